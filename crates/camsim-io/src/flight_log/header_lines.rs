//! Which of the lines above the rows name the columns, which state their units, and which are prose.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightSpec, LogFormat},
};

use super::{
    column_meaning::ColumnMeaning,
    header::{HeaderColumn, HeaderColumns, ParsedName, parse_name, parse_qualifiers},
    missing_columns::missing_columns_message,
    text_table::{HeaderLine, Table, is_missing},
    time_fields,
    units::Qualifier,
};

/// Known names from which on a comment is taken for names of columns, not for prose.
const MIN_KNOWN_NAMES: usize = 3;

/// The lines above the rows, sorted.
#[derive(Debug, Default)]
pub(super) struct HeaderLines<'a> {
    /// The columns, with the line that names them.
    pub(super) names: Option<(usize, HeaderColumns)>,
    /// A comment that names another number of columns than the rows have, with these names.
    pub(super) misfit: Option<(usize, Vec<&'a str>)>,
    /// Lines of words that are neither names nor units.
    pub(super) prose: Vec<HeaderLine<'a>>,
}

impl<'a> HeaderLines<'a> {
    /// Sorts the lines above the rows. The last line that names a time and a position counts; units and names
    /// of the lines beside it are added.
    ///
    /// # Errors
    /// A line that is no comment does not fit, or two lines contradict each other.
    pub(super) fn sort(table: &Table<'a>, spec: &FlightSpec, notes: &mut Vec<Note>) -> Result<Self, String> {
        let complete = table.headers.iter().enumerate().rev().find_map(|(index, line)| {
            Some((index, complete_names(table, line)?)).filter(|(_, header)| {
                // A comment of another width may still be prose about the columns.
                !line.is_comment || table.fits(header.0.len())
            })
        });
        let Some((index, header)) = complete else { return Self::without_names(table, spec, notes) };
        let names_line = table.headers[index];
        if !table.fits(header.0.len()) {
            return Err(format!(
                "line {}: {}",
                names_line.number,
                width_message(&table.names(names_line.text), table)
            ));
        }
        let mut header = header;
        let mut prose = Vec::new();
        for (other, line) in table.headers.iter().enumerate().filter(|&(other, _)| other != index) {
            if let Some(cells) = unit_cells(&header, table, line.text) {
                add_units(&mut header, &cells);
                let text = format!("line {} states the units of the columns", line.number);
                notes.push(Note::information(text));
            } else if let Some(second) = second_names(&header, table, line) {
                merge(&mut header, &second, [line.number, names_line.number]);
                let text = format!("lines {} and {} both name the columns", line.number, names_line.number);
                notes.push(Note::information(text));
            } else if line.is_comment || other < index {
                prose.push(*line);
            } else {
                let below = HeaderColumns::parse(&table.names(line.text));
                return Err(format!("line {}: {}", line.number, below_message(&below, names_line.number)));
            }
        }
        Ok(Self { names: Some((names_line.number, header)), misfit: None, prose })
    }

    /// The lines of a table none of which names a time and a position.
    fn without_names(table: &Table<'a>, spec: &FlightSpec, notes: &mut Vec<Note>) -> Result<Self, String> {
        let parsed = |line: &HeaderLine<'a>| HeaderColumns::parse(&table.names(line.text));
        let must_be_names = table.headers.iter().filter(|line| !line.is_comment);
        let best = must_be_names.max_by_key(|line| known_names(&parsed(line)));
        let fitting_comment = || {
            table.headers.iter().rev().find(|line| {
                let header = parsed(line);
                table.fits(header.0.len())
                    && known_names(&header) >= MIN_KNOWN_NAMES
                    && known_names(&header) * 2 >= header.0.len()
            })
        };
        if let Some(line) = best.or_else(fitting_comment) {
            let problem = format!("line {}: {}", line.number, missing_columns_message(&parsed(line)));
            if !line.is_comment || spec.format == LogFormat::Auto {
                return Err(problem);
            }
            notes.push(Note::warning(format!("{problem}; flight.format counts")));
        }
        let misfit = table.headers.iter().rev().find_map(|line| {
            let names = without_words_before(table.names(line.text));
            HeaderColumns::parse(&names).has_time_and_position().then_some((line.number, names))
        });
        Ok(Self { names: None, misfit, prose: table.headers.clone() })
    }
}

fn known_names(header: &HeaderColumns) -> usize {
    header.0.iter().filter(|column| column.parsed.is_some()).count()
}

/// Message for names of another number than the columns.
pub(super) fn width_message(names: &[&str], table: &Table<'_>) -> String {
    // RTKLIB's name of such columns.
    if names.contains(&"latitude(d'\")") {
        return "degrees, minutes and seconds stand in columns of their own: write degrees with decimals (RTKLIB: \
                Lat/Lon format ddd.ddddddd)"
            .to_owned();
    }
    format!(
        "it names {} columns, but the rows have {}: give every column one name (a comma within a name needs \
            quotes, decimal commas need semicolons between the columns)",
        names.len(),
        table.columns
    )
}

fn below_message(below: &HeaderColumns, names_line: usize) -> String {
    if known_names(below) > 1 {
        return missing_columns_message(below);
    }
    let words: Vec<&str> = below.0.iter().map(|column| column.name.as_str()).collect();
    format!(
        "`{}` stands between the names of the columns (line {names_line}) and the rows, and is no line of \
            units: remove it, or begin it with #",
        words.join(", ")
    )
}

/// The columns that a line names, if they include a time and a position.
fn complete_names(table: &Table<'_>, line: &HeaderLine<'_>) -> Option<HeaderColumns> {
    let header = HeaderColumns::parse(&names_of_columns(table, line.text));
    if header.has_time_and_position() && (table.fits(header.0.len()) || !line.is_comment) {
        return Some(header);
    }
    if line.is_comment { header_after_prose(table, line.text) } else { None }
}

/// The names of a header, one for each column. A time in two columns, a date and a clock or a GPS week and
/// its seconds, may have one name.
fn names_of_columns<'a>(table: &Table<'a>, text: &'a str) -> Vec<&'a str> {
    let mut names = table.names(text);
    if names.len() + 1 != table.columns {
        return names;
    }
    let Some(first) = table.rows.first().map(|row| table.fields(row)) else { return names };
    let is_number_in = |field: &str, range: std::ops::Range<f64>| {
        table.number(field).is_some_and(|value| range.contains(&value))
    };
    for (index, pair) in first.windows(2).enumerate().take(names.len()) {
        let meaning = HeaderColumns::parse(&names[index..=index]).parsed(0).map(|parsed| parsed.meaning);
        if !matches!(meaning, Some(ColumnMeaning::Time | ColumnMeaning::DateTime)) {
            continue;
        }
        if time_fields::date_ns(pair[0]).is_some() && time_fields::clock_ns(pair[1]).is_some() {
            names.insert(index, "date");
            break;
        }
        // Weeks since 1980, of this century.
        if meaning == Some(ColumnMeaning::DateTime)
            && pair[0].bytes().all(|byte| byte.is_ascii_digit())
            && is_number_in(pair[0], 1000.0..6000.0)
            && is_number_in(pair[1], 0.0..604_801.0)
        {
            names.splice(index..=index, ["week", "tow_s"]);
            break;
        }
    }
    names
}

/// The header at the end of a comment, as in `# format: timestamp tx ty ...` and `# columns are t x y ...`:
/// the names after a colon or an equals sign, else as many of the last words as the table has columns.
fn header_after_prose(table: &Table<'_>, text: &str) -> Option<HeaderColumns> {
    let after_mark = text.match_indices([':', '=']).map(|(mark, _)| &text[mark + 1..]);
    let mut headers = after_mark.map(|text| HeaderColumns::parse(&table.names(text.trim())));
    let fits = |header: &HeaderColumns| table.fits(header.0.len()) && header.has_time_and_position();
    headers.find(fits).or_else(|| {
        let names = table.names(text);
        let prose_words = names.len().checked_sub(table.columns)?;
        let is_prose = names
            .get(..prose_words)?
            .iter()
            .all(|word| HeaderColumns::parse(&[word]).0.iter().all(|column| column.parsed.is_none()));
        is_prose.then(|| HeaderColumns::parse(&names[prose_words..])).filter(fits)
    })
}

/// Names without a label before them, as `format:` is.
fn without_words_before(mut names: Vec<&str>) -> Vec<&str> {
    let is_label = |name: &&str| name.ends_with([':', '=']);
    if let Some(label) = names.iter().rposition(is_label) {
        names.drain(..=label);
    }
    names
}

/// The cells of a line of units above or below the names; `None` if it is none. Cells may be empty, and those
/// of columns that are not read may hold any word.
fn unit_cells<'a>(header: &HeaderColumns, table: &Table<'a>, text: &'a str) -> Option<Vec<&'a str>> {
    let text = without_label(text);
    let cells =
        table.cells(text, header.0.len()).or_else(|| cells_of_columns_with_units(header, table, text))?;
    let (mut units, mut others) = (0, 0);
    for (column, cell) in cells.iter().enumerate().filter(|(_, cell)| !is_missing(cell)) {
        let bare = cell.trim_matches(['[', ']', '(', ')', '"', ' ']);
        let wanted = header.parsed(column).map(|parsed| parsed.meaning.dimension());
        let unit_of = |qualifiers: Vec<Qualifier>| {
            qualifiers.into_iter().find_map(|qualifier| match qualifier {
                Qualifier::Unit(unit) => Some(unit.dimension),
                _ => None,
            })
        };
        match (parse_qualifiers(bare).map(unit_of), wanted) {
            (Some(Some(dimension)), Some(wanted)) if wanted == Some(dimension) => units += 1,
            (Some(Some(_)) | None, Some(_)) => others += 1,
            _ => {}
        }
    }
    (units > others).then_some(cells)
}

/// The cells of a line that leaves out the columns without a unit, as those of quality.
fn cells_of_columns_with_units<'a>(
    header: &HeaderColumns,
    table: &Table<'a>,
    text: &'a str,
) -> Option<Vec<&'a str>> {
    let has_unit =
        |column: usize| header.parsed(column).is_some_and(|parsed| parsed.meaning.dimension().is_some());
    let columns: Vec<usize> = (0..header.0.len()).filter(|&column| has_unit(column)).collect();
    let units = table.cells(text, columns.len())?;
    let mut cells = vec![""; header.0.len()];
    for (column, unit) in columns.into_iter().zip(units) {
        let wanted = header.parsed(column).and_then(|parsed| parsed.meaning.dimension());
        let bare = unit.trim_matches(['[', ']', '(', ')', '"', ' ']);
        let found = parse_qualifiers(bare)?.into_iter().find_map(|qualifier| match qualifier {
            Qualifier::Unit(unit) => Some(unit.dimension),
            _ => None,
        });
        if found != wanted {
            return None;
        }
        cells[column] = unit;
    }
    Some(cells)
}

/// A line without a label such as `units:` or `Unit,` before the cells.
fn without_label(text: &str) -> &str {
    let lower = text.to_ascii_lowercase();
    let rest = ["units", "unit"].into_iter().find_map(|label| lower.strip_prefix(label));
    match rest.filter(|rest| rest.starts_with([':', '=', ' ', ',', ';', '\t'])) {
        Some(rest) => text[text.len() - rest.len()..].trim_start_matches([':', '=', ' ', ',', ';', '\t']),
        None => text,
    }
}

/// Adds the units of cells to the columns that are known.
fn add_units(header: &mut HeaderColumns, cells: &[&str]) {
    for (column, cell) in header.0.iter_mut().zip(cells).filter(|(_, cell)| !is_missing(cell)) {
        let Some(parsed) = &column.parsed else { continue };
        // Dates and words such as `quaternion` have no unit.
        if parsed.meaning.dimension().is_some()
            && let Some(with_unit) = parse_name(&column.name, Some(cell))
        {
            column.parsed = Some(with_unit);
        }
    }
}

/// The columns of a line above or below the names that names as many, most of them known.
fn second_names(header: &HeaderColumns, table: &Table<'_>, line: &HeaderLine<'_>) -> Option<HeaderColumns> {
    let second = HeaderColumns::parse(&table.names(line.text));
    let agreeing = |(ours, theirs): &(&HeaderColumn, &HeaderColumn)| match (&ours.parsed, &theirs.parsed) {
        (Some(ours), Some(theirs)) => merged(ours, theirs).is_some(),
        _ => false,
    };
    // `world frame: NED (x north, y east, z down)` has as many words as columns.
    if line.is_comment && header.0.iter().zip(&second.0).filter(agreeing).count() * 2 < known_names(&second) {
        return None;
    }
    let is_header = second.0.len() == header.0.len()
        && known_names(&second) >= MIN_KNOWN_NAMES
        && known_names(&second) * 2 >= known_names(header);
    is_header.then_some(second)
}

/// Adds what a second line of names says: names that the first does not know, units, datums.
fn merge(header: &mut HeaderColumns, second: &HeaderColumns, lines: [usize; 2]) {
    for (column, other) in header.0.iter_mut().zip(&second.0) {
        let Some(theirs) = &other.parsed else { continue };
        let Some(ours) = &column.parsed else {
            *column = other.clone();
            continue;
        };
        match merged(ours, theirs) {
            Some(both) if both == *ours => {}
            Some(both) => *column = HeaderColumn { name: other.name.clone(), parsed: Some(both) },
            None => {
                let problem = Some(format!(
                    "line {} names it `{}` and line {} `{}`: remove one of these lines",
                    lines[0], other.name, lines[1], column.name
                ));
                column.parsed = Some(ParsedName { problem, ..ours.clone() });
            }
        }
    }
}

/// What two names of one column say together; `None` if they contradict each other.
fn merged(ours: &ParsedName, theirs: &ParsedName) -> Option<ParsedName> {
    let finer = if ours.meaning == theirs.meaning || refines(ours.meaning, theirs.meaning) {
        ours
    } else if refines(theirs.meaning, ours.meaning) {
        theirs
    } else {
        return None;
    };
    let unit = match (ours.unit, theirs.unit) {
        (Some(one), Some(other)) if one != other => return None,
        (one, other) => one.or(other),
    };
    let problem = ours.problem.clone().or_else(|| theirs.problem.clone());
    Some(ParsedName { unit, problem, ..finer.clone() })
}

/// Whether a meaning says more than another one.
fn refines(fine: ColumnMeaning, coarse: ColumnMeaning) -> bool {
    use ColumnMeaning::{Course, DateTime, Height, MagneticYaw, PressureHeight, RelativeHeight, Time, Yaw};
    matches!(
        (fine, coarse),
        (Height(Some(_)) | PressureHeight | RelativeHeight(_), Height(None))
            | (MagneticYaw | Course, Yaw)
            | (DateTime, Time)
    )
}
