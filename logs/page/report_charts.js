// Charts over time share one range and one cursor; a map; bars.
const COLORS = {chaser: '#1f5fa8', target: '#e8710a', grey: '#8a8f98', good: '#1d7f4b', bad: '#c62828'};
const LABELS = {chase: '#3fa66b', wider: '#8ccf90', kept: '#4c9be8', safe_only: '#d9a33a', brake: '#d9534f', wait: '#9aa3ae', escape: '#b455c9', mitigate: '#991a1a',
  tracking: '#3fa66b', searching: '#9aa3ae', occluded: '#d9a33a', ok: '#3fa66b', degraded: '#d9a33a', starting: '#9aa3ae', lost: '#d9534f',
  IDLE: '#9aa3ae', READY: '#a9c7b4', TAKEOFF: '#6fbf73', CHASE: '#3fa66b', HOLD: '#4c9be8', SEARCH: '#d9a33a', RETURN: '#b455c9',
  LAND: '#8a6fd1', DONE: '#5b6675', EMERGENCY: '#d9534f'};
const PAIR = ['#1f5fa8', '#c2410c'];   // of A and B
const NARROW = window.innerWidth < 600;
const MARGIN = {l: NARROW ? 44 : 64, r: NARROW ? 8 : 24, t: 10, b: 40};
const timeCharts = [];

const layout = (extra) => ({margin: MARGIN, height: 260, paper_bgcolor: '#fff', plot_bgcolor: '#fff', hovermode: 'closest',
  font: {family: 'system-ui, DejaVu Sans, sans-serif', size: NARROW ? 11 : 12.5},
  legend: {orientation: 'h', y: 1.02, yanchor: 'bottom', x: 0}, modebar: {orientation: 'v'}, ...extra});
const axis = (title, extra) => ({title: {text: title, standoff: 8}, gridcolor: '#e9ebee', zeroline: false, automargin: false, ...extra});
const draw = (id, traces, extra) => Plotly.newPlot(id, traces, layout(extra),
  {responsive: true, displaylogo: false, displayModeBar: NARROW ? false : 'hover'});

// The time line's own range is that of all.
let timeRange = [0, 1];
const timeAxis = () => axis('time [s]', {range: [...timeRange]});

function drawOverTime(id, traces, extra) {
  draw(id, traces, {...extra, xaxis: timeAxis()});
  const chart = document.getElementById(id), now = document.createElement('div');
  now.className = 'now';
  chart.append(now);
  timeCharts.push(chart);
  chart.on('plotly_relayout', (change) => {
    if (chart.follows) return;
    const auto = change['xaxis.autorange'];
    const range = auto ? timeRange : [change['xaxis.range[0]'], change['xaxis.range[1]']];
    if (range[0] === undefined) return;
    for (const other of timeCharts) {
      if (other === chart && !auto) continue;
      other.follows = true;
      Plotly.relayout(other, {'xaxis.range': [...range]}).then(() => { other.follows = false; });
    }
  });
  chart.addEventListener('click', (event) => {
    const {xaxis} = chart._fullLayout, x = event.clientX - chart.getBoundingClientRect().left - xaxis._offset;
    if (x >= 0 && x <= xaxis._length) seekPlayback(xaxis.p2l(x));
  });
}

setInterval(() => {
  const t = playbackTime();
  if (t === null) return;
  for (const chart of timeCharts) {
    const {xaxis, yaxis} = chart._fullLayout, now = chart.querySelector('.now'), x = xaxis.l2p(t);
    const inside = x >= 0 && x <= xaxis._length;
    Object.assign(now.style, {display: inside ? 'block' : 'none', left: `${xaxis._offset + x}px`,
      top: `${yaxis._offset}px`, height: `${yaxis._length}px`});
  }
}, 200);

// A trace of many outlines, with gaps between them.
function joined(outlines, style) {
  const x = [], y = [];
  for (const o of outlines) { x.push(...o.x, null); y.push(...o.y, null); }
  return {x, y, mode: 'lines', hoverinfo: 'skip', ...style};
}

const filled = (name, outlines, color, extra) => joined(outlines,
  {name, fill: 'toself', fillcolor: color, line: {width: 0.5, color: '#9aa0a9'}, ...extra});
const path = (name, p, color, width, dash) => ({name, x: p.x, y: p.y, mode: 'lines', line: {color, width, dash}});

function mapTraces({data}) {
  const traces = [], some = (list) => list?.length > 0;
  if (some(data.crowns)) traces.push(filled('crowns', data.crowns, 'rgba(120,170,110,0.15)'));
  if (some(data.solids)) traces.push(filled('obstacles', data.solids, '#c3c8cf'));
  if (some(data.movers)) traces.push(filled('movers, every 5 s', data.movers, 'rgba(156,39,176,0.12)'));
  if (some(data.perceived)) traces.push(joined(data.perceived, {name: 'obstacles as perceived at the end',
    line: {width: 1, color: '#2a8f6a', dash: 'dot'}, visible: data.solids ? 'legendonly' : true}));
  if (some(data.predictions)) traces.push(joined(data.predictions, {name: 'predictions', line: {width: 1, color: 'rgba(232,113,10,0.45)'},
    visible: NARROW ? 'legendonly' : true}));
  if (some(data.plans)) traces.push(joined(data.plans, {name: 'plans', visible: 'legendonly', line: {width: 1, color: 'rgba(31,95,168,0.45)'}}));
  if (data.geofence) traces.push(joined([{x: [...data.geofence.x, data.geofence.x[0]], y: [...data.geofence.y, data.geofence.y[0]]}],
    {name: 'geofence', line: {width: 1.5, color: '#c026b3', dash: 'dash'}}));
  return traces;
}

function showMap(flights) {
  const two = flights.length === 2, traces = mapTraces(flights[0]);
  flights.forEach(({data}, i) => {
    const name = two ? `, ${'AB'[i]}` : '', colors = two ? [PAIR[i], PAIR[i]] : [COLORS.chaser, COLORS.target];
    traces.push(path(`chaser${name}`, data.chaser, colors[0], 3), path(`target${name}`, data.target, colors[1], 1.5, two ? 'dot' : 'solid'));
    if (!two && data.estimated?.x.length) traces.push(path('chaser as estimated', data.estimated, '#111', 1, 'dot'));
    if (data.chaser.x.length) traces.push({name: `start${name}`, mode: 'markers', marker: {size: 8, color: two ? PAIR[i] : '#20242b'},
      x: [data.chaser.x[0]], y: [data.chaser.y[0]], showlegend: !two});
  });
  draw('map', traces, {height: NARROW ? 520 : 720, xaxis: axis('x, east [m]'), yaxis: axis('y, north [m]', {scaleanchor: 'x', scaleratio: 1})});
}

// Bars from lane to lane, of two flights below one another; a fault has a mark where it begins.
function showTimeLine(flights) {
  const two = flights.length === 2, order = ['fault', 'pose', 'target', 'verdict', 'flight'];
  const spans = flights.flatMap(({data}, i) => data.spans.map((s) => ({...s, row: two ? `${s.lane} ${'AB'[i]}` : s.lane})));
  const rows = order.flatMap((lane) => two ? [`${lane} B`, `${lane} A`] : [lane]).filter((row) => spans.some((s) => s.row === row));
  const marks = spans.filter((s) => s.lane === 'fault');
  const traces = [...new Set(spans.map((s) => s.label))].map((label) => {
    const own = spans.filter((s) => s.label === label);
    return {name: label, type: 'bar', orientation: 'h', base: own.map((s) => s.from), x: own.map((s) => Math.max(s.to - s.from, 0.02)),
      y: own.map((s) => s.row), marker: {color: LABELS[label] ?? COLORS.bad, opacity: own[0].lane === 'fault' ? 0.35 : 1, line: {width: 0}},
      customdata: own.map((s) => [plain(s.reason ?? ''), s.to]),
      hovertemplate: `${plain(label)}, from %{base:.1f} to %{customdata[1]:.1f} s<br>%{customdata[0]}<extra></extra>`};
  });
  if (marks.length) traces.push({name: 'fault begins', x: marks.map((s) => s.from), y: marks.map((s) => s.row), mode: 'markers+text', showlegend: false,
    text: marks.map((s) => s.label), textposition: 'top right', marker: {symbol: 'x', size: 10, color: COLORS.bad}, hoverinfo: 'skip'});
  drawOverTime('timeline', traces, {height: 110 + 34 * rows.length, barmode: 'overlay', bargap: 0.25, margin: {...MARGIN, t: 20, l: Math.max(MARGIN.l, 12 + 7 * Math.max(...rows.map((row) => row.length)))},
    yaxis: {categoryorder: 'array', categoryarray: rows, fixedrange: true}});
}

// Plotly reads some HTML; what a log says is none.
const plain = (text) => text.replace(/[<>&]/g, (c) => ({'<': '&lt;', '>': '&gt;', '&': '&amp;'})[c]);

// What is drawn over time: [key, name, colour, dash, filled]. Of two flights the first that both hold.
const STRIPS = [
  {id: 'distance', title: 'Distance to the target', unit: 'm', zero: true, lines: [['distance', 'chaser to target', COLORS.chaser]], level: 'desired_distance'},
  {id: 'visibility', title: 'Visibility', unit: 'share', lines: [['visible_share', "visible share of the target's pixels", COLORS.target],
    ['blocked', 'line of sight blocked', 'rgba(198,40,40,0.35)', 'fill']]},
  {id: 'clearance', title: 'Clearance', unit: 'm', touch: true, text: "Of the drone's sphere: to the nearest solid, ground and target among them, where truth is known; and what the plan flown certified.",
    lines: [['clearance', 'clearance', COLORS.chaser], ['certified', 'certified', COLORS.good, 'dot']]},
  {id: 'speed', title: 'Speed', unit: 'm/s', zero: true, text: 'As estimated.', lines: [['speed', 'speed', COLORS.chaser]]},
  {id: 'tracking', title: 'Distance from the plan', unit: 'm', zero: true, lines: [['tracking_error', 'tracking error', COLORS.chaser]]},
  {id: 'sigma', title: 'Uncertainty', unit: 'm', zero: true, text: 'Largest standard deviation of the position, as the estimators say.',
    lines: [['pose_sigma', 'pose', COLORS.chaser], ['target_sigma', 'target', COLORS.target]]},
];

function stripTraces(strip, flights) {
  if (flights.length === 1) return strip.lines.filter(([key]) => flights[0].data[key]?.t.length).map(([key, name, color, dash]) => {
    const {t, value} = flights[0].data[key], fill = dash === 'fill';
    return {name, x: t, y: value, mode: 'lines', ...(fill ? {fill: 'tozeroy', fillcolor: color} : {}),
      line: fill ? {width: 0, shape: 'hv'} : {color, width: dash ? 1.5 : 2, dash}};
  });
  const line = strip.lines.find(([key]) => flights.every(({data}) => data[key]?.t.length));
  return !line ? [] : flights.map(({data}, i) => ({name: `${line[1]}, ${'AB'[i]}`, x: data[line[0]].t, y: data[line[0]].value, mode: 'lines',
    line: {color: PAIR[i], width: 1.8}}));
}

function addStrip(strip, traces, extra) {
  const card = document.createElement('section'), chart = document.createElement('div');
  chart.id = `strip_${strip.id}`;
  chart.className = 'time';
  card.append(Object.assign(document.createElement('h2'), {textContent: strip.unit ? `${strip.title}, ${strip.unit}` : strip.title}));
  if (strip.text) card.append(Object.assign(document.createElement('p'), {textContent: strip.text}));
  card.append(chart);
  document.getElementById('strips').append(card);
  drawOverTime(chart.id, traces, extra);
}

function showStrips(flights) {
  for (const strip of STRIPS) {
    const traces = stripTraces(strip, flights), level = flights[0].data[strip.level];
    if (!traces.length) continue;
    const across = (name, y, color) => traces.push({name, x: [...timeRange], y: [y, y], mode: 'lines', line: {color, dash: 'dash', width: 1.2}});
    if (level) across('desired', level, COLORS.grey);
    if (strip.touch) across('touching', 0, COLORS.bad);
    addStrip(strip, traces, {yaxis: axis('', {rangemode: strip.zero ? 'tozero' : 'normal'})});
  }
  showLatencies(flights);
}

// Of channels whose age says how fresh what is flown by is.
function showLatencies(flights) {
  const two = flights.length === 2, traces = [], colors = ['#1f5fa8', '#e8710a', '#1d7f4b', '#b455c9', '#8a8f98', '#d9a33a'];
  for (const channel of two ? ['TARGET'] : Object.keys(flights[0].data.latency ?? {}))
    flights.forEach(({data}, i) => {
      const series = data.latency?.[channel];
      if (series) traces.push({name: two ? `${channel}, ${'AB'[i]}` : channel, x: series.t, y: series.value, mode: 'lines',
        line: {width: 1.2, color: two ? PAIR[i] : colors[traces.length % colors.length]}});
    });
  if (traces.length) addStrip({id: 'latency', title: 'Latency', unit: 'ms', text: 'Age of messages when they were logged.'}, traces, {yaxis: axis('', {rangemode: 'tozero'})});
}

function showPixels({data}) {
  if (!data.pixel_u?.t.length) return document.getElementById('pixels_card').remove();
  const [width, height] = data.image_px;
  draw('pixels', [{x: data.pixel_u.value, y: data.pixel_v.value, mode: 'lines+markers', line: {color: 'rgba(105,112,124,0.35)', width: 1},
    text: data.pixel_u.t.map((v) => `${v.toFixed(1)} s`), marker: {size: 4, color: data.pixel_u.t, colorscale: 'Viridis',
      colorbar: {thickness: NARROW ? 8 : 16, title: {text: 's'}}}}],
    {height: NARROW ? 270 : 520, showlegend: false, shapes: [{type: 'rect', x0: 0, y0: 0, x1: width, y1: height, line: {color: COLORS.grey, width: 1}}],
     xaxis: axis('u [px]', {range: [0, width], constrain: 'domain'}),
     yaxis: axis('v [px]', {range: [height, 0], scaleanchor: 'x', scaleratio: 1, constrain: 'domain'})});
}
