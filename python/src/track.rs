//! Whole runs: an estimator on recorded data, and a simulated truth.

use crate::errors::{error, of_estimation, of_simulation};
use crate::estimator::{PyBelief, PyEstimator, measured};
use crate::numbers::{LARGEST, matrix, matrix_with_gaps, shaped_2, shaped_3, vector, vector_of};
use crate::problem::PyProblem;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::sync::Mutex;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use zonobench_estimation::simulate::{Drawn, InitialState, Law, Noise};
use zonobench_estimation::{
    AnyBelief, Belief, EstimationError, Inputs, System, Truth, simulate as simulated,
    track as steps_of,
};
use zonobench_sets::Matrix;

/// How often a long call looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

fn rows(m: &Matrix) -> Vec<Vec<f64>> {
    (0..m.rows()).map(|i| m.row(i).to_vec()).collect()
}

/// A matrix with a row for every step, or a vector where a row is one number.
fn by_step(what: &str, given: &Bound<'_, PyAny>, n: usize, gaps: bool) -> PyResult<Matrix> {
    let is_vector = n == 1 && crate::numbers::dimensions(what, given)? == 1;
    let m = match (is_vector, gaps) {
        (true, true) => Matrix::column(&crate::numbers::vector_with_gaps(what, given)?),
        (true, false) => Matrix::column(&vector(what, given)?),
        (false, true) => matrix_with_gaps(what, given)?,
        (false, false) => matrix(what, given)?,
    };
    if m.cols() != n {
        let got = m.cols();
        return Err(error(format!(
            "{what}: expected {n} columns, one a component, got {got}"
        )));
    }
    Ok(m)
}

/// What is kept of one phase of a run.
struct Phase {
    center: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    covariance: Vec<f64>,
    has_covariance: bool,
}

impl Phase {
    fn new(steps: usize) -> Self {
        let room = |n| Vec::with_capacity(n * (steps + 1));
        Self {
            center: room(1),
            lower: room(1),
            upper: room(1),
            covariance: Vec::new(),
            has_covariance: false,
        }
    }

    fn push(&mut self, belief: Option<&AnyBelief>, n: usize) {
        let nothing = || std::iter::repeat_n(f64::NAN, n);
        match belief {
            Some(belief) => {
                self.center.extend(belief.center());
                match belief.interval_hull() {
                    Some(hull) => {
                        self.lower.extend(hull.lower());
                        self.upper.extend(hull.upper());
                    }
                    None => {
                        self.lower.extend(nothing());
                        self.upper.extend(nothing());
                    }
                }
            }
            None => {
                self.center.extend(nothing());
                self.lower.extend(nothing());
                self.upper.extend(nothing());
            }
        }
        match belief.and_then(Belief::covariance) {
            Some(p) => {
                self.has_covariance = true;
                self.covariance.extend_from_slice(p.as_slice());
            }
            None => self.covariance.extend(std::iter::repeat_n(f64::NAN, n * n)),
        }
    }

    fn into_dict<'py>(self, py: Python<'py>, n: usize) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let steps = self.center.len() / n;
        dict.set_item("center", shaped_2(py, self.center, [steps, n])?)?;
        dict.set_item("lower", shaped_2(py, self.lower, [steps, n])?)?;
        dict.set_item("upper", shaped_2(py, self.upper, [steps, n])?)?;
        let covariance = self
            .has_covariance
            .then(|| shaped_3(py, self.covariance, [steps, n, n]))
            .transpose()?;
        dict.set_item("covariance", covariance)?;
        Ok(dict)
    }
}

/// A run so far.
struct Run {
    predicted: Phase,
    updated: Phase,
    kept: Vec<(usize, AnyBelief)>,
    ended: Option<(usize, EstimationError)>,
}

/// The run of an estimator over k = 0 ... N, as a dictionary of arrays; `zonobench.track` makes an object of it.
#[pyfunction]
#[pyo3(signature = (estimator, y, u, keep))]
pub fn _track<'py>(
    py: Python<'py>,
    estimator: &Bound<'py, PyEstimator>,
    y: &Bound<'py, PyAny>,
    u: Option<&Bound<'py, PyAny>>,
    keep: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let of = estimator.get();
    let [p, m] = of.sizes;
    let y = by_step("y", y, m, true)?;
    if y.rows() == 0 {
        return Err(error(
            "y: expected a row for every step k = 0, 1, ..., got none",
        ));
    }
    let last = y.rows() - 1;
    let y: Vec<Vec<Option<f64>>> = (0..=last)
        .map(|k| measured("y", y.row(k)))
        .collect::<PyResult<_>>()?;
    let u = match u {
        None if p == 0 => Vec::new(),
        None => {
            return Err(error(format!(
                "u: expected a row of {p} numbers for every step, because the system has inputs; got none"
            )));
        }
        Some(u) => {
            let mut u = rows(&by_step("u", u, p, false)?);
            // Where the measurement does not hold the input, nothing reads that of the last step.
            if u.len() == last && !of.measures_input {
                u.push(vec![0.0; p]);
            }
            if u.len() != last + 1 {
                let got = u.len();
                return Err(error(format!(
                    "u: expected {} rows as y has, got {got}",
                    last + 1
                )));
            }
            u
        }
    };
    let n = zonobench_estimation::Estimator::prior(&of.estimator)
        .center()
        .len();
    if (last + 1).saturating_mul(n * n) > LARGEST {
        return Err(error(format!("y: expected fewer steps, got {}", last + 1)));
    }
    let run = py.detach(|| -> PyResult<Run> {
        let mut run = Run {
            predicted: Phase::new(last),
            updated: Phase::new(last),
            kept: Vec::new(),
            ended: None,
        };
        let mut looked = Instant::now();
        for step in steps_of(&of.estimator, last, &u, &y) {
            run.predicted.push(step.predicted.as_ref(), n);
            match step.updated {
                Ok(belief) => {
                    run.updated.push(Some(&belief), n);
                    if keep {
                        run.kept.push((step.k, belief));
                    }
                }
                Err(fault) => {
                    run.updated.push(None, n);
                    run.ended = Some((step.k, fault));
                }
            }
            if looked.elapsed() > LOOK {
                Python::attach(|py| py.check_signals())?;
                looked = Instant::now();
            }
        }
        Ok(run)
    })?;
    let dict = PyDict::new(py);
    dict.set_item("predicted", run.predicted.into_dict(py, n)?)?;
    dict.set_item("updated", run.updated.into_dict(py, n)?)?;
    let kept = run
        .kept
        .into_iter()
        .map(|(k, belief)| Py::new(py, PyBelief { belief, k }));
    dict.set_item(
        "beliefs",
        PyList::new(py, kept.collect::<PyResult<Vec<_>>>()?)?,
    )?;
    dict.set_item("steps", last + 1)?;
    if let Some((k, fault)) = run.ended {
        dict.set_item("ended", k)?;
        dict.set_item("error", of_estimation(py, fault).into_value(py))?;
    }
    Ok(dict)
}

/// A noise: uniform in the assumed set unless a law, or the data of every step, is given.
fn noise(
    what: &'static str,
    given: Option<&Bound<'_, PyAny>>,
    assumed: &zonobench_estimation::Uncertain,
) -> PyResult<Noise> {
    let Some(given) = given else {
        return Truth::assumed_noise(what, assumed).map_err(of_simulation);
    };
    if let Ok(name) = given.extract::<String>() {
        let law = Law::NAMES.iter().find(|(known, _)| *known == name);
        let Some((_, law)) = law else {
            let names: Vec<String> = Law::NAMES
                .iter()
                .map(|(name, _)| format!("{name:?}"))
                .collect();
            return Err(error(format!(
                "{what}: expected a law, {}, or an array with a row for every step; got {name:?}",
                names.join(", ")
            )));
        };
        return Ok(Noise::Drawn(Drawn {
            law: *law,
            of: assumed.clone(),
            truncate: false,
        }));
    }
    Ok(Noise::Data(rows(&by_step(
        what,
        given,
        assumed.dim(),
        false,
    )?)))
}

/// One simulated run, as a dictionary of arrays; `zonobench.simulate` makes an object of it.
#[pyfunction]
#[pyo3(signature = (problem, steps, seed, run, x0, u, w, v))]
#[allow(
    clippy::too_many_arguments,
    reason = "the keywords of the function that calls it"
)]
pub fn _simulate<'py>(
    py: Python<'py>,
    problem: &Bound<'py, PyProblem>,
    steps: usize,
    seed: u64,
    run: u64,
    x0: Option<&Bound<'py, PyAny>>,
    u: Option<&Bound<'py, PyAny>>,
    w: Option<&Bound<'py, PyAny>>,
    v: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let of = problem.get();
    let system = of.system(py).get().0.clone();
    let variables = system.variables();
    let (n, p) = (variables.x.len(), variables.u.len());
    let numbers = 2 * n + p + variables.y.len() + variables.w.len() + variables.v.len();
    if steps.saturating_add(1).saturating_mul(numbers) > LARGEST {
        return Err(error(format!(
            "steps: expected at most {} of this system, got {steps}",
            LARGEST / numbers - 1
        )));
    }
    let truth = Truth {
        x0: match x0 {
            Some(x0) => InitialState::Point(vector_of("x0", x0, n)?),
            None => Truth::assumed_x0(&of.problem).map_err(of_simulation)?,
        },
        w: noise("w", w, &of.w().0)?,
        v: noise("v", v, &of.v().0)?,
        delta: Truth::assumed_delta(&system),
    };
    let inputs = match u {
        None if p == 0 => Inputs::Constant(Vec::new()),
        None => {
            return Err(error(format!(
                "u: expected {p} numbers, or a row of them for every step, because the system has inputs; got none"
            )));
        }
        Some(u) if crate::numbers::dimensions("u", u)? < 2 && (p > 1 || is_single(u)?) => {
            Inputs::Constant(vector_of("u", u, p)?)
        }
        Some(u) => {
            let mut u = rows(&by_step("u", u, p, false)?);
            if u.len() == steps && !system.measures_input() {
                u.push(vec![0.0; p]);
            }
            Inputs::Data(u)
        }
    };
    let (sender, receiver) = channel();
    // On a thread of its own, which a Ctrl-C leaves to itself.
    std::thread::spawn(move || {
        // Whoever waited may be gone.
        let _ = sender.send(simulated(&system, &truth, &inputs, seed, run, steps));
    });
    let receiver = Mutex::new(receiver);
    let done = loop {
        let next = py.detach(|| match receiver.lock() {
            Ok(receiver) => receiver.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match next {
            Ok(done) => break Some(done),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => break None,
        }
    };
    let trajectory = done
        .ok_or_else(|| error("simulate: the run ended without a result"))?
        .map_err(of_simulation)?;
    let dict = PyDict::new(py);
    let array = |rows: Vec<Vec<f64>>, columns: usize| {
        let steps = rows.len();
        shaped_2(py, rows.concat(), [steps, columns])
    };
    dict.set_item("x", array(trajectory.x, n)?)?;
    dict.set_item("rounding", array(trajectory.rounding, n)?)?;
    dict.set_item("y", array(trajectory.y, variables.y.len())?)?;
    dict.set_item("u", array(trajectory.u, p)?)?;
    dict.set_item("w", array(trajectory.w, variables.w.len())?)?;
    dict.set_item("v", array(trajectory.v, variables.v.len())?)?;
    Ok(dict)
}

/// Whether an input of one number is one number, and not one a step.
fn is_single(u: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(vector("u", u)?.len() == 1)
}
