// A ball on a surface in the replay: the wall, the trace of the contact, what presses there.
replayed.ball = (replay) => {
  const { ui, css, make, straight, smooth, held, fixed, digits, colour } = replay;
  const STATES = [["slips", "≋ slips"], ["sticks", "● sticks"], ["away", "○ off the wall"]];
  const state = (run) => (run.state ? STATES[held(run.state)] : null);
  const bounded = () => replay.shown.friction.static !== null;
  let cells, meter, stage;

  // ---- words ----
  const columns = () => [
    { name: "N", unit: "N", number: true }, { name: "F/N", number: true },
    ...(bounded() ? [{ name: "●≋", title: "contact: ● sticks, ≋ slips, ○ off the wall" }] : []),
  ];

  function rows(notes) {
    const { shown } = replay, plain = shown.runs.slice(1).filter((run) => !run.q).map((run) => run.name);
    if (plain.length) notes.push(`Without marks, for the run did not follow the ball's orientation: ${plain.join(", ")}.`);
    if (!shown.runs[0].press) notes.push("The truth gives no forces here.");
    // Where the true ball slips, on a strip under the time line.
    const { state: known } = shown.runs[0], stops = [];
    for (let i = 0; known && i < known.length; i++) {
      const tone = known.values[i] === 1 ? "var(--sticks)" : "var(--slips)";
      if (i === 0 || known.values[i] !== known.values[i - 1]) {
        if (i) stops.push(`${stops.at(-1).split(" ")[0]} ${(100 * i) / (known.length - 1)}%`);
        stops.push(`${tone} ${(100 * i) / (known.length - 1)}%`);
      }
    }
    ui.strip.style.background = known ? `linear-gradient(90deg, ${stops.join(", ")}, ${stops.at(-1).split(" ")[0]} 100%)` : "";
    cells = replay.values(["N", "F", "F/N", "contact"]);
    meter = make("span", { class: "replay-meter", "aria-hidden": "true" }, make("i"), make("b"));
  }

  function write() {
    const { shown } = replay, truth = shown.runs[0];
    const [press, pull, ratio, contact] = cells;
    const { static: most, kinetic } = shown.friction;
    if (truth.press) {
      const N = straight(truth.press)[0], F = straight(truth.pull)[0], needed = F / N;
      press.textContent = `${fixed(N, digits(N, 4))} N`;
      pull.textContent = `${fixed(F, digits(N, 4))} N`;
      const bound = most === null ? "" : ` of μ ${Number(most.toPrecision(4))}${kinetic !== most ? `, ${Number(kinetic.toPrecision(4))} while it slips` : ""}`;
      ratio.replaceChildren(`${fixed(needed, 4)}${bound}`, meter);
      meter.firstChild.style.width = `${Math.min(100, (80 * needed) / most)}%`;  // the bound is at four fifths
      meter.hidden = most === null || !Number.isFinite(needed);
    }
    const now = state(truth);
    meter.className = `replay-meter ${now ? now[0] : ""}`;
    contact.replaceChildren(make("b", { class: now ? now[0] : "" }, now ? now[1] : "rolls without slip, friction unbounded"));
  }

  function compare(run, there) {
    const presses = there && run.press && replay.time > 0;  // a reaction at time 0 is the start's: contacts that begin unloaded have none yet
    const N = presses ? straight(run.press)[0] : NaN, word = there ? state(run) : null;
    return {
      off: Math.hypot(...smooth(run.p).map((x, k) => x - smooth(replay.shown.runs[0].p)[k])),
      texts: [fixed(N, 1), presses ? fixed(straight(run.pull)[0] / N, 3) : "–"],
      sign: word ? { look: word[0], sign: word[1][0], words: word[1].slice(2) } : { look: "", sign: "–", words: "not known" },
    };
  }

  // ---- picture ----
  // Octants in two tones and a band on the first meridian make the rotation visible.
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
    const texture = new replay.view.T.CanvasTexture(tile);
    texture.anisotropy = replay.view.renderer.capabilities.getMaxAnisotropy();
    return texture;
  }

  function wall() {
    const { T } = replay.view, { rows: n, columns: m, lines } = replay.shown.wall, faces = [], edges = [];
    for (let i = 0; i < n; i++) for (let j = 0; j < m; j++) {
      const a = i * m + j;
      if (i + 1 < n && j + 1 < m) faces.push(a, a + m, a + 1, a + 1, a + m, a + m + 1);
      if (i % lines[0] === 0 && j + 1 < m) edges.push(a, a + 1);
      if (j % lines[1] === 0 && i + 1 < n) edges.push(a, a + m);
    }
    const shape = new T.BufferGeometry().setIndex(faces);
    shape.setAttribute("position", new T.BufferAttribute(replay.shown.points.values, 3));
    shape.setAttribute("normal", new T.BufferAttribute(replay.shown.outward.values.map((x) => -x), 3));
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

  // The trace of the true contact on the wall, a ribbon coloured by the state of the contact.
  function trace() {
    const { T } = replay.view, { shown } = replay, truth = shown.runs[0], n = truth.contact.length, at = truth.contact.values, up = truth.normal.values;
    const points = new Float32Array(6 * n), tones = new Float32Array(6 * n), faces = [];
    const [free, slip] = [colour("--muted"), colour("--slips")];
    const side = new T.Vector3(), way = new T.Vector3(), e1 = new T.Vector3();
    for (let i = 0; i < n; i++) {
      const [j, k] = [Math.max(i - 1, 0), Math.min(i + 1, n - 1)];
      way.fromArray(at, 3 * k).sub(side.fromArray(at, 3 * j)).normalize();
      side.crossVectors(e1.fromArray(up, 3 * i), way).multiplyScalar(0.09 * shown.scale);
      for (const sign of [0, 1]) for (let x = 0; x < 3; x++)
        points[6 * i + 3 * sign + x] = at[3 * i + x] + (2 * sign - 1) * side.getComponent(x) - 0.01 * shown.scale * e1.getComponent(x);
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

  function build(scene) {
    const { T } = replay.view, { shown } = replay, truth = shown.runs[0];
    const box = new T.Box3().setFromArray(truth.p.values).expandByScalar(shown.scale);
    const size = 0.5 * box.getSize(new T.Vector3()).length();
    const largest = truth.press ? Math.max(...truth.press.values) : 0;
    scene.add(...wall());
    const thin = 0.055 * shown.scale;
    stage = { trace: trace(), push: replay.arrow(thin), rub: replay.arrow(thin) };
    stage.runs = shown.runs.map((run, index) => {
      const ghost = index > 0, radius = shown.scale * (ghost ? 0.97 : 1);
      const own = ghost ? css(`--e${run.colour}`) : "";
      const map = !ghost ? marks(css("--light"), css("--dark"), css("--link")) : run.q ? marks(own, `#${new T.Color(own).lerp(new T.Color(css("--paper")), 0.55).getHexString()}`, css("--paper")) : null;
      const material = new T.MeshPhongMaterial({ map, shininess: 25, specular: 0x333333, ...(map ? {} : { color: new T.Color(own) }), ...(ghost ? { transparent: true, opacity: 0.5, depthWrite: false } : {}) });
      const mesh = new T.Mesh(new T.SphereGeometry(radius, 48, 32), material);
      mesh.renderOrder = ghost ? 3 : 0;
      scene.add(mesh);
      return { mesh, path: ghost ? replay.path(scene, run.p, 0, own) : null };
    });
    stage.disc = new T.Mesh(new T.CircleGeometry(0.3 * shown.scale, 24), new T.MeshBasicMaterial({ side: T.DoubleSide, depthTest: false, transparent: true }));
    stage.disc.renderOrder = 9;
    scene.add(stage.trace, stage.disc, stage.push.group, stage.rub.group);
    return { size, centre: box.getCenter(new T.Vector3()), perNewton: largest > 0 ? (5 * shown.scale) / largest : 0 };
  }

  function draw(x) {
    const { T } = replay.view, { shown } = replay, truth = shown.runs[0];
    shown.runs.forEach((run, index) => {
      const { mesh, path } = stage.runs[index], there = replay.visible(run);
      mesh.visible = there;
      if (path) path.show(run, x);
      if (!there) return;
      mesh.position.set(...smooth(run.p));
      if (run.q) replay.turn(mesh.quaternion, run.q, 0);
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
  }

  const key = (forces) => [
    ...(forces ? [
      { sign: "arrow", text: `normal force on the ball (1 cm is ${forces} N)` },
      { sign: "arrow", text: "friction on it", tone: replay.shown.runs[0].state ? "var(--sticks)" : "var(--link)" },
    ] : []),
    { sign: "line", text: "trace of the contact", tone: "var(--muted)" },
    ...(replay.shown.runs[0].state ? [{ sign: "line", text: "where it slips, and its friction then", tone: "var(--slips)" }] : []),
  ];

  // The camera follows if the ball would be too small in the whole path.
  const reach = (size) => (size > 22 * replay.shown.scale ? 14 * replay.shown.scale : size);

  return { columns, rows, write, compare, build, draw, key, reach };
};
