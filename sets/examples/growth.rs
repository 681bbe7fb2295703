//! How hulls grow: time and pivots against n, q, p and density, by families of sets.
//!
//! `cargo run -p zonobench-sets --example growth -- [FAMILY ...] [--out DIRECTORY]`
//!
//! Families: uniform (entries of G and A drawn at a density), chain, banded, blocks (products of sets of (6, 6, 20)), lifted
//! (G names n of the ξ that A ties). With `--out` each set is also written as text, `n q p`, then G, A and b as lines of
//! `row column value`, for another tool to be asked the same. Counts are the same everywhere, times are not; of times the
//! least of some is shown, on the processor where the system tells that.

#![allow(clippy::disallowed_methods)] // a clock, in a program that measures

use std::fmt::Write;
use std::time::Instant;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{ConstrainedZonotope, Matrix};

/// Uniform numbers in [−1, 1) from a seed.
struct Source(u64);

impl Source {
    fn sym(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn matrix(&mut self, rows: usize, cols: usize, density: f64) -> Matrix {
        Matrix::from_fn(rows, cols, |_, _| {
            let x = self.sym();
            if self.sym().abs() < density { x } else { 0.0 }
        })
    }
}

struct Case {
    family: &'static str,
    g: Matrix,
    a: Matrix,
    b: Vec<f64>,
}

impl Case {
    fn new(family: &'static str, g: Matrix, a: Matrix, source: &mut Source) -> Self {
        let inside: Vec<f64> = (0..a.cols()).map(|_| source.sym()).collect();
        let b = a.mul_vec(&inside).into_vec();
        Self { family, g, a, b }
    }

    fn text(&self) -> String {
        let mut text = format!("{} {} {}\n", self.g.rows(), self.a.rows(), self.a.cols());
        let own = [("G", &self.g), ("A", &self.a)];
        for (name, m) in own {
            for i in 0..m.rows() {
                for j in (0..m.cols()).filter(|&j| m[(i, j)] != 0.0) {
                    let _ = writeln!(text, "{name} {i} {j} {:?}", m[(i, j)]);
                }
            }
        }
        for (i, b) in self.b.iter().enumerate() {
            let _ = writeln!(text, "b {i} 0 {b:?}");
        }
        text
    }
}

fn uniform(n: usize, q: usize, p: usize, density: f64) -> Case {
    let mut s = Source(7);
    let g = s.matrix(n, p, density);
    let a = s.matrix(q, p, density);
    Case::new("uniform", g, a, &mut s)
}

/// x_i⁺ = 0.5 x_i + 0.2 x_{i+1} + w_i over `steps`, each w_i a generator, every third state measured at each step: what a
/// filter that reduces nothing would hold.
fn chain(n: usize, steps: usize) -> Case {
    let mut s = Source(8);
    let seen: Vec<usize> = (0..n).step_by(3).collect();
    let p = n * (steps + 1) + seen.len() * steps;
    let mut x = Matrix::from_fn(n, p, |i, j| f64::from(i == j));
    let mut a = Matrix::zeros(seen.len() * steps, p);
    for k in 0..steps {
        let own = Matrix::from_fn(n, p, |i, j| {
            let next = if i + 1 < n { 0.2 * x[(i + 1, j)] } else { 0.0 };
            0.5 * x[(i, j)] + next + 0.1 * f64::from(j == n * (k + 1) + i)
        });
        x = own;
        for (l, &i) in seen.iter().enumerate() {
            let row = k * seen.len() + l;
            for j in 0..p {
                a[(row, j)] = x[(i, j)] - 0.1 * f64::from(j == n * (steps + 1) + row);
            }
        }
    }
    Case::new("chain", x, a, &mut s)
}

/// Rows of G and A with `width` entries side by side.
fn banded(n: usize, q: usize, p: usize, width: usize) -> Case {
    let mut s = Source(9);
    let mut band = |rows: usize| {
        Matrix::from_fn(rows, p, |i, j| {
            let x = s.sym();
            let first = i * (p - width) / rows.max(2).saturating_sub(1).max(1);
            if (first..first + width).contains(&j) {
                x
            } else {
                0.0
            }
        })
    };
    let (g, a) = (band(n), band(q));
    Case::new("banded", g, a, &mut Source(10))
}

fn blocks(count: usize) -> Case {
    let mut s = Source(11);
    let (n, q, p) = (6, 6, 20);
    let mut block = |rows: usize| {
        let own = s.matrix(count * rows, p, 1.0);
        Matrix::from_fn(count * rows, count * p, |i, j| {
            if i / rows == j / p {
                own[(i, j % p)]
            } else {
                0.0
            }
        })
    };
    let (g, a) = (block(n), block(q));
    Case::new("blocks", g, a, &mut s)
}

/// The first n of p lifted variables, tied by q sparse rows.
fn lifted(n: usize, q: usize, p: usize, density: f64) -> Case {
    let mut s = Source(12);
    let g = Matrix::from_fn(n, p, |i, j| f64::from(i == j));
    let a = s.matrix(q, p, density);
    Case::new("lifted", g, a, &mut s)
}

fn cases() -> Vec<Case> {
    let mut cases = vec![];
    for (n, q, p) in [(12, 12, 40), (30, 30, 120), (60, 60, 240), (100, 100, 400)] {
        for density in [1.0, 0.5, 0.3, 0.2, 0.1, 0.05] {
            if density * p as f64 >= 4.0 && (p < 400 || density < 0.5) {
                cases.push(uniform(n, q, p, density));
            }
        }
    }
    cases.push(uniform(200, 100, 600, 0.02));
    cases.push(uniform(500, 300, 2000, 0.005));
    for (n, steps) in [(10, 5), (20, 10), (50, 5), (100, 5)] {
        cases.push(chain(n, steps));
    }
    for (n, q, p, width) in [(10, 10, 40, 8), (50, 50, 200, 8), (200, 100, 600, 12)] {
        cases.push(banded(n, q, p, width));
    }
    for count in [2, 10, 40] {
        cases.push(blocks(count));
    }
    for (n, q, p, density) in [
        (10, 20, 60, 0.1),
        (50, 100, 300, 0.03),
        (200, 150, 700, 0.01),
    ] {
        cases.push(lifted(n, q, p, density));
    }
    cases
}

fn entries(m: &Matrix) -> f64 {
    m.as_slice().iter().filter(|x| **x != 0.0).count() as f64
}

/// Nanoseconds of this thread on a processor, where the system says so, else of a clock.
fn spent(begun: Instant) -> f64 {
    let own = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let own = own.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    own.unwrap_or_else(|| begun.elapsed().as_secs_f64() * 1e9)
}

fn main() {
    let begun = Instant::now();
    let mut wanted: Vec<String> = std::env::args().skip(1).collect();
    let at = wanted.iter().position(|w| w == "--out");
    let out = at.map(|at| wanted.split_off(at)).and_then(|mut w| w.pop());
    println!(
        "| family | n, q, p | density of A | pivots a program | time of a hull | unfinished | fallbacks | sum of the widths |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for case in cases() {
        let (n, q, p) = (case.g.rows(), case.a.rows(), case.a.cols());
        let density = entries(&case.a) / (q * p) as f64;
        let name = format!("{}-{n}-{q}-{p}-{density:.3}", case.family);
        if !wanted.is_empty() && !wanted.iter().any(|w| name.starts_with(w.as_str())) {
            continue;
        }
        if let Some(out) = &out {
            std::fs::write(format!("{out}/{name}.txt"), case.text())
                .expect("the directory is there");
        }
        let set = ConstrainedZonotope::new(vec![0.0; n], case.g, case.a, case.b);
        let set = set.expect("shapes fit");
        let mut least = f64::INFINITY;
        let (mut width, mut work) = (0.0, zonobench_sets::lp::Work::default());
        // The kernel tells a thread's time in slices of some milliseconds: small hulls are made many times.
        let (mut times, mut all) = (1, 0.0);
        while all < 0.3 && times < 100_000 {
            let mut lp = LinearProgram::new();
            let before = spent(begun);
            for _ in 1..times {
                let mut lp = LinearProgram::new();
                set.interval_hull_with(&mut lp)
                    .expect("the set has a point");
            }
            let hull = set
                .interval_hull_with(&mut lp)
                .expect("the set has a point");
            let own = (spent(begun) - before) * 1e-9;
            all += own;
            if own > 0.03 {
                least = least.min(own / f64::from(times));
            } else {
                times *= 4;
            }
            work = lp.work();
            width = hull.iter().map(|s| s.hi() - s.lo()).sum();
        }
        println!(
            "| {} | {n}, {q}, {p} | {density:.3} | {:.1} | {:.3} ms | {} | {} | {width:.12} |",
            case.family,
            work.pivots as f64 / work.programs as f64,
            1e3 * least,
            work.unfinished,
            work.fallbacks,
        );
    }
}
