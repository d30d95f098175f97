// Reports in headless Chromium, opened as files: every part is drawn, time axes are linked, the flight plays, and a
// phone needs no scrolling sideways. Of one flight, of what the vehicle said alone, and of two flights.
import assert from 'node:assert';
import {spawnSync} from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {bin, load, log, until} from './viewer.mjs';

const {chromium} = load('playwright-core');
const CHROMIUM = '/usr/bin/chromium';
if (!fs.existsSync(CHROMIUM)) {
  console.log(`skipped: no ${CHROMIUM}; cure: deploy/setup`);
  process.exit(77);
}
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'report-'));
process.on('exit', () => fs.rmSync(folder, {recursive: true, force: true}));
const run = (name, ...words) => {
  const answer = spawnSync(path.join(bin, name), words, {encoding: 'utf8'});
  assert.ok(answer.status === 0 || name === 'chase-report' && answer.status === 2, `${name}: ${answer.stderr}`);
};
const other = path.join(folder, 'other.lcm'), bare = path.join(folder, 'bare.lcm');
run('chase-log', 'cut', log, other, '--to', '12');
run('chase-log', 'filter', log, bare, '--drop', 'TRUTH,SCENARIO');
run('chase-report', log, '--out', path.join(folder, 'one'));
run('chase-report', bare, '--out', path.join(folder, 'vehicle'));
run('chase-report', log, other, '--out', path.join(folder, 'two'));
const struck = path.join(folder, 'struck.lcm');
run('chase-flight', 'mission', '--quiet', '--fault', 'lidar-gap@0.5', '--fault', 'motor-80@1', '--until', '2', '--log', struck, '--light');
run('chase-report', struck, '--out', path.join(folder, 'struck'));
run('chase-report', log, struck, '--out', path.join(folder, 'unlike'));

const browser = await chromium.launch({executablePath: CHROMIUM,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader']});
const problems = [];

async function open(name, width, height) {
  const page = await browser.newPage({viewport: {width, height}});
  page.setDefaultTimeout(100000);  // software GL on a loaded machine
  page.on('pageerror', (error) => problems.push(`${name}: ${error.stack}`));
  page.on('request', (request) => { if (!/^(file|blob|data|about):/.test(request.url())) problems.push(`${name} asks for ${request.url()}`); });
  await page.goto(`file://${folder}/${name}/report.html`);
  await page.waitForFunction(() => document.querySelectorAll('#software tr').length > 3);
  return page;
}

// Charts by id that hold at least one trace, and the range of each time axis.
const charts = (page) => page.evaluate(() => [...document.querySelectorAll('.js-plotly-plot')].filter((c) => c.data.length).map((c) => c.id));
const ranges = (page) => page.evaluate(() => [...document.querySelectorAll('.time')].map((c) => c._fullLayout.xaxis.range.map((v) => v.toFixed(2)).join()));
const TIME = ['timeline', 'strip_distance', 'strip_clearance', 'strip_speed', 'strip_tracking', 'strip_sigma', 'strip_latency'];

async function checkLinked(page) {
  await page.evaluate(() => Plotly.relayout('strip_speed', {'xaxis.range[0]': 2, 'xaxis.range[1]': 5}));
  await until('all time axes from 2 to 5', async () => (await ranges(page)).every((r) => r === '2.00,5.00'), 5000);
  await page.evaluate(() => Plotly.relayout('strip_speed', {'xaxis.autorange': true}));
  await until('all time axes at the whole flight', async () => new Set(await ranges(page)).size === 1 && (await ranges(page))[0] !== '2.00,5.00', 5000);
}

// The viewer's page plays inside, shows the drone, and a click into a chart seeks.
async function checkPlayback(page) {
  await page.click('#playback button');
  const look = () => page.evaluate(() => {
    const inside = document.querySelector('iframe')?.contentWindow.chase;
    return inside?.scene && {drone: inside.scene.drone.visible && inside.scene.drone.position.toArray(), points: inside.scene.points,
      t: inside.model.play?.t, duration: inside.model.duration, solids: inside.scene.shown.solids, counts: {...inside.counts}};
  });
  await until('the drone in the recording', async () => { const s = await look(); return s?.drone && s.points > 100 && s.solids > 0; }, 60000);
  const before = await look(), frame = page.frameLocator('iframe');
  let after;
  await until('a drone, an image and a sweep that move', async () => {
    after = await look();
    return after.t > before.t + 1 && String(after.drone) !== String(before.drone) && after.counts.image > before.counts.image && after.counts.cloud > before.counts.cloud;
  });
  await frame.locator('#playbutton').click();
  const chart = page.locator('#strip_distance'), box = await chart.boundingBox();
  const wanted = await chart.evaluate((c) => { const {xaxis} = c._fullLayout; return [xaxis._offset + xaxis.l2p(6), 6]; });
  await chart.click({position: {x: wanted[0], y: box.height / 2}, force: true});
  const begin = await page.evaluate(() => flights[0].playback.begin);
  await until('the moment that was clicked', async () => Math.abs((await look()).t + begin - wanted[1]) < 0.15, 5000);
}

const one = await open('one', 1280, 900);
for (const id of [...TIME, 'strip_visibility', 'map', 'pixels']) assert.ok((await charts(one)).includes(id), id);
const moments = await one.evaluate(() => flights[0].moments.map(({label, box}) => [label, !!box]));
assert.ok(moments.length >= 3 && moments.some(([, box]) => box), JSON.stringify(moments));
assert.ok(await one.evaluate(() => [...document.querySelectorAll('#moments canvas')].every((c) => c.width > 100)));
assert.match(await one.textContent('#subtitle'), /commit \w+/);
assert.match(await one.textContent('#software'), /planning.*commit/);
assert.doesNotMatch(await one.textContent('#figures'), /fault|Reaction/, 'no fault struck');
await checkLinked(one);
await checkPlayback(one);

const vehicle = await open('vehicle', 1280, 900);
for (const id of [...TIME, 'map']) assert.ok((await charts(vehicle)).includes(id), id);
assert.match(await vehicle.textContent('#figures'), /Pose, largest standard deviation.*Target known.*Distance from the plan/s);
assert.match(await vehicle.textContent('#latencies'), /POSE.*TARGET/s);
assert.match(await vehicle.textContent('#losses'), /whether this is the whole flight is not known/);
assert.match(await vehicle.textContent('#spent'), /target: tracking.*pose: ok/s);
await checkLinked(vehicle);
await checkPlayback(vehicle);

const two = await open('two', 1280, 900);
const worse = await two.evaluate(() => [...document.querySelectorAll('#figures tr.worse')].map((r) => r.innerText));
assert.ok(worse.some((text) => /Flown.*WORSE/s.test(text)), JSON.stringify(worse));
const overlaid = await two.evaluate(() => ['strip_distance', 'strip_speed', 'map', 'timeline'].map((id) => {
  const names = document.getElementById(id).data.flatMap((t) => [t.name, ...(id === 'timeline' ? t.y : [])]).join();
  return /A\b/.test(names) && /B\b/.test(names);
}));
assert.deepStrictEqual(overlaid, [true, true, true, true]);
await checkLinked(two);
assert.ok(fs.existsSync(path.join(folder, 'two/comparison.txt')));
assert.match(await two.evaluate(() => document.querySelector('#losses p').textContent), /^[AB]: the log ends at /);
const unlike = await open('unlike', 1280, 900);
assert.match(await unlike.textContent('#title'), /^gym, seed \d+ and mission, seed \d+: two flights/);
await unlike.close();

// A fault is drawn from its beginning to its end, and the flight's states come with their reasons.
const faulty = await open('struck', 1280, 900);
const bars = await faulty.evaluate(() => document.getElementById('timeline').data.filter((t) => t.type === 'bar' && t.y.includes('fault'))
  .map((t) => [t.name, t.base[0], t.base[0] + t.x[0]]));
assert.deepStrictEqual(bars.map(([name, from, to]) => [name, from.toFixed(2), to.toFixed(1)]),
  [['lidar-gap', '0.50', '1.5'], ['motor-80', '1.00', '2.0']]);
const changes = await faulty.textContent('#changes');
assert.match(changes, /0\.50 sfault: lidar-gap begins/);
assert.match(changes, /1\.50 sfault: lidar-gap ends/);
assert.doesNotMatch(changes, /motor-80 ends/);
const {reason} = await faulty.evaluate(() => flights[0].metrics.flight_states.find((s) => s.state === 'TAKEOFF'));
assert.ok(reason && changes.includes(`flight: TAKEOFF${reason}`), changes);
assert.match(await faulty.textContent('#figures'), /Reaction after the age limit.*Setpoints that are no numbers/s);

for (const name of ['one', 'vehicle', 'two', 'struck']) {
  const phone = await open(name, 390, 844);
  await phone.click('#playback button');
  await phone.evaluate(() => document.querySelectorAll('details').forEach((d) => { d.open = true; }));
  await until('the recording on a phone', () => phone.evaluate(() => document.querySelector('iframe')?.contentWindow.chase?.model.play));
  const inside = await phone.evaluate(() => document.querySelector('iframe').contentDocument.documentElement.scrollWidth - document.querySelector('iframe').clientWidth);
  assert.ok(await phone.evaluate(() => document.documentElement.scrollWidth) <= 390 && inside <= 0, `${name} is wider than a phone`);
  const unreadable = await phone.evaluate(() => {
    const lines = (cell) => { const text = document.createRange(); text.selectNodeContents(cell); return text.getClientRects().length; };
    const boxes = (chart, parts) => [...chart.querySelectorAll(parts)].map((text) => text.getBoundingClientRect());
    const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom - 1 && b.top < a.bottom - 1;
    return [...[...document.querySelectorAll('#software td:first-child')].filter((cell) => lines(cell) > 1).map((cell) => cell.innerText),
      ...[...document.querySelectorAll('.time')].filter((chart) => boxes(chart, '.xtitle').some((title) =>
        boxes(chart, '.xtick text, .legendtext').some((text) => meet(title, text)))).map(({id}) => id),
      ...[...document.querySelectorAll('.time')].filter((chart) =>
        boxes(chart, '.ytick text').some((text) => text.left < chart.getBoundingClientRect().left)).map(({id}) => `${id}, left`)];
  });
  assert.deepStrictEqual(unreadable, [], `${name}: names on two lines, an axis' title upon other words, or labels cut off`);
  await phone.close();
}
assert.deepStrictEqual(problems, []);
const size = fs.statSync(path.join(folder, 'one/report.html')).size;
await browser.close();
console.log(`reports in order; ${moments.length} key moments; report.html ${(size / 1e6).toFixed(1)} MB`);
process.exit(0);
