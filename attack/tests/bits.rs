//! The numbers of every estimator have the bits that are kept in `snapshots/bits.txt`.

#[test]
fn every_estimator_gives_the_bits_that_are_kept() {
    let got = zonobench_attack::bits().unwrap();
    let kept = include_str!("../../snapshots/bits.txt");
    let differ: Vec<(&str, &str)> = kept
        .lines()
        .zip(got.lines())
        .filter(|(a, b)| a != b)
        .collect();
    assert!(
        differ.is_empty() && kept.len() == got.len(),
        "kept and computed: {differ:#?}\n`cargo run -p zonobench-attack --example bits > snapshots/bits.txt` accepts them"
    );
}

/// A test that hashes constants would pass: the estimators must have been run.
#[test]
fn every_kind_has_a_line() {
    let kept = include_str!("../../snapshots/bits.txt");
    for info in zonobench_estimation::estimator::KINDS {
        let line = |l: &&str| {
            l.split(", ")
                .nth(1)
                .is_some_and(|k| k.split(' ').next() == Some(info.kind))
        };
        assert!(
            kept.lines().any(|l| line(&l) && !l.contains(" 0 sets")),
            "{}",
            info.kind
        );
    }
}
