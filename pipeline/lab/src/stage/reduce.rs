//! reduce: the steps of every run folded into that run's metrics.
//!
//! (Not to be confused with `reduce_order`, which makes a set simpler.) The formulas stand in
//! [`crate::experiment::METRICS`]; sums run over k in ascending order.

use crate::experiment::metric::Bound;
use crate::experiment::{EstimatorSpec, MetricSpec};
use crate::stage::estimate::{Job, describe, phase_name};
use crate::stage::{Experiment, Recordings, metadata};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, Float64Array, RecordBatch};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zonobench_estimation::estimator::Phase;
use zonobench_estimation::estimators::{printed_width_bound, width_bound};
use zonobench_estimation::{EstimationError, Problem, System as _};
use zonobench_lake::error::Error;
use zonobench_lake::rows::{Belief, Estimate, EstimatorInfo, Extra, Metric};
use zonobench_lake::store::Artifact;
use zonobench_lake::table::{self, Name};
use zonobench_sets::ellipsoid::{Ellipsoid, chi_square_isf};
use zonobench_sets::se2::wrap;
use zonobench_sets::{IntervalVector, Matrix};

/// What the metrics depend on: the contents of the simulation and of every estimator's estimates.
pub fn input(experiment: &Experiment, data: &str, estimates: &[String]) -> Value {
    let estimators: Vec<Value> = experiment
        .estimators
        .iter()
        .zip(estimates)
        .map(|(e, content)| json!({ "id": e.id, "content": content }))
        .collect();
    json!({
        "metrics": experiment.metrics,
        "steps": experiment.steps,
        "data": data,
        "estimators": estimators,
        // The width bounds are functions of the system and the noise boxes.
        "problem": experiment.problem,
    })
}

/// A belief at one step, as the tables hold it.
#[derive(Clone, Default)]
struct Point {
    center: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    covariance: Option<Matrix>,
    volume: Option<f64>,
    contains: Option<bool>,
    extras: Vec<(Name, f64)>,
}

impl Point {
    fn half_widths(&self) -> impl Iterator<Item = f64> {
        self.widths().map(|w| 0.5 * w)
    }

    fn widths(&self) -> impl Iterator<Item = f64> {
        self.upper.iter().zip(&self.lower).map(|(u, l)| u - l)
    }

    /// The extra number `name`, or NaN.
    fn extra(&self, name: &str) -> f64 {
        let found = self.extras.iter().find(|(n, _)| &**n == name);
        found.map_or(f64::NAN, |(_, value)| *value)
    }

    fn has_set(&self) -> bool {
        !self.lower.is_empty()
    }
}

/// One estimator's beliefs: phases[phase][run][k].
struct Series {
    id: String,
    kind: String,
    reported: usize,
    phases: [Vec<Vec<Option<Point>>>; 2],
    /// The step at which a run ended, and the status it ended with.
    ended: Vec<Option<(usize, Name)>>,
}

impl Series {
    fn at(&self, phase: usize, run: usize, k: usize) -> Option<&Point> {
        self.phases[phase].get(run)?.get(k)?.as_ref()
    }
}

fn phase_index(name: &str) -> usize {
    usize::from(name == "updated")
}

/// What is folded: the estimators of an experiment, over simulated or recorded data.
pub struct Subject<'a> {
    /// `paper/experiment`, for messages.
    pub name: String,
    /// Of the system and the noise that the experiment has, whose components the metrics are of.
    pub problem: &'a Problem,
    /// The estimators.
    pub estimators: &'a [EstimatorSpec],
    /// What each of them says of itself.
    pub infos: Vec<EstimatorInfo>,
    /// The metrics.
    pub metrics: Vec<&'a MetricSpec>,
    /// The last step.
    pub steps: usize,
}

/// The tables of one estimator.
pub struct Tables {
    /// `estimates`.
    pub estimates: PathBuf,
    /// `beliefs`.
    pub beliefs: PathBuf,
    /// `extras`.
    pub extras: PathBuf,
}

fn read(subject: &Subject, index: usize, runs: usize, tables: &Tables) -> Result<Series, Error> {
    let n = subject.problem.system.variables().x.len();
    let info = &subject.infos[index];
    let empty = || vec![vec![None; subject.steps + 1]; runs];
    let mut series = Series {
        id: info.estimator.to_string(),
        kind: info.kind.to_string(),
        reported: phase_index(&info.reported_phase),
        phases: [empty(), empty()],
        ended: vec![None; runs],
    };
    read_estimates(&mut series, &tables.estimates)?;
    read_beliefs(&mut series, &tables.beliefs, n)?;
    table::for_each::<Extra>(&tables.extras, |row| {
        let phase = phase_index(&row.phase);
        let place = &mut series.phases[phase][row.run as usize][row.k as usize];
        if let Some(point) = place {
            point.extras.push((row.name, row.value));
        }
    })?;
    Ok(series)
}

/// A column of a batch; `table::columns` has checked the table.
fn column<'a>(batch: &'a RecordBatch, name: &str) -> &'a dyn Array {
    batch.column_by_name(name).expect("this column was read")
}

fn doubles<'a>(batch: &'a RecordBatch, name: &str) -> &'a Float64Array {
    column(batch, name).as_primitive::<Float64Type>()
}

/// The columns run, k and phase, row by row as places in `phases`.
fn places(batch: &RecordBatch) -> impl Iterator<Item = (usize, usize, usize)> {
    let integers = |name: &str| column(batch, name).as_primitive::<Int32Type>().values();
    let phases = column(batch, "phase").as_string::<i32>();
    let steps = integers("run").iter().zip(integers("k"));
    let at = move |(i, (&run, &k)): (usize, (&i32, &i32))| {
        (phase_index(phases.value(i)), run as usize, k as usize)
    };
    steps.enumerate().map(at)
}

fn read_estimates(series: &mut Series, path: &Path) -> Result<(), Error> {
    let wanted = ["run", "k", "phase", "center", "lower", "upper", "status"];
    for batch in table::columns::<Estimate>(path, &wanted)? {
        let batch = batch?;
        let [center, lower, upper] = ["center", "lower", "upper"].map(|c| doubles(&batch, c));
        for (i, (phase, run, k)) in places(&batch).enumerate() {
            if center.is_null(i) {
                let status = column(&batch, "status").as_string::<i32>().value(i);
                series.ended[run] = Some((k, status.into()));
                continue;
            }
            let point = series.phases[phase][run][k].get_or_insert_with(Point::default);
            point.center.push(center.value(i));
            if lower.is_valid(i) && upper.is_valid(i) {
                point.lower.push(lower.value(i));
                point.upper.push(upper.value(i));
            }
        }
    }
    Ok(())
}

fn read_beliefs(series: &mut Series, path: &Path, n: usize) -> Result<(), Error> {
    let wanted = [
        "run",
        "k",
        "phase",
        "volume",
        "covariance",
        "contains_truth",
    ];
    for batch in table::columns::<Belief>(path, &wanted)? {
        let batch = batch?;
        let volume = doubles(&batch, "volume");
        let covariance = column(&batch, "covariance").as_list::<i32>();
        let contains = column(&batch, "contains_truth").as_boolean();
        for (i, (phase, run, k)) in places(&batch).enumerate() {
            let Some(point) = &mut series.phases[phase][run][k] else {
                continue;
            };
            point.covariance = covariance.is_valid(i).then(|| {
                let entries = covariance.value(i);
                let p = entries.as_primitive::<Float64Type>();
                Matrix::from_fn(n, n, |i, j| p.value(i * n + j))
            });
            point.volume = volume.is_valid(i).then(|| volume.value(i));
            point.contains = contains.is_valid(i).then(|| contains.value(i));
        }
    }
    Ok(())
}

/// Writes `metrics.parquet` from the artifacts of `simulate` and of every estimator, in the file's order.
pub fn make(
    experiment: &Experiment,
    recordings: &Recordings,
    estimates: &[Artifact],
    dir: &Path,
) -> Result<(), Error> {
    let all = 0..experiment.estimators.len();
    let subject = Subject {
        name: experiment.name(),
        problem: &experiment.problem,
        estimators: &experiment.estimators,
        infos: all
            .map(|index| describe(&Job::of(experiment, index)))
            .collect::<Result<_, _>>()?,
        metrics: experiment.metrics.iter().collect(),
        steps: experiment.steps,
    };
    let tables = |artifact: &Artifact| {
        let path = |name: &str| {
            artifact.path(name).ok_or_else(|| Error::Unknown {
                what: "file of the estimates",
                got: name.to_owned(),
                expected: "estimates.parquet, beliefs.parquet, extras.parquet".to_owned(),
            })
        };
        Ok(Tables {
            estimates: path("estimates.parquet")?,
            beliefs: path("beliefs.parquet")?,
            extras: path("extras.parquet")?,
        })
    };
    let tables: Vec<Tables> = estimates.iter().map(tables).collect::<Result<_, Error>>()?;
    table::write(
        &dir.join("metrics.parquet"),
        values(&subject, recordings, &tables)?,
        &metadata("reduce", Some(experiment.seed)),
    )?;
    Ok(())
}

/// The values of all metrics of all estimators, whose tables are `tables`.
pub fn values(
    subject: &Subject,
    recordings: &Recordings,
    tables: &[Tables],
) -> Result<Vec<Metric>, Error> {
    let runs = recordings.runs();
    let series: Vec<Series> = tables
        .iter()
        .enumerate()
        .map(|(index, tables)| read(subject, index, runs, tables))
        .collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    for (index, s) in series.iter().enumerate() {
        for spec in &subject.metrics {
            rows.extend(fold(subject, recordings, &series, index, spec, s)?);
        }
    }
    Ok(rows)
}

/// The values of one metric of one estimator over all runs; none where the metric does not apply to it.
fn fold(
    subject: &Subject,
    recordings: &Recordings,
    series: &[Series],
    index: usize,
    spec: &MetricSpec,
    s: &Series,
) -> Result<Vec<Metric>, Error> {
    let other = |id: &Option<String>| {
        id.as_ref()
            .and_then(|id| series.iter().find(|o| o.id == *id))
    };
    let compared = [other(&spec.over), other(&spec.than), other(&spec.within)]
        .into_iter()
        .flatten()
        .next();
    if compared.is_some_and(|o| o.id == s.id) {
        return Ok(Vec::new());
    }
    let fail = |source: EstimationError| Error::Estimator {
        experiment: subject.name.clone(),
        estimator: s.id.clone(),
        source: Box::new(source),
    };
    let variables = subject.problem.system.variables();
    let components: Vec<Name> = variables.x.iter().map(|v| v.name.as_str().into()).collect();
    // The quantile of the metric's level, of those metrics that ask for one.
    let quantile = |names: &[&str], dof: usize| {
        let level = spec.level.filter(|_| names.contains(&spec.name));
        let of = |level: f64| {
            chi_square_isf(1.0 - level, dof)
                .map_err(EstimationError::at(0, "level of the ellipsoid"))
        };
        level.map(of).transpose()
    };
    let context = Context {
        steps: subject.steps,
        spec,
        s,
        compared,
        angles: variables.x.iter().map(|v| v.unit == "rad").collect(),
        phase: spec
            .phase
            .map_or(s.reported, |p| phase_index(phase_name(p))),
        compared_phase: spec
            .than_phase
            .or(spec.within_phase)
            .map(|p| phase_index(phase_name(p)))
            .or(compared.map(|o| o.reported))
            .unwrap_or(1),
        bound: match spec.bound {
            Some(_) if s.kind != "box-state-est" => return Ok(Vec::new()),
            Some(bound) => {
                Some(box_bound(&subject.estimators[index].problem, bound).map_err(fail)?)
            }
            None => None,
        },
        ellipsoid: quantile(
            &["ellipsoid_contains", "ellipsoid_inside", "coverage"],
            components.len(),
        )
        .map_err(fail)?,
        interval: quantile(&["coverage"], 1).map_err(fail)?,
    };
    let values: Vec<Vec<(Option<usize>, Option<f64>)>> = (0..recordings.runs())
        .into_par_iter()
        .map(|run| context.run(recordings, run))
        .collect();
    // A metric without a value in any run does not apply to this kind of estimator.
    if values.iter().flatten().all(|(_, value)| value.is_none()) {
        return Ok(Vec::new());
    }
    let id: Name = s.id.as_str().into();
    let metric: Name = spec.id.as_str().into();
    let over: Option<Name> = compared.map(|o| o.id.as_str().into());
    let bounds = context.bounds(&values).map_err(fail)?;
    let bounds = bounds.into_iter().flat_map(|(side, value)| {
        let (id, metric) = (id.clone(), Name::from(format!("{metric}_{side}")));
        (0..recordings.runs()).map(move |run| Metric {
            estimator: id.clone(),
            run: run as i32,
            metric: metric.clone(),
            component: None,
            over: None,
            value: Some(value),
        })
    });
    let bounds: Vec<Metric> = bounds.collect();
    Ok(values
        .into_iter()
        .enumerate()
        .flat_map(|(run, values)| {
            values
                .into_iter()
                .map(move |(component, value)| (run, component, value))
        })
        .map(|(run, component, value)| Metric {
            estimator: id.clone(),
            run: run as i32,
            metric: metric.clone(),
            component: component.map(|i| components[i].clone()),
            over: over.clone(),
            value: value.filter(|v| !v.is_nan()),
        })
        .chain(bounds)
        .collect())
}

/// The width bound of [Meslem2018, Eq. (17)], as printed or corrected, for the noise boxes of `problem`.
fn box_bound(problem: &Problem, bound: Bound) -> Result<f64, EstimationError> {
    let parts = problem
        .system
        .linear_parts()
        .ok_or(EstimationError::Unsupported {
            kind: "box-state-est",
            what: "the width bound of this system",
            reason: "it holds for linear systems".into(),
        })?;
    let bound = match bound {
        Bound::Printed => printed_width_bound(&parts.a, &parts.c)?,
        Bound::Corrected => width_bound(&parts.a, &parts.c)?,
    };
    let widest = |hull: IntervalVector| {
        hull.iter()
            .map(|side| side.hi() - side.lo())
            .fold(0.0, f64::max)
    };
    Ok(bound.width(widest(problem.v.box_hull()), widest(problem.w.box_hull())))
}

struct Context<'a> {
    steps: usize,
    spec: &'a MetricSpec,
    s: &'a Series,
    compared: Option<&'a Series>,
    phase: usize,
    compared_phase: usize,
    bound: Option<f64>,
    ellipsoid: Option<f64>,
    interval: Option<f64>,
    /// Whether a component of the state is an angle.
    angles: Vec<bool>,
}

impl Context<'_> {
    /// The 95 % bounds of the mean over the runs of a squared distance that is chi-square if the filter is consistent,
    /// by name; none of other metrics.
    fn bounds(
        &self,
        values: &[Vec<(Option<usize>, Option<f64>)>],
    ) -> Result<Vec<(&'static str, f64)>, EstimationError> {
        let runs = (values.iter()).filter(|run| run.iter().any(|(_, value)| value.is_some()));
        let (dof, terms) = match self.spec.name {
            "nees" => {
                let runs = runs.count();
                (runs * self.angles.len(), runs as f64)
            }
            "nis" => {
                let all = (0..values.len()).flat_map(|run| self.innovations(run));
                let (dof, terms) = all.fold((0.0, 0.0), |(d, n), (_, m)| (d + m, n + 1.0));
                (dof as usize, terms)
            }
            _ => return Ok(Vec::new()),
        };
        let bound = |tail: f64| {
            chi_square_isf(tail, dof)
                .map(|quantile| quantile / terms)
                .map_err(EstimationError::at(0, "bounds of a metric"))
        };
        Ok(vec![("lo", bound(0.975)?), ("hi", bound(0.025)?)])
    }

    /// zᵀ S⁻¹ z and the number of components measured, of each step of K that has both.
    fn innovations(&self, run: usize) -> impl Iterator<Item = (f64, f64)> {
        let updated = phase_index(phase_name(Phase::Updated));
        (0..=self.steps)
            .filter(|&k| self.spec.covers(k))
            .filter_map(move |k| {
                let point = self.s.at(updated, run, k)?;
                let (squared, m) = (point.extra("nis"), point.extra("nis_components"));
                (!squared.is_nan() && !m.is_nan()).then_some((squared, m))
            })
    }

    /// (x − c)ᵀ P⁻¹ (x − c), where errors of angles are taken in (−π, π].
    fn squared_distance(&self, p: &Point, x: &[f64]) -> Option<f64> {
        let near = (p.center.iter().zip(x).zip(&self.angles))
            .map(|((c, x), angle)| if *angle { c + wrap(x - c) } else { *x });
        let near: Vec<f64> = near.collect();
        let ellipsoid = Ellipsoid::new(p.center.clone(), p.covariance.clone()?, 1.0).ok()?;
        ellipsoid.squared_distance(&near).ok()
    }

    /// Whether each component of `x` is covered, and all at once.
    fn covered(&self, p: &Point, x: &[f64]) -> Option<Vec<bool>> {
        let Some((interval, ellipsoid)) = self.interval.zip(self.ellipsoid) else {
            let sides = p.lower.iter().zip(&p.upper).zip(x);
            let mut all: Vec<bool> = sides.map(|((l, u), x)| l <= x && x <= u).collect();
            all.push(all.iter().all(|&inside| inside));
            return p.has_set().then_some(all);
        };
        let covariance = p.covariance.as_ref()?;
        let distance = self.squared_distance(p, x)?;
        let mut all: Vec<bool> = (0..x.len())
            .map(|i| {
                let e = x[i] - p.center[i];
                let e = if self.angles[i] { wrap(e) } else { e };
                e * e <= interval * covariance[(i, i)]
            })
            .collect();
        all.push(distance <= ellipsoid);
        Some(all)
    }

    /// (component, value) of one run.
    fn run(&self, recordings: &Recordings, run: usize) -> Vec<(Option<usize>, Option<f64>)> {
        let window: Vec<(usize, &Point)> = (0..=self.steps)
            .filter(|&k| self.spec.covers(k))
            .filter_map(|k| Some((k, self.s.at(self.phase, run, k)?)))
            .collect();
        let truth = |k: usize| recordings.state(run, k).unwrap_or_default();
        let n = window.first().map_or(0, |(_, p)| p.center.len());
        let sets = || window.iter().filter(|(_, p)| p.has_set());
        let one = |value: Option<f64>| vec![(None, value)];
        match self.spec.name {
            "rmse" => (0..n)
                .map(|i| {
                    let square = |k: usize, p: &Point| {
                        let e = p.center[i] - truth(k)[i];
                        e * e
                    };
                    (Some(i), self.ratio_or(&window, run, square).map(f64::sqrt))
                })
                .collect(),
            "rmse_wrapped" => (0..n)
                .map(|i| {
                    let square = |k: usize, p: &Point| {
                        let e = p.center[i] - truth(k)[i];
                        let e = if self.angles[i] { wrap(e) } else { e };
                        e * e
                    };
                    (Some(i), self.ratio_or(&window, run, square).map(f64::sqrt))
                })
                .collect(),
            "overshoot" => (0..n)
                .map(|i| {
                    let error = |&(k, p): &(usize, &Point)| {
                        let e = p.center[i] - truth(k)[i];
                        if self.angles[i] { wrap(e) } else { e }
                    };
                    let beyond = window.first().map(|first| {
                        let from = error(first);
                        let other = |e: &f64| (from > 0.0 && *e < 0.0) || (from < 0.0 && *e > 0.0);
                        let other = window.iter().map(error).filter(other);
                        other.map(f64::abs).fold(0.0, f64::max)
                    });
                    (Some(i), beyond)
                })
                .collect(),
            "rmse_norm" => {
                let square = |k: usize, p: &Point| {
                    let x = truth(k);
                    let errors = self.spec.components.iter().map(|&i| p.center[i] - x[i]);
                    errors.map(|e| e * e).sum()
                };
                one(self.ratio_or(&window, run, square).map(f64::sqrt))
            }
            "radius" | "r_box" => one(self.ratio_or(&window, run, |_, p| {
                p.half_widths().fold(f64::NAN, f64::max)
            })),
            "width" => {
                let component =
                    |i: usize| (Some(i), self.ratio_or(&window, run, |_, p| width_of(p, i)));
                let mut values: Vec<_> = (0..n).map(component).collect();
                values.push((
                    None,
                    self.ratio_or(&window, run, |_, p| p.widths().fold(f64::NAN, f64::max)),
                ));
                values
            }
            "volume" | "area" => {
                one(self.ratio_or(&window, run, |_, p| p.volume.unwrap_or(f64::NAN)))
            }
            "box_area" => one(self.ratio_or(&window, run, |_, p| {
                self.spec
                    .components
                    .iter()
                    .map(|&i| width_of(p, i))
                    .product()
            })),
            name @ ("body_box_area" | "projected_area") => {
                one(self.ratio_or(&window, run, |_, p| p.extra(name)))
            }
            "bound_ratio" => one(self.bound.and_then(|bound| {
                sets()
                    .flat_map(|(_, p)| p.widths())
                    .map(|w| w / bound)
                    .reduce(f64::max)
            })),
            "contains" => one(share(window.iter().filter_map(|(_, p)| p.contains))),
            "outside" => {
                let any = sets().next().is_some();
                let lost = window
                    .iter()
                    .filter(|(_, p)| p.contains == Some(false))
                    .count();
                one(any.then_some(lost as f64))
            }
            status @ ("inconsistent" | "refused") => {
                let ended = self.s.ended[run]
                    .as_ref()
                    .is_some_and(|(k, how)| &**how == status && self.spec.covers(*k));
                one(Some(f64::from(u8::from(ended))))
            }
            "better" => (0..n)
                .map(|i| {
                    let better = window.iter().filter_map(|(k, p)| {
                        let q = self.compared?.at(self.compared_phase, run, *k)?;
                        let x = truth(*k)[i];
                        let (ours, theirs) = ((p.center[i] - x).abs(), (q.center[i] - x).abs());
                        Some(if self.spec.strict {
                            ours < theirs
                        } else {
                            ours <= theirs
                        })
                    });
                    (Some(i), share(better))
                })
                .collect(),
            "ellipsoid_contains" => one(share(window.iter().filter_map(|(k, p)| {
                let sigma = self.ellipsoid?;
                let ellipsoid =
                    Ellipsoid::new(p.center.clone(), p.covariance.clone()?, sigma).ok()?;
                ellipsoid.contains(&truth(*k)).ok()
            }))),
            "ellipsoid_inside" => one(share(window.iter().filter_map(|(k, p)| {
                let sigma = self.ellipsoid?;
                let ellipsoid =
                    Ellipsoid::new(p.center.clone(), p.covariance.clone()?, sigma).ok()?;
                let q = self.compared?.at(self.compared_phase, run, *k)?;
                ellipsoid
                    .is_inside(&IntervalVector::from_bounds(&q.lower, &q.upper).ok()?)
                    .ok()
            }))),
            "center_inside" => one(share(window.iter().filter_map(|(k, p)| {
                let q = self.compared?.at(self.compared_phase, run, *k)?;
                q.has_set().then(|| {
                    let sides = q.lower.iter().zip(&q.upper);
                    p.center
                        .iter()
                        .zip(sides)
                        .all(|(c, (l, u))| l <= c && c <= u)
                })
            }))),
            "boundary" => (0..n)
                .map(|i| {
                    let near = sets().filter_map(|(k, p)| {
                        let (x, level) = (truth(*k)[i], self.spec.level?);
                        let gap = (x - p.lower[i]).min(p.upper[i] - x);
                        Some(gap <= level * width_of(p, i))
                    });
                    (Some(i), share(near))
                })
                .collect(),
            "nees" => {
                let distances = window
                    .iter()
                    .map(|(k, p)| self.squared_distance(p, &truth(*k)));
                one(mean(distances.flatten()))
            }
            "nis" => one(mean(self.innovations(run).map(|(squared, _)| squared))),
            "coverage" => {
                let covered = window.iter().map(|(k, p)| self.covered(p, &truth(*k)));
                let covered: Vec<Vec<bool>> = covered.flatten().collect();
                let place = |i: usize| (i < n).then_some(i);
                (0..=n)
                    .map(|i| (place(i), share(covered.iter().map(|all| all[i]))))
                    .collect()
            }
            "crps" => (0..n)
                .map(|i| {
                    let scores = window.iter().filter_map(|(k, p)| {
                        let e = truth(*k)[i] - p.center[i];
                        let e = if self.angles[i] { wrap(e) } else { e };
                        Some(ranked_score(
                            e,
                            p.covariance.as_ref()?[(i, i)].max(0.0).sqrt(),
                        ))
                    });
                    (Some(i), mean(scores))
                })
                .collect(),
            other => unreachable!("the metric {other} was checked when the experiment was read"),
        }
    }

    /// Mean over the window of `value`, or, with `over`, of its ratio to the other estimator's.
    fn ratio_or(
        &self,
        window: &[(usize, &Point)],
        run: usize,
        value: impl Fn(usize, &Point) -> f64,
    ) -> Option<f64> {
        let mut sum = 0.0;
        let mut count = 0usize;
        for (k, point) in window {
            let ours = value(*k, point);
            let term = match self.compared {
                None => ours,
                Some(other) => ours / value(*k, other.at(self.compared_phase, run, *k)?),
            };
            sum += term;
            count += 1;
        }
        (count > 0)
            .then(|| sum / count as f64)
            .filter(|mean| !mean.is_nan())
    }
}

fn width_of(p: &Point, i: usize) -> f64 {
    match (p.lower.get(i), p.upper.get(i)) {
        (Some(l), Some(u)) => u - l,
        _ => f64::NAN,
    }
}

/// The mean in order; None of nothing.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, n), x| (sum + x, n + 1));
    (count > 0).then(|| sum / count as f64)
}

/// The continuous ranked probability score of N(0, s²) at `e`; |e| for s = 0. Source: [Gneiting2005, Eq. (5)].
fn ranked_score(e: f64, s: f64) -> f64 {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI};
    if s == 0.0 {
        return e.abs();
    }
    let z = e / s;
    // 2 F(z) − 1 is erf(z/√2), and 2 f(z) = (2/√π) exp(−z²/2)/√2.
    let density = FRAC_2_SQRT_PI * FRAC_1_SQRT_2 * libm::exp(-0.5 * z * z);
    s * (z * libm::erf(z * FRAC_1_SQRT_2) + density - 0.5 * FRAC_2_SQRT_PI)
}

fn share(verdicts: impl Iterator<Item = bool>) -> Option<f64> {
    let (mut yes, mut all) = (0usize, 0usize);
    for verdict in verdicts {
        yes += usize::from(verdict);
        all += 1;
    }
    (all > 0).then(|| yes as f64 / all as f64)
}

#[cfg(test)]
mod tests {
    use super::ranked_score;

    /// ∫ (F(t) − 1[t ≥ e])² dt of N(0, s²), by the midpoint rule.
    fn integral(e: f64, s: f64) -> f64 {
        let (from, steps) = (-12.0 * s - e.abs(), 200_000);
        let width = -2.0 * from / f64::from(steps);
        let term = |i: i32| {
            let t = from + (f64::from(i) + 0.5) * width;
            let below = 0.5 * (1.0 + libm::erf(t / s * std::f64::consts::FRAC_1_SQRT_2));
            let step = if t >= e { 1.0 } else { 0.0 };
            (below - step) * (below - step) * width
        };
        (0..steps).map(term).sum()
    }

    #[test]
    fn the_ranked_score_is_its_integral() {
        for (e, s) in [
            (0.0, 1.0),
            (0.7, 1.0),
            (-2.5, 0.5),
            (3.0, 2.0),
            (0.01, 0.001),
        ] {
            let (formula, integral) = (ranked_score(e, s), integral(e, s));
            // The step falls into one of the intervals.
            let width = (24.0 * s + 2.0 * e.abs()) / 200_000.0;
            let off = (formula - integral).abs();
            assert!(off < width, "{e} {s}: {formula} {integral}");
        }
        assert_eq!(ranked_score(-0.25, 0.0), 0.25);
    }
}
