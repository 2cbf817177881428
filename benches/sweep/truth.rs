//! What truth costs beside colour.

use std::time::Duration;

use camsim::core::scenario::Channel;

use crate::{
    flight::{
        Outcome,
        comparison::{Comparison, RATE_TO_FIRST, Renderers},
        rounds::RoundLimits,
    },
    scenario::{ALL_EFFECTS, FRAMES, HOUSES, VIO_TOWN, rig},
};

const LIMITS: RoundLimits = RoundLimits { burst: 8, rounds: 7, budget: Duration::from_secs(90) };
const SCENES: [&str; 3] = [ALL_EFFECTS, VIO_TOWN, HOUSES];
const SOME: [&[Channel]; 2] = [
    &[Channel::Color, Channel::Depth, Channel::Coords, Channel::Valid],
    &[Channel::Color, Channel::Depth, Channel::Flow, Channel::Object, Channel::Normal],
];

/// Colour alone beside colour with truth. Of a rig its first camera.
pub fn truth(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let limits = LIMITS.or_smoke_test(is_measuring);
    for path in &SCENES[..if is_measuring { SCENES.len() } else { 1 }] {
        let camera = rig(path)?.into_iter().next().ok_or("a scenario has a camera")?;
        let mut table = Comparison::new(renderers);
        table.add("colour", &camera, &[Channel::Color], false)?;
        for channels in SOME {
            let names: Vec<_> = channels[1..].iter().map(|channel| channel.name()).collect();
            table.add(names.join(", "), &camera, channels, false)?;
        }
        // A raw picture needs a sensor.
        let all: Vec<Channel> =
            Channel::ALL.iter().copied().filter(|channel| *channel != Channel::Raw).collect();
        table.add("all channels", &camera, &all, false)?;
        table.measure(camera.frames.min(FRAMES), limits)?;
        println!("\n{path}");
        table.print("channels", limits, &[RATE_TO_FIRST]);
    }
    Ok(())
}
