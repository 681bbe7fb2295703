//! Constrained zonotopes with a point that is in them exactly, to see whether a hull cuts it off.
//!
//! The sets have dyadic coefficients of few bits, so that A ξ = b and x = c + G ξ hold in f64 without
//! rounding, and the point can be compared with the hull as it is.

use crate::campaign::Counts;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{ConstrainedZonotope, Matrix, SetError};

/// Uniform numbers from a seed (splitmix64).
#[derive(Clone, Debug)]
pub struct Source(pub u64);

impl Source {
    /// A number in 0 … n − 1.
    pub fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % n
    }

    /// A number in `from` … `to`.
    pub fn size(&mut self, from: u64, to: u64) -> usize {
        (from + self.below(to - from + 1)) as usize
    }

    /// A multiple of 2⁻¹⁰ in [−bound, bound].
    pub fn dyadic(&mut self, bound: u64) -> f64 {
        let steps = bound * 1024;
        (self.below(2 * steps + 1) as f64 - steps as f64) / 1024.0
    }

    /// ±1 half of the time, else a multiple of 2⁻¹⁰ in [−1, 1].
    pub fn coordinate(&mut self) -> f64 {
        match self.below(4) {
            0 => 1.0,
            1 => -1.0,
            _ => self.dyadic(1),
        }
    }

    /// A power of two from 2^−bound to 2^bound.
    pub fn power(&mut self, bound: u64) -> f64 {
        let e = self.below(2 * bound + 1) as i32 - bound as i32;
        f64::from_bits(((1023 + i64::from(e)) as u64) << 52)
    }
}

/// What is peculiar to a random set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing.
    Dense,
    /// Constraints with coefficients −1, 0 and 1.
    SmallIntegers,
    /// Two thirds of A are zero.
    Sparse,
    /// Every second constraint repeats others, exactly.
    DependentRows,
    /// The first constraint is met in one corner of the box only: the set is barely not empty.
    OneCorner,
    /// Constraints scaled by 2⁻³⁰ … 2³⁰, about 10⁻⁹ … 10⁹.
    ScaledRows,
    /// Components of the state scaled by 2⁻²⁰ … 2²⁰.
    ScaledComponents,
}

impl Kind {
    /// Every kind with its name in the tables.
    pub const ALL: [(Kind, &'static str); 7] = [
        (Kind::Dense, "dense constraints"),
        (Kind::SmallIntegers, "constraints of -1, 0, 1"),
        (Kind::Sparse, "sparse constraints"),
        (Kind::DependentRows, "dependent constraints"),
        (Kind::OneCorner, "one corner left"),
        (Kind::ScaledRows, "constraints scaled 1e-9 to 1e9"),
        (Kind::ScaledComponents, "states scaled 1e-6 to 1e6"),
    ];
}

/// A random set and a point of it, both exact in f64.
pub fn random(s: &mut Source, kind: Kind) -> (ConstrainedZonotope, Vec<f64>) {
    let n = s.size(1, 6);
    let rows = s.size(1, 8);
    let cols = rows + s.size(2, 24);
    let mut xi: Vec<f64> = (0..cols).map(|_| s.coordinate()).collect();
    let mut a = Matrix::from_fn(rows, cols, |_, _| match kind {
        Kind::SmallIntegers => s.below(3) as f64 - 1.0,
        Kind::Sparse if s.below(3) != 0 => 0.0,
        _ => s.dyadic(4),
    });
    if kind == Kind::DependentRows {
        // Every second row repeats, doubles, or adds up rows above it.
        for i in (1..rows).step_by(2) {
            let (f, k) = (s.power(8), s.size(0, i as u64 - 1));
            for j in 0..cols {
                a[(i, j)] = if i >= 2 && k + 1 < i {
                    a[(k, j)] + a[(k + 1, j)]
                } else {
                    f * a[(k, j)]
                };
            }
        }
    }
    if kind == Kind::OneCorner {
        for j in 0..cols {
            xi[j] = if a[(0, j)] < 0.0 { -1.0 } else { 1.0 };
        }
    }
    let mut b = a.mul_vec(&xi);
    if kind == Kind::ScaledRows {
        for (i, b) in b.iter_mut().enumerate() {
            let f = s.power(30);
            a.row_mut(i).iter_mut().for_each(|x| *x *= f);
            *b *= f;
        }
    }
    let mut g = Matrix::from_fn(n, cols, |_, _| s.dyadic(2));
    let mut c: Vec<f64> = (0..n).map(|_| s.dyadic(8)).collect();
    if kind == Kind::ScaledComponents {
        for (i, c) in c.iter_mut().enumerate() {
            let f = s.power(20);
            g.row_mut(i).iter_mut().for_each(|x| *x *= f);
            *c *= f;
        }
    }
    let x = g.mul_vec(&xi).iter().zip(&c).map(|(o, c)| c + o).collect();
    (
        ConstrainedZonotope::new(c, g, a, b).expect("the shapes fit"),
        x,
    )
}

/// Takes the hulls of the `sets` random sets of `kind` from number `first` on; lost is a hull that cuts off the
/// point, and a set that is called empty.
pub fn attack(kind: Kind, first: u64, sets: u64) -> Counts {
    let mut counts = Counts::default();
    let mut lp = LinearProgram::new();
    for i in first..first + sets {
        let (set, x) = random(&mut Source(((kind as u64) << 40) | i), kind);
        counts.steps += 1;
        let hull = set.interval_hull_with(&mut lp);
        counts.empty += u64::from(matches!(hull, Err(SetError::Empty { .. })));
        let holds = hull.is_ok_and(|hull| {
            hull.iter()
                .zip(&x)
                .all(|(side, &x)| side.lo() <= x && x <= side.hi())
        });
        counts.lost += u64::from(!holds);
    }
    counts
}
