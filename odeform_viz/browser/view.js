// What is always in view lies over the scene: parts of the panel that are marked for it are shown there instead.
//
// viser's page has panels only, and React owns them; so the marked parts stay there unseen, and a layer mirrors them.
const SIDE = 338; // px of the panel on the right
const style = document.createElement("style");
style.textContent = `
  :not(#odeform-view) > [data-odeform-view] { display: none; }
  .odeform-unseen { position: absolute !important; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
  #odeform-view {
    position: fixed; inset: 0; z-index: 1; pointer-events: none; font: 13px/1.45 Inter, sans-serif;
    color: var(--mantine-color-text); display: flex; flex-direction: column; align-items: flex-start; gap: 6px;
    padding: 12px ${SIDE}px 84px 12px;
  }
  #odeform-view > * {
    border-radius: 6px; padding: 5px 10px; max-width: 62em;
    background: color-mix(in srgb, var(--mantine-color-body) 86%, transparent);
  }
  #odeform-view > :empty { display: none; }
  /* texts let the pointer through, to what is dragged below them */
  #odeform-view > [data-odeform-view=timeline], #odeform-view [title], #odeform-view [data-hotkey] { pointer-events: auto; }
  .odeform-badge { display: inline-block; padding: 1px 9px; border-radius: 1em; color: #fff; font-weight: 600; }
  .odeform-badge.inside { background: #1b7f4b; }
  .odeform-badge.outside { background: #b06a00; }
  .odeform-badge.unknown { background: #b3260c; }
  .odeform-bar { width: 27em; max-width: 100%; }
  @media (min-width: 75em) {
    #odeform-view > [data-odeform-view=scale] { position: absolute; right: ${SIDE}px; top: 12px; }
    #odeform-view:has(> [data-odeform-view=scale]:not(:empty)) > :is([data-odeform-view=caption], [data-odeform-view=trust]) {
      max-width: calc(100% - 30em);
    }
  }
  .odeform-bar svg { display: block; width: 100%; height: 14px; }
  #odeform-view > [data-odeform-view=timeline] {
    position: absolute; left: 12px; right: ${SIDE}px; bottom: 12px; max-width: none; height: 56px; padding: 4px 12px;
    display: flex; align-items: center; gap: 12px; background: var(--mantine-color-body);
    box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18);
  }
  #odeform-view > .odeform-axes {
    position: absolute; left: 12px; bottom: 270px; width: 64px; height: 64px; padding: 0; background: none;
  }
  .odeform-axes svg {
    display: block; overflow: visible; stroke-width: 2.5; stroke-linecap: round;
    filter: drop-shadow(0 0 1px var(--mantine-color-body)) drop-shadow(0 0 2px var(--mantine-color-body));
  }
  .odeform-axes text {
    font: 600 13px Inter, sans-serif; text-anchor: middle; dominant-baseline: central; stroke: none; fill: currentColor;
  }
  .odeform-buttons { display: flex; align-items: center; gap: 2px; }
  [data-odeform-view] [data-hotkey] {
    cursor: pointer; padding: 3px 7px; border-radius: 4px; white-space: nowrap; color: #b4490f; user-select: none;
  }
  [data-mantine-color-scheme=dark] [data-odeform-view] [data-hotkey] { color: #f0955f; }
  [data-odeform-view] [data-hotkey]:hover { background: color-mix(in srgb, currentColor 14%, transparent); }
  [data-odeform-view] [data-hotkey] svg { display: block; width: 18px; height: 18px; fill: currentColor; }
  .mantine-Paper-root [style*="letter-spacing"], .mantine-Paper-root input { letter-spacing: 0 !important; }
  .odeform-range { position: relative; height: 3px; pointer-events: none;
    margin: calc(-1.15em - 12px) calc(4.5em + 4px) calc(1.15em + 9px) calc(7.6em - 4px); }
  .odeform-range svg { height: 3px; }
  .odeform-range b {
    position: absolute; right: calc(100% + 4px); top: 19px; font: 10.5px/1 Inter, sans-serif; color: #b3450c;
    white-space: nowrap;
  }
  [data-mantine-color-scheme=dark] .odeform-range b { color: #f0955f; }
  .odeform-moment { width: 5em; text-align: right; font-variant-numeric: tabular-nums; font-weight: 600; }
  .odeform-track { position: relative; flex: 1; height: 46px; cursor: ew-resize; touch-action: none; min-width: 0; }
  .odeform-track > svg { position: absolute; left: 0; top: 0; width: 100%; height: 32px; overflow: visible; }
  .odeform-track .ground { fill: color-mix(in srgb, var(--mantine-color-text) 12%, transparent); }
  .odeform-track .beyond { fill: #d08a40; opacity: 0.3; }
  .odeform-track .shape { fill: color-mix(in srgb, var(--mantine-color-text) 45%, transparent); }
  .odeform-track .acting { fill: #d66030; }
  .odeform-track .mark { stroke: var(--mantine-color-text); opacity: 0.55; vector-effect: non-scaling-stroke; }
  .odeform-track span {
    position: absolute; top: 32px; font-size: 10.5px; opacity: 0.8; white-space: nowrap; transform: translateX(-50%);
  }
  .odeform-track span:first-of-type { transform: none; }
  .odeform-track span.last { transform: translateX(-100%); }
  .odeform-track span.until { background: var(--mantine-color-body); }
  @media (max-width: 68em) { .odeform-track span.truth { display: none; } }
  .odeform-track i {
    position: absolute; top: -2px; width: 3px; height: 36px; margin-left: -1.5px; border-radius: 2px; background: #d66030;
  }
  @media (max-width: 60em) {
    #odeform-view > [data-odeform-view=timeline] { gap: 4px; padding: 4px 6px; }
    .odeform-aside, .odeform-track span.until { display: none !important; }
    .odeform-buttons, .odeform-buttons > a { gap: 0; padding: 0 2px; margin: 0; }
  }
  @media (max-width: 48em) {
    #odeform-view { padding: 8px 8px 140px; font-size: 12px; }
    #odeform-view > [data-odeform-view=timeline] { left: 8px; right: 8px; bottom: 62px; gap: 6px; padding: 4px 8px; }
    #odeform-view > .odeform-axes { left: 8px; bottom: 128px; }
    .odeform-wide, .odeform-fine { display: none !important; }
  }`;
document.head.append(style);

// The page is laid out in pixels of CSS. viser tells the server how many the canvas has: more on a fine screen, and fewer
// where drawing is slow.
const canvas = document.querySelector("canvas[data-engine]");
for (const [side, shown] of [["width", "clientWidth"], ["height", "clientHeight"]]) {
  const { set } = Object.getOwnPropertyDescriptor(HTMLCanvasElement.prototype, side);
  Object.defineProperty(canvas, side, { get: () => canvas[shown], set });
}

const layer = document.createElement("div");
layer.id = "odeform-view";
document.body.append(layer);
const ORDER = ["caption", "trust", "shape", "scale", "timeline"];
const shown = new Map(ORDER.map((name) => {
  const place = document.createElement("div");
  place.dataset.odeformView = name;
  layer.append(place);
  return [name, place];
}));

// Axes of the scene: for each how far it goes to the right, down and away; null shows none.
const axes = document.createElement("div");
axes.className = "odeform-axes";
layer.append(axes);
const COLORS = { x: "#d23f3f", y: "#2e8b45", z: "#3b6fe0" };
window.odeform.showAxes = (seen) => {
  const lines = seen && ["x", "y", "z"].map((name, at) => ({ name, right: seen[at][0], down: seen[at][1], away: seen[at][2] }));
  // the nearest is drawn last
  const drawn = lines?.sort((one, other) => other.away - one.away).map(({ name, right, down }) =>
    `<g style="color:${COLORS[name]}"><path d="M0 0L${24 * right} ${24 * down}" stroke="currentColor"/>` +
    `<text x="${33 * right}" y="${33 * down}">${name}</text></g>`);
  axes.innerHTML = drawn ? `<svg viewBox="-32 -32 64 64">${drawn.join("")}</svg>` : "";
};
window.odeform.showAxes(window.odeform.axes ?? null);

// The control after the one that holds an element: viser gives text boxes no id.
window.odeform.boxAfter = (element) => {
  for (let part = element; part && !part.matches("[role=tabpanel], body"); part = part.parentElement) {
    if (part.nextElementSibling?.querySelectorAll("input").length === 1) return part.nextElementSibling;
  }
  return null;
};

function mirror() {
  const sources = new Map([...document.querySelectorAll("[data-odeform-view]")]
    .filter((part) => part.parentElement !== layer)
    .map((part) => [part.dataset.odeformView, part]));
  for (const [name, place] of shown) {
    const text = sources.get(name)?.innerHTML ?? "";
    if (place.source !== text) place.innerHTML = place.source = text;
  }
  const slider = shown.get("timeline").querySelector("[data-time-slider]")?.dataset.timeSlider;
  document.getElementById(slider)?.closest(".mantine-Paper-root")?.classList.add("odeform-unseen");
  const map = document.querySelector("[data-map]");
  if (map) window.odeform.boxAfter(map)?.classList.add("odeform-unseen");
}
new MutationObserver((changes) => {
  if (changes.some((change) => !layer.contains(change.target))) mirror();
}).observe(document.body, { childList: true, subtree: true });
mirror();
