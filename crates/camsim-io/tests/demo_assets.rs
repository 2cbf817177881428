//! The files in `assets/` are readable and consistent: the flight is over its terrain.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fs, path::PathBuf};

use camsim_core::scenario::{CameraSpec, HeightReference, Scenario};
use tiff::{
    decoder::{Decoder, DecodingResult, Limits},
    tags::Tag,
};

fn asset(name: impl AsRef<std::path::Path>) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(name)
}

/// A scenario with `camera = "file"` replaced by that file's table, as the loader does it.
fn scenario(name: &str) -> Scenario {
    let mut table: toml::Table = fs::read_to_string(asset(name)).unwrap().parse().unwrap();
    if let Some(file) = table.get("camera").and_then(|camera| camera.as_str()) {
        let camera: toml::Table = fs::read_to_string(asset(file)).unwrap().parse().unwrap();
        table.insert("camera".into(), camera.into());
    }
    table.try_into().unwrap()
}

#[test]
fn files_of_the_scenarios_exist() {
    for name in ["demo.toml", "pattern.toml"] {
        let scenario = scenario(name);
        let log_datum = scenario.log_datum();
        let mut files = vec![scenario.flight.log];
        files.extend(scenario.camera.photometric.vignette);
        files.extend(scenario.scene.pattern.map(|pattern| pattern.image));
        if let Some(terrain) = scenario.scene.terrain {
            // With equal height references the demo needs no geoid.
            assert_eq!((log_datum, terrain.height), (HeightReference::Msl, HeightReference::Msl));
            files.extend(terrain.dem.paths().iter().cloned());
            files.extend(terrain.ortho.iter().flat_map(|ortho| ortho.paths().to_vec()));
        }
        for file in files {
            assert!(asset(&file).is_file(), "{name} names {}", file.display());
        }
    }
    let camera: CameraSpec = toml::from_str(&fs::read_to_string(asset("demo_camera.toml")).unwrap()).unwrap();
    assert_eq!(scenario("demo.toml").camera, camera);
}

#[test]
fn flight_stays_over_its_terrain() {
    let mut dem =
        Decoder::new(fs::File::open(asset("demo_dem.tif")).unwrap()).unwrap().with_limits(Limits::default());
    let (cols, rows) = dem.dimensions().unwrap();
    let scale = dem.get_tag_f64_vec(Tag::ModelPixelScaleTag).unwrap();
    let tie = dem.get_tag_f64_vec(Tag::ModelTiepointTag).unwrap();
    let DecodingResult::F32(heights_m) = dem.read_image().unwrap() else { panic!("demo_dem.tif is float32") };
    assert_eq!((cols, rows), (1007, 633));
    let (low_m, high_m) =
        heights_m.iter().fold((f32::MAX, f32::MIN), |(low, high), &h| (low.min(h), high.max(h)));
    assert_eq!((low_m, high_m), (2543.0, 3946.25));

    let window_s = scenario("demo.toml").flight.window_s.unwrap();
    let log = fs::read_to_string(asset("demo_flight.csv")).unwrap();
    let mut lines = log.lines();
    assert_eq!(lines.next(), Some("t_s,lat_deg,lon_deg,height_m,roll_deg,pitch_deg,yaw_deg"));
    let mut last_s = -1.0;
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let [t_s, lat_deg, lon_deg, height_m, ..] = row[..] else { panic!("seven columns: {line}") };
        let row = ((tie[4] - lat_deg) / scale[1]).floor();
        let col = ((lon_deg - tie[3]) / scale[0]).floor();
        // 500 m from the border, so that the terrain's edge is not in the picture.
        assert!(
            (50.0..f64::from(rows) - 50.0).contains(&row) && (62.0..f64::from(cols) - 62.0).contains(&col),
            "{line}"
        );
        let above_m = height_m - f64::from(heights_m[row as usize * cols as usize + col as usize]);
        assert!((300.0..900.0).contains(&above_m), "{above_m} m above ground: {line}");
        assert!((t_s - last_s) > 0.0);
        last_s = t_s;
    }
    assert!(window_s[0] >= 0.0 && window_s[1] <= last_s);
}
