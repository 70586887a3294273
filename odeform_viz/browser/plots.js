// A drag along a curve or the timeline goes to that time: it is typed into the box beside the time slider.
let dragged = null; // the place that the mouse was pressed on, and the times at its ends

function placeOf(target) {
  const place = target.closest?.("[data-time-slider]");
  if (!place) return null;
  const { start, stop, left, right, timeSlider } = place.dataset;
  const box = place.getBoundingClientRect();
  // an SVG names the ends of what is drawn on in its own units
  const unit = left === undefined ? 0 : box.width / place.viewBox.baseVal.width;
  const from = box.left + unit * Number(left ?? 0);
  const to = left === undefined ? box.right : box.left + unit * Number(right);
  return { from, to, start: Number(start), stop: Number(stop), timeSlider };
}

function seek(event) {
  if (!(event.buttons & 1)) dragged = null;
  if (!dragged) return;
  const share = Math.min(Math.max((event.clientX - dragged.from) / (dragged.to - dragged.from), 0), 1);
  const time = dragged.start + share * (dragged.stop - dragged.start);
  const row = document.getElementById(dragged.timeSlider)?.closest(".mantine-Flex-root");
  const box = row?.querySelector("input[type=text], input:not([type])");
  if (box) window.odeform.setNumber(box, time.toFixed(4));
  event.preventDefault();
}

document.addEventListener("pointerdown", (event) => {
  dragged = placeOf(event.target);
  seek(event);
});
document.addEventListener("pointermove", seek);
document.addEventListener("pointerup", () => (dragged = null));

// a click on a map writes its place into a text box, which the server reads
document.addEventListener("click", (event) => {
  const map = event.target.closest?.("[data-map]");
  const box = map && window.odeform.boxAfter(map)?.querySelector("input");
  if (!box) return;
  const area = map.getBoundingClientRect();
  const across = (event.clientX - area.left) / area.width, up = 1 - (event.clientY - area.top) / area.height;
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  set.call(box, `${across.toFixed(4)},${up.toFixed(4)},${map.dataset.map}`);
  box.dispatchEvent(new Event("input", { bubbles: true }));
});

// what is drawn as a button presses a hot key; it does not bubble, as the camera would take it for a key that is held
document.addEventListener("click", (event) => {
  const key = event.target.closest?.("[data-hotkey]")?.dataset.hotkey;
  if (!key) return;
  const code = /\d/.test(key) ? `Digit${key}` : `Key${key}`;
  const pressed = new KeyboardEvent("keydown", { key: key.toLowerCase(), code, bubbles: false });
  document.documentElement.dispatchEvent(pressed);
});
