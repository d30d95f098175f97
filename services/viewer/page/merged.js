// Many solids in one draw call: software GL takes longer over a call than over the triangles in it.
import * as THREE from './three.module.min.js';

// Geometry of all `parts`, each {geometry, matrix, color}; with normals and colours, or positions alone for lines.
export function merge(parts) {
  const merged = new THREE.BufferGeometry(), normal = new THREE.Matrix3(), v = new THREE.Vector3();
  const positions = [], normals = [], colors = [], index = [];
  for (const {geometry, matrix, color} of parts) {
    const {position: p, normal: n} = geometry.attributes, first = positions.length / 3;
    normal.getNormalMatrix(matrix);
    for (let i = 0; i < p.count; ++i) {
      positions.push(...v.fromBufferAttribute(p, i).applyMatrix4(matrix));
      if (n) normals.push(...v.fromBufferAttribute(n, i).applyNormalMatrix(normal));
      if (color) colors.push(color.r, color.g, color.b);
    }
    const own = geometry.index;
    for (let i = 0; i < (own ? own.count : p.count); ++i) index.push(first + (own ? own.getX(i) : i));
  }
  const set = (name, values) => { if (values.length > 0) merged.setAttribute(name, new THREE.Float32BufferAttribute(values, 3)); };
  set('position', positions);
  set('normal', normals);
  set('color', colors);
  merged.setIndex(index);
  return merged;
}

export const part = (geometry, color, matrix = new THREE.Matrix4()) => ({geometry, color: color && new THREE.Color(color), matrix});

// A mesh, or lines, whose merged geometry is given anew; nothing to draw: invisible.
export function setMerged(object, parts) {
  object.geometry.dispose();
  object.visible = parts.length > 0;
  object.geometry = object.visible ? merge(parts) : new THREE.BufferGeometry();
}
