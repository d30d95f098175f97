// States come ten times a second: what moves is drawn on its way from one to the next.
const LONGEST = 0.3;  // s: after a longer silence it is drawn where it is

export class Motion {
  constructor() { this.ways = []; this.at = 0; this.span = 0; }

  // The objects (three.js) have been put to where they are now; from where they were drawn last they go there
  // within the time from the state before to this one, unless it is of another `generation`. Times in seconds.
  aim(t, generation, objects) {
    const span = t - this.at, jumps = generation !== this.generation || span > LONGEST;
    for (const {object} of this.ways) if (!objects.includes(object)) delete object.userData.drawn;
    [this.at, this.span, this.generation] = [t, jumps ? 0 : span, generation];
    this.ways = objects.map((object) => {
      const to = object.position.clone(), from = jumps || !object.userData.drawn ? to : object.userData.drawn.clone();
      return {object, from, to};
    });
    for (const {object, from} of this.ways) object.userData.drawn = from.clone();
    this.rests = false;
  }

  // False: nothing has moved since the last call.
  move(t) {
    if (this.rests) return false;
    const share = this.span > 0 ? Math.min((t - this.at) / this.span, 1) : 1;
    for (const {object, from, to} of this.ways) {
      object.position.lerpVectors(from, to, share);
      object.userData.drawn.copy(object.position);
    }
    this.rests = share === 1;
    return true;
  }
}
