// Reads an MCAP file with @mcap/core, the reader of Lichtblick and Foxglove Studio, through its indexes and
// with all checksums. Each message has to fit its channel's JSON schema.
//
//   node read.js FILE     prints how many messages there are, by topic

"use strict";

const { open } = require("node:fs/promises");
const assert = require("node:assert");
const Ajv = require("ajv");
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

async function main(path) {
  const file = await open(path);
  const { size } = await file.stat();
  const readable = {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
      assert.strictEqual(bytesRead, bytes.length);
      return bytes;
    },
  };
  const decompressHandlers = await loadDecompressHandlers();
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  // `title` beside `const` and `oneOf` without a type are as Foxglove's own schemas have them.
  const ajv = new Ajv({ strict: false });
  const checks = new Map();
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    assert.strictEqual(channel.messageEncoding, "json");
    assert.strictEqual(schema.encoding, "jsonschema");
    checks.set(channel.id, ajv.compile(JSON.parse(new TextDecoder().decode(schema.data))));
  }
  const counts = {};
  let last = -1n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    assert(message.logTime >= last);
    last = message.logTime;
    const check = checks.get(message.channelId);
    const value = JSON.parse(new TextDecoder().decode(message.data));
    assert(check(value), `${JSON.stringify(value)}: ${ajv.errorsText(check.errors)}`);
    const { topic } = reader.channelsById.get(message.channelId);
    counts[topic] = (counts[topic] ?? 0) + 1;
  }
  const all = Object.values(counts).reduce((sum, count) => sum + count, 0);
  assert.strictEqual(BigInt(all), reader.statistics.messageCount);
  // The index leads to a time in the middle.
  const { messageStartTime, messageEndTime } = reader.statistics;
  const middle = (messageStartTime + messageEndTime) / 2n;
  let later = 0;
  for await (const message of reader.readMessages({ startTime: middle })) {
    assert(message.logTime >= middle);
    later += 1;
  }
  assert(later > 0 && later < all);
  await file.close();
  console.log(`${path}: ${all} messages fit their schemas: ${JSON.stringify(counts)}`);
}

main(process.argv[2]);
