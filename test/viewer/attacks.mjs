// What hostile clients do to a viewer's port.
import net from 'node:net';
import crypto from 'node:crypto';
import {load, sleep, until} from './viewer.mjs';

const {WebSocket} = load('ws');

// Sends bytes and hands over what comes back until the end of the connection.
export const raw = (port, bytes, wait = 300) => new Promise((done) => {
  let answer = '';
  const socket = net.connect(port, '127.0.0.1', () => socket.write(bytes));
  socket.on('data', (data) => { answer += data; });
  socket.on('error', () => done(answer));
  socket.on('close', () => done(answer));
  setTimeout(() => { socket.destroy(); done(answer); }, wait);
});
const upgrade = (path, extra = '') => `GET ${path} HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n` +
  `Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${crypto.randomBytes(16).toString('base64')}\r\n${extra}\r\n`;
const open = (port, protocols) => new Promise((done) => {
  const socket = new WebSocket(`ws://127.0.0.1:${port}/ws`, protocols);
  socket.on('open', () => done(socket));
  socket.on('error', () => done(null));
});

// Instead of HTTP, of a hand-shake and of frames.
export async function sendGarbage(port) {
  await Promise.all([
    crypto.randomBytes(5000), 'GET / HTTP/9.9\r\n\r\n', '\r\n\r\n\r\n', `GET /${'x'.repeat(100000)} HTTP/1.1\r\n\r\n`,
    `GET / HTTP/1.1\r\n${'a: b\r\n'.repeat(20000)}\r\n`, `POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n`,
    `GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n`, upgrade('/ws').replace('13', '7'),
    upgrade('/elsewhere'), upgrade('/ws', 'Sec-WebSocket-Protocol: ,,;"\x01\r\n'),
    ...[...Array(20)].map(() => Buffer.concat([Buffer.from(upgrade('/ws')), crypto.randomBytes(3000)])),
    ...[...Array(10)].map(() => Buffer.concat([Buffer.from(upgrade('/', 'Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n')), crypto.randomBytes(3000)])),
  ].map((bytes) => raw(port, bytes)));
  for (const protocols of [[], ['foxglove.websocket.v1']]) {
    const texts = ['{', '[]', 'null', '{"ack":1e400}', '['.repeat(60000), '{"want":[[]]}', '{"seek":"x"}', '{"op":"subscribe","subscriptions":{"a":1}}',
      '{"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967295}]}', '{"op":"getParameters","parameterNames":[{}],"id":7}', '\u0000'];
    const socket = await open(port, protocols);
    for (const text of texts) socket.send(text);
    socket.send(crypto.randomBytes(1000));
    socket.send(Buffer.from('\x02\x01\0\0\0\x01\0\0\0\xff\xff\xff\xffjson{}', 'latin1'));  // a call of a service
    await sleep(100);
    socket.send('x'.repeat(1 << 20));  // more than it reads
    await until('the oversized client is sent away', () => socket.readyState === WebSocket.CLOSED);
  }
}

// A thousand connections, some held open, more than there are places for.
export async function connectOften(port) {
  const held = [];
  for (let i = 0; i < 1000; ++i) {
    const socket = net.connect(port, '127.0.0.1');
    socket.on('error', () => {});
    if (i % 4 === 0) held.push(socket);
    else setTimeout(() => socket.destroy(), 20);
    if (i % 50 === 0) await sleep(10);
  }
  await sleep(1000);
  for (const socket of held) socket.destroy();
  await sleep(300);
}

// More requests than one may have, from many at once, until stop() is called; without a token, or with a wrong one.
export async function flood(port) {
  const sockets = (await Promise.all([...Array(20)].map((_, i) => open(port, i % 4 ? [] : ['foxglove.websocket.v1'])))).filter((socket) => socket);
  const texts = ['{"command":"land","token":"wrong"}', '{"command":"stop"}', '{"want":["cloud"]}', '{"op":"unsubscribe","subscriptionIds":[]}'];
  const timer = setInterval(() => {
    for (const socket of sockets)
      for (let i = 0; i < 10 && socket.bufferedAmount < 100000; ++i) socket.send(texts[i % texts.length]);
  }, 20);
  return () => {
    clearInterval(timer);
    for (const socket of sockets) socket.terminate();
  };
}

// Readers that read nothing: pages, and Foxglove clients that want every channel, images included.
export async function openDeaf(port) {
  const deaf = [];
  for (let i = 0; i < 20; ++i) {
    const socket = await open(port, i % 2 ? ['foxglove.websocket.v1'] : []);
    if (!socket) continue;  // there are too many
    if (i % 2) socket.send(JSON.stringify({op: 'subscribe', subscriptions: [...Array(60).keys()].map((id) => ({id, channelId: id + 1}))}));
    else socket.send('{"want":["cloud","image"]}');
    socket._socket.pause();
    deaf.push(socket);
  }
  return deaf;
}
