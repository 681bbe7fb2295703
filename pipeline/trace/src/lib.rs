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
mod plane;
mod scene;
mod schemas;
mod space;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use prost_types::Timestamp;
use thiserror::Error;

pub use layout::{Topics, View, layout_json};
pub use schemas::schema;

use messages::Point3;
use plane::{Plane, Window};
use scene::{metrics, path_scene, pose, set_scene, strip_scene, tube_scenes, warning, zonotope};

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
    #[error(
        "time of k = {k}: expected steps at least 1 ns apart and at most {LONGEST_S:e} s in all, got dt = {dt_s:?} s"
    )]
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

/// The shortest time from step to step, in s: stamps are whole nanoseconds, and no two steps have the same.
pub const SHORTEST_S: f64 = 1e-9;

/// The longest time from the first step to the last, in s: 8e18 ns after 2000 is still below 2^63 ns after 1970, which
/// is what readers count in.
pub const LONGEST_S: f64 = 8e9;

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
        if !(dt_s >= SHORTEST_S && elapsed_s <= LONGEST_S) {
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

#[cfg(test)]
mod tests;
