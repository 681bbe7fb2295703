//! The law of units for metrics: a diagonal change of units by powers of two changes no dimensionless value, bit for bit,
//! and every other by its own unit; but for those that compare components by their definition.

use crate::experiment::{Experiment, METRICS};
use crate::stage::estimate::{Job, describe, make};
use crate::stage::reduce::{Subject, Tables, values};
use crate::stage::{Measured, Recordings};
use std::collections::BTreeSet;
use zonobench_estimation::simulate;
use zonobench_lake::rows::Metric;

/// A list of numbers as TOML, with every bit.
fn list(numbers: impl IntoIterator<Item = f64>) -> String {
    let texts: Vec<String> = numbers.into_iter().map(|x| format!("{x:e}")).collect();
    format!("[{}]", texts.join(", "))
}

fn matrix(rows: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", rows.into_iter().collect::<Vec<_>>().join(", "))
}

fn sides(radii: &[f64], units: &[f64]) -> String {
    let sides = radii.iter().zip(units);
    matrix(sides.map(|(r, u)| list([-r / u, r / u])))
}

fn covariance(p: [[f64; 2]; 2], units: &[f64]) -> String {
    matrix((0..2).map(|i| list((0..2).map(|j| p[i][j] / units[i] / units[j]))))
}

/// diag(rows)⁻¹ M diag(cols).
fn moved(m: [[f64; 2]; 2], rows: &[f64], cols: &[f64]) -> String {
    matrix((0..2).map(|i| list((0..2).map(|j| m[i][j] * cols[j] / rows[i]))))
}

/// Two correlated states of which both are measured, in these units of x and y.
fn linear(x: &[f64], y: &[f64]) -> String {
    format!(
        "schema = 1\npaper = \"units\"\nid = \"linear\"\nseed = 3\nruns = 3\nsteps = 8\n\
         [system]\nkind = \"linear\"\na = {}\nc = {}\n\
         [prior]\nbox = {}\ncovariance = {}\n\
         [noise]\nw = {{ box = {}, covariance = {} }}\nv = {{ box = {}, covariance = {} }}\n\
         [truth]\nx0 = \"prior\"\nw = {{ law = \"vertices\" }}\nv = {{ law = \"uniform\" }}\n\
         {ESTIMATORS}{METRICS_OF_LINEAR}",
        moved([[0.9, 0.4], [-0.3, 0.8]], x, x),
        moved([[1.0, 0.0], [0.5, 1.0]], y, x),
        sides(&[2.0, 1.4], x),
        covariance([[1.0, 0.2], [0.2, 0.5]], x),
        sides(&[0.1, 0.07], x),
        covariance([[0.01, 0.003], [0.003, 0.005]], x),
        sides(&[0.2, 0.15], y),
        covariance([[0.02, 0.0], [0.0, 0.01]], y),
    )
}

const ESTIMATORS: &str = r#"
[[estimator]]
id = "box"
kind = "box-state-est"
scale = "prior"
[[estimator]]
id = "kf"
kind = "kalman"
[[estimator]]
id = "mixed"
kind = "ezgkf"
phi = 12
eta = 0.5
alpha = 0.01
scale = "prior"
[[estimator]]
id = "cz"
kind = "czmv"
generators = 12
constraints = 3
scale = "prior"
"#;

const METRICS_OF_LINEAR: &str = r#"
[[metric]]
name = "rmse"
[[metric]]
name = "rmse"
id = "rmse_over"
over = "kf"
[[metric]]
name = "rmse_wrapped"
[[metric]]
name = "rmse_norm"
components = ["x1", "x2"]
[[metric]]
name = "overshoot"
[[metric]]
name = "radius"
[[metric]]
name = "r_box"
[[metric]]
name = "width"
[[metric]]
name = "bound_ratio"
bound = "corrected"
[[metric]]
name = "volume"
[[metric]]
name = "area"
phase = "predicted"
[[metric]]
name = "box_area"
components = ["x1", "x2"]
[[metric]]
name = "contains"
[[metric]]
name = "outside"
[[metric]]
name = "inconsistent"
[[metric]]
name = "refused"
[[metric]]
name = "better"
than = "kf"
[[metric]]
name = "ellipsoid_contains"
level = 0.9
[[metric]]
name = "ellipsoid_inside"
level = 0.9
within = "box"
[[metric]]
name = "center_inside"
within = "cz"
[[metric]]
name = "boundary"
level = 0.25
[[metric]]
name = "nees"
[[metric]]
name = "nis"
[[metric]]
name = "coverage"
[[metric]]
name = "crps"
"#;

/// A vehicle whose unit of length is `s` metres.
fn vehicle(s: f64) -> String {
    let units = [1.0, s, s];
    format!(
        "schema = 1\npaper = \"units\"\nid = \"vehicle\"\nseed = 4\nruns = 2\nsteps = 8\n\
         [system]\nkind = \"vehicle-se2\"\ndt = 0.1\n\
         [prior]\nbox = {}\n\
         [noise]\nw = {{ box = {} }}\nv = {{ box = {} }}\n\
         [truth]\nx0 = \"prior\"\nw = {{ law = \"uniform\" }}\nv = {{ law = \"uniform\" }}\n\
         [inputs]\nconstant = {}\n\
         [[estimator]]\nid = \"group\"\nkind = \"inzsmf\"\ngenerators = 8\nscale = \"prior\"\n\
         [[metric]]\nname = \"body_box_area\"\n[[metric]]\nname = \"projected_area\"\n\
         [[metric]]\nname = \"rmse_wrapped\"\n",
        sides(&[0.1, 1.0, 0.75], &units),
        sides(&[0.01, 0.05, 0.03], &units),
        sides(&[0.5, 0.4], &units[1..]),
        list([0.2, 5.0 / s]),
    )
}

/// All metrics of all estimators and runs of the experiment, simulated in its own units.
fn metrics(text: &str) -> Vec<Metric> {
    let experiment = Experiment::parse("units.toml", text)
        .unwrap_or_else(|fault| panic!("{fault}"))
        .remove(0);
    let (mut u, mut y, mut x) = (Vec::new(), Vec::new(), Vec::new());
    for run in 0..experiment.runs {
        let t = simulate(
            &experiment.problem.system,
            &experiment.truth,
            &experiment.inputs,
            experiment.seed,
            run as u64,
            experiment.steps,
        )
        .unwrap();
        let measured = |y: Vec<f64>| y.into_iter().map(Some).collect();
        u.push(t.u);
        y.push(t.y.into_iter().map(measured).collect());
        let known =
            |(x, r): (Vec<f64>, Vec<f64>)| x.into_iter().zip(r.into_iter().map(Some)).collect();
        x.push(t.x.into_iter().zip(t.rounding).map(known).collect());
    }
    let recordings = Recordings {
        u,
        y: Measured::Simulated(y),
        x,
    };
    let all = 0..experiment.estimators.len();
    let dir = tempfile::tempdir().unwrap();
    let tables: Vec<Tables> = all
        .clone()
        .map(|index| {
            let folder = dir.path().join(index.to_string());
            std::fs::create_dir(&folder).unwrap();
            let job = Job::of(&experiment, index);
            let endings = make(&job, &recordings, &folder, &|_| {}).unwrap();
            assert!(endings.is_empty(), "{endings:?}");
            Tables {
                estimates: folder.join("estimates.parquet"),
                beliefs: folder.join("beliefs.parquet"),
                extras: folder.join("extras.parquet"),
            }
        })
        .collect();
    let subject = Subject {
        name: experiment.name(),
        problem: &experiment.problem,
        estimators: &experiment.estimators,
        infos: all
            .map(|index| describe(&Job::of(&experiment, index)).unwrap())
            .collect(),
        metrics: experiment.metrics.iter().collect(),
        steps: experiment.steps,
    };
    values(&subject, &recordings, &tables).unwrap()
}

/// The unit of a metric's value, a power of two; none where it compares components, or adds them, by its definition.
fn unit(metric: &Metric, units: &[f64]) -> Option<f64> {
    let own = |name: &str| match name {
        "x1" => units[units.len() - 2],
        "x2" => units[units.len() - 1],
        _ => units[0],
    };
    let name = match &*metric.metric {
        "rmse_over" => return Some(1.0),
        // The bounds that stand beside a metric are in its unit.
        name => name.trim_end_matches("_lo").trim_end_matches("_hi"),
    };
    let info = METRICS.iter().find(|info| info.name == name).unwrap();
    match (name, &metric.component) {
        ("radius" | "r_box" | "rmse_norm" | "bound_ratio", _) | ("width", None) => None,
        (_, Some(component)) if info.unit == "state" => Some(own(component)),
        _ if matches!(info.unit, "state-product" | "m2") => Some(own("x1") * own("x2")),
        _ => Some(1.0),
    }
}

/// The metrics that were the same in these units; panics where one is not.
fn same(here: &[Metric], there: &[Metric], units: &[f64]) -> BTreeSet<String> {
    assert_eq!(here.len(), there.len());
    let mut seen = BTreeSet::new();
    for (a, b) in here.iter().zip(there) {
        assert_eq!(
            (&a.estimator, a.run, &a.metric, &a.component),
            (&b.estimator, b.run, &b.metric, &b.component)
        );
        if let Some(unit) = unit(a, units) {
            assert_eq!(a.value.map(|x| x / unit), b.value, "{a:?} {b:?} {units:?}");
            seen.insert(a.metric.to_string());
        }
    }
    seen
}

#[test]
fn no_metric_depends_on_the_units_of_its_experiment() {
    let power = |e: i32| f64::from_bits(((1023 + e) as u64) << 52);
    let here = metrics(&linear(&[1.0; 2], &[1.0; 2]));
    let mut seen = BTreeSet::new();
    for [a, b, c, d] in [[10, -10, 10, 10], [40, -40, -40, 40], [-17, 23, 31, -11]] {
        let (x, y) = ([power(a), power(b)], [power(c), power(d)]);
        seen.extend(same(&here, &metrics(&linear(&x, &y)), &x));
    }
    let here = metrics(&vehicle(1.0));
    for s in [-40, -10, 10, 40].map(power) {
        seen.extend(same(&here, &metrics(&vehicle(s)), &[1.0, s, s]));
    }
    let compared = ["radius", "r_box", "rmse_norm", "bound_ratio"];
    for info in METRICS {
        assert!(
            seen.contains(info.name) != compared.contains(&info.name),
            "{}: of each metric it is known whether it depends on units",
            info.name
        );
    }
}

/// A guard that cannot fail would be none.
#[test]
fn the_metrics_that_compare_components_depend_on_units() {
    let here = metrics(&linear(&[1.0; 2], &[1.0; 2]));
    let there = metrics(&linear(&[1024.0, 1.0 / 1024.0], &[1.0; 2]));
    for name in ["radius", "r_box", "rmse_norm", "width"] {
        let moved = here.iter().zip(&there).any(|(a, b)| {
            &*a.metric == name && a.component.is_none() && a.value.is_some() && a.value != b.value
        });
        assert!(moved, "{name}");
    }
}
