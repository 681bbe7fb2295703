//! The exact sizes of [Rego2020, Remarks 3, 5, 8 and Prop. 2] and [dePaula, Remark 3].

use crate::claim::{Row, Verdict, statement};
use crate::ezgkf;
use crate::instance::{Dense, Instance};
use zonobench_estimation::estimator::Estimator;
use zonobench_estimation::estimators::{Ezgkf, EzgkfM, EzgkfSettings};
use zonobench_estimation::propagation::{
    Choice, Expansion, Remainder, first_order_about, mean_value,
};
use zonobench_sets::ConstrainedZonotope;
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::reduction::scott;

/// Random sizes tried for each statement.
const TRIALS: u64 = 12;

const VALID: &str = "the instance is a valid one";

/// The row of a statement about sizes: `trial` gives what the statement says and what was found.
fn exact(claim: &str, trial: impl Fn(&mut Instance) -> ([usize; 2], [usize; 2])) -> Row {
    let mut wrong = None;
    for i in 0..TRIALS {
        let (said, found) = trial(&mut Instance::new((2 << 40) + i));
        if said != found {
            wrong = Some((said, found));
        }
    }
    match wrong {
        None => statement(
            claim,
            Verdict::Holds,
            format!("generators and constraints are as stated for {TRIALS} random sizes"),
        ),
        Some((said, found)) => statement(
            claim,
            Verdict::DoesNotHold,
            format!(
                "stated are {} generators and {} constraints, found {} and {}",
                said[0], said[1], found[0], found[1]
            ),
        ),
    }
}

fn found(set: &ConstrainedZonotope) -> [usize; 2] {
    [set.generators(), set.constraints()]
}

/// Random X and W with their sizes (n, n_g, n_c), (n_w, n_gw, n_cw).
fn sets(draw: &mut Instance) -> (ConstrainedZonotope, ConstrainedZonotope) {
    let (n, n_w) = (draw.integer(2, 4), draw.integer(1, 3));
    let (n_c, n_cw) = (draw.integer(1, 2), draw.integer(1, 2));
    let n_g = draw.integer(n + n_c, n + n_c + 4);
    let n_gw = draw.integer(n_w + n_cw, n_w + n_cw + 3);
    (
        draw.constrained(n, n_g, n_c, 0.2),
        draw.constrained(n_w, n_gw, n_cw, 0.2),
    )
}

/// The rows of \[Rego2020\].
pub fn of_constrained_zonotopes() -> Vec<Row> {
    vec![
        exact("cz-remark-5", |draw| {
            let (x, w) = sets(draw);
            let f = Dense::new(draw, x.dim(), w.dim());
            let mut lp = LinearProgram::new();
            let hull = x.interval_hull_with(&mut lp).expect(VALID);
            let set = mean_value(&f, &x, &hull, &w, Choice::C3, &mut lp).expect(VALID);
            let stated = x.generators() + w.generators() + 2 * x.dim();
            ([stated, x.constraints() + w.constraints()], found(&set))
        }),
        exact("cz-remark-8", |draw| {
            let (x, w) = sets(draw);
            let f = Dense::new(draw, x.dim(), w.dim());
            let z = x.cartesian_product(&w);
            let over = z.interval_hull().expect(VALID);
            // Any h other than the center brings the last term in.
            let h = over.mid();
            let set = first_order_about(&f, &z, &over, &h, Remainder::Symmetric, Expansion::Full)
                .expect(VALID);
            let (g, c) = (z.generators(), z.constraints());
            (
                [(g * g + 5 * g) / 2 + 2 * x.dim(), (c * c + 5 * c) / 2],
                found(&set),
            )
        }),
        exact("cz-proposition-2", |draw| {
            let (x, _) = sets(draw);
            let middle = vec![0.0; x.generators()];
            let set = scott::recentred(&x, &middle).expect(VALID);
            (
                [2 * x.generators(), 2 * x.constraints() + x.dim()],
                found(&set),
            )
        }),
    ]
}

/// The rows of \[dePaula\]: columns of the predicted generator matrix, which has no constraints.
pub fn of_predictions() -> Vec<Row> {
    let columns = |draw: &mut Instance, interval: bool| {
        let mut s = ezgkf::configuration(draw.integer(0, 10_000) as u64);
        s.phi = s.n + draw.integer(0, 20);
        let problem = draw.lpv(&s);
        let settings = EzgkfSettings {
            phi: s.phi,
            eta: 0.5,
            alpha: 0.0027,
            gain: Default::default(),
            overbars: true,
            merge_parallel: false,
            scale: Default::default(),
        };
        let u = vec![0.0; s.p];
        let generators = if interval {
            let filter = EzgkfM::new(&settings, &problem).expect(VALID);
            filter
                .predict(1, &filter.prior(), &u)
                .expect(VALID)
                .state
                .generators()
        } else {
            let filter = Ezgkf::new(&settings, &problem).expect(VALID);
            filter
                .predict(1, &filter.prior(), &u)
                .expect(VALID)
                .state
                .generators()
        };
        (s, generators)
    };
    vec![
        exact("ezgkf-order-affine", |draw| {
            let (s, found) = columns(draw, false);
            ([s.phi + s.n_gw + s.n_delta * (1 + s.phi), 0], [found, 0])
        }),
        exact("ezgkf-order-interval", |draw| {
            let (s, found) = columns(draw, true);
            ([s.phi + s.n_gw + 2 * s.n, 0], [found, 0])
        }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_statement_about_sizes_is_decided_and_a_wrong_one_is_found() {
        for row in of_constrained_zonotopes().iter().chain(&of_predictions()) {
            assert_eq!(row.verdict, Verdict::Holds, "{row:?}");
        }
        let wrong = exact("wrong", |_| ([3, 1], [3, 2]));
        assert_eq!(wrong.verdict, Verdict::DoesNotHold);
        assert!(wrong.reason.contains("found 3 and 2"));
    }
}
