// Reads every trace of a lake with @mcap/core: `node traces.mjs LAKE`.
//
// CRCs, index and statistics; schemas that protobufjs can decode every message by; times that only go on; and that
// the last message of each topic before any t draws a whole scene: no message needs an earlier one.
import { readFileSync, readdirSync } from "node:fs";
import { join, relative } from "node:path";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";

const lake = process.argv[2];
const decompressHandlers = await loadDecompressHandlers();

const need = (good, what) => { if (!good) throw new Error(what); };

const files = (folder) => readdirSync(folder, { withFileTypes: true }).flatMap((e) => {
  const path = join(folder, e.name);
  if (e.isDirectory()) return e.name === ".cache" ? [] : files(path);
  return e.name.endsWith(".mcap") ? [path] : [];
});

const decoders = (reader) => {
  const by = new Map();
  for (const schema of reader.schemasById.values()) {
    need(schema.name.startsWith("foxglove.") || schema.name.startsWith("zonobench."), `schema ${schema.name}`);
    if (schema.encoding === "protobuf") {
      const root = protobuf.Root.fromDescriptor(schema.data);
      root.resolveAll();
      by.set(schema.id, root.lookupType(schema.name));
    } else {
      need(schema.encoding === "jsonschema" || schema.encoding === "", `${schema.name} is ${schema.encoding}`);
    }
  }
  return by;
};

const nanoseconds = ({ seconds, nanos }) => BigInt(seconds.toString()) * 1_000_000_000n + BigInt(nanos ?? 0);

const DELETE_ALL = 1;

/** What a scene draws by itself: false where it needs what came before. */
const isWhole = (scene, time, flash) => {
  if (!scene.entities.length) return scene.deletions.length === 1 && scene.deletions[0].type === DELETE_ALL;
  return scene.entities.every((e) =>
    e.id && e.frame_id && nanoseconds(e.timestamp) === time
    // Nothing that is drawn here ends before the next message, but for what says so by its topic.
    && (flash || !e.lifetime || nanoseconds(e.lifetime) === 0n)
    && (e.lines.length || e.triangles.length)
    && e.lines.every((l) => l.points.length >= 3 && l.color.a > 0 && l.pose.orientation.w === 1)
    && e.triangles.every((t) => t.indices.length && t.indices.every((i) => i < t.points.length)));
};

async function check(bytes) {
  // The stream reader checks the CRC of every chunk and of the data section.
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  stream.append(bytes);
  let records = 0;
  while (stream.nextRecord()) records += 1;
  need(stream.done() && records, "ends early");

  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const types = decoders(reader);
  need(reader.chunkIndexes.length && reader.statistics, "has no index");
  let messages = 0;
  let last = 0n;
  const first = new Map();
  const scenes = new Map();
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const type = types.get(channel.schemaId);
    const { topic } = channel;
    need(message.logTime >= last && message.logTime === message.publishTime, `${topic}: goes back in time`);
    last = message.logTime;
    messages += 1;
    if (!first.has(topic)) first.set(topic, last);
    if (!type) {
      JSON.parse(new TextDecoder().decode(message.data));
      continue;
    }
    const decoded = type.decode(message.data);
    if (type.name !== "SceneUpdate") continue;
    need(isWhole(decoded, last, topic.startsWith("/measurement/")), `${topic} at ${last} needs an earlier message`);
    if (!scenes.has(topic)) scenes.set(topic, []);
    scenes.get(topic).push(last);
  }
  need(BigInt(messages) === reader.statistics.messageCount, `${messages} of ${reader.statistics.messageCount} messages`);

  // A jump to any t: a viewer shows the last message of each topic up to t, read here backwards from the index.
  const begin = reader.statistics.messageStartTime;
  const end = reader.statistics.messageEndTime;
  const sets = [...scenes.keys()].filter((t) => t.startsWith("/estimate/") && t.includes("/set"));
  need(sets.length, "draws no set");
  for (const part of [0n, 3n, 5n, 9n, 10n]) {
    const t = begin + (end - begin) * part / 10n;
    for (const topic of [...sets, ...[...scenes.keys()].filter((t) => t.startsWith("/truth/path"))]) {
      let seen;
      for await (const message of reader.readMessages({ topics: [topic], endTime: t, reverse: true })) {
        seen = message;
        break;
      }
      need(seen, `${topic}: nothing to draw at ${t}`);
      const expected = scenes.get(topic).filter((time) => time <= t).at(-1);
      need(seen.logTime === expected, `${topic}: the index gives ${seen.logTime} for ${t}, not ${expected}`);
    }
  }
  let layout;
  for await (const attachment of reader.readAttachments()) {
    if (attachment.name === "foxglove-layout.json") layout = JSON.parse(new TextDecoder().decode(attachment.data));
  }
  need(layout?.configById && layout.layout, "has no layout");
  return `${messages} messages, ${reader.channelsById.size} topics`;
}

let wrong = 0;
let bytes = 0;
const all = files(lake).sort();
for (const path of all) {
  const name = relative(lake, path);
  const content = new Uint8Array(readFileSync(path));
  bytes += content.length;
  try {
    console.log(`ok    ${name}: ${await check(content)}`);
  } catch (fault) {
    wrong += 1;
    console.log(`WRONG ${name}: ${fault.message}`);
  }
}
const small = bytes < 20e6;
console.log(`${all.length} files, ${wrong} wrong, ${(bytes / 1e6).toFixed(1)} MB${small ? "" : ": more than 20"}`);
process.exit(wrong || !all.length || !small ? 1 : 0);
