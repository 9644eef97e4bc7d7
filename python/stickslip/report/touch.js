// The slider of the report: the same panels as the explorer's, over motions that the page holds.
const scene = JSON.parse(document.getElementById("move-data").textContent);
(() => {
  const by = (id) => document.getElementById(`move-${id}`);
  const { loci, values, unit, pictures, first, dof } = scene;
  Object.assign(scene, scene.scene);
  document.getElementById("touch").hidden = false;
  by("still").hidden = true;
  readTheme();
  if (!loci.error) {
    loci.growth = decode(loci.growth, Float32Array);
    loci.frequency = decode(loci.frequency, Float32Array);
    loci.unstable = decode(loci.unstable, Float32Array);
  }
  const width = scene.sent.length + 1, plots = {};
  let at = first, playing = false, before = 0, cursor = { way: false, time: 0 };
  const whole = pictures[first];
  if (whole.way) {
    whole.way = unpacked(whole.way, whole.contacts, width);
    whole.wayScale = scaleOf(whole.way);
  }
  // Motions are unpacked when they are first looked at.
  function current() {
    const found = pictures[at];
    if (found.motion && !found.motion.count) {
      found.motion = unpacked(found.motion, found.contacts, width);
      found.scale = scaleOf(found.motion);
    }
    return found;
  }
  const status = (series, time) => series.contacts.map((i, k) =>
    `${scene.contacts[i]}: ${String.fromCharCode(series.status[indexAt(series, time) * series.contacts.length + k])}`).join("  ");
  const make = (id, options) => (plots[id] = new Plot(`move-${id}`, options));
  make("loci", { hover: ({ x, y }) => `${shown(x)} 1/s, ${shown(y)} Hz` }).drawn = () => drawLoci(plots.loci, loci, current().modes);
  make("structure", { zooms: false }).drawn = drawCursor;
  plots.portraits = scene.contacts.slice(0, 4).map(() => {
    const plot = new Plot("move-beside", { hover: ({ x, y }) => `${shown(x)} ${plot.unit}, ${shown(y)} m/s` });
    plot.drawn = draw;
    return plot;
  });
  const timed = (id, series) => {
    make(id, { hover: ({ x }) => (series() ? `${shown(x, 5)} ${plots[id].timeName}  ${status(series(), x / plots[id].perSecond)}` : "") }).drawn = draw;
    plots[id].stage.addEventListener("click", (event) => {
      const place = plots[id].at(event);
      if (!place.inside || !series()) return;
      play(false);
      cursor = { way: id === "way", time: place.x / plots[id].perSecond };
      if (cursor.way && at !== first) move(first); else draw();
    });
  };
  timed("ribbon", () => current().motion);
  make("energy", { left: 84, zooms: false, hover: ({ w }) => {
    const rows = current().energy, one = rows?.[Math.floor((1 - w) * rows.length)];
    return one ? worksOf(one) : "";
  } }).drawn = draw;
  timed("way", () => whole.way);
  const names = { loci: "Root loci", structure: "Structure in motion", ribbon: "Status over time", energy: "Work of the contacts", way: "Displacement from the start on" };
  for (const [id, name] of Object.entries(names)) plots[id].stage.setAttribute("aria-label", name);
  plots.portraits.forEach((plot, k) => plot.stage.setAttribute("aria-label", `Phase portrait of contact ${scene.contacts[k]}`));

  function draw() {
    const found = current();
    drawLoci(plots.loci, loci, found.modes);
    if (whole.way) drawWay(plots.way, whole.way, dof);
    if (found.motion) {
      found.contacts.forEach((_, k) => plots.portraits[k] && drawPortrait(plots.portraits[k], k, found.motion, cursor.way ? whole.way : null));
      drawRibbon(plots.ribbon, found.motion);
      drawEnergy(plots.energy, found.energy);
    } else for (const plot of [plots.ribbon, plots.energy, plots.structure, ...plots.portraits]) { plot.begin(); plot.begin(1); }
    drawCursor();
  }
  function drawCursor() {
    const found = current(), series = cursor.way ? whole.way : found.motion;
    if (!series) return;
    const index = indexAt(series, cursor.time), c = series.contacts.length;
    drawStructure(plots.structure, series, index, cursor.way ? whole.wayScale : found.scale);
    series.contacts.forEach((_, k) => {
      const plot = plots.portraits[k], ctx = plot?.begin(1);
      if (plot) plot.clipped(() => plot.dot(ctx, series.displaced[index * c + k] * plot.factor, series.slip[index * c + k], theme.ink, 5), 1);
    });
    for (const [plot, way] of [[plots.ribbon, false], [plots.way, true]]) {
      const ctx = plot.begin(1);
      if (way === cursor.way) plot.clipped(() => {
        ctx.strokeStyle = theme.ink; ctx.lineWidth = 2; ctx.beginPath();
        ctx.moveTo(plot.X(plot.perSecond * cursor.time), plot.box.y); ctx.lineTo(plot.X(plot.perSecond * cursor.time), plot.box.y + plot.box.h); ctx.stroke();
      }, 1);
    }
  }
  function move(to) {
    at = to;
    by("value").value = to;
    by("shown").textContent = `${shown(values[to])} ${unit}`;
    by("sentence").textContent = current().sentence;
    const series = current().motion;
    if (to !== first) cursor.way = false;
    if (series && !cursor.way && !(cursor.time >= series.begin && cursor.time <= series.end)) cursor.time = series.begin;
    draw();
  }
  function step(now) {
    if (!playing) return;
    const series = cursor.way ? whole.way : current().motion;
    if (series && now - before > 30) {
      const length = series.end - series.begin;
      cursor.time = series.begin + (cursor.time - series.begin + (now - before) / 2e5) % length;
      before = now;
      drawCursor();
    }
    requestAnimationFrame(step);
  }
  function play(on) {
    playing = on;
    before = performance.now();
    by("play").textContent = on ? "Pause" : "Play";
    if (on) requestAnimationFrame(step);
  }
  by("value").addEventListener("input", () => move(Number(by("value").value)));
  by("play").addEventListener("click", () => play(!playing));
  makeLegend(by("legend"), draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readTheme(); draw(); });
  scene.report = { plots, at: () => at, cursor: () => cursor };
  move(first);
})();
