#![allow(clippy::unwrap_used)]

use serde_json::json;

use super::*;

#[test]
fn patterns() {
    for (pattern, path, fit) in [
        ("a.b", "a.b", true),
        ("a.b", "a.b.c", false),
        ("cam*.rostopic", "cam12.rostopic", true),
        ("cam*.rostopic", "scam1.rostopic", false),
        ("Viewer.**", "Viewer.PointSize", true),
        ("Viewer.**", "Viewer", false),
        ("**", "x.y", true),
        ("imu_bias/*", "imu_bias/ax", true),
    ] {
        assert_eq!(matches(pattern, path), fit, "{pattern} {path}");
    }
}

#[test]
fn leaves_are_numbers_words_and_whole_lists() {
    let value = json!({"a": {"b": 1}, "m": {"rows": 1, "cols": 2, "data": [1, 2]}, "l": [{"c": [[1], [2]]}, {"c": "x"}], "e": {}});
    let paths: Vec<String> = leaves(&value).into_iter().map(|leaf| leaf.path).collect();
    assert_eq!(paths, ["a.b", "e", "l[0].c", "l[1].c", "m"]);
    let leaf = Leaf { path: "l[0].c[12].d".to_owned(), value: &value };
    assert_eq!((leaf.bare().as_ref(), leaf.name()), ("l.c.d", "d"));
}

#[test]
fn neutral_values() {
    for (neutral, value, is) in [
        (Neutral::Zero, json!(0.0), true),
        (Neutral::Zero, json!([0, 0]), true),
        (Neutral::Zero, json!("0"), true),
        (Neutral::Zero, json!(false), true),
        (Neutral::Zero, json!(true), false),
        (Neutral::Zero, json!("name"), false),
        (Neutral::One, json!(1), true),
        (Neutral::One, json!(true), false),
        (Neutral::UpToOne, json!([0, 1]), true),
        (Neutral::UpToOne, json!(2), false),
        (Neutral::Identity, json!({"rows": 2, "cols": 2, "data": [1, 0, 0, 1]}), true),
        (Neutral::Identity, json!([[1, 0], [0.1, 1]]), false),
        (Neutral::Never, json!(null), true),
        (Neutral::Never, json!(0), false),
    ] {
        assert_eq!(neutral.is(&value), is, "{neutral:?} {value}");
    }
}

#[test]
fn coefficients_by_name() {
    for (name, is) in [
        ("k4", true),
        ("p3", true),
        ("tauX", true),
        ("k", false),
        ("K1", false),
        ("kp1", false),
        ("s", false),
        ("p", false),
    ] {
        assert_eq!(is_coefficient(name), is, "{name}");
    }
}

#[test]
fn words_that_change_a_meaning_are_named() {
    let value = json!({"orientation": "upside_down", "pixel_origin": "corner", "color_encoding": "linear", "serial": "a1"});
    let notes = left_out(&[], &leaves(&value), &[]).join(" ");
    for word in ["orientation = `upside_down`", "pixel_origin = `corner`", "color_encoding = `linear`"] {
        assert!(notes.contains(word), "{notes}");
    }
    assert!(!notes.contains("serial"), "{notes}");
}
