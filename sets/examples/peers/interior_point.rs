//! clarabel, as a user would call it: one solver a set, the cost changed from one side to the next, its own objective
//! taken for the end, default settings.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SupportedConeT};
use zonobench_sets::ConstrainedZonotope;

/// The version in the workspace's lock file.
pub const VERSION: &str = "0.11.1";

/// A ξ = b, ξ ≤ 1, −ξ ≤ 1.
fn solver(set: &ConstrainedZonotope, d: &[f64]) -> DefaultSolver<f64> {
    let (q, p) = (set.constraints(), set.generators());
    let (mut colptr, mut rowval, mut nzval) = (vec![0], Vec::new(), Vec::new());
    for j in 0..p {
        rowval.extend((0..q).chain([q + j, q + p + j]));
        nzval.extend(set.a().col(j).into_iter().chain([1.0, -1.0]));
        colptr.push(rowval.len());
    }
    let rows = CscMatrix::new(q + 2 * p, p, colptr, rowval, nzval);
    let right = [set.b(), &vec![1.0; 2 * p]].concat();
    let cones = [
        SupportedConeT::ZeroConeT(q),
        SupportedConeT::NonnegativeConeT(2 * p),
    ];
    let settings = DefaultSettings {
        verbose: false,
        ..DefaultSettings::default()
    };
    let cost: Vec<f64> = d.iter().map(|d| -d).collect();
    DefaultSolver::new(
        &CscMatrix::zeros((p, p)),
        &cost,
        &rows,
        &right,
        &cones,
        settings,
    )
    .expect("the shapes fit")
}

/// (upper, lower) a state.
pub fn hull(set: &ConstrainedZonotope) -> Vec<[f64; 2]> {
    let mut solver = solver(set, set.g().row(0));
    let mut end = |cost: Vec<f64>| {
        solver.update_q(&cost).expect("the shape is the same");
        solver.solve();
        -solver.solution.obj_val
    };
    (0..set.dim())
        .map(|j| {
            let (row, c) = (set.g().row(j), set.c()[j]);
            let upper = c + end(row.iter().map(|g| -g).collect());
            let lower = c - end(row.to_vec());
            [upper, lower]
        })
        .collect()
}

/// max dᵀx over the set.
pub fn support(set: &ConstrainedZonotope, d: &[f64]) -> f64 {
    let along = set.g().transpose().mul_vec(d);
    let mut solver = solver(set, &along);
    solver.solve();
    d.iter().zip(set.c()).map(|(d, c)| d * c).sum::<f64>() - solver.solution.obj_val
}
