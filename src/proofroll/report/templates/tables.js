// Tables sort (but maps and spreads), filter and download once they come near; the library is kept compressed until the first one does.
(() => {
  const order = {{ symbols|list|tojson }};
  let library = null;
  function load() {
    library ??= unpack("datatables").then((text) => {
      const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
      return import(address).finally(() => URL.revokeObjectURL(address));
    });
    return library;
  }
  const sorts = (table) => table.querySelector("tbody tr:not(.group)");

  // A map and a spread rank nothing: they keep the order of their file.
  const ranks = (table) => !table.matches(".heat, .spread");

  // Rows of engines one after the other, each with its engine: a table that sorts has neither groups nor joined cells.
  function flatten(table) {
    const body = table.tBodies[0];
    let named = "";
    for (const part of [...table.tBodies]) {
      for (const row of [...part.rows]) {
        if (row.classList.contains("group")) { named = row.textContent.replace("#", "").trim(); row.remove(); continue; }
        if (part.dataset.engine) {
          row.dataset.engine = part.dataset.engine;
          row.classList.toggle("off", part.classList.contains("off"));
          if (row.cells[0].textContent.trim() !== named) row.cells[0].prepend(`${named} `);
        }
        for (const joined of row.querySelectorAll("[colspan]")) {
          (row.querySelector(".word") ?? row.cells[0]).append(Object.assign(document.createElement("small"), { className: "why", textContent: joined.textContent, title: joined.textContent }));
          for (let more = joined.colSpan; more > 0; --more) joined.before(Object.assign(document.createElement("td"), { className: "cell none", textContent: "–" }));
          joined.remove();
        }
        body.append(row);
      }
      if (part !== body) part.remove();
    }
    delete body.dataset.engine;
    body.classList.remove("off");
  }
  // Sort key of a cell: its verdict, or its first number; infinite values come last.
  function rank(cell, numeric) {
    const verdict = cell.querySelector(":scope > .v");
    if (verdict) return order.indexOf(verdict.classList[1]);
    const text = (cell.matches(".bar") ? cell.querySelector(".vh") : cell)?.textContent ?? "";
    if (!numeric) return text.trim();
    const found = text.replace("−", "-").match(/-?\d[\d.]*(?:e[-+]?\d+)?/i);
    return found ? Number(found[0]) : text.includes("∞") ? 1e300 : 1e301;
  }
  function keyTable(rows, heads) {
    for (const row of rows) {
      heads.forEach((head, at) => { row.cells[at].dataset.order = rank(row.cells[at], head.matches(".n, .bar") || row.cells[at].classList.contains("step")); });
    }
  }
  function said(cell) {
    const copy = cell.cloneNode(true);
    copy.querySelectorAll("[aria-hidden], .dt-column-order").forEach((part) => part.remove());
    copy.querySelectorAll("br, small, b").forEach((part) => part.before(" "));
    return `${cell.dataset.axis ?? ""} ${copy.textContent}`.replace(/\s+/g, " ").trim();
  }
  async function enliven(table) {
    const { default: DataTable } = await load();
    const region = table.closest(".scroll");
    const label = region.getAttribute("aria-label");
    flatten(table);
    const heads = [...[...table.tHead.rows].at(-1).cells], rows = [...table.tBodies[0].rows];
    if (ranks(table)) keyTable(rows, heads);
    const made = new DataTable(table, {
      paging: false, info: false, autoWidth: false, ordering: ranks(table), order: [], orderDescReverse: false,
      language: { search: "Filter", zeroRecords: "no row has this" },
      layout: {
        topStart: rows.length < 2 ? null : "search",
        // A file has one row of heads: the last one, whose cells name their groups.
        topEnd: { buttons: [{ extend: "csv", text: "CSV", filename: label, title: null,
          exportOptions: { customizeData: (data) => { data.headerStructure = data.headerStructure.slice(-1); }, format: { body: (_, __, ___, cell) => said(cell), header: (_, __, cell) => said(cell ?? heads[__]) } } }] },
        bottomStart: null, bottomEnd: null,
      },
    });
    const tools = made.table().container().querySelector(".dt-layout-row:not(.dt-layout-table)");
    tools.classList.add("tools");
    tools.querySelector("input")?.setAttribute("aria-label", `Filter: ${label}`);
    tools.querySelector("button").setAttribute("aria-label", `CSV: ${label}`);
    region.previousElementSibling.replaceWith(tools);
    region.dataset.sorts = "";
  }
  const near = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (!entry.isIntersecting) return;
    near.unobserve(entry.target);
    (window.requestIdleCallback ?? setTimeout)(() => enliven(entry.target));
  }), { rootMargin: "400px" });
  everywhere((part) => part.querySelectorAll(".scroll > table").forEach((table) => {
    if (!sorts(table)) return;
    // Room for the signs and the tools of a table that sorts, so that nothing moves when they come.
    table.classList.toggle("sorts", ranks(table));
    table.closest(".scroll").before(Object.assign(document.createElement("div"), { className: "tools" }));
    near.observe(table);
  }));
})();
