//! The numbers a model can be evaluated on.

mod dual;
mod elementary;
mod interval;

pub use dual::{Dual, Function, Hessian, Jacobian, hessian, jacobian, partial_jacobian};
pub use interval::Interval;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number a model can be evaluated on: f64, [`Interval`], [`Dual`] over either.
///
/// No ordering: models have no branches. `sqr` is its own operation, because x·x forgets that both
/// factors are the same. A function evaluated outside its domain gives NaN (f64) or the whole line
/// (interval); it never panics.
///
/// The last five methods are what derivatives of functions with a kink or a jump are made of; a model has no need of
/// them.
pub trait Real:
    Copy
    + 'static
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The constant `x`.
    fn constant(x: f64) -> Self;
    /// x².
    fn sqr(self) -> Self;
    /// 1/x.
    fn recip(self) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// sin x.
    fn sin(self) -> Self;
    /// cos x.
    fn cos(self) -> Self;
    /// tan x.
    fn tan(self) -> Self;
    /// arctan x.
    fn atan(self) -> Self;
    /// eˣ.
    fn exp(self) -> Self;
    /// eˣ − 1, exact near 0.
    fn exp_m1(self) -> Self;
    /// ln x, for x > 0.
    fn ln(self) -> Self;
    /// log₁₀ x, for x > 0.
    fn log10(self) -> Self;
    /// ln(1 + x), exact near 0, for x > −1.
    fn ln_1p(self) -> Self;
    /// xⁿ. Its own operation: an even power over an interval is not a product of equal factors.
    fn powi(self, n: i32) -> Self;
    /// x^p for a constant p, for x > 0, or x ≥ 0 where p > 0.
    fn powf(self, p: f64) -> Self;
    /// x^y, for x > 0, or x ≥ 0 where y > 0.
    fn pow(self, y: Self) -> Self;
    /// arcsin x, for |x| ≤ 1.
    fn asin(self) -> Self;
    /// arccos x, for |x| ≤ 1.
    fn acos(self) -> Self;
    /// The angle of the point (`x`, `self`) in (−π, π]. It jumps across {(x, 0) : x ≤ 0}, where it has no derivative.
    fn atan2(self, x: Self) -> Self;
    /// sinh x.
    fn sinh(self) -> Self;
    /// cosh x.
    fn cosh(self) -> Self;
    /// tanh x.
    fn tanh(self) -> Self;
    /// arsinh x.
    fn asinh(self) -> Self;
    /// √(x² + y²).
    fn hypot(self, y: Self) -> Self;
    /// |x|. Over 0 its derivative is the hull of both slopes, and it has no second one.
    fn abs(self) -> Self;
    /// The smaller of two. Where either may be, the derivative is the hull of both, and there is no second one.
    fn min(self, b: Self) -> Self;
    /// The larger of two; derivatives as of `min`.
    fn max(self, b: Self) -> Self;

    /// −1 left of 0 and 1 right of it, the slope of |x|: [−1, 1] over 0.
    fn sign(self) -> Self;
    /// The slope of `sign`: 0, and not defined at 0.
    fn impulse(self) -> Self;
    /// 1 where `self` < `b`, 0 where `self` > `b`, [0, 1] where neither is certain.
    fn is_less(self, b: Self) -> Self;
    /// `a` where `self` is 1, `b` where it is 0, what contains both otherwise.
    fn select(self, a: Self, b: Self) -> Self;
    /// 0 where the angle of (`x`, `self`) is smooth, not defined where it jumps.
    fn cut(self, x: Self) -> Self;
}

impl Real for f64 {
    fn constant(x: f64) -> Self {
        x
    }
    fn sqr(self) -> Self {
        self * self
    }
    fn recip(self) -> Self {
        1.0 / self
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn sin(self) -> Self {
        libm::sin(self)
    }
    fn cos(self) -> Self {
        libm::cos(self)
    }
    fn tan(self) -> Self {
        libm::tan(self)
    }
    fn atan(self) -> Self {
        libm::atan(self)
    }
    fn exp(self) -> Self {
        libm::exp(self)
    }
    fn exp_m1(self) -> Self {
        libm::expm1(self)
    }
    fn ln(self) -> Self {
        libm::log(self)
    }
    fn log10(self) -> Self {
        libm::log10(self)
    }
    fn ln_1p(self) -> Self {
        libm::log1p(self)
    }
    fn powi(self, n: i32) -> Self {
        elementary::powi_f64(self, n)
    }
    fn powf(self, p: f64) -> Self {
        libm::pow(self, p)
    }
    fn pow(self, y: Self) -> Self {
        libm::pow(self, y)
    }
    fn asin(self) -> Self {
        libm::asin(self)
    }
    fn acos(self) -> Self {
        libm::acos(self)
    }
    fn atan2(self, x: Self) -> Self {
        libm::atan2(self, x)
    }
    fn sinh(self) -> Self {
        libm::sinh(self)
    }
    fn cosh(self) -> Self {
        libm::cosh(self)
    }
    fn tanh(self) -> Self {
        libm::tanh(self)
    }
    fn asinh(self) -> Self {
        libm::asinh(self)
    }
    fn hypot(self, y: Self) -> Self {
        libm::hypot(self, y)
    }
    fn abs(self) -> Self {
        f64::abs(self)
    }
    fn min(self, b: Self) -> Self {
        if self < b || self.is_nan() { self } else { b }
    }
    fn max(self, b: Self) -> Self {
        if self > b || self.is_nan() { self } else { b }
    }
    fn sign(self) -> Self {
        f64::from(i8::from(self > 0.0) - i8::from(self < 0.0))
    }
    fn impulse(self) -> Self {
        if self == 0.0 { f64::NAN } else { 0.0 }
    }
    fn is_less(self, b: Self) -> Self {
        f64::from(u8::from(self < b))
    }
    fn select(self, a: Self, b: Self) -> Self {
        if self == 1.0 { a } else { b }
    }
    fn cut(self, x: Self) -> Self {
        if x <= 0.0 && self == 0.0 {
            f64::NAN
        } else {
            0.0
        }
    }
}
