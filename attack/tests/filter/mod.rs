//! A set-membership filter whose truth is carried as a rational: its sets have a point exactly.

use num_rational::BigRational;
use zonobench_attack::hulls::Source;
use zonobench_sets::reduction::scott;
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

pub type Q = BigRational;

pub fn q(x: f64) -> Q {
    Q::from_float(x).expect("the numbers are finite")
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
