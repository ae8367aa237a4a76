"use strict";
// The replay: unpacks a case, follows the time, writes the values and draws the balls. Without WebGL it only writes.
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
  const STATES = [["slips", "≋ slips"], ["sticks", "● sticks"], ["away", "○ off the wall"]];

  let cases, library, shown, time = 0, playing = false, last = 0, queued = false;
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
    const balls = spec.balls.map((ball) => ({ ...ball })), common = {};
    let at = 0;
    for (const [name, ball, width, length, step] of spec.arrays) {
      (ball < 0 ? common : balls[ball])[name] = { width, length, values: thick(bytes, at, width, length, step) };
      at += 4 * width * length;
    }
    return { ...spec, ...common, balls };
  }

  const place = () => (shown.frames < 2 ? 0 : (time / shown.until) * (shown.frames - 1));
  const until = (ball) => (shown.frames < 2 ? shown.until : (shown.until * (ball.frames - 1)) / (shown.frames - 1));

  // Between frames: straight, for what may jump, or smooth, for a path (Catmull-Rom).
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
  const state = (ball) => (ball.state ? STATES[held(ball.state)] : null);

  function rows() {
    const bounded = shown.friction.static !== null;
    ui.contact.hidden = !bounded;
    ui.balls.replaceChildren(...shown.balls.slice(1).map((ball, index) => {
      const box = make("input", { type: "checkbox" });
      box.checked = ball.shown;
      box.addEventListener("change", () => { ball.shown = box.checked; update(); });
      const name = make("label", {}, box, make("i", { class: `replay-dot e${ball.colour}` }), make("span", {}, ball.name.replace(/-(?=\d)/g, "\u2011")));  // 1e-3 stays in one line
      const cells = ["n", "n", "n", ""].map((kind) => make("td", { class: kind }));
      cells[3].hidden = !bounded;
      cells[3].append(make("span", { "aria-hidden": "true" }), make("span", { class: "vh" }));
      ball.cells = cells;
      ball.line = make("tr", {}, make("th", { scope: "row" }, name), ...cells);
      return ball.line;
    }));
    const plain = shown.balls.slice(1).filter((ball) => !ball.q).map((ball) => ball.name);
    const notes = shown.balls.filter((ball) => ball.message).map((ball) => `${ball.name}: ${ball.message}.`);
    if (plain.length) notes.push(`Without marks, for the run did not follow the ball's orientation: ${plain.join(", ")}.`);
    if (!shown.balls[0].press) notes.push("The truth gives no forces here.");
    ui.notes.textContent = notes.join(" ");
    ui.events.replaceChildren(...(shown.events.length ? ["The truth:"] : []), ...shown.events.filter((event) => event.time !== null).map((event) => {
      const button = make("button", { type: "button" }, `${event.kind} ${event.time.toFixed(3)} s`);
      button.addEventListener("click", () => { stop(); go(event.time); });
      return button;
    }));
    // Where the true ball slips, on a strip under the time line.
    const { state: known } = shown.balls[0], stops = [];
    for (let i = 0; known && i < known.length; i++) {
      const colour = known.values[i] === 1 ? "var(--sticks)" : "var(--slips)";
      if (i === 0 || known.values[i] !== known.values[i - 1]) {
        if (i) stops.push(`${stops.at(-1).split(" ")[0]} ${(100 * i) / (known.length - 1)}%`);
        stops.push(`${colour} ${(100 * i) / (known.length - 1)}%`);
      }
    }
    ui.strip.style.background = known ? `linear-gradient(90deg, ${stops.join(", ")}, ${stops.at(-1).split(" ")[0]} 100%)` : "";
    const [a, b] = shown.coordinates;
    const names = [a, b].map(({ symbol, unit }) => [symbol, unit]);
    ui.values.replaceChildren();
    ui.cells = [...names, ["N", "normal force"], ["F", "friction"], ["F/N", "needed friction"], ["contact", ""]].map(([name]) => {
      const cell = make("dd");
      ui.values.append(make("dt", {}, name), cell);
      return cell;
    });
    ui.meter = make("span", { class: "replay-meter", "aria-hidden": "true" }, make("i"), make("b"));
    ui.time.max = shown.until;
  }

  function write() {
    const truth = shown.balls[0];
    ui.clock.textContent = `${time.toFixed(3)} of ${Number(shown.until.toPrecision(6))} s`;
    if (document.activeElement !== ui.time || playing) ui.time.value = time;
    ui.time.setAttribute("aria-valuetext", `${time.toFixed(3)} seconds`);
    const u = smooth(truth.coordinates);
    shown.coordinates.forEach(({ unit }, k) => { ui.cells[k].textContent = `${fixed(u[k], 4)} ${unit}`; });
    const [, , press, pull, ratio, contact] = ui.cells;
    const { static: most, kinetic } = shown.friction;
    if (truth.press) {
      const N = straight(truth.press)[0], F = straight(truth.pull)[0], needed = F / N;
      press.textContent = `${fixed(N, digits(N, 4))} N`;
      pull.textContent = `${fixed(F, digits(N, 4))} N`;
      const bound = most === null ? "" : ` of μ ${Number(most.toPrecision(4))}${kinetic !== most ? `, ${Number(kinetic.toPrecision(4))} while it slips` : ""}`;
      ratio.replaceChildren(`${fixed(needed, 4)}${bound}`, ui.meter);
      ui.meter.firstChild.style.width = `${Math.min(100, (80 * needed) / most)}%`;  // the bound is at four fifths
      ui.meter.hidden = most === null || !Number.isFinite(needed);
    }
    const now = state(truth);
    ui.meter.className = `replay-meter ${now ? now[0] : ""}`;
    contact.replaceChildren(make("b", { class: now ? now[0] : "" }, now ? now[1] : "rolls without slip, friction unbounded"));
    const centre = smooth(truth.p);
    for (const ball of shown.balls.slice(1)) {
      const there = time <= until(ball) + 1e-9, p = smooth(ball.p), word = state(ball);
      const off = 1000 * Math.hypot(...p.map((x, k) => x - centre[k]));
      const presses = ball.press && time > 0;  // a reaction at time 0 is the start's: contacts that begin unloaded have none yet
      const texts = there ? [
        off < 0.1 ? "< 0.1" : fixed(off, off < 100 ? 1 : 0),
        presses ? fixed(straight(ball.press)[0], 1) : "–",
        presses ? fixed(straight(ball.pull)[0] / straight(ball.press)[0], 3) : "–",
      ] : ["gone", "–", "–"];
      texts.forEach((text, k) => { ball.cells[k].textContent = text; });
      const [sign, words] = [there && word ? word[1][0] : "–", there && word ? word[1].slice(2) : "not known"];
      ball.cells[3].className = there && word ? word[0] : "";
      ball.cells[3].title = ball.cells[3].lastChild.textContent = words;
      ball.cells[3].firstChild.textContent = sign;
      ball.line.classList.toggle("off", !ball.shown);
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

  // Octants in two tones, and a band where the first meridian is: what turns is seen to turn.
  function marks(light, dark, band) {
    const tile = document.createElement("canvas");
    [tile.width, tile.height] = [512, 256];
    const pen = tile.getContext("2d");
    for (let i = 0; i < 4; i++) for (let j = 0; j < 2; j++) {
      pen.fillStyle = (i + j) % 2 ? dark : light;
      pen.fillRect(128 * i, 128 * j, 128, 128);
    }
    pen.fillStyle = band;
    pen.fillRect(0, 0, 10, 256);
    pen.fillRect(502, 0, 10, 256);
    const texture = new view.T.CanvasTexture(tile);
    texture.anisotropy = view.renderer.capabilities.getMaxAnisotropy();
    return texture;
  }

  function arrow() {
    const { T } = view, r = 0.055 * shown.radius;
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

  function wall() {
    const { T } = view, { rows: n, columns: m, lines } = shown.wall, faces = [], edges = [];
    for (let i = 0; i < n; i++) for (let j = 0; j < m; j++) {
      const a = i * m + j;
      if (i + 1 < n && j + 1 < m) faces.push(a, a + m, a + 1, a + 1, a + m, a + m + 1);
      if (i % lines[0] === 0 && j + 1 < m) edges.push(a, a + 1);
      if (j % lines[1] === 0 && i + 1 < n) edges.push(a, a + m);
    }
    const shape = new T.BufferGeometry().setIndex(faces);
    shape.setAttribute("position", new T.BufferAttribute(shown.points.values, 3));
    shape.setAttribute("normal", new T.BufferAttribute(shown.outward.values.map((x) => -x), 3));
    const grid = new T.BufferGeometry().setIndex(edges);
    grid.setAttribute("position", shape.getAttribute("position"));
    const side = { color: colour("--wall"), transparent: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const parts = [
      new T.Mesh(shape, new T.MeshLambertMaterial({ ...side, opacity: 0.75, side: T.FrontSide })),   // seen from the ball
      new T.Mesh(shape, new T.MeshLambertMaterial({ ...side, opacity: 0.1, side: T.BackSide })),     // seen from behind
      new T.LineSegments(grid, new T.LineBasicMaterial({ color: colour("--grid"), transparent: true, opacity: 0.35, depthWrite: false })),
    ];
    parts.forEach((item, k) => { item.renderOrder = k === 1 ? 6 : -3 + k; });
    return parts;
  }

  // The trace of the true contact on the wall, a ribbon in the colour of what the contact did.
  function trace() {
    const { T } = view, truth = shown.balls[0], n = truth.contact.length, at = truth.contact.values, up = truth.normal.values;
    const points = new Float32Array(6 * n), tones = new Float32Array(6 * n), faces = [];
    const [free, slip] = [colour("--muted"), colour("--slips")];
    const side = new T.Vector3(), way = new T.Vector3(), e1 = new T.Vector3();
    for (let i = 0; i < n; i++) {
      const [j, k] = [Math.max(i - 1, 0), Math.min(i + 1, n - 1)];
      way.fromArray(at, 3 * k).sub(side.fromArray(at, 3 * j)).normalize();
      side.crossVectors(e1.fromArray(up, 3 * i), way).multiplyScalar(0.09 * shown.radius);
      for (const sign of [0, 1]) for (let x = 0; x < 3; x++)
        points[6 * i + 3 * sign + x] = at[3 * i + x] + (2 * sign - 1) * side.getComponent(x) - 0.01 * shown.radius * e1.getComponent(x);
      const tone = truth.state && truth.state.values[i] !== 1 ? slip : free;
      tone.toArray(tones, 6 * i);
      tone.toArray(tones, 6 * i + 3);
      if (i + 1 < n) faces.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 2, 2 * i + 1, 2 * i + 3);
    }
    const shape = new T.BufferGeometry().setIndex(faces);
    shape.setAttribute("position", new T.BufferAttribute(points, 3));
    shape.setAttribute("color", new T.BufferAttribute(tones, 3));
    return new T.Mesh(shape, new T.MeshBasicMaterial({ vertexColors: true, side: T.DoubleSide }));
  }

  function build() {
    const { T } = view, truth = shown.balls[0], scene = new T.Scene();
    stage?.scene.traverse((item) => { item.geometry?.dispose(); item.material?.map?.dispose(); item.material?.dispose(); });
    const box = new T.Box3().setFromArray(truth.p.values).expandByScalar(shown.radius);
    const size = 0.5 * box.getSize(new T.Vector3()).length();
    const largest = truth.press ? Math.max(...truth.press.values) : 0;
    stage = {
      scene, size, centre: box.getCenter(new T.Vector3()), perNewton: largest > 0 ? (5 * shown.radius) / largest : 0,
    };
    scene.add(new T.HemisphereLight(0xffffff, 0x8899aa, 0.75), view.camera, ...wall());
    const lamp = new T.DirectionalLight(0xffffff, 0.45);
    lamp.position.set(0.4, 0.7, 1);
    view.camera.clear().add(lamp);
    stage.balls = shown.balls.map((ball, index) => {
      const ghost = index > 0, radius = shown.radius * (ghost ? 0.97 : 1);
      const own = ghost ? css(`--e${ball.colour}`) : "";
      const map = !ghost ? marks(css("--light"), css("--dark"), css("--link")) : ball.q ? marks(own, `#${new T.Color(own).lerp(new T.Color(css("--paper")), 0.55).getHexString()}`, css("--paper")) : null;
      const material = new T.MeshPhongMaterial({ map, shininess: 25, specular: 0x333333, ...(map ? {} : { color: new T.Color(own) }), ...(ghost ? { transparent: true, opacity: 0.5, depthWrite: false } : {}) });
      const mesh = new T.Mesh(new T.SphereGeometry(radius, 48, 32), material);
      mesh.renderOrder = ghost ? 3 : 0;
      scene.add(mesh);
      if (!ghost) return { mesh };
      const path = new T.BufferGeometry();
      path.setAttribute("position", new T.BufferAttribute(ball.p.values, 3));
      const line = new T.Line(path, new T.LineBasicMaterial({ color: new T.Color(own) }));
      line.frustumCulled = false;
      scene.add(line);
      return { mesh, line };
    });
    stage.trace = trace();
    stage.disc = new T.Mesh(new T.CircleGeometry(0.3 * shown.radius, 24), new T.MeshBasicMaterial({ side: T.DoubleSide, depthTest: false, transparent: true }));
    stage.disc.renderOrder = 9;
    stage.push = arrow();
    stage.rub = arrow();
    scene.add(stage.trace, stage.disc, stage.push.group, stage.rub.group);
    key();
  }

  function key() {
    const bounded = Boolean(shown.balls[0].state);
    ui["key-forces"].hidden = !stage.perNewton;
    ui["key-slips"].hidden = !bounded;
    ui["key-friction"].style.color = bounded ? "var(--sticks)" : "var(--link)";
    ui.scale.textContent = stage.perNewton ? Number((0.01 / stage.perNewton).toPrecision(2)) : "";
    ui.key.hidden = false;
  }

  // The camera that shows the whole path, or, where the ball would be lost in it, follows.
  function reset() {
    ui.follow.checked = stage.size > 22 * shown.radius;
    view.turn = -1.15;
    view.lift = 0.5;
    const reach = ui.follow.checked ? 14 * shown.radius : stage.size;
    view.distance = (0.86 * reach) / Math.sin((view.camera.fov * Math.PI) / 360);
  }

  function draw() {
    const { T, renderer, camera } = view, truth = shown.balls[0];
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

    const x = place(), turn = new T.Quaternion(), next = new T.Quaternion();
    shown.balls.forEach((ball, index) => {
      const { mesh, line } = stage.balls[index], there = time <= until(ball) + 1e-9 && (index === 0 || ball.shown);
      mesh.visible = there;
      if (line) {
        line.visible = ui.paths.checked && ball.shown;
        const end = Math.min(Math.floor(x) + 1, ball.frames), from = Math.max(0, end - Math.ceil((0.4 * shown.frames) / shown.until));
        line.geometry.setDrawRange(from, end - from);
      }
      if (!there) return;
      mesh.position.set(...smooth(ball.p));
      if (!ball.q) return;
      const last = ball.frames - 1, i = Math.min(Math.floor(x), Math.max(last - 1, 0)), j = Math.min(i + 1, last);
      const read = (to, k) => { const v = ball.q.values; return to.set(v[4 * k + 1], v[4 * k + 2], v[4 * k + 3], v[4 * k]).normalize(); };
      mesh.quaternion.slerpQuaternions(read(turn, i), read(next, j), Math.min(1, x - i));
    });

    stage.trace.visible = ui.paths.checked;
    stage.trace.geometry.setDrawRange(0, 6 * Math.floor(x));
    const contact = new T.Vector3(...smooth(truth.contact)), e1 = new T.Vector3(...straight(truth.normal)).normalize();
    const word = state(truth), tone = word ? colour(word[0] === "sticks" ? "--sticks" : "--slips") : colour("--link");
    stage.disc.visible = !word || word[0] !== "away";
    stage.disc.position.copy(contact);
    stage.disc.quaternion.setFromUnitVectors(new T.Vector3(0, 0, 1), e1);
    stage.disc.material.color.copy(tone);
    if (truth.press) {
      stage.push.point(contact, e1.clone().multiplyScalar(-straight(truth.press)[0]), colour("--ink"));
      stage.rub.point(contact, new T.Vector3(...straight(truth.friction)), tone);
    }
    renderer.render(stage.scene, camera);
  }

  // ---- what a person does ----
  async function choose() {
    stop();
    shown = await load(Number(ui.case.value));
    time = 0;
    rows();
    if (view) { build(); reset(); }
    go(0);
  }

  function listen() {
    ui.case.addEventListener("change", choose);
    ui.play.addEventListener("click", () => (playing ? (stop(), update()) : play()));
    ui.time.addEventListener("input", () => { stop(); time = Number(ui.time.value); update(); });
    ui.reset.addEventListener("click", () => { if (view) reset(); update(); });
    for (const box of [ui.follow, ui.forces, ui.paths]) box.addEventListener("change", update);
    const zoom = (factor) => { if (view) view.distance = Math.max(4 * shown.radius, Math.min(20 * stage.size, view.distance * factor)); update(); };
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
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { if (view) build(); update(); });
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
