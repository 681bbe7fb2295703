//! Intervals with outward rounding.
//!
//! Every result contains all exact results of the operation for numbers taken from its arguments.
//! Nothing needs a rounding mode, so the bits are the same everywhere.
//!
//! - A sum's bounds are rounded to nearest and moved one step outward only where the rounding error,
//!   which an f64 holds exactly, points that way: they are the best possible ones.
//! - A product, quotient, square or root is rounded to nearest, then moved one step outward. Not moved are
//!   a product or quotient with a factor that is zero, and a product with an f64 that is a power of
//!   two as long as it stays above the smallest normal number, which a rounded one may have reached
//!   from below. A product that merely *underflows* to zero is moved:
//!   1e-200 · 1e-200 is [0, 5e-324], and its negative [−5e-324, 0].
//!
//! Sum, difference, product, quotient, square and root are inclusion isotonic: larger arguments give
//! a larger result, to the last bit.
//!
//! # Outside the domain
//!
//! An operation never panics and never makes a NaN. Where it is not defined on the whole argument it
//! gives the whole line [`Interval::ENTIRE`], which says nothing and is therefore never wrong:
//! division by an interval containing 0, the root of an interval with a negative part, tan across a
//! pole, a number that is NaN or infinite. (Cutting the argument down to the domain would enclose the
//! function on a smaller set than the one asked for.) Unbounded intervals are sets of real numbers,
//! so 0 · [−∞, ∞] = 0. A caller asks [`Interval::is_finite`] and turns the answer into
//! [`SetError::Domain`]; a bound beyond the largest f64 is infinite in the same way.
//!
//! # Elementary functions
//!
//! sin, cos, tan and arctan are `libm`'s, widened by two steps on both sides. libm states an error below
//! one unit in the last place for them; that is a claim which this crate's tests sample against
//! series in exact arithmetic, not a theorem. Everything else here is a theorem of IEEE 754.

use super::{Real, elementary};
use crate::SetError;
use std::f64::consts::FRAC_PI_2;
use std::fmt;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval [lo, hi] of real numbers, lo ≤ hi; a bound may be infinite, none is NaN or −0.
#[derive(Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "(f64, f64)", into = "(f64, f64)")]
pub struct Interval {
    lo: f64,
    hi: f64,
}

/// π/2 lies between this f64 and the next one.
pub(super) const HALF_PI: Interval = Interval {
    lo: FRAC_PI_2,
    hi: FRAC_PI_2.next_up(),
};

/// Beyond this magnitude sin and cos are [−1, 1] and tan is the whole line: 2²⁰.
const LARGEST_ANGLE: f64 = 1_048_576.0;

impl Interval {
    /// [0, 0].
    pub const ZERO: Self = Self { lo: 0.0, hi: 0.0 };
    /// [1, 1].
    pub const ONE: Self = Self { lo: 1.0, hi: 1.0 };
    /// [−1, 1].
    pub const UNIT: Self = Self { lo: -1.0, hi: 1.0 };
    /// (−∞, ∞).
    pub const ENTIRE: Self = Self {
        lo: f64::NEG_INFINITY,
        hi: f64::INFINITY,
    };

    /// [lo, hi].
    ///
    /// Fails with `NotFinite` if a bound is NaN or infinite, with `Reversed` if lo > hi.
    pub fn new(lo: f64, hi: f64) -> Result<Self, SetError> {
        for value in [lo, hi] {
            if !value.is_finite() {
                return Err(SetError::NotFinite {
                    op: "interval",
                    value,
                });
            }
        }
        if lo > hi {
            return Err(SetError::Reversed {
                op: "interval",
                index: 0,
                lower: lo,
                upper: hi,
            });
        }
        Ok(Self::trusted(lo, hi))
    }

    /// [x, x]; the whole line if `x` is NaN or infinite.
    #[inline]
    pub fn point(x: f64) -> Self {
        if x.is_finite() {
            Self::trusted(x, x)
        } else {
            Self::ENTIRE
        }
    }

    /// An interval containing { x : |x − center| ≤ radius }; the whole line unless both are finite
    /// and radius ≥ 0.
    #[inline]
    pub fn from_center_radius(center: f64, radius: f64) -> Self {
        if center.is_finite() && radius.is_finite() && radius >= 0.0 {
            // Without the sign of a zero.
            let (center, radius) = (center + 0.0, radius + 0.0);
            Self {
                lo: sum_down(center, -radius),
                hi: sum_up(center, radius),
            }
        } else {
            Self::ENTIRE
        }
    }

    /// [lo, hi] for bounds known to be ordered and not NaN; −0 becomes 0.
    #[inline]
    pub(crate) fn trusted(lo: f64, hi: f64) -> Self {
        debug_assert!(lo <= hi, "bounds are ordered: [{lo}, {hi}]");
        Self {
            lo: lo + 0.0,
            hi: hi + 0.0,
        }
    }

    /// The lower bound.
    #[inline]
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// The upper bound.
    #[inline]
    pub fn hi(self) -> f64 {
        self.hi
    }

    /// A number of the interval near its middle; 0 for the whole line, ±f64::MAX for a half line.
    #[inline]
    pub fn mid(self) -> f64 {
        let sum = self.lo + self.hi;
        if sum.is_finite() {
            // Rounding is monotone and 2·lo ≤ lo + hi ≤ 2·hi, so half the rounded sum stays inside.
            0.5 * sum
        } else if self.is_finite() {
            0.5 * self.lo + 0.5 * self.hi
        } else if self.lo.is_finite() {
            f64::MAX
        } else if self.hi.is_finite() {
            f64::MIN
        } else {
            0.0
        }
    }

    /// An upper bound on max { |x − mid| : x in the interval }, so that [mid − rad, mid + rad]
    /// contains it.
    #[inline]
    pub fn rad(self) -> f64 {
        let mid = self.mid();
        larger(sum_up(self.hi, -mid), sum_up(mid, -self.lo))
    }

    /// An upper bound on hi − lo.
    #[inline]
    pub fn width(self) -> f64 {
        sum_up(self.hi, -self.lo)
    }

    /// max |x|, exact.
    #[inline]
    pub fn mag(self) -> f64 {
        larger(self.hi, -self.lo)
    }

    /// min |x|, exact.
    #[inline]
    pub fn mig(self) -> f64 {
        larger(larger(self.lo, -self.hi), 0.0)
    }

    /// { |x| }, exact.
    #[inline]
    pub fn abs(self) -> Self {
        Self {
            lo: self.mig(),
            hi: self.mag(),
        }
    }

    /// True if `x` lies in the interval.
    #[inline]
    pub fn contains(self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// True if `inner` ⊆ this interval.
    #[inline]
    pub fn contains_interval(self, inner: Self) -> bool {
        self.lo <= inner.lo && inner.hi <= self.hi
    }

    /// True if this interval ⊆ `outer`.
    #[inline]
    pub fn is_subset(self, outer: Self) -> bool {
        outer.contains_interval(self)
    }

    /// True if both bounds are finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// True for the whole line.
    #[inline]
    pub fn is_entire(self) -> bool {
        self == Self::ENTIRE
    }

    /// True if lo = hi.
    #[inline]
    pub fn is_point(self) -> bool {
        self.lo == self.hi
    }

    /// The interval itself if it is finite, else the error `Domain` of the operation `op`.
    #[inline]
    pub fn finite(self, op: &'static str) -> Result<Self, SetError> {
        if self.is_finite() {
            Ok(self)
        } else {
            Err(SetError::Domain {
                op,
                lower: self.lo,
                upper: self.hi,
            })
        }
    }

    /// The intersection, exact; `None` if it is empty.
    #[inline]
    pub fn intersect(&self, other: &Self) -> Option<Self> {
        let (lo, hi) = (larger(self.lo, other.lo), smaller(self.hi, other.hi));
        (lo <= hi).then_some(Self { lo, hi })
    }

    /// The smallest interval containing both, exact.
    #[inline]
    pub fn hull(&self, other: &Self) -> Self {
        Self {
            lo: smaller(self.lo, other.lo),
            hi: larger(self.hi, other.hi),
        }
    }
}

/// The f64 next below `x`, which is neither zero nor −∞ (nor NaN). Without a branch.
#[inline]
fn step_down(x: f64) -> f64 {
    let bits = x.to_bits() as i64;
    f64::from_bits((bits - ((bits >> 63) | 1)) as u64)
}

/// The f64 next above `x`, which is neither zero nor ∞ (nor NaN). Without a branch. Above −2⁻¹⁰⁷⁴ it is 0, not −0.
#[inline]
fn step_up(x: f64) -> f64 {
    let bits = x.to_bits() as i64;
    f64::from_bits((bits + ((bits >> 63) | 1)) as u64) + 0.0
}

/// The rounded sum s of a and b, and in the second number the error a + b − s.
///
/// Fast2Sum: for |x| ≥ |y| the difference s − x and the error y − (s − x) are exact unless s
/// overflows (Dekker 1971). If it does, the second number is −∞ for s = ∞ and ∞ for s = −∞: its sign
/// is right. If a term is infinite, it is NaN. It is zero wherever s is.
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let (x, y) = if a.abs() < b.abs() { (b, a) } else { (a, b) };
    (s, y - (s - x))
}

/// The largest f64 below or at the exact a + b. Neither a = ∞ nor b = ∞.
#[inline]
fn sum_down(a: f64, b: f64) -> f64 {
    let (s, error) = two_sum(a, b);
    if error < 0.0 { step_down(s) } else { s }
}

/// The smallest f64 above or at the exact a + b. Neither a = −∞ nor b = −∞.
#[inline]
fn sum_up(a: f64, b: f64) -> f64 {
    let (s, error) = two_sum(a, b);
    if error > 0.0 { step_up(s) } else { s }
}

/// The step below `q`, the rounded value of an exact number that is negative only if `negative`:
/// where `q` is zero, this sign alone decides.
#[inline]
fn below(q: f64, negative: bool) -> f64 {
    if q == 0.0 {
        if negative { -f64::from_bits(1) } else { 0.0 }
    } else if q == f64::NEG_INFINITY {
        q
    } else {
        step_down(q)
    }
}

/// The step above `q`, the rounded value of an exact number that is positive only if `positive`.
#[inline]
fn above(q: f64, positive: bool) -> f64 {
    if q == 0.0 {
        if positive { f64::from_bits(1) } else { 0.0 }
    } else if q == f64::INFINITY {
        q
    } else {
        step_up(q)
    }
}

/// x·y for bounds of sets of real numbers: 0·∞ = 0.
#[inline]
fn product(x: f64, y: f64) -> f64 {
    if x == 0.0 || y == 0.0 { 0.0 } else { x * y }
}

/// −1, 0 or 1.
#[inline]
fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// The smaller of two bounds, never −0: [`f64::min`] leaves open which of two zeros it gives.
#[inline]
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    (if a < b { a } else { b }) + 0.0
}

/// The larger of two bounds, never −0.
#[inline]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    (if a > b { a } else { b }) + 0.0
}

/// The product when a bound of it is zero or infinite or an argument is unbounded.
#[cold]
#[inline(never)]
fn careful_product(a: Interval, b: Interval) -> Interval {
    let ends = [(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)];
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut negative, mut positive) = (false, false);
    for (x, y) in ends {
        let p = product(x, y);
        lo = smaller(p, lo);
        hi = larger(p, hi);
        negative |= sign(x) * sign(y) < 0;
        positive |= sign(x) * sign(y) > 0;
    }
    Interval {
        lo: below(lo, negative),
        hi: above(hi, positive),
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        Self {
            lo: sum_down(self.lo, b.lo),
            hi: sum_up(self.hi, b.hi),
        }
    }
}

impl Sub for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        Self {
            lo: sum_down(self.lo, -b.hi),
            hi: sum_up(self.hi, -b.lo),
        }
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        // 0 − x, because −x would make −0 of 0.
        Self {
            lo: 0.0 - self.hi,
            hi: 0.0 - self.lo,
        }
    }
}

impl Mul for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, b: Self) -> Self {
        let (p, q, r, s) = (
            self.lo * b.lo,
            self.lo * b.hi,
            self.hi * b.lo,
            self.hi * b.hi,
        );
        // The sign of a zero does not matter here: zeros go elsewhere.
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let most = |a: f64, b: f64| if a > b { a } else { b };
        let lo = least(least(p, q), least(r, s));
        let hi = most(most(p, q), most(r, s));
        let widths = (self.hi - self.lo) + (b.hi - b.lo);
        if lo != 0.0 && hi != 0.0 && widths < f64::INFINITY {
            Self {
                lo: lo.next_down(),
                hi: hi.next_up() + 0.0,
            }
        } else if self == Self::ZERO || b == Self::ZERO {
            // Common in gradients, where most derivatives are zero.
            Self::ZERO
        } else {
            careful_product(self, b)
        }
    }
}

impl Div for Interval {
    type Output = Self;
    /// The quotient; the whole line if `b` contains 0.
    #[inline]
    fn div(self, b: Self) -> Self {
        let (a, b) = if b.lo > 0.0 {
            (self, b)
        } else if b.hi < 0.0 {
            (-self, -b)
        } else {
            return Self::ENTIRE;
        };
        // b > 0. A finite positive b.lo meets every infinite bound of a; dividing by an infinite
        // b.hi gives a zero whose sign is known.
        let lo = a.lo / if a.lo >= 0.0 { b.hi } else { b.lo };
        let hi = a.hi / if a.hi >= 0.0 { b.lo } else { b.hi };
        Self {
            lo: below(lo, a.lo < 0.0),
            hi: above(hi, a.hi > 0.0),
        }
    }
}

impl Add<f64> for Interval {
    type Output = Self;
    #[inline]
    fn add(self, b: f64) -> Self {
        self + Self::point(b)
    }
}

impl Sub<f64> for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, b: f64) -> Self {
        self - Self::point(b)
    }
}

impl Mul<f64> for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, b: f64) -> Self {
        if is_power_of_two(b) {
            let (x, y) = if b > 0.0 {
                (self.lo, self.hi)
            } else {
                (self.hi, self.lo)
            };
            let (lo, hi) = (x * b, y * b);
            return Self::trusted(
                if stays_exact(x, lo) {
                    lo
                } else {
                    below(lo, lo.is_sign_negative())
                },
                if stays_exact(y, hi) {
                    hi
                } else {
                    above(hi, hi.is_sign_positive())
                },
            );
        }
        self * Self::point(b)
    }
}

impl Div<f64> for Interval {
    type Output = Self;
    #[inline]
    fn div(self, b: f64) -> Self {
        let inverse = 1.0 / b;
        if is_power_of_two(b) && is_power_of_two(inverse) {
            self * inverse
        } else {
            self / Self::point(b)
        }
    }
}

impl Mul<Interval> for f64 {
    type Output = Interval;
    #[inline]
    fn mul(self, b: Interval) -> Interval {
        b * self
    }
}

/// True for ±2ᵏ with a normal value.
#[inline]
fn is_power_of_two(x: f64) -> bool {
    let bits = x.to_bits();
    let exponent = (bits >> 52) & 0x7ff;
    bits & ((1 << 52) - 1) == 0 && exponent != 0 && exponent != 0x7ff
}

/// True if the product `p` of `x` with a power of two is certainly exact.
///
/// An exact product below the smallest normal number is rounded to that number at most: above it nothing was
/// rounded.
#[inline]
fn stays_exact(x: f64, p: f64) -> bool {
    x == 0.0 || (f64::MIN_POSITIVE < p.abs() && p.abs() < f64::INFINITY)
}

/// Two steps below `y`, the value libm gives for a function whose result is at least `least`.
#[inline]
fn margin_below(y: f64, least: f64) -> f64 {
    larger(y.next_down().next_down(), least)
}

/// Two steps above `y`, the value libm gives for a function whose result is at most `most`.
#[inline]
fn margin_above(y: f64, most: f64) -> f64 {
    smaller(y.next_up().next_up() + 0.0, most)
}

/// The smallest and the largest integer n for which n·π/2 may lie in `x`; `None` if `x` reaches so far
/// that the quotient x/(π/2) is no longer known well.
///
/// The quotient is an interval too, so an n that is certainly outside is left out and one that is
/// possibly inside is kept: an extremum kept in vain costs nothing, because a bound within 2⁻³⁰ of
/// an extremum of sin differs from it by less than a rounding.
#[inline]
fn quarter_turns(x: Interval) -> Option<(i64, i64)> {
    if !(x.lo >= -LARGEST_ANGLE && x.hi <= LARGEST_ANGLE) {
        return None;
    }
    let quotient = x / HALF_PI;
    Some((quotient.lo.ceil() as i64, quotient.hi.floor() as i64))
}

/// True if some n in [first, last] leaves the remainder `remainder` when divided by `period`.
#[inline]
fn reaches(first: i64, last: i64, remainder: i64, period: i64) -> bool {
    first + (remainder - first).rem_euclid(period) <= last
}

/// sin or cos (`f`) over `x`: the largest value 1 is taken at n·π/2 with n ≡ `top` modulo 4, the
/// least −1 two quarter turns later; between them `f` is monotone.
#[inline]
fn wave(x: Interval, f: fn(f64) -> f64, top: i64) -> Interval {
    let Some((first, last)) = quarter_turns(x) else {
        return Interval::UNIT;
    };
    let (a, b) = (f(x.lo), f(x.hi));
    let lo = if reaches(first, last, top + 2, 4) {
        -1.0
    } else {
        margin_below(smaller(a, b), -1.0)
    };
    let hi = if reaches(first, last, top, 4) {
        1.0
    } else {
        margin_above(larger(a, b), 1.0)
    };
    Interval::trusted(lo, hi)
}

impl Real for Interval {
    #[inline]
    fn constant(x: f64) -> Self {
        Self::point(x)
    }

    #[inline]
    fn sqr(self) -> Self {
        let (least, most) = (self.mig(), self.mag());
        Self {
            lo: below(least * least, false),
            hi: above(most * most, most > 0.0),
        }
    }

    #[inline]
    fn recip(self) -> Self {
        Self::ONE / self
    }

    #[inline]
    fn sqrt(self) -> Self {
        if self.lo < 0.0 {
            return Self::ENTIRE;
        }
        Self {
            lo: below(self.lo.sqrt(), false),
            hi: above(self.hi.sqrt(), false),
        }
    }

    fn sin(self) -> Self {
        if self == Self::ZERO {
            self
        } else {
            wave(self, libm::sin, 1)
        }
    }

    fn cos(self) -> Self {
        if self == Self::ZERO {
            Self::ONE
        } else {
            wave(self, libm::cos, 0)
        }
    }

    fn tan(self) -> Self {
        match quarter_turns(self) {
            Some((first, last)) if !reaches(first, last, 1, 2) => {
                let lo = if self.lo == 0.0 {
                    0.0
                } else {
                    margin_below(libm::tan(self.lo), f64::MIN)
                };
                let hi = if self.hi == 0.0 {
                    0.0
                } else {
                    margin_above(libm::tan(self.hi), f64::MAX)
                };
                Self { lo, hi }
            }
            _ => Self::ENTIRE,
        }
    }

    fn atan(self) -> Self {
        let lo = if self.lo == 0.0 {
            0.0
        } else {
            margin_below(libm::atan(self.lo), -HALF_PI.hi)
        };
        let hi = if self.hi == 0.0 {
            0.0
        } else {
            margin_above(libm::atan(self.hi), HALF_PI.hi)
        };
        Self { lo, hi }
    }

    fn exp(self) -> Self {
        elementary::exp(self)
    }
    fn exp_m1(self) -> Self {
        elementary::exp_m1(self)
    }
    fn ln(self) -> Self {
        elementary::ln(self)
    }
    fn log10(self) -> Self {
        elementary::log10(self)
    }
    fn ln_1p(self) -> Self {
        elementary::ln_1p(self)
    }
    fn powi(self, n: i32) -> Self {
        elementary::powi(self, n)
    }
    fn powf(self, p: f64) -> Self {
        elementary::pow(self, Self::point(p))
    }
    fn pow(self, y: Self) -> Self {
        elementary::pow(self, y)
    }
    fn asin(self) -> Self {
        elementary::asin(self)
    }
    fn acos(self) -> Self {
        elementary::acos(self)
    }
    fn atan2(self, x: Self) -> Self {
        elementary::atan2(self, x)
    }
    fn sinh(self) -> Self {
        elementary::sinh(self)
    }
    fn cosh(self) -> Self {
        elementary::cosh(self)
    }
    fn tanh(self) -> Self {
        elementary::tanh(self)
    }
    fn asinh(self) -> Self {
        elementary::asinh(self)
    }
    fn hypot(self, y: Self) -> Self {
        elementary::hypot(self, y)
    }
    #[inline]
    fn abs(self) -> Self {
        Interval::abs(self)
    }
    fn min(self, b: Self) -> Self {
        Self {
            lo: smaller(self.lo, b.lo),
            hi: smaller(self.hi, b.hi),
        }
    }
    fn max(self, b: Self) -> Self {
        Self {
            lo: larger(self.lo, b.lo),
            hi: larger(self.hi, b.hi),
        }
    }
    fn sign(self) -> Self {
        elementary::sign(self)
    }
    fn impulse(self) -> Self {
        elementary::impulse(self)
    }
    fn is_less(self, b: Self) -> Self {
        elementary::is_less(self, b)
    }
    fn select(self, a: Self, b: Self) -> Self {
        elementary::select(self, a, b)
    }
    fn cut(self, x: Self) -> Self {
        elementary::cut(self, x)
    }
}

impl TryFrom<(f64, f64)> for Interval {
    type Error = SetError;
    fn try_from((lo, hi): (f64, f64)) -> Result<Self, SetError> {
        Self::new(lo, hi)
    }
}

impl From<Interval> for (f64, f64) {
    fn from(x: Interval) -> Self {
        (x.lo, x.hi)
    }
}

impl fmt::Debug for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{:?}, {:?}]", self.lo, self.hi)
    }
}
