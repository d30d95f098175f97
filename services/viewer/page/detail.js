// How finely the scene is drawn, so that it moves at 30 Hz: a machine that draws more slowly gets coarser pixels and
// fewer points of the sweeps, one that keeps up gets back what it had.
export const PERIOD = 1 / 30;  // s between two pictures
const LEVELS = [{pixels: 1, points: 1}, {pixels: 0.75, points: 0.5}, {pixels: 0.5, points: 0.25}];
const SLOW = 1.1;         // periods, on average, that are too long
const WINDOW = 30;        // pictures that are averaged over
const RETRY = 20;         // s until finer ones are tried again, longer each time in vain

export class Detail {
  constructor() {
    this.level = 0;
    this.retry = RETRY;
    this.begin(0);
  }

  get pixels() { return LEVELS[this.level].pixels; }
  get points() { return LEVELS[this.level].points; }

  begin(t) {
    [this.count, this.sum] = [0, 0];
    this.since = t;
  }

  // A picture at `t`, `dt` after the one before [s]. True: the level is another one now.
  note(t, dt) {
    ++this.count;
    this.sum += dt;
    if (this.count < WINDOW) return false;
    const slow = this.sum / this.count > SLOW * PERIOD, before = this.level;
    if (slow) {
      if (this.tried) this.retry *= 2;
      this.level = Math.min(this.level + 1, LEVELS.length - 1);
      this.changed = t;
    } else if (this.level > 0 && t - this.changed > this.retry) {
      --this.level;
      this.changed = t;
    }
    this.tried = this.level < before;
    this.begin(t);
    return this.level !== before;
  }
}
