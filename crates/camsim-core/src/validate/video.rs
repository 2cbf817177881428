//! Checks of `[output.video]`.

use super::Check;
use crate::scenario::{ImageFormat, Scenario, VideoCodec};

pub(super) fn check_video(check: &mut Check, scenario: &Scenario) {
    let is_kept = scenario.output.video.codec != VideoCodec::Ffv1
        || !scenario.output.format.contains(&ImageFormat::Mp4);
    check.require(is_kept, "output.video.codec", || {
        "is \"ffv1\", which mp4 files do not hold; write \"mkv\" in output.format instead of \"mp4\"".into()
    });
}
