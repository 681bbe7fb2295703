//! Elementary functions over intervals: exp, ln and their kin, powers, arcus and hyperbolic functions, the angle of a
//! point, length, absolute value, smaller and larger.
//!
//! Each is `libm`'s at the ends of the argument, where the function is monotone between them, moved outward by as many
//! steps as the margin below says. libm claims less than one unit in the last place for `exp ln log10 exp_m1 ln_1p asin
//! acos atan2 hypot pow`: two steps. It claims nothing for `sinh cosh tanh asinh`, which it puts together of these with a few
//! roundings more: four steps. Both are premises that tests sample over the whole range against values of 300 bits, not
//! theorems. `powi`, `abs`, `min` and `max` use no libm: they are theorems of IEEE 754.
//!
//! Outside of its domain a function is the whole line, as everywhere in [`Interval`].

use super::Real;
use super::interval::{HALF_PI, Interval, larger, smaller};

/// Steps for functions that libm gives with less than one unit in the last place.
const MARGIN: u32 = 2;

/// Steps for functions that it puts together of others.
const WIDE_MARGIN: u32 = 4;

/// `steps` below `y`, but at least `least`.
fn down(y: f64, steps: u32, least: f64) -> f64 {
    larger((0..steps).fold(y, |y, _| y.next_down()), least)
}

/// `steps` above `y`, but at most `most`.
fn up(y: f64, steps: u32, most: f64) -> f64 {
    smaller((0..steps).fold(y, |y, _| y.next_up()), most)
}

/// A nondecreasing `f` over `x`, whose values lie in `range`; `exact` is an argument at which the value is an f64 that
/// libm gives exactly, as ln 1 = 0.
fn increasing(
    x: Interval,
    f: fn(f64) -> f64,
    steps: u32,
    range: (f64, f64),
    exact: f64,
) -> Interval {
    let lo = if x.lo() == exact {
        f(exact)
    } else {
        down(f(x.lo()), steps, range.0)
    };
    let hi = if x.hi() == exact {
        f(exact)
    } else {
        up(f(x.hi()), steps, range.1)
    };
    Interval::trusted(lo, hi)
}

const LINE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

pub(super) fn exp(x: Interval) -> Interval {
    increasing(x, libm::exp, MARGIN, (0.0, f64::INFINITY), 0.0)
}

pub(super) fn exp_m1(x: Interval) -> Interval {
    increasing(x, libm::expm1, MARGIN, (-1.0, f64::INFINITY), 0.0)
}

pub(super) fn ln(x: Interval) -> Interval {
    if x.lo() > 0.0 {
        increasing(x, libm::log, MARGIN, LINE, 1.0)
    } else {
        Interval::ENTIRE
    }
}

pub(super) fn log10(x: Interval) -> Interval {
    if x.lo() > 0.0 {
        increasing(x, libm::log10, MARGIN, LINE, 1.0)
    } else {
        Interval::ENTIRE
    }
}

pub(super) fn ln_1p(x: Interval) -> Interval {
    if x.lo() > -1.0 {
        increasing(x, libm::log1p, MARGIN, LINE, 0.0)
    } else {
        Interval::ENTIRE
    }
}

pub(super) fn asin(x: Interval) -> Interval {
    if x.is_subset(Interval::UNIT) {
        increasing(x, libm::asin, MARGIN, (-HALF_PI.hi(), HALF_PI.hi()), 0.0)
    } else {
        Interval::ENTIRE
    }
}

/// arccos decreases: arccos x = −(−arccos x).
pub(super) fn acos(x: Interval) -> Interval {
    if x.is_subset(Interval::UNIT) {
        let falling = |x: f64| -libm::acos(x);
        -increasing(x, falling, MARGIN, (-2.0 * HALF_PI.hi(), 0.0), 1.0)
    } else {
        Interval::ENTIRE
    }
}

pub(super) fn sinh(x: Interval) -> Interval {
    increasing(x, libm::sinh, WIDE_MARGIN, LINE, 0.0)
}

/// cosh x = cosh |x| increases in |x|.
pub(super) fn cosh(x: Interval) -> Interval {
    increasing(x.abs(), libm::cosh, WIDE_MARGIN, (1.0, f64::INFINITY), 0.0)
}

pub(super) fn tanh(x: Interval) -> Interval {
    increasing(x, libm::tanh, WIDE_MARGIN, (-1.0, 1.0), 0.0)
}

pub(super) fn asinh(x: Interval) -> Interval {
    increasing(x, libm::asinh, WIDE_MARGIN, LINE, 0.0)
}

/// √(x² + y²), which increases in |x| and in |y|; exact where one of them is 0.
pub(super) fn hypot(x: Interval, y: Interval) -> Interval {
    let (x, y) = (x.abs(), y.abs());
    let bound = |x: f64, y: f64, moved: fn(f64, u32, f64) -> f64, end: f64| {
        if x == 0.0 || y == 0.0 {
            larger(x, y)
        } else {
            moved(libm::hypot(x, y), MARGIN, end)
        }
    };
    Interval::trusted(
        bound(x.lo(), y.lo(), down, larger(x.lo(), y.lo())),
        bound(x.hi(), y.hi(), up, f64::INFINITY),
    )
}

/// True where the half line {(x, 0) : x ≤ 0}, across which the angle jumps by 2π, meets the box.
fn meets_the_cut(y: Interval, x: Interval) -> bool {
    x.lo() <= 0.0 && y.contains(0.0)
}

/// The angle of (x, y) in (−π, π]; [−π, π] where the box meets the cut.
///
/// Elsewhere the box lies in the plane without the cut, in which the angle is continuous, and a rectangle that leaves the
/// origin out is seen from it between two of its corners.
pub(super) fn atan2(y: Interval, x: Interval) -> Interval {
    let pi = 2.0 * HALF_PI.hi();
    if meets_the_cut(y, x) || !(x.is_finite() && y.is_finite()) {
        return Interval::trusted(-pi, pi);
    }
    let corners = [
        (y.lo(), x.lo()),
        (y.lo(), x.hi()),
        (y.hi(), x.lo()),
        (y.hi(), x.hi()),
    ];
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for (y, x) in corners {
        let angle = libm::atan2(y, x);
        // On the positive axis it is 0 exactly.
        let exact = y == 0.0;
        lo = smaller(
            lo,
            if exact {
                angle
            } else {
                down(angle, MARGIN, -pi)
            },
        );
        hi = larger(hi, if exact { angle } else { up(angle, MARGIN, pi) });
    }
    Interval::trusted(lo, hi)
}

/// 0 where the angle is smooth over the box, the whole line where the box meets the cut.
pub(super) fn cut(y: Interval, x: Interval) -> Interval {
    if meets_the_cut(y, x) {
        Interval::ENTIRE
    } else {
        Interval::ZERO
    }
}

/// xⁿ by repeated squaring with outward rounding, at the ends: even powers have their least value where |x| has.
pub(super) fn powi(x: Interval, n: i32) -> Interval {
    match n {
        0 => Interval::ONE,
        1 => x,
        2 => x.sqr(),
        n if n < 0 => {
            let power = positive_power(x, n.unsigned_abs());
            Interval::ONE / power
        }
        n => positive_power(x, n.unsigned_abs()),
    }
}

fn positive_power(x: Interval, n: u32) -> Interval {
    let of_point = |end: f64| power_of(Interval::trusted(end, end), n);
    let (from, to) = if n.is_multiple_of(2) {
        (x.mig(), x.mag())
    } else {
        (x.lo(), x.hi())
    };
    let (lo, hi) = (of_point(from), of_point(to));
    Interval::trusted(lo.lo(), hi.hi())
}

/// xⁿ for n ≥ 1, by the bits of n from the least.
fn power_of<S: Real>(x: S, n: u32) -> S {
    let (mut square, mut left) = (x, n);
    let mut power: Option<S> = None;
    loop {
        if left % 2 == 1 {
            power = Some(power.map_or(square, |p| p * square));
        }
        left /= 2;
        match power {
            Some(power) if left == 0 => return power,
            _ => square = square.sqr(),
        }
    }
}

/// xⁿ of an f64 with the same products as over an interval: not std's, which may differ by system.
pub(super) fn powi_f64(x: f64, n: i32) -> f64 {
    match n {
        0 => 1.0,
        n if n < 0 => 1.0 / power_of(x, n.unsigned_abs()),
        n => power_of(x, n.unsigned_abs()),
    }
}

/// x^y for x > 0, or x ≥ 0 where y > 0. It is monotone in x for each y and in y for each x, so its extrema over a box are at
/// corners.
pub(super) fn pow(x: Interval, y: Interval) -> Interval {
    let defined = x.lo() > 0.0 || (x.lo() == 0.0 && y.lo() > 0.0);
    if !(defined && x.is_finite() && y.is_finite()) {
        return Interval::ENTIRE;
    }
    let (mut lo, mut hi) = (f64::INFINITY, 0.0);
    for x in [x.lo(), x.hi()] {
        for y in [y.lo(), y.hi()] {
            let power = libm::pow(x, y);
            let exact = x == 0.0 || x == 1.0 || y == 0.0 || y == 1.0;
            lo = smaller(
                lo,
                if exact {
                    power
                } else {
                    down(power, MARGIN, 0.0)
                },
            );
            hi = larger(
                hi,
                if exact {
                    power
                } else {
                    up(power, MARGIN, f64::INFINITY)
                },
            );
        }
    }
    Interval::trusted(lo, hi)
}

/// −1 left of 0, 1 right of it, [−1, 1] over it: the slope of |x|.
pub(super) fn sign(x: Interval) -> Interval {
    if x.lo() > 0.0 {
        Interval::ONE
    } else if x.hi() < 0.0 {
        -Interval::ONE
    } else {
        Interval::UNIT
    }
}

/// The slope of the sign: 0, and the whole line over 0, where it has none.
pub(super) fn impulse(x: Interval) -> Interval {
    if x.contains(0.0) {
        Interval::ENTIRE
    } else {
        Interval::ZERO
    }
}

/// 1 where a < b, 0 where a > b, [0, 1] where neither is certain.
pub(super) fn is_less(a: Interval, b: Interval) -> Interval {
    if a.hi() < b.lo() {
        Interval::ONE
    } else if a.lo() > b.hi() {
        Interval::ZERO
    } else {
        Interval::trusted(0.0, 1.0)
    }
}

/// `a` where `first` is 1, `b` where it is 0, and what contains both otherwise.
pub(super) fn select(first: Interval, a: Interval, b: Interval) -> Interval {
    if first == Interval::ONE {
        a
    } else if first == Interval::ZERO {
        b
    } else {
        a.hull(&b)
    }
}
