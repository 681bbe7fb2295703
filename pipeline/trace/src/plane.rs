//! The planes that sets are drawn over, and what of a set lies in them.

use super::layout::{View, with_unit};
use super::messages::Point3;
use super::{MeasurementRow, TraceStep, topic_segment};

/// What a set is drawn over: two components, or one over time.
pub(super) struct Plane {
    /// Twice the same component where it is drawn over time
    pub(super) axes: (usize, usize),
    /// What the topics' names end with
    pub(super) suffix: String,
    pub(super) frame: String,
    pub(super) title: String,
}

impl Plane {
    /// The planes of a state with the components `names`; `axes` are the pairs asked for. Without any,
    /// neighbours are paired: (0, 1), (2, 3), …, and a last one that is left over with the one before it.
    pub(super) fn all(names: &[(String, String)], axes: &[(usize, usize)]) -> Vec<Plane> {
        let n = names.len();
        if n == 1 {
            let (name, unit) = &names[0];
            return vec![Plane {
                axes: (0, 0),
                suffix: String::new(),
                frame: "world".to_owned(),
                title: format!("time in s, {}", with_unit(name, unit)),
            }];
        }
        let neighbours = || {
            let mut pairs: Vec<_> = (1..n).step_by(2).map(|i| (i - 1, i)).collect();
            if n % 2 == 1 && n > 1 {
                pairs.push((n - 2, n - 1));
            }
            pairs
        };
        let pairs = if axes.is_empty() {
            neighbours()
        } else {
            axes.to_vec()
        };
        let alone = n == 2 && pairs.len() == 1;
        pairs
            .into_iter()
            .map(|(i, j)| {
                let pair = format!(
                    "{}_{}",
                    topic_segment(&names[i].0),
                    topic_segment(&names[j].0)
                );
                Plane {
                    axes: (i, j),
                    suffix: if alone {
                        String::new()
                    } else {
                        format!("_{pair}")
                    },
                    frame: if alone { "world".to_owned() } else { pair },
                    title: format!(
                        "{}, {}",
                        with_unit(&names[i].0, &names[i].1),
                        with_unit(&names[j].0, &names[j].1)
                    ),
                }
            })
            .collect()
    }

    pub(super) fn over_time(&self) -> bool {
        self.axes.0 == self.axes.1
    }

    pub(super) fn point(&self, elapsed_s: f64, x: &[f64]) -> Option<Point3> {
        let first = if self.over_time() {
            elapsed_s
        } else {
            x[self.axes.0]
        };
        drawn([first, x[self.axes.1]])
    }

    /// The outline of the step's set, at least three points; None where there is nothing finite to draw.
    pub(super) fn set(&self, step: &TraceStep, dt_s: f64) -> Option<Vec<Point3>> {
        let outline = step.outlines.iter().find(|o| o.axes == self.axes);
        if let Some(outline) = outline {
            return polygon(&outline.polygon);
        }
        let (lower, upper) = (step.lower.as_ref()?, step.upper.as_ref()?);
        let (i, j) = self.axes;
        let (left, right) = if self.over_time() {
            let t = step.k as f64 * dt_s;
            (t, t + dt_s)
        } else {
            (lower[i], upper[i])
        };
        rectangle([left, lower[j]], [right, upper[j]])
    }

    /// The part of `window` in which row · x + v = y for some v in the noise; None where the row
    /// depends on what the plane does not show.
    pub(super) fn strip(
        &self,
        row: &MeasurementRow,
        y: f64,
        elapsed_s: f64,
        dt_s: f64,
        window: &Window,
    ) -> Option<Vec<Point3>> {
        let (i, j) = self.axes;
        let others = row
            .row
            .iter()
            .enumerate()
            .filter(|(l, _)| *l != i && *l != j);
        let (low, high) = (y - row.noise.1, y - row.noise.0);
        if others.into_iter().any(|(_, c)| *c != 0.0) || low.is_nan() || high.is_nan() || low > high
        {
            return None;
        }
        if self.over_time() {
            let (a, b) = (low / row.row[j], high / row.row[j]);
            return rectangle([elapsed_s, a.min(b)], [elapsed_s + dt_s, a.max(b)]);
        }
        let c = [row.row[i], row.row[j]];
        let below = clip(&window.corners()?, c, high);
        polygon(&clip(&below, [-c[0], -c[1]], -low))
    }
}

/// The points of `polygon` with c · p ≤ bound (Sutherland and Hodgman, one edge).
pub(super) fn clip(polygon: &[[f64; 2]], c: [f64; 2], bound: f64) -> Vec<[f64; 2]> {
    let excess = |p: [f64; 2]| c[0] * p[0] + c[1] * p[1] - bound;
    let mut inside = Vec::new();
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (at_p, at_q) = (excess(p), excess(q));
        if at_p <= 0.0 {
            inside.push(p);
        }
        if (at_p < 0.0 && at_q > 0.0) || (at_p > 0.0 && at_q < 0.0) {
            let s = at_p / (at_p - at_q);
            inside.push([p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]);
        }
    }
    inside
}

/// A point as it is drawn, None where it is not finite. Viewers draw in single precision; rounding to it
/// here halves the files. The numbers themselves are in the metrics and the zonotope, unrounded.
fn drawn(p: [f64; 2]) -> Option<Point3> {
    let [x, y] = p.map(|v| f64::from(v as f32));
    (x.is_finite() && y.is_finite()).then_some(Point3 { x, y, z: 0.0 })
}

/// The polygon as it is drawn: None where a vertex is not finite or it is a mere point; a segment gets
/// its middle as a third point, since viewers leave out lines of two.
pub(super) fn polygon(vertices: &[[f64; 2]]) -> Option<Vec<Point3>> {
    let mut points = vertices
        .iter()
        .map(|v| drawn(*v))
        .collect::<Option<Vec<_>>>()?;
    if let [a, b] = points[..] {
        let middle = drawn([(a.x + b.x) / 2.0, (a.y + b.y) / 2.0])?;
        points.insert(1, middle);
    }
    (points.len() >= 3).then_some(points)
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> Option<Vec<Point3>> {
    if !(low[0] <= high[0] && low[1] <= high[1]) {
        return None;
    }
    polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]])
}

/// A rectangle that grows around what is drawn.
pub(super) struct Window {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

impl Window {
    pub(super) fn empty() -> Self {
        Window {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }

    pub(super) fn include(&mut self, p: Point3) {
        for (i, v) in [p.x, p.y].into_iter().enumerate() {
            self.low[i] = self.low[i].min(v);
            self.high[i] = self.high[i].max(v);
        }
    }

    fn corners(&self) -> Option<[[f64; 2]; 4]> {
        let ([left, bottom], [right, top]) = (self.low, self.high);
        (left <= right).then_some([[left, bottom], [right, bottom], [right, top], [left, top]])
    }

    /// All of it with a tenth to spare, one unit at least.
    pub(super) fn view(&self) -> View {
        if self.corners().is_none() {
            return View {
                center: [0.0, 0.0],
                height: 20.0,
            };
        }
        let size = (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]);
        View {
            center: [0, 1].map(|i| (self.low[i] + self.high[i]) / 2.0),
            height: 1.1 * if size > 0.0 { size } else { 1.0 },
        }
    }
}
