// Draws the motions that the page holds, at the parameters and the time of its sliders. WebGL 2, no libraries.
// What is interpolated, and how, is as in table.py and body.py.
"use strict";
(() => {
const figure = JSON.parse(document.getElementById("figure-data").textContent);
const KINDS = {
  int8: Int8Array, uint8: Uint8Array, int16: Int16Array, uint16: Uint16Array, uint32: Uint32Array, float32: Float32Array,
};
const $ = (id) => document.getElementById(id);
const SLOW = 0.045, COARSEST = 0.45, COARSEST_SPLATS = 0.33; // s between two frames; pixels each way, of those there are
const STILL = 300; // ms without a change, after which all pixels are drawn
const UNSEEN = 1e-6; // m, deformations below which are not drawn

function decode(array) {
  const text = atob(array.data), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new KINDS[array.dtype](bytes.buffer);
}

function cubicWeights(place, count) {
  // [[index, weight] ...] of Catmull-Rom; beyond the ends, values continue the line through the nearest two
  if (count === 1) return [[0, 1]];
  const first = Math.min(Math.max(Math.trunc(place), 0), count - 2), x = place - first;
  const terms = [x * (x * (1 - x / 2) - 0.5), 1 + x * x * (1.5 * x - 2.5), x * (0.5 + x * (2 - 1.5 * x)),
    0.5 * x * x * (x - 1)];
  const found = new Map(), add = (i, w) => found.set(i, (found.get(i) ?? 0) + w);
  terms.forEach((term, k) => {
    const i = first - 1 + k;
    if (i >= 0 && i < count) return add(i, term);
    const [end, inner] = i < 0 ? [0, 1] : [count - 1, count - 2];
    add(end, 2 * term);
    add(inner, -term);
  });
  return [...found];
}
// rows of the rotation about a vector, by its length in radians
function rotation(x, y, z) {
  const angle = Math.hypot(x, y, z), c = Math.cos(angle);
  const s = angle > 1e-9 ? Math.sin(angle) / angle : 1, t = angle > 1e-9 ? (1 - c) / (angle * angle) : 0.5;
  return [c + t * x * x, t * x * y - s * z, t * x * z + s * y, t * x * y + s * z, c + t * y * y, t * y * z - s * x,
    t * x * z - s * y, t * y * z + s * x, c + t * z * z];
}

