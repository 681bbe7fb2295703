//! estimate: one estimator over all runs of an experiment, and the judge beside it.
//!
//! The estimator reads measurements and inputs. The truth goes to the judge alone, which is handed
//! every finished belief and says whether it holds the truth.

use crate::command::{self, Block, Program};
use crate::experiment::{EstimatorSpec, Method, MetricSpec, Output};
use crate::stage::ending::{self, Ending, not_finite};
use crate::stage::{Experiment, Recordings, Run, metadata};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;
use zonobench_estimation::estimator::{Belief as _, Containment, Estimator as _, Phase};
use zonobench_estimation::growth::{Grown, Growth};
use zonobench_estimation::outline::outline;
use zonobench_estimation::track::{Data as _, Track};
use zonobench_estimation::{
    AnyBelief, AnyEstimator, EstimationError, EstimatorSettings, Problem, System as _,
};
use zonobench_lake::error::Error;
use zonobench_lake::rows::{self, Belief, Estimate, EstimatorInfo, Extra, Set, Timing};
use zonobench_lake::store::canonical;
use zonobench_lake::table::{self, Name, TableWriter};
use zonobench_sets::{Interval, IntervalVector, SetError};

/// The most steps whose rows are held in memory before they are written, of all runs that are made at once.
const MOST_HELD: usize = 1 << 18;

/// How many rows of one run are held before they are handed on.
const HANDED_ON: usize = 4096;

/// How many runs of so many steps are made at once.
fn at_once(steps: usize) -> usize {
    (MOST_HELD / (steps + 1)).clamp(1, 32)
}

/// The most steps whose rows are held in memory in a job of runs of so many steps.
pub(crate) fn most_held(steps: usize) -> usize {
    match at_once(steps) {
        1 => HANDED_ON,
        runs => runs * (steps + 1),
    }
}

/// The most generators of a set that a trace carries.
const TRACED_GENERATORS: usize = 256;

/// What the estimates of estimator `index` depend on.
pub fn input(experiment: &Experiment, index: usize, data: &str) -> Value {
    let e = &experiment.estimators[index];
    json!({
        "estimator": e.id,
        "settings": e.settings,
        "problem": e.problem,
        "steps": experiment.steps,
        "runs": experiment.runs,
        "sets": experiment.output.sets,
        "traces": experiment.output.traces,
        "updated_only": experiment.output.updated_only,
        "volumes": volumes(&experiment.metrics),
        "extras": extras(&experiment.metrics),
        "data": data,
    })
}

/// Whether some metric needs the volumes of sets.
pub fn volumes(metrics: &[MetricSpec]) -> bool {
    let needed = |m: &MetricSpec| matches!(m.name, "area" | "volume");
    metrics.iter().any(needed)
}

/// Whether some metric needs the numbers that one kind of belief has beyond its size.
pub fn extras(metrics: &[MetricSpec]) -> bool {
    let needed = |m: &MetricSpec| matches!(m.name, "body_box_area" | "projected_area" | "nis");
    metrics.iter().any(needed)
}

/// One estimator and what it is run on.
pub struct Job<'a> {
    /// `paper/experiment`, for messages.
    pub name: String,
    /// The estimator.
    pub spec: &'a EstimatorSpec,
    /// The last step.
    pub steps: usize,
    /// What is kept besides the estimates.
    pub output: &'a Output,
    /// Whether volumes are computed also where that takes more than the step itself.
    pub volumes: bool,
    /// Whether a belief's extra numbers are kept.
    pub extras: bool,
    /// The seed of the simulated data.
    pub seed: Option<u64>,
    /// Whether the data keep to what the estimator assumes; true where nothing is known of them.
    pub admissible: bool,
}

impl Job<'_> {
    /// Estimator `index` of an experiment.
    pub fn of(experiment: &Experiment, index: usize) -> Job<'_> {
        Job {
            name: experiment.name(),
            spec: &experiment.estimators[index],
            steps: experiment.steps,
            output: &experiment.output,
            volumes: volumes(&experiment.metrics),
            extras: extras(&experiment.metrics),
            seed: Some(experiment.seed),
            admissible: experiment
                .truth
                .is_admissible(&experiment.estimators[index].problem, experiment.steps),
        }
    }
}

/// The row that describes the estimator of a job.
pub fn describe(job: &Job) -> Result<EstimatorInfo, Error> {
    let spec = job.spec;
    let estimator = match &spec.settings {
        Method::BuiltIn(settings) => build(job, settings)?,
        Method::Command(settings) => {
            let Value::Object(mut map) =
                serde_json::to_value(settings).expect("it has a JSON form")
            else {
                unreachable!("settings are an object")
            };
            map.remove("kind");
            return Ok(EstimatorInfo {
                estimator: spec.id.as_str().into(),
                kind: command::KIND.into(),
                // It is put to the test, and never believed.
                guaranteed: false,
                reads: "y_0 to y_k, as far as its program uses them".into(),
                reported_phase: phase_name(Phase::Updated).into(),
                settings: canonical(&Value::Object(map)).into(),
            });
        }
    };
    let mut settings = serde_json::to_value(&spec.settings).expect("settings have a JSON form");
    if let Value::Object(map) = &mut settings {
        map.remove("kind");
        let readings = estimator.readings();
        if !readings.is_empty() {
            map.insert("moments".to_owned(), readings.into_iter().collect());
        }
    }
    Ok(EstimatorInfo {
        estimator: spec.id.as_str().into(),
        kind: estimator.kind().into(),
        guaranteed: estimator.guaranteed() && job.admissible,
        reads: estimator.reads().into(),
        reported_phase: phase_name(estimator.reported_phase()).into(),
        settings: canonical(&settings).into(),
    })
}

fn build(job: &Job, settings: &EstimatorSettings) -> Result<AnyEstimator, Error> {
    AnyEstimator::new(settings, &job.spec.problem).map_err(|source| Error::Estimator {
        experiment: job.name.clone(),
        estimator: job.spec.id.clone(),
        source: Box::new(source),
    })
}

/// The name of a phase in the tables.
pub fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Predicted => "predicted",
        Phase::Updated => "updated",
    }
}

/// Rows of one run.
#[derive(Default)]
struct RunRows {
    estimates: Vec<Estimate>,
    beliefs: Vec<Belief>,
    extras: Vec<Extra>,
    sets: Vec<Set>,
    shapes: Vec<Set>,
}

impl RunRows {
    fn append(&mut self, mut rows: RunRows) {
        self.estimates.append(&mut rows.estimates);
        self.beliefs.append(&mut rows.beliefs);
        self.extras.append(&mut rows.extras);
        self.sets.append(&mut rows.sets);
        self.shapes.append(&mut rows.shapes);
    }
}

/// How one run went.
#[derive(Default)]
struct Course {
    timing: Option<Timing>,
    ending: Option<Ending>,
}

/// The tables of the stage while they are written.
struct Tables {
    estimates: TableWriter<Estimate>,
    beliefs: TableWriter<Belief>,
    extras: TableWriter<Extra>,
    sets: TableWriter<Set>,
    shapes: TableWriter<Set>,
}

impl Tables {
    fn create(dir: &Path, meta: &BTreeMap<String, String>) -> Result<Self, Error> {
        Ok(Self {
            estimates: TableWriter::create(&dir.join("estimates.parquet"), meta)?,
            beliefs: TableWriter::create(&dir.join("beliefs.parquet"), meta)?,
            extras: TableWriter::create(&dir.join("extras.parquet"), meta)?,
            sets: TableWriter::create(&dir.join("sets.parquet"), meta)?,
            shapes: TableWriter::create(&dir.join("shapes.parquet"), meta)?,
        })
    }

    fn push(&mut self, rows: RunRows) -> Result<(), Error> {
        self.estimates.push(rows.estimates)?;
        self.beliefs.push(rows.beliefs)?;
        self.extras.push(rows.extras)?;
        self.sets.push(rows.sets)?;
        self.shapes.push(rows.shapes)
    }

    fn close(self) -> Result<(), Error> {
        self.estimates.close()?;
        self.beliefs.close()?;
        self.extras.close()?;
        self.sets.close()?;
        self.shapes.close()?;
        Ok(())
    }
}

/// Writes `estimates`, `beliefs`, `extras` (for metrics), `sets`, `shapes` (outlines of run 0 for the trace),
/// `timings`, and the [`ending::FILE`] where a run failed; returns the runs that ended early.
///
/// Rows are written as they are made: what is held in memory does not grow with the number of steps.
pub fn make(
    job: &Job,
    recordings: &Recordings,
    dir: &Path,
    done: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Ending>, Error> {
    let estimator = Made::new(job)?;
    let judged = Judged::new(job, &estimator);
    let meta = metadata("estimate", job.seed);
    let mut tables = Tables::create(dir, &meta)?;
    let (mut timings, mut endings) = (Vec::new(), Vec::new());
    let mut finish = |course: Course| {
        timings.extend(course.timing);
        endings.extend(course.ending);
    };
    let runs: Vec<usize> = (0..recordings.runs()).collect();
    let at_once = at_once(job.steps);
    // A process serves several runs, one after the other.
    let in_a_row = match estimator {
        Made::BuiltIn(_) => 1,
        Made::Command(_) => command::BLOCK,
    };
    for chunk in runs.chunks(at_once) {
        if let [run] = *chunk {
            let mut source = estimator.source();
            finish(judged.run(recordings, run, &mut source, &mut |rows| tables.push(rows))?);
            done(1);
            continue;
        }
        let finished: Vec<Vec<(RunRows, Course)>> = chunk
            .par_chunks(in_a_row)
            .map(|block| {
                let mut source = estimator.source();
                let one = |&run: &usize| {
                    let mut all = RunRows::default();
                    let course = judged.run(recordings, run, &mut source, &mut |rows| {
                        all.append(rows);
                        Ok(())
                    })?;
                    done(1);
                    Ok((all, course))
                };
                block.iter().map(one).collect()
            })
            .collect::<Result<_, Error>>()?;
        for (rows, course) in finished.into_iter().flatten() {
            tables.push(rows)?;
            finish(course);
        }
    }
    tables.close()?;
    table::write(&dir.join("timings.parquet"), timings, &meta)?;
    ending::write(dir, &endings)?;
    Ok(endings)
}

/// An estimator that is ready to run.
enum Made<'a> {
    BuiltIn(Box<AnyEstimator>),
    Command(Program<'a>),
}

impl<'a> Made<'a> {
    /// Fails where the estimator cannot be made, or is a program that the user has not allowed to run.
    fn new(job: &Job<'a>) -> Result<Self, Error> {
        match &job.spec.settings {
            Method::BuiltIn(settings) => Ok(Self::BuiltIn(Box::new(build(job, settings)?))),
            Method::Command(settings) if settings.allowed => {
                let problem = &job.spec.problem;
                Ok(Self::Command(Program::new(settings, problem, job.steps)))
            }
            Method::Command(settings) => Err(command::not_allowed(&job.spec.id, settings)),
        }
    }

    fn reported_phase(&self) -> Phase {
        match self {
            Self::BuiltIn(e) => e.reported_phase(),
            Self::Command(_) => Phase::Updated,
        }
    }

    fn guaranteed(&self) -> bool {
        matches!(self, Self::BuiltIn(e) if e.guaranteed())
    }

    fn source(&self) -> Source<'_> {
        match self {
            Self::BuiltIn(e) => Source::BuiltIn(e),
            Self::Command(program) => Source::Command(program.block()),
        }
    }
}

/// Where beliefs come from.
enum Source<'a> {
    BuiltIn(&'a AnyEstimator),
    Command(Block<'a>),
}

/// How a run ended: by an error of an estimator of this program, or as one outside of it was found to.
enum Ended {
    Error(EstimationError),
    Said(Ending),
}

/// What was known at a step, and how the run ended if it did.
struct Known {
    k: usize,
    predicted: Option<AnyBelief>,
    updated: Result<AnyBelief, Ended>,
    /// Whether the set is claimed to hold the state for certain by one whose word is not a proof.
    claims: bool,
}

impl Source<'_> {
    /// The steps of a run, one when it is asked for; the first that fails is the last.
    fn steps<'s>(
        &'s mut self,
        id: &'s str,
        run: usize,
        steps: usize,
        data: Run<'s>,
    ) -> Box<dyn Iterator<Item = Known> + 's> {
        match self {
            Self::BuiltIn(estimator) => {
                let steps = Track::new(*estimator, steps, data).of_run(run as u64);
                Box::new(steps.map(move |step| Known {
                    k: step.k,
                    predicted: step.predicted,
                    updated: step.updated.map_err(Ended::Error),
                    claims: false,
                }))
            }
            Self::Command(block) => {
                let mut ended = false;
                Box::new((0..=steps).map_while(move |k| {
                    if ended {
                        return None;
                    }
                    let begun = if k == 0 { block.begin(run) } else { Ok(()) };
                    let said =
                        begun.and_then(|()| block.step(k, data.input(k), data.measurement(k)));
                    ended = said.is_err();
                    if k == steps && !ended {
                        block.finished();
                    }
                    let claims = said.as_ref().is_ok_and(|said| said.claims);
                    let updated = said.map(|said| said.belief).map_err(|fault| {
                        Ended::Said(Ending {
                            estimator: id.to_owned(),
                            run,
                            k,
                            status: fault.status,
                            cause: fault.cause,
                        })
                    });
                    Some(Known {
                        k,
                        predicted: None,
                        updated,
                        claims,
                    })
                }))
            }
        }
    }
}

/// Which belief a row is of, and what it says in place of the belief's own status.
#[derive(Clone, Copy)]
struct At {
    run: usize,
    k: usize,
    phase: Phase,
    status: Option<&'static str>,
}

struct Judged<'a> {
    job: &'a Job<'a>,
    estimator: &'a Made<'a>,
    id: Name,
    components: Vec<Name>,
    words: Words,
}

/// Looks at the sets of a run of a guaranteed estimator: whether they grow without end, and what a term does with them
/// that leaves its domain.
struct Watch<'a> {
    judged: &'a Judged<'a>,
    recordings: &'a Recordings,
    run: usize,
    growth: Option<Growth>,
    /// The box at the step before, and its step.
    last: Option<(usize, IntervalVector)>,
}

impl<'a> Watch<'a> {
    fn new(judged: &'a Judged<'a>, recordings: &'a Recordings, run: usize) -> Self {
        Self {
            judged,
            recordings,
            run,
            growth: judged.estimator.guaranteed().then(Growth::default),
            last: None,
        }
    }

    /// How the run ends if the reported belief of step `k` shows that it grows without end.
    fn observe(&mut self, k: usize, belief: &AnyBelief) -> Option<Ending> {
        let growth = self.growth.as_mut()?;
        let hull = belief.interval_hull()?;
        let run = self.recordings.run(self.run);
        let is_measured = run.measurement(k).iter().all(Option::is_some);
        match growth.observe(&hull, is_measured) {
            Some(grown) => Some(self.diverged(k, grown)),
            None => {
                self.last = Some((k, hull));
                None
            }
        }
    }

    fn diverged(&self, k: usize, grown: Grown) -> Ending {
        let cause = self.last.as_ref().map_or_else(String::new, |(k, over)| {
            let run = self.recordings.run(self.run);
            grown.explained(&self.judged.job.spec.problem, *k, run.input(*k), over)
        });
        Ending::diverged(&self.judged.id, self.run, k, cause)
    }

    /// The ending, with its reason where sets that grew are no longer finite.
    fn told(&self, ending: Ending, is_infinite: bool) -> Ending {
        let grown = self.growth.as_ref().and_then(Growth::since_start);
        match grown.filter(|_| is_infinite) {
            Some(grown) => {
                let now = f64::INFINITY;
                self.diverged(ending.k, Grown { now, ..grown })
            }
            None => ending,
        }
    }

    /// How the run ends by `error` at step `k`.
    fn failed(&self, k: usize, error: &EstimationError, predicted: Option<&AnyBelief>) -> Ending {
        let ending = Ending::of(&self.judged.id, self.run, k, error);
        let outside = match error {
            EstimationError::Set {
                source: SetError::Domain { lower, upper, .. },
                ..
            } => Some((lower, upper)),
            _ => None,
        };
        let is_entire =
            outside.is_some_and(|(lower, upper)| lower.is_infinite() || upper.is_infinite());
        let is_infinite = ending.is_overflow() || is_entire;
        let ending = self.told(ending, is_infinite);
        match outside {
            Some(_) if !ending.is_divergence() => self.outside(ending, predicted),
            _ => ending,
        }
    }

    /// The ending, with the term that is not defined all over the set.
    fn outside(&self, mut ending: Ending, predicted: Option<&AnyBelief>) -> Ending {
        let over = predicted.map_or_else(
            || self.last.as_ref().map(|(_, hull)| hull.clone()),
            AnyBelief::interval_hull,
        );
        let system = &self.judged.job.spec.problem.system;
        if let Some(fault) = over.and_then(|x| system.domain_fault(&x)) {
            ending.cause = fault;
        }
        ending
    }
}

/// The texts that stand in every row.
struct Words {
    ok: Name,
    unbounded: Name,
    predicted: Name,
    updated: Name,
}

impl<'a> Judged<'a> {
    fn new(job: &'a Job<'a>, estimator: &'a Made<'a>) -> Self {
        let variables = job.spec.problem.system.variables();
        Self {
            job,
            estimator,
            id: job.spec.id.as_str().into(),
            components: variables.x.iter().map(|v| v.name.as_str().into()).collect(),
            words: Words {
                ok: "ok".into(),
                unbounded: "unbounded".into(),
                predicted: phase_name(Phase::Predicted).into(),
                updated: phase_name(Phase::Updated).into(),
            },
        }
    }

    /// One run; its rows go to `hand_on`, some at a time, in order.
    fn run(
        &self,
        recordings: &Recordings,
        run: usize,
        source: &mut Source,
        hand_on: &mut dyn FnMut(RunRows) -> Result<(), Error>,
    ) -> Result<Course, Error> {
        let mut rows = RunRows::default();
        let mut times = Vec::with_capacity(self.job.steps + 1);
        let updated_only =
            self.job.output.updated_only && self.estimator.reported_phase() == Phase::Updated;
        let mut steps = source.steps(&self.id, run, self.job.steps, recordings.run(run));
        let mut watch = Watch::new(self, recordings, run);
        let mut ending = None;
        let mut refuted = None;
        while ending.is_none() {
            let start = Instant::now();
            let Some(step) = steps.next() else { break };
            times.push(start.elapsed().as_nanos() as i64);
            let truth = recordings.truth(run, step.k);
            let truth = truth.as_deref();
            let predicted = step.predicted.as_ref().filter(|_| !updated_only);
            let lost = |belief: &AnyBelief| {
                let outside = |x| belief.contains(x) == Containment::Outside;
                step.claims && truth.is_some_and(outside)
            };
            let reported = match self.estimator.reported_phase() {
                Phase::Predicted => step.predicted.as_ref(),
                Phase::Updated => step.updated.as_ref().ok(),
            };
            let mut diverged = reported.and_then(|belief| watch.observe(step.k, belief));
            let mut record = |phase, belief: &AnyBelief, status| {
                if phase == self.estimator.reported_phase() && diverged.is_some() {
                    return diverged.take();
                }
                match not_finite(belief) {
                    None => {
                        let at = At {
                            run,
                            k: step.k,
                            phase,
                            status,
                        };
                        self.record(at, belief, truth, &mut rows);
                        None
                    }
                    Some(what) => {
                        let ending = Ending::overflow(&self.id, run, step.k, what);
                        Some(watch.told(ending, true))
                    }
                }
            };
            ending = predicted.and_then(|belief| record(Phase::Predicted, belief, None));
            if ending.is_none() {
                ending = match &step.updated {
                    // Nothing new is known, and nothing is said twice.
                    Ok(belief) if predicted.is_some_and(|b| b.says_the_same(belief)) => None,
                    Ok(belief) if lost(belief) => {
                        refuted.get_or_insert_with(|| Ending::refuted(&self.id, run, step.k));
                        record(Phase::Updated, belief, Some(ending::REFUTED))
                    }
                    Ok(belief) => record(Phase::Updated, belief, None),
                    Err(Ended::Error(error)) => {
                        Some(watch.failed(step.k, error, step.predicted.as_ref()))
                    }
                    Err(Ended::Said(ending)) => Some(ending.clone()),
                };
            }
            if let Some(ending) = &ending {
                self.ended(run, ending.k, &ending.status, &mut rows);
            }
            if rows.estimates.len() >= HANDED_ON {
                hand_on(std::mem::take(&mut rows))?;
            }
        }
        drop(steps);
        hand_on(rows)?;
        times.sort_unstable();
        let period = self.job.spec.problem.system.period();
        let late = |period: f64| times.iter().filter(|&&t| t as f64 > 1e9 * period).count() as i64;
        let timing = times.last().map(|&max_ns| Timing {
            estimator: self.id.clone(),
            run: run as i32,
            steps: times.len() as i64,
            total_ns: times.iter().sum(),
            median_ns: times[times.len() / 2],
            p999_ns: times[(times.len() * 999).div_ceil(1000) - 1],
            late: period.map(late),
            max_ns,
        });
        // A claim that was refuted is told, whatever came after it.
        let ending = refuted.or(ending);
        Ok(Course { timing, ending })
    }

    fn record(&self, at: At, belief: &AnyBelief, truth: Option<&[Interval]>, rows: &mut RunRows) {
        let At {
            run,
            k,
            phase,
            status,
        } = at;
        let (center, hull, size) = (belief.center(), belief.interval_hull(), belief.size());
        let truth = truth.filter(|_| hull.is_some());
        let contains = truth.and_then(|x| match belief.contains(x) {
            Containment::Inside => Some(true),
            Containment::Outside => Some(false),
            Containment::Undecided => None,
        });
        let bounded = hull
            .as_ref()
            .is_none_or(|h| h.iter().all(|side| side.is_finite()));
        let words = &self.words;
        let said = status.or(belief.status()).map(Name::from);
        let status = match &said {
            Some(status) => status,
            None if bounded => &words.ok,
            None => &words.unbounded,
        };
        let phase_text = match phase {
            Phase::Predicted => &words.predicted,
            Phase::Updated => &words.updated,
        };
        for (i, component) in self.components.iter().enumerate() {
            rows.estimates.push(Estimate {
                estimator: self.id.clone(),
                run: run as i32,
                k: k as i32,
                phase: phase_text.clone(),
                component: component.clone(),
                center: Some(center[i]).filter(|c| !c.is_nan()),
                lower: hull.as_ref().map(|h| h[i].lo()),
                upper: hull.as_ref().map(|h| h[i].hi()),
                status: status.clone(),
            });
        }
        rows.beliefs.push(Belief {
            estimator: self.id.clone(),
            run: run as i32,
            k: k as i32,
            phase: phase_text.clone(),
            n_generators: size.n_generators.map(|n| n as i64),
            n_constraints: size.n_constraints.map(|n| n as i64),
            trace_ggt: size.trace_ggt,
            radius: size.radius,
            volume: match self.job.volumes {
                true => belief.volume(),
                false => size.volume,
            }
            .filter(|volume| !volume.is_nan()),
            covariance: belief.covariance().map(|p| p.as_slice().to_vec()),
            contains_truth: contains,
            lp_count: size.lp_count as i64,
            pivots: size.pivots as i64,
            unfinished: size.unfinished as i64,
            fallbacks: size.fallbacks as i64,
        });
        let reported = phase == self.estimator.reported_phase();
        // Innovations are known after a measurement, whichever phase is reported.
        if self.job.extras && (reported || phase == Phase::Updated) {
            let extras = belief.extras().into_iter();
            rows.extras.extend(
                extras
                    .filter(|(_, x)| !x.is_nan())
                    .map(|(name, value)| Extra {
                        estimator: self.id.clone(),
                        run: run as i32,
                        k: k as i32,
                        phase: phase_text.clone(),
                        name: name.into(),
                        value,
                    }),
            );
        }
        if run == 0 {
            let wanted = self.job.output.sets.contains(&k);
            let traced = self.job.output.traces && phase == self.estimator.reported_phase();
            if wanted {
                rows.sets
                    .push(self.set(run, k, phase_text, belief, usize::MAX));
            }
            if traced {
                rows.shapes
                    .push(self.set(run, k, phase_text, belief, TRACED_GENERATORS));
            }
        }
    }

    fn set(&self, run: usize, k: usize, phase: &Name, belief: &AnyBelief, most: usize) -> Set {
        let shape = belief.shape();
        let numbers = |v: &Vec<f64>| v.iter().all(|x| !x.is_nan());
        let vertices = (self.components.len() == 2).then(|| {
            outline(&shape, (0, 1))
                .into_iter()
                .flatten()
                .collect::<Vec<f64>>()
        });
        Set {
            estimator: self.id.clone(),
            run: run as i32,
            k: k as i32,
            phase: phase.clone(),
            kind: shape.kind.into(),
            center: Some(shape.center).filter(numbers),
            generators: shape
                .generators
                .filter(|g| g.cols() <= most)
                .map(|g| g.as_slice().to_vec())
                .filter(numbers),
            a: shape
                .constraints
                .as_ref()
                .map(|(a, _)| a.as_slice().to_vec())
                .filter(numbers),
            b: shape.constraints.map(|(_, b)| b).filter(numbers),
            vertices: vertices.filter(|v| v.iter().all(|x| x.is_finite())),
        }
    }

    /// A run that ended at `k` without a belief, and why.
    fn ended(&self, run: usize, k: usize, status: &str, rows: &mut RunRows) {
        for component in &self.components {
            rows.estimates.push(Estimate {
                estimator: self.id.clone(),
                run: run as i32,
                k: k as i32,
                phase: "updated".into(),
                component: component.clone(),
                center: None,
                lower: None,
                upper: None,
                status: status.into(),
            });
        }
    }
}

/// The rows of the table `variables`.
pub fn variables(problem: &Problem) -> Vec<rows::Variable> {
    let v = problem.system.variables();
    let mut out = Vec::new();
    for (role, list) in [
        ("x", &v.x),
        ("u", &v.u),
        ("w", &v.w),
        ("y", &v.y),
        ("v", &v.v),
    ] {
        out.extend(list.iter().enumerate().map(|(i, variable)| rows::Variable {
            role: role.into(),
            position: i as i32,
            component: variable.name.as_str().into(),
            unit: (&*variable.unit).into(),
        }));
    }
    out
}
