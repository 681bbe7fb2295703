//! The recursion predict → update → reduce_order as an iterator of steps.
//!
//! Clocks, counters and judges stand around `next()`; none enters an estimator.

use crate::estimator::{Estimator, Measurement};
use crate::{AnyBelief, EstimationError};

/// What an estimator knew at step k, before and after y_k.
#[derive(Clone, Debug)]
pub struct Step<B = AnyBelief> {
    /// k; 0 is the start.
    pub k: usize,
    /// The predicted belief (at k = 0 the prior); None where the prediction itself failed.
    pub predicted: Option<B>,
    /// The updated belief before `reduce_order`, or why there is none: then this step is the last.
    pub updated: Result<B, EstimationError>,
}

/// What an estimator is given, step by step.
pub trait Data {
    /// u_k; empty for a system without inputs.
    fn input(&self, k: usize) -> &[f64];
    /// y_k, with None for a component that was not measured.
    fn measurement(&self, k: usize) -> Measurement<'_>;
}

/// u_k and y_k of every step.
pub type Given<'a> = (&'a [Vec<f64>], &'a [Vec<Option<f64>>]);

/// The inputs and the measurements of every step; one that is missing altogether is of dimension 0.
impl Data for (&[Vec<f64>], &[Vec<Option<f64>>]) {
    fn input(&self, k: usize) -> &[f64] {
        self.0.get(k).map_or(&[], Vec::as_slice)
    }
    fn measurement(&self, k: usize) -> Measurement<'_> {
        self.1.get(k).map_or(&[], Vec::as_slice)
    }
}

/// Runs `estimator` from k = 0 to k = `steps`.
///
/// `inputs[k]` is u_k; an empty slice stands for a system without inputs. `measurements[k]` is y_k.
/// At k = 0 the predicted belief is the prior, and so is the updated one where the paper's estimator
/// starts with y_1. An error, [`EstimationError::Inconsistent`] among them, ends the iterator after
/// the step that holds it; a measurement or an input that is missing altogether is one of dimension 0.
pub fn track<'a, E: Estimator>(
    estimator: &'a E,
    steps: usize,
    inputs: &'a [Vec<f64>],
    measurements: &'a [Vec<Option<f64>>],
) -> Track<'a, E, Given<'a>> {
    Track::new(estimator, steps, (inputs, measurements))
}

/// The steps of an estimator on recorded data; see [`track`].
#[derive(Debug)]
pub struct Track<'a, E: Estimator, D> {
    estimator: &'a E,
    steps: usize,
    data: D,
    k: usize,
    run: u64,
    /// The updated belief of the step before, not yet reduced.
    belief: Option<E::Belief>,
    ended: bool,
}

impl<'a, E: Estimator, D: Data> Track<'a, E, D> {
    /// As [`track`], on data that need not lie in lists.
    pub fn new(estimator: &'a E, steps: usize, data: D) -> Self {
        Self {
            estimator,
            steps,
            data,
            k: 0,
            run: 0,
            belief: None,
            ended: false,
        }
    }

    /// As one of several runs: an estimator that draws random numbers draws those of this run.
    pub fn of_run(mut self, run: u64) -> Self {
        self.run = run;
        self
    }

    fn predict(&mut self, k: usize) -> Result<E::Belief, EstimationError> {
        match self.belief.take() {
            None => Ok(self.estimator.prior_of_run(self.run)),
            Some(belief) => {
                let belief = self.estimator.reduce_order(k - 1, belief)?;
                let input = self.data.input(k - 1);
                self.estimator.predict(k, &belief, input)
            }
        }
    }
}

impl<E: Estimator, D: Data> Iterator for Track<'_, E, D> {
    type Item = Step<E::Belief>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended || self.k > self.steps {
            return None;
        }
        let k = self.k;
        self.k += 1;
        let predicted = match self.predict(k) {
            Ok(belief) => belief,
            Err(error) => {
                self.ended = true;
                return Some(Step {
                    k,
                    predicted: None,
                    updated: Err(error),
                });
            }
        };
        let updated = if k == 0 && !self.estimator.uses_first_measurement() {
            Ok(predicted.clone())
        } else {
            let (u, y) = (self.data.input(k), self.data.measurement(k));
            self.estimator.update(k, &predicted, u, y)
        };
        match &updated {
            Ok(belief) => self.belief = Some(belief.clone()),
            Err(_) => self.ended = true,
        }
        Some(Step {
            k,
            predicted: Some(predicted),
            updated,
        })
    }
}
