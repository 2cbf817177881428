#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::{
    camera::CameraModel,
    lens::{Lens, LensModel},
};
use glam::DVec2;

use super::*;

/// Made up, in the schema of lensfun-database.dtd.
const DATABASE: &str = r#"<!DOCTYPE lensdatabase SYSTEM "lensfun-database.dtd">
<lensdatabase version="2">
    <camera><maker>Example</maker><model>Body</model><mount>E</mount><cropfactor>1.534</cropfactor></camera>
    <lens>
        <maker>Example</maker>
        <model>Zoom 20-80mm f/4</model>
        <model lang="de">Zoom 20-80mm</model>
        <mount>E</mount>
        <cropfactor>1.534</cropfactor>
        <calibration>
            <distortion model="ptlens" focal="20" a="0.012" b="-0.045" c="0.021"/>
            <distortion model="ptlens" focal="35" a="0.004" b="-0.011" c="0.006"/>
            <distortion model="ptlens" focal="50" real-focal="49.2" a="-0.001" b="0.002" c="0.003"/>
            <distortion model="ptlens" focal="80" a="0" b="0.006" c="0.001"/>
            <tca model="linear" focal="20" kr="1.0003" kb="0.9998"/>
            <tca model="poly3" focal="40" vr="1.0007" cr="0.0002" br="-0.0004" vb="0.9996"/>
            <vignetting model="pa" focal="20" aperture="4" distance="10" k1="-0.3" k2="0.1" k3="0"/>
            <vignetting model="pa" focal="20" aperture="4" distance="1000" k1="-0.32" k2="0.11" k3="-0.02"/>
            <vignetting model="pa" focal="20" aperture="8" distance="1000" k1="-0.2" k2="0.05" k3="0.01"/>
            <vignetting model="pa" focal="80" aperture="4" distance="1000" k1="-0.5" k2="0.2" k3="-0.07"/>
        </calibration>
    </lens>
    <lens>
        <maker>Example</maker>
        <model>Prime 35mm</model>
        <mount>E</mount>
        <cropfactor>1</cropfactor>
        <aspect-ratio>4:3</aspect-ratio>
        <calibration><distortion model="poly3" focal="35" k1="-0.021"/></calibration>
    </lens>
    <lens>
        <maker>Example</maker>
        <model>Prime 24mm</model>
        <mount>E</mount>
        <cropfactor>1.6</cropfactor>
        <calibration><distortion model="poly5" focal="24" k1="-0.03" k2="0.004"/></calibration>
    </lens>
    <lens>
        <maker>Example</maker>
        <model>Fisheye 8mm</model>
        <mount>E</mount>
        <type>fisheye</type>
        <cropfactor>1.5</cropfactor>
        <calibration><distortion model="ptlens" focal="8" a="0.01" b="-0.03" c="0.02"/></calibration>
    </lens>
    <lens>
        <maker>Example</maker><model>Ball 10mm</model><mount>E</mount><type>stereographic</type>
        <cropfactor>1.5</cropfactor>
        <calibration><distortion model="poly3" focal="10" k1="0.01"/></calibration>
    </lens>
</lensdatabase>
"#;

fn import(lens: &str, focal_mm: f64, crop: Option<f64>) -> Result<LensfunCamera, String> {
    import_at(lens, focal_mm, crop, None, 1000.0)
}

fn import_at(
    lens: &str,
    focal_mm: f64,
    crop: Option<f64>,
    aperture: Option<f64>,
    distance_m: f64,
) -> Result<LensfunCamera, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lenses.xml");
    std::fs::write(&path, DATABASE).unwrap();
    let query = LensfunQuery { lens, focal_mm, size_px: [6000, 4000], crop, aperture, distance_m };
    import_lensfun(&path, &query).map_err(|error| error.to_string())
}

/// Largest difference in pixels from lensfun's own formula, in its own units: half the short side of the
/// calibration's sensor. `undistorted` is that radius of an angle off axis for the nominal focal length.
fn difference_px(
    camera: &LensfunCamera,
    half_short_mm: f64,
    pitch_mm: f64,
    nominal_mm: f64,
    formula: impl Fn(f64) -> f64,
    undistorted: impl Fn(f64) -> f64,
) -> f64 {
    let model = CameraModel::from_spec(&camera.spec).unwrap();
    let centre = DVec2::from_array(camera.spec.principal_point_px.unwrap());
    let corner_mm = pitch_mm * 3000f64.hypot(2000.0);
    let mut worst: f64 = 0.0;
    for i in 1..500 {
        let angle = 1.2 * f64::from(i) / 500.0;
        let image_mm = half_short_mm * formula(undistorted(angle) * nominal_mm / half_short_mm);
        if image_mm > corner_mm {
            break;
        }
        let found =
            model.lens.image(glam::DVec3::new(angle.sin(), 0.0, angle.cos())) * camera.spec.focal_px[0];
        worst = worst.max((found.x - image_mm / pitch_mm).abs()).max(found.y.abs());
    }
    assert!(centre == DVec2::new(2999.5, 1999.5));
    worst
}

fn half_short_mm(crop: f64, aspect: f64) -> f64 {
    (36f64 * 36.0 + 24.0 * 24.0).sqrt() / crop / (aspect * aspect + 1.0).sqrt() / 2.0
}

fn pitch_mm(crop: f64) -> f64 {
    (36f64 * 36.0 + 24.0 * 24.0).sqrt() / crop / (6000f64 * 6000.0 + 4000.0 * 4000.0).sqrt()
}

#[test]
fn polynomials_are_lensfuns() {
    // On a smaller sensor than that of the calibration, with another aspect ratio.
    let camera = import("Prime 35mm", 35.0, Some(1.5)).unwrap();
    assert_eq!(camera.spec.lens.model, LensModel::BrownConrady);
    let poly3 = |r: f64| r * (1.0 + 0.021 - 0.021 * r * r);
    let error = difference_px(&camera, half_short_mm(1.0, 4.0 / 3.0), pitch_mm(1.5), 35.0, poly3, f64::tan);
    assert!(error < 1e-8, "{error}");

    let camera = import("prime 24mm", 24.0, None).unwrap();
    let poly5 = |r: f64| r * (1.0 - 0.03 * r * r + 0.004 * r.powi(4));
    let error = difference_px(&camera, half_short_mm(1.6, 1.5), pitch_mm(1.6), 24.0, poly5, f64::tan);
    assert!(error < 1e-8, "{error}");

    let ptlens =
        |[a, b, c]: [f64; 3]| move |r: f64| r * (a * r.powi(3) + b * r * r + c * r + 1.0 - a - b - c);
    // The angle of an equidistant fisheye: exact as f-theta.
    let camera = import("Fisheye", 8.0, None).unwrap();
    assert_eq!(camera.spec.lens.model, LensModel::FTheta);
    let formula = ptlens([0.01, -0.03, 0.02]);
    let error = difference_px(&camera, half_short_mm(1.5, 1.5), pitch_mm(1.5), 8.0, formula, |angle| angle);
    assert!(error < 1e-8, "{error}");

    // Fitted: the note states the error.
    let camera = import("Zoom 20-80mm f/4", 20.0, None).unwrap();
    let formula = ptlens([0.012, -0.045, 0.021]);
    let error = difference_px(&camera, half_short_mm(1.534, 1.5), pitch_mm(1.534), 20.0, formula, f64::tan);
    let note = camera.notes.iter().find(|note| note.contains("fitted")).unwrap();
    let stated: f64 = note.split_whitespace().rev().nth(1).unwrap().parse().unwrap();
    // numpy's least squares for the same rational function: 0.282 px.
    assert!(error <= 1.1 * stated && (stated - 0.282).abs() < 0.02, "{error} {note}");
    let wanted = "not applied: vignetting, which depends on the aperture: add --aperture N (calibrated from f/4 to f/8)";
    assert!(camera.notes.iter().any(|note| note == wanted), "{:?}", camera.notes);
}

#[test]
fn colors_are_scaled_as_lensfun_has_it() {
    let scales = |focal_mm: f64, crop: Option<f64>| {
        let chromatic = import("Zoom 20-80mm f/4", focal_mm, crop).unwrap().spec.chromatic.unwrap();
        [chromatic.red_scale, chromatic.blue_scale]
    };
    // The pictures have the calibration's sensor and aspect: r is the same.
    assert_eq!(scales(20.0, None), [vec![1.0003], vec![0.9998]]);
    let close = |got: &[f64], wanted: &[f64]| {
        got.len() == wanted.len() && got.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12)
    };
    let between = scales(30.0, None);
    assert!(close(&between[0], &[1.0005, 0.0001, -0.0002]) && close(&between[1], &[0.9997]), "{between:?}");
    // Half of that sensor's size: r of the calibration is half of the picture's.
    let smaller = scales(60.0, Some(2.0 * 1.534));
    assert!(close(&smaller[0], &[1.0007, 0.0001, -0.0001]), "{smaller:?}");
    assert!(import("Prime 35mm", 35.0, None).unwrap().spec.chromatic.is_none());
}

#[test]
fn vignetting_is_lensfuns() {
    // What lensfun 0.3.4 (lensfunpy 1.18, Modifier.apply_color_modification) divides a picture of 601 x 401 by,
    // at pixels (0, 0), (100, 50), (300, 0), (600, 200), whose centres it counts from the middle one's.
    let positions = [(300.0, 200.0), (200.0, 150.0), (0.0, 200.0), (300.0, 0.0)];
    let golden: [(f64, f64, f64, f64, [f64; 4]); 6] = [
        (20.0, 4.0, 10.0, 1.534, [0.799_999_95, 0.878_883_00, 0.917_159_02, 0.840_235_77]),
        (20.0, 4.0, 1000.0, 1.534, [0.769_999_98, 0.869_356_45, 0.911_369_26, 0.824_546_05]),
        (30.0, 5.6, 50.0, 1.534, [0.820_924_52, 0.894_520_34, 0.928_335_85, 0.859_507_38]),
        (30.0, 5.6, 50.0, 3.068, [0.940_645_69, 0.970_242_74, 0.980_694_29, 0.957_866_31]),
        (65.0, 4.5, 1000.0, 1.534, [0.642_262_70, 0.804_181_75, 0.867_180_11, 0.734_947_74]),
        (20.0, 22.0, 1000.0, 1.534, [0.853_332_88, 0.912_824_93, 0.940_951_41, 0.883_877_64]),
    ];
    for (focal_mm, aperture, distance_m, crop, expected) in golden {
        let camera = import_at("Zoom 20-80mm f/4", focal_mm, Some(crop), Some(aperture), distance_m).unwrap();
        let found = camera.spec.photometric.vignetting.unwrap();
        for ((x, y), expected) in positions.into_iter().zip(expected) {
            let r2 = (x * x + y * y) / (300.0 * 300.0 + 200.0 * 200.0_f64);
            let terms = found.polynomial.iter().rev();
            let weight = 1.0 + r2 * terms.fold(0.0, |sum, k| sum * r2 + k);
            // Single precision there.
            assert!((weight - expected).abs() < 2e-6, "{focal_mm} mm f/{aperture}: {weight} {expected}");
        }
        assert!(!camera.notes.iter().any(|note| note.contains("vignetting")), "{:?}", camera.notes);
    }
    // A focus as near as 5 cm is far from all, as for lensfun; a lens without vignetting needs no aperture.
    let camera = import_at("Zoom 20-80mm f/4", 20.0, None, Some(5.0), 0.05).unwrap();
    let wanted = "not applied: vignetting, none of whose calibrations is near 20 mm at f/5";
    assert!(camera.spec.photometric.vignetting.is_none());
    assert!(camera.notes.iter().any(|note| note.starts_with(wanted)), "{:?}", camera.notes);
    assert!(import("Prime 35mm", 35.0, None).unwrap().notes.iter().all(|note| !note.contains("vignetting")));
    assert!(import_at("Prime 35mm", 35.0, None, Some(0.0), 10.0).unwrap_err().contains("positive numbers"));
}

#[test]
fn focal_lengths_between_are_lensfuns() {
    // lensfun's Hermite interpolation of terms times focal length, written out for 42 mm.
    let y = [0.012 * 20.0, 0.004 * 35.0, -0.001 * 50.0, 0.0];
    let t: f64 = 7.0 / 15.0;
    let (m2, m3) = (0.5 * (y[2] - y[0]), 0.5 * (y[3] - y[1]));
    let h = [
        2.0 * t.powi(3) - 3.0 * t * t + 1.0,
        t.powi(3) - 2.0 * t * t + t,
        -2.0 * t.powi(3) + 3.0 * t * t,
        t.powi(3) - t * t,
    ];
    let wanted = (h[0] * y[1] + h[1] * m2 + h[2] * y[2] + h[3] * m3) / 42.0;
    let tree = roxmltree::Document::parse_with_options(
        DATABASE,
        roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() },
    )
    .unwrap();
    let all = find_lens(&tree, "Zoom 20-80mm f/4").unwrap();
    let (entry, is_beyond) = at_focal(&all[0].entries, 42.0);
    assert!((entry.terms[0] - wanted).abs() < 1e-15 && !is_beyond, "{entry:?} {wanted}");
    assert_eq!(at_focal(&all[0].entries, 50.0), (all[0].entries[2], false));
    assert_eq!(at_focal(&all[0].entries, 50.0).0.real_focal_mm, 49.2);
    // Beyond the ends the nearest, with a note.
    assert_eq!(at_focal(&all[0].entries, 90.0), (all[0].entries[3], true));
    assert_eq!(at_focal(&all[0].entries, 10.0), (all[0].entries[0], true));
    assert!(import("Zoom 20-80mm", 90.0, None).unwrap().notes[0].contains("80 mm is taken"));
}

#[test]
fn lenses_that_do_not_fit_are_refused() {
    for (lens, crop, wanted) in [
        ("Prime", None, "2 lenses match"),
        ("Nothing", None, "no lens of this file"),
        ("Prime 24mm", Some(1.0), "larger sensor"),
        ("Ball 10mm", None, "`stereographic`"),
    ] {
        let error = import(lens, 20.0, crop).unwrap_err();
        assert!(error.contains(wanted), "{lens}: {error}");
    }
    assert!(import("Prime 24mm", f64::NAN, None).is_err());
    assert!(Lens::new(LensModel::FTheta, &[1.0]).is_ok());
}
