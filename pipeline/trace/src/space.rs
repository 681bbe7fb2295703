//! The flight in three dimensions: the path and the boxes around the position, for states whose first three
//! components are positions in m.
//!
//! Topics in the frame `space`: `/truth/path_space`, `/truth/pose_space`, `/estimate/<id>/box_space` (the hull of
//! each step in place of the one before) and `/estimate/<id>/boxes_space` (one of every hundred steps, which stay).

use super::messages::{
    LINE_LOOP, LINE_STRIP, LinePrimitive, Point3, Pose, PoseInFrame, Quaternion, SceneEntity,
    Vector3,
};
use super::scene::{ALARM_COLOR, SET_COLOR, TRUTH_COLOR, encoded, line, scene};
use super::{Moment, POSE, SCENE, Topic, Trace, TraceStep, topic_segment};

/// The frame of the three positions.
pub(super) const FRAME: &str = "space";

/// Steps from one box that stays to the next.
const BETWEEN: usize = 100;

/// True if the state, given by the names and units of its components, begins with a position.
pub(super) fn is_in_space(names: &[(String, String)]) -> bool {
    let position = names
        .iter()
        .take(3)
        .map(|(name, unit)| (name.as_str(), unit.as_str()));
    position.eq([("x", "m"), ("y", "m"), ("z", "m")])
}

/// The topics of a trace with its moments, none if the state does not begin with a position.
pub(super) fn topics(trace: &Trace, moments: &[Moment]) -> Vec<Topic> {
    if !is_in_space(&trace.names) {
        return Vec::new();
    }
    let steps = || trace.steps.iter().zip(moments.iter().copied());
    let method = topic_segment(&trace.estimator);
    let path: Vec<Point3> = steps()
        .filter_map(|(step, _)| point(step.truth.as_ref()?))
        .collect();
    let mut all = Vec::new();
    let mut topic = |name: String, schema, messages: Vec<(u64, Vec<u8>)>| {
        if !messages.is_empty() {
            all.push(Topic {
                name,
                schema,
                messages,
            });
        }
    };
    if path.len() >= 3 {
        let mut drawn = entity(moments[0], "path");
        drawn.lines = vec![line(path, LINE_STRIP, 2.0, TRUTH_COLOR)];
        topic(
            "/truth/path_space".to_owned(),
            SCENE,
            vec![scene(moments[0], vec![drawn])],
        );
    }
    let poses = steps().filter_map(|(step, at)| pose(step, at));
    topic("/truth/pose_space".to_owned(), POSE, poses.collect());
    let now = steps().map(|(step, at)| match cuboid(step) {
        Some(lines) => {
            let mut drawn = entity(at, "box");
            drawn.lines = lines;
            scene(at, vec![drawn])
        }
        None => scene(at, Vec::new()),
    });
    topic(
        format!("/estimate/{method}/box_space"),
        SCENE,
        now.collect(),
    );
    // The prior cut by one measurement would hide the rest.
    // A long trace holds every sixth step or so: of each hundred the first that it has.
    let mut hundreds = 0;
    let kept = steps().filter(|(step, _)| {
        let first = step.k / BETWEEN > hundreds;
        hundreds = step.k / BETWEEN;
        first
    });
    let kept = kept.filter_map(|(step, at)| {
        let mut drawn = entity(at, &format!("box_{}", step.k));
        drawn.lines = cuboid(step)?;
        Some(scene(at, vec![drawn]))
    });
    topic(
        format!("/estimate/{method}/boxes_space"),
        SCENE,
        kept.collect(),
    );
    all
}

fn entity(at: Moment, id: &str) -> SceneEntity {
    SceneEntity {
        timestamp: at.timestamp(),
        frame_id: FRAME.to_owned(),
        id: id.to_owned(),
        ..SceneEntity::default()
    }
}

/// A point in single precision, which is what viewers draw in.
fn point(x: &[f64]) -> Option<Point3> {
    let [x, y, z] = [x[0], x[1], x[2]].map(|v| f64::from(v as f32));
    (x.is_finite() && y.is_finite() && z.is_finite()).then_some(Point3 { x, y, z })
}

/// The edges of the hull of the position: its two faces across z, and the four edges between them.
fn cuboid(step: &TraceStep) -> Option<Vec<LinePrimitive>> {
    let (low, high) = (point(step.lower.as_ref()?)?, point(step.upper.as_ref()?)?);
    let color = match step.status.as_str() {
        "ok" => SET_COLOR,
        _ => ALARM_COLOR,
    };
    let corners = |z: f64| {
        [
            (low.x, low.y),
            (high.x, low.y),
            (high.x, high.y),
            (low.x, high.y),
        ]
        .map(|(x, y)| Point3 { x, y, z })
    };
    let (floor, top) = (corners(low.z), corners(high.z));
    let mut lines = vec![
        line(floor.to_vec(), LINE_LOOP, 1.5, color),
        line(top.to_vec(), LINE_LOOP, 1.5, color),
    ];
    for (a, b) in floor.into_iter().zip(top) {
        // Viewers leave out lines of two points.
        let middle = Point3 {
            z: 0.5 * (a.z + b.z),
            ..a
        };
        lines.push(line(vec![a, middle, b], LINE_STRIP, 1.5, color));
    }
    Some(lines)
}

/// The true position, turned by the angles φ, θ, ψ where the state has them: R_z(ψ) R_y(θ) R_x(φ).
fn pose(step: &TraceStep, at: Moment) -> Option<(u64, Vec<u8>)> {
    let truth = step.truth.as_ref()?;
    let p = point(truth)?;
    let half = |i: usize| {
        let angle = 0.5 * truth.get(i).copied().unwrap_or(0.0);
        (libm::sin(angle), libm::cos(angle))
    };
    let ((sr, cr), (sp, cp), (sy, cy)) = (half(6), half(7), half(8));
    let pose = Pose {
        position: Some(Vector3 {
            x: p.x,
            y: p.y,
            z: p.z,
        }),
        orientation: Some(Quaternion {
            x: sr * cp * cy - cr * sp * sy,
            y: cr * sp * cy + sr * cp * sy,
            z: cr * cp * sy - sr * sp * cy,
            w: cr * cp * cy + sr * sp * sy,
        }),
    };
    Some(encoded(
        at,
        &PoseInFrame {
            timestamp: at.timestamp(),
            frame_id: FRAME.to_owned(),
            pose: Some(pose),
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_around_a_position_has_twelve_edges() {
        let step = TraceStep {
            lower: Some(vec![-1.0, -2.0, 0.0]),
            upper: Some(vec![1.0, 2.0, 3.0]),
            status: "ok".to_owned(),
            ..TraceStep::default()
        };
        let lines = cuboid(&step).unwrap();
        assert_eq!(lines.len(), 6);
        let edges: usize = lines
            .iter()
            .map(|l| if l.r#type == LINE_LOOP { 4 } else { 1 })
            .sum();
        assert_eq!(edges, 12);
        assert!(lines[0].points.iter().all(|p| p.z == 0.0));
        assert!(lines[1].points.iter().all(|p| p.z == 3.0));
        let unbounded = TraceStep {
            upper: Some(vec![1.0, f64::INFINITY, 3.0]),
            ..step
        };
        assert!(cuboid(&unbounded).is_none());
    }
}
