//! Which stage of which implementation is compared with what, and within which tolerance.

use super::{implementations::Implementation, stage::Stage};

/// Cases that are compared alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Frames of the planner's plans over ground and houses.
    Planned,
    /// Frames over ground alone, compared pixel by pixel.
    Smooth,
    /// Frames that copy the ideal frame.
    Still,
    /// Frames with vignette, light and noise.
    Photometric,
    /// Exposures and taps that no plan combines.
    HandMade,
    /// Solvers of constant twist.
    ConstantTwist,
    /// Ideal frames of level ground, with a closed form.
    IdealPattern,
    /// Ideal frames of other scenes.
    Ideal,
    /// Ideal frames of scenarios in files, with levels of detail.
    IdealFiles,
    /// Ideal frames of four samples a pixel.
    IdealSamples,
    /// The same of scenarios in files.
    IdealSamplesOfFiles,
    /// Ideal frames of every kind of material.
    Gallery,
    /// Ideal frames of hills and panes that the rasteriser draws too.
    Opaque,
    /// The same with four samples a pixel, over level ground.
    OpaqueSamples,
}

impl Group {
    /// Whether a check of the group asks for an implementation.
    pub fn asks_for(self, implementation: Implementation) -> bool {
        CHECKS.iter().filter(|check| check.group == self).any(|check| {
            check.implementation == implementation
                || check.reference == Reference::Other(implementation)
                || (implementation == Gpu && check.reference == TwinBesideGpu)
        })
    }

    /// Least number of pixels whose source is compared, in one case with so many pixels.
    pub fn least_sources(self, pixels: usize) -> usize {
        match self {
            Self::Planned => pixels / 2,
            Self::Smooth => 20_000,
            Self::HandMade | Self::ConstantTwist => 1500,
            _ => 0,
        }
    }

    /// Whether pixels near the sky are skipped.
    pub fn is_clear_of_sky(self) -> bool {
        self == Self::Smooth
    }
}

/// What an output is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The f64 twin of the stage, which reads what the stages before it have put out.
    Twin,
    /// The f64 twin; the error is given as a multiple of the gpu's.
    TwinBesideGpu,
    /// The output of another implementation.
    Other(Implementation),
}

/// What of all differences must not be larger than the tolerance.
#[derive(Clone, Copy, Debug)]
pub enum Statistic {
    Maximum,
    Percentile99,
    /// Fraction of the pixels that differ by more than so much.
    ShareBeyond([f64; 2]),
    /// RMS over components, of the pixels that differ by not more than so much.
    RmsWithin([f64; 2]),
    /// RMS over components.
    Rms,
    /// RMS of the components that differ most.
    RmsOfMost,
}

/// A tolerance. Pairs of numbers are those of software adapters, and of cards: circuits weigh texels with 8
/// bits of fraction and move corners to multiples of 1/256 px.
#[derive(Debug)]
pub struct Tolerance {
    pub name: &'static str,
    pub statistic: Statistic,
    pub most: [f64; 2],
    pub unit: &'static str,
    pub reason: &'static str,
}

const fn tolerance(
    name: &'static str,
    statistic: Statistic,
    most: [f64; 2],
    unit: &'static str,
    reason: &'static str,
) -> Tolerance {
    Tolerance { name, statistic, most, unit, reason }
}

/// A line of the table of checks.
#[derive(Debug)]
pub struct Check {
    pub group: Group,
    pub stage: Stage,
    pub implementation: Implementation,
    pub reference: Reference,
    pub tolerance: &'static Tolerance,
}

use Implementation::{CpuGeneral, CpuVectorised, Gpu};
use Reference::{Other, Twin, TwinBesideGpu};
use Statistic::{Maximum, Percentile99, Rms, RmsOfMost, RmsWithin, ShareBeyond};

/// Differences of linear colours that rounding does not explain, on software adapters and on cards.
const FAR: [f64; 2] = [1e-3, 6e-3];

const EXACT: Tolerance = tolerance("EXACT", Maximum, [0.0; 2], "", "the same operations");
const COLOR_FAR: Tolerance = tolerance(
    "COLOR_FAR",
    ShareBeyond(FAR),
    [1.0 / 5000.0; 2],
    "of the pixels",
    "rounding decides which surface is seen and what is still in the ideal frame",
);
const COLOR_RMS: Tolerance = tolerance(
    "COLOR_RMS",
    RmsWithin(FAR),
    [1e-5, 3e-4],
    "of full scale",
    "texels weighed with 8 bits: 2^-9 of the difference of neighbours along each axis, more where a spline \
     sharpens",
);
const SEEN: Tolerance =
    tolerance("SEEN", ShareBeyond([0.5; 2]), [1e-3; 2], "of the pixels", "rounding at silhouettes");
const SOURCE_P99: Tolerance = tolerance(
    "SOURCE_P99",
    Percentile99,
    [1e-3; 2],
    "px",
    "f32 of coordinates up to 1000 px, some roundings",
);
const DEPTH_P99: Tolerance =
    tolerance("DEPTH_P99", Percentile99, [1e-5; 2], "relative", "f32, some roundings");
const POINT_P99: Tolerance =
    tolerance("POINT_P99", Percentile99, [1e-5; 2], "of the depth", "f32, some roundings");
const LENS_MAP_CPU: Tolerance =
    tolerance("LENS_MAP_CPU", Maximum, [1e-4; 2], "px", "f32 of a ray that is solved in f64");
const LENS_MAP_GPU: Tolerance =
    tolerance("LENS_MAP_GPU", Maximum, [1e-3; 2], "px", "solved in f32, as `lens_inverse.rs` demands");
const ROW_TIME: Tolerance = tolerance("ROW_TIME", Maximum, [5e-9; 2], "s", "f32 of times up to 0.1 s");
const VALID: Tolerance = tolerance(
    "VALID",
    ShareBeyond([0.5; 2]),
    [1e-3; 2],
    "of the pixels",
    "rounding at the ideal frame's border",
);
const BYTES: Tolerance = tolerance(
    "BYTES",
    ShareBeyond([1.5; 2]),
    [1.0 / 5000.0, 1e-2],
    "of the pixels by more than 1 DN",
    "one step where f32 rounds to the other side, more where `COLOR_FAR` counts",
);
const SOURCE_F32: Tolerance = tolerance(
    "SOURCE_F32",
    Maximum,
    [1.5e-4, 5e-4],
    "px",
    "f32 of coordinates up to 400 px: 3e-5 px a rounding",
);
const DEPTH_F32: Tolerance = tolerance("DEPTH_F32", Maximum, [1e-4; 2], "relative", "f32, source by f32");
const GATHER_MOST: Tolerance = tolerance(
    "GATHER_MOST",
    Maximum,
    [0.02; 2],
    "of full scale",
    "f32 may take one sample more where a path length is at the boundary between two counts",
);
const GATHER_SHARE: Tolerance = tolerance(
    "GATHER_SHARE",
    ShareBeyond([1e-3; 2]),
    [0.01; 2],
    "of the pixels",
    "pixels with one sample more are few",
);
const COPIED: Tolerance = tolerance("COPIED", Maximum, [1e-5; 2], "of full scale", "reads at texel centres");
const PHOTOMETRIC_F32: Tolerance =
    tolerance("PHOTOMETRIC_F32", Maximum, [2e-6; 2], "of full scale", "f32 with other operations fused");
const GATHER_F64: Tolerance = tolerance(
    "GATHER_F64",
    Maximum,
    // The largest distance of colours is 1e-6.
    [5.77e-7; 2],
    "of full scale",
    "f64, put out as f32",
);
const SOURCE_F64: Tolerance =
    tolerance("SOURCE_F64", Maximum, [5e-5; 2], "px", "f64, put out as f32 of coordinates up to 400 px");
const TWIST_F64: Tolerance =
    tolerance("TWIST_F64", Maximum, [2e-5; 2], "px", "f64, put out as f32 of coordinates up to 200 px");
const IDEAL_OTHER: Tolerance = tolerance(
    "IDEAL_OTHER",
    ShareBeyond([0.5; 2]),
    [2e-4; 2],
    "of the pixels",
    "rounding decides at borders of triangles",
);
const IDEAL_COLOR: Tolerance = tolerance(
    "IDEAL_COLOR",
    Rms,
    [0.2; 2],
    "DN",
    "0.12 were found, half of them half floats that are cut off",
);
const IDEAL_DEPTH: Tolerance = tolerance(
    "IDEAL_DEPTH",
    Rms,
    [3e-6, 1e-5],
    "relative",
    "f32, and the grid of thin triangles; circuits have the depth of the corners that they moved by 1/512 px",
);
const IDEAL_DEPTH_EXACT: Tolerance =
    tolerance("IDEAL_DEPTH_EXACT", Rms, [2e-6; 2], "relative", "f32, and the grid of the corners");
const IDEAL_DEPTH_GPU: Tolerance = tolerance(
    "IDEAL_DEPTH_GPU",
    Rms,
    [1e-5, 1e-4],
    "relative",
    "f32 of depths that are interpolated, 5e-6 where the camera is 30 cm above the ground",
);
const IDEAL_COLOR_OF_MEAN: Tolerance = tolerance(
    "IDEAL_COLOR_OF_MEAN",
    Rms,
    [3.0; 2],
    "DN",
    "half floats, and prefilters of pixels that are long on the ground: 2.4 DN from 30 cm, elsewhere 1.5",
);
const IDEAL_COLOR_EXACT: Tolerance = tolerance(
    "IDEAL_COLOR_EXACT",
    Rms,
    [1.02; 2],
    "of the gpu's error",
    "nearer by 2 % at least with one driver; others may be as near",
);
const SAMPLES_OTHER: Tolerance = tolerance(
    "SAMPLES_OTHER",
    ShareBeyond([16.0; 2]),
    [2e-3; 2],
    "of the pixels",
    "2.2e-4 were found; other drivers choose other sides at borders",
);
const SAMPLES_DEPTH: Tolerance = tolerance(
    "SAMPLES_DEPTH",
    ShareBeyond([1e-3; 2]),
    [2e-3; 2],
    "of the pixels",
    "2.2e-4 were found; other drivers choose other sides at borders",
);
const SAMPLES_COLOR: Tolerance =
    tolerance("SAMPLES_COLOR", Rms, [0.4; 2], "DN", "the gpu shades each triangle of a surface");
const SAMPLES_COLOR_OF_FILES: Tolerance =
    tolerance("SAMPLES_COLOR_OF_FILES", Rms, [0.5; 2], "DN", "the gpu shades each triangle of a surface");
const CAST_DEPTH: Tolerance =
    tolerance("CAST_DEPTH", Maximum, [9.99e-7; 2], "relative", "f64, put out as f32");
const CAST_COLOR: Tolerance =
    tolerance("CAST_COLOR", Maximum, [255e-5; 2], "DN", "f32 shading of magnified textures");
const OPAQUE_OTHER: Tolerance = tolerance(
    "OPAQUE_OTHER",
    ShareBeyond([0.5; 2]),
    [9.5 / 6912.0; 2],
    "of the pixels",
    "the rasteriser's corners stand on a grid of 1/256 px",
);
const OPAQUE_COLOR: Tolerance =
    tolerance("OPAQUE_COLOR", RmsOfMost, [0.15; 2], "DN", "half floats and the same grid");
const OPAQUE_SAMPLES_OTHER: Tolerance = tolerance(
    "OPAQUE_SAMPLES_OTHER",
    ShareBeyond([0.5; 2]),
    [11.5 / 6912.0; 2],
    "of the pixels",
    "the rasteriser's corners stand on a grid of 1/256 px",
);
const OPAQUE_SAMPLES_COLOR: Tolerance = tolerance(
    "OPAQUE_SAMPLES_COLOR",
    RmsOfMost,
    [0.5; 2],
    "DN",
    "the rasteriser shades a surface once a pixel",
);

const fn check(
    group: Group,
    stage: Stage,
    implementation: Implementation,
    reference: Reference,
    tolerance: &'static Tolerance,
) -> Check {
    Check { group, stage, implementation, reference, tolerance }
}

/// All checks.
#[rustfmt::skip]
pub static CHECKS: &[Check] = &[
    check(Group::Planned, Stage::LensMap, CpuVectorised, Twin, &LENS_MAP_CPU),
    check(Group::Planned, Stage::LensMap, CpuGeneral, Twin, &LENS_MAP_CPU),
    check(Group::Planned, Stage::LensMap, Gpu, Twin, &LENS_MAP_GPU),
    check(Group::Planned, Stage::RowTime, CpuVectorised, Twin, &ROW_TIME),
    check(Group::Planned, Stage::RowTime, CpuGeneral, Twin, &ROW_TIME),
    check(Group::Planned, Stage::RowTime, Gpu, Twin, &ROW_TIME),
    check(Group::Planned, Stage::Seen, CpuVectorised, Other(Gpu), &SEEN),
    check(Group::Planned, Stage::Source, CpuVectorised, Twin, &SOURCE_P99),
    check(Group::Planned, Stage::Source, CpuGeneral, Twin, &SOURCE_P99),
    check(Group::Planned, Stage::Source, Gpu, Twin, &SOURCE_P99),
    check(Group::Planned, Stage::Source, CpuVectorised, Other(Gpu), &SOURCE_P99),
    check(Group::Planned, Stage::Depth, CpuVectorised, Twin, &DEPTH_P99),
    check(Group::Planned, Stage::Depth, CpuGeneral, Twin, &DEPTH_P99),
    check(Group::Planned, Stage::Depth, Gpu, Twin, &DEPTH_P99),
    check(Group::Planned, Stage::Depth, CpuVectorised, Other(Gpu), &DEPTH_P99),
    check(Group::Planned, Stage::Point, CpuVectorised, Twin, &POINT_P99),
    check(Group::Planned, Stage::Point, CpuGeneral, Twin, &POINT_P99),
    check(Group::Planned, Stage::Point, Gpu, Twin, &POINT_P99),
    check(Group::Planned, Stage::Point, CpuVectorised, Other(Gpu), &POINT_P99),
    check(Group::Planned, Stage::Valid, CpuVectorised, Twin, &VALID),
    check(Group::Planned, Stage::Valid, CpuGeneral, Twin, &VALID),
    check(Group::Planned, Stage::Valid, Gpu, Twin, &VALID),
    check(Group::Planned, Stage::Color, CpuVectorised, Twin, &COLOR_FAR),
    check(Group::Planned, Stage::Color, CpuGeneral, Twin, &GATHER_F64),
    check(Group::Planned, Stage::Color, Gpu, Twin, &COLOR_FAR),
    check(Group::Planned, Stage::Color, CpuVectorised, Twin, &COLOR_RMS),
    check(Group::Planned, Stage::Color, Gpu, Twin, &COLOR_RMS),
    check(Group::Planned, Stage::Color, CpuVectorised, Other(Gpu), &COLOR_FAR),
    check(Group::Planned, Stage::Color, CpuVectorised, Other(Gpu), &COLOR_RMS),
    check(Group::Planned, Stage::ColorAlone, CpuVectorised, Twin, &EXACT),
    check(Group::Planned, Stage::Bytes, CpuVectorised, Twin, &BYTES),
    check(Group::Planned, Stage::Bytes, CpuGeneral, Twin, &BYTES),
    check(Group::Planned, Stage::Bytes, Gpu, Twin, &BYTES),
    check(Group::Smooth, Stage::Source, CpuVectorised, Twin, &SOURCE_F32),
    check(Group::Smooth, Stage::Source, CpuGeneral, Twin, &SOURCE_F64),
    check(Group::Smooth, Stage::Source, Gpu, Twin, &SOURCE_F32),
    check(Group::Smooth, Stage::Depth, CpuVectorised, Twin, &DEPTH_F32),
    check(Group::Smooth, Stage::Depth, CpuGeneral, Twin, &DEPTH_F32),
    check(Group::Smooth, Stage::Depth, Gpu, Twin, &DEPTH_F32),
    check(Group::Smooth, Stage::Color, CpuVectorised, Twin, &GATHER_MOST),
    check(Group::Smooth, Stage::Color, CpuGeneral, Twin, &GATHER_F64),
    check(Group::Smooth, Stage::Color, Gpu, Twin, &GATHER_MOST),
    check(Group::Smooth, Stage::Color, CpuVectorised, Twin, &GATHER_SHARE),
    check(Group::Smooth, Stage::Color, Gpu, Twin, &GATHER_SHARE),
    check(Group::Still, Stage::Color, CpuVectorised, Twin, &COPIED),
    check(Group::Still, Stage::Color, CpuGeneral, Twin, &COPIED),
    check(Group::Still, Stage::Color, Gpu, Twin, &COPIED),
    check(Group::Photometric, Stage::Photometric, CpuVectorised, Twin, &PHOTOMETRIC_F32),
    check(Group::Photometric, Stage::Photometric, CpuGeneral, Twin, &EXACT),
    check(Group::Photometric, Stage::Photometric, Gpu, Twin, &PHOTOMETRIC_F32),
    check(Group::HandMade, Stage::Valid, CpuVectorised, Twin, &EXACT),
    check(Group::HandMade, Stage::Valid, CpuGeneral, Twin, &EXACT),
    check(Group::HandMade, Stage::Source, CpuVectorised, Twin, &SOURCE_F32),
    check(Group::HandMade, Stage::Source, CpuGeneral, Twin, &SOURCE_F64),
    check(Group::HandMade, Stage::Color, CpuVectorised, Twin, &GATHER_MOST),
    check(Group::HandMade, Stage::Color, CpuVectorised, Twin, &GATHER_SHARE),
    check(Group::HandMade, Stage::Color, CpuGeneral, Twin, &GATHER_F64),
    check(Group::ConstantTwist, Stage::Source, CpuGeneral, Twin, &TWIST_F64),
    check(Group::ConstantTwist, Stage::Color, CpuGeneral, Twin, &GATHER_F64),
    check(Group::IdealPattern, Stage::IdealDepth, CpuVectorised, Twin, &IDEAL_DEPTH_EXACT),
    check(Group::IdealPattern, Stage::IdealDepth, CpuGeneral, Twin, &IDEAL_DEPTH_EXACT),
    check(Group::IdealPattern, Stage::IdealDepth, Gpu, Twin, &IDEAL_DEPTH_GPU),
    check(Group::IdealPattern, Stage::IdealColor, CpuVectorised, Twin, &IDEAL_COLOR_OF_MEAN),
    check(Group::IdealPattern, Stage::IdealColor, CpuGeneral, Twin, &IDEAL_COLOR_OF_MEAN),
    check(Group::IdealPattern, Stage::IdealColor, Gpu, Twin, &IDEAL_COLOR_OF_MEAN),
    check(Group::IdealPattern, Stage::IdealColor, CpuVectorised, TwinBesideGpu, &IDEAL_COLOR_EXACT),
    check(Group::IdealPattern, Stage::IdealColor, CpuGeneral, TwinBesideGpu, &IDEAL_COLOR_EXACT),
    check(Group::IdealPattern, Stage::IdealMark, CpuVectorised, Other(Gpu), &EXACT),
    check(Group::Ideal, Stage::IdealMark, CpuVectorised, Other(Gpu), &EXACT),
    check(Group::Ideal, Stage::IdealSurface, CpuVectorised, Other(Gpu), &IDEAL_OTHER),
    check(Group::Ideal, Stage::IdealColor, CpuVectorised, Other(Gpu), &IDEAL_COLOR),
    check(Group::Ideal, Stage::IdealDepth, CpuVectorised, Other(Gpu), &IDEAL_DEPTH),
    check(Group::Ideal, Stage::IdealMark, CpuGeneral, Other(Gpu), &EXACT),
    check(Group::Ideal, Stage::IdealSurface, CpuGeneral, Other(Gpu), &IDEAL_OTHER),
    check(Group::Ideal, Stage::IdealColor, CpuGeneral, Other(Gpu), &IDEAL_COLOR),
    check(Group::Ideal, Stage::IdealDepth, CpuGeneral, Other(Gpu), &IDEAL_DEPTH),
    check(Group::IdealFiles, Stage::IdealMark, CpuVectorised, Other(Gpu), &EXACT),
    check(Group::IdealFiles, Stage::IdealSurface, CpuVectorised, Other(Gpu), &IDEAL_OTHER),
    check(Group::IdealFiles, Stage::IdealColor, CpuVectorised, Other(Gpu), &IDEAL_COLOR),
    check(Group::IdealFiles, Stage::IdealDepth, CpuVectorised, Other(Gpu), &IDEAL_DEPTH),
    check(Group::IdealSamples, Stage::SampleColor, CpuVectorised, Other(Gpu), &SAMPLES_OTHER),
    check(Group::IdealSamples, Stage::SampleColor, CpuVectorised, Other(Gpu), &SAMPLES_COLOR),
    check(Group::IdealSamples, Stage::SampleDepth, CpuVectorised, Other(Gpu), &SAMPLES_DEPTH),
    check(Group::IdealSamples, Stage::SampleColor, CpuGeneral, Other(Gpu), &SAMPLES_OTHER),
    check(Group::IdealSamples, Stage::SampleColor, CpuGeneral, Other(Gpu), &SAMPLES_COLOR),
    check(Group::IdealSamples, Stage::SampleDepth, CpuGeneral, Other(Gpu), &SAMPLES_DEPTH),
    check(Group::IdealSamplesOfFiles, Stage::SampleColor, CpuVectorised, Other(Gpu), &SAMPLES_OTHER),
    check(Group::IdealSamplesOfFiles, Stage::SampleColor, CpuVectorised, Other(Gpu), &SAMPLES_COLOR_OF_FILES),
    check(Group::IdealSamplesOfFiles, Stage::SampleDepth, CpuVectorised, Other(Gpu), &SAMPLES_DEPTH),
    check(Group::Gallery, Stage::IdealColor, CpuGeneral, Twin, &CAST_COLOR),
    check(Group::Gallery, Stage::IdealDepth, CpuGeneral, Twin, &CAST_DEPTH),
    check(Group::Opaque, Stage::IdealSurface, CpuGeneral, Other(CpuVectorised), &OPAQUE_OTHER),
    check(Group::Opaque, Stage::IdealColor, CpuGeneral, Other(CpuVectorised), &OPAQUE_COLOR),
    check(Group::OpaqueSamples, Stage::IdealSurface, CpuGeneral, Other(CpuVectorised), &OPAQUE_SAMPLES_OTHER),
    check(Group::OpaqueSamples, Stage::IdealColor, CpuGeneral, Other(CpuVectorised), &OPAQUE_SAMPLES_COLOR),
];

/// What an implementation does not expose, and why; [`super::compare::run`] adds what a single case finds.
pub static UNEXPOSED: &[(&str, &str, &str)] = &[
    ("plans that no planner makes", "gpu", "a session renders plans of the planner only"),
    ("row records (rows.csv)", "every implementation", "the planner makes them; see `reference_rows.rs`"),
    ("silhouette rays", "every implementation", "compared in `silhouettes.rs` and `keys.rs`"),
    (
        "depth of constant twist",
        "every implementation",
        "compared with rays in `solvers.rs` and in camsim-cpu",
    ),
    ("colour without other channels", "cpu general, gpu", "compared for the vectorised cpu only"),
    ("exposure nodes", "every implementation", "seen through `Source` at a phase and through `Color`"),
    ("photometric stage", "every implementation", "its input is that of a second picture without effects"),
    (
        "ideal frames of scenarios in files",
        "cpu general",
        "it casts models and terrain at full detail, the others draw levels of detail",
    ),
];
