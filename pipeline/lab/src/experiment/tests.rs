use super::*;
use zonobench_estimation::estimator::Phase;
use zonobench_estimation::simulate;
use zonobench_estimation::simulate::{DeltaLaw, INSIDE, InitialState, Law, Noise};

/// A point that is measured in one direction, with the sections of a complete file.
const BASE: &str = r#"schema = 1
paper = "mine"
id = "ex1"
seed = 2020
runs = 30
steps = 100

[system]
kind = "linear"
a = [[0.9, 1.0], [0.0, 0.8]]
c = [[-22.0, 1.0]]

[prior]
box = [[-10.0, 10.0], [-10, 10]]
covariance = [[10.0, 0.0], [0.0, 10.0]]

[noise]
w = { box = [[-1.0, 1.0], [-1.0, 1.0]], covariance = [[0.12, 0.0], [0.0, 0.12]] }
v = { box = [[-1.0, 1.0]], covariance = [[0.12]] }

[truth]
x0 = [5.0, 5.0]
w = { law = "gaussian", truncate = "box" }
v = { law = "uniform" }

[[estimator]]
id = "kf"
kind = "kalman"

[[estimator]]
id = "mixed"
kind = "ezgkf"
phi = 20
eta = 0.5
alpha = 0.01

[[metric]]
name = "rmse"
from = 4

[output]
sets = [0, 4, 9]
traces = true
"#;

fn one(text: &str) -> Experiment {
    let mut all = Experiment::parse("x.toml", text).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(all.len(), 1);
    all.remove(0)
}

/// The message about the base with `old` replaced by `new`.
fn refused(old: &str, new: &str) -> String {
    assert!(BASE.contains(old), "{old} is in the base");
    complaint(&BASE.replacen(old, new, 1))
}

fn complaint(text: &str) -> String {
    let fault = Experiment::parse("x.toml", text).expect_err("the file is wrong");
    match miette::Diagnostic::help(&fault) {
        Some(help) => format!("{fault} [{help}]"),
        None => fault.to_string(),
    }
}

fn with(more: &str) -> String {
    format!("{BASE}\n{more}")
}

fn ids(text: &str) -> Vec<String> {
    let all = Experiment::parse("x.toml", text).unwrap_or_else(|fault| panic!("{fault}"));
    all.into_iter().map(|experiment| experiment.id).collect()
}

#[test]
fn a_complete_file_is_read() {
    let e = one(BASE);
    assert_eq!(
        (e.paper.as_str(), e.id.as_str(), e.seed, e.runs, e.steps),
        ("mine", "ex1", 2020, 30, 100)
    );
    assert_eq!(e.name(), "mine/ex1");
    assert_eq!(e.problem.prior.box_hull().lower(), [-10.0, -10.0]);
    assert_eq!(e.truth.x0, InitialState::Point(vec![5.0, 5.0]));
    let Noise::Drawn(w) = &e.truth.w else {
        panic!("{:?}", e.truth.w)
    };
    assert_eq!(
        (w.law, w.truncate, &w.of),
        (Law::Gaussian, true, &e.problem.w)
    );
    assert_eq!(e.inputs, Inputs::Constant(vec![]));
    assert_eq!(
        e.estimators
            .iter()
            .map(|s| s.id.as_str())
            .collect::<Vec<_>>(),
        ["kf", "mixed"]
    );
    assert_eq!(e.estimators[1].settings.kind(), "ezgkf");
    assert_eq!(
        (
            e.metrics[0].name,
            e.metrics[0].id.as_str(),
            e.metrics[0].from
        ),
        ("rmse", "rmse", 4)
    );
    assert_eq!(
        e.output,
        Output {
            sets: vec![0, 4, 9],
            traces: true,
            updated_only: false,
        }
    );
    let run = simulate(&e.problem.system, &e.truth, &e.inputs, e.seed, 0, e.steps).unwrap();
    assert_eq!(run.x.len(), 101);
}

#[test]
fn a_folder_s_name_is_text_to_every_reader() {
    for name in ["inf", "infinity", "epoch", "true", "false"] {
        for key in ["paper = \"mine\"", "id = \"ex1\""] {
            let (key, _) = key.split_once(" = ").unwrap();
            let old = if key == "paper" {
                "\"mine\""
            } else {
                "\"ex1\""
            };
            let line = BASE
                .lines()
                .find(|l| l.starts_with(key) && l.contains(old))
                .unwrap();
            let fault =
                complaint(&BASE.replacen(line, &line.replace(old, &format!("{name:?}")), 1));
            assert!(
                fault.contains(&format!("got \"{name}\""))
                    && fault.contains(&format!("call it \"{name}_1\"")),
                "{fault}"
            );
        }
    }
    // Within a longer name they do no harm.
    let swept =
        BASE.replacen("\"ex1\"", "\"inf\"", 1) + "\n[sweep]\n\"estimator.mixed.phi\" = [20, 30]\n";
    assert_eq!(ids(&swept), ["inf_phi20", "inf_phi30"]);
}

#[test]
fn the_serialized_form_does_not_depend_on_comments_order_or_spelling_of_numbers() {
    let canonical = |text: &str| serde_json::to_string(&one(text)).unwrap();
    let other = BASE
        .replace(
            "seed = 2020\nruns = 30",
            "# a comment\nruns = 30\nseed = 2_020",
        )
        .replace("[-10, 10]", "[-1e1, 10.0]");
    assert_eq!(canonical(BASE), canonical(&other));
    assert_ne!(
        canonical(BASE),
        canonical(&BASE.replace("phi = 20", "phi = 21"))
    );
}

#[test]
fn an_unknown_key_is_refused_with_a_suggestion() {
    assert_eq!(
        refused("phi = 20", "pi = 20\nphi = 20"),
        "x.toml:33: estimator.mixed.pi: unknown key in estimator.mixed: expected id, kind, prior, noise, phi, eta, \
         alpha, gain, overbars, merge_parallel, scale, got \"pi\" [did you mean \"phi\"?]"
    );
    assert_eq!(
        refused("runs = 30", "run = 30"),
        "x.toml:5: run: unknown key: expected schema, paper, id, title, description, seed, runs, steps, system, \
         prior, noise, truth, inputs, estimator, metric, sweep, case, output, got \"run\" [did you mean \"runs\"?]"
    );
    assert_eq!(
        refused("box = [[-10.0", "boxes = [[-10.0"),
        "x.toml:14: prior.boxes: unknown key in prior: expected box, center, generators, constraints, mean, \
         covariance, got \"boxes\" [did you mean \"box\"?]"
    );
    assert!(
        refused("phi = 20", "products = \"stacked\"\nphi = 20")
            .ends_with("[ezgkf has no products; box-state-est has]")
    );
}

#[test]
fn a_wrong_type_is_refused_at_its_line() {
    assert_eq!(
        refused("runs = 30", "runs = \"ten\""),
        "x.toml:5: runs: expected an integer from 1 to 1000000, got \"ten\""
    );
    assert_eq!(
        refused("runs = 30", "runs = 0"),
        "x.toml:5: runs: expected an integer from 1 to 1000000, got 0"
    );
    assert_eq!(
        refused("steps = 100", "steps = 1.5"),
        "x.toml:6: steps: expected an integer from 1 to 1000000, got 1.5 (a float)"
    );
    assert_eq!(
        refused("seed = 2020", "seed = -1"),
        "x.toml:4: seed: expected an integer of at least 0, got -1"
    );
    assert_eq!(
        refused("seed = 2020", "seed = 99999999999999999999"),
        "x.toml:4: seed: expected an integer of at most 63 bits, got 99999999999999999999"
    );
    assert_eq!(
        refused("phi = 20", "phi = \"many\""),
        "x.toml:33: estimator.mixed.phi: expected an integer of at least 0, got \"many\""
    );
    assert_eq!(
        refused("eta = 0.5", "eta = true"),
        "x.toml:34: estimator.mixed.eta: expected a number, got true"
    );
    assert_eq!(
        refused("phi = 20", "gain = \"best\"\nphi = 20"),
        "x.toml:33: estimator.mixed.gain: expected \"optimal\" or \"unsquared\", got \"best\""
    );
    assert_eq!(
        refused("eta = 0.5\n", ""),
        "x.toml:30: estimator.mixed.eta: expected a value, got nothing"
    );
    assert_eq!(
        refused("seed = 2020", "seed = 1979-05-27"),
        "x.toml:4: seed: expected a number, a string, an array or a table, got the date 1979-05-27"
    );
}

#[test]
fn wrong_shapes_are_refused() {
    assert_eq!(
        refused("a = [[0.9, 1.0], [0.0, 0.8]]", "a = [[0.9, 1.0], [0.0]]"),
        "x.toml:10: system.a[2]: expected an array of 2 numbers, got an array of 1 value"
    );
    assert_eq!(
        refused("a = [[0.9, 1.0], [0.0, 0.8]]", "a = [[0.9, 1.0]]"),
        "x.toml:10: system.a: expected a square matrix, got 1 x 2"
    );
    assert_eq!(
        refused("c = [[-22.0, 1.0]]", "c = [[-22.0, 1.0, 2.0]]"),
        "x.toml:11: system.c[1]: expected an array of 2 numbers, got an array of 3 values"
    );
    assert_eq!(
        refused("box = [[-10.0, 10.0], [-10, 10]]", "box = [[-10.0, 10.0]]"),
        "x.toml:14: prior.box: expected 2 pairs [lower, upper], got an array of 1 value"
    );
    assert_eq!(
        refused(
            "box = [[-10.0, 10.0], [-10, 10]]",
            "center = [0.0]\ngenerators = [[1.0], [1.0]]"
        ),
        "x.toml:14: prior.center: expected an array of 2 numbers, got an array of 1 value"
    );
    assert_eq!(
        refused(
            "box = [[-10.0, 10.0], [-10, 10]]",
            "generators = [[1.0, 2.0]]"
        ),
        "x.toml:14: prior.generators: expected 2 rows of numbers, got 1 row"
    );
    assert_eq!(
        refused(
            "covariance = [[10.0, 0.0], [0.0, 10.0]]",
            "covariance = [10.0, 10.0]"
        ),
        "x.toml:15: prior.covariance[1]: expected an array of 2 numbers, got 10.0"
    );
    assert_eq!(
        refused("x0 = [5.0, 5.0]", "x0 = [5.0]"),
        "x.toml:22: truth.x0: expected an array of 2 numbers, got an array of 1 value"
    );
    assert_eq!(
        refused(
            "kind = \"linear\"\na = [[0.9, 1.0], [0.0, 0.8]]",
            "kind = \"linear\"\nb = [[1.0]]\na = [[0.9, 1.0], [0.0, 0.8]]"
        ),
        "x.toml:10: system.b: expected 2 rows of numbers, got 1 row"
    );
}

#[test]
fn a_covariance_that_is_none_is_refused() {
    assert_eq!(
        refused(
            "covariance = [[10.0, 0.0], [0.0, 10.0]]",
            "covariance = [[10.0, 1.0], [0.0, 10.0]]"
        ),
        "x.toml:15: prior.covariance: expected a symmetric matrix, got 0 in row 2, column 1 and 1 in row 1, column 2"
    );
    assert_eq!(
        refused(
            "covariance = [[10.0, 0.0], [0.0, 10.0]]",
            "covariance = [[1.0, 2.0], [2.0, 1.0]]"
        ),
        "x.toml:15: prior.covariance: expected a positive semidefinite matrix, got the covariance 2 of components 1 and 2, whose variances are 1 and 1"
    );
}

#[test]
fn a_reversed_box_and_numbers_that_are_not_finite_are_refused() {
    assert_eq!(
        refused(
            "box = [[-10.0, 10.0], [-10, 10]]",
            "box = [[-10.0, 10.0], [10, -10]]"
        ),
        "x.toml:14: prior.box[2]: expected lower <= upper, got [10, -10]"
    );
    assert_eq!(
        refused("a = [[0.9, 1.0]", "a = [[nan, 1.0]"),
        "x.toml:10: system.a[1][1]: expected a finite number, got nan"
    );
    assert_eq!(
        refused("eta = 0.5", "eta = -inf"),
        "x.toml:34: estimator[2].eta: expected a finite number, got -inf"
    );
    assert_eq!(
        refused("eta = 0.5", "eta = 1e999"),
        "x.toml:34: estimator[2].eta: expected a finite number, got 1e999"
    );
}

#[test]
fn a_setting_out_of_range_is_refused_at_its_line() {
    let of_kind = " [estimator.mixed is of kind ezgkf]";
    assert_eq!(
        refused("phi = 20", "phi = 1"),
        format!("x.toml:33: estimator.mixed.phi: expected at least n = 2, got 1{of_kind}")
    );
    assert_eq!(
        refused("eta = 0.5", "eta = 1.5"),
        format!("x.toml:34: estimator.mixed.eta: expected in [0, 1], got 1.5{of_kind}")
    );
    assert_eq!(
        refused("alpha = 0.01", "alpha = 0.0"),
        format!("x.toml:35: estimator.mixed.alpha: expected in (0, 1), got 0{of_kind}")
    );
    assert_eq!(
        refused("covariance = [[10.0, 0.0], [0.0, 10.0]]\n", ""),
        "x.toml:13: prior.covariance: expected given, got nothing [estimator.kf is of kind kalman]"
    );
}

#[test]
fn an_unobservable_pair_is_refused_at_the_estimator() {
    let text = BASE
        .replace("c = [[-22.0, 1.0]]", "c = [[0.0, 1.0]]")
        .replace("kind = \"kalman\"", "kind = \"box-state-est\"");
    assert_eq!(
        complaint(&text),
        "x.toml:28: estimator.kf.kind: box-state-est: the pair (A, C) must be observable, \
         but [C; CA; ...] has rank 1 instead of 2"
    );
}

#[test]
fn a_file_of_a_later_schema_says_so_before_anything_else() {
    let text = BASE.replace("schema = 1", "schema = 7\nnovelty = true");
    assert_eq!(
        complaint(&text),
        "x.toml:1: schema: expected schema = 1, the newest that this program knows, got 7 [the file is for a newer zonobench]"
    );
    assert_eq!(
        refused("schema = 1\n", ""),
        "x.toml:1: schema: expected schema = 1, got nothing"
    );
    assert_eq!(
        refused("schema = 1", "schema = \"1\""),
        "x.toml:1: schema: expected schema = 1, got \"1\""
    );
}

#[test]
fn names_that_could_leave_the_lake_are_refused() {
    let expected = "expected a lower-case letter, then lower-case letters, digits, _ and -";
    for bad in ["../x", "a/b", "", "A", "1a", "a b", "a.b", "é", "_a"] {
        assert_eq!(
            refused("id = \"ex1\"", &format!("id = \"{bad}\"")),
            format!("x.toml:3: id: {expected}, got {bad:?}")
        );
    }
    assert_eq!(
        refused("paper = \"mine\"", "paper = \"..\""),
        format!("x.toml:2: paper: {expected}, got \"..\"")
    );
    assert!(
        refused("id = \"kf\"", "id = \"K\"")
            .starts_with("x.toml:27: estimator[1].id: expected a lower-case letter")
    );
    assert!(
        refused("id = \"ex1\"", &format!("id = \"{}\"", "a".repeat(121)))
            .ends_with("expected at most 120 characters, got 121")
    );
    assert_eq!(
        refused("id = \"mixed\"", "id = \"kf\""),
        "x.toml:31: estimator[2].id: expected an id of its own, got \"kf\" again"
    );
}

#[test]
fn an_empty_file_and_bad_syntax_are_refused() {
    assert_eq!(
        complaint(" \n"),
        "x.toml: expected an experiment, got an empty file"
    );
    assert!(refused("runs = 30", "runs 30").starts_with("x.toml:5: "));
    assert!(
        refused("seed = 2020", "runs = 1").starts_with("x.toml:5: duplicate key"),
        "{}",
        refused("seed = 2020", "runs = 1")
    );
    let nowhere = Experiment::load(Path::new("/nonexistent/x.toml")).unwrap_err();
    assert!(
        nowhere
            .to_string()
            .starts_with("/nonexistent/x.toml: expected a TOML file, got: No such file")
    );
    assert_eq!(nowhere.exit_code(), 2);
}

/// Every prefix of a file, and the file with any one byte replaced, is read or refused, and the refusal
/// can be drawn: nothing panics.
#[test]
fn no_damage_to_a_file_is_a_crash() {
    let mut refusals = 0;
    let mut check = |text: &str| {
        if let Err(fault) = Experiment::parse("x.toml", text) {
            let mut drawn = String::new();
            miette::NarratableReportHandler::new()
                .render_report(&mut drawn, &fault)
                .unwrap();
            refusals += 1;
        }
    };
    let text = with("[sweep]\n\"estimator.mixed.phi\" = [8, 12]\n# \u{e9}\u{1d4b3}\n");
    for (at, c) in text.char_indices() {
        check(&text[..at]);
        for replacement in ["", "\"", "[", "]", "=", "\u{e9}", "-", "9", "\n"] {
            check(&format!(
                "{}{replacement}{}",
                &text[..at],
                &text[at + c.len_utf8()..]
            ));
        }
    }
    assert!(refusals > 2000, "{refusals}");
}

#[test]
fn a_sweep_gives_every_combination_in_the_order_of_the_text() {
    let swept = with(
        "[sweep]\n\"estimator.mixed.phi\" = [8, 12]\nsteps = [50, 60]\n\"estimator.mixed.alpha\" = [0.3]\n",
    );
    let all = Experiment::parse("x.toml", &swept).unwrap();
    let names: Vec<&str> = all.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(
        names,
        [
            "ex1_phi8_steps50_alpha0p3",
            "ex1_phi8_steps60_alpha0p3",
            "ex1_phi12_steps50_alpha0p3",
            "ex1_phi12_steps60_alpha0p3"
        ]
    );
    assert_eq!((all[2].steps, all[1].steps), (50, 60));
    let phi =
        |e: &Experiment| serde_json::to_value(&e.estimators[1].settings).unwrap()["phi"].clone();
    assert_eq!((phi(&all[1]), phi(&all[2])), (8.into(), 12.into()));
    assert_eq!(all[0].seed, all[3].seed);
    let words = with("[sweep]\n\"estimator.mixed.gain\" = [\"optimal\", \"unsquared\"]\n");
    assert_eq!(ids(&words), ["ex1_gainoptimal", "ex1_gainunsquared"]);
    let nested = with("[sweep]\nestimator.mixed.phi = [8, 9]\n");
    assert_eq!(ids(&nested), ["ex1_phi8", "ex1_phi9"]);
}

#[test]
fn a_swept_value_that_is_wrong_is_shown_in_the_sweep() {
    let text = with("[sweep]\n\"estimator.mixed.phi\" = [8, 1]\n");
    let line = text
        .lines()
        .position(|line| line.starts_with("\"estimator"))
        .unwrap()
        + 1;
    assert!(complaint(&text).starts_with(&format!(
        "x.toml:{line}: estimator.mixed.phi: expected at least n = 2, got 1"
    )));
    assert!(
        complaint(&with("[sweep]\nsteps = 5\n"))
            .contains("sweep.steps: expected an array of at least one value, got 5")
    );
    assert!(
        complaint(&with("[sweep]\nsteps = []\n"))
            .contains("sweep.steps: expected an array of at least one value, got an array of 0")
    );
    assert!(
        complaint(&with("[sweep]\nid = [\"a\"]\n"))
            .contains("id: expected a key that a variant can change, got \"id\"")
    );
    assert_eq!(
        complaint(&with("[sweep]\n\"estimator.mixt.phi\" = [8]\n")),
        format!(
            "x.toml:{line}: estimator.mixt.phi: expected an id of estimator (kf, mixed), got \"mixt\" [did you mean \"mixed\"?]"
        )
    );
    assert!(
        complaint(&with("[sweep]\n\"estimator.mixed.gain\" = [\"a/b\"]\n"))
            .contains("it becomes part of an id")
    );
    assert!(
        complaint(&with("[sweep]\nsteps = [50, 50]\n"))
            .contains("expected experiments with different names, got ex1_steps50 twice")
    );
    assert!(
        complaint(&with("[sweep]\n\"estimator.mixed.ph\" = [8]\n"))
            .contains("did you mean \"phi\"?")
    );
}

#[test]
fn cases_override_any_key() {
    let text = with(
        "[[case]]\nid = \"row7\"\nsteps = 40\n\"estimator.mixed.eta\" = 0.25\n\"truth.w.law\" = \"uniform\"\n\"truth.w.truncate\" = \"box\"\n\
         [[case]]\nid = \"row8\"\n[case.truth]\nw = { law = \"zero\" }\n[case.estimator.mixed]\nphi = 5\n[case.metric.rmse]\nfrom = 7\n",
    );
    let fault = complaint(&text);
    assert!(
        fault.contains("truth.w: expected the gaussian law beside truncate, got another law"),
        "{fault}"
    );
    let all = Experiment::parse(
        "x.toml",
        &text
            .replace("\"truth.w.truncate\" = \"box\"\n", "")
            .replace(", truncate = \"box\"", ""),
    )
    .unwrap();
    assert_eq!(
        all.iter().map(|e| e.id.as_str()).collect::<Vec<_>>(),
        ["ex1_row7", "ex1_row8"]
    );
    assert_eq!((all[0].steps, all[1].steps), (40, 100));
    let law = |e: &Experiment| match &e.truth.w {
        Noise::Drawn(drawn) => drawn.law,
        other => panic!("{other:?}"),
    };
    assert_eq!((law(&all[0]), law(&all[1])), (Law::Uniform, Law::Zero));
    assert_eq!((all[0].metrics[0].from, all[1].metrics[0].from), (4, 7));
    let swept = format!(
        "{}[sweep]\nruns = [2, 3]\n",
        with(
            "[[case]]\nid = \"a\"\n[[case]]\nid = \"b\"\nsteps = 9\nmetric = []\noutput.sets = []\n"
        )
    );
    assert_eq!(
        ids(&swept),
        ["ex1_a_runs2", "ex1_a_runs3", "ex1_b_runs2", "ex1_b_runs3"]
    );
    assert!(
        complaint(&with("[[case]]\nsteps = 4\n"))
            .contains("case.id: expected a string, got nothing")
    );
    assert!(
        complaint(&with("[[case]]\nid = \"../a\"\n"))
            .contains("case.id: expected lower-case letters")
    );
    assert!(
        complaint(&with("[[case]]\nid = \"a\"\n[[case]]\nid = \"a\"\n"))
            .contains("got ex1_a twice")
    );
    assert!(
        complaint(&with("[[case]]\nid = \"a\"\n\"runs.x\" = 1\n"))
            .contains("runs.x: expected runs to be a table, got 30")
    );
}

#[test]
fn the_truth_defaults_to_the_assumed_sets_and_must_be_given_beside_a_covariance() {
    let bare = BASE
        .replace("[truth]\nx0 = [5.0, 5.0]\nw = { law = \"gaussian\", truncate = \"box\" }\nv = { law = \"uniform\" }\n", "")
        .replace("covariance = [[10.0, 0.0], [0.0, 10.0]]\n", "")
        .replace(", covariance = [[0.12, 0.0], [0.0, 0.12]]", "")
        .replace(", covariance = [[0.12]]", "")
        .replace("kind = \"kalman\"", "kind = \"box-state-est\"")
        .replace("[[estimator]]\nid = \"mixed\"\nkind = \"ezgkf\"\nphi = 20\neta = 0.5\nalpha = 0.01\n", "");
    let e = one(&bare);
    assert!(matches!(e.truth.x0, InitialState::Drawn(_)));
    assert!(matches!(&e.truth.v, Noise::Drawn(drawn) if drawn.law == Law::Uniform));
    assert_eq!(
        refused("v = { law = \"uniform\" }\n", ""),
        "x.toml:21: truth.v: expected it to be given: a set and a covariance are assumed, and the truth can follow \
         either, got nothing"
    );
    assert_eq!(
        refused("x0 = [5.0, 5.0]", "x0 = \"posterior\""),
        "x.toml:22: truth.x0: expected prior, got \"posterior\""
    );
}

#[test]
fn a_noise_may_have_its_own_set_or_gaussian() {
    let e = one(&BASE.replace(
        "v = { law = \"uniform\" }",
        "v = { law = \"gaussian\", covariance = [[4.0]] }",
    ));
    let Noise::Drawn(v) = &e.truth.v else {
        panic!("{:?}", e.truth.v)
    };
    assert_eq!(v.of.covariance_matrix()[(0, 0)], 4.0);
    assert_eq!(v.of.bounds, e.problem.v.bounds);
    let e = one(&BASE.replace(
        "v = { law = \"uniform\" }",
        "v = { law = \"vertices\", box = [[-2, 3]] }",
    ));
    let Noise::Drawn(v) = &e.truth.v else {
        panic!("{:?}", e.truth.v)
    };
    assert_eq!(v.of.box_hull().upper(), [3.0]);
    assert!(
        refused("v = { law = \"uniform\" }", "v = { law = \"unifrom\" }")
            .contains("[did you mean \"uniform\"?]")
    );
    assert!(
        refused(
            "v = { law = \"uniform\" }",
            "v = { law = \"uniform\", signals = [[]] }"
        )
        .contains("expected one of law, signals, alternatives, file, got several")
    );
    assert!(
        refused("v = { law = \"uniform\" }", "v = { truncate = \"box\" }")
            .contains("expected one of law, signals, alternatives, file, got none")
    );
    assert!(
        refused(
            "v = { law = \"uniform\" }",
            "v = { law = \"zero\", box = [[0, 1]] }"
        )
        .contains("unknown key in truth.v: expected law, got \"box\"")
    );
}

#[test]
fn signals_and_families_of_them_are_read() {
    let text = BASE.replace(
        "w = { law = \"gaussian\", truncate = \"box\" }\nv = { law = \"uniform\" }",
        "w = { signals = [[{ kind = \"saw\", period = 40 }, { kind = \"sine\", omega = 2.0, dt = 0.1, amplitude = 0.1 }, \
         { kind = \"pieces\", at = [100, 200], value = [0, 0.05, 0] }], []] }\n\
         v = { alternatives = [[{ kind = \"square\", period = 40 }, [{ kind = \"constant\", value = 0.5 }]]] }",
    );
    assert_eq!(
        complaint(&text),
        "x.toml:5: runs: expected at most 2, because nothing is drawn and runs would repeat, got 30"
    );
    let e = one(&text.replace("runs = 30", "runs = 2"));
    let run = |r| simulate(&e.problem.system, &e.truth, &e.inputs, e.seed, r, e.steps).unwrap();
    let inside = INSIDE;
    assert_eq!((run(0).v[0][0], run(1).v[0][0]), (inside, 0.5 * inside));
    assert_eq!(run(0).w[0], [-inside, 0.0]);
    let wrong = |signal: &str| {
        complaint(&BASE.replace(
            "v = { law = \"uniform\" }",
            &format!("v = {{ signals = [[{signal}]] }}"),
        ))
    };
    assert_eq!(
        wrong("{ kind = \"swa\", period = 3 }"),
        "x.toml:24: truth.v.signals[1][1].kind: expected saw, sawdown, square, triangle, sine, cosine, constant, pieces, \
         got \"swa\" [did you mean \"saw\"?]"
    );
    assert_eq!(
        wrong("{ kind = \"saw\", period = 0 }"),
        "x.toml:24: truth.v.signals[1][1].period: expected a positive number, got 0"
    );
    assert_eq!(
        wrong("{ kind = \"saw\" }"),
        "x.toml:24: truth.v.signals[1][1].period: expected a value, got nothing"
    );
    assert!(
        wrong("{ kind = \"saw\", omega = 3 }").contains("unknown key in truth.v.signals[1][1]")
    );
    assert_eq!(
        wrong("{ kind = \"pieces\", at = [5, 3], value = [0, 1, 2] }"),
        "x.toml:24: truth.v.signals[1][1].at: expected ascending steps, got 5 before 3"
    );
    assert!(
        refused("v = { law = \"uniform\" }", "v = { signals = [[], []] }")
            .contains("expected an array with signals for 1 components, got an array of 2 values")
    );
}

const LPV: &str = r#"schema = 1
paper = "mine"
id = "lpv"
seed = 1
runs = 2
steps = 40
[system]
kind = "lpv"
a0 = [[0.0, -0.5], [1.0, 1.0]]
a = [[[0.0, 0.0], [0.0, 0.3]]]
c = [[-2.0, 1.0]]
[prior]
center = [0.0, 0.0]
generators = [[0.1, 0.0], [0.0, 0.1]]
covariance = [[8e-4, 0.0], [0.0, 8e-4]]
[noise]
w = { generators = [[-0.06, 0.0], [0.01, 0.0]], covariance = [[4e-4, 0.0], [0.0, 1e-5]] }
v = { generators = [[0.1]], covariance = [[1e-3]] }
[truth]
x0 = [0.1, 0.1]
w = { law = "mixed" }
v = { law = "mixed" }
delta = { law = "uniform" }
[[estimator]]
id = "a"
kind = "ezgkf"
phi = 40
eta = 0.5
alpha = 0.0027
"#;

#[test]
fn delta_has_its_own_laws() {
    let with = |delta: &str| LPV.replace("delta = { law = \"uniform\" }", delta);
    assert_eq!(one(LPV).truth.delta, Some(DeltaLaw::Uniform));
    assert_eq!(one(&with("")).truth.delta, Some(DeltaLaw::Uniform));
    assert_eq!(
        one(&with("delta = { law = \"constant\", value = -1 }"))
            .truth
            .delta,
        Some(DeltaLaw::Constant { value: -1.0 })
    );
    assert!(matches!(
        one(&with("delta = { law = \"sine\", omega = 0.5 }"))
            .truth
            .delta,
        Some(DeltaLaw::Sine(_))
    ));
    assert!(matches!(
        one(&with(
            "delta = { signals = [[{ kind = \"constant\", value = -1.0 }]] }"
        ))
        .truth
        .delta,
        Some(DeltaLaw::Signals { .. })
    ));
    assert!(
        complaint(&with("delta = { law = \"constant\", value = -2 }"))
            .contains("truth.delta: expected a value in [-1, 1], got -2")
    );
    assert!(
        complaint(&with("delta = { law = \"sign\", value = 1 }"))
            .contains("truth.delta.value: unknown key")
    );
    assert_eq!(
        refused(
            "x0 = [5.0, 5.0]",
            "x0 = [5.0, 5.0]\ndelta = { law = \"zero\" }"
        ),
        "x.toml:23: truth.delta: expected no delta, because the system has none, got one"
    );
    assert_eq!(
        complaint(&LPV.replace("[[[0.0, 0.0], [0.0, 0.3]]]", "[[[0.0, 0.0]]]")),
        "x.toml:10: system.a[1]: expected 2 rows of 2 numbers, got 1 row"
    );
}

#[test]
fn inputs_must_fit_the_system() {
    let driven = BASE.replace(
        "a = [[0.9, 1.0], [0.0, 0.8]]",
        "a = [[0.9, 1.0], [0.0, 0.8]]\nb = [[0.0], [1.0]]",
    );
    assert!(
        complaint(&driven)
            .contains("inputs: expected a table, because the system has 1 inputs, got nothing")
    );
    let with = |inputs: &str| format!("{driven}\n[inputs]\n{inputs}\n");
    assert_eq!(
        one(&with("constant = [2]")).inputs,
        Inputs::Constant(vec![2.0])
    );
    assert!(matches!(
        one(&with("signals = [[{ kind = \"sine\", period = 8 }]]")).inputs,
        Inputs::Signals(_)
    ));
    assert!(
        complaint(&with("constant = [2, 3]"))
            .contains("inputs.constant: expected an array of 1 numbers, got an array of 2 values")
    );
    assert!(
        complaint(&with("controller = \"feedback-linearising\"")).contains(
            "inputs.controller: expected a system that this controller can drive, got linear"
        )
    );
    assert!(
        complaint(&with(""))
            .contains("inputs: expected one of constant, signals, file, controller, got none")
    );
    assert!(
        complaint(&with("file = \"u.csv\""))
            .contains("inputs.file: expected no file, because this experiment is not in a folder")
    );
    assert_eq!(
        one(&format!("{BASE}\n[inputs]\nconstant = []\n")).inputs,
        Inputs::Constant(vec![])
    );
}

#[test]
fn files_beside_the_experiment_are_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.toml");
    std::fs::write(
        &path,
        BASE.replace("v = { law = \"uniform\" }", "v = { file = \"v.csv\" }")
            .replace("steps = 100", "steps = 9"),
    )
    .unwrap();
    let load = |content: &str| {
        std::fs::write(folder.path().join("v.csv"), content).unwrap();
        Experiment::load(&path)
    };
    let rows: String = (0..10)
        .map(|k| format!("{k},{}\n", 0.1 * f64::from(k)))
        .collect();
    let all = load(&format!("k,v1\n{rows}")).unwrap();
    let Noise::Data(data) = &all[0].truth.v else {
        panic!("{:?}", all[0].truth.v)
    };
    assert_eq!((data.len(), data[9][0]), (10, 0.9));
    let short = load("k,v1\n0,1.0\n1,1.0\n").unwrap_err().to_string();
    assert!(
        short.ends_with(
            "x.toml:24: truth.v.file: v.csv: expected values for k = 0 to 9, got k up to 1"
        ),
        "{short}"
    );
    let bad = load("k,v1\n0,high\n").unwrap_err().to_string();
    assert!(
        bad.ends_with("v.csv:2: column v1: expected a number or an empty cell, got \"high\""),
        "{bad}"
    );
}

#[test]
fn a_file_of_inputs_needs_no_last_row_where_nothing_reads_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.toml");
    let load = |d: &str, rows: &str| {
        let system = format!("a = [[0.9, 1.0], [0.0, 0.8]]\nb = [[0.0], [1.0]]\n{d}");
        let text = BASE
            .replace("a = [[0.9, 1.0], [0.0, 0.8]]", &system)
            .replace("steps = 100", "steps = 9");
        std::fs::write(&path, format!("{text}\n[inputs]\nfile = \"u.csv\"\n")).unwrap();
        std::fs::write(folder.path().join("u.csv"), format!("k,u1\n{rows}")).unwrap();
        Experiment::load(&path).map_err(|e| e.to_string())
    };
    let inputs = |rows: &str| load("", rows).unwrap().remove(0).inputs;
    let data = |last: f64| {
        let rows = (0..9).map(|k| vec![f64::from(k) + 1.0]);
        Inputs::Data(rows.chain([vec![last]]).collect())
    };
    let nine: String = (0..9).map(|k| format!("{k},{}\n", k + 1)).collect();
    assert_eq!(inputs(&format!("{nine}9,5\n")), data(5.0));
    assert_eq!(inputs(&nine), data(0.0));
    let short = load("", "0,1\n1,2\n").unwrap_err();
    assert!(
        short.ends_with("inputs.file: u.csv: expected values for k = 0 to 8, got k up to 1"),
        "{short}"
    );
    let read = load("d = [[0.5]]", &nine).unwrap_err();
    assert!(
        read.ends_with("inputs.file: u.csv: expected values for k = 0 to 9, got k up to 8"),
        "{read}"
    );
}

#[test]
fn an_estimator_may_have_its_own_prior_and_noise() {
    let text = BASE.replace("alpha = 0.01\n", "alpha = 0.01\n[estimator.prior]\ngenerators = [[1.0], [2.0]]\n[estimator.noise]\nv = { covariance = [[9.0]] }\n");
    let e = one(&text);
    assert_eq!(e.estimators[1].problem.prior.generator_matrix().cols(), 1);
    assert_eq!(e.estimators[1].problem.v.covariance_matrix()[(0, 0)], 9.0);
    assert_eq!(e.estimators[1].problem.w, e.problem.w);
    assert_eq!(e.estimators[0].problem.v, e.problem.v);
    let wrong = text.replace(
        "v = { covariance = [[9.0]] }",
        "v = { covariance = [[-9.0]] }",
    );
    assert!(
        complaint(&wrong).contains(
            "estimator.mixed.noise.v.covariance: expected a positive semidefinite matrix"
        ),
        "{}",
        complaint(&wrong)
    );
}

#[test]
fn a_vehicle_is_read_and_its_faults_are_pointed_at() {
    let text = r#"schema = 1
paper  = "mine"
id     = "vehicle"
seed   = 1
runs   = 2
steps  = 9
[system]
kind = "vehicle-se2"
dt   = 0.01
form = "group"
[prior]
center     = [0.0, 0.0, 0.0]
generators = [[0.1, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]
[noise]
w = { box = [[-0.1, 0.1], [-0.1, 0.1], [-0.1, 0.1]] }
v = { box = [[-1.0, 1.0], [-1.0, 1.0]] }
[inputs]
constant = [0.4, 8.0]
[[estimator]]
id   = "filter"
kind = "inzsmf"
generators = 30
gain = { longitudinal = 0.98, lateral = [0.95, 0.98] }
[[metric]]
name = "rmse_norm"
components = ["x2", "x1"]
"#;
    let e = one(text);
    assert_eq!(e.problem.system.kind(), "vehicle-se2");
    assert_eq!(e.metrics[0].components, [2, 1]);
    let wrong = |from: &str, to: &str| complaint(&text.replace(from, to));
    assert!(
        wrong("dt   = 0.01", "dt   = 0").contains("system.dt: expected positive and finite, got 0")
    );
    assert!(wrong("\"group\"", "\"groop\"").ends_with("[did you mean \"group\"?]"));
    assert!(
        wrong("generators = 30", "generators = 3")
            .contains("estimator.filter.generators: expected at least 4")
    );
    let poles = wrong("longitudinal = 0.98", "longitudinal = 1.5");
    assert!(
        poles.contains("estimator.filter.gain: expected poles of magnitude below 1, got 1.5"),
        "{poles}"
    );
    let name = wrong(
        "gain = { longitudinal = 0.98, lateral = [0.95, 0.98] }",
        "gain = \"optimal\"",
    );
    assert!(
        name.contains("estimator.filter.gain") && name.contains("f-radius"),
        "{name}"
    );
}

#[test]
fn metrics_are_checked_against_their_table() {
    let with = |metric: &str| BASE.replace("[[metric]]\nname = \"rmse\"\nfrom = 4\n", metric);
    let e = one(&with(
        "[[metric]]\nname = \"better\"\nthan = \"kf\"\nthan_phase = \"predicted\"\nstrict = true\n\
         [[metric]]\nname = \"better\"\nid = \"better_late\"\nthan = \"kf\"\nat = [10, 20]\n\
         [[metric]]\nname = \"radius\"\nover = \"mixed\"\nto = 9\n[[metric]]\nname = \"radius\"\n\
         [[metric]]\nname = \"bound_ratio\"\nbound = \"printed\"\n",
    ));
    assert_eq!(
        (e.metrics[0].than_phase, e.metrics[0].strict),
        (Some(Phase::Predicted), true)
    );
    assert_eq!(e.metrics[1].id, "better_late");
    let covered: Vec<usize> = (0..=100).filter(|&k| e.metrics[1].covers(k)).collect();
    assert_eq!(covered, [10, 20]);
    assert!(e.metrics[2].covers(9) && !e.metrics[2].covers(10));
    assert_eq!(e.metrics[4].info().unit, "1");
    let wrong = |metric: &str| complaint(&with(&format!("[[metric]]\n{metric}\n")));
    assert!(wrong("name = \"rsme\"").ends_with("got \"rsme\" [did you mean \"rmse\"?]"));
    assert_eq!(
        wrong("name = \"better\""),
        "x.toml:37: metric[1].than: expected a value, which better needs, got nothing"
    );
    assert_eq!(
        wrong("name = \"better\"\nthan = \"mixd\""),
        "x.toml:39: metric[1].than: expected the id of an estimator (kf, mixed), got \"mixd\" [did you mean \"mixed\"?]"
    );
    assert_eq!(
        wrong("name = \"rmse\"\nfrom = 101"),
        "x.toml:39: metric[1].from: expected a step of at most 100, the last one, got 101"
    );
    assert_eq!(
        wrong("name = \"rmse\"\nfrom = 9\nto = 8"),
        "x.toml:40: metric[1].to: expected a step of at least from = 9, got 8"
    );
    assert_eq!(
        wrong("name = \"rmse_norm\""),
        "x.toml:37: metric[1].components: expected a value, which rmse_norm needs, got nothing"
    );
    assert_eq!(
        wrong("name = \"box_area\"\ncomponents = [\"x1\", \"x3\"]"),
        "x.toml:39: metric[1].components[2]: expected x1, x2, got \"x3\" [did you mean \"x1\"?]"
    );
    assert!(
        wrong("name = \"box_area\"\ncomponents = [\"x1\", \"x1\"]")
            .ends_with("expected different components, got x1 again")
    );
    assert_eq!(
        wrong("name = \"boundary\"\nlevel = 2"),
        "x.toml:39: metric[1].level: expected a number in (0, 1), got 2"
    );
    assert!(wrong("name = \"rmse\"\nthan = \"kf\"").contains("metric[1].than: unknown key"));
    assert!(wrong("name = \"rmse\"\n[[metric]]\nname = \"rmse\"").ends_with("metric[2].name: expected a metric with an id of its own, got \"rmse\" again [give one of them an id]"));
    assert!(
        wrong("name = \"rmse\"\nat = [3, 2]")
            .contains("metric[1].at[2]: expected ascending steps, got 2")
    );
    assert!(wrong("name = \"rmse\"\nat = [3]\nto = 5").contains("without from and to"));
}

#[test]
fn every_metric_is_described() {
    for info in METRICS {
        assert!(
            !info.formula.is_empty() && !info.unit.is_empty(),
            "{}",
            info.name
        );
        assert_eq!(
            METRICS
                .iter()
                .filter(|other| other.name == info.name)
                .count(),
            1
        );
    }
}

#[test]
fn the_output_is_checked() {
    assert_eq!(
        refused("sets = [0, 4, 9]", "sets = [0, 400]"),
        "x.toml:42: output.sets[2]: expected a step of at most 100, the last one, got 400"
    );
    assert_eq!(
        refused("sets = [0, 4, 9]", "sets = [4, 4]"),
        "x.toml:42: output.sets[2]: expected ascending steps, got 4"
    );
    assert_eq!(
        refused("traces = true", "traces = 1"),
        "x.toml:43: output.traces: expected true or false, got 1"
    );
}

#[test]
fn a_quick_experiment_is_smaller_and_whole() {
    let text = with(
        "[[metric]]\nname = \"width\"\nto = 90\n[[metric]]\nname = \"rmse\"\nid = \"late\"\nat = [41]\n",
    );
    let (full, quick) = (one(&text), one(&text).quick());
    assert_eq!((quick.runs, quick.steps), (QUICK_RUNS, 41));
    assert_eq!(quick.metrics.len(), full.metrics.len());
    assert_eq!(quick.metrics[1].to, Some(41));
    assert_eq!(quick.estimators.len(), 2);
    assert_eq!(quick.output.sets, [0, 4, 9]);
    let small = one(&BASE
        .replace("runs = 30", "runs = 1")
        .replace("steps = 100", "steps = 9"));
    assert_eq!((small.quick().runs, small.quick().steps), (1, 9));
}

#[test]
fn tracking_needs_no_truth_runs_or_metrics() {
    let bare = BASE
        .replace("seed = 2020\nruns = 30\nsteps = 100\n", "")
        .replace("[truth]\nx0 = [5.0, 5.0]\nw = { law = \"gaussian\", truncate = \"box\" }\nv = { law = \"uniform\" }\n", "")
        .replace("[[metric]]\nname = \"rmse\"\nfrom = 4\n", "");
    let all = Tracking::parse("x.toml", &bare).unwrap();
    assert_eq!(
        (all.len(), all[0].id.as_str(), all[0].estimators.len()),
        (1, "ex1", 2)
    );
    assert_eq!(Tracking::parse("x.toml", BASE).unwrap().len(), 1);
    let fault = Tracking::parse("x.toml", &bare.replace("phi = 20", "phi = 1")).unwrap_err();
    assert!(
        fault
            .to_string()
            .contains("estimator.mixed.phi: expected at least n = 2, got 1")
    );
    assert!(complaint(&bare).starts_with("x.toml:1: seed: expected an integer, got nothing"));
}

#[test]
fn the_published_experiments_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../experiments");
    let mut names = BTreeSet::new();
    for paper in ["box", "ezgkf"] {
        let mut files = 0;
        for entry in std::fs::read_dir(folder.join(paper)).unwrap() {
            let path = entry.unwrap().path();
            if path
                .extension()
                .is_some_and(|extension| extension == "toml")
            {
                files += 1;
                for experiment in Experiment::load(&path).unwrap_or_else(|fault| panic!("{fault}"))
                {
                    assert_eq!(experiment.paper, paper);
                    assert!(names.insert(experiment.name()), "{}", experiment.name());
                    assert!(experiment.quick().runs <= QUICK_RUNS);
                }
            }
        }
        assert!(files > 0, "{paper} has experiments");
    }
}
