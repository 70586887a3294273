// Keys belong to whatever has the focus; only keys that nothing else uses are hot keys.
//
// viser's hot keys listen on the root element, and its camera on the document, so a listener on the body decides who
// gets a key. After a click the mouse's target loses the focus: Space then plays instead of clicking again, and a letter
// is a hot key instead of a search in a dropdown.
const TYPED = "input:not([type=checkbox]), textarea, select, [contenteditable=true]";
const SLIDER_KEYS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];
const CLICK_KEYS = [" ", "Enter"];
const CONTROLS = "button, input[type=checkbox], [role=tab]";

document.body.addEventListener("keydown", (event) => {
  const on = (selector) => event.target === document.activeElement && event.target.closest(selector) !== null;
  const used =
    on(TYPED) ||
    (on("[role=slider], [role=tab]") && SLIDER_KEYS.includes(event.key)) ||
    (on("button, a, input, [role=button], [role=tab]") && CLICK_KEYS.includes(event.key));
  if (used) event.stopPropagation();
});

// the camera turns with the arrows as well; they step through frames here
document.documentElement.addEventListener("keydown", (event) => {
  if (event.key === "ArrowLeft" || event.key === "ArrowRight") event.stopPropagation();
});

// a control that the mouse has pressed does not take Space or Enter, also before it loses the focus: a page that is busy
// lets go late, and the browser counts a key of any kind as the keyboard's focus (:focus-visible) until then
let pressed = null;
document.addEventListener("pointerdown", (event) => {
  pressed = event.target.closest(CONTROLS);
}, true);
document.addEventListener("keydown", (event) => {
  if (event.key === "Tab") pressed = null;
  const control = event.target.closest(CONTROLS);
  if (control && control === pressed && CLICK_KEYS.includes(event.key)) control.blur();
}, true);

const release = () => setTimeout(() => document.activeElement && document.activeElement.blur(), 0);

document.addEventListener("click", (event) => {
  const byMouse = event.detail > 0;
  if (byMouse && event.target.closest(`${CONTROLS}, label, [role=option]`)) release();
});

document.addEventListener("keydown", (event) => {
  if (event.key === "Enter" && event.target.matches("input[aria-haspopup=listbox]")) release();
}, true);
