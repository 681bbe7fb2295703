//! What a reader is told about the messages: their schemas as protobuf file descriptors.
//!
//! The table below is the whole of each `foxglove.*` type, the primitives that are never drawn
//! included: a viewer decodes by the schema in the file and then walks every list of an entity, so a
//! list that the schema leaves out is one it stumbles over. Names, numbers and types are those of the
//! published schemas (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto>).

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet, OneofDescriptorProto,
};

/// The type of a field: a scalar, or a message or enum by its full name.
#[derive(Clone, Copy)]
enum Kind {
    Double,
    Bool,
    Int32,
    Int64,
    Uint32,
    Uint64,
    Fixed32,
    Text,
    Bytes,
    Message(&'static str),
    Enum(&'static str),
}
use Kind::{Bool, Bytes, Double, Enum, Fixed32, Int32, Int64, Text, Uint32, Uint64};

/// How often a field stands in a message.
#[derive(Clone, Copy, PartialEq)]
enum Count {
    One,
    Optional,
    Many,
}
use Count::{Many, One, Optional};

struct Field(&'static str, i32, Count, Kind);

struct Shape {
    /// Full name
    name: &'static str,
    /// The enum declared inside it, if any: its name and its values, numbered from zero
    values: Option<(&'static str, &'static [&'static str])>,
    fields: &'static [Field],
}

const TIME: Kind = Kind::Message("google.protobuf.Timestamp");
const DURATION: Kind = Kind::Message("google.protobuf.Duration");
const POSE: Kind = Kind::Message("foxglove.Pose");
const COLOR: Kind = Kind::Message("foxglove.Color");
const POINT: Kind = Kind::Message("foxglove.Point3");
const VECTOR: Kind = Kind::Message("foxglove.Vector3");

const SHAPES: &[Shape] = &[
    Shape {
        name: "google.protobuf.Timestamp",
        values: None,
        fields: &[
            Field("seconds", 1, One, Int64),
            Field("nanos", 2, One, Int32),
        ],
    },
    Shape {
        name: "google.protobuf.Duration",
        values: None,
        fields: &[
            Field("seconds", 1, One, Int64),
            Field("nanos", 2, One, Int32),
        ],
    },
    Shape {
        name: "foxglove.Color",
        values: None,
        fields: &[
            Field("r", 1, One, Double),
            Field("g", 2, One, Double),
            Field("b", 3, One, Double),
            Field("a", 4, One, Double),
        ],
    },
    Shape {
        name: "foxglove.Point3",
        values: None,
        fields: &[
            Field("x", 1, One, Double),
            Field("y", 2, One, Double),
            Field("z", 3, One, Double),
        ],
    },
    Shape {
        name: "foxglove.Vector3",
        values: None,
        fields: &[
            Field("x", 1, One, Double),
            Field("y", 2, One, Double),
            Field("z", 3, One, Double),
        ],
    },
    Shape {
        name: "foxglove.Quaternion",
        values: None,
        fields: &[
            Field("x", 1, One, Double),
            Field("y", 2, One, Double),
            Field("z", 3, One, Double),
            Field("w", 4, One, Double),
        ],
    },
    Shape {
        name: "foxglove.Pose",
        values: None,
        fields: &[
            Field("position", 1, One, VECTOR),
            Field("orientation", 2, One, Kind::Message("foxglove.Quaternion")),
        ],
    },
    Shape {
        name: "foxglove.PoseInFrame",
        values: None,
        fields: &[
            Field("timestamp", 1, One, TIME),
            Field("frame_id", 2, One, Text),
            Field("pose", 3, One, POSE),
        ],
    },
    Shape {
        name: "foxglove.KeyValuePair",
        values: None,
        fields: &[Field("key", 1, One, Text), Field("value", 2, One, Text)],
    },
    Shape {
        name: "foxglove.ArrowPrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("shaft_length", 2, One, Double),
            Field("shaft_diameter", 3, One, Double),
            Field("head_length", 4, One, Double),
            Field("head_diameter", 5, One, Double),
            Field("color", 6, One, COLOR),
        ],
    },
    Shape {
        name: "foxglove.CubePrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("size", 2, One, VECTOR),
            Field("color", 3, One, COLOR),
        ],
    },
    Shape {
        name: "foxglove.SpherePrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("size", 2, One, VECTOR),
            Field("color", 3, One, COLOR),
        ],
    },
    Shape {
        name: "foxglove.CylinderPrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("size", 2, One, VECTOR),
            Field("bottom_scale", 3, One, Double),
            Field("top_scale", 4, One, Double),
            Field("color", 5, One, COLOR),
        ],
    },
    Shape {
        name: "foxglove.LinePrimitive",
        values: Some(("Type", &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"])),
        fields: &[
            Field("type", 1, One, Enum("foxglove.LinePrimitive.Type")),
            Field("pose", 2, One, POSE),
            Field("thickness", 3, One, Double),
            Field("scale_invariant", 4, One, Bool),
            Field("points", 5, Many, POINT),
            Field("color", 6, One, COLOR),
            Field("colors", 7, Many, COLOR),
            Field("indices", 8, Many, Fixed32),
        ],
    },
    Shape {
        name: "foxglove.TriangleListPrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("points", 2, Many, POINT),
            Field("color", 3, One, COLOR),
            Field("colors", 4, Many, COLOR),
            Field("indices", 5, Many, Fixed32),
        ],
    },
    Shape {
        name: "foxglove.TextPrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("billboard", 2, One, Bool),
            Field("font_size", 3, One, Double),
            Field("scale_invariant", 4, One, Bool),
            Field("color", 5, One, COLOR),
            Field("text", 6, One, Text),
        ],
    },
    Shape {
        name: "foxglove.ModelPrimitive",
        values: None,
        fields: &[
            Field("pose", 1, One, POSE),
            Field("scale", 2, One, VECTOR),
            Field("color", 3, One, COLOR),
            Field("override_color", 4, One, Bool),
            Field("url", 5, One, Text),
            Field("media_type", 6, One, Text),
            Field("data", 7, One, Bytes),
        ],
    },
    Shape {
        name: "foxglove.SceneEntity",
        values: None,
        fields: &[
            Field("timestamp", 1, One, TIME),
            Field("frame_id", 2, One, Text),
            Field("id", 3, One, Text),
            Field("lifetime", 4, One, DURATION),
            Field("frame_locked", 5, One, Bool),
            Field("metadata", 6, Many, Kind::Message("foxglove.KeyValuePair")),
            Field("arrows", 7, Many, Kind::Message("foxglove.ArrowPrimitive")),
            Field("cubes", 8, Many, Kind::Message("foxglove.CubePrimitive")),
            Field(
                "spheres",
                9,
                Many,
                Kind::Message("foxglove.SpherePrimitive"),
            ),
            Field(
                "cylinders",
                10,
                Many,
                Kind::Message("foxglove.CylinderPrimitive"),
            ),
            Field("lines", 11, Many, Kind::Message("foxglove.LinePrimitive")),
            Field(
                "triangles",
                12,
                Many,
                Kind::Message("foxglove.TriangleListPrimitive"),
            ),
            Field("texts", 13, Many, Kind::Message("foxglove.TextPrimitive")),
            Field("models", 14, Many, Kind::Message("foxglove.ModelPrimitive")),
        ],
    },
    Shape {
        name: "foxglove.SceneEntityDeletion",
        values: Some(("Type", &["MATCHING_ID", "ALL"])),
        fields: &[
            Field("timestamp", 1, One, TIME),
            Field("type", 2, One, Enum("foxglove.SceneEntityDeletion.Type")),
            Field("id", 3, One, Text),
        ],
    },
    Shape {
        name: "foxglove.SceneUpdate",
        values: None,
        fields: &[
            Field(
                "deletions",
                1,
                Many,
                Kind::Message("foxglove.SceneEntityDeletion"),
            ),
            Field("entities", 2, Many, Kind::Message("foxglove.SceneEntity")),
        ],
    },
    Shape {
        name: "foxglove.Log",
        values: Some((
            "Level",
            &["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"],
        )),
        fields: &[
            Field("timestamp", 1, One, TIME),
            Field("level", 2, One, Enum("foxglove.Log.Level")),
            Field("message", 3, One, Text),
            Field("name", 4, One, Text),
            Field("file", 5, One, Text),
            Field("line", 6, One, Fixed32),
        ],
    },
    Shape {
        name: "zonobench.NamedValue",
        values: None,
        fields: &[Field("name", 1, One, Text), Field("value", 2, One, Double)],
    },
    Shape {
        name: "zonobench.StepMetrics",
        values: None,
        fields: &[
            Field("timestamp", 1, One, TIME),
            Field("k", 2, One, Uint64),
            Field("status", 3, One, Text),
            Field("center", 4, Many, Double),
            Field("lower", 5, Many, Double),
            Field("upper", 6, Many, Double),
            Field("truth", 7, Many, Double),
            Field("measurement", 8, Many, Double),
            Field("error", 9, Optional, Double),
            Field("radius", 10, Optional, Double),
            Field("volume", 11, Optional, Double),
            Field("trace_ggt", 12, Optional, Double),
            Field("n_generators", 13, Optional, Double),
            Field("n_constraints", 14, Optional, Double),
            Field("contains_truth", 15, Optional, Double),
            Field("others", 16, Many, Kind::Message("zonobench.NamedValue")),
        ],
    },
    Shape {
        name: "zonobench.Zonotope",
        values: None,
        fields: &[
            Field("timestamp", 1, One, TIME),
            Field("k", 2, One, Uint64),
            Field("center", 3, Many, Double),
            Field("generators", 4, Many, Double),
            Field("n", 5, One, Uint32),
            Field("m", 6, One, Uint32),
        ],
    },
];

/// The schema of the message called `name` (full, `foxglove.Log`), as the bytes of a
/// `FileDescriptorSet` that holds it and everything it is made of, what is used before what uses it.
///
/// None for a name that is not in the table.
pub fn schema(name: &str) -> Option<Vec<u8>> {
    let mut files = Vec::new();
    collect(shape(name)?, &mut files);
    Some(FileDescriptorSet { file: files }.encode_to_vec())
}

fn shape(name: &str) -> Option<&'static Shape> {
    SHAPES.iter().find(|s| s.name == name)
}

fn collect(shape: &Shape, files: &mut Vec<FileDescriptorProto>) {
    let path = path(shape.name);
    if files.iter().any(|f| f.name.as_deref() == Some(&path)) {
        return;
    }
    let mut dependency: Vec<String> = Vec::new();
    for Field(.., kind) in shape.fields {
        if let Kind::Message(name) = kind {
            let used =
                self::shape(name).expect("every message of the table is made of others of it");
            collect(used, files);
            let used = self::path(name);
            if !dependency.contains(&used) {
                dependency.push(used);
            }
        }
    }
    let (package, _) = split(shape.name);
    files.push(FileDescriptorProto {
        name: Some(path),
        package: Some(package.to_owned()),
        dependency,
        message_type: vec![message(shape)],
        syntax: Some("proto3".to_owned()),
        ..Default::default()
    });
}

/// The file a message is declared in: one a message, but for protobuf's own, whose names are small.
fn path(name: &str) -> String {
    let (package, message) = split(name);
    match package {
        "google.protobuf" => format!("google/protobuf/{}.proto", message.to_ascii_lowercase()),
        _ => format!("{package}/{message}.proto"),
    }
}

fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.')
        .expect("every name of the table has a package")
}

fn message(shape: &Shape) -> DescriptorProto {
    let mut oneof_decl = Vec::new();
    let field = shape
        .fields
        .iter()
        .map(|Field(name, number, count, kind)| {
            let (r#type, type_name) = match *kind {
                Double => (Type::Double, None),
                Bool => (Type::Bool, None),
                Int32 => (Type::Int32, None),
                Int64 => (Type::Int64, None),
                Uint32 => (Type::Uint32, None),
                Uint64 => (Type::Uint64, None),
                Fixed32 => (Type::Fixed32, None),
                Text => (Type::String, None),
                Bytes => (Type::Bytes, None),
                Kind::Message(name) => (Type::Message, Some(format!(".{name}"))),
                Enum(name) => (Type::Enum, Some(format!(".{name}"))),
            };
            let label = match count {
                Many => Label::Repeated,
                One | Optional => Label::Optional,
            };
            // protobuf writes `optional` in proto3 as a choice of one.
            let oneof_index = (*count == Optional).then(|| {
                oneof_decl.push(OneofDescriptorProto {
                    name: Some(format!("_{name}")),
                    options: None,
                });
                i32::try_from(oneof_decl.len() - 1).expect("a message has few fields")
            });
            FieldDescriptorProto {
                name: Some((*name).to_owned()),
                number: Some(*number),
                label: Some(label.into()),
                r#type: Some(r#type.into()),
                type_name,
                oneof_index,
                proto3_optional: oneof_index.map(|_| true),
                ..Default::default()
            }
        })
        .collect();
    let enum_type = shape
        .values
        .iter()
        .map(|(name, values)| EnumDescriptorProto {
            name: Some((*name).to_owned()),
            value: (0..)
                .zip(*values)
                .map(|(number, value)| EnumValueDescriptorProto {
                    name: Some((*value).to_owned()),
                    number: Some(number),
                    options: None,
                })
                .collect(),
            ..Default::default()
        })
        .collect();
    DescriptorProto {
        name: Some(split(shape.name).1.to_owned()),
        field,
        enum_type,
        oneof_decl,
        ..Default::default()
    }
}
