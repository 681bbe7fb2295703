//! Ellipsoids of Gaussian beliefs and the quantiles that set their level.
//!
//! These belong to probabilities: nothing here is rounded outward.

use crate::covariance::{Scaled, TOLERANCE};
use crate::{IntervalVector, Matrix, SetError};
use std::f64::consts::TAU;

/// { x : (x − c)ᵀ P⁻¹ (x − c) ≤ σ }, or its limit { c + √σ P^½ z : |z|₂ ≤ 1 } for a singular P.
///
/// # Laws
///
/// ρ(d) = dᵀc + √(σ dᵀP d); the interval hull is c ± √(σ P_ii); boundary points satisfy the equation.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    c: Vec<f64>,
    p: Matrix,
    sigma: f64,
}

/// Of a component whose variance is 0, x agrees with c if they differ by no more than this part of them.
const AGREE: f64 = 1e-12;

impl Ellipsoid {
    /// From a center c in ℝⁿ, a symmetric positive semidefinite P n × n, a level σ ≥ 0.
    ///
    /// Fails with `Dimension` if shapes differ or n = 0, `NotFinite` at a NaN or infinite number,
    /// `Singular` if P is not symmetric positive semidefinite ([`Scaled::check`]: in units near the standard
    /// deviations of its components), `Range` if σ < 0.
    pub fn new(c: Vec<f64>, p: Matrix, sigma: f64) -> Result<Self, SetError> {
        const OP: &str = "ellipsoid";
        let n = c.len();
        if n == 0 {
            return Err(SetError::Dimension {
                op: OP,
                expected: 1,
                got: 0,
            });
        }
        for got in [p.rows(), p.cols()] {
            if got != n {
                return Err(SetError::Dimension {
                    op: OP,
                    expected: n,
                    got,
                });
            }
        }
        let numbers = c.iter().chain(p.as_slice()).chain([&sigma]);
        if let Some(&value) = numbers.into_iter().find(|x| !x.is_finite()) {
            return Err(SetError::NotFinite { op: OP, value });
        }
        if sigma < 0.0 {
            return Err(SetError::Range {
                op: OP,
                what: "level",
                expected: "nonnegative",
                got: sigma,
            });
        }
        if Scaled::new(&p).check().is_err() {
            return Err(SetError::Singular { op: OP });
        }
        Ok(Self {
            c,
            p: p.symmetrized(),
            sigma,
        })
    }

    /// The ellipsoid that holds c + g, g ~ N(0, P), with probability 1 − α: σ = `chi_square_isf`(α, n).
    ///
    /// Fails as [`Ellipsoid::new`] and [`chi_square_isf`].
    pub fn with_confidence(c: Vec<f64>, p: Matrix, alpha: f64) -> Result<Self, SetError> {
        let sigma = chi_square_isf(alpha, c.len())?;
        Self::new(c, p, sigma)
    }

    /// n.
    pub fn dim(&self) -> usize {
        self.c.len()
    }

    /// The center c.
    pub fn c(&self) -> &[f64] {
        &self.c
    }

    /// The shape P, n × n, symmetric.
    pub fn p(&self) -> &Matrix {
        &self.p
    }

    /// The level σ.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The support ρ(d) = max { dᵀx } = dᵀc + √(σ dᵀP d). Fails with `Dimension`.
    pub fn support(&self, d: &[f64]) -> Result<f64, SetError> {
        self.same("support of an ellipsoid", d.len())?;
        let dot = |v: &[f64]| -> f64 { d.iter().zip(v).map(|(a, b)| a * b).sum() };
        let variance = dot(&self.p.mul_vec(d)).max(0.0);
        Ok(dot(&self.c) + (self.sigma * variance).sqrt())
    }

    /// Half-widths √(σ P_ii) of the interval hull.
    pub fn radius(&self) -> Vec<f64> {
        (0..self.dim())
            .map(|i| (self.sigma * self.p[(i, i)].max(0.0)).sqrt())
            .collect()
    }

    /// The smallest box that contains the ellipsoid, c ± √(σ P_ii), rounded to nearest.
    ///
    /// Fails with `NotFinite` on overflow.
    pub fn interval_hull(&self) -> Result<IntervalVector, SetError> {
        let radius = self.radius();
        let bounds = |sign: f64| -> Vec<f64> {
            let both = self.c.iter().zip(&radius);
            both.map(|(c, r)| c + sign * r).collect()
        };
        IntervalVector::from_bounds(&bounds(-1.0), &bounds(1.0))
    }

    /// The square of the Mahalanobis distance, (x − c)ᵀ P⁻¹ (x − c).
    ///
    /// It does not depend on the components' units: P and x − c are first divided by powers of two near the standard
    /// deviations. There, along an eigenvector of an eigenvalue below 10⁻¹² of the greatest, the term is 0 where x
    /// agrees with c to 10⁻⁶ of its root, else the distance is ∞; so it is for a component without variance that
    /// differs from c by more than 10⁻¹² of |x| + |c|. Fails with `Dimension`.
    pub fn squared_distance(&self, x: &[f64]) -> Result<f64, SetError> {
        self.same("distance in an ellipsoid", x.len())?;
        let varies: Vec<usize> = (0..x.len()).filter(|&i| self.p[(i, i)] > 0.0).collect();
        let agrees = |i: usize| {
            let (x, c) = (x[i], self.c[i]);
            varies.contains(&i) || (x - c).abs() <= AGREE * (x.abs() + c.abs())
        };
        if !(0..x.len()).all(agrees) {
            return Ok(f64::INFINITY);
        }
        let n = varies.len();
        if n == 0 {
            return Ok(0.0);
        }
        let part = Matrix::from_fn(n, n, |i, j| self.p[(varies[i], varies[j])]);
        let Scaled { units, matrix } = Scaled::new(&part);
        let offset = varies.iter().zip(&units);
        let offset: Vec<f64> = offset.map(|(&i, u)| (x[i] - self.c[i]) / u).collect();
        let (values, vectors) = matrix.symmetric_eigen();
        let greatest = values.iter().copied().fold(0.0, f64::max);
        let along = vectors.transpose().mul_vec(&offset);
        let terms = values.iter().zip(&along).map(|(&value, &z)| {
            if value > TOLERANCE * greatest {
                z * z / value
            } else if z * z <= TOLERANCE * greatest {
                0.0
            } else {
                f64::INFINITY
            }
        });
        Ok(terms.sum())
    }

    /// True if x lies in the ellipsoid, up to rounding: (x − c)ᵀ P⁻¹ (x − c) ≤ σ. Fails with `Dimension`.
    pub fn contains(&self, x: &[f64]) -> Result<bool, SetError> {
        Ok(self.squared_distance(x)? <= self.sigma)
    }

    /// True if the ellipsoid lies in the box, up to rounding: its interval hull does.
    ///
    /// Fails with `Dimension`, or `NotFinite` on overflow.
    pub fn is_inside(&self, sides: &IntervalVector) -> Result<bool, SetError> {
        self.same("ellipsoid inside a box", sides.dim())?;
        Ok(sides.contains_box(&self.interval_hull()?))
    }

    /// `points` points of the boundary of an ellipse, counter-clockwise: c + √σ L (cos φ, sin φ) with
    /// P = L Lᵀ, L lower triangular, φ = 2π k / `points`.
    ///
    /// Fails with `Dimension` unless n = 2.
    pub fn outline(&self, points: usize) -> Result<Vec<[f64; 2]>, SetError> {
        self.same("outline of an ellipsoid", 2)?;
        let scale = self.sigma.sqrt();
        let l11 = self.p[(0, 0)].max(0.0).sqrt();
        let l21 = if l11 > 0.0 { self.p[(1, 0)] / l11 } else { 0.0 };
        let l22 = (self.p[(1, 1)] - l21 * l21).max(0.0).sqrt();
        let point = |k: usize| {
            let angle = TAU * k as f64 / points as f64;
            let (x, y) = (scale * libm::cos(angle), scale * libm::sin(angle));
            [self.c[0] + l11 * x, self.c[1] + (l21 * x + l22 * y)]
        };
        Ok((0..points).map(point).collect())
    }

    fn same(&self, op: &'static str, got: usize) -> Result<(), SetError> {
        let expected = self.dim();
        if expected == got {
            Ok(())
        } else {
            Err(SetError::Dimension { op, expected, got })
        }
    }
}

/// The σ that a χ² variable of `dof` degrees of freedom exceeds with probability `alpha`.
///
/// σ = 2 y with Q(dof/2, y) = α, Q the regularized upper incomplete gamma function; −2 ln α for
/// dof = 2. Newton's method on ln Q (on ln P for α > ½, where 1 − α is exact), kept in a bracket.
/// Accurate to 10⁻¹³ relative, however small α.
///
/// Fails with `Range` unless 0 < α < 1 and `dof` ≥ 1.
///
/// ```
/// use zonobench_sets::ellipsoid::chi_square_isf;
/// assert!((chi_square_isf(0.0027, 2).unwrap() - 11.829007011943707).abs() < 1e-13);
/// ```
pub fn chi_square_isf(alpha: f64, dof: usize) -> Result<f64, SetError> {
    const OP: &str = "quantile of chi-square";
    if !(alpha > 0.0 && alpha < 1.0) {
        return Err(SetError::Range {
            op: OP,
            what: "alpha",
            expected: "between 0 and 1",
            got: alpha,
        });
    }
    if dof == 0 {
        return Err(SetError::Range {
            op: OP,
            what: "number of degrees of freedom",
            expected: "at least 1",
            got: 0.0,
        });
    }
    if dof == 2 {
        return Ok(-2.0 * libm::log(alpha));
    }
    let a = dof as f64 / 2.0;
    // The excess falls with y when the upper tail is matched, and rises with the lower one.
    let excess = |y: f64| match alpha > 0.5 {
        true => libm::log1p(-alpha) - log_lower(a, y),
        false => log_upper(a, y) - libm::log(alpha),
    };
    let (mut lo, mut hi) = (0.0, a);
    while excess(hi) > 0.0 {
        lo = hi;
        hi *= 2.0;
    }
    let mut y = 0.5 * (lo + hi);
    // Newton needs about five steps; the bound is for bisection alone, from the largest f64 down.
    for _ in 0..2200 {
        let value = excess(y);
        if value > 0.0 {
            lo = y;
        } else {
            hi = y;
        }
        let tail = match alpha > 0.5 {
            true => log_lower(a, y),
            false => log_upper(a, y),
        };
        // d ln Q / d ln y = −yᵃ e⁻ʸ / (Γ(a) Q), likewise for P with the other sign.
        let slope = libm::exp(log_density(a, y) - tail);
        let newton = y * libm::exp(value / slope);
        if (newton - y).abs() <= f64::EPSILON * y || hi <= lo.next_up() {
            break;
        }
        y = match newton > lo && newton < hi {
            true => newton,
            false => 0.5 * (lo + hi),
        };
    }
    Ok(2.0 * y)
}

/// ln(yᵃ e⁻ʸ / Γ(a)).
fn log_density(a: f64, y: f64) -> f64 {
    a * libm::log(y) - y - libm::lgamma(a)
}

/// ln P(a, y), the lower regularized incomplete gamma function.
fn log_lower(a: f64, y: f64) -> f64 {
    if y < a + 1.0 {
        log_density(a, y) + libm::log(series(a, y))
    } else {
        libm::log1p(-libm::exp(log_upper(a, y)))
    }
}

/// ln Q(a, y), the upper regularized incomplete gamma function.
fn log_upper(a: f64, y: f64) -> f64 {
    if y < a + 1.0 {
        libm::log1p(-libm::exp(log_lower(a, y)))
    } else {
        log_density(a, y) + libm::log(continued_fraction(a, y))
    }
}

/// Σ_k yᵏ / (a (a + 1) … (a + k)): P(a, y) over the density, for y < a + 1.
fn series(a: f64, y: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    let mut k = a;
    while term > sum * f64::EPSILON / 4.0 {
        k += 1.0;
        term *= y / k;
        sum += term;
    }
    sum
}

/// 1/(y + 1 − a − 1 (1 − a)/(y + 3 − a − 2 (2 − a)/…)): Q(a, y) over the density, for y ≥ a + 1, by Lentz's
/// method.
fn continued_fraction(a: f64, y: f64) -> f64 {
    let mut b = y + 1.0 - a;
    let mut c = f64::INFINITY;
    let mut d = 1.0 / b;
    let mut value = d;
    // Takes about √a steps beyond a few dozen.
    for k in 1..100_000 {
        let k = f64::from(k);
        let numerator = -k * (k - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        value *= c * d;
        if (c * d - 1.0).abs() <= f64::EPSILON {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipse() -> Ellipsoid {
        let p = Matrix::from_rows(&[[4.0, 1.0], [1.0, 1.0]]).unwrap();
        Ellipsoid::new(vec![1.0, -1.0], p, 9.0).unwrap()
    }

    #[test]
    fn hull_support_and_distance_of_an_ellipse() {
        let e = ellipse();
        assert_eq!(e.radius(), [6.0, 3.0]);
        // (1, −1)ᵀ P (1, −1) = 4 − 2 + 1 = 3
        assert!((e.support(&[1.0, -1.0]).unwrap() - (2.0 + 27f64.sqrt())).abs() < 1e-14);
        // P⁻¹ = [1 −1; −1 4]/3, so the distance of (2, 0) from (1, −1) is (1 − 2 + 4)/3 = 1.
        assert!((e.squared_distance(&[2.0, 0.0]).unwrap() - 1.0).abs() < 1e-14);
        assert!(e.contains(&[2.0, 0.0]).unwrap());
        assert!(!e.contains(&[6.0, -3.5]).unwrap());
        let inside = |x: f64| {
            let sides = IntervalVector::from_bounds(&[-5.0, -4.0], &[x, 2.0]).unwrap();
            e.is_inside(&sides).unwrap()
        };
        assert!(inside(7.0) && !inside(6.9));
    }

    #[test]
    fn the_outline_lies_on_the_boundary_and_runs_counter_clockwise() {
        let outline = ellipse().outline(60).unwrap();
        for (i, v) in outline.iter().enumerate() {
            assert!((ellipse().squared_distance(v).unwrap() - 9.0).abs() < 1e-12);
            let next = outline[(i + 1) % 60];
            let turn = (v[0] - 1.0) * (next[1] + 1.0) - (v[1] + 1.0) * (next[0] - 1.0);
            assert!(turn > 0.0);
        }
    }

    #[test]
    fn a_singular_shape_is_a_segment() {
        let p = Matrix::from_rows(&[[1.0, 2.0], [2.0, 4.0]]).unwrap();
        let e = Ellipsoid::new(vec![0.0; 2], p, 4.0).unwrap();
        assert!(e.contains(&[1.0, 2.0]).unwrap());
        assert!(!e.contains(&[1.0, 1.9]).unwrap());
        assert!(!e.contains(&[2.1, 4.2]).unwrap());
    }

    #[test]
    fn a_metre_beside_a_milliradian_changes_no_distance() {
        for (a, b) in [(1e6_f64, 1e-6_f64), (1e-12, 1e18), (1e200, 1e-200)] {
            let p = Matrix::from_rows(&[[a, 0.5 * (a * b).sqrt()], [0.5 * (a * b).sqrt(), b]]);
            let e = Ellipsoid::new(vec![0.0; 2], p.unwrap(), 1.5).unwrap();
            // (1, −1) in standard deviations: (1 + 1 + 2 ½)/(1 − ¼) = 4; (1, ½): 1.
            let at = |x: f64, y: f64| e.squared_distance(&[x * a.sqrt(), y * b.sqrt()]).unwrap();
            assert!((at(1.0, -1.0) - 4.0).abs() < 1e-14, "{}", at(1.0, -1.0));
            assert!((at(1.0, 0.5) - 1.0).abs() < 1e-14);
            assert!(e.contains(&[a.sqrt(), 0.5 * b.sqrt()]).unwrap());
            assert!(!e.contains(&[a.sqrt(), -b.sqrt()]).unwrap());
        }
    }

    #[test]
    fn a_component_without_variance_must_agree() {
        let p = Matrix::from_rows(&[[1e6, 0.0], [0.0, 0.0]]).unwrap();
        let e = Ellipsoid::new(vec![0.0, 1e-3], p, 1.0).unwrap();
        assert!(e.contains(&[500.0, 1e-3]).unwrap());
        assert!(!e.contains(&[500.0, 1.001e-3]).unwrap());
    }

    #[test]
    fn shapes_and_values_are_checked() {
        let new = |p: &[[f64; 2]], sigma| {
            Ellipsoid::new(vec![0.0; 2], Matrix::from_rows(p).unwrap(), sigma)
        };
        assert!(new(&[[1.0, 0.5], [0.0, 1.0]], 1.0).is_err());
        assert!(new(&[[1.0, 0.0], [0.0, -1.0]], 1.0).is_err());
        assert!(new(&[[1.0, 0.0], [0.0, 1.0]], -1.0).is_err());
        assert!(new(&[[f64::NAN, 0.0], [0.0, 1.0]], 1.0).is_err());
        assert!(new(&[[1.0, 0.0]], 1.0).is_err());
        assert!(new(&[[0.0, 0.0], [0.0, 0.0]], 1.0).is_ok());
        for alpha in [0.0, 1.0, -0.1, f64::NAN] {
            assert!(chi_square_isf(alpha, 3).is_err());
        }
        assert!(chi_square_isf(0.5, 0).is_err());
    }

    #[test]
    fn quantiles_agree_with_forty_digit_arithmetic() {
        // 2 y with Q(dof/2, y) = alpha, by bisection in mpmath 1.3 at 40 digits, rounded to f64.
        let table = [
            (0.0027, 1, 8.999861956749694),
            (0.05, 1, 3.841458820694126),
            (1e-12, 1, 50.844127911818155),
            (1e-300, 1, 1373.8726312223941),
            (0.999, 1, 1.5707971492624927e-6),
            (0.0027, 3, 14.15625250054093),
            (0.5, 3, 2.365973884375338),
            (1e-12, 3, 58.919755683202155),
            (0.95, 4, 0.7107230213973245),
            (0.05, 4, 9.487729036781156),
            (0.01, 5, 15.08627246938899),
            (0.0027, 12, 30.097049086892017),
            (1e-12, 12, 83.21940615745052),
            (0.05, 30, 43.77297182574219),
            (0.5, 100, 99.33412923598846),
            (1e-12, 100, 233.81056795920782),
            (0.99, 7, 1.23904230556793),
            (1.0 - 2f64.powi(-40), 6, 0.000352127210288041),
            (0.01, 1000, 1106.9689943522174),
            (0.51, 2001, 1998.748206698344),
            (1e-12, 2, 55.262042231857095),
        ];
        for (alpha, dof, expected) in table {
            let sigma = chi_square_isf(alpha, dof).unwrap();
            let error = (sigma / expected - 1.0).abs();
            assert!(
                error < 1e-13,
                "alpha = {alpha}, dof = {dof}: {sigma}, {error:e}"
            );
        }
    }

    #[test]
    fn the_general_branches_give_the_closed_form_of_two_degrees() {
        for y in [1e-9, 0.1, 1.0, 1.9, 2.0, 2.1, 30.0, 700.0] {
            // ln P ≈ −21 at the smallest y carries that many units of rounding into P.
            let error = (log_upper(1.0, y) + y).abs();
            assert!(error <= 32.0 * f64::EPSILON * y, "{y}: {error:e}");
        }
    }
}
