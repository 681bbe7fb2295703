//! `track`: recorded data in, estimates out, and the values of an independent implementation
//! (`estimation/tests/reference/`) on the way through files.

mod program;

use program::{Folder, Outcome};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use zonobench_lake::rows::{Belief, Estimate, EstimatorInfo, Metric};
use zonobench_lake::table::{self, Row};

/// Absolute; outward rounding, another order of summation and another eigenvalue routine move these
/// numbers by at most about 1e-13.
const TOLERANCE: f64 = 1e-9;

/// `$name.json` of the reference values.
fn reference(name: &str) -> Value {
    let path = Path::new("../../estimation/tests/reference").join(format!("{name}.json"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap()
}

/// Rows of vectors as CSV, with every digit.
fn csv(header: &str, rows: &Value) -> String {
    let mut text = format!("k,{header}\n");
    for (k, row) in rows.as_array().unwrap().iter().enumerate() {
        let cells: Vec<String> = row
            .as_array()
            .unwrap()
            .iter()
            .map(Value::to_string)
            .collect();
        writeln!(text, "{k},{}", cells.join(",")).unwrap();
    }
    text
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// `[lo, hi]` by component, from the corners `[[lo, …], [hi, …]]`.
fn sides(corners: &Value) -> String {
    let (lo, hi) = (numbers(&corners[0]), numbers(&corners[1]));
    let sides: Vec<String> = lo
        .iter()
        .zip(&hi)
        .map(|(lo, hi)| format!("[{lo:?}, {hi:?}]"))
        .collect();
    format!("[{}]", sides.join(", "))
}

/// What `track` wrote.
struct Written {
    estimates: Vec<Estimate>,
    beliefs: Vec<Belief>,
    estimators: Vec<EstimatorInfo>,
}

impl Written {
    fn read(folder: &Folder, out: &str) -> Self {
        fn rows<R: Row>(folder: &Path) -> Vec<R> {
            table::read(&folder.join(format!("{}.parquet", R::TABLE))).unwrap()
        }
        let out = folder.path(out);
        let names: Vec<_> = std::fs::read_dir(&out)
            .unwrap()
            .map(|e| e.unwrap().file_name())
            .collect();
        assert_eq!(names.len(), 3, "{names:?}");
        Self {
            estimates: rows(&out),
            beliefs: rows(&out),
            estimators: rows(&out),
        }
    }

    /// (center, lower, upper) of all components.
    fn estimate(&self, estimator: &str, k: usize, phase: &str) -> [Vec<Option<f64>>; 3] {
        let of =
            |e: &&Estimate| &*e.estimator == estimator && e.k as usize == k && &*e.phase == phase;
        let mut out = [vec![], vec![], vec![]];
        for (i, row) in self.estimates.iter().filter(of).enumerate() {
            assert_eq!(
                (row.run, &*row.component),
                (0, format!("x{}", i + 1).as_str())
            );
            out[0].push(row.center);
            out[1].push(row.lower);
            out[2].push(row.upper);
        }
        out
    }

    fn belief(&self, estimator: &str, k: usize, phase: &str) -> &Belief {
        let of =
            |b: &&Belief| &*b.estimator == estimator && b.k as usize == k && &*b.phase == phase;
        let mut found = self.beliefs.iter().filter(of);
        let belief = found
            .next()
            .unwrap_or_else(|| panic!("{estimator} at k = {k}, {phase}"));
        assert!(found.next().is_none());
        assert_eq!((belief.run, belief.contains_truth), (0, None));
        belief
    }

    /// (k, status) of the updated estimates, one for each k.
    fn statuses(&self, estimator: &str) -> Vec<(i32, String)> {
        let of = |e: &&Estimate| {
            &*e.estimator == estimator && &*e.phase == "updated" && &*e.component == "x1"
        };
        self.estimates
            .iter()
            .filter(of)
            .map(|e| (e.k, e.status.to_string()))
            .collect()
    }
}

fn assert_close(what: &str, k: usize, got: &[Option<f64>], expected: &Value) {
    let expected = numbers(expected);
    let close = |(g, e): (&Option<f64>, &f64)| g.is_some_and(|g| (g - e).abs() <= TOLERANCE);
    let agree = got.len() == expected.len() && got.iter().zip(&expected).all(close);
    assert!(agree, "{what} at k = {k}: {got:?}, expected {expected:?}");
}

fn covariance(belief: &Belief) -> Vec<Option<f64>> {
    belief
        .covariance
        .iter()
        .flatten()
        .map(|&x| Some(x))
        .collect()
}

fn tracked(folder: &Folder, more: &[&str]) -> Outcome {
    let arguments = ["track", "t.toml", "--measurements", "y.csv", "--out", "out"];
    folder.done(&[&arguments[..], more].concat())
}

#[test]
fn scenario_a_agrees_with_the_reference() {
    let file = reference("box_scenario_a");
    let folder = Folder::new();
    let kf = &file["kf"];
    folder.write(
        "t.toml",
        format!(
            "schema = 1\npaper = \"mine\"\nid = \"a\"\n\
             [system]\nkind = \"linear\"\na = {}\nc = {}\n\
             [prior]\nbox = {}\nmean = {}\ncovariance = {}\n\
             [noise]\nw = {{ box = {}, covariance = {} }}\nv = {{ box = {}, covariance = {} }}\n\
             [[estimator]]\nid = \"kf\"\nkind = \"kalman\"\n\
             [[estimator]]\nid = \"stacked\"\nkind = \"box-state-est\"\n\
             [[estimator]]\nid = \"printed\"\nkind = \"box-state-est\"\nproducts = \"printed\"\n",
            file["system"]["A"],
            file["system"]["C"],
            sides(&file["x0_box"]),
            kf["xe"],
            kf["G0"],
            sides(&file["d_box"]),
            kf["Gd"],
            sides(&file["v_box"]),
            kf["Gv"],
        ),
    );
    folder.write("y.csv", csv("y1", &file["y"]));
    let said = tracked(&folder, &[]);
    assert_eq!(said.stdout, "a: k = 0 to 119; see out/estimates.parquet\n");
    let written = Written::read(&folder, "out");
    let e = &file["expected"];
    // For n = 2 both readings of the products agree.
    for estimator in ["stacked", "printed"] {
        for k in 0..120 {
            let [_, lower, upper] = written.estimate(estimator, k, "predicted");
            assert_close("predicted lower", k, &lower, &e["pred_lo"][k]);
            assert_close("predicted upper", k, &upper, &e["pred_hi"][k]);
            let [center, lower, upper] = written.estimate(estimator, k, "updated");
            assert_close("center", k, &center, &e["xhat"][k]);
            assert_close("lower", k, &lower, &e["box_lo"][k]);
            assert_close("upper", k, &upper, &e["box_hi"][k]);
        }
    }
    for k in 0..120 {
        let [predicted, ..] = written.estimate("kf", k, "predicted");
        assert_close("x predicted", k, &predicted, &e["kf_x_pred"][k]);
        let [updated, lower, upper] = written.estimate("kf", k, "updated");
        assert_close("x updated", k, &updated, &e["kf_x_filt"][k]);
        assert_eq!(
            (lower, upper),
            (vec![None; 2], vec![None; 2]),
            "a Kalman filter has no set"
        );
        let p = |phase| covariance(written.belief("kf", k, phase));
        assert_close("P predicted", k, &p("predicted"), &e["kf_G_pred"][k]);
        assert_close("P updated", k, &p("updated"), &e["kf_G_filt"][k]);
    }
    let about: Vec<(&str, &str, bool)> = written
        .estimators
        .iter()
        .map(|e| (&*e.estimator, &*e.kind, e.guaranteed))
        .collect();
    assert_eq!(
        about,
        [
            ("kf", "kalman", false),
            ("stacked", "box-state-est", true),
            ("printed", "box-state-est", false)
        ]
    );
    assert_eq!(written.statuses("stacked").len(), 120);
    assert!(written.estimates.iter().all(|row| &*row.status == "ok"));
}

/// The mixed filters on the system of `name`, its recorded inputs included.
fn mixed_agrees(name: &str) {
    let file = reference(name);
    let s = &file["system"];
    let steps = s["kf"].as_u64().unwrap() as usize;
    let is_lpv = s["model"] == "lpv";
    let system = if is_lpv {
        format!(
            "kind = \"lpv\"\na0 = {}\na = {}\nb = {}\nc = {}",
            s["A0"], s["Ai"], s["B"], s["C"]
        )
    } else {
        format!("kind = \"van-der-pol\"\nts = {}", s["Ts"])
    };
    let settings = format!(
        "phi = {}\neta = {}\nalpha = {}",
        s["phi_g"], s["eta"], s["alpha"]
    );
    let mut text = format!(
        "schema = 1\npaper = \"mine\"\nid = \"mixed\"\n[system]\n{system}\n\
         [prior]\ncenter = {}\ngenerators = {}\ncovariance = {}\n\
         [noise]\nw = {{ generators = {}, covariance = {} }}\nv = {{ generators = {}, covariance = {} }}\n",
        s["c0"], s["G0"], s["P0"], s["Gw"], s["Q"], s["Gv"], s["R"]
    );
    let kinds = [
        ("EZGKF", "ezgkf", "kind = \"ezgkf\""),
        ("EZGKF-M", "ezgkf-m", "kind = \"ezgkf-m\""),
        ("EZGKP", "ak", "kind = \"ezgkp\"\nform = \"ak\""),
        (
            "EZGKP_direct",
            "direct",
            "kind = \"ezgkp\"\nform = \"direct\"",
        ),
    ];
    for (_, id, kind) in kinds {
        write!(text, "[[estimator]]\nid = \"{id}\"\n{kind}\n{settings}\n").unwrap();
    }
    let folder = Folder::new();
    folder.write("t.toml", text);
    folder.write("y.csv", csv("y1", &s["y"]));
    // The reference has no input at the last k, where none is used.
    folder.write("u.csv", csv("u1", &s["u"]));
    tracked(&folder, if is_lpv { &["--inputs", "u.csv"] } else { &[] });
    let written = Written::read(&folder, "out");
    for (reference, id, _) in kinds {
        let expected = file["expected"][reference].as_array().unwrap();
        assert_eq!(expected.len(), steps + 1);
        for (k, e) in expected.iter().enumerate() {
            assert_eq!(e["k"], k);
            let what = |part: &str| format!("{name} {id} {part}");
            let [center, lower, upper] = written.estimate(id, k, "updated");
            assert_close(&what("c"), k, &center, &e["c"]);
            assert_close(&what("lower"), k, &lower, &e["lo"]);
            assert_close(&what("upper"), k, &upper, &e["hi"]);
            let belief = written.belief(id, k, "updated");
            assert_close(&what("P"), k, &covariance(belief), &e["P"]);
            assert_close(&what("tr GG'"), k, &[belief.trace_ggt], &e["trGGt"]);
            assert_eq!(
                belief.n_generators,
                e["n_g"].as_i64(),
                "{} at k = {k}",
                what("order")
            );
        }
    }
}

#[test]
fn the_mixed_filters_agree_with_the_reference_on_the_lpv_system() {
    mixed_agrees("ezgkf_lpv_phi30");
}

#[test]
fn the_mixed_filters_agree_with_the_reference_on_the_van_der_pol_oscillator() {
    mixed_agrees("ezgkf_vdp_phi12");
}

/// Two measured components, and every estimator that takes measurements with gaps.
const TWO: &str = r#"schema = 1
paper = "mine"
id = "two"

[system]
kind = "linear"
a = [[0.9, 0.2], [0.0, 0.8]]
c = [[1.0, 0.0], [0.0, 1.0]]

[prior]
box = [[-10.0, 10.0], [-10.0, 10.0]]
covariance = [[10.0, 0.0], [0.0, 10.0]]

[noise]
w = { box = [[-0.1, 0.1], [-0.1, 0.1]], covariance = [[0.01, 0.0], [0.0, 0.01]] }
v = { box = [[-0.1, 0.1], [-0.1, 0.1]], covariance = [[0.01, 0.0], [0.0, 0.01]] }

[[estimator]]
id = "box"
kind = "box-state-est"

[[estimator]]
id = "kf"
kind = "kalman"

[[estimator]]
id = "mixed"
kind = "ezgkf"
phi = 20
eta = 0.5
alpha = 0.01
"#;

#[test]
fn empty_cells_and_steps_that_are_left_out_are_steps_without_a_measurement() {
    let folder = Folder::new();
    folder.write("t.toml", TWO);
    folder.write("y.csv", "k,y1,y2\n0,1.0,2.0\n1,,1.6\n2,,\n4,1.2,\n5,,0.7\n");
    tracked(&folder, &[]);
    let written = Written::read(&folder, "out");
    for estimator in ["box", "kf", "mixed"] {
        let ok: Vec<(i32, String)> = (0..=5).map(|k| (k, "ok".to_owned())).collect();
        assert_eq!(written.statuses(estimator), ok, "{estimator}");
    }
    // Nothing was learnt at k = 2, which has empty cells, and at k = 3, which has no line; something at k = 4.
    for k in [2, 3] {
        for estimator in ["kf", "mixed"] {
            let at = |phase| written.estimate(estimator, k, phase);
            assert_eq!(at("updated"), at("predicted"), "{estimator} at k = {k}");
        }
    }
    assert_ne!(
        written.estimate("kf", 4, "updated"),
        written.estimate("kf", 4, "predicted")
    );
    // The same with the steps written out, in another order of columns.
    let first = (
        std::fs::read(folder.path("out/estimates.parquet")).unwrap(),
        written.beliefs,
    );
    folder.write(
        "y.csv",
        "y2,k,y1\r\n2,0,1\r\n1.6,1,\r\n,2,\r\n,3,\r\n,4,1.2\r\n0.7,5,\r\n",
    );
    tracked(&folder, &[]);
    assert_eq!(
        std::fs::read(folder.path("out/estimates.parquet")).unwrap(),
        first.0
    );
    assert_eq!(Written::read(&folder, "out").beliefs, first.1);
}

#[test]
fn a_measurement_that_contradicts_the_model_is_a_result() {
    let folder = Folder::new();
    folder.write("t.toml", TWO);
    folder.write(
        "y.csv",
        "k,y1,y2\n0,1.0,1.0\n1,1.1,0.8\n2,500,0.64\n3,1.2,0.5\n4,1.2,0.4\n",
    );
    let said = tracked(&folder, &[]).stdout;
    let written = Written::read(&folder, "out");
    // The boxes of the guaranteed filter cannot hold it: it ends there, with a row that says so.
    let box_filter = written.statuses("box");
    let (last, before) = box_filter.split_last().unwrap();
    assert_eq!(last.1, "inconsistent", "{box_filter:?}");
    assert!(
        before.iter().all(|(_, status)| status == "ok"),
        "{box_filter:?}"
    );
    assert!((2..=3).contains(&last.0), "{box_filter:?}");
    assert_eq!(
        said.lines().next().unwrap(),
        format!(
            "two: box: the measurement at k = {} contradicts the model",
            last.0
        )
    );
    let rows: Vec<&Estimate> = written
        .estimates
        .iter()
        .filter(|row| &*row.status == "inconsistent")
        .collect();
    assert_eq!(rows.len(), 2, "a row for each component");
    assert!(
        rows.iter()
            .all(|row| (row.center, row.lower, row.upper) == (None, None, None))
    );
    // The others go on to the end.
    for estimator in ["kf", "mixed"] {
        assert_eq!(written.statuses(estimator).len(), 5, "{estimator}");
    }
}

#[test]
fn a_sweep_tracks_in_a_folder_for_each_combination() {
    let folder = Folder::new();
    folder.write(
        "t.toml",
        format!("{TWO}\n[sweep]\n\"estimator.mixed.phi\" = [4, 8]\n"),
    );
    folder.write("y.csv", "k,y1,y2\n0,1.0,1.0\n1,1.1,0.8\n");
    let said = tracked(&folder, &["--quiet"]);
    assert_eq!((said.stdout.as_str(), said.stderr.as_str()), ("", ""));
    for phi in [4, 8] {
        let written = Written::read(&folder, &format!("out/two_phi{phi}"));
        let mixed = written
            .estimators
            .iter()
            .find(|e| &*e.estimator == "mixed")
            .unwrap();
        assert!(
            mixed.settings.contains(&format!("\"phi\":{phi}")),
            "{}",
            mixed.settings
        );
    }
}

#[test]
fn a_table_of_the_lake_is_not_in_the_form_of_a_recording() {
    use zonobench_lake::rows::Measurement;
    let folder = Folder::new();
    folder.write("t.toml", TWO);
    let rows = [Measurement {
        run: 0,
        k: 0,
        component: "y1".into(),
        value: Some(1.0),
    }];
    table::write(&folder.path("long.parquet"), rows, &Default::default()).unwrap();
    let arguments = [
        "track",
        "t.toml",
        "--measurements",
        "long.parquet",
        "--out",
        "out",
    ];
    folder.run(&arguments).ends_with(2).says(&[
        "long.parquet: ",
        "expected the columns k, y1, y2, got \"run\"",
    ]);
}

/// A perfect sensor, no noise at all, and an estimator without either.
const PERFECT: &str = r#"schema = 1
paper = "mine"
id = "perfect"

[system]
kind = "linear"
a = [[1.0]]
c = [[1.0]]

[prior]
box = [[-1.0, 1.0]]
mean = [0.0]
covariance = [[1.0]]

[noise]
w = { box = [[0.0, 0.0]], mean = [0.0], covariance = [[0.0]] }
v = { box = [[0.0, 0.0]], mean = [0.0], covariance = [[0.0]] }

[[estimator]]
id = "kalman"
kind = "kalman"

[[estimator]]
id = "box"
kind = "box-state-est"
"#;

#[test]
fn an_estimator_that_fails_takes_nothing_from_the_others() {
    let folder = Folder::new();
    folder.write("t.toml", PERFECT);
    // Without noise the second measurement is impossible: the Kalman filter divides by zero, the box is empty.
    folder.write("y.csv", "k,y1\n0,0.5\n1,0.5\n2,0.75\n3,0.5\n");
    let arguments = ["track", "t.toml", "--measurements", "y.csv", "--out", "out"];
    let outcome = folder.run(&arguments).ends_with(1);
    let outcome = outcome.says(&["perfect: kalman, run 0, k = 2: singular: "]);
    assert_eq!(
        outcome.stdout,
        "perfect: box: the measurement at k = 2 contradicts the model\n\
         perfect: k = 0 to 3; see out/estimates.parquet\n"
    );
    let written = Written::read(&folder, "out");
    for (estimator, last) in [("kalman", "singular"), ("box", "inconsistent")] {
        let expected = [(0, "ok"), (1, "ok"), (2, last)].map(|(k, s)| (k, s.to_owned()));
        assert_eq!(written.statuses(estimator), expected, "{estimator}");
        let [center, ..] = written.estimate(estimator, 1, "updated");
        // The box is rounded outward.
        assert!(
            center[0].is_some_and(|c| (c - 0.5).abs() < 1e-12),
            "{estimator}: {center:?}"
        );
    }
}

#[test]
fn a_simulated_run_that_fails_is_a_row_too_and_its_exit_code_is_kept_with_it() {
    let folder = Folder::new();
    // The truth does not keep to what the estimators assume.
    let text = PERFECT.replace(
        "[prior]",
        "[truth]\nx0 = [0.5]\nw = { law = \"zero\" }\nv = { signals = [[{ kind = \"pieces\", at = [2], value = [0.0, 1.0] }]] }\n\n[prior]",
    );
    let text = text.replace(
        "id = \"perfect\"",
        "id = \"perfect\"\nseed = 1\nruns = 1\nsteps = 4",
    );
    folder.write(
        "t.toml",
        format!("{text}\n[[metric]]\nname = \"radius\"\n\n[output]\ntraces = true\n"),
    );
    for _ in ["made", "found"] {
        let outcome = folder.run(&["run", "t.toml"]).ends_with(1);
        outcome.says(&["mine/perfect: kalman, run 0, k = 2: singular: "]);
    }
    let sql = "SELECT estimator, k, status FROM estimates WHERE phase = 'updated' AND status <> 'ok' ORDER BY estimator";
    let rows = folder.done(&["query", sql, "--format", "csv"]).stdout;
    assert_eq!(
        rows,
        "estimator,k,status\nbox,2,inconsistent\nkalman,2,singular\n"
    );
    folder.done(&["verify"]);
}

/// A state that grows tenfold a step, so that its covariance is beyond every f64 after 160.
const GROWING: &str = r#"schema = 1
paper = "mine"
id = "growing"

[system]
kind = "linear"
a = [[10.0]]
c = [[1.0]]

[prior]
center = [0.0]
generators = [[1.0]]
mean = [0.0]
covariance = [[1.0]]

[noise]
w = { generators = [[1.0]], covariance = [[1.0]] }
v = { generators = [[1.0]], covariance = [[1.0]] }

[[estimator]]
id = "kf"
kind = "kalman"

[[estimator]]
id = "mixed"
kind = "ezgkf"
phi = 20
eta = 0.5
alpha = 0.01
"#;

#[test]
fn a_covariance_that_is_no_longer_finite_is_an_overflow_and_not_ok() {
    let folder = Folder::new();
    folder.write("t.toml", GROWING);
    folder.write("y.csv", "k,y1\n0,0.5\n400,0.5\n");
    let arguments = ["track", "t.toml", "--measurements", "y.csv", "--out", "out"];
    let outcome = folder.run(&arguments).ends_with(1);
    outcome.says(&[
        "growing: kf, run 0, k = 15",
        ": overflow: ",
        "growing: mixed, run 0, k = ",
    ]);
    let written = Written::read(&folder, "out");
    for estimator in ["kf", "mixed"] {
        let statuses = written.statuses(estimator);
        let (last, before) = statuses.split_last().unwrap();
        assert_eq!(last.1, "overflow", "{estimator}");
        assert!((100..400).contains(&last.0), "{estimator}: {last:?}");
        assert!(
            before.iter().all(|(_, status)| status == "ok"),
            "{estimator}"
        );
    }
    let finite = |b: &Belief| b.covariance.iter().flatten().all(|x| x.is_finite());
    assert!(written.beliefs.iter().all(finite));
}

#[test]
fn what_the_file_asks_for_is_given_as_far_as_no_truth_is_needed() {
    let folder = Folder::new();
    folder.write(
        "t.toml",
        format!(
            "{TWO}\n[[metric]]\nname = \"rmse\"\n\n[[metric]]\nname = \"contains\"\nid = \"inside\"\n\n\
             [[metric]]\nname = \"area\"\nfrom = 500\n\n[[metric]]\nname = \"width\"\nfrom = 1\n\n\
             [[metric]]\nname = \"center_inside\"\nwithin = \"box\"\n\n\
             [output]\nsets = [0, 2, 1000]\ntraces = true\n"
        ),
    );
    folder.write("y.csv", "k,y1,y2\n0,1.0,1.0\n1,1.1,0.8\n2,1.2,0.64\n");
    let said = tracked(&folder, &[]).stdout;
    assert_eq!(
        said,
        "two: left out, because they need the truth: rmse, inside\n\
         two: k = 0 to 2; see out/estimates.parquet\n"
    );
    let sets: Vec<zonobench_lake::rows::Set> =
        table::read(&folder.path("out/sets.parquet")).unwrap();
    let steps = |estimator: &str| {
        let of = sets.iter().filter(|set| &*set.estimator == estimator);
        of.map(|set| set.k).collect::<Vec<_>>()
    };
    assert_eq!(steps("box"), [0, 0, 2, 2]);
    assert!(
        sets.iter()
            .all(|set| set.center.as_ref().is_some_and(|c| c.len() == 2))
    );
    let beliefs: Vec<Belief> = table::read(&folder.path("out/beliefs.parquet")).unwrap();
    let volumes = |estimator: &str| {
        let of = beliefs.iter().filter(|b| &*b.estimator == estimator);
        of.map(|b| b.volume.is_some()).collect::<Vec<_>>()
    };
    assert!(volumes("box").iter().all(|&there| there));
    assert!(
        volumes("kf").iter().all(|&there| !there),
        "a Kalman filter has no set"
    );
    // Metrics are the means over the recording that the estimates' own numbers give.
    let metrics: Vec<Metric> = table::read(&folder.path("out/metrics.parquet")).unwrap();
    let value = |estimator: &str, metric: &str, component: Option<&str>| {
        let mut of = metrics.iter().filter(|m| {
            (&*m.estimator, &*m.metric, m.component.as_deref()) == (estimator, metric, component)
        });
        let found = of.next().map(|m| (m.run, m.value.unwrap()));
        assert!(of.next().is_none());
        found
    };
    let estimates: Vec<Estimate> = table::read(&folder.path("out/estimates.parquet")).unwrap();
    let widths = estimates.iter().filter(|e| {
        (&*e.estimator, &*e.phase, &*e.component) == ("box", "updated", "x1") && e.k >= 1
    });
    let widths: Vec<f64> = widths
        .map(|e| e.upper.unwrap() - e.lower.unwrap())
        .collect();
    assert_eq!(widths.len(), 2);
    assert_eq!(
        value("box", "width", Some("x1")),
        Some((0, (widths[0] + widths[1]) / 2.0))
    );
    assert_eq!(value("kf", "width", Some("x1")), None);
    assert_eq!(
        value("kf", "center_inside", None).map(|(run, _)| run),
        Some(0)
    );
    assert_eq!(
        value("box", "area", None),
        None,
        "K is beyond the recording"
    );
    let truth = |m: &Metric| matches!(&*m.metric, "rmse" | "inside");
    assert!(!metrics.iter().any(truth));
    // A run that writes none leaves none of another run behind.
    folder.write("t.toml", TWO);
    tracked(&folder, &[]);
    Written::read(&folder, "out");
}

#[test]
fn the_last_input_is_asked_for_only_where_it_is_measured() {
    let folder = Folder::new();
    let text = TWO
        .replace("[prior]", "b = [[1.0], [0.5]]\n\n[prior]")
        .replacen("\nb =", "b =", 1);
    folder.write("t.toml", &text);
    folder.write("y.csv", "k,y1,y2\n0,1.0,1.0\n1,1.1,0.8\n2,1.2,0.64\n");
    folder.write("all.csv", "k,u1\n0,0\n1,0\n2,0\n");
    folder.write("fewer.csv", "k,u1\n0,0\n1,0\n");
    folder.write("none.csv", "k,u1\n0,0\n");
    tracked(&folder, &["--inputs", "all.csv"]);
    let estimates = std::fs::read(folder.path("out/estimates.parquet")).unwrap();
    tracked(&folder, &["--inputs", "fewer.csv"]);
    let without_the_last = std::fs::read(folder.path("out/estimates.parquet")).unwrap();
    assert!(estimates == without_the_last);
    let arguments = ["track", "t.toml", "--measurements", "y.csv", "--out", "out"];
    let with = |inputs| folder.run(&[&arguments[..], &["--inputs", inputs]].concat());
    with("none.csv")
        .ends_with(2)
        .says(&["none.csv: expected values for k = 0 to 1, got k up to 0"]);
    folder.write(
        "t.toml",
        text.replace("\n\n[prior]", "\nd = [[0.1], [0.0]]\n\n[prior]"),
    );
    with("all.csv").ends_with(0);
    with("fewer.csv")
        .ends_with(2)
        .says(&["fewer.csv: expected values for k = 0 to 2, got k up to 1"]);
}

#[cfg(unix)]
#[test]
fn a_pipe_is_read_once_and_what_has_no_end_is_refused() {
    let folder = Folder::new();
    let endless = [
        "track",
        "/dev/zero",
        "--measurements",
        "y.csv",
        "--out",
        "out",
    ];
    for arguments in [&endless[..], &["run", "/dev/zero"]] {
        folder
            .run(arguments)
            .ends_with(2)
            .says(&["/dev/zero: expected at most 4194304 bytes, got more"]);
    }
    folder.write(
        "t.toml",
        format!("{TWO}\n[sweep]\n\"estimator.mixed.phi\" = [4, 8]\n"),
    );
    let made = std::process::Command::new("mkfifo")
        .arg(folder.path("pipe"))
        .status();
    assert!(made.unwrap().success());
    let pipe = folder.path("pipe");
    let writer =
        std::thread::spawn(move || std::fs::write(pipe, "k,y1,y2\n0,1.0,1.0\n1,1.1,0.8\n"));
    let track = |measurements| {
        let arguments = [
            "track",
            "t.toml",
            "--measurements",
            measurements,
            "--out",
            "out",
        ];
        folder.run(&arguments)
    };
    let outcome = track("pipe").ends_with(0);
    assert!(
        outcome.stdout.contains("two_phi8: k = 0 to 1"),
        "{outcome:?}"
    );
    writer.join().unwrap().unwrap();
    let start = std::time::Instant::now();
    track("/dev/zero")
        .ends_with(2)
        .says(&["/dev/zero:1: expected at most 1048576 bytes in a line"]);
    track("/dev/null")
        .ends_with(2)
        .says(&["/dev/null: expected a header and at least one row"]);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn a_gap_costs_what_it_says_and_a_longer_one_is_refused_first() {
    let folder = Folder::new();
    folder.write("t.toml", TWO);
    folder.write("y.csv", "k,y1,y2\n0,1,1\n1000000,1,1\n");
    let arguments = ["track", "t.toml", "--measurements", "y.csv", "--out", "out"];
    folder.run(&arguments).ends_with(2).says(&[
        "y.csv:3: column k: expected at most 100000 steps in a row without a row, got 999999 from 0 to 1000000",
        "--longest-gap 999999",
    ]);
    assert!(!folder.path("out").exists());
    folder.write("y.csv", "k,y1,y2\n0,1,1\n20,0,0\n");
    let with = |gap| folder.run(&[&arguments[..], &["--longest-gap", gap]].concat());
    with("18")
        .ends_with(2)
        .says(&["expected at most 18 steps in a row without a row, got 19"]);
    with("19").ends_with(0);
    assert_eq!(Written::read(&folder, "out").statuses("kf").len(), 21);
}
