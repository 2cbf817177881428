//! Tables of `docs/reference/inputs/APPLY.md`: the keys of FRAME.toml, and the treatment of metadata in its
//! files.

/// A key, and the values that it takes.
type KeyTreatment = (&'static str, &'static str);

/// Keys of FRAME.toml.
const KEYS: &[KeyTreatment] = &[
    (
        "frames",
        "a table of `time color` or `time color time depth`, or a .csv of color, depth and t_s (t_ms, t_us, \
            t_ns, stamp_ns)",
    ),
    ("name_unit", "`s`, `ms`, `us`, `ns`: what stands for the * in names is a time"),
    ("fps", "times for frames that have none"),
    ("max_gap_ms", "how far depth may be from its colour in time; 20 if omitted"),
    ("color", "EXR, PNG (8 and 16 bits), JPEG, BMP, PNM, GIF, TIFF, WebP; a pattern with *, or a list"),
    ("color_channels", "of an EXR: one name (grey) or three"),
    ("color_layer", "of an EXR"),
    (
        "color_space",
        "`srgb` or `linear`; omitted: linear for EXR, sRGB for others; asked for where a TIFF is of floats \
            or a PNG states another gamma",
    ),
    ("depth", "EXR, PFM, TIFF, .npy, 16-bit PNG or PGM; packed: PNG, BMP, PPM; a pattern, or a list"),
    ("depth_channel", "of an EXR"),
    ("depth_layer", "of an EXR"),
    (
        "depth_encoding",
        "`plain`; `packed24`: metres are (65025 R + 255 G + B) / 255; `carla`: 1000 (R + 256 G + 65536 B) / \
            16777215. An RGB picture without it is refused",
    ),
    (
        "depth_per_metre",
        "the stored value of one metre: depth is the number stored over it. Needed for whole numbers; of \
            floats 1 if omitted, but asked for where all of them are whole numbers above 100, as \
            millimetres are. With `inverse`: the stored value of 1/m, always needed",
    ),
    ("depth_rows", "of a PFM: `bottom-up`, as the format says, or `top-down`; asked for"),
    ("depth_max_m", "what is as far, or farther, is no depth"),
    (
        "depth_kind",
        "`planar`: along the optical axis; `range`: along the ray; `inverse`: depth_per_metre over the \
            number stored, planar. Of disparities depth_per_metre is focal length in pixels times baseline \
            in metres",
    ),
    ("holes", "`far`, `nearest`, `mark`: what is taken where there is no depth"),
    ("focal_px", "of the ideal frame"),
    (
        "principal_point_px",
        "from the first pixel's centre; omitted: the middle of the picture, of an EXR that of its display \
            window",
    ),
    ("instant_ms", "when it was taken, from its stamp"),
    ("motion.velocity_m_s", "in camera axes"),
    ("motion.angular_rate_rad_s", "in camera axes"),
    ("motion.trajectory", "a table of poses"),
    ("motion.trajectory_format", "`csv` or `tum`"),
    ("motion.stamp_s", "the frame's time on the trajectory's clock"),
    ("motion.flow", "Middlebury .flo, an EXR of two channels, or a .npy of (H, W, 2) or (2, H, W)"),
    ("motion.flow_channels", "of an EXR: right and down"),
    ("motion.flow_scale", "times this are pixels right and down"),
    ("motion.flow_interval_ms", "the time that the flow takes; needed"),
    ("fog.end_m", "with --preset paper"),
    ("fog.color", "with --preset paper"),
];

/// Metadata in files: what, treatment, remark.
const FILES: &[(&str, &str, &str)] = &[
    (
        "PFM: scale",
        "applied",
        "its sign is the byte order; its magnitude is a factor of every number, and a warning tells of it \
            where it is not 1",
    ),
    ("PFM of three channels (`PF`)", "refused", "depth is of one"),
    ("TIFF: GDAL_NODATA", "applied", "what is that number is no depth"),
    (
        "TIFF: SCALE, OFFSET, UNITTYPE (GDAL_METADATA, `.aux.xml`)",
        "applied",
        "`scale x stored + offset` in that unit, metres where none is stated; a warning tells of them. \
            Refused where depth_per_metre says another, or the unit is not known",
    ),
    ("TIFF: mask of its own, `.msk`", "applied", "pixels beyond the mask have no depth"),
    ("PNG of depth: sBIT, pCAL, sCAL", "named", ""),
    (
        "TIFF: kinds of samples",
        "applied",
        "16, 32 and 64-bit floats, 16-bit whole numbers; others are refused",
    ),
    (".npy: descr", "applied", "f2, f4, f8, u2, u4, i2, i4, i8 in both byte orders; others are refused"),
    (".npy: fortran_order, shape", "applied", "(H, W), (H, W, 1), (1, H, W); other shapes are refused"),
    (".npz", "refused", "the line of Python that takes an array out of it is in the message"),
    ("8-bit grey depth", "refused", "256 steps are no distances"),
    ("EXR: channel named disparity or inverse", "refused", "unless depth_kind is `inverse`"),
    (
        "EXR: data window, display window",
        "applied",
        "colour, depth and flow must cover the same pixels; the optical axis is in the middle of the display",
    ),
    ("EXR: pixelAspectRatio", "named", "where it is not 1 and focal_px says otherwise"),
    ("EXR: chromaticities", "named", "where they are not those of sRGB"),
    ("EXR: subsampled or deep channels", "refused", ""),
    (
        "EXIF orientation of colour or depth",
        "refused",
        "a turned picture and its depth may be of either sense",
    ),
    ("ICC profile", "named", "unless it is one of sRGB"),
    ("PNG: gAMA", "refused", "where it is not that of sRGB and color_space is omitted"),
    (
        "PNG: cICP",
        "refused",
        "where its curve is not that of sRGB and color_space is omitted; else named where it is not 1, 13, \
            0, 1",
    ),
    ("PNG: cHRM", "named", "where it is not that of sRGB"),
    (
        "colours of 16 bits that end below 16384",
        "named",
        "as those of 10, 12 or 14 bits do, with their white",
    ),
    ("alpha of colour", "named", "where a pixel has some below 1"),
    (
        "poses: header",
        "applied",
        "t, time, timestamp or stamp with _s, _ms, _us, _ns, _min; x, tx or px with _m, _mm, _cm, _km, _ft, \
            _in; qw to qz in any order. `[ms]` and `(ms)` do as well as `_ms`",
    ),
    ("poses: time without a unit, two columns of one quantity, an unknown unit", "refused", ""),
    ("poses: other columns", "named", ""),
    ("poses: quaternions off unit length", "applied", "made unit where within 1 %; refused beyond"),
    ("poses in TUM's order: a comment that names eight columns", "applied", "their order and units"),
    ("times beyond 1e11 s", "refused", "they count milliseconds or less"),
    ("frames.csv: other columns", "named", "but for those of camsim's own tables"),
    ("flow: not a number, or beyond 1e9", "applied", "not known: nothing is shown there"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame_file::schema::FRAME;

    fn page() -> String {
        let keys: String = KEYS.iter().map(|(key, what)| format!("| `{key}` | {what} |\n")).collect();
        let files: String =
            FILES.iter().map(|(what, how, note)| format!("| {what} | {how} | {note} |\n")).collect();
        format!(
            "# What `camsim apply` takes, and what becomes of it\n\n\
             Made from `crates/camsim-io/src/frame_file/treatments.rs`; [APPLY.md](../../guide/APPLY.md) \
             tells how it is used.\n\n\
             ## Keys of FRAME.toml\n\nAll are applied; a key that is not here is refused, with the nearest \
             that is.\n\n| key | what it takes |\n|---|---|\n{keys}\n\
             ## What files say of themselves\n\n*Applied*: it does what it says. *Refused*: an error that \
             names it and what to do. *Named*: a warning.\n\n\
             | what | treatment | |\n|---|---|---|\n{files}"
        )
    }

    #[test]
    fn apply_md_is_up_to_date_and_has_every_key() {
        let keys = KEYS.iter().map(|(key, _)| *key);
        assert!(keys.eq(FRAME.keys.iter().map(|(key, _)| *key)), "a key is in one table alone");
        crate::inputs_page::check("APPLY.md", &page());
    }
}
