// The page in headless Chromium while a log is played: drone, sweep, plan and image are there and change. With --judge, for a
// machine that does nothing else, 30 frames a second, too.
import assert from 'node:assert';
import fs from 'node:fs';
import {load, play, sleep, until} from './viewer.mjs';

const {chromium} = load('playwright-core');
const CHROMIUM = '/usr/bin/chromium';
if (!fs.existsSync(CHROMIUM)) {
  console.log(`skipped: no ${CHROMIUM}; cure: deploy/setup`);
  process.exit(77);
}

const viewer = await play();
const browser = await chromium.launch({executablePath: CHROMIUM,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader']});
const page = await browser.newPage({viewport: {width: 1280, height: 720}});
const problems = [];
page.on('pageerror', (error) => problems.push(error.stack));
page.on('requestfailed', (request) => problems.push(`failed: ${request.url()}`));
page.on('request', (request) => { if (!/^(ws|http):\/\/127\.0\.0\.1|^blob:|^data:/.test(request.url())) problems.push(`asks the internet: ${request.url()}`); });
await page.goto(viewer.url);
await page.waitForFunction(() => window.chase);

const look = () => page.evaluate(() => {
  const {scene, model, counts} = window.chase;
  const image = document.getElementById('image');
  const pixels = image.getContext('2d').getImageData(0, 0, image.width, image.height).data;
  let hash = 0;
  for (let i = 0; i < pixels.length; i += 16) hash = (hash * 31 + pixels[i]) | 0;
  const plan = scene.plan.geometry.attributes.position;
  return {drone: scene.drone.visible && scene.drone.position.toArray(), points: scene.points ?? 0,
    plan: scene.plan.visible && Array.from(plan.array.slice(0, 9)), image: hash, counts: {...counts}, frames: scene.frames,
    level: scene.detail.level, calls: scene.renderer.info.render.calls, t: model.play?.t, rows: model.rows.length, obstacles: scene.shown.solids,
    verdict: document.getElementById('verdict').textContent, health: document.querySelectorAll('#health details').length};
});
const seek = async (t) => {
  await page.evaluate((to) => {
    const scrubber = document.getElementById('scrubber');
    scrubber.value = to;
    scrubber.dispatchEvent(new Event('input'));
    scrubber.dispatchEvent(new Event('change'));
  }, t);
  await until(`the state at ${t} s`, async () => { const s = await look(); return s.t >= t - 0.1 && s.t < t + 3; });
};
// A sweep and obstacles, while the log stands still, that stay.
async function shown(look, where) {
  const all = async () => { const s = await look(); return s.points > 100 && s.obstacles > 0; };
  await until(`a sweep and obstacles ${where}`, all, 5000);
  await sleep(500);
  assert.ok(await all(), `sweep or obstacles have gone ${where}`);
}
const toggle = () => page.click('#playbutton');
const paused = async () => !(await page.evaluate(() => window.chase.model.play.playing));
// On a slow machine the log may have ended by itself: toggles only what plays.
const pause = () => until('a pause', async () => await paused() || (await toggle(), await sleep(500)));

await until('the scene', async () => { const s = await look(); return s.drone && s.points > 100 && s.plan && s.counts.image > 1; }, 20000);
const before = await look(), since = Date.now();
let after = before;
await until('twenty states, two images, a sweep, and a drone and a plan that move', async () => {
  after = await look();
  const moves = ['drone', 'plan'].every((part) => String(after[part]) !== String(before[part]));
  return moves && ['state', 'image', 'cloud'].every((part, i) => after.counts[part] - before.counts[part] >= [20, 2, 1][i]);
});
assert.notStrictEqual(after.image, before.image, 'the image stands still');
assert.ok(after.obstacles > 0 && after.health >= 5 && after.verdict.length > 0);
assert.match(await page.textContent('#legend'), /chase.*wider.*kept.*safe only.*brake.*wait.*escape.*mitigate/);
const fps = (after.frames - before.frames) / (Date.now() - since) * 1000;

// Few calls into software GL draw the whole scene, and a machine that is slow at it draws less finely.
assert.ok(after.calls <= 20, `${after.calls} draw calls`);
const levels = await page.evaluate(async () => {
  const {Detail} = await import('./detail.js'), detail = new Detail(), seen = [];
  let t = 0;
  for (const dt of [0.05, 0.05, 0.033, 0.033, 0.05, 0.033]) {
    for (const end = t + 15; t < end; t += dt) detail.note(t, dt);
    seen.push(detail.level);
  }
  return seen;
});
assert.deepStrictEqual(levels, [2, 2, 2, 1, 2, 2]);
// What moves is drawn on its way between two states; a seek jumps.
const way = await page.evaluate(async () => {
  const {Motion} = await import('./motion.js'), motion = new Motion(), thing = window.chase.scene.target.clone();
  const at = (t) => { motion.move(t); return Number(thing.position.x.toFixed(3)); };
  const put = (t, x, generation) => { thing.position.set(x, 0, 0); motion.aim(t, generation, [thing]); };
  thing.userData = {};
  put(0, 1, 0);
  put(0.1, 2, 0);
  const seen = [at(0.1), at(0.15), at(0.3)];
  put(0.35, 7, 1);
  return [...seen, at(0.36)];
});
assert.deepStrictEqual(way, [1, 1.5, 2, 7]);

// What has not changed is not drawn anew, and strips change four times a second at most.
await pause();
await sleep(3000);  // the camera comes to rest
const idle = await page.evaluate(async () => {
  const {scene, counts} = window.chase, before = [scene.frames, counts.lines, counts.state];
  const changes = [], watch = new MutationObserver((records) => changes.push(...records.map((r) => r.target.id)));
  for (const part of document.querySelectorAll('header, #view')) watch.observe(part, {subtree: true, childList: true, characterData: true, attributes: true});
  await new Promise((done) => setTimeout(done, 1000));
  watch.disconnect();
  return {changes, frames: scene.frames - before[0], lines: counts.lines - before[1], states: counts.state - before[2]};
});
assert.ok(idle.states >= 5, `${idle.states} states`);
assert.deepStrictEqual([idle.changes, idle.frames, idle.lines], [[], 0, 0]);
await toggle();
const running = await page.evaluate(async () => {
  const {counts} = window.chase, before = counts.lines, places = new Set();
  for (const end = performance.now() + 2000; performance.now() < end; await new Promise((done) => setTimeout(done, 20)))
    places.add(document.getElementById('scrubber').value);
  return {lines: counts.lines - before, places: places.size};
});
assert.ok(running.lines >= 2 && running.lines <= 9, `${running.lines} times in 2 s`);
assert.ok(running.places <= running.lines + 1, `the scrubber is at ${running.places} places, the lines at ${running.lines}`);

// A process's row stays where it is while its figures change.
await page.click('#health details summary');
const health = after.counts.health;
await until('two more statuses', async () => (await look()).counts.health >= health + 2);
assert.ok(await page.evaluate(() => document.querySelector('#health details').open));

// A seek shows the state at that time: the drone stands where the history says.
await pause();
const duration = await page.evaluate(() => window.chase.model.duration);
for (const share of [0.9, 0.3, 0.7]) {
  await seek(share * duration);
  const error = await page.evaluate(() => {
    const {model, scene} = window.chase;
    const row = model.rows.findLast((r) => r[0] <= model.play.t + 0.051);
    return Math.hypot(...[0, 1, 2].map((k) => row[8 + k] - scene.drone.position.getComponent(k)));
  });
  assert.ok(error < 0.3, `the drone is ${error} m from where it was at ${share} of the log`);
  await shown(look, `at ${share} of the log`);
}
// So does a page that is opened while the log stands still.
const late = await browser.newPage({viewport: {width: 640, height: 480}});
await late.goto(viewer.url);
await late.waitForFunction(() => window.chase?.model.state);
await shown(() => late.evaluate(() => ({points: window.chase.scene.points, obstacles: window.chase.scene.shown.solids})), 'on a page that comes late');
await late.close();
// The same time is at the same place on the scrubber and on what is below it.
const played = () => page.evaluate(() => window.chase.model.play.t);
const {left, width} = await page.evaluate(() => { const {left, width} = document.getElementById('timeline').getBoundingClientRect(); return {left, width}; });
for (const share of [0.1, 0.5, 0.9]) {
  const clicked = async (id) => {
    const box = await (await page.$(id)).boundingBox(), before = await played();
    await page.mouse.click(left + share * width, box.y + box.height / 2);
    await until('a seek', async () => await played() !== before);
    return played();
  };
  const scrubbed = await clicked('#scrubber');
  await seek(0);
  await until('the beginning', async () => await played() < 0.05);
  const drawn = await clicked('#timeline');
  assert.ok(Math.abs(scrubbed - drawn) < 0.05 + 2 * duration / width, `${scrubbed} s on the scrubber, ${drawn} s on the time line`);
}
await page.selectOption('#speed', '10');
await seek(0);
await toggle();
await until('ten times as fast to the end', async () => (await look()).t >= duration - 0.01, 1000 * (duration / 10 + 10));

// Heavy parts come on demand only.
await page.uncheck('#wantcloud');
await page.uncheck('#wantimage');
await page.selectOption('#speed', '1');
await toggle();
await sleep(300);
const off = await look();
await sleep(1200);
const later = await look();
assert.deepStrictEqual([later.counts.cloud, later.counts.image], [off.counts.cloud, off.counts.image]);
assert.ok(later.counts.state > off.counts.state);

// A mover has an arrow for its velocity; what is null is not drawn.
const drawn = await page.evaluate(() => {
  const {scene} = window.chase, solid = {id: 1, kind: 1, solid: 0, half: [1, 1, 1], q: [1, 0, 0, 0]};
  scene.setObstacles([{...solid, p: [0, 0, 1], v: [1, 0, 0]}, {...solid, p: [null, 0, 1], v: [1, 0, 0]},
    {...solid, p: [0, 0, 1], half: [null, 1, 1]}, {...solid, p: [0, 0, 1], v: [null, 0, 0], q: [null, 0, 0, 0]}]);
  scene.setState({generation: 0, row: [], drone: {p: [null, 0, 0], q: [1, 0, 0, 0]}, plan: {verdict: 9, path: [null, 1, 2, 3, 4, 5]}});
  return {...scene.shown, drone: scene.drone.visible, plan: scene.plan.visible};
});
assert.deepStrictEqual(drawn, {solids: 2, arrows: 1, grown: 0, drone: false, plan: false});

// A mover goes on by its velocity between two lists, a second at most; and one without a velocity stays.
const moved = await page.evaluate(() => {
  const {scene} = window.chase, mover = {kind: 1, solid: 0, half: [1, 1, 1], q: [1, 0, 0, 0], p: [1, 0, 1]};
  const told = (t) => { scene.setState({generation: 0, row: [t]}); scene.motion.move(1e9); return [...scene.movers.values()].map((m) => Number(m.position.x.toFixed(3))); };
  scene.setObstacles([{...mover, id: 1, v: [1, 0, 0]}, {...mover, id: 2}], 5);
  const seen = [told(5), told(5.4), told(5.4), told(9)];
  scene.setObstacles([{...mover, id: 2}], 9);
  return [...seen, told(9)];
});
assert.deepStrictEqual(moved, [[1, 1], [1.4, 1], [1.4, 1], [2, 1], [1]]);

// What is too old is not shown as what is.
const past = await page.evaluate(async () => {
  const {scene} = window.chase, path = [0, 0, 1, 1, 0, 1, 2, 0, 1], age = {age: 5.1, stale: true}, shown = (id) => document.getElementById(id), {generation} = scene;
  const state = {...window.chase.model.state, generation: generation + 0.1, tracking: {following: 1, ...age}, row: [0],
    drone: {p: [0, 0, 1], q: [1, 0, 0, 0], health: 0}, plan: {verdict: 0, radius: 0.4, path, stop: path, ...age},
    forecast: {path, spread: [0.5, 0.5], ...age}, obstacles: age, image: age,
    target: {state: 1, p: [0, 0, 0], axes: [0.1, 0.2, 0.3], q: [1, 0, 0, 0], radius: 0.2, height: 1, ...age}};
  window.chase.link.handlers.state(state);
  const seen = {words: ['verdict', 'targetstate', 'imagetext'].map((id) => shown(id).textContent), figures: shown('figures').textContent,
    bad: ['verdict', 'targetstate'].map((id) => shown(id).className), image: shown('image').style.opacity,
    hidden: ['plan', 'stop', 'forecast', 'fan', 'covariance', 'sight'].map((part) => scene[part].visible),
    colors: ['target', 'solid'].map((part) => scene[part].material.color.getHexString())};
  window.chase.link.handlers.state({...state, generation: generation + 0.2, obstacles: null, image: null, target: {...state.target, stale: false}});
  const again = ['target', 'solid'].map((part) => scene[part].material.color.getHexString());
  window.chase.link.handlers.state({...state, generation: generation + 0.3, tracking: {following: 1}});
  const follows = shown('figures').textContent;
  scene.begin(generation);
  return {...seen, follows, again};
});
assert.deepStrictEqual(past, {words: ['plan 5.1 s old', 'target 5.1 s old', 'image 5.1 s old'],
  figures: 'z 1.00 m\ntracking 5.1 s old\nobstacles 5.1 s old', bad: ['pill bad', 'pill bad'], image: '0.4',
  hidden: [false, false, false, false, false, false], colors: ['4a525c', '4a525c'], follows: 'z 1.00 m\nfollows plan\nobstacles 5.1 s old', again: ['e8702a', 'ffffff']});

// Obstacles are grown by what plans keep free, the target has its 3 sigma, the forecast its 2, and the stop its verdict's colour.
const told = await page.evaluate(async () => {
  const {scene} = window.chase, {VERDICT_COLORS} = await import('./names.js');
  const path = [0, 0, 1, 1, 0, 1, 2, 0, 1], row = {id: 1, kind: 0, q: [1, 0, 0, 0]};
  scene.setObstacles([{...row, solid: 1, p: [0, 0, 1], half: [1, 2, 1]}, {...row, kind: 2, solid: 1, p: [9, 9, 9], half: [1, 1, 1]}]);
  scene.setState({generation: 1, row: [], plan: {verdict: 3, radius: 0.4, path, stop: path}, forecast: {path, spread: [0.5, 0.5]},
    target: {p: [0, 0, 0], axes: [0.1, 0.2, 0.3], q: [1, 0, 0, 0], radius: 0.2, height: 1}});
  const {grown, fan, covariance, stop} = scene;
  const size = (mesh, axis) => { mesh.geometry.computeBoundingBox(); return Number(mesh.geometry.boundingBox.max[axis].toFixed(3)); };
  const seen = {grown: [size(grown, 'x'), size(grown, 'y')], sigma: covariance.scale.toArray().map((v) => Number(v.toFixed(3))),
    fan: fan.visible && size(fan, 'y'), stop: stop.visible && `#${stop.material.color.getHexString()}` === VERDICT_COLORS[3]};
  document.getElementById('showgrown').click();
  return {...seen, hidden: !grown.visible};
});
assert.deepStrictEqual(told, {grown: [1.4, 2.4], sigma: [0.3, 0.6, 0.9], fan: 1, stop: true, hidden: true});

// A simulation's truth is a layer: drone and target, for the gym has no movers, and nothing of it where a log has none.
const truth = await page.evaluate(() => {
  const {scene, model} = window.chase, drawn = () => scene.truth.filter((cross) => cross.visible).length;
  const box = document.getElementById('showtruth'), label = document.getElementById('truth');
  const log = {movers: model.state.truth.length - 2, offered: !label.hidden};
  const body = (x) => ({p: [x, 2, 3], q: [0, 0, 0, 1]}), state = {generation: 0, row: [], truth: [body(1), body(4)]};
  scene.setState(state);
  const seen = [drawn(), scene.truth[1].position.toArray(), scene.truth[1].quaternion.toArray()];
  box.click();
  scene.setState(state);
  const off = drawn();
  box.click();
  scene.setState({generation: 0, row: []});
  return {log, seen, off, none: drawn()};
});
assert.deepStrictEqual(truth, {log: {movers: 0, offered: true}, seen: [2, [4, 2, 3], [0, 0, 1, 0]], off: 0, none: 0});

// The geofence stands where it is told, and who is silent is seen on the time line.
const lines = await page.evaluate(async () => {
  const {scene, model} = window.chase, corners = [[0, 0], [4, 0], [4, 3]];
  scene.setState({generation: 0, row: [], fence: {corners, floor: -1, ceiling: 5}});
  const {array} = scene.fence.geometry.attributes.position, shown = scene.fence.visible;
  scene.setState({generation: 0, row: []});
  const {drawTimeline} = await import('./strips.js'), canvas = document.createElement('canvas');
  Object.assign(canvas.style, {width: '400px', height: '80px', position: 'absolute'});
  document.body.append(canvas);
  const rows = model.rows.slice(0, 40).map((row, i) => Object.assign([...row], {0: i, 15: i < 20 ? 1 : 3}));
  drawTimeline(canvas, rows, 0, 40, 0);
  const pixel = (x) => [...canvas.getContext('2d').getImageData(x * devicePixelRatio, 72 * devicePixelRatio, 1, 1).data.slice(0, 3)];
  const seen = [pixel(120), pixel(380)];  // beside the words
  canvas.remove();
  return {ends: array.length / 3, low: Math.min(...array), high: Math.max(...array), shown, after: scene.fence.visible, seen};
});
assert.deepStrictEqual(lines, {ends: 18, low: -1, high: 5, shown: true, after: false, seen: [[35, 43, 54], [217, 83, 79]]});

// No label hides a curve.
const hidden = await page.evaluate(async () => {
  const {drawStrips} = await import('./strips.js'), canvas = document.createElement('canvas');
  Object.assign(canvas.style, {width: '370px', height: '148px', position: 'absolute'});
  document.body.append(canvas);
  const row = window.chase.model.rows[0].map(() => null), column = (await import('./names.js')).DISTANCE;
  drawStrips(canvas, [...Array(81).keys()].map((i) => Object.assign([...row], {0: i / 2, [column]: 1})), 0, 40, 0);
  const y = 4 * devicePixelRatio, context = canvas.getContext('2d');  // the curve runs through its label
  const blue = (x) => Math.max(...[0, 1, 2].map((k) => context.getImageData(x * devicePixelRatio, y + k, 1, 1).data).map(([r, , b]) => b - r));
  const at = [...Array(280).keys()].map((i) => 70 + i), wanted = blue(340);
  canvas.remove();
  return {wanted, missing: at.filter((x) => blue(x) < 0.8 * wanted)};
});
assert.ok(hidden.wanted > 100 && hidden.missing.length === 0, JSON.stringify(hidden));

// A viewer that says nothing is told from one that is well within two seconds; then the connection is made anew until it answers.
const linked = () => page.evaluate(() => {
  const link = document.getElementById('link'), {opacity} = getComputedStyle(document.getElementById('view'));
  return {text: link.textContent, bad: link.classList.contains('bad'), dim: opacity < 1};
});
await page.evaluate(() => { const arm = document.getElementById('arm'); arm.disabled = false; arm.checked = true; });
viewer.process.kill('SIGSTOP');
try {
  await until('silence is told', async () => (await linked()).text !== 'linked', 2500);
  const silent = await linked();
  assert.match(silent.text, /^silent [1-3] s$/);
  assert.ok(silent.bad && silent.dim && !await page.isChecked('#arm'), JSON.stringify(silent));
  await until('the connection is given up', async () => /^no link [4-9] s$/.test((await linked()).text), 8000);
} finally {
  viewer.process.kill('SIGCONT');
}
await until('a link again', async () => (await linked()).text === 'linked', 10000);
assert.ok(!(await linked()).dim);

// Commands stay off without a token, and a phone needs no scrolling sideways.
assert.ok(await page.isDisabled('#arm'));
assert.strictEqual(await page.textContent('#reply'), 'off: a log is played');
assert.ok(await page.isDisabled('#buttons button'));
await page.setViewportSize({width: 390, height: 844});
await sleep(300);
assert.ok(await page.evaluate(() => document.documentElement.scrollWidth) <= 390, 'wider than a phone');
assert.deepStrictEqual(problems, []);
await browser.close();
await viewer.stop();
console.log(`page in order; ${fps.toFixed(0)} frames a second at 1280 x 720 in software, level of detail ${after.level} (0: all)`);
if (process.argv.includes('--judge')) assert.ok(fps >= 29.5 && after.level === 0, 'wanted: 30 frames a second in all detail');
process.exit(0);
