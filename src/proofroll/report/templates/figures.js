// Figures: drawn when they come into view, linked within a section, switched by the legend, repainted and printed.
const plots = (() => {
  const drawn = new Map();     // figure -> its element
  const hidden = new Map();    // comparison -> rows that are switched off
  const cursors = new Map();   // section's figures -> the sample that the keyboard is at
  const PRINTED = { width: 430, height: 380 };  // of half a page; see the style for print
  let loading, parts = null;
  const paper = document.documentElement.classList;  // of the class "paper" while the figures are drawn for it

  const off = (c) => hidden.get(c) ?? hidden.set(c, new Set()).get(c);
  const canvas = (figure) => figure.querySelector(".canvas");
  const siblings = (figure) => [...drawn.keys()].filter((f) => f !== figure && f.parentNode === figure.parentNode);

  const paint = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  async function load() {
    return (parts = { data: JSON.parse(await stored("curves")) });
  }

  function shown(figure) {
    const { c, p, o } = figure.dataset, point = parts.data.points[c][p];
    return { rows: parts.data.rows[c], time: point.time, observable: point.observables[o], off: off(Number(c)), paint, room: paper.contains("paper") ? 8 : ends.room(canvas(figure).clientWidth) };
  }

  const size = (figure) => (paper.contains("paper") ? PRINTED : {});

  function place(figure) {
    if (drawn.has(figure)) return;
    const element = canvas(figure), what = shown(figure);
    drawn.set(figure, element);
    put(figure, picture.traces(what), picture.layout(what, size(figure)));
    element.addEventListener("zoom", ({ detail: range }) => [figure, ...siblings(figure)].forEach((other) => zoomTo(other, range)));
    element.addEventListener("point", ({ detail: x }) => linkHover(figure, x));
    element.addEventListener("resized", () => { if (element.clientWidth !== element.places.width && !paper.contains("paper")) name(figure); });
  }

  // A layout with names at the ends of the curves, beside the names of lines.
  function named(figure, what, layout) {
    const lines = layout.annotations.filter(({ name }) => name !== ends.NAME);
    return { ...layout, annotations: [...lines, ...ends.labels(what, layout, layout.height ?? canvas(figure).clientHeight)] };
  }

  function put(figure, traces, layout) {
    const what = shown(figure);
    chart.draw(drawn.get(figure), traces, named(figure, what, layout), picture.span(what));
  }

  // Names as the curves end now, also of other traces.
  function name(figure, traces = drawn.get(figure).data) {
    const { layout } = drawn.get(figure), { width, height, ...rest } = layout;
    put(figure, traces, { ...rest, ...size(figure), margin: { ...layout.margin, r: shown(figure).room } });
  }

  function zoomTo(figure, range) {
    const element = drawn.get(figure);
    element.layout = { ...element.layout, xaxis: { ...element.layout.xaxis, range: [...range] } };
    name(figure);
  }

  const ready = () => (loading ??= load());

  async function draw(figure) {
    await ready();
    place(figure);
  }

  function redraw() {
    for (const [figure, element] of drawn) {
      const what = shown(figure), layout = picture.layout(what, size(figure)), before = element.layout.xaxis;
      layout.xaxis.range = [...before.range];  // a person's zoom stays
      put(figure, picture.traces(what), layout);
    }
  }

  function nearest(time, x) {
    let found = 0;
    time.forEach((t, i) => { if (Math.abs(t - x) < Math.abs(time[found] - x)) found = i; });
    return found;
  }

  // The truth's value at the same time, in every other figure of the section.
  function linkHover(figure, x) {
    for (const other of siblings(figure)) {
      if (x === null) chart.hover(drawn.get(other));
      else chart.hover(drawn.get(other), 0, nearest(shown(other).time, x));
    }
  }

  // With the keyboard: arrows read the truth along time, aloud too; plus and minus zoom there, 0 returns.
  const JUMPS = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity };
  document.addEventListener("keydown", (event) => {
    const figure = event.target.closest?.(".canvas")?.closest("figure[data-o]");
    if (!figure || !drawn.has(figure) || event.ctrlKey || event.metaKey || event.altKey) return;
    const group = figure.parentNode, { time } = shown(figure), at = cursors.get(group) ?? 0, element = drawn.get(figure);
    if (event.key in JUMPS) {
      const sample = Math.min(Math.max(at + JUMPS[event.key], 0), time.length - 1);
      cursors.set(group, sample);
      chart.hover(element, 0, sample);
      linkHover(figure, time[sample]);
      read(figure, sample);
    } else if (event.key === "+" || event.key === "-") {
      const [low, high] = element.layout.xaxis.range, half = (high - low) * (event.key === "+" ? 0.25 : 1);
      chart.zoom(element, [time[at] - half, time[at] + half]);
    } else if (event.key === "0") {
      chart.zoom(element, picture.span(shown(figure)));
    } else if (event.key === "Escape") {
      chart.hover(element);
      linkHover(figure, null);
    } else return;
    event.preventDefault();
  });

  function read(figure, sample) {
    const { c, p } = figure.dataset, { time, observables } = parts.data.points[c][p];
    const values = observables.map(({ symbol, truth, unit }) => `${symbol} ${truth[sample] ?? "–"} ${unit}`.trim());
    figure.closest(".point").querySelector(".readout").textContent = `truth at ${time[sample]} s: ${values.join(", ")}`;
  }

  // Rows on and off, in all figures of a comparison at once.
  function show(c) {
    for (const button of document.querySelectorAll(`.legend[data-c="${c}"] button[data-row]`))
      button.setAttribute("aria-pressed", String(!off(c).has(Number(button.dataset.row))));
    for (const [figure, element] of drawn) {
      if (Number(figure.dataset.c) !== c) continue;
      name(figure, element.data.map((trace) => ({ ...trace, visible: picture.visible(trace.meta, off(c)) })));
    }
  }

  document.addEventListener("click", (event) => {
    const button = event.target.closest(".legend button");
    if (!button) return;
    const legend = button.closest(".legend"), c = Number(legend.dataset.c);
    if (button.dataset.all !== undefined) {
      off(c).clear();
      if (button.dataset.all === "0") legend.querySelectorAll("[data-row]").forEach((b) => off(c).add(Number(b.dataset.row)));
    } else {
      const row = Number(button.dataset.row);
      if (!off(c).delete(row)) off(c).add(row);
    }
    show(c);
  });

  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) { watcher.unobserve(entry.target); draw(entry.target); }
  }, { rootMargin: "200px" });
  everywhere((part) => {
    part.querySelectorAll("figure[data-o]").forEach((figure) => watcher.observe(figure));
    [...hidden.keys()].forEach(show);
  });

  // After the first figure the curves are unpacked, so that all others can be drawn before the page is printed.
  addEventListener("beforeprint", () => {
    paper.add("paper");
    if (!parts) return;
    document.querySelectorAll("details[open] figure[data-o]").forEach((figure) => { if (figure.offsetParent) place(figure); });
    redraw();
  });
  addEventListener("afterprint", () => {
    paper.remove("paper");
    redraw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  return { ready, paint };
})();
