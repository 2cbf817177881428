//! Line plots as SVG.

use std::ops::Range;

use plotters::{
    coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter},
    prelude::*,
};

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y), in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// Whether points are joined by a line.
    pub joined: bool,
    /// Vertical bars (x, low, high).
    pub bars: Vec<(f64, f64, f64)>,
}

impl Series {
    /// Points that are joined by a line.
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, joined: true, bars: Vec::new() }
    }

    /// Single points.
    pub fn dots(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { joined: false, ..Self::line(name, points) }
    }
}

/// A plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Text above the plot.
    pub title: String,
    /// Label of the x axis, with unit.
    pub x_label: String,
    /// Label of the y axis, with unit.
    pub y_label: String,
    /// Whether the x and the y axis are logarithmic. Logarithmic axes leave out values of 0 and below.
    pub log: [bool; 2],
    /// The curves.
    pub series: Vec<Series>,
}

/// Why a plot could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// There is no finite point.
    #[error("the plot \"{0}\" has no point to show")]
    Empty(String),
    /// The drawing library failed.
    #[error("the plot \"{title}\" could not be drawn: {reason}")]
    Draw {
        /// Title of the plot.
        title: String,
        /// Message of the library.
        reason: String,
    },
}

/// Width and height, px.
const SIZE_PX: (u32, u32) = (900, 560);

impl Plot {
    /// The plot as an SVG document.
    ///
    /// # Errors
    /// [`PlotError`].
    pub fn svg(&self) -> Result<String, PlotError> {
        let [x, y] = [0, 1]
            .map(|axis| self.range(axis))
            .map(|range| range.ok_or_else(|| PlotError::Empty(self.title.clone())));
        let (x, y) = (x?, y?);
        let mut text = String::new();
        let legend = self.emptiest_corner(&x, &y);
        let drawn = match self.log {
            [false, false] => self.draw(&mut text, x, y, legend),
            [true, false] => self.draw(&mut text, x.log_scale(), y, legend),
            [false, true] => self.draw(&mut text, x, y.log_scale(), legend),
            [true, true] => self.draw(&mut text, x.log_scale(), y.log_scale(), legend),
        };
        drawn.map_err(|reason| PlotError::Draw { title: self.title.clone(), reason })?;
        Ok(text)
    }

    /// Points that are within the axes.
    fn shown<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64)> + 'a {
        series.points.iter().copied().filter(move |&(x, y)| self.is_on(0, x) && self.is_on(1, y))
    }

    /// Whether a value has a place on an axis.
    fn is_on(&self, axis: usize, value: f64) -> bool {
        value.is_finite() && (!self.log[axis] || value > 0.0)
    }

    /// The ends of bars that are within the axes.
    fn ends<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64)> + 'a {
        self.shown_bars(series).flat_map(|(x, low, high)| [(x, low), (x, high)])
    }

    /// Bars that are within the axes.
    fn shown_bars<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64, f64)> + 'a {
        let is_shown =
            |&(x, low, high): &(f64, f64, f64)| self.is_on(0, x) && self.is_on(1, low) && self.is_on(1, high);
        series.bars.iter().copied().filter(is_shown)
    }

    /// Smallest and largest value of an axis, with a margin.
    fn range(&self, axis: usize) -> Option<Range<f64>> {
        let values = self
            .series
            .iter()
            .flat_map(|series| self.shown(series).chain(self.ends(series)))
            .map(|(x, y)| if axis == 0 { x } else { y });
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return None;
        }
        if self.log[axis] {
            return Some(low / 1.5..high * 1.5);
        }
        let margin = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        Some(low - margin..high + margin)
    }

    /// The corner in which the legend hides the fewest points of the curves.
    fn emptiest_corner(&self, x: &Range<f64>, y: &Range<f64>) -> SeriesLabelPosition {
        let fraction = |value: f64, range: &Range<f64>, log: bool| match log {
            false => (value - range.start) / (range.end - range.start),
            true => (value / range.start).ln() / (range.end / range.start).ln(),
        };
        let mut positions: Vec<(f64, f64)> = Vec::new();
        for series in &self.series {
            let points: Vec<_> = self
                .shown(series)
                .map(|(u, v)| (fraction(u, x, self.log[0]), fraction(v, y, self.log[1])))
                .collect();
            if series.joined {
                // Points on the joining lines count too.
                let between = |pair: &[(f64, f64)], k: f64| {
                    (pair[0].0 + k * (pair[1].0 - pair[0].0), pair[0].1 + k * (pair[1].1 - pair[0].1))
                };
                positions.extend(
                    points.windows(2).flat_map(|pair| [0.2, 0.4, 0.6, 0.8].map(|k| between(pair, k))),
                );
            }
            positions.extend(points);
        }
        let (width, height) = (0.4, 0.06 * self.series.len() as f64 + 0.05);
        let hidden = |right: bool, top: bool| {
            let inside = |position: f64, far: bool, size: f64| {
                if far { position > 1.0 - size } else { position < size }
            };
            positions.iter().filter(|(u, v)| inside(*u, right, width) && inside(*v, top, height)).count()
        };
        use SeriesLabelPosition::{LowerLeft, LowerRight, UpperLeft, UpperRight};
        let corners = [
            (hidden(true, true), UpperRight),
            (hidden(true, false), LowerRight),
            (hidden(false, true), UpperLeft),
            (hidden(false, false), LowerLeft),
        ];
        corners.into_iter().min_by_key(|(count, _)| *count).map_or(UpperRight, |(_, corner)| corner)
    }

    fn draw<X, Y>(&self, text: &mut String, x: X, y: Y, legend: SeriesLabelPosition) -> Result<(), String>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let label =
            |value: &f64| format!("{value:.4}").trim_end_matches('0').trim_end_matches('.').to_owned();
        let label = |value: &f64| {
            if value.abs() < 1e-3 && *value != 0.0 { format!("{value:.0e}") } else { label(value) }
        };
        let message = |error: DrawingAreaErrorKind<_>| error.to_string();
        let root = SVGBackend::with_string(text, SIZE_PX).into_drawing_area();
        root.fill(&WHITE).map_err(message)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .build_cartesian_2d(x, y)
            .map_err(message)?;
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .light_line_style(WHITE)
            .draw()
            .map_err(message)?;
        for (i, series) in self.series.iter().enumerate() {
            let color = Palette99::pick(i).to_rgba();
            let points: Vec<_> = self.shown(series).collect();
            if series.joined {
                chart
                    .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))
                    .map_err(message)?;
            }
            let bar = |(x, low, high)| PathElement::new(vec![(x, low), (x, high)], color.stroke_width(1));
            chart.draw_series(self.shown_bars(series).map(bar)).map_err(message)?;
            chart
                .draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))
                .map_err(message)?
                .label(&series.name)
                .legend(move |(x, y)| Circle::new((x + 10, y), 3, color.filled()));
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .position(legend)
            .draw()
            .map_err(message)?;
        root.present().map_err(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>, log: [bool; 2]) -> Plot {
        let series = vec![Series::line("curve <1>", points)];
        Plot { title: "t".into(), x_label: "x".into(), y_label: "y".into(), log, series }
    }

    #[test]
    fn unplottable_points_are_left_out_and_empty_plots_refused() {
        let svg = plot(vec![(1.0, 0.1), (2.0, f64::NAN), (0.0, 3.0), (10.0, 1.0)], [true, true])
            .svg()
            .expect("a plot");
        assert_eq!(svg.matches("<circle").count(), 2 + 1, "two points and the legend: {svg}");
        assert!(svg.contains("curve &lt;1&gt;"));
        assert!(matches!(plot(vec![(0.0, 1.0)], [true, false]).svg(), Err(PlotError::Empty(_))));
        assert!(plot(vec![(0.0, 1.0)], [false, false]).svg().is_ok());
    }

    #[test]
    fn legend_is_in_the_emptiest_corner() {
        let corner = |points: &[(f64, f64)], log| {
            plot(points.to_vec(), log).emptiest_corner(&(1.0..100.0), &(1.0..100.0))
        };
        assert!(matches!(corner(&[(1.0, 100.0), (100.0, 1.0)], [false; 2]), SeriesLabelPosition::UpperRight));
        assert!(matches!(corner(&[(1.0, 1.0), (100.0, 100.0)], [true; 2]), SeriesLabelPosition::LowerRight));
        assert!(matches!(
            corner(&[(1.0, 1.0), (100.0, 1.0), (100.0, 100.0)], [false; 2]),
            SeriesLabelPosition::UpperLeft
        ));
    }
}
