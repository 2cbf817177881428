//! Tables as text, Markdown and CSV.

use camsim_io::columns::csv_cell;

/// Rows of text under named columns.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Column names, with units.
    pub columns: Vec<String>,
    /// Cells of each row, one per column.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    #[must_use]
    pub fn new(title: impl Into<String>, columns: &[&str]) -> Self {
        Self {
            title: title.into(),
            columns: columns.iter().map(|name| (*name).to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; missing cells stay empty.
    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        let mut cells = Vec::from(cells);
        cells.resize(self.columns.len(), String::new());
        self.rows.push(cells);
    }

    /// The table as text: the first column is aligned left, the others right.
    #[must_use]
    pub fn text(&self) -> String {
        let lines: Vec<&Vec<String>> = std::iter::once(&self.columns).chain(&self.rows).collect();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|k| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0))
            .collect();
        let mut text = format!("{}\n", self.title);
        for line in lines {
            let cells: Vec<String> = line
                .iter()
                .zip(&widths)
                .enumerate()
                .map(
                    |(k, (cell, &width))| {
                        if k == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
                    },
                )
                .collect();
            text += cells.join("  ").trim_end();
            text.push('\n');
        }
        text
    }

    /// The table as Markdown, with the title in bold.
    #[must_use]
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            format!(
                "| {} |\n",
                cells.iter().map(|cell| cell.replace('|', "\\|")).collect::<Vec<_>>().join(" | ")
            )
        };
        let mut text =
            format!("**{}**\n\n{}|{}\n", self.title, line(&self.columns), "---|".repeat(self.columns.len()));
        for row in &self.rows {
            text += &line(row);
        }
        text
    }

    /// The table as CSV with a header.
    #[must_use]
    pub fn csv(&self) -> String {
        let line = |cells: &Vec<String>| {
            cells.iter().map(|cell| csv_cell(cell)).collect::<Vec<_>>().join(",") + "\n"
        };
        std::iter::once(&self.columns).chain(&self.rows).map(line).collect()
    }
}

/// A number with three significant digits.
#[must_use]
pub fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !size.is_finite() => "-".to_owned(),
        size if size < 1e-3 => format!("{value:.1e}"),
        size if size < 100.0 => {
            let decimals = (2.0 - size.log10().floor()).clamp(0.0, 5.0) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_written_as_text_markdown_and_csv() {
        let mut table = Table::new("steps", &["solver", "error, px"]);
        table.row(["rk2".into(), "0.02".into()]);
        table.row(["a|b".into()]);
        assert_eq!(table.text(), "steps\nsolver  error, px\nrk2          0.02\na|b\n");
        assert_eq!(
            table.markdown(),
            "**steps**\n\n| solver | error, px |\n|---|---|\n| rk2 | 0.02 |\n| a\\|b |  |\n"
        );
        assert_eq!(table.csv(), "solver,\"error, px\"\nrk2,0.02\na|b,\n");
    }

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.0, 0.018_45, 3.578, 17.02, 123.4, 2.34e-5, f64::NAN].map(short);
        assert_eq!(texts, ["0", "0.0185", "3.58", "17.0", "123", "2.3e-5", "-"]);
    }
}
