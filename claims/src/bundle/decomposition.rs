//! Proposition 4 and Corollary 1: remainder-form decomposition functions.

use super::claim;
use crate::exact::{M, Q, Source, V, add, dot, frac, q, scale, sub};
use crate::{Claim, Class, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "proposition-4",
            "(6)-(8) is a mixed-monotone decomposition function (Definition 2)",
            "",
            |t| mixed_monotone(t, false),
        )
        .twin("the corners of (8) exchanged", |t| mixed_monotone(t, true)),
        claim(
            "proposition-4-tight",
            "(ours) the decomposition functions of (6)-(8) are tight bounds of f itself",
            "tight for g = f - m x, as Corollary 1 says; for f a bound only",
            |t| tight(t, false),
        )
        .class(Class::Remark)
        .twin("m halved, so that g is not monotone", |t| tight(t, true)),
        claim(
            "proposition-4-linear",
            "the search for the tightest function of the form (7) can be restricted to linear remainders",
            "",
            |t| linear_remainders(t, false),
        )
        .twin("remainders whose slope stays short of m", |t| {
            linear_remainders(t, true);
        }),
        claim(
            "corollary-1-sign",
            "g = f - H x is Jacobian sign-stable for every H of (9)",
            "",
            |t| sign_stable(t, false),
        )
        .twin("m halved", |t| sign_stable(t, true)),
        claim(
            "corollary-1",
            "in the text at hand: f(z+) + m (z- - z+) and f(z-) + m (z+ - z-) bound g = f - H x, z+ = zeta(lower, upper)",
            "lower and upper are exchanged, as bars are elsewhere in this text ((20), (30), I Xi, I B); with them restored the \
             bound holds on [-1, 1]^n, where the lemmas use it, and is that of f there, so loose for g; f(z) - m z is tight on \
             every box",
            |t| printed_bounds(t, false),
        )
        .class(Class::Damage)
        .twin("m halved in the restored bounds", |t| printed_bounds(t, true)),
    ]
}

/// f(x) = xᵀ Q x + l·x on the box between `low` and `high`.
pub struct Scalar {
    pub q: M,
    pub l: V,
}

impl Scalar {
    pub fn drawn(draw: &mut Source, n: usize) -> Self {
        Self {
            q: draw.matrix(n, n, 2),
            l: draw.vector(n, 3),
        }
    }

    pub fn at(&self, x: &[Q]) -> Q {
        dot(x, &self.q.apply(x)) + dot(&self.l, x)
    }

    /// The exact bounds of the gradient over a box.
    pub fn gradient(&self, low: &[Q], high: &[Q]) -> (V, V) {
        let s = self.q.add(&self.q.t());
        let end = |j: usize, upper: bool| {
            (0..low.len()).fold(self.l[j].clone(), |sum, k| {
                let take_high = s[(j, k)].is_negative() != upper;
                sum + &s[(j, k)] * if take_high { &high[k] } else { &low[k] }
            })
        };
        (
            (0..low.len()).map(|j| end(j, false)).collect(),
            (0..low.len()).map(|j| end(j, true)).collect(),
        )
    }

    /// The composition with x = c + G ξ, without its constant f(c).
    pub fn over(&self, c: &[Q], g: &M) -> Scalar {
        let slope = self.q.add(&self.q.t()).apply(c);
        Scalar {
            q: g.t().mul(&self.q).mul(g),
            l: g.t()
                .apply(&slope.iter().zip(&self.l).map(|(a, b)| a + b).collect::<V>()),
        }
    }
}

/// A vector of (6): for each coordinate min(J, 0) (true) or max(J, 0) (false).
pub fn supporting(jacobian: &(V, V), lower: &[bool]) -> V {
    (0..lower.len())
        .map(|j| {
            if lower[j] {
                jacobian.0[j].clone().min(Q::zero())
            } else {
                jacobian.1[j].clone().max(Q::zero())
            }
        })
        .collect()
}

/// (8): z where m is the lower choice, ẑ elsewhere.
fn zeta(lower: &[bool], z: &[Q], hat: &[Q]) -> V {
    (0..z.len())
        .map(|j| {
            if lower[j] {
                z[j].clone()
            } else {
                hat[j].clone()
            }
        })
        .collect()
}

/// (7) for the remainder h.
fn decomposed(f: &Scalar, h: impl Fn(&[Q]) -> Q, lower: &[bool], z: &[Q], hat: &[Q]) -> Q {
    let own = zeta(lower, z, hat);
    h(&zeta(lower, hat, z)) + f.at(&own) - h(&own)
}

/// The exact bounds of g = f − m·x: g rises in the lower choices and falls in the others.
pub fn remainder_bounds(f: &Scalar, m: &[Q], lower: &[bool], low: &[Q], high: &[Q]) -> (Q, Q) {
    let g = |x: &[Q]| f.at(x) - dot(m, x);
    (g(&zeta(lower, low, high)), g(&zeta(lower, high, low)))
}

/// Bounds of f over a box by every vector of (6): g bounded as above, m·x by its own range.
pub fn range_bounds(f: &Scalar, low: &[Q], high: &[Q]) -> (Q, Q) {
    let gradient = f.gradient(low, high);
    let of = |lower: &Vec<bool>| {
        let m = supporting(&gradient, lower);
        let (a, b) = remainder_bounds(f, &m, lower, low, high);
        let end = |up: bool| {
            (0..m.len()).fold(Q::zero(), |s, j| {
                s + &m[j]
                    * if m[j].is_negative() == up {
                        &low[j]
                    } else {
                        &high[j]
                    }
            })
        };
        (a + end(false), b + end(true))
    };
    let all: Vec<(Q, Q)> = choices(low.len()).iter().map(of).collect();
    let (lows, highs): (V, V) = all.into_iter().unzip();
    let least = highs.into_iter().min().unwrap_or_else(Q::zero);
    (lows.into_iter().max().unwrap_or_else(Q::zero), least)
}

/// Every choice of (6).
pub fn choices(n: usize) -> Vec<Vec<bool>> {
    (0..1_usize << n)
        .map(|bits| (0..n).map(|j| bits >> j & 1 == 1).collect())
        .collect()
}

struct Case {
    f: Scalar,
    low: V,
    high: V,
    lower: Vec<bool>,
    m: V,
}

fn case(draw: &mut Source, n: usize) -> Case {
    let f = Scalar::drawn(draw, n);
    let low = draw.vector(n, 2);
    let high: V = low.iter().map(|l| l + q(draw.int(1, 3))).collect();
    let lower: Vec<bool> = (0..n).map(|_| draw.int(0, 1) == 1).collect();
    let m = supporting(&f.gradient(&low, &high), &lower);
    Case {
        f,
        low,
        high,
        lower,
        m,
    }
}

impl Case {
    fn point(&self, draw: &mut Source) -> V {
        (0..self.low.len())
            .map(|j| {
                let part = frac(draw.int(0, 4), 4);
                &self.low[j] + part * (&self.high[j] - &self.low[j])
            })
            .collect()
    }
}

fn mixed_monotone(t: &mut Trial, damaged: bool) {
    for _ in 0..400 {
        let n = t.draw.size(1, 3);
        let c = case(&mut t.draw, n);
        let h = |x: &[Q]| dot(&c.m, x);
        let value = |z: &[Q], hat: &[Q]| {
            let (z, hat) = if damaged { (hat, z) } else { (z, hat) };
            decomposed(&c.f, h, &c.lower, z, hat)
        };
        let (x, y, z) = (
            c.point(&mut t.draw),
            c.point(&mut t.draw),
            c.point(&mut t.draw),
        );
        t.check(value(&x, &x) == c.f.at(&x));
        let above: V = x.iter().zip(&z).map(|(a, b)| a.max(b).clone()).collect();
        t.check(value(&above, &y) >= value(&x, &y));
        t.check(value(&y, &above) <= value(&y, &x));
        t.check(value(&c.low, &c.high) <= c.f.at(&x) && c.f.at(&x) <= value(&c.high, &c.low));
    }
}

/// The largest value of a quadratic on an interval.
fn largest(f: &Scalar, low: &Q, high: &Q) -> Q {
    let mut points = vec![low.clone(), high.clone()];
    let square = &f.q[(0, 0)];
    if !square.is_zero() {
        let top = -&f.l[0] / (square * q(2));
        if *low < top && top < *high {
            points.push(top);
        }
    }
    let values = points.into_iter().map(|x| f.at(&[x]));
    values.max().unwrap_or_else(Q::zero)
}

fn tight(t: &mut Trial, damaged: bool) {
    let parabola = Scalar {
        q: M::ints(&[&[-1]]),
        l: vec![q(1)],
    };
    // The tightest of the choices.
    let bound = |f: &Scalar, low: &[Q], high: &[Q]| {
        let jacobian = f.gradient(low, high);
        let all = choices(1).into_iter().map(|lower| {
            let m = supporting(&jacobian, &lower);
            decomposed(f, |x| dot(&m, x), &lower, high, low)
        });
        all.min().unwrap_or_else(Q::zero)
    };
    let (upper, truth) = (
        bound(&parabola, &[q(0)], &[q(1)]),
        largest(&parabola, &q(0), &q(1)),
    );
    t.equality(upper == truth, upper >= truth, || {
        format!("x (1 - x) on [0, 1]: the bound is {upper}, the largest value {truth}")
    });
    for _ in 0..300 {
        let c = case(&mut t.draw, 1);
        let upper = bound(&c.f, &c.low, &c.high);
        let truth = largest(&c.f, &c.low[0], &c.high[0]);
        t.equality(upper == truth, upper >= truth, String::new);
        // g is bounded tightly: its bounds are taken at corners.
        let m = if damaged { halved(&c.m) } else { c.m.clone() };
        let g = Scalar {
            q: c.f.q.clone(),
            l: sub(&c.f.l, &m),
        };
        let (_, top) = remainder_bounds(&c.f, &m, &c.lower, &c.low, &c.high);
        t.repaired(top == largest(&g, &c.low[0], &c.high[0]));
    }
}

/// Remainders whose slope goes beyond m, to the side of the choice: linear ones bound at least as well.
fn linear_remainders(t: &mut Trial, damaged: bool) {
    for _ in 0..300 {
        let n = t.draw.size(1, 2);
        let c = case(&mut t.draw, n);
        // h(x) = m·x ± Σ (a (x − low) + b (x − low)²), a, b ≥ 0: its slope is m or beyond.
        let a: V = (0..n).map(|_| q(t.draw.int(0, 3))).collect();
        let b: V = (0..n).map(|_| q(t.draw.int(0, 2))).collect();
        let h = |x: &[Q]| {
            (0..n).fold(dot(&c.m, x), |s, j| {
                let d = &x[j] - &c.low[j];
                let beyond = &a[j] * &d + &b[j] * &d * &d;
                if c.lower[j] != damaged {
                    s - beyond
                } else {
                    s + beyond
                }
            })
        };
        let linear = |z: &[Q], hat: &[Q]| decomposed(&c.f, |x| dot(&c.m, x), &c.lower, z, hat);
        let other = |z: &[Q], hat: &[Q]| decomposed(&c.f, h, &c.lower, z, hat);
        t.check(linear(&c.high, &c.low) <= other(&c.high, &c.low));
        t.check(linear(&c.low, &c.high) >= other(&c.low, &c.high));
    }
}

fn halved(m: &[Q]) -> V {
    scale(&frac(1, 2), m)
}

/// The gradient of g at the corners of the box has the sign of the choice in every component.
fn sign_stable(t: &mut Trial, damaged: bool) {
    for _ in 0..300 {
        let n = t.draw.size(1, 3);
        let c = case(&mut t.draw, n);
        let m = if damaged { halved(&c.m) } else { c.m.clone() };
        let double = c.f.q.add(&c.f.q.t());
        for corner in choices(n) {
            let x = zeta(&corner, &c.low, &c.high);
            let slope = sub(&add(&double.apply(&x), &c.f.l), &m);
            t.check((0..n).all(|j| {
                if c.lower[j] {
                    !slope[j].is_negative()
                } else {
                    !slope[j].is_positive()
                }
            }));
        }
    }
}

/// The bounds of the text, lower and upper, from ζ⁺ and ζ⁻.
fn of_the_text(f: &Scalar, m: &[Q], plus: &[Q], minus: &[Q]) -> (Q, Q) {
    let step = dot(m, &sub(minus, plus));
    (f.at(minus) - &step, f.at(plus) + step)
}

fn printed_bounds(t: &mut Trial, damaged: bool) {
    // f = x on [0, 1], the lower choice m = min(1, 0) = 0: g = x.
    let f = Scalar {
        q: M::zeros(1, 1),
        l: vec![q(1)],
    };
    let (m, low, high) = ([q(0)], [q(0)], [q(1)]);
    let (a, b) = of_the_text(
        &f,
        &m,
        &zeta(&[true], &low, &high),
        &zeta(&[true], &high, &low),
    );
    let g = f.at(&high);
    t.check_or(a <= g && g <= b, || {
        format!("f = x on [0, 1], m = min(1, 0) = 0: {a} <= g <= {b} in the text at hand, but g(1) = {g}")
    });
    for k in 0..400 {
        let n = t.draw.size(1, 3);
        let mut c = case(&mut t.draw, n);
        if k % 2 == 0 {
            // The boxes of the lemmas.
            (c.low, c.high) = (vec![q(-1); n], vec![q(1); n]);
            c.m = supporting(&c.f.gradient(&c.low, &c.high), &c.lower);
        }
        let (first, second) = (
            zeta(&c.lower, &c.low, &c.high),
            zeta(&c.lower, &c.high, &c.low),
        );
        let printed = of_the_text(&c.f, &c.m, &first, &second);
        let used = if damaged { halved(&c.m) } else { c.m.clone() };
        let restored = of_the_text(&c.f, &used, &second, &first);
        let corrected = remainder_bounds(&c.f, &used, &c.lower, &c.low, &c.high);
        // The corners of the box, and a point inside.
        let mut points: Vec<V> = choices(n)
            .iter()
            .map(|lower| zeta(lower, &c.low, &c.high))
            .collect();
        points.push(c.point(&mut t.draw));
        let bounds = |m: &[Q], (low, high): &(Q, Q)| {
            let mut values = points.iter().map(|x| c.f.at(x) - dot(m, x));
            values.all(|g| *low <= g && g <= *high)
        };
        t.check(bounds(&c.m, &printed));
        t.repaired(bounds(&used, &corrected));
        if k % 2 == 0 {
            t.repaired(bounds(&used, &restored));
        }
    }
}
