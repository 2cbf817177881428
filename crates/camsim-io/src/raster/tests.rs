//! Small generated files, and published terrains in CAMSIM_DATA.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fs, path::Path};

use camsim_core::{
    pose::CameraPose,
    scene::{TerrainDetail, linear_from_srgb},
};
use glam::DQuat;
use tiff::{
    encoder::{TiffEncoder, colortype},
    tags::Tag,
};

use super::{crs::Crs, *};

/// NED from geodetic on WGS-84: geodetic -> ECEF -> tangent plane.
fn ned_frame(origin_deg: [f64; 2], height_m: f64) -> impl Fn(f64, f64, f64) -> DVec3 + Sync {
    fn ecef(lat: f64, lon: f64, h: f64) -> DVec3 {
        let (a, f) = (6_378_137.0, 1.0 / 298.257_223_563);
        let e2: f64 = f * (2.0 - f);
        let n = a / (1.0 - e2 * lat.sin().powi(2)).sqrt();
        DVec3::new(
            (n + h) * lat.cos() * lon.cos(),
            (n + h) * lat.cos() * lon.sin(),
            (n * (1.0 - e2) + h) * lat.sin(),
        )
    }
    let [lat0, lon0] = origin_deg.map(f64::to_radians);
    let origin = ecef(lat0, lon0, height_m);
    let north = DVec3::new(-lat0.sin() * lon0.cos(), -lat0.sin() * lon0.sin(), lat0.cos());
    let east = DVec3::new(-lon0.sin(), lon0.cos(), 0.0);
    let down = -DVec3::new(lat0.cos() * lon0.cos(), lat0.cos() * lon0.sin(), lat0.sin());
    move |lat, lon, h| {
        let offset = ecef(lat, lon, h) - origin;
        DVec3::new(offset.dot(north), offset.dot(east), offset.dot(down))
    }
}

fn spec(dem: &Path, ortho: Option<&Path>) -> TerrainSpec {
    TerrainSpec { dem: dem.into(), ortho: ortho.map(Into::into), ..TerrainSpec::default() }
}

/// Tags of a small GeoTIFF.
struct Tags {
    scale: [f64; 3],
    tie: [f64; 6],
    epsg: Option<u16>,
    raster_type: u16,
    nodata: Option<&'static str>,
}

/// UTM 32N near 9 E, 45.1 N with 10 m pixels.
const UTM: Tags = Tags {
    scale: [10.0, 10.0, 0.0],
    tie: [0.0, 0.0, 0.0, 500_000.0, 5_000_000.0, 0.0],
    epsg: Some(32632),
    raster_type: 1,
    nodata: None,
};

fn write_dem(path: &Path, [width, height]: [u32; 2], heights: &[f32], tags: Option<&Tags>) {
    let mut encoder = TiffEncoder::new(fs::File::create(path).unwrap()).unwrap();
    let mut image = encoder.new_image::<colortype::Gray32Float>(width, height).unwrap();
    if let Some(tags) = tags {
        let directory = image.encoder();
        directory.write_tag(Tag::ModelPixelScaleTag, &tags.scale[..]).unwrap();
        directory.write_tag(Tag::ModelTiepointTag, &tags.tie[..]).unwrap();
        let mut keys = vec![1u16, 1, 0, 1, 1025, 0, 1, tags.raster_type];
        if let Some(epsg) = tags.epsg {
            keys[3] = 2;
            keys.extend([3072, 0, 1, epsg]);
        }
        directory.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
        if let Some(nodata) = tags.nodata {
            directory.write_tag(Tag::GdalNodata, nodata).unwrap();
        }
    }
    image.write_data(heights).unwrap();
}

/// NED position of the first vertex; the frame's origin is at model coordinates (500000, 5000000).
fn first_vertex(path: &Path) -> DVec3 {
    let [lat, lon] = Crs::new(32632).unwrap().geodetic_from_model([500_000.0, 5_000_000.0]).unwrap();
    let loaded =
        read_terrain(&spec(path, None), &ned_frame([lat.to_degrees(), lon.to_degrees()], 0.0), None).unwrap();
    loaded.terrain.position_ned_m(0, 0, 0)
}

#[test]
fn pixel_centres_follow_the_raster_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let heights = [7.0; 12];
    write_dem(&path, [4, 3], &heights, Some(&UTM));
    // Area: the tie point is the outer corner. UTM scale on the central meridian is 0.9996.
    assert!(
        (first_vertex(&path) - DVec3::new(-5.002, 5.002, -7.0)).length() < 2e-3,
        "{}",
        first_vertex(&path)
    );
    write_dem(&path, [4, 3], &heights, Some(&Tags { raster_type: 2, ..UTM }));
    assert!((first_vertex(&path) - DVec3::new(0.0, 0.0, -7.0)).length() < 2e-3, "{}", first_vertex(&path));
    // World files refer to centres.
    write_dem(&path, [4, 3], &heights, None);
    fs::write(folder.path().join("dem.tfw"), "10\n0\n0\n-10\n500000\n5000000\n").unwrap();
    let error = read_terrain(&spec(&path, None), &ned_frame([45.0, 9.0], 0.0), None).unwrap_err();
    assert!(error.to_string().contains("scene.terrain.epsg"), "{error}");
    let with_epsg = TerrainSpec { epsg: Some(32632), ..spec(&path, None) };
    let loaded = read_terrain(&with_epsg, &ned_frame([45.0, 9.0], 0.0), Some(&|_, _| 50.0)).unwrap();
    assert_eq!((loaded.summary.epsg, loaded.summary.height_range_m), (32632, [7.0, 7.0]));
    let shifted = loaded.terrain.position_ned_m(0, 0, 0);
    let plain =
        read_terrain(&with_epsg, &ned_frame([45.0, 9.0], 0.0), None).unwrap().terrain.position_ned_m(0, 0, 0);
    // 17 km from the frame's origin the vertical differs by a few milliradians.
    assert!((plain.z - shifted.z - 50.0).abs() < 1e-3 && (plain - shifted).truncate().length() < 0.5);
}

#[test]
fn raster_with_rows_from_the_south_is_reversed() {
    let folder = tempfile::tempdir().unwrap();
    let (up, down) = (folder.path().join("up.tif"), folder.path().join("down.tif"));
    let heights: Vec<f32> = (0..12).map(|n| n as f32).collect();
    let reversed: Vec<f32> = heights.chunks(4).rev().flatten().copied().collect();
    write_dem(&up, [4, 3], &heights, Some(&UTM));
    write_dem(
        &down,
        [4, 3],
        &reversed,
        Some(&Tags { scale: [10.0, -10.0, 0.0], tie: [0.0, 0.0, 0.0, 500_000.0, 4_999_970.0, 0.0], ..UTM }),
    );
    let ned = ned_frame([45.15, 9.0], 0.0);
    let [a, b] = [up, down].map(|path| read_terrain(&spec(&path, None), &ned, None).unwrap().terrain);
    for n in 0..12 {
        assert!((a.position_ned_m(0, n % 4, n / 4) - b.position_ned_m(0, n % 4, n / 4)).length() < 1e-6);
    }
    assert!(
        a.position_ned_m(0, 0, 0).x > a.position_ned_m(0, 0, 2).x
            && a.position_ned_m(0, 0, 0).y < a.position_ned_m(0, 3, 0).y
    );
}

#[test]
fn nodata_and_implausible_values_are_voids() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let mut heights = vec![5.0f32; 25];
    (heights[0], heights[1], heights[2], heights[3]) = (-9999.0, f32::NAN, 1e30, -3.402_823_5e38);
    write_dem(&path, [5, 5], &heights, Some(&UTM));
    let ned = ned_frame([45.15, 9.0], 0.0);
    let loaded = read_terrain(&spec(&path, None), &ned, None).unwrap();
    assert_eq!((loaded.summary.void_heights, loaded.terrain.void_cells), (4, 4));
    // A row without heights has no range.
    heights[..5].fill(f32::NAN);
    write_dem(&path, [5, 5], &heights, Some(&UTM));
    assert_eq!(read_terrain(&spec(&path, None), &ned, None).unwrap().summary.height_range_m, [5.0; 2]);
    // With a declared no-data value the common ones do not apply.
    heights.fill(0.0);
    heights[24] = 100.0;
    write_dem(&path, [5, 5], &heights, Some(&Tags { nodata: Some("100"), ..UTM }));
    assert_eq!(read_terrain(&spec(&path, None), &ned, None).unwrap().summary.void_heights, 1);
    heights.fill(f32::NAN);
    write_dem(&path, [5, 5], &heights, Some(&UTM));
    let error = read_terrain(&spec(&path, None), &ned, None).unwrap_err().to_string();
    assert!(error.contains("dem.tif: not one triangle"), "{error}");
}

#[test]
fn invalid_terrain_files_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let ned = ned_frame([45.15, 9.0], 0.0);
    let assert_error = |epsg: Option<u16>, text: &str| {
        let error =
            read_terrain(&TerrainSpec { epsg, ..spec(&path, None) }, &ned, None).unwrap_err().to_string();
        assert!(error.contains("dem.tif") && error.contains(text), "{error}");
    };
    assert_error(None, "cannot be read");
    fs::write(&path, "north,east").unwrap();
    assert_error(None, "is not a TIFF file");
    write_dem(&path, [1, 1], &[0.0], Some(&UTM));
    assert_error(None, "at least 2 x 2");
    write_dem(&path, [2, 2], &[0.0; 4], None);
    assert_error(None, "no georeference");
    assert_error(Some(32632), "no georeference");
    write_dem(&path, [2, 2], &[0.0; 4], Some(&Tags { epsg: Some(27573), ..UTM }));
    assert_error(None, "EPSG:27573 is not supported");
    write_dem(&path, [2, 2], &[0.0; 4], Some(&UTM));
    assert_error(Some(32633), "states EPSG:32632 but scene.terrain.epsg = 32633");
    write_dem(&path, [2, 2], &[0.0; 4], Some(&Tags { scale: [0.0; 3], ..UTM }));
    assert_error(None, "degenerate");
    write_dem(&path, [2, 2], &[0.0; 4], Some(&Tags { epsg: Some(4326), ..UTM }));
    assert_error(None, "outside of the domain");
}

#[test]
fn ortho_image_is_placed_by_its_georeference() {
    let folder = tempfile::tempdir().unwrap();
    let (dem, ortho) = (folder.path().join("dem.tif"), folder.path().join("ortho.png"));
    write_dem(&dem, [4, 3], &[1.0; 12], Some(&UTM));
    image::RgbImage::from_pixel(8, 6, image::Rgb([9, 8, 7])).save(&ortho).unwrap();
    let ned = ned_frame([45.15, 9.0], 0.0);
    // Without georeference the image covers the DEM's extent.
    let loaded = read_terrain(&spec(&dem, Some(&ortho)), &ned, None).unwrap();
    assert_eq!((loaded.terrain.vertices[0].uv, loaded.summary.outside_ortho), ([0.125, 1.0 / 6.0], 0));
    let is_stretched =
        |notes: &[String]| notes.iter().any(|note| note.contains("times as wide for its height"));
    assert!(!is_stretched(&loaded.notes), "{:?}", loaded.notes);
    let square = folder.path().join("square.png");
    image::RgbImage::from_pixel(8, 8, image::Rgb([9, 8, 7])).save(&square).unwrap();
    let notes = read_terrain(&spec(&dem, Some(&square)), &ned, None).unwrap().notes;
    assert!(is_stretched(&notes) && notes.iter().any(|note| note.contains("1.33 times")), "{notes:?}");
    // 5 m pixels from 10 m further west and north.
    fs::write(folder.path().join("ortho.pgw"), "5 0 0 -5 499992.5 5000007.5").unwrap();
    let with_edge = TerrainSpec { beyond: Beyond::Edge, ..spec(&dem, Some(&ortho)) };
    let loaded = read_terrain(&with_edge, &ned, None).unwrap();
    assert_eq!(loaded.terrain.vertices[0].uv, [15.0 / 40.0, 0.5]);
    assert_eq!(loaded.summary.outside_ortho, 6);
    fs::write(folder.path().join("ortho.pgw"), "5 0 0 -5 599992.5 5000007.5").unwrap();
    let error = read_terrain(&spec(&dem, Some(&ortho)), &ned, None).unwrap_err().to_string();
    assert!(error.contains("ortho.png: does not overlap"), "{error}");
}

#[test]
fn ortho_image_can_have_another_coordinate_system() {
    let folder = tempfile::tempdir().unwrap();
    let (dem, ortho) = (folder.path().join("dem.tif"), folder.path().join("ortho.tif"));
    write_dem(&dem, [4, 3], &[1.0; 12], Some(&UTM));
    // Web Mercator with 100 m pixels at the same location.
    let [lat, lon] = Crs::new(32632).unwrap().geodetic_from_model([500_005.0, 4_999_995.0]).unwrap();
    let [x, y] = Crs::new(3857).unwrap().model_from_geodetic([lat, lon]).unwrap();
    let mut encoder = TiffEncoder::new(fs::File::create(&ortho).unwrap()).unwrap();
    let mut image = encoder.new_image::<colortype::RGB8>(10, 10).unwrap();
    image.encoder().write_tag(Tag::ModelPixelScaleTag, &[100.0, 100.0, 0.0][..]).unwrap();
    image
        .encoder()
        .write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, x - 250.0, y + 750.0, 0.0][..])
        .unwrap();
    image.encoder().write_tag(Tag::GeoKeyDirectoryTag, &[1u16, 1, 0, 1, 3072, 0, 1, 3857][..]).unwrap();
    image.write_data(&[50; 300]).unwrap();
    let loaded = read_terrain(&spec(&dem, Some(&ortho)), &ned_frame([45.15, 9.0], 0.0), None).unwrap();
    let [u, v] = loaded.terrain.vertices[0].uv;
    assert!((u - 0.25).abs() < 1e-6 && (v - 0.75).abs() < 1e-6, "{u} {v}");
}

#[test]
fn damaged_files_do_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let ned = ned_frame([45.15, 9.0], 0.0);
    write_dem(&path, [6, 5], &[3.0; 30], Some(&UTM));
    let whole = fs::read(&path).unwrap();
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        if let Err(error) = read_terrain(&spec(&path, None), &ned, None) {
            assert!(error.to_string().contains("dem.tif"), "{error}");
        } else {
            // Only padding at the end may be missing.
            assert!(length + 4 > whole.len(), "{length} of {}", whole.len());
        }
    }
    for index in 0..whole.len() {
        for value in [0, 1, 0x7f, 0xff] {
            let mut bytes = whole.clone();
            bytes[index] = value;
            fs::write(&path, &bytes).unwrap();
            let _ = read_terrain(&spec(&path, None), &ned, None);
        }
    }
}

fn data() -> Option<PathBuf> {
    let data = std::env::var_os("CAMSIM_DATA").map(PathBuf::from);
    if data.is_none() {
        eprintln!("CAMSIM_DATA is not set: published terrains are not tested");
    }
    data
}

#[test]
fn sertig_is_georeferenced_correctly() {
    let Some(data) = data() else { return };
    let folder = data.join("terrain/sertig");
    let origin = [46.735383, 9.836560];
    let ned = ned_frame(origin, 0.0);
    let begin = std::time::Instant::now();
    let loaded = read_terrain(
        &spec(&folder.join("sertig_valley.tif"), Some(&folder.join("sertig_valley_color.tif"))),
        &ned,
        None,
    )
    .unwrap();
    eprintln!("sertig loads in {:.3} s", begin.elapsed().as_secs_f64());
    let (terrain, summary) = (&loaded.terrain, &loaded.summary);
    assert_eq!(
        (terrain.cells, summary.void_heights, summary.outside_ortho, summary.epsg),
        ([640, 916], 0, 0, 21781)
    );
    assert!(
        (summary.height_range_m[0] - 1491.7).abs() < 0.1 && (summary.height_range_m[1] - 3002.4).abs() < 0.1
    );
    // The frame's origin is E 783249 N 178821: column 320, row 458 of the grid (pixel centres).
    let (chunk, i, j) = (7 * terrain.chunk_grid[0] + 5, 0, 458 - 448);
    let centre = terrain.position_ned_m(chunk, i, j);
    assert!(centre.truncate().length() < 2.0, "{centre}");
    // The grid is rotated against north by the convergence of the Swiss grid there, atan(2.4 deg * sin 46.7
    // deg) = 1.74 deg.
    let north = terrain.position_ned_m(2 * terrain.chunk_grid[0] + 5, 0, 0) - centre;
    assert!(
        ((-north.y).atan2(north.x).to_degrees() + 1.745).abs() < 0.03,
        "{}",
        (-north.y).atan2(north.x).to_degrees()
    );
    let down = terrain.down_at(0.0, 0.0).unwrap();
    assert!((-down - -centre.z).abs() < 30.0, "{down} {centre}");

    // Views straight down and 30 degrees below the horizon, at the height of the demo flight.
    let nadir = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let oblique = nadir * DQuat::from_rotation_x(60f64.to_radians());
    for (name, ned_from_camera) in [("nadir", nadir), ("oblique", oblique)] {
        let camera = CameraPose { position_ned_m: DVec3::new(0.0, 0.0, -3500.0), ned_from_camera };
        let mut before = u64::MAX;
        for max_error_px in [0.25, 0.5, 1.0, 2.0, 4.0] {
            let begin = std::time::Instant::now();
            let mesh =
                TerrainDetail::new(terrain, &camera, [-1.0, 1.0, -0.75, 0.75], 307.6, max_error_px).mesh();
            let (lod, microseconds) = (mesh.lod, begin.elapsed().as_secs_f64() * 1e6);
            eprintln!(
                "{name} {max_error_px} px: {} chunks, {} triangles, {:.3} px, {microseconds:.0} us",
                lod.chunks, lod.triangles, lod.max_error_px
            );
            assert!(lod.max_error_px <= max_error_px && lod.triangles <= before);
            before = lod.triangles;
        }
    }
}

#[test]
fn published_terrains_load() {
    let Some(data) = data() else { return };
    let folder = data.join("terrain");
    for (dem, ortho, origin, void_fraction) in [
        ("duebendorf/duebendorf.tif", Some("duebendorf/duebendorf_color.tif"), [47.41, 8.65], 0.0),
        ("hinwil/hinwil.tif", Some("hinwil/hinwil_color.tif"), [47.31, 8.83], 0.0),
        ("hinwil/hinwil_large_dem.tif", Some("hinwil/hinwil_color.tif"), [47.31, 8.83], 0.0),
        ("bern/swissALTI3D_bern_2m.tif", None, [46.93, 7.45], 0.0),
        (
            "brighton_beach/brighton_beach_dsm_10cm.tif",
            Some("brighton_beach/brighton_beach_rgb_10cm.tif"),
            [46.84258, -91.99405],
            0.57,
        ),
        ("jacksboro/jacksboro_fault_dem.tif", None, [36.59, -84.25], 0.0),
    ] {
        let ortho = ortho.map(|name| folder.join(name));
        let ned = ned_frame(origin, 0.0);
        let begin = std::time::Instant::now();
        let loaded = read_terrain(&spec(&folder.join(dem), ortho.as_deref()), &ned, None).unwrap();
        let (terrain, summary) = (&loaded.terrain, &loaded.summary);
        let cells = f64::from(terrain.cells[0]) * f64::from(terrain.cells[1]);
        eprintln!(
            "{dem}: {:.3} s, {:?}, centre {:?}, quantum {:.1e} m, {:.1} % void cells, {} heights outside the \
             picture",
            begin.elapsed().as_secs_f64(),
            terrain.cells,
            summary.centre_rad.map(f64::to_degrees),
            terrain.quantum_m,
            100.0 * terrain.void_cells as f64 / cells,
            summary.outside_ortho
        );
        // The centre is near the published location.
        assert!(summary.centre_ned_m.truncate().length() < 10_000.0, "{dem} {}", summary.centre_ned_m);
        let fraction =
            summary.void_heights as f64 / (f64::from(summary.size[0]) * f64::from(summary.size[1]));
        assert!((fraction - void_fraction).abs() < 0.01, "{dem} {fraction}");
        assert!(
            summary.south_west_rad[0] < summary.centre_rad[0]
                && summary.centre_rad[1] < summary.north_east_rad[1]
        );
        // The centre of the bounding box has ground within the file's range of heights, or is void.
        let centre = terrain.bounds.centre();
        match terrain.down_at(centre.x, centre.y) {
            Some(down) => assert!((terrain.bounds.min.z..=terrain.bounds.max.z).contains(&down)),
            None => assert!(terrain.void_cells > 0, "{dem}"),
        }
    }
}

/// Hypsometric tints are hillshaded without scene light; with it they have the scene's light instead.
#[test]
fn scene_light_replaces_hillshading() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    // A slope of 40 % up to the east.
    let heights: Vec<f32> = (0..12 * 10).map(|k| 4.0 * (k % 12) as f32).collect();
    write_dem(&path, [12, 10], &heights, Some(&UTM));
    let [lat, lon] = Crs::new(32632).unwrap().geodetic_from_model([500_000.0, 5_000_000.0]).unwrap();
    let ned = ned_frame([lat.to_degrees(), lon.to_degrees()], 0.0);
    let picture = |light: Option<Light>| {
        let loaded = read_terrain_in_light(&spec(&path, None), &ned, None, light.as_ref()).unwrap();
        loaded.terrain.texture.rgba8.clone()
    };
    // Sky light alone leaves level ground unchanged.
    let (open, half) = (Light::new(0.0, 0.5, 0.0, 1.0), Light::new(4.0, 0.9, 0.5, 0.25));
    let up = DVec3::new(0.0, -0.4, -1.0).normalize();
    let linear = |byte: u8| f64::from(linear_from_srgb(f32::from(byte) / 255.0));
    let (bright, dim) = (picture(Some(open)), picture(Some(half)));
    assert_ne!(picture(None), bright);
    let ratio = half.factor(up) / open.factor(up);
    for (a, b) in bright.chunks_exact(4).zip(dim.chunks_exact(4)) {
        for (a, b) in a[..3].iter().zip(b) {
            // Both are rounded to a byte of sRGB.
            let [low, high] = [a.saturating_sub(1), a.saturating_add(1)].map(|a| linear(a) * ratio);
            assert!(
                linear(b.saturating_sub(1)) <= high && linear(b.saturating_add(1)) >= low,
                "{a} {b} {ratio}"
            );
        }
    }
}
