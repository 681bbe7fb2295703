//! Noise vectors drawn, step by step, by counter.

use super::{Drawn, INSIDE, Law, Noise, SimulationError};
use crate::problem::Uncertain;
use crate::random::{Draws, MAX_ATTEMPTS, Purpose};
use crate::signal::{Signal, sum_at};
use zonobench_sets::Matrix;
use zonobench_sets::covariance::Scaled;

/// What makes a noise vector at any step of one run.
pub(super) struct Source<'a> {
    part: &'static str,
    noise: &'a Noise,
    n: usize,
    /// The terms of each component, where the noise is deterministic.
    terms: Vec<&'a [Signal]>,
    draws: Draws,
    gaussian: Draws,
    factor: Matrix,
    /// True if Σ is diagonal: then components can be redrawn one by one.
    independent: bool,
}

impl<'a> Source<'a> {
    pub(super) fn new(
        part: &'static str,
        noise: &'a Noise,
        n: usize,
        choice: &[usize],
        purposes: [Purpose; 2],
        (seed, run): (u64, u64),
    ) -> Self {
        let terms = match noise {
            Noise::Signals { terms, .. } => terms.iter().map(|t| &t[..]).collect(),
            Noise::Alternatives { alternatives, .. } => alternatives
                .iter()
                .zip(choice)
                .map(|(list, &digit)| &list[digit][..])
                .collect(),
            Noise::Drawn(_) | Noise::Data(_) => Vec::new(),
        };
        let sigma = match noise {
            Noise::Drawn(drawn) => drawn.of.covariance_matrix(),
            _ => Matrix::zeros(0, 0),
        };
        let independent = (0..sigma.rows()).all(|i| (0..i).all(|j| sigma[(i, j)] == 0.0));
        Self {
            part,
            noise,
            n,
            terms,
            draws: Draws::new(seed, purposes[0], run),
            gaussian: Draws::new(seed, purposes[1], run),
            factor: Scaled::new(&sigma).factor(),
            independent,
        }
    }

    /// The vector at step k.
    pub(super) fn at(&mut self, k: usize) -> Result<Vec<f64>, SimulationError> {
        match self.noise {
            Noise::Drawn(drawn) => self.draw(drawn, k),
            Noise::Signals { about, .. } | Noise::Alternatives { about, .. } => {
                let value = self.terms.iter().map(|terms| sum_at(terms, k));
                Ok(match about {
                    Some(center) => value
                        .zip(center)
                        .map(|(s, c)| c + (s - c) * INSIDE)
                        .collect(),
                    None => value.collect(),
                })
            }
            Noise::Data(rows) => Ok(rows[k].clone()),
        }
    }

    fn draw(&mut self, drawn: &Drawn, k: usize) -> Result<Vec<f64>, SimulationError> {
        let of = &drawn.of;
        match drawn.law {
            Law::Zero => Ok(vec![0.0; self.n]),
            Law::Uniform => Ok(in_generators(of, &of.center, |j| {
                self.draws.uniform(k, j, 0)
            })),
            Law::Vertices => Ok(in_generators(of, &of.center, |j| self.draws.sign(k, j, 0))),
            Law::Mixed => {
                let g = self.normal(k, 0, &of.mixed_mean());
                Ok(in_generators(of, &g, |j| self.draws.uniform(k, j, 0)))
            }
            Law::Gaussian if drawn.truncate => self.truncated(of, k),
            Law::Gaussian => Ok(self.normal(k, 0, of.gaussian_mean())),
        }
    }

    /// `mean` + F g.
    fn normal(&mut self, k: usize, attempt: usize, mean: &[f64]) -> Vec<f64> {
        let g: Vec<f64> = (0..self.n)
            .map(|j| self.gaussian.gaussian(k, j, attempt))
            .collect();
        mean.iter()
            .enumerate()
            .map(|(i, m)| m + dot_in_order(self.factor.row(i), &g))
            .collect()
    }

    /// Drawn again until inside the box: one component at a time where they are independent (the law
    /// is then the same as that of redrawing the vector), else the whole vector.
    fn truncated(&mut self, of: &Uncertain, k: usize) -> Result<Vec<f64>, SimulationError> {
        let radius = of.generator_matrix().abs_row_sums();
        let inside = |i: usize, x: f64| (x - of.center[i]).abs() <= radius[i] * INSIDE;
        let mut vector: Vec<Option<f64>> = vec![None; self.n];
        for attempt in 0..MAX_ATTEMPTS {
            let draw = self.normal(k, attempt, of.gaussian_mean());
            if self.independent {
                for (i, x) in draw.into_iter().enumerate() {
                    vector[i] = vector[i].or(inside(i, x).then_some(x));
                }
            } else if draw.iter().enumerate().all(|(i, &x)| inside(i, x)) {
                vector = draw.into_iter().map(Some).collect();
            }
            if let Some(found) = vector.iter().copied().collect::<Option<Vec<f64>>>() {
                return Ok(found);
            }
        }
        Err(SimulationError::Truncation {
            part: self.part,
            k,
            attempts: MAX_ATTEMPTS,
        })
    }
}

/// `center` + G ξ with ξ_j = [`INSIDE`] · `xi`(j).
fn in_generators(of: &Uncertain, center: &[f64], mut xi: impl FnMut(usize) -> f64) -> Vec<f64> {
    let Some(g) = &of.generators else {
        return center.to_vec();
    };
    let xi: Vec<f64> = (0..g.cols()).map(|j| INSIDE * xi(j)).collect();
    center
        .iter()
        .enumerate()
        .map(|(i, c)| c + dot_in_order(g.row(i), &xi))
        .collect()
}

fn dot_in_order(row: &[f64], x: &[f64]) -> f64 {
    row.iter().zip(x).fold(0.0, |s, (a, x)| s + a * x)
}
