// The 3D scene. World: x east, y north, z up, metres.
import * as THREE from './three.module.min.js';
import {OrbitControls} from './OrbitControls.js';
import {Detail, PERIOD} from './detail.js';
import {Motion} from './motion.js';
import {part, setMerged} from './merged.js';
import {circles, line, makeDrone, place, poseOf, setLine, setTube, tube, turn} from './shapes.js';
import {VERDICT_COLORS, SCENE_COLORS, T, DRONE, TARGET} from './names.js';

const SWEEPS = 6;        // of the last seconds that stay on the screen
const TRAIL = 20;        // s
const MOST_POINTS = 20000;
const KINDS = ['still', 'moving', 'ground'].map((kind) => SCENE_COLORS[kind]);
const SIGMAS = 3;        // of the target's ellipsoid; it is small beside the target
const FOLLOW = 0.3;      // s: time constant of the camera
const SLACK = 0.008;     // s by which a picture may come early: half a period of a screen of 60 Hz
const AHEAD = 1;        // s that movers go on by their velocity without being heard
const STALE = '#4a525c';  // of what is too old to be shown as what is
const LARGE = 1.5;       // m: half an edge from which on a box would hide what is behind it

const seconds = () => performance.now() / 1000;
const grey = (object, stale) => {
  object.own ??= object.material.color.getHex();
  object.material.color.set(stale ? STALE : object.own);
};

export class Scene3D {
  constructor(canvas) {
    THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
    this.canvas = canvas;
    // Opaque: what is behind the canvas need not be drawn and blended.
    const context = canvas.getContext('webgl2', {alpha: false, antialias: false, powerPreference: 'low-power'});
    this.renderer = new THREE.WebGLRenderer({canvas, context});
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color('#12161c');
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.1, 500);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-4, -3.5, 5);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.49 * Math.PI;
    this.controls.addEventListener('change', () => { this.dirty = true; });
    this.scene.add(new THREE.HemisphereLight('#ffffff', '#404850', 2.2));
    const sun = new THREE.DirectionalLight('#ffffff', 1.2);
    sun.position.set(5, -8, 12);
    this.scene.add(sun);
    this.addThings();
    this.follow = true;
    this.at = new THREE.Vector3();
    this.dirty = true;
    this.frames = 0;  // that were drawn
    this.drawn = 0;   // when the last one was, s
    this.due = 0;     // and the next one is
    this.detail = new Detail();
    this.motion = new Motion();
    const draw = () => { this.draw(); requestAnimationFrame(draw); };
    requestAnimationFrame(draw);
  }

  addThings() {
    const grid = new THREE.GridHelper(200, 100, '#2c3542', '#222a34');
    grid.rotation.x = Math.PI / 2;
    this.drone = makeDrone();
    const orange = new THREE.MeshLambertMaterial({color: SCENE_COLORS.target});
    this.target = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 24).rotateX(Math.PI / 2), orange);
    this.covariance = new THREE.Mesh(new THREE.SphereGeometry(1, 10, 8),
      new THREE.MeshBasicMaterial({color: SCENE_COLORS.sigma, wireframe: true, transparent: true, opacity: 0.5, depthTest: false}));
    this.trail = line(SCENE_COLORS.drone, 0.6);
    this.targetTrail = line(SCENE_COLORS.target, 0.5);
    this.plan = tube('#ffffff', 0.035, 1);
    this.stop = tube('#ffffff', 0.06, 0.35);
    this.forecast = tube(SCENE_COLORS.forecast, 0.025, 1);
    this.fan = new THREE.Mesh(new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({color: SCENE_COLORS.forecast, transparent: true, opacity: 0.22, side: THREE.DoubleSide, depthWrite: false}));
    this.fan.frustumCulled = false;
    this.sight = line('#93a0b0', 0.35);
    this.solid = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshLambertMaterial({vertexColors: true}));
    this.ground = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshLambertMaterial(
      {vertexColors: true, transparent: true, opacity: 0.25, depthWrite: false}));
    this.walls = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial(
      {color: KINDS[0], transparent: true, opacity: 0.08, side: THREE.BackSide, depthWrite: false}));
    this.edges = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: '#6d7886'}));
    this.grown = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: SCENE_COLORS.grown, transparent: true, opacity: 0.45}));
    this.obstacles = [this.solid, this.ground, this.walls, this.edges, this.grown];
    this.movers = new Map();  // by id: their solid, arrow and grown shape in a mesh each, for they move
    for (const thing of this.obstacles) thing.frustumCulled = false;
    this.cloud = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({size: 2, sizeAttenuation: false, vertexColors: true}));
    this.cloud.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * MOST_POINTS), 3));
    this.cloud.geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * MOST_POINTS), 3));
    this.points = 0;
    this.cloud.frustumCulled = false;
    this.sweeps = [];
    this.fence = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: SCENE_COLORS.fence}));
    this.fence.frustumCulled = this.fence.visible = false;
    this.scene.add(this.fence, grid, this.drone, this.target, this.covariance, this.trail, this.targetTrail, this.plan, this.stop,
      this.forecast, this.fan, this.sight, ...this.obstacles, this.cloud);
    for (const thing of [this.drone, this.target, this.covariance]) thing.visible = false;
    this.solids = [new THREE.SphereGeometry(1, 16, 10), new THREE.BoxGeometry(2, 2, 2),
      new THREE.CylinderGeometry(1, 1, 2, 20).rotateX(Math.PI / 2)];
    this.boxEdges = new THREE.EdgesGeometry(this.solids[1]);
    this.outlines = [circles(16), this.boxEdges,
      new THREE.EdgesGeometry(new THREE.CylinderGeometry(1, 1, 2, 12).rotateX(Math.PI / 2), 20)];
    this.rows = [];
    this.radius = 0;         // m, by which shapes are grown
    this.showGrown = true;
    this.shaft = new THREE.CylinderGeometry(0.02, 0.02, 1, 6).translate(0, 0.5, 0);
    this.head = new THREE.ConeGeometry(0.075, 0.25, 8);
    this.setObstacles([]);
    this.truth = [];
    this.showTruth = true;
    this.cross = new THREE.BufferGeometry().setAttribute('position',
      new THREE.Float32BufferAttribute([-0.25, 0, 0, 0.5, 0, 0, 0, -0.25, 0, 0, 0.25, 0, 0, 0, -0.25, 0, 0, 0.25], 3));
    this.crossLines = new THREE.LineBasicMaterial({color: SCENE_COLORS.truth, depthTest: false});  // seen through what stands there
  }

  // Where a simulation had drone, target or a mover: lines along its axes, the longest forward.
  addCross() {
    const cross = new THREE.LineSegments(this.cross, this.crossLines);
    cross.frustumCulled = false;
    this.truth.push(cross);
    this.scene.add(cross);
  }

  // A seek, or another frame W: what was drawn before is nowhere now.
  begin(generation) {
    if (generation === this.generation) return;
    this.generation = generation;
    this.clearSweeps();
    this.setObstacles([]);
  }

  clearSweeps() {
    this.sweeps = [];
    this.points = 0;
    this.dirty = true;
  }

  setState(state) {
    const {drone, target} = state, [plan, forecast] = [state.plan, state.forecast].map((part) => part?.stale ? null : part);
    const truth = this.showTruth && state.truth || [];
    while (this.truth.length < truth.length) this.addCross();
    const crosses = this.truth.map((cross, i) => [cross, truth[i]]);
    const moving = [[this.drone, drone], [this.target, target], ...crosses, ...this.moversAt(state.row[T] ?? this.told)].filter(([object, at]) => place(object, at?.p));
    for (const [object, at] of [[this.drone, drone], ...crosses]) turn(object, at?.q);
    this.motion.aim(seconds(), state.generation, moving.map(([object]) => object));
    if (this.target.visible) {
      this.target.scale.set(target.radius, target.radius, target.height);
      this.covariance.scale.set(...target.axes.map((v) => Math.max(SIGMAS * (v ?? 0), 0.005)));
      turn(this.covariance, target.q);
    }
    this.covariance.visible = this.target.visible && !target.stale;
    grey(this.target, target?.stale);
    for (const object of this.obstacles) grey(object, state.obstacles?.stale);
    const color = VERDICT_COLORS[plan?.verdict] ?? '#ffffff';
    for (const part of [this.plan, this.stop]) part.material.color.set(color);
    setTube(this.plan, plan?.path);
    setTube(this.stop, plan?.stop);
    setTube(this.forecast, forecast?.path);
    this.setFan(forecast);
    this.grow(state.plan?.radius ?? 0);
    this.setFence(state.fence);
    setLine(this.sight, this.drone.visible && this.covariance.visible ? [...drone.p, ...target.p] : null);
    this.dirty = true;
  }

  // A band of two standard deviations to both sides of the forecast.
  setFan(forecast) {
    this.fan.visible = this.forecast.visible && forecast.spread.every((v) => v !== null);
    if (!this.fan.visible) return;
    const path = forecast.path, count = path.length / 3, sides = [], faces = [];
    for (let i = 0; i < count; ++i) {
      const a = 3 * Math.max(i - 1, 0), b = 3 * Math.min(i + 1, count - 1);
      let dx = path[b] - path[a], dy = path[b + 1] - path[a + 1];
      const length = Math.hypot(dx, dy) || 1;
      const along = i / (count - 1) * (forecast.spread.length - 1), k = Math.min(Math.floor(along), forecast.spread.length - 2);
      const sigma = forecast.spread[k] + (along - k) * (forecast.spread[k + 1] - forecast.spread[k]);
      dx *= 2 * sigma / length; dy *= 2 * sigma / length;
      const [x, y, z] = path.slice(3 * i, 3 * i + 3);
      sides.push(x - dy, y + dx, z, x + dy, y - dx, z);
      if (i > 0) faces.push(2 * i - 2, 2 * i - 1, 2 * i, 2 * i - 1, 2 * i + 1, 2 * i);
    }
    this.fan.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(sides), 3));
    this.fan.geometry.setIndex(faces);
  }

  // Its edges at both heights and between them.
  setFence(fence) {
    const key = JSON.stringify(fence ?? null);
    if (key === this.fenceKey) return;
    this.fenceKey = key;
    const lines = (fence?.corners ?? []).flatMap(([x, y], i, all) => {
      const [u, v] = all[(i + 1) % all.length], {floor, ceiling} = fence;
      return [x, y, floor, u, v, floor, x, y, ceiling, u, v, ceiling, x, y, floor, x, y, ceiling];
    });
    setLine(this.fence, lines);
  }

  setTrail(rows, now) {
    for (const [part, column] of [[this.trail, DRONE], [this.targetTrail, TARGET]]) {
      const points = [];
      for (const row of rows) {
        if (row[T] < now - TRAIL || row[T] > now || row[column] === null) continue;
        points.push(row[column], row[column + 1], row[column + 2]);
      }
      setLine(part, points);
    }
    this.dirty = true;
  }

  // Where the drone's centre may not be: obstacles grown by what plans keep free.
  grow(radius) {
    if (radius === this.radius) return;
    this.radius = radius;
    this.setObstacles(this.rows);
  }

  grownOf(known) {
    if (!this.showGrown || this.radius <= 0) return [];
    return known.filter((row) => row.kind !== 2).map((row) =>
      part(this.outlines[row.solid] ?? this.outlines[0], null, poseOf({...row, half: row.half.map((v) => v + this.radius)})));
  }

  // Movers and where they are at t: on their way by their velocity since they were told.
  moversAt(t) {
    const ahead = Math.min(Math.max(t - this.told, 0), AHEAD);
    return [...this.movers.values()].map((mover) => [mover, {p: mover.row.p.map((x, i) => x + ahead * (mover.row.v?.[i] ?? 0))}]);
  }

  setMovers(rows) {
    for (const [id, mover] of this.movers) {
      if (rows.some((row) => row.id === id)) continue;
      this.scene.remove(mover);
      mover.geometry.dispose();
      mover.children[0].geometry.dispose();
      this.movers.delete(id);
    }
    for (const row of rows) {
      const known = this.movers.get(row.id), mover = known ?? new THREE.Mesh(new THREE.BufferGeometry(), this.solid.material);
      if (!known) {
        mover.add(new THREE.LineSegments(new THREE.BufferGeometry(), this.grown.material));
        for (const object of [mover, mover.children[0]]) object.frustumCulled = false;
        this.movers.set(row.id, mover);
        this.scene.add(mover);
      }
      const own = {...row, p: [0, 0, 0]};
      mover.row = row;
      setMerged(mover, [part(this.solids[row.solid] ?? this.solids[0], KINDS[1], poseOf(own)), ...this.arrow(own)]);
      setMerged(mover.children[0], this.grownOf([own]));
      if (!known) place(mover, row.p);
    }
  }

  // `t`: of the state that they were told with, s.
  setObstacles(rows, t = this.told ?? 0) {
    this.rows = rows;
    this.told = t;
    const known = rows.filter((row) => [...row.p, ...row.half].every((v) => v !== null));
    const solid = [], ground = [], walls = [], edges = [];
    const movers = known.filter((row) => row.kind === 1), rest = known.filter((row) => row.kind !== 1);
    for (const row of rest) {
      const wall = row.kind === 0 && row.solid === 1 && Math.max(...row.half) > LARGE;
      const made = part(this.solids[row.solid] ?? this.solids[0], KINDS[row.kind] ?? KINDS[0], poseOf(row));
      (wall ? walls : row.kind === 2 ? ground : solid).push(made);
      if (wall) edges.push(part(this.boxEdges, null, made.matrix));
    }
    const grown = this.grownOf(rest);
    this.setMovers(movers);
    [solid, this.showGround ? ground : [], walls, edges, grown].forEach((parts, i) => setMerged(this.obstacles[i], parts));
    this.shown = {solids: known.length, arrows: movers.filter((row) => this.arrow(row).length > 0).length, grown: grown.length};
    this.dirty = true;
  }

  // Of the velocity: as long as what is covered in a second, 5 m at most.
  arrow(row) {
    if (!row.v || row.v.some((v) => v === null)) return [];
    const v = new THREE.Vector3(...row.v), length = Math.min(v.length(), 5);
    if (length < 0.05) return [];
    const turned = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), v.normalize());
    const from = new THREE.Vector3(...row.p), to = from.clone().addScaledVector(v, length);
    const at = (p, size) => new THREE.Matrix4().compose(p, turned, new THREE.Vector3(1, size, 1));
    return [part(this.shaft, SCENE_COLORS.velocity, at(from, length)), part(this.head, SCENE_COLORS.velocity, at(to, 1))];
  }

  // The newest sweep is bright, the ones before fade; colour: height above the lowest.
  addSweep(points) {
    this.sweeps.unshift(points);
    this.sweeps.length = Math.min(this.sweeps.length, SWEEPS);
    const {position, color} = this.cloud.geometry.attributes;
    let n = 0;
    this.sweeps.forEach((sweep, age) => {
      const bright = 1 - 0.7 * age / SWEEPS;
      for (let i = 0; i + 2 < sweep.length && n < MOST_POINTS; i += 3, ++n) {
        position.setXYZ(n, sweep[i], sweep[i + 1], sweep[i + 2]);
        const h = Math.min(Math.max(sweep[i + 2] / 3, 0), 1);
        color.setXYZ(n, bright * (0.25 + 0.5 * h), bright * (0.55 + 0.25 * h), bright * (0.75 - 0.35 * h));
      }
    });
    position.needsUpdate = color.needsUpdate = true;
    this.points = n;
    this.dirty = true;
  }

  // Moves camera and centre along with the drone.
  keepInView(dt) {
    if (!this.follow) return false;
    const goal = this.target.visible ? this.drone.position.clone().lerp(this.target.position, 0.5) : this.drone.position;
    const step = goal.clone().sub(this.controls.target);
    if (step.length() < 30 && this.placed) step.multiplyScalar(1 - Math.exp(-dt / FOLLOW));
    this.placed = true;
    this.controls.target.add(step);
    this.camera.position.add(step);
    return step.length() > 1e-3;
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2) * this.detail.pixels);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  draw() {
    const t = seconds(), dt = t - this.drawn;
    if (t < this.due - SLACK) return;
    this.resize();
    const moves = this.motion.move(t);
    if (!moves && !this.dirty) return;
    if (this.target.visible) this.covariance.position.copy(this.target.position);
    const follows = this.drone.visible && this.keepInView(Math.min(dt, 1));
    // The newest sweep comes first, so that the oldest go.
    this.cloud.geometry.setDrawRange(0, Math.ceil(this.detail.points * this.points));
    this.dirty = follows;
    this.controls.update();
    this.renderer.render(this.scene, this.camera);
    this.frames++;
    this.drawn = t;
    this.due = Math.max(this.due + PERIOD, t - PERIOD);  // one that was late does not hold the next one back
    if (moves && this.moved && this.detail.note(t, dt)) this.width = 0;  // sized anew
    this.moved = moves;
  }
}
