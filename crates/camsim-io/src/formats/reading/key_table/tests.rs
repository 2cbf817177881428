#![allow(clippy::unwrap_used, reason = "tests")]

use serde_json::json;

use super::*;

#[test]
fn paths_match_patterns() {
    for (pattern, path, expected) in [
        ("a.b", "a.b", true),
        ("a.b", "a.b.c", false),
        ("cam*.rostopic", "cam12.rostopic", true),
        ("cam*.rostopic", "scam1.rostopic", false),
        ("Viewer.**", "Viewer.PointSize", true),
        ("Viewer.**", "Viewer", false),
        ("**", "x.y", true),
        ("imu_bias/*", "imu_bias/ax", true),
    ] {
        assert_eq!(path_matches(pattern, path), expected, "{pattern} {path}");
    }
}

#[test]
fn leaves_are_numbers_texts_and_lists() {
    let value = json!({"a": {"b": 1}, "m": {"rows": 1, "cols": 2, "data": [1, 2]}, "l": [{"c": [[1], [2]]},
        {"c": "x"}], "e": {}});
    let paths: Vec<String> = leaves(&value).into_iter().map(|leaf| leaf.path).collect();
    assert_eq!(paths, ["a.b", "e", "l[0].c", "l[1].c", "m"]);
    let leaf = Leaf { path: "l[0].c[12].d".to_owned(), value: &value };
    assert_eq!((leaf.path_without_indices().as_ref(), leaf.name()), ("l.c.d", "d"));
}

#[test]
fn neutral_values_have_no_effect() {
    for (neutral, value, expected) in [
        (Neutral::Zero, json!(0.0), true),
        (Neutral::Zero, json!([0, 0]), true),
        (Neutral::Zero, json!("0"), true),
        (Neutral::Zero, json!(false), true),
        (Neutral::Zero, json!(true), false),
        (Neutral::Zero, json!("name"), false),
        (Neutral::One, json!(1), true),
        (Neutral::One, json!(true), false),
        (Neutral::ZeroOrOne, json!([0, 1]), true),
        (Neutral::ZeroOrOne, json!(2), false),
        (Neutral::Identity, json!({"rows": 2, "cols": 2, "data": [1, 0, 0, 1]}), true),
        (Neutral::Identity, json!([[1, 0], [0.1, 1]]), false),
        (Neutral::Never, json!(null), true),
        (Neutral::Never, json!(0), false),
    ] {
        assert_eq!(neutral.matches(&value), expected, "{neutral:?} {value}");
    }
}

#[test]
fn coefficient_names_are_recognised() {
    for (name, expected) in [
        ("k4", true),
        ("p3", true),
        ("tauX", true),
        ("k", false),
        ("K1", false),
        ("kp1", false),
        ("s", false),
        ("p", false),
    ] {
        assert_eq!(is_coefficient(name), expected, "{name}");
    }
}

#[test]
fn unknown_conventions_are_reported() {
    let value = json!({"orientation": "upside_down", "pixel_origin": "corner", "color_encoding": "linear",
        "serial": "a1"});
    let notes = unapplied_notes(&[], &leaves(&value), &[]).join(" ");
    for word in ["orientation = `upside_down`", "pixel_origin = `corner`", "color_encoding = `linear`"] {
        assert!(notes.contains(word), "{notes}");
    }
    assert!(!notes.contains("serial"), "{notes}");
}
