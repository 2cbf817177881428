#![allow(clippy::unwrap_used)]

use std::mem::{offset_of, size_of};

use super::*;

fn parsed(model: LensModel, start: Start) -> naga::Module {
    let source = shader_source(model, start);
    naga::front::wgsl::parse_str(&source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)))
}

#[test]
fn all_variants_are_valid_without_optional_capabilities() {
    for (model, start) in VARIANTS {
        let module = parsed(model, start);
        let mut validator = naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
        );
        validator.validate(&module).unwrap_or_else(|error| panic!("{model:?} {start:?}: {error:?}"));
    }
}

#[test]
fn uniform_layout_equals_that_of_the_shader() {
    let module = parsed(LensModel::BrownConrady, Start::Cold);
    let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("LensUniform")).unwrap();
    let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("LensUniform is not a struct") };
    let offsets: Vec<_> =
        members.iter().map(|member| (member.name.as_deref().unwrap(), member.offset as usize)).collect();
    let mirror = [
        ("size_px", offset_of!(LensUniform, size_px)),
        ("focal_px", offset_of!(LensUniform, focal_px)),
        ("principal_point_whole_px", offset_of!(LensUniform, principal_point_whole_px)),
        ("principal_point_fraction_px", offset_of!(LensUniform, principal_point_fraction_px)),
        ("radial", offset_of!(LensUniform, radial)),
        ("rational", offset_of!(LensUniform, rational)),
        ("tangential", offset_of!(LensUniform, tangential)),
        ("distorted_max", offset_of!(LensUniform, distorted_max)),
        ("table_distorted_max", offset_of!(LensUniform, table_distorted_max)),
        ("theta_max", offset_of!(LensUniform, theta_max)),
        ("fold_min", offset_of!(LensUniform, fold_min)),
    ];
    assert_eq!(offsets, mirror);
    assert_eq!(*span as usize, size_of::<LensUniform>());
}

#[test]
fn shader_constants_equal_those_of_camsim_core() {
    let source = shader_source(LensModel::BrownConrady, Start::Cold);
    assert!(source.contains(&format!("const FOLD_RAYS: u32 = {}u;", camsim_core::lens::FOLD_RAYS)));
    assert!(
        source.contains(&format!("const RADIAL_TABLE_LEN: u32 = {}u;", camsim_core::lens::RADIAL_TABLE_LEN))
    );
    assert!(source.contains(&format!("const INVALID_UV: f32 = {INVALID_UV:e};")));
}
