//! Magnetometer.

use glam::{DMat3, DVec3};
use world_magnetic_model::{
    GeomagneticField,
    time::{Date, Month},
    uom::si::{
        angle::radian,
        f32::{Angle, Length},
        length::meter,
        magnetic_flux_density::nanotesla,
    },
};

use super::{
    Earth, SampleClock, SampleTime, SensorError, SensorInput, SensorMount,
    errors::{AxisErrors, ErrorFigures, Normals, read_out},
};
use crate::{geodesy::Geodetic, scenario::MagnetometerSpec};

/// First stream of the errors.
const STREAM: u32 = 44;
/// Heights for which the World Magnetic Model is meant, metres above the ellipsoid.
const MODEL_HEIGHTS_M: [f64; 2] = [-1000.0, 850e3];

/// A magnetometer on a flight.
#[derive(Clone, Debug)]
pub struct Magnetometer {
    /// Its keys.
    pub spec: MagnetometerSpec,
    /// Its position and axes.
    pub mount: SensorMount,
    /// Its clock.
    pub clock: SampleClock,
    /// What the samples are made from.
    pub input: SensorInput,
    field: Field,
    soft_iron: DMat3,
    hard_iron_ut: DVec3,
    errors: AxisErrors,
}

/// A sample of a magnetometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerSample {
    /// Instant and stamp.
    pub time: SampleTime,
    /// Measured field in sensor axes, microtesla.
    pub mag_ut: DVec3,
    /// The Earth's field in sensor axes.
    pub true_mag_ut: DVec3,
    /// The Earth's field in the axes of the local frame.
    pub field_ned_ut: DVec3,
}

/// The Earth's field.
#[derive(Clone, Copy, Debug)]
enum Field {
    /// The same everywhere.
    Given(DVec3),
    /// The World Magnetic Model on a day.
    Model(Date),
}

impl Field {
    fn of(spec: &MagnetometerSpec) -> Result<Self, String> {
        if let Some(field_ned_ut) = spec.field_ned_ut {
            return Ok(Self::Given(DVec3::from_array(field_ned_ut)));
        }
        let [year, month, day] = spec.year_month_day().ok_or("it needs a date YYYY-MM-DD")?;
        let small = |value: u16| u8::try_from(value).map_err(|error| error.to_string());
        let month = Month::try_from(small(month)?).map_err(|error| error.to_string())?;
        Date::from_calendar_date(i32::from(year), month, small(day)?)
            .map(Self::Model)
            .map_err(|error| error.to_string())
    }

    /// The field at a point, in the axes of the local frame.
    fn at(&self, earth: &mut Earth, point_ned_m: DVec3) -> Result<DVec3, String> {
        let date = match self {
            Self::Given(field_ned_ut) => return Ok(*field_ned_ut),
            Self::Model(date) => *date,
        };
        let (Some(at), Some(frame)) = (earth.geodetic(point_ned_m), earth.frame()) else {
            return Err("the position is not known".into());
        };
        Ok(frame.ned_from_local(at) * model_field_ut(at, date)?)
    }
}

/// The World Magnetic Model: north, east, down at `at`, microtesla.
fn model_field_ut(at: Geodetic, date: Date) -> Result<DVec3, String> {
    let height_m = at.height_m.clamp(MODEL_HEIGHTS_M[0], MODEL_HEIGHTS_M[1]);
    let field = GeomagneticField::new(
        Length::new::<meter>(height_m as f32),
        Angle::new::<radian>(at.lat_rad as f32),
        Angle::new::<radian>(at.lon_rad as f32),
        date,
    )
    .map_err(|error| error.to_string())?;
    let [north, east, down] = [field.x(), field.y(), field.z()].map(|b| f64::from(b.get::<nanotesla>()));
    Ok(DVec3::new(north, east, down) * 1e-3)
}

impl Magnetometer {
    pub(super) fn new(spec: &MagnetometerSpec, seed: u64, input: &SensorInput) -> Result<Self, SensorError> {
        let keys = [spec.rate_hz, spec.clock_offset_ms, spec.jitter_ms];
        let clock = SampleClock::new(("magnetometer", &spec.name), keys, seed, input)?;
        if spec.field_ned_ut.is_none() {
            input.check_position("magnetometer", &spec.name, "date")?;
        }
        let no_field = |problem| SensorError::NoField { name: spec.name.clone(), problem };
        let field = Field::of(spec).map_err(no_field)?;
        let start_ned_m = input.trajectory.state(input.span_s[0]).position_ned_m;
        field.at(&mut input.earth.clone(), start_ned_m).map_err(no_field)?;
        let figures = ErrorFigures { white: DVec3::from_array(spec.sigma_ut.0), ..ErrorFigures::default() };
        Ok(Self {
            mount: SensorMount::new(&spec.mount, spec.axes),
            errors: AxisErrors::new(Normals::new(seed, &spec.name), STREAM, &figures),
            soft_iron: DMat3::from_cols_array(&spec.soft_iron).transpose(),
            hard_iron_ut: DVec3::from_array(spec.hard_iron_ut),
            spec: spec.clone(),
            clock,
            input: input.clone(),
            field,
        })
    }

    /// All samples in order.
    pub fn samples(&self) -> impl Iterator<Item = MagnetometerSample> + '_ {
        let mut earth = self.input.earth.clone();
        self.clock.times().map(move |time| {
            let motion = self.mount.motion(&self.input.trajectory.state(time.t_s));
            // Day and heights suit the model, as `new` has checked and `model_field_ut` sees to.
            let field_ned_ut = self.field.at(&mut earth, motion.position_ned_m).unwrap_or(DVec3::NAN);
            let true_mag_ut = motion.ned_from_sensor.inverse() * field_ned_ut;
            let value = self.soft_iron * true_mag_ut + self.hard_iron_ut + self.errors.white(time.sample);
            let (step, range) = (self.spec.quantisation_ut, self.spec.range_ut);
            let mag_ut = DVec3::from_array(value.to_array().map(|axis| read_out(axis, step, range)));
            MagnetometerSample { time, mag_ut, true_mag_ut, field_ned_ut }
        })
    }
}
