// Prints each message of some topics of a recording as a line of JSON, decoded by the schemas in it:
//   node read.mjs FOLDER_WITH_NODE_MODULES FILE.mcap TYPE…
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const [folder, file, ...types] = process.argv.slice(2);
const require = createRequire(`${folder}/`);
const { McapIndexedReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { decompress } = require("fzstd");

const bytes = readFileSync(file);
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
  },
  decompressHandlers: { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) },
});

const readers = new Map();
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  if (!types.includes(schema.name)) {
    continue;
  }
  if (!readers.has(schema.id)) {
    readers.set(schema.id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
  }
  const values = readers.get(schema.id).readMessage(message.data);
  const plain = (_, value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
  const told = [channel.topic, String(message.logTime), String(message.publishTime), values];
  process.stdout.write(`${JSON.stringify(told, plain)}\n`);
}
