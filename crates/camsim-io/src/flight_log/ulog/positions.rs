//! The positions of a PX4 topic.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightHeight, FlightSpec, HeightReference},
};

use super::{
    super::streams::{self, Stream},
    file::{Topic, UlogField},
};

/// Radius of PX4's projection.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// The fields of a position.
#[derive(Clone, Copy, Debug)]
pub(super) enum PositionFields {
    /// Latitude and longitude with a factor to degrees, and heights with a factor to metres.
    Geodetic {
        plane: [UlogField; 2],
        plane_factor: f64,
        msl: UlogField,
        ellipsoid: Option<UlogField>,
        height_factor: f64,
    },
    /// North, east, down.
    Local([UlogField; 3]),
}

impl PositionFields {
    pub(super) fn of(topic: &Topic<'_>) -> Option<Self> {
        let both = |a: &str, b: &str| Some([topic.field(a)?, topic.field(b)?]);
        if let Some(plane) = both("latitude_deg", "longitude_deg") {
            let (msl, ellipsoid) = (topic.field("altitude_msl_m")?, topic.field("altitude_ellipsoid_m"));
            return Some(Self::Geodetic { plane, plane_factor: 1.0, msl, ellipsoid, height_factor: 1.0 });
        }
        if let Some(plane) = both("lat", "lon") {
            let (msl, ellipsoid) = (topic.field("alt")?, topic.field("alt_ellipsoid"));
            // Receivers have whole numbers of 1e-7 degrees and of millimetres.
            let is_whole = topic.field("fix_type").is_some();
            let (plane_factor, height_factor) = if is_whole { (1e-7, 1e-3) } else { (1.0, 1.0) };
            return Some(Self::Geodetic { plane, plane_factor, msl, ellipsoid, height_factor });
        }
        if let (Some([x, y]), Some(z)) = (both("x", "y"), topic.field("z")) {
            return Some(Self::Local([x, y, z]));
        }
        topic.array_field("position").map(Self::Local)
    }
}

/// The fields of a topic of positions.
#[derive(Debug)]
pub(super) struct PositionReader {
    time: UlogField,
    fields: PositionFields,
    /// Quality of the fix of a receiver.
    fix: Option<UlogField>,
    /// Whether a position is valid.
    valid: Vec<UlogField>,
    /// Whether the estimate goes on without any measurement of the position.
    dead_reckoning: Option<UlogField>,
    /// Counters of jumps of the estimate.
    resets: Vec<UlogField>,
    /// Latitude, longitude (deg) and height of the origin of local positions.
    reference: Option<[UlogField; 3]>,
    /// w, x, y, z.
    pub(super) quaternion: Option<[UlogField; 4]>,
    uses_ellipsoid: bool,
}

impl PositionReader {
    pub(super) fn new(topic: &Topic<'_>, spec: &FlightSpec, notes: &mut Vec<Note>) -> Result<Self, String> {
        let fields = PositionFields::of(topic).ok_or_else(|| format!("`{}` has no positions", topic.name))?;
        let time = time_field(topic)?;
        let all = |names: &[&str]| names.iter().filter_map(|name| topic.field(name)).collect::<Vec<_>>();
        let reference = match fields {
            PositionFields::Local(_) => reference_fields(topic),
            PositionFields::Geodetic { .. } => None,
        };
        let has_ellipsoid = |field: UlogField| {
            topic.messages.iter().any(|(_, message)| {
                let height = field.read(message);
                height.is_finite() && height != 0.0
            })
        };
        let uses_ellipsoid = spec.height == FlightHeight::Ellipsoid
            && matches!(fields, PositionFields::Geodetic { ellipsoid: Some(field), .. } if has_ellipsoid(field));
        let is_geodetic = reference.is_some() || matches!(fields, PositionFields::Geodetic { .. });
        if is_geodetic && !uses_ellipsoid {
            notes.extend(streams::height_note(
                &format!("heights of `{}`", topic.name),
                HeightReference::Msl,
                spec,
            ));
        }
        let quaternion = match fields {
            PositionFields::Local(_) if topic.field("position[0]").is_some() => {
                let frame = topic.field("pose_frame").or(topic.field("local_frame"));
                let frames: Vec<f64> = frame
                    .map_or(Vec::new(), |frame| topic.messages.iter().map(|(_, m)| frame.read(m)).collect());
                refuse_foreign_frame(topic, &frames)?;
                topic.array_field("q")
            }
            _ => None,
        };
        let mut valid = all(&["xy_valid", "z_valid", "lat_lon_valid", "alt_valid"]);
        if reference.is_some() {
            valid.extend(all(&["xy_global", "z_global"]));
        }
        Ok(Self {
            time,
            fields,
            fix: topic.field("fix_type"),
            valid,
            dead_reckoning: topic.field("dead_reckoning"),
            resets: all(&[
                "xy_reset_counter",
                "z_reset_counter",
                "lat_lon_reset_counter",
                "alt_reset_counter",
                "reset_counter",
            ]),
            reference,
            quaternion,
            uses_ellipsoid,
        })
    }

    pub(super) fn is_geodetic(&self) -> bool {
        self.reference.is_some() || matches!(self.fields, PositionFields::Geodetic { .. })
    }

    /// The positions; those that the log itself calls invalid are skipped, with a note.
    pub(super) fn stream(&self, topic: &Topic<'_>, notes: &mut Vec<Note>) -> Stream {
        let mut rows = Vec::with_capacity(topic.messages.len());
        let (mut left_out, mut reckoned) = (0, 0);
        let mut resets: Vec<usize> = Vec::new();
        let mut counters: Option<Vec<f64>> = None;
        for &(number, message) in &topic.messages {
            let invalid = self.valid.iter().any(|field| field.read(message) == 0.0)
                || self.fix.is_some_and(|fix| fix.read(message) < 3.0);
            if invalid {
                left_out += 1;
                continue;
            }
            reckoned += usize::from(self.dead_reckoning.is_some_and(|field| field.read(message) == 1.0));
            let now: Vec<f64> = self.resets.iter().map(|field| field.read(message)).collect();
            if counters.as_ref().is_some_and(|before| *before != now) {
                resets.push(number);
            }
            counters = Some(now);
            let mut row = streams::empty_row(number, time_ns(self.time.read(message)));
            row.position = self.position(message);
            if let Some(q) = self.quaternion {
                row.attitude = xyzw(q.map(|field| field.read(message)));
            }
            rows.push(row);
        }
        let name = full_name(topic);
        if left_out > 0 {
            notes.push(Note::warning(format!(
                "{left_out} of {} positions of `{name}` are marked as invalid or without a 3D fix, and \
                        are skipped",
                topic.messages.len()
            )));
        }
        if reckoned > 0 {
            notes.push(Note::warning(format!(
                "{reckoned} of {} positions of `{name}` are dead reckoning (without GNSS or another \
                        position), and drift",
                topic.messages.len()
            )));
        }
        if let Some(first) = resets.first() {
            notes.push(Note::warning(format!(
                "the estimator moved the positions of `{name}` at once {} times, first at message \
                        {first}: the flight jumps there",
                resets.len()
            )));
        }
        Stream { name, rows }
    }

    fn position(&self, message: &[u8]) -> [f64; 3] {
        match self.fields {
            PositionFields::Geodetic { plane: [lat, lon], plane_factor, msl, ellipsoid, height_factor } => {
                let height = if self.uses_ellipsoid { ellipsoid.unwrap_or(msl) } else { msl };
                [
                    lat.read(message) * plane_factor,
                    lon.read(message) * plane_factor,
                    height.read(message) * height_factor,
                ]
            }
            PositionFields::Local(fields) => {
                let ned = fields.map(|field| field.read(message));
                match self.reference {
                    Some(reference) => geodetic_from_local(ned, reference.map(|field| field.read(message))),
                    None => ned,
                }
            }
        }
    }
}

/// Fields of the origin of local positions, if the log has a usable one.
fn reference_fields(topic: &Topic<'_>) -> Option<[UlogField; 3]> {
    let fields = [topic.field("ref_lat")?, topic.field("ref_lon")?, topic.field("ref_alt")?];
    let flags: Vec<UlogField> =
        ["xy_global", "z_global"].iter().filter_map(|name| topic.field(name)).collect();
    let is_global = |message: &[u8]| {
        let [lat, lon, alt] = fields.map(|field| field.read(message));
        lat.is_finite()
            && lon.is_finite()
            && alt.is_finite()
            && (lat, lon) != (0.0, 0.0)
            && flags.iter().all(|flag| flag.read(message) != 0.0)
    };
    topic.messages.iter().any(|(_, message)| is_global(message)).then_some(fields)
}

/// Geodetic position, in degrees and metres, from north, east, down about an origin: PX4's azimuthal
/// equidistant projection on a sphere, reversed.
fn geodetic_from_local([north, east, down]: [f64; 3], [lat, lon, height]: [f64; 3]) -> [f64; 3] {
    let (x, y) = (north / EARTH_RADIUS_M, east / EARTH_RADIUS_M);
    let angle = x.hypot(y);
    if angle == 0.0 {
        return [lat, lon, height - down];
    }
    let (sin, cos) = angle.sin_cos();
    let (sin_lat, cos_lat) = lat.to_radians().sin_cos();
    let latitude = (cos * sin_lat + x * sin * cos_lat / angle).asin();
    let longitude = (y * sin).atan2(angle * cos_lat * cos - x * sin_lat * sin);
    [latitude.to_degrees(), lon + longitude.to_degrees(), height - down]
}

/// Refuses odometry in a frame other than north-east-down.
fn refuse_foreign_frame(topic: &Topic<'_>, frames: &[f64]) -> Result<(), String> {
    // 1 is north-east-down in `pose_frame`; 0 is that in the older `local_frame`.
    let ned = if topic.field("pose_frame").is_some() { 1.0 } else { 0.0 };
    if frames.iter().any(|&frame| frame != ned) {
        return Err(format!(
            "`{}` is not in north-east-down (another frame in {}): choose another position by flight.topic",
            topic.name,
            if ned == 1.0 { "pose_frame" } else { "local_frame" }
        ));
    }
    Ok(())
}

pub(super) fn time_field(topic: &Topic<'_>) -> Result<UlogField, String> {
    let sample = topic
        .field("timestamp_sample")
        .filter(|field| topic.messages.iter().all(|(_, message)| field.read(message) > 0.0));
    sample.or(topic.field("timestamp")).ok_or_else(|| format!("`{}` has no timestamp", topic.name))
}

/// Nanoseconds of a time in microseconds.
pub(super) fn time_ns(microseconds: f64) -> Option<i128> {
    (microseconds.is_finite() && microseconds > 0.0 && microseconds < 9e15)
        .then_some((microseconds * 1e3) as i128)
}

/// Name of a topic with its instance.
pub(super) fn full_name(topic: &Topic<'_>) -> String {
    if topic.is_merged || topic.instance == 0 {
        topic.name.clone()
    } else {
        format!("{}#{}", topic.name, topic.instance)
    }
}

/// The order of camsim's quaternions.
pub(super) fn xyzw([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [x, y, z, w]
}
