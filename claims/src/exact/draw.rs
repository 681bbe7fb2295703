//! Instances by counter.

use super::{Cz, M, Q, V, frac, q};
use num_traits::Zero;
use zonobench_estimation::random::{Draws, Purpose};

/// The seed of every campaign.
const SEED: u64 = 2020;

/// A source of small rational numbers. Every claim has its own, so that no claim depends on another.
pub struct Source {
    draws: Draws,
    next: usize,
}

impl Source {
    /// The source of a claim.
    pub fn of(paper: &str, id: &str) -> Self {
        // FNV-1a of the claim's name: the stream of its numbers.
        let name = paper.bytes().chain([b'/']).chain(id.bytes());
        let stream = name.fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        });
        Self {
            draws: Draws::new(SEED, Purpose::W, stream),
            next: 0,
        }
    }

    /// A whole number from `low` to `high`.
    pub fn int(&mut self, low: i64, high: i64) -> i64 {
        let u = (self.draws.uniform(self.next, 0, 0) + 1.0) / 2.0;
        self.next += 1;
        let count = (high - low + 1) as f64;
        low + ((u * count) as i64).min(high - low)
    }

    /// A whole number from `low` to `high`, as a size.
    pub fn size(&mut self, low: usize, high: usize) -> usize {
        self.int(low as i64, high as i64) as usize
    }

    /// A multiple of 1/4 in [−1, 1].
    pub fn unit(&mut self) -> Q {
        frac(self.int(-4, 4), 4)
    }

    /// −1 or 1.
    pub fn sign(&mut self) -> Q {
        q(2 * self.int(0, 1) - 1)
    }

    /// Whole numbers of at most `size`.
    pub fn vector(&mut self, n: usize, size: i64) -> V {
        (0..n).map(|_| q(self.int(-size, size))).collect()
    }

    /// Whole numbers of at most `size`, not all of them 0.
    pub fn direction(&mut self, n: usize, size: i64) -> V {
        loop {
            let d = self.vector(n, size);
            if d.iter().any(|d| !d.is_zero()) {
                return d;
            }
        }
    }

    /// Multiples of 1/4 in [−1, 1].
    pub fn units(&mut self, n: usize) -> V {
        (0..n).map(|_| self.unit()).collect()
    }

    /// Whole numbers of at most `size`.
    pub fn matrix(&mut self, rows: usize, cols: usize, size: i64) -> M {
        M::from_fn(rows, cols, |_, _| q(self.int(-size, size)))
    }

    /// A symmetric positive definite matrix L Lᵀ, L with a diagonal of at least 1.
    pub fn definite(&mut self, n: usize) -> M {
        let l = M::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => Q::zero(),
            std::cmp::Ordering::Equal => q(self.int(1, 2)),
            std::cmp::Ordering::Greater => q(self.int(-1, 1)),
        });
        l.mul(&l.t())
    }

    /// A constrained zonotope that is not empty: the constraints are satisfied by a drawn point.
    pub fn cz(&mut self, n: usize, generators: usize, constraints: usize) -> Cz {
        let g = self.matrix(n, generators, 2);
        let c = self.vector(n, 2);
        let a = M::from_fn(constraints, generators, |_, _| q(self.int(-2, 2)));
        let b = a.apply(&self.units(generators));
        Cz { g, c, a, b }
    }
}
