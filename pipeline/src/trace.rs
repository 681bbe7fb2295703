//! Sets over time, as MCAP files that Foxglove and Lichtblick open.
//!
//! [`write()`] takes a run as values and makes one file of it: the sets as scenes, the numbers as
//! messages to plot, the settings and a viewer's layout as attachments. A viewer that jumps to a time
//! shows the latest message of each topic and nothing before it, so **every message is the whole of
//! what its topic shows**: ids are constant, lifetimes zero, and a set that cannot be drawn is a message
//! that clears the topic. Times are those of the experiment, counted from 2000-01-01, and nothing of the
//! machine enters: the same trace is the same bytes.
//!
//! | topic | schema | content |
//! |---|---|---|
//! | `/truth/path` | `foxglove.SceneUpdate` | the whole true path, once |
//! | `/truth/pose`, `/estimate/center` | `foxglove.PoseInFrame` | each step |
//! | `/estimate/<method>/set` | `foxglove.SceneUpdate` | outline and fill of the set |
//! | `/estimate/<method>/tube` | `foxglove.SceneUpdate` | the last outlines |
//! | `/estimate/<method>/metrics` | `zonobench.StepMetrics` | numbers to plot |
//! | `/estimate/<method>/zonotope` | `zonobench.Zonotope` | the set itself |
//! | `/measurement/set` | `foxglove.SceneUpdate` | states a measurement allows, for one period |
//! | `/log` | `foxglove.Log` | steps that are not `ok` |
//! | `/run/info` | JSON | what this is |
//!
//! Above two components a set is drawn over pairs of axes, a topic and a frame a pair
//! (`…/set_x_y` in `x_y`). One component is drawn over time. A state that begins with a position in space is
//! drawn there too, in the frame `space`.

mod layout;
mod messages;
mod schemas;
mod space;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use prost::Message;
use prost_types::{Duration, Timestamp};
use thiserror::Error;

pub use layout::{Topics, View, layout_json};
pub use schemas::schema;

use layout::with_unit;
use messages::{
    Color, DELETE_ALL, KeyValuePair, LINE_LOOP, LINE_STRIP, LOG_WARNING, LinePrimitive, Log,
    Point3, Pose, PoseInFrame, SceneEntity, SceneEntityDeletion, SceneUpdate, StepMetrics,
    TriangleListPrimitive,
};

/// One run of one estimator.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// The paper's folder
    pub paper: String,
    /// The experiment's id
    pub experiment: String,
    /// The estimator's id in the experiment
    pub estimator: String,
    /// The estimator's kind
    pub kind: String,
    /// Whether its sets are proven to contain the truth
    pub guaranteed: bool,
    /// Name and unit of each component of the state; n in all
    pub names: Vec<(String, String)>,
    /// Time from step to step in s; 1 where the system knows no time
    pub dt_s: f64,
    /// What else the file says of itself
    pub metadata: BTreeMap<String, String>,
    /// The estimator's settings and what it was told, as JSON
    pub params_json: String,
    /// The layout; where empty, one is made for this trace
    pub layout_json: String,
    /// How each measured component depends on the state, where that is linear; empty where it is not
    pub measurement_rows: Vec<MeasurementRow>,
    /// The steps, k ascending
    pub steps: Vec<TraceStep>,
}

/// A measured component y = row · x + v.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasurementRow {
    /// Its name
    pub name: String,
    /// Its row of C, n values
    pub row: Vec<f64>,
    /// The ends of the interval of v
    pub noise: (f64, f64),
}

/// One step.
#[derive(Clone, Debug, Default)]
pub struct TraceStep {
    /// The step
    pub k: usize,
    /// The true state, where it is known
    pub truth: Option<Vec<f64>>,
    /// The point estimate
    pub center: Vec<f64>,
    /// Lower ends of the interval hull
    pub lower: Option<Vec<f64>>,
    /// Upper ends of the interval hull
    pub upper: Option<Vec<f64>>,
    /// The set over pairs of axes; where there is none, the hull is drawn
    pub outlines: Vec<Outline>,
    /// The set itself, where it is a zonotope
    pub zonotope: Option<TraceZonotope>,
    /// The measurement, a value a component that was measured
    pub measurement: Option<Vec<Option<f64>>>,
    /// Named numbers of this step: `error`, `radius`, `volume`, `trace_ggt`, `n_generators`,
    /// `n_constraints`, `contains_truth` have fields of their own, any other name may stand here too
    pub metrics: Vec<(String, f64)>,
    /// `ok`, or what was wrong: `inconsistent`
    pub status: String,
}

/// A convex set over two components of the state.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Which two
    pub axes: (usize, usize),
    /// The vertices in order; the last is joined to the first
    pub polygon: Vec<[f64; 2]>,
}

/// A zonotope c ⊕ G \[-1, 1\]ᵐ.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceZonotope {
    /// c, n values
    pub center: Vec<f64>,
    /// G, row by row
    pub generators: Vec<f64>,
    /// Number of components
    pub n: usize,
    /// Number of generators
    pub m: usize,
}

/// Why a trace could not be written.
#[derive(Debug, Error)]
pub enum TraceError {
    /// A list has the wrong length
    #[error("{what} at k = {k}: expected {expected} values, got {got}")]
    Dimension {
        /// Which list
        what: &'static str,
        /// At which step
        k: usize,
        /// Its length by the trace's components
        expected: usize,
        /// Its length
        got: usize,
    },
    /// An outline over a component that does not exist
    #[error("outline at k = {k}: expected two different axes below {n}, got {axes:?}")]
    Axes {
        /// At which step
        k: usize,
        /// Number of components
        n: usize,
        /// The axes
        axes: (usize, usize),
    },
    /// The trace has no components or no steps
    #[error("trace: expected at least one {0}, got none")]
    Nothing(&'static str),
    /// The steps do not ascend
    #[error("steps: expected k ascending, got {next} after {k}")]
    Order {
        /// A step
        k: usize,
        /// The one after it
        next: usize,
    },
    /// The time of a step cannot be told
    #[error("time of k = {k}: expected a positive dt and a time below 2^63 ns, got dt = {dt_s} s")]
    Time {
        /// The step
        k: usize,
        /// Time from step to step
        dt_s: f64,
    },
    /// The file could not be written
    #[error("MCAP: {0}")]
    Mcap(#[from] mcap::McapError),
}

/// Time zero of every trace: 2000-01-01T00:00:00Z in seconds since 1970. Fixed, since no clock of a
/// machine may enter, and not zero, which viewers take for "no time".
pub const EPOCH_S: u64 = 946_684_800;

/// How many outlines a tube shows.
const TUBE_LENGTH: usize = 10;

/// Bytes of a chunk before compression: what a viewer reads to show one moment.
const CHUNK_BYTES: u64 = 512 * 1024;

const SCENE: &str = "foxglove.SceneUpdate";
const POSE: &str = "foxglove.PoseInFrame";
const LOG: &str = "foxglove.Log";
const METRICS: &str = "zonobench.StepMetrics";
const ZONOTOPE: &str = "zonobench.Zonotope";
const RUN_INFO: &str = "zonobench.RunInfo";

/// What the viewers know of `/run/info`. They walk the properties of every object, so each has some,
/// be it none.
const RUN_INFO_SCHEMA: &str = r#"{"title":"zonobench.RunInfo","type":"object","properties":{"components":{"type":"array","items":{"type":"object","properties":{"name":{"type":"string"},"unit":{"type":"string"}}}},"dt_s":{"type":"number"},"estimator":{"type":"string"},"experiment":{"type":"string"},"guaranteed":{"type":"boolean"},"kind":{"type":"string"},"metadata":{"type":"object","properties":{}},"paper":{"type":"string"},"steps":{"type":"integer"}}}"#;

/// Orange, sky blue, green, vermilion: told apart by people who see few colours, on light and dark.
const TRUTH_COLOR: Color = color(0.902, 0.624, 0.0, 1.0);
const SET_COLOR: Color = color(0.337, 0.706, 0.914, 1.0);
const STRIP_COLOR: Color = color(0.0, 0.62, 0.451, 1.0);
const ALARM_COLOR: Color = color(0.835, 0.369, 0.0, 1.0);

const fn color(r: f64, g: f64, b: f64, a: f64) -> Color {
    Color { r, g, b, a }
}

/// Writes `trace` to `out` as MCAP.
///
/// Times are 2000-01-01 + k · dt, to the nanosecond; log time, publish time and the messages' own are
/// the same. A value that is not finite is not drawn; in the numbers it stays, and where the hull is
/// unbounded its ends are infinite.
///
/// Fails where a list does not have the length that `names` asks for, an outline names an axis that
/// does not exist, k does not ascend, a time cannot be told, or `out` fails.
pub fn write(trace: &Trace, out: &mut (impl Write + Seek)) -> Result<(), TraceError> {
    trace.check()?;
    let recording = Recording::of(trace)?;
    let mut writer = mcap::WriteOptions::new()
        .library("zonobench")
        .profile("")
        .compression(Some(mcap::Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        .create(out)?;
    recording.send(&mut writer)?;
    writer.write_metadata(&Metadata {
        name: "zonobench".to_owned(),
        metadata: trace.record(),
    })?;
    let start = trace.time(trace.steps[0].k)?.nanoseconds;
    let layout = if trace.layout_json.is_empty() {
        layout_json(&trace.paper, &trace.topics())
    } else {
        trace.layout_json.clone()
    };
    for (name, media_type, text) in [
        ("foxglove-layout.json", "application/json", &layout),
        ("params.json", "application/json", &trace.params_json),
    ] {
        writer.attach(&mcap::Attachment {
            log_time: start,
            create_time: start,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(text.as_bytes()),
        })?;
    }
    writer.finish()?;
    Ok(())
}

/// A moment of the experiment.
#[derive(Clone, Copy)]
struct Moment {
    nanoseconds: u64,
    /// Seconds since the experiment's start
    elapsed_s: f64,
}

impl Moment {
    fn timestamp(self) -> Option<Timestamp> {
        Some(Timestamp {
            seconds: (self.nanoseconds / 1_000_000_000) as i64,
            nanos: (self.nanoseconds % 1_000_000_000) as i32,
        })
    }
}

impl Trace {
    /// What a layout for this trace shows; the views fit what is drawn.
    pub fn topics(&self) -> Topics {
        let planes = Plane::all(&self.names, &self.drawn_axes());
        Topics {
            estimators: vec![self.estimator.clone()],
            names: self.names.clone(),
            axes: planes.iter().map(|p| p.axes).collect(),
            views: planes.iter().map(|p| self.window(p).view()).collect(),
        }
    }

    fn check(&self) -> Result<(), TraceError> {
        let n = self.names.len();
        if n == 0 {
            return Err(TraceError::Nothing("component"));
        }
        if self.steps.is_empty() {
            return Err(TraceError::Nothing("step"));
        }
        for pair in self.steps.windows(2) {
            if pair[1].k <= pair[0].k {
                return Err(TraceError::Order {
                    k: pair[0].k,
                    next: pair[1].k,
                });
            }
        }
        for row in &self.measurement_rows {
            length("row of a measurement", 0, n, row.row.len())?;
        }
        self.steps.iter().try_for_each(|step| self.check_step(step))
    }

    fn check_step(&self, step: &TraceStep) -> Result<(), TraceError> {
        let (n, k) = (self.names.len(), step.k);
        length("center", k, n, step.center.len())?;
        for (what, list) in [
            ("truth", &step.truth),
            ("lower", &step.lower),
            ("upper", &step.upper),
        ] {
            if let Some(list) = list {
                length(what, k, n, list.len())?;
            }
        }
        if let (Some(y), false) = (&step.measurement, self.measurement_rows.is_empty()) {
            length("measurement", k, self.measurement_rows.len(), y.len())?;
        }
        if let Some(z) = &step.zonotope {
            length("rows of the zonotope", k, n, z.n)?;
            length("center of the zonotope", k, n, z.center.len())?;
            length("generators", k, z.n * z.m, z.generators.len())?;
        }
        for outline in &step.outlines {
            let axes = outline.axes;
            if axes.0 >= n || axes.1 >= n || axes.0 == axes.1 {
                return Err(TraceError::Axes { k, n, axes });
            }
        }
        Ok(())
    }

    fn time(&self, k: usize) -> Result<Moment, TraceError> {
        let dt_s = self.dt_s;
        let elapsed_s = k as f64 * dt_s;
        let nanoseconds = (elapsed_s * 1e9).round();
        // 8e18 ns after 2000 is still below 2^63 ns after 1970, which is what readers count in.
        if !(dt_s > 0.0 && nanoseconds < 8e18) {
            return Err(TraceError::Time { k, dt_s });
        }
        Ok(Moment {
            nanoseconds: EPOCH_S * 1_000_000_000 + nanoseconds as u64,
            elapsed_s,
        })
    }

    fn drawn_axes(&self) -> Vec<(usize, usize)> {
        let outlines = self.steps.iter().flat_map(|s| &s.outlines);
        let distinct: BTreeSet<_> = outlines.map(|o| o.axes).collect();
        distinct.into_iter().collect()
    }

    /// Where the true state lies in `plane`, where it is known.
    fn path(&self, plane: &Plane) -> Vec<Point3> {
        let known = self
            .steps
            .iter()
            .filter_map(|s| Some((s.k, s.truth.as_ref()?)));
        known
            .filter_map(|(k, x)| plane.point(k as f64 * self.dt_s, x))
            .collect()
    }

    /// The smallest rectangle around the path and the sets in `plane`.
    fn window(&self, plane: &Plane) -> Window {
        let mut window = Window::empty();
        for p in self.path(plane) {
            window.include(p);
        }
        for step in &self.steps {
            for p in plane.set(step, self.dt_s).unwrap_or_default() {
                window.include(p);
            }
        }
        window
    }

    fn record(&self) -> BTreeMap<String, String> {
        let mut record = self.metadata.clone();
        for (key, value) in [
            ("paper", self.paper.clone()),
            ("experiment", self.experiment.clone()),
            ("estimator", self.estimator.clone()),
            ("kind", self.kind.clone()),
            ("guaranteed", self.guaranteed.to_string()),
            ("dt_s", self.dt_s.to_string()),
        ] {
            record.insert(key.to_owned(), value);
        }
        record
    }

    fn info(&self) -> String {
        let components: Vec<_> = self
            .names
            .iter()
            .map(|(name, unit)| serde_json::json!({ "name": name, "unit": unit }))
            .collect();
        serde_json::json!({
            "components": components,
            "dt_s": self.dt_s,
            "estimator": self.estimator,
            "experiment": self.experiment,
            "guaranteed": self.guaranteed,
            "kind": self.kind,
            "metadata": self.metadata,
            "paper": self.paper,
            "steps": self.steps.len(),
        })
        .to_string()
    }

    /// `radius_m` where all components are in m, `radius` where their units differ.
    fn with_common_unit(&self, name: &str) -> String {
        let unit = &self.names[0].1;
        let common = self.names.iter().all(|(_, u)| u == unit);
        if common && !unit.is_empty() && unit != "1" {
            format!("{name}_{unit}")
        } else {
            name.to_owned()
        }
    }
}

fn length(what: &'static str, k: usize, expected: usize, got: usize) -> Result<(), TraceError> {
    if expected == got {
        return Ok(());
    }
    Err(TraceError::Dimension {
        what,
        k,
        expected,
        got,
    })
}

/// `id` with what a message path cannot hold spelt out (`+` as `_plus`) or replaced by `_`.
fn topic_segment(id: &str) -> String {
    let mut segment = String::new();
    for c in id.chars() {
        match c {
            '+' => segment.push_str("_plus"),
            c if c.is_ascii_alphanumeric() || c == '_' || c == '-' => segment.push(c),
            _ => segment.push('_'),
        }
    }
    segment
}

/// What a set is drawn over: two components, or one over time.
struct Plane {
    /// Twice the same component where it is drawn over time
    axes: (usize, usize),
    /// What the topics' names end with
    suffix: String,
    frame: String,
    title: String,
}

impl Plane {
    /// The planes of a state with the components `names`; `axes` are the pairs asked for. Without any,
    /// neighbours are paired: (0, 1), (2, 3), …, and a last one that is left over with the one before it.
    fn all(names: &[(String, String)], axes: &[(usize, usize)]) -> Vec<Plane> {
        let n = names.len();
        if n == 1 {
            let (name, unit) = &names[0];
            return vec![Plane {
                axes: (0, 0),
                suffix: String::new(),
                frame: "world".to_owned(),
                title: format!("time in s, {}", with_unit(name, unit)),
            }];
        }
        let neighbours = || {
            let mut pairs: Vec<_> = (1..n).step_by(2).map(|i| (i - 1, i)).collect();
            if n % 2 == 1 && n > 1 {
                pairs.push((n - 2, n - 1));
            }
            pairs
        };
        let pairs = if axes.is_empty() {
            neighbours()
        } else {
            axes.to_vec()
        };
        let alone = n == 2 && pairs.len() == 1;
        pairs
            .into_iter()
            .map(|(i, j)| {
                let pair = format!(
                    "{}_{}",
                    topic_segment(&names[i].0),
                    topic_segment(&names[j].0)
                );
                Plane {
                    axes: (i, j),
                    suffix: if alone {
                        String::new()
                    } else {
                        format!("_{pair}")
                    },
                    frame: if alone { "world".to_owned() } else { pair },
                    title: format!(
                        "{}, {}",
                        with_unit(&names[i].0, &names[i].1),
                        with_unit(&names[j].0, &names[j].1)
                    ),
                }
            })
            .collect()
    }

    fn over_time(&self) -> bool {
        self.axes.0 == self.axes.1
    }

    fn point(&self, elapsed_s: f64, x: &[f64]) -> Option<Point3> {
        let first = if self.over_time() {
            elapsed_s
        } else {
            x[self.axes.0]
        };
        drawn([first, x[self.axes.1]])
    }

    /// The outline of the step's set, at least three points; None where there is nothing finite to draw.
    fn set(&self, step: &TraceStep, dt_s: f64) -> Option<Vec<Point3>> {
        let outline = step.outlines.iter().find(|o| o.axes == self.axes);
        if let Some(outline) = outline {
            return polygon(&outline.polygon);
        }
        let (lower, upper) = (step.lower.as_ref()?, step.upper.as_ref()?);
        let (i, j) = self.axes;
        let (left, right) = if self.over_time() {
            let t = step.k as f64 * dt_s;
            (t, t + dt_s)
        } else {
            (lower[i], upper[i])
        };
        rectangle([left, lower[j]], [right, upper[j]])
    }

    /// The part of `window` in which row · x + v = y for some v in the noise; None where the row
    /// depends on what the plane does not show.
    fn strip(
        &self,
        row: &MeasurementRow,
        y: f64,
        elapsed_s: f64,
        dt_s: f64,
        window: &Window,
    ) -> Option<Vec<Point3>> {
        let (i, j) = self.axes;
        let others = row
            .row
            .iter()
            .enumerate()
            .filter(|(l, _)| *l != i && *l != j);
        let (low, high) = (y - row.noise.1, y - row.noise.0);
        if others.into_iter().any(|(_, c)| *c != 0.0) || low.is_nan() || high.is_nan() || low > high
        {
            return None;
        }
        if self.over_time() {
            let (a, b) = (low / row.row[j], high / row.row[j]);
            return rectangle([elapsed_s, a.min(b)], [elapsed_s + dt_s, a.max(b)]);
        }
        let c = [row.row[i], row.row[j]];
        let below = clip(&window.corners()?, c, high);
        polygon(&clip(&below, [-c[0], -c[1]], -low))
    }
}

/// The points of `polygon` with c · p ≤ bound (Sutherland and Hodgman, one edge).
fn clip(polygon: &[[f64; 2]], c: [f64; 2], bound: f64) -> Vec<[f64; 2]> {
    let excess = |p: [f64; 2]| c[0] * p[0] + c[1] * p[1] - bound;
    let mut inside = Vec::new();
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (at_p, at_q) = (excess(p), excess(q));
        if at_p <= 0.0 {
            inside.push(p);
        }
        if (at_p < 0.0 && at_q > 0.0) || (at_p > 0.0 && at_q < 0.0) {
            let s = at_p / (at_p - at_q);
            inside.push([p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]);
        }
    }
    inside
}

/// A point as it is drawn, None where it is not finite. Viewers draw in single precision; rounding to it
/// here halves the files. The numbers themselves are in the metrics and the zonotope, unrounded.
fn drawn(p: [f64; 2]) -> Option<Point3> {
    let [x, y] = p.map(|v| f64::from(v as f32));
    (x.is_finite() && y.is_finite()).then_some(Point3 { x, y, z: 0.0 })
}

/// The polygon as it is drawn: None where a vertex is not finite or it is a mere point; a segment gets
/// its middle as a third point, since viewers leave out lines of two.
fn polygon(vertices: &[[f64; 2]]) -> Option<Vec<Point3>> {
    let mut points = vertices
        .iter()
        .map(|v| drawn(*v))
        .collect::<Option<Vec<_>>>()?;
    if let [a, b] = points[..] {
        let middle = drawn([(a.x + b.x) / 2.0, (a.y + b.y) / 2.0])?;
        points.insert(1, middle);
    }
    (points.len() >= 3).then_some(points)
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> Option<Vec<Point3>> {
    if !(low[0] <= high[0] && low[1] <= high[1]) {
        return None;
    }
    polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]])
}

/// A rectangle that grows around what is drawn.
struct Window {
    low: [f64; 2],
    high: [f64; 2],
}

impl Window {
    fn empty() -> Self {
        Window {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }

    fn include(&mut self, p: Point3) {
        for (i, v) in [p.x, p.y].into_iter().enumerate() {
            self.low[i] = self.low[i].min(v);
            self.high[i] = self.high[i].max(v);
        }
    }

    fn corners(&self) -> Option<[[f64; 2]; 4]> {
        let ([left, bottom], [right, top]) = (self.low, self.high);
        (left <= right).then_some([[left, bottom], [right, bottom], [right, top], [left, top]])
    }

    /// All of it with a tenth to spare, one unit at least.
    fn view(&self) -> View {
        if self.corners().is_none() {
            return View {
                center: [0.0, 0.0],
                height: 20.0,
            };
        }
        let size = (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]);
        View {
            center: [0, 1].map(|i| (self.low[i] + self.high[i]) / 2.0),
            height: 1.1 * if size > 0.0 { size } else { 1.0 },
        }
    }
}

/// The messages of a file before they are written, topic by topic.
struct Recording {
    topics: Vec<Topic>,
}

struct Topic {
    name: String,
    schema: &'static str,
    /// Time and bytes
    messages: Vec<(u64, Vec<u8>)>,
}

impl Recording {
    /// Every message of the trace. The topics stand in the order in which their ids are given.
    fn of(trace: &Trace) -> Result<Self, TraceError> {
        let moments = trace
            .steps
            .iter()
            .map(|step| trace.time(step.k))
            .collect::<Result<Vec<_>, _>>()?;
        let method = topic_segment(&trace.estimator);
        let mut topics = vec![Topic {
            name: "/run/info".to_owned(),
            schema: RUN_INFO,
            messages: vec![(moments[0].nanoseconds, trace.info().into_bytes())],
        }];
        let mut topic = |name: String, schema, messages: Vec<(u64, Vec<u8>)>| {
            if !messages.is_empty() {
                topics.push(Topic {
                    name,
                    schema,
                    messages,
                });
            }
        };
        let steps = || trace.steps.iter().zip(moments.iter().copied());
        for plane in &Plane::all(&trace.names, &trace.drawn_axes()) {
            let suffix = &plane.suffix;
            let window = trace.window(plane);
            let path = path_scene(trace, plane, moments[0]);
            topic(
                format!("/truth/path{suffix}"),
                SCENE,
                path.into_iter().collect(),
            );
            let truth = steps().filter_map(|(s, at)| pose(plane, at, s.truth.as_ref()?));
            topic(format!("/truth/pose{suffix}"), POSE, truth.collect());
            let center = steps().filter_map(|(s, at)| pose(plane, at, &s.center));
            topic(format!("/estimate/center{suffix}"), POSE, center.collect());
            let sets = steps().map(|(s, at)| set_scene(trace, plane, s, at));
            topic(
                format!("/estimate/{method}/set{suffix}"),
                SCENE,
                sets.collect(),
            );
            topic(
                format!("/estimate/{method}/tube{suffix}"),
                SCENE,
                tube_scenes(trace, plane, &moments),
            );
            let strips = steps().filter_map(|(s, at)| strip_scene(trace, plane, s, at, &window));
            topic(format!("/measurement/set{suffix}"), SCENE, strips.collect());
        }
        let numbers = steps().map(|(s, at)| metrics(s, at));
        topic(
            format!("/estimate/{method}/metrics"),
            METRICS,
            numbers.collect(),
        );
        let exact = steps().filter_map(|(s, at)| zonotope(s, at));
        topic(
            format!("/estimate/{method}/zonotope"),
            ZONOTOPE,
            exact.collect(),
        );
        let log = steps().filter_map(|(s, at)| warning(trace, s, at));
        topic("/log".to_owned(), LOG, log.collect());
        topics.extend(space::topics(trace, &moments));
        Ok(Recording { topics })
    }

    /// Schemas and channels first, in the order of the topics, then the messages by time.
    fn send<W: Write + Seek>(&self, writer: &mut mcap::Writer<W>) -> Result<(), TraceError> {
        let mut order = Vec::new();
        for (i, topic) in self.topics.iter().enumerate() {
            let (schema, encoding) = match topic.schema {
                RUN_INFO => {
                    let schema = RUN_INFO_SCHEMA.as_bytes();
                    (writer.add_schema(RUN_INFO, "jsonschema", schema)?, "json")
                }
                name => {
                    let bytes = schema(name).expect("every topic's schema is in the table");
                    (writer.add_schema(name, "protobuf", &bytes)?, "protobuf")
                }
            };
            let channel = writer.add_channel(schema, &topic.name, encoding, &BTreeMap::new())?;
            for (sequence, (time, bytes)) in (0..).zip(&topic.messages) {
                let header = MessageHeader {
                    channel_id: channel,
                    sequence,
                    log_time: *time,
                    publish_time: *time,
                };
                order.push((*time, i, header, bytes));
            }
        }
        // Stable: at one time the topics keep their order.
        order.sort_by_key(|(time, topic, ..)| (*time, *topic));
        for (_, _, header, bytes) in order {
            writer.write_to_known_channel(&header, bytes)?;
        }
        Ok(())
    }
}

fn encoded(at: Moment, message: &impl Message) -> (u64, Vec<u8>) {
    (at.nanoseconds, message.encode_to_vec())
}

fn entity(plane: &Plane, at: Moment, id: &str) -> SceneEntity {
    SceneEntity {
        timestamp: at.timestamp(),
        frame_id: plane.frame.clone(),
        id: id.to_owned(),
        ..SceneEntity::default()
    }
}

fn line(points: Vec<Point3>, r#type: i32, thickness: f64, color: Color) -> LinePrimitive {
    LinePrimitive {
        r#type,
        pose: Some(Pose::at(0.0, 0.0)),
        thickness,
        scale_invariant: true,
        points,
        color: Some(color),
    }
}

/// The convex polygon as triangles around its first vertex.
fn fill(points: Vec<Point3>, color: Color) -> TriangleListPrimitive {
    let last = u32::try_from(points.len()).expect("a polygon has few vertices");
    TriangleListPrimitive {
        pose: Some(Pose::at(0.0, 0.0)),
        indices: (2..last).flat_map(|i| [0, i - 1, i]).collect(),
        points,
        color: Some(color),
    }
}

/// A scene of these entities; without any, one that clears what the topic drew before.
fn scene(at: Moment, entities: Vec<SceneEntity>) -> (u64, Vec<u8>) {
    let deletions = if entities.is_empty() {
        vec![SceneEntityDeletion {
            timestamp: at.timestamp(),
            r#type: DELETE_ALL,
            id: String::new(),
        }]
    } else {
        Vec::new()
    };
    encoded(
        at,
        &SceneUpdate {
            deletions,
            entities,
        },
    )
}

fn path_scene(trace: &Trace, plane: &Plane, at: Moment) -> Option<(u64, Vec<u8>)> {
    let points = trace.path(plane);
    if points.len() < 3 {
        return None;
    }
    let mut path = entity(plane, at, "path");
    path.lines = vec![line(points, LINE_STRIP, 2.0, TRUTH_COLOR)];
    Some(scene(at, vec![path]))
}

fn pose(plane: &Plane, at: Moment, x: &[f64]) -> Option<(u64, Vec<u8>)> {
    let p = plane.point(at.elapsed_s, x)?;
    let pose = PoseInFrame {
        timestamp: at.timestamp(),
        frame_id: plane.frame.clone(),
        pose: Some(Pose::at(p.x, p.y)),
    };
    Some(encoded(at, &pose))
}

fn set_scene(trace: &Trace, plane: &Plane, step: &TraceStep, at: Moment) -> (u64, Vec<u8>) {
    let Some(points) = plane.set(step, trace.dt_s) else {
        return scene(at, Vec::new());
    };
    let color = if step.status == "ok" {
        SET_COLOR
    } else {
        ALARM_COLOR
    };
    let mut outline = entity(plane, at, "outline");
    outline.lines = vec![line(points.clone(), LINE_LOOP, 2.0, color)];
    outline.metadata = step
        .metrics
        .iter()
        .filter_map(|(name, value)| {
            let key = match name.as_str() {
                "n_generators" | "n_constraints" => name.clone(),
                "radius" | "error" => trace.with_common_unit(name),
                _ => return None,
            };
            let value = value.to_string();
            Some(KeyValuePair { key, value })
        })
        .collect();
    let mut area = entity(plane, at, "fill");
    area.triangles = vec![fill(points, Color { a: 0.2, ..color })];
    scene(at, vec![outline, area])
}

/// At each step the outlines of the last [`TUBE_LENGTH`] steps, the older the fainter.
fn tube_scenes(trace: &Trace, plane: &Plane, moments: &[Moment]) -> Vec<(u64, Vec<u8>)> {
    let sets: Vec<_> = trace
        .steps
        .iter()
        .map(|s| plane.set(s, trace.dt_s))
        .collect();
    let scenes = moments.iter().enumerate().map(|(last, at)| {
        let first = (last + 1).saturating_sub(TUBE_LENGTH);
        let lines: Vec<_> = (first..=last)
            .filter_map(|i| {
                let age = (last - i) as f64 / TUBE_LENGTH as f64;
                let color = Color {
                    a: 0.6 - 0.5 * age,
                    ..SET_COLOR
                };
                Some(line(sets[i].clone()?, LINE_LOOP, 1.0, color))
            })
            .collect();
        if lines.is_empty() {
            return scene(*at, Vec::new());
        }
        let mut tube = entity(plane, *at, "tube");
        tube.lines = lines;
        scene(*at, vec![tube])
    });
    scenes.collect()
}

fn strip_scene(
    trace: &Trace,
    plane: &Plane,
    step: &TraceStep,
    at: Moment,
    window: &Window,
) -> Option<(u64, Vec<u8>)> {
    let period = (trace.dt_s * 1e9).round() as i64;
    let lifetime = Duration {
        seconds: period / 1_000_000_000,
        nanos: (period % 1_000_000_000) as i32,
    };
    let measured = trace
        .measurement_rows
        .iter()
        .zip(step.measurement.as_ref()?);
    let strips: Vec<_> = measured
        .filter_map(|(row, y)| {
            let points = plane.strip(row, (*y)?, at.elapsed_s, trace.dt_s, window)?;
            let mut strip = entity(plane, at, &format!("strip_{}", row.name));
            strip.lifetime = Some(lifetime);
            strip.lines = vec![line(points.clone(), LINE_LOOP, 1.0, STRIP_COLOR)];
            strip.triangles = vec![fill(
                points,
                Color {
                    a: 0.15,
                    ..STRIP_COLOR
                },
            )];
            Some(strip)
        })
        .collect();
    (!strips.is_empty()).then(|| scene(at, strips))
}

fn metrics(step: &TraceStep, at: Moment) -> (u64, Vec<u8>) {
    let measured = step.measurement.as_ref();
    let mut metrics = StepMetrics {
        timestamp: at.timestamp(),
        k: step.k as u64,
        status: step.status.clone(),
        center: step.center.clone(),
        lower: step.lower.clone().unwrap_or_default(),
        upper: step.upper.clone().unwrap_or_default(),
        truth: step.truth.clone().unwrap_or_default(),
        measurement: measured.map_or_else(Vec::new, |y| {
            y.iter().map(|v| v.unwrap_or(f64::NAN)).collect()
        }),
        ..StepMetrics::default()
    };
    for (name, value) in &step.metrics {
        metrics.set(name, *value);
    }
    encoded(at, &metrics)
}

fn zonotope(step: &TraceStep, at: Moment) -> Option<(u64, Vec<u8>)> {
    let z = step.zonotope.as_ref()?;
    let count = |size: usize| {
        u32::try_from(size).expect("a list that fits in memory has fewer than 2^32 values")
    };
    let message = messages::Zonotope {
        timestamp: at.timestamp(),
        k: step.k as u64,
        center: z.center.clone(),
        generators: z.generators.clone(),
        n: count(z.n),
        m: count(z.m),
    };
    Some(encoded(at, &message))
}

fn warning(trace: &Trace, step: &TraceStep, at: Moment) -> Option<(u64, Vec<u8>)> {
    let what = match step.status.as_str() {
        "ok" => return None,
        "inconsistent" => {
            "no state fits both the model and the measurement (inconsistent)".to_owned()
        }
        "refused" => "the estimator refuses to go on".to_owned(),
        other => other.to_owned(),
    };
    let log = Log {
        timestamp: at.timestamp(),
        level: LOG_WARNING,
        message: format!("k = {}: {what}", step.k),
        name: trace.estimator.clone(),
    };
    Some(encoded(at, &log))
}

#[cfg(test)]
mod tests;
