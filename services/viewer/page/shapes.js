// What the scene is made of: lines, tubes, the drone, and where they are put.
import * as THREE from './three.module.min.js';
import {part, merge} from './merged.js';
import {SCENE_COLORS} from './names.js';

export const line = (color, opacity = 1) => {
  const made = new THREE.Line(new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({color, transparent: opacity < 1, opacity}));
  made.frustumCulled = false;
  return made;
};
// The wire's quaternions are w x y z.
export const turn = (object, q) => { if (q && q.every((v) => v !== null)) object.quaternion.set(q[1], q[2], q[3], q[0]); };
export const poseOf = ({p, q, half}) => {
  const object = new THREE.Object3D();
  object.position.set(...p);
  turn(object, q);
  object.scale.set(...half.map((v) => Math.max(v, 0.005)));
  object.updateMatrix();
  return object.matrix;
};
export const place = (object, p) => {
  object.visible = !!p && p.every((v) => v !== null);
  if (object.visible) object.position.set(p[0], p[1], p[2]);
  return object.visible;
};
// Lines are one pixel wide in WebGL: what counts is drawn as a tube.
export const tube = (color, radius, opacity) => {
  const made = new THREE.Mesh(new THREE.BufferGeometry(),
    new THREE.MeshBasicMaterial({color, transparent: opacity < 1, opacity}));
  made.frustumCulled = false;
  made.radius = radius;
  return made;
};
export const setTube = (object, points) => {
  object.visible = !!points && points.length >= 6 && points.every((v) => v !== null);
  if (!object.visible) return;
  const path = [];
  for (let i = 0; i < points.length; i += 3) path.push(new THREE.Vector3(points[i], points[i + 1], points[i + 2]));
  object.geometry.dispose();
  object.geometry = new THREE.TubeGeometry(new THREE.CatmullRomCurve3(path), path.length, object.radius, 5);
};
export const setLine = (object, points) => {
  object.visible = !!points && points.length >= 6 && points.every((v) => v !== null);
  if (!object.visible) return;
  object.geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(points), 3));
};

// The unit sphere's three circles, as ends of lines.
export function circles(count) {
  const ends = [], angle = 2 * Math.PI / count;
  for (const [u, v] of [[0, 1], [1, 2], [2, 0]])
    for (let i = 0; i < 2 * count; ++i) {
      const p = [0, 0, 0], k = Math.ceil(i / 2);
      [p[u], p[v]] = [Math.cos(k * angle), Math.sin(k * angle)];
      ends.push(...p);
    }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(ends, 3));
  return geometry;
}

export function makeDrone() {
  const at = (x, y, z) => new THREE.Matrix4().makeTranslation(x, y, z);
  const disc = new THREE.CylinderGeometry(0.11, 0.11, 0.02, 16).rotateX(Math.PI / 2);
  const nose = new THREE.ConeGeometry(0.05, 0.16, 12).rotateZ(-Math.PI / 2);
  const rotors = [[1, 1], [1, -1], [-1, 1], [-1, -1]].map(([x, y]) => part(disc, SCENE_COLORS.drone, at(0.16 * x, 0.16 * y, 0.04)));
  return new THREE.Mesh(merge([part(new THREE.BoxGeometry(0.22, 0.12, 0.08), '#dfe5ec'), ...rotors, part(nose, '#e8702a', at(0.18, 0, 0))]),
    new THREE.MeshLambertMaterial({vertexColors: true}));
}
