//! Messages of `camsim apply` about optical flow.

#![allow(clippy::unwrap_used)]

use std::{ffi::OsString, fs, path::Path};

fn camsim<S: Into<OsString>>(args: impl IntoIterator<Item = S>) -> (u8, String) {
    let mut err = Vec::new();
    let args = std::iter::once(OsString::from("camsim")).chain(args.into_iter().map(Into::into));
    let code = camsim_cli::run(args, &mut Vec::new(), &mut err);
    (code, String::from_utf8(err).unwrap())
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn unknown_flow_and_extrapolation_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let (camera, frame, out) = (file("CAMERA.toml"), file("FRAME.toml"), file("out.exr"));
    fs::write(&camera, "size_px = [20, 10]\nfocal_px = [30.0, 30.0]\n[shutter]\nreadout_ms = 16.0\n")
        .unwrap();
    fs::write(file("c.ppm"), [b"P6\n40 20\n255\n".to_vec(), vec![99; 3 * 40 * 20]].concat()).unwrap();
    // Every fourth pixel is unknown.
    let flow = (0..40 * 20).flat_map(|i| if i % 4 == 0 { [2e9_f32, 0.0] } else { [0.0, 0.0] });
    let head = [202_021.25_f32.to_le_bytes(), 40_u32.to_le_bytes(), 20_u32.to_le_bytes()].concat();
    fs::write(file("f.flo"), head.into_iter().chain(flow.flat_map(f32::to_le_bytes)).collect::<Vec<u8>>())
        .unwrap();
    let apply = |interval_ms: &str, more: &[&str]| {
        let text_of = format!(
            "color = \"c.ppm\"\nfocal_px = [30.0, 30.0]\n[motion]\nflow = \"f.flo\"\nflow_interval_ms = \
             {interval_ms}\n"
        );
        fs::write(&frame, text_of).unwrap();
        let (code, err) = camsim([&["apply", text(&camera), text(&frame), "-o", text(&out)], more].concat());
        assert_eq!(code, 0, "{err}");
        err
    };
    let err = apply("40", &[]);
    assert!(
        err.contains("25.00 % of the picture is empty (alpha 0): 25.00 % where the flow is unknown"),
        "{err}"
    );
    assert!(!err.contains("holes") && !err.contains("extrapolated"), "{err}");
    let err = apply("40", &["-v"]);
    assert!(
        err.contains("open from -0.18 to +0.18 of the flow's interval after the ideal image: outside of it"),
        "{err}"
    );
    let err = apply("-5", &[]);
    assert!(
        err.contains("FRAME.toml: the shutter is open from -1.44 to +1.44")
            && err.contains("by more than its own interval"),
        "{err}"
    );
}
