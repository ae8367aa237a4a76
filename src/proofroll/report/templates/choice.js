// The first screen: chips, cards, matrix, profile and advice follow the question; rows unfold, and cells explain themselves.
(() => {
  const table = document.getElementById("choice");
  if (!table) return;
  const place = (id) => document.getElementById(id);
  const slider = place("tolerance"), forces = place("forces"), kind = place("kind");
  const first = {{ decades.start }}, count = {{ decades|length }}, lengths = {{ lengths|tojson }};
  const rows = [...table.querySelectorAll("[data-place]")];
  const boxes = [...document.querySelectorAll("[name=engine]")];
  const off = () => new Set(boxes.filter((box) => !box.checked).map((box) => box.value));
  const rivals = boxes.filter((box) => !("witness" in box.dataset)).map((box) => box.value);

  // What is put in place was made by the same templates as the page, with every text escaped.
  async function show() {
    const decade = Number(slider.value), asked = (forces.checked ? count : 0) + decade - first;
    place("tolerated").textContent = `1e-${decade}`;
    slider.setAttribute("aria-valuetext", `1e-${decade} of the path, ${lengths[decade]} per metre`);
    const data = JSON.parse(await unpack("choices"));
    const gone = off(), chosen = rivals.filter((name) => !gone.has(name)), own = data.screens[chosen.join(" ")];
    const screen = (own ?? data.screens[rivals.join(" ")])[asked];
    place("asked").textContent = `The cheapest that holds ${screen.asked}${own && gone.size ? `, of ${chosen.map(title).join(" and ")} alone` : ""}:`;
    place("answer-chips").innerHTML = screen.chips[kind.value];
    place("answer-one").innerHTML = screen.one[kind.value] ?? "";
    place("facts").innerHTML = data.facts[kind.value];
    for (const part of ["cards", "profile", "use"]) place(`answer-${part}`).innerHTML = screen[part];
    rows.forEach((row, i) => [...row.cells].slice(1).forEach((cell, j) => {
      const [look, inner] = data.cells[data.grid[i][j][asked]];
      cell.className = `s-${look} ${cell.classList.contains("of-kind") ? "of-kind" : "of-scene"}${screen.best[j] === i ? " best" : ""}`;
      cell.innerHTML = inner;
    }));
    hide(document);
    table.dataset.at = asked;
    start();
  }
  const title = (name) => boxes.find((box) => box.value === name).parentElement.textContent.trim();
  function hide(within) {
    const gone = off();
    within.querySelectorAll("[data-engine]").forEach((part) => part.classList.toggle("off", gone.has(part.dataset.engine)));
    within.querySelectorAll("[data-kind]").forEach((part) => { part.hidden = kind.value !== "" && part.dataset.kind !== kind.value; });
  }
  everywhere(hide);
  // A step of the back button when a control is let go; the answer follows while the slider is drawn.
  slider.addEventListener("input", show);
  [slider, forces, kind, ...boxes].forEach((control) => control.addEventListener("change", () => { address.ask(control); show(); }));
  address.keep(
    (words) => {
      if (Number(slider.value) !== {{ first_decade }}) words.set("tol", `1e-${slider.value}`);
      if (forces.checked) words.set("forces", "1");
      if (kind.value) words.set("kinds", kind.value);
      if (boxes.some((box) => !box.checked)) words.set("engines", boxes.filter((box) => box.checked).map((box) => box.value).join(","));
      if (table.className === "single") words.set("cols", "scene");
    },
    (words) => {
      const names = words.get("engines")?.split(",");
      slider.value = words.has("tol") ? Math.round(-Math.log10(Number(words.get("tol")))) || {{ first_decade }} : {{ first_decade }};
      forces.checked = words.get("forces") === "1";
      kind.value = [...kind.options].some((option) => option.value === words.get("kinds")) ? words.get("kinds") : "";
      boxes.forEach((box) => { box.checked = !names || names.includes(box.value); });
      columns(words.get("cols") === "scene" ? "single" : "kinds");
      if (table.dataset.at || [...words.keys()].some((name) => name !== "at" && name !== "open")) show();
    },
  );
  document.querySelectorAll(".ask").forEach((form) => form.addEventListener("submit", (event) => event.preventDefault()));

  // Rows unfold: engines to formulations, formulations to settings.
  function fold(button, open) {
    button.setAttribute("aria-expanded", open);
    for (const row of rows.filter((row) => row.dataset.of === button.dataset.unfold)) {
      row.hidden = !open;
      const below = row.querySelector("[data-unfold]");
      if (below && !open) fold(below, false);
    }
  }
  window.unfoldRow = (row) => {
    const above = row.dataset.of && table.querySelector(`[data-unfold="${CSS.escape(row.dataset.of)}"]`);
    if (!above) return;
    unfoldRow(above.closest("tr"));
    fold(above, true);
  };
  table.addEventListener("click", ({ target }) => {
    const button = target.closest("[data-unfold]");
    if (!button) return;
    fold(button, button.getAttribute("aria-expanded") !== "true");
    address.note();
  });
  const all = place("formulations");
  all.addEventListener("click", () => {
    const open = all.getAttribute("aria-pressed") !== "true";
    all.setAttribute("aria-pressed", open);
    all.textContent = open ? "hide formulations" : "show all formulations";
    table.querySelectorAll(".engine [data-unfold]").forEach((button) => fold(button, open));
    address.note();
  });
  const kinds = [...document.querySelectorAll("[data-columns]")];
  function columns(which) {
    table.className = which;
    kinds.forEach((button) => button.setAttribute("aria-pressed", button.dataset.columns === which));
    start();
  }
  kinds.forEach((button) => button.addEventListener("click", () => { columns(button.dataset.columns); address.ask(button); }));

  // The cells are one stop of the Tab key; arrows, Home and End walk.
  const seen = (part) => part && part.offsetParent !== null;
  const inside = (cell) => cell.querySelector(".in, [data-unfold]");
  function start() {
    const cells = [...table.querySelectorAll(".in")];
    cells.forEach((cell) => { cell.tabIndex = -1; });
    const at = cells.find(seen);
    if (at) at.tabIndex = 0;
  }
  table.addEventListener("keydown", (event) => {
    const from = event.target.closest(".in, [data-unfold]"), step = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0], Home: [0, -99], End: [0, 99] }[event.key];
    if (!from || !step) return;
    const lines = [...table.tBodies[0].rows].filter((row) => seen(row) && !row.matches(".group"));
    const row = from.closest("tr"), cells = (line) => [...line.cells].filter(seen);
    const down = lines[lines.indexOf(row) + step[0]] ?? row, across = cells(row).indexOf(from.closest("td, th"));
    const line = cells(down), next = inside(line[Math.max(0, Math.min(line.length - 1, across + step[1]))]);
    event.preventDefault();
    if (!next) return;
    if (next.matches(".in")) { table.querySelectorAll(".in[tabindex='0']").forEach((cell) => { cell.tabIndex = -1; }); next.tabIndex = 0; }
    next.focus();
  });
  start();

  // Lines for a reader's own model: of a scene's cheapest engine, then of another that holds the tolerance.
  const dialog = place("model"), engine = place("model-engine");
  async function model(scene, chosen) {
    const data = JSON.parse(await unpack("choices")), holding = data.models[Number(table.dataset.at ?? {{ first_decade - decades.start }})][scene];
    const gone = off(), names = Object.keys(holding).filter((name) => !gone.has(name));
    engine.replaceChildren(...names.map((name) => new Option(title(name), name)));
    engine.value = chosen ?? names[0];
    dialog.dataset.scene = scene;
    place("model-lines").innerHTML = data.texts[holding[engine.value]];
    if (!dialog.open) dialog.showModal();
  }
  engine.addEventListener("change", () => model(dialog.dataset.scene, engine.value));
  document.addEventListener("click", ({ target }) => {
    const button = target.closest("[data-model]");
    if (button) model(button.dataset.model);
    if (target === dialog || target.closest("#model .close")) dialog.close();
  });

  // A tooltip in place of the browser's: the first line bold; by pointer, keyboard or touch, Escape closes it.
  const tip = Object.assign(document.createElement("div"), { id: "tip", hidden: true });
  tip.setAttribute("role", "tooltip");
  document.body.append(tip);
  let owner = null;
  function close() {
    tip.hidden = true;
    owner?.removeAttribute("aria-describedby");
    owner = null;
  }
  function open(part) {
    if (part.title) { part.dataset.tip = part.title; part.removeAttribute("title"); }
    const [head, ...rest] = part.dataset.tip.split("\n");
    tip.replaceChildren(Object.assign(document.createElement("b"), { textContent: head }), rest.join(" "));
    close();
    owner = part;
    tip.hidden = false;
    part.setAttribute("aria-describedby", "tip");
    const box = part.getBoundingClientRect();
    tip.style.left = `${Math.max(8, Math.min(innerWidth - tip.offsetWidth - 8, box.left + box.width / 2 - tip.offsetWidth / 2))}px`;
    tip.style.top = `${box.bottom + tip.offsetHeight + 10 < innerHeight ? box.bottom + 7 : Math.max(6, box.top - tip.offsetHeight - 7)}px`;
  }
  const told = (target) => target.closest?.("#choice [title], #choice [data-tip], .key [title], .key [data-tip], #uses th[title], #uses th[data-tip]");
  // What has the focus keeps its tooltip when the pointer leaves another, and beside it when the page scrolls.
  const back = () => { const part = owner && told(document.activeElement); if (part) open(part); else close(); };
  document.addEventListener("pointerover", ({ target }) => { const part = told(target); if (part) open(part); else back(); });
  document.addEventListener("focusin", ({ target }) => { const part = told(target); if (part) open(part); else close(); });
  document.addEventListener("keydown", ({ key }) => { if (key === "Escape") close(); });
  addEventListener("scroll", back, { passive: true });

  // The matrix as it is shown, as a file.
  place("csv").addEventListener("click", () => {
    const said = (cell) => {
      const copy = cell.cloneNode(true);
      copy.querySelectorAll("[aria-hidden]").forEach((part) => part.remove());
      copy.querySelectorAll("small, .f").forEach((part) => part.before(" "));
      return copy.textContent.replace(/\s+/g, " ").trim();
    };
    const lines = [...table.querySelectorAll("tr:not(.group)")].map((row) => {
      const above = row.dataset.of ? `${row.dataset.of} ` : "";
      return [...row.cells].map((cell, at) => `"${((at ? "" : above) + said(cell)).replaceAll('"', '""')}"`).join(",");
    });
    const address = URL.createObjectURL(new Blob([lines.join("\n")], { type: "text/csv" }));
    Object.assign(document.createElement("a"), { href: address, download: `engines to ${place("tolerated").textContent}${forces.checked ? " with forces" : ""}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  });
})();
