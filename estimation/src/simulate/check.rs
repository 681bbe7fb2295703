//! A truth and inputs held against the system and the number of steps.

use super::{DeltaLaw, Drawn, InitialState, Inputs, Law, Noise, SimulationError, Truth};
use crate::error::shortest;
use crate::problem::Uncertain;
use crate::random::{MAX_COMPONENTS, MAX_STEPS};
use crate::signal::{Signal, sum_at};
use crate::system::System;

impl Truth {
    /// Checks every part against the system and the number of steps, so that only a truncation that
    /// never succeeds or a state that diverges can fail later.
    pub fn validate<Y: System>(&self, system: &Y, steps: usize) -> Result<(), SimulationError> {
        let variables = system.variables();
        let (n, n_delta) = (variables.x.len(), system.n_delta());
        match &self.x0 {
            InitialState::Point(x) => finite("truth.x0", x, n)?,
            InitialState::Drawn(of) => {
                let at = |source| SimulationError::Uncertain {
                    part: "truth.x0",
                    source,
                };
                of.validate(n).map_err(at)?;
                without_constraints("truth.x0", of)?;
                if !(of.has_set() || of.has_gaussian()) {
                    return Err(part_error(
                        "truth.x0",
                        "a prior that is a set or has a covariance",
                        "a point",
                    ));
                }
            }
        }
        self.w
            .validate("truth.w", variables.w.len() - n_delta, steps)?;
        self.v.validate("truth.v", variables.v.len(), steps + 1)?;
        match (&self.delta, n_delta) {
            (Some(_), 0) => {
                return Err(part_error(
                    "truth.delta",
                    "no delta: the system has none",
                    "a law",
                ));
            }
            (None, 1..) => return Err(part_error("truth.delta", "a law", "none")),
            (Some(law), _) => law.validate(n_delta, steps)?,
            (None, 0) => {}
        }
        if steps >= MAX_STEPS || variables.w.len().max(n) >= MAX_COMPONENTS {
            let expected = format!("fewer than {MAX_STEPS} steps and {MAX_COMPONENTS} components");
            return Err(part_error("truth", expected, format!("{steps} steps")));
        }
        Ok(())
    }
}

impl Noise {
    /// Checks the noise against its dimension `n` and the number of vectors that will be asked for.
    fn validate(
        &self,
        part: &'static str,
        n: usize,
        vectors: usize,
    ) -> Result<(), SimulationError> {
        let components = |got: usize| {
            let expected = format!("signals for {n} components");
            if got == n {
                Ok(())
            } else {
                Err(part_error(part, expected, got.to_string()))
            }
        };
        match self {
            Noise::Drawn(drawn) => drawn.validate(part, n),
            Noise::Signals { terms, .. } => {
                components(terms.len())?;
                check_terms(part, terms.iter().enumerate().map(|(i, t)| (i, &t[..])))
            }
            Noise::Alternatives { alternatives, .. } => {
                components(alternatives.len())?;
                if let Some(i) = alternatives.iter().position(Vec::is_empty) {
                    let expected = format!("an alternative for component {}", i + 1);
                    return Err(part_error(part, expected, "none"));
                }
                let all = alternatives.iter().enumerate();
                check_terms(
                    part,
                    all.flat_map(|(i, list)| list.iter().map(move |t| (i, &t[..]))),
                )
            }
            Noise::Data(rows) => check_data(part, rows, n, vectors),
        }
    }
}

impl Drawn {
    fn validate(&self, part: &'static str, n: usize) -> Result<(), SimulationError> {
        self.of
            .validate(n)
            .map_err(|source| SimulationError::Uncertain { part, source })?;
        let reads_set = matches!(self.law, Law::Uniform | Law::Vertices | Law::Mixed);
        if reads_set && !self.of.has_set() {
            return Err(part_error(part, "a box or generators for this law", "none"));
        }
        if reads_set {
            without_constraints(part, &self.of)?;
        }
        if matches!(self.law, Law::Gaussian | Law::Mixed) && !self.of.has_gaussian() {
            return Err(part_error(part, "a covariance for this law", "none"));
        }
        if self.truncate && self.law != Law::Gaussian {
            return Err(part_error(
                part,
                "the gaussian law beside truncate",
                "another law",
            ));
        }
        if self.truncate && self.of.bounds.is_none() {
            return Err(part_error(part, "a box to truncate to", "none"));
        }
        if self.of.generator_matrix().cols() >= MAX_COMPONENTS {
            let expected = format!("fewer than {MAX_COMPONENTS} generators");
            return Err(part_error(part, expected, "more"));
        }
        Ok(())
    }
}

impl DeltaLaw {
    fn validate(&self, n: usize, steps: usize) -> Result<(), SimulationError> {
        let part = "truth.delta";
        match self {
            DeltaLaw::Signals { terms } => {
                if terms.len() != n {
                    let expected = format!("signals for {n} components");
                    return Err(part_error(part, expected, terms.len().to_string()));
                }
                check_terms(part, terms.iter().enumerate().map(|(i, t)| (i, &t[..])))?;
                for k in 0..steps {
                    if let Some(value) = terms.iter().map(|t| sum_at(t, k)).find(|d| d.abs() > 1.0)
                    {
                        let expected = "signals within [-1, 1]";
                        return Err(part_error(
                            part,
                            expected,
                            format!("{} at step {k}", shortest(value)),
                        ));
                    }
                }
                Ok(())
            }
            DeltaLaw::Constant { value } if value.is_nan() || value.abs() > 1.0 => {
                Err(part_error(part, "a value in [-1, 1]", shortest(*value)))
            }
            DeltaLaw::Sine(wave) => {
                let at = |source| SimulationError::Signal {
                    part,
                    component: 1,
                    source,
                };
                Signal::Sine(wave.clone()).validate().map_err(at)?;
                let largest = wave.amplitude.abs() + wave.offset.abs();
                if largest > 1.0 {
                    return Err(part_error(
                        part,
                        "a sine within [-1, 1]",
                        format!("up to {}", shortest(largest)),
                    ));
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

impl Inputs {
    /// Checks the inputs against the system and the last step.
    pub fn validate<Y: System>(&self, system: &Y, steps: usize) -> Result<(), SimulationError> {
        let n = system.variables().u.len();
        match self {
            Inputs::Constant(u) => finite("inputs", u, n),
            Inputs::Signals(terms) => {
                if terms.len() != n {
                    let expected = format!("signals for {n} components");
                    return Err(part_error("inputs", expected, terms.len().to_string()));
                }
                check_terms("inputs", terms.iter().enumerate().map(|(i, t)| (i, &t[..])))
            }
            Inputs::Data(rows) => check_data("inputs", rows, n, steps + 1),
            Inputs::Controller(controller) => match controller.start(system) {
                Some(_) => Ok(()),
                None => Err(part_error(
                    "inputs",
                    "a system that the controller can drive",
                    system.kind(),
                )),
            },
        }
    }
}

fn part_error(
    part: &'static str,
    expected: impl Into<String>,
    got: impl Into<String>,
) -> SimulationError {
    SimulationError::Part {
        part,
        expected: expected.into(),
        got: got.into(),
    }
}

fn finite(part: &'static str, v: &[f64], n: usize) -> Result<(), SimulationError> {
    if v.len() != n {
        return Err(part_error(
            part,
            format!("{n} numbers"),
            v.len().to_string(),
        ));
    }
    match v.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(part_error(part, "finite numbers", shortest(*x))),
        None => Ok(()),
    }
}

fn check_data(
    part: &'static str,
    rows: &[Vec<f64>],
    n: usize,
    vectors: usize,
) -> Result<(), SimulationError> {
    if rows.len() < vectors {
        return Err(part_error(
            part,
            format!("data for {vectors} steps"),
            rows.len().to_string(),
        ));
    }
    rows.iter().try_for_each(|row| finite(part, row, n))
}

fn check_terms<'a>(
    part: &'static str,
    components: impl Iterator<Item = (usize, &'a [Signal])>,
) -> Result<(), SimulationError> {
    for (i, terms) in components {
        for term in terms {
            term.validate().map_err(|source| SimulationError::Signal {
                part,
                component: i + 1,
                source,
            })?;
        }
    }
    Ok(())
}

pub(super) fn unambiguous(part: &'static str, of: &Uncertain) -> Result<(), SimulationError> {
    match (of.has_set(), of.has_gaussian()) {
        (true, false) => Ok(()),
        (true, true) => {
            let expected = "it to be given: a set and a covariance are assumed, and the truth can follow either";
            Err(part_error(part, expected, "nothing"))
        }
        (false, true) => Err(part_error(
            part,
            "it to be given: only a covariance is assumed",
            "nothing",
        )),
        (false, false) => Err(part_error(
            part,
            "it to be given: no set is assumed",
            "nothing",
        )),
    }
}

fn without_constraints(part: &'static str, of: &Uncertain) -> Result<(), SimulationError> {
    match &of.constraints {
        Some(_) => Err(part_error(
            part,
            "a set without constraints to draw from",
            "constraints",
        )),
        None => Ok(()),
    }
}
