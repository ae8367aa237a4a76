"use strict";
// The replay: unpacks a case, follows the time, and lets the kind of scene write its values and draw its bodies. Without
// WebGL it only writes. `replayed` holds what each kind of scene brings: columns, rows, compare, build, draw, key
// and reach, made from the tools of `replay` below.
(() => {
  const root = document.querySelector(".replay");
  if (!root) return;
  const ui = Object.fromEntries([...root.querySelectorAll("[data-part]")].map((element) => [element.dataset.part, element]));
  const css = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };

  let cases, library, shown, kind, readings = [], time = 0, playing = false, last = 0, queued = false;
  const strip = errorStrip(ui.errors, (to) => { stop(); go(to); }, largest);
  let view = null, stage = null;         // the camera, and what is drawn; null until there is something

  // ---- numbers ----
  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text.trim()), (sign) => sign.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Multiples of a step, as differences from row to row, as int32 whose bytes are sorted by rank: the lowest first.
  function thick(bytes, at, width, length, step) {
    const count = width * length, sorted = new Uint8Array(4 * count);
    for (let rank = 0; rank < 4; rank++) for (let i = 0; i < count; i++) sorted[4 * i + rank] = bytes[at + rank * count + i];
    const sums = new Int32Array(sorted.buffer);
    for (let i = width; i < count; i++) sums[i] += sums[i - width];
    return Float32Array.from(sums, (sum) => sum * step);
  }

  async function load(number) {
    const spec = cases[number], bytes = await unpacked(root.querySelector(`[data-numbers="${number}"]`).textContent);
    const runs = spec.runs.map((run) => ({ ...run })), common = {};
    let at = 0;
    for (const [name, run, width, length, step] of spec.arrays) {
      (run < 0 ? common : runs[run])[name] = { width, length, values: thick(bytes, at, width, length, step) };
      at += 4 * width * length;
    }
    return { ...spec, ...common, runs };
  }

  const place = () => (shown.frames < 2 ? 0 : (time / shown.until) * (shown.frames - 1));
  const until = (run) => (shown.frames < 2 ? shown.until : (shown.until * (run.frames - 1)) / (shown.frames - 1));
  const there = (run) => time <= until(run) + 1e-9;

  // Interpolation between frames: linear for values that may jump, smooth for a path (Catmull-Rom).
  function straight({ values, width, length }) {
    const x = Math.min(place(), length - 1), i = Math.min(Math.floor(x), Math.max(length - 2, 0)), f = x - i;
    const j = Math.min(i + 1, length - 1);
    return Array.from({ length: width }, (_, k) => values[i * width + k] * (1 - f) + values[j * width + k] * f);
  }
  function smooth({ values, width, length }) {
    const x = Math.min(place(), length - 1), i = Math.min(Math.floor(x), Math.max(length - 2, 0)), f = x - i;
    const at = (j, k) => values[Math.max(0, Math.min(length - 1, j)) * width + k];
    return Array.from({ length: width }, (_, k) => {
      const [a, b, c, d] = [at(i - 1, k), at(i, k), at(i + 1, k), at(i + 2, k)];
      return b + 0.5 * f * (c - a + f * (2 * a - 5 * b + 4 * c - d + f * (3 * (b - c) + d - a)));
    });
  }
  const held = ({ values, length }) => values[Math.min(Math.floor(place() + 1e-6), length - 1)];

  // ---- words ----
  const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1").replace("-", "−") : "–");
  const digits = (size, least) => Math.max(0, least - 1 - Math.floor(Math.log10(Math.max(size, 1e-12))));

  // Puts the values of the truth beside the picture: its readings, then what the kind of scene adds; returns the cells
  // of the latter, in the order of their names.
  function values(names) {
    const cells = [...shown.readings.map(({ symbol }) => symbol), ...names].map((name) => [make("dt", {}, name), make("dd")]);
    ui.values.replaceChildren(...cells.flat());
    readings = cells.slice(0, shown.readings.length).map(([, cell]) => cell);
    return cells.slice(shown.readings.length).map(([, cell]) => cell);
  }

  // How far a run is from the truth now: in millimetres of place (`number` −1), or in the unit of a reading.
  const away = (run, number) => (number < 0 ? 1000 * kind.compare(run, true).off
    : run[`reading${number}`] ? Math.abs(smooth(run[`reading${number}`])[0] - smooth(shown.runs[0][`reading${number}`])[0]) : null);

  function rows() {
    const columns = kind.columns(), head = ({ name, unit, number, title }) => {
      const cell = make("th", { scope: "col", ...(number ? { class: "n" } : {}), ...(title ? { title } : {}) }, name);
      if (unit) cell.append(" ", make("small", {}, unit));
      return cell;
    };
    ui.head.closest("table").hidden = shown.runs.length === 1;
    ui.head.replaceChildren(
      head({ name: "ghost" }), head({ name: "off by", unit: "mm", number: true, title: shown.off }), ...columns.map(head),
    );
    ui.runs.replaceChildren(...shown.runs.slice(1).map((run) => {
      const box = make("input", { type: "checkbox" });
      box.checked = run.shown;
      box.addEventListener("change", () => { run.shown = box.checked; update(); });
      const name = make("label", {}, box, make("i", { class: `replay-dot e${run.colour}` }), make("span", {}, run.name.replace(/-(?=\d)/g, "\u2011")));  // 1e-3 stays in one line
      run.cells = [make("td", { class: "n" }), ...columns.map(({ number }) => (
        number ? make("td", { class: "n" }) : make("td", {}, make("span", { "aria-hidden": "true" }), make("span", { class: "vh" }))
      ))];
      run.line = make("tr", {}, make("th", { scope: "row" }, name), ...run.cells);
      return run.line;
    }));
    const notes = shown.runs.filter((run) => run.message).map((run) => `${run.name}: ${run.message}.`);
    ui.events.replaceChildren(...(shown.events.length ? ["The truth:"] : []), ...shown.events.filter((event) => event.time !== null).map((event) => {
      const button = make("button", { type: "button" }, `${event.kind} ${event.time.toFixed(3)} s`);
      button.addEventListener("click", () => { stop(); go(event.time); });
      return button;
    }));
    ui.strip.style.background = "";
    kind.rows(notes);
    ui.notes.textContent = notes.join(" ");
    ui.time.max = shown.until;
    ui.speed.value = shown.speed;
  }

  // Text in millimetres; sizes below `least` are invisible.
  const distance = (mm, least) => (mm < least ? `< ${least}` : fixed(mm, Math.max(0, -Math.log10(least) - (mm >= 1000 * least))));

  function write() {
    ui.clock.textContent = `${time.toFixed(shown.until < 0.1 ? 5 : 3)} of ${Number(shown.until.toPrecision(6))} s`;
    if (document.activeElement !== ui.time || playing) ui.time.value = time;
    ui.time.setAttribute("aria-valuetext", `${time.toFixed(shown.until < 0.1 ? 5 : 3)} seconds`);
    readings.forEach((cell, k) => {
      const { unit, size } = shown.readings[k];
      cell.textContent = `${fixed(smooth(shown.runs[0][`reading${k}`])[0], Math.min(6, digits(size || 1, 4)))} ${unit}`;
    });
    kind.write?.();
    strip.now(time);
    for (const line of document.querySelectorAll("[data-now]")) line.style.left = `${(100 * time) / shown.until}%`;
    for (const run of shown.runs.slice(1)) {
      const here = there(run), { off, texts, sign } = kind.compare(run, here);
      const told = [here ? distance(1000 * off, shown.least) : "gone", ...texts.map((text) => (here ? text : "–"))];
      told.forEach((text, k) => { run.cells[k].textContent = text; });
      const cell = run.cells[told.length];
      if (cell) {
        cell.className = sign.look;
        cell.title = cell.lastChild.textContent = sign.words;
        cell.firstChild.textContent = sign.sign;
      }
      run.line.classList.toggle("off", !run.shown);
    }
  }

  // ---- time ----
  function update() {
    if (queued || !shown) return;
    queued = true;
    requestAnimationFrame((now) => {
      queued = false;
      if (playing) {
        time = Math.min(shown.until, time + Math.min(now - last, 100) * 1e-3 * Number(ui.speed.value));
        last = now;
        if (time >= shown.until) stop(); else update();
      }
      write();
      if (view) draw();
    });
  }
  function go(to) {
    time = Math.max(0, Math.min(shown.until, to));
    ui.time.value = time;
    update();
  }
  function stop() {
    playing = false;
    ui.play.textContent = "▶ Play";
  }
  function play() {
    if (time >= shown.until) time = 0;
    playing = true;
    last = performance.now();
    ui.play.textContent = "❚❚ Pause";
    update();
  }
  const step = (frames) => { stop(); go(((Math.round(place()) + frames) * shown.until) / Math.max(1, shown.frames - 1)); };

  // ---- picture ----
  function start() {
    const probe = document.createElement("canvas");
    if (!library) return "Here stands no picture, for the report was made without three.js (the Python package trimesh); the values follow the time.";
    if (!(probe.getContext("webgl2") ?? probe.getContext("webgl"))) return "Here stands no picture, for this browser has no WebGL; the values follow the time.";
    const script = document.createElement("script");
    script.textContent = library;
    document.head.append(script);
    const T = window.THREE;
    const renderer = new T.WebGLRenderer({ canvas: ui.canvas, antialias: true, alpha: true });
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    view = { T, renderer, camera: new T.PerspectiveCamera(32, 1, 0.001, 1000), turn: 0, lift: 0, distance: 1 };
    view.camera.up.set(0, 0, 1);
    new ResizeObserver(update).observe(ui.canvas.parentNode);
    return "";
  }

  const colour = (name) => new view.T.Color(css(name));

  // An arrow of shaft radius `r`.
  function arrow(r) {
    const { T } = view;
    const material = new T.MeshBasicMaterial({ depthTest: false, transparent: true });
    const shaft = new T.Mesh(new T.LatheGeometry([new T.Vector2(r, 0), new T.Vector2(r, 1)], 12), material);
    const head = new T.Mesh(new T.ConeGeometry(3 * r, 8 * r, 16).translate(0, -4 * r, 0), material);
    const group = new T.Group().add(shaft, head);
    shaft.renderOrder = head.renderOrder = 10;
    return { group, point(from, force, tone) {
      const length = force.length() * stage.perNewton;
      group.visible = ui.forces.checked && length > 0.1 * r;
      if (!group.visible) return;
      group.position.copy(from);
      group.quaternion.setFromUnitVectors(new T.Vector3(0, 1, 0), force.clone().normalize());
      head.position.y = length;
      head.scale.setScalar(Math.min(1, length / (8 * r)));
      shaft.scale.y = Math.max(length - 8 * r * head.scale.x, 1e-9);
      material.color.copy(tone);
    } };
  }

  // A line along the last four tenths of a second of a path: that of the point whose coordinates begin at `column`.
  function path(scene, { values, width, length }, column, tone) {
    const { T } = view, points = new Float32Array(3 * length);
    for (let i = 0; i < length; i++) for (let k = 0; k < 3; k++) points[3 * i + k] = values[i * width + column + k];
    const shape = new T.BufferGeometry();
    shape.setAttribute("position", new T.BufferAttribute(points, 3));
    const line = new T.Line(shape, new T.LineBasicMaterial({ color: new T.Color(tone) }));
    line.frustumCulled = false;
    scene.add(line);
    return { show(run, x) {
      line.visible = ui.paths.checked && (run.shown || run === shown.runs[0]);
      const end = Math.min(Math.floor(x) + 1, run.frames), from = Math.max(0, end - Math.ceil((shown.tail * shown.frames) / shown.until));
      shape.setDrawRange(from, end - from);
    } };
  }

  // The orientation now of the body whose quaternion begins at `column`, scalar first.
  function turn(quaternion, { values, width, length }, column) {
    const x = place(), i = Math.min(Math.floor(x), Math.max(length - 2, 0)), j = Math.min(i + 1, length - 1);
    const read = (k) => { const v = values.subarray(width * k + column); return new view.T.Quaternion(v[1], v[2], v[3], v[0]).normalize(); };
    quaternion.slerpQuaternions(read(i), read(j), Math.min(1, x - i));
  }

  function build() {
    const { T } = view, scene = new T.Scene();
    stage?.scene.traverse((item) => { item.geometry?.dispose(); item.material?.map?.dispose(); item.material?.dispose(); });
    stage = { scene };
    scene.add(new T.HemisphereLight(0xffffff, 0x8899aa, 0.75), view.camera);
    const lamp = new T.DirectionalLight(0xffffff, 0.45);
    lamp.position.set(0.4, 0.7, 1);
    view.camera.clear().add(lamp);
    Object.assign(stage, kind.build(scene));
    key();
  }

  const SIGNS = { arrow: "M1 5H19M14 1L20 5L14 9", line: "M1 5H21", dot: "M9 5H13M11 3V7" };
  function key() {
    const drawn = (path) => {
      const holder = make("span");
      holder.innerHTML = `<svg width="22" height="10" aria-hidden="true"><path d="${path}" fill="none" stroke="currentColor" stroke-width="2"/></svg>`;  // a sign of ours
      return holder.firstChild;
    };
    const forces = stage.perNewton ? Number((0.01 / stage.perNewton).toPrecision(2)) : "";
    ui.key.replaceChildren(...kind.key(forces).map(({ sign, text, tone }) => {
      const picture = make("span", {}, drawn(SIGNS[sign]));
      picture.style.color = tone ?? "";
      return make("span", {}, picture, text);
    }));
    ui.key.hidden = false;
  }

  // A camera that shows the whole path, or follows the body with its ghosts if that would be too small in it.
  function reset() {
    const off = shown.runs.slice(1).filter((run) => run.shown && there(run)).map((run) => kind.compare(run, true).off);
    const reach = Math.min(stage.size, Math.max(kind.reach(stage.size), ...off));
    ui.follow.checked = reach < stage.size;
    view.turn = shown.from[0];
    view.lift = shown.from[1];
    view.distance = (0.86 * reach) / Math.sin((view.camera.fov * Math.PI) / 360);
  }

  function draw() {
    const { T, renderer, camera } = view;
    const width = ui.canvas.parentNode.clientWidth, height = ui.canvas.parentNode.clientHeight;
    if (!width || !height) return;
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    const target = ui.follow.checked ? new T.Vector3(...smooth(shown.middle)) : stage.centre;
    const reach = view.distance / Math.min(1, camera.aspect);
    camera.position.set(Math.cos(view.turn) * Math.cos(view.lift), Math.sin(view.turn) * Math.cos(view.lift), Math.sin(view.lift)).multiplyScalar(reach).add(target);
    camera.near = 0.01 * reach;
    camera.far = 4 * reach + 4 * stage.size;
    camera.updateProjectionMatrix();
    camera.lookAt(target);
    kind.draw(place());
    renderer.render(stage.scene, camera);
  }

  const replay = {
    ui, css, make, straight, smooth, held, fixed, digits, values, colour, arrow, path, turn,
    visible: (run) => there(run) && (run === shown.runs[0] || run.shown),
    get shown() { return shown; }, get time() { return time; }, get view() { return view; },
  };
  const kinds = Object.fromEntries(Object.entries(replayed).map(([name, made]) => [name, made(replay)]));

  // ---- input ----
  async function choose() {
    stop();
    shown = await load(Number(ui.case.value));
    kind = kinds[shown.kind];
    time = 0;
    rows();
    strip.choices(shown.readings);
    if (view) build();
    largest();
    if (view) reset();
  }

  // Draws the errors of the quantity that is chosen, and goes to the largest one in sight.
  function largest() {
    const worst = strip.show(shown, (run, number, moment) => {
      time = moment;
      return there(run) ? away(run, number) : null;
    });
    stop();
    go(worst);
  }

  function listen() {
    ui.case.addEventListener("change", choose);
    ui.play.addEventListener("click", () => (playing ? (stop(), update()) : play()));
    ui.time.addEventListener("input", () => { stop(); time = Number(ui.time.value); update(); });
    ui.reset.addEventListener("click", () => { if (view) reset(); update(); });
    for (const box of [ui.follow, ui.forces, ui.paths]) box.addEventListener("change", update);
    const zoom = (factor) => { if (view) view.distance = Math.max(4 * shown.scale, Math.min(20 * stage.size, view.distance * factor)); update(); };
    const orbit = (turn, lift) => { if (!view) return; view.turn += turn; view.lift = Math.max(-1.5, Math.min(1.5, view.lift + lift)); update(); };
    ui.nearer.addEventListener("click", () => zoom(0.8));
    ui.further.addEventListener("click", () => zoom(1.25));
    const pointers = new Map();
    ui.canvas.addEventListener("pointerdown", (event) => { pointers.set(event.pointerId, event); ui.canvas.setPointerCapture(event.pointerId); });
    for (const kind of ["pointerup", "pointercancel"]) ui.canvas.addEventListener(kind, (event) => pointers.delete(event.pointerId));
    ui.canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const other = [...pointers.values()].find((pointer) => pointer.pointerId !== event.pointerId);
      const span = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY);
      if (other) zoom(span(before) / Math.max(span(event), 1));
      else orbit((before.clientX - event.clientX) * 0.008, (event.clientY - before.clientY) * 0.008);
      pointers.set(event.pointerId, event);
    });
    // The wheel belongs to the page until the picture has been chosen.
    ui.canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== ui.canvas) return;
      event.preventDefault();
      zoom(Math.exp(event.deltaY * (event.deltaMode ? 0.03 : 0.001)));
    }, { passive: false });
    const keys = {
      ArrowLeft: () => orbit(-0.1, 0), ArrowRight: () => orbit(0.1, 0), ArrowUp: () => orbit(0, 0.1), ArrowDown: () => orbit(0, -0.1),
      "+": () => zoom(0.8), "=": () => zoom(0.8), "-": () => zoom(1.25), ",": () => step(-1), ".": () => step(1),
      Home: () => { stop(); go(0); }, End: () => { stop(); go(shown.until); },
    };
    root.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const onLine = event.target === ui.time, onPicture = event.target === ui.canvas;
      if (event.key === " " && (onLine || onPicture)) ui.play.click();
      else if (onLine && event.key.startsWith("Arrow")) step((event.key === "ArrowRight" || event.key === "ArrowUp" ? 1 : -1) * (event.shiftKey ? 10 : 1));
      else if (onPicture && keys[event.key]) keys[event.key]();
      else return;
      event.preventDefault();
    });
    const paint = () => { if (stage) { build(); draw(); } };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
    for (const event of ["beforeprint", "afterprint"]) addEventListener(event, paint);  // one still, on paper's ground
  }

  async function open() {
    if (typeof DecompressionStream === "undefined") {
      ui.said.textContent = "This browser is too old to unpack the replay.";
      return;
    }
    cases = JSON.parse(ui.cases.textContent);
    if (ui.library) library = new TextDecoder().decode(await unpacked(ui.library.textContent));
    ui.said.textContent = start();
    listen();
    await choose();
    root.dataset.ready = "";
  }

  new IntersectionObserver((entries, watcher) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    watcher.disconnect();
    open().catch((error) => { ui.said.textContent = `The replay cannot be shown: ${error.message}`; });
  }, { rootMargin: "200px" }).observe(root);
})();
