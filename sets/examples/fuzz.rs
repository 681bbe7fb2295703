//! Linear programs and reductions made of hostile numbers, held against exact rational arithmetic until the time is up.
//!
//! `cargo run -p zonobench-sets --example fuzz -- 60 7` takes 60 seconds from seed 7. Every case has a number: a finding
//! is reported with it, and `-- 0 7 N` runs case N of seed 7 alone.

#![allow(clippy::disallowed_methods)] // the tests' source of cases uses the platform's functions

#[path = "../tests/rational/mod.rs"]
mod rational;

use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};
use rational::{has, maximum, q, qs};
use std::time::{Duration, Instant};
use zonobench_sets::lp::{Emptiness, LinearProgram};
use zonobench_sets::reduction::scott;
use zonobench_sets::{ConstrainedZonotope, Matrix, SetError, Zonotope};

/// Uniform bits (splitmix64).
struct Bits(u64);

impl Bits {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A power of two from 2^−spread to 2^spread.
    fn power(&mut self, spread: usize) -> f64 {
        let e = self.below(2 * spread + 1) as u64;
        f64::from_bits((1023 + e - spread as u64) << 52)
    }

    /// A number that solvers dislike: zeros and ones, one bit off, small integers, powers of two, any mantissa.
    fn number(&mut self, spread: usize) -> f64 {
        let sign = if self.below(2) == 0 { 1.0 } else { -1.0 };
        let size = match self.below(8) {
            0 | 1 => 0.0,
            2 => 1.0,
            3 => 1.0_f64.next_up(),
            4 => self.power(spread),
            5 => self.below(4) as f64,
            _ => {
                let mantissa = (self.next() >> 12) as f64 / (1_u64 << 52) as f64;
                self.power(spread) * (1.0 + mantissa)
            }
        };
        sign * size
    }

    /// Now and then a row, or a multiple of it, stands there twice.
    fn matrix(&mut self, rows: usize, cols: usize, spread: usize) -> Matrix {
        let mut m = Matrix::zeros(rows, cols);
        for i in 0..rows {
            let again = (i > 0 && self.below(5) == 0).then(|| (self.below(i), self.number(3)));
            for j in 0..cols {
                m[(i, j)] = match again {
                    Some((k, factor)) => factor * m[(k, j)],
                    None => self.number(spread),
                };
            }
        }
        m
    }

    fn numbers(&mut self, n: usize, spread: usize) -> Vec<f64> {
        (0..n).map(|_| self.number(spread)).collect()
    }

    /// ξ with |ξ| ≤ 1.
    fn inside(&mut self, n: usize) -> Vec<f64> {
        let numbers = self.numbers(n, 2).into_iter();
        numbers.map(|x| x.clamp(-1.0, 1.0)).collect()
    }
}

/// What is wrong with the answers to a program, if anything is.
fn program(bits: &mut Bits) -> Option<String> {
    let (rows, cols) = (1 + bits.below(4), 1 + bits.below(7));
    let spread = [0, 4, 30, 60][bits.below(4)];
    let a = bits.matrix(rows, cols, spread);
    // A right side that some point meets up to rounding, or none in particular.
    let b = match bits.below(3) {
        0 => bits.numbers(rows, spread),
        _ => a.mul_vec(&bits.inside(cols)).into_vec(),
    };
    let delta: Vec<f64> = (0..rows)
        .map(|_| bits.below(2) as f64 * bits.number(spread).abs() * 1e-9)
        .collect();
    let mut lp = LinearProgram::new();
    lp.load(&a, &b, &delta).ok()?;
    for _ in 0..3 {
        let d = bits.numbers(cols, spread);
        let exact = maximum(&a, &b, &delta, &d);
        match (lp.maximize(&d), exact) {
            (Ok(found), Some(exact)) if q(found.upper) < exact => {
                return Some(format!("the bound {:e} is below the maximum", found.upper));
            }
            (Err(SetError::Empty { .. }), Some(_)) => return Some("called empty".to_owned()),
            _ => {}
        }
    }
    let point = maximum(&a, &b, &delta, &vec![0.0; cols]);
    (lp.emptiness() == Emptiness::Empty && point.is_some()).then(|| "proved empty".to_owned())
}

/// What a reduction has lost, if anything.
fn reduction(bits: &mut Bits) -> Option<String> {
    let (n, rows) = (1 + bits.below(3), bits.below(4));
    let cols = rows + n + bits.below(5);
    let spread = [0, 3, 12][bits.below(3)];
    let g = bits.matrix(n, cols, spread);
    let a = bits.matrix(rows, cols, spread);
    let c = bits.numbers(n, spread);
    let xi = bits.inside(cols);
    let times = |m: &Matrix| -> Vec<BigRational> {
        let row = |i| m.row(i).iter().zip(&xi).map(|(&m, &x)| q(m) * q(x)).sum();
        (0..m.rows()).map(row).collect()
    };
    // The right side is rounded, and the slack is what that may have cost.
    let b = a.mul_vec(&xi);
    let off = |(exact, &b): (BigRational, &f64)| {
        let off = (exact - q(b)).abs().to_f64();
        off.map_or(f64::INFINITY, |x| x.next_up().next_up())
    };
    let delta: Vec<f64> = times(&a).into_iter().zip(&b).map(off).collect();
    let x: Vec<BigRational> = times(&g)
        .into_iter()
        .zip(qs(&c))
        .map(|(g, c)| g + c)
        .collect();
    let zonotope = Zonotope::new(c, g).ok()?;
    let set = ConstrainedZonotope::with_slack(zonotope, a, b, delta).ok()?;
    let constraints = bits.below(3);
    let generators = n + constraints + bits.below(3);
    match scott::reduce(&set.fold(), generators, constraints) {
        Ok(small) => (!has(&small, &x)).then(|| "the reduced set lost a point".to_owned()),
        Err(SetError::Empty { .. }) => Some("the reduction called the set empty".to_owned()),
        Err(_) => None,
    }
}

fn case(seed: u64, number: u64) -> Option<String> {
    let mut bits = Bits(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ number);
    if number.is_multiple_of(4) {
        reduction(&mut bits)
    } else {
        program(&mut bits)
    }
}

fn main() {
    let arguments: Vec<u64> = std::env::args()
        .skip(1)
        .map(|a| a.parse().expect("seconds, seed and case are whole numbers"))
        .collect();
    let at = |i: usize, default| arguments.get(i).copied().unwrap_or(default);
    let (seconds, seed) = (at(0, 60), at(1, 1));
    if let Some(&number) = arguments.get(2) {
        let found = case(seed, number);
        println!(
            "case {number} of seed {seed}: {}",
            found.as_deref().unwrap_or("right")
        );
        return;
    }
    let (start, mut number, mut wrong) = (Instant::now(), 0, 0);
    let mut longest = Duration::ZERO;
    while start.elapsed().as_secs() < seconds {
        let before = Instant::now();
        if let Some(finding) = case(seed, number) {
            println!("case {number} of seed {seed}: {finding}");
            wrong += 1;
        }
        longest = longest.max(before.elapsed());
        number += 1;
    }
    println!("{wrong} of {number} cases wrong, the longest took {longest:.1?}");
    if wrong > 0 {
        std::process::exit(1);
    }
}
