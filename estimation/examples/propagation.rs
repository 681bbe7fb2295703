//! Sets through nonlinear dynamics, without an estimator: the image of a triangle under one step, enclosed by the
//! mean value extension and by the first-order Taylor extension.
//!
//! Run with `cargo run -p zonobench-estimation --example propagation`.

use zonobench_estimation::propagation::{
    Choice, Dynamics, Expansion, Remainder, first_order, mean_value,
};
use zonobench_estimation::systems::Raimondo;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::{ConstrainedZonotope, Matrix, SetError};

fn main() -> Result<(), SetError> {
    // The triangle with the vertices (-1.2, 1), (-1.5, 1.3) and (-1.5, 0.7); its center (-1, 1) lies outside.
    let g = Matrix::from_rows(&[[0.2, 0.4, 0.2], [0.2, 0.0, -0.2]])?;
    let a = Matrix::from_rows(&[[2.0, 2.0, 2.0]])?;
    let x = ConstrainedZonotope::new(vec![-1.0, 1.0], g, a, vec![-3.0])?;
    // No process noise: a set of one point.
    let w = ConstrainedZonotope::new(
        vec![0.0; 2],
        Matrix::zeros(2, 0),
        Matrix::zeros(0, 0),
        Vec::new(),
    )?;

    let system = Raimondo::default();
    let f = Dynamics::new(&system, 0, &[]);
    let mut lp = LinearProgram::new();
    // One hull serves every extension of the same set.
    let hull = x.interval_hull_with(&mut lp)?;

    println!("choice  extension   generators constraints     area  hull");
    for choice in [Choice::C1, Choice::C2, Choice::C3, Choice::C4] {
        let mean = mean_value(&f, &x, &hull, &w, choice, &mut lp)?;
        let taylor = first_order(
            &f,
            &x,
            &hull,
            &w,
            choice,
            Remainder::Symmetric,
            Expansion::Full,
            &mut lp,
        )?;
        for (name, set) in [("mean value", mean), ("first order", taylor)] {
            let bounds = set.interval_hull_with(&mut lp)?;
            let area = set.volume()?.unwrap_or(f64::NAN);
            println!(
                "{choice:?}      {name:11} {:10} {:11} {area:8.3}  [{:.3}, {:.3}] x [{:.3}, {:.3}]",
                set.generators(),
                set.constraints(),
                bounds[0].lo(),
                bounds[0].hi(),
                bounds[1].lo(),
                bounds[1].hi()
            );
        }
    }
    Ok(())
}
