"use strict";
// Axes on two canvases: what changes with the parameters below, what changes with time above.

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
let theme = {};
const readTheme = () => {
  theme = Object.fromEntries(["ink", "paper", "quiet", "line", "accent", "wash"].map((n) => [n, css(`--${n}`)]));
};
const shown = (value, digits = 4) => {
  if (value === null || !Number.isFinite(value)) return "";
  return String(Number(value.toPrecision(digits))).replace("-", "\u2212");
};

function ticksOf(low, high, most) {
  const rough = (high - low) / Math.max(most, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
  return ticks;
}

// The names of ticks, which differ; where that would take many digits, they count from a place that the axis names.
function namesOf(ticks) {
  const step = ticks.length > 1 ? ticks[1] - ticks[0] : 0, largest = Math.max(...ticks.map(Math.abs), 0);
  const digits = step > 0 ? Math.floor(Math.log10(largest)) - Math.floor(Math.log10(step) + 1e-9) + 1 : 4;
  if (digits <= 5) return { names: ticks.map((tick) => shown(tick, Math.max(digits, 4))), from: "" };
  return { names: ticks.map((tick) => shown(Math.round((tick - ticks[0]) / step) * step)), from: ` from ${shown(ticks[0], Math.min(digits, 15))} on` };
}

// Whole powers of ten in a range of decimal logarithms, or what stands between two of them; each with its name.
function powersOf(low, high, most) {
  const ticks = ticksOf(low, high, most), whole = ticks.filter((tick) => Math.abs(tick - Math.round(tick)) < 1e-9);
  if (whole.length > 1) return { ticks: whole, names: whole.map((tick) => `1e${Math.round(tick)}`.replace("-", "\u2212")) };
  // Narrower than a decade: numbers, which differ.
  return { ticks, names: ticks.map((tick) => (10 ** tick).toExponential(Math.max(2, Math.ceil(-Math.log10(high - low)) + 1)).replace("e+0", "").replace(/-/g, "\u2212")) };
}

// The smallest and largest of some numbers, a little apart, and around each other where they are the same.
function extent(values, margin = 0.05) {
  let low = Infinity, high = -Infinity;
  for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
  if (!(low <= high)) return [0, 1];
  const pad = high > low ? (high - low) * margin : Math.abs(high) * 0.05 || 1;
  return [low - pad, high + pad];
}

class Plot {
  constructor(id, options) {
    Object.assign(this, { log: false, left: 56, bottom: 34, top: 6, right: 8, axes: true, zooms: true, keys: false }, options);
    const stage = document.createElement("div");
    stage.className = "stage";
    // Only what the keyboard moves is reached by it.
    if (this.keys) stage.tabIndex = 0;
    stage.setAttribute("role", "img");
    document.getElementById(id).append(stage);
    this.stage = stage;
    this.layers = [0, 1].map(() => {
      const canvas = document.createElement("canvas");
      stage.append(canvas);
      return canvas.getContext("2d");
    });
    this.tip = document.createElement("div");
    this.tip.className = "tip";
    this.tip.hidden = true;
    stage.append(this.tip);
    this.zoomed = null;
    this.auto = { x: [0, 1], y: [0, 1] };
    this.measure();
    new ResizeObserver(() => { this.measure(); this.drawn?.(); }).observe(stage);
    if (this.zooms) this.zooming();
    stage.addEventListener("pointermove", (event) => this.hovered(event));
    stage.addEventListener("pointerleave", () => { this.tip.hidden = true; });
  }

  measure() {
    const ratio = window.devicePixelRatio || 1;
    this.width = Math.max(this.stage.clientWidth, 60);
    this.height = Math.max(this.stage.clientHeight, 40);
    for (const layer of this.layers) {
      layer.canvas.width = Math.round(this.width * ratio);
      layer.canvas.height = Math.round(this.height * ratio);
      layer.setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    this.box = { x: this.left, y: this.top, w: this.width - this.left - this.right, h: this.height - this.top - this.bottom };
  }

  range() { return this.zoomed || this.auto; }
  X(v) { const [a, b] = this.range().x; return this.box.x + (v - a) / (b - a) * this.box.w; }
  Y(v) {
    const [a, b] = this.range().y;
    return this.box.y + this.box.h - (v - a) / (b - a) * this.box.h;
  }
  // What stands at a place of the stage.
  at(event) {
    const place = this.stage.getBoundingClientRect(), { x, y } = this.range();
    const u = (event.clientX - place.left - this.box.x) / this.box.w;
    const w = 1 - (event.clientY - place.top - this.box.y) / this.box.h;
    return { u, w, x: x[0] + u * (x[1] - x[0]), y: y[0] + w * (y[1] - y[0]), inside: u >= 0 && u <= 1 && w >= 0 && w <= 1 };
  }

  begin(layer = 0) {
    const ctx = this.layers[layer];
    ctx.clearRect(0, 0, this.width, this.height);
    return ctx;
  }

  frame(xlabel, ylabel, { yticks = true } = {}) {
    const ctx = this.layers[0], { x, y, w, h } = this.box, range = this.range();
    ctx.save();
    ctx.font = "11px system-ui, sans-serif";
    ctx.strokeStyle = theme.line; ctx.fillStyle = theme.quiet; ctx.lineWidth = 1;
    ctx.strokeRect(x, y, w, h);
    ctx.textAlign = "center"; ctx.textBaseline = "top";
    const across = ticksOf(...range.x, Math.floor(w / 70)), { names, from } = namesOf(across);
    for (const [k, tick] of across.entries()) {
      const px = this.X(tick);
      ctx.beginPath(); ctx.moveTo(px, y + h); ctx.lineTo(px, y + h + 4); ctx.stroke();
      // The last number is not cut off by the margin.
      const text = names[k];
      ctx.fillText(text, Math.min(px, this.width - 1 - ctx.measureText(text).width / 2), y + h + 6);
    }
    ctx.fillText(xlabel + from, x + w / 2, y + h + 19);
    let above = "";
    if (yticks) {
      const most = Math.floor(h / 34), up = this.log ? powersOf(...range.y, most) : { ticks: ticksOf(...range.y, most) };
      if (!this.log) ({ names: up.names, from: above } = namesOf(up.ticks));
      ctx.textAlign = "right"; ctx.textBaseline = "middle";
      for (const [k, tick] of up.ticks.entries()) {
        const py = this.Y(tick);
        ctx.beginPath(); ctx.moveTo(x - 4, py); ctx.lineTo(x, py); ctx.stroke();
        ctx.fillText(up.names[k], x - 6, py);
      }
    }
    ctx.translate(10, y + h / 2); ctx.rotate(-Math.PI / 2);
    ctx.textAlign = "center"; ctx.textBaseline = "middle";
    ctx.fillText(ylabel + above, 0, 0);
    ctx.restore();
  }

  clipped(draw, layer = 0) {
    const ctx = this.layers[layer], { x, y, w, h } = this.box;
    ctx.save();
    ctx.beginPath(); ctx.rect(x, y, w, h); ctx.clip();
    draw(ctx);
    ctx.restore();
  }

  dot(ctx, x, y, colour, size = 5, ring = theme.paper) {
    ctx.beginPath(); ctx.arc(this.X(x), this.Y(y), size, 0, 2 * Math.PI);
    ctx.fillStyle = colour; ctx.fill();
    ctx.lineWidth = 1.5; ctx.strokeStyle = ring; ctx.stroke();
  }

  // The wheel zooms about the pointer, a drag moves what is zoomed, a double click shows all again.
  zooming() {
    this.stage.addEventListener("wheel", (event) => {
      const at = this.at(event);
      if (!at.inside) return;
      event.preventDefault();
      const factor = Math.exp(Math.max(-1, Math.min(1, event.deltaY / 240)));
      const range = this.range();
      this.zoomed = { x: range.x.map((v) => at.x + (v - at.x) * factor), y: range.y.map((v) => at.y + (v - at.y) * factor) };
      this.drawn?.();
    }, { passive: false });
    this.stage.addEventListener("dblclick", () => { this.zoomed = null; this.drawn?.(); });
    let from = null;
    this.stage.addEventListener("pointerdown", (event) => {
      if (this.zoomed && !this.grabs?.(event)) {
        from = { at: this.at(event), range: this.zoomed };
        this.stage.setPointerCapture(event.pointerId);
      }
    });
    this.stage.addEventListener("pointermove", (event) => {
      if (!from) return;
      const { u, w } = this.at(event), { x, y } = from.range;
      const dx = (u - from.at.u) * (x[1] - x[0]), dy = (w - from.at.w) * (y[1] - y[0]);
      this.zoomed = { x: x.map((v) => v - dx), y: y.map((v) => v - dy) };
      this.drawn?.();
    });
    for (const end of ["pointerup", "pointercancel"]) this.stage.addEventListener(end, () => { from = null; });
  }

  hovered(event) {
    const at = this.at(event), text = at.inside && this.hover ? this.hover(at) : "";
    this.tip.hidden = !text;
    if (!text) return;
    this.tip.textContent = text;
    const place = this.stage.getBoundingClientRect();
    const x = event.clientX - place.left, y = event.clientY - place.top;
    this.tip.style.left = `${Math.min(x + 12, Math.max(this.width - this.tip.offsetWidth - 2, 0))}px`;
    this.tip.style.top = `${Math.max(y - 24, 0)}px`;
  }
}
