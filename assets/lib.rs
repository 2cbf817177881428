//! The files of this folder, embedded: a crate of their own, so that they stay where people look for them and
//! are in a package all the same. `README.md` states their licences.

/// Embeds files of this folder as `FILES`.
macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        /// Name and content of each file.
        pub const FILES: &[(&str, &[u8])] = &[$(($name, include_bytes!($name))),*];
    };
}

embedded![
    "README.md",
    "acircles.png",
    "demo.toml",
    "demo_camera.toml",
    "demo_dem.tif",
    "demo_flight.csv",
    "demo_ortho.jpg",
    "pattern.toml",
    "vignette.png",
];
