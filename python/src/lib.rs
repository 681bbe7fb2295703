//! `zonobench._native`: the crates `sets` and `estimation` as a module of Python.
//!
//! Nothing is computed here. Arguments are checked and copied, results wrapped, the interpreter's lock is given up where
//! a call takes long. What is easier said in Python (settings by keyword, traced functions, frames, pictures) is in the package
//! beside it.

mod errors;
mod estimator;
mod interval;
mod numbers;
mod problem;
mod sets;
mod system;
mod track;

use pyo3::prelude::*;

/// The compiled part of zonobench.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    module.add_class::<interval::PyInterval>()?;
    sets::register(module)?;
    module.add_class::<system::PySystem>()?;
    module.add_class::<problem::PyUncertain>()?;
    module.add_class::<problem::PyProblem>()?;
    module.add_class::<estimator::PyEstimator>()?;
    module.add_class::<estimator::PyBelief>()?;
    module.add_class::<estimator::PyOnline>()?;
    module.add_function(wrap_pyfunction!(estimator::_kinds, module)?)?;
    module.add_function(wrap_pyfunction!(estimator::_seconds_from_rust, module)?)?;
    module.add_function(wrap_pyfunction!(track::_track, module)?)?;
    module.add_function(wrap_pyfunction!(track::_simulate, module)?)
}
