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

