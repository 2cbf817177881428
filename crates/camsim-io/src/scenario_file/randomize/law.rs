//! The distribution of one key as it is written, and the values that it gives.

use camsim_core::distribution::{Distribution, Draws, choose, to_12_digits};
use toml::{Table, Value};

use super::super::{similar::nearest_word, tree::join};

/// Words of distributions.
pub(super) const KINDS: [&str; 8] =
    ["uniform", "log_uniform", "normal", "integer", "choice", "times", "plus", "piece_s"];
/// Words that go with them.
const OPTIONS: [&str; 2] = ["clip", "weights"];

/// How a value is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Law {
    /// A number.
    Number(Distribution),
    /// A list of independent numbers.
    Numbers(Vec<Distribution>),
    /// One of these values, by their weights.
    Choice(Vec<Value>, Vec<f64>),
    /// The value that stands there, times a drawn one.
    Times(Box<Law>),
    /// The value that stands there, plus a drawn one.
    Plus(Box<Law>),
    /// A piece of this length of the interval that stands there.
    Piece(f64),
}

impl Law {
    /// Reads a distribution, `{ uniform = [2, 10] }`.
    pub(super) fn parse(value: &Value) -> Result<Self, String> {
        let usage = "expected a distribution, such as { uniform = [2, 10] }, { log_uniform = [1, 100] }, { normal = \
                     [5, 1], clip = [2, 8] }, { integer = [1, 6] } or { choice = [1, 2, 5] }";
        let table = value.as_table().ok_or_else(|| format!("{usage}; found {value}"))?;
        let kinds: Vec<&str> = KINDS.into_iter().filter(|kind| table.contains_key(*kind)).collect();
        let known = |name: &str| KINDS.contains(&name) || OPTIONS.contains(&name);
        if let Some(name) = table.keys().find(|name| !known(name)) {
            let all: Vec<&str> = KINDS.into_iter().chain(OPTIONS).collect();
            let hint =
                nearest_word(name, &all).map_or_else(String::new, |word| format!("; did you mean `{word}`?"));
            return Err(
                format!("`{name}` is no distribution{hint} {usage}").replace("? expected", "? Expected")
            );
        }
        let [kind] = kinds[..] else {
            return Err(if kinds.is_empty() {
                usage.to_owned()
            } else {
                format!("has {}: keep one", kinds.join(" and "))
            });
        };
        let wanted = match kind {
            "normal" => Some("clip"),
            "choice" => Some("weights"),
            _ => None,
        };
        if let Some(option) =
            OPTIONS.iter().find(|option| table.contains_key(**option) && wanted != Some(**option))
        {
            return Err(format!("{option} does not go with {kind}; leave it out"));
        }
        let given = &table[kind];
        match kind {
            "choice" => choice(given, table.get("weights")),
            "times" => Ok(Self::Times(Box::new(Self::parse_numbers(given)?))),
            "plus" => Ok(Self::Plus(Box::new(Self::parse_numbers(given)?))),
            "piece_s" => match number(given).filter(|length| *length > 0.0 && length.is_finite()) {
                Some(length) => Ok(Self::Piece(length)),
                None => Err(format!("piece_s: expected a number of seconds above 0, found {given}")),
            },
            _ => numbers(kind, given, table),
        }
    }

    /// A distribution of numbers, within `times` or `plus`.
    fn parse_numbers(value: &Value) -> Result<Self, String> {
        match Self::parse(value)? {
            law @ (Self::Number(_) | Self::Numbers(_)) => Ok(law),
            _ => Err(
                "times and plus take a distribution of numbers, such as { times = { uniform = [0.9, 1.1] } }"
                    .into(),
            ),
        }
    }

    /// Whether it gives only whole numbers.
    pub(super) fn is_whole(&self) -> bool {
        let whole = |distribution: &Distribution| matches!(distribution, Distribution::Integer { .. });
        match self {
            Self::Number(distribution) => whole(distribution),
            Self::Numbers(list) => list.iter().all(whole),
            Self::Choice(..) => true,
            Self::Times(_) | Self::Plus(_) | Self::Piece(_) => false,
        }
    }

    /// Whether it gives a list with a fixed number of numbers.
    pub(super) fn is_numbers(&self) -> bool {
        matches!(self, Self::Numbers(_) | Self::Piece(_))
    }

    /// Value `index` of the random numbers called `name`. `base` is the value that stands at its key.
    pub(super) fn value(
        &self,
        seed: u64,
        name: &str,
        index: u64,
        base: Option<&Value>,
    ) -> Result<Value, String> {
        let unit = |name: &str| Draws::new(seed, name).unit(index);
        match self {
            Self::Number(distribution) => Ok(drawn(distribution, unit(name))),
            Self::Numbers(list) => {
                let one = |(i, distribution)| drawn(distribution, unit(&join(name, &format!("{i}"))));
                Ok(Value::Array(list.iter().enumerate().map(one).collect()))
            }
            Self::Choice(values, fractions) => Ok(values[choose(fractions, unit(name))].clone()),
            Self::Times(law) => combined(base, &law.value(seed, name, index, None)?, |a, b| a * b),
            Self::Plus(law) => combined(base, &law.value(seed, name, index, None)?, |a, b| a + b),
            Self::Piece(length) => piece(base, *length, unit(name)),
        }
    }
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

fn drawn(distribution: &Distribution, unit: f64) -> Value {
    let value = distribution.quantile(unit);
    match distribution {
        Distribution::Integer { .. } => Value::Integer(value as i64),
        _ => Value::Float(value),
    }
}

/// `choice = [...]`, with `weights` or without.
fn choice(given: &Value, weights: Option<&Value>) -> Result<Law, String> {
    let values = given.as_array().filter(|values| !values.is_empty());
    let values = values.ok_or("choice: expected a list of values, such as { choice = [1, 2, 5] }")?;
    let fractions = match weights {
        None => vec![1.0; values.len()],
        Some(weights) => {
            let fractions: Option<Vec<f64>> =
                weights.as_array().and_then(|weights| weights.iter().map(number).collect());
            let is_legal = |fractions: &Vec<f64>| {
                fractions.len() == values.len()
                    && fractions.iter().all(|fraction| *fraction >= 0.0 && fraction.is_finite())
                    && fractions.iter().sum::<f64>() > 0.0
            };
            fractions.filter(is_legal).ok_or_else(|| {
                format!("weights: expected {} numbers, 0 or more, one for each choice", values.len())
            })?
        }
    };
    Ok(Law::Choice(values.clone(), fractions))
}

/// A distribution of two numbers, or of two lists of numbers.
fn numbers(kind: &str, given: &Value, table: &Table) -> Result<Law, String> {
    let pair = |value: &Value| match value.as_array().map(Vec::as_slice) {
        Some([low, high]) => Some([low.clone(), high.clone()]),
        _ => None,
    };
    let two = if kind == "normal" { "[mean, standard deviation]" } else { "[lowest, highest]" };
    let wrong = || format!("{kind}: expected two numbers, {two}, or two lists of numbers, found {given}");
    let [first, second] = pair(given).ok_or_else(wrong)?;
    let clip = match table.get("clip") {
        None => [f64::NEG_INFINITY, f64::INFINITY].map(Value::Float),
        Some(clip) => pair(clip)
            .ok_or_else(|| format!("clip: expected two numbers, [lowest, highest], found {clip}"))?,
    };
    let parts = [&first, &second, &clip[0], &clip[1]];
    let lengths: Vec<usize> = parts.iter().filter_map(|part| part.as_array().map(Vec::len)).collect();
    let one = |i: usize| -> Result<Distribution, String> {
        let [a, b, low, high] = parts.map(|part| part.as_array().map_or(part, |list| &list[i]));
        let distribution = distribution(kind, [a, b], [low, high]).ok_or_else(wrong)?;
        distribution.check().map_err(|problem| format!("{kind} {problem}"))?;
        Ok(distribution)
    };
    match lengths.first() {
        None => Ok(Law::Number(one(0)?)),
        Some(0) => Err(wrong()),
        Some(length) if lengths.iter().any(|other| other != length) => {
            Err(format!("{kind}: its lists have different lengths"))
        }
        Some(length) => Ok(Law::Numbers((0..*length).map(one).collect::<Result<_, _>>()?)),
    }
}

fn distribution(kind: &str, [a, b]: [&Value; 2], clip: [&Value; 2]) -> Option<Distribution> {
    if kind == "integer" {
        return Some(Distribution::Integer { low: a.as_integer()?, high: b.as_integer()? });
    }
    let (a, b) = (number(a)?, number(b)?);
    Some(match kind {
        "uniform" => Distribution::Uniform { low: a, high: b },
        "log_uniform" => Distribution::LogUniform { low: a, high: b },
        _ => Distribution::Normal { mean: a, sigma: b, clip: [number(clip[0])?, number(clip[1])?] },
    })
}

/// A number, or each number of a list, with a drawn one or with its own of a drawn list.
fn combined(base: Option<&Value>, drawn: &Value, with: fn(f64, f64) -> f64) -> Result<Value, String> {
    let none = || "has no value that could be changed; state one in the scenario".to_owned();
    let wrong = |base: &Value| format!("is {base}, which is not a number that could be changed");
    let base = base.ok_or_else(none)?;
    let one = |base: &Value, drawn: &Value| -> Result<Value, String> {
        let (Some(a), Some(b)) = (number(base), number(drawn)) else { return Err(wrong(base)) };
        Ok(Value::Float(to_12_digits(with(a, b))))
    };
    match (base, drawn) {
        (Value::Array(list), Value::Array(drawn)) if list.len() == drawn.len() => {
            Ok(Value::Array(list.iter().zip(drawn).map(|(a, b)| one(a, b)).collect::<Result<_, _>>()?))
        }
        (Value::Array(list), Value::Array(drawn)) => {
            Err(format!("is a list of {} numbers, and the distribution gives {}", list.len(), drawn.len()))
        }
        (Value::Array(list), drawn) => {
            Ok(Value::Array(list.iter().map(|a| one(a, drawn)).collect::<Result<_, _>>()?))
        }
        (base, drawn) => one(base, drawn),
    }
}

/// A piece of an interval, which begins at a whole microsecond.
fn piece(base: Option<&Value>, length: f64, unit: f64) -> Result<Value, String> {
    let ends: Option<Vec<f64>> =
        base.and_then(Value::as_array).and_then(|ends| ends.iter().map(number).collect());
    let Some([start, end]) = ends.as_deref() else {
        return Err("state flight.window_s in the scenario: pieces are taken from it".into());
    };
    let rest = end - start - length;
    if rest < 0.0 {
        return Err(format!("a piece of {length} s does not fit into the window [{start}, {end}]"));
    }
    let begin = start + (unit * rest * 1e6).floor() * 1e-6;
    let begin = (begin * 1e6).round() / 1e6;
    Ok(Value::Array(vec![Value::Float(begin), Value::Float(begin + length)]))
}
