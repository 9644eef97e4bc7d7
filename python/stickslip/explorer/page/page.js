"use strict";
// What the page holds: parameters, the last answers, the time cursor; and how it asks the server for more.

// Seconds of computing above which a motion is no longer followed while the point is dragged.
const SLOW = 0.25;
// Values of loci, cells of a map, and lines searched for curves in each parameter, while dragging and at rest.
const COARSE = { loci: 31, map: [24, 18], lines: 4 }, FINE = { loci: 121, map: [72, 54], lines: 16 };
const by = (id) => document.getElementById(id);
let scene = null;
const plots = {};
const state = {
  values: {}, x: "", y: "", dof: 0, contact: 0, start: null, dragging: false,
  motion: null, loci: null, map: null, curves: null, cursor: { series: "motion", time: 0 }, playing: false,
  // For those who measure: how many answers were drawn, and ms from the last input to the drawing.
  updates: 0, latency: [], asked: 0, pace: "",
};

async function post(path, message, signal) {
  const answer = await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(message), signal });
  if (!answer.ok) throw new Error(`${path}: ${(await answer.json()).error}`);
  return answer;
}

// One question at a time; what was asked meanwhile is asked once, as it then stands, if it is another question.
class Lane {
  constructor(path, message, done, tells = () => true) { Object.assign(this, { path, message, done, tells, wanted: false, busy: false, last: "", asked: "", took: [0, 0] }); }
  // The first answer also loads what it computes with, so one slow answer alone says nothing.
  get slow() { return Math.min(...this.took) > SLOW; }
  ask() {
    if (state.dragging && this.slow) return;
    this.wanted = true;
    if (!this.busy) this.go();
  }
  async go() {
    this.busy = true;
    while (this.wanted) {
      this.wanted = false;
      const message = this.message(), since = state.asked, text = JSON.stringify(message);
      if (text === this.last) continue;
      this.asked = text;
      this.given = new AbortController();
      // An answer that takes long is on its way.
      const waits = setTimeout(() => { by("pace").textContent = "computing ..."; }, 1e3 * SLOW);
      try {
        const answer = await (await post(this.path, message, this.given.signal)).json();
        this.last = text;
        if (this.tells(message)) this.took = [answer.seconds ?? 0, this.took[0]];
        await this.done(answer, message, since);
      } catch (error) {
        if (error.name !== "AbortError") by("note").textContent = error instanceof TypeError ? "The program behind this page does not answer; it may have ended." : String(error.message);
        if (error.name !== "AbortError") this.wanted = false;
        this.last = "";
      }
      clearTimeout(waits);
      by("pace").textContent = state.pace;
    }
    this.busy = false;
  }
}

const knobOf = (name) => scene.knobs.find((knob) => knob.name === name) || null;
const singles = (name) => scene.joint[name] || [name];
// Static friction that nobody set is the friction of its contact; other numbers may have no value.
const isSet = (name) => state.values[singles(name)[0]] !== null || name.startsWith("static_");
const valueOf = (name) => {
  const single = singles(name)[0], value = state.values[single];
  if (value !== null) return value;
  return state.values[single.replace("static_", "")] ?? knobOf(single).low;
};
function axisOf(name) {
  const knobs = singles(name).map(knobOf);
  const unit = knobs[0].unit, label = name.replaceAll("_", " ") + (unit ? `, ${unit}` : "");
  return { name, label, low: Math.min(...knobs.map((k) => k.low)), high: Math.max(...knobs.map((k) => k.high)) };
}
const startOf = () => {
  if (state.start === "kick") return { kind: "kick", dof: Number(by("kicked").value), velocity: Number(by("kick").value) || 0 };
  if (state.start === "on") return state.motion?.state ? { kind: "on", ...state.motion.state } : { kind: "mode" };
  return { kind: state.start };
};
const common = () => ({ values: { ...state.values } });
// The values that a panel over some parameters depends on: all others.
const fixed = (...over) => {
  const moved = new Set(over.flatMap(singles));
  return { values: Object.fromEntries(Object.entries(state.values).filter(([name]) => !moved.has(name))) };
};

const lanes = {
  motion: new Lane("motion", () => ({ ...common(), dof: state.dof, start: startOf(), patience: state.dragging ? 0.15 : 2 }), gotMotion),
  loci: new Lane("loci", () => {
    const { name, low, high } = axisOf(state.x);
    return { ...fixed(name), x: [name, low, high], count: state.dragging ? COARSE.loci : FINE.loci, critical: !state.dragging };
  }, gotLoci, ({ count }) => count === COARSE.loci),
  map: new Lane("map", () => {
    const [x, y] = [axisOf(state.x), axisOf(state.y)], [columns, rows] = mapFine ? FINE.map : COARSE.map;
    return { ...fixed(x.name, y.name), x: [x.name, x.low, x.high], y: [y.name, y.low, y.high], columns, rows };
  }, gotMap, ({ columns }) => columns === COARSE.map[0]),
  curves: new Lane("curves", () => {
    const [x, y] = [axisOf(state.x), axisOf(state.y)];
    return { ...fixed(x.name, y.name), x: [x.name, x.low, x.high], y: [y.name, y.low, y.high], cells: state.dragging ? COARSE.lines : FINE.lines };
  }, gotCurves, ({ cells }) => cells === COARSE.lines),
};
// What curves depend on: all but how many lines are searched.
const keyOf = ({ cells, ...others }) => JSON.stringify(others);
// Curves stay while the point is dragged over the map. While another number is dragged, the last ones that came are shown.
function curvesNow() {
  const { curves } = state, message = lanes.curves.message();
  const live = () => state.dragging && !lanes.curves.slow && curves.lines === COARSE.lines && curves.axes === JSON.stringify([message.x, message.y]);
  return curves && (curves.key === keyOf(message) || live()) ? curves : null;
}
function askCurves() {
  const lane = lanes.curves, key = keyOf(lane.message()), asked = lane.busy ? JSON.parse(lane.asked) : null;
  const same = asked && keyOf(asked) === key;
  // A search along many lines is given up where its answer is not wanted any more, one along few lines where many are.
  if (asked && (asked.cells === FINE.lines ? !same : !state.dragging)) lane.given.abort();
  if (state.dragging && (scene.band || same || state.curves?.key === key)) return;
  if (scene.band || state.map?.image) lane.ask();
}
// The map of a band comes with its curves, and is that of the other parameters as they stand.
const mapNow = () => (scene.band ? curvesNow()?.image ?? null : state.map);

// A map first in few cells; in many where these say that it will not take long.
let mapFine = false, mapKey = "";
function askMap() {
  if (scene.band) return;
  const key = JSON.stringify([state.x, state.y, fixed(state.x, state.y)]);
  if (key !== mapKey) mapFine = false;
  else mapFine ||= state.map?.image && lanes.map.took[0] * FINE.map[0] * FINE.map[1] / (COARSE.map[0] * COARSE.map[1]) < (state.dragging ? 0.05 : 3);
  mapKey = key;
  lanes.map.ask();
}

function ask() {
  state.asked = performance.now();
  showPoint();
  const waits = state.dragging ? Object.keys(lanes).filter((name) => lanes[name].slow) : [];
  if (waits.length) by("note").textContent = `This scene is too large to follow live; ${waits.join(" and ").replace("motion", "it")} ${["map", "motion"].includes(waits.join()) ? "is" : "are"} computed when you let go.`;
  if (waits.includes("motion")) return;
  lanes.motion.ask();
  lanes.loci.ask();
  askMap();
  askCurves();
}

function gotMotion(answer, message, since) {
  by("sentence").textContent = answer.sentence;
  by("over").textContent = answer.cycle ? "over one period" : "at the end of the motion";
  if (!state.dragging) by("note").textContent = lanes.motion.slow ? `Computed in ${shown(answer.seconds, 2)} s: too long to follow live, so while you drag only the point moves.` : "";
  const dofs = scene.sent.length + 1;
  if (answer.motion) {
    for (const name of ["motion", "way"]) answer[name] = unpacked(answer[name], answer.contacts, dofs);
    answer.scale = scaleOf(answer.motion);
    answer.wayScale = scaleOf(answer.way);
  }
  answer.values = message.values;
  state.motion = answer;
  const series = answer[state.cursor.series];
  if (state.playing && state.dragging) advance(performance.now());
  else if (series && !(state.cursor.time >= series.begin && state.cursor.time <= series.end)) state.cursor.time = series.begin;
  drawMotion();
  drawCursor();
  if (!lanes.loci.busy) plots.loci.drawn();
  state.updates += 1;
  state.latency.push(performance.now() - since);
  if (state.latency.length > 2000) state.latency.shift();
  state.pace = `computed in ${shown(1e3 * answer.seconds, 2)} ms`;
}

function gotLoci(answer, message) {
  if (!answer.error) {
    answer.growth = decode(answer.growth, Float32Array);
    answer.frequency = decode(answer.frequency, Float32Array);
    answer.unstable = decode(answer.unstable, Float32Array);
    answer.count = message.count;
  }
  state.loci = answer;
  plots.loci.drawn();
}

function gotMap(answer, message) {
  const [x, low, high] = message.x, [y, below, above] = message.y;
  state.map = answer.error ? answer : mapFrom(answer, message.columns, message.rows, { name: x, low, high }, { name: y, low: below, high: above });
  plots.map.drawn();
  if (!answer.error && !mapFine) askMap();
  askCurves();
}

function gotCurves(answer, message) {
  for (const piece of answer.pieces ?? []) for (const name of ["x", "y"]) piece[name] = decode(piece[name], Float32Array);
  if (answer.map) {
    const inner = ([name, low, high]) => { const half = (high - low) / answer.map.cells / 2; return { name, low: low + half, high: high - half }; };
    answer.image = mapFrom(answer.map, answer.map.cells, answer.map.cells, inner(message.x), inner(message.y));
  }
  state.curves = { ...answer, key: keyOf(message), lines: message.cells, axes: JSON.stringify([message.x, message.y]) };
  plots.map.drawn();
}

function drawMotion() {
  const found = state.motion;
  if (!found) return;
  if (!found.motion) {
    for (const name of ["ribbon", "way", "lines", "energy"]) plots[name].begin();
    plots.structure.begin(1);
    for (const plot of plots.portraits) { plot.begin(); plot.begin(1); }
    return;
  }
  found.contacts.forEach((_, k) => plots.portraits[k] && drawPortrait(plots.portraits[k], k, found.motion, state.cursor.series === "way" ? found.way : null));
  drawRibbon(plots.ribbon, found.motion);
  drawWay(plots.way, found.way, state.dof);
  drawLines(plots.lines, found.lines);
  drawEnergy(plots.energy, found.energy);
}

// The time cursor, in every panel that has a time.
function drawCursor() {
  const found = state.motion;
  if (!found?.motion) return;
  const { series: name, time } = state.cursor, series = found[name], index = indexAt(series, time), c = series.contacts.length;
  drawStructure(plots.structure, series, index, name === "motion" ? found.scale : found.wayScale);
  found.contacts.forEach((_, k) => {
    const plot = plots.portraits[k], ctx = plot?.begin(1);
    if (plot) plot.clipped(() => plot.dot(ctx, series.displaced[index * c + k] * plot.factor, series.slip[index * c + k], theme.ink, 5), 1);
  });
  for (const [plot, own] of [[plots.ribbon, "motion"], [plots.way, "way"]]) {
    const ctx = plot.begin(1);
    if (own === name) plot.clipped(() => {
      ctx.strokeStyle = theme.ink; ctx.lineWidth = 2; ctx.beginPath();
      ctx.moveTo(plot.X(plot.perSecond * time), plot.box.y); ctx.lineTo(plot.X(plot.perSecond * time), plot.box.y + plot.box.h); ctx.stroke();
    }, 1);
  }
}

let before = 0;
function advance(now) {
  const series = state.motion?.[state.cursor.series];
  if (!series) return;
  const slower = 10 ** Number(by("slower").value), length = series.end - series.begin;
  const on = state.cursor.time - series.begin + Math.min(now - before, 120) / 1e3 / slower;
  state.cursor.time = series.begin + (length > 0 && on >= 0 ? on % length : 0);
  before = now;
}
function step(now) {
  if (!state.playing) return;
  // While the point is dragged, time goes on with each picture of it.
  if (now - before > 30 && !(state.dragging && lanes.motion.busy)) { advance(now); drawCursor(); }
  requestAnimationFrame(step);
}
function play(on) {
  state.playing = on;
  by("play").textContent = on ? "Pause" : "Play";
  before = performance.now();
  if (on) requestAnimationFrame(step);
}

function setValue(name, value) {
  for (const single of singles(name)) state.values[single] = value;
}
function showPoint() {
  plots.map.drawn();
  for (const row of document.querySelectorAll(".knob")) {
    const value = valueOf(row.dataset.name);
    if (row.shown === value && isSet(row.dataset.name)) continue;
    row.shown = value;
    const [number, range] = row.querySelectorAll("input");
    range.value = value;
    if (number !== document.activeElement) number.value = isSet(row.dataset.name) ? String(Number(value.toPrecision(9))) : "";
  }
}

function row(name) {
  const { label, low, high } = axisOf(name), element = document.createElement("label");
  element.className = "knob";
  element.dataset.name = name;
  const text = document.createElement("span");
  text.textContent = label;
  const number = Object.assign(document.createElement("input"), { type: "number", step: "any", placeholder: "not set" });
  const range = Object.assign(document.createElement("input"), { type: "range", min: low, max: high, step: "any" });
  number.setAttribute("aria-label", `${label}, as a number`);
  range.setAttribute("aria-label", label);
  for (const input of [number, range]) {
    input.addEventListener("input", () => {
      if (input.value === "" || !Number.isFinite(Number(input.value))) return;
      state.dragging = input === range;
      setValue(name, Number(input.value));
      ask();
    });
    input.addEventListener("change", rested);
  }
  element.append(text, number, range);
  return element;
}
function rested() {
  if (!state.dragging) return;
  state.dragging = false;
  ask();
}

function makeKnobs() {
  const box = by("knobs"), within = new Set(Object.values(scene.joint).flat());
  for (const knob of scene.knobs) {
    if (!within.has(knob.name)) { box.append(row(knob.name)); continue; }
    const name = Object.keys(scene.joint).find((one) => scene.joint[one][0] === knob.name);
    if (!name) continue;
    const parts = document.createElement("details"), inner = document.createElement("div");
    parts.className = "parts";
    parts.append(Object.assign(document.createElement("summary"), { textContent: `${name.replaceAll("_", " ")}, each` }), inner);
    // A scene of many contacts makes its sliders when they are first looked at.
    parts.addEventListener("toggle", () => { if (!inner.children.length) { inner.append(...scene.joint[name].map(row)); showPoint(); } });
    box.append(row(name), parts);
  }
  by("filter").addEventListener("input", () => {
    const text = by("filter").value.trim().toLowerCase().replaceAll(" ", "_");
    for (const element of box.children) element.hidden = element.dataset.name ? !element.dataset.name.includes(text) : text !== "";
  });
}

const options = (id, pairs, chosen) => by(id).append(...pairs.map(([value, text]) => new Option(text, value, false, value === chosen)));

function makeControls() {
  const names = [...Object.keys(scene.joint), ...scene.knobs.map((knob) => knob.name)], named = names.map((n) => [n, n.replaceAll("_", " ")]);
  const first = ["friction", "friction_0"].find((n) => names.includes(n)) || names.find((n) => n.startsWith("friction_")) || names[0];
  const apart = (name) => names.includes(name) && !singles(name).some((one) => singles(first).includes(one));
  const second = [...scene.ordinates, ...names].find(apart);
  Object.assign(state, { x: first, y: second, start: scene.start });
  options("x", named, first);
  options("y", named, second);
  for (const [id, other] of [["x", "y"], ["y", "x"]]) by(id).addEventListener("change", () => {
    const overlaps = singles(by(id).value).some((n) => singles(state[other]).includes(n));
    if (overlaps) { by(id).value = state[id]; by("note").textContent = "The two axes of the map must be different parameters."; return; }
    state[id] = by(id).value;
    plots.map.zoomed = plots.loci.zoomed = null;
    ask();
  });
  const starts = [["mode", "leading mode set in motion"], ["kick", "kick"], ["on", "go on from the motion shown"]];
  options("start", scene.start === "file" ? [["file", "as given"], ...starts] : starts, scene.start);
  by("start").addEventListener("change", () => {
    state.start = by("start").value;
    for (const element of document.querySelectorAll(".kick")) element.hidden = state.start !== "kick";
    ask();
  });
  const dofs = scene.dofs.map((name, k) => [String(k), name]);
  options("kicked", dofs, "0");
  options("dof", dofs, "0");
  options("contact", scene.contacts.map((name, k) => [String(k), name]), "0");
  for (const id of ["kicked", "kick"]) by(id).addEventListener("change", ask);
  by("dof").addEventListener("change", () => { state.dof = Number(by("dof").value); ask(); });
  by("contact").addEventListener("change", () => { state.contact = Number(by("contact").value); });
  by("play").addEventListener("click", () => play(!state.playing));
  by("reset").addEventListener("click", () => {
    for (const knob of scene.knobs) state.values[knob.name] = knob.value;
    for (const plot of [...Object.values(plots).flat()]) plot.zoomed = null;
    ask();
  });
  by("listen").addEventListener("click", () => asked(async () => {
    const audio = by("audio"), blob = await (await post("sound", { ...common(), start: startOf(), seconds: 3, contact: state.contact })).blob();
    if (blob.type !== "audio/wav") throw new Error(JSON.parse(await blob.text()).error);
    URL.revokeObjectURL(audio.src);
    audio.src = URL.createObjectURL(blob);
    audio.hidden = false;
    await audio.play();
  }));
  for (const id of ["toml", "python"]) by(id).addEventListener("click", () => asked(async () => {
    const answer = await (await post("text", { ...common(), start: startOf() })).json();
    if (answer.error) throw new Error(answer.error);
    by("text").textContent = answer[id];
    by("copied").hidden = false;
    by("copied").querySelector("summary").textContent = await navigator.clipboard.writeText(answer[id]).then(() => "Copied", () => "Copy this");
  }));
  by("figure").addEventListener("click", () => asked(async () => {
    const blob = await (await post("figure", { ...common(), start: startOf() })).blob();
    if (blob.type !== "application/pdf") throw new Error(JSON.parse(await blob.text()).error);
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${scene.title}.pdf` });
    link.click();
    URL.revokeObjectURL(link.href);
  }));
  makeLegend(by("legend"), () => { drawMotion(); drawCursor(); });
}
async function asked(what) {
  try { await what(); by("note").textContent = ""; } catch (error) { by("note").textContent = error.message; }
}

function makePlots() {
  const make = (id, options) => (plots[id] = new Plot(id, options));
  make("map", { keys: true, hover: ({ x, y }) => {
    const map = mapNow();
    if (map?.x?.name !== state.x || map.y.name !== state.y) return "";
    const cell = (value, { low, high }, count) => Math.min(Math.max(Math.round((value - low) / (high - low) * (count - 1)), 0), count - 1);
    const growth = map.growth[cell(y, map.y, map.rows) * map.columns + cell(x, map.x, map.columns)];
    const near = curvesNow()?.points?.find((one) => Math.hypot(plots.map.X(one.x) - plots.map.X(x), plots.map.Y(one.y) - plots.map.Y(y)) < 8);
    if (near) return near.told;
    return `${shown(x, 3)}, ${shown(y, 3)}: ` + (Number.isNaN(growth) ? (scene.band ? "no steady sliding, or no mode in the band" : "no steady sliding") : `growth rate ${shown(growth, 3)} 1/s`);
  } });
  plots.map.drawn = () => {
    const curves = curvesNow();
    by("curves").textContent = curves ? curves.error || curves.said : "";
    drawMap(plots.map, mapNow(), axisOf(state.x), axisOf(state.y), { x: valueOf(state.x), y: valueOf(state.y) }, curves);
  };
  make("loci", { hover: ({ x, y }) => `${shown(x, 4)} 1/s, ${shown(y, 4)} Hz` });
  plots.loci.drawn = () => drawLoci(plots.loci, state.loci, state.motion?.modes);
  const count = Math.min(scene.contacts.length, 4), box = by("portraits");
  const beside = document.createElement("div");
  beside.id = "beside";
  box.append(beside);
  plots.portraits = Array.from({ length: count }, (_, k) => {
    const plot = new Plot("beside", { hover: ({ x, y }) => `${shown(x, 4)} ${plot.unit}, ${shown(y, 4)} m/s` });
    plot.drawn = () => { if (state.motion?.motion && k < state.motion.contacts.length) { drawPortrait(plot, k, state.motion.motion, state.cursor.series === "way" ? state.motion.way : null); drawCursor(); } };
    return plot;
  });
  const status = (series, time) => series.contacts.map((i, k) => `${scene.contacts[i]}: ${String.fromCharCode(series.status[indexAt(series, time) * series.contacts.length + k])}`).join("  ");
  const timed = (id, own) => {
    make(id, { hover: ({ x }) => (state.motion?.[own] ? `${shown(x, 5)} ${plots[id].timeName}  ${status(state.motion[own], x / plots[id].perSecond)}` : "") });
    plots[id].drawn = () => { if (state.motion?.motion) { drawMotion(); drawCursor(); } };
    let held = false;
    const set = (event) => {
      const at = plots[id].at(event);
      if (!at.inside || !state.motion?.[own]) return;
      const other = state.cursor.series !== own;
      state.cursor = { series: own, time: at.x / plots[id].perSecond };
      if (other) drawMotion();
      drawCursor();
    };
    plots[id].stage.addEventListener("pointerdown", (event) => { held = !plots[id].zoomed; if (held) { play(false); set(event); } });
    plots[id].stage.addEventListener("pointermove", (event) => { if (held) set(event); });
    plots[id].stage.addEventListener("click", (event) => { if (plots[id].zoomed) { play(false); set(event); } });
    for (const end of ["pointerup", "pointerleave"]) plots[id].stage.addEventListener(end, () => { held = false; });
  };
  make("structure", { zooms: false });
  plots.structure.drawn = drawCursor;
  timed("ribbon", "motion");
  timed("way", "way");
  make("lines", { hover: ({ x }) => {
    const lines = state.motion?.lines;
    if (!lines?.frequency.length) return "";
    const k = lines.frequency.reduce((best, f, i) => (Math.abs(f - x) < Math.abs(lines.frequency[best] - x) ? i : best), 0);
    return `${shown(lines.frequency[k], 5)} Hz: ${shown(plots.lines.factor * lines.amplitude[k], 4)} ${plots.lines.unit}`;
  } });
  plots.lines.log = true;
  make("energy", { left: 84, zooms: false, hover: ({ w }) => {
    const rows = state.motion?.energy, one = rows?.[Math.floor((1 - w) * rows.length)];
    return one ? worksOf(one) : "";
  } });
  for (const id of ["lines", "energy"]) plots[id].drawn = () => { if (state.motion?.motion) drawMotion(); };
  const names = { map: "Map of stability; drag the point, or move it by the arrow keys", loci: "Root loci", structure: "Structure in motion",
    ribbon: "Status of the contacts over time", way: "Displacement from the start on", lines: "Spectrum", energy: "Work of the contacts" };
  for (const [id, name] of Object.entries(names)) plots[id].stage.setAttribute("aria-label", name);
  plots.portraits.forEach((plot, k) => plot.stage.setAttribute("aria-label", `Phase portrait ${k}`));
}

function makePoint() {
  const plot = plots.map, stage = plot.stage;
  const near = (event) => {
    const place = stage.getBoundingClientRect();
    return Math.hypot(event.clientX - place.left - plot.X(valueOf(state.x)), event.clientY - place.top - plot.Y(valueOf(state.y))) < 18;
  };
  // Zoomed, only the point itself is grabbed; a drag elsewhere moves the map.
  plot.grabs = near;
  let last = null;
  const move = (event) => {
    const at = plot.at(event), x = axisOf(state.x), y = axisOf(state.y);
    setValue(state.x, Math.min(Math.max(at.x, x.low), x.high));
    setValue(state.y, Math.min(Math.max(at.y, y.low), y.high));
    ask();
  };
  stage.addEventListener("pointerdown", (event) => {
    if (!plot.at(event).inside || (plot.zoomed && !near(event))) return;
    stage.setPointerCapture(event.pointerId);
    last = event.pointerId;
    state.dragging = true;
    move(event);
  });
  stage.addEventListener("pointermove", (event) => { if (event.pointerId === last) move(event); });
  for (const end of ["pointerup", "pointercancel"]) stage.addEventListener(end, (event) => {
    if (event.pointerId !== last) return;
    last = null;
    rested();
  });
  stage.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] }[event.key];
    if (!steps) return;
    event.preventDefault();
    for (const [name, by] of [[state.x, steps[0]], [state.y, steps[1]]]) {
      const { low, high } = axisOf(name);
      if (by) setValue(name, Math.min(Math.max(valueOf(name) + by * (high - low) / 100, low), high));
    }
    ask();
  });
}

(async () => {
  readTheme();
  scene = await (await fetch("scene")).json();
  for (const knob of scene.knobs) state.values[knob.name] = knob.value;
  by("title").textContent = `${scene.title}: stickslip explorer`;
  document.title = `${scene.title} - stickslip explorer`;
  makeControls();
  makePlots();
  makeKnobs();
  makePoint();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readTheme();
    for (const plot of Object.values(plots).flat()) plot.drawn?.();
  });
  ask();
  play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
})();
