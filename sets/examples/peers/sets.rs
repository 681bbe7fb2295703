//! The sets that every tool is asked about, and points that are in them exactly.
//!
//! Coefficients are multiples of 2⁻¹⁰ of few bits, so that b = A ξ₀ holds in f64 without rounding and no set is
//! empty. For each of the 2n sides of a set its vertex is solved for in rational numbers: |ξ| ≤ 1 and A ξ = b are
//! then checked without error, and with the multipliers of the same basis it is the exact end of the set.

use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use serde_json::{Value, json};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

pub type Q = BigRational;

/// States n, generators p, constraints q, measured components, and how many sets there are.
#[derive(Clone, Copy)]
pub struct Size {
    pub n: usize,
    pub p: usize,
    pub q: usize,
    pub outputs: usize,
    pub sets: usize,
}

/// The papers' order, and the small and the large size of other libraries' tests.
pub const SIZES: [Size; 3] = [
    Size {
        n: 2,
        p: 12,
        q: 5,
        outputs: 2,
        sets: 40,
    },
    Size {
        n: 2,
        p: 20,
        q: 5,
        outputs: 2,
        sets: 40,
    },
    Size {
        n: 12,
        p: 40,
        q: 12,
        outputs: 9,
        sets: 20,
    },
];

/// The half widths of the boxes of w and v in a step.
pub const NOISE: [f64; 2] = [0.125, 0.5];

/// A set with what is asked about it.
pub struct Case {
    pub set: ConstrainedZonotope,
    /// A direction for one support value
    pub direction: Vec<f64>,
    /// x⁺ = M x + w
    pub map: Matrix,
    /// y = R x + v
    pub output: Matrix,
    /// A measurement of a point of the set, and one of its image
    pub y: [Vec<f64>; 2],
    /// The 2n vertices: ξ and the exact end, above and below, state by state
    pub ends: Vec<End>,
}

/// The end of a set along one axis.
pub struct End {
    pub xi: Vec<Q>,
    pub value: Q,
}

/// Multiples of 2⁻¹⁰ from a seed (splitmix64).
struct Source(u64);

impl Source {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [−bound, bound].
    fn dyadic(&mut self, bound: u64) -> f64 {
        let steps = bound * 1024;
        ((self.bits() % (2 * steps + 1)) as f64 - steps as f64) / 1024.0
    }

    fn matrix(&mut self, rows: usize, cols: usize, bound: u64) -> Matrix {
        Matrix::from_fn(rows, cols, |_, _| self.dyadic(bound))
    }

    fn vector(&mut self, n: usize, bound: u64) -> Vec<f64> {
        (0..n).map(|_| self.dyadic(bound)).collect()
    }
}

/// The cases of a size, the same everywhere.
pub fn cases(size: Size) -> Vec<Case> {
    let seed = ((size.n * 100 + size.p) * 100 + size.q) as u64;
    let mut s = Source(seed << 20);
    (0..size.sets).map(|_| case(&mut s, size)).collect()
}

fn case(s: &mut Source, size: Size) -> Case {
    let Size {
        n, p, q, outputs, ..
    } = size;
    let g = s.matrix(n, p, 2);
    let a = s.matrix(q, p, 4);
    let c = s.vector(n, 8);
    let inside = s.vector(p, 1);
    let b = a.mul_vec(&inside);
    let x: Vec<f64> = g
        .mul_vec(&inside)
        .iter()
        .zip(&c)
        .map(|(o, c)| c + o)
        .collect();
    let map = s.matrix(n, n, 1).scale(2.0 / n as f64);
    let output = s.matrix(outputs, n, 1);
    let y = [&x[..], &map.mul_vec(&x)].map(|x| output.mul_vec(x).into_vec());
    let set = ConstrainedZonotope::new(c, g, a, b).expect("the shapes fit");
    let ends = ends(&set);
    Case {
        set,
        direction: s.vector(n, 1),
        map,
        output,
        y,
        ends,
    }
}

/// The box |x| ≤ `half` in n dimensions, around `c`.
pub fn cube(c: Vec<f64>, half: f64) -> ConstrainedZonotope {
    let n = c.len();
    Zonotope::new(c, Matrix::identity(n).scale(half))
        .expect("the shapes fit")
        .into()
}

pub fn q(x: f64) -> Q {
    Q::from_float(x).expect("coefficients are finite")
}

fn dot(a: &[f64], x: &[Q]) -> Q {
    a.iter().zip(x).map(|(&a, x)| q(a) * x).sum()
}

/// The exact ends along the axes. The simplex proposes the basis; whether it is the right one is decided here.
fn ends(set: &ConstrainedZonotope) -> Vec<End> {
    let mut lp = LinearProgram::new();
    lp.load(set.a(), set.b(), set.delta())
        .expect("the rows are finite");
    let mut ends = Vec::new();
    for j in 0..set.dim() {
        for sign in [1.0, -1.0] {
            let d: Vec<f64> = set.g().row(j).iter().map(|g| sign * g).collect();
            lp.maximize(&d).expect("the set has a point");
            let xi = vertex(set, &d, lp.point());
            let value = q(set.c()[j]) + dot(set.g().row(j), &xi);
            ends.push(End { xi, value });
        }
    }
    ends
}

/// The ξ of the vertex near `point`: the coordinates at ±1 stay there, the others solve A ξ = b. Asserts that it
/// is in the set, and that dᵀξ is the maximum over the set: d − Aᵀy has the sign of ξ where |ξ| = 1, and is 0
/// elsewhere.
fn vertex(set: &ConstrainedZonotope, d: &[f64], point: &[f64]) -> Vec<Q> {
    let (a, rows) = (set.a(), set.constraints());
    let basis: Vec<usize> = (0..point.len()).filter(|&k| point[k].abs() < 1.0).collect();
    assert_eq!(basis.len(), rows, "a vertex has a basis");
    let mut xi: Vec<Q> = point
        .iter()
        .map(|&x| if x.abs() < 1.0 { Q::zero() } else { q(x) })
        .collect();
    let square = |i: usize, k: usize| q(a[(i, basis[k])]);
    let right = (0..rows)
        .map(|i| q(set.b()[i]) - dot(a.row(i), &xi))
        .collect();
    for (&k, x) in basis.iter().zip(solve(rows, square, right)) {
        xi[k] = x;
    }
    for i in 0..rows {
        assert_eq!(
            dot(a.row(i), &xi),
            q(set.b()[i]),
            "the vertex meets the constraints"
        );
    }
    assert!(
        xi.iter().all(|x| x.abs() <= Q::one()),
        "the vertex is in the box"
    );
    let y = solve(
        rows,
        |k, i| square(i, k),
        basis.iter().map(|&k| q(d[k])).collect(),
    );
    for (k, x) in xi.iter().enumerate().filter(|(k, _)| !basis.contains(k)) {
        let reduced = q(d[k]) - dot(&a.col(k), &y);
        assert!(!(reduced * x).is_negative(), "the vertex is the end");
    }
    xi
}

/// x of M x = right, M n × n, by elimination.
fn solve(n: usize, m: impl Fn(usize, usize) -> Q, right: Vec<Q>) -> Vec<Q> {
    let mut rows: Vec<Vec<Q>> = (right.into_iter().enumerate())
        .map(|(i, b)| (0..n).map(|k| m(i, k)).chain([b]).collect())
        .collect();
    for k in 0..n {
        let pivot = (k..n)
            .find(|&i| !rows[i][k].is_zero())
            .expect("a basis is regular");
        rows.swap(k, pivot);
        let inverse = rows[k][k].recip();
        rows[k].iter_mut().for_each(|x| *x *= &inverse);
        let row = rows[k].clone();
        for i in (0..n).filter(|&i| i != k) {
            let factor = rows[i][k].clone();
            if !factor.is_zero() {
                rows[i]
                    .iter_mut()
                    .zip(&row)
                    .for_each(|(x, r)| *x -= &factor * r);
            }
        }
    }
    rows.into_iter()
        .map(|mut row| row.pop().expect("a row ends with its right side"))
        .collect()
}

/// How far a hull is off the exact one, each side as a part of the set's width there.
#[derive(Clone, Copy, Default)]
pub struct Off {
    /// The greatest part of a set beyond its hull
    pub cut: f64,
    /// The greatest part of a hull beyond its set
    pub excess: f64,
}

/// Of `hull` = (upper, lower) a state; inexact only in the division that makes it readable.
pub fn off(hull: &[[f64; 2]], ends: &[End]) -> Off {
    let mut off = Off::default();
    for (side, ends) in hull.iter().zip(ends.chunks_exact(2)) {
        let width = &ends[0].value - &ends[1].value;
        for beyond in [q(side[0]) - &ends[0].value, &ends[1].value - q(side[1])] {
            let part = num_traits::ToPrimitive::to_f64(&(&beyond / &width))
                .expect("a ratio of finite numbers");
            off.excess = off.excess.max(part);
            // A ratio that underflows would say that nothing is cut off.
            let cut = if beyond.is_negative() {
                (-part).max(f64::MIN_POSITIVE)
            } else {
                0.0
            };
            off.cut = off.cut.max(cut);
        }
    }
    off
}

/// Every case for the other tools: numbers as the shortest decimals that read back the same, exact points as fractions.
pub fn json(all: &[(Size, Vec<Case>)]) -> Value {
    let matrix = |m: &Matrix| (0..m.rows()).map(|i| m.row(i).to_vec()).collect::<Vec<_>>();
    let of = |size: &Size, case: &Case| {
        let xi = case
            .ends
            .iter()
            .map(|e| e.xi.iter().map(Q::to_string).collect::<Vec<_>>());
        json!({
            "n": size.n, "generators": size.p, "constraints": size.q,
            "c": case.set.c(), "g": matrix(case.set.g()), "a": matrix(case.set.a()), "b": case.set.b(),
            "direction": case.direction, "map": matrix(&case.map), "output": matrix(&case.output), "y": case.y,
            "noise": NOISE,
            "ends": xi.collect::<Vec<_>>(),
        })
    };
    let cases = all
        .iter()
        .flat_map(|(size, cases)| cases.iter().map(move |case| of(size, case)));
    json!(cases.collect::<Vec<_>>())
}
