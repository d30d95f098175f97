// Looks on at a live flight until its input ends: node onlooker.mjs none none MODULES PORT page|chromium|hostile.
// Prints what it saw as one line of JSON; exits 1 where that is not enough.
import assert from 'node:assert';
import {connectOften, flood, openDeaf, sendGarbage} from './attacks.mjs';
import {load, pageClient, sleep} from './viewer.mjs';

const [port, kind] = [Number(process.argv[5]), process.argv[6]];
let over = false;
process.stdin.on('end', () => { over = true; }).resume();

// A page that wants all there is, and plays with its switches.
async function lookOn() {
  const client = await pageClient(port);
  const ages = [];
  for (let i = 0; !over; ++i, await sleep(500)) {
    client.ask({want: i % 20 < 15 ? ['cloud', 'image'] : ['image']});
    if (client.newest.state?.drone) ages.push(client.newest.state.drone.age);
  }
  client.socket.terminate();
  return {states: client.states.length, sweeps_and_images: client.binary, oldest_pose_s: Math.max(...ages)};
}

async function attack() {
  const replies = [];
  let rounds = 0;
  for (; !over; ++rounds) {
    await sendGarbage(port).catch(() => {});
    await connectOften(port);
    const deaf = await openDeaf(port);
    const client = await pageClient(port).catch(() => null);
    client?.socket.on('message', (data, binary) => { if (!binary && String(data).includes('"reply"')) replies.push(JSON.parse(data).refusal); });
    for (const token of ['', 'wrong', 'x'.repeat(32)]) client?.ask({command: 'land', token});
    await sleep(1500);
    const stop = await flood(port);
    await sleep(1500);
    stop();
    for (const socket of [...deaf, ...(client ? [client.socket] : [])]) socket.terminate();
  }
  assert.ok(replies.length > 0 && replies.every((refusal) => refusal), JSON.stringify(replies));
  return {rounds, refused: replies.length};
}

// The page itself: drone, sweep, plan and image are there and change.
async function openPage() {
  const {chromium} = load('playwright-core');
  const browser = await chromium.launch({executablePath: '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader']});
  const page = await browser.newPage({viewport: {width: 1280, height: 720}});
  await page.goto(`http://127.0.0.1:${port}/`);
  const seen = {drone: new Set(), plan: new Set(), image: new Set(), sweeps: 0, frames: 0, verdict: ''};
  while (!over) {
    await sleep(1000);
    const now = await page.evaluate(() => {
      const {scene, counts} = window.chase ?? {};
      const image = document.getElementById('image');
      const plan = scene?.plan.geometry.attributes.position?.array.slice(0, 9);
      return {drone: scene?.drone.visible && String(scene.drone.position.toArray()), plan: scene?.plan.visible && String(plan),
        image: counts?.image && String(image.getContext('2d').getImageData(0, image.height / 2, image.width, 1).data), sweeps: counts?.cloud ?? 0,
        frames: scene?.frames ?? 0, verdict: document.getElementById('verdict').textContent};
    }).catch(() => ({}));
    for (const part of ['drone', 'plan', 'image']) if (now[part]) seen[part].add(now[part]);
    Object.assign(seen, {sweeps: Math.max(now.sweeps ?? 0, seen.sweeps), frames: now.frames ?? seen.frames, verdict: now.verdict ?? seen.verdict});
  }
  await browser.close();
  for (const part of ['drone', 'plan', 'image']) assert.ok(seen[part].size > 10, `${part}: ${seen[part].size}`);
  assert.ok(seen.sweeps > 10, `${seen.sweeps} sweeps`);
  return {drone: seen.drone.size, plan: seen.plan.size, image: seen.image.size, sweeps: seen.sweeps, frames: seen.frames, verdict: seen.verdict};
}

const seen = await {page: lookOn, chromium: openPage, hostile: attack}[kind]();
console.log(JSON.stringify(seen));
process.exit(0);
