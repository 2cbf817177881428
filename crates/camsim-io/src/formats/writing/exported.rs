//! The formats, and what each cannot hold.

use camsim_core::{
    pose::FLU_FROM_FRD,
    scenario::{CameraSpec, Readout, Reset},
};
use toml::{Table, Value};

use super::{Calibration, CalibrationError, CalibrationFormat, ImuReference};
use crate::formats::axes::Rigid;

/// A format of calibrations that can be written.
pub(crate) struct Writer {
    /// Name, as in `--as`.
    pub(crate) name: &'static str,
    /// The usual name of its file.
    pub(crate) file_name: &'static str,
    pub(crate) content: Content,
    /// What it has a field for, beside camera matrix and lens: a lens that it does not have is an error.
    pub(crate) fields: &'static [Field],
    /// What readers of the file should know.
    pub(crate) note: fn(&Calibration) -> Option<String>,
}

/// What writes a file, with the axes and the clock to which poses refer.
pub(crate) enum Content {
    /// Of one camera.
    One(fn(&Calibration, &ImuReference) -> Result<String, CalibrationError>),
    /// Of several cameras.
    Rig(fn(&[Calibration], &ImuReference) -> Result<String, CalibrationError>),
    /// Two pictures.
    Pictures(fn(&Calibration) -> Result<[CalibrationFile; 2], CalibrationError>),
}

/// Something that a format may have a field for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Field {
    Name,
    /// Names `cam0`, `cam1`, ... by the order of the cameras.
    Number,
    Pose,
    /// The time between stamps of the camera and those of an inertial sensor.
    TimeShift,
    /// The readout in these directions.
    Readout(&'static [Readout]),
    Rate,
    WholeRate,
}

impl Writer {
    pub(crate) const fn new(
        name: &'static str,
        file_name: &'static str,
        content: Content,
        fields: &'static [Field],
    ) -> Self {
        Self { name, file_name, content, fields, note: |_| None }
    }

    /// Whether it has the readout of a camera.
    fn has_readout(&self, spec: &CameraSpec) -> bool {
        let is_held = |field: &Field| match field {
            Field::Readout(directions) => directions.contains(&spec.shutter.readout),
            _ => false,
        };
        // Rows that begin at once are exposed half as far apart as they are read, which no format says.
        spec.shutter.reset != Reset::Global && self.fields.iter().any(is_held)
    }

    /// Whether the file holds a key of the camera at an index.
    fn holds(&self, spec: &CameraSpec, i: usize, key: &str) -> bool {
        let has = |field| self.fields.contains(&field);
        match key {
            "size_px" | "focal_px" | "principal_point_px" => true,
            "name" => has(Field::Name) || has(Field::Number) && spec.name == format!("cam{i}"),
            "fps" => has(Field::Rate) || has(Field::WholeRate) && spec.fps.fract() == 0.0,
            "clock_offset_ms" | "shutter.delay_ms" => has(Field::TimeShift),
            "shutter.readout_ms" | "shutter.readout" | "shutter.line_time_us" => self.has_readout(spec),
            "mount.angles_deg" | "mount.offset_m" => has(Field::Pose),
            key => key.starts_with("lens"),
        }
    }
}

impl CalibrationFormat {
    /// Whether a file holds several cameras.
    #[must_use]
    pub fn is_rig(self) -> bool {
        matches!(self.row().content, Content::Rig(_))
    }
}

/// A file of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CalibrationFile {
    /// Its usual name.
    pub name: &'static str,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// A calibration in a format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// Its files; one, but for STmaps.
    pub files: Vec<CalibrationFile>,
    /// What the format cannot hold, and what it has in another form.
    pub notes: Vec<String>,
}

/// The cameras in a format. Poses and clocks refer to the platform: x forward, y left, z up.
///
/// # Errors
/// The format holds one camera, or does not have the lens of one of them.
pub fn export(cameras: &[CameraSpec], format: CalibrationFormat) -> Result<Exported, CalibrationError> {
    let all = cameras.iter().map(Calibration::new).collect::<Result<Vec<_>, _>>()?;
    let platform = ImuReference { body_from_imu: Rigid::turn(FLU_FROM_FRD), clock_offset_s: 0.0 };
    let one = match &all[..] {
        [one] => Ok(one),
        _ => Err(CalibrationError::Refused(format!(
            "{} holds one camera, and there are {} ({}): choose one with `--camera`",
            format.name(),
            all.len(),
            cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ")
        ))),
    };
    let writer = format.row();
    let text = match writer.content {
        Content::One(write) => write(one?, &platform)?,
        Content::Rig(write) => write(&all, &platform)?,
        Content::Pictures(write) => {
            return Ok(Exported { files: write(one?)?.into(), notes: notes(&all, writer)? });
        }
    };
    let file = CalibrationFile { name: writer.file_name, bytes: text.into_bytes() };
    Ok(Exported { files: vec![file], notes: notes(&all, writer)? })
}

/// What the file lacks, and what it has in another form.
fn notes(cameras: &[Calibration], writer: &Writer) -> Result<Vec<String>, CalibrationError> {
    let mut notes = Vec::new();
    for (i, camera) in cameras.iter().enumerate() {
        let spec = &camera.spec;
        let lost = lost(spec, i, writer)?;
        if !lost.is_empty() {
            notes.push(format!(
                "left out of {}, which cannot hold it: {} of {}",
                writer.name,
                lost.join(", "),
                camera.label()
            ));
        }
        if writer.fields.contains(&Field::TimeShift) && spec.shutter.delay_ms != 0.0 {
            notes.push(format!(
                "shutter.delay_ms and clock_offset_ms of {} are written as one shift of its stamps: read back, it is a \
                 clock_offset_ms of {}",
                camera.label(),
                -1e3 * camera.stamp_to_centre_s()
            ));
        }
    }
    notes.extend(cameras.iter().filter_map(writer.note));
    if writer.fields.contains(&Field::Pose) {
        notes.push("poses refer to the platform as x forward, y left, z up".to_owned());
    }
    Ok(notes)
}

/// Keys of a camera, by its index in the file, that differ from the default and that a format does not hold, with
/// their values.
fn lost(spec: &CameraSpec, i: usize, writer: &Writer) -> Result<Vec<String>, CalibrationError> {
    let table = |spec: &CameraSpec| {
        Table::try_from(spec).map_err(|error| CalibrationError::Refused(format!("{}: {error}", spec.name)))
    };
    let default = leaves(&table(&CameraSpec::default())?);
    let own = leaves(&table(spec)?);
    let differs = own.iter().filter(|leaf| !default.contains(leaf));
    Ok(differs
        .filter(|(key, _)| !writer.holds(spec, i, key))
        .map(|(key, value)| format!("{key} = {value}"))
        .collect())
}

/// Keys with their values, by dotted paths.
fn leaves(table: &Table) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(below) => {
                found.extend(leaves(below).into_iter().map(|(name, value)| (format!("{key}.{name}"), value)));
            }
            value => found.push((key.clone(), value.clone())),
        }
    }
    found
}
