const CUBES = 6;

class Drawing {
  constructor(columns) {
    this.body = program(BODY_VERTEX, BODY_PIXEL);
    this.cast = program(SHADOW_VERTEX, SHADOW_PIXEL);
    this.blur = program(WHOLE_VERTEX, BLUR_PIXEL);
    this.ground = program(FLOOR_VERTEX, FLOOR_PIXEL);
    this.targets = [target(), target()];
    this.corners = buffer(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    this.meshes = columns.map((column) => (column.splats ? this.nodes(column) : this.surface(column)));
    if (!columns.some(({ splats }) => splats)) return;
    this.project = program(WHOLE_VERTEX, SPLAT_PROJECTED);
    this.paint = program(SPLAT_CORNER, SPLAT_PIXEL);
  }

  surface({ drawn, arrays }) {
    const { rest, faces, colors } = arrays, at = arrays.corners;
    return {
      points: buffer(drawn[0], gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW),
      normals: buffer(drawn[1], gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW),
      rest: buffer(at ? Float32Array.from(drawn[0], (_, i) => rest[3 * at[Math.floor(i / 3)] + (i % 3)]) : rest),
      colors: colors && buffer(colors),
      faces: buffer(faces, gl.ELEMENT_ARRAY_BUFFER),
      count: faces.length,
      kind: faces instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT,
      checks: checks(rest),
    };
  }

  // splats cast the shadow of the nodes that carry them
  nodes({ points, splats }) {
    return { points: buffer(points, gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW), dots: points.length / 3, splats: new SplatDrawing(splats) };
  }

  mesh(mesh) {
    for (const [name, source] of [["point", mesh.points], ["normal", mesh.normals], ["rest", mesh.rest]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, source);
      attribute(name, 3);
    }
    if (mesh.colors) {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.colors);
      attribute("own", 3, gl.UNSIGNED_BYTE);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.faces);
    gl.drawElements(gl.TRIANGLES, mesh.count, mesh.kind, 0);
    ["point", "normal", "rest", "own"].forEach(unused);
  }

  dots(mesh) {
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.points);
    attribute("point", 3);
    gl.drawArrays(gl.POINTS, 0, mesh.dots);
    unused("point");
  }

  square() {
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    attribute("corner", 2);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    unused("corner");
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
    if (mesh.splats) this.dots(mesh);
    else this.mesh(mesh);
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
    const data = mesh.splats ? [[mesh.points, column.points]] : [[mesh.points, column.drawn[0]], [mesh.normals, column.drawn[1]]];
    for (const [at, values] of data) {
      gl.bindBuffer(gl.ARRAY_BUFFER, at);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, values);
    }
    const floored = figure.floor !== null, floorAt = floored ? figure.floor : camera.target[2] - 1e3;
    const light = unit([...turned([0.55, 0.5], camera.azimuth - Math.PI / 2), 1.1]);
    const height = Math.max(column.middle[2] - floorAt, 0);
    const center = [0, 1].map((i) => column.middle[i] - (light[i] / light[2]) * height);
    // twice as wide as nodes are apart on a sphere of the body's size
    const wide = (SHADOW / reach) * size * Math.sqrt(Math.PI / Math.max(mesh.dots ?? 1, 1));
    if (floored) this.shadow(mesh, { light, about: center, floorAt, reach, wide });
    gl.viewport(...box);
    gl.scissor(...box);
    gl.clearColor(...colors.paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const view = camera.matrix(box[2] / box[3]), about = camera.target.slice(0, 2);
    const room = column.splats?.still.count > 0; // which has a floor of its own
    if (floored && !room) {
      this.ground({ ...colors, view, about, center, floorAt, reach, far: 14 * size, cell: figure.cell });
      gl.depthMask(false); // a body that dents does not flicker in the plane of the floor
      this.square();
      gl.depthMask(true);
    }
    if (mesh.splats) {
      const pixels = [0.5 * box[2], 0.5 * box[3]], eye = camera.eye, turn = column.turn;
      const values = { view, turn, eye, pixels, center, floorAt: floored ? floorAt : -1e9, reach, size };
      mesh.splats.draw(this, box, values);
      return;
    }
    this.body({ ...colors, view, eye: camera.eye, light, floorAt, size, ...mesh.checks, painted: Number(Boolean(mesh.colors)) });
    this.mesh(mesh);
  }
}

// the checkerboard of a body without colours of its own: cubes about its middle, that many along its longest side
function checks(rest) {
  const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
  rest.forEach((x, i) => {
    low[i % 3] = Math.min(low[i % 3], x);
    high[i % 3] = Math.max(high[i % 3], x);
  });
  return { origin: low.map((x, d) => 0.5 * (x + high[d])), cube: Math.max(...high.map((x, d) => x - low[d])) / CUBES };
}

