//! The predicted source error from pixel to pixel.

/// The predicted source error of a frame from pixel to pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// One a probe: some 430, or a quarter of them for a frame that shares its ideal frame, spread evenly over the
    /// pixels that have a ray.
    pub pixels: Vec<PixelError>,
    /// What is known of the frame as a whole only, and comes on top everywhere while the exposure lasts:
    /// curves between its nodes, and depth between its ends. Nothing at mid-exposure.
    pub everywhere_px: f64,
    /// Columns and rows of the grid of probes over the image: one in each of its cells, or in each black or
    /// white one of a chessboard, and the image's corners.
    pub grid: [u32; 2],
    /// Half of the side of the square around a pixel whose probes stand for it: the side of the part of the
    /// image that each stands for.
    pub reach_px: f64,
}

/// The prediction at one output pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelError {
    /// Output pixel.
    pub pixel: [u32; 2],
    /// Its predicted source error.
    pub error: SourceError,
}

/// The predicted source error of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceError {
    /// An error of so many pixels of the ideal frame.
    Within(f64),
    /// It is beside a silhouette, or what it sees is hidden from the ideal frame's camera: such pixels are
    /// counted apart.
    Silhouette,
    /// What it sees lies outside of the ideal frame: the pixel gets rays of its own; with the paper's preset it stays
    /// empty.
    NoSource,
}

impl ErrorMap {
    /// The largest error of all probes, with what comes on top:
    /// [`Predicted::total_px`](super::predicted::Predicted::total_px) of the plan.
    #[must_use]
    pub fn largest_px(&self) -> f64 {
        self.known().map(|(_, px)| px).fold(0.0, f64::max) + self.everywhere_px
    }

    /// The largest error of the probes around a pixel, without what comes on top; `None` where they are all
    /// at silhouettes or without a source.
    #[must_use]
    pub fn near_px(&self, pixel: [u32; 2]) -> Option<f64> {
        let is_near =
            |at: [u32; 2]| (0..2).all(|axis| f64::from(at[axis].abs_diff(pixel[axis])) <= self.reach_px);
        self.known().filter(|(at, _)| is_near(*at)).map(|(_, px)| px).reduce(f64::max)
    }

    /// Probes that have an error, and their errors.
    pub fn known(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        self.pixels.iter().filter_map(|entry| match entry.error {
            SourceError::Within(px) => Some((entry.pixel, px)),
            _ => None,
        })
    }
}
