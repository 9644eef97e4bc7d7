"use strict";
(() => {
  // One period of a mode on the screen, in ms.
  const PERIOD = 1800;
  const button = document.getElementById("motion");
  const numbers = (element, name) => element.getAttribute(name).split(" ").map(Number);
  const points = [...document.querySelectorAll("svg.motion .point")].map((element) => ({
    element, x: numbers(element, "data-x"), y: numbers(element, "data-y"),
  }));
  const ends = [...document.querySelectorAll("svg.motion .link")].flatMap((element) =>
    [1, 2].map((end) => ({ element, end, at: numbers(element, `data-p${end}`) })));
  let moving = false;
  let phase = 0;
  let before = null;

  function draw() {
    const c = Math.cos(phase), s = Math.sin(phase);
    for (const { element, x, y } of points) {
      const dx = x[0] * c - x[1] * s, dy = y[0] * c - y[1] * s;
      element.setAttribute("transform", `translate(${dx.toFixed(2)} ${(-dy).toFixed(2)})`);
    }
    for (const { element, end, at } of ends) {
      element.setAttribute(`x${end}`, (at[0] + at[2] * c - at[3] * s).toFixed(2));
      element.setAttribute(`y${end}`, (at[1] - at[4] * c + at[5] * s).toFixed(2));
    }
  }

  function step(now) {
    if (!moving) return;
    if (before !== null) phase = (phase + 2 * Math.PI * (now - before) / PERIOD) % (2 * Math.PI);
    before = now;
    draw();
    requestAnimationFrame(step);
  }

  function run(on) {
    moving = on;
    before = null;
    button.textContent = on ? "Pause the motion" : "Start the motion";
    if (on) requestAnimationFrame(step);
  }

  if (button && points.length) {
    button.hidden = false;
    button.addEventListener("click", () => run(!moving));
    const still = matchMedia("(prefers-reduced-motion: reduce)");
    still.addEventListener("change", () => { if (still.matches) run(false); });
    run(!still.matches);
  }

  for (const plot of document.querySelectorAll("svg.plot")) {
    // A click in a legend hides what its entry names, and shows it again.
    for (const entry of plot.querySelectorAll("[data-entry]")) entry.addEventListener("click", () => {
      const off = entry.classList.toggle("off");
      const alike = `[data-entry="${entry.dataset.entry}"], [data-series="${entry.dataset.entry}"]`;
      for (const one of plot.querySelectorAll(alike)) one.classList.toggle("off", off);
    });
    // Zoomed by the wheel where it was clicked: the page itself has to scroll.
    const whole = plot.getAttribute("viewBox").split(" ").map(Number);
    let [x, y, width, height] = whole, held = null;
    const at = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
    const show = (...box) => {
      [x, y, width, height] = box[2] < whole[2] ? box : whole;
      plot.setAttribute("viewBox", [x, y, width, height].join(" "));
    };
    plot.tabIndex = -1;
    plot.addEventListener("wheel", (event) => {
      if (document.activeElement !== plot) return;
      event.preventDefault();
      const place = at(event), factor = Math.max(Math.exp(Math.max(-1, Math.min(1, event.deltaY / 240))), whole[2] / 40 / width);
      show(place.x + (x - place.x) * factor, place.y + (y - place.y) * factor, width * factor, height * factor);
    });
    plot.addEventListener("pointerdown", (event) => {
      plot.focus({ preventScroll: true });
      if (width < whole[2]) { held = at(event); event.preventDefault(); }
    });
    plot.addEventListener("pointermove", (event) => {
      if (!held) return;
      const place = at(event);
      show(x + held.x - place.x, y + held.y - place.y, width, height);
    });
    for (const end of ["pointerup", "pointerleave", "pointercancel"]) plot.addEventListener(end, () => { held = null; });
    plot.addEventListener("dblclick", () => show(...whole));
    plot.addEventListener("keydown", (event) => { if (event.key === "Escape") show(...whole); });
  }
  document.getElementById("hint").hidden = false;

  // What is wider than the window scrolls by keyboard as well.
  const reach = () => {
    for (const box of document.querySelectorAll(".wide")) {
      if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
      else box.removeAttribute("tabindex");
    }
  };
  reach();
  addEventListener("resize", reach);

  // Paper folds nothing away.
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const part of folded) part.open = true;
  });
  addEventListener("afterprint", () => { for (const part of folded) part.open = false; });
})();
