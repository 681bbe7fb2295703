//! No hull of a filter's set cuts off its point, and no set with a point is called empty.

mod filter;

use filter::{Filter, q};
use zonobench_sets::lp::LinearProgram;

#[test]
fn five_thousand_hulls_hold_their_points() {
    let (runs, steps) = (125, 40);
    let (mut sets, mut lost) = (0, 0);
    let mut lp = LinearProgram::new();
    for run in 0..runs {
        let mut filter = Filter::new(1 ^ (1000 + run));
        for _ in 0..steps {
            filter.step();
            let hull = filter.set.interval_hull_with(&mut lp);
            let holds = hull.is_ok_and(|hull| {
                let sides = hull.iter().zip(&filter.truth);
                sides
                    .into_iter()
                    .all(|(side, x)| q(side.lo()) <= *x && *x <= q(side.hi()))
            });
            sets += 1;
            lost += u64::from(!holds);
        }
    }
    println!("{lost} of {sets} hulls cut off the point of their set");
    assert_eq!((sets, lost), (5000, 0));
}
