// Draws the motions that the page holds, at the parameters and the time of its sliders. WebGL 2, no libraries.
// What is interpolated, and how, is as in table.py and body.py.
"use strict";
(() => {
const figure = JSON.parse(document.getElementById("figure-data").textContent);
const KINDS = { int16: Int16Array, uint16: Uint16Array, uint32: Uint32Array, float32: Float32Array };
const $ = (id) => document.getElementById(id);
const SLOW = 0.045, COARSEST = 0.45; // s between two frames; pixels each way, of those there are
const UNSEEN = 1e-6; // m, deformations below which are not drawn

function decode(array) {
  const text = atob(array.data), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new KINDS[array.dtype](bytes.buffer);
}

// ---- interpolation -------------------------------------------------------------------------------------------------

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

class Column {
  constructor(data) {
    Object.assign(this, data);
    this.arrays = Object.fromEntries(Object.entries(data.arrays).map(([name, array]) => [name, decode(array)]));
    const { basis, steps, rest } = this.arrays;
    this.modes = steps.length;
    this.size = 6 + this.modes;
    this.basis = Float32Array.from(basis, (value, i) => value * steps[Math.floor(i / rest.length)]);
    this.y = new Float64Array(this.size);
    this.points = new Float32Array(rest.length);
    this.normals = new Float32Array(rest.length);
    this.local = new Float32Array(rest.length);
  }

  // the coordinates of all frames at places on the sliders
  choose(places) {
    const { mean, scale, sizes, patterns, weights } = this.arrays, ranks = sizes.length;
    let nodes = [[0, 1]];
    this.counts.forEach((count, axis) => {
      const next = cubicWeights(places[this.axes[axis]] * (count - 1), count);
      nodes = nodes.flatMap(([i, w]) => next.map(([j, v]) => [i * count + j, w * v]));
    });
    const sum = new Float64Array(mean);
    for (let r = 0; r < ranks; r++) {
      let by = 0;
      for (const [i, w] of nodes) by += w * weights[i * ranks + r];
      by *= sizes[r];
      for (let i = 0, at = r * mean.length; i < mean.length; i++) sum[i] += by * patterns[at + i];
    }
    for (let i = 0; i < sum.length; i++) sum[i] /= scale[i % this.size];
    this.table = sum;
  }

  move(time) {
    const place = Math.min(Math.max((time - figure.start) / figure.step, 0), figure.frames - 1);
    const { y, local, points, arrays: { rest, anchor } } = this;
    y.fill(0);
    for (const [frame, w] of cubicWeights(place, figure.frames))
      for (let d = 0; d < this.size; d++) y[d] += w * this.table[frame * this.size + d];
    local.set(rest);
    for (let k = 0; k < this.modes; k++) {
      const c = y[6 + k], at = k * rest.length, basis = this.basis;
      if (Math.abs(c) < UNSEEN) continue;
      for (let i = 0; i < rest.length; i++) local[i] += c * basis[at + i];
    }
    const [a, b, c, d, e, f, g, h, i] = rotation(y[3], y[4], y[5]);
    const cos = Math.cos(this.azimuth), sin = Math.sin(this.azimuth);
    this.middle = [anchor[0] + cos * y[0] - sin * y[1], anchor[1] + sin * y[0] + cos * y[1], anchor[2] + y[2]];
    for (let n = 0; n < points.length; n += 3) {
      const x = local[n], v = local[n + 1], w = local[n + 2];
      const px = a * x + b * v + c * w + y[0], py = d * x + e * v + f * w + y[1];
      points[n] = anchor[0] + cos * px - sin * py;
      points[n + 1] = anchor[1] + sin * px + cos * py;
      points[n + 2] = anchor[2] + g * x + h * v + i * w + y[2];
    }
    this.shade();
  }

  shade() {
    const { points, normals, arrays: { faces } } = this;
    normals.fill(0);
    for (let n = 0; n < faces.length; n += 3) {
      const a = 3 * faces[n], b = 3 * faces[n + 1], c = 3 * faces[n + 2];
      const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
      const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      normals[a] += x;
      normals[a + 1] += y;
      normals[a + 2] += z;
      normals[b] += x;
      normals[b + 1] += y;
      normals[b + 2] += z;
      normals[c] += x;
      normals[c + 1] += y;
      normals[c + 2] += z;
    }
  }
}

// rows of the rotation about a vector, by its length in radians
function rotation(x, y, z) {
  const angle = Math.hypot(x, y, z), c = Math.cos(angle);
  const s = angle > 1e-9 ? Math.sin(angle) / angle : 1, t = angle > 1e-9 ? (1 - c) / (angle * angle) : 0.5;
  return [c + t * x * x, t * x * y - s * z, t * x * z + s * y, t * x * y + s * z, c + t * y * y, t * y * z - s * x,
    t * x * z - s * y, t * y * z + s * x, c + t * z * z];
}

// ---- drawing -------------------------------------------------------------------------------------------------------

const HEAD = "#version 300 es\nprecision highp float;\n";
const BODY_VERTEX = HEAD + `
in vec3 point; in vec3 normal; uniform mat4 view; out vec3 n; out vec3 p;
void main() { n = normal; p = point; gl_Position = view * vec4(point, 1.0); }`;
const BODY_PIXEL = HEAD + `
in vec3 n; in vec3 p; uniform vec3 eye, light, clay, sky, ground; uniform float floorAt, size; out vec4 color;
void main() {
  vec3 normal = normalize(n), to = normalize(eye - p);
  if (!gl_FrontFacing) normal = -normal;
  float key = clamp((dot(normal, light) + 0.35) / 1.35, 0.0, 1.0);
  vec3 fill = mix(ground, sky, 0.5 + 0.5 * normal.z);
  float near = 1.0 - 0.45 * exp(-5.0 * max(p.z - floorAt, 0.0) / size) * clamp(0.6 - normal.z, 0.0, 1.0);
  float rim = pow(1.0 - max(dot(normal, to), 0.0), 3.0) * clamp(0.5 + 0.5 * normal.z, 0.0, 1.0);
  vec3 lit = pow(clay, vec3(2.2)) * (0.85 * key * key + 0.5 * fill * near) + 0.05 * rim * sky;
  lit += 0.035 * pow(max(dot(normal, normalize(light + to)), 0.0), 20.0);
  color = vec4(pow(lit, vec3(1.0 / 2.2)), 1.0);
}`;
const SHADOW_VERTEX = HEAD + `
in vec3 point; uniform vec3 light; uniform vec2 about; uniform float floorAt, reach; out float strength;
void main() {
  float above = max(point.z - floorAt, 0.0);
  vec2 at = point.xy - light.xy / light.z * above;
  strength = exp(-1.3 * above / reach);
  gl_Position = vec4((at - about) / reach, 0.0, 1.0);
}`;
const SHADOW_PIXEL = HEAD + `in float strength; out vec4 color; void main() { color = vec4(strength); }`;
const WHOLE_VERTEX = HEAD + `
in vec2 corner; out vec2 at; void main() { at = 0.5 + 0.5 * corner; gl_Position = vec4(corner, 0.0, 1.0); }`;
const BLUR_PIXEL = HEAD + `
in vec2 at; uniform sampler2D image; uniform vec2 along; out vec4 color;
void main() {
  float sum = 0.0, total = 0.0;
  for (int i = -4; i <= 4; i++) {
    float w = exp(-float(i * i) / 8.0);
    sum += w * texture(image, at + float(i) * along).r;
    total += w;
  }
  color = vec4(sum / total);
}`;
const FLOOR_VERTEX = HEAD + `
in vec2 corner; uniform mat4 view; uniform vec2 about; uniform float floorAt, far; out vec2 p;
void main() { p = about + far * corner; gl_Position = view * vec4(p, floorAt, 1.0); }`;
const FLOOR_PIXEL = HEAD + `
in vec2 p; uniform sampler2D shadow; uniform vec2 about, center; uniform vec3 paper, line, shade;
uniform float reach, far, cell; out vec4 color;
float lines(vec2 at) {
  vec2 wide = max(fwidth(at), 1e-6), off = abs(fract(at - 0.5) - 0.5) / wide;
  return (1.0 - clamp(min(off.x, off.y), 0.0, 1.0)) * clamp(1.5 - 3.0 * max(wide.x, wide.y), 0.0, 1.0);
}
void main() {
  float fade = clamp(1.0 - length(p - about) / far, 0.0, 1.0);
  float grid = max(0.45 * lines(p / cell), lines(p / cell / 5.0)) * fade;
  vec2 at = 0.5 + 0.5 * (p - center) / reach;
  float dark = all(lessThan(abs(at - 0.5), vec2(0.5))) ? texture(shadow, at).r : 0.0;
  color = vec4(mix(mix(paper, line, grid), shade, 0.62 * dark), 1.0);
}`;

// whether there is no graphics card: smooth edges then cost more than all else
function drawnInSoftware() {
  const probe = document.createElement("canvas").getContext("webgl2");
  const told = probe?.getParameter(probe.RENDERER) ?? "";
  // Chromium tells it by an extension only, of which Firefox warns
  const info = told.startsWith("WebKit") && probe.getExtension("WEBGL_debug_renderer_info");
  const name = info ? probe.getParameter(info.UNMASKED_RENDERER_WEBGL) : told;
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

const canvas = $("canvas");
const gl = canvas.getContext("webgl2", { antialias: !drawnInSoftware(), alpha: false });
const SHADOW = 128; // pixels of a shadow, each way

function program(vertex, pixel) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, pixel]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  ["point", "normal"].forEach((name, i) => gl.bindAttribLocation(made, i, name));
  gl.bindAttribLocation(made, 2, "corner");
  gl.linkProgram(made);
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(made, i);
    uniforms[name] = gl.getUniformLocation(made, name);
  }
  return (values) => {
    gl.useProgram(made);
    for (const [name, value] of Object.entries(values)) {
      const at = uniforms[name];
      if (at === undefined) continue;
      if (typeof value === "number") gl.uniform1f(at, value);
      else gl[value.length === 16 ? "uniformMatrix4fv" : `uniform${value.length}fv`](at, ...(value.length === 16 ? [false, value] : [value]));
    }
  };
}

function target() {
  const texture = gl.createTexture(), frame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, SHADOW, SHADOW, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  return { texture, frame };
}

function buffer(data, kind = gl.ARRAY_BUFFER, use = gl.STATIC_DRAW) {
  const made = gl.createBuffer();
  gl.bindBuffer(kind, made);
  gl.bufferData(kind, data, use);
  return made;
}

class Drawing {
  constructor(columns) {
    this.body = program(BODY_VERTEX, BODY_PIXEL);
    this.cast = program(SHADOW_VERTEX, SHADOW_PIXEL);
    this.blur = program(WHOLE_VERTEX, BLUR_PIXEL);
    this.ground = program(FLOOR_VERTEX, FLOOR_PIXEL);
    this.targets = [target(), target()];
    this.corners = buffer(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    this.meshes = columns.map((column) => ({
      points: buffer(column.points, gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW),
      normals: buffer(column.normals, gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW),
      faces: buffer(column.arrays.faces, gl.ELEMENT_ARRAY_BUFFER),
      count: column.arrays.faces.length,
      kind: column.arrays.faces instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT,
    }));
  }

  mesh(mesh) {
    for (const [at, source] of [[0, mesh.points], [1, mesh.normals]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, source);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.faces);
    gl.drawElements(gl.TRIANGLES, mesh.count, mesh.kind, 0);
  }

  square() {
    gl.disableVertexAttribArray(0);
    gl.disableVertexAttribArray(1);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribPointer(2, 2, gl.FLOAT, false, 0, 0);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.disableVertexAttribArray(2);
  }

  shadow(mesh, values) {
    gl.disable(gl.DEPTH_TEST);
    gl.viewport(0, 0, SHADOW, SHADOW);
    gl.scissor(0, 0, SHADOW, SHADOW);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets[0].frame);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.MAX);
    this.cast(values);
    this.mesh(mesh);
    gl.disable(gl.BLEND);
    for (const [from, to, along] of [[0, 1, [1, 0]], [1, 0, [0, 1]]]) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets[to].frame);
      gl.bindTexture(gl.TEXTURE_2D, this.targets[from].texture);
      this.blur({ along: along.map((x) => (0.8 * x) / SHADOW) });
      this.square();
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, this.targets[0].texture);
    gl.enable(gl.DEPTH_TEST);
  }

  column(index, column, box, camera, colors) {
    const mesh = this.meshes[index], size = figure.size, reach = 2.2 * size;
    for (const [at, data] of [[mesh.points, column.points], [mesh.normals, column.normals]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, at);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, data);
    }
    const floored = figure.floor !== null, floorAt = floored ? figure.floor : camera.target[2] - 1e3;
    const light = unit([...turned([0.55, 0.5], camera.azimuth - Math.PI / 2), 1.1]);
    const height = Math.max(column.middle[2] - floorAt, 0);
    const center = [0, 1].map((i) => column.middle[i] - (light[i] / light[2]) * height);
    if (floored) this.shadow(mesh, { light, about: center, floorAt, reach });
    gl.viewport(...box);
    gl.scissor(...box);
    gl.clearColor(...colors.paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const view = camera.matrix(box[2] / box[3]), about = camera.target.slice(0, 2);
    if (floored) {
      this.ground({ ...colors, view, about, center, floorAt, reach, far: 14 * size, cell: figure.cell });
      gl.depthMask(false); // a body that dents does not flicker in the plane of the floor
      this.square();
      gl.depthMask(true);
    }
    this.body({ ...colors, view, eye: camera.eye, light, floorAt, size });
    this.mesh(mesh);
  }
}

function turned([x, y], angle) {
  return [Math.cos(angle) * x - Math.sin(angle) * y, Math.sin(angle) * x + Math.cos(angle) * y];
}

function unit(v) {
  const length = Math.hypot(...v);
  return v.map((x) => x / length);
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

class Camera {
  constructor() {
    Object.assign(this, { azimuth: figure.columns[0].azimuth - 1.15, elevation: 0.3, distance: 4.2 * figure.size, target: [0, 0, 0], pan: [0, 0, 0] });
  }

  get toward() {
    const c = Math.cos(this.elevation);
    return [c * Math.cos(this.azimuth), c * Math.sin(this.azimuth), Math.sin(this.elevation)];
  }

  get eye() {
    return this.target.map((x, i) => x + this.distance * this.toward[i]);
  }

  get axes() {
    const right = unit(cross([0, 0, 1], this.toward));
    return [right, cross(this.toward, right)];
  }

  matrix(aspect) {
    const [right, up] = this.axes, back = this.toward, eye = this.eye;
    const f = 2.6 * Math.min(1, aspect / 0.9), near = 0.02 * this.distance, far = 60 * figure.size + this.distance;
    const rows = [right.map((x) => (x * f) / aspect), up.map((x) => x * f), back];
    const z = (far + near) / (near - far), shift = (2 * far * near) / (near - far);
    const out = new Float32Array(16);
    for (let i = 0; i < 3; i++) out.set([rows[0][i], rows[1][i], z * back[i], -back[i]], 4 * i);
    out.set([-dot(rows[0], eye), -dot(rows[1], eye), -z * dot(back, eye) + shift, dot(back, eye)], 12);
    return out;
  }
}

// ---- the page ------------------------------------------------------------------------------------------------------

function number(value) {
  return Number(value.toPrecision(3)).toString();
}

function color(name) {
  const [r, g, b] = getComputedStyle(document.documentElement).getPropertyValue(name).trim().match(/\w\w/g);
  return [r, g, b].map((x) => parseInt(x, 16) / 255);
}

function main() {
  if (!gl) {
    $("message").textContent = "This figure needs a browser with WebGL 2.";
    return;
  }
  gl.enable(gl.SCISSOR_TEST);
  const columns = figure.columns.map((column) => new Column(column)), camera = new Camera();
  const drawing = new Drawing(columns), places = figure.sweeps.map((sweep) => sweep.place);
  const stop = figure.start + (figure.frames - 1) * figure.step;
  const state = { time: figure.start, playing: false, chosen: true, shown: true, last: 0, frames: 0, detail: 1, pace: 0 };
  window.figure = state; // for whoever measures it
  let colors = {};
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const themed = () => {
    colors = Object.fromEntries(["paper", "line", "shade", "clay", "sky", "ground"].map((name) => [name, color(`--${name}`)]));
    state.shown = true;
  };
  dark.addEventListener("change", themed);
  themed();

  // sliders
  const time = $("time"), play = $("play");
  const tell = () => {
    time.value = state.time;
    $("time-value").textContent = `${state.time.toFixed(3)} s`;
    play.setAttribute("aria-label", state.playing ? "Pause" : "Play");
    play.dataset.playing = state.playing;
  };
  Object.assign(time, { min: figure.start, max: stop, step: "any" });
  time.addEventListener("input", () => {
    Object.assign(state, { time: Number(time.value), playing: false, shown: true });
    tell();
  });
  const toggle = () => {
    if (!state.playing && state.time >= stop) state.time = figure.start;
    state.playing = !state.playing;
    tell();
  };
  play.addEventListener("click", toggle);
  figure.sweeps.forEach((sweep, axis) => {
    const row = $("slider").content.cloneNode(true), slider = row.querySelector("input");
    const [name, , value] = row.querySelector("label").children;
    name.textContent = sweep.name;
    const told = () => {
      const x = places[axis];
      const at = sweep.log ? sweep.low * (sweep.high / sweep.low) ** x : sweep.low + x * (sweep.high - sweep.low);
      value.textContent = `${number(at)} ${sweep.unit}`;
      const inside = at >= sweep.trained[0] * (1 - 1e-6 * Math.sign(sweep.trained[0])) && at <= sweep.trained[1] * (1 + 1e-6 * Math.sign(sweep.trained[1]));
      value.classList.toggle("outside", !inside);
      value.title = inside ? "" : `outside of what was ${figure.known}: ${number(sweep.trained[0])} to ${number(sweep.trained[1])} ${sweep.unit}`;
    };
    Object.assign(slider, { min: 0, max: 1, step: "any", value: places[axis] });
    slider.setAttribute("aria-label", sweep.name);
    slider.addEventListener("input", () => {
      places[axis] = Number(slider.value);
      Object.assign(state, { chosen: true, shown: true });
      told();
    });
    told();
    $("sliders").append(row);
  });
  // a truth is known at one place of the sliders
  const compared = columns.filter((column) => column.truth), truth = $("truth");
  const tellTruth = () => {
    const frame = Math.round((state.time - figure.start) / figure.step);
    const known = compared.filter(({ axes, truth: { places: at } }) => at.every((x, k) => Math.abs(x - places[axes[k]]) < 1e-3));
    const said = known.map(({ label, truth: { rms_mm: errors } }) =>
      `${columns.length > 1 ? `${label}: ` : ""}${errors[frame] === null ? "no truth at this time" : `${errors[frame].toFixed(2)} mm from the truth (RMS)`}`);
    truth.lastChild.textContent = said.join(", ");
    truth.firstChild.hidden = known.length > 0;
  };
  truth.hidden = !compared.length;
  truth.firstChild.addEventListener("click", () => {
    compared.forEach(({ axes, truth: { places: at } }) => at.forEach((x, k) => {
      const slider = $("sliders").children[axes[k]].querySelector("input");
      slider.value = x;
      slider.dispatchEvent(new Event("input"));
    }));
  });
  columns.forEach((column) => {
    const label = document.createElement("div");
    label.textContent = columns.length > 1 ? column.label : "";
    $("labels").append(label);
  });

  // camera
  const held = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => held.delete(event.pointerId));
  const zoom = (by) => {
    camera.distance = Math.min(Math.max(camera.distance * by, 1.2 * figure.size), 40 * figure.size);
    state.shown = true;
  };
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    if (held.size === 2) {
      const other = [...held].find(([id]) => id !== event.pointerId)[1];
      zoom(Math.hypot(before[0] - other[0], before[1] - other[1]) / Math.max(Math.hypot(event.clientX - other[0], event.clientY - other[1]), 1));
    } else if (event.buttons === 2 || event.shiftKey) {
      const [right, up] = camera.axes, by = camera.distance / canvas.clientHeight / 1.3;
      camera.pan = camera.pan.map((x, i) => x - by * (dx * right[i] - dy * up[i]));
    } else {
      camera.azimuth -= 0.008 * dx;
      camera.elevation = Math.min(Math.max(camera.elevation + 0.008 * dy, 0.02), 1.55);
    }
    held.set(event.pointerId, [event.clientX, event.clientY]);
    state.shown = true;
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(0.0012 * event.deltaY));
  }, { passive: false });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => {
    Object.assign(camera, new Camera());
    state.shown = true;
  });
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target === play) return;
    event.preventDefault();
    toggle();
  });
  new ResizeObserver(() => (state.shown = true)).observe(canvas);

  const boxes = (width, height) => {
    // side by side, or one below the other where that leaves more room
    const count = columns.length, across = width >= height * 0.9 ? count : Math.ceil(count / Math.ceil(count / 2 + 0.5));
    const rows = Math.ceil(count / across), w = Math.floor(width / across), h = Math.floor(height / rows);
    return columns.map((_, i) => [(i % across) * w, height - (Math.floor(i / across) + 1) * h, w, h]);
  };

  const draw = (now) => {
    const passed = Math.min((now - state.last) / 1e3, 0.1);
    state.last = now;
    // where pixels are slow, as without a graphics card, there are fewer of them
    state.pace = state.playing ? 0.8 * state.pace + 0.2 * passed : 0;
    if (state.pace > SLOW && state.detail > COARSEST) Object.assign(state, { detail: 0.8 * state.detail, pace: 0 });
    if (state.playing) {
      state.time += passed * Number($("speed").value);
      if (state.time > stop) state.time = figure.start;
      state.shown = true;
      tell();
    }
    if (state.shown) {
      const ratio = Math.min(window.devicePixelRatio || 1, 2) * state.detail;
      const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      if (state.chosen) columns.forEach((column) => column.choose(places));
      state.chosen = false;
      const all = boxes(width, height);
      if (String(all) !== state.placed) {
        state.placed = String(all);
        all.forEach(([x, y, w, h], i) => {
          for (const [side, at] of Object.entries({ left: x, width: w, bottom: y }))
            $("labels").children[i].style[side] = `${at / ratio}px`;
        });
      }
      gl.viewport(0, 0, width, height);
      gl.scissor(0, 0, width, height);
      gl.clearColor(...colors.paper, 1);
      gl.clear(gl.COLOR_BUFFER_BIT); // beside the columns as well
      columns.forEach((column, i) => {
        column.move(state.time);
        const lift = column.middle[2] - figure.low; // followed for the most part: that it flies is to be seen
        camera.target = [column.middle[0], column.middle[1], figure.low + 0.85 * lift].map((x, d) => x + camera.pan[d]);
        drawing.column(i, column, all[i], camera, colors);
      });
      if (compared.length) tellTruth();
      state.shown = false;
      state.frames += 1;
    }
    requestAnimationFrame(draw);
  };
  tell();
  requestAnimationFrame(draw);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches && location.hash !== "#paused") toggle();
}

main();
})();
