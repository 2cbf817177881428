//! What people should know of each key of a scenario: unit, range that makes sense, and the paper's symbol
//! for it. A test holds this table against the format's own.

/// A key's facts.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Dotted key.
    pub key: &'static str,
    /// Unit, for display.
    pub unit: &'static str,
    /// Range of sliders and drags; what is legal is decided elsewhere.
    pub range: [f64; 2],
    /// Change a point of drag.
    pub speed: f64,
    /// What it means; names the paper's symbol or equation where it has one.
    pub tip: &'static str,
}

const fn param(
    key: &'static str,
    unit: &'static str,
    range: [f64; 2],
    speed: f64,
    tip: &'static str,
) -> Param {
    Param { key, unit, range, speed, tip }
}

/// Where numbers have no range of their own.
const ANY: [f64; 2] = [-1e9, 1e9];
const POSITIVE: [f64; 2] = [0.0, 1e9];

/// The facts of a key.
pub fn of(key: &str) -> Option<&'static Param> {
    PARAMS.iter().find(|param| param.key == key)
}

/// In the order of the format.
pub const PARAMS: &[Param] = &[
    param("seed", "", [0.0, 1e9], 1.0, "seed of every random number; the same seed gives the same noise"),
    param("flight.log", "", ANY, 1.0, "the flight log: time, position, attitude (the paper's section 3)"),
    param("flight.format", "", ANY, 1.0, "columns of the log; auto refuses what could be two of them"),
    param(
        "flight.time_unit",
        "",
        ANY,
        1.0,
        "unit of times whose column names none; auto refuses what the values leave in doubt",
    ),
    param(
        "flight.angle_unit",
        "",
        ANY,
        1.0,
        "unit of roll, pitch and yaw whose columns name none; auto refuses what the values leave in doubt",
    ),
    param("flight.angles", "", ANY, 1.0, "whether angles wrap or count turns"),
    param(
        "flight.attitude",
        "",
        ANY,
        1.0,
        "the log's own attitude, or heading, bank and climb from the flown path",
    ),
    param(
        "flight.origin",
        "deg, deg, m",
        ANY,
        0.0001,
        "origin of the local north-east-down frame: the first row, or latitude, longitude, height",
    ),
    param("flight.height", "", ANY, 1.0, "what the log's heights are above"),
    param("flight.window_s", "s", [0.0, 1e6], 0.05, "part of the log that is flown, from its first good row"),
    param("flight.speed", "x", [0.01, 100.0], 0.01, "2 flies twice as fast"),
    param(
        "tracker.kind",
        "",
        ANY,
        1.0,
        "how the platform follows the log: sqrt is the paper's pair of nested SQRT loops (section 3)",
    ),
    param("tracker.rate_hz", "Hz", [10.0, 2000.0], 1.0, "control ticks of sqrt, knots of spline"),
    param("tracker.max_speed_m_s", "m/s", POSITIVE, 0.1, "limit of the velocity (the paper's v_max)"),
    param(
        "tracker.max_acceleration_m_s2",
        "m/s2",
        POSITIVE,
        0.1,
        "limit of the acceleration (the paper's a_max)",
    ),
    param("tracker.max_angular_rate_deg_s", "deg/s", POSITIVE, 0.1, "limit of the body rate"),
    param(
        "tracker.max_angular_acceleration_deg_s2",
        "deg/s2",
        POSITIVE,
        0.5,
        "limit of the angular acceleration",
    ),
    param(
        "camera.name",
        "",
        ANY,
        1.0,
        "part of the seed of the noise: cameras of other names have other noise",
    ),
    param("camera.size_px", "px", [1.0, 8192.0], 1.0, "width and height of the picture (W, H)"),
    param("camera.focal_px", "px", [1.0, 20_000.0], 0.5, "focal lengths f_x, f_y"),
    param(
        "camera.principal_point_px",
        "px",
        [-8192.0, 8192.0],
        0.1,
        "principal point c_x, c_y; (0, 0) is the centre of the top-left pixel",
    ),
    param("camera.fps", "1/s", [0.01, 1000.0], 0.1, "frames a second"),
    param("camera.phase", "frames", [-10.0, 10.0], 0.01, "fraction of a frame period added to every stamp"),
    param(
        "camera.mount.angles_deg",
        "deg",
        [-180.0, 180.0],
        0.1,
        "roll, pitch, yaw of the camera on the platform; 0 looks along the nose, pitch -90 straight down (eqs. 3-5)",
    ),
    param("camera.mount.offset_m", "m", [-100.0, 100.0], 0.01, "lever arm forward, right, down (eqs. 3-5)"),
    param("camera.mount.vibration", "", ANY, 1.0, "sinusoids added to the mount"),
    param("camera.mount.vibration.axis", "", ANY, 1.0, "what it shakes"),
    param("camera.mount.vibration.amplitude_deg", "deg", [0.0, 45.0], 0.005, "of a rotation"),
    param("camera.mount.vibration.amplitude_m", "m", [0.0, 10.0], 0.001, "of a translation"),
    param("camera.mount.vibration.hz", "Hz", [0.0, 2000.0], 0.2, "frequency"),
    param(
        "camera.mount.vibration.phase_deg",
        "deg",
        [-360.0, 360.0],
        1.0,
        "phase at the first row of the log",
    ),
    param("camera.lens.model", "", ANY, 1.0, "distortion model; brown-conrady is the paper's (eqs. 8 and 9)"),
    param(
        "camera.lens.coefficients",
        "",
        [-10.0, 10.0],
        0.001,
        "k1 k2 p1 p2 k3 k4 k5 k6 (eqs. 8 and 9), or k1 k2 k3 k4 of kannala-brandt",
    ),
    param("camera.zoom", "", ANY, 1.0, "calibrations over zoom; go with a zoom track"),
    param("camera.zoom.at", "", ANY, 0.01, "zoom value of this calibration"),
    param("camera.zoom.focal_px", "px", [1.0, 20_000.0], 0.5, "focal lengths there"),
    param("camera.zoom.principal_point_px", "px", [-8192.0, 8192.0], 0.1, "principal point there"),
    param("camera.zoom.coefficients", "", [-10.0, 10.0], 0.001, "distortion there"),
    param("camera.zoom_track", "", ANY, 1.0, "CSV t_s,zoom"),
    param(
        "camera.shutter.delay_ms",
        "ms",
        [0.0, 10_000.0],
        0.2,
        "how much older than its stamp the image centre is: -t_d",
    ),
    param(
        "camera.shutter.readout_ms",
        "ms",
        [0.0, 1000.0],
        0.2,
        "rolling shutter t_r: from the first row to the last",
    ),
    param("camera.shutter.readout", "", ANY, 1.0, "where the readout begins"),
    param(
        "camera.shutter.exposure_ms",
        "ms",
        [0.0, 1000.0],
        0.1,
        "exposure t_e, about each row's middle (eq. 20): motion blur",
    ),
    param(
        "camera.shutter.interlace_ms",
        "ms",
        [0.0, 1000.0],
        0.2,
        "lag t_i between the two fields (eq. 21); field is half a frame period",
    ),
    param("camera.shutter.first_field", "", ANY, 1.0, "rows of the earlier field, counted from 0"),
    param(
        "camera.photometric.vignette",
        "",
        ANY,
        1.0,
        "vignette map v, stretched over the picture (section 7)",
    ),
    param(
        "camera.photometric.vignette_thresholds",
        "",
        [0.0, 1.0],
        0.005,
        "t1, t2: v < t1 is black, else min(v / t2, 1)",
    ),
    param("camera.photometric.light", "x", [0.0, 100.0], 0.01, "gain on linear values"),
    param(
        "camera.photometric.noise_sigma",
        "",
        [0.0, 1.0],
        0.001,
        "standard deviation of the noise on linear values",
    ),
    param("camera.photometric.output", "", ANY, 1.0, "encoding of PNG files; the viewer always shows sRGB"),
    param("scene.terrain.dem", "", ANY, 1.0, "GeoTIFF of heights"),
    param("scene.terrain.ortho", "", ANY, 1.0, "picture on the terrain"),
    param("scene.terrain.height", "", ANY, 1.0, "what the terrain's heights are above"),
    param("scene.terrain.epsg", "", [0.0, 65_535.0], 1.0, "coordinate system, where the file does not say"),
    param("scene.terrain.height_unit", "", ANY, 1.0, "unit of the heights, where the file does not say"),
    param(
        "scene.terrain.ortho_white",
        "",
        [1.0, 65_535.0],
        1.0,
        "stored number of the picture that is white, where not all bits are used",
    ),
    param("scene.terrain.beyond", "", ANY, 1.0, "what is seen of ground without a picture"),
    param(
        "scene.pattern.image",
        "",
        ANY,
        1.0,
        "a level picture at the origin's height, its top to the north",
    ),
    param("scene.pattern.width_m", "m", POSITIVE, 1.0, "width of the pattern on the ground"),
    param("scene.pattern.at", "m", ANY, 1.0, "centre of the pattern: the origin, or north, east, down"),
    param("scene.board.target", "", ANY, 1.0, "Kalibr's target YAML, in place of the keys below"),
    param("scene.board.kind", "", ANY, 1.0, "what is on the board"),
    param(
        "scene.board.columns",
        "",
        [1.0, 80.0],
        0.1,
        "inner corners, squares, circles or tags from left to right",
    ),
    param("scene.board.rows", "", [1.0, 80.0], 0.1, "the same from top to bottom"),
    param("scene.board.size_m", "m", POSITIVE, 0.001, "side of a square or tag, or spacing of circles"),
    param(
        "scene.board.row_size_m",
        "m",
        POSITIVE,
        0.001,
        "height of a chessboard's squares, if it is another",
    ),
    param("scene.board.diameter_m", "m", POSITIVE, 0.001, "of a circle; half the spacing if left out"),
    param(
        "scene.board.spacing",
        "",
        POSITIVE,
        0.005,
        "gap between the tags of an AprilGrid, as a share of their side",
    ),
    param("scene.board.marker_m", "m", POSITIVE, 0.001, "side of a ChArUco board's markers"),
    param("scene.board.dictionary", "", ANY, 1.0, "of a ChArUco board's markers"),
    param("scene.board.first_id", "", [0.0, 586.0], 0.2, "number of the first tag or marker"),
    param("scene.board.margin_m", "m", [0.0, 1e6], 0.001, "white around the board, at least"),
    param("scene.board.at", "m", ANY, 0.1, "middle of the board: the origin, or north, east, down"),
    param("scene.board.geodetic", "deg deg m", ANY, 0.1, "middle of the board: latitude, longitude, height"),
    param("scene.board.angles_deg", "deg", ANY, 0.1, "roll, pitch, yaw: 0 0 0 lies face up; pitch 90 stands"),
    param("scene.gltf", "", ANY, 1.0, "models, each once or wherever a table says"),
    param("scene.gltf.file", "", ANY, 1.0, ".gltf or .glb"),
    param("scene.gltf.at", "m", ANY, 0.1, "where its origin is: the origin, or north, east, down"),
    param("scene.gltf.geodetic", "deg deg m", ANY, 0.1, "the same: latitude, longitude, height"),
    param("scene.gltf.placements", "", ANY, 1.0, "a table of places"),
    param("scene.gltf.heading_deg", "deg", ANY, 0.1, "where its front looks, degrees east of north"),
    param("scene.gltf.scale", "x", POSITIVE, 0.01, "metres for each of its metres"),
    param("scene.gltf.on_ground", "", ANY, 1.0, "put on the terrain, whatever height its place has"),
    param("scene.gltf.scene", "", [0.0, 1e6], 0.1, "which of the file's scenes"),
    param("scene.gltf.time_s", "s", ANY, 0.01, "instant of its animation"),
    param("scene.gltf.animation", "", [0.0, 1e6], 0.1, "which of the file's animations"),
    param("scene.sky", "sRGB", [0.0, 1.0], 0.005, "colour of the sky"),
    param(
        "scene.fog_visibility_m",
        "m",
        [1.0, 1e6],
        50.0,
        "visibility V: 1 - exp(-3.912 d / V) of a colour is the sky's",
    ),
    param(
        "scene.light.sun_azimuth_deg",
        "deg",
        [-360.0, 360.0],
        0.5,
        "where the sun is, east of north; without any of these colours are as they are",
    ),
    param("scene.light.sun_elevation_deg", "deg", [0.0, 90.0], 0.2, "how high the sun is above the horizon"),
    param(
        "scene.light.sun",
        "x",
        [0.0, 1.0],
        0.005,
        "of a colour that the sun meets at right angles; no shadows",
    ),
    param(
        "scene.light.sky",
        "x",
        [0.0, 1.0],
        0.005,
        "of a colour that looks up, half of it for walls; with the sun at most 1",
    ),
    param("quality.preset", "", ANY, 1.0, "paper: the paper's own methods, to measure against"),
    param(
        "quality.max_error_px",
        "px",
        [0.001, 10.0],
        0.001,
        "bound on 99 % of the pixels' source coordinates",
    ),
    param(
        "quality.max_error_dn",
        "1/255",
        [0.01, 50.0],
        0.01,
        "RMS of the picture from resampling, blur samples, sources beside their place and at silhouettes",
    ),
    param("quality.max_terrain_error_px", "px", [0.01, 50.0], 0.01, "level of detail of the terrain"),
    param(
        "quality.solver",
        "",
        ANY,
        1.0,
        "temporal inverse: linear is eq. 16, rk2 eq. 18, reproject exact poses with depth",
    ),
    param("quality.iterations", "", [1.0, 64.0], 0.1, "depth look-ups of reproject"),
    param("quality.blur_samples", "", [1.0, 4096.0], 0.1, "samples for each pixel of path"),
    param("quality.footprint_taps", "", [1.0, 64.0], 0.1, "taps along each side of a pixel, at most"),
    param("quality.ideal_scale", "", [1.0, 5.0], 0.01, "pixels of the ideal frame for each of the camera's"),
    param(
        "quality.ideal_samples",
        "",
        [1.0, 4.0],
        1.0,
        "samples of each of its pixels, 1 or 4: with several, borders are known to a part of a pixel",
    ),
    param("quality.key_frames", "", [1.0, 4.0], 0.05, "ideal frames for each output frame"),
    param(
        "quality.frames_per_ideal",
        "",
        [1.0, 64.0],
        0.1,
        "output frames that may be made from one ideal frame",
    ),
    param("quality.silhouettes", "", ANY, 1.0, "rays of their own for pixels at borders of surfaces"),
    param("output.channels", "", ANY, 1.0, "what is written for each frame"),
    param("output.format", "", ANY, 1.0, "file formats of colour"),
    param(
        "output.stamps",
        "",
        ANY,
        1.0,
        "clock of stamps: the log's, or one that shows output.epoch_ns at the beginning of the window",
    ),
    param("output.epoch_ns", "ns", ANY, 1.0, "what that clock shows at the beginning of the window"),
    param("output.exr_pixel", "", ANY, 1.0, "pixel type of EXR colour"),
    param("output.exr_compression", "", ANY, 1.0, "compression of EXR"),
];

#[cfg(test)]
mod tests {
    use camsim_io::scenario_file::{ValueKind, keys};

    use super::*;

    #[test]
    fn every_key_of_the_format_has_its_facts_and_no_other() {
        let known: Vec<&str> = PARAMS.iter().map(|param| param.key).collect();
        let format: Vec<&str> =
            keys().iter().filter(|(_, kind)| *kind != ValueKind::Unsupported).map(|(key, _)| *key).collect();
        assert_eq!(known, format);
        for param in PARAMS {
            assert!(
                param.range[0] < param.range[1] && param.speed > 0.0 && !param.tip.is_empty(),
                "{}",
                param.key
            );
        }
    }
}
