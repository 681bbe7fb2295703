//! `kind = "command"`: programs as estimators. The children are in Python 3, which these tests need.

mod program;

use program::Folder;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;
use zonobench_lake::rows::{Belief, Estimate, EstimatorInfo, Input, Measurement, Metric};
use zonobench_lake::table::{self, Row};
use zonobench_sets::Interval;

const PAGE: &str = include_str!("../../../docs/own-methods.md");

/// The file `name` of the page.
fn example(name: &str) -> &'static str {
    let (_, rest) = PAGE
        .split_once(&format!("file={name}\n"))
        .expect("the page has it");
    rest.split_once("\n```").expect("the block ends").0
}

fn rows<R: Row>(folder: &Folder, lake: &str, experiment: &str) -> Vec<R> {
    let path = format!(
        "{lake}/{}/paper=mine/experiment={experiment}/part-0.parquet",
        R::TABLE
    );
    let path = folder.path(&path);
    table::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn page() -> Folder {
    let folder = Folder::new();
    folder.write("interval.py", example("interval.py"));
    folder.write("mine.toml", example("mine.toml"));
    folder
}

/// The interval observer of the walk, on the system of the page, by this program's intervals.
fn observed(y: &[f64], u: &[f64]) -> Vec<[Interval; 2]> {
    let side = |r: f64| Interval::new(-r, r).unwrap();
    let (w, v) = ([side(0.01), side(0.02)], side(0.05));
    let mut x = [side(1.0); 2];
    (0..y.len())
        .map(|k| {
            if k > 0 {
                let by_input = Interval::point(u[k - 1]) * 0.1;
                x = [x[0] + x[1] * 0.1 + w[0], x[1] * 0.95 + by_input + w[1]];
            }
            let known = Interval::point(y[k]) - v;
            x[0] = x[0].intersect(&known).expect("consistent");
            x
        })
        .collect()
}

#[test]
fn the_interval_observer_in_python_gives_the_bounds_of_the_one_in_rust() {
    let folder = page();
    folder.done(&["run", "mine.toml", "--lake", "lake", "--allow-commands"]);
    let mut bounds: BTreeMap<(i32, i32), Vec<(f64, f64)>> = BTreeMap::new();
    for e in rows::<Estimate>(&folder, "lake", "compared") {
        if &*e.estimator == "mine" {
            assert_eq!((&*e.phase, &*e.status), ("updated", "ok"));
            let side = (e.lower.unwrap(), e.upper.unwrap());
            bounds.entry((e.run, e.k)).or_default().push(side);
        }
    }
    assert_eq!(bounds.len(), 40 * 61);
    let measured = rows::<Measurement>(&folder, "lake", "compared");
    let inputs = rows::<Input>(&folder, "lake", "compared");
    for run in 0..40 {
        let y: Vec<f64> = (measured.iter())
            .filter(|m| m.run == run)
            .map(|m| m.value.unwrap())
            .collect();
        let u: Vec<f64> = inputs
            .iter()
            .filter(|u| u.run == run)
            .map(|u| u.value)
            .collect();
        for (k, x) in observed(&y, &u).into_iter().enumerate() {
            for (side, (lower, upper)) in x.iter().zip(&bounds[&(run, k as i32)]) {
                // Python's are rounded outward always, ours only where something was rounded: a hundred last bits.
                let apart = (side.lo() - lower).abs().max((side.hi() - upper).abs());
                assert!(
                    apart < 1e-13,
                    "run {run}, k = {k}: {side:?} [{lower}, {upper}]"
                );
            }
        }
    }
    let judged: Vec<Belief> = rows::<Belief>(&folder, "lake", "compared")
        .into_iter()
        .filter(|b| &*b.estimator == "mine")
        .collect();
    assert!(judged.iter().all(|b| b.contains_truth == Some(true)));
    let infos = rows::<EstimatorInfo>(&folder, "lake", "compared");
    let mine = infos.iter().find(|i| &*i.estimator == "mine").unwrap();
    assert!(!mine.guaranteed && &*mine.kind == "command" && mine.settings.contains("interval.py"));
    let ekf = infos.iter().find(|i| &*i.estimator == "ekf").unwrap();
    let moments = r#""moments":{"prior":"uniform","v":"uniform","w":"uniform"}"#;
    assert!(ekf.settings.contains(moments), "{}", ekf.settings);
    let coverage = rows::<Metric>(&folder, "lake", "compared");
    let of_mine = coverage
        .iter()
        .filter(|m| &*m.estimator == "mine" && &*m.metric == "coverage");
    assert!(of_mine.clone().count() == 40 * 3 && of_mine.clone().all(|m| m.value == Some(1.0)));

    let text = folder
        .done(&["rank", "mine/compared", "--lake", "lake"])
        .stdout;
    assert!(
        text.contains("mine/compared: rmse of x1") && text.contains("99 % interval"),
        "{text}"
    );
    let csv = folder
        .done(&[
            "rank",
            "compared",
            "--metric",
            "width",
            "--against",
            "box",
            "--lake",
            "lake",
            "--format",
            "csv",
        ])
        .stdout;
    let lines: Vec<&str> = csv.lines().skip(1).collect();
    assert_eq!(lines.len(), 3, "{csv}");
    assert!(lines.iter().all(|l| l.contains(",mine,box,40,")), "{csv}");
    folder
        .run(&["rank", "nowhere", "--lake", "lake"])
        .ends_with(2)
        .says(&["nowhere", "mine/compared"]);
}

#[test]
fn nothing_is_started_without_the_flag() {
    let folder = page();
    folder.write("interval.py", "open('started', 'w')\n");
    for arguments in [
        &["run", "mine.toml", "--lake", "lake"][..],
        &[
            "track",
            "mine.toml",
            "--measurements",
            "y.csv",
            "--out",
            "out",
        ],
    ] {
        folder.write("y.csv", "k,y1\n0,0.5\n");
        folder
            .run(arguments)
            .ends_with(2)
            .says(&["--allow-commands", "python3 interval.py"]);
    }
    folder.done(&["plan", "mine.toml", "--lake", "lake"]);
    assert!(!folder.path("started").exists());
    assert!(!Path::new("started").exists());
}

#[test]
fn the_key_holds_the_command_and_the_bytes_of_its_files() {
    let folder = page();
    folder.done(&["run", "mine.toml", "--lake", "lake", "--allow-commands"]);
    let missing = |folder: &Folder| {
        let plan = folder.done(&["plan", "mine.toml", "--lake", "lake"]).stdout;
        plan.lines()
            .last()
            .unwrap()
            .split(' ')
            .next()
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    assert_eq!(missing(&folder), 0);
    folder.write("other.py", "");
    assert_eq!(missing(&folder), 0);
    folder.write(
        "interval.py",
        format!("# A comment.\n{}", example("interval.py")),
    );
    assert!(missing(&folder) > 0);
    folder.write("interval.py", example("interval.py"));
    assert_eq!(missing(&folder), 0);
    let moved = example("mine.toml").replace(
        r#"["python3", "interval.py"]"#,
        r#"["python3", "-u", "interval.py"]"#,
    );
    folder.write("mine.toml", moved);
    assert!(missing(&folder) > 0);
}

/// A filter that always says (0, 0) within [−9, 9]², with `before` the answer of step k and `answer` for it.
fn child(start: &str, step: &str) -> String {
    format!(
        r#"import json, os, sys, time
told = json.loads(sys.stdin.readline())["problem"]
{start}
for line in sys.stdin:
    now = json.loads(line)
    if "run" in now:
        run = now["run"]
        continue
    k = now["k"]
    said = {{"k": k, "center": [0.0, 0.0], "lower": [-9.0, -9.0], "upper": [9.0, 9.0]}}
    {step}
    print(json.dumps(said), flush=True)
"#
    )
}

#[test]
fn whatever_a_program_does_costs_its_own_runs_alone() {
    let cases: [(&str, String, &str, &str); 12] = [
        ("good", child("", "pass"), "ok", ""),
        ("slow", child("", "time.sleep(0.02)"), "ok", ""),
        (
            "killed",
            child("", "if k == 3: os.kill(os.getpid(), 9)"),
            "failed",
            "signal: 9",
        ),
        (
            "raises",
            child("", "if k == 3: raise ValueError('no such thing')"),
            "failed",
            "ValueError: no such thing",
        ),
        (
            "hanging",
            child("", "if k == 3: time.sleep(3600)"),
            "timeout",
            "no answer within 0.5 s",
        ),
        (
            "deaf",
            "import time\ntime.sleep(3600)\n".to_owned(),
            "timeout",
            "no answer within 1 s",
        ),
        (
            "lying",
            child("", "if k == 3: said['center'] = [0.0] * 3"),
            "failed",
            "a center of 3 numbers, not 2",
        ),
        (
            "nonsense",
            child("", "if k == 3: print('hello', flush=True)"),
            "failed",
            "hello",
        ),
        (
            "babbling",
            child("", "print(json.dumps(said), flush=True)"),
            "failed",
            "step",
        ),
        (
            "flooding",
            child("", "if k == 3: sys.stdout.write('x' * (20 << 20))"),
            "failed",
            "without an end of line",
        ),
        (
            "refusing",
            child(
                "",
                "if k == 3: said = {'k': k, 'status': 'refused', 'reason': 'enough'}",
            ),
            "refused",
            "enough",
        ),
        (
            "claiming",
            child("", "said.update(guaranteed=True, upper=[0.0, 9.0])"),
            "refuted",
            "claims a guarantee",
        ),
    ];
    let folder = Folder::new();
    let small = program::SMALL
        .replace("runs = 40", "runs = 5")
        .replace("steps = 60", "steps = 6")
        .replace("sets = [0, 4, 60]", "sets = [0, 4, 6]");
    let beside = |id: &str, command: &str, rest: &str| {
        let file = small.replace("id = \"small\"", &format!("id = \"beside-{id}\""));
        let estimator = format!(
            "\n[[estimator]]\nid = \"{id}\"\nkind = \"command\"\ncommand = [{command}]\n{rest}"
        );
        folder.write(&format!("{id}.toml"), file + &estimator);
    };
    folder.write("small.toml", &small);
    folder.done(&["run", "small.toml", "--lake", "lake"]);
    for (id, code, ..) in &cases {
        folder.write(&format!("{id}.py"), code);
        // Python itself takes its time to start on a busy machine.
        let timeout = match *id {
            "hanging" | "deaf" => 0.5,
            _ => 60.0,
        };
        let rest = format!("files = [\"{id}.py\"]\ntimeout = {timeout:?}\n");
        beside(id, &format!("\"python3\", \"{id}.py\""), &rest);
    }
    beside("absent", "\"./no-such-program\"", "");
    let files: Vec<String> = (cases.iter().map(|case| case.0).chain(["absent"]))
        .map(|id| format!("{id}.toml"))
        .collect();
    let mut arguments = vec!["run", "--lake", "lake", "--allow-commands"];
    arguments.extend(files.iter().map(String::as_str));
    let start = Instant::now();
    let outcome = folder.run(&arguments).ends_with(1);
    // Nobody waits for a program that sleeps an hour.
    assert!(start.elapsed().as_secs() < 600, "{:?}", start.elapsed());
    let said = |what: &str| {
        assert!(
            outcome.stderr.contains(what),
            "no {what:?}\n{}",
            outcome.stderr
        )
    };
    let of = |id: &str| rows::<Estimate>(&folder, "lake", &format!("beside-{id}"));
    for (id, _, status, cause) in &cases {
        let all = of(id);
        let all: Vec<&Estimate> = all.iter().filter(|e| &*e.estimator == *id).collect();
        for run in 0..5 {
            let last = all.iter().rev().find(|e| e.run == run).unwrap();
            assert_eq!(
                &*last.status, *status,
                "{id}, run {run}\n{}",
                outcome.stderr
            );
            let ended = last.center.is_none();
            assert_eq!(ended, !["ok", "refuted"].contains(status), "{id}");
        }
        if *status != "refused" {
            said(cause);
        }
    }
    let absent = of("absent");
    let absent = absent.iter().filter(|e| &*e.estimator == "absent");
    assert_eq!(absent.clone().count(), 10);
    assert!(absent.clone().all(|e| &*e.status == "failed" && e.k == 0));
    said("no-such-program");
    // After three runs that fail the program is not started again; one that says why it ends is.
    said("killed, run 4, k = 0: failed: not started again after 3 runs");
    let refusing = of("refusing");
    let refusing = refusing
        .iter()
        .filter(|e| &*e.estimator == "refusing" && e.k == 2);
    assert_eq!(refusing.count(), 10);
    let lost = rows::<Belief>(&folder, "lake", "beside-claiming")
        .into_iter()
        .filter(|b| &*b.estimator == "claiming" && b.contains_truth == Some(false));
    assert!(lost.count() > 0);
    // The others are what they are without all of this.
    let others = |all: Vec<Estimate>| -> Vec<String> {
        (all.iter())
            .filter(|e| ["kf", "box", "mixed"].contains(&&*e.estimator))
            .map(|e| format!("{e:?}"))
            .collect()
    };
    let alone = others(rows::<Estimate>(&folder, "lake", "small"));
    for (id, ..) in &cases {
        assert_eq!(others(of(id)), alone, "{id}");
    }
}

#[test]
fn a_program_tracks_a_recording() {
    let folder = page();
    folder.write("y.csv", "k,y1\n0,0.5\n1,\n2,0.52\n3,7\n4,0.5\n");
    folder.write("u.csv", "k,u1\n0,1\n1,1\n2,1\n3,1\n4,1\n");
    let arguments = [
        "track",
        "mine.toml",
        "--measurements",
        "y.csv",
        "--inputs",
        "u.csv",
        "--out",
        "out",
        "--allow-commands",
    ];
    folder.done(&arguments);
    let all: Vec<Estimate> = table::read(&folder.path("out/estimates.parquet")).unwrap();
    let last = all.iter().rev().find(|e| &*e.estimator == "mine").unwrap();
    assert_eq!((last.k, &*last.status), (3, "inconsistent"));
}

#[test]
fn a_wrong_command_is_shown_at_its_line() {
    let folder = page();
    let with = |old: &str, new: &str| {
        folder.write("bad.toml", example("mine.toml").replace(old, new));
        folder
            .run(&["run", "bad.toml", "--lake", "lake", "--allow-commands"])
            .ends_with(2)
    };
    let command = r#"["python3", "interval.py"]"#;
    with(command, "[]").says(&[
        "estimator.mine.command",
        "expected a program and its arguments",
    ]);
    with(command, "\"python3 interval.py\"").says(&["expected an array of strings"]);
    with(r#"files   = ["interval.py"]"#, r#"files = ["none.py"]"#).says(&["none.py"]);
    with(r#"files   = ["interval.py"]"#, "timeout = 0")
        .says(&["estimator.mine.timeout", "above 0"]);
    with("files   =", "file =").says(&["unknown key", "did you mean \"files\"?"]);
}

/// Printed, not asserted: a machine may be busy.
#[test]
fn the_overhead_of_a_step_is_measured() {
    let folder = Folder::new();
    folder.write("good.py", child("", "pass"));
    let file = program::SMALL
        .replace("runs = 40", "runs = 1")
        .replace("steps = 60", "steps = 5000");
    let file = file.replace("traces = true", "traces = false")
        + "\n[[estimator]]\nid = \"good\"\nkind = \"command\"\ncommand = [\"python3\", \"good.py\"]\n";
    folder.write("small.toml", file);
    folder.done(&["run", "small.toml", "--lake", "lake", "--allow-commands"]);
    let sql = "SELECT median_ns FROM timings WHERE estimator = 'good'";
    let found = folder
        .done(&["query", sql, "--lake", "lake", "--format", "csv"])
        .stdout;
    println!("median of a step of a Python program that does nothing, in ns: {found}");
    assert!(found.lines().count() == 2);
}
