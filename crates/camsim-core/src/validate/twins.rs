//! Checks of `[[output.twin]]`.

use super::{Check, names, validate};
use crate::scenario::{BurstOver, Channel, FieldOr, Scenario, TwinSpec};
use crate::twin::scenario_of;

/// Names below the output folder that are taken, beside those of channels.
const TAKEN: &[&str] = &["inputs", "object_palette", "class_palette", "sensors", "datasets"];

/// Checks the twins of a scenario. Those of a scenario that has other problems are checked by themselves only.
pub(super) fn check_twins(check: &mut Check, scenario: &Scenario) {
    let twins = &scenario.output.twin;
    let is_usable = check.problems.is_empty();
    for (i, twin) in twins.iter().enumerate() {
        let before = check.problems.len();
        let is_repeated = twins[..i].iter().any(|other| other.name.eq_ignore_ascii_case(&twin.name));
        check.require(!is_repeated, format!("output.twin.{i}.name"), || {
            format!("\"{}\" names two twins; give each a name of its own, as it is a folder", twin.name)
        });
        check_folder_name(check, &format!("output.twin.{i}.name"), &twin.name);
        check_keys(check, i, twin);
        check_burst(check, i, twin, scenario);
        if is_usable && check.problems.len() == before {
            check_scenario(check, i, twin, scenario);
        }
    }
}

/// Checks the name of a folder beside those of channels.
pub(super) fn check_folder_name(check: &mut Check, key: &str, name: &str) {
    check.require(names::is_portable(name), key, || {
        format!("is the name of a folder: {}, such as \"sharp\", not \"{name}\"", names::ADVICE)
    });
    let mut taken = Channel::ALL.iter().map(|channel| channel.name()).chain(TAKEN.iter().copied());
    check.require(!taken.any(|other| name.eq_ignore_ascii_case(other)), key, || {
        format!("\"{name}\" is the name of another folder beside the frames; choose another name")
    });
}

/// Keys that contradict each other.
fn check_keys(check: &mut Check, i: usize, twin: &TwinSpec) {
    let key = |leaf: &str| format!("output.twin.{i}.{leaf}");
    check.require(twin.differs(), format!("output.twin.{i}"), || {
        "is the frame itself; leave something out (exposure = false, shutter = \"global\", lens = false, noise = \
         false, vignette = false, point_spread = false, ideal = true or instants = 9), or leave the twin out"
            .into()
    });
    let flags = [
        ("exposure", twin.exposure),
        ("lens", twin.lens),
        ("noise", twin.noise),
        ("vignette", twin.vignette),
        ("point_spread", twin.point_spread),
    ];
    for (name, _) in flags.iter().filter(|(_, flag)| twin.ideal && *flag == Some(true)) {
        check.fail(
            key(name),
            "is already omitted by ideal = true; write false, or what is to be omitted instead of ideal",
        );
    }
    check.require(twin.exposure != Some(true) || twin.instants.is_none(), key("exposure"), || {
        "cannot be true for a burst, whose pictures are instants; leave it out, or leave instants out".into()
    });
    let is_over_readout = twin.over == Some(BurstOver::Readout);
    check.require(twin.instant.is_none() || (twin.is_global() && !is_over_readout), key("instant"), || {
        match is_over_readout {
            true => {
                "cannot be chosen for a burst over the readout, which has all instants; leave it out".into()
            }
            false => "is that of a global shutter; write shutter = \"global\" too, or leave it out".into(),
        }
    });
    check.require(twin.channels.as_ref().is_none_or(|list| !list.is_empty()), key("channels"), || {
        "is empty; name what to write, or leave it out for the channels of the frame".into()
    });
}

fn check_burst(check: &mut Check, i: usize, twin: &TwinSpec, scenario: &Scenario) {
    let key = |leaf: &str| format!("output.twin.{i}.{leaf}");
    let Some(count) = twin.instants else {
        check.require(twin.over.is_none(), key("over"), || {
            "says what a burst is spread over; write instants too, or leave it out".into()
        });
        return;
    };
    let shutter = &scenario.camera.shutter;
    let is_instant = match twin.over.unwrap_or_default() {
        BurstOver::Exposure => shutter.exposure_ms == 0.0,
        BurstOver::Readout => scenario.camera.readout_ms() == 0.0 && shutter.interlace_ms == FieldOr::Ms(0.0),
    };
    check.require(count == 1 || !is_instant, key("instants"), || match twin.over.unwrap_or_default() {
        BurstOver::Exposure => "are all the same, as camera.shutter.exposure_ms is 0; give it, or leave the \
                                twin out"
            .into(),
        BurstOver::Readout => "are all the same, as camera.shutter.readout_ms is 0; give it, or leave the \
                               twin out"
            .into(),
    });
}

/// Problems of the scenario that a twin is a frame of.
fn check_scenario(check: &mut Check, i: usize, twin: &TwinSpec, scenario: &Scenario) {
    match scenario_of(scenario, twin, twin.instants().next().flatten()) {
        Ok(scenario) => {
            for problem in validate(&scenario) {
                check.fail(format!("output.twin.{i}"), format!("with what it leaves out, {problem}"));
            }
        }
        Err(error) => check.fail(format!("output.twin.{i}"), error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        scenario::{FlowInstant, TwinShutter},
        validate::tests::good,
    };

    fn twin(name: &str) -> TwinSpec {
        TwinSpec { name: name.into(), noise: Some(false), ..TwinSpec::default() }
    }

    fn problems(twins: Vec<TwinSpec>) -> Vec<(String, String)> {
        let mut scenario = good();
        scenario.camera.shutter.exposure_ms = 8.0;
        scenario.output.twin = twins;
        validate(&scenario).into_iter().map(|problem| (problem.key, problem.message)).collect()
    }

    #[test]
    fn legal_twins_have_no_problem() {
        let twins = vec![
            TwinSpec { ideal: true, instant: Some(FlowInstant::LastRow), ..twin("ideal") },
            TwinSpec { instants: Some(9), shutter: Some(TwinShutter::Global), ..twin("burst-9") },
            TwinSpec { channels: Some(vec![Channel::Depth]), ..twin("no_noise") },
        ];
        assert_eq!(problems(twins), []);
    }

    #[test]
    fn each_problem_is_named_once() {
        let readout = TwinSpec { over: Some(BurstOver::Readout), ..twin("a") };
        let cases = [
            (vec![twin("Sharp"), twin("sharp")], "output.twin.1.name"),
            (vec![twin("../up")], "output.twin.0.name"),
            (vec![twin("")], "output.twin.0.name"),
            (vec![twin("NUL")], "output.twin.0.name"),
            (vec![twin("Depth")], "output.twin.0.name"),
            (vec![twin("inputs")], "output.twin.0.name"),
            (vec![twin("object_palette")], "output.twin.0.name"),
            (vec![TwinSpec { noise: Some(true), ..twin("a") }], "output.twin.0"),
            (vec![TwinSpec { ideal: true, lens: Some(true), ..twin("a") }], "output.twin.0.lens"),
            (
                vec![TwinSpec { instants: Some(3), exposure: Some(true), ..twin("a") }],
                "output.twin.0.exposure",
            ),
            (vec![TwinSpec { instant: Some(FlowInstant::Centre), ..twin("a") }], "output.twin.0.instant"),
            (vec![TwinSpec { channels: Some(vec![]), ..twin("a") }], "output.twin.0.channels"),
            (vec![readout.clone()], "output.twin.0.over"),
            (vec![TwinSpec { instants: Some(5), ..readout }], "output.twin.0.instants"),
            (vec![TwinSpec { instants: Some(0), ..twin("a") }], "output.twin.0.instants"),
            (vec![TwinSpec { instants: Some(1001), ..twin("a") }], "output.twin.0.instants"),
        ];
        for (twins, key) in cases {
            let found = problems(twins);
            assert!(found.len() == 1 && found[0].0 == key, "{key}: {found:?}");
        }
    }
}
