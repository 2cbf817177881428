//! Line plots as SVG.

use std::ops::Range;

use plotters::{
    coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter},
    prelude::*,
};

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// (x, y) in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// Whether points are joined by a line.
    pub joined: bool,
}

/// What a plot shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Above it.
    pub title: String,
    /// Under it, with unit.
    pub x_label: String,
    /// Beside it, with unit.
    pub y_label: String,
    /// Whether each axis is logarithmic; then values of 0 and below are left out.
    pub log: [bool; 2],
    /// The curves.
    pub series: Vec<Series>,
}

/// A plot without anything to show, or one that could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// No finite point.
    #[error("the plot \"{0}\" has no point to show")]
    Empty(String),
    /// The drawing library.
    #[error("the plot \"{title}\" could not be drawn: {reason}")]
    Draw {
        /// Its title.
        title: String,
        /// Why.
        reason: String,
    },
}

/// Width and height, px.
const SIZE_PX: (u32, u32) = (900, 560);

impl Plot {
    /// The plot as an SVG document.
    ///
    /// # Errors
    /// Nothing to show.
    pub fn svg(&self) -> Result<String, PlotError> {
        let [x, y] = [0, 1].map(|axis| self.range(axis)).map(|range| range.ok_or_else(|| PlotError::Empty(self.title.clone())));
        let (x, y) = (x?, y?);
        let mut text = String::new();
        let drawn = match self.log {
            [false, false] => self.draw(&mut text, x, y),
            [true, false] => self.draw(&mut text, x.log_scale(), y),
            [false, true] => self.draw(&mut text, x, y.log_scale()),
            [true, true] => self.draw(&mut text, x.log_scale(), y.log_scale()),
        };
        drawn.map_err(|reason| PlotError::Draw { title: self.title.clone(), reason })?;
        Ok(text)
    }

    /// Points that can be shown.
    fn shown<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64)> + 'a {
        let fits = |value: f64, log: bool| value.is_finite() && (!log || value > 0.0);
        series.points.iter().copied().filter(move |&(x, y)| fits(x, self.log[0]) && fits(y, self.log[1]))
    }

    /// Smallest and largest value of an axis, with some room.
    fn range(&self, axis: usize) -> Option<Range<f64>> {
        let values = self.series.iter().flat_map(|series| self.shown(series)).map(|(x, y)| if axis == 0 { x } else { y });
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return None;
        }
        if self.log[axis] {
            return Some(low / 1.5..high * 1.5);
        }
        let room = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        Some(low - room..high + room)
    }

    fn draw<X, Y>(&self, text: &mut String, x: X, y: Y) -> Result<(), String>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let label = |value: &f64| format!("{value:.4}").trim_end_matches('0').trim_end_matches('.').to_owned();
        let label = |value: &f64| if value.abs() < 1e-3 && *value != 0.0 { format!("{value:.0e}") } else { label(value) };
        let said = |error: DrawingAreaErrorKind<_>| error.to_string();
        let root = SVGBackend::with_string(text, SIZE_PX).into_drawing_area();
        root.fill(&WHITE).map_err(said)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .build_cartesian_2d(x, y)
            .map_err(said)?;
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .light_line_style(WHITE)
            .draw()
            .map_err(said)?;
        for (i, series) in self.series.iter().enumerate() {
            let color = Palette99::pick(i).to_rgba();
            let points: Vec<_> = self.shown(series).collect();
            if series.joined {
                chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2))).map_err(said)?;
            }
            chart
                .draw_series(points.iter().map(|&at| Circle::new(at, 3, color.filled())))
                .map_err(said)?
                .label(&series.name)
                .legend(move |(x, y)| Circle::new((x + 10, y), 3, color.filled()));
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .position(SeriesLabelPosition::UpperRight)
            .draw()
            .map_err(said)?;
        root.present().map_err(said)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>, log: [bool; 2]) -> Plot {
        let series = vec![Series { name: "curve <1>".into(), points, joined: true }];
        Plot { title: "t".into(), x_label: "x".into(), y_label: "y".into(), log, series }
    }

    #[test]
    fn what_cannot_be_shown_is_left_out_and_nothing_at_all_is_refused() {
        let svg = plot(vec![(1.0, 0.1), (2.0, f64::NAN), (0.0, 3.0), (10.0, 1.0)], [true, true]).svg().expect("a plot");
        assert_eq!(svg.matches("<circle").count(), 2 + 1, "two points and the legend: {svg}");
        assert!(svg.contains("curve &lt;1&gt;"));
        assert!(matches!(plot(vec![(0.0, 1.0)], [true, false]).svg(), Err(PlotError::Empty(_))));
        assert!(plot(vec![(0.0, 1.0)], [false, false]).svg().is_ok());
    }
}
