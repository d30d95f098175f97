// The connection to the viewer: texts and binary parts in, requests out. It comes back by itself, and acknowledges
// every frame, so that what is under way on a slow link stays small.
const SILENT = 1;    // s without a message: ten states are missing
const DEAD = 5;      // s without one: the connection is made anew
const LOOK = 250;    // ms from one look at the silence to the next
const RETRY = 1000;  // ms

const seconds = () => performance.now() / 1000;

export class Link {
  constructor(handlers) {
    this.handlers = handlers;
    this.wants = ['cloud', 'image'];
    this.bytes = 0;
    this.heard = seconds();
    this.connect();
    setInterval(() => this.look(), LOOK);
  }

  connect() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const socket = new WebSocket(`${scheme}://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    [this.socket, this.begun] = [socket, seconds()];
    socket.onopen = () => {
      this.handlers.connected();
      this.ask({want: this.wants});
    };
    socket.onclose = () => this.leave();
    socket.onmessage = (event) => this.hear(event.data);
  }

  // Whoever is dead does not answer a close either: what may still come of this connection is not waited for.
  leave() {
    Object.assign(this.socket, {onopen: null, onclose: null, onmessage: null});
    this.socket.close();
    this.socket = null;
    this.tell();
    setTimeout(() => this.connect(), RETRY);
  }

  look() {
    if (this.socket && seconds() - Math.max(this.heard, this.begun) > DEAD) this.leave();
    else this.tell();
  }

  // Is it up, and for how long has nothing come? 0 s as long as nothing is amiss.
  tell() {
    const silence = seconds() - this.heard;
    this.handlers.link(this.socket?.readyState === WebSocket.OPEN, silence > SILENT ? silence : 0);
  }

  ask(request) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }

  want(parts) {
    this.wants = parts;
    this.ask({want: parts});
  }

  hear(data) {
    this.heard = seconds();
    this.ask({ack: 1});
    this.bytes += data.length ?? data.byteLength;
    if (typeof data !== 'string') return hearBinary(data, this.handlers);
    const message = JSON.parse(data);
    this.handlers[message.type]?.(message);
  }
}

export function hearBinary(data, handlers) {
  const kind = new DataView(data).getUint8(0);
  if (kind === 1) handlers.cloud(cloudOf(data));
  if (kind === 2) handlers.image(imageOf(data));
}

// services/viewer/cloud.h says what stands where.
function cloudOf(data) {
  const view = new DataView(data);
  const count = view.getUint32(4, true), generation = view.getUint32(0, true) >>> 8;
  const origin = [16, 24, 32].map((at) => view.getFloat64(at, true));
  const points = new Float32Array(3 * count);
  for (let i = 0; i < 3 * count; ++i) points[i] = origin[i % 3] + 0.01 * view.getInt16(40 + 2 * i, true);
  return {t: view.getFloat64(8, true), generation, points};
}

function imageOf(data) {
  const length = new DataView(data).getUint32(4, true);
  const about = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 8, length)));
  return {about, jpeg: new Blob([new Uint8Array(data, 8 + length)], {type: 'image/jpeg'})};
}
