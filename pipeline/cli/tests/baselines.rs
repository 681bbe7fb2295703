//! `ekf`, `ukf` and `particle` through the whole chain, and the metrics that say whether a filter believes its own
//! covariance.

mod program;

use program::Folder;
use std::collections::BTreeMap;

/// One file, two filters of each kind: one that is told the noise, one that is told a tenth of it. One seed in twenty is outside
/// of 95 % bounds by chance; this one is not.
fn experiment() -> String {
    let mut file = r#"schema = 1
paper = "mine"
id = "consistency"
seed = 12
runs = 1000
steps = 12

[system]
kind = "linear"
a = [[1.0, 0.1], [-0.1, 0.9]]
c = [[1.0, 0.0]]

[prior]
mean = [0.0, 0.0]
covariance = [[1.0, 0.0], [0.0, 1.0]]

[noise]
w = { mean = [0.0, 0.0], covariance = [[0.01, 0.0], [0.0, 0.02]] }
v = { mean = [0.0], covariance = [[0.04]] }

[truth]
x0 = "prior"
w = { law = "gaussian" }
v = { law = "gaussian" }

[[metric]]
name = "nees"
at = [12]

[[metric]]
name = "nis"
from = 1

[[metric]]
name = "coverage"
level = 0.9
at = [12]

[[metric]]
name = "crps"
at = [12]

"#
    .to_owned();
    for kind in ["kalman", "ekf", "ukf"] {
        for (id, w, v) in [
            ("told", "[[0.01, 0.0], [0.0, 0.02]]", "[[0.04]]"),
            ("tenth", "[[0.001, 0.0], [0.0, 0.002]]", "[[0.004]]"),
        ] {
            file += &format!(
                "[[estimator]]\nid = \"{kind}-{id}\"\nkind = \"{kind}\"\n[estimator.noise]\n\
                 w = {{ mean = [0.0, 0.0], covariance = {w} }}\nv = {{ mean = [0.0], covariance = {v} }}\n\n"
            );
        }
    }
    file
}

#[test]
fn a_consistent_filter_is_inside_its_bounds_and_one_that_is_told_a_tenth_is_not() {
    let folder = Folder::new();
    folder.write("consistency.toml", experiment());
    folder.done(&["run", "consistency.toml", "--lake", "lake"]);
    let sql = "SELECT estimator, metric, component, mean FROM scores";
    let csv = folder
        .done(&["query", sql, "--lake", "lake", "--format", "csv"])
        .stdout;
    let mut means: BTreeMap<String, f64> = BTreeMap::new();
    for line in csv.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        means.insert(cells[..3].join(" "), cells[3].parse().unwrap());
    }
    let mean = |estimator: &str, metric: &str| means[&format!("{estimator} {metric}")];
    for kind in ["kalman", "ekf", "ukf"] {
        let (told, tenth) = (format!("{kind}-told"), format!("{kind}-tenth"));
        for (metric, n) in [("nees", 2.0), ("nis", 1.0)] {
            let bounds = |id: &str| {
                let side = |side: &str| mean(id, &format!("{metric}_{side} "));
                (side("lo"), side("hi"))
            };
            let (lo, hi) = bounds(&told);
            let value = mean(&told, &format!("{metric} "));
            assert!(
                lo < n && n < hi && hi - lo < 0.3,
                "{kind} {metric}: {lo} {hi}"
            );
            assert!(
                lo < value && value < hi,
                "{kind}: {metric} {value} not in {lo} {hi}"
            );
            assert_eq!(bounds(&tenth), (lo, hi));
            let value = mean(&tenth, &format!("{metric} "));
            assert!(value > hi, "{kind}: {metric} {value} in {lo} {hi}");
        }
        // A share of 0.9 over 1000 runs has the standard error 0.0095.
        for component in ["x1", "x2", ""] {
            let share = mean(&told, &format!("coverage {component}"));
            assert!(
                (share - 0.9).abs() < 4.0 * 0.0095,
                "{kind} {component}: {share}"
            );
            assert!(mean(&tenth, &format!("coverage {component}")) < 0.8);
        }
        // The score of the right density is the better one, and near σ/√π, its mean where it is right.
        let (right, wrong) = (mean(&told, "crps x1"), mean(&tenth, "crps x1"));
        assert!(right < wrong, "{kind}: {right} {wrong}");
    }
    let rank = folder
        .done(&[
            "rank", "--metric", "crps", "--lake", "lake", "--format", "json",
        ])
        .stdout;
    let pairs: serde_json::Value = serde_json::from_str(&rank).unwrap();
    let verdict = |a: &str, b: &str| {
        let mut pairs = pairs.as_array().unwrap().iter();
        let pair = pairs.find(|p| p["estimator"] == a && p["than"] == b && p["component"] == "x1");
        pair.unwrap()["verdict"].as_str().unwrap().to_owned()
    };
    assert_eq!(verdict("kalman-told", "kalman-tenth"), "less");
    // One filter in two forms; and what `kalman` reports is a prediction.
    assert_eq!(verdict("ekf-told", "ukf-told"), "no difference");
    assert_eq!(verdict("kalman-told", "ekf-told"), "more");
}

#[test]
fn every_filter_takes_a_system_of_equations_with_a_nonlinear_measurement() {
    let folder = Folder::new();
    let file = r#"schema = 1
paper = "mine"
id = "bearing"
seed = 3
runs = 30
steps = 40

[system]
kind = "equations"
x = { px = "m", py = "m", theta = "rad" }
u = { turn = "rad/s" }
w = { wx = "m", wy = "m", wt = "rad" }
y = { range = "m", bearing = "rad" }
v = { vr = "m", vb = "rad" }
next = { px = "px + 0.1*cos(theta) + wx", py = "py + 0.1*sin(theta) + wy", theta = "theta + 0.1*turn + wt" }
output = { range = "sqrt((px - 2)^2 + (py - 3)^2) + vr", bearing = "atan2(3 - py, 2 - px) - theta + vb" }
period = 0.1

[prior]
box = [[-0.3, 0.3], [-0.3, 0.3], [-0.2, 0.2]]

[noise]
w = { box = [[-0.01, 0.01], [-0.01, 0.01], [-0.01, 0.01]] }
v = { box = [[-0.05, 0.05], [-0.02, 0.02]] }

[inputs]
constant = [0.5]

[[estimator]]
id = "ekf"
kind = "ekf"
wrap = true

[[estimator]]
id = "ukf"
kind = "ukf"
wrap = true

[[estimator]]
id = "particle"
kind = "particle"
particles = 500
wrap = true

[[metric]]
name = "rmse"
from = 20

[[metric]]
name = "nis"
"#;
    folder.write("bearing.toml", file);
    let run = |lake: &str, jobs: &str| {
        folder.done(&["run", "bearing.toml", "--lake", lake, "--jobs", jobs]);
        folder.vouched(lake)
    };
    program::assert_same("one thread and three", &run("one", "1"), &run("three", "3"));
    let sql = "SELECT estimator, component, mean FROM scores WHERE metric = 'rmse'";
    let csv = folder
        .done(&["query", sql, "--lake", "one", "--format", "csv"])
        .stdout;
    assert_eq!(csv.lines().count(), 10, "{csv}");
    for line in csv.lines().skip(1) {
        let error: f64 = line.rsplit(',').next().unwrap().parse().unwrap();
        // What range and bearing leave of noise of 3 and 1 cm, after twenty steps.
        assert!(error < 0.1, "{line}");
    }
}
