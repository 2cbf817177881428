//! Table, summary and plots of a study.

use std::{collections::BTreeSet, fmt::Write as _};

use super::{Numbers, PlotSpec, Point, Study};
use crate::plot::{Plot, PlotError, Series};

/// A point with what its command left.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// The point.
    pub point: Point,
    /// Its numbers, or why there are none.
    pub result: Result<Numbers, String>,
}

/// A cell of a CSV file, quoted where it needs to be.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Text of a value; words without their quotes.
fn text_of(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// A few digits.
fn short(value: f64) -> String {
    let digits = if value.fract() == 0.0 { 0 } else { (3 - value.abs().log10().floor() as i32).clamp(0, 6) };
    format!("{value:.*}", digits as usize)
}

/// All keys that vary, in the order of the study.
fn keys(all: &[Done]) -> Vec<&str> {
    let mut known = Vec::new();
    for key in all.iter().flat_map(|done| done.point.keys()) {
        if !known.contains(&key) {
            known.push(key);
        }
    }
    known
}

/// The names of all numbers.
fn names(all: &[Done]) -> BTreeSet<&str> {
    let numbers = all.iter().filter_map(|done| done.result.as_ref().ok());
    numbers.flat_map(|numbers| numbers.0.keys().map(String::as_str)).collect()
}

/// `study.csv`: a row for each point, with its keys, seed and folder, its numbers, and why there are none.
#[must_use]
pub fn table(all: &[Done]) -> String {
    let (keys, names) = (keys(all), names(all));
    let has_seeds = all.iter().any(|done| done.point.seed.is_some());
    let header = keys.iter().copied().chain(has_seeds.then_some("seed")).chain(names.iter().copied());
    let mut text: String = header.chain(["folder", "problem"]).map(cell).collect::<Vec<_>>().join(",");
    text.push('\n');
    for Done { point, result } in all {
        let mut cells: Vec<String> =
            keys.iter().map(|key| point.value(key).map_or_else(String::new, text_of)).collect();
        cells.extend(has_seeds.then(|| point.seed.map_or_else(String::new, |seed| seed.to_string())));
        let number = |name: &&str| result.as_ref().ok().and_then(|numbers| numbers.0.get(*name));
        cells.extend(names.iter().map(|name| number(name).map_or_else(String::new, f64::to_string)));
        cells.push(point.folder());
        cells.push(result.as_ref().err().cloned().unwrap_or_default());
        let _ = writeln!(text, "{}", cells.iter().map(|text| cell(text)).collect::<Vec<_>>().join(","));
    }
    text
}

/// Numbers of equal points, which differ by their seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spread {
    mean: f64,
    low: f64,
    high: f64,
    count: usize,
}

impl Spread {
    fn of(values: &[f64]) -> Option<Self> {
        let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        let mean = finite.iter().sum::<f64>() / finite.len() as f64;
        let [low, high] = [f64::min, f64::max].map(|pick| finite.iter().copied().reduce(pick));
        Some(Self { mean, low: low?, high: high?, count: finite.len() })
    }
}

/// The distinct values of points, with all results of each, in order.
fn groups(all: &[Done]) -> Vec<(&Point, Vec<&Done>)> {
    let mut groups: Vec<(&Point, Vec<&Done>)> = Vec::new();
    for done in all {
        match groups.iter_mut().find(|(point, _)| point.values == done.point.values) {
            Some((_, same)) => same.push(done),
            None => groups.push((&done.point, vec![done])),
        }
    }
    groups
}

fn spread(group: &[&Done], name: &str) -> Option<Spread> {
    let numbers = group.iter().filter_map(|done| done.result.as_ref().ok());
    Spread::of(&numbers.filter_map(|numbers| numbers.0.get(name).copied()).collect::<Vec<_>>())
}

/// `study.md`: a row for each combination of values, with the mean of each number and, over several seeds, its range.
#[must_use]
pub fn summary(all: &[Done]) -> String {
    let (keys, names) = (keys(all), names(all));
    let row = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut text = row(keys.iter().copied().chain(names.iter().copied()).map(str::to_owned).collect());
    text += &row(vec!["---".to_owned(); keys.len() + names.len()]);
    for (point, group) in groups(all) {
        let values = keys.iter().map(|key| point.value(key).map_or_else(String::new, text_of));
        let numbers = names.iter().map(|name| match spread(&group, name) {
            None => "-".to_owned(),
            Some(Spread { mean, count: 1, .. }) => short(mean),
            Some(Spread { mean, low, high, .. }) => {
                format!("{} ({} .. {})", short(mean), short(low), short(high))
            }
        });
        text += &row(values.chain(numbers).collect());
    }
    text
}

/// The study's plots, or, if it names none, one of each number; each with the name of its file.
/// A plot without points is an error.
#[must_use]
pub fn plots(study: &Study, all: &[Done]) -> Vec<(String, Result<String, PlotError>)> {
    let specs = if study.plot.is_empty() { default_plots(all) } else { study.plot.clone() };
    specs.iter().map(|spec| (file_name(spec), plot(study, spec, all).svg())).collect()
}

/// Whether a file has the name of a plot of [`plots`].
#[must_use]
pub fn is_plot(file: &str) -> bool {
    file.contains("-over-") && file.ends_with(".svg")
}

fn file_name(spec: &PlotSpec) -> String {
    let by = spec.by.as_ref().map(|by| format!("-by-{by}")).unwrap_or_default();
    let plain = |c: char| if c.is_ascii_alphanumeric() || "_.-".contains(c) { c } else { '-' };
    format!("{}-over-{}{by}.svg", spec.y, spec.x).chars().map(plain).collect()
}

/// Each number over the first key that has several numbers, a curve for each value of the next key.
fn default_plots(all: &[Done]) -> Vec<PlotSpec> {
    let keys = keys(all);
    let is_axis = |key: &&&str| {
        let values: BTreeSet<u64> =
            all.iter().filter_map(|done| done.point.number(key)).map(f64::to_bits).collect();
        values.len() > 1
    };
    let Some(&x) = keys.iter().find(is_axis) else { return Vec::new() };
    let by = keys.iter().find(|key| **key != x).map(|key| (*key).to_owned());
    let has_values = |y: &&str| {
        let numbers = all.iter().filter_map(|done| done.result.as_ref().ok());
        numbers.filter_map(|numbers| numbers.0.get(*y)).any(|value| value.is_finite())
    };
    let plot = |y: &str| PlotSpec { x: x.to_owned(), y: y.to_owned(), by: by.clone(), log: false };
    names(all).into_iter().filter(has_values).map(plot).collect()
}

/// Points of a curve: x, and what is there.
type Curve<'a> = Vec<(f64, Vec<&'a Done>)>;

/// Means joined by lines, with bars from the least to the largest over the seeds.
fn plot(study: &Study, spec: &PlotSpec, all: &[Done]) -> Plot {
    // By curve and x, so that keys which a plot does not name are part of the spread.
    let mut curves: Vec<(String, Curve<'_>)> = Vec::new();
    for done in all {
        let Some(x) = done.point.number(&spec.x) else { continue };
        let curve = find_or_add(&mut curves, curve_name(study, spec, &done.point));
        find_or_add(curve, x).push(done);
    }
    let series = |(name, points): (String, Curve<'_>)| {
        let spread = |(x, group): &(f64, Vec<&Done>)| Some((*x, spread(group, &spec.y)?));
        let mut points: Vec<(f64, Spread)> = points.iter().filter_map(spread).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut series = Series::line(name, points.iter().map(|(x, spread)| (*x, spread.mean)).collect());
        series.bars = points
            .iter()
            .filter(|(_, spread)| spread.count > 1)
            .map(|(x, spread)| (*x, spread.low, spread.high))
            .collect();
        series
    };
    let seeds = study.seeds.len();
    Plot {
        title: match seeds {
            0 | 1 => spec.y.clone(),
            _ => format!("{}: mean and range of {seeds} seeds", spec.y),
        },
        x_label: study.label(&spec.x).to_owned(),
        y_label: spec.y.clone(),
        log: [false, spec.log],
        series: curves.into_iter().map(series).collect(),
    }
}

/// The value of a key of a list, which gets an empty one where it is new.
fn find_or_add<K: PartialEq, V: Default>(list: &mut Vec<(K, V)>, key: K) -> &mut V {
    let at = list.iter().position(|(known, _)| *known == key).unwrap_or(list.len());
    if at == list.len() {
        list.push((key, V::default()));
    }
    &mut list[at].1
}

/// The values of the other keys: that of `by`, or of all but x.
fn curve_name(study: &Study, spec: &PlotSpec, point: &Point) -> String {
    let others = point.values.iter().filter(|(key, _)| *key != spec.x);
    let shown = others.filter(|(key, _)| spec.by.as_ref().is_none_or(|by| by == key));
    let names: Vec<String> =
        shown.map(|(key, value)| format!("{} {}", study.label(key), text_of(value))).collect();
    match (names.is_empty(), &spec.by) {
        (true, Some(by)) => format!("{} -", study.label(by)),
        (true, None) => spec.y.clone(),
        (false, _) => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(plot: Vec<PlotSpec>) -> Study {
        let text = "scenario = \"s.toml\"\ncommand = [\"x\", \"{result}\"]\nseeds = [1, 2]\n\
            [[vary]]\nkey = \"a\"\nvalues = [1, 2]\nlabel = \"a, ms\"\n\
            [[vary]]\nkey = \"b\"\nvalues = [\"one, two\", \"three\"]\n";
        Study { plot, ..toml::from_str(text).expect("a study") }
    }

    /// The number `e` is ten times `a` plus the seed.
    fn done(study: &Study) -> Vec<Done> {
        let result = |point: &Point| {
            let e = 10.0 * point.number("a")? + point.seed? as f64;
            Some(Numbers([("e".to_owned(), e)].into()))
        };
        let done = |point: Point| Done { result: result(&point).ok_or_else(String::new), point };
        study.points().into_iter().map(done).collect()
    }

    #[test]
    fn the_table_has_a_row_for_each_point_and_quotes_words_with_commas() {
        let table = table(&done(&study(Vec::new())));
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!((lines[0], lines.len()), ("a,b,seed,e,folder,problem", 9));
        assert!(lines[1].starts_with("1,\"one, two\",1,11,a=1_b=-one--two-_seed=1_"), "{}", lines[1]);
    }

    #[test]
    fn the_summary_has_means_and_ranges_over_the_seeds() {
        let summary = summary(&done(&study(Vec::new())));
        assert_eq!(summary.lines().nth(2), Some("| 1 | one, two | 11.50 (11 .. 12) |"));
        assert_eq!(summary.lines().count(), 6);
    }

    #[test]
    fn plots_have_a_curve_for_each_other_value_and_a_bar_for_each_spread() {
        let default = study(Vec::new());
        let [(name, Ok(svg))] = &plots(&default, &done(&default))[..] else { panic!("one plot") };
        assert_eq!(name, "e-over-a-by-b.svg");
        assert!(is_plot(name) && !is_plot("own.svg"));
        assert!(svg.contains("a, ms") && svg.contains("b three"), "{svg}");
        let spec = PlotSpec { x: "a".into(), y: "e".into(), by: None, log: false };
        let curves = |study: &Study, all: &[Done], spec: &PlotSpec| plot(study, spec, all).series;
        let by = PlotSpec { by: Some("b".into()), ..spec.clone() };
        let series = curves(&default, &done(&default), &by);
        assert_eq!(series.len(), 2);
        assert_eq!(series[0].points, [(1.0, 11.5), (2.0, 21.5)]);
        assert_eq!(series[0].bars, [(1.0, 11.0, 12.0), (2.0, 21.0, 22.0)]);
        let missing = PlotSpec { y: "f".into(), ..spec };
        let missing = study(vec![missing]);
        assert!(matches!(plots(&missing, &done(&missing))[..], [(_, Err(PlotError::Empty(_)))]));
    }

    #[test]
    fn failed_points_have_a_problem_and_no_number() {
        let study = study(Vec::new());
        let mut all = done(&study);
        all[0].result = Err("broke".into());
        assert!(table(&all).lines().nth(1).is_some_and(|line| line.ends_with(",broke")));
        assert!(summary(&all).contains("| 1 | one, two | 12 |"));
    }
}
