"use strict";
// The panels: each draws what the last answer of the server says, and where the time cursor is.

const decode = (text, Kind) => {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Kind(bytes.buffer);
};
// Displacements are in µm, mm or m, as in the figures: how many of them a metre has, and the name.
const unitOf = (largest) => (largest < 1e-3 ? [1e6, "\u00b5m"] : largest < 1 ? [1e3, "mm"] : [1, "m"]);
// Likewise of times by the length that is shown, s, and of works by the largest one, mJ.
const timeUnit = ({ begin, end }) => (end - begin < 1e-3 ? [1e6, "\u00b5s"] : end - begin < 1 ? [1e3, "ms"] : [1, "s"]);
const workUnit = (largest) => (largest === 0 ? [1, "mJ"] : largest < 1e-3 ? [1e6, "nJ"] : largest < 1 ? [1e3, "\u00b5J"] : largest < 1e3 ? [1, "mJ"] : [1e-3, "J"]);
// The parts of a work as a text, in the unit that suits the largest one.
function worksOf({ name, parts }) {
  const works = Object.entries(parts).filter(([, work]) => work);
  const [factor, unit] = workUnit(Math.max(...works.map(([, work]) => Math.abs(work)), 0));
  return `${name}: ${works.map(([part, work]) => `${part} ${shown(work * factor, 3)}`).join(", ")} ${unit}`;
}
const DASHES = { "-": [], "-.": [7, 3, 1.5, 3], ":": [2, 2], "--": [7, 4] }, LONG = [10, 2];
// Codes of the statuses that a click in the legend took out of the portraits.
const hidden = new Set();

// The legend of the statuses: a click takes one out of the portraits, or puts it back.
function makeLegend(box, redraw) {
  box.append(...scene.statuses.map(({ letter, name }) => {
    const item = document.createElement("button"), swatch = document.createElement("canvas"), code = letter.charCodeAt(0);
    item.type = "button";
    item.className = "legend";
    item.setAttribute("aria-pressed", "true");
    [swatch.width, swatch.height] = [22, 12];
    bar(swatch.getContext("2d"), code, 0, 0, 22, 12);
    item.append(swatch, name);
    item.addEventListener("click", () => {
      if (!hidden.delete(code)) hidden.add(code);
      item.setAttribute("aria-pressed", String(!hidden.has(code)));
      redraw();
    });
    return item;
  }));
}

// A stretch of motion with its arrays unpacked.
function unpacked(series, contacts, dofs) {
  const found = { begin: series.begin, end: series.end, speed: series.speed, contacts, dofs };
  for (const name of ["time", "position", "displaced", "slip"]) found[name] = decode(series[name], Float32Array);
  found.status = decode(series.status, Uint8Array);
  found.count = found.time.length;
  return found;
}

// The last instant of a stretch not after a time.
function indexAt(series, time) {
  let low = 0, high = series.count - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (series.time[middle] <= time) low = middle; else high = middle - 1;
  }
  return low;
}
const column = (array, width, k) => {
  const found = new Float32Array(array.length / width);
  for (let i = 0; i < found.length; i++) found[i] = array[i * width + k];
  return found;
};

// Runs of one status of contact k: [letter code, first, last] with the instant after it, so that lines join.
function runsOf(series, k) {
  const c = series.contacts.length, runs = [];
  for (let i = 0, from = 0; i < series.count; i++) {
    if (i + 1 === series.count || series.status[(i + 1) * c + k] !== series.status[from * c + k]) {
      runs.push([series.status[from * c + k], from, Math.min(i + 1, series.count - 1)]);
      from = i + 1;
    }
  }
  return runs;
}
const statusOf = (code) => scene.statuses.find(({ letter }) => letter.charCodeAt(0) === code);
const colourOf = (code) => statusOf(code)?.colour || theme.ink;

// White dots or lines across, as the hatching of the figures; a bar too narrow for them stays plain.
const hatches = new Map();
function hatchOf(code) {
  if (!hatches.has(code)) {
    const tile = document.createElement("canvas"), kind = statusOf(code)?.hatch[0];
    tile.width = tile.height = 8;
    const ctx = tile.getContext("2d");
    ctx.strokeStyle = ctx.fillStyle = "#fff"; ctx.lineWidth = 1.2;
    const round = { ".": 0.9, "o": 1.7 }[kind];
    if (round) for (const [x, y] of [[2, 2], [6, 6]]) { ctx.beginPath(); ctx.arc(x, y, round, 0, 7); ctx[kind === "o" ? "stroke" : "fill"](); }
    else for (const shift of [-8, 0, 8]) {
      ctx.beginPath(); ctx.moveTo(shift - 1, kind === "/" ? 9 : -1); ctx.lineTo(shift + 9, kind === "/" ? -1 : 9); ctx.stroke();
    }
    hatches.set(code, kind ? ctx.createPattern(tile, "repeat") : null);
  }
  return hatches.get(code);
}
function bar(ctx, code, x, y, width, height) {
  ctx.fillStyle = colourOf(code);
  ctx.fillRect(x, y, width, height);
  const hatch = width >= 6 && height >= 6 ? hatchOf(code) : null;
  if (hatch) { ctx.fillStyle = hatch; ctx.fillRect(x, y, width, height); }
}

// Curves on which stability ends, with the points at which they meet; grey ones are without steady sliding.
function drawCurves(plot, ctx, { pieces, points }) {
  for (const { x, y, line, look } of pieces) {
    ctx.strokeStyle = look ? theme.ink : theme.quiet; ctx.lineWidth = look === 2 ? 2 : 1;
    ctx.setLineDash(DASHES[line]); ctx.beginPath();
    x.forEach((value, k) => ctx[k ? "lineTo" : "moveTo"](plot.X(value), plot.Y(y[k])));
    ctx.stroke();
  }
  ctx.setLineDash([]);
  ctx.font = "11px system-ui, sans-serif"; ctx.textBaseline = "middle"; ctx.lineJoin = "round";
  for (const { x, y, name } of points) {
    plot.dot(ctx, x, y, theme.paper, name ? 4.5 : 2.5, theme.ink);
    const left = plot.X(x) > plot.box.x + plot.box.w / 2, to = plot.X(x) + (left ? -6 : 6);
    const at = plot.Y(y) + (plot.Y(y) < plot.box.y + 20 ? 12 : -12);
    ctx.textAlign = left ? "right" : "left"; ctx.strokeStyle = theme.paper; ctx.fillStyle = theme.ink; ctx.lineWidth = 3;
    ctx.strokeText(name, to, at); ctx.fillText(name, to, at);
  }
}

function drawMap(plot, map, x, y, point, curves) {
  const ctx = plot.begin();
  plot.auto = { x: [x.low, x.high], y: [y.low, y.high] };
  if (map?.image && map.x.name === x.name && map.y.name === y.name) {
    plot.clipped(() => {
      ctx.imageSmoothingEnabled = false;
      const w = (map.x.high - map.x.low) / (map.columns - 1) / 2, h = (map.y.high - map.y.low) / (map.rows - 1) / 2;
      const left = plot.X(map.x.low - w), top = plot.Y(map.y.high + h);
      ctx.drawImage(map.image, left, top, plot.X(map.x.high + w) - left, plot.Y(map.y.low - h) - top);
      // The border of cells stands in for curves until all are there.
      if (!curves?.whole) {
        ctx.strokeStyle = theme.ink; ctx.lineWidth = 1.5; ctx.beginPath();
        for (const [a, b, c, d] of map.border) {
          ctx.moveTo(plot.X(a), plot.Y(b)); ctx.lineTo(plot.X(c), plot.Y(d));
        }
        ctx.stroke();
      }
    });
  }
  if (curves?.pieces) plot.clipped(() => drawCurves(plot, ctx, curves));
  plot.frame(x.label, y.label);
  if (map?.error) write(plot, ctx, map.error);
  plot.clipped(() => {
    ctx.strokeStyle = theme.ink; ctx.lineWidth = 1; ctx.setLineDash([3, 3]); ctx.beginPath();
    ctx.moveTo(plot.X(point.x), plot.box.y); ctx.lineTo(plot.X(point.x), plot.box.y + plot.box.h);
    ctx.moveTo(plot.box.x, plot.Y(point.y)); ctx.lineTo(plot.box.x + plot.box.w, plot.Y(point.y));
    ctx.stroke(); ctx.setLineDash([]);
    plot.dot(ctx, point.x, point.y, theme.ink, 7);
  });
}

// The image of a map and the line on which the largest growth rate is zero, by marching squares.
function mapFrom(answer, columns, rows, x, y) {
  const growth = decode(answer.growth, Float32Array), grows = decode(answer.unstable, Float32Array), image = document.createElement("canvas");
  image.width = columns; image.height = rows;
  const ctx = image.getContext("2d"), pixels = ctx.createImageData(columns, rows);
  let largest = 0;
  for (const g of growth) if (Math.abs(g) > largest) largest = Math.abs(g);
  const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  const stable = rgb(scene.colours.stable), unstable = rgb(scene.colours.unstable);
  for (let j = 0; j < rows; j++) for (let i = 0; i < columns; i++) {
    const at = j * columns + i, g = growth[at], to = 4 * ((rows - 1 - j) * columns + i);
    const colour = Number.isNaN(g) ? ((i + j) % 2 ? [150, 150, 150] : [185, 185, 185]) : grows[at] ? unstable : stable;
    pixels.data.set(colour, to);
    pixels.data[to + 3] = Number.isNaN(g) ? 255 : 60 + 170 * Math.sqrt(Math.abs(g) / (largest || 1));
  }
  ctx.putImageData(pixels, 0, 0);
  const border = [], px = (i) => x.low + (x.high - x.low) * i / (columns - 1), py = (j) => y.low + (y.high - y.low) * j / (rows - 1);
  for (let j = 0; j + 1 < rows; j++) for (let i = 0; i + 1 < columns; i++) {
    const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]], cuts = [];
    for (let k = 0; k < 4; k++) {
      const [a, b] = corners[k], [c, d] = corners[(k + 1) % 4], [at, next] = [b * columns + a, d * columns + c];
      const g = growth[at], h = growth[next];
      if (grows[at] !== grows[next] && !Number.isNaN(g) && !Number.isNaN(h)) {
        const s = g / (g - h);
        cuts.push(px(a + s * (c - a)), py(b + s * (d - b)));
      }
    }
    for (let k = 0; k + 3 < cuts.length; k += 4) border.push(cuts.slice(k, k + 4));
  }
  return { x, y, columns, rows, growth, image, border };
}

function drawLoci(plot, loci, modes) {
  const ctx = plot.begin();
  if (!loci || loci.error) {
    plot.frame("growth rate, 1/s", "frequency, Hz");
    if (loci) write(plot, ctx, loci.error);
    return;
  }
  const n = loci.count;
  plot.auto = { x: extent(loci.growth), y: extent(loci.frequency) };
  plot.clipped(() => {
    ctx.strokeStyle = theme.quiet; ctx.lineWidth = 1; ctx.setLineDash([2, 3]); ctx.beginPath();
    ctx.moveTo(plot.X(0), plot.box.y); ctx.lineTo(plot.X(0), plot.box.y + plot.box.h); ctx.stroke(); ctx.setLineDash([]);
    for (let b = 0; b < loci.branches; b++) {
      for (const side of [false, true]) {
        ctx.beginPath(); ctx.strokeStyle = side ? scene.colours.unstable : scene.colours.stable; ctx.lineWidth = 1.6;
        for (let k = 0; k + 1 < n; k++) {
          const i = b * n + k;
          if (Boolean(loci.unstable[i] && loci.unstable[i + 1]) !== side) continue;
          ctx.moveTo(plot.X(loci.growth[i]), plot.Y(loci.frequency[i]));
          ctx.lineTo(plot.X(loci.growth[i + 1]), plot.Y(loci.frequency[i + 1]));
        }
        ctx.stroke();
      }
    }
    for (const { frequency } of loci.hopf) plot.dot(ctx, 0, frequency, theme.paper, 4, theme.ink);
  });
  plot.frame("growth rate, 1/s", "frequency, Hz");
  if (modes) plot.clipped(() => modes.growth.forEach((g, k) =>
    plot.dot(ctx, g, modes.frequency[k], modes.unstable[k] ? scene.colours.unstable : scene.colours.stable, 5, theme.ink)));
}

function write(plot, ctx, text) {
  ctx.fillStyle = theme.quiet; ctx.font = "12px system-ui, sans-serif"; ctx.textAlign = "center";
  // In as many lines as it needs.
  const lines = text.match(/.{1,48}(\s|$)/g) || [];
  lines.forEach((line, k) => ctx.fillText(line, plot.box.x + plot.box.w / 2, plot.box.y + plot.box.h / 4 + 16 * k));
}

// Phase portraits side by side: plots[k] is that of the k-th contact drawn.
function drawPortrait(plot, k, motion, way) {
  const ctx = plot.begin();
  const c = motion.contacts.length, u = column(motion.displaced, c, k), v = column(motion.slip, c, k);
  const [factor, unit] = unitOf(Math.max(...extent(u, 0).map(Math.abs)));
  plot.factor = factor; plot.unit = unit;
  for (let i = 0; i < u.length; i++) u[i] *= factor;
  plot.auto = { x: extent(u), y: extent([...extent(v, 0), motion.speed[k]], 0.08) };
  plot.clipped(() => {
    if (way) {
      ctx.strokeStyle = theme.line; ctx.lineWidth = 0.8; ctx.beginPath();
      for (let i = 0; i < way.count; i++) ctx[i ? "lineTo" : "moveTo"](plot.X(way.displaced[i * c + k] * factor), plot.Y(way.slip[i * c + k]));
      ctx.stroke();
    }
    ctx.strokeStyle = theme.ink; ctx.lineWidth = 1; ctx.setLineDash([5, 3]); ctx.beginPath();
    ctx.moveTo(plot.box.x, plot.Y(motion.speed[k])); ctx.lineTo(plot.box.x + plot.box.w, plot.Y(motion.speed[k])); ctx.stroke(); ctx.setLineDash([]);
    ctx.lineWidth = 2;
    for (const [code, first, last] of runsOf(motion, k)) {
      if (hidden.has(code)) continue;
      ctx.strokeStyle = colourOf(code); ctx.setLineDash(DASHES[statusOf(code).style] ?? LONG); ctx.beginPath();
      for (let i = first; i <= last; i++) ctx[i > first ? "lineTo" : "moveTo"](plot.X(u[i]), plot.Y(v[i]));
      ctx.stroke();
    }
    ctx.setLineDash([]);
  });
  plot.frame(`contact ${scene.contacts[motion.contacts[k]]}: displacement, ${unit}`, "velocity, m/s");
}

function ribbon(plot, ctx, series, top, height, factor) {
  const each = height / series.contacts.length;
  series.contacts.forEach((_, k) => {
    for (const [code, first, last] of runsOf(series, k)) {
      const a = plot.X(factor * series.time[first]), b = plot.X(factor * series.time[last]);
      bar(ctx, code, a, top + k * each + 1, Math.max(b - a, 0.7), each - 2);
    }
  });
}

function drawRibbon(plot, motion) {
  const ctx = plot.begin();
  const [per, name] = [plot.perSecond, plot.timeName] = timeUnit(motion);
  plot.auto = { x: [per * motion.begin, per * motion.end], y: [0, 1] };
  plot.clipped(() => ribbon(plot, ctx, motion, plot.box.y, plot.box.h, per));
  plot.frame(`time, ${name}`, "", { yticks: false });
  ctx.fillStyle = theme.quiet; ctx.textAlign = "right"; ctx.textBaseline = "middle"; ctx.font = "11px system-ui, sans-serif";
  const each = plot.box.h / motion.contacts.length;
  motion.contacts.forEach((i, k) => ctx.fillText(String(scene.contacts[i]).slice(0, 8), plot.box.x - 6, plot.box.y + (k + 0.5) * each));
}

function drawWay(plot, way, dof) {
  const ctx = plot.begin(), m = way.dofs, x = column(way.position, m, m - 1);
  let mean = 0;
  for (const value of x) mean += value / x.length;
  for (let i = 0; i < x.length; i++) x[i] -= mean;
  const [factor, unit] = unitOf(Math.max(...extent(x, 0).map(Math.abs)));
  for (let i = 0; i < x.length; i++) x[i] *= factor;
  // The statuses stand below the curve.
  const [low, high] = extent(x, 0.08), below = (high - low) * 18 / Math.max(plot.box.h - 18, 18);
  const [per, name] = [plot.perSecond, plot.timeName] = timeUnit(way);
  plot.auto = { x: [per * way.begin, per * way.end], y: [low - below, high] };
  plot.clipped(() => {
    ctx.strokeStyle = theme.accent; ctx.lineWidth = 1; ctx.beginPath();
    for (let i = 0; i < way.count; i++) ctx[i ? "lineTo" : "moveTo"](plot.X(per * way.time[i]), plot.Y(x[i]));
    ctx.stroke();
    ribbon(plot, ctx, way, plot.box.y + plot.box.h - 16, 16, per);
  });
  plot.frame(`time, ${name}`, `${scene.dofs[dof]}, ${unit}`);
}

function drawLines(plot, lines) {
  const ctx = plot.begin();
  // Amplitudes come in µm.
  const [per, unit] = unitOf(Math.max(...extent(lines.amplitude, 0), 0) / 1e6), factor = per / 1e6;
  plot.factor = factor; plot.unit = unit;
  const logs = lines.amplitude.map((a) => Math.log10(Math.max(factor * a, 1e-12)));
  let top = -12;
  for (const a of logs) if (a > top) top = a;
  const floor = top - 5;
  let far = 1;
  lines.frequency.forEach((f, k) => { if (logs[k] > floor) far = f; });
  plot.auto = { x: [0, 1.05 * far], y: [floor, top + 0.4] };
  plot.clipped(() => {
    ctx.strokeStyle = ctx.fillStyle = theme.accent; ctx.lineWidth = 1.5; ctx.beginPath();
    lines.frequency.forEach((f, k) => {
      if (lines.exact) { ctx.moveTo(plot.X(f), plot.Y(floor)); ctx.lineTo(plot.X(f), plot.Y(logs[k])); }
      else ctx[k ? "lineTo" : "moveTo"](plot.X(f), plot.Y(logs[k]));
    });
    ctx.stroke();
    if (lines.exact) lines.frequency.forEach((f, k) => { if (logs[k] > floor) plot.dot(ctx, f, logs[k], theme.accent, 3); });
  });
  plot.frame("frequency, Hz", `amplitude, ${unit}`);
}

function drawEnergy(plot, rows) {
  const ctx = plot.begin();
  let low = 0, high = 0;
  for (const row of rows) {
    const works = Object.values(row.parts);
    low = Math.min(low, works.reduce((s, w) => s + Math.min(w, 0), 0));
    high = Math.max(high, works.reduce((s, w) => s + Math.max(w, 0), 0));
  }
  const [factor, unit] = workUnit(Math.max(-low, high));
  plot.auto = { x: extent([factor * low, factor * high]), y: [0, 1] };
  const each = plot.box.h / rows.length, others = { impact: theme.ink, other: theme.quiet };
  rows.forEach((row, r) => {
    let below = 0, above = 0;
    for (const [part, inMillijoules] of Object.entries(row.parts)) {
      const work = factor * inMillijoules, from = work < 0 ? below : above, to = from + work;
      if (work < 0) below = to; else above = to;
      const a = plot.X(Math.min(from, to)), b = plot.X(Math.max(from, to)), top = plot.box.y + r * each + 2;
      if (others[part]) { ctx.fillStyle = others[part]; ctx.fillRect(a, top, b - a, each - 4); }
      else bar(ctx, part.charCodeAt(0), a, top, b - a, each - 4);
    }
  });
  plot.frame(unit, "", { yticks: false });
  ctx.strokeStyle = theme.ink; ctx.beginPath(); ctx.moveTo(plot.X(0), plot.box.y); ctx.lineTo(plot.X(0), plot.box.y + plot.box.h); ctx.stroke();
  ctx.fillStyle = theme.quiet; ctx.textAlign = "right"; ctx.textBaseline = "middle"; ctx.font = "11px system-ui, sans-serif";
  rows.forEach((row, r) => ctx.fillText(row.name.slice(0, 14), plot.box.x - 6, plot.box.y + (r + 0.5) * each));
}

// The structure at an instant: bodies where they are, springs between them, sliders below the contacts.
function drawStructure(plot, series, index, scale) {
  const ctx = plot.begin(1), { bodies, springs, walls, faces } = scene, m = series.dofs;
  scene.placeOf ??= new Map(scene.sent.map((dof, place) => [dof, place]));
  const xs = bodies.map((b) => b.x), ys = bodies.map((b) => b.y);
  const [x0, x1] = extent(xs, 0), [y0, y1] = extent(ys, 0);
  let [wide, high] = [(plot.width - 100) / (x1 - x0), (plot.height - 88) / (y1 - y0)];
  // A mesh keeps its shape; places of a schematic have no scale.
  if (faces.length) wide = high = Math.min(wide, high);
  const px = (x) => plot.width / 2 + wide * (x - (x0 + x1) / 2);
  const py = (y) => plot.height / 2 - 8 - high * (y - (y0 + y1) / 2);
  const size = Math.max(5, Math.min(11, 120 / Math.sqrt(bodies.length + 1) / 6));
  const places = bodies.map((body) => {
    let right = 0, up = 0;
    for (const [dof, r, u] of body.along) {
      const place = scene.placeOf.get(dof), q = series.position[index * m + place] - scale.middle[place];
      right += r * q; up += u * q;
    }
    return [px(body.x) + scale.factor * right, py(body.y) - scale.factor * up];
  });
  if (faces.length) {
    ctx.fillStyle = theme.wash; ctx.strokeStyle = theme.accent; ctx.lineWidth = 0.7;
    for (const face of faces) {
      ctx.beginPath();
      for (const k of face) ctx.lineTo(...places[k]);
      ctx.closePath(); ctx.fill(); ctx.stroke();
    }
    return;
  }
  ctx.strokeStyle = theme.quiet; ctx.lineWidth = 1.3;
  const coil = (a, b) => {
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]], long = Math.hypot(dx, dy) || 1, [nx, ny] = [-dy / long, dx / long];
    ctx.beginPath(); ctx.moveTo(...a);
    for (let k = 1; k < 12; k++) {
      const s = 0.2 + 0.6 * k / 12, side = k % 2 ? 4 : -4;
      ctx.lineTo(a[0] + s * dx + side * nx, a[1] + s * dy + side * ny);
    }
    ctx.lineTo(...b); ctx.stroke();
  };
  for (const [a, b] of springs) coil(places[a], places[b]);
  for (const [a] of walls) {
    const [x, y] = [px(bodies[a].x), py(bodies[a].y)], end = bodies[a].y > 0 || bodies[a].contact === null ? [x, y - 32] : [x - 34, y];
    coil(places[a], end);
    ctx.beginPath();
    if (end[1] < y) { ctx.moveTo(x - 9, end[1]); ctx.lineTo(x + 9, end[1]); } else { ctx.moveTo(end[0], y - 9); ctx.lineTo(end[0], y + 9); }
    ctx.lineWidth = 2.5; ctx.stroke(); ctx.lineWidth = 1.3;
  }
  bodies.forEach((body, k) => {
    const [x, y] = places[k];
    let colour = theme.accent;
    if (body.contact !== null) {
      const shownAt = series.contacts.indexOf(body.contact);
      if (shownAt >= 0) colour = colourOf(series.status[index * series.contacts.length + shownAt]);
      const a = Math.cos(body.angle), b = Math.sin(body.angle), sx = px(body.x) + b * (size + 5), sy = py(body.y) + a * (size + 5);
      ctx.strokeStyle = theme.ink; ctx.lineWidth = 3; ctx.beginPath();
      ctx.moveTo(sx - 30 * a, sy + 30 * b); ctx.lineTo(sx + 30 * a, sy - 30 * b); ctx.stroke();
    }
    ctx.fillStyle = colour; ctx.strokeStyle = theme.paper; ctx.lineWidth = 1.5;
    ctx.beginPath(); ctx.arc(x, y, size, 0, 2 * Math.PI); ctx.fill(); ctx.stroke();
    if (bodies.length <= 16) {
      ctx.fillStyle = theme.quiet; ctx.font = "11px system-ui, sans-serif"; ctx.textAlign = "left";
      ctx.fillText(body.name, px(body.x) + size + 10, py(body.y) - size - 6);
    }
  });
}

// Where dofs move about, and how many pixels a metre is, so that the largest displacement is seen.
function scaleOf(series) {
  const m = series.dofs, count = scene.sent.length, middle = new Float32Array(count);
  let largest = 0;
  for (let d = 0; d < count; d++) {
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < series.count; i++) {
      const q = series.position[i * m + d];
      if (q < low) low = q;
      if (q > high) high = q;
    }
    middle[d] = (low + high) / 2;
    largest = Math.max(largest, (high - low) / 2);
  }
  return { middle, factor: largest ? 26 / largest : 0 };
}
