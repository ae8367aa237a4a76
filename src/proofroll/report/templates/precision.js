// Error against cost: a panel for each engine, the others in grey. Drawn when it comes into view; the quantity is
// chosen beside it, engines, tolerance and whether forces count on the first screen.
(() => {
  const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"], SYMBOLS = {{ outlines|list|tojson }};
  const LARGEST = 1, LEAST = 1e-17;  // errors beyond the quantity's size tell nothing more, and are left out
  const PANEL = 215, TICKS = 38, ENTRY = 19, HEAD = 22;  // heights of a panel and of what is around it [CSS px]
  const drawn = new Map();  // part of the page -> its plotly element
  const slider = document.getElementById("tolerance");
  const { paint } = plots, literal = picture.literal;
  const short = (value) => (value >= 1e300 ? "∞" : String(Number(value.toPrecision(2))));
  const decade = () => Number(slider?.value ?? {{ first_decade }});
  const title = (engine) => parts.data.titles[engine] ?? engine;
  let parts;

  // Points with a value of the quantity, without hidden engines.
  function curves(study, quantity) {
    const off = new Set([...document.querySelectorAll("[name=engine]:not(:checked)")].map((box) => box.value));
    const found = study.curves.filter(({ engine }) => !off.has(engine)).map((curve, number) => ({
      ...curve, number,
      points: curve.points.filter(([, cost, , , errors]) => cost > 0 && errors[quantity] !== null && errors[quantity] <= LARGEST)
        .map(([step, cost, clean, verdict, errors, held]) => ({ step, cost, clean, verdict, error: errors[quantity], held: held[quantity], y: Math.max(errors[quantity], LEAST) })),
    }));
    return found.filter(({ points }) => points.length);
  }
  function front(points) {
    const best = [];
    for (const point of [...points].sort((a, b) => a.cost - b.cost || a.held - b.held))
      if (point.held <= LARGEST && (!best.length || point.held < best[best.length - 1].held)) best.push(point);
    return best;
  }
  function told({ name, engine }, { step, cost, clean, verdict, error, held }) {
    const answer = held <= 10 ** -decade() ? "holds" : error <= 10 ** -decade() ? "by luck, finer steps are worse:" : "does not hold";
    return `<b>${literal(`${title(engine)} ${name}`)}</b><br>${literal(step || "its own steps")}<br>error ${short(error)} of the size: ${answer} 1e-${decade()}` +
      `<br>cost ${clean ? "" : "≈ "}${short(cost)} s/s<br>${verdict ? `verdict: ${literal(verdict)}` : "a step of its ladder"}<extra></extra>`;
  }

  // Heights of the rows of panels. Each has its settings below, where they lie over no point: as many lines as its longest list.
  function sized(entries, width) {
    const columns = Math.max(1, Math.min(entries.length, Math.floor(width / 330))), rows = Math.ceil(entries.length / columns) || 1;
    const blocks = [...Array(rows).keys()].map((row) => PANEL + TICKS + ENTRY * Math.max(...entries.slice(row * columns, (row + 1) * columns), 0) + (row < rows - 1 && HEAD));
    return { columns, blocks, total: blocks.reduce((sum, block) => sum + block, 0) };
  }
  function content(study, quantity, width) {
    const all = curves(study, quantity), engines = [...new Set(study.curves.map(({ engine }) => engine))];
    const coloured = [...new Set([...parts.data.engines, ...engines])];  // each has one colour on the page
    const shown = engines.filter((engine) => all.some((curve) => curve.engine === engine));
    const { columns, blocks, total } = sized(shown.map((engine) => all.filter((curve) => curve.engine === engine).length), width);
    const points = all.flatMap(({ points }) => points), costs = points.map(({ cost }) => cost);
    const span = [Math.log10(Math.min(...costs)) - 0.3, Math.log10(Math.max(...costs)) + 0.3];
    const least = Math.min(...points.map(({ y }) => y), 10 ** -decade());
    const best = front(all.filter(({ own }) => !own).flatMap(({ points }) => points));
    const choice = best.find(({ held }) => held <= 10 ** -decade());
    const layout = {
      height: total + HEAD + 8, width, margin: { l: 52, r: 8, t: HEAD, b: 8 }, hovermode: "closest", showlegend: true,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom",
      font: { family: paint("--sans"), size: 11, color: paint("--ink") }, annotations: [], shapes: [],
      hoverlabel: { bgcolor: paint("--paper"), bordercolor: paint("--muted"), font: { color: paint("--ink") }, align: "left" },
    };
    const traces = [];
    shown.forEach((engine, at) => {
      const tail = at ? String(at + 1) : "", column = at % columns, row = Math.floor(at / columns);
      const gap = 0.12 / columns, wide = (1 - gap * (columns - 1)) / columns;
      const x = [column * (wide + gap), column * (wide + gap) + wide], top = 1 - blocks.slice(0, row).reduce((sum, block) => sum + block, 0) / total, y = [top - PANEL / total, top];
      const axis = { type: "log", gridcolor: paint("--rule"), linecolor: paint("--rule"), zeroline: false, ticks: "", exponentformat: "power" };
      layout[`xaxis${tail}`] = { ...axis, domain: x, anchor: `y${tail}`, range: span, ...(at && { matches: "x" }), title: { text: "cost [s/s]", standoff: 4 }, ...(span[1] - span[0] > 1.5 && { dtick: Math.ceil((span[1] - span[0]) / 6) }) };
      layout[`yaxis${tail}`] = { ...axis, domain: y, anchor: `x${tail}`, range: [Math.log10(least) - 0.4, 0.35], ...(at && { matches: "y" }), nticks: 8, ...(!column && { title: { text: "error", standoff: 4 } }) };
      layout[`legend${tail}`] = { x: x[0], y: y[0] - TICKS / total, xanchor: "left", yanchor: "top", bgcolor: "rgba(0,0,0,0)", font: { size: 11 }, tracegroupgap: 0 };
      layout.annotations.push({ text: `<b>${literal(title(engine))}</b>`, showarrow: false, xref: "paper", yref: "paper", x: x[0], y: y[1], xanchor: "left", yanchor: "bottom" });
      layout.shapes.push({ type: "line", xref: `x${tail} domain`, yref: `y${tail}`, x0: 0, x1: 1, y0: 10 ** -decade(), y1: 10 ** -decade(), line: { color: paint("--muted"), width: 1, dash: "dash" } });
      const here = { type: "scatter", xaxis: `x${tail}`, yaxis: `y${tail}`, legend: `legend${tail}` };
      const others = all.filter((curve) => curve.engine !== engine).flatMap(({ points }) => [...points, { cost: null, y: null }]);
      traces.push({ ...here, mode: "lines+markers", x: others.map(({ cost }) => cost), y: others.map((point) => point.y), line: { color: paint("--muted"), width: 0.8 }, marker: { color: paint("--muted"), size: 3 }, opacity: 0.55, hoverinfo: "skip", showlegend: false });
      if (best.length) traces.push({
        ...here, mode: "lines", x: [...best.map(({ cost }) => cost), 10 ** span[1]], y: [...best, best[best.length - 1]].map(({ held }) => Math.max(held, LEAST)),
        line: { color: paint("--truth"), width: 5, shape: "hv" }, hoverinfo: "skip", showlegend: false,
      });
      const formulations = [...new Set(all.filter((curve) => curve.engine === engine).map(({ formulation }) => formulation))];
      const color = paint(`--e${coloured.indexOf(engine) % 8}`);
      all.filter((curve) => curve.engine === engine).forEach((curve, place) => {
        const symbol = SYMBOLS[place % SYMBOLS.length];
        traces.push({
          ...here, name: literal(curve.name), mode: "lines+markers", x: curve.points.map(({ cost }) => cost), y: curve.points.map((point) => point.y),
          line: { color, width: 1.5, dash: DASHES[formulations.indexOf(curve.formulation) % DASHES.length] },
          marker: { color, size: 6, symbol: curve.points.map(({ clean }) => (clean ? symbol : `${symbol}-open`)) },
          hovertemplate: curve.points.map((point) => told(curve, point)),
        });
        if (curve.points.includes(choice)) traces.push({
          ...here, mode: "markers", x: [choice.cost], y: [choice.y], hoverinfo: "skip", showlegend: false, name: "choice",
          marker: { symbol: "circle-open", size: 16, color: paint("--ink"), line: { width: 2 } },
        });
      });
    });
    return { traces, layout };
  }

  function show(part) {
    const element = part.querySelector(".canvas"), width = document.documentElement.classList.contains("paper") ? 900 : element.clientWidth;
    const { traces, layout } = content(parts.data.precision[part.dataset.precision], Number(part.querySelector("select").value), width);
    element.style.height = `${layout.height}px`;
    parts.Plotly.react(element, traces, layout, { displayModeBar: false, doubleClick: "reset" });
    drawn.set(part, element);
  }
  const again = () => [...drawn.keys()].forEach(show);
  const near = new IntersectionObserver((entries) => entries.forEach(async (entry) => {
    if (!entry.isIntersecting) return;
    near.unobserve(entry.target);
    parts = await plots.ready();
    show(entry.target);
    sizes.observe(entry.target.querySelector("figure"));
  }), { rootMargin: "200px" });
  const sizes = new ResizeObserver((changes) => changes.forEach(({ target }) => {
    const part = target.closest(".precision"), element = drawn.get(part);
    if (element.clientWidth && Math.abs(element.layout.width - element.clientWidth) > 1) show(part);
  }));
  everywhere((part) => part.querySelectorAll(".precision").forEach((each) => {
    // The picture has its height before it is drawn, so that nothing moves then.
    const canvas = each.querySelector(".canvas");
    canvas.style.height = `${sized(canvas.dataset.entries.split(" ").map(Number), canvas.clientWidth || each.closest("main").clientWidth).total + HEAD + 8}px`;
    near.observe(each);
  }));
  document.addEventListener("change", (event) => { if (drawn.has(event.target.closest(".precision"))) show(event.target.closest(".precision")); });
  document.addEventListener("change", ({ target }) => { if (target.matches("#tolerance, #forces, [name=engine]")) again(); });
  addEventListener("beforeprint", again);
  addEventListener("afterprint", again);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
})();
