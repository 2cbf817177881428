//! Satellite receivers, barometers and magnetometers as tables of what they measured.

use std::io::Write;

use super::csv_rows::CsvRows;
use super::imu::{SensorDescription, descriptions};
use super::{DatasetError, ExportJob};
use crate::columns::{T_NS, T_TRUE_NS};
use crate::formats::axes::Rigid;
use crate::text::numbers::{matrix_list, real};
use camsim_core::sensors::GnssSample;

/// Writes `mav0/KINDn/{data.csv, sensor.yaml}` of all sensors but cameras and inertial ones; returns names of the tables.
pub(crate) fn write(job: &ExportJob<'_>, body_from_b: &Rigid) -> Result<Vec<String>, DatasetError> {
    let mut names: Vec<String> = Vec::new();
    for sensor in descriptions(job.run)?.into_iter().filter(|sensor| sensor.kind != "imu") {
        let prefix = format!("mav0/{}", sensor.kind);
        let number = names.iter().filter(|name| name.starts_with(&prefix)).count();
        let folder = format!("{prefix}{number}");
        write_table(job, &sensor, &format!("{folder}/data.csv"))?;
        let b_from_sensor = body_from_b.inverse().of(&sensor.body_from_sensor());
        let yaml = format!(
            "sensor_type: {}\ncomment: camsim\nT_BS:\n  cols: 4\n  rows: 4\n  data: {}\n\nrate_hz: {}\n",
            sensor.kind,
            matrix_list(&b_from_sensor.matrix()),
            real(sensor.rate_hz)
        );
        job.target.text(&format!("{folder}/sensor.yaml"), &yaml)?;
        names.push(format!("{folder}/data.csv"));
    }
    Ok(names)
}

/// The columns before the true values.
fn write_table(job: &ExportJob<'_>, sensor: &SensorDescription, name: &str) -> Result<(), DatasetError> {
    // All sensors have these.
    let mut rows = CsvRows::open::<GnssSample>(&sensor.table, &[T_NS, T_TRUE_NS])?;
    let columns: Vec<String> =
        rows.header().iter().skip(1).take_while(|column| *column != T_TRUE_NS).map(str::to_owned).collect();
    job.target.stream(name, &mut |out| {
        writeln!(out, "#timestamp [ns],{}", columns.join(","))?;
        while rows.advance()? {
            let t_ns: i64 = rows.whole(0)?;
            write!(out, "{}", t_ns.saturating_add(job.run.shift_ns()))?;
            for (i, column) in columns.iter().enumerate() {
                let cell = rows.cell(i + 1);
                match cell.parse::<i64>() {
                    // Other stamps of the row.
                    Ok(t_ns) if column.ends_with("_ns") => {
                        write!(out, ",{}", t_ns.saturating_add(job.run.shift_ns()))?;
                    }
                    _ => write!(out, ",{cell}")?,
                }
            }
            writeln!(out)?;
        }
        Ok(())
    })
}
