//! The gain of a linear filter, K = P Cᵀ S⁻¹ with S = C P Cᵀ + R, where S may be singular.
//!
//! Sensors without noise, a state that is known, a sensor that is mounted twice: S is positive semidefinite and
//! no more. The minimum of the error is still attained: by K = P Cᵀ S⁻ for *every* generalized inverse S⁻, since the
//! rows of C P lie in the range of S. All of them give the same K z for an innovation z in the range of S. The one
//! here is that of a largest set of components that are independent under S; it does not depend on units, as
//! the Moore–Penrose inverse does. An innovation outside of the range is impossible under the model. Then no gain is
//! right, and [`Range::check`] says so.

use crate::EstimationError;
use zonobench_sets::{List, Matrix, SetError};

/// A pivot of the Cholesky factor that keeps this much of its diagonal entry is beyond all rounding of S
/// in dimensions that fit into memory: S is taken for regular without a closer look.
const REGULAR: f64 = 1.0 / (1u64 << 40) as f64;

/// An innovation that misses the range by less than half of the digits of the numbers it was computed from
/// is not told from their rounding, which the mean carries on from step to step.
const HALF_OF_THE_DIGITS: f64 = 1.0 / (1u64 << 26) as f64;

/// S = C P Cᵀ + R and what it was made of.
pub(super) struct Innovation<'a> {
    /// C, m × n.
    pub c: &'a Matrix,
    /// P, n × n, positive semidefinite.
    pub p: &'a Matrix,
    /// P Cᵀ, n × m.
    pub pct: &'a Matrix,
    /// R, m × m, positive semidefinite.
    pub r: &'a Matrix,
    /// S, m × m.
    pub s: &'a Matrix,
}

impl Innovation<'_> {
    /// K = P Cᵀ S⁻, n × m, and the range of S if S is singular up to the rounding of its entries.
    ///
    /// Fails with `NotFinite` where S has overflowed, and with `Singular` where it has a direction of
    /// negative variance, which no covariance has.
    pub fn gain(&self) -> Result<(Matrix, Option<Range>), SetError> {
        gain(self.pct, self.s, || self.rounding())
    }

    /// The range of S.
    pub fn range(&self) -> Result<Range, SetError> {
        Range::of(self.s, &self.rounding())
    }

    /// A bound on the rounding of each diagonal entry of S, and with it on that of s_ij by the
    /// geometric mean: γ (|C| |P| |C|ᵀ + |R|)_ii with two sums of n and one more, twice for a P that is itself rounded.
    fn rounding(&self) -> List<f64> {
        let (c, n) = (self.c.abs(), self.c.cols());
        let spread = c.mul(&self.p.abs());
        let unit = (4 * n + 8) as f64 * f64::EPSILON;
        (0..c.rows())
            .map(|i| {
                let sum: f64 = (0..n).map(|j| spread[(i, j)] * c[(i, j)]).sum();
                unit * (sum + self.r[(i, i)].abs())
            })
            .collect()
    }
}

/// K = P Cᵀ S⁻ from P Cᵀ and S, and the range of S if S is singular; `rounding` is what each diagonal entry of S may be
/// off by. Fails as [`Innovation::gain`].
pub(super) fn gain(
    pct: &Matrix,
    s: &Matrix,
    rounding: impl Fn() -> List<f64>,
) -> Result<(Matrix, Option<Range>), SetError> {
    const OP: &str = "gain";
    let range = || Range::of(s, &rounding());
    if let Some(&value) = s.as_slice().iter().find(|x| !x.is_finite()) {
        return Err(SetError::NotFinite { op: OP, value });
    }
    if s.rows() == 1 && s[(0, 0)] > 0.0 {
        return Ok((pct.divide(s[(0, 0)]), None));
    }
    if s.rows() > 1
        && let Ok(l) = s.cholesky()
    {
        let regular = |i| l[(i, i)] * l[(i, i)] > REGULAR * s[(i, i)];
        if (0..s.rows()).all(regular) || range()?.is_whole() {
            let k = l.solve_by_factor(&pct.transpose()).transpose();
            return Ok((k, None));
        }
    }
    let range = range()?;
    let kept = range.kept();
    let mut gain = Matrix::zeros(pct.rows(), s.rows());
    let part = pct.select_columns(kept);
    let solved = match kept {
        [] => return Ok((gain, Some(range))),
        &[i] => part.divide(s[(i, i)]),
        _ => Matrix::from_fn(kept.len(), kept.len(), |i, j| s[(kept[i], kept[j])])
            .solve_positive_definite(&part.transpose())
            .map_err(|_| SetError::Singular { op: OP })?
            .transpose(),
    };
    for (j, &component) in kept.iter().enumerate() {
        for i in 0..gain.rows() {
            gain[(i, component)] = solved[(i, j)];
        }
    }
    Ok((gain, Some(range)))
}

/// The range of a positive semidefinite matrix: the components that were independent, and how the
/// others follow from them.
#[derive(Debug)]
pub(super) struct Range {
    /// All components, the independent ones first.
    order: List<usize>,
    rank: usize,
    /// L of the factorization in this order, `rank` columns: z_i − Σ_k l_ik z'_k is 0 in the range.
    l: Matrix,
}

impl Range {
    /// By the factorization L D Lᵀ, at each step with the component that keeps most of its variance; a component
    /// that keeps less than rounding depends on those before. Both are ratios within one component.
    ///
    /// `rounding` is what each diagonal entry may be off by. Fails with `Singular` where a variance is negative
    /// beyond it.
    pub fn of(s: &Matrix, rounding: &[f64]) -> Result<Self, SetError> {
        let m = s.rows();
        let mut left = s.clone();
        let mut order: List<usize> = (0..m).collect();
        let mut l = Matrix::zeros(m, m);
        // The elimination itself: one product, one quotient and one difference a step.
        let unit = (4 * m + 8) as f64 * f64::EPSILON;
        let cut = |i: usize| unit * s[(i, i)].abs() + rounding[i] * (m + 1) as f64;
        let mut rank = 0;
        while rank < m {
            let share = |i: usize| match left[(i, i)] > cut(i) {
                true => left[(i, i)] / s[(i, i)],
                false => 0.0,
            };
            let (mut best, mut most) = (rank, 0.0);
            for (place, &i) in order.iter().enumerate().skip(rank) {
                if share(i) > most {
                    (best, most) = (place, share(i));
                }
            }
            if most == 0.0 {
                break;
            }
            // The others stay in their order.
            order[rank..=best].rotate_right(1);
            let pivot = order[rank];
            for &i in &order[rank + 1..] {
                let factor = left[(i, pivot)] / left[(pivot, pivot)];
                l[(i, rank)] = factor;
                for &j in &order[rank + 1..] {
                    left[(i, j)] -= factor * left[(pivot, j)];
                }
            }
            rank += 1;
        }
        // What is left of a semidefinite matrix without variances has no covariances either.
        let rest = &order[rank..];
        let beyond = |i: usize, j: usize| left[(i, j)].abs() > cut(i).sqrt() * cut(j).sqrt();
        if rest.iter().any(|&i| left[(i, i)] < -cut(i))
            || rest
                .iter()
                .any(|&i| rest.iter().any(|&j| i != j && beyond(i, j)))
        {
            return Err(SetError::Singular {
                op: "covariance of the innovation",
            });
        }
        Ok(Self { order, rank, l })
    }

    /// The components that were kept.
    fn kept(&self) -> &[usize] {
        &self.order[..self.rank]
    }

    fn is_whole(&self) -> bool {
        self.rank == self.order.len()
    }

    /// Fails with [`EstimationError::Singular`] unless the innovation z lies in the range, up to half of the digits
    /// of `scale`, the sizes of the numbers that each z_i was computed from.
    pub fn check(
        &self,
        k: usize,
        op: &'static str,
        z: &[f64],
        scale: &[f64],
    ) -> Result<(), EstimationError> {
        let mut rest: List<f64> = z.into();
        let mut allowed: List<f64> = scale.iter().map(|s| HALF_OF_THE_DIGITS * s).collect();
        for (step, &pivot) in self.kept().iter().enumerate() {
            for &i in &self.order[step + 1..] {
                let factor = self.l[(i, step)];
                rest[i] -= factor * rest[pivot];
                allowed[i] += factor.abs() * allowed[pivot];
            }
        }
        match self.order[self.rank..]
            .iter()
            .find(|&&i| rest[i].is_nan() || allowed[i].is_nan() || rest[i].abs() > allowed[i])
        {
            None => Ok(()),
            Some(&i) => Err(EstimationError::Singular {
                k,
                op,
                reason: format!(
                    "the covariance C P C' + R allows no deviation in component {} of y, and it deviates by {:e}",
                    i + 1,
                    rest[i]
                ),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: &[&[f64]]) -> Matrix {
        Matrix::from_rows(rows).unwrap()
    }

    fn gain(c: &Matrix, p: &Matrix, r: &Matrix) -> (Matrix, Option<Range>) {
        let pct = p.mul_transpose(c);
        let s = c.mul(&pct).add(r);
        let innovation = Innovation {
            c,
            p,
            pct: &pct,
            r,
            s: &s,
        };
        innovation.gain().unwrap()
    }

    #[test]
    fn a_sensor_without_noise_of_a_known_state_has_the_gain_zero() {
        let zero = Matrix::zeros(1, 1);
        let (k, range) = gain(&Matrix::identity(1), &zero, &zero);
        assert_eq!(k, zero);
        let range = range.unwrap();
        assert!(range.check(3, "gain", &[0.0], &[1.0]).is_ok());
        let error = range.check(3, "gain", &[0.25], &[1.0]).unwrap_err();
        assert!(matches!(error, EstimationError::Singular { k: 3, .. }));
    }

    #[test]
    fn two_perfect_sensors_of_one_state_are_one_and_must_agree() {
        // x ~ N(0, 3), y = (x, 2 x): K y = y_1 or y_2/2, or any mean of them.
        let c = matrix(&[&[1.0], &[2.0]]);
        let (k, range) = gain(&c, &matrix(&[&[3.0]]), &Matrix::zeros(2, 2));
        assert_eq!(k.mul_vec(&[0.7, 1.4]), [0.7]);
        let range = range.unwrap();
        assert!(range.check(0, "gain", &[0.7, 1.4], &[1.0, 1.0]).is_ok());
        assert!(range.check(0, "gain", &[0.7, 1.5], &[1.0, 1.0]).is_err());
    }

    #[test]
    fn the_gain_of_a_singular_covariance_is_the_limit_of_regular_ones() {
        // Three states, two perfect sensors, the second of a known combination.
        let p = matrix(&[&[2.0, 1.0, 0.0], &[1.0, 2.0, 0.0], &[0.0, 0.0, 0.0]]);
        let c = matrix(&[&[1.0, 0.0, 1.0], &[0.0, 0.0, 3.0], &[1.0, -1.0, 0.5]]);
        let (k, range) = gain(&c, &p, &Matrix::zeros(3, 3));
        let range = range.unwrap();
        let z = [0.5, 0.0, 0.25];
        assert!(range.check(0, "gain", &z, &[1.0; 3]).is_ok());
        let (near, regular) = gain(&c, &p, &Matrix::identity(3).scale(1e-9));
        assert!(regular.is_none());
        for (a, b) in k.mul_vec(&z).iter().zip(&near.mul_vec(&z)) {
            // R = 1e-9 moves the gain by as much.
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }

    #[test]
    fn no_power_of_two_in_the_units_of_y_changes_which_components_are_independent() {
        let p = matrix(&[&[2.0, 1.0], &[1.0, 2.0]]);
        let c = matrix(&[&[1.0, 0.1], &[0.3, 1.0], &[1.3, 1.1]]);
        let (k, _) = gain(&c, &p, &Matrix::zeros(3, 3));
        let units = [1.0, (40.0_f64).exp2(), (-40.0_f64).exp2()];
        let scaled = Matrix::from_fn(3, 2, |i, j| units[i] * c[(i, j)]);
        let (there, _) = gain(&scaled, &p, &Matrix::zeros(3, 3));
        let back = Matrix::from_fn(2, 3, |i, j| there[(i, j)] * units[j]);
        assert_eq!(back, k);
    }

    #[test]
    fn a_small_variance_that_is_known_exactly_is_not_taken_for_zero() {
        // Two sensors of variance 1e-14 on one state: their mean, not one of them.
        let c = matrix(&[&[1.0], &[1.0]]);
        let r = Matrix::identity(2).scale(1.0 / (1u64 << 46) as f64);
        let (k, range) = gain(&c, &Matrix::identity(1), &r);
        assert!(range.is_none());
        assert!((k[(0, 0)] - 0.5).abs() < 0.05, "{k:?}");
    }

    #[test]
    fn a_negative_variance_is_refused() {
        let s = matrix(&[&[1.0, 2.0], &[2.0, 1.0]]);
        assert!(Range::of(&s, &[0.0, 0.0]).is_err());
        assert!(Range::of(&matrix(&[&[-1.0]]), &[0.0]).is_err());
        assert!(Range::of(&matrix(&[&[0.0, 1.0], &[1.0, 0.0]]), &[0.0, 0.0]).is_err());
    }
}
