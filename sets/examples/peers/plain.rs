//! The steps in plain f64: the same operations, with nothing that bounds their rounding. They tell what the
//! bounds cost; no set of theirs is guaranteed.

use zonobench_sets::Matrix;
use zonobench_sets::reduction::combastel;

/// (M X ⊕ W) corrected by the gain K for y = C x + v, reduced to `generators`; noises have their center at 0.
#[allow(clippy::too_many_arguments)] // the step's own letters
pub fn zonotope_step(
    (c, g): (&[f64], &Matrix),
    map: &Matrix,
    w: &Matrix,
    gain: &Matrix,
    output: &Matrix,
    y: &[f64],
    v: &Matrix,
    generators: usize,
) -> (Vec<f64>, Matrix) {
    let predicted = (map.mul_vec(c), Matrix::hcat(&[&map.mul(g), w]));
    let m = Matrix::identity(c.len()).sub(&gain.mul(output));
    let innovation: Vec<f64> = (output.mul_vec(&predicted.0).iter().zip(y))
        .map(|(p, y)| y - p)
        .collect();
    let correction = gain.mul_vec(&innovation);
    let center = predicted
        .0
        .iter()
        .zip(&correction)
        .map(|(c, e)| c + e)
        .collect();
    let joined = Matrix::hcat(&[&m.mul(&predicted.1), &gain.mul(v).scale(-1.0)]);
    (center, combastel::reduce_columns(&joined, generators))
}
