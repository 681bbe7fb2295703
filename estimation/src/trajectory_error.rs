//! How far a trajectory computed in floating point is from the exact one, as a verified bound.
//!
//! The simulator's truth is f64 arithmetic: x_{k+1} = fl(f(x_k, w_k)). Where a verdict depends on the
//! exact trajectory of the same noise, x*_{k+1} = f(x*_k, w_k), the distance e_k = x*_k − x_k matters.
//! By the mean value theorem, with [x_k] a box around x_k that holds x*_k,
//!
//! e_{k+1} ∈ J([x_k]) e_k + l_k,  l_k = f(x_k, w_k) − x_{k+1} evaluated on intervals.
//!
//! A box around e_k would wrap and grow even where the system contracts, so e_k is kept as S_k z_k with
//! S_k an (almost) orthogonal matrix that follows the flow and z_k a box: Lohner's method. "Orthogonal" is meant in units of
//! the components, the powers of two at or below the largest |x_k| of each: a rounding of metres is none of radians.
//!
//! Source: [Lohner1987], the QR variant.

use crate::system::System;
use zonobench_sets::number::{Function, Real, jacobian};
use zonobench_sets::units::power_below;
use zonobench_sets::{Interval, IntervalMatrix, IntervalVector, Matrix};

/// x ↦ f(k, x, u, w) at one step.
struct Step<'a, Sys> {
    system: &'a Sys,
    k: usize,
    u: &'a [f64],
    w: &'a [f64],
    n: usize,
}

impl<Sys: System> Function for Step<'_, Sys> {
    fn inputs(&self) -> usize {
        self.n
    }
    fn outputs(&self) -> usize {
        self.n
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        let w: Vec<S> = self.w.iter().map(|&w| S::constant(w)).collect();
        self.system.f(self.k, x, self.u, &w, y);
    }
}

/// Radii r_k ≥ |x*_k − x_k|, componentwise, for k = 0 … N, where `x` holds x_0 … x_N as computed,
/// and `u`, `w` what drove each step. r_0 = 0: the first state is exact.
///
/// Once a bound is lost (an operation left its domain or overflowed) all later radii are infinite.
pub fn trajectory_error<Sys: System>(
    system: &Sys,
    x: &[Vec<f64>],
    u: &[Vec<f64>],
    w: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let n = x.first().map_or(0, Vec::len);
    let largest = |i: usize| x.iter().fold(0.0_f64, |l, x| l.max(x[i].abs()));
    let units: Vec<f64> = (0..n).map(|i| power_below(largest(i))).collect();
    let mut radii = vec![vec![0.0; n]];
    let mut frame = Matrix::identity(n);
    let mut error = IntervalVector::new(vec![Interval::ZERO; n]);
    for k in 0..x.len().saturating_sub(1) {
        let step = Step {
            system,
            k,
            u: &u[k],
            w: &w[k],
            n,
        };
        let radius = &radii[k];
        let over: Vec<Interval> = x[k]
            .iter()
            .zip(radius)
            .map(|(&c, &r)| Interval::from_center_radius(c, r))
            .collect();
        let at: Vec<Interval> = x[k].iter().map(|&c| Interval::point(c)).collect();
        let mut image = vec![Interval::ZERO; n];
        step.evaluate(&at, &mut image);
        let local = image.iter().zip(&x[k + 1]).zip(&units);
        let local: Vec<Interval> = local.map(|((f, &x), u)| (*f - x) * (1.0 / u)).collect();
        let derivative = jacobian(&step, &over);
        let flow = IntervalMatrix::from_fn(n, n, |i, j| {
            derivative.get(i, j) * units[j] * (1.0 / units[i])
        });
        let flow = flow.mul_matrix(&frame);
        let next = orthonormal_frame(&flow.mid(), &error.rad());
        error = in_frame(&next, &flow, &error, &local);
        frame = next;
        let by_frame = (0..n).map(|i| {
            let component = error
                .iter()
                .zip(frame.row(i))
                .fold(Interval::ZERO, |s, (z, &q)| s + *z * q);
            (component * units[i]).mag()
        });
        // The direct image of the box bounds the same error, and is the better one now and then.
        let radius = by_frame
            .zip(derivative.value.iter().zip(&x[k + 1]))
            .map(|(r, (f, &x))| {
                let bound = r.min((*f - x).mag());
                if bound.is_nan() { f64::INFINITY } else { bound }
            })
            .collect();
        radii.push(radius);
    }
    radii
}

/// z' with Q z' ∋ M z + l for every value in the boxes: z' ∈ Q⁻¹(M z + l).
///
/// Q⁻¹ = (QᵀQ)⁻¹Qᵀ, and ‖(QᵀQ)⁻¹ − I‖∞ ≤ d/(1 − d) with d = ‖I − QᵀQ‖∞ < 1, so Qᵀ(M z + l) widened
/// by d/(1 − d) times its largest component holds z'.
fn in_frame(q: &Matrix, m: &IntervalMatrix, z: &IntervalVector, l: &[Interval]) -> IntervalVector {
    let n = q.rows();
    let transposed = q.transpose();
    let moved = m.left_mul(&transposed).mul_vec(z);
    let sum: Vec<Interval> = (0..n)
        .map(|i| {
            transposed
                .row(i)
                .iter()
                .zip(l)
                .fold(moved[i], |s, (&q, l)| s + *l * q)
        })
        .collect();
    let exact = IntervalMatrix::from_fn(n, n, |i, j| Interval::point(q[(i, j)]));
    let defect = IntervalMatrix::identity(n)
        .sub(&exact.left_mul(&transposed))
        .norm_inf();
    let largest = sum.iter().fold(0.0_f64, |m, s| m.max(s.mag()));
    let share = (defect / (1.0 - defect).next_down()).next_up();
    let widening = if defect < 1.0 {
        (share * largest).next_up()
    } else {
        f64::INFINITY
    };
    let band = Interval::from_center_radius(0.0, widening);
    sum.into_iter()
        .map(|s| if largest == 0.0 { s } else { s + band })
        .collect()
}

/// An orthonormal matrix, up to rounding, whose first columns span the longest columns of M diag(r):
/// Gram–Schmidt, twice, in order of decreasing length (ties as they stand), filled up with unit vectors.
fn orthonormal_frame(m: &Matrix, r: &[f64]) -> Matrix {
    let n = m.rows();
    if !(m.is_finite() && r.iter().all(|x| x.is_finite())) {
        return Matrix::identity(n);
    }
    let norm = |v: &[f64]| v.iter().fold(0.0, |s, x| s + x * x).sqrt();
    let directions: Vec<Vec<f64>> = (0..n).map(|j| m.col(j).into_vec()).collect();
    let lengths: Vec<f64> = directions.iter().zip(r).map(|(d, r)| norm(d) * r).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| lengths[b].total_cmp(&lengths[a]));
    let unit = |i: usize| (0..n).map(|j| f64::from(i == j)).collect::<Vec<f64>>();
    let candidates = order
        .into_iter()
        .map(|j| directions[j].clone())
        .chain((0..n).map(unit));
    let mut columns: Vec<Vec<f64>> = Vec::with_capacity(n);
    for candidate in candidates {
        if columns.len() == n {
            break;
        }
        let length = norm(&candidate);
        if !(length > 0.0 && length.is_finite()) {
            continue;
        }
        let mut v: Vec<f64> = candidate.iter().map(|x| x / length).collect();
        for _ in 0..2 {
            for q in &columns {
                let along = q.iter().zip(&v).fold(0.0, |s, (q, v)| s + q * v);
                v.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
            }
        }
        let rest = norm(&v);
        // What is left of a dependent column is rounding and points anywhere.
        if rest > 1e-6 {
            columns.push(v.into_iter().map(|x| x / rest).collect());
        }
    }
    if columns.len() < n {
        return Matrix::identity(n);
    }
    Matrix::from_fn(n, n, |i, j| columns[j][i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{AnySystem, System};
    use crate::systems::Linear;
    use num_rational::BigRational;
    use num_traits::Signed;

    fn exact(x: f64) -> BigRational {
        BigRational::from_float(x).unwrap()
    }

    fn run<S: System>(
        system: &S,
        x0: &[f64],
        steps: usize,
        w: impl Fn(usize, usize) -> f64,
    ) -> Vec<Vec<Vec<f64>>> {
        let n_w = system.variables().w.len();
        let w: Vec<Vec<f64>> = (0..steps)
            .map(|k| (0..n_w).map(|i| w(k, i)).collect())
            .collect();
        let mut x = vec![x0.to_vec()];
        for k in 0..steps {
            let mut next = vec![0.0; x0.len()];
            system.f(k, &x[k], &[], &w[k], &mut next);
            x.push(next);
        }
        vec![x, w, vec![Vec::new(); steps]]
    }

    #[test]
    fn the_exact_trajectory_of_a_rotation_stays_within_bounds_that_do_not_wrap() {
        // 0.99 · rotation(0.7), as f64 numbers.
        let (c, s) = (0.99 * 0.7_f64.cos(), 0.99 * 0.7_f64.sin());
        let a = Matrix::from_rows(&[[c, -s], [s, c]]).unwrap();
        let c_row = Matrix::from_rows(&[[1.0, 0.0]]).unwrap();
        let system = AnySystem::Linear(Linear::new(a.clone(), None, c_row, None).unwrap());
        let [x, w, u] = &run(&system, &[1.0, 0.5], 60, |k, i| {
            ((k * 7 + i * 3) % 11) as f64 / 11.0 - 0.5
        })[..] else {
            unreachable!("run returns three series")
        };
        let radii = trajectory_error(&system, x, u, w);
        let mut truth: Vec<BigRational> = x[0].iter().map(|&x| exact(x)).collect();
        for k in 0..60 {
            truth = (0..2)
                .map(|i| (0..2).fold(exact(w[k][i]), |s, j| s + exact(a[(i, j)]) * &truth[j]))
                .collect();
            for i in 0..2 {
                let error = (&truth[i] - exact(x[k + 1][i])).abs();
                assert!(error <= exact(radii[k + 1][i]), "k = {k}");
            }
        }
        assert!(
            (&truth[0] - exact(x[60][0])).is_positive()
                || (&truth[0] - exact(x[60][0])).is_negative()
        );
        let long = run(&system, &[1.0, 0.5], 5000, |k, i| {
            ((k * 7 + i * 3) % 11) as f64 / 11.0 - 0.5
        });
        let radii = trajectory_error(&system, &long[0], &long[2], &long[1]);
        assert!(radii[5000].iter().all(|&r| r < 1e-12), "{:?}", radii[5000]);
    }

    #[test]
    fn the_bound_of_the_van_der_pol_oscillator_stays_small() {
        let system = crate::systems::VanDerPol::new(0.1).unwrap();
        let series = run(&system, &[1.0, 1.0], 500, |k, i| {
            if i == 1 {
                0.1 * (0.2 * k as f64).sin()
            } else {
                0.0
            }
        });
        let radii = trajectory_error(&system, &series[0], &series[2], &series[1]);
        assert!(
            radii.iter().flatten().all(|&r| r < 1e-11),
            "{:?}",
            radii[500]
        );
    }

    #[test]
    fn a_trajectory_that_explodes_has_an_infinite_bound() {
        let system = crate::systems::VanDerPol::new(0.1).unwrap();
        let series = run(&system, &[1e5, 1e5], 12, |_, _| 0.0);
        let radii = trajectory_error(&system, &series[0], &series[2], &series[1]);
        assert!(radii[12].iter().any(|r| r.is_infinite()));
        assert!(radii.iter().flatten().all(|r| !r.is_nan()));
    }
}
