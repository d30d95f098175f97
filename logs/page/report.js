// Header, tables, images of key moments; then the charts.
const flights = page.flights, two = flights.length === 2;
const byId = (id) => document.getElementById(id);
const make = (tag, text = '', name = '') => Object.assign(document.createElement(tag), {textContent: text, className: name});  // never as HTML
const at = (object, key) => key.split('.').reduce((v, k) => v?.[k], object);
const UNKNOWN = 'not known';
const shown = (value, digits = 2, unit = '', scale = 1) =>
  value === null || value === undefined ? UNKNOWN : `${(scale * value).toFixed(digits)}${unit ? ` ${unit}` : ''}`;

function table(parent, head, rows) {
  const made = make('table');
  if (head) {
    const row = made.insertRow();
    head.forEach((text, i) => row.append(make('th', text, i ? 'number' : '')));
  }
  for (const {cells, worse, mark} of rows) {
    const row = made.insertRow();
    cells.forEach((text, i) => row.append(make('td', text, i ? 'number' : '')));
    if (worse) row.className = 'worse';
    if (rows.some((r) => r.mark)) row.append(make('td', mark ?? '', mark?.startsWith('✓') ? 'passed' : 'failed'));
  }
  parent.append(made);
  return made;
}

// [key of metrics.json, words, unit, scale, digits]
const ROWS = page.rows;
const MOST_CHANGES = 200;
const wordsOf = (key) => ROWS.find(([name]) => name === key)?.[1] ?? key.replace('criteria.', 'criterion ');

const canTell = ({judged}, name) => judged || ['recorded', 'finite_setpoints'].includes(name);   // the others are of samples of the mission
const criterionOf = ({metrics, judged}, key) => {
  if (!canTell({judged}, key)) return undefined;
  const name = [key, `${key}_max`].find((n) => n in (metrics.criteria ?? {}));
  return name === undefined ? undefined : (metrics.criteria[name] ? '✓' : '✗') + (NARROW ? '' : ' criterion');
};

function showHeader() {
  const titles = [...new Set(flights.map(({title}) => title))];
  byId('title').textContent = two ? `${titles.join(' and ')}: two flights` : titles[0];
  flights.forEach((flight, i) => {
    if ('passed' in flight.metrics) {
      const [word, kind] = !flight.judged ? [UNKNOWN, 'open'] : flight.metrics.passed ? ['passed', 'good'] : ['failed', 'bad'];
      byId('title').append(make('span', `${two ? `${'AB'[i]} ` : ''}${word}`, `badge ${kind}`));
    }
    const {metrics, vehicle} = flight, commits = [...new Set(Object.values(vehicle.software.versions).map((v) => v.match(/commit [\w-]+/)?.[0] ?? v))];
    const of = metrics.duration_s ? ` of ${metrics.duration_s} s` : '';
    const factor = metrics.real_time_factor ? `, real-time factor ${metrics.real_time_factor.toFixed(2)}` : '';
    const hosts = [...new Set(Object.values(vehicle.software.hosts))], named = (word, names) => (names?.length ? `, ${word} ${names.join(', ')}` : '');
    const where = `${vehicle.recorded_utc ? `, ${vehicle.recorded_utc} UTC` : ''}${named('vehicle', vehicle.vehicles)}${named('host', hosts)}`;
    byId('subtitle').append(make('div', `${two ? `${'AB'[i]}: ` : ''}${flight.log}${where}, ${metrics.flown_s.toFixed(1)} s${of} flown${factor}; ${commits.join(', ')}`));
    for (const loss of [metrics.shortfall ?? `whether this is the whole flight is ${UNKNOWN}`, ...metrics.losses].filter((line) => line)) byId('losses').append(make('p', `${two ? `${'AB'[i]}: ` : ''}${loss}`, 'failed'));
  });
  byId('map_text').textContent = `${flights[0].truth ? 'Paths over the mission.' : 'Paths as estimated.'} `
    + 'Thin lines: predictions and plans of every half second (switch them in the legend).';
}

function showFigures() {
  byId('figures_text').textContent = two ? 'Red rows: B has moved to its worse side by more than 1 % and half of the last digit.'
    : flights[0].truth ? 'Sampled on the truth at 100 Hz over the mission.' : 'What the vehicle said of itself; nobody knows where it really was.';
  if (two) return compareFigures();
  const {metrics} = flights[0], of_fault = (key) => key === 'reaction_s' || key === 'recovery_s';
  const known = ROWS.filter(([key]) => at(metrics, key) !== undefined && (metrics.fault || !of_fault(key)));
  const rows = known.map(([key, words, unit, scale, digits]) => ({cells: [words, shown(at(metrics, key), digits, unit, scale)], mark: criterionOf(flights[0], key)}));
  for (const [name, words] of [['complete', 'Mission complete'], ['recorded', 'Log complete']])
    if (name in (metrics.criteria ?? {})) rows.unshift({cells: [words, !canTell(flights[0], name) ? UNKNOWN : metrics.criteria[name] ? 'yes' : 'no'], mark: criterionOf(flights[0], name)});
  const half = Math.ceil(rows.length / 2);
  table(byId('figures'), null, rows.slice(0, half));
  table(byId('figures'), null, rows.slice(half));
}

function compareFigures() {
  byId('figures').className = '';
  const rows = page.compared.filter(({a, b}) => a || b).map(({key, a, b, worse}) =>
    ({cells: [wordsOf(key), a || UNKNOWN, b || UNKNOWN, worse ? 'WORSE' : ''], worse}));
  table(byId('figures'), ['', 'A', 'B', ''], rows);
}

function showSoftware() {
  flights.forEach(({vehicle: {software}}, i) => {
    const names = Object.keys(software.versions).sort();
    if (two) byId('software').append(make('p', 'AB'[i]));
    table(byId('software'), ['process', 'version', 'host', 'configuration'], names.map((name) =>
      ({cells: [name, software.versions[name], software.hosts[name] ?? '–', software.configurations[name] ?? '–']})));
  });
}

// Faults, and why the flight's state, what is planned, the target and the pose became what they are.
function showChanges() {
  const rows = flights.flatMap(({data, metrics}, i) => data.spans.flatMap((s) => {
    const side = two ? [`${'AB'[i]}`] : [], of = (t, what, reason) => ({t, cells: [...side, `${t.toFixed(2)} s`, `${s.lane}: ${what}`, reason]});
    if (s.lane !== 'fault') return s.reason || s.lane === 'flight' ? [of(s.from, s.label, s.reason ?? '')] : [];
    const ended = metrics.faults?.some((f) => f.name === s.label && f.end_s !== null && Math.abs(f.end_s - s.to) < 0.01);
    return [of(s.from, `${s.label} begins`, ''), ...(ended ? [of(s.to, `${s.label} ends`, '')] : [])];
  })).sort((a, b) => a.t - b.t);
  if (!rows.length) return;
  const shownRows = rows.slice(0, MOST_CHANGES), details = make('details');
  details.append(make('summary', `Changes and their reasons (${rows.length})`));
  table(details, null, shownRows);
  if (rows.length > shownRows.length) details.append(make('p', `and ${rows.length - shownRows.length} more`));
  byId('changes').append(details);
}

// Seconds and shares of each lane's labels.
function showSpent() {
  const rows = new Map();
  flights.forEach(({data}, i) => {
    for (const {lane, label, from, to} of data.spans.filter((s) => s.lane !== 'fault')) {
      const key = `${lane}: ${label}`;
      if (!rows.has(key)) rows.set(key, flights.map(() => 0));
      rows.get(key)[i] += to - from;
    }
  });
  table(byId('spent'), two ? ['', 'A', 'B'] : null, [...rows].map(([key, seconds]) => ({cells: [key, ...seconds.map((s) => shown(s, 1, 's'))]})));
}

function showTimes() {
  const quantiles = (id, pick) => {
    const names = [...new Set(flights.flatMap(({vehicle}) => Object.keys(vehicle[pick] ?? {})))];
    if (!names.length) return byId(id).append(make('p', 'Not in this log: a flight in lockstep does not measure it.'));
    const both = (name, q) => flights.map(({vehicle}) => shown(vehicle[pick]?.[name]?.[q], 1)).join(' / ');
    table(byId(id), [two ? 'A / B, ms' : 'ms', 'median', '99 %', 'most'], names.map((name) => ({cells: [name, both(name, 'p50'), both(name, 'p99'), both(name, 'max')]})));
  };
  quantiles('latencies', 'latency_ms');
  quantiles('stages', 'stages_ms');
  const processes = [...new Set(flights.flatMap(({vehicle}) => Object.keys(vehicle.cpu_s ?? {})))];
  if (!processes.length) return byId('cpu').append(make('p', 'Not in this log: a flight in lockstep does not measure it.'));
  const share = ({vehicle, metrics}, name) => shown(vehicle.cpu_s?.[name] === undefined ? null : vehicle.cpu_s[name] / metrics.flown_s, 1, '%', 100);
  table(byId('cpu'), ['of one core', ...(two ? ['A', 'B'] : [''])], processes.map((name) => ({cells: [name, ...flights.map((f) => share(f, name))]})));
}

async function showMoment(parent, flight, moment, label) {
  const figure = make('figure'), canvas = make('canvas');
  figure.append(canvas, make('figcaption', `${label}${moment.t.toFixed(1)} s: ${moment.label}`));
  figure.onclick = () => seekPlayback(moment.t);
  parent.append(figure);
  Object.assign(canvas, {width: moment.width, height: moment.height});
  const image = new Image();
  image.src = `data:image/jpeg;base64,${moment.jpeg}`;
  await image.decode();
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  if (!moment.box) return;
  const [u, v, w, h] = moment.box;
  context.strokeStyle = ['#9aa3ae', '#3fe06b', '#ffb020', '#ff5050'][moment.state] ?? '#fff';
  context.lineWidth = 2;
  context.strokeRect(u - w / 2, v - h / 2, w, h);
}

function showMoments() {
  const box = byId('moments');
  flights.forEach((flight, i) => flight.moments.forEach((moment) => showMoment(box, flight, moment, two ? `${'AB'[i]}, ` : '')));
  if (!box.childNodes.length) box.append(make('p', 'No image is in this log.'));
}

function showPlayback() {
  if (!viewerFiles) return byId('playback').append(make('p', 'Not in this report: the viewer was built without three.js; run deploy/setup and build again.'));
  const buttons = flights.map((flight, i) => {
    const button = make('button', two ? `play ${'AB'[i]}` : 'play');
    button.onclick = () => {
      buttons.forEach((b) => b.setAttribute('aria-pressed', b === button));
      if (!two) button.remove();
      openPlayback(flight, Math.max(-flight.playback.begin, 0));
    };
    byId('playback').append(button);
    return button;
  });
}

const ends = flights.flatMap(({data, metrics}) => [...data.spans.flatMap((s) => [s.from, s.to]), metrics.flown_s]);
timeRange = [Math.min(0, ...ends), Math.max(...ends)];
showHeader();
showFigures();
showPlayback();
showMoments();
showTimeLine(flights);
showChanges();
showStrips(flights);
showMap(flights);
if (two) byId('pixels_card').remove();
else showPixels(flights[0]);
showSpent();
showTimes();
showSoftware();
