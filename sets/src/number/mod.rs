//! The numbers a model can be evaluated on.

mod dual;
mod interval;

pub use dual::{Dual, Function, Hessian, Jacobian, hessian, jacobian, partial_jacobian};
pub use interval::Interval;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number a model can be evaluated on: f64, [`Interval`], [`Dual`] over either.
///
/// No ordering: models have no branches. `sqr` is its own operation, because x·x forgets that both
/// factors are the same. A function evaluated outside its domain gives NaN (f64) or the whole line
/// (interval); it never panics.
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
}
