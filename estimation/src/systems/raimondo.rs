//! The nonlinear example of two states on which set-membership filters are compared.

use crate::system::{System, Variable, Variables, constant_output};
use serde::{Deserialize, Serialize};
use zonobench_sets::number::Real;
use zonobench_sets::{Interval, IntervalVector, Matrix};

/// x₁⁺ = 3 x₁ − x₁²/7 − 4 x₁x₂/(4 + x₁) + w₁, x₂⁺ = −2 x₂ + 3 x₁x₂/(4 + x₁) + w₂,
/// y₁ = x₁ + v₁, y₂ = −x₁ + x₂ + v₂.
///
/// Defined where 4 + x₁ ≠ 0. Source: [Rego2020, Eqs. (23), (25)], after Raimondo et al.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Raimondo {
    /// How x₁/(4 + x₁) is written, which decides how wide enclosures of the derivatives are.
    #[serde(default)]
    pub form: QuotientForm,
    /// What is measured.
    #[serde(default)]
    pub output: Measured,
}

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measured {
    /// y of [Rego2020, Eq. (25)].
    #[default]
    Both,
    /// Nothing: sets are only propagated, and there is neither y nor v.
    None,
}

/// How x₁/(4 + x₁) is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum QuotientForm {
    /// 1 − 4/(4 + x₁): x₁ once, so its derivative 4/(4 + x₁)² has x₁ once.
    #[default]
    Tight,
    /// x₁/(4 + x₁) as printed: x₁ twice, and wider enclosures.
    Printed,
    /// x₁x₂ · 1/(4 + x₁): its derivative is x₂/(4 + x₁) − x₁x₂/(4 + x₁)², as symbolic differentiation
    /// writes it, and \[Khajenejad\] with it.
    Expanded,
}

impl System for Raimondo {
    fn variables(&self) -> Variables {
        let measured = match self.output {
            Measured::Both => 2,
            Measured::None => 0,
        };
        Variables {
            x: Variable::numbered("x", 2),
            u: Vec::new(),
            w: Variable::numbered("w", 2),
            y: Variable::numbered("y", measured),
            v: Variable::numbered("v", measured),
        }
    }

    fn f<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], w: &[S], next: &mut [S]) {
        let linear = x[0] * 3.0 - x[0].sqr() / 7.0;
        let shifted = x[0] + 4.0;
        match self.form {
            QuotientForm::Tight => {
                // x₁x₂/(4 + x₁) = x₂ − 4 x₂/(4 + x₁).
                let rest = x[1] * shifted.recip();
                next[0] = linear - x[1] * 4.0 + rest * 16.0 + w[0];
                next[1] = x[1] - rest * 12.0 + w[1];
            }
            QuotientForm::Printed => {
                let product = x[0] * x[1] / shifted;
                next[0] = linear - product * 4.0 + w[0];
                next[1] = product * 3.0 - x[1] * 2.0 + w[1];
            }
            QuotientForm::Expanded => {
                let product = x[0] * x[1] * shifted.recip();
                next[0] = linear - product * 4.0 + w[0];
                next[1] = product * 3.0 - x[1] * 2.0 + w[1];
            }
        }
    }

    fn h<S: Real>(&self, _k: usize, x: &[S], _u: &[f64], v: &[S], y: &mut [S]) {
        if self.output == Measured::Both {
            y[0] = x[0] + v[0];
            y[1] = x[1] - x[0] + v[1];
        }
    }

    fn kind(&self) -> &'static str {
        "raimondo"
    }

    fn measures_input(&self) -> bool {
        false
    }

    fn linear_output(&self) -> Option<(Matrix, Matrix)> {
        constant_output(self)
    }

    fn domain_fault(&self, over: &IntervalVector) -> Option<String> {
        let shifted = over[0] + Interval::point(4.0);
        shifted.contains(0.0).then(|| {
            let (lo, hi) = (shifted.lo(), shifted.hi());
            format!("4 + x1 may be 0: the set reaches over [{lo}, {hi}]")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_forms_are_the_same_function() {
        let mut next = [[0.0; 2]; 3];
        for (next, form) in next.iter_mut().zip([
            QuotientForm::Tight,
            QuotientForm::Printed,
            QuotientForm::Expanded,
        ]) {
            let system = Raimondo {
                form,
                ..Raimondo::default()
            };
            system.f(0, &[0.8, 0.65], &[], &[0.1, -0.2], next);
        }
        // 2.4 − 0.64/7 − 2.08/4.8 + 0.1 and −1.3 + 1.56/4.8 − 0.2
        let expected = [2.4 - 0.64 / 7.0 - 2.08 / 4.8 + 0.1, -1.3 + 1.56 / 4.8 - 0.2];
        for next in next {
            assert!((next[0] - expected[0]).abs() < 1e-14 && (next[1] - expected[1]).abs() < 1e-14);
        }
    }

    #[test]
    fn nothing_is_measured_where_there_is_no_output() {
        let system = Raimondo {
            output: Measured::None,
            ..Raimondo::default()
        };
        let variables = system.variables();
        assert_eq!((variables.x.len(), variables.w.len()), (2, 2));
        assert!(variables.y.is_empty() && variables.v.is_empty());
        let mut y: [f64; 0] = [];
        system.h(0, &[0.8, 0.65], &[], &[], &mut y);
    }
}
