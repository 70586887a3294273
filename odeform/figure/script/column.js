class Column {
  constructor(data) {
    Object.assign(this, data);
    this.arrays = Object.fromEntries(Object.entries(data.arrays).map(([name, array]) => [name, decode(array)]));
    const { basis, steps, rest, faces, corners } = this.arrays;
    this.modes = steps.length;
    this.size = 6 + this.modes;
    this.basis = Float32Array.from(basis, (value, i) => value * steps[Math.floor(i / rest.length)]);
    this.y = new Float64Array(this.size);
    this.local = new Float32Array(rest.length);
    this.points = new Float32Array(rest.length);
    this.normals = new Float32Array(rest.length);
    // vertices of several colours are drawn once for each of them
    this.faces = corners ? faces.map((i) => corners[i]) : faces;
    this.drawn = corners ? [0, 1].map(() => new Float32Array(3 * corners.length)) : [this.points, this.normals];
    this.splats = this.arrays.near ? new MovedSplats(this) : null;
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
    this.time = time;
    this.moves = (this.moves ?? 0) + 1; // so that what is drawn follows
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
    const turn = this.turned(rotation(y[3], y[4], y[5])), shift = this.turned([y[0], y[1], y[2]], 1);
    this.turn = turn;
    this.middle = shift.map((x, d) => anchor[d] + x);
    this.place(local, points);
    if (this.splats) this.splats.move(local);
    else this.shade();
  }

  // rows of a matrix of so many columns, turned by the azimuth
  turned(rows, columns = 3) {
    const cos = Math.cos(this.azimuth), sin = Math.sin(this.azimuth), out = [...rows];
    for (let j = 0; j < columns; j++) {
      out[j] = cos * rows[j] - sin * rows[columns + j];
      out[columns + j] = sin * rows[j] + cos * rows[columns + j];
    }
    return out;
  }

  // points of the body's own axes, where the pose takes them
  place(from, to) {
    const [a, b, c, d, e, f, g, h, i] = this.turn, [x0, y0, z0] = this.middle;
    for (let n = 0; n < from.length; n += 3) {
      const x = from[n], y = from[n + 1], z = from[n + 2];
      to[n] = x0 + a * x + b * y + c * z;
      to[n + 1] = y0 + d * x + e * y + f * z;
      to[n + 2] = z0 + g * x + h * y + i * z;
    }
  }

  shade() {
    const { points, normals, faces, arrays: { corners } } = this;
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
    if (!corners) return;
    [points, normals].forEach((from, k) => {
      const to = this.drawn[k];
      for (let n = 0; n < corners.length; n++) {
        const i = 3 * corners[n];
        to[3 * n] = from[i];
        to[3 * n + 1] = from[i + 1];
        to[3 * n + 2] = from[i + 2];
      }
    });
  }
}

