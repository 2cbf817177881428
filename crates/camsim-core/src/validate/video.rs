//! Checks of `[output.video]`.

use super::Check;
use crate::scenario::{ImageFormat, Scenario, VideoCodec, VideoSpec};

pub(super) fn check_video(check: &mut Check, scenario: &Scenario) {
    let VideoSpec { codec, bits, .. } = scenario.output.video;
    check.require([8, 10].contains(&bits), "output.video.bits", || format!("must be 8 or 10, not {bits}"));
    let is_kept = codec != VideoCodec::Ffv1 || !scenario.output.format.contains(&ImageFormat::Mp4);
    check.require(is_kept, "output.video.codec", || {
        "is \"ffv1\", which mp4 files do not hold; write \"mkv\" in output.format in place of \"mp4\"".into()
    });
}
