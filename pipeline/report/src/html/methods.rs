//! Methods beside each other: who is more accurate and tighter, and who keeps up with the plant.

use super::markup::{badge_named, code, commands, escaped, label, place, row, scrolling, table};
use super::{Page, heading};
use crate::source::{Held, Source};
use crate::step_times::{Recorded, StepTimes};
use std::collections::BTreeMap;
use std::path::Path;
use zonobench_estimation::System as _;
use zonobench_lab::experiment::metric::METRICS;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_lake::rows;
use zonobench_query::query;
use zonobench_query::tables;

/// How long steps of one estimator of one experiment took in this lake.
pub struct StepTime {
    paper: String,
    experiment: String,
    estimator: String,
    /// Median over the runs of the median over the steps, in µs
    median_us: f64,
    /// The longest step of all runs, in µs
    longest_us: f64,
    /// 99.9 % of the steps of the run where that is longest take no longer, in µs
    p999_us: f64,
    /// Steps longer than the sampling period, over all runs; NaN where there is none
    late: f64,
    /// Steps timed
    steps: f64,
}

/// The times of this lake; none where it has no table `timings`.
pub fn times(lake: &Path) -> Result<Vec<StepTime>, Error> {
    if !query::holds(lake, "timings")? {
        return Ok(Vec::new());
    }
    let frame = query::run(
        lake,
        "SELECT paper, experiment, estimator, MEDIAN(median_ns) / 1000.0 AS median_us, MAX(max_ns) / 1000.0 AS longest_us, \
         MAX(p999_ns) / 1000.0 AS p999_us, SUM(late) AS late, SUM(steps) AS steps \
         FROM timings GROUP BY paper, experiment, estimator ORDER BY paper, experiment, estimator",
    )?;
    let text = |name: &str, i: usize| Some(frame.value(name, i)?.text().into_owned());
    let number = |name: &str, i: usize| frame.value(name, i)?.number();
    let time = |i| {
        Some(StepTime {
            paper: text("paper", i)?,
            experiment: text("experiment", i)?,
            estimator: text("estimator", i)?,
            median_us: number("median_us", i)?,
            longest_us: number("longest_us", i)?,
            p999_us: number("p999_us", i)?,
            late: number("late", i).unwrap_or(f64::NAN),
            steps: number("steps", i)?,
        })
    };
    Ok((0..frame.len()).filter_map(time).collect())
}

/// What a method came to over the comparisons that it took part in.
#[derive(Default)]
struct Tally {
    /// How often it was compared
    compared: usize,
    /// How often it was the best
    best: usize,
    /// Σ log (its mean / the least mean)
    logs: f64,
}

impl Tally {
    fn add(&mut self, ratio: f64) {
        self.compared += 1;
        self.best += usize::from(ratio <= 1.0);
        self.logs += libm::log(ratio);
    }

    fn ratio(&self) -> Option<f64> {
        (self.compared > 0).then(|| libm::exp(self.logs / self.compared as f64))
    }

    fn cells(&self) -> [String; 2] {
        [
            self.ratio().map(four_digits).unwrap_or_default(),
            if self.compared == 0 {
                String::new()
            } else {
                format!("{} of {}", self.best, self.compared)
            },
        ]
    }
}

#[derive(Default)]
struct Method {
    kind: String,
    /// In how many of its experiments its sets are guaranteed
    guaranteed: usize,
    experiments: usize,
    error: Tally,
    size: Tally,
}

/// Whether a metric is an error or a size, in an experiment that comes with this program or in one that does not.
fn is_size(held: &Held, experiment: &str, metric: &str) -> Option<bool> {
    let of_name = |name: &str| match name {
        "rmse" | "rmse_wrapped" | "rmse_norm" => Some(false),
        "radius" | "r_box" | "width" | "volume" | "area" | "box_area" | "projected_area" => {
            Some(true)
        }
        _ => None,
    };
    let published = held
        .paper
        .as_ref()
        .and_then(|p| p.experiments.iter().find(|e| e.id == experiment));
    match published {
        Some(e) => {
            let spec = e.metrics.iter().find(|m| m.id == metric)?;
            // One step, or another phase than the paper reports, is not what a method is judged by.
            (spec.at.is_empty() && spec.phase.is_none() && spec.over.is_none())
                .then(|| of_name(spec.name))
                .flatten()
        }
        None => METRICS
            .iter()
            .find(|info| info.name == metric)
            .and_then(|info| of_name(info.name)),
    }
}

fn methods(source: &Source, held: &Held) -> Result<BTreeMap<String, Method>, Error> {
    let mut methods: BTreeMap<String, Method> = BTreeMap::new();
    for experiment in &held.experiments {
        for e in source.estimators(&held.name, experiment)? {
            let method = methods.entry(e.estimator.to_string()).or_default();
            method.guaranteed += usize::from(e.guaranteed);
            method.kind = e.kind.to_string();
            method.experiments += 1;
        }
        let mut groups: BTreeMap<(String, String), Vec<(String, f64)>> = BTreeMap::new();
        for rows::Score {
            estimator,
            metric,
            component,
            over,
            mean,
            ..
        } in source.scores(&held.name, experiment)?
        {
            if let (None, Some(mean)) = (over, mean.filter(|x| x.is_finite() && *x > 0.0)) {
                let key = (
                    metric.to_string(),
                    component.map(|c| c.to_string()).unwrap_or_default(),
                );
                groups
                    .entry(key)
                    .or_default()
                    .push((estimator.to_string(), mean));
            }
        }
        for ((metric, _), group) in groups.iter().filter(|(_, group)| group.len() > 1) {
            let Some(size) = is_size(held, experiment, metric) else {
                continue;
            };
            let least = group.iter().map(|(_, x)| *x).fold(f64::INFINITY, f64::min);
            for (estimator, mean) in group {
                let method = methods.entry(estimator.clone()).or_default();
                let tally = if size {
                    &mut method.size
                } else {
                    &mut method.error
                };
                tally.add(mean / least);
            }
        }
    }
    Ok(methods)
}

/// The ranking of methods, a table a paper.
pub fn ranking(source: &Source, papers: &[&Held], times: &[StepTime]) -> Result<Page, Error> {
    let mut body = "<h1>Methods in order</h1>\n<p>Over all experiments of a paper in this lake: an error (RMSE) or a size (radius, \
                    width, area, volume) of one component is one comparison between the estimators of that experiment. A \
                    method's number is the geometric mean of its mean over the least mean: 1 is the best everywhere, 2 is twice \
                    the best. Estimators of different experiments are not the same problem; guarantees are not priced in: a \
                    set that is not guaranteed may be small because it loses the truth.</p>\n"
        .to_owned();
    if papers.iter().any(|p| p.is_quick()) {
        body += super::front::SMOKE_RUN;
    }
    for held in papers {
        let methods = methods(source, held)?;
        let mut compared: Vec<(&String, &Method)> = methods
            .iter()
            .filter(|(_, m)| m.error.compared + m.size.compared > 0)
            .collect();
        if compared.is_empty() {
            continue;
        }
        // By error; those that were compared in size alone come after.
        let key = |m: &Method| [&m.error, &m.size].map(|t| t.ratio().unwrap_or(f64::INFINITY));
        compared.sort_by(|(_, a), (_, b)| {
            let ([error, size], [other, others]) = (key(a), key(b));
            error.total_cmp(&other).then(size.total_cmp(&others))
        });
        let rows: Vec<String> = compared
            .iter()
            .enumerate()
            .map(|(i, (name, m))| {
                let mut own: Vec<f64> = times
                    .iter()
                    .filter(|t| t.paper == held.name && t.estimator == **name)
                    .map(|t| t.median_us)
                    .collect();
                own.sort_by(f64::total_cmp);
                let [error, best] = m.error.cells();
                let [size, tightest] = m.size.cells();
                row(&[
                    escaped(name),
                    (i + 1).to_string(),
                    escaped(&m.kind),
                    format!("{} of {}", m.guaranteed, m.experiments),
                    error,
                    best,
                    size,
                    tightest,
                    own.get(own.len() / 2)
                        .map(|x| format!("{} µs", four_digits(*x)))
                        .unwrap_or_default(),
                ])
            })
            .collect();
        body += &heading(2, &place(&held.name, "ranking"), &escaped(&held.name));
        body += &table(
            "sortable filtered",
            &format!("Methods of {}", held.name),
            &[
                "method",
                "place",
                "kind",
                "experiments with a guarantee",
                "error / least",
                "least error",
                "size / least",
                "least size",
                "median step",
            ],
            &rows.concat(),
        );
    }
    body += &commands(
        "zonobench query \"SELECT paper, experiment, metric, component, estimator, mean, ci_lo, ci_hi FROM scores \
         ORDER BY paper, experiment, metric, component, mean\"",
    );
    Ok(Page {
        place: "ranking".to_owned(),
        name: "Ranking".to_owned(),
        body,
    })
}

/// The sampling period of an experiment's system in µs, where it has one.
fn period_us(held: &Held, experiment: &str) -> Option<f64> {
    let e = held
        .paper
        .as_ref()?
        .experiments
        .iter()
        .find(|e| e.id == experiment)?;
    e.problem.system.period().map(|seconds| 1e6 * seconds)
}

/// Step times beside each other on a logarithmic scale, and beside the sampling period where there is one.
pub fn real_time(
    lake: &Path,
    papers: &[&Held],
    times: &[StepTime],
    recorded: &[Recorded],
) -> Result<Page, Error> {
    let mut body = "<h1>Does it keep up?</h1>\n<p>Times of a step in this lake, measured on the machine that made it: they depend \
                    on it, and are part of no hash and no verdict of the tables. The bar is the median of a step, the mark behind it \
                    the longest of all runs, both on one logarithmic scale. A method runs in real time where its longest step is \
                    shorter than the sampling period.</p>\n"
        .to_owned();
    let positive = || {
        times
            .iter()
            .flat_map(|t| [t.median_us, t.longest_us])
            .filter(|x| *x > 0.0)
    };
    let (low, high) = (
        positive().fold(f64::INFINITY, f64::min),
        positive().fold(0.0, f64::max),
    );
    if high <= 0.0 {
        body += "<p>Missing: this lake holds no times.</p>\n";
    } else {
        let (from, to) = (
            libm::floor(libm::log10(low)),
            libm::ceil(libm::log10(high)).max(libm::floor(libm::log10(low)) + 1.0),
        );
        let at =
            |us: f64| (100.0 * (libm::log10(us.max(low)) - from) / (to - from)).clamp(0.0, 100.0);
        let rows: Vec<String> = times
            .iter()
            .map(|t| {
                let held = papers.iter().find(|p| p.name == t.paper);
                let period = held.and_then(|held| period_us(held, &t.experiment));
                let real = match period {
                    None => String::new(),
                    Some(p) if t.longest_us < p => badge_of("good", "✓", "yes"),
                    Some(_) => badge_of(
                        "bad",
                        "✗",
                        &format!("{} of {} steps late", t.late, t.steps),
                    ),
                };
                row(&[
                    format!("{} {}", escaped(&t.paper), code(&t.experiment)),
                    escaped(&t.estimator),
                    format!(
                        "<span class=\"scale\" aria-hidden=\"true\"><i style=\"width:{:.2}%\"></i><b style=\"left:{:.2}%\"></b></span>",
                        at(t.median_us),
                        at(t.longest_us)
                    ),
                    format!("{} µs", four_digits(t.median_us)),
                    format!("{} µs", four_digits(t.p999_us)),
                    format!("{} µs", four_digits(t.longest_us)),
                    period.map(|p| format!("{} µs", four_digits(p))).unwrap_or_default(),
                    real,
                ])
            })
            .collect();
        let scale = format!("{} µs to {} µs, logarithmic", power(from), power(to));
        body += &table(
            "sortable filtered times",
            "Time of a step",
            &[
                "experiment",
                "estimator",
                &scale,
                "median",
                "99.9 %",
                "longest",
                "sampling period",
                "in real time",
            ],
            &rows.concat(),
        );
        body += &commands(
            "zonobench query \"SELECT paper, experiment, estimator, MEDIAN(median_ns) / 1000 AS median_us FROM timings \
             GROUP BY paper, experiment, estimator ORDER BY median_us DESC\"",
        );
    }
    for held in papers {
        if let Some(steps) = StepTimes::of(recorded, &held.name) {
            body += &heading(
                2,
                &format!("step-times-{}", held.name),
                &format!("Step by step: {}", escaped(&held.name)),
            );
            body += &step_times(&steps);
        }
    }
    let mut printed = Vec::new();
    for held in papers {
        for t in tables::timing_comparisons(lake, &held.name)? {
            printed.push(row(&[
                format!("{} {}", escaped(&held.name), escaped(&t.table)),
                label(&t.row),
                label(&t.column),
                escaped(&t.published),
                t.reproduced_ms.map(four_digits).unwrap_or_default(),
                badge_named(&t.verdict),
                escaped(&t.reason),
            ]));
        }
    }
    if !printed.is_empty() {
        body += &heading(2, "printed-times", "Printed times beside ours");
        body += "<p>Another machine and another program: at best the order of a column is the same. Ours is in ms, or a ratio where \
                 the paper prints one.</p>\n";
        body += &table(
            "sortable filtered",
            "Printed times",
            &[
                "table",
                "row",
                "column",
                "published",
                "ours",
                "verdict",
                "reason",
            ],
            &printed.concat(),
        );
    }
    Ok(Page {
        place: "times".to_owned(),
        name: "Real time".to_owned(),
        body,
    })
}

/// The recorded times of single steps.
fn step_times(steps: &StepTimes) -> String {
    let words = escaped(&steps.words());
    let picture = scrolling("How long a step takes", &steps.picture());
    let mut out = format!("<figure>{picture}<figcaption>{words}</figcaption></figure>\n");
    let grids = [
        ("Quantiles of the times", steps.quantiles()),
        ("Where the time of a step goes", steps.shares()),
    ];
    for (caption, grid) in grids {
        let cells = |cells: &Vec<String>| -> Vec<String> {
            cells.iter().map(|cell| escaped(cell)).collect()
        };
        let rows: Vec<String> = grid.rows.iter().map(|r| row(&cells(r))).collect();
        if !rows.is_empty() {
            out += &table("", caption, &grid.header, &rows.concat());
        }
    }
    out
}

fn badge_of(class: &str, mark: &str, words: &str) -> String {
    format!("<span class=\"badge {class}\"><span aria-hidden=\"true\">{mark}</span> {words}</span>")
}

fn power(exponent: f64) -> String {
    four_digits(libm::pow(10.0, exponent))
}
