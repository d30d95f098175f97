import {Link} from './link.js';
import {Recording} from './recording.js';
import {Scene3D} from './scene3d.js';
import {drawTimeline, drawStrips, timeAt} from './strips.js';
import {drawImage, showHealth, makeCommands, allowCommands, disarm} from './panels.js';
import {T, DRONE, VERDICTS, VERDICT_COLORS, SCENE_COLORS, SCENE_WORDS, TARGET_STATES, HEALTHS, FOLLOWING, FLIGHT_STATES,
  FLIGHT_COLORS, format, setText} from './names.js';

const WINDOW = 60;   // s of a live flight that the strips show
const LINES = 4;     // times a second
const page = Object.fromEntries([...document.querySelectorAll('[id]')].map((e) => [e.id, e]));
const scene = new Scene3D(page.scene);
const now = () => model.play ? model.play.t : model.rows.at(-1)?.[T] ?? 0;
const model = {rows: [], generation: -1, play: null, duration: 0, seeking: false};
// What a test looks at.
window.chase = {model, scene, counts: {lines: 0, state: 0, cloud: 0, image: 0, health: 0, obstacles: 0, reply: 0}};

function pill(element, text, kind, color = '') {
  const look = [text, kind, color].join();
  if (element.look === look) return;
  element.textContent = element.title = text;
  Object.assign(element, {look, className: `pill ${kind}`});
  Object.assign(element.style, {background: color, color: color && '#0c1116'});
}

function span() {
  if (model.play) return [0, model.duration];
  const to = Math.max(now(), WINDOW);
  return [to - WINDOW, to];
}

// Where the flight is, why, and what it still waits for.
function showFlight(flight) {
  const silent = flight?.stale, on_ground = flight?.state === 0;
  const missing = on_ground && flight.missing.length ? `: ${flight.missing.join(', ')}` : '';
  const text = !flight ? '' : silent ? `flight state ${flight.age.toFixed(0)} s old`
    : `${FLIGHT_STATES[flight.state] ?? '?'}: ${flight.reason}${missing}`;
  pill(page.flight, text, silent ? 'bad' : '', silent ? '' : FLIGHT_COLORS[flight?.state]);
}

// What is too old to be shown as what is (`stale`: services/viewer/scene.h), in words.
const old = (name, part) => part?.stale ? `${name} ${part.age.toFixed(part.age < 10 ? 1 : 0)} s old` : '';

function showPills({drone, target, plan, obstacles, image, tracking, flight, truth}) {
  showFlight(flight);
  page.truth.hidden = !truth;
  const verdict = plan?.verdict;
  pill(page.verdict, old('plan', plan) || (plan ? `${VERDICTS[verdict] ?? '?'}${plan.reason ? ': ' + plan.reason : ''}` : 'no plan'),
    plan?.stale ? 'bad' : '', plan?.stale ? '' : VERDICT_COLORS[verdict]);
  pill(page.targetstate, old('target', target) || (target ? `target ${TARGET_STATES[target.state]}` : 'no target'),
    target?.stale ? 'bad' : target?.state === 1 ? 'good' : 'warn');
  pill(page.pose, old('pose', drone) || (drone ? HEALTHS[drone.health] : 'no pose'),
    !drone || drone.stale || drone.health === 2 ? 'bad' : drone.health === 0 ? 'good' : 'warn');
  page.scene.style.opacity = drone?.stale ? 0.5 : 1;
  page.image.style.opacity = image?.stale ? 0.4 : 1;
  if (image?.stale) setText(page.imagetext, old('image', image));
  setText(page.figures, [drone && `z ${format(drone.p[2], 2, 'm')}`, drone && old('tracking', tracking) || `follows ${FOLLOWING[tracking?.following] ?? '–'}`,
    old('obstacles', obstacles)].filter((text) => text).join('\n'));
}

function showPlayer(play) {
  page.player.hidden = false;
  setText(page.playbutton, play.playing ? '\u2759\u2759' : '\u25b6');
  if (Number(page.scrubber.max) !== play.duration) page.scrubber.max = play.duration;
  if (document.activeElement !== page.speed) page.speed.value = String(play.speed);
}

// What the lines show moves a pixel in a second and more: they are drawn anew LINES times a second at most.
function drawLines() {
  if (!model.lines) return;
  model.lines = false;
  window.chase.counts.lines++;
  const [from, to] = span();
  if (model.play && !model.seeking) page.scrubber.value = now();
  drawTimeline(page.timeline, model.rows, from, to, now());
  drawStrips(page.strips, model.rows, from, to, now());
}

// Parts may overtake each other: the first of a new generation clears the scene, one of an old generation is not shown.
function isNow({generation}) {
  if (generation < scene.generation) return false;
  scene.begin(generation);
  return true;
}

const handlers = {
  link(up, silence = 0) {
    const well = up && !silence, words = up ? 'silent' : 'no link';
    pill(page.link, well ? 'linked' : silence ? `${words} ${silence.toFixed(0)} s` : words, well ? 'good' : 'bad');
    document.body.classList.toggle('silent', !well);
    if (!well) disarm(page);
  },
  connected() { scene.begin(-1); },  // to a viewer that may count anew
  hello(message) {
    page.source.textContent = message.source || 'live';
    model.rows = message.rows;
    model.duration = message.duration;
    model.lines = true;
    allowCommands(page, message);
  },
  state(message) {
    window.chase.counts.state++;
    if (!isNow(message)) return;
    const {generation, play} = model, paused = play && message.generation === generation && message.play?.t === play.t;
    if (message.generation !== generation && !message.play) for (const row of model.rows) row.fill(null, DRONE);
    model.generation = message.generation;
    model.play = message.play ?? null;
    model.state = message;
    if (!model.play) {
      if (message.row[T] < model.rows.at(-1)?.[T]) model.rows = [];
      model.rows.push(message.row);
      while (model.rows[0][T] < message.row[T] - WINDOW) model.rows.shift();
    } else {
      showPlayer(model.play);
    }
    if (paused) return;
    scene.setState(message);
    scene.setTrail(model.rows, now());
    showPills(message);
    setText(page.clock, `${now().toFixed(1)} s${model.play ? ` / ${model.duration.toFixed(1)} s` : ''}`);
    model.lines = true;
  },
  obstacles(message) {
    window.chase.counts.obstacles++;
    if (isNow(message)) scene.setObstacles(message.rows, message.t);
  },
  health(message) {
    window.chase.counts.health++;
    showHealth(page.health, message.rows);
    page.self.textContent = `viewer: ${message.self}; ${(link.bytes / 1000).toFixed(0)} kB/s`;
    link.bytes = 0;
  },
  reply(message) {
    window.chase.counts.reply++;
    page.reply.textContent = `${message.command}: ${message.refusal ? `refused: ${message.refusal}` : `taken: ${message.words}`}`;
    page.reply.className = message.refusal ? 'refused' : 'taken';
  },
  cloud(cloud) {
    window.chase.counts.cloud++;
    if (isNow(cloud)) scene.addSweep(cloud.points);
  },
  image(image) { window.chase.counts.image++; drawImage(page.image, page.imagetext, image).catch(() => {}); },
};
// A report hands the flight over with the page.
const link = window.chaseRecording ? new Recording(handlers, window.chaseRecording) : new Link(handlers);
window.chase.link = link;
page.commands.hidden = !!window.chaseRecording;  // it has been flown
document.body.classList.toggle('recorded', page.commands.hidden);

const want = () => link.want(['cloud', 'image'].filter((part) => page[`want${part}`].checked));
page.wantcloud.onchange = page.wantimage.onchange = () => { want(); if (!page.wantcloud.checked) scene.clearSweeps(); };
page.follow.onchange = () => { scene.follow = page.follow.checked; };
const redraw = () => scene.setObstacles(scene.rows);
page.showground.onchange = () => { scene.showGround = page.showground.checked; redraw(); };
page.showtruth.onchange = () => { scene.showTruth = page.showtruth.checked; if (model.state) scene.setState(model.state); };
page.showgrown.onchange = () => { scene.showGrown = page.showgrown.checked; redraw(); };

page.playbutton.onclick = () => link.ask({play: !model.play?.playing});
page.speed.onchange = () => { link.ask({speed: Number(page.speed.value)}); page.speed.blur(); };
page.scrubber.oninput = () => { model.seeking = true; link.ask({seek: Number(page.scrubber.value)}); };
page.scrubber.onchange = () => { model.seeking = false; };
for (const canvas of [page.timeline, page.strips])
  canvas.onclick = (event) => { if (model.play) link.ask({seek: timeAt(canvas, event, ...span())}); };

// A command that waits in a link that stalls tells by the newest state how old it has become.
makeCommands(page, (request) => link.ask({...request, utime: model.state?.utime}));
const legend = (name, entries) => {
  const line = document.createElement('div'), made = entries.map(([text, color]) => {
    const entry = document.createElement('span'), box = document.createElement('i');
    box.style.background = color;
    entry.append(box, text);
    return entry;
  });
  line.append(name, ...made);
  return line;
};
page.truth.style.color = SCENE_COLORS.truth;
page.legend.replaceChildren(legend('', Object.entries(SCENE_WORDS).map(([key, text]) => [text, SCENE_COLORS[key]])),
  legend('plan, wide: its stop ', VERDICTS.map((name, i) => [name, VERDICT_COLORS[i]])));
page.colors.open = innerWidth > 800;  // a phone's scene has no room for them
page.safety.onsubmit = (event) => event.preventDefault();
setInterval(drawLines, 1000 / LINES);
window.addEventListener('resize', () => { model.lines = true; });
