//! `python/camsim/keys.py`: the keys with the types of their values.

use camsim_core::scenario::keys::{Key, ValueKind};

use super::super::keys;

const HEAD: &str = "\
\"\"\"Keys of a scenario with the types of their values, for editors and type checkers; None takes a key out.

Made from the fields of the scenario by `CAMSIM_BLESS=1 cargo test --workspace --lib listing`.

>>> changes: Keys = {\"camera.fps\": 10, \"camera.shutter.readout\": \"bottom-to-top\"}
\"\"\"

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict

Path = str | PathLike[str]
Tables = Sequence[Mapping[str, Any]]
Keys = TypedDict(
    \"Keys\",
    {
";

pub fn module() -> String {
    let line = |key: &Key| format!("        {:?}: {} | None,\n", key.name, python_type(key.field.kind));
    let lines: String = keys().iter().map(line).collect();
    format!("{HEAD}{lines}    }},\n    total=False,\n)\n")
}

fn python_type(kind: ValueKind) -> String {
    let words = |words: &[&str]| {
        let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
        format!("Literal[{}]", quoted.join(", "))
    };
    match kind {
        ValueKind::Number => "float".to_owned(),
        ValueKind::NumberOr(names) => format!("float | {}", words(names)),
        ValueKind::Whole | ValueKind::Within(..) => "int".to_owned(),
        ValueKind::CountOr(_, names) => format!("int | {}", words(names)),
        ValueKind::Numbers(_) | ValueKind::NumberList => "Sequence[float]".to_owned(),
        ValueKind::Counts(..) | ValueKind::WholeList => "Sequence[int]".to_owned(),
        ValueKind::NumbersOr(_, word) => format!("Sequence[float] | {}", words(&[word])),
        ValueKind::NumberOrNumbers(_) | ValueKind::NumberOrList => "float | Sequence[float]".to_owned(),
        ValueKind::Points(_) => "Sequence[Sequence[float]]".to_owned(),
        ValueKind::Flag => "bool".to_owned(),
        // Instead of a path there may be an array or table in memory.
        ValueKind::Path => "Path | Any".to_owned(),
        ValueKind::Paths => "Path | Sequence[Path] | Any".to_owned(),
        ValueKind::Text => "str".to_owned(),
        ValueKind::Texts => "Sequence[str]".to_owned(),
        ValueKind::Word(names) => words(names),
        ValueKind::Words(names) => format!("Sequence[{}]", words(names)),
        ValueKind::Numbered(..) => "Mapping[str, int]".to_owned(),
        ValueKind::WordsOrTables(_) => "Path | Sequence[Path]".to_owned(),
        ValueKind::Table => "Mapping[str, Any]".to_owned(),
        ValueKind::Tables => "Tables".to_owned(),
    }
}
