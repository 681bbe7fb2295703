//! Numbers, vectors and matrices from Python and to it.
//!
//! What comes in is copied once, what goes out is a fresh array: nothing of a set can be changed from outside. Float64
//! arrays and lists of floats are read as they stand; everything else passes through `zonobench._convert`, which
//! takes what a float64 holds exactly and refuses the rest.

use crate::errors::error;
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyList};
use zonobench_sets::{Interval, IntervalVector, Matrix};

/// Entries of the largest array that is taken or made: 1 GiB.
pub const LARGEST: usize = 1 << 27;

/// Fails where an array of `rows` × `cols` would be larger than memory should be asked for.
pub fn room(what: &str, rows: usize, cols: usize) -> PyResult<()> {
    match rows.checked_mul(cols) {
        Some(entries) if entries <= LARGEST => Ok(()),
        _ => Err(error(format!(
            "{what}: expected at most {LARGEST} numbers, got {rows} x {cols}"
        ))),
    }
}

/// `given` as a float64 array.
fn array<'py>(what: &str, given: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if given.is_exact_instance_of::<PyUntypedArray>()
        && let Ok(array) = given.cast::<PyArrayDyn<f64>>()
        && array.len() <= LARGEST
        && array.is_aligned()
    {
        return borrowed(what, array);
    }
    let convert = given.py().import("zonobench._convert")?;
    let converted = convert.getattr("exactly")?.call1((what, given))?;
    borrowed(what, converted.cast::<PyArrayDyn<f64>>()?)
}

fn borrowed<'py>(
    what: &str,
    array: &Bound<'py, PyArrayDyn<f64>>,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    array
        .try_readonly()
        .map_err(|fault| error(format!("{what}: {fault}")))
}

/// A vector, NaN among its entries perhaps.
pub fn vector_with_gaps(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if let Ok(list) = given.cast_exact::<PyList>() {
        let floats: Option<Vec<f64>> = list
            .iter()
            .map(|x| x.cast_exact::<PyFloat>().ok().map(|x| x.value()))
            .collect();
        if let Some(floats) = floats.filter(|floats| !floats.is_empty()) {
            return Ok(floats);
        }
    }
    let array = array(what, given)?;
    if array.ndim() != 1 {
        let shape = array.shape();
        return Err(error(format!(
            "{what}: expected a vector, got an array of shape {shape:?}"
        )));
    }
    Ok(array.as_array().iter().copied().collect())
}

/// A vector of finite numbers.
pub fn vector(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let vector = vector_with_gaps(what, given)?;
    match vector.iter().position(|x| !x.is_finite()) {
        Some(i) => Err(error(format!(
            "{what}: expected finite numbers, got {} at [{i}]",
            vector[i]
        ))),
        None => Ok(vector),
    }
}

/// A vector of `n` finite numbers.
pub fn vector_of(what: &str, given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    let vector = vector(what, given)?;
    if vector.len() != n {
        return Err(error(format!(
            "{what}: expected {n} numbers, got {}",
            vector.len()
        )));
    }
    Ok(vector)
}

/// A matrix, NaN among its entries perhaps.
pub fn matrix_with_gaps(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Matrix> {
    let array = array(what, given)?;
    let &[rows, cols] = array.shape() else {
        let shape = array.shape();
        return Err(error(format!(
            "{what}: expected a matrix, got an array of shape {shape:?}"
        )));
    };
    let mut matrix = Matrix::zeros(rows, cols);
    let view = array.as_array();
    matrix
        .as_mut_slice()
        .iter_mut()
        .zip(view.iter())
        .for_each(|(to, from)| *to = *from);
    Ok(matrix)
}

/// A matrix of finite numbers.
pub fn matrix(what: &str, given: &Bound<'_, PyAny>) -> PyResult<Matrix> {
    let matrix = matrix_with_gaps(what, given)?;
    match matrix.as_slice().iter().position(|x| !x.is_finite()) {
        Some(at) => Err(error(format!(
            "{what}: expected finite numbers, got {} at [{}, {}]",
            matrix.as_slice()[at],
            at / matrix.cols(),
            at % matrix.cols()
        ))),
        None => Ok(matrix),
    }
}

/// The number of dimensions of `given` as an array.
pub fn dimensions(what: &str, given: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(array(what, given)?.ndim())
}

/// The length of a vector, or the rows and columns of a matrix.
pub fn array_1<'py>(py: Python<'py>, x: &[f64]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, x)
}

/// `m` as an array.
pub fn array_2<'py>(py: Python<'py>, m: &Matrix) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, m.as_slice()).reshape([m.rows(), m.cols()])
}

/// Numbers row after row as an array.
pub fn shaped_2(
    py: Python<'_>,
    numbers: Vec<f64>,
    shape: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    PyArray1::from_vec(py, numbers).reshape(shape)
}

/// Numbers as an array of three dimensions.
pub fn shaped_3(
    py: Python<'_>,
    numbers: Vec<f64>,
    shape: [usize; 3],
) -> PyResult<Bound<'_, PyArray3<f64>>> {
    PyArray1::from_vec(py, numbers).reshape(shape)
}

/// Each number as a point.
pub fn points(x: &[f64]) -> IntervalVector {
    x.iter().map(|&x| Interval::point(x)).collect()
}
