//! A system at a point: its values and its first derivatives there, in plain f64.
//!
//! For people, who want to see what was understood of their equations; no estimator reads it, because its rounding is not
//! enclosed.

use crate::System;
use zonobench_sets::Matrix;
use zonobench_sets::number::{Function, Real, jacobian};

/// x⁺ and y at a point, and their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearised {
    /// f(k, x, u, w), n numbers.
    pub next: Vec<f64>,
    /// ∂f/∂x, n × n.
    pub next_by_x: Matrix,
    /// ∂f/∂w, n × n_w.
    pub next_by_w: Matrix,
    /// h(k, x, u, v), m numbers.
    pub output: Vec<f64>,
    /// ∂h/∂x, m × n.
    pub output_by_x: Matrix,
    /// ∂h/∂v, m × n_v.
    pub output_by_v: Matrix,
}

/// A system's f or h at one step and input, as a function of the state and one noise.
struct Map<'a, Y> {
    system: &'a Y,
    k: usize,
    u: &'a [f64],
    states: usize,
    noises: usize,
    outputs: usize,
    is_output: bool,
}

impl<Y: System> Function for Map<'_, Y> {
    fn inputs(&self) -> usize {
        self.states + self.noises
    }
    fn outputs(&self) -> usize {
        self.outputs
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        let (x, noise) = z.split_at(self.states);
        match self.is_output {
            true => self.system.h(self.k, x, self.u, noise, out),
            false => self.system.f(self.k, x, self.u, noise, out),
        }
    }
}

/// The values and derivatives of `system` at step `k` and the point (x, u, w, v).
///
/// Numbers that are not finite are where the equations, or their derivatives, are not defined.
///
/// # Panics
///
/// If a vector has not the system's number of components.
pub fn linearised<Y: System>(
    system: &Y,
    k: usize,
    x: &[f64],
    u: &[f64],
    w: &[f64],
    v: &[f64],
) -> Linearised {
    let outputs = system.variables().y.len();
    let at = |noise: &[f64], outputs: usize, is_output: bool| {
        let (states, noises) = (x.len(), noise.len());
        let map = Map {
            system,
            k,
            u,
            states,
            noises,
            outputs,
            is_output,
        };
        let found = jacobian(&map, &[x, noise].concat());
        let of = |from: usize, n: usize| Matrix::from_fn(outputs, n, |i, j| found.get(i, from + j));
        (found.value.to_vec(), of(0, states), of(states, noises))
    };
    let (next, next_by_x, next_by_w) = at(w, x.len(), false);
    let (output, output_by_x, output_by_v) = at(v, outputs, true);
    Linearised {
        next,
        next_by_x,
        next_by_w,
        output,
        output_by_x,
        output_by_v,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AnySystem;
    use crate::systems::VanDerPol;

    #[test]
    fn the_derivatives_of_van_der_pol_are_those_on_paper() {
        // x1⁺ = x1 + T x2 + w1, x2⁺ = −T x1 + (1 + T − T x1²) x2 + w2, y = x1 + x2 + v.
        let (t, x1, x2) = (0.1, 0.5, 2.0);
        let system = AnySystem::VanDerPol(VanDerPol::new(t).unwrap());
        let at = linearised(&system, 0, &[x1, x2], &[], &[0.25, 0.0], &[0.5]);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        let j = &at.next_by_x;
        near(j[(0, 0)], 1.0);
        near(j[(0, 1)], t);
        near(j[(1, 0)], t * (-1.0 - 2.0 * x1 * x2));
        near(j[(1, 1)], 1.0 + t * (1.0 - x1 * x1));
        assert_eq!(at.next_by_w, Matrix::identity(2));
        near(at.output[0], 3.0);
        assert_eq!(at.output_by_x.as_slice(), [1.0, 1.0]);
        assert_eq!(at.output_by_v.as_slice(), [1.0]);
    }
}
