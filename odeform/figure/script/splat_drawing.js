// kinds of textures: format inside, format and type of the data, channels
const FLOATS = gl && [gl.RGBA32F, gl.RGBA, gl.FLOAT, 4], THREE = gl && [gl.RGB32F, gl.RGB, gl.FLOAT, 3];
const SHARES = gl && [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, 4], SIGNED = gl && [gl.RGBA8I, gl.RGBA_INTEGER, gl.BYTE, 4];
const NUMBERS = gl && [gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, 4], NUMBER = gl && [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, 1];
const BITS = gl && [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4];

// numbers in a texture of rows of `ROW` texels, with as many channels as `format` has
class DataTexture {
  constructor([internal, format, kind, channels], data) {
    Object.assign(this, { format, kind, channels, rows: Math.max(Math.ceil(data.length / channels / ROW), 1) });
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    this.whole = new data.constructor(ROW * this.rows * channels);
    this.whole.set(data);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, ROW, this.rows, 0, format, kind, this.whole);
  }

  // the first numbers anew
  fill(data) {
    const rows = Math.ceil(data.length / this.channels / ROW);
    this.whole.set(data);
    this.bind(1); // a shadow is at place 0
    gl.activeTexture(gl.TEXTURE1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, rows, this.format, this.kind, this.whole);
    gl.activeTexture(gl.TEXTURE0);
  }

  bind(place) {
    gl.activeTexture(gl.TEXTURE0 + place);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.activeTexture(gl.TEXTURE0);
  }
}

function joined(kind, ...parts) {
  const out = new kind(parts.reduce((sum, part) => sum + part.length, 0));
  parts.reduce((at, part) => (out.set(part, at), at + part.length), 0);
  return out;
}

// harmonics of both parts with as many coefficients, and a channel that is not used
function evenHarmonics({ moving, still }) {
  const most = Math.max(moving.steps.length, still.steps.length);
  const out = new Int8Array(4 * most * (moving.count + still.count));
  for (const [part, first] of [[moving, 0], [still, moving.count]])
    for (let i = 0; i < part.count; i++)
      for (let h = 0; h < part.steps.length; h++)
        for (let c = 0; c < 3; c++) out[4 * ((first + i) * most + h) + c] = part.harmonics[(i * part.steps.length + h) * 3 + c];
  return out;
}

// how much of each node's deformation a splat has: all of that where it is, and less of the others
function blends({ column: { arrays: { near, rest } }, moving, carriers }) {
  const nodes = new Uint16Array(CARRIERS * moving.count), shares = new Uint8Array(CARRIERS * moving.count);
  for (let i = 0; i < moving.count; i++) {
    const away = [];
    for (let k = 0; k < carriers; k++) {
      const n = 3 * near[i * carriers + k];
      away.push(Math.hypot(...[0, 1, 2].map((d) => moving.places[3 * i + d] - rest[n + d])));
    }
    const far = 1.05 * Math.max(...away) + 1e-9, by = away.map((x) => (1 - x / far) ** 2);
    const sum = by.reduce((a, b) => a + b);
    by.forEach((share, k) => {
      nodes[CARRIERS * i + k] = near[i * carriers + k];
      shares[CARRIERS * i + k] = Math.round((255 * share) / sum);
    });
  }
  return [nodes, shares];
}

class SplatDrawing {
  constructor(splats) {
    const { moving, still, count } = splats, [nodes, shares] = blends(splats), harmonics = evenHarmonics(splats);
    const coefficients = Math.max(moving.steps.length, still.steps.length);
    this.splats = splats;
    const steps = new Float32Array(30);
    steps.set(moving.steps);
    steps.set(still.steps, 15);
    this.values = { coefficients, count, moving: moving.count, steps };
    this.textures = {
      shapes: new DataTexture(FLOATS, joined(Float32Array, moving.shapes, still.shapes)),
      colors: new DataTexture(SHARES, joined(Uint8Array, moving.colors, still.colors)),
      harmonics: new DataTexture(SIGNED, harmonics),
      near: new DataTexture(NUMBERS, nodes),
      shares: new DataTexture(SHARES, shares),
      nodes: new DataTexture(FLOATS, splats.nodes),
      places: new DataTexture(THREE, splats.places),
    };
    this.order = new DataTexture(NUMBER, splats.order);
    this.seen = { place: new DataTexture(BITS, new Uint32Array(4 * count)), across: new DataTexture(BITS, new Uint32Array(4 * count)) };
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    const outputs = [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1];
    Object.values(this.seen).forEach(({ texture }, i) => gl.framebufferTexture2D(gl.FRAMEBUFFER, outputs[i], gl.TEXTURE_2D, texture, 0));
    gl.drawBuffers(outputs);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  // uniforms of textures that are bound from place 1 on: a shadow is at place 0
  bound(textures) {
    return Object.fromEntries(Object.entries(textures).map(([name, texture], i) => (texture.bind(i + 1), [name, i + 1])));
  }

  // each is projected once, and drawn from back to front; `values` are what `SPLAT_PROJECTED` needs of the view
  draw(drawing, box, values) {
    const { splats, textures, seen, order } = this;
    if (this.moves !== splats.column.moves) {
      this.moves = splats.column.moves;
      textures.nodes.fill(splats.nodes);
      textures.places.fill(splats.places.subarray(0, 3 * splats.moving.count));
    }
    const count = splats.sort(values.view);
    order.fill(splats.order.subarray(0, count));
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, ROW, textures.colors.rows);
    gl.scissor(0, 0, ROW, textures.colors.rows);
    drawing.project({ ...values, ...this.values, ...this.bound(textures) });
    drawing.square();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(...box);
    gl.scissor(...box);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    drawing.paint(this.bound({ order, ...seen }));
    gl.drawArrays(gl.TRIANGLES, 0, 3 * count);
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
  }
}

