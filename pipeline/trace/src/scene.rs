//! The messages of one step: scenes of sets, paths and strips, poses, numbers, warnings.

use super::messages::{
    self, Color, DELETE_ALL, KeyValuePair, LINE_LOOP, LINE_STRIP, LOG_WARNING, LinePrimitive, Log,
    Point3, Pose, PoseInFrame, SceneEntity, SceneEntityDeletion, SceneUpdate, StepMetrics,
    TriangleListPrimitive,
};
use super::plane::{Plane, Window};
use super::{Moment, Trace, TraceStep};
use prost::Message;
use prost_types::Duration;

/// How many outlines a tube shows.
pub(super) const TUBE_LENGTH: usize = 10;

/// Orange, sky blue, green, vermilion: told apart by people who see few colours, on light and dark.
pub(super) const TRUTH_COLOR: Color = color(0.902, 0.624, 0.0, 1.0);
pub(super) const SET_COLOR: Color = color(0.337, 0.706, 0.914, 1.0);
const STRIP_COLOR: Color = color(0.0, 0.62, 0.451, 1.0);
pub(super) const ALARM_COLOR: Color = color(0.835, 0.369, 0.0, 1.0);

const fn color(r: f64, g: f64, b: f64, a: f64) -> Color {
    Color { r, g, b, a }
}

pub(super) fn encoded(at: Moment, message: &impl Message) -> (u64, Vec<u8>) {
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

pub(super) fn line(
    points: Vec<Point3>,
    r#type: i32,
    thickness: f64,
    color: Color,
) -> LinePrimitive {
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
pub(super) fn scene(at: Moment, entities: Vec<SceneEntity>) -> (u64, Vec<u8>) {
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

pub(super) fn path_scene(trace: &Trace, plane: &Plane, at: Moment) -> Option<(u64, Vec<u8>)> {
    let points = trace.path(plane);
    if points.len() < 3 {
        return None;
    }
    let mut path = entity(plane, at, "path");
    path.lines = vec![line(points, LINE_STRIP, 2.0, TRUTH_COLOR)];
    Some(scene(at, vec![path]))
}

pub(super) fn pose(plane: &Plane, at: Moment, x: &[f64]) -> Option<(u64, Vec<u8>)> {
    let p = plane.point(at.elapsed_s, x)?;
    let pose = PoseInFrame {
        timestamp: at.timestamp(),
        frame_id: plane.frame.clone(),
        pose: Some(Pose::at(p.x, p.y)),
    };
    Some(encoded(at, &pose))
}

pub(super) fn set_scene(
    trace: &Trace,
    plane: &Plane,
    step: &TraceStep,
    at: Moment,
) -> (u64, Vec<u8>) {
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
pub(super) fn tube_scenes(trace: &Trace, plane: &Plane, moments: &[Moment]) -> Vec<(u64, Vec<u8>)> {
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

pub(super) fn strip_scene(
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

pub(super) fn metrics(step: &TraceStep, at: Moment) -> (u64, Vec<u8>) {
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

pub(super) fn zonotope(step: &TraceStep, at: Moment) -> Option<(u64, Vec<u8>)> {
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

pub(super) fn warning(trace: &Trace, step: &TraceStep, at: Moment) -> Option<(u64, Vec<u8>)> {
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
