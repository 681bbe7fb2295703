//! Sets through nonlinear dynamics: enclosures of { f(x, w) : x ∈ X, w ∈ W }.
//!
//! Shared by the estimators and usable alone: [`mean_value`] linearises f with an interval Jacobian,
//! [`first_order`] expands it to second order with an interval Hessian. Both hold for any point h that the
//! expansion is made about; [`Choice`] says how it is chosen. Derivatives come from the model by
//! automatic differentiation over intervals, so how the model is written matters for their width.
//!
//! Source: [Rego2020, Sec. 4].

mod choice;
pub mod decomposition;
pub mod generators;
mod mean_value;
mod taylor;

pub use choice::{Choice, closest_point, coordinates_of};
pub use mean_value::{mean_value, zonotope_mean_value};
pub use taylor::{Expansion, Remainder, first_order, first_order_about, zonotope_first_order};

use crate::System;
use zonobench_sets::interval_matrix::jacobian_over;
use zonobench_sets::number::{Function, Real};
use zonobench_sets::rounding::up;
use zonobench_sets::{Interval, IntervalVector, List, Matrix, Zonotope};

/// (x, w) ↦ f(k, x, u, w) of a system at one step, as a function of n + n_w numbers.
#[derive(Debug)]
pub struct Dynamics<'a, Y> {
    system: &'a Y,
    k: usize,
    u: &'a [f64],
    n: usize,
    n_w: usize,
}

impl<'a, Y: System> Dynamics<'a, Y> {
    /// The dynamics that lead from step `k` to `k` + 1 under the input `u`.
    pub fn new(system: &'a Y, k: usize, u: &'a [f64]) -> Self {
        let variables = system.variables();
        Self::of_sizes(system, k, u, variables.x.len(), variables.w.len())
    }

    /// The same where n and n_w are known: the names of variables are made anew each time they are asked for.
    pub(crate) fn of_sizes(system: &'a Y, k: usize, u: &'a [f64], n: usize, n_w: usize) -> Self {
        Self {
            system,
            k,
            u,
            n,
            n_w,
        }
    }
}

impl<Y: System> Function for Dynamics<'_, Y> {
    fn inputs(&self) -> usize {
        self.n + self.n_w
    }
    fn outputs(&self) -> usize {
        self.n
    }
    fn evaluate<S: Real>(&self, z: &[S], next: &mut [S]) {
        self.system
            .f(self.k, &z[..self.n], self.u, &z[self.n..], next);
    }
}

/// (x, v) ↦ h(k, x, u, v) of a system at one step, as a function of n + n_v numbers.
#[derive(Debug)]
pub(crate) struct Output<'a, Y> {
    system: &'a Y,
    /// k.
    pub k: usize,
    u: &'a [f64],
    n: usize,
    n_y: usize,
    n_v: usize,
}

impl<'a, Y: System> Output<'a, Y> {
    /// The measurement of step `k` under the input `u`.
    pub fn new(system: &'a Y, k: usize, u: &'a [f64]) -> Self {
        let variables = system.variables();
        let sizes = [&variables.x, &variables.y, &variables.v].map(Vec::len);
        Self::of_sizes(system, k, u, sizes)
    }

    /// The same where n, n_y and n_v are known.
    pub fn of_sizes(system: &'a Y, k: usize, u: &'a [f64], [n, n_y, n_v]: [usize; 3]) -> Self {
        Self {
            system,
            k,
            u,
            n,
            n_y,
            n_v,
        }
    }

    /// C and D_v where h is linear over the box, with f64 coefficients at this k and u.
    ///
    /// A linear function has points for derivatives, not intervals. One that is not defined all over the box is not linear.
    pub fn coefficients(&self, over: &IntervalVector) -> Option<(Matrix, Matrix)> {
        let (n, all) = (self.n, self.n + self.n_v);
        let (_, j) = jacobian_over(self, over).ok()?;
        let columns =
            |from: usize, to: usize| j.select_columns(&(from..to).collect::<List<_>>()).mid();
        j.as_slice()
            .iter()
            .all(|e| e.is_point())
            .then(|| (columns(0, n), columns(n, all)))
    }
}

impl<Y: System> Function for Output<'_, Y> {
    fn inputs(&self) -> usize {
        self.n + self.n_v
    }
    fn outputs(&self) -> usize {
        self.n_y
    }
    fn evaluate<S: Real>(&self, z: &[S], y: &mut [S]) {
        self.system.h(self.k, &z[..self.n], self.u, &z[self.n..], y);
    }
}

/// The box and the point: their smallest common box.
pub(crate) fn around(sides: &IntervalVector, point: &[f64]) -> IntervalVector {
    sides
        .iter()
        .zip(point)
        .map(|(side, &x)| side.hull(&Interval::point(x)))
        .collect()
}

/// Upper bounds on |x − h| over the zonotope: ⌈|c − h| + |G| 1 + r⌉.
fn distances(z: &Zonotope, h: &[f64]) -> List<f64> {
    let radius = z.radius();
    (0..z.dim())
        .map(|i| up((z.c()[i] - h[i]).abs() + radius[i], 2))
        .collect()
}

/// ⌈R e⌉ for R, e ≥ 0; exactly 0 where the row of R is.
pub(crate) fn product_up(r: &Matrix, e: &[f64]) -> List<f64> {
    let row = |i: usize| {
        let row = r.row(i);
        match row.iter().all(|&x| x == 0.0) {
            true => 0.0,
            false => up(
                row.iter().zip(e).fold(0.0, |s, (r, e)| s + r * e),
                row.len() + 1,
            ),
        }
    };
    (0..r.rows()).map(row).collect()
}

/// a + b of nonnegative numbers, rounded up where it rounds.
fn sum_up(a: &[f64], b: &[f64]) -> List<f64> {
    a.iter()
        .zip(b)
        .map(|(&a, &b)| {
            if a == 0.0 || b == 0.0 {
                a + b
            } else {
                up(a + b, 1)
            }
        })
        .collect()
}
