// Reads an MCAP file as Foxglove does: node mcap_check.cjs NODE_MODULES FILE. Every channel's schema must
// resolve and every message decode by it; prints {topic: {schema, count, first}} as JSON.
'use strict';
const fs = require('fs');
const { createRequire } = require('module');
const from = createRequire(process.argv[2] + '/x.js');
const { McapIndexedReader } = from('@mcap/core');
const { FileHandleReadable } = from('@mcap/nodejs');
const { loadDecompressHandlers } = from('@mcap/support');
const protobuf = from('protobufjs');
const descriptor = from('protobufjs/ext/descriptor');

async function main() {
  const handle = await fs.promises.open(process.argv[3], 'r');
  const reader = await McapIndexedReader.Initialize({
    readable: new FileHandleReadable(handle), decompressHandlers: await loadDecompressHandlers()});
  const types = new Map(), found = {};
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    if (schema.encoding !== 'protobuf') throw new Error(`${channel.topic}: ${schema.encoding}`);
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
    root.resolveAll();
    types.set(channel.id, root.lookupType(schema.name));
    found[channel.topic] = {schema: schema.name, count: 0};
  }
  for await (const message of reader.readMessages()) {
    const type = types.get(message.channelId);
    const entry = found[reader.channelsById.get(message.channelId).topic];
    const value = type.toObject(type.decode(message.data), {longs: Number});
    if (entry.count++ > 0) continue;
    if (value.data instanceof Uint8Array) value.data = value.data.length;
    entry.first = value;
  }
  console.log(JSON.stringify(found));
  await handle.close();
}
main().catch((error) => { console.error(error.stack); process.exit(1); });
