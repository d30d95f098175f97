// Commands from the page to a live chase-mission and back: 0 taken without the right token, one answer to a right one.
// In a network namespace of its own.
import assert from 'node:assert';
import crypto from 'node:crypto';
import fs from 'node:fs';
import {flood} from './attacks.mjs';
import {live, load, pageClient, sleep, until} from './viewer.mjs';

const TOKEN = crypto.randomBytes(16).toString('hex');
const viewer = await live(TOKEN);
const client = await pageClient(viewer.port);
const replies = [];
client.socket.on('message', (data, binary) => { if (!binary && String(data).includes('"reply"')) replies.push(JSON.parse(data)); });
// Rates of COMMAND as chase-mission's statuses say, summed up: 0 as long as it has heard none.
let commands = 0;
client.socket.on('message', (data, binary) => {
  const rows = !binary && String(data).includes('"health"') ? JSON.parse(data).rows : [];
  for (const [channel, rate] of rows.find((row) => row.name === 'mission')?.channels ?? [])
    if (channel === 'COMMAND') commands += rate;
});
const statuses = () => until('two statuses', (() => { const after = Date.now() + 2500; return () => Date.now() > after; })());
await until('the state of the flight and of chase-mission',
  () => client.newest.state?.flight && client.newest.health?.rows.some((row) => row.name === 'mission'));
assert.match(client.newest.state.flight.missing.join(), /POSE is not heard/);
assert.strictEqual(client.newest.state.row[14], 0);
await until('a row of the viewer', () => client.newest.health.rows.some((row) => row.name === 'viewer' && row.channels.length));

async function ask(request) {
  const heard = replies.length;
  client.ask({utime: client.newest.state.utime, ...request});
  await until('a reply', () => replies.length > heard, 8000);
  return replies.at(-1);
}
for (const token of [undefined, '', 'wrong', TOKEN.slice(1), TOKEN.replace(/./, 'x')])
  assert.strictEqual((await ask({command: 'takeoff', token})).refusal, 'wrong token');
for (let i = 0; i < 50; ++i) client.socket.send(crypto.randomBytes(200).toString('latin1'));
assert.strictEqual((await ask({command: 'explode', token: TOKEN})).refusal, 'no such command');
await statuses();
assert.strictEqual(commands, 0, 'a command was sent');
const answer = await ask({command: 'takeoff', token: TOKEN});
assert.match(answer.refusal, /^takeoff in IDLE: .*POSE is not heard/);
const heard = replies.length;
await statuses();
assert.strictEqual(replies.length, heard, 'answered more than once');
assert.ok(commands > 0);

// What waited in a link that stalled is refused when it arrives.
const given = commands;
viewer.process.kill('SIGSTOP');
const stalled = ask({command: 'takeoff', token: TOKEN});
await sleep(3000);
viewer.process.kill('SIGCONT');
assert.match((await stalled).refusal, /^given [3-9]\.\d s ago$/);
await statuses();
assert.strictEqual(commands, given, 'an old command was sent');

// While others flood the viewer with wrong tokens, each command reaches chase-mission and is answered, and theirs do not.
const stopFlood = await flood(viewer.port);
await until('requests that are dropped', () => / [1-9]\d* requests dropped/.test(client.newest.health.self));
for (const command of ['stop', 'hold', 'stop'])
  assert.match((await ask({command, token: TOKEN})).refusal, new RegExp(`^${command} in IDLE: `));
stopFlood();

// By Foxglove's service: offered because there is a token, and bound to it.
const {FoxgloveClient} = load('@foxglove/ws-protocol'), {WebSocket} = load('ws');
const foxglove = new FoxgloveClient({ws: new WebSocket(`ws://127.0.0.1:${viewer.port}/`, [FoxgloveClient.SUPPORTED_SUBPROTOCOL])});
const answers = new Map();
let services, failures = 0;
foxglove.on('advertiseServices', (list) => { services = list; });
foxglove.on('serviceCallResponse', ({callId, data}) => answers.set(callId, JSON.parse(new TextDecoder().decode(data))));
foxglove.on('serviceCallFailure', () => failures++);
await until('the service', () => services);
async function call(callId, payload) {
  const data = new TextEncoder().encode(typeof payload === 'string' ? payload : JSON.stringify(payload));
  foxglove.sendServiceCallRequest({serviceId: services[0].id, callId, encoding: 'json', data: new DataView(data.buffer)});
  const before = failures;
  await until('an answer', () => answers.has(callId) || failures > before, 8000);
  return answers.get(callId);
}
assert.deepStrictEqual(await call(1, {command: 'land', token: 'wrong'}), {accepted: false, words: 'wrong token'});
assert.deepStrictEqual(await call(2, {command: 'land'}), {accepted: false, words: 'wrong token'});
assert.strictEqual(await call(3, '{'), undefined);
assert.strictEqual(await call(4, {token: TOKEN}), undefined);
assert.deepStrictEqual(await call(5, {command: 'kill', token: TOKEN}), {accepted: false, words: 'not from a page: chase-command kill --force'});
const toPages = replies.length;
assert.match((await call(6, {command: 'takeoff', token: TOKEN})).words, /^takeoff in IDLE: .*POSE is not heard/);
assert.strictEqual(replies.length, toPages, 'pages heard the answer');
assert.match((await call(7, {command: 'takeoff', token: TOKEN, utime: client.newest.state.utime - 3e6})).words, /^given 3\.\d s ago$/);
assert.match((await call(8, {command: 'takeoff', token: TOKEN, utime: client.newest.state.utime})).words, /^takeoff in IDLE: /);
foxglove.close();

// The same by hand in a browser: the buttons wait for the arm switch and a token.
const CHROMIUM = '/usr/bin/chromium';
if (fs.existsSync(CHROMIUM)) {
  const {chromium} = load('playwright-core');
  const browser = await chromium.launch({executablePath: CHROMIUM,
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader']});
  const page = await browser.newPage({viewport: {width: 1280, height: 720}});
  await page.goto(viewer.url);
  await page.waitForFunction(() => window.chase?.model.state?.flight);
  assert.match(await page.textContent('#flight'), /^IDLE: .*POSE is not heard/);
  const button = '#buttons button:nth-child(6)';
  assert.strictEqual(await page.textContent(button), 'land');
  assert.ok(await page.isDisabled(button));
  await page.fill('#token', TOKEN);
  assert.ok(await page.isDisabled(button), 'not armed');
  await page.check('#arm');
  await page.click(button);
  await page.waitForFunction(() => document.getElementById('reply').className);
  assert.match(await page.textContent('#reply'), /^land: refused: land in IDLE/);
  await page.uncheck('#arm');
  assert.ok(await page.isDisabled(button));
  await browser.close();
}
client.socket.terminate();
await viewer.stop();
console.log('commands in order');
process.exit(0);
