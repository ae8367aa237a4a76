// A mechanism in the replay: bodies as rods between their joints, shapes that touch, springs, tracked points, forces.
replayed.mechanism = (replay) => {
  const { ui, css, straight, smooth, colour } = replay;
  let stage;

  // ---- words ----
  const columns = () => [];

  function rows(notes) {
    const { shown } = replay;
    if (!shown.runs[0].force) notes.push("No reaction is determinate here, so none is drawn.");
    replay.values([]);
  }

  const compare = (run) => {
    const own = smooth(run.points), true_ = smooth(replay.shown.runs[0].points);
    let off = 0;
    for (let k = 0; k < own.length; k += 3) off = Math.max(off, Math.hypot(own[k] - true_[k], own[k + 1] - true_[k + 1], own[k + 2] - true_[k + 2]));
    return { off, texts: [] };
  };

  // ---- picture ----
  function rod(from, to, radius, material) {
    const { T } = replay.view, a = new T.Vector3(...from), along = new T.Vector3(...to).sub(a), length = along.length();
    const mesh = new T.Mesh(new T.CylinderGeometry(radius, radius, Math.max(length, 1e-9), 12).translate(0, length / 2, 0), material);
    mesh.position.copy(a);
    if (length > 0) mesh.quaternion.setFromUnitVectors(new T.Vector3(0, 1, 0), along.normalize());
    return mesh;
  }

  function dot(at, radius, material) {
    const mesh = new replay.view.T.Mesh(new replay.view.T.SphereGeometry(radius, 20, 14), material);
    mesh.position.set(...at);
    return mesh;
  }

  // One group for each body, in the body's frame; the last one is the world's.
  function skeleton(scene, index) {
    const { T } = replay.view, { shown } = replay, ghost = index > 0, size = shown.scale;
    const tone = new T.Color(ghost ? css(`--e${shown.runs[index].colour}`) : css("--dark"));
    const look = { shininess: 25, specular: 0x333333, ...(ghost ? { transparent: true, opacity: 0.5, depthWrite: false } : {}) };
    const material = new T.MeshPhongMaterial({ color: tone, ...look }), joint = new T.MeshPhongMaterial({ color: colour("--link"), ...look });
    const groups = shown.bodies.map(({ rods, com }) => {
      const group = new T.Group();
      for (const [from, to] of rods) group.add(rod(from, to, (ghost ? 0.2 : 0.22) * size, material));
      // A body whose rods are all short gets axes, so that its rotation is visible.
      if (com && rods.every(([from, to]) => Math.hypot(...from.map((x, k) => x - to[k])) < 0.5 * size)) {
        const axes = new T.AxesHelper(2.5 * size);
        axes.position.set(...com);
        group.add(axes);
      }
      if (com) group.add(dot(com, (ghost ? 0.42 : 0.46) * size, material));
      scene.add(group);
      return group;
    });
    const dots = ghost ? [] : shown.joints.map(({ body, at }) => {
      const mesh = dot(at, 0.34 * size, joint.clone());
      groups[body].add(mesh);
      return mesh;
    });
    for (const { body, kind, at, turn, half, wire, long } of shown.shapes) {
      const wall = ["plane", "bore", "shaft", "bowl", "cone", "torus"].includes(kind);
      if (!Math.max(...half) || (ghost && wall)) continue;
      const unit = { plane: () => new T.PlaneGeometry(2, 2), box: () => new T.BoxGeometry(2, 2, 2),
        circle: () => new T.CylinderGeometry(1, 1, 2, 48).rotateX(Math.PI / 2),
        cylinder: () => new T.CylinderGeometry(1, 1, 2, 48).rotateX(Math.PI / 2),
        capsule: () => new T.CapsuleGeometry(1, long, 16, 32).rotateX(Math.PI / 2),
        bore: () => new T.CylinderGeometry(1, 1, 2, 48, 1, true).rotateX(Math.PI / 2),
        shaft: () => new T.CylinderGeometry(1, 1, 2, 48, 1, true).rotateX(Math.PI / 2),
        cone: () => new T.ConeGeometry(1, 1, 48, 1, true).rotateX(-Math.PI / 2).translate(0, 0, 0.5),
        torus: () => new T.TorusGeometry(1, wire, 16, 64) }[kind] || (() => new T.SphereGeometry(1, 32, 20));
      const paint = { color: wall ? colour("--wall") : tone, transparent: true, opacity: ghost ? 0.15 : wall ? 0.5 : 0.25 };
      const mesh = new T.Mesh(unit(), new T.MeshPhongMaterial({ ...paint, depthWrite: false, side: T.DoubleSide }));
      mesh.position.set(...at);
      mesh.quaternion.set(...turn);
      mesh.scale.set(...half.map((one) => one || 1));
      groups[body].add(mesh);
      // Lines make the rotation of round shapes visible: a radius on a disc, two great circles on others.
      const round = (from, to) => Array.from({ length: 65 }, (_, k) => from.clone().multiplyScalar(Math.cos((Math.PI * k) / 32)).addScaledVector(to, Math.sin((Math.PI * k) / 32)));
      const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => new T.Vector3(...axis));
      const lines = { circle: [[new T.Vector3(), x]], cylinder: [[z, z.clone().add(x)]], capsule: [round(x, y), round(y, x)], sphere: [round(x, z), round(y, z)], ellipsoid: [round(x, z), round(y, z)] }[kind] || [];
      for (const line of lines) mesh.add(new T.Line(new T.BufferGeometry().setFromPoints(line), new T.LineBasicMaterial({ color: tone, transparent: true, opacity: ghost ? 0.4 : 0.8 })));
    }
    groups.forEach((group) => group.traverse((item) => { item.renderOrder = ghost ? 3 : 0; }));
    const springs = shown.springs.map(() => {
      const shape = new T.BufferGeometry();
      shape.setAttribute("position", new T.BufferAttribute(new Float32Array(6), 3));
      const line = new T.Line(shape, new T.LineBasicMaterial({ color: tone, transparent: ghost, opacity: ghost ? 0.5 : 1 }));
      line.frustumCulled = false;
      scene.add(line);
      return line;
    });
    return { groups, springs, dots };
  }

  function build(scene) {
    const { T } = replay.view, { shown } = replay, truth = shown.runs[0];
    const box = new T.Box3().setFromArray(truth.extent.values).expandByScalar(shown.scale);
    const edges = box.getSize(new T.Vector3());
    const size = Math.max(0.5 * edges.length(), 0.65 * Math.max(...edges.toArray())); // of a long way its ends are in view
    stage = { runs: shown.runs.map((_, index) => skeleton(scene, index)), arrows: [] };
    stage.paths = shown.runs.map((run, index) => {
      const tone = css(index ? `--e${run.colour}` : "--link");
      return Array.from({ length: run.points.width / 3 }, (_, k) => replay.path(scene, run.points, 3 * k, tone));
    });
    let largest = 0;
    if (truth.force) {
      stage.arrows = Array.from({ length: truth.force.width / 3 }, () => replay.arrow(0.12 * shown.scale));
      stage.arrows.forEach(({ group }) => scene.add(group));
      // Scale by the 95th percentile: the peaks at a singular pose would make all other forces invisible.
      const sizes = Array.from({ length: truth.force.length * stage.arrows.length }, (_, k) => Math.hypot(...truth.force.values.subarray(3 * k, 3 * k + 3)));
      largest = sizes.sort((a, b) => a - b)[Math.floor(0.95 * (sizes.length - 1))];
    }
    return { size, centre: box.getCenter(new T.Vector3()), perNewton: largest > 0 ? (8 * shown.scale) / largest : 0 };
  }

  function draw(x) {
    const { T } = replay.view, { shown } = replay;
    shown.runs.forEach((run, index) => {
      const { groups, springs } = stage.runs[index], there = replay.visible(run), world = groups.length - 1;
      for (const path of stage.paths[index]) path.show(run, x);
      groups.forEach((group) => { group.visible = there; });
      springs.forEach((line) => { line.visible = there; });
      if (!there) return;
      const at = smooth(run.p);
      for (let body = 0; body < world; body++) {
        groups[body].position.set(...at.slice(3 * body, 3 * body + 3));
        replay.turn(groups[body].quaternion, run.q, 4 * body);
        groups[body].updateMatrixWorld();
      }
      shown.springs.forEach(([a, from, b, to], k) => {
        const ends = [[a, from], [b, to]].flatMap(([body, point]) => groups[body].localToWorld(new T.Vector3(...point)).toArray());
        springs[k].geometry.attributes.position.array.set(ends);
        springs[k].geometry.attributes.position.needsUpdate = true;
      });
    });
    const { force } = shown.runs[0], now = force ? straight(force) : [];
    stage.arrows.forEach((arrow, k) => {
      const { body, at } = shown.joints[k];
      const from = stage.runs[0].groups[body].localToWorld(new T.Vector3(...at));
      arrow.point(from, new T.Vector3(...now.slice(3 * k, 3 * k + 3)), colour("--ink"));
    });
    const first = shown.joints.length - shown.contacts;
    if (shown.contacts) straight(shown.runs[0].slip).forEach((slip, k) => { // a mark where what presses slips
      const presses = now.length && Math.hypot(...now.slice(3 * (first + k), 3 * (first + k) + 3)) > 0;
      stage.runs[0].dots[first + k].material.color.set(colour(!presses ? "--grid" : slip > shown.slips ? "--slips" : "--sticks"));
    });
  }

  const key = (forces) => [
    ...(forces ? [{ sign: "arrow", text: `force of a joint on its child, or of a contact, what of it is determinate (1 cm is ${forces} N)` }] : []),
    { sign: "line", text: "path of a tracked point", tone: "var(--link)" },
    ...(replay.shown.contacts ? [["slips", "slips"], ["sticks", "sticks"], ["is open", "grid"]].map(([word, tone]) =>
      ({ sign: "dot", text: `contact that ${word}`, tone: `var(--${tone})` })) : []),
  ];

  // The camera follows if the mechanism would be too small in its path.
  const reach = (size) => {
    const { scale, shapes, falls } = replay.shown, widest = Math.max(0, ...shapes.filter(({ kind }) => kind !== "plane").flatMap(({ half }) => half));
    return size > (falls ? 40 : 75) * scale ? Math.min(size, Math.max(30 * scale, 1.6 * widest)) : size;
  };

  return { columns, rows, compare, build, draw, key, reach };
};
