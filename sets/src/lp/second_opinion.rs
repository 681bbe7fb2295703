//! The same programs by an interior-point solver, whose multipliers and points pass through the same
//! certificate.
//!
//! clarabel knows nothing of bases, so it does not share the simplex's weaknesses: it is the second
//! opinion in tests, and the fallback where the simplex gave up. Its answers are a tolerance away from a
//! vertex, hence its bounds wider; and its bits may depend on the processor, so the fallbacks are counted.
//!
//! It takes numbers of 10²⁰ and more for infinite, drops their rows, and panics where none is left or the sizes
//! are too far apart. What it is given is therefore scaled first, by powers of two that need not be exact since nothing
//! of the answer is trusted: each row and the direction to a largest coefficient in \[1, 2), entries below 2⁻⁶⁰ of that
//! left out. A row whose right side is beyond all that Aξ can be is not given to it: either its slack covers that, and
//! the row says nothing, or the row alone is a proof that nothing satisfies it. Programs without a row or
//! a column are not given to it at all.

use super::certificate::Program;
use crate::matrix::abs_sum;
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

/// A row that clarabel is given: |a ξ − b| ≤ δ, scaled.
struct Row {
    /// The row of the program.
    index: usize,
    scale: f64,
    a: Vec<f64>,
    b: f64,
    delta: f64,
}

/// What is small beside 1 and large beside a coefficient in \[1, 2): 2⁶⁰ < 10²⁰.
const FAR: f64 = (1u64 << 60) as f64;

/// The rows worth asking about, or the row and the sign of its multiplier that prove by themselves that no ξ exists.
fn rows_of(program: &Program) -> Result<Vec<Row>, (usize, f64)> {
    let (m, n) = (program.rows(), program.cols());
    let mut rows = Vec::with_capacity(m);
    for index in 0..m {
        let full = &program.coefficients()[index * program.stride()..][..n];
        let (b, delta) = (program.right_side()[index], program.slack()[index]);
        let reach = abs_sum(full);
        if b.abs() - delta > reach {
            return Err((index, b.signum()));
        }
        if delta - b.abs() > reach {
            continue;
        }
        let scale = to_one(full);
        let times = |x: f64| x * scale.0 * scale.1;
        let a: Vec<f64> = full
            .iter()
            .map(|&x| times(x))
            .map(|x| if x.abs() < 1.0 / FAR { 0.0 } else { x })
            .collect();
        let (b, delta) = (times(b), times(delta));
        // δ and |b| within the reach of each other and both far beyond it: no digit is left for ξ.
        if b.abs() < FAR && delta < FAR {
            let scale = scale.0 * scale.1;
            rows.push(Row {
                index,
                scale,
                a,
                b,
                delta,
            });
        }
    }
    Ok(rows)
}

/// Two powers of two whose product brings the largest |x_j| into [1, 2), or 1 and 1 if all are zero.
fn to_one(x: &[f64]) -> (f64, f64) {
    let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return (1.0, 1.0);
    }
    // The exponent of a subnormal number is taken for that of the smallest normal one.
    let exponent = 1023 - ((largest.to_bits() >> 52) as i64).max(1);
    let power = |e: i64| f64::from_bits(((1023 + e) as u64) << 52);
    let half = exponent / 2;
    (power(half), power(exponent - half))
}

/// max dᵀξ over the rows, as min −dᵀξ subject to Aξ − b ≤ δ, b − Aξ ≤ δ (one equation where δ_i = 0),
/// ξ ≤ 1, −ξ ≤ 1. `None` if the solver fails altogether, or should not be asked.
///
/// With z ≥ 0 its multipliers, d = Aᵀy + z_upper − z_lower for y the equation's multiplier or the difference
/// of the two of a pair.
pub(super) fn consult(program: &Program, d: &[f64]) -> Option<Opinion> {
    let (m, n) = (program.rows(), program.cols());
    if n == 0 || !d.iter().all(|x| x.is_finite()) {
        return None;
    }
    let mut multipliers = vec![0.0; m];
    let rows = match rows_of(program) {
        Ok(rows) => rows,
        Err((index, sign)) => {
            multipliers[index] = sign;
            return Some(Opinion {
                multipliers,
                point: vec![0.0; n],
                infeasible: true,
            });
        }
    };
    let d_scale = to_one(&d[..n]);
    let cost: Vec<f64> = d[..n].iter().map(|d| -d * d_scale.0 * d_scale.1).collect();
    if rows.is_empty() {
        return Some(Opinion {
            multipliers,
            point: d[..n].iter().map(|d| d.signum()).collect(),
            infeasible: false,
        });
    }
    let (equations, pairs): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| row.delta == 0.0);
    let right: Vec<f64> = (equations.iter().map(|row| row.b))
        .chain(pairs.iter().map(|row| row.b + row.delta))
        .chain(pairs.iter().map(|row| row.delta - row.b))
        .chain(std::iter::repeat_n(1.0, 2 * n))
        .collect();
    let (first, second) = (equations.len(), equations.len() + pairs.len());
    let upper = second + pairs.len();
    let (mut colptr, mut rowval, mut nzval) = (vec![0], Vec::new(), Vec::new());
    for j in 0..n {
        let mut put = |row: usize, value: f64| {
            if value != 0.0 {
                rowval.push(row);
                nzval.push(value);
            }
        };
        for (k, row) in equations.iter().enumerate() {
            put(k, row.a[j]);
        }
        for (k, row) in pairs.iter().enumerate() {
            put(first + k, row.a[j]);
        }
        for (k, row) in pairs.iter().enumerate() {
            put(second + k, -row.a[j]);
        }
        put(upper + j, 1.0);
        put(upper + n + j, -1.0);
        colptr.push(rowval.len());
    }
    let matrix = CscMatrix::new(right.len(), n, colptr, rowval, nzval);
    let cones = [
        SupportedConeT::ZeroConeT(equations.len()),
        SupportedConeT::NonnegativeConeT(2 * pairs.len() + 2 * n),
    ];
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-11,
        tol_gap_rel: 1e-11,
        tol_feas: 1e-11,
        ..DefaultSettings::default()
    };
    let quadratic = CscMatrix::zeros((n, n));
    let mut solver =
        DefaultSolver::new(&quadratic, &cost, &matrix, &right, &cones, settings).ok()?;
    solver.solve();
    let z = &solver.solution.z;
    let infeasible = matches!(
        solver.solution.status,
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible
    );
    // The multipliers of a bound are for the scaled direction; those of a proof may be of any size.
    let back = |y: f64| {
        if infeasible {
            -y
        } else {
            y / d_scale.0 / d_scale.1
        }
    };
    for (k, row) in equations.iter().enumerate() {
        multipliers[row.index] = back(z[k] * row.scale);
    }
    for (k, row) in pairs.iter().enumerate() {
        multipliers[row.index] = back((z[first + k] - z[second + k]) * row.scale);
    }
    Some(Opinion {
        multipliers,
        point: solver.solution.x.clone(),
        infeasible,
    })
}
