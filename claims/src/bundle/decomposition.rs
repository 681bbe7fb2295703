//! Proposition 4 and Corollary 1: remainder-form decomposition functions.

use super::claim;
use crate::exact::{M, Q, Source, V, dot, frac, q, sub};
use crate::{Claim, Trial};
use num_traits::{Signed, Zero};

pub fn claims() -> Vec<Claim> {
    vec![
        claim(
            "proposition-4",
            "(6)-(8) is a mixed-monotone decomposition function (Definition 2)",
            "",
            mixed_monotone,
        ),
        claim(
            "proposition-4-tight",
            "the decomposition functions of (6)-(8) are tight",
            "a bound of f; tight for g = f - m x only",
            tight,
        ),
        claim(
            "proposition-4-linear",
            "the search for the tightest function of the form (7) can be restricted to linear remainders",
            "",
            linear_remainders,
        ),
        claim(
            "corollary-1",
            "the printed f(z+) + m (z- - z+) and f(z-) + m (z+ - z-) bound g = f - H x",
            "both errors have to be corrected: z+ and z- are swapped, and the bound is that of f, not of g",
            printed_bounds,
        ),
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

fn mixed_monotone(t: &mut Trial) {
    for _ in 0..400 {
        let n = t.draw.size(1, 3);
        let c = case(&mut t.draw, n);
        let h = |x: &[Q]| dot(&c.m, x);
        let value = |z: &[Q], hat: &[Q]| decomposed(&c.f, h, &c.lower, z, hat);
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

fn tight(t: &mut Trial) {
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
        let g = Scalar {
            q: c.f.q.clone(),
            l: sub(&c.f.l, &c.m),
        };
        let (_, top) = remainder_bounds(&c.f, &c.m, &c.lower, &c.low, &c.high);
        t.repaired(top == largest(&g, &c.low[0], &c.high[0]));
    }
}

/// Remainders whose slope goes beyond m, to the side of the choice: linear ones bound at least as well.
fn linear_remainders(t: &mut Trial) {
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
                if c.lower[j] { s - beyond } else { s + beyond }
            })
        };
        let linear = |z: &[Q], hat: &[Q]| decomposed(&c.f, |x| dot(&c.m, x), &c.lower, z, hat);
        let other = |z: &[Q], hat: &[Q]| decomposed(&c.f, h, &c.lower, z, hat);
        t.check(linear(&c.high, &c.low) <= other(&c.high, &c.low));
        t.check(linear(&c.low, &c.high) >= other(&c.low, &c.high));
    }
}

/// The printed bounds of g, lower and upper.
fn as_printed(c: &Case) -> (Q, Q) {
    let plus = zeta(&c.lower, &c.low, &c.high);
    let minus = zeta(&c.lower, &c.high, &c.low);
    let step = dot(&c.m, &sub(&minus, &plus));
    (c.f.at(&minus) - &step, c.f.at(&plus) + step)
}

fn printed_bounds(t: &mut Trial) {
    // f = x on [0, 1], the lower choice m = min(1, 0) = 0: g = x.
    let c = Case {
        f: Scalar {
            q: M::zeros(1, 1),
            l: vec![q(1)],
        },
        low: vec![q(0)],
        high: vec![q(1)],
        lower: vec![true],
        m: vec![q(0)],
    };
    let (low, high) = as_printed(&c);
    let g = c.f.at(&c.high);
    t.check_or(low <= g && g <= high, || {
        format!("f = x on [0, 1], m = min(1, 0) = 0: printed {low} <= g <= {high}, but g(1) = {g}")
    });
    for _ in 0..400 {
        let n = t.draw.size(1, 3);
        let c = case(&mut t.draw, n);
        let printed = as_printed(&c);
        let corrected = remainder_bounds(&c.f, &c.m, &c.lower, &c.low, &c.high);
        // The corners of the box, and a point inside.
        let mut points: Vec<V> = choices(n)
            .iter()
            .map(|lower| zeta(lower, &c.low, &c.high))
            .collect();
        points.push(c.point(&mut t.draw));
        let values: V = points.iter().map(|x| c.f.at(x) - dot(&c.m, x)).collect();
        let bounds = |(low, high): &(Q, Q)| values.iter().all(|g| low <= g && g <= high);
        t.check(bounds(&printed));
        t.repaired(bounds(&corrected));
    }
}
