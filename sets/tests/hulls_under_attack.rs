//! No hull cuts off a point of its set, and no set with a point is called empty.

mod attack;

#[test]
fn ten_thousand_hulls_hold_their_points() {
    let report = attack::attack(10_000, 1);
    println!(
        "{} of {} hulls cut off a point of their set: {report:?}",
        report.cut_off, report.sets
    );
    assert_eq!(
        (report.sets, report.cut_off, report.called_empty),
        (10_000, 0, 0)
    );
}
