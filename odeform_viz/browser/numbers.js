// A number is read when it is complete: on Enter, or when its box loses the focus.
//
// viser reads each key: it drops a comma, so that 0,75 becomes 75, leaves an emptied box blank, and moves values into the
// range without a word. Here the box keeps what is typed, and what is no number, or out of range, is refused in words.
const BOX = ".mantine-NumberInput-input";
const { get: read, set: write } = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
const confirmed = new WeakMap(); // the value of a box before it was edited, and its property `value`
const selecting = new WeakMap(); // the property `value` of the box that has the focus
const relayed = new WeakSet(); // events that viser is to see

function limitsOf(box) {
  const row = box.closest(".mantine-Flex-root");
  const known = [...(row?.querySelectorAll(BOX) ?? [])].map((one) => window.odeform.limits?.[one.id]).find(Boolean);
  if (known) return known;
  const slider = row?.querySelector("[role=slider]");
  return slider ? [Number(slider.ariaValueMin), Number(slider.ariaValueMax)] : [-Infinity, Infinity];
}

function nameOf(box) {
  const row = box.closest(".mantine-Flex-root:has(label)");
  return row ? row.querySelector("label").textContent : "number";
}

// Why `text` cannot be the value of a box; empty if it can.
function objection(box, text) {
  const [low, high] = limitsOf(box);
  const range = Number.isFinite(low) ? `a number from ${low} to ${high}` : "a number";
  if (text === "") return `expected ${range}`;
  const pointed = text.replace(",", ".");
  if (text !== pointed && Number.isFinite(Number(pointed))) return `expected ${range}, got ${text}; write ${pointed}`;
  const value = Number(text);
  return Number.isFinite(value) && low <= value && value <= high ? "" : `expected ${range}, got ${text}`;
}

// Without an exponent, whose letter viser drops.
const plain = (value) => value.toFixed(10).replace(/\.?0+$/, "");

function set(box, text) {
  const event = new Event("input", { bubbles: true });
  relayed.add(event);
  write.call(box, text);
  box.dispatchEvent(event);
}

function refuse(box, message) {
  document.getElementById("odeform-refusal")?.remove();
  const note = document.createElement("div");
  note.id = "odeform-refusal";
  note.setAttribute("role", "alert");
  note.textContent = `${nameOf(box)}: ${message}`;
  const at = box.getBoundingClientRect();
  note.style.cssText =
    `position:fixed;top:${at.bottom + 6}px;right:${Math.max(innerWidth - at.right, 8)}px;z-index:2000;max-width:17rem;` +
    "padding:0.5em 0.8em;border-radius:4px;background:#b3260c;color:#fff;font:13px/1.35 sans-serif;" +
    "box-shadow:0 2px 8px rgba(0,0,0,0.35)";
  document.body.append(note);
  setTimeout(() => note.remove(), 8000);
}

// A text that is selected as a whole stays so when the page writes to the box, as it does all the time while it plays:
// what is typed then replaces it. React writes the value, and the number field of viser then sets the caret.
function keepSelection(box) {
  const own = Object.getOwnPropertyDescriptor(box, "value");
  if (!own?.set || selecting.has(box)) return;
  selecting.set(box, own);
  const isWhole = () => box.selectionEnd > 0 && box.selectionEnd - box.selectionStart === box.value.length;
  const write = (text) => {
    const whole = isWhole();
    own.set.call(box, text);
    if (whole) box.select();
  };
  Object.defineProperty(box, "value", { get: own.get, set: write, configurable: true });
  box.setSelectionRange = (...range) => {
    // the caret belongs to whom types: viser would set it for a value that the page wrote, and that did not arrive
    if (!isWhole() && !confirmed.has(box)) HTMLInputElement.prototype.setSelectionRange.apply(box, range);
  };
}

function dropSelection(box) {
  if (!selecting.has(box)) return;
  Object.defineProperty(box, "value", selecting.get(box));
  delete box.setSelectionRange;
  selecting.delete(box);
}

// While a box is edited, the page must not write to it: it does at each update, of the time while it plays for instance.
function begin(box) {
  if (confirmed.has(box)) return;
  confirmed.set(box, [box.value, Object.getOwnPropertyDescriptor(box, "value")]);
  Object.defineProperty(box, "value", { get: read, set: () => {}, configurable: true });
}

// The value before the box was edited, which it has again.
function end(box) {
  const [before, property] = confirmed.get(box);
  confirmed.delete(box);
  delete box.value;
  if (property) Object.defineProperty(box, "value", property);
  write.call(box, before);
  return before;
}

// Reads what is typed; returns whether it can be the value.
function finish(box) {
  if (!confirmed.has(box)) return true;
  const text = box.value.trim();
  if (text === end(box)) return true;
  const message = objection(box, text);
  if (message) refuse(box, message);
  else set(box, plain(Number(text)));
  return message === "";
}

addEventListener("input", (event) => {
  if (relayed.has(event) || !event.target.matches?.(BOX)) return;
  event.stopImmediatePropagation();
  document.getElementById("odeform-refusal")?.remove();
}, true);

addEventListener("beforeinput", (event) => {
  const box = event.target;
  // Enter arrives here too, after it has ended the edit
  if (box.matches?.(BOX) && event.inputType !== "insertLineBreak") begin(box);
}, true);

addEventListener("keydown", (event) => {
  const box = event.target;
  if (!box.matches?.(BOX)) return;
  // keys after it are hot keys; one that is refused is typed again
  if (event.key === "Enter") finish(box) && setTimeout(() => box.blur(), 0);
  else if (event.key === "Escape" && confirmed.has(box)) end(box);
  else if (event.key.length === 1 || event.key === "Backspace" || event.key === "Delete") {
    event.stopImmediatePropagation(); // viser would drop a comma here
  }
}, true);

addEventListener("focusin", (event) => event.target.matches?.(BOX) && keepSelection(event.target), true);

addEventListener("focusout", (event) => {
  if (!event.target.matches?.(BOX)) return;
  finish(event.target);
  dropSelection(event.target);
}, true);

// What a box is set to from elsewhere replaces what is being typed there.
window.odeform.setNumber = (box, text) => {
  if (confirmed.has(box)) end(box);
  set(box, text);
};
