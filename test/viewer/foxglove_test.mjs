// Foxglove's published client subscribes to every channel; every schema must resolve and every message decode.
import assert from 'node:assert';
import {execFileSync} from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import os from 'node:os';
import path from 'node:path';
import {bin, load, log, pageClient, play, sleep, until} from './viewer.mjs';

const {FoxgloveClient} = load('@foxglove/ws-protocol');
const {WebSocket} = load('ws');
const protobuf = load('protobufjs');
const descriptor = load('protobufjs/ext/descriptor');

const EXPECTED = {
  'POSE': 'chase.pose_t', 'POSE/pose': 'foxglove.PoseInFrame', '/tf': 'foxglove.FrameTransforms',
  'OBSTACLES/scene': 'foxglove.SceneUpdate', 'TARGET/scene': 'foxglove.SceneUpdate', 'PLAN/scene': 'foxglove.SceneUpdate',
  'PREDICTION/scene': 'foxglove.SceneUpdate', 'LIDAR_SCAN': 'foxglove.PointCloud', 'SCAN_REGISTERED': 'foxglove.PointCloud',
  'CAMERA_IMAGE': 'foxglove.CompressedImage', 'CAMERA_IMAGE/calibration': 'foxglove.CameraCalibration',
  'PLANNING_STATUS/log': 'foxglove.Log', 'PLAN': 'chase.plan_t', 'SCENARIO': 'chase.scenario_t', 'TRUTH/pose': 'foxglove.PoseInFrame',
};

async function connect(port, protocols) {
  const socket = new WebSocket(`ws://127.0.0.1:${port}/`, protocols);
  const client = new FoxgloveClient({ws: socket});
  const seen = {socket, client, channels: new Map(), types: new Map(), counts: new Map(), first: new Map(), most: new Map(), errors: [], statuses: []};
  client.on('error', (error) => seen.errors.push(error));
  client.on('status', (status) => seen.statuses.push(status));
  client.on('serverInfo', (info) => { seen.info = info; });
  client.on('parameterValues', (values) => { seen.parameters = values; });
  const bySubscription = new Map();
  client.on('advertise', (channels) => {
    for (const channel of channels) {
      const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, 'base64')));
      root.resolveAll();
      assert.strictEqual(channel.encoding, 'protobuf');
      assert.strictEqual(channel.schemaEncoding, 'protobuf');
      seen.channels.set(channel.topic, channel);
      seen.types.set(channel.topic, root.lookupType(channel.schemaName));
      bySubscription.set(client.subscribe(channel.id), channel.topic);
    }
  });
  client.on('message', ({subscriptionId, timestamp, data}) => {
    const topic = bySubscription.get(subscriptionId), type = seen.types.get(topic);
    const message = type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
    assert.strictEqual(type.verify(message), null, topic);
    assert.ok(timestamp > 0n, topic);
    seen.counts.set(topic, (seen.counts.get(topic) ?? 0) + 1);
    seen.first.set(topic, seen.first.get(topic) ?? type.toObject(message));
    for (const [part, list] of Object.entries(message.entities?.[0] ?? {})) {
      const most = seen.most.get(topic) ?? {};
      seen.most.set(topic, {...most, [part]: Math.max(most[part] ?? 0, list?.length ?? 0)});
    }
  });
  await until(`serverInfo (${protocols})`, () => seen.info);
  return seen;
}

// A log of every channel: the flight's, and those that it lacks.
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'foxglove-')), every = path.join(folder, 'every.lcm');
process.on('exit', () => fs.rmSync(folder, {recursive: true}));
const added = execFileSync('python3', ['-B', path.join(import.meta.dirname, '../replay/every_channel.py'),
  path.join(bin, '../share/chase/python'), log, every], {encoding: 'utf8'});
for (const line of added.trim().split('\n')) EXPECTED[line.split(' ')[0]] = `chase.${line.split(' ')[1]}`;

const viewer = await play('rig: {lens: plumb_bob, lens_coefficients: [-0.3, 0.1, 0, 0, 0.02]}\n', every);
const page = await pageClient(viewer.port);
page.ask({speed: 5});
const seen = await connect(viewer.port, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
assert.deepStrictEqual(seen.info.capabilities, ['parameters']);
const keepPlaying = () => { if (page.newest.state?.play && !page.newest.state.play.playing) page.ask({play: true}); };
await until('a message on every channel', () => {
  keepPlaying();
  return seen.channels.size >= Object.keys(EXPECTED).length &&
    Object.keys(EXPECTED).every((topic) => seen.channels.has(topic)) &&
    [...seen.channels.keys()].every((topic) => seen.counts.has(topic));
}, 60000).catch((error) => {
  throw new Error(`${error.message}; missing: ${[...new Set([...Object.keys(EXPECTED), ...seen.channels.keys()])].filter((t) => !seen.counts.has(t))}`);
});
for (const [topic, schema] of Object.entries(EXPECTED)) assert.strictEqual(seen.channels.get(topic).schemaName, schema, topic);
assert.deepStrictEqual(seen.errors, []);

const cloud = seen.first.get('SCAN_REGISTERED');
assert.strictEqual(cloud.data.length % cloud.point_stride, 0);
assert.ok(cloud.data.length > 1000 * cloud.point_stride);
assert.strictEqual(Buffer.from(seen.first.get('CAMERA_IMAGE').data).readUInt16BE(0), 0xffd8);
assert.deepStrictEqual(seen.first.get('/tf').transforms.map((t) => t.child_frame_id), ['body', 'lidar', 'camera']);

const lens = seen.first.get('CAMERA_IMAGE/calibration');
assert.deepStrictEqual([lens.distortion_model, ...lens.D], ['plumb_bob', -0.3, 0.1, 0, 0, 0.02]);

// The layout to import comes as it is to who asks for no gzip, and names nothing that is not there.
const layout = JSON.parse(await new Promise((done, fail) => http.get(`${viewer.url}foxglove-layout.json`, (answer) => {
  let text = '';
  answer.on('data', (data) => { text += data; }).on('end', () => done(text));
}).on('error', fail)));
const named = new Set(), plotted = new Set();
for (const {topics, imageMode, paths} of Object.values(layout.configById)) {
  for (const topic of [...Object.keys(topics ?? {}), ...Object.values(imageMode ?? {})]) named.add(topic);
  for (const {value} of paths ?? []) {
    // TOPIC.field, TOPIC.field[0], or TOPIC.list[:]{name=="row"}.field
    const [topic, field, row, part] = /^([A-Z_]+)\.(\w+)(?:\[\d\]|\[:\]\{name=="(\w+)"\}\.(\w+))?$/.exec(value).slice(1);
    const found = seen.types.get(topic)?.fields[field];
    assert.ok(found, value);
    if (row) assert.ok(found.resolvedType.fields.name && found.resolvedType.fields[part], value);
    plotted.add(topic);
  }
}
for (const topic of named) assert.ok(seen.channels.has(topic), `the layout shows ${topic}`);
assert.ok(named.size >= 8);
for (const topic of ['FLIGHT_STATE', 'PLAN', 'TARGET', 'POSE', 'PLANNING_STATUS']) assert.ok(plotted.has(topic), `no panel of ${topic}`);
// Every process tells how it is, the viewer included.
const {processes} = JSON.parse(fs.readFileSync(path.join(import.meta.dirname, '../../deploy/processes.json')));
for (const {name} of processes) assert.ok(seen.counts.has(`${name.toUpperCase()}_STATUS`), `nothing of ${name}`);
await until('a row of each process', () => processes.every(({name}) => page.newest.health?.rows.some((row) => row.name === name)));

// What is drawn, once the target is tracked: with its uncertainty, the plan with its stop, the forecast with its spread.
for (const [topic, part, least] of [['TARGET/scene', 'spheres', 1], ['PLAN/scene', 'lines', 2], ['PREDICTION/scene', 'spheres', 5]])
  await until(`${topic} with ${least} ${part}`, () => {
    keepPlaying();
    return (seen.most.get(topic)?.[part] ?? 0) >= least;
  });

seen.client.getParameters([], 'all');
await until('parameters', () => seen.parameters);
assert.ok(seen.parameters.parameters.some((p) => p.name === 'version'));
seen.client.setParameters([{name: 'version', value: 'x'}]);
await until('a refusal', () => seen.statuses.length > 0);

// The newer name of the protocol, and several clients at once.
const other = await connect(viewer.port, ['foxglove.sdk.v1']);
assert.strictEqual(other.socket.protocol, 'foxglove.sdk.v1');
await until('messages for the second', () => {
  if (!page.newest.state.play.playing) page.ask({play: true});
  return other.counts.has('POSE') && other.counts.has('CAMERA_IMAGE');
});

// Who comes while a log stands still is shown that moment.
page.ask({play: false});
await until('a pause', () => !page.newest.state.play.playing);
await sleep(500);
const late = await connect(viewer.port, ['foxglove.sdk.v1']);
await until('the moment for Foxglove', () => late.counts.has('POSE') && late.counts.has('CAMERA_IMAGE') && late.counts.has('SCAN_REGISTERED'), 10000);
const latePage = await pageClient(viewer.port);
latePage.ask({want: ['cloud', 'image']});
await until('sweep and image for a page', () => latePage.binary >= 2, 10000);
for (const {client} of [seen, other, late]) client.close();
await sleep(100);
await viewer.stop();
const total = [...seen.counts.values()].reduce((a, b) => a + b, 0);
console.log(`${seen.channels.size} channels, ${total} messages decoded by their schemas`);
process.exit(0);
