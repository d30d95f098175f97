// Over a link of 200 kB/s and 200 ms, with the sweep and the camera on, what the page shows is at most a second old and does
// not grow older.
import assert from 'node:assert';
import net from 'node:net';
import {pageClient, play, sleep, until} from './viewer.mjs';

const RATE = 200000, DELAY = 200;  // bytes/s; ms each way

// Passes on at that rate and that late, and holds whatever does not fit: the worst that a link can do to a sender.
function slowly(from, to) {
  let free = 0;
  from.on('data', (data) => {
    free = Math.max(free, Date.now()) + 1000 * data.length / RATE;
    setTimeout(() => to.write(data), free + DELAY - Date.now());
  });
  from.on('close', () => to.destroy());
  from.on('error', () => to.destroy());
}

const viewer = await play();
const relay = net.createServer((client) => {
  const server = net.connect(viewer.port, '127.0.0.1');
  slowly(client, server);
  slowly(server, client);
});
await new Promise((done) => relay.listen(0, '127.0.0.1', done));

const near = await pageClient(viewer.port), far = await pageClient(relay.address().port);
far.ask({want: ['cloud', 'image'], speed: 0.5});
await until('the first sweep', () => far.binary > 0 && far.newest.state?.play);
const ages = [];
for (let i = 0; i < 60; ++i) {
  await sleep(100);
  ages.push((near.newest.state.play.t - far.newest.state.play.t) / 0.5);
}
const oldest = Math.max(...ages), mean = (part) => part.reduce((a, b) => a + b, 0) / part.length;
console.log(`oldest state ${oldest.toFixed(2)} s; mean ${mean(ages.slice(0, 20)).toFixed(2)} s at first, ` +
  `${mean(ages.slice(-20)).toFixed(2)} s at last; ${far.states.length} states, ${far.binary} sweeps and images`);
assert.ok(oldest <= 1, `a state was ${oldest} s old`);
assert.ok(mean(ages.slice(-20)) < mean(ages.slice(0, 20)) + 0.2, 'it grows older');
assert.ok(far.states.length > 30 && far.binary > 10, 'not usable');
near.socket.terminate();
far.socket.terminate();
relay.close();
await viewer.stop();
process.exit(0);
