//! A net below changes that are to change nothing: plans of 60 sequences and more, and checksums of their
//! pictures.
//!
//! `CAMSIM_BLESS=1 cargo test --workspace --test net` writes the golden files in `tests/data/net` anew: for
//! changes that are meant, and to be read as part of them. Plans hold on every machine; checksums hold for
//! adapters and processors like those of the machine that wrote them.

#[path = "net/golden.rs"]
mod golden;
#[path = "net/pictures.rs"]
mod pictures;
#[path = "net/subjects.rs"]
mod subjects;

use std::{collections::BTreeMap, io::Write, sync::LazyLock};

use camsim_plan::{FramePlan, PlanError};
use pictures::Checksums;
use serde_json::{Map, Value, json};
use subjects::Subject;

const CHECKSUMS: &str = "checksums.txt";
/// RMS between a picture of the gpu and the cpu's, 1/255: with llvmpipe 0.0001 to 0.57, most of it at
/// silhouettes, where rounding decides which surface a pixel shows.
const RENDERERS_APART_DN: f64 = 1.0;
/// Pixels that one of the two alone calls valid: 0, and 1 or 2 of 19 200 where a lens folds its image.
const VALID_IN_ONE: usize = 4;
/// Between the mean of a picture's numbers and the golden one, on whatever adapter.
const MEANS_APART: f64 = 1.0 / 255.0;
/// Differences that are told; after a change that goes everywhere there are thousands.
const MOST_TOLD: usize = 40;

static SUBJECTS: LazyLock<Vec<Subject>> = LazyLock::new(subjects::subjects);

fn expect_none(differences: &[String]) {
    let told = &differences[..differences.len().min(MOST_TOLD)];
    assert!(told.is_empty(), "{} differences:\n{}", differences.len(), told.join("\n"));
}

/// What `camsim explain` says, as JSON and, of first frames, as text; and what plans are compared by.
///
/// Texts, and reasons within the JSON, have numbers of two or three digits in them and are compared as they
/// are. The risk: where another library takes the sines, a number within rounding of a half may be written
/// otherwise. No other difference of a text is to be put down to the machine.
fn explained(plan: &Result<FramePlan, PlanError>, with_text: bool) -> Value {
    let plan = match plan {
        Ok(plan) => plan,
        Err(refusal) => return json!({ "refused": refusal.to_string() }),
    };
    let prices_ms = [plan.price_ms, plan.ideal_price_ms];
    let mut explained = json!({ "plan": plan.summary(), "prices_ms": prices_ms });
    if with_text {
        explained["text"] = plan.to_string().lines().collect();
    }
    golden::rounded(explained)
}

#[test]
fn plans_are_those_of_the_golden_files() {
    let mut groups = BTreeMap::<&str, Map<String, Value>>::new();
    for subject in &*SUBJECTS {
        for (frame, plan) in subject.plans() {
            let with_text = frame == 0;
            let plans = groups.entry(subject.group).or_default();
            plans.insert(format!("{} {frame}", subject.name), explained(&plan, with_text));
        }
    }
    let mut differences = Vec::new();
    for (group, plans) in groups {
        let (file, plans) = (format!("plans_{group}.json"), Value::Object(plans));
        if golden::is_blessing() {
            golden::write(&file, &format!("{plans:#}\n"));
            continue;
        }
        let golden = serde_json::from_str(&golden::read(&file)).expect(&file);
        golden::compare(group, &golden, &plans, &mut differences);
    }
    expect_none(&differences);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn pictures_are_those_of_the_golden_file() {
    let [whole, tiled] = [u32::MAX, pictures::MOST_PICTURE_PX].map(pictures::Engines::new);
    let (mut found, mut faults) = (Checksums::new(), Vec::new());
    for subject in &*SUBJECTS {
        let engines = if subject.name == subjects::TILED { &tiled } else { &whole };
        let [gpu, cpu] = pictures::render(engines, subject);
        for (renderer, frames) in [("gpu", &gpu), ("cpu", &cpu)] {
            for frame in frames {
                let of = format!("{} {} {renderer}", subject.name, frame.index);
                pictures::add(frame, &of, &mut found, &mut faults);
            }
        }
        for by_cpu in &cpu {
            let of = format!("{} {}", subject.name, by_cpu.index);
            let by_gpu = gpu.iter().find(|frame| frame.index == by_cpu.index).expect("the same frame");
            let (apart_dn, validity) = pictures::apart_dn(by_gpu, by_cpu);
            eprintln!("{of}: renderers {apart_dn:.4} dn apart, {validity} pixels valid in one alone");
            if apart_dn > RENDERERS_APART_DN || validity > VALID_IN_ONE {
                faults.push(format!(
                    "{of} color: renderers are {apart_dn:.3} dn apart, {validity} pixels are valid in one \
                     alone"
                ));
            }
        }
    }
    let machine = pictures::machine(&whole.gpu);
    if golden::is_blessing() {
        golden::write(CHECKSUMS, &pictures::to_text(&machine, &found));
    } else {
        faults.extend(differences(&machine, &found));
    }
    expect_none(&faults);
}

/// From the golden file: checksums where this machine wrote it, frames and means everywhere.
fn differences(machine: &str, found: &Checksums) -> Vec<String> {
    let (written_by, golden) = pictures::from_text(&golden::read(CHECKSUMS));
    let is_same_machine = written_by == machine;
    if !is_same_machine {
        let text = format!("CHECKSUMS ARE NOT COMPARED: they are of\n{written_by}and this is\n{machine}");
        // Past the harness, which would keep it to itself.
        std::io::stderr().write_all(text.as_bytes()).expect("standard error");
    }
    let mut differences = Vec::new();
    for (key, golden) in &golden {
        match found.get(key) {
            None => differences.push(format!("{key}: golden {golden:x?}, now missing")),
            Some(found) if is_same_machine && found.checksum != golden.checksum => {
                let [golden, found] = [golden, found].map(|kept| kept.checksum);
                differences.push(format!("{key}: golden {golden:016x}, now {found:016x}"));
            }
            Some(found) if key.ends_with("color") && (found.mean - golden.mean).abs() > MEANS_APART => {
                differences.push(format!("{key}: golden mean {}, now {}", golden.mean, found.mean));
            }
            Some(_) => {}
        }
    }
    let added = found.keys().filter(|key| !golden.contains_key(*key));
    differences.extend(added.map(|key| format!("{key}: not in the golden file")));
    differences
}
