// side by side, or one below the other where that leaves more room: left, bottom, width and height in pixels
function boxes(count, width, height) {
  const across = width >= height * 0.9 ? count : Math.ceil(count / Math.ceil(count / 2 + 0.5));
  const rows = Math.ceil(count / across), w = Math.floor(width / across), h = Math.floor(height / rows);
  return Array.from({ length: count }, (_, i) => [(i % across) * w, height - (Math.floor(i / across) + 1) * h, w, h]);
}

function placeLabels(all, ratio) {
  all.forEach(([x, y, w], i) => {
    for (const [side, at] of Object.entries({ left: x, width: w, bottom: y }))
      $("labels").children[i].style[side] = `${at / ratio}px`;
  });
}

// colours of the theme, by name; they follow the system
function themed(state) {
  const colors = {}, dark = matchMedia("(prefers-color-scheme: dark)");
  const read = () => {
    for (const name of ["paper", "line", "shade", "clay", "sky", "ground"]) colors[name] = color(`--${name}`);
    state.shown = true;
  };
  dark.addEventListener("change", read);
  read();
  return colors;
}

// the picture of the present moment
function drawAll(state, { columns, camera, drawing, places, colors }, detail) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2) * detail;
  const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const all = boxes(columns.length, width, height);
  if (String(all) !== state.placed) {
    state.placed = String(all);
    placeLabels(all, ratio);
  }
  gl.viewport(0, 0, width, height);
  gl.scissor(0, 0, width, height);
  gl.clearColor(...colors.paper, 1);
  gl.clear(gl.COLOR_BUFFER_BIT); // beside the columns as well
  columns.forEach((column, i) => {
    if (state.chosen) column.choose(places);
    if (state.chosen || column.time !== state.time) column.move(state.time);
    const lift = column.middle[2] - figure.low; // followed for the most part: that it flies is to be seen
    camera.target = [column.middle[0], column.middle[1], figure.low + 0.85 * lift].map((x, d) => x + camera.pan[d]);
    drawing.column(i, column, all[i], camera, colors);
  });
  Object.assign(state, { chosen: false, shown: false, frames: state.frames + 1 });
}

function main() {
  if (!gl) {
    $("message").textContent = "This figure needs a browser with WebGL 2.";
    return;
  }
  gl.enable(gl.SCISSOR_TEST);
  const columns = figure.columns.map((column) => new Column(column)), camera = new Camera();
  const places = figure.sweeps.map((sweep) => sweep.place), stop = figure.start + (figure.frames - 1) * figure.step;
  const state = { time: figure.start, playing: false, chosen: true, shown: true, last: 0, frames: 0, detail: 1, pace: 0, sharp: true, columns, camera };
  window.figure = state; // for whoever measures it
  const scene = { columns, camera, drawing: new Drawing(columns), places, colors: themed(state) };
  const coarsest = columns.some(({ splats }) => splats) ? COARSEST_SPLATS : COARSEST;
  const { tell, toggle } = timeControls(state, stop);
  sliderControls(state, places);
  const tellTruth = truthControls(state, places, columns);
  columnLabels(columns);
  pointerControls(state, camera);
  const draw = (now) => {
    const passed = Math.min((now - state.last) / 1e3, 0.1);
    state.last = now;
    if (state.playing) {
      state.time += passed * Number($("speed").value);
      if (state.time > stop) state.time = figure.start;
      state.shown = true;
      tell();
    }
    if (state.shown) {
      // where pixels are slow, as without a graphics card, there are fewer of them while something moves
      state.pace = state.moving ? 0.8 * state.pace + 0.2 * passed : 0;
      if (state.pace > SLOW && state.detail > coarsest) Object.assign(state, { detail: 0.8 * state.detail, pace: 0 });
      drawAll(state, scene, state.detail);
      tellTruth();
      Object.assign(state, { moving: true, sharp: state.detail === 1, drawn: now });
    } else {
      state.moving = false;
      if (!state.sharp && now - state.drawn > STILL) {
        drawAll(state, scene, 1);
        state.sharp = true;
      }
    }
    requestAnimationFrame(draw);
  };
  tell();
  requestAnimationFrame(draw);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches && location.hash !== "#paused") toggle();
}

main();
})();
