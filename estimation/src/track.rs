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
) -> Track<'a, E> {
    Track {
        estimator,
        steps,
        inputs,
        measurements,
        k: 0,
        belief: None,
        ended: false,
    }
}

/// See [`track`].
#[derive(Debug)]
pub struct Track<'a, E: Estimator> {
    estimator: &'a E,
    steps: usize,
    inputs: &'a [Vec<f64>],
    measurements: &'a [Vec<Option<f64>>],
    k: usize,
    /// The updated belief of the step before, not yet reduced.
    belief: Option<E::Belief>,
    ended: bool,
}

impl<'a, E: Estimator> Track<'a, E> {
    fn input(&self, k: usize) -> &'a [f64] {
        self.inputs.get(k).map_or(&[], Vec::as_slice)
    }

    fn measurement(&self, k: usize) -> Measurement<'a> {
        self.measurements.get(k).map_or(&[], Vec::as_slice)
    }

    fn predict(&mut self, k: usize) -> Result<E::Belief, EstimationError> {
        match self.belief.take() {
            None => Ok(self.estimator.prior()),
            Some(belief) => {
                let belief = self.estimator.reduce_order(k - 1, belief)?;
                self.estimator.predict(k, &belief, self.input(k - 1))
            }
        }
    }
}

impl<E: Estimator> Iterator for Track<'_, E> {
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
            self.estimator
                .update(k, &predicted, self.input(k), self.measurement(k))
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
