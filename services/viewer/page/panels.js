// Camera image, process health, commands.
import {TARGET_STATES, TARGET_COLORS, STATE_COLORS, COMMANDS, format, setText} from './names.js';

const STALE = 3;  // s without a status

const element = (tag, text = '', name = '') => {
  const made = document.createElement(tag);
  made.textContent = text;  // never as HTML: it comes from messages
  if (name) made.className = name;
  return made;
};

export async function drawImage(canvas, text, {about, jpeg}) {
  const bitmap = await createImageBitmap(jpeg);
  if (canvas.width !== about.width) canvas.width = about.width;
  if (canvas.height !== about.height) canvas.height = about.height;
  const context = canvas.getContext('2d', {willReadFrequently: true});  // in memory: software GL is slow at it
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  if (about.box && about.box.every((v) => v !== null)) {
    const [u, v, w, h] = about.box;
    context.strokeStyle = TARGET_COLORS[about.state] ?? '#ffffff';
    context.lineWidth = 2;
    context.strokeRect(u - w / 2, v - h / 2, w, h);
  }
  setText(text, about.state === undefined ? 'no target told of this image'
    : `target ${TARGET_STATES[about.state] ?? '?'}, probability ${format(about.existence, 2, '')}`);
}

// A row per process. Rows stay while their texts change, so that a click meets what it was aimed at.
export function showHealth(box, rows) {
  const known = new Map([...box.querySelectorAll('details')].map((d) => [d.dataset.name, d]));
  const shown = rows.map((row) => updateProcess(known.get(row.name) ?? makeProcess(row.name), row));
  if (shown.length !== box.childNodes.length || shown.some((d, i) => d !== box.childNodes[i])) box.replaceChildren(...shown);
}

function makeProcess(name) {
  const details = element('details'), summary = element('summary');
  details.dataset.name = name;
  summary.append(element('span', '', 'dot'), element('b', name), element('span'), element('span'));
  details.append(summary, element('p'), element('table'));
  return details;
}

function updateProcess(details, row) {
  const [summary, text, table] = details.children, [dot, , share, losses] = summary.children;
  const stale = row.age > STALE;
  dot.style.background = stale ? '#d9534f' : STATE_COLORS[row.state] ?? '#7d8896';
  setText(share, row.age < 0 ? 'never heard' : stale ? `silent ${row.age.toFixed(0)} s` : row.cpu === null || row.cpu < 0 ? '' : `${row.cpu.toFixed(0)} %`);
  const sum = (k) => row.channels.reduce((n, c) => n + c[k], 0);
  const lost = sum(2), malformed = sum(3);
  setText(losses, [row.restarts > 0 ? `${row.restarts} restarts` : '', lost + malformed > 0 ? `${lost} lost ${malformed} malformed` : '']
    .filter((text) => text).join(', '));
  setText(text, `${row.detail}${row.error ? ` · last error: ${row.error}` : ''} · ${format(row.rss, 0, 'MiB')}`);
  table.replaceChildren(...row.channels.map(([channel, rate, dropped, bad, foreign]) => {
    const line = element('tr');
    line.append(element('td', channel), element('td', format(rate, 1, 'Hz')), element('td', `${dropped} lost`),
      element('td', `${bad} malformed`), element('td', `${foreign} foreign`));
    return line;
  }));
  return details;
}

// Buttons work only while armed and linked, and only with the token that the viewer was started with. The vehicle's
// answer comes through "reply".
export function makeCommands(page, ask) {
  const buttons = COMMANDS.map((name) => {
    const button = element('button', name);
    button.disabled = true;
    button.onclick = () => {
      page.reply.textContent = `${name}: sent`;
      page.reply.className = '';
      ask({command: name, token: page.token.value});
    };
    return button;
  });
  page.buttons.replaceChildren(...buttons);
  const update = () => {
    const silent = document.body.classList.contains('silent');
    for (const b of buttons) b.disabled = silent || !page.arm.checked || !page.token.value;
  };
  page.arm.onchange = page.token.oninput = update;
}

export function disarm(page) {
  page.arm.checked = false;
  page.arm.onchange();
}

export function allowCommands(page, {commands, source}) {
  page.arm.disabled = page.token.disabled = !commands;
  if (!commands) page.reply.textContent = source ? 'off: a log is played' : 'off: the viewer was started without --token-file';
}
