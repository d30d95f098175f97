// A recorded flight in place of the connection: plays what the viewer said of a log, with a clock of its own.
import {hearBinary} from './link.js';

const PERIOD = 0.1;                      // s between states
const MOST = 1 << 24;                    // generations that a sweep can tell
const HEAVY = {cloud: true, image: true};

const bytesOf = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)).buffer;

export class Recording {
  // `recorded`: {duration [s], hello, frames: [kind, t, message; of sweeps and images base64]}, in the order of t.
  constructor(handlers, recorded) {
    Object.assign(this, {handlers, recorded, wants: ['cloud', 'image'], bytes: 0, t: 0, speed: 1, playing: true, next: 0, seeks: 0});
    setTimeout(() => this.begin());
  }

  begin() {
    this.handlers.link(true);
    this.handlers.hello(this.recorded.hello);
    this.seek(this.recorded.start ?? 0);
    setInterval(() => this.step(), 1000 * PERIOD);
  }

  want(parts) { this.wants = parts; }

  ask(request) {
    if (request.speed) this.speed = request.speed;
    if (request.seek !== undefined) this.seek(request.seek);
    if (request.play === undefined) return;
    if (request.play && this.t >= this.recorded.duration) this.seek(0);
    this.playing = request.play;
    this.tell();
  }

  // The newest of every kind up to then.
  seek(t) {
    this.t = Math.min(Math.max(t, 0), this.recorded.duration);
    this.seeks++;
    this.next = 0;
    this.state = null;
    this.advance();
  }

  step() {
    if (!this.playing) return;
    this.t = Math.min(this.t + this.speed * PERIOD, this.recorded.duration);
    this.playing = this.t < this.recorded.duration;
    this.advance();
  }

  // Hands over what comes until now; of each kind the newest.
  advance() {
    const newest = {}, {frames} = this.recorded;
    for (; this.next < frames.length && frames[this.next][1] <= this.t + 1e-6; ++this.next) newest[frames[this.next][0]] = frames[this.next][2];
    this.state = newest.state ?? this.state;
    this.tell();
    for (const [kind, message] of Object.entries(newest)) {
      if (HEAVY[kind] && this.wants.includes(kind)) hearBinary(bytesOf(message), {...this.handlers, cloud: (cloud) => this.handlers.cloud(this.anew(cloud))});
      if (!HEAVY[kind] && kind !== 'state') this.handlers[kind](this.anew(message));
    }
  }

  // Each seek is a generation after all before.
  anew(message) { return {...message, generation: this.seeks * MOST + message.generation}; }

  tell() {
    if (!this.state) return;
    this.handlers.state({...this.anew(this.state), play: {t: this.t, duration: this.recorded.duration, speed: this.speed, playing: this.playing}});
  }
}
