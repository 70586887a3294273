const BUCKETS = 1 << 16; // of depth
const CARRIERS = 4;

// centres (3), six numbers of a covariance and two of the colours, colours and harmonics of packed splats
function unpacked(arrays, kind) {
  const { centers, sizes, turns, colors, harmonics, low, steps, harmonic_steps } = Object.fromEntries(
    ["centers", "sizes", "turns", "colors", "harmonics", "low", "steps", "harmonic_steps"].map((name) => [name, arrays[`${kind}_${name}`]]));
  const count = centers ? centers.length / 3 : 0, places = new Float32Array(3 * count), shapes = new Float32Array(8 * count);
  for (let i = 0; i < count; i++) {
    for (let k = 0; k < 3; k++) places[3 * i + k] = low[k] + steps[k] * centers[3 * i + k];
    const variances = [0, 1, 2].map((k) => Math.exp(2 * (low[3] + steps[3] * sizes[3 * i + k])));
    const r = quaternionRows(turns[4 * i], turns[4 * i + 1], turns[4 * i + 2], turns[4 * i + 3]);
    let at = 8 * i;
    for (let a = 0; a < 3; a++)
      for (let b = a; b < 3; b++)
        shapes[at++] = r[3 * a] * r[3 * b] * variances[0] + r[3 * a + 1] * r[3 * b + 1] * variances[1] + r[3 * a + 2] * r[3 * b + 2] * variances[2];
    shapes[at++] = low[4];
    shapes[at] = 255 * steps[4];
  }
  return { count, places, shapes, colors: colors ?? [], harmonics: harmonics ?? [], steps: harmonic_steps ?? [] };
}

function quaternionRows(w, x, y, z) {
  const s = 2 / (w * w + x * x + y * y + z * z);
  return [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), s * (x * y + w * z), 1 - s * (x * x + z * z),
    s * (y * z - w * x), s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)];
}

// the quaternion, w last, of the rotation nearest to a matrix by rows that turns by less than half a turn
function nearestRotation(matrix) {
  let m = matrix;
  for (let round = 0; round < 5; round++) {
    const rows = [m.slice(0, 3), m.slice(3, 6), m.slice(6, 9)];
    const adjoint = [cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])].flat();
    const volume = dot(rows[0], adjoint);
    m = m.map((value, i) => 0.5 * (value + adjoint[i] / volume));
  }
  const q = [m[7] - m[5], m[2] - m[6], m[3] - m[1], 1 + m[0] + m[4] + m[8]], length = Math.hypot(...q);
  return q.map((x) => x / length);
}

// The splats of a column: those of the body first, which nodes carry, then those that stand still. As in binding.py.
class MovedSplats {
  constructor(column) {
    const { arrays } = column, { near, near_weights, around, around_weights, bound_steps, rest } = arrays;
    this.column = column;
    this.moving = unpacked(arrays, "moving");
    this.still = unpacked(arrays, "still");
    this.count = this.moving.count + this.still.count;
    this.carriers = near.length / this.moving.count;
    this.weights = Float32Array.from(near_weights, (value) => value * bound_steps[0]);
    this.around = around.length / (rest.length / 3);
    this.slopes = Float32Array.from(around_weights, (value) => value * bound_steps[1]);
    this.followed = this.slopes.length / around.length; // axes at a node that follow those around it
    this.nodes = new Float32Array((16 * rest.length) / 3);
    this.local = new Float32Array(3 * this.moving.count);
    this.moved = new Float32Array(rest.length);
    this.places = new Float32Array(3 * this.count);
    this.places.set(this.still.places, 3 * this.moving.count);
    this.order = new Uint32Array(this.count);
    this.buckets = new Uint32Array(BUCKETS);
    this.bucket = new Uint16Array(this.count);
    this.depth = new Float32Array(this.count);
  }

  move(nodes) {
    const { moved, local, moving, carriers, weights, column: { arrays: { rest, near } } } = this;
    for (let i = 0; i < rest.length; i++) moved[i] = nodes[i] - rest[i];
    local.set(moving.places);
    for (let i = 0, at = 0; i < local.length; i += 3)
      for (let k = 0; k < carriers; k++, at++) {
        const w = weights[at], n = 3 * near[at];
        local[i] += w * moved[n];
        local[i + 1] += w * moved[n + 1];
        local[i + 2] += w * moved[n + 2];
      }
    this.column.place(local, this.places);
    this.deform();
  }

  // gradients F of the deformation at the nodes, and the rotations nearest to them
  deform() {
    const { moved, nodes, slopes, followed, around: each, column: { arrays: { around, around_axes: axes } } } = this;
    for (let n = 0; n < nodes.length / 16; n++) {
      const f = [0, 1, 2].map((a) => [0, 1, 2].map((i) => axes[9 * n + 3 * a + i]));
      for (let a = 0; a < followed; a++)
        for (let k = 0; k < each; k++) {
          const w = slopes[(n * followed + a) * each + k], from = 3 * around[n * each + k];
          for (let i = 0; i < 3; i++) f[a][i] += w * moved[from + i];
        }
      if (followed === 2) f[2] = unit(cross(f[0], f[1])); // the thickness is kept
      const gradient = new Array(9).fill(0);
      for (let a = 0; a < 3; a++)
        for (let i = 0; i < 3; i++)
          for (let j = 0; j < 3; j++) gradient[3 * i + j] += f[a][i] * axes[9 * n + 3 * a + j];
      const q = nearestRotation(gradient);
      for (let k = 0; k < 4; k++) {
        for (let i = 0; i < 3; i++) nodes[16 * n + 4 * k + i] = k < 3 ? gradient[3 * i + k] : 0;
        nodes[16 * n + 4 * k + 3] = q[k];
      }
    }
  }

  // numbers of those that may be seen, from back to front, by a counting sort; returns how many
  sort(view) {
    const { places, count, buckets, bucket, order, depth } = this;
    let low = Infinity, high = -Infinity;
    for (let i = 0, at = 0; i < count; i++, at += 3) {
      const x = places[at], y = places[at + 1], z = places[at + 2];
      const w = view[3] * x + view[7] * y + view[11] * z + view[15], edge = BEYOND * w;
      const inside = w > 0 && Math.abs(view[0] * x + view[4] * y + view[8] * z + view[12]) < edge
        && Math.abs(view[1] * x + view[5] * y + view[9] * z + view[13]) < edge;
      depth[i] = inside ? w : -1;
      if (!inside) continue;
      if (w < low) low = w;
      if (w > high) high = w;
    }
    const scale = (BUCKETS - 1) / Math.max(high - low, 1e-9);
    buckets.fill(0);
    for (let i = 0; i < count; i++) {
      if (depth[i] < 0) continue;
      bucket[i] = (high - depth[i]) * scale;
      buckets[bucket[i]]++;
    }
    let seen = 0;
    for (let b = 0; b < BUCKETS; b++) {
      const here = buckets[b];
      buckets[b] = seen;
      seen += here;
    }
    for (let i = 0; i < count; i++) if (depth[i] >= 0) order[buckets[bucket[i]]++] = i;
    return seen;
  }
}

