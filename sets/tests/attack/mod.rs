//! Sets with a point that is in them exactly, to see whether a hull ever cuts one off.
//!
//! Random sets have dyadic coefficients of few bits, so that A ξ = b and x = c + G ξ hold in f64 without
//! rounding. Structured sets come out of a set-membership filter whose truth is carried as a rational.

use num_rational::BigRational;
use zonobench_sets::reduction::scott;
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

pub type Q = BigRational;

fn q(x: f64) -> Q {
    Q::from_float(x).expect("the numbers are finite")
}

/// Uniform numbers from a seed (splitmix64).
pub struct Source(pub u64);

impl Source {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % n
    }

    fn size(&mut self, from: u64, to: u64) -> usize {
        (from + self.below(to - from + 1)) as usize
    }

    /// A multiple of 2⁻¹⁰ in [−bound, bound].
    fn dyadic(&mut self, bound: u64) -> f64 {
        let steps = bound * 1024;
        (self.below(2 * steps + 1) as f64 - steps as f64) / 1024.0
    }

    /// ±1 half of the time, else a multiple of 2⁻¹⁰ in [−1, 1].
    fn coordinate(&mut self) -> f64 {
        match self.below(4) {
            0 => 1.0,
            1 => -1.0,
            _ => self.dyadic(1),
        }
    }

    fn power(&mut self, bound: u64) -> f64 {
        exp2(self.below(2 * bound + 1) as i32 - bound as i32)
    }
}

/// 2^e, exact.
fn exp2(e: i32) -> f64 {
    f64::from_bits(((1023 + i64::from(e)) as u64) << 52)
}

pub const KINDS: u64 = 7;

/// A random set of kind `kind` < [`KINDS`] and a point of it; both exact in f64.
pub fn random(s: &mut Source, kind: u64) -> (ConstrainedZonotope, Vec<f64>) {
    let n = s.size(1, 6);
    let rows = s.size(1, 8);
    let cols = rows + s.size(2, 24);
    let mut xi: Vec<f64> = (0..cols).map(|_| s.coordinate()).collect();
    let mut a = Matrix::from_fn(rows, cols, |_, _| match kind {
        1 => s.below(3) as f64 - 1.0,
        2 if s.below(3) != 0 => 0.0,
        _ => s.dyadic(4),
    });
    if kind == 3 {
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
    if kind == 4 {
        // The first row is met in one corner of the box only.
        for j in 0..cols {
            xi[j] = if a[(0, j)] < 0.0 { -1.0 } else { 1.0 };
        }
    }
    let mut b = a.mul_vec(&xi);
    if kind == 5 {
        for (i, b) in b.iter_mut().enumerate() {
            let f = s.power(20);
            a.row_mut(i).iter_mut().for_each(|x| *x *= f);
            *b *= f;
        }
    }
    let mut g = Matrix::from_fn(n, cols, |_, _| s.dyadic(2));
    let mut c: Vec<f64> = (0..n).map(|_| s.dyadic(8)).collect();
    if kind == 6 {
        // Rows of the set as different as 2⁻²⁰ and 2²⁰.
        for (i, c) in c.iter_mut().enumerate() {
            let f = s.power(20);
            g.row_mut(i).iter_mut().for_each(|x| *x *= f);
            *c *= f;
        }
    }
    let x = g.mul_vec(&xi).iter().zip(&c).map(|(o, c)| c + o).collect();
    (ConstrainedZonotope::new(c, g, a, b).expect("shapes fit"), x)
}

/// A filter on x⁺ = M x + w, y = C x + v with vertex noise, and its truth.
pub struct Filter {
    s: Source,
    m: Matrix,
    w: Vec<f64>,
    c: Matrix,
    sigma: f64,
    constraints: usize,
    generators: usize,
    pub set: ConstrainedZonotope,
    pub truth: Vec<Q>,
}

impl Filter {
    pub fn new(seed: u64) -> Self {
        let mut s = Source(seed);
        let blocks = s.size(1, 2);
        let n = 2 * blocks;
        // Blocks that turn and contract, coupled a little.
        let m = Matrix::from_fn(n, n, |i, j| match (i / 2 == j / 2, i == j) {
            (true, true) => 0.75,
            (true, false) => {
                if i < j {
                    -0.5
                } else {
                    0.5
                }
            }
            _ => s.dyadic(1) / 16.0,
        });
        let noise = s.power(8);
        // Some components have no noise: there the sets become thin.
        let w = (0..n)
            .map(|_| if s.below(3) == 0 { 0.0 } else { noise })
            .collect();
        let outputs = s.size(1, 2);
        let c = Matrix::from_fn(outputs, n, |_, _| s.dyadic(1));
        let sigma = s.power(6);
        let constraints = s.size(1, 6);
        let generators = n + constraints + s.size(2, 16);
        let truth = (0..n).map(|_| q(s.coordinate())).collect();
        let unit = Zonotope::new(vec![0.0; n], Matrix::identity(n)).expect("shapes fit");
        Self {
            s,
            m,
            w,
            c,
            sigma,
            constraints,
            generators,
            set: unit.into(),
            truth,
        }
    }

    /// One step; the truth stays in the set if every operation is sound.
    pub fn step(&mut self) {
        let n = self.truth.len();
        let w: Vec<f64> = self.w.iter().map(|w| w * self.s.coordinate()).collect();
        self.truth = (0..n)
            .map(|i| {
                self.m
                    .row(i)
                    .iter()
                    .zip(&self.truth)
                    .fold(q(w[i]), |t, (&m, x)| t + q(m) * x)
            })
            .collect();
        let noise = Zonotope::new(vec![0.0; n], Matrix::diagonal(&self.w)).expect("shapes fit");
        let predicted = self
            .set
            .linear_map(&self.m)
            .and_then(|x| x.minkowski_sum(&noise.into()));
        let mut set = predicted.expect("shapes fit");
        for i in 0..self.c.rows() {
            let row = self.c.row(i).to_vec();
            let exact = row
                .iter()
                .zip(&self.truth)
                .fold(q(0.0), |t, (&c, x)| t + q(c) * x);
            // The measurement is an f64 whose distance from C x is at most σ, exactly.
            let v = self.sigma * self.s.coordinate() * (1.0 - 1e-9);
            let y = num_traits::ToPrimitive::to_f64(&exact).expect("the truth is bounded") + v;
            assert!(num_traits::Signed::abs(&(&exact - q(y))) <= q(self.sigma));
            set = set
                .intersect_strip(&row, y, self.sigma)
                .expect("shapes fit");
        }
        self.set = scott::reduce(&set.fold(), self.generators, self.constraints)
            .expect("the set has a point");
    }
}

/// What an attack found.
#[derive(Debug, Default, PartialEq)]
pub struct Report {
    pub sets: u64,
    pub cut_off: u64,
    pub called_empty: u64,
    pub fallbacks: u64,
    /// Sets that are wider than their zonotope or not solved to the optimum.
    pub unfinished: u64,
}

/// Takes hulls of `sets` sets, half of them random and half out of filters.
pub fn attack(sets: u64, seed: u64) -> Report {
    let mut report = Report::default();
    let mut lp = zonobench_sets::lp::LinearProgram::new();
    let mut s = Source(seed);
    let mut check = |set: &ConstrainedZonotope, x: &[Q]| {
        report.sets += 1;
        match set.interval_hull_with(&mut lp) {
            Ok(hull) => {
                let inside = hull
                    .iter()
                    .zip(x)
                    .all(|(side, x)| q(side.lo()) <= *x && *x <= q(side.hi()));
                report.cut_off += u64::from(!inside);
            }
            Err(_) => report.called_empty += 1,
        }
    };
    for i in 0..sets / 2 {
        let (set, x) = random(&mut s, i % KINDS);
        check(&set, &x.iter().map(|&x| q(x)).collect::<Vec<_>>());
    }
    let steps = 40;
    let mut left = sets - sets / 2;
    let mut run = 0;
    while left > 0 {
        let mut filter = Filter::new(seed ^ (1000 + run));
        run += 1;
        for _ in 0..steps.min(left) {
            filter.step();
            check(&filter.set, &filter.truth);
            left -= 1;
        }
    }
    report.fallbacks = lp.work().fallbacks;
    report.unfinished = lp.work().unfinished;
    report
}
