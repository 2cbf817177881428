//! A drawn key: its distribution, and the keys of the scenario that get the value.

use toml::{Table, Value};

use super::{
    super::{
        ScenarioError,
        schema::{CAMERAS, ValueKind},
        tree::{Tree, get, join},
    },
    Drawn, RANDOMIZE,
    law::Law,
    overlaps, problems,
};

/// A key of `[randomize]` with its distribution.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    /// The key as written, which names its random numbers.
    name: String,
    /// Keys that get the value, of one draw.
    targets: Vec<Target>,
    law: Law,
    /// Whether some of its keys are fixed.
    is_part: bool,
}

/// A key that gets a value.
#[derive(Clone, Debug)]
struct Target {
    /// With names of cameras.
    shown: String,
    /// With numbers of cameras.
    key: String,
}

impl Draw {
    /// A key with its distribution. `kind` are the values that it takes, `None` if it is a table.
    pub(super) fn new(
        name: &str,
        kind: Option<ValueKind>,
        value: &Value,
        tree: &Tree,
        defaults: &Table,
    ) -> Result<Self, String> {
        let law = Law::parse(value)?;
        let is_choice = matches!(law, Law::Choice(..));
        let takes_whole = matches!(
            kind,
            Some(ValueKind::Whole | ValueKind::Within(..) | ValueKind::CountOr(..) | ValueKind::Counts(..))
        );
        if takes_whole && !law.is_whole() {
            return Err(
                "takes whole numbers: write { integer = [lowest, highest] } or { choice = [...] }".into()
            );
        }
        if (matches!(law, Law::Piece(_))) != (matches!(law, Law::Piece(_)) && name == "flight.window_s") {
            return Err("piece_s goes with flight.window_s".into());
        }
        if kind.is_none_or(|kind| matches!(kind, ValueKind::Tables | ValueKind::Path | ValueKind::Paths))
            && !is_choice
        {
            return Err("takes no numbers: write { choice = [...] } with values that it can have".into());
        }
        let targets = targets(name, tree)?;
        let draw = Self { name: name.into(), targets, law, is_part: false };
        // Whether values fit the keys does not depend on what is drawn.
        let (mut tree, mut drawn) = (tree.clone(), Vec::new());
        match draw.put(&mut tree, defaults, 0, 0, &mut drawn) {
            Ok(()) => Ok(draw),
            Err(ScenarioError::Problems(lines)) => Err(plain(&lines, name)),
            Err(other) => Err(other.to_string()),
        }
    }

    /// The key as written.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Whether some of its keys are fixed.
    pub(super) fn is_part(&self) -> bool {
        self.is_part
    }

    /// Without what stands at these keys, above or below them; `None` if nothing is left.
    pub(super) fn without(mut self, fixed: &[String]) -> Option<Self> {
        let count = self.targets.len();
        self.targets.retain(|target| !fixed.iter().any(|key| overlaps(key, &target.key)));
        self.is_part = self.targets.len() < count;
        (!self.targets.is_empty()).then_some(self)
    }

    /// Draws the value of variation `index`, puts it into the tree and appends it to `drawn`.
    pub(super) fn put(
        &self,
        tree: &mut Tree,
        defaults: &Table,
        seed: u64,
        index: u64,
        drawn: &mut Vec<Drawn>,
    ) -> Result<(), ScenarioError> {
        let location = tree.location(&join(RANDOMIZE, &self.name));
        for Target { shown, key } in &self.targets {
            let base = tree.get(key).or_else(|| get(defaults, key));
            let value = self.law.value(seed, &self.name, index, base);
            let value = value.map_err(|message| problems(tree, &[(self.name.clone(), message)]))?;
            let fail = |message: String| {
                ScenarioError::Problems(vec![format!("{location}: {RANDOMIZE}.{}: {message}", self.name)])
            };
            // An element of a list that the scenario does not state: the others have their defaults.
            if let Some((list, _)) = key.rsplit_once('.')
                && tree.get(list).is_none()
                && let Some(default @ Value::Array(_)) = get(defaults, list)
            {
                tree.put(list, default.clone(), &location, fail)?;
            }
            tree.put(key, value.clone(), &location, fail)?;
            drawn.push(Drawn { key: shown.clone(), value, is_numbers: self.law.is_numbers() });
        }
        Ok(())
    }
}

/// Messages without location and key, which the caller adds.
fn plain(lines: &[String], name: &str) -> String {
    let mark = format!("{RANDOMIZE}.{name}: ");
    let one =
        |line: &String| line.split_once(&mark).map_or_else(|| line.clone(), |(_, text)| text.to_owned());
    lines.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// The keys that a key with `*` for every element of a list stands for.
fn targets(name: &str, tree: &Tree) -> Result<Vec<Target>, String> {
    let mut keys = vec![String::new()];
    for step in name.split('.') {
        let mut longer = Vec::new();
        for key in &keys {
            if step != "*" {
                longer.push(join(key, step));
                continue;
            }
            longer.extend(elements(key, tree)?.iter().map(|element| join(key, element)));
        }
        keys = longer;
    }
    keys.into_iter().map(|shown| Ok(Target { key: tree.numbered(&shown)?, shown })).collect()
}

/// Names of the elements of a list: of cameras their own, else their numbers.
fn elements(list: &str, tree: &Tree) -> Result<Vec<String>, String> {
    if list == CAMERAS && !tree.entries().is_empty() {
        return Ok(tree.names().into_iter().map(str::to_owned).collect());
    }
    match tree.get(&tree.numbered(list)?) {
        Some(Value::Array(elements)) => Ok((0..elements.len()).map(|i| i.to_string()).collect()),
        _ => Err(format!("`*` stands for the elements of a list, and the scenario has no list `{list}`")),
    }
}
