//! The layout a viewer is given: which panels there are and what each shows.
//!
//! Scene topics are hidden in the viewers until somebody ticks them, so the layout names each one and
//! makes it visible; the sets are then on the screen as soon as the file and the layout are open.
//! The form is the one the apps import and export (`configById`, a mosaic `layout`, …).

use serde_json::{Map, Value, json};

use super::plane::Plane;
use super::space::{FRAME, is_in_space};
use super::topic_segment;

/// What there is to show.
#[derive(Clone, Debug, Default)]
pub struct Topics {
    /// The estimators, by id
    pub estimators: Vec<String>,
    /// Name and unit of each component of the state
    pub names: Vec<(String, String)>,
    /// Pairs of components that sets are drawn over; ignored below three components
    pub axes: Vec<(usize, usize)>,
    /// What each plane's panel shows at first, in the order of `axes`; a plane without one shows
    /// 20 units around the origin
    pub views: Vec<View>,
}

/// The part of a plane that is on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The middle
    pub center: [f64; 2],
    /// Height, in units of the second axis
    pub height: f64,
}

/// More plots than this would be too low to read; the components after them have none.
const MOST_PLOTS: usize = 4;

/// A layout for the traces of `paper`, as JSON text that ends with a line feed.
///
/// Beside each other: a flat view of every plane with the truth, the sets, their tubes and the
/// measurement sets, all visible; a plot of each component (truth, estimate, hull), one of error and
/// radius, and the log.
pub fn layout_json(paper: &str, topics: &Topics) -> String {
    let mut panels = Map::new();
    let mut scenes = Vec::new();
    if is_in_space(&topics.names) {
        let id = format!("3D!{paper}_space");
        panels.insert(id.clone(), in_space(topics));
        scenes.push(id);
    }
    for (i, plane) in Plane::all(&topics.names, &topics.axes).iter().enumerate() {
        let id = format!("3D!{paper}_set{}", plane.suffix);
        panels.insert(id.clone(), scene(topics, plane, topics.views.get(i)));
        scenes.push(id);
    }
    let mut plots = Vec::new();
    for (i, (name, unit)) in topics.names.iter().enumerate().take(MOST_PLOTS) {
        let id = format!("Plot!{paper}_{}", topic_segment(name));
        panels.insert(id.clone(), component_plot(topics, i, name, unit));
        plots.push(id);
    }
    let id = format!("Plot!{paper}_size");
    panels.insert(id.clone(), size_plot(topics));
    plots.push(id);
    let id = format!("RosOut!{paper}_log");
    panels.insert(
        id.clone(),
        json!({ "foxglovePanelTitle": "Log", "searchTerms": [], "minLogLevel": 1, "topicToRender": "/log" }),
    );
    plots.push(id);

    let layout = json!({
        "configById": panels,
        "globalVariables": {},
        "layout": {
            "direction": "row",
            "first": stack(&scenes),
            "second": stack(&plots),
            "splitPercentage": 60,
        },
        "playbackConfig": { "speed": 1 },
        "userNodes": {},
    });
    format!("{layout:#}\n")
}

/// The panels above each other, all of the same height.
fn stack(ids: &[String]) -> Value {
    match ids {
        [] => Value::Null,
        [only] => json!(only),
        [first, rest @ ..] => json!({
            "direction": "column",
            "first": first,
            "second": stack(rest),
            "splitPercentage": 100 / ids.len(),
        }),
    }
}

/// The panel of the position in space, seen from the side and above.
fn in_space(topics: &Topics) -> Value {
    let visible = json!({ "visible": true });
    let mut shown = Map::new();
    shown.insert("/truth/path_space".to_owned(), visible.clone());
    shown.insert(
        "/truth/pose_space".to_owned(),
        json!({ "visible": true, "type": "axis", "axisScale": 0.3 }),
    );
    for estimator in &topics.estimators {
        let method = topic_segment(estimator);
        shown.insert(format!("/estimate/{method}/box_space"), visible.clone());
        shown.insert(format!("/estimate/{method}/boxes_space"), visible.clone());
    }
    json!({
        "cameraState": {
            "distance": 6,
            "far": 5000,
            "fovy": 45,
            "near": 0.01,
            "perspective": true,
            "phi": 65,
            "target": [0, 0, 0],
            "targetOffset": [0, 0, 2],
            "targetOrientation": [0, 0, 0, 1],
            "thetaOffset": 45,
        },
        "fixedFrame": FRAME,
        "followMode": "follow-none",
        "followTf": FRAME,
        "foxglovePanelTitle": "Position in m",
        "imageMode": {},
        "layers": {},
        "publish": {},
        "scene": { "transforms": { "visible": false } },
        "topics": shown,
        "transforms": {},
    })
}

fn scene(topics: &Topics, plane: &Plane, view: Option<&View>) -> Value {
    let view = view.copied().unwrap_or(View {
        center: [0.0, 0.0],
        height: 20.0,
    });
    let suffix = &plane.suffix;
    let mut shown = vec![
        format!("/truth/path{suffix}"),
        format!("/truth/pose{suffix}"),
        format!("/estimate/center{suffix}"),
        format!("/measurement/set{suffix}"),
    ];
    for estimator in &topics.estimators {
        let method = topic_segment(estimator);
        shown.push(format!("/estimate/{method}/set{suffix}"));
        shown.push(format!("/estimate/{method}/tube{suffix}"));
    }
    let visible: Map<String, Value> = shown
        .into_iter()
        .map(|topic| {
            // A pose is drawn as an axis or an arrow of a given size, which must fit the view.
            let settings = if topic.contains("/pose") || topic.contains("/center") {
                json!({ "visible": true, "type": "axis", "axisScale": view.height / 20.0 })
            } else {
                json!({ "visible": true })
            };
            (topic, settings)
        })
        .collect();
    json!({
        "cameraState": {
            "distance": view.height,
            "far": 5000,
            "fovy": 45,
            "near": 0.01,
            "perspective": false,
            "phi": 0,
            "target": [0, 0, 0],
            "targetOffset": [view.center[0], view.center[1], 0],
            "targetOrientation": [0, 0, 0, 1],
            "thetaOffset": 0,
        },
        "fixedFrame": plane.frame,
        "followMode": "follow-none",
        "followTf": plane.frame,
        "foxglovePanelTitle": plane.title,
        "imageMode": {},
        "layers": {
            "grid": {
                "color": "#8080804d",
                "divisions": 20,
                "frameId": plane.frame,
                "frameLocked": true,
                "instanceId": "grid",
                "label": "Grid",
                "layerId": "foxglove.Grid",
                "lineWidth": 1,
                "order": 1,
                "position": [view.center[0], view.center[1], 0],
                "rotation": [0, 0, 0],
                "size": 2.0 * view.height,
                "visible": true,
            },
        },
        "publish": {},
        "scene": { "transforms": { "visible": false } },
        "topics": visible,
        "transforms": {},
    })
}

/// Colours of curves, those of [`svg`](zonobench_report::svg): told apart by people who see few colours too.
const TRUTH: &str = "#e69f00";
const CURVES: [&str; 6] = [
    "#0072b2", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#8a7a00",
];

fn curve(path: String, label: String, color: &str) -> Value {
    json!({
        "color": color,
        "enabled": true,
        "label": label,
        "timestampMethod": "headerStamp",
        "value": path,
    })
}

fn component_plot(topics: &Topics, i: usize, name: &str, unit: &str) -> Value {
    let mut curves = Vec::new();
    for (estimator, color) in topics.estimators.iter().zip(CURVES.iter().cycle()) {
        let metrics = format!("/estimate/{}/metrics", topic_segment(estimator));
        if curves.is_empty() {
            curves.push(curve(
                format!("{metrics}.truth[{i}]"),
                "truth".to_owned(),
                TRUTH,
            ));
        }
        for end in ["center", "lower", "upper"] {
            curves.push(curve(
                format!("{metrics}.{end}[{i}]"),
                format!("{estimator} {end}"),
                color,
            ));
        }
    }
    plot(&with_unit(name, unit), curves)
}

fn size_plot(topics: &Topics) -> Value {
    let mut curves = Vec::new();
    for (i, estimator) in topics.estimators.iter().enumerate() {
        let metrics = format!("/estimate/{}/metrics", topic_segment(estimator));
        for (j, value) in ["radius", "error"].iter().enumerate() {
            curves.push(curve(
                format!("{metrics}.{value}"),
                format!("{estimator} {value}"),
                CURVES[(2 * i + j) % CURVES.len()],
            ));
        }
    }
    plot("radius and error", curves)
}

fn plot(title: &str, paths: Vec<Value>) -> Value {
    json!({
        "foxglovePanelTitle": title,
        "isSynced": true,
        "legendDisplay": "floating",
        "paths": paths,
        "showLegend": true,
        "showPlotValuesInLegend": false,
        "showXAxisLabels": true,
        "showYAxisLabels": true,
        "sidebarDimension": 240,
        "xAxisVal": "timestamp",
    })
}

/// `x in m`, or `x` alone where the unit is one.
pub(super) fn with_unit(name: &str, unit: &str) -> String {
    match unit {
        "" | "1" => name.to_owned(),
        _ => format!("{name} in {unit}"),
    }
}
