//! Every command on input that is right and on input that is wrong: the exit code, and a message that
//! names the file and the line or key, what was expected, and what came.

mod program;

use program::{Folder, Outcome, SMALL, files_below};

/// The outcome of `run` on [`SMALL`] with `old` replaced by `new`.
fn run_with(old: &str, new: &str) -> Outcome {
    assert!(SMALL.contains(old), "{old}");
    let folder = Folder::new();
    folder.write("a.toml", SMALL.replacen(old, new, 1));
    let outcome = folder.run(&["run", "a.toml"]);
    assert!(
        !folder.path("lake").exists(),
        "nothing is written for a wrong file: {outcome:?}"
    );
    outcome
}

/// The line of [`SMALL`] that starts with `text`, as a message has it.
fn line(text: &str) -> String {
    let at = SMALL
        .lines()
        .position(|line| line.starts_with(text))
        .unwrap();
    format!("a.toml:{}: ", at + 1)
}

#[test]
fn a_wrong_experiment_is_refused_at_its_line() {
    let cases: &[(&str, &str, &str, &[&str])] = &[
        (
            "phi = 20",
            "pi = 20",
            "phi",
            &[
                "estimator.mixed.pi: unknown key",
                "phi, eta, alpha",
                "did you mean \"phi\"?",
            ],
        ),
        (
            "runs = 40",
            "rums = 40",
            "runs",
            &["rums: unknown key", "did you mean \"runs\"?"],
        ),
        (
            "kind = \"ezgkf\"",
            "kind = \"ezkgf\"",
            "kind = \"ezgkf\"",
            &["expected", "got \"ezkgf\"", "did you mean \"ezgkf\"?"],
        ),
        (
            "[0.0, 0.8]]",
            "[0.0]]",
            "a =",
            &["system.a[2]: expected an array of 2 numbers, got an array of 1 value"],
        ),
        (
            "c = [[-22.0, 1.0]]",
            "c = [[-22.0, 1.0, 0.0]]",
            "c =",
            &["system.c[1]: expected an array of 2 numbers"],
        ),
        (
            "box = [[-10.0, 10.0], [-10.0, 10.0]]",
            "box = [[-10.0, 10.0]]",
            "box",
            &["prior.box: expected 2 pairs [lower, upper]"],
        ),
        (
            "covariance = [[10.0, 0.0], [0.0, 10.0]]",
            "covariance = [[10.0, 1.0], [0.0, 10.0]]",
            "covariance",
            &["prior.covariance: expected a symmetric matrix, got"],
        ),
        (
            "covariance = [[10.0, 0.0], [0.0, 10.0]]",
            "covariance = [[1.0, 2.0], [2.0, 1.0]]",
            "covariance",
            &["prior.covariance: expected a positive semidefinite matrix, got the covariance 2 of"],
        ),
        (
            "phi = 20",
            "phi = 1",
            "phi",
            &["estimator.mixed.phi: expected at least n = 2, got 1"],
        ),
        (
            "phi = 20",
            "phi = -3",
            "phi",
            &["estimator.mixed.phi: expected an integer of at least 0, got"],
        ),
        (
            "eta = 0.5",
            "eta = 1.5",
            "eta",
            &["estimator.mixed.eta: expected in [0, 1], got 1.5"],
        ),
        (
            "alpha = 0.01",
            "alpha = 0.0",
            "alpha",
            &["estimator.mixed.alpha: expected in (0, 1), got 0"],
        ),
        (
            "alpha = 0.01",
            "alpha = 1",
            "alpha",
            &["estimator.mixed.alpha: expected in (0, 1), got 1"],
        ),
        (
            "box = [[-10.0, 10.0], [",
            "box = [[10.0, -10.0], [",
            "box",
            &["prior.box[1]: expected lower <= upper, got [10, -10]"],
        ),
        (
            "a = [[0.9",
            "a = [[nan",
            "a =",
            &["system.a[1][1]: expected a finite number, got nan"],
        ),
        (
            "x0 = [5.0, 5.0]",
            "x0 = [inf, 5.0]",
            "x0",
            &["truth.x0[1]: expected a finite number, got inf"],
        ),
        (
            "schema = 1",
            "schema = 2\nnovelty = true",
            "schema",
            &["schema: expected schema = 1", "got 2", "newer zonobench"],
        ),
        (
            "runs = 40",
            "runs = 0",
            "runs",
            &["runs: expected an integer from 1 to 1000000, got 0"],
        ),
        (
            "steps = 60",
            "steps = 1e3",
            "steps",
            &["steps: expected an integer", "got 1e3 (a float)"],
        ),
        (
            "sets = [0, 4, 60]",
            "sets = [0, 61]",
            "sets",
            &["expected a step of at most 60", "got 61"],
        ),
        (
            "name = \"rmse\"",
            "name = \"rsme\"",
            "name = \"rmse\"",
            &["got \"rsme\"", "did you mean \"rmse\"?"],
        ),
        ("seed = 7", "seed = 7\nseed = 8", "runs", &["duplicate key"]),
        (
            "id = \"small\"",
            "id = \"../x\"",
            "id",
            &["id: expected a lower-case letter, then", "got \"../x\""],
        ),
        (
            "id = \"small\"",
            "id = \"/tmp/x\"",
            "id",
            &["id: expected a lower-case letter, then", "got \"/tmp/x\""],
        ),
        (
            "paper = \"mine\"",
            "paper = \"..\"",
            "paper",
            &["paper: expected a lower-case letter, then", "got \"..\""],
        ),
        (
            "id = \"mixed\"",
            "id = \"a/../../x\"",
            "id = \"mixed\"",
            &["estimator[3].id: expected a lower-case letter, then"],
        ),
        (
            "seed = 7",
            "seed = 7.0",
            "seed",
            &["seed: expected an integer of at least 0, got 7.0 (a float)"],
        ),
        (
            "phi = 20",
            "phi = 20.0",
            "phi",
            &["estimator.mixed.phi: expected an integer of at least 0, got 20.0 (a float)"],
        ),
        (
            "phi = 20",
            "gain = \"optmial\"\nphi = 20",
            "phi",
            &[
                "expected \"optimal\" or \"unsquared\", got \"optmial\"",
                "did you mean \"optimal\"?",
            ],
        ),
        (
            "covariance = [[10.0, 0.0], [0.0, 10.0]]",
            "covariance = [[1e-8, 2e-8], [2e-8, 1e-8]]",
            "covariance",
            &[
                "expected a positive semidefinite matrix, got the covariance 2e-8 of components 1 and 2",
                "whose variances are 1e-8 and 1e-8",
            ],
        ),
        (
            "eta = 0.5",
            "eta = -1e-300",
            "eta",
            &["estimator.mixed.eta: expected in [0, 1], got -1e-300"],
        ),
        (
            "kind = \"linear\"",
            "knid = \"linear\"",
            "kind = \"linear\"",
            &[
                "system.kind: expected a kind of system",
                "got nothing by that name but \"knid\"",
                "did you mean \"kind\"?",
            ],
        ),
        (
            "kind = \"ezgkf\"",
            "kidn = \"ezgkf\"",
            "kind = \"ezgkf\"",
            &[
                "estimator.mixed.kind: expected",
                "\"kidn\"",
                "did you mean \"kind\"?",
            ],
        ),
        (
            "[truth]",
            "[rtuth]",
            "[truth]",
            &["rtuth: unknown key", "did you mean \"truth\"?"],
        ),
        (
            "id = \"mixed\"",
            "id = \"kf\"",
            "id = \"mixed\"",
            &["expected an id of its own, got \"kf\" again"],
        ),
    ];
    for (old, new, at, parts) in cases {
        let at = line(at);
        run_with(old, new).ends_with(2).says(&[&at]).says(parts);
    }
    // The place is shown, too.
    run_with("eta = 0.5", "eta = 1.5").says(&["eta = 1.5", "here"]);
}

#[test]
fn a_pair_that_is_not_observable_is_refused() {
    let outcome = run_with("c = [[-22.0, 1.0]]", "c = [[0.0, 1.0]]").ends_with(2);
    outcome.says(&[
        "a.toml:",
        "estimator.box.kind",
        "(A, C) must be observable",
        "rank 1 instead of 2",
    ]);
}

#[test]
fn a_file_that_is_no_experiment_is_refused() {
    let folder = Folder::new();
    folder.write("empty.toml", "");
    folder.write("blank.toml", "\n  \n");
    folder.write("syntax.toml", "schema = 1\nruns 3\n");
    folder.write("latin.toml", b"schema = 1\ntitle = \"\xe9\"\n");
    let run = |file| folder.run(&["run", file]).ends_with(2);
    run("empty.toml").says(&["empty.toml: expected an experiment, got an empty file"]);
    run("blank.toml").says(&["blank.toml: expected an experiment, got an empty file"]);
    run("syntax.toml").says(&["syntax.toml:2: "]);
    run("latin.toml").says(&["latin.toml: expected UTF-8 text, got other bytes"]);
    run("missing.toml").says(&["missing.toml: expected a TOML file, got", "No such file"]);
    run(".").says(&["expected a TOML file, got", "directory"]);
    assert!(!folder.path("lake").exists());
}

#[test]
fn two_files_with_one_id_are_refused() {
    let folder = Folder::new();
    folder.write("a.toml", SMALL);
    folder.write("b.toml", SMALL.replace("runs = 40", "runs = 3"));
    let outcome = folder.run(&["run", "a.toml", "b.toml"]).ends_with(2);
    outcome.says(&["b.toml: id: expected experiments that a.toml does not have, got mine/small"]);
    assert!(!folder.path("lake").exists());
}

#[test]
fn names_that_do_not_exist_are_refused_with_those_that_do() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml", "--quiet"]);
    let refused = |arguments: &[&str]| folder.run(arguments).ends_with(2);
    refused(&["run", "small.toml", "--jobs", "0"]).says(&["--jobs", "'0'", "from 1 to 1024"]);
    refused(&["run", "small.toml", "--jobs", "100000"]).says(&["--jobs", "from 1 to 1024"]);
    refused(&["run", "small.toml", "--jobs", "two"]).says(&["--jobs", "'two'", "from 1 to 1024"]);
    refused(&["run"]).says(&["<FILES>"]);
    refused(&["frobnicate"]).says(&["unrecognized subcommand 'frobnicate'"]);
    refused(&["querry", "SELECT 1"]).says(&["a similar subcommand exists: 'query'"]);
    refused(&["reproduce-all", "--paper", "bx"]).says(&["no paper `bx`", "box, bundle, cz, ezgkf"]);
    refused(&["reproduce-all", "--paper", "box", "--quick", "--full"]).says(&["--quick", "--full"]);
    refused(&["plan", "--paper", "../box"]).says(&["no paper `../box`", "box, bundle, cz, ezgkf"]);
    refused(&["explain", "nobody/x"]).says(&["no paper `nobody`", "box, bundle, cz, ezgkf"]);
    refused(&["explain", "box/nope"]).says(&["no target `box/nope`", "box/scenario-a"]);
    refused(&["explain", "mine/smal", "small.toml"]).says(&["no target `mine/smal`", "mine/small"]);
    refused(&["tables", "nope"]).says(&["no paper in this lake `nope`", "reproduce-all"]);
    refused(&["query", "SELEC * FROM scores"]).says(&["query: not SQL", "found: SELEC"]);
    refused(&["query", "SELECT * FROM score"]).says(&[
        "no table `score`",
        "did you mean `scores`?",
        "scores, timings",
    ]);
    refused(&["query", "SELECT maen FROM scores"]).says(&[
        "no column `maen`",
        "did you mean `mean`?",
        "estimator, metric",
    ]);
    refused(&["query", ""]).says(&["query: expected a statement"]);
    refused(&["query", "DELETE FROM scores"]).says(&["query: DELETE is refused"]);
    refused(&["query", "COPY scores TO 'x.csv'"]).says(&["query: COPY is refused"]);
    refused(&["query", "SELECT 1", "--format", "xml"]).says(&["'xml'", "table, csv, json"]);
}

#[test]
fn a_lake_that_is_not_there_is_named() {
    let folder = Folder::new();
    for arguments in [
        &["verify"][..],
        &["tables"],
        &["query", "SELECT 1"],
        &["report"],
    ] {
        folder
            .run(arguments)
            .ends_with(2)
            .says(&["no lake at lake", "zonobench reproduce-all"]);
    }
    folder
        .run(&["verify", "--lake", "there"])
        .ends_with(2)
        .says(&["no lake at there"]);
    assert!(files_below(&folder.path("")).is_empty());
}

#[test]
fn right_input_ends_with_zero() {
    let folder = Folder::with_small();
    let run = folder.done(&["run", "small.toml"]);
    assert!(
        run.stdout.contains("mine/small\n") && run.stdout.contains("contains"),
        "{run:?}"
    );
    let quiet = folder.done(&["run", "small.toml", "--quiet"]);
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));

    let sql = "SELECT estimator, mean FROM scores WHERE metric = 'contains' ORDER BY estimator";
    let table = folder.done(&["query", sql]).stdout;
    assert!(
        table.contains("estimator") && table.contains("mixed") && table.ends_with("2 rows\n"),
        "{table}"
    );
    assert_eq!(
        folder.done(&["query", sql, "--format", "csv"]).stdout,
        "estimator,mean\nbox,1\nmixed,1\n"
    );
    let json: serde_json::Value =
        serde_json::from_str(&folder.done(&["query", sql, "--format", "json"]).stdout).unwrap();
    assert_eq!(
        json,
        serde_json::json!([{ "estimator": "box", "mean": 1.0 }, { "estimator": "mixed", "mean": 1.0 }])
    );

    assert!(
        folder
            .done(&["verify"])
            .stdout
            .ends_with("files as the manifest says, no guarantee violated\n")
    );
    for arguments in [
        &["plan"][..],
        &["plan", "--paper", "box", "--paper", "ezgkf"],
    ] {
        assert!(
            folder
                .done(arguments)
                .stdout
                .contains("box/scenario-a/simulate: was never made\n")
        );
    }
    assert!(
        !folder
            .done(&["plan", "--paper", "ezgkf"])
            .stdout
            .contains("box/")
    );
    let dot = folder.done(&["plan", "small.toml", "--dot"]).stdout;
    assert!(
        dot.starts_with("digraph") && dot.contains("mine/small/estimate/kf"),
        "{dot}"
    );
    let explained = folder
        .done(&["explain", "box/scenario-a/estimate/kalman"])
        .stdout;
    assert!(
        explained.contains("would run, it reads what runs before it"),
        "{explained}"
    );
    assert_eq!(
        folder.done(&["tables"]).stdout,
        "This lake has no paper; `zonobench reproduce-all` makes them.\n"
    );
    assert!(
        folder
            .done(&["tables", "--format", "csv"])
            .stdout
            .starts_with("paper,table,row,column,reading,")
    );
    folder.done(&["--help"]);
    folder.done(&["--version"]);
}

/// Estimators on a system with one input and one measurement.
const TRACKED: &str = r#"schema = 1
paper = "mine"
id = "tracked"

[system]
kind = "linear"
a = [[0.9, 1.0], [0.0, 0.8]]
b = [[1.0], [0.0]]
c = [[-22.0, 1.0]]

[prior]
box = [[-10.0, 10.0], [-10.0, 10.0]]

[noise]
w = { box = [[-1.0, 1.0], [-1.0, 1.0]] }
v = { box = [[-1.0, 1.0]] }

[[estimator]]
id = "box"
kind = "box-state-est"
"#;

#[test]
fn wrong_measurements_are_refused_at_their_line_and_column() {
    let folder = Folder::new();
    folder.write("t.toml", TRACKED);
    folder.write("u.csv", "k,u1\n0,0\n1,0\n2,0\n");
    let right = "k,y1\n0,1.5\n1,\n2,3\n";
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "a missing column",
            "k\n0\n",
            &["y.csv:1: expected the columns k, y1, got no y1"],
        ),
        (
            "no k",
            "y1\n1.0\n",
            &["y.csv:1: expected the columns k, y1, got no k"],
        ),
        (
            "another column",
            "k,y1,y2\n0,1,2\n",
            &["y.csv:1: column 3: expected the columns k, y1, got \"y2\""],
        ),
        (
            "a column twice",
            "k,y1,y1\n0,1,2\n",
            &["y.csv:1: column 3: expected every column once"],
        ),
        (
            "no header",
            "0,1.5\n1,2.5\n",
            &["y.csv:1: column 1: expected the columns k, y1, got \"0\""],
        ),
        (
            "k descending",
            "k,y1\n0,1\n2,1\n1,1\n",
            &["y.csv:4: column k: expected ascending steps, got 1 after 2"],
        ),
        (
            "k twice",
            "k,y1\n0,1\n0,1\n",
            &["y.csv:3: column k: expected ascending steps, got 0 again"],
        ),
        (
            "a word",
            "k,y1\n0,1\n1,one\n",
            &["y.csv:3: column y1: expected a number or an empty cell, got \"one\""],
        ),
        (
            "not a number",
            "k,y1\n0,NaN\n",
            &[
                "y.csv:2: column y1: expected a finite number",
                "got \"NaN\"",
            ],
        ),
        (
            "infinity",
            "k,y1\n0,-inf\n",
            &[
                "y.csv:2: column y1: expected a finite number",
                "got \"-inf\"",
            ],
        ),
        (
            "half a step",
            "k,y1\n0.5,1\n",
            &["y.csv:2: column k: expected an integer, got \"0.5\""],
        ),
        (
            "a cell too many",
            "k,y1\n0,1,2\n",
            &["y.csv:2: expected 2 cells, as in the header, got 3"],
        ),
        (
            "semicolons",
            "k;y1\n0;1\n",
            &["y.csv:1: column 1: expected the columns k, y1, got \"k;y1\""],
        ),
        (
            "empty",
            "",
            &["y.csv: expected a header and at least one row, got an empty file"],
        ),
        (
            "a header alone",
            "k,y1\n",
            &["y.csv: expected at least one row below the header, got none"],
        ),
    ];
    let track = |measurements: &str, inputs: &[&str]| {
        let arguments = [
            "track",
            "t.toml",
            "--measurements",
            measurements,
            "--out",
            "out",
        ];
        folder.run(&[&arguments[..], inputs].concat())
    };
    let with_inputs = ["--inputs", "u.csv"];
    for (what, text, parts) in cases {
        folder.write("y.csv", text);
        let outcome = track("y.csv", &with_inputs);
        assert_eq!(outcome.code, Some(2), "{what}: {outcome:?}");
        outcome.says(parts);
        assert!(!folder.path("out").exists(), "{what}");
    }
    track("none.csv", &with_inputs)
        .ends_with(2)
        .says(&["none.csv: expected a CSV file, got", "No such file"]);
    folder.write("y.parquet", right);
    track("y.parquet", &with_inputs)
        .ends_with(2)
        .says(&["y.parquet: expected a Parquet file, got"]);

    folder.write("y.csv", right);
    track("y.csv", &[]).ends_with(2).says(&[
        "--inputs: expected a file with the columns k, u1",
        "got none",
    ]);
    folder.write("short.csv", "k,u1\n0,0\n");
    let short = track("y.csv", &["--inputs", "short.csv"]).ends_with(2);
    short.says(&["short.csv: expected values for k = 0 to 1, got k up to 0"]);
    folder.write("gap.csv", "k,u1\n0,0\n1,\n2,0\n");
    let gap = track("y.csv", &["--inputs", "gap.csv"]).ends_with(2);
    gap.says(&["gap.csv: expected a value of u1 at k = 1, got none"]);
    folder.write("t.toml", TRACKED.replace("b = [[1.0], [0.0]]\n", ""));
    track("y.csv", &with_inputs)
        .ends_with(2)
        .says(&["--inputs: expected no file, because the system has no inputs, got u.csv"]);
    assert!(!folder.path("out").exists());

    folder.write("t.toml", TRACKED);
    assert!(
        track("y.csv", &with_inputs)
            .ends_with(0)
            .stdout
            .contains("tracked: k = 0 to 2")
    );
    folder
        .run(&["track", "t.toml", "--out", "out"])
        .ends_with(2)
        .says(&["--measurements"]);
    folder
        .run(&["track", "t.toml", "--measurements", "y.csv"])
        .ends_with(2)
        .says(&["--out"]);
}

#[test]
fn a_recording_of_a_truth_must_have_all_its_steps() {
    let folder = Folder::new();
    folder.write(
        "a.toml",
        SMALL.replace(
            "v = { law = \"gaussian\", truncate = \"box\" }",
            "v = { file = \"v.csv\" }",
        ),
    );
    let run = || folder.run(&["run", "a.toml"]).ends_with(2);
    let at = format!("{}truth.v.file", line("v = { law"));
    run().says(&["v.csv: expected a CSV file, got", "No such file", &at]);
    folder.write("v.csv", "k,v1\n0,0.5\n1,x\n");
    run().says(&["v.csv:3: column v1: expected a number", "got \"x\"", &at]);
    folder.write("v.csv", "k,v1\n0,0.5\n1,0.5\n");
    run().says(&[&at, "v.csv: expected values for k = 0 to 60, got k up to 1"]);
    folder.write(
        "a.toml",
        SMALL.replace(
            "v = { law = \"gaussian\", truncate = \"box\" }",
            "v = { file = 3 }",
        ),
    );
    run().says(&[&at, "got 3"]);
}

/// Output that nobody reads to its end is no failure; output that cannot be written is one.
#[cfg(unix)]
#[test]
fn a_reader_who_goes_away_is_no_failure() {
    use std::process::Stdio;
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml", "--quiet"]);
    let mut child = folder
        .command(&["query", "SELECT * FROM estimates"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let outcome = Outcome::of(
        "query into a closed pipe",
        child.wait_with_output().unwrap(),
    );
    assert_eq!(outcome.ends_with(0).stderr, "");
    if let Ok(full) = std::fs::File::options().write(true).open("/dev/full") {
        let output = folder
            .command(&["query", "SELECT * FROM estimates"])
            .stdout(full)
            .output()
            .unwrap();
        Outcome::of("query into /dev/full", output)
            .ends_with(1)
            .says(&["cannot write to the standard output"]);
    }
}

/// The record of a long campaign is read as what it is: somebody's file.
#[test]
fn a_record_of_attacks_that_is_none_is_refused() {
    let folder = Folder::new();
    let header =
        "paper,system,estimator,attack,guaranteed,units,steps,undecided,lost,empty,refused,code";
    let row = |values: &str| format!("{header}\n{values}\n");
    let cases: &[(&str, String, &[&str])] = &[
        ("no header", "a,b\n1,2\n".into(), &["attack.csv", "paper"]),
        (
            "a number that is none",
            row("box,linear,box-state-est,uniform,true,1,many,0,0,0,0,0123456789abcdef"),
            &["attack.csv", "line: 2"],
        ),
        (
            "more lost than judged",
            row("box,linear,box-state-est,uniform,true,1,40,0,41,0,0,0123456789abcdef"),
            &["attack.csv", "lost + undecided <= steps"],
        ),
        (
            "another estimator",
            row("box,linear,oracle,uniform,true,1,40,0,0,0,0,0123456789abcdef"),
            &["attack.csv", "cases of the campaign", "oracle"],
        ),
        (
            "counts of other code",
            row("box,linear,box-state-est,uniform,true,1,40,0,0,0,0,0123456789abcdef"),
            &["attack.csv", "begin a new file", "0123456789abcdef"],
        ),
    ];
    for (what, text, parts) in cases {
        folder.write("attack.csv", text);
        let recorded = folder.run(&["attack", "box", "--record", "attack.csv", "--sets", "200"]);
        println!("{what}: {}", recorded.stderr);
        assert_ne!(recorded.code, Some(0), "{what}");
        recorded.says(parts);
        assert_eq!(
            std::fs::read_to_string(folder.path("attack.csv")).unwrap(),
            *text,
            "{what}"
        );
    }
}

#[test]
fn a_record_of_attacks_goes_on_and_is_counted_again() {
    let folder = Folder::new();
    let record = |sets: &str| {
        folder.done(&[
            "attack",
            "box",
            "--record",
            "attack.csv",
            "--sets",
            sets,
            "--quiet",
        ]);
        std::fs::read_to_string(folder.path("attack.csv")).unwrap()
    };
    let steps = |text: &str| -> u64 {
        let rows = text.lines().skip(1);
        rows.map(|row| row.split(',').nth(6).unwrap().parse::<u64>().unwrap())
            .sum()
    };
    let (first, more) = (record("1000"), record("3000"));
    assert!(steps(&first) >= 1000 && steps(&more) > steps(&first));
    folder.done(&["attack", "box", "--recount", "attack.csv"]);
    // One set less in a row, and the recount says in which.
    let row = more.lines().nth(1).unwrap();
    let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
    cells[6] = (cells[6].parse::<u64>().unwrap() - 1).to_string();
    folder.write("attack.csv", more.replace(row, &cells.join(",")));
    let recounted = folder.run(&["attack", "box", "--recount", "attack.csv"]);
    assert_ne!(recounted.code, Some(0));
    recounted.says(&["attack.csv", &cells[2], &cells[3]]);
}

/// [`SMALL`] as a vehicle with a period of `dt`, with traces.
fn with_period(dt: &str) -> Folder {
    let folder = Folder::new();
    let text = format!(
        "schema = 1\npaper = \"mine\"\nid = \"clock\"\nseed = 1\nruns = 1\nsteps = 20\n\
         [system]\nkind = \"van-der-pol\"\nts = {dt}\n\
         [prior]\nbox = [[-0.1, 0.1], [-0.1, 0.1]]\n\
         [noise]\nw = {{ box = [[0.0, 0.0], [0.0, 0.0]] }}\nv = {{ box = [[-0.1, 0.1]] }}\n\
         [truth]\nx0 = [0.0, 0.0]\n\
         [[estimator]]\nid = \"zmv\"\nkind = \"zmv\"\ngenerators = 8\n\
         [output]\ntraces = true\n"
    );
    folder.write("clock.toml", text);
    folder
}

#[test]
fn a_period_that_the_clock_of_a_trace_cannot_tell_is_refused_at_its_line() {
    for (dt, expected) in [
        ("1e-10", "expected at least 1e-9 s"),
        ("1e9", "expected at most 4.000e8 s for 20 steps"),
    ] {
        let folder = with_period(dt);
        let outcome = folder.run(&["run", "clock.toml"]).ends_with(2);
        let outcome = outcome.says(&["clock.toml:9: system.ts: ", expected, "output.traces", dt]);
        assert!(!outcome.stderr.contains(".cache"), "{}", outcome.stderr);
        assert!(!folder.path("lake").exists());
        // Without a trace there is no clock.
        let text = std::fs::read_to_string(folder.path("clock.toml")).unwrap();
        folder.write(
            "clock.toml",
            text.replace("traces = true", "traces = false"),
        );
        let without = folder.run(&["run", "clock.toml"]);
        assert_ne!(without.code, Some(2), "{without:?}");
    }
    let folder = with_period("1e-9");
    folder.done(&["run", "clock.toml"]);
    let trace = folder
        .path("lake")
        .join(zonobench_lake::lake::trace_path("mine", "clock", "zmv"));
    let bytes = std::fs::read(trace).unwrap();
    let mut stamps: Vec<u64> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(|message| message.unwrap())
        .filter(|message| message.channel.topic.ends_with("/metrics"))
        .map(|message| message.log_time)
        .collect();
    let n = stamps.len();
    stamps.dedup();
    assert!(stamps.is_sorted());
    assert_eq!((n, stamps.len()), (21, 21));
}

#[test]
fn a_message_is_short_and_fast_whatever_the_file_holds() {
    let long = "a1 ".repeat(350_000);
    let digits = "1".repeat(1_000_000);
    let cases: &[(&str, String, &str)] = &[
        (
            "a long text for a number",
            SMALL.replace("runs = 40", &format!("runs = \"{long}\"")),
            "(1050000 characters)",
        ),
        (
            "a long number",
            SMALL.replace("runs = 40", &format!("runs = {digits}")),
            "expected an integer",
        ),
        (
            "a long float",
            SMALL.replace("eta = 0.5", &format!("eta = {digits}.0")),
            "expected a finite number",
        ),
        (
            "a long key",
            SMALL.replace("runs = 40", &format!("{digits} = 40")),
            "unknown key",
        ),
        (
            "a long key in quotes",
            SMALL.replace("runs = 40", &format!("\"{long}\" = 40")),
            "unknown key",
        ),
        (
            "a long id",
            SMALL.replace("id = \"kf\"", &format!("id = \"{digits}\"")),
            "expected a lower-case letter",
        ),
        (
            "a long kind",
            SMALL.replace("kind = \"kalman\"", &format!("kind = \"{long}\"")),
            "(1050000 characters)",
        ),
        (
            "a long line with a fault",
            SMALL.replace("eta = 0.5", &format!("eta = 1.5 # {long}")),
            "got 1.5",
        ),
        (
            "a long array with a fault",
            SMALL.replace("sets = [0, 4, 60]", "sets = [0, -1]"),
            "output.sets",
        ),
        (
            "a quote that is not closed",
            SMALL.replace("paper = \"mine\"", &format!("paper = \"mine {long}")),
            "a.toml:2",
        ),
        (
            "three quotes that are not closed",
            SMALL.replace("paper = \"mine\"", &format!("paper = \"\"\"mine {long}")),
            "a.toml:",
        ),
        (
            "a long line that is none",
            format!("{SMALL}\n{long}\n"),
            "a.toml:",
        ),
        (
            "a long sweep",
            format!("{SMALL}\n[sweep]\n\"{digits}\" = 3\n"),
            "sweep",
        ),
        (
            "a long value of a setting",
            SMALL.replace("eta = 0.5", &format!("eta = \"{long}\"")),
            "expected a number",
        ),
    ];
    for (what, text, part) in cases {
        let folder = Folder::new();
        folder.write("a.toml", text);
        let start = std::time::Instant::now();
        let outcome = folder.run(&["run", "a.toml"]).ends_with(2);
        let (length, seconds) = (outcome.stderr.len(), start.elapsed().as_secs_f64());
        println!("{what}: {length} bytes, {seconds:.2} s");
        assert!(length < 2500, "{what}: {length} bytes");
        outcome.says(&[part]);
        // A second on a busy machine; every one of these took several.
        assert!(seconds < 10.0, "{what}: {seconds} s");
    }
}
