//! Columns that name the frames of poses, as tables of ROS messages have them: their words about axes count as
//! those of a recording do.

use std::sync::Arc;

use camsim_core::flight_log::Note;

use super::{
    columns::{AttitudeKind, Frame},
    header::normal_form,
    layout::TableLayout,
    mcap_file::{
        frames,
        messages::{RosKind, Sample},
    },
    rows::ParsedRow,
    text_table::{Table, is_missing},
};

/// A column and the only name in it.
struct FrameName {
    column: usize,
    name: String,
}

/// Turns poses of x, y, z to the axes that columns of frames state. Returns the axes of the rows, too. Rows are
/// as many as those of the table.
///
/// # Errors
/// There are several frames, or positions in them are no flight.
pub(super) fn turned(
    mut rows: Vec<ParsedRow>,
    table: &Table<'_>,
    layout: &TableLayout,
    notes: &mut Vec<Note>,
) -> Result<(Frame, Vec<ParsedRow>), String> {
    let is_child = |name: &str| name.ends_with("child_frame_id");
    if layout.frame == Frame::Geodetic {
        return Ok((layout.frame, rows));
    }
    let world = frame_name(table, layout, |name| name.ends_with("frame_id") && !is_child(name))?;
    let body = frame_name(table, layout, is_child)?;
    let Some(first) = world.as_ref().or(body.as_ref()) else { return Ok((layout.frame, rows)) };
    let described = layout.describe(first.column);
    if let Some(frame) = world.as_ref().filter(|frame| frames::is_geocentric(&frame.name)) {
        return Err(format!(
            "{described} says `{}`, whose positions are geocentric (REP 105): give poses in `map` or `odom`",
            frame.name
        ));
    }
    if layout.frame != Frame::EastNorthUp {
        notes.extend(world.and_then(|frame| contradiction(layout.frame, &described, &frame.name)));
        return Ok((layout.frame, rows));
    }
    let has_axes = [&world, &body].into_iter().flatten().any(|frame| frames::states_axes(&frame.name));
    if !has_axes {
        return Ok((layout.frame, rows));
    }
    let (world_name, body_name) =
        (world.map_or(String::new(), |frame| frame.name), body.map(|frame| Arc::from(frame.name)));
    let has_rotations = layout.attitude.kind() == AttitudeKind::Quaternion;
    let frame: Arc<str> = Arc::from(world_name);
    let mut samples: Vec<Sample> = rows
        .iter()
        .map(|row| Sample {
            number: row.line,
            stamp_ns: 0,
            recorded_ns: 0,
            position: row.has_position().then_some(row.position),
            rotation: (has_rotations && row.attitude.iter().all(|value| value.is_finite()))
                .then_some(row.attitude),
            is_valid: true,
            frame: Arc::clone(&frame),
            child: body_name.clone(),
        })
        .collect();
    frames::turn(&described, RosKind::Odometry, &mut samples, notes)?;
    for (row, sample) in rows.iter_mut().zip(samples) {
        row.position = sample.position.unwrap_or([f64::NAN; 3]);
        row.attitude = if has_rotations { sample.rotation.unwrap_or([f64::NAN; 4]) } else { row.attitude };
    }
    Ok((Frame::NorthEastDown, rows))
}

/// A warning where a frame has other axes than positions that are read by their names or by flight.format.
fn contradiction(frame: Frame, described: &str, name: &str) -> Option<Note> {
    let read_as = if frame == Frame::NorthEastDown { "north-east-down" } else { "north-east-up" };
    let stated = frames::world_axes(name).filter(|stated| stated != read_as)?;
    Some(Note::warning(format!(
        "{described} says `{name}` ({stated}), but positions are read as {read_as}: flight.format = \"tum\" \
                reads x, y, z as the frame says"
    )))
}

/// The first column of such a name in normal form, and the name of the frame in it.
fn frame_name(
    table: &Table<'_>,
    layout: &TableLayout,
    is_name: impl Fn(&str) -> bool,
) -> Result<Option<FrameName>, String> {
    let Some(column) = layout.names.iter().position(|name| is_name(&normal_form(name))) else {
        return Ok(None);
    };
    let mut found: Option<&str> = None;
    for line in &table.rows {
        let name = table.field(line, column);
        if is_missing(name) {
            continue;
        }
        let first = *found.get_or_insert(name);
        let differs = frames::states_axes(first) || frames::states_axes(name);
        if first != name && differs {
            return Err(format!(
                "line {}: `{name}` in {}, but `{first}` before: keep the rows of one frame",
                line.number,
                layout.describe(column)
            ));
        }
    }
    Ok(found.map(|name| FrameName { column, name: name.trim_start_matches('/').to_owned() }))
}
