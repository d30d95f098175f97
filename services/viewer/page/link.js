// The connection to the viewer: texts and binary parts in, requests out. It comes back by itself, and acknowledges
// every frame, so that what is under way on a slow link stays small.
export class Link {
  constructor(handlers) {
    this.handlers = handlers;
    this.wants = ['cloud', 'image'];
    this.bytes = 0;
    this.connect();
  }

  connect() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const socket = new WebSocket(`${scheme}://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => { this.socket = socket; this.ask({want: this.wants}); this.handlers.link(true); };
    socket.onclose = () => { this.socket = null; this.handlers.link(false); setTimeout(() => this.connect(), 1000); };
    socket.onmessage = (event) => this.hear(event.data);
  }

  ask(request) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }

  want(parts) {
    this.wants = parts;
    this.ask({want: parts});
  }

  hear(data) {
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
  const count = view.getUint32(4, true);
  const origin = [16, 24, 32].map((at) => view.getFloat64(at, true));
  const points = new Float32Array(3 * count);
  for (let i = 0; i < 3 * count; ++i) points[i] = origin[i % 3] + 0.01 * view.getInt16(40 + 2 * i, true);
  return {t: view.getFloat64(8, true), points};
}

function imageOf(data) {
  const length = new DataView(data).getUint32(4, true);
  const about = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 8, length)));
  return {about, jpeg: new Blob([new Uint8Array(data, 8 + length)], {type: 'image/jpeg'})};
}
