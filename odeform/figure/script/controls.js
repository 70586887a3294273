function number(value) {
  return Number(value.toPrecision(3)).toString();
}

function color(name) {
  const [r, g, b] = getComputedStyle(document.documentElement).getPropertyValue(name).trim().match(/\w\w/g);
  return [r, g, b].map((x) => parseInt(x, 16) / 255);
}

// play, time and its slider; `tell` and `toggle` are for others
function timeControls(state, stop) {
  const time = $("time"), play = $("play");
  const tell = () => {
    time.value = state.time;
    $("time-value").textContent = `${state.time.toFixed(3)} s`;
    play.setAttribute("aria-label", state.playing ? "Pause" : "Play");
    play.dataset.playing = state.playing;
  };
  Object.assign(time, { min: figure.start, max: stop, step: "any" });
  time.addEventListener("input", () => {
    Object.assign(state, { time: Number(time.value), playing: false, shown: true });
    tell();
  });
  const toggle = () => {
    if (!state.playing && state.time >= stop) state.time = figure.start;
    state.playing = !state.playing;
    tell();
  };
  play.addEventListener("click", toggle);
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target === play) return;
    event.preventDefault();
    toggle();
  });
  return { tell, toggle };
}

function sliderControls(state, places) {
  figure.sweeps.forEach((sweep, axis) => {
    const row = $("slider").content.cloneNode(true), slider = row.querySelector("input");
    const [name, , value] = row.querySelector("label").children;
    name.textContent = sweep.name;
    const told = () => {
      const x = places[axis];
      const at = sweep.log ? sweep.low * (sweep.high / sweep.low) ** x : sweep.low + x * (sweep.high - sweep.low);
      value.textContent = `${number(at)} ${sweep.unit}`;
      const inside = at >= sweep.trained[0] * (1 - 1e-6 * Math.sign(sweep.trained[0])) && at <= sweep.trained[1] * (1 + 1e-6 * Math.sign(sweep.trained[1]));
      value.classList.toggle("outside", !inside);
      value.title = inside ? "" : `outside of what was ${figure.known}: ${number(sweep.trained[0])} to ${number(sweep.trained[1])} ${sweep.unit}`;
    };
    Object.assign(slider, { min: 0, max: 1, step: "any", value: places[axis] });
    slider.setAttribute("aria-label", sweep.name);
    slider.addEventListener("input", () => {
      places[axis] = Number(slider.value);
      Object.assign(state, { chosen: true, shown: true });
      told();
    });
    told();
    $("sliders").append(row);
  });
}

// a truth is known at one place of the sliders; returns what tells its error at the present time
function truthControls(state, places, columns) {
  const compared = columns.filter((column) => column.truth), truth = $("truth");
  const tellTruth = () => {
    const frame = Math.round((state.time - figure.start) / figure.step);
    const known = compared.filter(({ axes, truth: { places: at } }) => at.every((x, k) => Math.abs(x - places[axes[k]]) < 1e-3));
    const said = known.map(({ label, truth: { rms_mm: errors } }) =>
      `${columns.length > 1 ? `${label}: ` : ""}${errors[frame] === null ? "no truth at this time" : `${errors[frame].toFixed(2)} mm from the truth (RMS)`}`);
    truth.lastChild.textContent = said.join(", ");
    truth.firstChild.hidden = known.length > 0;
  };
  truth.hidden = !compared.length;
  truth.firstChild.addEventListener("click", () => {
    compared.forEach(({ axes, truth: { places: at } }) => at.forEach((x, k) => {
      const slider = $("sliders").children[axes[k]].querySelector("input");
      slider.value = x;
      slider.dispatchEvent(new Event("input"));
    }));
  });
  return compared.length ? tellTruth : () => {};
}

function columnLabels(columns) {
  columns.forEach((column) => {
    const label = document.createElement("div");
    label.textContent = columns.length > 1 ? column.label : "";
    $("labels").append(label);
  });
}

