// Draws a figure as SVG from traces and a layout: two halves over one time axis, the lower one logarithmic, and at its left
// the limits of small steps. It tells of zooms ("zoom") and of the sample at the pointer ("point") by events.
const chart = (() => {
  const NS = document.querySelector("svg").namespaceURI, OUTLINES = {{ outlines|tojson }};
  const DASHES = { dash: "6 3", dot: "2 2", dashdot: "6 2 2 2", longdash: "11 3", longdashdot: "11 3 2 3" };
  const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹", NEAR = 24;  // farthest that a pointer may be from a sample that it shows [px]
  let count = 0;

  function make(name, attributes, parent, text) {
    const made = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) if (value !== undefined && value !== null) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    parent?.append(made);
    return made;
  }

  const logarithmic = (axis) => axis.type === "log";
  const power = (exponent) => `10${exponent < 0 ? "⁻" : ""}${[...String(Math.abs(exponent))].map((digit) => SUPERSCRIPTS[digit]).join("")}`;

  // Ticks of an axis: place and label.
  function ticks({ range: [low, high], dtick, type }, most) {
    if (type === "log") {
      const first = Math.ceil(low / dtick - 1e-9) * dtick, found = [];
      for (let at = first; at <= high + 1e-9; at += dtick) found.push([10 ** at, power(Math.round(at))]);
      return found;
    }
    const rough = (high - low) / most, size = 10 ** Math.floor(Math.log10(rough));
    const step = size * [1, 2, 5, 10].find((factor) => factor * size >= rough), found = [];
    for (let at = Math.ceil(low / step - 1e-9) * step; at <= high + 1e-9 * step; at += step) found.push([at, String(Math.abs(at) < 1e-9 * step ? 0 : Number(at.toPrecision(6)))]);
    return found;
  }

  // From values to pixels: of the axis of a trace or a shape.
  function scales(element) {
    const { layout } = element, { margin } = layout;
    const width = layout.width ?? element.clientWidth, height = layout.height ?? element.clientHeight;
    const across = width - margin.l - margin.r, down = height - margin.t - margin.b;
    const scale = (axis, start, length) => {
      const [low, high] = axis.range, [from, to] = axis.domain ?? [0, 1];
      const part = (value) => ((logarithmic(axis) ? Math.log10(value) : value) - low) / (high - low);
      const place = (share) => start + length * (from + (to - from) * share);
      return Object.assign((value) => place(part(value)), { axis, place, low: place(0), high: place(1) });
    };
    const x = (axis) => scale(axis, margin.l, across), y = (axis) => scale(axis, margin.t + down, -down);
    return { width, height, x: x(layout.xaxis), y: y(layout.yaxis), y2: y(layout.yaxis2), ...(layout.xaxis2 && { x2: x(layout.xaxis2) }), paper: { left: margin.l, right: margin.l + across, top: margin.t, bottom: margin.t + down } };
  }
  const of = (places, trace) => [places[trace.xaxis ?? "x"], places[trace.yaxis ?? "y"]];

  function grid(svg, places, layout) {
    const lines = make("g", { stroke: layout.yaxis.gridcolor }, svg), words = make("g", { fill: layout.font.color, "font-size": 11 }, svg);
    const { x, y, y2, x2 } = places, across = Math.max(2, (x.high - x.low) / 70);
    for (const [value, label] of ticks(x.axis, across)) {
      for (const half of [y, y2]) make("path", { d: `M${x(value)} ${half.low}V${half.high}` }, lines);
      make("text", { x: x(value), y: y2.low + 14, "text-anchor": "middle" }, make("g", { class: "xtick" }, words), label);
    }
    for (const half of [y, y2]) {
      const left = half === y2 && x2 ? x2 : x;
      for (const [value, label] of ticks(half.axis, 5)) {
        make("path", { d: `M${x.low} ${half(value)}H${x.high}` }, lines);
        make("text", { x: left.low - 5, y: half(value) + 4, "text-anchor": "end" }, words, label);
      }
      make("text", { transform: `translate(12 ${(half.low + half.high) / 2}) rotate(-90)`, "text-anchor": "middle" }, words, half.axis.title.text);
    }
    make("text", { x: (x.low + x.high) / 2, y: y2.low + 32, "text-anchor": "middle" }, words, x.axis.title.text);
    if (x2) {
      make("path", { d: `M${x2.low} ${y2.low}H${x2.high}` }, lines);
      make("text", { x: (x2.low + x2.high) / 2, y: y2.low + 14, "text-anchor": "middle" }, words, x2.axis.title.text);
    }
  }

  function shape(parent, places, { type, xref, yref, x0, x1, y0, y1, line, fillcolor }) {
    const { paper } = places;
    const across = (value) => (xref === "paper" ? paper.left + value * (paper.right - paper.left) : xref.endsWith("domain") ? places.x.place(value) : places.x(value));
    const down = (value) => (yref === "paper" ? paper.bottom + value * (paper.top - paper.bottom) : places[yref](value));
    if (type === "line") make("path", { d: `M${across(x0)} ${down(y0)}L${across(x1)} ${down(y1)}`, stroke: line.color, "stroke-width": line.width, "stroke-dasharray": DASHES[line.dash] }, parent);
    else make("rect", { x: across(x0), y: down(y1), width: across(x1) - across(x0), height: Math.max(0, down(y0) - down(y1)), fill: fillcolor }, parent);
  }

  // Path through the samples of a trace; a gap where there is none.
  function path(trace, x, y) {
    let open = false;
    return trace.x.map((at, k) => {
      const value = trace.y[k], there = value !== null && (!logarithmic(y.axis) || value > 0);
      const step = there ? `${open ? "L" : "M"}${x(at).toFixed(1)} ${Math.max(-1e4, Math.min(1e4, y(value))).toFixed(1)}` : "";
      open = there;
      return step;
    }).join("");
  }

  function curve(parent, places, trace) {
    const [x, y] = of(places, trace), group = make("g", { opacity: trace.opacity }, parent);
    if (trace.mode.includes("lines")) make("path", { class: "line", d: path(trace, x, y), fill: "none", stroke: trace.line.color, "stroke-width": trace.line.width, "stroke-dasharray": DASHES[trace.line.dash], "stroke-linejoin": "round" }, group);
    if (trace.error_y) {
      const [at, value] = [x(trace.x[0]), trace.y[0]], high = y(value + trace.error_y.array[0]), low = Math.min(y(value - trace.error_y.arrayminus[0]), y.low);
      make("path", { d: `M${at} ${low}V${high}M${at - 3} ${high}h6`, stroke: trace.error_y.color, "stroke-width": 1.2, fill: "none" }, group);
    }
    if (!trace.mode.includes("markers")) return;
    const { symbol, color, size, maxdisplayed, line } = trace.marker, every = maxdisplayed ? Math.ceil(trace.x.length / maxdisplayed) : 1;
    const hollow = symbol.endsWith("-open"), outline = OUTLINES[symbol.replace("-open", "")];
    for (let k = 0; k < trace.x.length; k += every) {
      const value = trace.y[k];
      if (value === null || trace.x[k] === null || (logarithmic(y.axis) && !(value > 0))) continue;
      make("path", { class: "mark", d: outline, transform: `translate(${x(trace.x[k])} ${y(value)}) scale(${size / 7})`, fill: hollow ? "none" : color, stroke: hollow ? color : undefined, "stroke-width": hollow ? (line?.width ?? 1.2) : undefined }, group);
    }
  }

  function annotation(parent, places, note) {
    const [x, y] = [places.x, places[note.yref.split(" ")[0]]];
    const left = x.place(note.x) + (note.xshift ?? 0), top = note.yref.endsWith("domain") ? y.place(note.y) : y(note.y);
    const group = make("g", { class: "annotation" }, parent);
    const text = make("text", { x: left, y: top + (note.yanchor === "middle" ? 3.5 : -3), "text-anchor": note.xanchor === "right" ? "end" : "start", "font-size": note.font.size, fill: note.font.color ?? places.ink }, group);
    if (note.tone) make("tspan", { fill: note.tone }, text, "● ");
    make("tspan", {}, text, note.text);
    if (note.hovertext) make("title", {}, text, note.hovertext);
  }

  function render(element) {
    const { layout } = element, places = { ...scales(element), ink: layout.font.color };
    const { width, height, x, y, y2 } = places, clip = `clip${++count}`;
    const svg = make("svg", { class: "main-svg", width, height, viewBox: `0 0 ${width} ${height}`, "font-family": layout.font.family });
    const parts = make("defs", {}, svg), halves = {};
    for (const [name, half] of [["y", y], ["y2", y2]]) make("rect", { x: places.paper.left, y: half.high, width: places.paper.right - places.paper.left, height: half.low - half.high }, make("clipPath", { id: `${clip}${name}` }, parts));
    layout.shapes.filter(({ layer }) => layer === "below").forEach((item) => shape(svg, places, item));
    grid(svg, places, layout);
    for (const name of ["y", "y2"]) halves[name] = make("g", { "clip-path": `url(#${clip}${name})` }, svg);
    element.data.filter(({ visible }) => visible).forEach((trace) => curve(halves[trace.yaxis ?? "y"], places, trace));
    layout.shapes.filter(({ layer }) => layer !== "below").forEach((item) => shape(svg, places, item));
    layout.annotations.forEach((item) => annotation(svg, places, item));
    make("g", { class: "pointer", "pointer-events": "none" }, svg);
    element.replaceChildren(svg);
    element.places = places;
    if (element.at) hover(element, ...element.at);
  }

  // Shows the sample of a trace with its label; nothing without a number of a trace.
  function hover(element, number, sample) {
    const layer = element.querySelector(".pointer");
    layer.replaceChildren();
    element.at = number === undefined ? null : [number, sample];
    if (!element.at) return;
    const trace = element.data[number], [x, y] = of(element.places, trace), { layout, places } = element;
    const at = x(trace.x[sample]), top = Math.min(y.low, Math.max(y.high, y(trace.y[sample])));
    const right = at > places.width / 2, label = make("g", { class: "hovertext" }, layer);
    make("circle", { cx: at, cy: top, r: 3.5, fill: trace.line?.color ?? trace.marker.color, stroke: layout.hoverlabel.bgcolor }, layer);
    const box = make("rect", { fill: layout.hoverlabel.bgcolor, stroke: layout.hoverlabel.bordercolor, rx: 3 }, label);
    const text = make("text", { "font-size": 11, fill: layout.hoverlabel.font.color }, label);
    trace.told(trace.x[sample], trace.y[sample]).forEach((line, k) => make("tspan", { x: 0, dy: k ? 14 : 0, "font-weight": k ? undefined : 650 }, text, line));
    const size = text.getBBox(), shift = [right ? at - size.width - 14 : at + 14, Math.min(Math.max(top - size.height / 2, 2), places.height - size.height - 4) - size.y];
    for (const [key, value] of Object.entries({ x: size.x - 4, y: size.y - 2, width: size.width + 8, height: size.height + 4 })) box.setAttribute(key, value);
    label.setAttribute("transform", `translate(${shift.join(" ")})`);
  }

  // The visible sample next to a place [px]; nothing where none is near.
  function nearest(element, left, top) {
    let found, least = NEAR;
    element.data.forEach((trace, number) => {
      if (!trace.visible || !trace.told) return;
      const [x, y] = of(element.places, trace);
      trace.x.forEach((value, sample) => {
        if (trace.y[sample] === null) return;
        const away = Math.hypot(x(value) - left, y(trace.y[sample]) - top);
        if (away < least) [least, found] = [away, [number, sample]];
      });
    });
    return found;
  }

  function zoom(element, range) {
    element.layout = { ...element.layout, xaxis: { ...element.layout.xaxis, range } };
    element.dispatchEvent(new CustomEvent("zoom", { detail: range }));
  }

  // Dragging along time zooms there; two clicks return to the whole time.
  function listen(element) {
    let from = null, marked = null;
    const place = (event) => { const box = element.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    const time = (left) => { const { x } = element.places, [low, high] = x.axis.range; return low + ((left - x.low) / (x.high - x.low)) * (high - low); };
    element.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch" || event.button) return;
      [from] = place(event);
      element.setPointerCapture(event.pointerId);
    });
    element.addEventListener("pointermove", (event) => {
      const [left, top] = place(event);
      if (from === null) {
        const found = nearest(element, left, top);
        if (String(found) === String(element.at ?? undefined)) return;
        hover(element, ...(found ?? []));
        element.dispatchEvent(new CustomEvent("point", { detail: found ? element.data[found[0]].x[found[1]] : null }));
        return;
      }
      marked?.remove();
      const { y, y2 } = element.places;
      marked = make("rect", { x: Math.min(from, left), y: y.high, width: Math.abs(left - from), height: y2.low - y.high, fill: element.layout.font.color, opacity: 0.12 }, element.querySelector("svg"));
    });
    element.addEventListener("pointerup", (event) => {
      marked?.remove();
      const [left] = place(event), start = from;
      from = null;
      if (start !== null && Math.abs(left - start) > 5) zoom(element, [time(Math.min(start, left)), time(Math.max(start, left))]);
    });
    element.addEventListener("pointerleave", () => {
      if (!element.at) return;
      hover(element);
      element.dispatchEvent(new CustomEvent("point", { detail: null }));
    });
    element.addEventListener("dblclick", () => zoom(element, element.whole));
    new ResizeObserver(() => element.dispatchEvent(new CustomEvent("resized"))).observe(element);
  }

  // Draws an element anew; `whole`: the time to which two clicks return.
  function draw(element, traces, layout, whole) {
    if (!element.places) listen(element);
    Object.assign(element, { data: traces, layout, whole });
    render(element);
  }

  return { draw, hover, zoom };
})();
