//! The messages a trace is made of, as they go over the wire.
//!
//! The `foxglove.*` types carry the field numbers of the published schemas; of a type with many kinds
//! of primitives only the fields that are drawn stand here, the rest is empty on the wire. What a
//! reader is told about the types, the whole of each, is in [`schemas`](super::schemas).

use prost::Message;
use prost_types::{Duration, Timestamp};

/// Red, green, blue and opacity, each in \[0, 1\].
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Color {
    /// Red
    #[prost(double, tag = "1")]
    pub r: f64,
    /// Green
    #[prost(double, tag = "2")]
    pub g: f64,
    /// Blue
    #[prost(double, tag = "3")]
    pub b: f64,
    /// Opacity
    #[prost(double, tag = "4")]
    pub a: f64,
}

/// A point of the scene.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Point3 {
    /// First coordinate
    #[prost(double, tag = "1")]
    pub x: f64,
    /// Second coordinate
    #[prost(double, tag = "2")]
    pub y: f64,
    /// Third coordinate, zero for everything drawn here
    #[prost(double, tag = "3")]
    pub z: f64,
}

/// A position.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Vector3 {
    /// First coordinate
    #[prost(double, tag = "1")]
    pub x: f64,
    /// Second coordinate
    #[prost(double, tag = "2")]
    pub y: f64,
    /// Third coordinate
    #[prost(double, tag = "3")]
    pub z: f64,
}

/// A rotation. The default, all zeros, is none: [`Pose::at`] writes w = 1.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Quaternion {
    /// First imaginary part
    #[prost(double, tag = "1")]
    pub x: f64,
    /// Second imaginary part
    #[prost(double, tag = "2")]
    pub y: f64,
    /// Third imaginary part
    #[prost(double, tag = "3")]
    pub z: f64,
    /// Real part
    #[prost(double, tag = "4")]
    pub w: f64,
}

/// Position and rotation.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Pose {
    /// Where
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3>,
    /// How turned
    #[prost(message, optional, tag = "2")]
    pub orientation: Option<Quaternion>,
}

impl Pose {
    /// The pose at (x, y, 0) that is not turned.
    pub fn at(x: f64, y: f64) -> Self {
        Pose {
            position: Some(Vector3 { x, y, z: 0.0 }),
            orientation: Some(Quaternion {
                x: 0.0,
                y: 0.0,
                z: 0.0,
                w: 1.0,
            }),
        }
    }
}

/// A pose at a time in a frame.
#[derive(Clone, PartialEq, Message)]
pub struct PoseInFrame {
    /// When
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// In which coordinates
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// Where
    #[prost(message, optional, tag = "3")]
    pub pose: Option<Pose>,
}

/// A name and its value, as text.
#[derive(Clone, PartialEq, Eq, Hash, Message)]
pub struct KeyValuePair {
    /// The name
    #[prost(string, tag = "1")]
    pub key: String,
    /// The value
    #[prost(string, tag = "2")]
    pub value: String,
}

/// A line through points.
#[derive(Clone, PartialEq, Message)]
pub struct LinePrimitive {
    /// Whether it closes: [`LINE_STRIP`] or [`LINE_LOOP`]
    #[prost(int32, tag = "1")]
    pub r#type: i32,
    /// Where its origin lies
    #[prost(message, optional, tag = "2")]
    pub pose: Option<Pose>,
    /// Its width, in pixels when `scale_invariant`
    #[prost(double, tag = "3")]
    pub thickness: f64,
    /// Whether `thickness` counts pixels
    #[prost(bool, tag = "4")]
    pub scale_invariant: bool,
    /// Its points, in order
    #[prost(message, repeated, tag = "5")]
    pub points: Vec<Point3>,
    /// Its colour
    #[prost(message, optional, tag = "6")]
    pub color: Option<Color>,
}

/// A line that ends at its last point.
pub const LINE_STRIP: i32 = 0;
/// A line that returns to its first point.
pub const LINE_LOOP: i32 = 1;

/// Triangles, three points each.
#[derive(Clone, PartialEq, Message)]
pub struct TriangleListPrimitive {
    /// Where its origin lies
    #[prost(message, optional, tag = "1")]
    pub pose: Option<Pose>,
    /// The corners
    #[prost(message, repeated, tag = "2")]
    pub points: Vec<Point3>,
    /// The colour of all
    #[prost(message, optional, tag = "3")]
    pub color: Option<Color>,
    /// Three corners a triangle, by their place in `points`
    #[prost(fixed32, repeated, tag = "5")]
    pub indices: Vec<u32>,
}

/// One thing in the scene; a later one of the same id on the same topic takes its place.
#[derive(Clone, PartialEq, Message)]
pub struct SceneEntity {
    /// When
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// In which coordinates
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// Its name on its topic
    #[prost(string, tag = "3")]
    pub id: String,
    /// How long it is shown; none or zero: until it is replaced
    #[prost(message, optional, tag = "4")]
    pub lifetime: Option<Duration>,
    /// What a click on it shows
    #[prost(message, repeated, tag = "6")]
    pub metadata: Vec<KeyValuePair>,
    /// Its lines
    #[prost(message, repeated, tag = "11")]
    pub lines: Vec<LinePrimitive>,
    /// Its areas
    #[prost(message, repeated, tag = "12")]
    pub triangles: Vec<TriangleListPrimitive>,
}

/// The order to take things out of the scene.
#[derive(Clone, PartialEq, Eq, Hash, Message)]
pub struct SceneEntityDeletion {
    /// What is older than this goes
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// [`DELETE_ALL`], all of the topic
    #[prost(int32, tag = "2")]
    pub r#type: i32,
    /// Which, where the type asks for one
    #[prost(string, tag = "3")]
    pub id: String,
}

/// Everything the topic has drawn goes.
pub const DELETE_ALL: i32 = 1;

/// A change of the scene; here always the whole of what its topic shows.
#[derive(Clone, PartialEq, Message)]
pub struct SceneUpdate {
    /// What goes
    #[prost(message, repeated, tag = "1")]
    pub deletions: Vec<SceneEntityDeletion>,
    /// What comes
    #[prost(message, repeated, tag = "2")]
    pub entities: Vec<SceneEntity>,
}

/// A line of the log.
#[derive(Clone, PartialEq, Eq, Hash, Message)]
pub struct Log {
    /// When
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// How grave: [`LOG_WARNING`]
    #[prost(int32, tag = "2")]
    pub level: i32,
    /// What happened
    #[prost(string, tag = "3")]
    pub message: String,
    /// Who says so
    #[prost(string, tag = "4")]
    pub name: String,
}

/// The level of a finding that the run survives.
pub const LOG_WARNING: i32 = 3;

/// One number of a step that has no field of its own in [`StepMetrics`].
#[derive(Clone, PartialEq, Message)]
pub struct NamedValue {
    /// Its name
    #[prost(string, tag = "1")]
    pub name: String,
    /// Its value
    #[prost(double, tag = "2")]
    pub value: f64,
}

/// The numbers of one step, for curves over time; absent where not computed.
#[derive(Clone, PartialEq, Message)]
pub struct StepMetrics {
    /// When
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The step
    #[prost(uint64, tag = "2")]
    pub k: u64,
    /// `ok`, `inconsistent`
    #[prost(string, tag = "3")]
    pub status: String,
    /// The point estimate, a value a component
    #[prost(double, repeated, tag = "4")]
    pub center: Vec<f64>,
    /// Lower ends of the interval hull
    #[prost(double, repeated, tag = "5")]
    pub lower: Vec<f64>,
    /// Upper ends of the interval hull
    #[prost(double, repeated, tag = "6")]
    pub upper: Vec<f64>,
    /// The true state
    #[prost(double, repeated, tag = "7")]
    pub truth: Vec<f64>,
    /// The measurement; NaN for a component that was not measured
    #[prost(double, repeated, tag = "8")]
    pub measurement: Vec<f64>,
    /// Distance of the point estimate from the truth
    #[prost(double, optional, tag = "9")]
    pub error: Option<f64>,
    /// Greatest half-width of the interval hull
    #[prost(double, optional, tag = "10")]
    pub radius: Option<f64>,
    /// Volume of the set
    #[prost(double, optional, tag = "11")]
    pub volume: Option<f64>,
    /// tr(G Gᵀ)
    #[prost(double, optional, tag = "12")]
    pub trace_ggt: Option<f64>,
    /// Number of generators
    #[prost(double, optional, tag = "13")]
    pub n_generators: Option<f64>,
    /// Number of constraints
    #[prost(double, optional, tag = "14")]
    pub n_constraints: Option<f64>,
    /// 1 where the set contains the truth, 0 where it does not
    #[prost(double, optional, tag = "15")]
    pub contains_truth: Option<f64>,
    /// Everything else
    #[prost(message, repeated, tag = "16")]
    pub others: Vec<NamedValue>,
}

impl StepMetrics {
    /// Puts `value` into the field called `name`, or among the others.
    pub fn set(&mut self, name: &str, value: f64) {
        let field = match name {
            "error" => &mut self.error,
            "radius" => &mut self.radius,
            "volume" => &mut self.volume,
            "trace_ggt" => &mut self.trace_ggt,
            "n_generators" => &mut self.n_generators,
            "n_constraints" => &mut self.n_constraints,
            "contains_truth" => &mut self.contains_truth,
            _ => {
                return self.others.push(NamedValue {
                    name: name.to_owned(),
                    value,
                });
            }
        };
        *field = Some(value);
    }
}

/// A zonotope c ⊕ G \[-1, 1\]ᵐ as it is, for machines.
#[derive(Clone, PartialEq, Message)]
pub struct Zonotope {
    /// When
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The step
    #[prost(uint64, tag = "2")]
    pub k: u64,
    /// c, n values
    #[prost(double, repeated, tag = "3")]
    pub center: Vec<f64>,
    /// G, n × m, row by row
    #[prost(double, repeated, tag = "4")]
    pub generators: Vec<f64>,
    /// Number of components
    #[prost(uint32, tag = "5")]
    pub n: u32,
    /// Number of generators
    #[prost(uint32, tag = "6")]
    pub m: u32,
}
