use std::collections::BTreeMap;
use std::io::Cursor;

use prost::Message;
use prost::bytes::Buf;
use prost::encoding::{WireType, decode_key, decode_varint};
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, Duration, FileDescriptorSet};

use super::messages::{
    DELETE_ALL, LINE_LOOP, LOG_WARNING, Log, PoseInFrame, SceneUpdate, StepMetrics,
};
use super::plane::{clip, polygon};
use super::scene::TUBE_LENGTH;
use super::*;

/// A turning state, its box widened by a corner cut off, and a measurement of the first component.
fn trace(steps: usize) -> Trace {
    let names = [("x1", "m"), ("x2", "m")];
    let step = |k: usize| {
        let angle = 0.1 * k as f64;
        let c = [5.0 * libm::cos(angle), 5.0 * libm::sin(angle)];
        let r = 0.5 + 1.0 / (1.0 + k as f64);
        TraceStep {
            k,
            truth: Some(vec![c[0] + 0.1, c[1] - 0.1]),
            center: c.to_vec(),
            lower: Some(vec![c[0] - r, c[1] - r]),
            upper: Some(vec![c[0] + r, c[1] + r]),
            outlines: vec![Outline {
                axes: (0, 1),
                polygon: [[-r, -r], [r, -r], [r, 0.0], [0.0, r], [-r, r]]
                    .map(|[x, y]| [c[0] + x, c[1] + y])
                    .to_vec(),
            }],
            zonotope: Some(TraceZonotope {
                center: c.to_vec(),
                generators: vec![r, 0.0, 0.1, 0.0, r, 0.2],
                n: 2,
                m: 3,
            }),
            measurement: Some(vec![Some(c[0])]),
            metrics: vec![
                ("radius".to_owned(), r),
                ("error".to_owned(), 0.1),
                ("pivots".to_owned(), 3.0),
            ],
            status: "ok".to_owned(),
        }
    };
    Trace {
        paper: "demo".to_owned(),
        experiment: "ex1".to_owned(),
        estimator: "comb+".to_owned(),
        kind: "comb+".to_owned(),
        guaranteed: true,
        names: names.map(|(n, u)| (n.to_owned(), u.to_owned())).to_vec(),
        dt_s: 0.1,
        params_json: "{}".to_owned(),
        measurement_rows: vec![MeasurementRow {
            name: "y1".to_owned(),
            row: vec![1.0, 0.0],
            noise: (-0.25, 0.5),
        }],
        steps: (0..steps).map(step).collect(),
        ..Trace::default()
    }
}

fn bytes(trace: &Trace) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write(trace, &mut out).unwrap();
    out.into_inner()
}

/// Topic, schema, log time and data of every message of a file, in the file's order.
fn read(file: &[u8]) -> Vec<(String, String, u64, Vec<u8>)> {
    mcap::MessageStream::new(file)
        .unwrap()
        .map(|m| {
            let m = m.unwrap();
            assert_eq!(m.log_time, m.publish_time);
            let schema = m.channel.schema.as_ref().unwrap().name.clone();
            (m.channel.topic.clone(), schema, m.log_time, m.data.to_vec())
        })
        .collect()
}

fn scenes(file: &[u8], topic: &str) -> Vec<SceneUpdate> {
    let of_topic = read(file).into_iter().filter(|m| m.0 == topic);
    of_topic
        .map(|m| SceneUpdate::decode(&m.3[..]).unwrap())
        .collect()
}

#[test]
fn the_same_trace_is_the_same_bytes() {
    let first = bytes(&trace(120));
    assert_eq!(first, bytes(&trace(120)));
    // 120 steps with tubes of ten outlines; uncompressed it is eight times as much.
    assert!(first.len() < 120_000, "{} bytes", first.len());
}

#[test]
fn no_version_of_a_dependency_is_in_the_header() {
    let file = bytes(&trace(3));
    let header = mcap::read::LinearReader::new(&file)
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let mcap::records::Record::Header(header) = header else {
        panic!("the first record is {header:?}");
    };
    assert_eq!(
        (header.profile.as_str(), header.library.as_str()),
        ("", "zonobench")
    );
}

#[test]
fn topics_have_the_published_schemas_and_fixed_ids() {
    let file = bytes(&trace(12));
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let channels: BTreeMap<_, _> = summary
        .channels
        .iter()
        .map(|(id, c)| {
            (
                *id,
                (c.topic.as_str(), c.schema.as_ref().unwrap().name.as_str()),
            )
        })
        .collect();
    let expected = [
        ("/run/info", "zonobench.RunInfo"),
        ("/truth/path", "foxglove.SceneUpdate"),
        ("/truth/pose", "foxglove.PoseInFrame"),
        ("/estimate/center", "foxglove.PoseInFrame"),
        ("/estimate/comb_plus/set", "foxglove.SceneUpdate"),
        ("/estimate/comb_plus/tube", "foxglove.SceneUpdate"),
        ("/measurement/set", "foxglove.SceneUpdate"),
        ("/estimate/comb_plus/metrics", "zonobench.StepMetrics"),
        ("/estimate/comb_plus/zonotope", "zonobench.Zonotope"),
    ];
    assert_eq!(channels, (1..).zip(expected).collect());
    assert_eq!(summary.attachment_indexes.len(), 2);
    assert_eq!(summary.metadata_indexes.len(), 1);
    let messages = summary.stats.unwrap().message_count;
    assert_eq!(messages, read(&file).len() as u64);
    assert_eq!(messages, 2 + 7 * 12);
}

#[test]
fn times_are_those_of_the_experiment_and_ascend() {
    let messages = read(&bytes(&trace(30)));
    assert!(messages.windows(2).all(|w| w[0].2 <= w[1].2));
    assert_eq!(messages[0].2, 946_684_800_000_000_000);
    assert_eq!(messages.last().unwrap().2, 946_684_802_900_000_000);
    for (topic, schema, time, data) in messages {
        let stamp = match schema.as_str() {
            "foxglove.SceneUpdate" => SceneUpdate::decode(&data[..]).unwrap().entities[0].timestamp,
            "foxglove.PoseInFrame" => PoseInFrame::decode(&data[..]).unwrap().timestamp,
            "zonobench.StepMetrics" => StepMetrics::decode(&data[..]).unwrap().timestamp,
            _ => continue,
        };
        let stamp = stamp.unwrap();
        assert_eq!(
            stamp.seconds as u64 * 1_000_000_000 + stamp.nanos as u64,
            time,
            "{topic}"
        );
    }
}

#[test]
fn every_scene_is_the_whole_of_its_topic() {
    let file = bytes(&trace(30));
    for scene in scenes(&file, "/estimate/comb_plus/set") {
        let ids: Vec<_> = scene.entities.iter().map(|e| e.id.as_str()).collect();
        assert_eq!(ids, ["outline", "fill"]);
        let outline = &scene.entities[0].lines[0];
        assert_eq!((outline.r#type, outline.points.len()), (LINE_LOOP, 5));
        assert_ne!(
            outline.points.first(),
            outline.points.last(),
            "a loop closes itself"
        );
        assert_eq!(outline.pose.unwrap().orientation.unwrap().w, 1.0);
        let keys: Vec<_> = scene.entities[0]
            .metadata
            .iter()
            .map(|p| p.key.as_str())
            .collect();
        assert_eq!(keys, ["radius_m", "error_m"]);
        let fill = &scene.entities[1].triangles[0];
        assert_eq!(fill.indices, [0, 1, 2, 0, 2, 3, 0, 3, 4]);
    }
    let tubes = scenes(&file, "/estimate/comb_plus/tube");
    let outlines: Vec<_> = tubes.iter().map(|t| t.entities[0].lines.len()).collect();
    assert_eq!(outlines[..3], [1, 2, 3]);
    assert!(outlines[9..].iter().all(|n| *n == TUBE_LENGTH));
    let path = scenes(&file, "/truth/path");
    assert_eq!(path.len(), 1);
    assert_eq!(path[0].entities[0].lines[0].points.len(), 30);
}

#[test]
fn a_set_that_cannot_be_drawn_clears_its_topic_and_is_logged() {
    let mut trace = trace(5);
    trace.steps[2].outlines[0].polygon[1][0] = f64::INFINITY;
    trace.steps[2].center[0] = f64::NAN;
    trace.steps[2].status = "inconsistent".to_owned();
    trace.steps[2].truth = None;
    let file = bytes(&trace);
    let sets = scenes(&file, "/estimate/comb_plus/set");
    assert_eq!(sets.len(), 5);
    assert!(sets[2].entities.is_empty());
    assert_eq!(sets[2].deletions[0].r#type, DELETE_ALL);
    assert!(sets[3].deletions.is_empty());
    let messages = read(&file);
    let count = |topic: &str| messages.iter().filter(|m| m.0 == topic).count();
    assert_eq!(count("/truth/pose"), 4);
    assert_eq!(count("/estimate/center"), 4);
    assert_eq!(count("/log"), 1);
    let log = messages.iter().find(|m| m.0 == "/log").unwrap();
    let log = Log::decode(&log.3[..]).unwrap();
    assert_eq!(
        (log.level, log.message.starts_with("k = 2: ")),
        (LOG_WARNING, true)
    );
}

#[test]
fn a_strip_is_the_part_of_the_window_the_measurement_allows() {
    let trace = trace(20);
    let window = trace.window(&Plane::all(&trace.names, &[])[0]);
    for (k, scene) in scenes(&bytes(&trace), "/measurement/set")
        .iter()
        .enumerate()
    {
        let strip = &scene.entities[0];
        assert_eq!(strip.id, "strip_y1");
        assert_eq!(
            strip.lifetime,
            Some(Duration {
                seconds: 0,
                nanos: 100_000_000
            })
        );
        let y = trace.steps[k].measurement.as_ref().unwrap()[0].unwrap();
        let left = f64::from((y - 0.5).max(window.low[0]) as f32);
        let right = f64::from((y + 0.25).min(window.high[0]) as f32);
        let x = strip.lines[0].points.iter().map(|p| p.x);
        assert_eq!(x.clone().fold(f64::INFINITY, f64::min), left, "k = {k}");
        assert_eq!(x.fold(f64::NEG_INFINITY, f64::max), right, "k = {k}");
    }
}

#[test]
fn a_slanted_strip_has_six_corners() {
    // |x + y| ≤ 1 in the square [-2, 2]²
    let square = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];
    let below = clip(&square, [1.0, 1.0], 1.0);
    assert_eq!(
        clip(&below, [-1.0, -1.0], 1.0),
        [
            [1.0, -2.0],
            [2.0, -2.0],
            [2.0, -1.0],
            [-1.0, 2.0],
            [-2.0, 2.0],
            [-2.0, 1.0]
        ]
    );
}

#[test]
fn boxes_are_drawn_as_rectangles_over_neighbours() {
    let mut trace = trace(4);
    trace.names = ["a", "b", "c"]
        .map(|n| (n.to_owned(), String::new()))
        .to_vec();
    trace.measurement_rows.clear();
    for step in &mut trace.steps {
        step.outlines.clear();
        step.zonotope = None;
        step.truth = None;
        step.center = vec![0.0, 1.0, 2.0];
        step.lower = Some(vec![-1.0, 0.0, 1.0]);
        step.upper = Some(vec![1.0, 2.0, f64::INFINITY]);
    }
    let file = bytes(&trace);
    let drawn = &scenes(&file, "/estimate/comb_plus/set_a_b")[0].entities[0];
    assert_eq!(drawn.frame_id, "a_b");
    let corners: Vec<_> = drawn.lines[0].points.iter().map(|p| (p.x, p.y)).collect();
    assert_eq!(corners, [(-1.0, 0.0), (1.0, 0.0), (1.0, 2.0), (-1.0, 2.0)]);
    let unbounded = &scenes(&file, "/estimate/comb_plus/set_b_c")[0];
    assert!(unbounded.entities.is_empty());
}

#[test]
fn one_component_is_drawn_over_time() {
    let mut trace = trace(4);
    trace.names.truncate(1);
    trace.measurement_rows[0].row = vec![2.0];
    for step in &mut trace.steps {
        step.outlines.clear();
        step.zonotope = None;
        step.truth = Some(vec![0.5]);
        step.center = vec![0.0];
        step.lower = Some(vec![-1.0]);
        step.upper = Some(vec![1.0]);
        step.measurement = Some(vec![Some(1.0)]);
    }
    let file = bytes(&trace);
    let corners = |topic: &str, k: usize| -> Vec<_> {
        let points = &scenes(&file, topic)[k].entities[0].lines[0].points;
        points.iter().map(|p| (p.x as f32, p.y)).collect()
    };
    assert_eq!(
        corners("/estimate/comb_plus/set", 2),
        [(0.2, -1.0), (0.3, -1.0), (0.3, 1.0), (0.2, 1.0)]
    );
    // (1 - 0.5) / 2 … (1 + 0.25) / 2
    assert_eq!(
        corners("/measurement/set", 2),
        [(0.2, 0.25), (0.3, 0.25), (0.3, 0.625), (0.2, 0.625)]
    );
    assert_eq!(corners("/truth/path", 0).len(), 4);
}

#[test]
fn a_segment_is_drawn_and_a_point_is_not() {
    assert_eq!(
        polygon(&[[0.0, 0.0], [2.0, 4.0]]).unwrap()[1],
        Point3 {
            x: 1.0,
            y: 2.0,
            z: 0.0
        }
    );
    assert_eq!(polygon(&[[0.0, 0.0]]), None);
    assert_eq!(polygon(&[[0.0, 0.0], [1.0, f64::NAN], [1.0, 1.0]]), None);
}

#[test]
fn a_wrong_trace_is_refused() {
    let refuse = |change: fn(&mut Trace)| {
        let mut trace = trace(4);
        change(&mut trace);
        write(&trace, &mut Cursor::new(Vec::new()))
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        refuse(|t| t.steps[1].center.push(0.0)),
        "center at k = 1: expected 2 values, got 3"
    );
    assert_eq!(
        refuse(|t| t.steps[3].outlines[0].axes = (0, 2)),
        "outline at k = 3: expected two different axes below 2, got (0, 2)"
    );
    assert_eq!(
        refuse(|t| t.steps[3].k = 1),
        "steps: expected k ascending, got 1 after 2"
    );
    assert!(
        refuse(|t| t.dt_s = f64::NAN)
            .starts_with("time of k = 0: expected steps at least 1 ns apart")
    );
    assert!(refuse(|t| t.dt_s = 1e300).starts_with("time of k = 1"));
    assert_eq!(
        refuse(|t| t.steps.clear()),
        "trace: expected at least one step, got none"
    );
}

fn described(name: &str) -> Vec<DescriptorProto> {
    let set = FileDescriptorSet::decode(&schema(name).unwrap()[..]).unwrap();
    let mut declared: Vec<String> = Vec::new();
    let mut messages = Vec::new();
    for file in set.file {
        for used in &file.dependency {
            assert!(
                declared.contains(used),
                "{used} is declared after {:?}",
                file.name
            );
        }
        declared.push(file.name().to_owned());
        for mut message in file.message_type {
            message.name = Some(format!(
                ".{}.{}",
                file.package.as_ref().unwrap(),
                message.name()
            ));
            messages.push(message);
        }
    }
    messages
}

/// Reads `data` by the descriptors alone and returns how many different fields of `name` were met.
fn walk(mut data: &[u8], name: &str, messages: &[DescriptorProto]) -> usize {
    let message = messages.iter().find(|m| m.name() == name).unwrap();
    let mut met = BTreeSet::new();
    while data.has_remaining() {
        let (number, wire) = decode_key(&mut data).unwrap();
        let field = message
            .field
            .iter()
            .find(|f| f.number() == number as i32)
            .unwrap_or_else(|| panic!("{name} has no field {number}"));
        met.insert(number);
        let what = format!("{name}.{}", field.name());
        let scalar = match field.r#type() {
            Type::Double => WireType::SixtyFourBit,
            Type::Fixed32 => WireType::ThirtyTwoBit,
            Type::String | Type::Bytes | Type::Message => WireType::LengthDelimited,
            _ => WireType::Varint,
        };
        let packed = field.label() == Label::Repeated && scalar != WireType::LengthDelimited;
        let expected = if packed {
            WireType::LengthDelimited
        } else {
            scalar
        };
        assert_eq!(wire, expected, "{what}");
        let length = match wire {
            WireType::SixtyFourBit => 8,
            WireType::ThirtyTwoBit => 4,
            WireType::Varint => {
                decode_varint(&mut data).unwrap();
                0
            }
            _ => decode_varint(&mut data).unwrap() as usize,
        };
        let (value, rest) = data.split_at(length);
        data = rest;
        if field.r#type() == Type::Message {
            walk(value, field.type_name(), messages);
        }
    }
    met.len()
}

#[test]
fn messages_and_schemas_agree() {
    let mut full = trace(3);
    full.steps[1].status = "inconsistent".to_owned();
    for name in [
        "volume",
        "trace_ggt",
        "n_generators",
        "n_constraints",
        "contains_truth",
    ] {
        full.steps[1].metrics.push((name.to_owned(), 1.0));
    }
    let mut most: BTreeMap<String, usize> = BTreeMap::new();
    for (_, name, _, data) in read(&bytes(&full)) {
        if name != RUN_INFO {
            let met = walk(&data, &format!(".{name}"), &described(&name));
            let seen = most.entry(name).or_default();
            *seen = met.max(*seen);
        }
    }
    let expected = [
        (LOG, 4),
        (POSE, 3),
        (SCENE, 1),
        (METRICS, 16),
        (ZONOTOPE, 6),
    ];
    assert_eq!(
        most,
        expected.map(|(n, fields)| (n.to_owned(), fields)).into()
    );
}

#[test]
fn run_info_has_the_properties_its_schema_names() {
    let schema: serde_json::Value = serde_json::from_str(RUN_INFO_SCHEMA).unwrap();
    let info: serde_json::Value = serde_json::from_str(&trace(3).info()).unwrap();
    let names = |object: &serde_json::Value| -> BTreeSet<String> {
        object.as_object().unwrap().keys().cloned().collect()
    };
    assert_eq!(names(&info), names(&schema["properties"]));
    assert_eq!(info["components"][1]["name"], "x2");
}

#[test]
fn a_schema_reads_back_as_it_was_written() {
    for name in [SCENE, POSE, LOG, METRICS, ZONOTOPE] {
        let bytes = schema(name).unwrap();
        let set = FileDescriptorSet::decode(&bytes[..]).unwrap();
        assert_eq!(set.encode_to_vec(), bytes);
        let message = described(name).pop().unwrap();
        assert_eq!(message.name(), format!(".{name}"));
    }
    assert_eq!(schema("foxglove.Nothing"), None);
}

#[test]
fn every_scene_of_a_layout_is_visible() {
    let trace = trace(10);
    let layout = layout_json("demo", &trace.topics());
    let layout: serde_json::Value = serde_json::from_str(&layout).unwrap();
    let scene = &layout["configById"]["3D!demo_set"];
    for topic in [
        "/truth/path",
        "/estimate/comb_plus/set",
        "/estimate/comb_plus/tube",
        "/measurement/set",
    ] {
        assert_eq!(scene["topics"][topic]["visible"], true, "{topic}");
    }
    assert_eq!(layout["layout"]["first"], "3D!demo_set");
    let height = scene["cameraState"]["distance"].as_f64().unwrap();
    let path = &trace.window(&Plane::all(&trace.names, &[])[0]);
    assert!(height > path.high[1] - path.low[1]);
}

/// The layouts in `layouts/` are those of the papers' experiments; `ZONOBENCH_WRITE_LAYOUTS=1` writes
/// them anew.
#[test]
fn the_committed_layouts_are_the_ones_the_builder_makes() {
    type Shown<'a> = (
        &'a str,
        &'a [&'a str],
        &'a [(&'a str, &'a str)],
        &'a [(usize, usize)],
        View,
    );
    let around = |center, height| View { center, height };
    let (plane, plain) = (&[(0, 1)], &[("x1", "1"), ("x2", "1")]);
    let papers: [Shown; 5] = [
        (
            "box",
            &["kalman", "box-state-est"],
            plain,
            plane,
            around([0.0, 0.0], 24.0),
        ),
        (
            "ezgkf",
            &["ezgkp", "ezgkf", "ezgkf-m"],
            plain,
            plane,
            around([0.0, 0.0], 4.0),
        ),
        // The position first: it is what a vehicle is looked at by.
        (
            "inzsmf",
            &[
                "zsmf",
                "inzsmf",
                "zsmf-tables",
                "inzsmf-tables",
                "zsmf-f-tables",
                "inzsmf-f-tables",
                "inzsmf-update",
            ],
            &[("theta", "rad"), ("x1", "m"), ("x2", "m")],
            &[(1, 2), (0, 1)],
            around([0.0, 20.0], 70.0),
        ),
        (
            "bundle",
            &["rrsr", "d-rrsr", "d-zb", "d-cz", "comb", "lift"],
            plain,
            plane,
            around([8.0, 0.0], 8.0),
        ),
        // The flight of the quadrotor, in space and from above.
        (
            "cz",
            &["zmv", "zfo", "czmv", "czfo"],
            &[
                ("x", "m"),
                ("y", "m"),
                ("z", "m"),
                ("u", "m/s"),
                ("v", "m/s"),
                ("w", "m/s"),
                ("phi", "rad"),
                ("theta", "rad"),
                ("psi", "rad"),
                ("p", "rad/s"),
                ("q", "rad/s"),
                ("r", "rad/s"),
            ],
            plane,
            around([0.25, 0.3], 2.0),
        ),
    ];
    for (paper, estimators, names, axes, view) in papers {
        let topics = Topics {
            estimators: estimators.iter().map(|e| (*e).to_owned()).collect(),
            names: names
                .iter()
                .map(|(name, unit)| ((*name).to_owned(), (*unit).to_owned()))
                .collect(),
            axes: axes.to_vec(),
            views: vec![view; axes.len()],
        };
        let made = layout_json(paper, &topics);
        let path = format!("{}/../../layouts/{paper}.json", env!("CARGO_MANIFEST_DIR"));
        if std::env::var_os("ZONOBENCH_WRITE_LAYOUTS").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let committed: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(
            committed,
            serde_json::from_str::<serde_json::Value>(&made).unwrap(),
            "{path}"
        );
    }
}
