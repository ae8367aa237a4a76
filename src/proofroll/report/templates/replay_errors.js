// The strip of errors below the picture: how far each ghost is from the truth over the whole time, on a logarithmic
// scale, with a line at the time shown. `show` draws a case and gives the time of the largest error that can be seen,
// `now` follows its time; a click tells the time it is at.
const errorStrip = (figure, chosen) => {
  const COUNT = 240;  // points of a curve
  const [plot, cursor, high, low] = ["plot", "now", "high", "low"].map((name) => figure.querySelector(`[data-errors="${name}"]`));
  const length = (mm) => (mm >= 1000 ? `${Number((mm / 1000).toPrecision(2))} m` : `${Number(mm.toPrecision(2))} mm`);
  let lines = [], until = 1;

  // `off(run, time)`: distance [m], null where the run is gone. `least`: distance that is invisible [mm].
  function show(shown, off) {
    const runs = shown.runs.slice(1);
    figure.hidden = !runs.length;
    until = shown.until;
    const curves = runs.map((run) => Array.from({ length: COUNT + 1 }, (_, k) => {
      const found = off(run, (until * k) / COUNT);
      return found === null || !Number.isFinite(found) ? null : 1000 * found;
    }));
    const floor = Math.log10(shown.least), largest = Math.max(shown.least, ...curves.flat().filter((mm) => mm !== null));
    const top = Math.max(Math.ceil(Math.log10(largest) - 1e-9), floor + 1);
    high.textContent = length(10 ** top);
    low.textContent = `< ${length(shown.least)}`;
    const y = (mm) => 100 * (1 - (Math.max(Math.log10(Math.max(mm, 1e-300)), floor) - floor) / (top - floor));
    const grid = Array.from({ length: Math.ceil(top - floor) + 1 }, (_, k) => `M0 ${y(10 ** (floor + k)).toFixed(1)}H1000`).join("");
    lines = runs.map((run, i) => {
      const line = document.createElementNS(plot.namespaceURI, "polyline");
      line.setAttribute("class", `e${run.colour}`);
      line.setAttribute("points", curves[i].map((mm, k) => (mm === null ? "" : `${((1000 * k) / COUNT).toFixed(1)},${y(mm).toFixed(1)}`)).join(" ").trim());
      return { line, run };
    });
    const path = document.createElementNS(plot.namespaceURI, "path");
    path.setAttribute("d", grid);
    plot.replaceChildren(path, ...lines.map(({ line }) => line));
    plot.setAttribute("aria-label", `Distance of each ghost from the truth over time, logarithmic, at most ${length(largest)}`);
    const visible = curves.filter((_, i) => runs[i].shown), worst = Math.max(...visible.flat().map((mm) => mm ?? 0));
    return worst > shown.least ? (until * visible.find((curve) => curve.includes(worst)).indexOf(worst)) / COUNT : 0;
  }

  function now(time) {
    cursor.style.left = `${(100 * time) / until}%`;
    for (const { line, run } of lines) line.style.display = run.shown ? "" : "none";
  }

  plot.addEventListener("pointerdown", (event) => {
    const { left, width } = plot.getBoundingClientRect();
    chosen(until * Math.min(1, Math.max(0, (event.clientX - left) / width)));
  });
  return { show, now };
};
