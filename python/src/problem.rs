//! What an estimator is told: the system, what is known of the first state, and the noises.

use crate::errors::{Unsupported, error, of_problem, of_sets, of_uncertain};
use crate::numbers::{array_1, array_2, matrix, vector};
use crate::sets::{AnySet, PySet, wrap};
use crate::system::{PySystem, fault_of_json};
use pyo3::prelude::*;
use zonobench_estimation::{Problem, System, Uncertain};
use zonobench_sets::{ConstrainedZonotope, Matrix};

/// Uncertain(set=None, mean=None, covariance=None): a vector known as a set, as a Gaussian, or as the sum of both.
///
/// Set filters read the set, `Kalman` mean and covariance, the mixed filters the sum. A set stands for itself wherever an
/// `Uncertain` is asked for.
///
/// set: any set of n components but an ellipsoid; mean: n numbers; covariance: n x n, symmetric positive semidefinite.
#[pyclass(name = "Uncertain", module = "zonobench", frozen)]
#[derive(Clone)]
pub struct PyUncertain(pub Uncertain);

fn of_constrained(z: &ConstrainedZonotope) -> Uncertain {
    let folded = z.clone().fold();
    let constraints = (folded.constraints() > 0).then(|| (folded.a().clone(), folded.b().to_vec()));
    Uncertain {
        constraints,
        ..Uncertain::zonotope(folded.c().to_vec(), folded.g().clone())
    }
}

fn of_set(set: &AnySet) -> PyResult<Uncertain> {
    match set {
        AnySet::Box(x) => Uncertain::from_box(&x.lower(), &x.upper()).map_err(of_uncertain),
        AnySet::Ellipsoid(_) => Err(Unsupported::new_err(
            "an Ellipsoid does not support being what a set is known by: give a covariance, or its bounding_box()",
        )),
        other => Ok(of_constrained(&other.constrained()?)),
    }
}

#[pymethods]
impl PyUncertain {
    #[new]
    #[pyo3(signature = (set=None, mean=None, covariance=None))]
    fn new(
        set: Option<&Bound<'_, PyAny>>,
        mean: Option<&Bound<'_, PyAny>>,
        covariance: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let mean = mean.map(|m| vector("mean", m)).transpose()?;
        let covariance = covariance.map(|c| matrix("covariance", c)).transpose()?;
        let n = mean
            .as_ref()
            .map(Vec::len)
            .or(covariance.as_ref().map(Matrix::rows));
        let base = match (set, n) {
            (Some(set), _) => read("set", set)?,
            (None, Some(n)) => Uncertain::point(vec![0.0; n]),
            (None, None) => {
                return Err(error(
                    "uncertain: expected a set, a mean or a covariance, got none",
                ));
            }
        };
        let uncertain = Uncertain {
            mean: mean.or(base.mean.clone()),
            covariance: covariance.or(base.covariance.clone()),
            ..base
        };
        uncertain.validate(uncertain.dim()).map_err(of_uncertain)?;
        Ok(Self(uncertain))
    }

    /// n.
    #[getter]
    fn dim(&self) -> usize {
        self.0.dim()
    }
    /// The set, or None where none was given: a `Box`, a `Zonotope` or a `ConstrainedZonotope`.
    #[getter]
    fn set(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        if let Some(bounds) = &self.0.bounds {
            return wrap(py, AnySet::Box(bounds.clone())).map(Some);
        }
        let Some(g) = &self.0.generators else {
            return Ok(None);
        };
        let c = self.0.center.clone();
        let set = match &self.0.constraints {
            Some((a, b)) => ConstrainedZonotope::new(c, g.clone(), a.clone(), b.clone())
                .map(AnySet::Constrained),
            None => zonobench_sets::Zonotope::new(c, g.clone()).map(AnySet::Zonotope),
        };
        wrap(py, set.map_err(of_sets)?).map(Some)
    }
    /// The mean, or None.
    #[getter]
    fn mean<'py>(&self, py: Python<'py>) -> Option<Bound<'py, numpy::PyArray1<f64>>> {
        self.0.mean.as_ref().map(|m| array_1(py, m))
    }
    /// The covariance, or None.
    #[getter]
    fn covariance<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, numpy::PyArray2<f64>>>> {
        self.0
            .covariance
            .as_ref()
            .map(|c| array_2(py, c))
            .transpose()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other
            .cast::<Self>()
            .is_ok_and(|other| other.get().0 == self.0)
    }
    fn __repr__(&self) -> String {
        let mut parts = vec![format!("{}-dimensional", self.0.dim())];
        for (has, what) in [
            (self.0.has_set(), "set"),
            (self.0.has_gaussian(), "Gaussian"),
        ] {
            if has {
                parts.push(what.to_owned());
            }
        }
        format!("Uncertain({})", parts.join(", "))
    }
    /// From what `to_json` gives.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        let uncertain: Uncertain = serde_json::from_str(text)
            .map_err(|fault| error(format!("uncertain: {}", fault_of_json(&fault))))?;
        uncertain.validate(uncertain.dim()).map_err(of_uncertain)?;
        Ok(Self(uncertain))
    }
    /// As JSON.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.0).map_err(|fault| error(fault.to_string()))
    }
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.getattr("from_json")?, (slf.get().to_json()?,)))
    }
}

/// An uncertain vector: one, a set, or a point.
fn read(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Uncertain> {
    if let Ok(uncertain) = given.cast::<PyUncertain>() {
        return Ok(uncertain.get().0.clone());
    }
    if let Ok(set) = given.cast::<PySet>() {
        return of_set(&set.get().0);
    }
    Ok(Uncertain::point(vector(what, given)?))
}

/// Problem(system, prior, w=None, v=None): a system with everything an estimator is told about it.
///
/// prior: what is known of x_0; w and v: what is assumed of the noises, each an `Uncertain`, a set, or a point; None where the
/// system has no such noise.
#[pyclass(name = "Problem", module = "zonobench", frozen)]
pub struct PyProblem {
    /// The parts, checked against each other.
    pub problem: Problem,
    system: Py<PySystem>,
    parts: [Uncertain; 3],
}

#[pymethods]
impl PyProblem {
    #[new]
    #[pyo3(signature = (system, prior, w=None, v=None))]
    fn new(
        system: &Bound<'_, PySystem>,
        prior: &Bound<'_, PyAny>,
        w: Option<&Bound<'_, PyAny>>,
        v: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let of = system.get().0.clone();
        let variables = of.variables();
        let noise = |what: &str, given: Option<&Bound<'_, PyAny>>, n: usize| match given {
            Some(given) => read(what, given),
            None if n == 0 => Ok(Uncertain::point(Vec::new())),
            None => Err(error(format!(
                "{what}: expected a set or an Uncertain of {n} components, because the system has this noise; got none"
            ))),
        };
        let w = noise("w", w, variables.w.len() - of.n_delta())?;
        let v = noise("v", v, variables.v.len())?;
        let parts = [read("prior", prior)?, w, v];
        let [prior, w, v] = parts.clone();
        let problem = Problem::new(of, prior, w, v).map_err(of_problem)?;
        Ok(Self {
            problem,
            system: system.clone().unbind(),
            parts,
        })
    }

    /// The system.
    #[getter]
    pub fn system(&self, py: Python<'_>) -> Py<PySystem> {
        self.system.clone_ref(py)
    }
    /// What is known of x_0.
    #[getter]
    pub fn prior(&self) -> PyUncertain {
        PyUncertain(self.parts[0].clone())
    }
    /// What is assumed of the process noise.
    #[getter]
    pub fn w(&self) -> PyUncertain {
        PyUncertain(self.parts[1].clone())
    }
    /// What is assumed of the measurement noise.
    #[getter]
    pub fn v(&self) -> PyUncertain {
        PyUncertain(self.parts[2].clone())
    }
    fn __repr__(&self) -> String {
        format!("Problem({})", self.system.get().0.kind())
    }
    #[allow(clippy::type_complexity)]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> (
        Bound<'py, PyAny>,
        (Py<PySystem>, PyUncertain, PyUncertain, PyUncertain),
    ) {
        let of = slf.get();
        let parts = (of.system(slf.py()), of.prior(), of.w(), of.v());
        (slf.get_type().into_any(), parts)
    }
}
