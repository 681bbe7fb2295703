//! Estimators, what they know, and one of them in a loop.

use crate::errors::{error, of_estimation};
use crate::numbers::{array_1, array_2, shaped_2, vector_with_gaps};
use crate::problem::PyProblem;
use crate::sets::{AnySet, answer, located, wrap};
use crate::system::fault_of_json;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value};
use std::sync::{Mutex, TryLockError};
use std::time::{Duration, Instant};
use zonobench_estimation::estimator::{KINDS, Phase};
use zonobench_estimation::outline::outline;
use zonobench_estimation::{
    AnyBelief, AnyEstimator, Belief, Estimator, EstimatorSettings, Online, System,
};
use zonobench_sets::{Ellipsoid, Zonotope};

/// A recursive estimator with its settings, for one problem. Its classes are the kinds: `Czmv`, `Kalman`, ...
///
/// It holds no state of its own: `Online` and `track` carry the belief, and any number of them may share an estimator.
#[pyclass(name = "Estimator", module = "zonobench", subclass, frozen)]
pub struct PyEstimator {
    /// The estimator.
    pub estimator: AnyEstimator,
    /// Numbers of inputs and measurements.
    pub sizes: [usize; 2],
    /// Whether h holds the input.
    pub measures_input: bool,
    problem: Py<PyProblem>,
    settings: EstimatorSettings,
}

/// Every kind of estimator and the names of its settings.
#[pyfunction]
pub fn _kinds() -> Vec<(&'static str, Vec<&'static str>)> {
    KINDS
        .iter()
        .map(|info| (info.kind, info.keys.to_vec()))
        .collect()
}

#[pymethods]
impl PyEstimator {
    /// kind: as in an experiment file; settings: that kind's settings as JSON.
    #[new]
    fn new(
        py: Python<'_>,
        problem: &Bound<'_, PyProblem>,
        kind: &str,
        settings: &str,
    ) -> PyResult<Self> {
        let no = |fault: &serde_json::Error| error(format!("{kind}: {}", fault_of_json(fault)));
        let mut keys: Map<String, Value> = serde_json::from_str(settings).map_err(|f| no(&f))?;
        keys.insert("kind".to_owned(), kind.into());
        let settings: EstimatorSettings =
            serde_json::from_value(Value::Object(keys)).map_err(|f| no(&f))?;
        let of = &problem.get().problem;
        let estimator =
            AnyEstimator::new(&settings, of).map_err(|fault| of_estimation(py, fault))?;
        let system = &problem.get().system(py);
        let (system, variables) = (&system.get().0, system.get().0.variables());
        Ok(Self {
            estimator,
            sizes: [variables.u.len(), variables.y.len()],
            measures_input: system.measures_input(),
            problem: problem.clone().unbind(),
            settings,
        })
    }

    /// The kind, as it stands in an experiment file: "czmv".
    #[getter]
    fn kind(&self) -> &'static str {
        self.estimator.kind()
    }
    /// The problem.
    #[getter]
    fn problem(&self, py: Python<'_>) -> Py<PyProblem> {
        self.problem.clone_ref(py)
    }
    /// The settings as JSON, defaults written out.
    fn settings_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.settings).map_err(|fault| error(fault.to_string()))
    }
    /// True if its sets are proved to contain the state whenever the problem's assumptions hold.
    #[getter]
    fn guaranteed(&self) -> bool {
        self.estimator.guaranteed()
    }
    /// The measurements that the belief reported at k has read.
    #[getter]
    fn reads(&self) -> &'static str {
        self.estimator.reads()
    }
    /// Which belief its paper reports: "predicted" or "updated".
    #[getter]
    fn reported_phase(&self) -> &'static str {
        match self.estimator.reported_phase() {
            Phase::Predicted => "predicted",
            Phase::Updated => "updated",
        }
    }
    /// False if its paper starts with y_1: then y_0 is not read.
    #[getter]
    fn uses_first_measurement(&self) -> bool {
        self.estimator.uses_first_measurement()
    }
    /// What a user should know before trusting the numbers, or None.
    #[getter]
    fn warning(&self) -> Option<String> {
        self.estimator.warning()
    }

    /// What is known of x_0 before anything is measured.
    fn prior(&self) -> PyBelief {
        PyBelief {
            belief: self.estimator.prior(),
            k: 0,
        }
    }
    /// From the (updated, reduced) belief at k - 1 to the predicted one at k >= 1; u is u_{k-1}.
    #[pyo3(signature = (k, belief, u=None))]
    fn predict(
        &self,
        py: Python<'_>,
        k: usize,
        belief: &Bound<'_, PyBelief>,
        u: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyBelief> {
        if k == 0 {
            return Err(error(
                "k: expected at least 1, the step that is predicted, got 0",
            ));
        }
        let (u, before) = (self.input(u)?, &belief.get().belief);
        let belief = py.detach(|| self.estimator.predict(k, before, &u));
        Ok(PyBelief {
            belief: belief.map_err(|fault| of_estimation(py, fault))?,
            k,
        })
    }
    /// Takes in y_k, with the input u_k where the measurement holds it.
    #[pyo3(signature = (k, belief, u=None, y=None))]
    fn update(
        &self,
        py: Python<'_>,
        k: usize,
        belief: &Bound<'_, PyBelief>,
        u: Option<&Bound<'_, PyAny>>,
        y: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyBelief> {
        let (u, y, before) = (self.input(u)?, self.measurement(y)?, &belief.get().belief);
        let belief = py.detach(|| self.estimator.update(k, before, &u, &y));
        Ok(PyBelief {
            belief: belief.map_err(|fault| of_estimation(py, fault))?,
            k,
        })
    }
    /// A simpler belief that contains this one, for the next prediction.
    fn reduce_order(
        &self,
        py: Python<'_>,
        k: usize,
        belief: &Bound<'_, PyBelief>,
    ) -> PyResult<PyBelief> {
        let before = belief.get().belief.clone();
        let belief = py.detach(|| self.estimator.reduce_order(k, before));
        Ok(PyBelief {
            belief: belief.map_err(|fault| of_estimation(py, fault))?,
            k,
        })
    }
}

impl PyEstimator {
    /// u_k, which may be left out where there are no inputs.
    fn input(&self, u: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
        let n = self.sizes[0];
        let u = match u {
            None if n == 0 => return Ok(Vec::new()),
            None => {
                return Err(error(format!(
                    "u: expected {n} numbers, because the system has inputs; got none"
                )));
            }
            Some(u) => few("u", u, n)?,
        };
        match u.iter().position(|x| !x.is_finite()) {
            Some(i) => Err(error(format!(
                "u: expected finite numbers, got {} at [{i}]",
                u[i]
            ))),
            None => Ok(u),
        }
    }

    /// y_k, with None where it is None or NaN.
    fn measurement(&self, y: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<Option<f64>>> {
        let m = self.sizes[1];
        let Some(y) = y else { return Ok(vec![None; m]) };
        let y = match y.cast_exact::<pyo3::types::PyList>() {
            // A list may hold None; it holds no more than a few numbers.
            Ok(list) if list.iter().any(|y| y.is_none()) => list
                .iter()
                .map(|y| {
                    if y.is_none() {
                        Ok(f64::NAN)
                    } else {
                        y.extract()
                    }
                })
                .collect::<PyResult<Vec<f64>>>()
                .map_err(|_| {
                    PyTypeError::new_err("y: expected numbers, or None for what was not measured")
                })
                .and_then(|y| sized("y", y, m))?,
            _ => few("y", y, m)?,
        };
        measured("y", &y)
    }
}

fn sized(what: &str, x: Vec<f64>, n: usize) -> PyResult<Vec<f64>> {
    if x.len() == n {
        Ok(x)
    } else {
        Err(error(format!(
            "{what}: expected {n} numbers, got {}",
            x.len()
        )))
    }
}

/// A vector of `n` numbers, or a number where n = 1.
fn few(what: &str, given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    if n == 1
        && let Ok(x) = given.cast::<pyo3::types::PyFloat>()
    {
        return Ok(vec![x.value()]);
    }
    sized(what, vector_with_gaps(what, given)?, n)
}

/// Numbers with None for NaN; an infinite one is none.
pub fn measured(what: &str, y: &[f64]) -> PyResult<Vec<Option<f64>>> {
    y.iter()
        .map(|&y| match y {
            y if y.is_nan() => Ok(None),
            y if y.is_finite() => Ok(Some(y)),
            y => Err(error(format!(
                "{what}: expected finite numbers, or NaN for what was not measured; got {y}"
            ))),
        })
        .collect()
}

/// What an estimator knows of x_k.
#[pyclass(name = "Belief", module = "zonobench", frozen)]
pub struct PyBelief {
    /// The belief.
    pub belief: AnyBelief,
    /// Its step.
    pub k: usize,
}

fn largest(sides: impl Iterator<Item = f64>) -> f64 {
    sides.fold(0.0, f64::max)
}

#[pymethods]
impl PyBelief {
    /// The step k.
    #[getter]
    fn k(&self) -> usize {
        self.k
    }
    /// The point estimate, n numbers.
    #[getter]
    fn center<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array_1(py, &self.belief.center())
    }
    /// The smallest `Box` around the set, proved where the estimator is guaranteed; of a mixed filter its confidence box; None
    /// where there is no set.
    #[getter]
    fn hull(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        // Computed when first asked for, by linear programs.
        let hull = py.detach(|| self.belief.interval_hull());
        hull.map(|hull| wrap(py, AnySet::Box(hull))).transpose()
    }
    /// The set itself; None where there is none. Of a mixed filter the zonotope part, to which the Gaussian comes; of a vehicle
    /// filter the box around its set, which is curved.
    #[getter]
    fn set(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let set = match &self.belief {
            AnyBelief::Gaussian(_) | AnyBelief::ParticleBelief(_) | AnyBelief::Reported(_) => {
                return Ok(None);
            }
            AnyBelief::BoxWindow(b) => AnySet::Box(b.bounds().clone()),
            AnyBelief::ZonotopeBelief(b) => AnySet::Zonotope(b.set().clone()),
            AnyBelief::ConstrainedBelief(b) => AnySet::Constrained(b.set().clone()),
            AnyBelief::PolytopeBelief(b) => AnySet::Constrained(b.set().clone()),
            AnyBelief::MixedBelief(b) => {
                let z = Zonotope::new(b.state.c().to_vec(), b.state.g().clone());
                AnySet::Zonotope(z.map_err(crate::errors::of_sets)?)
            }
            AnyBelief::PoseZonotope(_) => match self.belief.interval_hull() {
                Some(hull) => AnySet::Box(hull),
                None => return Ok(None),
            },
        };
        wrap(py, set).map(Some)
    }
    /// The covariance of the Gaussian part, n x n, or None.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.belief.covariance().map(|p| array_2(py, p)).transpose()
    }
    /// The largest half-width of the hull, or None.
    #[getter]
    fn radius(&self, py: Python<'_>) -> Option<f64> {
        let hull = py.detach(|| self.belief.interval_hull())?;
        Some(largest(hull.rad().iter().copied()))
    }
    /// Length, area or volume of the set up to three dimensions, or None.
    fn volume(&self, py: Python<'_>) -> Option<f64> {
        py.detach(|| self.belief.volume())
    }
    /// The numbers of generators and constraints of the set, each None where it has none.
    #[getter]
    fn order(&self) -> (Option<usize>, Option<usize>) {
        let size = self.belief.size();
        (size.n_generators, size.n_constraints)
    }
    /// What this kind of belief has beyond the others, by name.
    #[getter]
    fn extras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let extras = PyDict::new(py);
        for (name, value) in self.belief.extras() {
            extras.set_item(name, value)?;
        }
        Ok(extras)
    }
    /// True if x is proved to be in the set, False if it is proved not to be, None if neither could be shown, or where
    /// there is no set. x: a point, or a `Box` that holds it.
    fn contains(&self, py: Python<'_>, x: &Bound<'_, PyAny>) -> PyResult<Option<bool>> {
        let (x, n) = (located("x", x)?, self.belief.center().len());
        if x.dim() != n {
            return Err(error(format!(
                "x: expected a point of {n} numbers, got {}",
                x.dim()
            )));
        }
        let verdict = py.detach(|| self.belief.contains(x.as_slice()));
        Ok(answer(verdict))
    }
    fn __contains__(&self, py: Python<'_>, x: &Bound<'_, PyAny>) -> PyResult<bool> {
        Ok(self.contains(py, x)? == Some(true))
    }
    /// The ellipsoid that holds the state with probability 1 - alpha, of a Gaussian belief.
    fn ellipsoid(&self, py: Python<'_>, alpha: f64) -> PyResult<Py<PyAny>> {
        let AnyBelief::Gaussian(of) = &self.belief else {
            return Err(error(
                "ellipsoid: expected a Gaussian belief, got one with a set",
            ));
        };
        let ellipsoid = Ellipsoid::with_confidence(of.mean.to_vec(), of.covariance.clone(), alpha);
        wrap(
            py,
            AnySet::Ellipsoid(ellipsoid.map_err(crate::errors::of_sets)?),
        )
    }
    /// Corners of a polygon that shows the belief in the plane of two components, as rows; for pictures.
    #[pyo3(signature = (i=0, j=1))]
    fn outline<'py>(
        &self,
        py: Python<'py>,
        i: usize,
        j: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = self.belief.shape();
        let n = shape.center.len();
        if i >= n || j >= n {
            return Err(PyIndexError::new_err(format!(
                "outline: the state has {n} components"
            )));
        }
        let corners = py.detach(|| outline(&shape, (i, j)));
        shaped_2(py, corners.concat(), [corners.len(), 2])
    }
    fn __repr__(&self) -> String {
        format!(
            "Belief(k = {}, center = {:?})",
            self.k,
            self.belief.center()
        )
    }
}

/// A filter between two calls.
struct State {
    online: Online<AnyEstimator>,
    /// The longest step so far took more than this is worth.
    is_slow: bool,
}

/// A step longer than this is made without the interpreter's lock.
const SHORT: Duration = Duration::from_micros(50);

/// Online(estimator): an estimator with what it knows at present, a step at a time.
///
/// One filter belongs to one thread at a time; another that calls it meanwhile gets a `RuntimeError`.
#[pyclass(name = "Online", module = "zonobench", frozen)]
pub struct PyOnline {
    state: Mutex<State>,
    estimator: Py<PyEstimator>,
}

impl PyOnline {
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl Send + FnOnce(&mut Online<AnyEstimator>) -> T,
    ) -> PyResult<T> {
        let mut state = match self.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::WouldBlock) => {
                return Err(PyRuntimeError::new_err(
                    "this filter is in the middle of a step of another thread: each thread needs its own Online",
                ));
            }
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        };
        let state = &mut *state;
        let start = Instant::now();
        let done = match state.is_slow {
            true => {
                let online = &mut state.online;
                py.detach(|| work(online))
            }
            false => work(&mut state.online),
        };
        state.is_slow = start.elapsed() > SHORT;
        Ok(done)
    }

    fn believe(
        &self,
        py: Python<'_>,
        work: impl Send
        + FnOnce(
            &mut Online<AnyEstimator>,
        ) -> Result<(), zonobench_estimation::EstimationError>,
    ) -> PyResult<PyBelief> {
        let done = self.with(py, |online| {
            work(online).map(|()| PyBelief {
                belief: online.belief().clone(),
                k: online.k(),
            })
        })?;
        done.map_err(|fault| of_estimation(py, fault))
    }
}

#[pymethods]
impl PyOnline {
    #[new]
    fn new(estimator: &Bound<'_, PyEstimator>) -> Self {
        let online = Online::new(estimator.get().estimator.clone());
        Self {
            state: Mutex::new(State {
                online,
                is_slow: false,
            }),
            estimator: estimator.clone().unbind(),
        }
    }

    /// One period: u was applied since the last step, y is measured now.
    ///
    /// u: the p numbers of the input; None where the system has none. y: the m numbers of the measurement, with NaN (or None)
    /// for what was not measured; None where nothing was. A single number may stand for a vector of one.
    ///
    /// The first call is k = 0 and only measures; its u matters where the measurement holds the input.
    ///
    /// Returns the `Belief`. Raises `Inconsistent` where y contradicts the model, and what the estimator raises; then
    /// everything is as it was before the call, and the same step can be made without a measurement.
    #[pyo3(signature = (u=None, y=None))]
    fn step(
        &self,
        py: Python<'_>,
        u: Option<&Bound<'_, PyAny>>,
        y: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyBelief> {
        let of = self.estimator.get();
        let (u, y) = (of.input(u)?, of.measurement(y)?);
        self.believe(py, |online| online.step(&u, &y).map(|_| ()))
    }

    /// To the next step under the input u, without a measurement yet.
    #[pyo3(signature = (u=None))]
    fn advance(&self, py: Python<'_>, u: Option<&Bound<'_, PyAny>>) -> PyResult<PyBelief> {
        let u = self.estimator.get().input(u)?;
        self.believe(py, |online| online.advance(&u).map(|_| ()))
    }

    /// Takes in y_k of the present step, once; u is u_k.
    #[pyo3(signature = (u=None, y=None))]
    fn measure(
        &self,
        py: Python<'_>,
        u: Option<&Bound<'_, PyAny>>,
        y: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyBelief> {
        let of = self.estimator.get();
        let (u, y) = (of.input(u)?, of.measurement(y)?);
        self.believe(py, |online| online.measure(&u, &y).map(|_| ()))
    }

    /// The step that `belief` is about.
    #[getter]
    fn k(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |online| online.k())
    }
    /// What is known of x_k.
    #[getter]
    fn belief(&self, py: Python<'_>) -> PyResult<PyBelief> {
        self.believe(py, |_| Ok(()))
    }
    /// The estimator.
    #[getter]
    fn estimator(&self, py: Python<'_>) -> Py<PyEstimator> {
        self.estimator.clone_ref(py)
    }
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let k = self.k(py)?;
        Ok(format!(
            "Online({}, k = {k})",
            self.estimator.get().estimator.kind()
        ))
    }
}

/// Seconds that `steps` steps of an `Online` take from Rust, with the same input and measurement each time: what the bench of
/// overheads holds Python's against.
#[pyfunction]
pub fn _seconds_from_rust(
    estimator: &Bound<'_, PyEstimator>,
    u: Option<&Bound<'_, PyAny>>,
    y: Option<&Bound<'_, PyAny>>,
    steps: usize,
) -> PyResult<f64> {
    let of = estimator.get();
    let (u, y) = (of.input(u)?, of.measurement(y)?);
    let mut online = Online::new(of.estimator.clone());
    let start = Instant::now();
    for _ in 0..steps {
        online
            .step(&u, &y)
            .map_err(|fault| of_estimation(estimator.py(), fault))?;
    }
    Ok(start.elapsed().as_secs_f64())
}
