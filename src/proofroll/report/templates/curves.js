// Data of one figure. Above: the curves. Below: their distances from the truth on a logarithmic axis, with
// the truth's error bar, the tolerances, and at the left the limits of small steps with their error bars.
// A figure is described by { rows, time, observable, off, paint }: `off` holds the rows that are switched off, `paint` gives
// the colour of a name.
const picture = (() => {
  const LIMITS = 0.14;  // part of the width for the limits of small steps
  const unit = ({ observable }) => (observable.unit ? ` ${observable.unit}` : "");
  const digits = (value) => String(Number(value.toPrecision(4)));
  const short = (value) => (value === null ? "∞" : String(Number(value.toPrecision(3))));
  const limited = ({ observable }) => observable.engines.filter(({ limit }) => limit && limit[0] !== null && limit[1] !== null && limit[0] + limit[1] > 0);

  // A trace belongs to one row, or to several; it is shown while one of them is.
  const visible = (meta, off) => (Array.isArray(meta) ? meta.some((row) => !off.has(row)) : !off.has(meta));

  function traces(figure) {
    const { rows, time, observable, off, paint } = figure;
    const label = (name, what) => (x, y) => [name, `t = ${digits(x)} s`, `${what} ${digits(y)}${unit(figure)}`];
    const above = [], below = [];
    for (const { row, difference, at } of observable.engines) {
      const { name, colour, dash, width, opacity, symbol } = rows[row];
      const where = at ?? [...time.keys()];
      // Symbols above only where the curve differs visibly from the truth, which they would hide otherwise.
      const apart = difference.some((d) => Math.abs(d) > 0.02 * observable.scale);
      const shared = {
        type: "scatter", mode: "lines+markers", opacity, x: where.map((i) => time[i]), meta: row,
        line: { color: paint(`--e${colour}`), dash, width }, marker: { symbol, size: 6, maxdisplayed: 9, color: paint(`--e${colour}`) },
      };
      const sum = (i, k) => (difference[k] === null ? null : observable.truth[i] + difference[k]);
      above.push({ ...shared, mode: apart ? "lines+markers" : "lines", y: where.map(sum), told: label(name, `${observable.symbol} =`) });
      below.push({ ...shared, yaxis: "y2", y: difference.map((d) => (d ? Math.abs(d) : null)), told: label(name, "distance") });
    }
    const truth = {
      type: "scatter", mode: "lines", x: time, y: observable.truth, meta: -1, line: { color: paint("--truth"), width: 6 },
      told: label("truth", `${observable.symbol} =`),
    };
    const all = [truth, ...above, ...below, ...tolerances(figure), ...limits(figure), ...marks(figure)];
    return all.map((trace) => ({ ...trace, visible: visible(trace.meta, off) }));
  }

  // One line for each tolerance, in ink where several rows have it.
  function tolerances(figure) {
    const { rows, time, observable, paint } = figure;
    return [...shared(observable)].map(([value, having]) => ({
      type: "scatter", mode: "lines", yaxis: "y2", x: [time[0], time[time.length - 1]], y: [value, value], meta: having,
      line: { color: having.length > 1 ? paint("--ink") : paint(`--e${rows[having[0]].colour}`), width: 1, dash: "dash" },
      told: () => [`tolerance ${short(value)}${unit(figure)}`, ...having.map((row) => rows[row].name)],
    }));
  }

  function shared({ engines }) {
    const found = new Map();
    for (const { row, tolerance } of engines)
      if (tolerance) found.set(tolerance, [...(found.get(tolerance) ?? []), row]);
    return found;
  }

  // Limit of a ladder of steps with its error bar: a whisker that reaches the bottom includes the truth.
  function limits(figure) {
    const { rows, paint } = figure;
    return limited(figure).map(({ row, limit: [error, bar, order] }, place) => {
      const { name, colour, symbol, opacity } = rows[row], color = paint(`--e${colour}`), y = error || bar;
      return {
        type: "scatter", mode: "markers", xaxis: "x2", yaxis: "y2", x: [place], y: [y], meta: row, opacity, marker: { symbol, size: 6, color },
        error_y: { type: "data", symmetric: false, array: [error + bar - y], arrayminus: [y - Math.max(error - bar, 1e-30)], color, thickness: 1.2, width: 2 },
        told: () => [name, `limit of small steps: distance ${short(error)} ± ${short(bar)}${unit(figure)}`, ...(order === null ? [] : [`observed order ${short(order)}`])],
      };
    });
  }

  // Events that a kind of element marks, drawn on the bound that the curve must reach for one to happen.
  function marks({ rows, observable, paint }) {
    return (observable.marks ?? []).map(({ row, time, name: event }) => ({
      type: "scatter", mode: "markers", x: [time], y: [observable.bounds[0].value], meta: row, name: event,
      marker: row < 0
        ? { symbol: "diamond", size: 12, color: paint("--truth") }
        : { symbol: "circle-open", size: 9, color: paint(`--e${rows[row].colour}`), line: { width: rows[row].width } },
      told: (x) => [row < 0 ? "truth" : rows[row].name, `${event} at ${Number(x.toPrecision(7))} s`],
    }));
  }

  // The frame follows the truth: an engine that flies off must not flatten it.
  function frame({ truth, scale, bounds }) {
    const known = [...truth, ...(bounds ?? []).map(({ value }) => value)].filter((v) => v !== null);
    const low = Math.min(...known), high = Math.max(...known);
    const half = Math.max(0.65 * (high - low), 0.03 * scale) || 1;
    return [(low + high) / 2 - half, (low + high) / 2 + half];
  }

  // Decades of the lower half: for all distances but the smallest 5 %, tolerances, limits and the truth's error bar.
  function decades(figure) {
    const { engines, error_bar: bar } = figure.observable, ends = [...shared(figure.observable).keys()];
    for (const { difference } of engines) {
      const sizes = difference.filter((d) => d).map(Math.abs).sort((a, b) => a - b);
      if (sizes.length) ends.push(sizes[Math.floor(sizes.length / 20)], sizes[sizes.length - 1]);
    }
    for (const { limit: [error, width] } of limited(figure)) ends.push(error || width);
    if (bar) ends.push(bar / 3, 2 * bar);
    if (!ends.length) return [-18, -12];
    const least = 1e-18 * figure.observable.scale;  // less than the rounding of anything
    return [Math.log10(Math.max(least, Math.min(...ends))) - 0.2, Math.log10(Math.max(...ends)) + 0.3];
  }

  // Letters beside lines.
  function names(figure) {
    const { observable, paint } = figure, said = [...shared(observable)];
    const text = { font: { size: 11 } };
    const bounds = (observable.bounds ?? []).map(({ name, value }) => ({
      ...text, xref: "x domain", x: 1, yref: "y", y: value, xanchor: "right", yanchor: "bottom", text: `${name} = ${value}`,
    }));
    const small = { ...text, xref: "x domain", x: 0, yref: "y2", xanchor: "left", yanchor: "bottom", font: { size: 10, color: paint("--muted") } };
    if (said.length === 1) bounds.push({ ...small, y: said[0][0], text: `tolerance ${short(said[0][0])}` });
    if (observable.error_bar) bounds.push({ ...small, y: observable.error_bar, text: `truth ±${short(observable.error_bar)}` });
    return bounds;
  }

  function shapes({ observable, paint }, low) {
    const line = { type: "line", line: { color: paint("--ink"), width: 1, dash: "dash" } };
    const found = (observable.bounds ?? []).map(({ value }) => ({ ...line, xref: "x domain", x0: 0, x1: 1, yref: "y", y0: value, y1: value }));
    for (const { time } of (observable.marks ?? []).filter(({ row }) => row < 0))
      found.push({ type: "line", xref: "x", x0: time, x1: time, yref: "paper", y0: 0, y1: 1, layer: "below", line: { color: paint("--muted"), width: 1, dash: "dot" } });
    if (observable.error_bar)
      found.push({ type: "rect", xref: "paper", x0: 0, x1: 1, yref: "y2", y0: 10 ** low, y1: observable.error_bar, fillcolor: paint("--bar"), line: { width: 0 }, layer: "below" });
    return found;
  }

  function layout(figure, size) {
    const { observable, paint } = figure, log = decades(figure), count = limited(figure).length;
    const axis = { gridcolor: paint("--rule") }, title = (text) => ({ text }), inside = observable.unit ? ` [${observable.unit}]` : "";
    return {
      ...size, margin: { l: 64, r: figure.room, t: 8, b: 40 },
      font: { family: paint("--sans"), size: 12, color: paint("--ink") },
      hoverlabel: { bgcolor: paint("--paper"), bordercolor: paint("--muted"), font: { color: paint("--ink") } },
      xaxis: { ...axis, domain: [count ? LIMITS + 0.13 : 0, 1], range: span(figure), title: title("time [s]") },
      yaxis: { ...axis, domain: [0.5, 1], range: frame(observable), title: title(observable.symbol + inside) },
      yaxis2: {
        ...axis, domain: [0, 0.44], type: "log", range: log, dtick: Math.max(1, Math.ceil((log[1] - log[0]) / 5)),
        title: title("distance" + inside),
      },
      ...(count && { xaxis2: {
        domain: [0, LIMITS], range: [-0.8, count - 0.2], title: title("limit"),
      } }),
      annotations: names(figure), shapes: shapes(figure, log[0]),
    };
  }

  const span = ({ time }) => [time[0], time[time.length - 1]];

  return { traces, layout, visible, span };
})();
