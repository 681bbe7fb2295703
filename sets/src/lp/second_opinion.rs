//! The same programs by an interior-point solver, whose multipliers and points pass through the same
//! certificate.
//!
//! clarabel knows nothing of bases, so it does not share the simplex's weaknesses: it is the second
//! opinion in tests, and the fallback where the simplex gave up. Its answers are a tolerance away from a
//! vertex, hence its bounds wider; and its bits may depend on the processor, so the fallbacks are counted.

use super::certificate::Program;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// What the solver ends with.
pub(super) struct Opinion {
    /// Multipliers of the rows: for the bound, or, if `infeasible`, the Farkas vector.
    pub(super) multipliers: Vec<f64>,
    /// A nearly optimal ξ, not clamped.
    pub(super) point: Vec<f64>,
    /// The solver believes that no ξ satisfies the rows.
    pub(super) infeasible: bool,
}

/// max dᵀξ over the rows, as min −dᵀξ subject to Aξ − b ≤ δ, b − Aξ ≤ δ (one equation where δ_i = 0),
/// ξ ≤ 1, −ξ ≤ 1. `None` if the solver fails altogether.
///
/// With z ≥ 0 its multipliers, d = Aᵀy + z_upper − z_lower for y the equation's multiplier or the difference
/// of the two of a pair.
pub(super) fn consult(program: &Program, d: &[f64]) -> Option<Opinion> {
    let (m, n) = (program.rows(), program.cols());
    let slack = program.slack();
    let equations: Vec<usize> = (0..m).filter(|&i| slack[i] == 0.0).collect();
    let pairs: Vec<usize> = (0..m).filter(|&i| slack[i] != 0.0).collect();
    let b = program.right_side();
    let right: Vec<f64> = (equations.iter().map(|&i| b[i]))
        .chain(pairs.iter().map(|&i| b[i] + slack[i]))
        .chain(pairs.iter().map(|&i| slack[i] - b[i]))
        .chain(std::iter::repeat_n(1.0, 2 * n))
        .collect();
    let (first, second) = (equations.len(), equations.len() + pairs.len());
    let upper = second + pairs.len();
    let (mut colptr, mut rowval, mut nzval) = (vec![0], Vec::new(), Vec::new());
    for j in 0..n {
        let a = |i: usize| program.coefficients()[i * program.stride() + j];
        let mut put = |row: usize, value: f64| {
            if value != 0.0 {
                rowval.push(row);
                nzval.push(value);
            }
        };
        for (k, &i) in equations.iter().enumerate() {
            put(k, a(i));
        }
        for (k, &i) in pairs.iter().enumerate() {
            put(first + k, a(i));
        }
        for (k, &i) in pairs.iter().enumerate() {
            put(second + k, -a(i));
        }
        put(upper + j, 1.0);
        put(upper + n + j, -1.0);
        colptr.push(rowval.len());
    }
    let rows = CscMatrix::new(right.len(), n, colptr, rowval, nzval);
    let cones = [
        SupportedConeT::ZeroConeT(equations.len()),
        SupportedConeT::NonnegativeConeT(2 * pairs.len() + 2 * n),
    ];
    let cost: Vec<f64> = d[..n].iter().map(|d| -d).collect();
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-11,
        tol_gap_rel: 1e-11,
        tol_feas: 1e-11,
        ..DefaultSettings::default()
    };
    let quadratic = CscMatrix::zeros((n, n));
    let mut solver = DefaultSolver::new(&quadratic, &cost, &rows, &right, &cones, settings).ok()?;
    solver.solve();
    let z = &solver.solution.z;
    let infeasible = matches!(
        solver.solution.status,
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible
    );
    let sign = if infeasible { -1.0 } else { 1.0 };
    let mut multipliers = vec![0.0; m];
    for (k, &i) in equations.iter().enumerate() {
        multipliers[i] = sign * z[k];
    }
    for (k, &i) in pairs.iter().enumerate() {
        multipliers[i] = sign * (z[first + k] - z[second + k]);
    }
    Some(Opinion {
        multipliers,
        point: solver.solution.x.clone(),
        infeasible,
    })
}
