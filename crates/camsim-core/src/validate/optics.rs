//! Checks of `[camera.chromatic]`, `[camera.image_circle]` and `[camera.photometric.vignetting]`.

use super::{Check, check_coefficients};
use crate::{
    lens::largest_radius,
    scenario::{CameraSpec, ChromaticSpec, ImageCircleSpec, LensModel, Primary, VignettingSpec},
    vignetting::polynomial,
};

/// Scales of red and blue beyond this, or below its inverse, are typing errors.
const MOST_SCALE: f64 = 1.25;
/// Positions between axis and corner at which a polynomial is checked.
const RADII: u32 = 64;

pub(super) fn check_optics(check: &mut Check, camera: &CameraSpec) {
    if let Some(chromatic) = &camera.chromatic {
        for primary in [Primary::Red, Primary::Blue] {
            check_scale(check, camera, chromatic, primary);
            check_lens(check, camera, chromatic, primary);
        }
    }
    if let Some(circle) = &camera.image_circle {
        check_circle(check, circle);
    }
    if let Some(vignetting) = &camera.photometric.vignetting {
        check_vignetting(check, camera, vignetting);
    }
}

/// The paper's methods have one lens for all light, and a map.
pub(super) fn check_paper(check: &mut Check, camera: &CameraSpec) {
    for (present, key) in [
        (camera.chromatic.is_some(), "camera.chromatic"),
        (camera.image_circle.is_some(), "camera.image_circle"),
        (camera.photometric.vignetting.is_some(), "camera.photometric.vignetting"),
    ] {
        check.require(!present, key, || {
            "cannot be combined with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into()
        });
    }
}

/// Distance of the farthest corner from the principal point, pixels.
fn corner_px(camera: &CameraSpec) -> f64 {
    let [width, height] = camera.size_px.map(f64::from);
    let [cx, cy] = camera.principal_point_px.unwrap_or([0.5 * (width - 1.0), 0.5 * (height - 1.0)]);
    let farther = |centre: f64, size: f64| (centre + 0.5).max(size - 0.5 - centre);
    farther(cx, width).hypot(farther(cy, height))
}

fn check_scale(check: &mut Check, camera: &CameraSpec, chromatic: &ChromaticSpec, primary: Primary) {
    let key = format!("camera.chromatic.{}_scale", primary.name());
    let given = match primary {
        Primary::Blue => &chromatic.blue_scale,
        _ => &chromatic.red_scale,
    };
    check.require(given.len() <= 3, &key, || {
        format!("has {} values where at most 3 fit: v, c, b of the factor v + c r + b r^2", given.len())
    });
    check.require(given.is_empty() || chromatic.lens(primary).is_none(), &key, || {
        format!("cannot be combined with camera.chromatic.{}; leave one of them out", primary.name())
    });
    let Some(terms @ [v, c, b]) =
        chromatic.scale(primary).filter(|terms| terms.iter().all(|k| k.is_finite()))
    else {
        return;
    };
    let half_short_px = 0.5 * f64::from(camera.size_px[0].min(camera.size_px[1]));
    let most = corner_px(camera) / half_short_px;
    let is_near = |r: f64| {
        let factor = v + c * r + b * r * r;
        (1.0 / MOST_SCALE..=MOST_SCALE).contains(&factor)
    };
    check.require((0..=RADII).all(|i| is_near(most * f64::from(i) / f64::from(RADII))), &key, || {
        format!(
            "is the factor v + c r + b r^2 on the distance from the principal point, near 1 all over the picture (r = 0 \
             to {most:.2}), not {given:?}; [1.0005] makes this colour's image larger by 0.05 %"
        )
    });
    check.require(v <= 0.0 || largest_radius(terms) > most, &key, || {
        format!("folds the picture at r = {:.3} of {most:.3}; check the order v, c, b", largest_radius(terms))
    });
}

fn check_lens(check: &mut Check, camera: &CameraSpec, chromatic: &ChromaticSpec, primary: Primary) {
    let Some(lens) = chromatic.lens(primary) else { return };
    let key = format!("camera.chromatic.{}", primary.name());
    let own = camera.of_primary(primary);
    check_coefficients(
        check,
        &format!("{key}.coefficients"),
        own.lens.model,
        own.focal_px,
        &own.lens.coefficients,
    );
    check.require(lens.model != Some(LensModel::Table), format!("{key}.model"), || {
        format!(
            "cannot be \"table\"; give camera.chromatic.{}_scale beside the camera's table",
            primary.name()
        )
    });
    check.require(camera.zoom.is_empty(), &key, || {
        format!("cannot be combined with camera.zoom; give camera.chromatic.{}_scale", primary.name())
    });
    let is_empty =
        lens.focal_px.is_none() && lens.principal_point_px.is_none() && lens.coefficients.is_none();
    check.require(!is_empty || lens.model.is_some(), &key, || {
        "has no key of its own; give coefficients, focal_px or principal_point_px, or leave it out".into()
    });
}

fn check_circle(check: &mut Check, circle: &ImageCircleSpec) {
    check.require(
        circle.radius_px.is_some() || circle.half_angle_deg.is_some(),
        "camera.image_circle",
        || "needs radius_px or half_angle_deg; give one of them, or leave the table out".into(),
    );
    let has_circle = circle.centre_px.is_none() || circle.radius_px.is_some();
    check.require(has_circle, "camera.image_circle.centre_px", || {
        "goes with radius_px; half_angle_deg is about the optical axis".into()
    });
}

fn check_vignetting(check: &mut Check, camera: &CameraSpec, spec: &VignettingSpec) {
    let key = |leaf: &str| format!("camera.photometric.vignetting.{leaf}");
    check.require(camera.zoom.is_empty() || spec.cos_power == 0.0, key("cos_power"), || {
        "cannot be combined with camera.zoom, where the angle of a pixel changes; give a polynomial".into()
    });
    let [width, height] = camera.size_px.map(f64::from);
    let most = corner_px(camera) / (0.5 * width.hypot(height));
    let polynomials = [
        ("polynomial", Some(&spec.polynomial)),
        ("polynomial_red", spec.polynomial_red.as_ref()),
        ("polynomial_blue", spec.polynomial_blue.as_ref()),
    ];
    for (leaf, terms) in polynomials.into_iter().filter_map(|(leaf, terms)| Some((leaf, terms?))) {
        check.require(terms.len() <= 3, key(leaf), || {
            format!(
                "has {} values where at most 3 fit: k1, k2, k3 of 1 + k1 r^2 + k2 r^4 + k3 r^6",
                terms.len()
            )
        });
        let radii = (0..=RADII).map(|i| most * f64::from(i) / f64::from(RADII));
        let dark = radii.into_iter().find(|r| polynomial(terms, r * r) < 0.0);
        check.require(dark.is_none(), key(leaf), || {
            format!(
                "makes 1 + k1 r^2 + k2 r^4 + k3 r^6 negative at r = {:.2}; r is 1 at half the picture's diagonal, and \
                 falling light has k1 below 0",
                dark.unwrap_or_default()
            )
        });
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        scenario::{
            CameraSpec, ChromaticSpec, ImageCircleSpec, LensModel, PrimaryLensSpec, Scenario, VignettingSpec,
            ZoomSpec,
        },
        validate::{tests::good, validate},
    };

    fn chromatic(camera: &mut CameraSpec) -> &mut ChromaticSpec {
        camera.chromatic.get_or_insert_default()
    }

    fn vignetting(camera: &mut CameraSpec) -> &mut VignettingSpec {
        camera.photometric.vignetting.get_or_insert_default()
    }

    fn circle(camera: &mut CameraSpec) -> &mut ImageCircleSpec {
        camera.image_circle.get_or_insert_default()
    }

    fn zoom(scenario: &mut Scenario) {
        let entry =
            ZoomSpec { at: 1.0, focal_px: [500.0; 2], principal_point_px: None, coefficients: Vec::new() };
        scenario.camera.zoom.push(entry);
    }

    #[test]
    fn useful_values_pass() {
        let mut scenario = good();
        chromatic(&mut scenario.camera).red_scale = vec![1.0004, -0.0002, 0.0003];
        chromatic(&mut scenario.camera).blue =
            Some(PrimaryLensSpec { focal_px: Some([499.0; 2]), ..PrimaryLensSpec::default() });
        *vignetting(&mut scenario.camera) =
            VignettingSpec { cos_power: 4.0, polynomial: vec![-0.3, 0.1], ..VignettingSpec::default() };
        circle(&mut scenario.camera).half_angle_deg = Some(92.5);
        assert_eq!(validate(&scenario), Vec::new());
    }

    #[test]
    fn each_fault_names_its_key() {
        type Edit = fn(&mut Scenario);
        let faults: [(&str, Edit); 15] = [
            ("chromatic.red_scale", |s| chromatic(&mut s.camera).red_scale = vec![0.0004]),
            ("chromatic.blue_scale", |s| chromatic(&mut s.camera).blue_scale = vec![1.0, 0.0, 0.0, 0.0]),
            ("chromatic.blue_scale", |s| chromatic(&mut s.camera).blue_scale = vec![f64::NAN]),
            ("chromatic.red_scale", |s| {
                chromatic(&mut s.camera).red_scale = vec![1.0];
                chromatic(&mut s.camera).red =
                    Some(PrimaryLensSpec { focal_px: Some([1.0; 2]), ..PrimaryLensSpec::default() });
            }),
            ("chromatic.red", |s| chromatic(&mut s.camera).red = Some(PrimaryLensSpec::default())),
            ("chromatic.red.coefficients", |s| {
                chromatic(&mut s.camera).red =
                    Some(PrimaryLensSpec { coefficients: Some(vec![0.1]), ..PrimaryLensSpec::default() });
            }),
            ("chromatic.blue.model", |s| {
                let lens = PrimaryLensSpec { model: Some(LensModel::Table), ..PrimaryLensSpec::default() };
                chromatic(&mut s.camera).blue = Some(lens);
            }),
            ("chromatic.blue", |s| {
                zoom(s);
                chromatic(&mut s.camera).blue =
                    Some(PrimaryLensSpec { focal_px: Some([1.0; 2]), ..PrimaryLensSpec::default() });
            }),
            ("image_circle", |s| *circle(&mut s.camera) = ImageCircleSpec::default()),
            ("image_circle.radius_px", |s| circle(&mut s.camera).radius_px = Some(0.0)),
            ("image_circle.half_angle_deg", |s| circle(&mut s.camera).half_angle_deg = Some(181.0)),
            ("image_circle.centre_px", |s| {
                circle(&mut s.camera).half_angle_deg = Some(90.0);
                circle(&mut s.camera).centre_px = Some([1.0, 1.0]);
            }),
            ("photometric.vignetting.polynomial_red", |s| {
                vignetting(&mut s.camera).polynomial_red = Some(vec![-1.2]);
            }),
            ("photometric.vignetting.polynomial", |s| vignetting(&mut s.camera).polynomial = vec![0.0; 4]),
            ("photometric.vignetting.cos_power", |s| {
                zoom(s);
                vignetting(&mut s.camera).cos_power = 4.0;
            }),
        ];
        for (key, edit) in faults {
            let mut scenario = good();
            scenario.camera.lens = Default::default();
            edit(&mut scenario);
            let problems = validate(&scenario);
            let keys: Vec<&str> = problems.iter().map(|problem| problem.key.as_str()).collect();
            assert_eq!(keys, [format!("camera.{key}")], "{problems:?}");
        }
    }
}
