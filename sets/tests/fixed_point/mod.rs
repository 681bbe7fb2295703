//! Exact arithmetic to judge rounded arithmetic by, and numbers that are hard to round.
//!
//! A finite f64 is an integer multiple of 2⁻¹⁰⁷⁴, so sums and products of f64 are exact integers at
//! a known scale; sin, cos and arctan are evaluated by series at 2⁻¹²⁰⁰.

#![allow(dead_code, reason = "each test binary uses its own part")]

use num_bigint::{BigInt, Sign};
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use zonobench_sets::Interval;

/// The scale of sums: integers count multiples of 2^−1074.
pub const SUM: usize = 1074;
/// The scale of products of two f64.
pub const PRODUCT: usize = 2 * SUM;
/// The scale of the series.
pub const SERIES: usize = 1200;
/// No series below is off by more than this many multiples of 2^−1200: fewer than 2¹¹ terms, each
/// cut by at most a few units, times an argument below 2²².
pub const SERIES_ERROR: u64 = 1 << 40;

/// x · 2^scale, an integer for every finite x.
pub fn fixed(x: f64, scale: usize) -> BigInt {
    assert!(x.is_finite() && scale >= SUM, "{x} is finite");
    let bits = x.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as usize;
    let fraction = bits & ((1 << 52) - 1);
    let (significand, shift) = if exponent == 0 {
        (fraction, 0)
    } else {
        (fraction | 1 << 52, exponent - 1)
    };
    let magnitude = BigInt::from(significand) << (shift + scale - SUM);
    if x < 0.0 { -magnitude } else { magnitude }
}

/// x as a rational number.
pub fn rational(x: f64) -> BigRational {
    BigRational::from_float(x).expect("the number is finite")
}

/// True if bound ≤ exact · 2^−scale; −∞ is below everything.
pub fn is_below(bound: f64, exact: &BigInt, scale: usize) -> bool {
    bound == f64::NEG_INFINITY || (bound.is_finite() && fixed(bound, scale) <= *exact)
}

/// True if exact · 2^−scale ≤ bound; ∞ is above everything.
pub fn is_above(bound: f64, exact: &BigInt, scale: usize) -> bool {
    bound == f64::INFINITY || (bound.is_finite() && fixed(bound, scale) >= *exact)
}

/// True if the interval contains exact · 2^−scale.
pub fn encloses(x: Interval, exact: &BigInt, scale: usize) -> bool {
    is_below(x.lo(), exact, scale) && is_above(x.hi(), exact, scale)
}

/// arctan(1/k) at 2^−1200.
fn arctan_of_inverse(k: u64) -> BigInt {
    let mut power = (BigInt::one() << SERIES) / k;
    let mut sum = BigInt::zero();
    let mut n = 1u64;
    while !power.is_zero() {
        let term = &power / n;
        sum = if n % 4 == 1 { sum + term } else { sum - term };
        power /= k * k;
        n += 2;
    }
    sum
}

/// π/2 at 2^−1200, by Machin's formula π/4 = 4 arctan(1/5) − arctan(1/239).
pub fn half_pi() -> BigInt {
    2 * (4 * arctan_of_inverse(5) - arctan_of_inverse(239))
}

fn times(a: &BigInt, b: &BigInt) -> BigInt {
    (a * b) >> SERIES
}

/// Σ ± rⁿ/n! over n = start, start + 2, …
fn alternating(r: &BigInt, start: u64) -> BigInt {
    let square = times(r, r);
    let mut term = if start == 0 {
        BigInt::one() << SERIES
    } else {
        r.clone()
    };
    let (mut sum, mut n) = (term.clone(), start);
    while !term.is_zero() && term != -BigInt::one() {
        term = -times(&term, &square) / ((n + 1) * (n + 2));
        sum += &term;
        n += 2;
    }
    sum
}

/// sin x and cos x at 2^−1200, for |x| < 2²².
pub fn sin_cos(x: f64, half_pi: &BigInt) -> (BigInt, BigInt) {
    let x = fixed(x, SERIES);
    // The nearest multiple of π/2: the remainder is at most π/4.
    let doubled: BigInt = 2 * &x + half_pi;
    let turns = floor_div(&doubled, &(2 * half_pi));
    let r = x - &turns * half_pi;
    let (s, c) = (alternating(&r, 1), alternating(&r, 0));
    match quarter(&turns) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// ⌊a/b⌋ for b > 0.
pub fn floor_div(a: &BigInt, b: &BigInt) -> BigInt {
    let quotient = a / b;
    if (a % b).sign() == Sign::Minus {
        quotient - 1
    } else {
        quotient
    }
}

/// n modulo 4.
pub fn quarter(n: &BigInt) -> usize {
    let four = BigInt::from(4);
    usize::try_from(n - floor_div(n, &four) * &four).expect("a remainder of 4 is small")
}

/// arctan x at 2^−1200: arctan x = 2 arctan(x/(1 + √(1 + x²))) eight times, then the series.
pub fn arctan(x: f64, half_pi: &BigInt) -> BigInt {
    let one = BigInt::one() << SERIES;
    let x = fixed(x, SERIES);
    let magnitude = x.abs();
    let inverted = magnitude > one;
    let mut t = if inverted {
        (&one << SERIES) / &magnitude
    } else {
        magnitude
    };
    for _ in 0..8 {
        let root = ((&one + times(&t, &t)) << SERIES).sqrt();
        t = (&t << SERIES) / (&one + root);
    }
    let square = times(&t, &t);
    let (mut power, mut sum, mut n) = (t, BigInt::zero(), 1);
    while !power.is_zero() {
        sum = if n % 4 == 1 {
            sum + &power / n
        } else {
            sum - &power / n
        };
        power = times(&power, &square);
        n += 2;
    }
    sum <<= 8;
    let value = if inverted { half_pi - sum } else { sum };
    if x.is_negative() { -value } else { value }
}

/// |y − exact| in units of the last place of exact (an f64 near it), for an exact value at 2^−1200.
pub fn error_in_ulps(y: f64, exact: &BigInt) -> f64 {
    let last_place = exact.abs().bits() as usize - 53;
    let error = (fixed(y, SERIES) - exact).abs();
    // Ten more bits than the unit: enough to tell 0.999 from 1.
    let scaled: BigInt = (error << 10) >> last_place;
    i64::try_from(scaled).map_or(f64::INFINITY, |e| e as f64 / 1024.0)
}

/// A deterministic source of numbers (SplitMix64).
pub struct Source(pub u64);

impl Source {
    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// An integer below `n`.
    pub fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    /// A number in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number in [−1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.uniform() - 1.0
    }

    /// ±m·2^e with |e| ≤ `exponent`.
    pub fn scaled(&mut self, exponent: i32) -> f64 {
        let e = self.below(2 * exponent as u64 + 1) as i32 - exponent;
        self.signed() * 2f64.powi(e)
    }

    /// A finite f64 of a kind that rounding rules tend to forget.
    pub fn adversarial(&mut self) -> f64 {
        let sign = if self.below(2) == 0 { 1.0 } else { -1.0 };
        let magnitude: f64 = match self.below(12) {
            0 => 0.0,
            1 => f64::from_bits(self.below(1 << 52)),
            2 => f64::from_bits(self.below(4)),
            3 => f64::from_bits(f64::MIN_POSITIVE.to_bits() - 4 + self.below(8)),
            4 => f64::from_bits(f64::MAX.to_bits() - self.below(8)),
            5 => self.below(16) as f64,
            6 => {
                f64::from_bits(2f64.powi(self.below(60) as i32 - 30).to_bits() - 2 + self.below(4))
            }
            7 => self.scaled(996).abs(),
            8 => self.scaled(512).abs(),
            9 => 1e-162 * (1.0 + self.uniform()),
            _ => self.scaled(30).abs(),
        };
        sign * magnitude
    }

    /// Bounds of an interval: a point, a few steps wide, or any two numbers.
    pub fn interval(&mut self) -> Interval {
        let a = self.adversarial();
        let b = match self.below(4) {
            0 => a,
            1 => (0..self.below(4))
                .fold(a, |x, _| x.next_up())
                .clamp(f64::MIN, f64::MAX),
            _ => self.adversarial(),
        };
        Interval::new(a.min(b), a.max(b)).expect("the bounds are ordered")
    }

    /// A partner of `a`: often one that nearly cancels it.
    pub fn partner(&mut self, a: Interval) -> Interval {
        match self.below(4) {
            0 => {
                let step =
                    |x: f64, n: u64| (0..n).fold(x, |x, _| x.next_up()).clamp(f64::MIN, f64::MAX);
                let (lo, n) = (-a.hi(), self.below(3));
                Interval::new(lo, step(-a.lo(), n).max(lo)).expect("the bounds are ordered")
            }
            1 => {
                let scale = self.scaled(3);
                let (x, y) = (
                    (a.lo() * scale).clamp(f64::MIN, f64::MAX),
                    (a.hi() * scale).clamp(f64::MIN, f64::MAX),
                );
                Interval::new(x.min(y), x.max(y)).expect("the bounds are ordered")
            }
            _ => self.interval(),
        }
    }

    /// A number of the interval, often a bound.
    pub fn within(&mut self, x: Interval) -> f64 {
        match self.below(4) {
            0 => x.lo(),
            1 => x.hi(),
            _ => {
                let t = self.uniform();
                ((1.0 - t) * x.lo() + t * x.hi()).clamp(x.lo(), x.hi())
            }
        }
    }
}
