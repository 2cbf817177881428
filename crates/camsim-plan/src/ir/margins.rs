//! Margins and safety factors, each with its reason. Values are multiplied by them unless noted.

/// Source error: the largest of a few hundred probes misses some pixels.
pub(crate) const SOURCE_ERROR: f64 = 1.25;
/// Picture error by resampling and misregistration: texture spectra differ over the picture.
pub(crate) const TEXTURES: f64 = 1.2;
/// Picture error at silhouettes: of a few hundred probes a few are at silhouettes.
pub(crate) const SILHOUETTES: f64 = 1.3;
/// Picture error at silhouettes with rays of their own, which is known from points a pixel apart.
pub(crate) const SILHOUETTES_WITH_RAYS: f64 = 1.2;
/// Standard errors of what the probes find at borders, squared, that are added to it.
pub(crate) const STANDARD_ERRORS: f64 = 1.5;
/// Most times what is found at borders, squared, that is taken to lie between those.
pub(crate) const MOST_BETWEEN_BORDERS: f64 = 2.0;
/// How far silhouettes of the terrain are displaced, in times of all of it: they are ridges, which coarser
/// triangles cut off. Over an alpine valley the whole error by a level of detail of 0.25 px was 0.34 to
/// 0.51/255 in ten frames, with 3500 houses or none; the prediction with this factor was 0.8 to 1.1 times
/// that, and more since the skyline is known by itself.
pub(crate) const RIDGES: f64 = 1.5;
/// Picture error at the skyline: it is known at some positions, between which it is more rugged.
pub(crate) const SKYLINE: f64 = 1.5;
/// Picture error at the skyline of a terrain that is drawn coarser than it is.
pub(crate) const SKYLINE_OF_TERRAIN: f64 = 1.2;
/// Picture error by the one depth of blended surfaces: of a few thousand rays few may pass near a border.
pub(crate) const BLENDED_DEPTH: f64 = 1.2;
/// A slope of more than this part of the view's own already counts as edge-on.
pub(crate) const FACING: f64 = 0.95;
/// Rim of the ideal frame, pixels: for bilinear fetches, footprint taps, and what lies between the kept rays.
pub(crate) const IDEAL_RIM_PX: f64 = 4.0;
/// View of a still camera, tangents for each unit of slant: spared on each side for what moves.
pub(crate) const STILL_VIEW: f64 = 0.1;
/// Reach of marks, ideal pixels: for the reads around a source, and for rounding.
pub(crate) const MARK_REACH_PX: f64 = 3.0;
/// Inverse depth of the nearest surface from which on rays are searched: as in
/// `camsim-gpu/shaders/reverse/edges/near_silhouette.wgsl`.
pub(crate) const NEARER: f64 = 1.02;
/// Farthest that nine points see without a step between them: nothing farther is seen among them.
pub(crate) const BEHIND: f64 = 1.05;
/// Miss of the exposure's path when more nodes are chosen for it.
pub(crate) const PATH_MISS: f64 = 1.05;
/// Tolerance of the picture: what is left of it and what is taken of it may add up to a little more.
pub(crate) const ROUNDED: f64 = 1.0 + 1e-9;
