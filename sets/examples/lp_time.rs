//! Certified interval hulls: 2n programs over one warm engine.

use std::hint::black_box;
use zonobench_sets::Matrix;
use zonobench_sets::lp::LinearProgram;

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

    /// Roughly normal.
    fn normal(&mut self) -> f64 {
        (0..6).map(|_| self.sym()).sum::<f64>() * std::f64::consts::FRAC_1_SQRT_2
    }
}

struct Case {
    g: Matrix,
    minus: Matrix,
    a: Matrix,
    b: Vec<f64>,
    delta: Vec<f64>,
}

fn cases(n: usize, rows: usize, cols: usize) -> Vec<Case> {
    let mut s = Source(7);
    let cases = (0..20).map(|_| {
        let g = Matrix::from_fn(n, cols, |_, _| s.normal());
        let a = Matrix::from_fn(rows, cols, |_, _| s.normal());
        let inside: Vec<f64> = (0..cols).map(|_| s.sym()).collect();
        let b = a.mul_vec(&inside);
        Case {
            minus: g.scale(-1.0),
            g,
            a,
            b,
            delta: vec![0.0; rows],
        }
    });
    cases.collect()
}

fn hull(lp: &mut LinearProgram, case: &Case) -> f64 {
    lp.load(&case.a, &case.b, &case.delta)
        .expect("the case is finite");
    let mut total = 0.0;
    for j in 0..case.g.rows() {
        total += lp
            .maximize(case.g.row(j))
            .expect("the case is feasible")
            .upper;
        total += lp
            .maximize(case.minus.row(j))
            .expect("the case is feasible")
            .upper;
    }
    total
}

fn main() {
    for (n, rows, cols) in [(2, 5, 20), (12, 12, 40), (12, 24, 90), (30, 30, 120)] {
        let cases = cases(n, rows, cols);
        let mut lp = LinearProgram::new();
        for case in &cases {
            hull(&mut lp, case);
        }
        let w0 = lp.work();
        let mut best = vec![f64::INFINITY; cases.len()];
        let reps = std::env::var("REPS")
            .ok()
            .and_then(|r| r.parse().ok())
            .unwrap_or(3_000_000 / (n * rows * cols) / 3 + 10);
        if let Ok(only) = std::env::var("ONLY") {
            if only != n.to_string() {
                continue;
            }
        }
        for _ in 0..reps {
            for (i, case) in cases.iter().enumerate() {
                let t = std::time::Instant::now();
                black_box(hull(&mut lp, case));
                best[i] = best[i].min(t.elapsed().as_nanos() as f64);
            }
        }
        let w = lp.work();
        let mean: f64 = best.iter().sum::<f64>() / best.len() as f64;
        let piv = (w.pivots - w0.pivots) as f64 / (w.programs - w0.programs) as f64;
        println!(
            "({n},{rows},{cols}) min-mean {:.2} us, {:.2} pivots/lp, {:.3} us/pivot",
            mean / 1e3,
            piv,
            mean / 1e3 / (2.0 * n as f64) / piv
        );
    }
}
