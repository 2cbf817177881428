//! The lists of the tables of frames, timing, objects and tracks. Readers of the files go by the names: they stay.

use super::{FrameRecord, ObjectRecord, PointRecord, TimingRecord, TrackRecord};
use crate::columns::{
    Column,
    Get::{Flag, Index, MaybeNumber, Ned, Number, Text, Whole, Wxyz},
    Part::{Exposures, Geodetic, Instants, Motion},
    TableRow, column, of, plain,
};

const AUTO: &str = "with `[camera.auto_exposure]`";
const ON_EARTH: &str = "where the log has an origin";

impl TableRow for FrameRecord {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("frame", "number of the frame", Whole(|row| row.frame as i64)),
        plain("stamp_ns", "stamp on the camera's clock", Whole(|row| row.stamp_ns)),
        column("position_ned_m", "*", "the optical centre at the stamp", Ned(|row| row.pose.position_ned_m)),
        column("ned_from_camera_wxyz", "q*", "the attitude then", Wxyz(|row| row.pose.ned_from_camera)),
        // The pinhole frame that `x y` of `coords` are pixels of.
        plain("ideal_width_px", "width of the frame of `coords`", Index(|row| row.source.size_px[0])),
        plain("ideal_height_px", "its height", Index(|row| row.source.size_px[1])),
        plain("ideal_fx_px", "its focal length", Number(|row| row.source.focal_px[0])),
        plain("ideal_fy_px", "its focal length", Number(|row| row.source.focal_px[1])),
        plain("ideal_cx_px", "its principal point", Number(|row| row.source.principal_px[0])),
        plain("ideal_cy_px", "its principal point", Number(|row| row.source.principal_px[1])),
        plain("ideal_t_ns", "its instant on the clock of stamps", Whole(|row| row.source.t_ns)),
        column("ideal_position_ned_m", "ideal_*", "its centre", Ned(|row| row.source.pose.position_ned_m)),
        column("ideal_wxyz", "ideal_q*", "its attitude", Wxyz(|row| row.source.pose.ned_from_camera)),
        // On Earth: with a log of latitudes and longitudes, or `flight.origin`, whose vertical datum heights have.
        of(
            Geodetic,
            plain("lat_deg", "at the stamp (WGS-84)", MaybeNumber(|row| Some(row.geodetic?.lat_deg()))),
        ),
        of(Geodetic, plain("lon_deg", "at the stamp", MaybeNumber(|row| Some(row.geodetic?.lon_deg())))),
        of(
            Geodetic,
            plain("height_m", "as `flight.origin`'s", MaybeNumber(|row| Some(row.geodetic?.height_m))),
        ),
        of(Exposures, plain("exposure_ms", AUTO, MaybeNumber(|row| Some(1e3 * row.exposure?.time_s)))),
        of(Exposures, plain("gain", AUTO, MaybeNumber(|row| Some(row.exposure?.gain)))),
        of(
            Instants,
            plain("instant", "number within the burst", MaybeNumber(|row| row.instant.map(f64::from))),
        ),
    ];
}

impl TableRow for TimingRecord {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("frame", "number of the frame", Whole(|row| row.frame as i64)),
        plain("delivery", "`own`, `dropped`, `doubled` or `missed`", Text(|row| row.delivery)),
        plain("picture", "number of the frame whose picture it shows", Whole(|row| row.picture as i64)),
        plain("nominal_ns", "when a trigger was meant to be, by trajectories", Whole(|row| row.nominal_ns)),
        // Row times are relative to it, as they are to the stamp of a faultless camera.
        plain("trigger_ns", "when it was; rows are relative to it", Whole(|row| row.trigger_ns)),
        plain("stamp_ns", "what the camera writes", Whole(|row| row.stamp_ns)),
    ];
}

impl TableRow for ObjectRecord {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("number", "what `object` has, from 1", Index(|row| row.number)),
        plain("name", "its name, which need not be its own alone", Text(|row| &row.object.name)),
        plain("class", "what `class` has; 0 = none", Index(|row| row.object.class.into())),
    ];
}

impl TableRow for PointRecord {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("point", "number of the point, from 0", Index(|row| row.number)),
        plain("name", "its name in its source", Text(|row| &row.point.name)),
        plain("source", "`terrain`, `vertices`, `board` or a table", Text(|row| &row.point.source)),
        column("position_ned_m", "*_m", "at path time 0 if it moves", Ned(|row| row.point.position_ned_m)),
        of(Motion, plain("moves", "if any point does", Flag(|row| row.point.moves_with.is_some()))),
        of(Geodetic, plain("lat_deg", ON_EARTH, MaybeNumber(|row| Some(row.geodetic?[0])))),
        of(Geodetic, plain("lon_deg", ON_EARTH, MaybeNumber(|row| Some(row.geodetic?[1])))),
        of(Geodetic, plain("height_m", "as heights of the log", MaybeNumber(|row| Some(row.geodetic?[2])))),
    ];
}

impl TableRow for TrackRecord {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("frame", "number in `frames.csv`", Whole(|row| row.frame as i64)),
        plain("point", "number in `points.csv`", Whole(|row| row.sighting.point as i64)),
        plain("x_px", "0, 0 is the centre of the first pixel", Number(|row| row.sighting.seen.px.x)),
        plain("y_px", "likewise", Number(|row| row.sighting.seen.px.y)),
        plain("t_ns", "when the point is seen, on the clock of stamps", Whole(|row| row.t_ns)),
        plain("depth_m", "planar, in the camera at that instant", Number(|row| row.sighting.seen.depth_m)),
        plain("visible", "0 if a surface is in front of it", Flag(|row| row.sighting.is_visible)),
        plain("solutions", "lines of this point and frame", Index(|row| row.sighting.seen.solutions)),
    ];
}
