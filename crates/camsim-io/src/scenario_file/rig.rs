//! Scenarios of one camera or several as trees of values: `cameras` instead of `camera`.

use camsim_core::scenario::{CameraSpec, Problem, Rig, Scenario};
use serde::{Serialize, de::Error as _};
use serde_json::Value as Json;
use toml::{Table, Value};

use super::{
    ScenarioError, check,
    schema::{self, CAMERAS},
    tree::Tree,
    unexpected,
};
use camsim_core::validate::checked_cameras;

/// The scenarios of a tree with paths resolved. Ranges are not checked, and `camera.resized` is not applied.
///
/// # Errors
/// Keys or types that do not fit.
pub fn rig_of_table(mut root: Table) -> Result<Rig, toml::de::Error> {
    let Some(cameras) = root.remove(CAMERAS) else {
        return Ok(Rig::single(Value::Table(root).try_into()?));
    };
    let shared: Scenario = Value::Table(root).try_into()?;
    let missing = || toml::de::Error::custom("cameras: is empty");
    Rig::of_cameras(&shared, cameras.try_into()?).ok_or_else(missing)
}

/// The tree of a rig.
///
/// # Errors
/// Values that TOML cannot store.
pub fn rig_table(rig: &Rig) -> Result<Table, toml::ser::Error> {
    let mut root = Table::try_from(rig.first())?;
    if rig.is_list() {
        root.remove("camera");
        let cameras = rig.scenarios().iter().map(|scenario| Value::try_from(&scenario.camera));
        root.insert(CAMERAS.into(), Value::Array(cameras.collect::<Result<_, _>>()?));
    }
    Ok(root)
}

/// The tree of a rig as JSON.
///
/// # Errors
/// Values that JSON cannot store.
pub fn rig_json(rig: &Rig) -> Result<Json, serde_json::Error> {
    let mut tree = json(rig.first())?;
    if let Some(root) = tree.as_object_mut().filter(|_| rig.is_list()) {
        root.remove("camera");
        let cameras = rig.scenarios().iter().map(|scenario| json(&scenario.camera));
        root.insert(CAMERAS.into(), Json::Array(cameras.collect::<Result<_, _>>()?));
    }
    Ok(tree)
}

fn json(value: &impl Serialize) -> Result<Json, serde_json::Error> {
    serde_json::to_value(value)
}

/// The cameras of a tree that has `[[cameras]]` and nothing else.
pub(super) fn read_cameras_alone(mut tree: Tree) -> Result<Vec<CameraSpec>, ScenarioError> {
    tree.resolve_cameras()?;
    tree.check_cameras()?;
    let missing = |problem: &String| {
        schema::SCENARIO.required.iter().any(|(key, parent)| {
            // A scenario needs a flight; a file of cameras does not.
            parent.is_empty() && problem.contains(&format!(": {key}: is missing"))
        })
    };
    let mut problems = check::check(&mut tree, &schema::SCENARIO, "");
    problems.retain(|problem| !missing(problem));
    if !problems.is_empty() {
        return Err(ScenarioError::Problems(problems));
    }
    let cameras = tree.root.get(CAMERAS).cloned().unwrap_or(Value::Array(Vec::new()));
    let cameras: Vec<CameraSpec> = cameras.try_into().map_err(|error| unexpected(&tree, &error))?;
    checked_cameras(cameras).map_err(|problems| {
        let line = |problem: &Problem| format!("{}: {problem}", tree.location(&problem.key));
        ScenarioError::Problems(problems.iter().map(line).collect())
    })
}

#[cfg(test)]
mod tests;
