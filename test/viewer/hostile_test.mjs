// Hostile clients neither crash the viewer nor slow it for the others, and no command is taken.
import assert from 'node:assert';
import fs from 'node:fs';
import http from 'node:http';
import {connectOften, flood, openDeaf, raw, sendGarbage} from './attacks.mjs';
import {pageClient, play, sleep, until} from './viewer.mjs';

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

const get = (path) => new Promise((done, fail) => {
  http.get({port: viewer.port, host: '127.0.0.1', path, agent: false}, (answer) => {
    answer.resume();
    done(answer.statusCode);
  }).on('error', fail);
});
// Who only asks for files, and stays, is not counted as connected.
const agent = new http.Agent({keepAlive: true});
await Promise.all([...Array(6)].map(() => new Promise((done, fail) =>
  http.get({port: viewer.port, host: '127.0.0.1', path: '/', agent}, (answer) => answer.resume().on('end', done)).on('error', fail))));
const healths = good.newest.health;
await until('a newer status', () => good.newest.health !== healths);
assert.match(good.newest.health.self, /^1 connected, /);
agent.destroy();
// Paths that lead out, and methods that write.
for (const path of ['/../../etc/passwd', '/..%2f..%2fetc/passwd', '/%2e%2e/%2e%2e/etc/passwd', '//etc/passwd', '/main.js/../../x',
  '/./main.js', '/main.js%00.html', '\\..\\etc', '/etc/passwd', '/index.html.gz', '/ws'])
  assert.match(await raw(viewer.port, `GET ${path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n`), /^HTTP\/1.1 40[04]|^$/, path);
assert.match(await raw(viewer.port, 'POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\nConnection: close\r\n\r\nhi'), /405/);

await sendGarbage(viewer.port);
await connectOften(viewer.port);
const deaf = await openDeaf(viewer.port);
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

// While others ask more than anybody may, and are refused by themselves, each command and each seek is heard.
const stopFlood = await flood(viewer.port);
await until('requests that are dropped', () => / [1-9]\d* requests dropped/.test(good.newest.health.self));
replies.length = 0;
for (let i = 1; i <= 5; ++i) {
  good.ask({command: 'stop', token: TOKEN});
  good.ask({seek: i, play: false});
  await until(`answer ${i} in a flood`, () => replies.length === i && good.newest.state.play.t === i, 10000);
}
assert.deepStrictEqual(new Set(replies), new Set(['a log is played: nobody flies']), 'the refusal of another was heard');
stopFlood();

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
