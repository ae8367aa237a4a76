// Error against speed: a curve for each setting, that of each engine's cheapest choice strong, names at the fast ends.
// Drawn when it comes into view; the quantity is chosen beside it, engines, tolerance and whether forces count on the
// first screen.
(() => {
  const SYMBOLS = {{ outlines|list|tojson }};
  const LARGEST = 1, LEAST = 1e-17;  // errors beyond the quantity's size tell nothing more, and are left out
  const MARGIN = { l: 52, r: 12, t: 8, b: 40 }, LINE = 14, LETTER = 6.4;  // of the plot; a name's height and a letter's width [CSS px]
  const WIDE = 700;  // width from which there is room for the names of all formulations [CSS px]
  const drawn = new Map();  // part of the page -> its plotly element
  const slider = document.getElementById("tolerance");
  const { paint } = plots, literal = picture.literal;
  const short = (value) => (value >= 1e300 ? "∞" : String(Number(value.toPrecision(2))));
  const decade = () => Number(slider?.value ?? {{ first_decade }});
  const title = (engine) => parts.data.titles[engine] ?? engine;
  const tall = (width) => (width < 520 ? 360 : 430);
  let parts;

  // Points with a value of the quantity, without hidden engines.
  function curves(study, quantity) {
    const off = new Set([...document.querySelectorAll("[name=engine]:not(:checked)")].map((box) => box.value));
    const found = study.curves.filter(({ engine }) => !off.has(engine)).map((curve) => ({
      ...curve,
      points: curve.points.filter(([, cost, , , errors]) => cost > 0 && errors[quantity] !== null && errors[quantity] <= LARGEST)
        .map(([step, cost, clean, verdict, errors, held]) => ({ step, cost, clean, verdict, error: errors[quantity], held: held[quantity], y: Math.max(errors[quantity], LEAST) })),
    }));
    // Of a setting the steps of which none is cheaper and as accurate.
    return found.map((curve) => ({ ...curve, points: front(curve.points) })).filter(({ points }) => points.length);
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

  // Names at the fast ends of curves: those that would cover another go down.
  function labels(curves, at, width) {
    const boxes = [];
    return curves.map((curve) => ({ curve, end: curve.points.reduce((best, point) => (point.cost < best.cost ? point : best)) })).sort((a, b) => b.end.y - a.end.y).map(({ curve, end }) => {
      const text = `${title(curve.engine)} ${curve.name.replaceAll("_", " ")}`, long = LETTER * text.length + 6, [x, y] = at(end);
      const left = x + 8 + long > width ? x - 8 - long : x + 8;
      let top = y, hit;
      while ((hit = boxes.find((box) => left < box.left + box.long && box.left < left + long && Math.abs(top - box.top) < LINE))) top = hit.top + LINE;
      boxes.push({ left, top, long });
      return {
        x: Math.log10(1 / end.cost), y: Math.log10(end.y), xanchor: left > x ? "left" : "right", yanchor: "middle", xshift: left > x ? 8 : -8, yshift: y - top,
        text: curve.strong ? `<b>${literal(text)}</b>` : literal(text), showarrow: false, font: { size: 12, color: paint(curve.strong ? "--ink" : "--muted") },
      };
    });
  }
  function content(study, quantity, width) {
    const all = curves(study, quantity), engines = [...new Set(study.curves.map(({ engine }) => engine))], height = tall(width);
    const coloured = [...new Set([...parts.data.engines, ...engines])];  // each has one colour on the page
    const points = all.flatMap(({ points }) => points), speeds = points.map(({ cost }) => 1 / cost), held = 10 ** -decade();
    const span = [Math.log10(Math.min(...speeds)) - 0.2, Math.log10(Math.max(...speeds)) + 0.3];
    const errors = [Math.log10(Math.min(...points.map(({ y }) => y), held)) - 0.4, 0.35];
    const best = front(all.filter(({ own }) => !own).flatMap(({ points }) => points)), choice = best.find((point) => point.held <= held);
    const cost = ({ points }) => Math.min(...points.filter((point) => point.held <= held).map((point) => point.cost));
    for (const engine of engines) {
      const [cheapest] = all.filter((curve) => curve.engine === engine && !curve.own && cost(curve) < Infinity).sort((a, b) => cost(a) - cost(b));
      if (cheapest) cheapest.strong = true;
    }
    const at = ({ cost: spent, y }) => [
      MARGIN.l + ((width - MARGIN.l - MARGIN.r) * (Math.log10(1 / spent) - span[0])) / (span[1] - span[0]),
      MARGIN.t + ((height - MARGIN.t - MARGIN.b) * (errors[1] - Math.log10(y))) / (errors[1] - errors[0]),
    ];
    const named = new Map();  // the fastest of each formulation
    for (const curve of all) {
      const key = `${curve.engine} ${curve.formulation}`, fast = ({ points }) => Math.min(...points.map((point) => point.cost));
      if (!named.has(key) || curve.strong || (!named.get(key).strong && fast(curve) < fast(named.get(key)))) named.set(key, curve);
    }
    const axis = { type: "log", gridcolor: paint("--rule"), linecolor: paint("--rule"), zeroline: false, ticks: "", exponentformat: "power" };
    const line = { xref: "paper", x0: 0, x1: 1, y0: held };
    const layout = {
      height, width, margin: MARGIN, hovermode: "closest", showlegend: false, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom", font: { family: paint("--sans"), size: 11, color: paint("--ink") },
      xaxis: { ...axis, range: span, title: { text: "× real time, faster →", standoff: 4 }, ...(span[1] - span[0] > 1.5 && { dtick: 1 }) },
      yaxis: { ...axis, range: errors, nticks: 8, title: { text: "error", standoff: 4 } },
      annotations: labels([...named.values()].filter(({ strong }) => strong || width >= WIDE), at, width),
      shapes: [{ ...line, type: "rect", y1: 10 ** errors[0], fillcolor: paint("--agrees-bg"), line: { width: 0 }, layer: "below", opacity: 0.55 }, { ...line, type: "line", y1: held, line: { color: paint("--agrees"), width: 1.5 } }],
      hoverlabel: { bgcolor: paint("--paper"), bordercolor: paint("--muted"), font: { color: paint("--ink") }, align: "left" },
    };
    const traces = all.map((curve, place) => {
      const color = curve.own ? paint("--witness") : paint(`--e${coloured.indexOf(curve.engine) % 8}`), symbol = SYMBOLS[place % SYMBOLS.length];
      return {
        type: "scatter", name: literal(curve.name), mode: "lines+markers", x: curve.points.map((point) => 1 / point.cost), y: curve.points.map((point) => point.y),
        line: { color, width: curve.strong ? 2.6 : 1.2, dash: curve.own ? "dot" : "solid" }, opacity: curve.strong ? 1 : 0.55,
        marker: { color, size: curve.strong ? 6 : 4, symbol: curve.points.map(({ clean }) => (clean ? symbol : `${symbol}-open`)) },
        hovertemplate: curve.points.map((point) => told(curve, point)),
      };
    });
    if (choice) traces.push({ type: "scatter", mode: "markers", x: [1 / choice.cost], y: [choice.y], hoverinfo: "skip", name: "choice", marker: { symbol: "circle-open", size: 16, color: paint("--ink"), line: { width: 2 } } });
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
    canvas.style.height = `${tall(canvas.clientWidth || each.closest("main").clientWidth)}px`;
    near.observe(each);
  }));
  document.addEventListener("change", (event) => { if (drawn.has(event.target.closest(".precision"))) show(event.target.closest(".precision")); });
  document.addEventListener("change", ({ target }) => { if (target.matches("#tolerance, #forces, [name=engine]")) again(); });
  addEventListener("beforeprint", again);
  addEventListener("afterprint", again);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
})();
