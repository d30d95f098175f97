// What the messages' constants mean, and the colours that stand for them.
export const VERDICTS = ['chase', 'wider', 'kept', 'safe only', 'brake', 'wait', 'escape', 'mitigate'];
export const VERDICT_COLORS = ['#3fa66b', '#6fbf73', '#4c9be8', '#d9a33a', '#d9534f', '#7d8896', '#b455c9', '#991a1a'];
// What stands in the scene, in the order of its legend.
export const SCENE_COLORS = {drone: '#4c9be8', target: '#e8702a', sigma: '#fff2b0', forecast: '#ffd24d', still: '#8d97a5', grown: '#c98a8a',
  moving: '#d9534f', velocity: '#ff8a80', ground: '#6b5f4a', fence: '#e05bd0', truth: '#5ff0f0'};
export const SCENE_WORDS = {drone: 'drone', target: 'target', sigma: 'its 3 sigma', forecast: 'forecast, 2 sigma', still: 'obstacle',
  grown: "grown by the drone's radius", moving: 'mover', velocity: 'its way in 1 s', fence: 'geofence'};
export const TARGET_STATES = ['searching', 'tracking', 'occluded', 'lost'];
export const TARGET_COLORS = ['#7d8896', '#3fa66b', '#d9a33a', '#d9534f'];
export const HEALTHS = ['pose ok', 'pose degraded', 'pose lost', 'pose starting'];
export const HEALTH_COLORS = ['#3fa66b', '#d9a33a', '#d9534f', '#7d8896'];
export const FOLLOWING = ['no plan', 'plan', 'stop', 'brake', 'land'];
export const STATE_COLORS = ['#7d8896', '#3fa66b', '#d9a33a', '#d9534f'];  // of a process: starting ok degraded failed
export const FAULTS = ['', '', 'a process is degraded', 'a process has failed'];
export const FAULT_COLORS = [null, null, '#d9a33a', '#d9534f'];  // of all processes: the worst
export const COMMANDS = ['takeoff', 'chase', 'hold', 'search', 'return', 'land', 'stop'];

export const FLIGHT_STATES = ['IDLE', 'READY', 'TAKEOFF', 'CHASE', 'HOLD', 'SEARCH', 'RETURN', 'LAND', 'DONE', 'EMERGENCY'];
export const FLIGHT_COLORS = ['#7d8896', '#a9c7b4', '#6fbf73', '#3fa66b', '#4c9be8', '#d9a33a', '#b455c9', '#8a6fd1', '#5b6675', '#d9534f'];

// Columns of a row of samples (services/viewer/page_text.cpp, RowOf).
export const T = 0, DISTANCE = 1, CLEARANCE = 2, SPEED = 3, PLAN_MS = 4, VERDICT = 5, TARGET_STATE = 6, HEALTH = 7,
  DRONE = 8, TARGET = 11, FLIGHT = 14, PROCESSES = 15, INJECTED = 16;

// Of an element: written only where they change, so that nothing is laid out and painted in vain.
export const setText = (element, text) => { if (element.textContent !== text) element.textContent = text; };

export const format = (value, digits, unit) => value === null || value === undefined ? `– ${unit}` : `${value.toFixed(digits)} ${unit}`;
