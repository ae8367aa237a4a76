// The matrix of engines and scenes: its cells at the tolerance that the reader chooses; rows and columns unfold.
(() => {
  const table = document.getElementById("choice");
  if (!table) return;
  const form = document.getElementById("choose");
  const slider = document.getElementById("tolerance");
  const forces = document.getElementById("forces");
  const scene = document.getElementById("scene");
  const told = document.getElementById("tolerated");
  const answer = document.getElementById("answer");
  const rows = [...table.tBodies[0].rows], heads = [...table.tHead.rows[0].cells];
  const symbols = {{ symbols|tojson }};
  const first = {{ decades.start }}, count = {{ decades|length }};

  // Texts are inserted as text nodes, for an engine's message must not become markup.
  function fill(cell, [state, text, title, href], best, step) {
    cell.className = `cell ${state}${best ? " best" : ""}`;
    cell.replaceChildren();
    const hidden = (word) => Object.assign(document.createElement("span"), { className: "vh", textContent: word });
    if (state === "none") return cell.append(hidden("not run"));
    const link = Object.assign(document.createElement("a"), { title });
    if (href) link.href = `#${href}`;
    const sign = Object.assign(document.createElement("span"), { textContent: symbols[state] });
    sign.setAttribute("aria-hidden", "true");
    link.append(sign, hidden(best ? "cheapest that agrees" : state), ` ${text}`);
    if (best && step) link.append(" ", Object.assign(document.createElement("small"), { textContent: step }));
    cell.append(link);
  }
  const chosen = (on) => [...form.querySelectorAll("[name=engine]")].filter((box) => box.checked === on).map((box) => box.value);
  const { needs, unit, nothing, unjudged, tolerances, with_forces, same, unjudged_forces, lacking: unheld } = {{ answer_words|tojson }};
  // The cheapest of the chosen engines, worded as `ChoiceMatrix.answer`.
  function sentence(best, { groups, judged }) {
    const held = best.filter((found, j) => found && groups[j]).map((found) => found[1]);
    const without = groups.filter((group, j) => group && !best[j] && judged[+forces.checked].includes(group));
    const lacking = without.length ? `${nothing} ${without.join(", ")}` : "";
    const asked = needs[+forces.checked].replaceAll("{0}", tolerances[Number(slider.value) - first]);
    const whole = held.length ? `The cheapest to hold ${asked}, ${unit}: ${[held.join(", "), lacking].filter(Boolean).join("; ")}.` : `To hold ${asked}: ${lacking || (groups.some(Boolean) ? unjudged : "nothing was run")}.`;
    return chosen(false).length ? `${whole} This is of ${chosen(true).join(", ") || "no engine"} alone.` : whole;
  }
  // Changes if forces count, worded as `ChoiceMatrix.with_forces`.
  function also(motion, both, { groups, judged }) {
    const asked = groups.map((group, j) => ({ group, before: motion[j]?.[1], now: both[j]?.[1] })).filter(({ group }) => group && judged[1].includes(group));
    const listed = (words, test) => { const found = asked.filter(test).map(({ group }) => group); return found.length ? `${words} ${found.join(", ")}` : ""; };
    const other = asked.filter(({ before, now }) => now && now !== before).map(({ now }) => now).join(", ");
    const said = [other, listed(same, ({ before, now }) => now && now === before), listed(nothing, ({ now }) => !now)];
    const silent = groups.filter((group) => group && judged[0].includes(group) && !judged[1].includes(group));
    if (silent.length) said.push(`${unjudged_forces} ${silent.join(", ")}`);
    return judged[1].length ? `${with_forces.replace("{0}", tolerances[Number(slider.value) - first])}: ${said.filter(Boolean).join("; ")}.` : "";
  }
  // Advice for each column, of the chosen engines, worded as `of_column` but without the effect of forces.
  function advised({ said, heads, engines }) {
    const off = new Set(chosen(false));
    if (!off.size) return said;
    const times = (ratio) => ratio === 1 ? "as much" : `${ratio} times that`;
    return [...heads.map((head, j) => {
      const own = engines[j].filter(([engine]) => !off.has(engine));
      if (!own.length) return engines[j].length ? `${head} none of the chosen engines was run.` : said[j];
      const [[, least, name, text]] = own;
      const others = own.slice(least === null ? 0 : 1).map(([, cost, other]) => cost === null ? other : `${other} costs ${times(Number((cost / least).toPrecision(2)))}`);
      return `${head} ${[least === null ? unheld : `take ${name} (${text})`, ...others].join("; ")}.`;
    }), `This is of ${chosen(true).join(", ") || "no engine"} alone. What serves all scenes, and what forces change, is said of all engines together.`];
  }
  // A text whose numbers as 1e-3 are not broken, as `unbroken`.
  const put = (place, text) => place.replaceChildren(...text.split(/(\d[\d.]*e-\d+(?: (?:s|m|N|J|rad)\b(?:\/s)?)?)/).map(
    (part, at) => at % 2 ? Object.assign(document.createElement("span"), { className: "whole", textContent: part }) : part));
  // The chosen scene, or group of scenes, alone: its column, the rows that ran there, and the sentences.
  function narrow() {
    const only = scene.value === "" ? null : Number(scene.value) + 1;
    const fold = only && table.querySelector(`[data-group="${CSS.escape(heads[only].dataset.of ?? "")}"][aria-expanded=false]`);
    if (fold) unfoldChoice(fold, true);
    for (const row of [heads[0].parentElement, ...rows]) {
      [...row.cells].forEach((cell, at) => cell.classList.toggle("beside", only !== null && at > 0 && at !== only));
      row.classList.toggle("beside", only !== null && row.cells[only].matches(".none"));
    }
    document.querySelectorAll("#words li").forEach((line, at) => { line.hidden = only !== null && at !== only - 1; });
  }
  async function show() {
    const place = (forces.checked ? count : 0) + Number(slider.value) - first;
    told.textContent = `1e-${slider.value}`;
    slider.setAttribute("aria-valuetext", told.textContent);
    const data = JSON.parse(await unpack("choices"));
    if (scene.value !== "") data.groups = data.names.map((name, j) => j === Number(scene.value) ? name : "");
    const cheapest = (asked) => data.ranks[asked].map((ranked) => ranked.find(([at]) => !rows[at].classList.contains("off")));
    const best = cheapest(place);
    rows.forEach((row, i) => data.grid[i].forEach((numbers, j) => fill(row.cells[j + 1], data.cells[numbers[place]], best[j]?.[0] === i, best[j]?.[2])));
    put(answer, sentence(best, data));
    put(document.getElementById("also"), forces.checked ? "" : also(best, cheapest(place + count), data));
    const words = advised(JSON.parse(await unpack("all-words"))[place]);
    document.querySelectorAll("#words li").forEach((line, i) => put(line, words[i]));
    narrow();
    table.dataset.at = place;
    table.dispatchEvent(new Event("filled"));
  }
  slider.addEventListener("input", show);
  form.addEventListener("change", (event) => {
    if (event.target.name === "engine") hide(document);
    if (event.target !== slider) show();
  });
  function hide(within) {
    const off = new Set(chosen(false));
    within.querySelectorAll("[data-engine]").forEach((part) => part.classList.toggle("off", off.has(part.dataset.engine)));
  }
  everywhere(hide);
  form.addEventListener("submit", (event) => event.preventDefault());

  // Before the head itself hears of it, which would sort its column.
  table.addEventListener("keypress", (event) => { if (event.target.closest("thead :is([data-group], a)")) event.stopPropagation(); }, true);
  table.addEventListener("click", (event) => {
    const button = event.target.closest("[data-group], [data-model]");
    if (event.target.closest("thead :is([data-group], a)")) event.stopPropagation();
    if (!button) return;
    unfoldChoice(button, button.getAttribute("aria-expanded") !== "true");
  }, true);
})();
