//! The same input gives the same bytes, whatever the number of threads, and nothing is made twice.

mod program;

use program::{Folder, Outcome, RESULTS, SMALL, assert_same};

/// [`SMALL`] with `old` replaced.
fn changed(old: &str, new: &str) -> String {
    assert!(SMALL.contains(old), "{old}");
    SMALL.replacen(old, new, 1)
}

/// The targets that would run and those that would not, as `explain` says.
fn explained(outcome: &Outcome) -> (Vec<String>, Vec<String>) {
    let line = |end: &str| {
        let lines = outcome.stdout.lines().filter(|line| line.contains(end));
        lines
            .map(|line| line.split(": ").next().unwrap().replace("mine/small/", ""))
            .collect()
    };
    (line(": would run"), line(": in the lake, would not run"))
}

#[test]
fn the_lake_has_the_same_bytes_at_any_number_of_threads() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml", "--jobs", "1", "--lake", "lake1"]);
    let one = folder.vouched("lake1");
    let tables = [
        "truth",
        "measurements",
        "estimates",
        "beliefs",
        "sets",
        "metrics",
        "scores",
        "traces",
    ];
    for table in tables {
        assert!(
            one.keys()
                .any(|path| path.starts_with(&format!("{table}/"))),
            "{table} in {:?}",
            one.keys()
        );
    }
    assert!(!one.keys().any(|path| path.starts_with("timings/")));
    for jobs in ["2", "4"] {
        let lake = format!("lake{jobs}");
        folder.done(&["run", "small.toml", "--jobs", jobs, "--lake", &lake]);
        assert_same(&format!("{jobs} threads"), &folder.vouched(&lake), &one);
    }
}

/// The hashes stand for the values: the same in a lake of other bytes, others where one value is another.
#[test]
fn hashes_of_the_numbers_follow_the_values() {
    let folder = Folder::with_small();
    folder.write("other.toml", changed("seed = 7", "seed = 8"));
    folder.write("worded.toml", changed("id = \"kf\"", "id = \"kg\""));
    let numbers = |file: &str, lake: &str| {
        folder.done(&["run", file, "--lake", lake]);
        folder.done(&["verify", "--numbers", "--lake", lake]).stdout
    };
    let line = |text: &str, table: &str| {
        let start = format!("{table}, ");
        let line = text.lines().find(|line| line.starts_with(&start));
        line.unwrap_or_else(|| panic!("no {table} in {text}"))
            .to_owned()
    };
    let (first, again) = (
        numbers("small.toml", "lake"),
        numbers("small.toml", "again"),
    );
    assert_eq!(first, again);
    let other = numbers("other.toml", "other");
    for table in ["truth", "measurements", "estimates", "scores", "all"] {
        assert_ne!(line(&first, table), line(&other, table));
    }
    assert_eq!(
        line(&first, "truth").split(' ').nth(1),
        Some("4880"),
        "40 runs, 61 steps, 2 components"
    );
    let worded = numbers("worded.toml", "worded");
    assert_eq!(line(&first, "truth"), line(&worded, "truth"));
}

#[test]
fn a_second_run_makes_nothing() {
    let folder = Folder::with_small();
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (RESULTS, 0));
    let first = folder.vouched("lake");
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (0, RESULTS));
    assert_same("a second run", &folder.vouched("lake"), &first);
}

#[test]
fn white_space_comments_and_the_order_of_keys_make_nothing_run() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let first = folder.vouched("lake");
    let same = [
        (
            "a comment",
            format!(
                "# about\n\n{}",
                SMALL.replace("runs = 40", "runs   =   40   # enough")
            ),
        ),
        (
            "keys of an estimator",
            changed(
                "phi = 20\neta = 0.5\nalpha = 0.01",
                "alpha = 0.01\nphi = 20\neta = 0.5",
            ),
        ),
        (
            "id after the settings",
            changed(
                "id = \"mixed\"\nkind = \"ezgkf\"\nphi = 20",
                "phi = 20\nkind = \"ezgkf\"\nid = \"mixed\"",
            ),
        ),
        (
            "keys of the file",
            changed(
                "seed = 7\nruns = 40\nsteps = 60",
                "steps = 60\nruns = 40\nseed = 7",
            ),
        ),
        ("digits", changed("eta = 0.5", "eta = 5e-1")),
        (
            "a default",
            changed(
                "kind = \"box-state-est\"",
                "kind = \"box-state-est\"\nproducts = \"stacked\"",
            ),
        ),
        ("a title", changed("seed = 7", "title = \"New\"\nseed = 7")),
    ];
    for (what, text) in same {
        assert_ne!(text, SMALL, "{what}");
        folder.write("small.toml", text);
        assert_eq!(
            folder.done(&["run", "small.toml"]).tally(),
            (0, RESULTS),
            "{what}"
        );
        assert_same(what, &folder.vouched("lake"), &first);
    }
}

#[test]
fn one_setting_of_one_estimator_runs_what_reads_it() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let plan = folder.done(&["plan", "small.toml"]);
    assert_eq!(
        plan.stdout,
        format!("0 results to make, {RESULTS} in the lake\n")
    );
    folder.write("small.toml", changed("phi = 20", "phi = 24"));
    let plan = folder.done(&["plan", "small.toml"]).stdout;
    assert!(
        plan.contains("mine/small/estimate/mixed: /input/settings/phi: 20 -> 24\n"),
        "{plan}"
    );
    assert!(
        plan.ends_with("4 results to make, 5 in the lake\n"),
        "{plan}"
    );
    let explain = folder.done(&["explain", "mine/small", "small.toml"]);
    let (run, not_run) = explained(&explain);
    assert_eq!(run, ["estimate/mixed", "trace/mixed", "reduce", "score"]);
    assert_eq!(
        not_run,
        [
            "simulate",
            "estimate/kf",
            "estimate/box",
            "trace/kf",
            "trace/box"
        ]
    );
    let one = folder
        .done(&["explain", "mine/small/estimate/mixed", "small.toml"])
        .stdout;
    assert_eq!(
        one,
        "mine/small/estimate/mixed: would run, its key differs:\n  /input/settings/phi: 20 -> 24\n"
    );
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (4, 5));
    // Back again: all of it is still there.
    folder.write("small.toml", SMALL);
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (0, RESULTS));
}

#[test]
fn a_new_estimator_runs_alone_and_one_that_is_gone_leaves_no_file() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let first = folder.vouched("lake");
    let more = changed(
        "[[metric]]",
        "[[estimator]]\nid = \"more\"\nkind = \"ezgkf\"\nphi = 8\neta = 0.5\nalpha = 0.1\n\n[[metric]]",
    );
    folder.write("small.toml", more);
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (4, 7));
    let trace = "traces/paper=mine/experiment=small/more_run0000.mcap";
    assert!(folder.path("lake").join(trace).exists());
    folder.write("small.toml", SMALL);
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (0, RESULTS));
    assert!(!folder.path("lake").join(trace).exists());
    assert_same("without it", &folder.vouched("lake"), &first);
    folder.done(&["verify"]);
}

#[test]
fn estimators_see_the_noise_that_they_saw_before_another_came() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let query = "SELECT * FROM metrics WHERE estimator = 'box'";
    let first = folder.done(&["query", query, "--format", "csv"]).stdout;
    assert!(first.lines().count() > 100);
    let sweep = format!("{SMALL}\n[sweep]\n\"estimator.mixed.phi\" = [20, 30]\n");
    folder.write(
        "swept.toml",
        sweep.replace("id = \"small\"", "id = \"swept\""),
    );
    // The data and the estimates are those of `small`, but for the second mixed filter; the traces carry
    // the name of their experiment.
    let (made, found) = folder.done(&["run", "swept.toml", "--jobs", "1"]).tally();
    assert_eq!((made, found), (3 + 1 + 3 + 2, 2 * RESULTS - 9));
    let swept = format!("{query} AND experiment = 'swept_phi30'");
    let again = folder.done(&["query", &swept, "--format", "csv"]).stdout;
    assert_eq!(again.replace("swept_phi30", "small"), first);
}

#[test]
fn a_lake_that_is_copied_elsewhere_makes_nothing_run() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let elsewhere = Folder::with_small();
    let copied = std::process::Command::new("cp")
        .arg("-r")
        .arg(folder.path("lake"))
        .arg(elsewhere.path("other"))
        .status();
    assert!(copied.unwrap().success());
    assert_eq!(
        elsewhere
            .done(&["run", "small.toml", "--lake", "other"])
            .tally(),
        (0, RESULTS)
    );
    assert_same(
        "a copy",
        &elsewhere.vouched("other"),
        &folder.vouched("lake"),
    );
    elsewhere.done(&["verify", "--lake", "other"]);
}
