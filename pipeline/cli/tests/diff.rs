//! `diff`: what moved between two lakes, and which part of a key did it.

mod program;

use program::{Folder, SMALL};
use serde_json::Value;

fn two_lakes(second: &str) -> Folder {
    let folder = Folder::new();
    folder.write("one.toml", SMALL);
    folder.write("two.toml", second);
    for (file, lake) in [("one.toml", "a"), ("two.toml", "b")] {
        folder.done(&["run", file, "--lake", lake]);
    }
    folder
}

#[test]
fn one_setting_moves_exactly_what_depends_on_it() {
    let folder = two_lakes(&SMALL.replace("eta = 0.5", "eta = 0.25"));
    let outcome = folder.run(&["diff", "a", "b", "--format", "json"]);
    let found: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let beyond = found["moved_beyond"].as_bool().unwrap();
    assert_eq!(outcome.code, Some(i32::from(beyond)), "{}", outcome.stderr);
    let changes = found["changes"].as_array().unwrap();
    assert!(!changes.is_empty());
    for change in changes {
        assert_eq!(change["of"]["estimator"], "mixed", "{change}");
        let causes = change["causes"].as_array().unwrap();
        assert_eq!(causes.len(), 1, "{change}");
        let cause = causes[0].as_str().unwrap();
        assert!(cause.starts_with("small/estimate.mixed: "), "{cause}");
        assert!(cause.ends_with("eta: 0.5 -> 0.25"), "{cause}");
    }
    assert!(found["unchanged"]["scores"].as_u64().unwrap() > 0);
}

#[test]
fn another_noise_moves_numbers_beyond_their_intervals() {
    let folder =
        two_lakes(&SMALL.replace("v = { box = [[-1.0, 1.0]]", "v = { box = [[-9.0, 9.0]]"));
    let outcome = folder.run(&["diff", "a", "b"]).ends_with(1);
    assert!(outcome.stdout.contains("beyond its interval"));
    assert!(outcome.stdout.contains(" -> "), "{}", outcome.stdout);
}

#[test]
fn completions_know_the_commands() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish"] {
        let outcome = folder.done(&["completions", shell]);
        assert!(outcome.stdout.contains("reproduce-all"), "{shell}");
    }
    folder.done(&["completions", "man", "--out", "man"]);
    assert!(folder.path("man/zonobench-diff.1").is_file());
}

#[test]
fn a_lake_is_equal_to_itself_in_every_format() {
    let folder = two_lakes(SMALL);
    for format in ["table", "markdown", "json", "html"] {
        let outcome = folder.done(&["diff", "a", "b", "--format", format]);
        assert!(outcome.stdout.contains("unchanged"), "{}", outcome.stdout);
        assert!(!outcome.stdout.contains("moved beyond its"), "{format}");
    }
}

#[test]
fn what_is_no_lake_is_named() {
    let folder = two_lakes(SMALL);
    let outcome = folder.run(&["diff", "a", "nowhere"]).ends_with(2);
    assert!(outcome.stderr.contains("nowhere"), "{}", outcome.stderr);
}
