//! Unit, range and tooltip of each key of a scenario. A test compares the list with the format's keys.

/// Description of a key.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Dotted key, without indices of lists.
    pub key: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Range of the number field; `validate` decides what is legal.
    pub range: [f64; 2],
    /// Change per point of drag.
    pub speed: f64,
    /// Tooltip: meaning, with the paper's symbol or equation if there is one.
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

/// Range of keys without one of their own.
const ANY: [f64; 2] = [-1e9, 1e9];
/// Range of keys that are not negative.
const POSITIVE: [f64; 2] = [0.0, 1e9];

/// Range of classes of objects.
const CLASS: [f64; 2] = [1.0, 65_535.0];

/// The description of a key.
pub fn find(key: &str) -> Option<&'static Param> {
    PARAMS.iter().find(|param| param.key == key)
}

/// All keys, in the order of the format.
pub const PARAMS: &[Param] = &[
    param("seed", "", [0.0, 1e9], 1.0, "seed of every random number; the same seed gives the same noise"),
    param("flight.log", "", ANY, 1.0, "the flight log: time, position, attitude (the paper's section 3)"),
    param("flight.format", "", ANY, 1.0, "format of the log; auto refuses ambiguous files"),
    param(
        "flight.time_unit",
        "",
        ANY,
        1.0,
        "unit of times whose column names none; auto refuses ambiguous values",
    ),
    param(
        "flight.angle_unit",
        "",
        ANY,
        1.0,
        "unit of roll, pitch and yaw whose columns name none; auto refuses ambiguous values",
    ),
    param("flight.angles", "", ANY, 1.0, "whether angles wrap or count turns"),
    param(
        "flight.attitude",
        "",
        ANY,
        1.0,
        "attitude of the log, or heading, bank and climb derived from the path",
    ),
    param(
        "flight.origin",
        "deg, deg, m",
        ANY,
        0.0001,
        "origin of the local north-east-down frame: the first row, or latitude, longitude, height",
    ),
    param("flight.height", "", ANY, 1.0, "vertical datum of the log's heights"),
    param("flight.window_s", "s", [0.0, 1e6], 0.05, "part of the log to fly, from its first good row"),
    param("flight.speed", "x", [0.01, 100.0], 0.01, "speed-up of the log: 2 flies twice as fast"),
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
        "part of the noise seed: cameras of different name have different noise",
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
        "roll, pitch, yaw of the camera on the platform; 0 looks along the nose, pitch -90 straight down \
         (eqs. 3-5)",
    ),
    param("camera.mount.offset_m", "m", [-100.0, 100.0], 0.01, "lever arm forward, right, down (eqs. 3-5)"),
    param("camera.mount.vibration", "", ANY, 1.0, "sinusoidal vibration of the mount"),
    param("camera.mount.vibration.axis", "", ANY, 1.0, "axis of rotation or translation"),
    param("camera.mount.vibration.amplitude_deg", "deg", [0.0, 45.0], 0.005, "amplitude of a rotation"),
    param("camera.mount.vibration.amplitude_m", "m", [0.0, 10.0], 0.001, "amplitude of a translation"),
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
    param("camera.zoom", "", ANY, 1.0, "calibrations by zoom value; need a zoom track"),
    param("camera.zoom.at", "", ANY, 0.01, "zoom value of this calibration"),
    param("camera.zoom.focal_px", "px", [1.0, 20_000.0], 0.5, "focal lengths at this zoom value"),
    param(
        "camera.zoom.principal_point_px",
        "px",
        [-8192.0, 8192.0],
        0.1,
        "principal point at this zoom value",
    ),
    param("camera.zoom.coefficients", "", [-10.0, 10.0], 0.001, "distortion coefficients at this zoom value"),
    param("camera.zoom_track", "", ANY, 1.0, "CSV file with columns t_s,zoom"),
    param(
        "camera.shutter.delay_ms",
        "ms",
        [0.0, 10_000.0],
        0.2,
        "exposure of the image centre before the stamp: -t_d",
    ),
    param(
        "camera.shutter.readout_ms",
        "ms",
        [0.0, 1000.0],
        0.2,
        "rolling shutter t_r: from the first row to the last",
    ),
    param("camera.shutter.readout", "", ANY, 1.0, "side at which the readout begins"),
    param(
        "camera.shutter.exposure_ms",
        "ms",
        [0.0, 1000.0],
        0.1,
        "exposure t_e, centred at each row's time (eq. 20): motion blur",
    ),
    param(
        "camera.shutter.interlace_ms",
        "ms",
        [0.0, 1000.0],
        0.2,
        "lag t_i between the two fields (eq. 21); \"field\" is half a frame period",
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
    param("scene.terrain.ortho", "", ANY, 1.0, "orthophoto of the terrain"),
    param("scene.terrain.height", "", ANY, 1.0, "vertical datum of the terrain's heights"),
    param("scene.terrain.epsg", "", [0.0, 65_535.0], 1.0, "coordinate system, if the file has none"),
    param("scene.terrain.height_unit", "", ANY, 1.0, "unit of the heights, if the file has none"),
    param(
        "scene.terrain.ortho_white",
        "",
        [1.0, 65_535.0],
        1.0,
        "stored value of white, if the orthophoto does not use all bits",
    ),
    param("scene.terrain.beyond", "", ANY, 1.0, "appearance of terrain beyond the orthophoto"),
    param("scene.terrain.name", "", ANY, 1.0, "name of the object in objects.csv; default: terrain"),
    param("scene.terrain.class", "", CLASS, 0.2, "class of the object, 1 to 65535"),
    param(
        "scene.pattern.image",
        "",
        ANY,
        1.0,
        "image of a level pattern at the origin's height, top to the north",
    ),
    param("scene.pattern.width_m", "m", POSITIVE, 1.0, "width of the pattern on the ground"),
    param("scene.pattern.at", "m", ANY, 1.0, "centre of the pattern: the origin, or north, east, down"),
    param("scene.pattern.name", "", ANY, 1.0, "name of the object in objects.csv; default: pattern"),
    param("scene.pattern.class", "", CLASS, 0.2, "class of the object, 1 to 65535"),
    param("scene.board.target", "", ANY, 1.0, "Kalibr's target YAML, in place of the keys below"),
    param("scene.board.kind", "", ANY, 1.0, "kind of calibration board"),
    param(
        "scene.board.columns",
        "",
        [1.0, 80.0],
        0.1,
        "inner corners, squares, circles or tags from left to right",
    ),
    param(
        "scene.board.rows",
        "",
        [1.0, 80.0],
        0.1,
        "inner corners, squares, circles or tags from top to bottom",
    ),
    param("scene.board.size_m", "m", POSITIVE, 0.001, "side of a square or tag, or spacing of circles"),
    param("scene.board.row_size_m", "m", POSITIVE, 0.001, "height of a chessboard's squares, if not square"),
    param("scene.board.diameter_m", "m", POSITIVE, 0.001, "diameter of circles; default: half the spacing"),
    param(
        "scene.board.spacing",
        "",
        POSITIVE,
        0.005,
        "gap between the tags of an AprilGrid, as a share of their side",
    ),
    param("scene.board.marker_m", "m", POSITIVE, 0.001, "side of a ChArUco board's markers"),
    param("scene.board.dictionary", "", ANY, 1.0, "dictionary of a ChArUco board's markers"),
    param("scene.board.first_id", "", [0.0, 586.0], 0.2, "number of the first tag or marker"),
    param("scene.board.margin_m", "m", [0.0, 1e6], 0.001, "least white margin around the board"),
    param("scene.board.at", "m", ANY, 0.1, "middle of the board: the origin, or north, east, down"),
    param("scene.board.geodetic", "deg deg m", ANY, 0.1, "middle of the board: latitude, longitude, height"),
    param("scene.board.angles_deg", "deg", ANY, 0.1, "roll, pitch, yaw; 0 0 0 is face up, pitch 90 upright"),
    param("scene.board.name", "", ANY, 1.0, "name of the object in objects.csv; default: board"),
    param("scene.board.class", "", CLASS, 0.2, "class of the object, 1 to 65535"),
    param("scene.gltf", "", ANY, 1.0, "models, each at one place or at those of a placement table"),
    param("scene.gltf.file", "", ANY, 1.0, "model file, .gltf or .glb"),
    param("scene.gltf.at", "m", ANY, 0.1, "position of the model: the origin, or north, east, down"),
    param("scene.gltf.geodetic", "deg deg m", ANY, 0.1, "position of the model: latitude, longitude, height"),
    param("scene.gltf.placements", "", ANY, 1.0, "CSV table of placements"),
    param("scene.gltf.heading_deg", "deg", ANY, 0.1, "heading of the model's front, east of north"),
    param("scene.gltf.scale", "x", POSITIVE, 0.01, "scale factor of the model"),
    param("scene.gltf.on_ground", "", ANY, 1.0, "place on the terrain, ignoring the height"),
    param("scene.gltf.scene", "", [0.0, 1e6], 0.1, "index of the scene in the file"),
    param("scene.gltf.time_s", "s", ANY, 0.01, "time of the animation"),
    param("scene.gltf.animation", "", [0.0, 1e6], 0.1, "index of the animation in the file"),
    param("scene.gltf.name", "", ANY, 1.0, "name of the object in objects.csv; default: the file's"),
    param("scene.gltf.class", "", CLASS, 0.2, "class of the object, 1 to 65535"),
    param("scene.gltf.objects", "", ANY, 1.0, "what an object is: each copy, or its nodes or materials"),
    param("scene.gltf.classes", "", ANY, 1.0, "classes by name of node or material"),
    param("scene.gltf.motion.poses", "", ANY, 1.0, "CSV table of poses by time, in place of a path"),
    param("scene.gltf.motion.path", "m", ANY, 1.0, "points that the model passes: north, east, down"),
    param("scene.gltf.motion.speed_m_s", "m/s", POSITIVE, 0.1, "speed along the path"),
    param("scene.gltf.motion.start_s", "s", ANY, 0.1, "path time at which it leaves the first point"),
    param("scene.gltf.motion.loop", "", ANY, 1.0, "what happens at the end of the path"),
    param("scene.gltf.motion.orient", "", ANY, 1.0, "whether its front looks where it goes"),
    param("scene.gltf.motion.spin", "", ANY, 1.0, "parts that spin: wheels, rotors"),
    param("scene.gltf.motion.spin.axis", "", ANY, 0.1, "axis in the node's own axes"),
    param("scene.gltf.motion.spin.hz", "Hz", ANY, 0.1, "turns a second"),
    param("scene.gltf.motion.spin.phase_deg", "deg", ANY, 1.0, "angle at path time 0"),
    param(
        "scene.gltf.motion.spin.node",
        "",
        ANY,
        1.0,
        "name of the node that spins; the whole model without",
    ),
    param("scene.gltf.motion.animate", "", ANY, 1.0, "play the model's own animations, again and again"),
    param("scene.sky", "sRGB", [0.0, 1.0], 0.005, "colour of the sky"),
    param(
        "scene.fog_visibility_m",
        "m",
        [1.0, 1e6],
        50.0,
        "visibility V: fog share 1 - exp(-3.912 d / V) at distance d",
    ),
    param(
        "scene.light.sun_azimuth_deg",
        "deg",
        [-360.0, 360.0],
        0.5,
        "azimuth of the sun, east of north; without a light the scene is unshaded",
    ),
    param("scene.light.sun_elevation_deg", "deg", [0.0, 90.0], 0.2, "elevation of the sun above the horizon"),
    param("scene.light.sun", "x", [0.0, 1.0], 0.005, "direct light on surfaces facing the sun"),
    param(
        "scene.light.sky",
        "x",
        [0.0, 1.0],
        0.005,
        "diffuse light on upward surfaces, half of it on walls; sun + sky is at most 1",
    ),
    param("scene.light.shadows", "", ANY, 1.0, "whether terrain and models keep the sun from what is behind"),
    param("quality.preset", "", ANY, 1.0, "paper: the methods as published, for comparison"),
    param(
        "quality.max_error_px",
        "px",
        [0.001, 10.0],
        0.001,
        "tolerance of the source error, 99th percentile",
    ),
    param(
        "quality.max_error_dn",
        "1/255",
        [0.01, 50.0],
        0.01,
        "tolerance of the RMS picture error: resampling, blur samples, misregistration, silhouettes",
    ),
    param(
        "quality.max_terrain_error_px",
        "px",
        [0.01, 50.0],
        0.01,
        "tolerance of the terrain's level of detail",
    ),
    param(
        "quality.solver",
        "",
        ANY,
        1.0,
        "temporal inverse: linear is eq. 16, rk2 eq. 18, reproject exact poses with depth",
    ),
    param("quality.iterations", "", [1.0, 64.0], 0.1, "depth look-ups of reproject"),
    param("quality.blur_samples", "", [1.0, 4096.0], 0.1, "exposure samples per pixel of path"),
    param("quality.footprint_taps", "", [1.0, 64.0], 0.1, "texture taps along each side of a pixel, at most"),
    param(
        "quality.ideal_scale",
        "",
        [1.0, 5.0],
        0.01,
        "pixels of the ideal frame per camera pixel, along a side",
    ),
    param(
        "quality.ideal_samples",
        "",
        [1.0, 4.0],
        1.0,
        "samples per pixel of the ideal frame, 1 or 4; 4 locate silhouettes within a pixel",
    ),
    param("quality.key_frames", "", [1.0, 4.0], 0.05, "ideal frames per output frame"),
    param("quality.frames_per_ideal", "", [1.0, 64.0], 0.1, "output frames per ideal frame, at most"),
    param("quality.silhouettes", "", ANY, 1.0, "silhouette rays for pixels at borders of surfaces"),
    param("output.channels", "", ANY, 1.0, "channels written for each frame"),
    param("output.format", "", ANY, 1.0, "file formats of colour"),
    param(
        "output.stamps",
        "",
        ANY,
        1.0,
        "clock of stamps: the log's, or one that starts at output.epoch_ns at the window's begin",
    ),
    param("output.epoch_ns", "ns", ANY, 1.0, "time of that clock at the window's begin"),
    param("output.exr_pixel", "", ANY, 1.0, "pixel type of EXR colour"),
    param("output.exr_compression", "", ANY, 1.0, "compression of EXR files"),
    param("output.video.codec", "", ANY, 1.0, "encoder of mp4 and mkv"),
    param("output.video.bits", "", [8.0, 10.0], 0.1, "bits of each code value of a video"),
    param("output.video.crf", "", [0.0, 51.0], 0.1, "constant rate factor: 0 is best, 51 smallest"),
    param(
        "output.flow_step",
        "frames",
        [1.0, 1e6],
        0.1,
        "frames from one to the other of flow and flow_back",
    ),
    param("output.flow_instant", "", ANY, 1.0, "instant of the picture that flow_global leads to"),
    param("output.palette", "", ANY, 1.0, "pictures of object and class in colour"),
    param(
        "output.tracks.points",
        "",
        ANY,
        1.0,
        "points whose pixel tracks.csv has for every frame: terrain, vertices, board, tables (.csv)",
    ),
    param("output.tracks.count", "", [1.0, 1e6], 10.0, "most points of terrain, vertices and board, each"),
    param(
        "output.twin",
        "",
        ANY,
        1.0,
        "the same frames by a better camera, each twin in a folder of its own",
    ),
    param("output.twin.name", "", ANY, 1.0, "name of the twin's folder"),
    param("output.twin.exposure", "", ANY, 1.0, "off: an instant in place of the exposure, no motion blur"),
    param("output.twin.shutter", "", ANY, 1.0, "global: all pixels at one instant"),
    param("output.twin.instant", "", ANY, 1.0, "mid-exposure that a global shutter shows"),
    param("output.twin.lens", "", ANY, 1.0, "off: a pinhole with the same focal length and principal point"),
    param("output.twin.noise", "", ANY, 1.0, "off: no noise"),
    param("output.twin.vignette", "", ANY, 1.0, "off: no vignette"),
    param("output.twin.ideal", "", ANY, 1.0, "no exposure, rolling shutter, lens, noise or vignette"),
    param("output.twin.instants", "", [1.0, 1000.0], 0.1, "pictures in a burst for each frame"),
    param("output.twin.over", "", ANY, 1.0, "what the instants of a burst are spread over"),
    param("output.twin.channels", "", ANY, 1.0, "channels of the twin; those of the frame if none is chosen"),
];

#[cfg(test)]
mod tests {
    use camsim_io::scenario_file::{ValueKind, keys};

    use super::*;

    #[test]
    fn params_lists_exactly_the_keys_of_the_format() {
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
