// Hostile clients neither crash the viewer nor slow it for the others, and no command is taken.
import assert from 'node:assert';
import fs from 'node:fs';
import http from 'node:http';
import net from 'node:net';
import crypto from 'node:crypto';
import {load, pageClient, play, sleep, until} from './viewer.mjs';

const {WebSocket} = load('ws');
const TOKEN = 'right-token-of-the-test';
const viewer = await play(`token: ${TOKEN}\n`);
const rss = () => Number(/VmRSS:\s+(\d+)/.exec(fs.readFileSync(`/proc/${viewer.process.pid}/status`, 'utf8'))[1]) / 1024;
const good = await pageClient(viewer.port);
good.ask({want: ['cloud', 'image'], speed: 0.5});
await until('the first states', () => good.states.length > 5);
const mean = (from, to = good.states.length - 1) => (good.states[to] - good.states[from]) / (to - from);
const before = good.states.length;
await sleep(2000);
const usual = mean(before);  // ms from state to state: what this machine can do today
const quiet = good.states.length - 1;
const atFirst = rss();

const raw = (bytes, wait = 300) => new Promise((done) => {
  let answer = '';
  const socket = net.connect(viewer.port, '127.0.0.1', () => socket.write(bytes));
  socket.on('data', (data) => { answer += data; });
  socket.on('error', () => done(answer));
  socket.on('close', () => done(answer));
  setTimeout(() => { socket.destroy(); done(answer); }, wait);
});
const get = (path) => new Promise((done, fail) => {
  http.get({port: viewer.port, host: '127.0.0.1', path, agent: false}, (answer) => {
    answer.resume();
    done(answer.statusCode);
  }).on('error', fail);
});
const upgrade = (path, extra = '') => `GET ${path} HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n` +
  `Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${crypto.randomBytes(16).toString('base64')}\r\n${extra}\r\n`;
const open = (protocols) => new Promise((done) => {
  const socket = new WebSocket(`ws://127.0.0.1:${viewer.port}/ws`, protocols);
  socket.on('open', () => done(socket));
  socket.on('error', () => done(null));
});

// Paths that lead out, and methods that write.
for (const path of ['/../../etc/passwd', '/..%2f..%2fetc/passwd', '/%2e%2e/%2e%2e/etc/passwd', '//etc/passwd', '/main.js/../../x',
  '/./main.js', '/main.js%00.html', '\\..\\etc', '/etc/passwd', '/index.html.gz', '/ws'])
  assert.match(await raw(`GET ${path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n`), /^HTTP\/1.1 40[04]|^$/, path);
assert.match(await raw('POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\nConnection: close\r\n\r\nhi'), /405/);

// Garbage instead of HTTP, of a hand-shake and of frames.
await Promise.all([
  raw(crypto.randomBytes(5000)), raw('GET / HTTP/9.9\r\n\r\n'), raw('\r\n\r\n\r\n'), raw(`GET /${'x'.repeat(100000)} HTTP/1.1\r\n\r\n`),
  raw(`GET / HTTP/1.1\r\n${'a: b\r\n'.repeat(20000)}\r\n`), raw(`POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n`),
  raw(`GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n`), raw(upgrade('/ws').replace('13', '7')),
  raw(upgrade('/elsewhere')), raw(upgrade('/ws', 'Sec-WebSocket-Protocol: ,,;"\x01\r\n')),
  ...[...Array(20)].map(() => raw(Buffer.concat([Buffer.from(upgrade('/ws')), crypto.randomBytes(3000)]))),
  ...[...Array(10)].map(() => raw(Buffer.concat([Buffer.from(upgrade('/', 'Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n')), crypto.randomBytes(3000)])))]);
for (const protocols of [[], ['foxglove.websocket.v1']]) {
  const texts = ['{', '[]', 'null', '{"ack":1e400}', '['.repeat(60000), '{"want":[[]]}', '{"seek":"x"}', '{"op":"subscribe","subscriptions":{"a":1}}',
    '{"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967295}]}', '{"op":"getParameters","parameterNames":[{}],"id":7}', '\u0000'];
  const socket = await open(protocols);
  for (const text of texts) socket.send(text);
  socket.send(crypto.randomBytes(1000));
  await sleep(100);
  socket.send('x'.repeat(1 << 20));  // more than it reads
  await until('the oversized client is sent away', () => socket.readyState === WebSocket.CLOSED);
}

// A thousand connections, some held open, more than there are places for.
const held = [];
for (let i = 0; i < 1000; ++i) {
  const socket = net.connect(viewer.port, '127.0.0.1');
  socket.on('error', () => {});
  if (i % 4 === 0) held.push(socket);
  else setTimeout(() => socket.destroy(), 20);
  if (i % 50 === 0) await sleep(10);
}
await sleep(1000);
for (const socket of held) socket.destroy();
await sleep(300);

// Readers that read nothing: pages, and Foxglove clients that want every channel, images included.
const deaf = [];
for (let i = 0; i < 20; ++i) {
  const socket = await open(i % 2 ? ['foxglove.websocket.v1'] : []);
  if (i % 2) socket.send(JSON.stringify({op: 'subscribe', subscriptions: [...Array(60).keys()].map((id) => ({id, channelId: id + 1}))}));
  else socket.send('{"want":["cloud","image"]}');
  socket._socket.pause();
  deaf.push(socket);
}
await sleep(4000);
const grown = rss() - atFirst;
for (const socket of deaf) socket.terminate();

// Commands: a wrong token, none, an unknown command; and the right one, while a log is played.
const replies = [];
good.socket.on('message', (data, binary) => { if (!binary && String(data).includes('"reply"')) replies.push(JSON.parse(data).refusal); });
for (const request of [{command: 'land', token: TOKEN.replace('right', 'wrong')}, {command: 'land'}, {command: 'land', token: ''},
  {command: 'explode', token: TOKEN}, {command: 'land', token: TOKEN}]) {
  const heard = replies.length;
  good.ask(request);
  await until('a reply', () => replies.length > heard);
}
assert.deepStrictEqual(replies, ['wrong token', 'wrong token', 'wrong token', 'no such command', 'a log is played: nobody flies']);

const attacked = mean(quiet);
const longest = Math.max(...good.states.slice(quiet + 1).map((t, i) => t - good.states[quiet + i]));
assert.strictEqual(viewer.process.exitCode, null, 'the viewer has ended');
assert.strictEqual(await get('/'), 200);
assert.ok(attacked < 1.5 * usual, `a state every ${attacked} ms, before ${usual} ms`);
assert.ok(longest < 20 * usual, `a gap of ${longest} ms`);
assert.ok(grown < 150, `grew by ${grown} MiB`);
assert.ok(good.binary > 10);
good.socket.terminate();
await viewer.stop();
console.log(`alive; a state every ${attacked.toFixed(0)} ms, before ${usual.toFixed(0)} ms; longest gap ${longest} ms; grew by ${grown.toFixed(0)} MiB`);
process.exit(0);
