//! The walks of the guide: its examples run, and stand there as they are.

#[path = "../examples/new_estimator.rs"]
mod new_estimator;
#[path = "../examples/own_system.rs"]
mod own_system;

const GUIDE: &str = include_str!("../../docs/walks.md");

#[test]
fn a_system_of_ones_own_is_held_by_its_sets() {
    own_system::main().unwrap();
}

#[test]
fn a_new_estimator_never_loses_the_truth() {
    new_estimator::main();
}

#[test]
fn the_guide_shows_the_examples_as_they_are() {
    for (name, text) in [
        ("own_system", include_str!("../examples/own_system.rs")),
        (
            "new_estimator",
            include_str!("../examples/new_estimator.rs"),
        ),
    ] {
        assert!(
            GUIDE.contains(&format!("```rust\n{text}```")),
            "docs/walks.md shows another {name}.rs"
        );
    }
}
