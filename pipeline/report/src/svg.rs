//! Figures as SVG: line charts, bands and sets, in panels beside each other.
//!
//! A [`Figure`] is made of values and drawn by [`Figure::to_svg`] in text that depends on them alone:
//! coordinates in hundredths of a pixel, no ids (several figures can stand in one page), no fonts asked
//! for by file. The picture has its own white ground, so it can be read on a dark page, a title and a
//! description for those who cannot see it, and colours that people who see few of them tell apart.

mod axis;
pub mod bars;
mod path;
pub mod scores;

use axis::{Scale, Tick};
use path::{Path, number};
use serde::Deserialize;

/// A picture: panels in rows of `columns`, one legend for all.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// What it shows, above it
    pub title: String,
    /// What is to be seen, in words; where empty, panels and series are listed
    pub description: String,
    /// How many panels stand in a row
    pub columns: usize,
    /// The panels, row by row
    pub panels: Vec<Panel>,
}

/// One chart.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// What it shows, above it
    pub title: String,
    /// The axis across
    pub x: Axis,
    /// The axis upwards
    pub y: Axis,
    /// What is drawn, the first at the bottom
    pub series: Vec<Series>,
    /// Whether a unit is as long on both axes
    pub equal: bool,
}

/// An axis.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// What is on it
    pub label: String,
    /// In what; empty or `1` for none
    pub unit: String,
    /// Whether equal ratios are equally long; values that are not positive are then left out
    pub log: bool,
    /// Where it begins; by the data where None
    pub min: Option<f64>,
    /// Where it ends; by the data where None
    pub max: Option<f64>,
}

impl Axis {
    /// A linear axis as long as the data.
    pub fn new(label: &str, unit: &str) -> Self {
        Axis {
            label: label.to_owned(),
            unit: unit.to_owned(),
            ..Axis::default()
        }
    }

    fn text(&self) -> String {
        match self.unit.as_str() {
            "" | "1" => self.label.clone(),
            unit => format!("{} ({unit})", self.label),
        }
    }
}

/// Something drawn in a panel. Series of the same label share one place in the legend, those without a
/// label have none. What is not finite is left out: a line has a gap there, a polygon is not drawn.
#[derive(Clone, Debug)]
pub enum Series {
    /// A line through points
    Line {
        /// Its name in the legend
        label: String,
        /// Its colour
        colour: Colour,
        /// (x, y) in order
        points: Vec<[f64; 2]>,
    },
    /// A dashed line
    Dashes {
        /// Its name in the legend
        label: String,
        /// Its colour
        colour: Colour,
        /// (x, y) in order
        points: Vec<[f64; 2]>,
    },
    /// Marks
    Points {
        /// Their name in the legend
        label: String,
        /// Their colour
        colour: Colour,
        /// Their shape
        marker: Marker,
        /// (x, y)
        points: Vec<[f64; 2]>,
    },
    /// The area between two curves
    Band {
        /// Its name in the legend
        label: String,
        /// Its colour, drawn faintly
        colour: Colour,
        /// (x, lower, upper), x ascending
        points: Vec<[f64; 3]>,
    },
    /// A set
    Polygon {
        /// Its name in the legend
        label: String,
        /// Its colour
        colour: Colour,
        /// Whether its inside is coloured too, faintly
        filled: bool,
        /// Its vertices in order; the last is joined to the first
        vertices: Vec<[f64; 2]>,
    },
    /// y ∝ x^exponent, dotted, from side to side: a straight line where both axes are logarithmic
    Slope {
        /// Its name in the legend
        label: String,
        /// Its colour
        colour: Colour,
        /// The power
        exponent: f64,
        /// A point it goes through, positive
        through: [f64; 2],
    },
}

/// The colours of Okabe and Ito, told apart by people who see few colours and in print; the pale
/// yellow among them is not here, since it is lost on white.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    /// For the truth and what else is given
    Black,
    /// First of the series
    Blue,
    /// Second
    Vermilion,
    /// Third
    Green,
    /// Fourth
    Purple,
    /// Fifth
    Orange,
    /// Sixth
    Sky,
    /// For what stands behind
    Grey,
}

impl Colour {
    /// The colour of the `i`-th of several series; after six they repeat.
    pub fn nth(i: usize) -> Self {
        use Colour::{Blue, Green, Orange, Purple, Sky, Vermilion};
        [Blue, Vermilion, Green, Purple, Orange, Sky][i % 6]
    }

    fn hex(self) -> &'static str {
        match self {
            Colour::Black => "#1a1a1a",
            Colour::Blue => "#0072b2",
            Colour::Vermilion => "#d55e00",
            Colour::Green => "#009e73",
            Colour::Purple => "#cc79a7",
            Colour::Orange => "#e69f00",
            Colour::Sky => "#56b4e9",
            Colour::Grey => "#8a8a8a",
        }
    }
}

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A small dot, for many
    Dot,
    /// A circle
    Ring,
    /// A cross
    Cross,
}

impl Marker {
    /// Path data around the pen, which ends where it began.
    fn data(self) -> &'static str {
        match self {
            Marker::Dot => "h0",
            Marker::Ring => "m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0m3 0",
            Marker::Cross => "m-3-3l6 6m0-6l-6 6m3-3",
        }
    }
}

/// The corners of the box \[low, high\], for [`Series::Polygon`].
pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Vec<[f64; 2]> {
    vec![low, [high[0], low[1]], high, [low[0], high[1]]]
}

/// Points around the ellipse { x : (x − c)ᵀ S⁻¹ (x − c) = 1 }, for [`Series::Polygon`]: c + L u with
/// S = L Lᵀ (Cholesky) and u around the unit circle. For a level set of a Gaussian, S is the covariance
/// times the quantile of χ². Empty where `s` is not positive semidefinite.
pub fn ellipse(c: [f64; 2], s: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
    let l11 = s[0][0].sqrt();
    let l21 = if l11 > 0.0 { s[1][0] / l11 } else { 0.0 };
    let l22 = (s[1][1] - l21 * l21).sqrt();
    if !(l11.is_finite() && l22.is_finite()) {
        return Vec::new();
    }
    let corners = 72;
    (0..corners)
        .map(|i| {
            let angle = f64::from(i) * (core::f64::consts::TAU / f64::from(corners));
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            [c[0] + l11 * cos, c[1] + l21 * cos + l22 * sin]
        })
        .collect()
}

/// Sizes in pixels.
const WIDTH: f64 = 760.0;
const MARGIN: f64 = 14.0;
const TITLE: f64 = 15.0;
const PANEL_TITLE: f64 = 12.5;
const LABEL: f64 = 12.0;
const TICK_LABEL: f64 = 10.5;
const LEGEND: f64 = 11.5;
/// Between the panels of a row
const GUTTER: f64 = 22.0;
const SWATCH: f64 = 22.0;
/// How much wider bold letters are
const BOLD: f64 = 1.12;

const INK: &str = "#222";
const GRID: &str = "#e4e4e4";
const FRAME: &str = "#555";

impl Figure {
    /// The figure as an SVG document, 760 pixels wide. The same figure gives the same text.
    pub fn to_svg(&self) -> String {
        let mut body = String::new();
        let mut top = MARGIN;
        for line in wrapped(&self.title, TITLE * BOLD, WIDTH - 2.0 * MARGIN) {
            top += TITLE + 3.0;
            text(
                &mut body,
                [MARGIN, top - 3.0],
                TITLE,
                " font-weight=\"bold\"",
                &line,
            );
        }
        top = self.legend(&mut body, top + 4.0);
        let columns = self.columns.max(1).min(self.panels.len().max(1));
        let rows = self.panels.chunks(columns);
        let spaces = self.spaces(columns);
        for row in rows {
            let height = row
                .iter()
                .map(|p| spaces.plot_height(p))
                .fold(0.0, f64::max);
            let titles = spaces.title_height(row);
            let mut left = MARGIN;
            for (panel, beside) in row.iter().zip(&spaces.left) {
                let corner = [left + beside, top + titles];
                panel.draw(&mut body, corner, [spaces.width, height]);
                left += beside + spaces.width + GUTTER;
            }
            top += titles + height + LABEL + TICK_LABEL + 22.0;
        }
        let height = number(((top + 2.0) * 100.0) as i64);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" \
             font-family=\"Helvetica,Arial,'Liberation Sans',sans-serif\" fill=\"{INK}\">\n\
             <title>{}</title>\n<desc>{}</desc>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" rx=\"6\" fill=\"#fff\"/>\n{body}</svg>\n",
            escaped(&self.title),
            escaped(&self.described()),
        )
    }

    fn described(&self) -> String {
        if !self.description.is_empty() {
            return self.description.clone();
        }
        let panels = self.panels.iter().map(|panel| {
            let mut labels: Vec<_> = panel.series.iter().map(Series::label).collect();
            labels.retain(|l| !l.is_empty());
            labels.dedup();
            let subject = if panel.title.is_empty() {
                panel.y.text()
            } else {
                panel.title.clone()
            };
            format!("{subject} over {}: {}.", panel.x.text(), labels.join(", "))
        });
        panels.collect::<Vec<_>>().join(" ")
    }

    /// Draws each label once with what it stands for and returns where the panels begin.
    fn legend(&self, body: &mut String, top: f64) -> f64 {
        let mut entries: Vec<(&str, Vec<&Series>)> = Vec::new();
        for series in self.panels.iter().flat_map(|p| &p.series) {
            let label = series.label();
            match entries.iter_mut().find(|(l, _)| *l == label) {
                _ if label.is_empty() => {}
                Some((_, same)) => {
                    let seen = same.iter().any(|s| s.looks_like(series));
                    if !seen {
                        same.push(series);
                    }
                }
                None => entries.push((label, vec![series])),
            }
        }
        if entries.is_empty() {
            return top + 4.0;
        }
        let (mut left, mut middle) = (MARGIN, top + 10.0);
        for (label, series) in entries {
            let marks = series.iter().all(|s| matches!(s, Series::Points { .. }));
            let swatch = if marks { 8.0 } else { SWATCH };
            let width = swatch + 6.0 + text_width(label, LEGEND);
            if left > MARGIN && left + width > WIDTH - MARGIN {
                (left, middle) = (MARGIN, middle + LEGEND + 6.0);
            }
            for s in series {
                s.swatch(body, [left, middle], swatch);
            }
            text(body, [left + swatch + 6.0, middle + 4.0], LEGEND, "", label);
            left += width + 18.0;
        }
        middle + 14.0
    }

    /// How the width is shared out: beside each column the widest of its y axes.
    fn spaces(&self, columns: usize) -> Spaces {
        let mut left = vec![0.0_f64; columns];
        for (i, panel) in self.panels.iter().enumerate() {
            // The height hardly moves the labels' width; the scale at a common one is enough.
            let labels = panel.scales([200.0, 200.0]).1.ticks(Y_SPACING);
            let widest = labels.iter().filter_map(|t| t.label.as_deref());
            let widest = widest
                .map(|l| text_width(l, TICK_LABEL))
                .fold(0.0, f64::max);
            let name = if panel.y.label.is_empty() {
                0.0
            } else {
                LABEL + 6.0
            };
            left[i % columns] = left[i % columns].max(widest + name + 10.0);
        }
        let between = GUTTER * (columns - 1) as f64;
        let room = WIDTH - 2.0 * MARGIN - between - left.iter().sum::<f64>();
        Spaces {
            left,
            width: (room / columns as f64).max(60.0).floor(),
        }
    }
}

/// Pixels between the ticks of an axis, about.
const X_SPACING: f64 = 52.0;
const Y_SPACING: f64 = 30.0;

struct Spaces {
    /// Beside each column, for its y axis
    left: Vec<f64>,
    /// Of a panel's inside
    width: f64,
}

impl Spaces {
    fn plot_height(&self, panel: &Panel) -> f64 {
        let part = if panel.equal { 0.8 } else { 0.62 };
        (self.width * part)
            .clamp(120.0, if panel.equal { 420.0 } else { 320.0 })
            .floor()
    }

    fn title_height(&self, row: &[Panel]) -> f64 {
        let lines = row.iter().map(|p| p.title_lines(self.width).len()).max();
        lines.unwrap_or(0) as f64 * (PANEL_TITLE + 2.0) + 8.0
    }
}

impl Panel {
    fn title_lines(&self, width: f64) -> Vec<String> {
        wrapped(&self.title, PANEL_TITLE * BOLD, width)
    }

    fn scales(&self, size: [f64; 2]) -> (Scale, Scale) {
        let extent = |i: usize| self.series.iter().flat_map(move |s| s.extent(i));
        let mut x = Scale::new(&self.x, extent(0), size[0], false);
        let mut y = Scale::new(&self.y, extent(1), size[1], true);
        if self.equal {
            Scale::make_equal(&mut x, &mut y);
        }
        (x, y)
    }

    fn draw(&self, body: &mut String, corner: [f64; 2], size: [f64; 2]) {
        let [left, top] = corner;
        let [width, height] = size;
        let (x, y) = self.scales(size);
        let lines = self.title_lines(width);
        for (i, line) in lines.iter().rev().enumerate() {
            let at = top - 7.0 - i as f64 * (PANEL_TITLE + 2.0);
            text(body, [left, at], PANEL_TITLE, " font-weight=\"bold\"", line);
        }
        // A nested <svg> cuts off what leaves the panel, without an id to refer to.
        body.push_str(&format!(
            "<svg x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" overflow=\"hidden\">\n",
            pixels(left),
            pixels(top)
        ));
        let (mut x_ticks, y_ticks) = (x.ticks(X_SPACING), y.ticks(Y_SPACING));
        thin_out(&x, &mut x_ticks);
        grid(body, (&x, &x_ticks), (&y, &y_ticks), size);
        for series in &self.series {
            series.draw(body, &x, &y);
        }
        body.push_str("</svg>\n");
        frame(body, corner, size, (&x, &x_ticks), (&y, &y_ticks));
        let below = top + height + TICK_LABEL + LABEL + 11.0;
        let middle = " text-anchor=\"middle\"";
        text(
            body,
            [left + width / 2.0, below],
            LABEL,
            middle,
            &self.x.text(),
        );
        let widest = y_ticks.iter().filter_map(|t| t.label.as_deref());
        let widest = widest
            .map(|l| text_width(l, TICK_LABEL))
            .fold(0.0, f64::max);
        let [at_x, at_y] = [left - widest - 14.0, top + height / 2.0].map(pixels);
        let turned = format!("{middle} transform=\"rotate(-90 {at_x} {at_y})\"");
        text(
            body,
            [left - widest - 14.0, top + height / 2.0],
            LABEL,
            &turned,
            &self.y.text(),
        );
    }
}

fn grid(body: &mut String, x: (&Scale, &[Tick]), y: (&Scale, &[Tick]), size: [f64; 2]) {
    let mut path = Path::default();
    for at in
        x.1.iter()
            .filter(|t| t.label.is_some())
            .filter_map(|t| x.0.pixel(t.value))
    {
        path.move_to([at, 0.0]);
        path.lines_to(&[[at, size[1]]]);
    }
    for at in
        y.1.iter()
            .filter(|t| t.label.is_some())
            .filter_map(|t| y.0.pixel(t.value))
    {
        path.move_to([0.0, at]);
        path.lines_to(&[[size[0], at]]);
    }
    stroke(body, &path.finish(), GRID, "1", "");
}

/// Takes labels off ticks below an axis, evenly, until no two of them touch.
fn thin_out(x: &Scale, ticks: &mut [Tick]) {
    let labelled: Vec<usize> = (0..ticks.len())
        .filter(|&i| ticks[i].label.is_some() && x.pixel(ticks[i].value).is_some())
        .collect();
    let room: Vec<(f64, f64)> = labelled
        .iter()
        .map(|&i| {
            let at = x.pixel(ticks[i].value).unwrap_or_default();
            let label = ticks[i].label.as_deref().unwrap_or_default();
            let half = text_width(label, TICK_LABEL) / 2.0;
            (at - half, at + half)
        })
        .collect();
    let free = |every: usize| {
        let kept: Vec<_> = room.iter().step_by(every).collect();
        kept.windows(2).all(|pair| pair[0].1 + 4.0 <= pair[1].0)
    };
    let every = (1..=room.len()).find(|&every| free(every)).unwrap_or(1);
    for (n, &i) in labelled.iter().enumerate() {
        if n % every != 0 {
            ticks[i].label = None;
        }
    }
}

/// The two axes with their ticks and labels.
fn frame(
    body: &mut String,
    [left, top]: [f64; 2],
    [width, height]: [f64; 2],
    x: (&Scale, &[Tick]),
    y: (&Scale, &[Tick]),
) {
    let bottom = top + height;
    let mut path = Path::default();
    path.move_to([left, top]);
    path.lines_to(&[[left, bottom], [left + width, bottom]]);
    for tick in x.1 {
        if let Some(at) = x.0.pixel(tick.value) {
            let long = if tick.label.is_some() { 4.0 } else { 2.0 };
            path.move_to([left + at, bottom]);
            path.lines_to(&[[left + at, bottom + long]]);
        }
    }
    for tick in y.1 {
        if let Some(at) = y.0.pixel(tick.value) {
            let long = if tick.label.is_some() { 4.0 } else { 2.0 };
            path.move_to([left, top + at]);
            path.lines_to(&[[left - long, top + at]]);
        }
    }
    stroke(body, &path.finish(), FRAME, "1", "");
    for tick in x.1 {
        if let (Some(at), Some(label)) = (x.0.pixel(tick.value), &tick.label) {
            let place = [left + at, bottom + TICK_LABEL + 6.0];
            text(body, place, TICK_LABEL, " text-anchor=\"middle\"", label);
        }
    }
    for tick in y.1 {
        if let (Some(at), Some(label)) = (y.0.pixel(tick.value), &tick.label) {
            let place = [left - 7.0, top + at + 0.36 * TICK_LABEL];
            text(body, place, TICK_LABEL, " text-anchor=\"end\"", label);
        }
    }
}

impl Series {
    fn label(&self) -> &str {
        match self {
            Series::Line { label, .. }
            | Series::Dashes { label, .. }
            | Series::Points { label, .. }
            | Series::Band { label, .. }
            | Series::Polygon { label, .. }
            | Series::Slope { label, .. } => label,
        }
    }

    fn colour(&self) -> Colour {
        match self {
            Series::Line { colour, .. }
            | Series::Dashes { colour, .. }
            | Series::Points { colour, .. }
            | Series::Band { colour, .. }
            | Series::Polygon { colour, .. }
            | Series::Slope { colour, .. } => *colour,
        }
    }

    fn looks_like(&self, other: &Series) -> bool {
        core::mem::discriminant(self) == core::mem::discriminant(other)
            && self.colour() == other.colour()
    }

    /// The x (0) or y (1) that the axis must hold. A slope asks for nothing: it runs from side to side.
    fn extent(&self, i: usize) -> Vec<f64> {
        match self {
            Series::Line { points, .. }
            | Series::Dashes { points, .. }
            | Series::Points { points, .. } => points.iter().map(|p| p[i]).collect(),
            Series::Polygon { vertices, .. } => vertices.iter().map(|p| p[i]).collect(),
            Series::Band { points, .. } if i == 0 => points.iter().map(|p| p[0]).collect(),
            Series::Band { points, .. } => points.iter().flat_map(|p| [p[1], p[2]]).collect(),
            Series::Slope { .. } => Vec::new(),
        }
    }

    fn draw(&self, body: &mut String, x: &Scale, y: &Scale) {
        let pixel = |p: [f64; 2]| Some([x.pixel(p[0])?, y.pixel(p[1])?]);
        let colour = self.colour().hex();
        let mut path = Path::default();
        match self {
            Series::Line { points, .. } | Series::Dashes { points, .. } => {
                let pixels: Vec<_> = points.iter().map(|p| pixel(*p)).collect();
                for run in runs(&pixels) {
                    path.strip(&run);
                }
            }
            Series::Points { marker, points, .. } => {
                for p in points.iter().filter_map(|p| pixel(*p)) {
                    path.hop_to(p);
                    path.raw(marker.data());
                }
            }
            Series::Band { points, .. } => {
                let ends: Vec<_> = points
                    .iter()
                    .map(|p| Some((pixel([p[0], p[1]])?, pixel([p[0], p[2]])?)))
                    .collect();
                for run in runs(&ends) {
                    let (lower, mut upper): (Vec<_>, Vec<_>) = run.into_iter().unzip();
                    upper.reverse();
                    path.strip(&lower);
                    path.lines_to(&upper);
                    path.close();
                }
            }
            Series::Polygon { vertices, .. } => {
                let corners: Option<Vec<_>> = vertices.iter().map(|p| pixel(*p)).collect();
                if let Some([first, rest @ ..]) = corners.as_deref() {
                    path.move_to(*first);
                    path.lines_to(rest);
                    path.close();
                }
            }
            Series::Slope {
                exponent, through, ..
            } => {
                let (low, high) = x.range();
                let steps = 48;
                let curve: Vec<_> = (0..=steps)
                    .map(|i| {
                        // Evenly spread by ratio where the range allows it.
                        let part = f64::from(i) / f64::from(steps);
                        let at = if low > 0.0 {
                            low * libm::pow(high / low, part)
                        } else {
                            low + part * (high - low)
                        };
                        pixel([at, through[1] * libm::pow(at / through[0], *exponent)])
                    })
                    .collect();
                for run in runs(&curve) {
                    path.strip(&run);
                }
            }
        }
        self.ink(body, &path.finish(), colour);
    }

    /// A sample of the series in the legend, its left end and middle at `at`.
    fn swatch(&self, body: &mut String, at: [f64; 2], width: f64) {
        let [left, middle] = at;
        let right = left + width;
        let mut path = Path::default();
        match self {
            Series::Line { .. } | Series::Dashes { .. } | Series::Slope { .. } => {
                path.move_to(at);
                path.lines_to(&[[right, middle]]);
            }
            Series::Points { marker, .. } => {
                path.move_to([left + width / 2.0, middle]);
                path.raw(marker.data());
            }
            Series::Band { .. } | Series::Polygon { .. } => {
                let corners = rectangle([left, middle - 5.0], [right, middle + 5.0]);
                path.move_to(corners[0]);
                path.lines_to(&corners[1..]);
                path.close();
            }
        }
        self.ink(body, &path.finish(), self.colour().hex());
    }

    /// Draws path data the way this series is drawn.
    fn ink(&self, body: &mut String, d: &str, colour: &str) {
        if d.is_empty() {
            return;
        }
        match self {
            Series::Line { .. } => stroke(body, d, colour, "1.6", " stroke-linejoin=\"round\""),
            Series::Dashes { .. } => stroke(body, d, colour, "1.6", " stroke-dasharray=\"6 4\""),
            Series::Slope { .. } => stroke(body, d, colour, "1.4", " stroke-dasharray=\"1.5 3.5\""),
            Series::Points {
                marker: Marker::Dot,
                ..
            } => {
                stroke(body, d, colour, "2.8", " stroke-linecap=\"round\"");
            }
            Series::Points { .. } => stroke(body, d, colour, "1.4", ""),
            Series::Band { .. } => {
                body.push_str(&format!(
                    "<path d=\"{d}\" fill=\"{colour}\" fill-opacity=\".2\"/>\n"
                ));
            }
            Series::Polygon { filled, .. } => {
                let fill = if *filled {
                    format!("{colour}\" fill-opacity=\".14")
                } else {
                    "none".to_owned()
                };
                body.push_str(&format!(
                    "<path d=\"{d}\" fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1.4\" \
                     stroke-linejoin=\"round\"/>\n"
                ));
            }
        }
    }
}

/// The stretches of what can be drawn between what cannot.
fn runs<T: Copy>(values: &[Option<T>]) -> Vec<Vec<T>> {
    let stretches = values.split(Option::is_none).filter(|run| !run.is_empty());
    stretches
        .map(|run| run.iter().flatten().copied().collect())
        .collect()
}

fn stroke(body: &mut String, d: &str, colour: &str, width: &str, more: &str) {
    if !d.is_empty() {
        body.push_str(&format!(
            "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{more}/>\n"
        ));
    }
}

fn text(body: &mut String, at: [f64; 2], size: f64, more: &str, content: &str) {
    if !content.is_empty() {
        let [x, y] = at.map(pixels);
        let content = escaped(content);
        body.push_str(&format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\"{more}>{content}</text>\n"
        ));
    }
}

fn pixels(v: f64) -> String {
    number((v * 100.0).round() as i64)
}

/// `text` as it may stand in XML; characters that may not stand there at all become �.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' => out.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// About how wide `text` is. No font is at hand to measure; these are the widths of a wide sans serif
/// (DejaVu), so that text fits with the narrower ones too.
fn text_width(text: &str, size: f64) -> f64 {
    let em: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | 't' | 'f' | 'r' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!'
            | ' ' | '(' | ')' => 0.36,
            '⁰'..='₟' | '¹' | '²' | '³' => 0.4,
            'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.95,
            'A'..='Z' => 0.7,
            _ => 0.61,
        })
        .sum();
    em * size
}

/// `text` in lines of at most `width` pixels, broken between words.
fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(line, size) + text_width(word, size) + 0.3 * size <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests;
