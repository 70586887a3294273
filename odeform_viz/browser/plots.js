// A click on a curve, or a drag along it, goes to that time: it is typed into the box beside the time slider.
function seek(event) {
  const plot = event.target.closest?.("svg[data-time-slider]");
  if (!plot || !(event.buttons & 1)) return;
  const { start, stop, left, right, timeSlider } = plot.dataset;
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
  const share = Math.min(Math.max((point.x - Number(left)) / (Number(right) - Number(left)), 0), 1);
  const time = Number(start) + share * (Number(stop) - Number(start));
  const box = document.getElementById(timeSlider)?.closest(".mantine-Flex-root")?.querySelector("input[type=text], input:not([type])");
  if (box) window.odeform.setNumber(box, time.toFixed(4));
  event.preventDefault();
}

document.addEventListener("pointerdown", seek);
document.addEventListener("pointermove", seek);

// what is drawn as a button presses a hot key; it does not bubble, as the camera would take it for a key that is held
document.addEventListener("click", (event) => {
  const key = event.target.closest?.("[data-hotkey]")?.dataset.hotkey;
  if (!key) return;
  const pressed = new KeyboardEvent("keydown", { key: key.toLowerCase(), code: `Key${key}`, bubbles: false });
  document.documentElement.dispatchEvent(pressed);
});
