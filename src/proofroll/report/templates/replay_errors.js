// The strip of errors below the picture: how far each ghost is from the truth over the whole time, in place or in one
// of the readings, on a logarithmic scale, with a line at the time shown. `choices` offers the readings of a case, `show`
// draws the one chosen and gives the time of the largest error that can be seen, `now` follows its time; a click tells
// the time it is at, another choice calls `changed`.
const errorStrip = (figure, chosen, changed) => {
  const COUNT = 240;  // points of a curve
  const RESOLVED = 1e-5;  // least error of a reading that is drawn, relative to its size
  const [plot, cursor, high, low, choice] = ["plot", "now", "high", "low", "of"].map((name) => figure.querySelector(`[data-errors="${name}"]`));
  const text = (size, unit) => (unit === "mm" && size >= 1000 ? text(size / 1000, "m") : `${Number(size.toPrecision(2))} ${unit}`);
  let lines = [], until = 1;

  function choices(readings) {
    const before = choice.selectedOptions[0]?.textContent;
    choice.replaceChildren(...["place", ...readings.map(({ symbol }) => symbol)].map((name, k) => new Option(name, k - 1, k === 0, name === before)));
  }

  // `off(run, number, time)`: error of the choice of this number, null where the run is gone or does not give it.
  function show(shown, off) {
    const number = Number(choice.value), name = choice.selectedOptions[0].textContent;
    const { unit, least } = number < 0 ? { unit: "mm", least: shown.least }
      : { unit: shown.readings[number].unit, least: 10 ** Math.ceil(Math.log10(RESOLVED * (shown.readings[number].size || 1))) };
    const runs = shown.runs.slice(1);
    figure.hidden = !runs.length;
    until = shown.until;
    const curves = runs.map((run) => Array.from({ length: COUNT + 1 }, (_, k) => {
      const error = off(run, number, (until * k) / COUNT);
      return Number.isFinite(error) ? error : null;
    }));
    const floor = Math.log10(least), largest = Math.max(least, ...curves.flat().filter((error) => error !== null));
    const top = Math.max(Math.ceil(Math.log10(largest) - 1e-9), floor + 1);
    high.textContent = text(10 ** top, unit);
    low.textContent = `< ${text(least, unit)}`;
    const y = (error) => 100 * (1 - (Math.max(Math.log10(Math.max(error, 1e-300)), floor) - floor) / (top - floor));
    const grid = Array.from({ length: Math.ceil(top - floor) + 1 }, (_, k) => `M0 ${y(10 ** (floor + k)).toFixed(1)}H1000`).join("");
    lines = runs.map((run, i) => {
      const line = document.createElementNS(plot.namespaceURI, "polyline");
      line.setAttribute("class", `e${run.colour}`);
      line.setAttribute("points", curves[i].map((error, k) => (error === null ? "" : `${((1000 * k) / COUNT).toFixed(1)},${y(error).toFixed(1)}`)).join(" ").trim());
      return { line, run };
    });
    const path = document.createElementNS(plot.namespaceURI, "path");
    path.setAttribute("d", grid);
    plot.replaceChildren(path, ...lines.map(({ line }) => line));
    plot.setAttribute("aria-label", `Error of each ghost in ${name} over time, logarithmic, at most ${text(largest, unit)}`);
    const visible = curves.filter((_, i) => runs[i].shown), worst = Math.max(...visible.flat().map((error) => error ?? 0));
    return worst > least ? (until * visible.find((curve) => curve.includes(worst)).indexOf(worst)) / COUNT : 0;
  }

  function now(time) {
    cursor.style.left = `${(100 * time) / until}%`;
    for (const { line, run } of lines) line.style.display = run.shown ? "" : "none";
  }

  choice.addEventListener("change", changed);
  plot.addEventListener("pointerdown", (event) => {
    const { left, width } = plot.getBoundingClientRect();
    chosen(until * Math.min(1, Math.max(0, (event.clientX - left) / width)));
  });
  return { choices, show, now };
};
