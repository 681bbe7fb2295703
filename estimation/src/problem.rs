//! What an estimator is told: the system, what is known of the first state, and the noises.
//!
//! An uncertain vector is described once, as a set, as a Gaussian, or as the sum of both, and each
//! estimator reads the part it understands: set filters the box or the generators, the Kalman filter
//! mean and covariance, the mixed filters the sum. Everything is checked here, where it is made.

use crate::error::shortest;
use crate::system::{AnySystem, System};
use serde::{Deserialize, Serialize};
use zonobench_sets::covariance::{Fault, Scaled};
use zonobench_sets::rounding::up;
use zonobench_sets::{Interval, IntervalVector, Matrix};

/// An uncertain vector: c + G ξ + g with ‖ξ‖∞ ≤ 1 (and A ξ = b) and g ~ N(m, Σ).
///
/// Without generators the set part is the point c; without a covariance there is no Gaussian part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Uncertain {
    /// c, of length n.
    pub center: Vec<f64>,
    /// G, n × p.
    pub generators: Option<Matrix>,
    /// The exact bounds, where the set was given as a box; center and the generators along axes then enclose it.
    pub bounds: Option<IntervalVector>,
    /// A (q × p) and b (q): only the ξ with A ξ = b belong to the set.
    pub constraints: Option<(Matrix, Vec<f64>)>,
    /// m, of length n.
    pub mean: Option<Vec<f64>>,
    /// Σ, n × n, symmetric positive semidefinite.
    pub covariance: Option<Matrix>,
}

/// What is wrong with one key of an uncertain vector.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: expected {expected}, got {got}")]
pub struct UncertainError {
    /// The key: `center`, `generators`, `box`, `constraints`, `mean`, `covariance`.
    pub key: &'static str,
    /// What was expected.
    pub expected: String,
    /// What came.
    pub got: String,
}

/// What is wrong with a problem: one key of one of its parts.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{part}.{source}")]
pub struct ProblemError {
    /// `prior`, `noise.w` or `noise.v`.
    pub part: &'static str,
    /// The fault.
    pub source: UncertainError,
}

fn fault(key: &'static str, expected: impl Into<String>, got: impl Into<String>) -> UncertainError {
    UncertainError {
        key,
        expected: expected.into(),
        got: got.into(),
    }
}

impl Uncertain {
    /// The point `c`: nothing is uncertain.
    pub fn point(center: Vec<f64>) -> Self {
        Self {
            center,
            generators: None,
            bounds: None,
            constraints: None,
            mean: None,
            covariance: None,
        }
    }

    /// The zonotope c ⊕ G [−1, 1]^p.
    pub fn zonotope(center: Vec<f64>, generators: Matrix) -> Self {
        Self {
            generators: Some(generators),
            ..Self::point(center)
        }
    }

    /// The Gaussian N(`mean`, `covariance`).
    pub fn gaussian(mean: Vec<f64>, covariance: Matrix) -> Self {
        let center = vec![0.0; mean.len()];
        Self {
            mean: Some(mean),
            covariance: Some(covariance),
            ..Self::point(center)
        }
    }

    /// The box `lower` ≤ x ≤ `upper`, kept exactly in `bounds`, with a center and a diagonal generator
    /// matrix that enclose it: c = fl((lo + hi)/2), r ≥ max(hi − c, c − lo), rounded up unless exact.
    ///
    /// Fails on different lengths, NaN or infinity, and lo > hi.
    pub fn from_box(lower: &[f64], upper: &[f64]) -> Result<Self, UncertainError> {
        if lower.len() != upper.len() {
            return Err(fault(
                "box",
                format!("{} upper bounds", lower.len()),
                upper.len().to_string(),
            ));
        }
        let (mut center, mut radius, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
        for (i, (&lo, &hi)) in lower.iter().zip(upper).enumerate() {
            if !(lo.is_finite() && hi.is_finite()) {
                return Err(fault(
                    "box",
                    "finite numbers",
                    format!(
                        "[{}, {}] in component {}",
                        shortest(lo),
                        shortest(hi),
                        i + 1
                    ),
                ));
            }
            if lo > hi {
                return Err(fault(
                    "box",
                    "lower <= upper",
                    format!(
                        "[{}, {}] in component {}",
                        shortest(lo),
                        shortest(hi),
                        i + 1
                    ),
                ));
            }
            // Halved first, so that the sum of two large bounds does not overflow.
            let c = 0.5 * lo + 0.5 * hi;
            center.push(c);
            radius.push(difference_up(hi, c).max(difference_up(c, lo)));
            bounds.push(Interval::new(lo, hi).expect("the bounds are finite and ordered"));
        }
        Ok(Self {
            generators: Some(Matrix::diagonal(&radius)),
            bounds: Some(IntervalVector::new(bounds)),
            ..Self::point(center)
        })
    }

    /// n, the number of components.
    pub fn dim(&self) -> usize {
        self.center.len()
    }

    /// G, or the n × 0 matrix where the set part is a point.
    pub fn generator_matrix(&self) -> Matrix {
        self.generators
            .clone()
            .unwrap_or_else(|| Matrix::zeros(self.dim(), 0))
    }

    /// Σ, or the n × n matrix of zeros where there is no Gaussian part.
    pub fn covariance_matrix(&self) -> Matrix {
        self.covariance
            .clone()
            .unwrap_or_else(|| Matrix::zeros(self.dim(), self.dim()))
    }

    /// The mean of the vector read as a Gaussian alone: m, or c where no mean was given.
    pub fn gaussian_mean(&self) -> &[f64] {
        self.mean.as_deref().unwrap_or(&self.center)
    }

    /// The mean of the vector read as the sum of both parts: c + m, and c where no mean was given.
    pub fn mixed_mean(&self) -> Vec<f64> {
        match &self.mean {
            Some(m) => self.center.iter().zip(m).map(|(c, m)| c + m).collect(),
            None => self.center.clone(),
        }
    }

    /// True if a set was given (a box or generators).
    pub fn has_set(&self) -> bool {
        self.generators.is_some()
    }

    /// True if a covariance was given.
    pub fn has_gaussian(&self) -> bool {
        self.covariance.is_some()
    }

    /// The smallest box around the set part: the bounds where it was given as a box, else
    /// c_i ± Σ_j |G_ij| rounded outward. Constraints are left out, which can only make it larger.
    pub fn box_hull(&self) -> IntervalVector {
        if let Some(bounds) = &self.bounds {
            return bounds.clone();
        }
        let sides = self.center.iter().enumerate().map(|(i, &c)| {
            let row = self.generators.as_ref().map_or(&[][..], |g| g.row(i));
            if row.iter().all(|&g| g == 0.0) {
                return Interval::point(c);
            }
            let radius = up(row.iter().fold(0.0, |s, g| s + g.abs()), row.len());
            Interval::from_center_radius(c, radius)
        });
        sides.collect()
    }

    /// Whether the generators along axis `i` reach both ends of `side` from the center, certainly.
    fn covers(&self, i: usize, side: Interval) -> bool {
        let c = self.center[i];
        let needed = difference_up(side.hi(), c).max(difference_up(c, side.lo()));
        let Some(g) = &self.generators else {
            return needed <= 0.0;
        };
        let along = (0..g.cols()).filter(|&j| {
            let other = |l: usize| l != i && g[(l, j)] != 0.0;
            g[(i, j)] != 0.0 && !(0..g.rows()).any(other)
        });
        let reach = along.fold(Interval::ZERO, |sum, j| {
            sum + Interval::point(g[(i, j)].abs())
        });
        needed <= reach.lo()
    }

    /// Checks every part against dimension `n`: shapes, finite numbers, symmetry and definiteness.
    pub fn validate(&self, n: usize) -> Result<(), UncertainError> {
        finite_vector("center", &self.center, n)?;
        if let Some(g) = &self.generators {
            if g.rows() != n {
                return Err(fault(
                    "generators",
                    format!("{n} rows"),
                    g.rows().to_string(),
                ));
            }
            finite_matrix("generators", g)?;
        }
        if let Some(bounds) = &self.bounds
            && bounds.dim() != n
        {
            return Err(fault(
                "box",
                format!("{n} pairs [lower, upper]"),
                bounds.dim().to_string(),
            ));
        }
        if let Some(bounds) = &self.bounds
            && let Some(i) = (0..n).find(|&i| !self.covers(i, bounds[i]))
        {
            return Err(fault(
                "box",
                "bounds that the center and the generators along axes enclose",
                format!("{:?} in component {}", bounds[i], i + 1),
            ));
        }
        if let Some((a, b)) = &self.constraints {
            let p = self.generators.as_ref().map_or(0, Matrix::cols);
            if a.cols() != p {
                let expected = format!("a with {p} columns, one a generator");
                return Err(fault("constraints", expected, a.cols().to_string()));
            }
            if a.rows() != b.len() {
                return Err(fault(
                    "constraints",
                    format!("b of length {}", a.rows()),
                    b.len().to_string(),
                ));
            }
            finite_matrix("constraints", a)?;
            finite_vector("constraints", b, b.len())?;
        }
        if let Some(mean) = &self.mean {
            finite_vector("mean", mean, n)?;
        }
        match &self.covariance {
            Some(s) => check_covariance("covariance", s, n),
            None => Ok(()),
        }
    }
}

/// Checks that `s` is n × n, finite, symmetric and positive semidefinite, the last two as [`Scaled::check`] does:
/// whatever the units of its components. `key` names it in the error.
pub fn check_covariance(key: &'static str, s: &Matrix, n: usize) -> Result<(), UncertainError> {
    if (s.rows(), s.cols()) != (n, n) {
        return Err(fault(
            key,
            format!("{n} x {n}"),
            format!("{} x {}", s.rows(), s.cols()),
        ));
    }
    finite_matrix(key, s)?;
    let semidefinite = "a positive semidefinite matrix";
    let (expected, got) = match Scaled::new(s).check() {
        Ok(()) => return Ok(()),
        Err(Fault::Negative { i }) => {
            let got = format!(
                "the variance {} of component {}",
                shortest(s[(i, i)]),
                i + 1
            );
            (semidefinite, got)
        }
        Err(Fault::Asymmetric { i, j }) => {
            let got = format!(
                "{} in row {}, column {} and {} in row {}, column {}",
                shortest(s[(i, j)]),
                i + 1,
                j + 1,
                shortest(s[(j, i)]),
                j + 1,
                i + 1
            );
            ("a symmetric matrix", got)
        }
        Err(Fault::Correlation { i, j }) => {
            let got = format!(
                "the covariance {} of components {} and {}, whose variances are {} and {}",
                shortest(s[(i, j)]),
                j + 1,
                i + 1,
                shortest(s[(j, j)]),
                shortest(s[(i, i)])
            );
            (semidefinite, got)
        }
        Err(Fault::Eigenvalue { value }) => {
            let got = format!("correlations whose matrix has the eigenvalue {value:.2e}");
            (semidefinite, got)
        }
    };
    Err(fault(key, expected, got))
}

fn finite_vector(key: &'static str, v: &[f64], n: usize) -> Result<(), UncertainError> {
    if v.len() != n {
        return Err(fault(key, format!("{n} numbers"), v.len().to_string()));
    }
    match v.iter().position(|x| !x.is_finite()) {
        Some(i) => Err(fault(
            key,
            "finite numbers",
            format!("{} in component {}", shortest(v[i]), i + 1),
        )),
        None => Ok(()),
    }
}

fn finite_matrix(key: &'static str, m: &Matrix) -> Result<(), UncertainError> {
    match m.as_slice().iter().position(|x| !x.is_finite()) {
        Some(at) => {
            let (i, j) = (at / m.cols() + 1, at % m.cols() + 1);
            Err(fault(
                key,
                "finite numbers",
                format!("{} in row {i}, column {j}", shortest(m.as_slice()[at])),
            ))
        }
        None => Ok(()),
    }
}

/// a − b rounded up: exact where the difference is a floating-point number. Needs a ≥ b.
fn difference_up(a: f64, b: f64) -> f64 {
    let d = a - b;
    // Knuth's two-sum: the rounding error of a − b, exactly.
    let b_virtual = a - d;
    let error = (a - (d + b_virtual)) + (b_virtual - b);
    if error > 0.0 { d.next_up() } else { d }
}

/// A system with everything an estimator is told about it: the first state and both noises.
///
/// Every estimator checks the problem that it is made for.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem<Y = AnySystem> {
    /// The model.
    pub system: Y,
    /// What is known of x_0 before anything is measured.
    pub prior: Uncertain,
    /// What is assumed of the process noise. Of an `lpv` system: of w alone, not of δ.
    pub w: Uncertain,
    /// What is assumed of the measurement noise.
    pub v: Uncertain,
}

impl<Y: System> Problem<Y> {
    /// A problem whose parts fit each other.
    ///
    /// Fails where a part has the wrong length or is not what [`Uncertain::validate`] asks for.
    pub fn new(
        system: Y,
        prior: Uncertain,
        w: Uncertain,
        v: Uncertain,
    ) -> Result<Self, ProblemError> {
        let problem = Self {
            system,
            prior,
            w,
            v,
        };
        problem.validate()?;
        Ok(problem)
    }

    /// Checks every part against the system's dimensions.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let variables = self.system.variables();
        let deltas = self.system.n_delta();
        let at = |part| move |source| ProblemError { part, source };
        self.prior
            .validate(variables.x.len())
            .map_err(at("prior"))?;
        self.w
            .validate(variables.w.len() - deltas)
            .map_err(at("noise.w"))?;
        self.v.validate(variables.v.len()).map_err(at("noise.v"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(u: &Uncertain, n: usize) -> String {
        u.validate(n).unwrap_err().to_string()
    }

    #[test]
    fn a_box_keeps_its_bounds_and_its_generators_enclose_them() {
        let exact = Uncertain::from_box(&[-1.0, 2.0], &[1.0, 2.0]).unwrap();
        assert_eq!(exact.center, [0.0, 2.0]);
        assert_eq!(exact.generators, Some(Matrix::diagonal(&[1.0, 0.0])));
        for (lo, hi) in [(0.1, 0.7), (-1e-9, 1e9), (1e300, 1.7e308), (0.3, 0.3)] {
            let u = Uncertain::from_box(&[lo], &[hi]).unwrap();
            let (c, r) = (u.center[0], u.generator_matrix()[(0, 0)]);
            // Exactly: c − r ≤ lo and c + r ≥ hi hold in ℝ if they hold after rounding towards the box.
            assert!((c - r) <= lo && (c + r) >= hi, "{lo} {hi}: {c} ± {r}");
            let hull = u.box_hull();
            assert_eq!((hull[0].lo(), hull[0].hi()), (lo, hi));
        }
    }

    #[test]
    fn a_hull_of_generators_is_rounded_outward() {
        let g = Matrix::from_rows(&[[0.1, 0.2, -0.1], [0.0, 0.0, 0.0]]).unwrap();
        let hull = Uncertain::zonotope(vec![0.5, 0.25], g).box_hull();
        assert!(hull[0].lo() < 0.1 + 1e-15 && hull[0].hi() > 0.9 - 1e-15);
        assert!(hull[0].hi() - hull[0].lo() < 0.8 + 1e-14);
        assert_eq!((hull[1].lo(), hull[1].hi()), (0.25, 0.25));
    }

    #[test]
    fn reversed_or_infinite_bounds_are_refused_with_their_component() {
        let message = |lo, hi| {
            Uncertain::from_box(&[0.0, lo], &[0.0, hi])
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            message(2.0, 1.0),
            "box: expected lower <= upper, got [2, 1] in component 2"
        );
        assert_eq!(
            message(f64::NAN, 1.0),
            "box: expected finite numbers, got [NaN, 1] in component 2"
        );
        assert_eq!(
            message(0.0, f64::INFINITY),
            "box: expected finite numbers, got [0, inf] in component 2"
        );
    }

    #[test]
    fn an_asymmetric_or_indefinite_covariance_is_refused() {
        let covariance = |rows: [[f64; 2]; 2]| {
            Uncertain::gaussian(vec![0.0; 2], Matrix::from_rows(&rows).unwrap())
        };
        assert_eq!(
            message(&covariance([[1.0, 0.5], [0.4, 1.0]]), 2),
            "covariance: expected a symmetric matrix, got 0.4 in row 2, column 1 and 0.5 in row 1, column 2"
        );
        assert_eq!(
            message(&covariance([[1.0, 2.0], [2.0, 1.0]]), 2),
            "covariance: expected a positive semidefinite matrix, got the covariance 2 of components 1 and 2, \
             whose variances are 1 and 1"
        );
        let wide = |rows: [[f64; 3]; 3]| {
            let s = Matrix::from_rows(&rows).unwrap();
            message(&Uncertain::gaussian(vec![0.0; 3], s), 3)
        };
        assert_eq!(
            wide([[1e6, 0.0, 0.0], [0.0, 1e-8, 2e-8], [0.0, 2e-8, 1e-8]]),
            "covariance: expected a positive semidefinite matrix, got the covariance 2e-8 of components 2 and 3, \
             whose variances are 1e-8 and 1e-8"
        );
        assert_eq!(
            wide([[1e6, 0.0, 0.0], [0.0, -2.96e-8, 0.0], [0.0, 0.0, 1.0]]),
            "covariance: expected a positive semidefinite matrix, got the variance -2.96e-8 of component 2"
        );
        assert_eq!(
            wide([
                [1.0, 0.0009, 0.0009],
                [0.0009, 1e-6, -9e-7],
                [0.0009, -9e-7, 1e-6]
            ]),
            "covariance: expected a positive semidefinite matrix, got correlations whose matrix has the eigenvalue -8.00e-1"
        );
        assert!(
            covariance([[1.0, 2.0], [2.0, 4.0]]).validate(2).is_ok(),
            "singular is allowed"
        );
        assert!(
            covariance([[0.0, 0.0], [0.0, 0.0]]).validate(2).is_ok(),
            "zero is allowed"
        );
    }

    #[test]
    fn a_wrong_shape_is_refused_with_its_key() {
        assert_eq!(
            message(&Uncertain::point(vec![0.0]), 2),
            "center: expected 2 numbers, got 1"
        );
        let z = Uncertain::zonotope(vec![0.0; 2], Matrix::zeros(3, 1));
        assert_eq!(message(&z, 2), "generators: expected 2 rows, got 3");
        let constrained = Uncertain {
            constraints: Some((Matrix::zeros(1, 2), vec![0.0])),
            ..Uncertain::zonotope(vec![0.0; 2], Matrix::zeros(2, 3))
        };
        assert_eq!(
            message(&constrained, 2),
            "constraints: expected a with 3 columns, one a generator, got 2"
        );
    }
}
