// Time line and strips: plain 2D canvases over the rows of samples.
import {T, DISTANCE, CLEARANCE, SPEED, PLAN_MS, VERDICT, TARGET_STATE, HEALTH, FLIGHT, PROCESSES, VERDICTS, VERDICT_COLORS,
  TARGET_STATES, TARGET_COLORS, HEALTHS, HEALTH_COLORS, FLIGHT_STATES, FLIGHT_COLORS, FAULTS, FAULT_COLORS, INJECTED,
  format} from './names.js';

const STRIPS = [['distance', DISTANCE, 'm', 2, '#4c9be8'], ['certified clearance', CLEARANCE, 'm', 2, '#3fa66b'],
  ['speed', SPEED, 'm/s', 2, '#d9a33a'], ['plan time', PLAN_MS, 'ms', 2, '#b455c9']];
const LANES = [['flight', FLIGHT, FLIGHT_STATES, FLIGHT_COLORS], ['verdict', VERDICT, VERDICTS, VERDICT_COLORS],
  ['target', TARGET_STATE, TARGET_STATES, TARGET_COLORS], ['pose', HEALTH, HEALTHS, HEALTH_COLORS], ['faults', PROCESSES, FAULTS, FAULT_COLORS],
  ['injected', INJECTED]];  // by name; where a log holds any
const LEFT = 60, DIM = '#93a0b0', DARK = '#0c1116';

function prepare(canvas) {
  const ratio = window.devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext('2d', {willReadFrequently: true});  // in memory: software GL is slow at it
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = '11px system-ui, sans-serif';
  context.textBaseline = 'middle';
  return {context, width, height};
}

function cursor(context, x, height) {
  context.fillStyle = '#ffffff';
  context.fillRect(x, 0, 1, height);
}

export function drawTimeline(canvas, rows, from, to, now) {
  const {context, width, height} = prepare(canvas);
  const x = (t) => LEFT + (width - LEFT - 8) * (t - from) / Math.max(to - from, 1e-6);
  const lanes = LANES.filter(([, column]) => column !== INJECTED || rows.some((row) => row[INJECTED]));
  const step = height / lanes.length;
  lanes.forEach(([name, column, words, colors], lane) => {
    const top = lane * step + 2;
    context.fillStyle = DIM;
    context.fillText(name, 8, top + step / 2 - 1);
    context.fillStyle = '#232b36';
    context.fillRect(LEFT, top, width - LEFT - 8, step - 4);
    for (let i = 0, j; i < rows.length; i = j) {  // runs of the same code
      for (j = i + 1; j < rows.length && rows[j][column] === rows[i][column]; ++j);
      const code = rows[i][column], color = colors ? colors[code] : code && '#d9534f';
      const a = Math.max(x(rows[i][T]), LEFT), b = x((rows[j] ?? rows[rows.length - 1])[T]);
      if (!color || b < LEFT) continue;
      context.fillStyle = color;
      context.fillRect(a, top, Math.max(b - a, 1), step - 4);
      const word = words ? words[code] : code;
      if (context.measureText(word).width + 8 > b - a) continue;
      context.fillStyle = DARK;
      context.fillText(word, a + 4, top + step / 2 - 1);
    }
  });
  cursor(context, x(now), height);
}

export function drawStrips(canvas, rows, from, to, now) {
  const {context, width, height} = prepare(canvas);
  const x = (t) => LEFT + (width - LEFT - 8) * (t - from) / Math.max(to - from, 1e-6);
  const step = height / STRIPS.length;
  const current = rows.findLast((row) => row[T] <= now + 1e-6);
  STRIPS.forEach(([name, column, unit, digits, color], strip) => {
    const top = strip * step, shown = rows.filter((row) => row[T] >= from && row[column] !== null);
    const most = shown.reduce((m, row) => Math.max(m, row[column]), 1e-3) * 1.05;
    context.strokeStyle = '#2c3542';
    context.strokeRect(LEFT + 0.5, top + 2.5, width - LEFT - 9, step - 5);
    context.fillStyle = '#dfe5ec';
    context.fillText(`${name}  ${format(current?.[column], digits, unit)}`, LEFT + 8, top + 11);
    context.strokeStyle = color;  // over the words, which hide nothing of it
    context.beginPath();
    let last = -Infinity;
    for (const row of shown) {
      const y = top + step - 4 - (step - 8) * Math.max(row[column], 0) / most;
      if (row[T] - last > 1.5 * Math.max(0.5, (to - from) / 1000)) context.moveTo(x(row[T]), y);
      else context.lineTo(x(row[T]), y);
      last = row[T];
    }
    context.stroke();
    context.fillStyle = DIM;
    context.fillText(shown.length > 0 ? most.toPrecision(2) : '–', 8, top + 9);
    context.fillText('0', 8, top + step - 8);
  });
  cursor(context, x(now), height);
}

export const timeAt = (canvas, event, from, to) => {
  const box = canvas.getBoundingClientRect();
  return from + (to - from) * (event.clientX - box.left - LEFT) / (box.width - LEFT - 8);
};
