//! Exact rational arithmetic to hold the certified bounds against, and a seeded source of cases.

#![allow(dead_code)] // Each test binary uses a part of it.

use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

pub type Q = BigRational;

/// The exact value of a finite f64.
pub fn q(x: f64) -> Q {
    Q::from_float(x).expect("test data are finite")
}

pub fn qs(v: &[f64]) -> Vec<Q> {
    v.iter().map(|&x| q(x)).collect()
}

/// bᵀy + |y|ᵀδ + ‖d − Aᵀy‖₁, exactly.
pub fn core(a: &Matrix, b: &[f64], delta: &[f64], d: &[f64], y: &[f64]) -> Q {
    let mut v = qs(d);
    let mut value = Q::zero();
    for i in 0..a.rows() {
        let y = q(y[i]);
        if y.is_zero() {
            continue;
        }
        for (v, &a) in v.iter_mut().zip(a.row(i)) {
            *v -= &y * q(a);
        }
        value += &y * q(b[i]) + y.abs() * q(delta[i]);
    }
    v.iter().fold(value, |s, v| s + v.abs())
}

/// max dᵀξ over |Aξ − b| ≤ δ, |ξ| ≤ 1, exactly; `None` if there is no such ξ.
pub fn maximum(a: &Matrix, b: &[f64], delta: &[f64], d: &[f64]) -> Option<Q> {
    maximum_over(a, qs(b), &qs(delta), d)
}

/// Whether x = c + G ξ + s for some |ξ| ≤ 1, |A ξ − b| ≤ δ, |s| ≤ r, exactly.
pub fn has(set: &ConstrainedZonotope, x: &[Q]) -> bool {
    let rows = Matrix::vcat(&[set.g(), set.a()]);
    let offset = x.iter().zip(set.c()).map(|(x, &c)| x - q(c));
    let right = offset.chain(qs(set.b())).collect();
    let slack = qs(&[set.r(), set.delta()].concat());
    maximum_over(&rows, right, &slack, &vec![0.0; rows.cols()]).is_some()
}

/// [`maximum`] for a right side and a slack that are not f64.
///
/// A bounded dual simplex by the smallest-index rule, which ends in exact arithmetic.
fn maximum_over(a: &Matrix, mut right: Vec<Q>, delta: &[Q], d: &[f64]) -> Option<Q> {
    let (m, n) = (a.rows(), a.cols());
    let one = q(1.0);
    let range = |v: usize| {
        if v < n {
            one.clone()
        } else {
            delta[v - n].clone()
        }
    };
    let mut t: Vec<Vec<Q>> = (0..m).map(|i| qs(a.row(i))).collect();
    let mut reduced = qs(d);
    let mut basis: Vec<usize> = (n..n + m).collect();
    let mut column: Vec<usize> = (0..n).collect();
    let mut side: Vec<Q> = reduced
        .iter()
        .map(|r| {
            if r.is_negative() {
                -one.clone()
            } else {
                one.clone()
            }
        })
        .collect();
    loop {
        let at: Vec<Q> = (0..n).map(|j| &side[j] * range(column[j])).collect();
        let x: Vec<Q> = (0..m)
            .map(|i| {
                t[i].iter()
                    .zip(&at)
                    .fold(right[i].clone(), |s, (t, x)| s - t * x)
            })
            .collect();
        let leaving = (0..m)
            .filter(|&i| x[i].abs() > range(basis[i]))
            .min_by_key(|&i| basis[i]);
        let Some(r) = leaving else {
            let nonbasic = (0..n)
                .filter(|&j| column[j] < n)
                .map(|j| q(d[column[j]]) * &at[j]);
            let basic = (0..m)
                .filter(|&i| basis[i] < n)
                .map(|i| q(d[basis[i]]) * &x[i]);
            return Some(nonbasic.chain(basic).fold(Q::zero(), |s, v| s + v));
        };
        let sign = if x[r].is_positive() {
            -one.clone()
        } else {
            one.clone()
        };
        let mut best: Option<(Q, usize)> = None;
        for j in 0..n {
            let slope = &sign * &side[j] * &t[r][j];
            if !slope.is_positive() {
                continue;
            }
            let step = &side[j] * &reduced[j] / slope;
            let better = best
                .as_ref()
                .is_none_or(|(s, c)| step < *s || (step == *s && column[j] < column[*c]));
            if better {
                best = Some((step, j));
            }
        }
        let (_, j) = best?;
        let pivot = t[r][j].clone();
        t[r][j] = one.clone();
        for v in &mut t[r] {
            *v /= &pivot;
        }
        right[r] /= &pivot;
        let (row, value) = (t[r].clone(), right[r].clone());
        for i in (0..m).filter(|&i| i != r) {
            let f = std::mem::replace(&mut t[i][j], Q::zero());
            if !f.is_zero() {
                for (t, p) in t[i].iter_mut().zip(&row) {
                    *t -= &f * p;
                }
                right[i] -= &f * &value;
            }
        }
        let f = std::mem::replace(&mut reduced[j], Q::zero());
        for (t, p) in reduced.iter_mut().zip(&row) {
            *t -= &f * p;
        }
        side[j] = -sign;
        std::mem::swap(&mut basis[r], &mut column[j]);
    }
}

/// Uniform numbers from a seed (splitmix64).
pub struct Source(pub u64);

impl Source {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In [-1, 1).
    pub fn sym(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Roughly normal: a sum of twelve.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    /// A power of ten between 10^-e and 10^e.
    pub fn scale(&mut self, e: f64) -> f64 {
        libm::pow(10.0, e * self.sym())
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.normal()).collect()
    }

    pub fn matrix(&mut self, m: usize, n: usize) -> Matrix {
        Matrix::from_fn(m, n, |_, _| self.normal())
    }
}

/// Rows |Aξ − b| ≤ δ of one kind of difficulty, made so that a known ξ satisfies them nearly or exactly.
pub struct Rows {
    pub a: Matrix,
    pub b: Vec<f64>,
    pub delta: Vec<f64>,
}

pub const KINDS: [&str; 9] = [
    "random",
    "redundant",
    "scaled",
    "scaled and redundant",
    "integer",
    "barely feasible",
    "barely infeasible",
    "slack",
    "sparse with zeros",
];

/// A case of kind `kind` (an index into [`KINDS`]).
pub fn rows(s: &mut Source, kind: usize, m: usize, n: usize) -> Rows {
    let mut a = s.matrix(m, n);
    let mut delta = vec![0.0; m];
    if kind == 4 {
        a = Matrix::from_fn(m, n, |_, _| (s.below(3) as f64) - 1.0);
    }
    if kind == 8 {
        a = Matrix::from_fn(m, n, |_, _| if s.below(3) == 0 { s.normal() } else { 0.0 });
    }
    if kind == 1 || kind == 3 {
        // Every second row is a combination of the two before it.
        for i in (2..m).step_by(2) {
            let (f, g) = (s.normal(), s.normal());
            for j in 0..n {
                a[(i, j)] = f * a[(i - 1, j)] + g * a[(i - 2, j)];
            }
        }
    }
    let xi: Vec<f64> = (0..n)
        .map(|_| {
            if kind == 4 {
                (s.below(3) as f64) - 1.0
            } else {
                s.sym()
            }
        })
        .collect();
    let mut b = a.mul_vec(&xi).into_vec();
    if kind == 5 || kind == 6 {
        // One row touches the box's corner, but for a little.
        let little = [1e-6, 1e-9, 1e-12][s.below(3)] * if kind == 5 { -1.0 } else { 1.0 };
        let size: f64 = a.row(0).iter().map(|x| x.abs()).sum();
        b[0] = size * (1.0 + little);
        for (i, b) in b.iter_mut().enumerate().skip(1) {
            *b = a
                .row(i)
                .iter()
                .zip(a.row(0))
                .map(|(x, r)| x * r.signum())
                .sum();
        }
    }
    if kind == 2 || kind == 3 {
        for (i, b) in b.iter_mut().enumerate() {
            let f = s.scale(6.0);
            a.row_mut(i).iter_mut().for_each(|x| *x *= f);
            *b *= f;
        }
    }
    if kind == 7 {
        for d in &mut delta {
            *d = [0.0, 1e-15, 1e-9, 0.1][s.below(4)];
        }
    }
    Rows { a, b, delta }
}

/// A set and an exact point of it: coordinates ξ and x = c + G ξ + s.
pub struct Known {
    pub set: ConstrainedZonotope,
    pub xi: Vec<Q>,
    pub x: Vec<Q>,
}

/// At least the exact nonnegative value.
pub fn up(x: &Q) -> f64 {
    x.to_f64().unwrap().next_up()
}

pub fn product(m: &Matrix, v: &[Q]) -> Vec<Q> {
    (0..m.rows())
        .map(|i| {
            m.row(i)
                .iter()
                .zip(v)
                .fold(Q::zero(), |s, (&a, x)| s + q(a) * x)
        })
        .collect()
}

/// A set of scattered scales with a known point, r and δ at rounding level or larger.
pub fn known(s: &mut Source, n: usize, rows: usize, cols: usize) -> Known {
    let size = s.scale(6.0);
    let g = Matrix::from_fn(n, cols, |_, _| {
        if s.below(6) == 0 {
            0.0
        } else {
            s.normal() * size
        }
    });
    let a = Matrix::from_fn(
        rows,
        cols,
        |_, _| if s.below(6) == 0 { 0.0 } else { s.normal() },
    );
    let c: Vec<f64> = (0..n)
        .map(|_| s.normal() * size * [0.0, 1.0, 1e6][s.below(3)])
        .collect();
    let xi: Vec<f64> = (0..cols)
        .map(|_| [s.sym(), 1.0, -1.0][s.below(3)])
        .collect();
    let xi = qs(&xi);
    let b: Vec<f64> = product(&a, &xi)
        .iter()
        .map(|b| b.to_f64().unwrap())
        .collect();
    let delta: Vec<f64> = product(&a, &xi)
        .iter()
        .zip(&b)
        .map(|(e, &b)| up(&(e - q(b)).abs()))
        .collect();
    let r: Vec<f64> = (0..n)
        .map(|_| [0.0, 1e-16 * size, 0.1 * size][s.below(3)])
        .collect();
    let x = product(&g, &xi);
    let x = x
        .iter()
        .zip(&c)
        .zip(&r)
        .map(|((x, &c), &r)| x + q(c) + q(r))
        .collect();
    let z = Zonotope::with_rounding(c, g, r).unwrap();
    Known {
        set: ConstrainedZonotope::with_slack(z, a, b, delta).unwrap(),
        xi,
        x,
    }
}
