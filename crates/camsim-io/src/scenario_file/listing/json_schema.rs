//! The JSON schema of scenarios, for editors.

use camsim_core::scenario::{
    Scenario,
    keys::{End, Field, Value as _, ValueKind},
};
use serde_json::{Map, Value, json};

/// The schema (draft 7), as editors of TOML read it: names, kinds, ranges, words and descriptions of all keys.
#[must_use]
pub fn json_schema() -> Value {
    let mut root = table(Scenario::FIELDS, Scenario::ABOUT);
    let camera = root["properties"]["camera"].take();
    let mut of_rig = camera.clone();
    of_rig["properties"]["file"] =
        json!({ "type": "string", "description": "Camera file; the keys beside it replace its own." });
    of_rig["required"] = json!(["name"]);
    root["properties"]["camera"] = json!({
        "description": "The camera, or the path of a CAMERA.toml.",
        "anyOf": [{ "$ref": "#/definitions/camera" }, { "type": "string" }],
    });
    root["properties"]["cameras"] = json!({
        "description": "Several cameras on the platform, instead of `camera`.",
        "type": "array",
        "items": of_rig,
    });
    root["properties"]["randomize"] = json!({
        "description": "Keys whose values are drawn, each with its distribution.",
        "type": "object",
    });
    root["definitions"] = json!({ "camera": camera });
    root["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    root["title"] = json!("camsim scenario");
    root
}

fn table(fields: &[Field], about: &str) -> Value {
    let properties: Map<String, Value> =
        fields.iter().map(|field| (field.name.to_owned(), property(field))).collect();
    let required: Vec<&str> =
        fields.iter().filter(|field| field.is_required).map(|field| field.name).collect();
    let mut schema = json!({
        "type": "object",
        "description": about,
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    schema
}

fn property(field: &Field) -> Value {
    let mut schema = of_kind(field);
    let unit = if field.unit.is_empty() { String::new() } else { format!(" Unit: {}.", field.unit) };
    schema["description"] = json!(format!("{}{unit}", field.about));
    let default = format!("v = {}", (field.default)());
    let default = toml::from_str::<Value>(&default).ok().filter(|_| !field.is_required);
    if let Some(default) = default.and_then(|mut table| table.get_mut("v").map(Value::take)) {
        schema["default"] = default;
    }
    schema
}

fn of_kind(field: &Field) -> Value {
    let (number, text) = (|| limited("number", field), json!({ "type": "string" }));
    let list = |items: Value| json!({ "type": "array", "items": items });
    let fixed = |items: Value, count: usize| {
        let length = json!(count);
        json!({ "type": "array", "items": items, "minItems": length, "maxItems": length })
    };
    let either = |first: Value, second: Value| json!({ "anyOf": [first, second] });
    match field.kind {
        ValueKind::Number => number(),
        ValueKind::Whole | ValueKind::Within(..) => limited("integer", field),
        ValueKind::NumberOr(names) => either(number(), words(field, names)),
        ValueKind::CountOr(_, names) => either(limited("integer", field), words(field, names)),
        ValueKind::Numbers(count) => fixed(number(), count),
        ValueKind::Counts(count, _) => fixed(limited("integer", field), count),
        ValueKind::NumbersOr(count, word) => either(fixed(number(), count), words(field, &[word])),
        ValueKind::NumberOrNumbers(count) => either(number(), fixed(number(), count)),
        ValueKind::NumberOrList => either(number(), list(number())),
        ValueKind::NumberList => list(number()),
        ValueKind::WholeList => list(limited("integer", field)),
        ValueKind::Points(count) => list(fixed(number(), count)),
        ValueKind::Flag => json!({ "type": "boolean" }),
        ValueKind::Path | ValueKind::Text => text,
        ValueKind::Paths => either(text.clone(), list(text)),
        ValueKind::Texts => list(text),
        ValueKind::Word(names) => words(field, names),
        ValueKind::Words(names) => list(words(field, names)),
        ValueKind::WordsOrTables(names) => {
            let one = either(words(field, names), json!({ "type": "string", "pattern": "\\.[cC][sS][vV]$" }));
            either(one.clone(), list(one))
        }
        ValueKind::Numbered(..) => {
            json!({ "type": "object", "additionalProperties": limited("integer", field) })
        }
        ValueKind::Table => table(field.fields, field.about),
        ValueKind::Tables => list(table(field.fields, field.about)),
    }
}

/// A number within its legal interval.
fn limited(kind: &str, field: &Field) -> Value {
    if !field.only.is_empty() {
        return json!({ "type": kind, "enum": field.only });
    }
    // TOML tells 4 from 4.0, and servers such as tombi take "number" alone as the latter.
    let mut schema = match kind {
        "number" => json!({ "type": ["number", "integer"] }),
        kind => json!({ "type": kind }),
    };
    let ends = [(field.low, "minimum", "exclusiveMinimum"), (field.high, "maximum", "exclusiveMaximum")];
    for (end, closed, open) in ends {
        match end {
            End::None => {}
            End::Closed(value) => schema[closed] = json!(value),
            End::Open(value) => schema[open] = json!(value),
        }
    }
    if kind == "integer" && field.low == End::None {
        schema["minimum"] = json!(0);
    }
    schema
}

/// One of some words, with what each means, as Visual Studio Code and taplo show it.
fn words(field: &Field, names: &[&str]) -> Value {
    let about = |name: &&str| {
        field.words.iter().find(|word| word.name == *name).map_or("", |word| word.about).to_owned()
    };
    let about: Vec<String> = names.iter().map(about).collect();
    let mut schema = json!({ "type": "string", "enum": names });
    if about.iter().any(|text| !text.is_empty()) {
        schema["enumDescriptions"] = json!(about);
        schema["x-taplo"] = json!({ "docs": { "enumValues": about } });
    }
    schema
}
