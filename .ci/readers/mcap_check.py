"""Reads every trace of a lake with readers that are not ours and says whether they hold what they promise.

    python -m venv v && v/bin/pip install mcap mcap-protobuf-support foxglove-schemas-protobuf
    v/bin/python .ci/readers/mcap_check.py lake/

Prints a line a file; exit code 1 where anything is wrong, 2 where there is nothing to read.
"""

import importlib
import json
import math
import sys
from collections import Counter, defaultdict
from pathlib import Path

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

OWN = {"zonobench.StepMetrics", "zonobench.Zonotope", "zonobench.RunInfo"}
EPOCH_NS = 946_684_800 * 10**9
DELETE_ALL = 1


def check(condition, *what):
    if not condition:
        raise AssertionError(" ".join(str(w) for w in what))


def fields(descriptor):
    """Name, number, type, whether repeated, and the type's name of every field."""
    return {
        (f.name, f.number, f.type, f.label == f.LABEL_REPEATED, f.type_name.lstrip("."))
        for f in descriptor.field
    }


def check_schema(schema):
    """A foxglove schema must be the published one, in all that it is made of."""
    check(schema.name in OWN or schema.name.startswith("foxglove."), "schema", schema.name)
    if schema.encoding != "protobuf":
        check(schema.name == "zonobench.RunInfo", schema.name, "is", schema.encoding)
        return
    described = FileDescriptorSet.FromString(schema.data)
    declared = set()
    for file in described.file:
        check(set(file.dependency) <= declared, file.name, "is declared before what it uses")
        declared.add(file.name)
        if file.package != "foxglove":
            continue
        for message in file.message_type:
            module = importlib.import_module(f"foxglove_schemas_protobuf.{message.name}_pb2")
            official = FileDescriptorSet().file.add()
            module.DESCRIPTOR.CopyToProto(official)
            published = next(m for m in official.message_type if m.name == message.name)
            check(fields(message) == fields(published), message.name, "differs from the published one")
            enums = [[(e.name, [(v.name, v.number) for v in e.value]) for e in m.enum_type] for m in (message, published)]
            check(enums[0] == enums[1], "the enums of", message.name, "differ")
    name = schema.name.rsplit(".", 1)[1]
    check(name in [m.name for m in described.file[-1].message_type], schema.name, "is not in its schema")


def check_scene(topic, scene, log_time, frames):
    """Every message is the whole of its topic: something drawn, or everything cleared."""
    if not scene.entities:
        check([d.type for d in scene.deletions] == [DELETE_ALL], topic, "neither draws nor clears")
    ids = [e.id for e in scene.entities]
    check(len(set(ids)) == len(ids), topic, "repeats an id:", ids)
    for e in scene.entities:
        check(e.id and e.frame_id, topic, "entity without id or frame")
        check(e.timestamp.ToNanoseconds() == log_time, topic, e.id, "has another time than its message")
        lifetime = e.lifetime.ToNanoseconds()
        check((lifetime > 0) == topic.startswith("/measurement/"), topic, e.id, "lifetime", lifetime)
        check(e.lines or e.triangles, topic, e.id, "draws nothing")
        frames[topic].add(e.frame_id)
        for line in e.lines:
            check(len(line.points) >= 3, topic, e.id, "line of", len(line.points))
            check(line.color.a > 0, topic, e.id, "is invisible")
            check(line.pose.orientation.w == 1, topic, e.id, "line is not oriented")
            check(line.scale_invariant and line.thickness > 0, topic, e.id, "thickness")
            check(all(map(finite, line.points)), topic, e.id, "point is not finite")
        for area in e.triangles:
            check(area.color.a > 0 and area.pose.orientation.w == 1, topic, e.id, "area is invisible")
            check(len(area.indices) % 3 == 0 and area.indices, topic, e.id, "area of", len(area.indices))
            check(max(area.indices) < len(area.points), topic, e.id, "corner that does not exist")
            check(all(map(finite, area.points)), topic, e.id, "corner is not finite")


def finite(p):
    return math.isfinite(p.x) and math.isfinite(p.y) and math.isfinite(p.z)


def check_metrics(topic, m, components):
    for name in ("center", "lower", "upper", "truth"):
        values = getattr(m, name)
        check(len(values) in (0, components), topic, name, "has", len(values), "of", components)
    check(len(m.center) == components, topic, "has no center")
    check(m.status, topic, "has no status")


def check_file(path):
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header, summary = reader.get_header(), reader.get_summary()
        check(header.profile == "" and header.library == "zonobench", "header", header)
        for schema in summary.schemas.values():
            check_schema(schema)
        check(summary.chunk_indexes, "no chunk index")
        check(all(c.compression == "zstd" for c in summary.chunk_indexes), "a chunk is not zstd")
        ids = sorted(summary.channels)
        check(ids == list(range(1, len(ids) + 1)), "channel ids", ids)

        last, counts, components = 0, Counter(), None
        frames, scene_times, starts = defaultdict(set), defaultdict(list), []
        for schema, channel, message, decoded in decoded_messages(reader):
            t, topic = message.log_time, channel.topic
            check(t >= last, topic, "goes back in time")
            check(t == message.publish_time and t >= EPOCH_NS, topic, "time", t, message.publish_time)
            check(message.sequence == counts[topic], topic, "sequence", message.sequence)
            last, starts = t, starts or [t]
            counts[topic] += 1
            if schema.name == "zonobench.RunInfo":
                components = len(decoded["components"])
            elif schema.name == "foxglove.SceneUpdate":
                check_scene(topic, decoded, t, frames)
                scene_times[topic].append(t)
            else:
                check(decoded.timestamp.ToNanoseconds() == t, topic, "has another time than its message")
            if schema.name == "foxglove.PoseInFrame":
                o = decoded.pose.orientation
                turned = math.hypot(o.x, o.y, o.z, o.w)
                # In space a body has an attitude; in the planes of the state nothing turns.
                upright = o.w == 1 or topic.endswith("_space")
                check(abs(turned - 1) < 1e-12 and upright and decoded.frame_id, topic, "pose")
                check(finite(decoded.pose.position), topic, "pose is not finite")
                frames[topic].add(decoded.frame_id)
            elif schema.name == "zonobench.StepMetrics":
                check_metrics(topic, decoded, components)
            elif schema.name == "zonobench.Zonotope":
                check(len(decoded.center) == decoded.n == components, topic, "center")
                check(len(decoded.generators) == decoded.n * decoded.m, topic, "generators")

        total = sum(counts.values())
        check(total == summary.statistics.message_count, "read", total, "of", summary.statistics.message_count)
        for frame in frames.items():
            check(len(frame[1]) == 1, frame[0], "moves between frames", frame[1])
        check(components, "no /run/info")
        metrics = [t for t in counts if t.endswith("/metrics")]
        check(len(metrics) == 1, "topics of metrics:", metrics)
        sets = [t for t in counts if "/set" in t and t.startswith("/estimate/")]
        check(sets, "no set is drawn")
        for topic in sets:
            # A jump to any time shows the latest message alone: there is one from the start on, each step.
            check(scene_times[topic][0] == starts[0], topic, "draws nothing at the start")
            check(counts[topic] == counts[metrics[0]], topic, "does not say at each step what it shows")
            tube = topic.replace("/set", "/tube")
            check(scene_times[tube] == scene_times[topic], tube, "is out of step")

        records = {m.name: m.metadata for m in reader.iter_metadata()}
        check(set(records) == {"zonobench"}, "metadata records", set(records))
        for key in ("paper", "experiment", "estimator", "kind", "guaranteed"):
            check(key in records["zonobench"], "metadata has no", key)
        attachments = {a.name: a for a in reader.iter_attachments()}
        check(set(attachments) == {"foxglove-layout.json", "params.json"}, "attachments", set(attachments))
        check_layout(attachments["foxglove-layout.json"].data, counts, scene_times)
    return counts


def decoded_messages(reader):
    """`iter_decoded_messages` with JSON decoded too."""
    factory = DecoderFactory()
    for schema, channel, message in reader.iter_messages():
        if channel.message_encoding == "json":
            yield schema, channel, message, json.loads(message.data)
        else:
            yield schema, channel, message, factory.decoder_for(channel.message_encoding, schema)(message.data)


def check_layout(data, counts, scene_times):
    """Every scene topic is made visible by some panel, and the form is the one the apps import."""
    layout = json.loads(data)
    check({"configById", "layout", "globalVariables", "userNodes", "playbackConfig"} <= set(layout), "layout", list(layout))
    visible = {
        topic
        for panel in layout["configById"].values()
        for topic, settings in panel.get("topics", {}).items()
        if settings["visible"]
    }
    check(set(scene_times) <= visible, "hidden by the layout:", set(scene_times) - visible)

    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])

    check(sorted(leaves(layout["layout"])) == sorted(layout["configById"]), "panels and mosaic differ")


def main():
    lake = Path(sys.argv[1] if len(sys.argv) > 1 else "lake")
    paths = sorted(p for p in lake.rglob("*.mcap") if ".cache" not in p.parts)
    if not paths:
        print(f"{lake}: no *.mcap below it", file=sys.stderr)
        return 2
    failed, total = 0, 0
    for path in paths:
        name = path.relative_to(lake)
        try:
            counts = check_file(path)
            total += sum(counts.values())
            print(f"ok    {name}: {sum(counts.values())} messages, {len(counts)} topics, {path.stat().st_size} bytes")
        except Exception as error:  # whatever a reader throws is a finding about the file
            failed += 1
            print(f"WRONG {name}: {type(error).__name__}: {error}")
    print(f"{len(paths)} files, {total} messages, {failed} wrong")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
