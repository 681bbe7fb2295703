//! Numbers that carry their derivatives, and the Jacobians and Hessians they give.
//!
//! A [`Dual`] is a value with N directional derivatives; over intervals its gradient encloses the
//! gradient at every point of the box, over duals it carries second derivatives. A model written once
//! for [`Real`] is therefore evaluated on every number. Over intervals an enclosure depends on how
//! the model is written: fewer occurrences of a variable give a tighter one.

use super::Real;
use crate::List;
use std::ops::{Add, Div, Mul, Neg, Range, Sub};

/// A value and its derivatives in N directions.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Dual<S, const N: usize> {
    /// The value.
    pub value: S,
    /// The derivatives in the N directions.
    pub gradient: [S; N],
}

impl<S: Real, const N: usize> Dual<S, N> {
    /// The number `value`, which depends on no direction.
    #[inline]
    pub fn fixed(value: S) -> Self {
        Self {
            value,
            gradient: [S::constant(0.0); N],
        }
    }

    /// The variable `value` whose derivative is 1 in direction `i` < N and 0 in the others.
    #[inline]
    pub fn variable(value: S, i: usize) -> Self {
        let mut x = Self::fixed(value);
        x.gradient[i] = S::constant(1.0);
        x
    }

    /// The number with this value whose gradient is `slope` times this one's: the chain rule.
    #[inline]
    fn chain(self, value: S, slope: S) -> Self {
        Self {
            value,
            gradient: self.gradient.map(|g| slope * g),
        }
    }

    #[inline]
    fn zip(self, b: Self, value: S, f: impl Fn(S, S) -> S) -> Self {
        Self {
            value,
            gradient: std::array::from_fn(|i| f(self.gradient[i], b.gradient[i])),
        }
    }
}

impl<S: Real, const N: usize> Add for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        self.zip(b, self.value + b.value, |x, y| x + y)
    }
}

impl<S: Real, const N: usize> Sub for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        self.zip(b, self.value - b.value, |x, y| x - y)
    }
}

impl<S: Real, const N: usize> Neg for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            gradient: self.gradient.map(|g| -g),
        }
    }
}

#[allow(
    clippy::suspicious_arithmetic_impl,
    reason = "the rules of differentiation mix operations"
)]
impl<S: Real, const N: usize> Mul for Dual<S, N> {
    type Output = Self;
    /// (ab)' = a'b + ab'.
    #[inline]
    fn mul(self, b: Self) -> Self {
        self.zip(b, self.value * b.value, |x, y| x * b.value + self.value * y)
    }
}

#[allow(
    clippy::suspicious_arithmetic_impl,
    reason = "the rules of differentiation mix operations"
)]
impl<S: Real, const N: usize> Div for Dual<S, N> {
    type Output = Self;
    /// (a/b)' = (a' − (a/b) b')/b. Over intervals tighter than (a'b − ab')/b², which has b twice more.
    #[inline]
    fn div(self, b: Self) -> Self {
        let quotient = self.value / b.value;
        self.zip(b, quotient, |x, y| (x - quotient * y) / b.value)
    }
}

impl<S: Real, const N: usize> Add<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn add(self, b: f64) -> Self {
        Self {
            value: self.value + b,
            gradient: self.gradient,
        }
    }
}

impl<S: Real, const N: usize> Sub<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn sub(self, b: f64) -> Self {
        Self {
            value: self.value - b,
            gradient: self.gradient,
        }
    }
}

impl<S: Real, const N: usize> Mul<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn mul(self, b: f64) -> Self {
        Self {
            value: self.value * b,
            gradient: self.gradient.map(|g| g * b),
        }
    }
}

impl<S: Real, const N: usize> Div<f64> for Dual<S, N> {
    type Output = Self;
    #[inline]
    fn div(self, b: f64) -> Self {
        Self {
            value: self.value / b,
            gradient: self.gradient.map(|g| g / b),
        }
    }
}

impl<S: Real, const N: usize> Real for Dual<S, N> {
    #[inline]
    fn constant(x: f64) -> Self {
        Self::fixed(S::constant(x))
    }

    #[inline]
    fn sqr(self) -> Self {
        self.chain(self.value.sqr(), self.value * 2.0)
    }

    /// (1/x)' = −(1/x)².
    #[inline]
    fn recip(self) -> Self {
        let value = self.value.recip();
        self.chain(value, -value.sqr())
    }

    /// (√x)' = 1/(2√x).
    #[inline]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.chain(value, (value * 2.0).recip())
    }

    #[inline]
    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }

    #[inline]
    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }

    /// (tan x)' = 1 + tan² x.
    #[inline]
    fn tan(self) -> Self {
        let value = self.value.tan();
        self.chain(value, value.sqr() + 1.0)
    }

    /// (arctan x)' = 1/(1 + x²).
    #[inline]
    fn atan(self) -> Self {
        self.chain(self.value.atan(), (self.value.sqr() + 1.0).recip())
    }

    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }

    /// (eˣ − 1)' = eˣ.
    fn exp_m1(self) -> Self {
        self.chain(self.value.exp_m1(), self.value.exp())
    }

    /// (ln x)' = 1/x.
    fn ln(self) -> Self {
        self.chain(self.value.ln(), self.value.recip())
    }

    /// (log₁₀ x)' = 1/(x ln 10).
    fn log10(self) -> Self {
        let ln_10 = S::constant(10.0).ln();
        self.chain(self.value.log10(), (self.value * ln_10).recip())
    }

    /// (ln(1 + x))' = 1/(1 + x).
    fn ln_1p(self) -> Self {
        self.chain(self.value.ln_1p(), (self.value + 1.0).recip())
    }

    /// (xⁿ)' = n xⁿ⁻¹.
    fn powi(self, n: i32) -> Self {
        match n.checked_sub(1) {
            Some(-1) => Self::constant(1.0),
            Some(less) => self.chain(self.value.powi(n), self.value.powi(less) * f64::from(n)),
            // n = −2³¹: (1/x)^2³¹.
            None => self.sqr().recip().powi(1 << 30),
        }
    }

    /// (x^p)' = p x^(p−1).
    fn powf(self, p: f64) -> Self {
        self.chain(self.value.powf(p), self.value.powf(p - 1.0) * p)
    }

    /// (x^y)' = y x^(y−1) x' + x^y ln x · y'.
    fn pow(self, y: Self) -> Self {
        let value = self.value.pow(y.value);
        let of_base = y.value * self.value.pow(y.value - 1.0);
        let of_exponent = value * self.value.ln();
        self.zip(y, value, |dx, dy| of_base * dx + of_exponent * dy)
    }

    /// (arcsin x)' = 1/√(1 − x²).
    fn asin(self) -> Self {
        let slope = (-self.value.sqr() + 1.0).sqrt().recip();
        self.chain(self.value.asin(), slope)
    }

    /// (arccos x)' = −1/√(1 − x²).
    fn acos(self) -> Self {
        let slope = (-self.value.sqr() + 1.0).sqrt().recip();
        self.chain(self.value.acos(), -slope)
    }

    /// Of the angle of (x, y): (x y' − y x')/(x² + y²), and none across the jump.
    fn atan2(self, x: Self) -> Self {
        let cut = self.value.cut(x.value);
        let square = x.value.sqr() + self.value.sqr();
        let of_y = x.value / square + cut;
        let of_x = -(self.value / square) + cut;
        self.zip(x, self.value.atan2(x.value), |dy, dx| of_y * dy + of_x * dx)
    }

    fn sinh(self) -> Self {
        self.chain(self.value.sinh(), self.value.cosh())
    }

    fn cosh(self) -> Self {
        self.chain(self.value.cosh(), self.value.sinh())
    }

    /// (tanh x)' = 1 − tanh² x.
    fn tanh(self) -> Self {
        let value = self.value.tanh();
        self.chain(value, -value.sqr() + 1.0)
    }

    /// (arsinh x)' = 1/√(1 + x²).
    fn asinh(self) -> Self {
        self.chain(self.value.asinh(), (self.value.sqr() + 1.0).sqrt().recip())
    }

    /// (√(x² + y²))' = (x x' + y y')/√(x² + y²).
    fn hypot(self, y: Self) -> Self {
        let value = self.value.hypot(y.value);
        let (of_x, of_y) = (self.value / value, y.value / value);
        self.zip(y, value, |dx, dy| of_x * dx + of_y * dy)
    }

    fn abs(self) -> Self {
        self.chain(self.value.abs(), self.value.sign())
    }

    fn min(self, b: Self) -> Self {
        let first = self.value.is_less(b.value);
        let value = self.value.min(b.value);
        self.zip(b, value, |x, y| first.select(x, y))
    }

    fn max(self, b: Self) -> Self {
        let first = b.value.is_less(self.value);
        let value = self.value.max(b.value);
        self.zip(b, value, |x, y| first.select(x, y))
    }

    fn sign(self) -> Self {
        self.chain(self.value.sign(), self.value.impulse())
    }

    fn impulse(self) -> Self {
        let value = self.value.impulse();
        self.chain(value, value)
    }

    fn is_less(self, b: Self) -> Self {
        let slope = (b.value - self.value).impulse();
        self.zip(b, self.value.is_less(b.value), |x, y| slope * (y - x))
    }

    /// Where it is not certain which of both it is, the derivative of `self` says so: it is not defined there.
    fn select(self, a: Self, b: Self) -> Self {
        Self {
            value: self.value.select(a.value, b.value),
            gradient: std::array::from_fn(|i| {
                self.value.select(a.gradient[i], b.gradient[i]) + self.gradient[i]
            }),
        }
    }

    fn cut(self, x: Self) -> Self {
        let value = self.value.cut(x.value);
        self.zip(x, value, |dy, dx| value * dy + value * dx)
    }
}

/// A map ℝⁿ → ℝᵐ that can be evaluated on every number.
///
/// A closure cannot be generic over the number it is called with, hence the trait.
pub trait Function {
    /// n.
    fn inputs(&self) -> usize;
    /// m.
    fn outputs(&self) -> usize;
    /// y = f(x); `x` has n, `y` m components, and every component of `y` is written.
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]);
}

/// f(x) and the m × n matrix of first derivatives.
#[derive(Clone, PartialEq, Debug)]
pub struct Jacobian<S: 'static> {
    /// f(x), m components.
    pub value: List<S>,
    inputs: usize,
    first: List<S>,
}

impl<S: Copy + 'static> Jacobian<S> {
    /// n.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// m.
    pub fn outputs(&self) -> usize {
        self.value.len()
    }

    /// ∂f_q/∂x_i.
    pub fn get(&self, q: usize, i: usize) -> S {
        self.first[q * self.inputs + i]
    }

    /// The gradient of f_q, n components.
    pub fn row(&self, q: usize) -> &[S] {
        &self.first[q * self.inputs..(q + 1) * self.inputs]
    }

    /// All first derivatives, row after row.
    pub fn as_slice(&self) -> &[S] {
        &self.first
    }
}

/// f(x), its Jacobian and, for every output, the symmetric n × n matrix of second derivatives.
#[derive(Clone, PartialEq, Debug)]
pub struct Hessian<S: 'static> {
    /// f(x) and the first derivatives.
    pub jacobian: Jacobian<S>,
    second: List<S>,
}

impl<S: Copy + 'static> Hessian<S> {
    /// ∂²f_q/∂x_i∂x_j, the same for (i, j) and (j, i).
    pub fn get(&self, q: usize, i: usize, j: usize) -> S {
        let n = self.jacobian.inputs;
        self.second[(q * n + i) * n + j]
    }

    /// The second derivatives of f_q, row after row, n² numbers.
    pub fn output(&self, q: usize) -> &[S] {
        let n2 = self.jacobian.inputs * self.jacobian.inputs;
        &self.second[q * n2..(q + 1) * n2]
    }
}

/// The Jacobian of `f` at `x`, in groups of at most four directions.
///
/// # Panics
///
/// If `x` has not `f.inputs()` components.
pub fn jacobian<S: Real, F: Function>(f: &F, x: &[S]) -> Jacobian<S> {
    partial_jacobian(f, x, 0..f.inputs())
}

/// The columns `inputs` of the [`jacobian`]: the derivatives with respect to these inputs alone, as many as
/// there are numbers in the range.
///
/// # Panics
///
/// If `x` has not `f.inputs()` components or the range exceeds them.
pub fn partial_jacobian<S: Real, F: Function>(f: &F, x: &[S], inputs: Range<usize>) -> Jacobian<S> {
    match inputs.len() {
        1 => jacobian_in_groups::<S, F, 1>(f, x, inputs),
        2 => jacobian_in_groups::<S, F, 2>(f, x, inputs),
        3 => jacobian_in_groups::<S, F, 3>(f, x, inputs),
        _ => jacobian_in_groups::<S, F, 4>(f, x, inputs),
    }
}

fn jacobian_in_groups<S: Real, F: Function, const N: usize>(
    f: &F,
    x: &[S],
    inputs: Range<usize>,
) -> Jacobian<S> {
    let m = f.outputs();
    let (offset, n) = (inputs.start, inputs.len());
    assert_eq!(
        x.len(),
        f.inputs(),
        "Jacobian: the point has as many components as the function has inputs"
    );
    assert!(
        inputs.end <= x.len(),
        "Jacobian: the columns are among the inputs"
    );
    let zero = S::constant(0.0);
    let (mut value, mut first) = (List::filled(zero, m), List::filled(zero, m * n));
    let mut seeds: List<Dual<S, N>> = x.iter().map(|&v| Dual::fixed(v)).collect();
    let mut y = List::filled(Dual::fixed(zero), m);
    if n == 0 {
        f.evaluate(x, &mut value);
    }
    for start in (0..n).step_by(N) {
        let group = start..(start + N).min(n);
        for i in group.clone() {
            seeds[offset + i] = Dual::variable(x[offset + i], i - start);
        }
        f.evaluate(&seeds, &mut y);
        for (q, y) in y.iter().enumerate() {
            value[q] = y.value;
            for i in group.clone() {
                first[q * n + i] = y.gradient[i - start];
            }
        }
        for i in group {
            seeds[offset + i] = Dual::fixed(x[offset + i]);
        }
    }
    Jacobian {
        value,
        inputs: n,
        first,
    }
}

/// The second derivatives of `f` at `x`, with value and Jacobian, by duals over duals.
///
/// Directions go in groups of at most four, and of two different groups only one order is evaluated:
/// the matrices are exactly symmetric.
///
/// # Panics
///
/// If `x` has not `f.inputs()` components.
pub fn hessian<S: Real, F: Function>(f: &F, x: &[S]) -> Hessian<S> {
    match f.inputs() {
        1 => hessian_in_groups::<S, F, 1>(f, x),
        2 => hessian_in_groups::<S, F, 2>(f, x),
        3 => hessian_in_groups::<S, F, 3>(f, x),
        _ => hessian_in_groups::<S, F, 4>(f, x),
    }
}

fn hessian_in_groups<S: Real, F: Function, const N: usize>(f: &F, x: &[S]) -> Hessian<S> {
    let (n, m) = (f.inputs(), f.outputs());
    assert_eq!(
        x.len(),
        n,
        "Hessian: the point has as many components as the function has inputs"
    );
    let zero = S::constant(0.0);
    let (mut value, mut first, mut second) = (
        List::filled(zero, m),
        List::filled(zero, m * n),
        List::filled(zero, m * n * n),
    );
    let mut seeds: List<Dual<Dual<S, N>, N>> = List::filled(Dual::fixed(Dual::fixed(zero)), n);
    let mut y = List::filled(Dual::fixed(Dual::fixed(zero)), m);
    if n == 0 {
        f.evaluate(x, &mut value);
    }
    for outer in (0..n).step_by(N) {
        for inner in (outer..n).step_by(N) {
            for (i, seed) in seeds.iter_mut().enumerate() {
                let mut v = Dual::fixed(x[i]);
                if (inner..inner + N).contains(&i) {
                    v.gradient[i - inner] = S::constant(1.0);
                }
                *seed = Dual::fixed(v);
                if (outer..outer + N).contains(&i) {
                    seed.gradient[i - outer] = Dual::constant(1.0);
                }
            }
            f.evaluate(&seeds, &mut y);
            for (q, y) in y.iter().enumerate() {
                value[q] = y.value.value;
                for j in inner..(inner + N).min(n) {
                    first[q * n + j] = y.value.gradient[j - inner];
                    for i in outer..(outer + N).min(n).min(j + 1) {
                        let entry = y.gradient[i - outer].gradient[j - inner];
                        second[(q * n + i) * n + j] = entry;
                        second[(q * n + j) * n + i] = entry;
                    }
                }
            }
        }
    }
    Hessian {
        jacobian: Jacobian {
            value,
            inputs: n,
            first,
        },
        second,
    }
}
