"use strict";
(() => {
  const seen = new Map();      // figure -> its plotly element, once drawn
  const hidden = new Map();    // comparison -> rows that are switched off
  let curves;                  // of all figures
  let ready;                   // a promise: the curves are there, and plotly is a program

  const data = () => curves;
  const off = (c) => hidden.get(c) ?? hidden.set(c, new Set()).get(c);
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const siblings = (figure) => [...seen.keys()].filter((f) => f !== figure && f.parentNode === figure.parentNode);

  const plotly = () => window.Plotly;
  const prepare = () => (ready ??= Promise.all([unpack("curves"), unpack("plotly")]).then(([text, program]) => {
    curves = JSON.parse(text);
    const script = document.createElement("script");
    script.textContent = program;
    document.head.append(script);
  }));

  // plotly reads a few HTML tags and %{…} in names: show them as they are written.
  const literal = (text) =>
    String(text).replace(/[&<>{}]/g, (sign) => `&#${sign.charCodeAt(0)};`);

  function contents(figure) {
    const { c, p, o } = figure.dataset;
    const point = data().points[c][p];
    return { c: Number(c), rows: data().rows[c], time: point.time, observable: point.observables[o] };
  }

  function traces(figure) {
    const { c, rows, time, observable } = contents(figure);
    const label = (name, what) =>
      `<b>${literal(name)}</b><br>t = %{x:.4g} s<br>${what} %{y:.4g} ${literal(observable.unit)}<extra></extra>`;
    const above = [], below = [];
    for (const { row, difference, at } of observable.engines) {
      const { name, colour, dash, width, opacity } = rows[row];
      const where = at ?? time.keys().toArray?.() ?? [...time.keys()];
      const shared = {
        type: "scatter", mode: "lines", opacity, x: where.map((i) => time[i]), meta: row, visible: !off(c).has(row),
        line: { color: css(`--e${colour}`), dash, width },
      };
      const sum = (i, k) => (difference[k] === null ? null : observable.truth[i] + difference[k]);
      above.push({ ...shared, y: where.map(sum), hovertemplate: label(name, literal(observable.symbol) + " =") });
      below.push({
        ...shared, yaxis: "y2", y: difference.map((d) => (d ? Math.abs(d) : null)), hovertemplate: label(name, "distance"),
      });
    }
    const truth = {
      type: "scatter", mode: "lines", x: time, y: observable.truth, meta: -1, line: { color: css("--truth"), width: 6 },
      hovertemplate: label("truth", literal(observable.symbol) + " ="),
    };
    return [truth, ...above, ...below, ...onsets(figure)];
  }

  // First slips, on the line that the needed friction must reach.
  function onsets(figure) {
    const { c, rows, observable } = contents(figure);
    return (observable.marks ?? []).map(({ row, time }) => ({
      type: "scatter", mode: "markers", x: [time], y: [observable.bounds[0].value], meta: row, visible: !off(c).has(row),
      marker: row < 0
        ? { symbol: "diamond", size: 12, color: css("--truth") }
        : { symbol: "circle-open", size: 9, color: css(`--e${rows[row].colour}`), line: { width: rows[row].width } },
      hovertemplate: `<b>${literal(row < 0 ? "truth" : rows[row].name)}</b><br>first slip at %{x:.7g} s<extra></extra>`,
    }));
  }

  // The bounds of friction: a line each, named at its right end.
  const lines = ({ bounds }) => (bounds ?? []).map(({ value }) => (
    { type: "line", xref: "paper", x0: 0, x1: 1, yref: "y", y0: value, y1: value, line: { color: css("--ink"), width: 1, dash: "dash" } }));
  const named = ({ bounds }) => (bounds ?? []).map(({ name, value }) => (
    { xref: "paper", x: 1, yref: "y", y: value, xanchor: "right", yanchor: "bottom", showarrow: false, font: { size: 11 },
      text: `${literal(name)} = ${value}` }));

  // The frame follows the truth: an engine that flies off must not flatten it. Double-click shows everything.
  function frame({ truth, scale, bounds }) {
    const known = [...truth, ...(bounds ?? []).map(({ value }) => value)].filter((v) => v !== null);
    const low = Math.min(...known), high = Math.max(...known);
    const half = Math.max(0.65 * (high - low), 0.03 * scale) || 1;
    return [(low + high) / 2 - half, (low + high) / 2 + half];
  }

  function decades({ engines, error_bar: bar }) {
    let low = Infinity, high = 0;
    for (const { difference } of engines) {
      const sizes = difference.filter((d) => d).map(Math.abs).sort((a, b) => a - b);
      if (!sizes.length) continue;
      low = Math.min(low, sizes[Math.floor(sizes.length / 20)]);
      high = Math.max(high, sizes[sizes.length - 1]);
    }
    if (!high) return bar ? [Math.log10(bar) - 2, Math.log10(bar) + 2] : [-18, -12];
    if (bar) low = Math.min(low, bar / 3), high = Math.max(high, 2 * bar);
    return [Math.log10(low) - 0.2, Math.log10(high) + 0.3];
  }

  function layout(figure) {
    const { observable } = contents(figure);
    const unit = observable.unit ? ` [${literal(observable.unit)}]` : "";
    const log = decades(observable);
    const axis = { gridcolor: css("--rule"), linecolor: css("--rule"), zeroline: false, ticks: "", automargin: true, title: { standoff: 6 } };
    const touch = matchMedia("(pointer: coarse)").matches;
    return {
      height: figure.querySelector(".canvas").clientHeight, margin: { l: 64, r: 8, t: 8, b: 40 }, showlegend: false,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: "closest", dragmode: touch ? false : "zoom",
      font: { family: css("--sans"), size: 12, color: css("--ink") },
      hoverlabel: { bgcolor: css("--paper"), bordercolor: css("--muted"), font: { color: css("--ink") }, align: "left" },
      xaxis: { ...axis, anchor: "y2", rangemode: "nonnegative", title: { text: "time [s]", standoff: 6 } },
      yaxis: { ...axis, domain: [0.5, 1], range: frame(observable), title: { text: literal(observable.symbol) + unit, standoff: 6 } },
      yaxis2: {
        ...axis, domain: [0, 0.44], type: "log", range: log, exponentformat: "power", dtick: Math.max(1, Math.ceil((log[1] - log[0]) / 5)),
        title: { text: "distance" + unit, standoff: 6 },
      },
      annotations: named(observable),
      shapes: [...lines(observable), ...(observable.error_bar
        ? [{ type: "rect", xref: "paper", x0: 0, x1: 1, yref: "y2", y0: 10 ** log[0], y1: observable.error_bar,
             fillcolor: css("--bar"), line: { width: 0 }, layer: "below" }]
        : [])],
    };
  }

  function draw(figure) {
    if (seen.has(figure)) return;
    const element = figure.querySelector(".canvas");
    seen.set(figure, element);
    plotly().newPlot(element, traces(figure), layout(figure), { displayModeBar: false, responsive: true, doubleClick: "reset+autosize" });
    element.on("plotly_relayout", (change) => linkTime(figure, change));
    element.on("plotly_hover", (event) => linkHover(figure, event.points[0].x));
    element.on("plotly_unhover", () => linkHover(figure, null));
  }

  // plotly reports what it was told as well as what a person did, and later: only what is not so yet is passed on.
  function linkTime(figure, change) {
    const range = change["xaxis.range"] ?? (change["xaxis.range[0]"] === undefined ? null : [change["xaxis.range[0]"], change["xaxis.range[1]"]]);
    if (range === null && !change["xaxis.autorange"]) return;
    for (const other of siblings(figure)) {
      const axis = seen.get(other).layout.xaxis;
      if (range === null ? axis.autorange === true : !axis.autorange && axis.range.every((end, i) => end === range[i])) continue;
      plotly().relayout(seen.get(other), range === null ? { "xaxis.autorange": true } : { "xaxis.range": [...range], "xaxis.autorange": false });
    }
  }

  // The truth's value at the same time, in every other figure of the section; only the figure under the pointer leads.
  function linkHover(figure, x) {
    if (x !== null && !figure.matches(":hover")) return;
    if (x === null && siblings(figure).some((other) => other.matches(":hover"))) return;
    for (const other of siblings(figure)) {
      if (x === null) { plotly().Fx.unhover(seen.get(other)); continue; }
      const { time } = contents(other);
      let nearest = 0;
      time.forEach((t, i) => { if (Math.abs(t - x) < Math.abs(time[nearest] - x)) nearest = i; });
      plotly().Fx.hover(seen.get(other), [{ curveNumber: 0, pointNumber: nearest }]);
    }
  }

  function redraw(size = {}) {
    for (const [figure, element] of seen) plotly().react(element, traces(figure), { ...layout(figure), ...size });
  }

  // Rows on and off, in all figures of a comparison at once.
  function show(c) {
    for (const button of document.querySelectorAll(`.legend[data-c="${c}"] button[data-row]`))
      button.setAttribute("aria-pressed", String(!off(c).has(Number(button.dataset.row))));
    for (const [figure, element] of seen) {
      if (Number(figure.dataset.c) !== c) continue;
      plotly().restyle(element, { visible: element.data.map((trace) => !off(c).has(trace.meta)) });
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

  // A link to evidence opens what it lies in.
  function reveal() {
    document.querySelectorAll(".target").forEach((element) => element.classList.remove("target"));
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    target.classList.add("target");
    target.scrollIntoView();
  }
  addEventListener("hashchange", reveal);
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[href^='#']");
    if (link && link.hash === location.hash) reveal();
  });
  reveal();

  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) { watcher.unobserve(entry.target); prepare().then(() => draw(entry.target)); }
  }, { rootMargin: "200px" });
  document.querySelectorAll("figure[data-o]").forEach((figure) => watcher.observe(figure));

  addEventListener("beforeprint", () => {
    if (!curves) return;
    document.querySelectorAll("details[open] figure[data-o]").forEach((figure) => { if (figure.offsetParent) draw(figure); });
    document.documentElement.classList.add("paper");
    redraw({ width: 430, height: 380 });  // of half a page; see the style for print
  });
  addEventListener("afterprint", () => { document.documentElement.classList.remove("paper"); redraw(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw());
})();
