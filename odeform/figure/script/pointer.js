// drag to turn, with Shift or two buttons to move, the wheel or two fingers to zoom
function pointerControls(state, camera) {
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
  new ResizeObserver(() => (state.shown = true)).observe(canvas);
}

