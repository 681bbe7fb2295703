//! What was understood of an experiment, before anything runs: for `zonobench check`.

use crate::experiment::Experiment;
use crate::stage::estimate;
use serde_json::{Value, json};
use zonobench_estimation::estimator::{Estimator as _, KINDS, Phase};
use zonobench_estimation::linearised::linearised;
use zonobench_estimation::system::{System as _, Variable};
use zonobench_estimation::systems::equations::Dependence;
use zonobench_estimation::{AnyEstimator, AnySystem, EstimatorSettings, Problem};
use zonobench_sets::Matrix;

/// What was understood of `experiment`, as text.
pub fn text(experiment: &Experiment) -> String {
    let problem = &experiment.problem;
    let mut out = format!("{}\n\n", experiment.name());
    out += &system(problem);
    out += &at_the_center(problem);
    out += &estimators(experiment);
    out += &size(experiment);
    out
}

/// Dimensions, names, units, and what is linear in what.
fn system(problem: &Problem) -> String {
    let variables = problem.system.variables();
    let mut out = format!("system: {}", problem.system.kind());
    if let Some(period) = problem.system.period() {
        out += &format!(", every {period} s");
    }
    out += "\n";
    for (role, what, list) in [
        ("x", "state", &variables.x),
        ("u", "input", &variables.u),
        ("w", "process noise", &variables.w),
        ("y", "measurement", &variables.y),
        ("v", "measurement noise", &variables.v),
    ] {
        let names: Vec<String> = list.iter().map(named).collect();
        let names = match names.is_empty() {
            true => "none".to_owned(),
            false => names.join(", "),
        };
        out += &format!("  {role}  {:2}  {what}: {names}\n", list.len());
    }
    out + &dependence(&problem.system) + "\n"
}

fn named(variable: &Variable) -> String {
    match &*variable.unit {
        "1" => variable.name.clone(),
        unit => format!("{} in {unit}", variable.name),
    }
}

fn dependence(system: &AnySystem) -> String {
    let [next, output] = match system {
        AnySystem::Equations(equations) => {
            let (f, h) = equations.operations();
            let [next, output] = equations.dependence();
            let line = |what: &str, noise: &str, of: [Dependence; 3], operations: usize| {
                let names = ["x", "u", noise];
                let words = names.iter().zip(of).map(|(name, of)| match of {
                    Dependence::No => format!("without {name}"),
                    Dependence::Linear => format!("linear in {name}"),
                    Dependence::Nonlinear => format!("not linear in {name}"),
                });
                let words: Vec<String> = words.collect();
                format!("  {what}: {}; {operations} operations\n", words.join(", "))
            };
            [line("next", "w", next, f), line("output", "v", output, h)]
        }
        other => {
            let words = match other.linear_parts() {
                Some(_) => "linear in x, u, w and v",
                None => "not linear, or with parameters that vary",
            };
            [format!("  {words}\n"), String::new()]
        }
    };
    let mut out = next + &output;
    let whole = match (system, system.linear_parts()) {
        (AnySystem::Equations(_), Some(_)) => "  as a whole: a linear system, and treated as one\n",
        _ => "",
    };
    out += whole;
    out
}

/// The Jacobians at the center of the prior, without noise, at k = 0 and u = 0.
fn at_the_center(problem: &Problem) -> String {
    let variables = problem.system.variables();
    let middle = |hull: zonobench_sets::IntervalVector, n: usize| {
        let mut middle: Vec<f64> = hull.mid().to_vec();
        middle.resize(n, 0.0);
        middle
    };
    let x = middle(problem.prior.box_hull(), variables.x.len());
    let u = vec![0.0; variables.u.len()];
    let w = middle(problem.w.box_hull(), variables.w.len());
    let v = middle(problem.v.box_hull(), variables.v.len());
    let at = linearised(&problem.system, 0, &x, &u, &w, &v);
    let names =
        |list: &[Variable]| -> Vec<String> { list.iter().map(|v| v.name.clone()).collect() };
    let [xs, ws, ys, vs] =
        [&variables.x, &variables.w, &variables.y, &variables.v].map(|l| names(l));
    let point = |names: &[String], values: &[f64]| {
        let pairs = names.iter().zip(values);
        let pairs: Vec<String> = pairs
            .map(|(n, x)| format!("{n} = {}", number(*x)))
            .collect();
        pairs.join(", ")
    };
    let mut out = format!("at the center of the prior, {}", point(&xs, &x));
    if !u.is_empty() {
        out += ", with u = 0";
    }
    out += "\n";
    let primed: Vec<String> = xs.iter().map(|name| format!("{name}+")).collect();
    out += &format!("  next: {}\n", point(&primed, &at.next));
    if !ys.is_empty() {
        out += &format!("  measured: {}\n", point(&ys, &at.output));
    }
    for (what, rows, columns, matrix) in [
        ("next by x", &primed, &xs, &at.next_by_x),
        ("next by w", &primed, &ws, &at.next_by_w),
        ("output by x", &ys, &xs, &at.output_by_x),
        ("output by v", &ys, &vs, &at.output_by_v),
    ] {
        out += &table(what, rows, columns, matrix);
    }
    let all = [
        &at.next_by_x,
        &at.next_by_w,
        &at.output_by_x,
        &at.output_by_v,
    ];
    let is_finite = |m: &&Matrix| m.as_slice().iter().all(|x| x.is_finite());
    if !all.iter().all(is_finite) {
        out += "  a derivative there is not finite: the equations have a kink or an end at this point\n";
    }
    out + "\n"
}

/// More columns than this are not shown.
const MOST_COLUMNS: usize = 12;

fn table(what: &str, rows: &[String], columns: &[String], matrix: &Matrix) -> String {
    if rows.is_empty() || columns.is_empty() {
        return String::new();
    }
    if columns.len() > MOST_COLUMNS {
        return format!("  {what}: {} x {}\n", rows.len(), columns.len());
    }
    let cell = |i: usize, j: usize| number(matrix[(i, j)]);
    let width = |j: usize| {
        let cells = (0..rows.len()).map(|i| cell(i, j).len());
        cells.max().unwrap_or(0).max(columns[j].len())
    };
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    let label = rows.iter().map(String::len).max().unwrap_or(0);
    let mut out = format!("  {what}\n    {:label$}", "");
    for (name, width) in columns.iter().zip(&widths) {
        out += &format!("  {name:>width$}");
    }
    out += "\n";
    for (i, row) in rows.iter().enumerate() {
        out += &format!("    {row:label$}");
        for (j, width) in widths.iter().enumerate() {
            out += &format!("  {:>width$}", cell(i, j));
        }
        out += "\n";
    }
    out
}

/// A number in four digits.
fn number(x: f64) -> String {
    let size = x.abs();
    match size == 0.0 || (1e-3..1e5).contains(&size) || !size.is_finite() {
        true => format!("{}", (x * 1e4).round() / 1e4),
        false => format!("{x:.3e}"),
    }
}

/// Settings with which a kind is tried where the file has none: what it needs, and sizes that fit n states.
fn settings(kind: &str, n: usize) -> Value {
    match kind {
        "zmv" | "zfo" | "zsmf" => json!({ "kind": kind, "generators": 6 * n }),
        "czmv" | "czfo" => json!({ "kind": kind, "generators": 6 * n, "constraints": n }),
        "inzsmf" => json!({ "kind": kind, "generators": 6 * n }),
        "ezgkf" | "ezgkf-m" | "ezgkp" => {
            json!({ "kind": kind, "phi": 6 * n, "eta": 0.5, "alpha": 0.01 })
        }
        _ => json!({ "kind": kind }),
    }
}

/// Which kinds of estimators apply, which of them the file has, and why the others do not.
fn estimators(experiment: &Experiment) -> String {
    let n = experiment.problem.system.variables().x.len();
    let (mut applies, mut others) = (String::new(), String::new());
    for info in KINDS {
        let own = experiment.estimators.iter();
        let own: Vec<&str> = own
            .filter(|spec| spec.settings.kind() == info.kind)
            .map(|spec| spec.id.as_str())
            .collect();
        let found = experiment.estimators.iter().find_map(|spec| {
            let settings = spec.settings.built_in()?;
            (settings.kind() == info.kind).then_some((settings, &spec.problem))
        });
        let made = match found {
            Some((settings, problem)) => {
                AnyEstimator::new(settings, problem).map_err(|e| e.to_string())
            }
            None => serde_json::from_value::<EstimatorSettings>(settings(info.kind, n))
                .map_err(|e| e.to_string())
                .and_then(|settings| {
                    AnyEstimator::new(&settings, &experiment.problem).map_err(|e| e.to_string())
                }),
        };
        match made {
            Ok(estimator) => {
                applies += &format!("  {:14}", info.kind);
                applies += match estimator.guaranteed() {
                    true => "guaranteed",
                    false => "not guaranteed",
                };
                if !own.is_empty() {
                    applies += &format!("; in the file as {}", own.join(", "));
                }
                if let Some(warning) = estimator.warning() {
                    applies += &format!("; {warning}");
                }
                applies += "\n";
            }
            Err(why) => {
                let system = experiment.problem.system.kind();
                let known = [
                    format!("{}: ", info.kind),
                    format!("{} does not support {system}: ", info.kind),
                ];
                let rest = known
                    .iter()
                    .find_map(|prefix| why.strip_prefix(prefix.as_str()));
                let why = rest.unwrap_or(&why);
                others += &format!("  {:14}{why}\n", info.kind);
            }
        }
    }
    for spec in &experiment.estimators {
        if spec.settings.built_in().is_none() {
            let (kind, id) = (spec.settings.kind(), &spec.id);
            applies += &format!(
                "  {kind:14}not guaranteed; in the file as {id}; runs with --allow-commands\n"
            );
        }
    }
    let mut out = format!("estimators that apply\n{applies}");
    if !others.is_empty() {
        out += &format!("estimators that do not\n{others}");
    }
    out + "\n"
}

/// Rows that go to the lake, and the memory that the run takes.
fn size(experiment: &Experiment) -> String {
    let variables = experiment.problem.system.variables();
    let (n, m, p) = (variables.x.len(), variables.y.len(), variables.u.len());
    let (runs, steps) = (experiment.runs, experiment.steps + 1);
    let times = |a: usize, b: usize| a.saturating_mul(b);
    let all = times(runs, steps);
    let per_step: usize = experiment
        .estimators
        .iter()
        .map(|spec| {
            match spec
                .settings
                .built_in()
                .map(|s| AnyEstimator::new(s, &spec.problem))
            {
                None => 1,
                Some(Ok(e))
                    if experiment.output.updated_only && e.reported_phase() == Phase::Updated =>
                {
                    1
                }
                _ => 2,
            }
        })
        .sum();
    let rows = [
        ("truth", times(all, n)),
        ("measurements", times(all, m)),
        ("inputs", times(all, p)),
        ("estimates", times(all, times(n, per_step))),
        ("beliefs", times(all, per_step)),
    ];
    let total = rows
        .iter()
        .fold(0_usize, |sum, (_, r)| sum.saturating_add(*r));
    let words: Vec<String> = rows
        .iter()
        .map(|(name, r)| format!("{name} {}", grouped(*r)))
        .collect();
    // A number and its place in a list; the truth has its rounding beside it, and a measurement may be missing.
    let held = times(all, 32 * n + 16 * m + 8 * p + 72).saturating_add(times(
        estimate::most_held(experiment.steps).min(all),
        120 * (n + 2) * 2,
    ));
    let mut out = format!(
        "{} runs of {} steps: at most {} rows in the lake ({})\n",
        grouped(runs),
        grouped(experiment.steps),
        grouped(total),
        words.join(", ")
    );
    out += &format!(
        "about {} MB of memory for the data, beside the sets of the estimators\n",
        grouped(held.div_ceil(1_000_000))
    );
    out
}

/// 1234567 as 1 234 567.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_and_short() {
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!((grouped(0), grouped(999)), ("0".into(), "999".into()));
        assert_eq!(number(0.123456), "0.1235");
        assert_eq!(number(-9.81), "-9.81");
        assert_eq!(number(1.5e-7), "1.500e-7");
        assert_eq!(number(f64::NAN), "NaN");
    }
}
