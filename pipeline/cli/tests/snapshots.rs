//! Our accepted numbers: every table of the published experiments, rounded, as reviewed snapshots.
//!
//! A changed number shows as a diff under `snapshots/`; `just review` accepts it. Precisions are declared
//! here: six significant digits for scores, which are pinned by counter-based random numbers and
//! fixed-order sums, and four for the papers' cells. The lake is the workspace's own `lake/` where there is
//! one (the program brings it up to date, which costs nothing if it is), else one below the target folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use zonobench_lake::digits::four_digits;
use zonobench_lake::lake::{paper_table_path, table_path};
use zonobench_lake::rows::{
    Belief, Claim, Comparison, Complexity, Estimate, EstimatorInfo, Metric, Score, Set, Truth,
};
use zonobench_lake::table::{self, Name};

fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors()
        .nth(2)
        .expect("the crate lies in the workspace")
        .to_owned()
}

fn lake() -> PathBuf {
    let own = workspace().join("lake");
    let lake = if own.is_dir() {
        own
    } else {
        Path::new(env!("CARGO_TARGET_TMPDIR")).join("lake")
    };
    let reports = tempfile::tempdir().expect("a temporary folder");
    let status = Command::new(env!("CARGO_BIN_EXE_zonobench"))
        .args(["reproduce-all", "--quiet", "--lake"])
        .arg(&lake)
        .arg("--reports")
        .arg(reports.path())
        .status()
        .expect("the program starts");
    assert!(status.success(), "reproduce-all ended with {status}");
    lake
}

/// Six significant digits.
fn six(x: f64) -> String {
    if x == 0.0 {
        "0".to_owned()
    } else {
        format!("{x:.5e}")
    }
}

fn optional(x: Option<f64>, show: fn(f64) -> String) -> String {
    x.map_or_else(|| "-".to_owned(), show)
}

fn name(x: &Option<Name>) -> &str {
    x.as_deref().unwrap_or("-")
}

fn comparison(lake: &Path, paper: &str) -> String {
    let path = lake.join(paper_table_path("comparison", paper));
    let header = "table | row | column | reading | published | reproduced | interval | verdict\n";
    let mut out = header.to_owned();
    for c in table::read::<Comparison>(&path).expect("a comparison") {
        let interval = match (c.interval_lo, c.interval_hi) {
            (Some(lo), Some(hi)) => format!("{}..{}", four_digits(lo), four_digits(hi)),
            _ => "-".to_owned(),
        };
        let reproduced = optional(c.reproduced, four_digits);
        out += &format!("{} | {} | {} | {} | ", c.table, c.row, c.column, c.reading);
        out += &format!(
            "{} | {reproduced} | {interval} | {}\n",
            c.published, c.verdict
        );
    }
    out
}

fn claims(lake: &Path, paper: &str) -> String {
    let path = lake.join(paper_table_path("claims", paper));
    let mut out = "claim | verdict | lost of trials | counterexample | consequence\n".to_owned();
    for c in table::read::<Claim>(&path).expect("claims") {
        let (claim, verdict) = (c.claim, c.verdict);
        out += &format!("{claim} | {verdict} | {} of {} | ", c.lost, c.trials);
        out += &format!("{} | {}\n", c.counterexample, c.consequence);
    }
    out
}

/// Counts in full, degrees to two digits; None for a paper that claims no cost.
fn complexity(lake: &Path, paper: &str) -> Option<String> {
    let path = lake.join(paper_table_path("complexity", paper));
    if !path.exists() {
        return None;
    }
    let mut out = "claim | swept | size | counted | formula | degree | verdict\n".to_owned();
    for r in table::read::<Complexity>(&path).expect("counts") {
        let size = r.size.map_or_else(|| "-".to_owned(), |n| n.to_string());
        let counted = optional(r.counted, |x| format!("{x}"));
        let degree = optional(r.fitted_degree, |x| format!("{x:.2}"));
        out += &format!(
            "{} | {} | {size} | {counted} | {} | {degree} | {}\n",
            r.claim,
            name(&r.sweep_variable),
            optional(r.formula, six),
            r.verdict
        );
    }
    Some(out)
}

/// Number, least, greatest and mean of the finite values of a column.
#[derive(Default)]
struct Summary {
    n: usize,
    sum: f64,
    lo: Option<f64>,
    hi: Option<f64>,
}

impl Summary {
    fn add(&mut self, x: Option<f64>) {
        let Some(x) = x.filter(|x| x.is_finite()) else {
            return;
        };
        self.n += 1;
        self.sum += x;
        self.lo = Some(self.lo.map_or(x, |lo| lo.min(x)));
        self.hi = Some(self.hi.map_or(x, |hi| hi.max(x)));
    }

    fn text(&self) -> String {
        let mean = (self.n > 0).then(|| self.sum / self.n as f64);
        let (lo, hi, mean) = (
            optional(self.lo, six),
            optional(self.hi, six),
            optional(mean, six),
        );
        format!("{} | {lo} | {hi} | {mean}", self.n)
    }
}

fn experiment(lake: &Path, paper: &str, id: &str) -> String {
    let path = |table: &str| lake.join(table_path(table, paper, id));
    let mut out = String::from("# estimators\n");
    for e in table::read::<EstimatorInfo>(&path("estimators")).expect("estimators") {
        out += &format!(
            "{} | {} | guaranteed {} | ",
            e.estimator, e.kind, e.guaranteed
        );
        out += &format!(
            "reads {} | reports {} | {}\n",
            e.reads, e.reported_phase, e.settings
        );
    }
    out += "\n# scores: estimator | metric | component | over | runs | mean | sd\n";
    for s in table::read::<Score>(&path("scores")).expect("scores") {
        let (component, over) = (name(&s.component), name(&s.over));
        // A spread at rounding level is none.
        let spread = s.sd.filter(|sd| *sd > 1e-12 * s.mean.unwrap_or(0.0).abs());
        let (mean, sd) = (optional(s.mean, six), optional(spread, six));
        out += &format!(
            "{} | {} | {component} | {over} | {} | {mean} | {sd}\n",
            s.estimator, s.metric, s.n_runs
        );
    }
    out += "\n# the large tables: subject | values | least | greatest | mean\n";
    let mut columns: BTreeMap<String, Summary> = BTreeMap::new();
    let mut add = |subject: String, x: Option<f64>| columns.entry(subject).or_default().add(x);
    table::for_each::<Truth>(&path("truth"), |t| {
        add(format!("truth {}", t.component), Some(t.value))
    })
    .expect("truth");
    table::for_each::<Estimate>(&path("estimates"), |e| {
        let subject = format!("estimates {} {} {}", e.estimator, e.phase, e.component);
        add(format!("{subject} center"), e.center);
        add(
            format!("{subject} width"),
            e.upper.zip(e.lower).map(|(u, l)| u - l),
        );
    })
    .expect("estimates");
    table::for_each::<Belief>(&path("beliefs"), |b| {
        let subject = format!("beliefs {} {}", b.estimator, b.phase);
        add(
            format!("{subject} n_generators"),
            b.n_generators.map(|n| n as f64),
        );
        add(
            format!("{subject} n_constraints"),
            b.n_constraints.map(|n| n as f64),
        );
        add(format!("{subject} pivots"), Some(b.pivots as f64));
        add(
            format!("{subject} contains_truth"),
            b.contains_truth.map(|c| f64::from(u8::from(c))),
        );
        let n = b.covariance.as_ref().map_or(0, |p| p.len().isqrt());
        add(
            format!("{subject} trace of P"),
            b.covariance.map(|p| p.iter().step_by(n + 1).sum()),
        );
    })
    .expect("beliefs");
    table::for_each::<Set>(&path("sets"), |s| {
        let subject = format!("sets {} {} generators", s.estimator, s.phase);
        add(subject, s.generators.map(|g| g.len() as f64));
    })
    .expect("sets");
    let metrics = table::read::<Metric>(&path("metrics")).expect("metrics");
    for (subject, summary) in columns.into_iter().filter(|(_, summary)| summary.n > 0) {
        out += &format!("{subject} | {}\n", summary.text());
    }
    out + &format!("metrics | {} rows\n", metrics.len())
}

#[test]
fn the_published_experiments_give_the_accepted_numbers() {
    let lake = lake();
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(workspace().join("snapshots"));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| {
        for paper in
            zonobench_verdicts::papers::load(&[]).expect("the embedded experiments are valid")
        {
            insta::assert_snapshot!(paper.name.clone(), comparison(&lake, &paper.name));
            let text = claims(&lake, &paper.name);
            insta::assert_snapshot!(format!("{}__claims", paper.name), text);
            if let Some(text) = complexity(&lake, &paper.name) {
                insta::assert_snapshot!(format!("{}__complexity", paper.name), text);
            }
            for e in &paper.experiments {
                let text = experiment(&lake, &paper.name, &e.id);
                insta::assert_snapshot!(format!("{}__{}", paper.name, e.id), text);
            }
        }
    });
}
