//! What a measurement says of the state: C x ∈ T, exactly where h is linear in x and v, by the mean value form where not.
//!
//! The predicted set's hull B, the hull V̂ of the noise and v̄, and any c ∈ B give, for every x of the set and v of V,
//!
//! ```text
//! h(x, v) = h(c, v̄) + J_x (x − c) + J_v (v − v̄),   J ∈ J(B × V̂) row by row,
//! ```
//!
//! hence mid J_x x ∈ y − h(c, v̄) + mid J_x c + mid J_v v̄ − mid J_v V ± ρ, ρ = ⌈rad J_x |B − c| + rad J_v |V̂ − v̄|⌉: a strip, or
//! a generalized intersection in which all rows share one v. A smaller set has a smaller B, so the same measurement may be read
//! once more over what the first reading left. Where h cannot be expanded over B (a sensor in it, a jump), slices of B over which h misses y
//! altogether are cut off first.

use super::linear_output::check_measurement;
use super::set_membership::set_of;
use crate::error::finite_vector;
use crate::estimator::Measurement;
use crate::propagation::{Output, around, product_up};
use crate::{EstimationError, Problem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::interval_matrix::real_dot;
use zonobench_sets::number::{self, Function};
use zonobench_sets::rounding::up;
use zonobench_sets::{
    ConstrainedZonotope, Interval, IntervalVector, List, Matrix, SetError, Zonotope,
};

/// How `zmv`, `zfo`, `czmv` and `czfo` take in a measurement that is not linear. One that is linear is exact and needs no second
/// look.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasurementSettings {
    /// How often the same measurement is read, each time over what the reading before has left: 1, unless given, or 2.
    #[serde(default = "once")]
    pub passes: usize,
}

fn once() -> usize {
    1
}

impl Default for MeasurementSettings {
    fn default() -> Self {
        Self { passes: once() }
    }
}

impl MeasurementSettings {
    /// True for the default, which is not written to files.
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The number of passes, where it is 1 or 2.
    pub(super) fn passes(&self, kind: &'static str) -> Result<usize, EstimationError> {
        match self.passes {
            1 | 2 => Ok(self.passes),
            got => {
                let (key, expected) = ("measurement.passes", "1 or 2");
                Err(EstimationError::setting(kind, key, expected, got))
            }
        }
    }
}

/// What the measured components say of x.
#[derive(Debug)]
pub(super) struct Reading {
    /// C, a row for every component that was read, and T: C x ∈ T. None where every component was left out.
    pub strips: Option<(Matrix, ConstrainedZonotope)>,
    /// Whether h is linear, so that C and T are the same over every set; else they hold for the set that they were read over.
    pub exact: bool,
    /// The measured components that h cannot be expanded in over the set.
    pub left_out: List<usize>,
}

/// h with the set of its noise.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    /// V; none where there is no measurement noise.
    v: Option<ConstrainedZonotope>,
    /// V̂ with v̄ = c of V; empty where C and D_v are known.
    v_hull: IntervalVector,
    /// C and D_v that are the same at every step and input; none where they are taken anew, or h is not linear.
    known: Option<(Matrix, Matrix)>,
    n: usize,
    n_y: usize,
    n_u: usize,
    n_v: usize,
}

impl Sensor {
    /// Fails where v has no set.
    pub fn new<Y: System>(
        kind: &'static str,
        problem: &Problem<Y>,
    ) -> Result<Self, EstimationError> {
        let variables = problem.system.variables();
        let (n, n_y, n_v) = (variables.x.len(), variables.y.len(), variables.v.len());
        let v = (n_v > 0)
            .then(|| set_of(kind, "noise.v", &problem.v))
            .transpose()?;
        let known = problem.system.linear_output();
        let v_hull = match (&v, &known) {
            (Some(v), None) => {
                let hull = v.interval_hull();
                around(&hull.map_err(EstimationError::at(0, "assumed set"))?, v.c())
            }
            _ => IntervalVector::new(List::new()),
        };
        Ok(Self {
            v,
            v_hull,
            known,
            n,
            n_y,
            n_u: variables.u.len(),
            n_v,
        })
    }

    /// What y_k says of the x_k in a set, of which `hull` is asked for where h is not known to be linear.
    pub fn read<Y: System>(
        &self,
        system: &Y,
        k: usize,
        u: &[f64],
        y: Measurement,
        hull: impl FnOnce() -> Result<IntervalVector, EstimationError>,
    ) -> Result<Option<Reading>, EstimationError> {
        finite_vector("input u", u, self.n_u)?;
        check_measurement(y, self.n_y)?;
        if y.iter().all(Option::is_none) {
            return Ok(None);
        }
        let output = Output::of_sizes(system, k, u, [self.n, self.n_y, self.n_v]);
        if let Some((c, d_v)) = &self.known {
            return self.linear(&output, c, d_v, y).map(Some);
        }
        let hull = hull()?;
        // h(k, 0, u, 0) is part of the linear form, so it has to be linear up to there.
        let from_zero: IntervalVector = [&hull, &self.v_hull]
            .into_iter()
            .flat_map(|sides| sides.iter().map(|side| side.hull(&Interval::ZERO)))
            .collect();
        let reading = match output.coefficients(&from_zero) {
            Some((c, d_v)) => self.linear(&output, &c, &d_v, y),
            None => self.mean_value(&output, &hull, y),
        };
        reading.map(Some)
    }

    /// The rows of C that were measured, and the set y − h(k, 0, u, 0) − D_v V that C x lies in.
    fn linear<Y: System>(
        &self,
        output: &Output<Y>,
        c: &Matrix,
        d_v: &Matrix,
        y: Measurement,
    ) -> Result<Reading, EstimationError> {
        let rows: List<usize> = (0..y.len()).filter(|&i| y[i].is_some()).collect();
        let mut offset = List::filled(Interval::ZERO, self.n_y);
        output.evaluate(
            &List::filled(Interval::ZERO, self.n + self.n_v),
            &mut offset,
        );
        let select = |m: &Matrix| Matrix::from_fn(rows.len(), m.cols(), |i, j| m[(rows[i], j)]);
        let known: List<Interval> = rows
            .iter()
            .filter_map(|&i| y[i].map(|y| Interval::point(y) - offset[i]))
            .collect();
        let middle: List<f64> = known.iter().map(|x| x.mid()).collect();
        let rounding: List<f64> = known.iter().map(|x| x.rad()).collect();
        let target = self.target(output.k, &select(d_v), middle, &rounding)?;
        Ok(Reading {
            strips: Some((select(c), target)),
            exact: true,
            left_out: List::new(),
        })
    }

    /// `middle` − D_v V ± `spread`.
    fn target(
        &self,
        k: usize,
        d_v: &Matrix,
        middle: List<f64>,
        spread: &[f64],
    ) -> Result<ConstrainedZonotope, EstimationError> {
        let target = match &self.v {
            Some(v) => v.affine_map(&d_v.scale(-1.0), &middle),
            None => Zonotope::new(middle, Matrix::zeros(d_v.rows(), 0)).map(Into::into),
        };
        target
            .and_then(|t| t.widened_by(spread))
            .map_err(EstimationError::at(k, "measurement"))
    }

    /// The mean value form over `hull` × V̂. Where a component is left out, the hull is first narrowed by what the measurement rules
    /// out, and the sides that moved are strips, too.
    fn mean_value<Y: System>(
        &self,
        output: &Output<Y>,
        hull: &IntervalVector,
        y: Measurement,
    ) -> Result<Reading, EstimationError> {
        let at = EstimationError::at(output.k, "update");
        let mut rows = self.expanded(output, hull, y).map_err(&at)?;
        if !rows.left_out.is_empty() {
            let narrowed = self.narrowed(output, hull, y).map_err(&at)?;
            if narrowed != *hull {
                rows = self.expanded(output, &narrowed, y).map_err(&at)?;
                for (j, (side, before)) in narrowed.iter().zip(hull).enumerate() {
                    if side != before {
                        let unit = |i: usize| f64::from(u8::from(i == j));
                        rows.linear.push((0..self.n + self.n_v).map(unit).collect());
                        rows.middle.push(side.mid());
                        rows.spread.push(side.rad());
                    }
                }
            }
        }
        let Rows {
            linear,
            middle,
            spread,
            left_out,
        } = rows;
        let part = |from: usize, to: usize| {
            Matrix::from_fn(linear.len(), to - from, |i, j| linear[i][from + j])
        };
        let strips = match linear.is_empty() {
            true => None,
            false => {
                let d_v = part(self.n, self.n + self.n_v);
                let target = self.target(output.k, &d_v, middle, &spread)?;
                Some((part(0, self.n), target))
            }
        };
        Ok(Reading {
            strips,
            exact: false,
            left_out,
        })
    }

    /// The rows of the mean value form over `hull` × V̂ about the middle of the hull and v̄. A component is left out where a number of
    /// its row is not finite: h or a derivative may be undefined there.
    fn expanded<Y: System>(
        &self,
        output: &Output<Y>,
        hull: &IntervalVector,
        y: Measurement,
    ) -> Result<Rows, SetError> {
        let over = IntervalVector::stack(&[hull, &self.v_hull]);
        let center = match &self.v {
            Some(v) => List::concat(&[&hull.mid()[..], v.c()]),
            None => hull.mid(),
        };
        let point = IntervalVector::point(&center)?;
        let mut value = List::filled(Interval::ZERO, self.n_y);
        output.evaluate(point.as_slice(), &mut value);
        let derivatives = number::jacobian(output, over.as_slice());
        let far = distances(&over, &center);
        let mut rows = Rows::default();
        for (i, y) in y.iter().enumerate() {
            let Some(y) = *y else { continue };
            let row = derivatives.row(i);
            let linear: List<f64> = row.iter().map(|j| j.mid()).collect();
            let width = Matrix::from_fn(1, row.len(), |_, j| row[j].rad());
            let varies = product_up(&width, &far)[0];
            let right = real_dot(Interval::point(y) - value[i], &linear, point.as_slice());
            let spread = up(right.rad() + varies, 1);
            if row.iter().all(|e| e.is_finite()) && spread.is_finite() {
                rows.linear.push(linear);
                rows.middle.push(right.mid());
                rows.spread.push(spread);
            } else {
                rows.left_out.push(i);
            }
        }
        Ok(rows)
    }

    /// The hull without slices at its sides over which h × V̂, evaluated on intervals, misses y in some component.
    ///
    /// A slice is half of what is left of the side, then a quarter, down to a sixteenth. Fails with `Empty` where h misses y all over
    /// the hull.
    fn narrowed<Y: System>(
        &self,
        output: &Output<Y>,
        hull: &IntervalVector,
        y: Measurement,
    ) -> Result<IntervalVector, SetError> {
        let mut value = List::filled(Interval::ZERO, self.n_y);
        let mut misses = |sides: &[Interval]| {
            output.evaluate(sides, &mut value);
            let both = y.iter().zip(&value);
            both.into_iter()
                .any(|(y, h)| y.is_some_and(|y| !h.contains(y)))
        };
        let mut sides = IntervalVector::stack(&[hull, &self.v_hull]).into_sides();
        if misses(&sides) {
            return Err(SetError::Empty { op: "narrowing" });
        }
        for side in (0..2 * self.n).chain(0..2 * self.n) {
            let (j, upper) = (side / 2, side % 2 == 1);
            let mut share = 0.5;
            for _ in 0..TRIES {
                let whole = sides[j];
                let width = share * (whole.hi() - whole.lo());
                let cut = match upper {
                    false => whole.lo() + width,
                    true => whole.hi() - width,
                };
                if !(whole.lo() < cut && cut < whole.hi()) {
                    break;
                }
                let [below, above] = [(whole.lo(), cut), (cut, whole.hi())]
                    .map(|(lo, hi)| Interval::new(lo, hi).unwrap_or(whole));
                let (slice, rest) = if upper {
                    (above, below)
                } else {
                    (below, above)
                };
                sides[j] = slice;
                let gone = misses(&sides);
                sides[j] = if gone { rest } else { whole };
                if !gone && share <= 1.0 / 16.0 {
                    break;
                }
                if !gone {
                    share *= 0.5;
                }
            }
        }
        sides.truncate(self.n);
        Ok(IntervalVector::new(sides))
    }
}

/// Rows M x + N v ∈ middle ± spread.
#[derive(Default)]
struct Rows {
    /// \[M, N\].
    linear: List<List<f64>>,
    middle: List<f64>,
    spread: List<f64>,
    left_out: List<usize>,
}

/// How many slices of a side are tried at most.
const TRIES: usize = 64;

/// Upper bounds on |z − c| over a box that contains c.
fn distances(over: &IntervalVector, center: &[f64]) -> List<f64> {
    let far = |(side, &c): (&Interval, &f64)| (*side - Interval::point(c)).mag();
    over.iter().zip(center).map(far).collect()
}
