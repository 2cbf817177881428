//! The listings agree with the reader.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::Path;

use camsim_core::scenario::Scenario;
use toml::Value;

use super::{
    super::{check, find_key, kinds, schema::SCENARIO, tree::Tree},
    *,
};

#[test]
fn pages_are_up_to_date() {
    crate::inputs_page::check("../KEYS.md", &keys_page::page());
    crate::inputs_page::check("../default.toml", &print_default());
    crate::inputs_page::check("../../../python/camsim/keys.py", &python_keys::module());
    crate::inputs_page::check("../scenario.schema.json", &format!("{:#}\n", json_schema()));
}

/// The printed default with every comment mark of a key taken away.
fn whole_tree() -> Tree {
    let is_key = |line: &str| {
        let name = line.split(" = ").next().unwrap_or_default();
        line.starts_with('[') || (line.contains(" = ") && !name.contains(' '))
    };
    let shown = print_default();
    let (shown, _) = shown.split_once("# [randomize]").unwrap();
    let lines = shown.lines().map(|line| line.strip_prefix("# ").filter(|key| is_key(key)).unwrap_or(line));
    let text: String = lines.map(|line| format!("{line}\n")).collect();
    let (before, rig) = text.split_once("[[cameras]]").unwrap();
    let (_, after) = rig.split_once("\n\n").unwrap();
    Tree::parse(&format!("{before}\n{after}"), Path::new("s.toml"), "").unwrap()
}

/// The value of a key, of the first element of each list.
fn find<'a>(root: &'a mut Value, key: &str) -> Option<&'a mut Value> {
    key.split('.').try_fold(root, |value, part| match value {
        Value::Array(tables) => tables.first_mut()?.get_mut(part),
        value => value.get_mut(part),
    })
}

#[test]
fn the_printed_default_has_every_key_with_a_value_of_its_kind() {
    let mut tree = whole_tree();
    assert_eq!(check::check(&mut tree, &SCENARIO, ""), Vec::<String>::new());
    let mut root = Value::Table(tree.root);
    let absent: Vec<&str> =
        kinds().map(|(key, _)| key).filter(|key| find(&mut root, key).is_none()).collect();
    assert_eq!(absent, Vec::<&str>::new());
    // Read, written and read again it is the same: what serde reads and writes are the keys of the fields.
    let scenario: Scenario = root.try_into().unwrap();
    let mut written = Value::try_from(&scenario).unwrap();
    assert_eq!(written.clone().try_into::<Scenario>().unwrap(), scenario);
    let is_skipped = |key: &&str| {
        let value = find(&mut written, key);
        value.is_none()
    };
    // Those that are not written where they have their defaults.
    let defaults: Vec<&str> = kinds().map(|(key, _)| key).filter(is_skipped).collect();
    for key in defaults {
        let field = find_key(key).unwrap().field;
        assert!(!field.is_required && field.example.is_empty(), "{key} is read, but not written");
    }
}

#[test]
fn serde_has_every_word() {
    let tree = Value::Table(whole_tree().root);
    let check = |key: &str, value: Value| {
        let mut root = tree.clone();
        *find(&mut root, key).unwrap() = value.clone();
        let scenario = root.try_into::<Scenario>().unwrap_or_else(|error| panic!("{key} = {value}: {error}"));
        let mut written = Value::try_from(&scenario).unwrap();
        let word = find(&mut written, key).cloned();
        assert!(word.is_none_or(|word| word == value), "{key} = {value}");
    };
    for (key, kind) in kinds() {
        match kind {
            ValueKind::Word(words) | ValueKind::NumberOr(words) | ValueKind::CountOr(_, words) => {
                words.iter().for_each(|word| check(key, (*word).into()));
            }
            ValueKind::Words(words) => words.iter().for_each(|word| check(key, vec![*word].into())),
            ValueKind::NumbersOr(_, word) => check(key, word.into()),
            _ => {}
        }
    }
}
