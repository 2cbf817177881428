//! Plans before the first frame, so that their errors come before anything is written.

use std::time::{Duration, Instant};

use super::{Job, Pictures, Series, todo};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_source::FrameSource,
    progress::waiting,
};

/// Plans the first of the pictures that a run renders; returns the time it takes. `is_planned`: the planner of
/// `source` is theirs.
pub fn plan_first(
    job: &Job<'_>,
    pictures: &Pictures,
    is_planned: bool,
    source: &dyn FrameSource,
    console: &Console<'_>,
) -> Result<Duration, Failure> {
    let begin = Instant::now();
    let first = |series: &Series| todo(job, series).first().copied();
    if let Some((series, frame)) = pictures.series.iter().find_map(|series| Some((series, first(series)?))) {
        let waiting = waiting("planning the first frame", console.is_quiet());
        let planned = match is_planned {
            true => source.planner().plan(frame),
            false => source.planner_of(&series.sequence).and_then(|planner| planner.plan(frame)),
        };
        waiting.finish_and_clear();
        planned.or_bad_input()?;
    }
    Ok(begin.elapsed())
}
