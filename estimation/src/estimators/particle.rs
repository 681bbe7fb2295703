//! The bootstrap particle filter.

use super::kalman::{Gaussian, Innovated};
use super::linear_output::congruence;
use super::moments::{Model, difference};
use crate::error::before;
use crate::estimator::{Belief, Containment, Estimator, Extra, Measurement, Phase, Shape, Size};
use crate::random::{Draws, MAX_COMPONENTS, Purpose};
use crate::{EstimationError, Problem};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zonobench_sets::covariance::Scaled;
use zonobench_sets::number::{Function, partial_jacobian};
use zonobench_sets::{Interval, IntervalVector, List, Matrix};

const KIND: &str = "particle";

/// The settings of [`Particle`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParticleSettings {
    /// N, from 2 to 65 536.
    #[serde(default = "thousand")]
    pub particles: usize,
    /// The share of N, in [0, 1], below which the effective number of particles makes the filter resample.
    #[serde(default = "half")]
    pub resample_below: f64,
    /// The seed of its own random numbers.
    #[serde(default)]
    pub seed: u64,
    /// Whether differences of components in rad are taken in (−π, π].
    #[serde(default)]
    pub wrap: bool,
}

fn thousand() -> usize {
    1000
}

fn half() -> f64 {
    0.5
}

/// N weighted points, and their mean and covariance. It has no set.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticleBelief {
    run: u64,
    /// N × n.
    points: Matrix,
    /// They sum to 1.
    weights: List<f64>,
    gaussian: Gaussian,
}

impl ParticleBelief {
    /// The points, N × n; one of weight 0 may hold numbers that are not finite.
    pub fn points(&self) -> &Matrix {
        &self.points
    }

    /// Their weights, which sum to 1.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// 1 / Σ w_i², the effective number of particles: N for equal weights, 1 where one has it all.
    pub fn effective(&self) -> f64 {
        1.0 / self.weights.iter().map(|w| w * w).sum::<f64>()
    }
}

impl Belief for ParticleBelief {
    fn center(&self) -> Vec<f64> {
        self.gaussian.center()
    }
    fn interval_hull(&self) -> Option<IntervalVector> {
        None
    }
    fn contains(&self, _x: &[Interval]) -> Containment {
        Containment::Undecided
    }
    fn covariance(&self) -> Option<&Matrix> {
        self.gaussian.covariance()
    }
    fn size(&self) -> Size {
        Size::default()
    }
    /// The ellipse of mean and covariance.
    fn shape(&self) -> Shape {
        self.gaussian.shape()
    }
    fn extras(&self) -> Vec<Extra> {
        self.gaussian.extras()
    }
    fn status(&self) -> Option<&'static str> {
        self.gaussian.status()
    }
}

/// The bootstrap particle filter:
///
/// start: x_i ~ N(x̄_0, P_0);
/// predict: where 1/Σ w_i² < `resample_below` · N, systematic resampling: the new points are those at which the sums of
/// weights pass (U + i)/N, i = 0 … N − 1, with one U uniform in [0, 1); then x_i ← f(k−1, x_i, u, w_i), w_i ~ N(w̄, Q);
/// update: w_i ∝ w_i N(y − h(k, x_i, u, v̄); 0, V R Vᵀ), V = ∂h/∂v at (x_i, v̄).
///
/// Its estimate is the weighted mean, its covariance the weighted one. Moments, missing components and `wrap` are as in
/// [`Ekf`](super::Ekf): all noises are taken for Gaussian with their mean and covariance; the mean of an angle is the
/// one about its circular mean. V R Vᵀ must be positive definite, and some particle must have a likelihood above 0;
/// where it is not so, the belief is the prediction, with the status `singular`, and the run goes on. A particle at which f or
/// h is not defined has the weight 0; where none is left, the filter refuses to go on.
///
/// The random numbers depend on `seed`, run, step, particle and component alone. The updated belief has read
/// y_0 … y_k. No set, so never guaranteed.
///
/// Source: \[Gordon1993\]; resampling: [Kitagawa1996, Appendix].
#[derive(Clone, Debug)]
pub struct Particle {
    model: Model,
    settings: ParticleSettings,
    /// Factors of the covariances of x_0 and w.
    x0: Matrix,
    w: Matrix,
}

impl Particle {
    /// Fails where a setting is out of range or a part of the problem has no moments.
    pub fn new(settings: &ParticleSettings, problem: &Problem) -> Result<Self, EstimationError> {
        if !(2..=MAX_COMPONENTS).contains(&settings.particles) {
            let expected = format!("from 2 to {MAX_COMPONENTS}");
            let got = settings.particles;
            return Err(EstimationError::setting(KIND, "particles", expected, got));
        }
        if !(0.0..=1.0).contains(&settings.resample_below) {
            let got = settings.resample_below;
            return Err(EstimationError::setting(
                KIND,
                "resample_below",
                "in [0, 1]",
                got,
            ));
        }
        let model = Model::new(KIND, problem, settings.wrap)?;
        Ok(Self {
            settings: settings.clone(),
            x0: Scaled::new(&model.prior.covariance).factor(),
            w: Scaled::new(&model.w.covariance).factor(),
            model,
        })
    }

    fn draws(&self, purpose: Purpose, run: u64) -> Draws {
        Draws::new(self.settings.seed, purpose, run)
    }

    /// The places of the particles that the new ones begin from.
    fn resampled(&self, k: usize, belief: &ParticleBelief) -> List<usize> {
        let n = self.settings.particles;
        let mut draws = self.draws(Purpose::Resample, belief.run);
        // From [−1, 1) to [0, 1).
        let start = 0.5 * (draws.uniform(k, 0, 0) + 1.0);
        let last = (0..n).rev().find(|&i| belief.weights[i] > 0.0);
        let last = last.expect("weights sum to 1");
        let (mut at, mut sum) = (0, belief.weights[0]);
        (0..n)
            .map(|i| {
                let wanted = (start + i as f64) / n as f64;
                // Beyond the last one rounding alone can lead.
                while sum <= wanted && at < last {
                    at += 1;
                    sum += belief.weights[at];
                }
                at
            })
            .collect()
    }

    /// The belief of these points; `Refused` where none has a weight, `Overflow` where they are too far out.
    fn belief(
        &self,
        k: usize,
        op: &'static str,
        run: u64,
        points: Matrix,
        weights: List<f64>,
    ) -> Result<ParticleBelief, EstimationError> {
        let (mean, covariance) = weighted(&points, &weights, &self.model.angles_x);
        Ok(ParticleBelief {
            run,
            gaussian: Gaussian::new(mean, covariance).finite(k, op)?,
            points,
            weights,
        })
    }

    fn nothing_left(&self, k: usize, what: &str) -> EstimationError {
        EstimationError::Refused {
            k,
            kind: KIND,
            reason: format!("{what} is not defined at any particle"),
        }
    }
}

/// Weights as they are, made to sum to 1; None where they sum to 0.
fn normalized(mut weights: List<f64>) -> Option<List<f64>> {
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    (sum > 0.0).then_some(weights)
}

/// Mean and covariance of the rows of `points`, those of weight 0 left out.
fn weighted(points: &Matrix, weights: &[f64], angles: &[bool]) -> (List<f64>, Matrix) {
    let rows = || {
        let all = weights.iter().enumerate().filter(|(_, w)| **w > 0.0);
        all.map(|(i, w)| (points.row(i), *w))
    };
    let mean: List<f64> = angles
        .iter()
        .enumerate()
        .map(|(j, angle)| {
            let sum = |of: &dyn Fn(f64) -> f64| rows().map(|(x, w)| w * of(x[j])).sum::<f64>();
            let mean = sum(&|x| x);
            if !angle {
                return mean;
            }
            let turned = libm::atan2(sum(&libm::sin), sum(&libm::cos));
            // The circular mean, in the turn of the plain one.
            let about = turned + TAU * libm::round((mean - turned) / TAU);
            about + sum(&|x| difference(true, x, about))
        })
        .collect();
    let mut deviations = Matrix::zeros(angles.len(), weights.len());
    for (i, (x, w)) in rows().enumerate() {
        let root = w.sqrt();
        for (j, &angle) in angles.iter().enumerate() {
            deviations[(j, i)] = root * difference(angle, x[j], mean[j]);
        }
    }
    (mean, deviations.gram())
}

/// V R Vᵀ of the measured components, and its Cholesky factor.
struct Noise {
    by_noise: Matrix,
    covariance: Matrix,
    factor: Matrix,
}

/// Σ t_i² of t with L t = z.
fn squared_distance(l: &Matrix, z: &[f64]) -> f64 {
    let mut t = List::from(z);
    let mut sum = 0.0;
    for i in 0..z.len() {
        for j in 0..i {
            t[i] -= l[(i, j)] * t[j];
        }
        t[i] /= l[(i, i)];
        sum += t[i] * t[i];
    }
    sum
}

impl Estimator for Particle {
    type Belief = ParticleBelief;

    fn prior(&self) -> ParticleBelief {
        self.prior_of_run(0)
    }

    fn prior_of_run(&self, run: u64) -> ParticleBelief {
        let (n, count) = (self.model.n(), self.settings.particles);
        let mut draws = self.draws(Purpose::ParticleX0, run);
        let mut points = Matrix::zeros(count, n);
        let mut drawn = List::filled(0.0, n);
        for i in 0..count {
            draws.gaussians(0, i, &mut drawn);
            let x = points.row_mut(i);
            x.copy_from_slice(&self.model.prior.mean);
            self.x0.add_mul_vec(&drawn, x);
        }
        let weights = List::filled(1.0 / count as f64, count);
        let (mean, covariance) = weighted(&points, &weights, &self.model.angles_x);
        ParticleBelief {
            run,
            gaussian: Gaussian::new(mean, covariance),
            points,
            weights,
        }
    }

    fn predict(
        &self,
        k: usize,
        belief: &ParticleBelief,
        u_prev: &[f64],
    ) -> Result<ParticleBelief, EstimationError> {
        let model = &self.model;
        model.check_input(u_prev)?;
        let (n, count) = (model.n(), self.settings.particles);
        let resample = belief.effective() < self.settings.resample_below * count as f64;
        let (from, mut weights): (List<usize>, _) = match resample {
            true => {
                let equal = List::filled(1.0 / count as f64, count);
                (self.resampled(k, belief), equal)
            }
            false => ((0..count).collect(), belief.weights.clone()),
        };
        let f = model.motion(before(k)?, u_prev);
        let mut draws = self.draws(Purpose::ParticleW, belief.run);
        let mut points = Matrix::zeros(count, n);
        let mut drawn = List::filled(0.0, model.w.mean.len());
        let mut at = List::filled(0.0, f.inputs());
        for (i, &from) in from.iter().enumerate() {
            if weights[i] == 0.0 {
                continue;
            }
            let (x, w) = at.split_at_mut(n);
            x.copy_from_slice(belief.points.row(from));
            draws.gaussians(k, i, &mut drawn);
            w.copy_from_slice(&model.w.mean);
            self.w.add_mul_vec(&drawn, w);
            f.evaluate(&at, points.row_mut(i));
            if points.row(i).iter().any(|x| !x.is_finite()) {
                weights[i] = 0.0;
            }
        }
        let weights = normalized(weights).ok_or_else(|| self.nothing_left(k, "f"))?;
        self.belief(k, "predict", belief.run, points, weights)
    }

    fn update(
        &self,
        k: usize,
        belief: &ParticleBelief,
        u: &[f64],
        y: Measurement,
    ) -> Result<ParticleBelief, EstimationError> {
        let model = &self.model;
        let rows = model.measured(u, y)?;
        if rows.is_empty() {
            return Ok(belief.clone());
        }
        let singular = || ParticleBelief {
            gaussian: belief.gaussian.clone().singular(),
            ..belief.clone()
        };
        let (n, count, m) = (model.n(), self.settings.particles, rows.len());
        let h = model.output(k, u);
        let mut at = List::concat(&[&model.prior.mean, &model.v.mean]);
        let mut logarithms = List::filled(f64::NEG_INFINITY, count);
        let mut expected = Matrix::zeros(count, m);
        let mut mean_noise = Matrix::zeros(m, m);
        let mut noise: Option<Noise> = None;
        // ln det of a factor beside that of the first particle, which no unit moves.
        let mut first: Option<List<f64>> = None;
        let mut z = List::filled(0.0, m);
        let mut usable = belief.weights.clone();
        for i in 0..count {
            if belief.weights[i] == 0.0 {
                continue;
            }
            at[..n].copy_from_slice(belief.points.row(i));
            let j = partial_jacobian(&h, &at, n..at.len());
            let by_noise = Matrix::from_fn(m, j.inputs(), |r, l| j.get(rows[r], l));
            for ((place, &row), y) in rows.iter().enumerate().zip(y.iter().flatten()) {
                expected[(i, place)] = j.value[row];
                z[place] = model.difference_y(row, *y, j.value[row]);
            }
            if z.iter().any(|z| !z.is_finite()) || !by_noise.is_finite() {
                usable[i] = 0.0;
                continue;
            }
            if noise
                .as_ref()
                .is_none_or(|known| known.by_noise != by_noise)
            {
                let covariance = congruence(&by_noise, &model.v.covariance);
                let Ok(factor) = covariance.cholesky() else {
                    return Ok(singular());
                };
                noise = Some(Noise {
                    by_noise,
                    covariance,
                    factor,
                });
            }
            let known = noise.as_ref().expect("it was made above");
            let diagonal = |i: usize| known.factor[(i, i)];
            let first = first.get_or_insert_with(|| (0..m).map(diagonal).collect());
            let spread: f64 = (0..m).map(|i| libm::log(diagonal(i) / first[i])).sum();
            let distance = squared_distance(&known.factor, &z);
            logarithms[i] = libm::log(belief.weights[i]) - 0.5 * distance - spread;
            for (sum, r) in mean_noise
                .as_mut_slice()
                .iter_mut()
                .zip(known.covariance.as_slice())
            {
                *sum += belief.weights[i] * r;
            }
        }
        let usable = normalized(usable).ok_or_else(|| self.nothing_left(k, "h"))?;
        let greatest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weight = |l: &f64| match greatest > f64::NEG_INFINITY {
            true => libm::exp(l - greatest),
            false => 0.0,
        };
        let Some(weights) = normalized(logarithms.iter().map(weight).collect()) else {
            return Ok(singular());
        };
        let angles: List<bool> = rows.iter().map(|&i| model.angles_y[i]).collect();
        let (center, mut s) = weighted(&expected, &usable, &angles);
        s.add_assign(&mean_noise);
        for ((place, &row), y) in rows.iter().enumerate().zip(y.iter().flatten()) {
            z[place] = model.difference_y(row, *y, center[place]);
        }
        let mut updated = self.belief(k, "update", belief.run, belief.points.clone(), weights)?;
        updated.gaussian.innovated = Innovated::new(&s, &z);
        Ok(updated)
    }

    fn guaranteed(&self) -> bool {
        false
    }
    fn reads(&self) -> &'static str {
        "y_0 to y_k"
    }
    fn reported_phase(&self) -> Phase {
        Phase::Updated
    }
    fn readings(&self) -> Vec<(&'static str, &'static str)> {
        self.model.sources()
    }
}
