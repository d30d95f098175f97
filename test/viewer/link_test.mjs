// Over a link of 200 kB/s and 200 ms, with the sweep and the camera on, what the page shows is at most a second old; over
// one that carries half of what the page wants it is as old as what is under way (48 kB) and grows no older.
import assert from 'node:assert';
import net from 'node:net';
import {pageClient, play, sleep, until} from './viewer.mjs';

const DELAY = 200;  // ms each way
// bytes/s; s: (48 + 16 kB) / rate and a second; states that come in ten seconds, of 100, the slow one's after 64 kB of others
const LINKS = [{rate: 200000, most: 1, least: 60}, {rate: 15000, most: 6, least: 10}];

// Passes on at that rate and that late, and holds whatever does not fit: the worst that a link can do to a sender.
function slowly(from, to, rate) {
  let free = 0;
  from.on('data', (data) => {
    free = Math.max(free, Date.now()) + 1000 * data.length / rate;
    setTimeout(() => to.write(data), free + DELAY - Date.now());
  });
  from.on('close', () => to.destroy());
  from.on('error', () => to.destroy());
}

const viewer = await play();
const mean = (part) => part.reduce((a, b) => a + b, 0) / part.length;
const near = await pageClient(viewer.port);

async function look({rate, most, least}) {
  const relay = net.createServer((client) => {
    const server = net.connect(viewer.port, '127.0.0.1');
    slowly(client, server, rate);
    slowly(server, client, rate);
  });
  await new Promise((done) => relay.listen(0, '127.0.0.1', done));
  const far = await pageClient(relay.address().port);
  far.ask({want: ['cloud', 'image'], seek: 0, play: true});
  await until('the first sweep', () => far.binary > 1 && far.newest.state?.play.t < 10);
  await sleep(3000);  // until the link is full
  const ages = [];
  for (let i = 0; i < 70; ++i) {
    await sleep(100);
    ages.push(near.newest.state.play.t - far.newest.state.play.t);
  }
  const oldest = Math.max(...ages), first = mean(ages.slice(0, 20)), last = mean(ages.slice(-20));
  console.log(`${rate / 1000} kB/s: oldest state ${oldest.toFixed(2)} s; mean ${first.toFixed(2)} s at first, ${last.toFixed(2)} s at last; ${far.states.length} states, ${far.binary} sweeps and images`);
  assert.ok(oldest <= most, `a state was ${oldest} s old`);
  assert.ok(last <= first + 1, 'a queue grows');
  assert.ok(far.states.length >= least && far.binary > 5, 'not usable');
  far.socket.terminate();
  relay.close();
}

for (const link of LINKS) await look(link);
near.socket.terminate();
await viewer.stop();
process.exit(0);
