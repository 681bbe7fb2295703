//! What the crates' errors are in Python: classes below `Error`, which is a `ValueError`, with the crates' sentences.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zonobench_estimation::simulate::SimulationError;
use zonobench_estimation::{EstimationError, ProblemError, UncertainError};
use zonobench_sets::SetError;

pyo3::create_exception!(
    zonobench,
    Error,
    PyValueError,
    "What is said of sets, problems and estimators that cannot be. `k` is the step, where one is named."
);
pyo3::create_exception!(
    zonobench,
    Inconsistent,
    Error,
    "The measurement contradicts the model: the intersection is empty. A result, not a failure."
);
pyo3::create_exception!(zonobench, Empty, Error, "The set is proved empty.");
pyo3::create_exception!(
    zonobench,
    Unsupported,
    Error,
    "This kind does not do what was asked of it."
);
pyo3::create_exception!(
    zonobench,
    Singular,
    Error,
    "A matrix that must be inverted is singular or not positive definite."
);
pyo3::create_exception!(
    zonobench,
    Refused,
    Error,
    "An estimator does not go on, because what it would say is worth nothing."
);
pyo3::create_exception!(
    zonobench,
    Overflow,
    Error,
    "A computed number is beyond the largest double, 1.8e308."
);
pyo3::create_exception!(
    zonobench,
    Diverged,
    Error,
    "A simulated state is no longer finite."
);

/// Puts the classes into the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let error = py.get_type::<Error>();
    error.setattr("k", py.None())?;
    module.add("Error", error)?;
    module.add("Inconsistent", py.get_type::<Inconsistent>())?;
    module.add("Empty", py.get_type::<Empty>())?;
    module.add("Unsupported", py.get_type::<Unsupported>())?;
    module.add("Singular", py.get_type::<Singular>())?;
    module.add("Refused", py.get_type::<Refused>())?;
    module.add("Overflow", py.get_type::<Overflow>())?;
    module.add("Diverged", py.get_type::<Diverged>())
}

/// `Error` with this sentence.
pub fn error(sentence: impl Into<String>) -> PyErr {
    Error::new_err(sentence.into())
}

/// An operation on sets failed.
pub fn of_sets(fault: SetError) -> PyErr {
    let sentence = fault.to_string();
    match fault {
        SetError::Empty { .. } => Empty::new_err(sentence),
        SetError::Singular { .. } => Singular::new_err(sentence),
        _ => Error::new_err(sentence),
    }
}

/// A problem is not one.
pub fn of_problem(fault: ProblemError) -> PyErr {
    Error::new_err(fault.to_string())
}

/// An uncertain vector is not one.
pub fn of_uncertain(fault: UncertainError) -> PyErr {
    Error::new_err(fault.to_string())
}

/// A system or an estimator says no.
pub fn of_estimation(py: Python<'_>, fault: EstimationError) -> PyErr {
    let sentence = fault.to_string();
    let raised = match &fault {
        EstimationError::Inconsistent { .. } => Inconsistent::new_err(sentence),
        EstimationError::Singular { .. } => Singular::new_err(sentence),
        EstimationError::Overflow { .. } => Overflow::new_err(sentence),
        EstimationError::Refused { .. } => Refused::new_err(sentence),
        EstimationError::Unsupported { .. } | EstimationError::Unobservable { .. } => {
            Unsupported::new_err(sentence)
        }
        _ => Error::new_err(sentence),
    };
    if let Some(k) = fault.step()
        && let Err(other) = raised.value(py).setattr("k", k)
    {
        return other;
    }
    raised
}

/// A truth is not one, or went where it cannot be followed.
pub fn of_simulation(fault: SimulationError) -> PyErr {
    let sentence = fault.to_string();
    match fault {
        SimulationError::Diverged { .. } => Diverged::new_err(sentence),
        _ => Error::new_err(sentence),
    }
}
