//! Random instances by counter: sets, systems and problems of any size.

use zonobench_estimation::random::{Draws, Purpose};
use zonobench_estimation::systems::{Linear, Lpv};
use zonobench_estimation::{AnySystem, Problem, Uncertain};
use zonobench_sets::number::{Function, Real};
use zonobench_sets::{ConstrainedZonotope, Matrix, Zonotope};

/// The seed of all instances.
pub const SEED: u64 = 2020;

/// Numbers of one instance; each matrix is a step of its own.
#[derive(Debug)]
pub struct Instance {
    draws: Draws,
    step: usize,
}

impl Instance {
    /// The numbers of instance `index`.
    pub fn new(index: u64) -> Self {
        Self {
            draws: Draws::new(SEED, Purpose::Delta, index),
            step: 0,
        }
    }

    /// A matrix with entries in [−`scale`, `scale`).
    pub fn matrix(&mut self, rows: usize, cols: usize, scale: f64) -> Matrix {
        self.step += 1;
        let (draws, step) = (&mut self.draws, self.step);
        // An address has 2¹⁶ components of 2¹⁶ attempts: row and column.
        Matrix::from_fn(rows, cols, |i, j| scale * draws.uniform(step, i, j))
    }

    /// A vector with entries in [−`scale`, `scale`).
    pub fn vector(&mut self, n: usize, scale: f64) -> Vec<f64> {
        self.matrix(1, n, scale).row(0).to_vec()
    }

    /// A symmetric positive definite matrix of entries near `scale`.
    pub fn covariance(&mut self, n: usize, scale: f64) -> Matrix {
        let m = self.matrix(n, n, 1.0).gram();
        m.add(&Matrix::identity(n)).scale(scale / n as f64)
    }

    /// An integer in [`lo`, `hi`].
    pub fn integer(&mut self, lo: usize, hi: usize) -> usize {
        self.step += 1;
        let unit = 0.5 * (self.draws.uniform(self.step, 0, 0) + 1.0);
        (lo + (unit * (hi - lo + 1) as f64) as usize).min(hi)
    }

    /// A zonotope of `p` generators whose half-widths are about `radius`.
    pub fn zonotope(&mut self, n: usize, p: usize, radius: f64) -> Zonotope {
        let center = self.vector(n, 0.5);
        let g = self.matrix(n, p, 2.0 * radius / p.max(1) as f64);
        Zonotope::new(center, g).expect("entries are finite and shapes fit")
    }

    /// The same with `q` constraints A ξ = A ξ₀ for some |ξ₀| ≤ ½, so that it is not empty.
    pub fn constrained(
        &mut self,
        n: usize,
        p: usize,
        q: usize,
        radius: f64,
    ) -> ConstrainedZonotope {
        let z = self.zonotope(n, p, radius);
        let a = self.matrix(q, p, 1.0);
        let inside = self.vector(p, 0.5);
        let b = a.mul_vec(&inside);
        ConstrainedZonotope::new(z.c().to_vec(), z.g().clone(), a, b)
            .expect("entries are finite and shapes fit")
    }

    /// An LPV system with its noises, x⁺ = (A₀ + Σ δ_i A_i) x + B u + w, for the mixed filters.
    pub fn lpv(&mut self, s: &crate::ezgkf::Sizes) -> Problem {
        let n = s.n;
        let scale = 0.5 / n as f64;
        let a0 = self.matrix(n, n, scale);
        let a = (0..s.n_delta)
            .map(|_| self.matrix(n, n, 0.1 * scale))
            .collect();
        let b = (s.p > 0).then(|| self.matrix(n, s.p, 1.0));
        let c = self.matrix(s.m, n, 1.0);
        let system = Lpv::new(a0, a, b, c).expect("shapes fit");
        let mixed = |center, g, covariance| Uncertain {
            covariance: Some(covariance),
            ..Uncertain::zonotope(center, g)
        };
        let mut part = |dim: usize, p: usize| {
            let (g, covariance) = (self.matrix(dim, p, 0.1), self.covariance(dim, 0.1));
            mixed(vec![0.0; dim], g, covariance)
        };
        Problem {
            system: AnySystem::Lpv(system),
            prior: part(n, s.phi),
            w: part(n, s.n_gw),
            v: part(s.m, s.n_gv),
        }
    }

    /// A linear system without inputs whose noises are boxes and Gaussian at once, observable for nearly
    /// every draw.
    pub fn linear(&mut self, n: usize, m: usize) -> Problem {
        let a = self.matrix(n, n, 1.0 / (n as f64).sqrt());
        let c = self.matrix(m, n, 1.0);
        let system = Linear::new(a, None, c, None).expect("shapes fit");
        let part = |dim: usize, radius: f64| Uncertain {
            mean: Some(vec![0.0; dim]),
            covariance: Some(Matrix::identity(dim).scale(0.1 * radius)),
            ..Uncertain::from_box(&vec![-radius; dim], &vec![radius; dim]).expect("a box about 0")
        };
        Problem {
            system: AnySystem::Linear(system),
            prior: part(n, 10.0),
            w: part(n, 1.0),
            v: part(m, 1.0),
        }
    }
}

/// f_i(z) = sin(0.3 + a_iᵀ z), z = (x, w): every first and second derivative depends on every variable. Or
/// with the noise outside the sine, where only x is met in derivatives.
#[derive(Debug)]
pub struct Dense {
    a: Matrix,
    /// Variables inside the sine.
    inside: usize,
}

impl Dense {
    /// n functions of n + n_w variables.
    pub fn new(instance: &mut Instance, n: usize, n_w: usize) -> Self {
        let inputs = n + n_w;
        Self {
            a: instance.matrix(n, inputs, 1.0 / (inputs as f64).sqrt()),
            inside: inputs,
        }
    }

    /// The same with an additive noise: sin(0.3 + a_iᵀ x) + b_iᵀ w.
    pub fn affine_in_noise(instance: &mut Instance, n: usize, n_w: usize) -> Self {
        Self {
            inside: n,
            ..Self::new(instance, n, n_w)
        }
    }
}

impl Function for Dense {
    fn inputs(&self) -> usize {
        self.a.cols()
    }
    fn outputs(&self) -> usize {
        self.a.rows()
    }
    fn evaluate<S: Real>(&self, x: &[S], y: &mut [S]) {
        for (i, y) in y.iter_mut().enumerate() {
            let sum = |start: f64, over: std::ops::Range<usize>| {
                let terms = self.a.row(i)[over.clone()].iter().zip(&x[over]);
                terms.fold(S::constant(start), |s, (&a, &x)| s + x * a)
            };
            *y = sum(0.3, 0..self.inside).sin();
            if self.inside < x.len() {
                *y = *y + sum(0.0, self.inside..x.len());
            }
        }
    }
}
