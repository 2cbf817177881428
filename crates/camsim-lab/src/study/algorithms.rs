//! Algorithms that come with camsim, as Python scripts.

/// An algorithm for a study.
#[derive(Clone, Copy, Debug)]
pub struct Algorithm {
    /// Name in a study.
    pub name: &'static str,
    /// What it does, and what it leaves.
    pub about: &'static str,
    /// Its script, which is called with the folder of the frames and the file of the result.
    pub script: &'static str,
    /// Layout that it reads, as of `camsim export --as`; `None` is the folder of `camsim render`.
    pub layout: Option<&'static str>,
    /// Keys that it needs; those of the study come after them.
    pub sets: &'static [(&'static str, &'static str)],
    /// What Python must import.
    pub modules: &'static [&'static str],
    /// The packages of these, for pip.
    pub packages: &'static str,
}

/// What the scripts share.
pub const COMMON: &str = include_str!("../../algorithms/common.py");

const OPENCV: &[&str] = &["cv2", "numpy"];
const OPENCV_PACKAGES: &str = "opencv-python-headless numpy";
const BOARD: &[(&str, &str)] = &[
    ("output.channels", r#"["color"]"#),
    ("output.format", r#"["png"]"#),
    ("output.tracks", r#"{ points = "board" }"#),
];

/// All of them.
pub const ALGORITHMS: &[Algorithm] = &[
    Algorithm {
        name: "tracking",
        about: "Lucas-Kanade from corners to the next picture against exact flow: error_{median,rms,p90}_px, lost",
        script: include_str!("../../algorithms/tracking.py"),
        layout: Some("flo"),
        sets: &[],
        modules: OPENCV,
        packages: OPENCV_PACKAGES,
    },
    Algorithm {
        name: "flow",
        about: "dense flow (DIS) against exact flow: error_{median,rms,p90}_px, flow_median_px",
        script: include_str!("../../algorithms/flow.py"),
        layout: Some("flo"),
        sets: &[],
        modules: OPENCV,
        packages: OPENCV_PACKAGES,
    },
    Algorithm {
        name: "pnp",
        about: "pose from a picture of scene.board: position_{median,rms,p90}_mm, angle_{median,rms,p90}_deg",
        script: include_str!("../../algorithms/pnp.py"),
        layout: None,
        sets: BOARD,
        modules: OPENCV,
        packages: OPENCV_PACKAGES,
    },
    Algorithm {
        name: "calibration",
        about: "calibration from pictures of scene.board: reprojection_px, focal_error, centre_error_px, map_rms_px",
        script: include_str!("../../algorithms/calibration.py"),
        layout: None,
        sets: BOARD,
        modules: OPENCV,
        packages: OPENCV_PACKAGES,
    },
    Algorithm {
        name: "mapping",
        about: "COLMAP with the true calibration: centre_rms_m, centre_percent (of the path), found, reprojection_px",
        script: include_str!("../../algorithms/mapping.py"),
        layout: Some("colmap"),
        sets: &[],
        modules: &["pycolmap", "numpy"],
        packages: "pycolmap numpy",
    },
];

impl Algorithm {
    /// The names of all.
    pub fn names() -> impl Iterator<Item = &'static str> {
        ALGORITHMS.iter().map(|algorithm| algorithm.name)
    }

    /// The one of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        ALGORITHMS.iter().find(|algorithm| algorithm.name == name)
    }
}
