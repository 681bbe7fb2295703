//! Powers of two as the units of components.
//!
//! Components of a state have units of their own, and no result may depend on them: a length in km beside an angle in
//! µrad is the same state as one in m beside rad. So whatever compares numbers of different components divides
//! them first by units taken from the data, the power of two at or below each component's size. Then a change of
//! units by powers of two changes nothing at all, bit for bit, because a product with a power of two is exact but for
//! underflow, and a change of any other kind changes a tolerance by less than a factor 2.
//!
//! What compares components by its definition (a norm over components: Girard's and Combastel's keys, Scott's
//! scores, Yang and Scott's block, the F-radius) takes them as they are, and says so;
//! [`Zonotope::divided_by`] and its counterpart for constrained zonotopes give such methods other units.

use crate::rounding::{ETA, up};
use crate::{ConstrainedZonotope, List, Matrix, SetError, Zonotope};

/// The least and the greatest power of two used as a unit, so that its reciprocal is a normal number too.
const EXTREME: i32 = 1022;

/// e with 2ᵉ ≤ |x| < 2ᵉ⁺¹, for a finite x ≠ 0.
fn exponent(x: f64) -> i32 {
    let (_, e) = libm::frexp(x);
    e - 1
}

/// 2ᵉ, e kept within ±1022.
fn power(e: i32) -> f64 {
    f64::from_bits(((1023 + e.clamp(-EXTREME, EXTREME)) as u64) << 52)
}

/// True for ±2ᵏ with a normal value.
pub fn is_power_of_two(x: f64) -> bool {
    x.is_normal() && x.to_bits() << 12 == 0
}

/// (k, a) if a = ±2ᵉ at index k is the only entry of the row that is not 0: such a row picks a component in another unit.
pub fn picked(row: &[f64]) -> Option<(usize, f64)> {
    let mut nonzero = row.iter().enumerate().filter(|(_, x)| **x != 0.0);
    match (nonzero.next(), nonzero.next()) {
        (Some((k, &a)), None) if is_power_of_two(a) => Some((k, a)),
        _ => None,
    }
}

/// The power of two at or below |x|, within 2^±1022; 1 for 0 and NaN.
///
/// ```
/// use zonobench_sets::units::power_below;
/// assert_eq!([3.0, -0.3, 0.0].map(power_below), [2.0, 0.25, 1.0]);
/// ```
pub fn power_below(x: f64) -> f64 {
    if x == 0.0 || x.is_nan() {
        1.0
    } else if x.is_infinite() {
        power(EXTREME)
    } else {
        power(exponent(x))
    }
}

/// The power of two nearest to |x| by its logarithm, within 2^±1022; 1 for 0 and NaN.
///
/// ```
/// use zonobench_sets::units::nearest_power;
/// assert_eq!([3.0, 2.5, -0.3].map(nearest_power), [4.0, 2.0, 0.25]);
/// ```
pub fn nearest_power(x: f64) -> f64 {
    let below = power_below(x);
    if x.is_finite() && x.abs() / below > core::f64::consts::SQRT_2 {
        power(exponent(x) + 1)
    } else {
        below
    }
}

/// Units for the components of a set of half-widths `radius` about `center`: the powers of two at or below them.
///
/// A component that is flat but for the rounding of its center, r < 2⁻⁵² |c|, has 2⁻⁵² |c| instead of r, and 1 where
/// both vanish but for what underflow may have cost. So c/u does not overflow.
pub fn of_set(center: &[f64], radius: &[f64]) -> List<f64> {
    let unit = |(&c, &r): (&f64, &f64)| {
        let size = r.max(c.abs() * f64::EPSILON);
        power_below(if size <= 4.0 * ETA { 0.0 } else { size })
    };
    center.iter().zip(radius).map(unit).collect()
}

/// The powers of two at or below the greatest |entry| of every row.
pub fn of_rows(m: &Matrix) -> List<f64> {
    let largest = |i: usize| m.row(i).iter().fold(0.0_f64, |l, x| l.max(x.abs()));
    (0..m.rows()).map(|i| power_below(largest(i))).collect()
}

/// diag(`units`)⁻¹ M, exact but for underflow.
pub fn divided_rows(m: &Matrix, units: &[f64]) -> Matrix {
    Matrix::from_fn(m.rows(), m.cols(), |i, j| m[(i, j)] / units[i])
}

/// diag(`units`) M, exact but for underflow and overflow.
pub fn multiplied_rows(m: &Matrix, units: &[f64]) -> Matrix {
    Matrix::from_fn(m.rows(), m.cols(), |i, j| m[(i, j)] * units[i])
}

/// `value` times all powers of two `units`, rounded once: no product on the way overflows or vanishes.
pub fn times(value: f64, units: &[f64]) -> f64 {
    let e = units.iter().map(|&u| exponent(u)).sum();
    libm::scalbn(value, e)
}

/// The product of the numbers, each factor's rounding aside: no product on the way overflows or vanishes.
///
/// ```
/// use zonobench_sets::units::product;
/// assert_eq!(product([1e-170, 1e-170, 1e300]), 1e-170 * (1e-170 * 1e300));
/// ```
pub fn product(factors: impl IntoIterator<Item = f64>) -> f64 {
    let (value, e) = factors.into_iter().fold((1.0, 0), |(value, e), x| {
        if x == 0.0 || !x.is_finite() {
            return (value * x, e);
        }
        let (mantissa, more) = libm::frexp(x);
        let (value, carry) = libm::frexp(value * mantissa);
        (value, e + more + carry)
    });
    libm::scalbn(value, e)
}

/// x · `unit` rounded to nearest, and by how much that is off at most: nothing unless it underflows.
fn moved(x: f64, unit: f64, slip: &mut f64) -> f64 {
    let y = x * unit;
    if y.is_finite() && y / unit != x {
        *slip += f64::from_bits(1);
    }
    y
}

/// ⌈x · `unit`⌉ for x ≥ 0.
pub(crate) fn moved_up(x: f64, unit: f64, slip: f64) -> f64 {
    let mut more = slip;
    let y = moved(x, unit, &mut more);
    if more == 0.0 { y } else { up(y + more, 1) }
}

impl Zonotope {
    /// { diag(u)⁻¹ x : x ∈ Z } for powers of two u, within 2^±1022: the set in other units.
    ///
    /// Exact, but where an entry underflows: then the rounding box takes what is lost. `units` has an entry for every
    /// component, which is the caller's duty. Fails with `NotFinite` on overflow.
    pub fn divided_by(&self, units: &[f64]) -> Result<Self, SetError> {
        self.times_powers(units.iter().map(|u| 1.0 / u))
    }

    /// { diag(u) x : x ∈ Z }, as [`Zonotope::divided_by`].
    pub fn multiplied_by(&self, units: &[f64]) -> Result<Self, SetError> {
        self.times_powers(units.iter().copied())
    }

    fn times_powers(&self, powers: impl Iterator<Item = f64>) -> Result<Self, SetError> {
        const OP: &str = "change of units";
        let (mut c, mut r) = (List::from(self.c()), List::from(self.r()));
        let mut g = self.g().clone();
        for (i, unit) in powers.enumerate() {
            let mut slip = 0.0;
            c[i] = moved(c[i], unit, &mut slip);
            for x in g.row_mut(i) {
                *x = moved(*x, unit, &mut slip);
            }
            r[i] = moved_up(r[i], unit, slip);
        }
        Self::checked(OP, c, g, r)
    }
}

impl ConstrainedZonotope {
    /// { diag(u)⁻¹ x : x ∈ X } for powers of two u, and every constraint in units in which its largest coefficient lies
    /// in [1, 2): the set in other units, those of the measurements that made its constraints included.
    ///
    /// Exact, but where an entry underflows: then r and δ take what is lost. Fails with `NotFinite` on overflow.
    pub fn divided_by(&self, units: &[f64]) -> Result<Self, SetError> {
        let z = self.zonotope().divided_by(units)?;
        let rows = of_rows(self.a());
        let (mut b, mut delta) = (List::from(self.b()), List::from(self.delta()));
        let mut a = self.a().clone();
        for (i, row) in rows.iter().enumerate() {
            let (unit, mut slip) = (1.0 / row, 0.0);
            b[i] = moved(b[i], unit, &mut slip);
            for x in a.row_mut(i) {
                *x = moved(*x, unit, &mut slip);
            }
            delta[i] = moved_up(delta[i], unit, slip);
        }
        Self::with_slack(z, a, b, delta)
    }

    /// { diag(u) x : x ∈ X }; constraints stay as they are. As [`ConstrainedZonotope::divided_by`].
    pub fn multiplied_by(&self, units: &[f64]) -> Result<Self, SetError> {
        let z = self.zonotope().multiplied_by(units)?;
        Self::with_slack(z, self.a().clone(), self.b(), self.delta())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_at_or_below_and_stay_in_range() {
        for e in [-1100, -1074, -1022, -3, 0, 17, 1023] {
            let x = 1.75 * libm::scalbn(1.0, e);
            let p = power_below(x);
            assert!(
                p >= f64::MIN_POSITIVE && (1.0 / p).is_normal(),
                "{e}: {p:e}"
            );
            if (-1022..=1022).contains(&e) {
                assert_eq!(x / p, 1.75);
            }
        }
        assert_eq!(power_below(f64::INFINITY), power(1022));
        assert_eq!(power_below(f64::NAN), 1.0);
    }

    #[test]
    fn products_do_not_vanish_on_the_way() {
        assert_eq!(product([3.0, 0.1, -7.0]), 3.0 * 0.1 * -7.0);
        let mixed = product([1e-200, 1e-200, 1e200, 1e200]);
        assert!((mixed - 1.0).abs() < 1e-15, "{mixed}");
        assert_eq!(product([1e200, 0.0, 1e200]), 0.0);
        assert_eq!(product([]), 1.0);
        assert_eq!(
            times(3.0, &[power(900), power(900), power(-1000), power(-800)]),
            3.0
        );
    }

    #[test]
    fn what_underflows_in_other_units_goes_into_the_rounding_box() {
        let tiny = 1.5 * f64::MIN_POSITIVE;
        let g = Matrix::from_rows(&[[1.0 + f64::EPSILON, tiny * (1.0 + f64::EPSILON)]]).unwrap();
        let z = Zonotope::new(vec![0.25], g).unwrap();
        let there = z.divided_by(&[4.0]).unwrap();
        assert_eq!(there.g()[(0, 0)], 0.25 * (1.0 + f64::EPSILON));
        assert!(there.r()[0] > 0.0);
        let exact = z.divided_by(&[0.25]).unwrap();
        assert_eq!((exact.c()[0], exact.r()[0]), (1.0, 0.0));
        assert_eq!(exact.multiplied_by(&[0.25]).unwrap(), z);
    }

    #[test]
    fn constraints_in_other_units_are_the_same() {
        let x = ConstrainedZonotope::new(
            vec![1.0, 2.0],
            Matrix::identity(2),
            Matrix::from_rows(&[[1024.0, -3072.0]]).unwrap(),
            vec![512.0],
        )
        .unwrap();
        let y = x.divided_by(&[0.5, 8.0]).unwrap();
        assert_eq!(y.a().row(0), [0.5, -1.5]);
        assert_eq!(y.b(), [0.25]);
        assert_eq!(y.delta(), [0.0]);
        assert_eq!(y.c(), [2.0, 0.25]);
        assert_eq!(
            y.multiplied_by(&[0.5, 8.0]).unwrap().zonotope(),
            x.zonotope()
        );
    }
}
