// What the viewer's tests share: the program playing a log, and clients of it.
import {spawn} from 'node:child_process';
import {createRequire} from 'node:module';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';

export const [bin, log, modules] = process.argv.slice(2);
export const load = createRequire(path.resolve(modules, 'x.js'));
export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

export async function until(what, condition, limit = 30000) {
  for (const end = Date.now() + limit; Date.now() < end; await sleep(50))
    if (await condition()) return;
  throw new Error(`not within ${limit} ms: ${what}`);
}

// Starts chase-viewer on a free port; resolves with {url, port, process, stop}.
export async function play(config = '', played = log) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'viewer-'));
  const file = path.join(folder, 'viewer.yaml');
  fs.writeFileSync(file, `address: 127.0.0.1\n${config}`);
  const child = spawn(path.join(bin, 'chase-viewer'), ['--port', '0', '--play', played, '--config', file],
    {stdio: ['ignore', 'pipe', 'inherit']});
  process.on('exit', () => child.kill('SIGKILL'));
  let text = '';
  child.stdout.on('data', (data) => { text += data; });
  await until('the viewer is up', () => /http:\/\/localhost:(\d+)/.test(text) || child.exitCode !== null, 30000);
  const port = Number(/:(\d+)/.exec(text)?.[1]);
  const ended = new Promise((done) => child.on('exit', (code) => done(code)));
  const stop = async () => {
    child.kill('SIGINT');
    const code = await ended;
    fs.rmSync(folder, {recursive: true});
    if (code !== 0) throw new Error(`chase-viewer ended with ${code}`);
  };
  return {url: `http://127.0.0.1:${port}/`, port, process: child, stop};
}

// Starts chase-mission with nothing to fly and a viewer that takes commands with the token; resolves like play.
export async function live(token) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'viewer-'));
  const file = path.join(folder, 'token');
  fs.writeFileSync(file, `${token}\n`);
  const port = 18080;  // of a network namespace of its own
  const start = (name, ...words) => spawn(path.join(bin, `chase-${name}`), words, {stdio: ['ignore', 'ignore', 'inherit']});
  const children = [start('mission'), start('viewer', '--port', String(port), '--token-file', file)];
  process.on('exit', () => children.forEach((child) => child.kill('SIGKILL')));
  const url = `http://127.0.0.1:${port}/`;
  await until('the viewer is up', () => fetch(url).then((answer) => answer.ok, () => false));
  const stop = async () => {
    for (const child of children) {
      const ended = new Promise((done) => child.on('exit', done));
      child.kill('SIGINT');
      if (await ended !== 0) throw new Error(`${child.spawnfile} ended badly`);
    }
    fs.rmSync(folder, {recursive: true});
  };
  return {url, port, process: children[1], stop};
}

// A page without a browser: acknowledges, keeps the newest of every type.
export async function pageClient(port) {
  const {WebSocket} = load('ws');
  const socket = new WebSocket(`ws://127.0.0.1:${port}/ws`);
  const client = {socket, newest: {}, states: [], binary: 0, ask: (request) => socket.send(JSON.stringify(request))};
  socket.on('message', (data, binary) => {
    client.ask({ack: 1});
    if (binary) { client.binary++; return; }
    const message = JSON.parse(data);
    client.newest[message.type] = message;
    if (message.type === 'state') client.states.push(Date.now());
  });
  await new Promise((done, fail) => { socket.on('open', done); socket.on('error', fail); });
  return client;
}
