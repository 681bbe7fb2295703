//! One estimator in the loop of a running system: a step at a time, measurements that may be missing.
//!
//! [`track`](crate::track()) runs over recorded data; here the data arrive. There is no clock in here: how long a
//! step may take, and what is used in place of one that takes longer, is for the caller to say, who has the clock.
//!
//! After the first steps a step of `kalman`, `zmv`, `zfo`, and with C2 or C3 of `czmv` and the lean `czfo`, asks the allocator
//! for nothing: what it makes lies in [`List`](zonobench_sets::List)s, whose memory stays with the thread. A step that needs a
//! longer list than all before it still asks, once. `docs/cost.md` has the counts.
//!
//! `examples/online.rs` shows a loop with a deadline and a second, cheaper estimator that steps in.

use crate::EstimationError;
use crate::estimator::{Estimator, Measurement};

/// An estimator with what it knows at present.
///
/// ```
/// # use zonobench_estimation::{AnyEstimator, Belief, EstimationError, Online, Problem, Uncertain};
/// # use zonobench_estimation::{AnySystem, systems::VanDerPol};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let boxed = |r: f64, n: usize| Uncertain::from_box(&vec![-r; n], &vec![r; n]);
/// # let problem = Problem {
/// #     system: AnySystem::VanDerPol(VanDerPol::new(0.1)?),
/// #     prior: boxed(0.5, 2)?, w: boxed(0.01, 2)?, v: boxed(0.1, 1)?,
/// # };
/// let settings = serde_json::from_str(r#"{"kind": "czmv", "generators": 12, "constraints": 3}"#)?;
/// let mut filter = Online::new(AnyEstimator::new(&settings, &problem)?);
/// for y in [Some(0.05), None, Some(0.02)] {
///     let belief = filter.step(&[], &[y])?;
///     println!("{:?}", belief.interval_hull());
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Online<E: Estimator> {
    estimator: E,
    belief: E::Belief,
    /// The step of `belief`.
    k: usize,
    /// Whether y_k was taken in (or stands for nothing).
    measured: bool,
    started: bool,
}

impl<E: Estimator> Online<E> {
    /// The estimator with its prior, before k = 0 is measured.
    pub fn new(estimator: E) -> Self {
        Self {
            belief: estimator.prior(),
            estimator,
            k: 0,
            measured: false,
            started: false,
        }
    }

    /// The step that [`Online::belief`] is about.
    pub fn k(&self) -> usize {
        self.k
    }

    /// What is known of x_k.
    pub fn belief(&self) -> &E::Belief {
        &self.belief
    }

    /// The estimator.
    pub fn estimator(&self) -> &E {
        &self.estimator
    }

    /// One period: `u` was applied since the last step and is held, `y` is measured now, `None` for a component
    /// that is not. The first call is k = 0 and only measures; its `u` matters where h holds the input.
    ///
    /// Where the measurement equation holds an input that has just changed, call [`Online::advance`] and
    /// [`Online::measure`] instead.
    ///
    /// Fails as the estimator does. An error leaves everything as it was before the call: after
    /// [`EstimationError::Inconsistent`] the same step can be made without a measurement.
    pub fn step(&mut self, u: &[f64], y: Measurement) -> Result<&E::Belief, EstimationError> {
        let (k, predicted) = match self.started {
            true => (self.k + 1, Some(self.predicted(u)?)),
            false => (0, None),
        };
        let before = predicted.as_ref().unwrap_or(&self.belief);
        self.belief = self.updated(k, before, u, y)?;
        (self.k, self.measured, self.started) = (k, true, true);
        Ok(&self.belief)
    }

    /// To the next step under the input `u`, without a measurement yet. An error changes nothing.
    pub fn advance(&mut self, u: &[f64]) -> Result<&E::Belief, EstimationError> {
        self.belief = self.predicted(u)?;
        self.k += 1;
        (self.measured, self.started) = (false, true);
        Ok(&self.belief)
    }

    /// Takes in y_k of the present step, once; `u` is u_k. An error changes nothing.
    pub fn measure(&mut self, u: &[f64], y: Measurement) -> Result<&E::Belief, EstimationError> {
        if !self.measured {
            self.belief = self.updated(self.k, &self.belief, u, y)?;
            (self.measured, self.started) = (true, true);
        }
        Ok(&self.belief)
    }

    fn predicted(&self, u: &[f64]) -> Result<E::Belief, EstimationError> {
        let reduced = self.estimator.reduce_order(self.k, self.belief.clone())?;
        self.estimator.predict(self.k + 1, &reduced, u)
    }

    fn updated(
        &self,
        k: usize,
        belief: &E::Belief,
        u: &[f64],
        y: Measurement,
    ) -> Result<E::Belief, EstimationError> {
        if k == 0 && !self.estimator.uses_first_measurement() {
            return Ok(belief.clone());
        }
        self.estimator.update(k, belief, u, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::Belief;
    use crate::systems::Raimondo;
    use crate::{AnyEstimator, AnySystem, Problem, Uncertain, track};

    fn filter(settings: &str) -> AnyEstimator {
        let boxed = |r: f64| Uncertain::from_box(&[-r, -r], &[r, r]).unwrap();
        let problem = Problem {
            system: AnySystem::Raimondo(Raimondo::default()),
            prior: boxed(0.5),
            w: boxed(0.1),
            v: boxed(0.1),
        };
        AnyEstimator::new(&serde_json::from_str(settings).unwrap(), &problem).unwrap()
    }

    const CZMV: &str = r#"{"kind": "czmv", "generators": 12, "constraints": 3}"#;

    #[test]
    fn steps_one_at_a_time_are_the_steps_of_a_track() {
        let y = [
            vec![Some(0.1), None],
            vec![None, None],
            vec![Some(0.3), Some(0.0)],
            vec![None, Some(-1.3)],
        ];
        for settings in [CZMV, r#"{"kind": "zmv", "generators": 8}"#] {
            let estimator = filter(settings);
            let mut online = Online::new(estimator.clone());
            for (step, y) in track(&estimator, 3, &[], &y).zip(&y) {
                let belief = online.step(&[], y).unwrap();
                assert_eq!(
                    step.updated.unwrap().interval_hull(),
                    belief.interval_hull()
                );
                assert_eq!(online.k(), step.k);
            }
            let mut halves = Online::new(estimator);
            for (k, y) in y.iter().enumerate() {
                if k > 0 {
                    halves.advance(&[]).unwrap();
                }
                halves.measure(&[], y).unwrap();
            }
            assert_eq!(
                halves.belief().interval_hull(),
                online.belief().interval_hull()
            );
        }
    }

    #[test]
    fn a_measurement_that_contradicts_leaves_the_filter_as_it_was() {
        let mut online = Online::new(filter(CZMV));
        online.step(&[], &[Some(0.1), Some(0.0)]).unwrap();
        let before = online.belief().interval_hull();
        let error = online.step(&[], &[Some(50.0), None]).unwrap_err();
        assert!(matches!(error, EstimationError::Inconsistent { k: 1 }));
        assert_eq!((online.k(), online.belief().interval_hull()), (0, before));
        online.step(&[], &[None, None]).unwrap();
        assert_eq!(online.k(), 1);
    }
}
