// Names at the right ends of curves, where there is room beside them. Curves that end too near one another share a name
// with their count; the pointer on it tells all. What ends outside the frame stands at its edge, with an arrow.
const ends = (() => {
  const LINE = 13, LONGEST = 23;  // height of a name [px], and its letters
  const NAME = "end";           // of such an annotation
  const ROOM = 162, LEAST = 480;  // width beside a picture, and the least width of one with names [px]

  const room = (width) => (width >= LEAST ? ROOM : 8);
  const cut = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}…` : text);

  // Last value of a curve up to a time; null: it has none.
  function last(values, times, until) {
    for (let i = values.length - 1; i >= 0; i--) if (times[i] <= until && values[i] !== null && Number.isFinite(values[i])) return values[i];
    return null;
  }

  // Ends in one half of a figure: name, colour and value of each curve that is shown.
  function found({ rows, time, observable, off }, lower, until) {
    const { truth, engines } = observable;
    const items = lower ? [] : [{ name: "truth", tone: "--muted", value: last(truth, time, until) }];
    for (const { row, difference, at } of engines) {
      if (off.has(row)) continue;
      const where = at ?? [...time.keys()], times = where.map((i) => time[i]);
      const value = last(lower ? difference.map((d) => (d ? Math.abs(d) : null)) : where.map((i, k) => (difference[k] === null ? null : truth[i] + difference[k])), times, until);
      items.push({ name: rows[row].label, whole: rows[row].name, tone: `--e${rows[row].colour}`, value });
    }
    return items.filter(({ value }) => value !== null);
  }

  // Groups from top to bottom whose middles are at least a line apart.
  function apart(items) {
    const groups = items.sort((a, b) => a.y - b.y).map((item) => ({ items: [item], y: item.y }));
    for (let k = 0; k + 1 < groups.length;) {
      const [one, next] = [groups[k], groups[k + 1]];
      if (next.y - one.y >= LINE) { k++; continue; }
      const all = [...one.items, ...next.items];
      groups.splice(k, 2, { items: all, y: all.reduce((sum, { y }) => sum + y, 0) / all.length });
      k = Math.max(0, k - 1);
    }
    return groups;
  }

  // Annotations of a figure with a layout and a height [px]; none where there is no room.
  function labels(figure, layout, height) {
    const { paint } = figure, { margin } = layout;
    if (margin.r < ROOM) return [];
    return [["yaxis", "y domain", false], ["yaxis2", "y2 domain", true]].flatMap(([name, ref, lower]) => {
      const { range: [low, high], domain } = layout[name], until = layout.xaxis.range[1] * (1 + 1e-9);
      const length = (height - margin.t - margin.b) * (domain[1] - domain[0]);
      const items = found(figure, lower, until).map((item) => {
        const y = (length * (high - (lower ? Math.log10(item.value) : item.value))) / (high - low), beyond = y < 0 ? "↑ " : y > length ? "↓ " : "";
        return { ...item, beyond, y: Math.min(Math.max(y, 0), length) };
      });
      return apart(items).map(({ items: group, y }) => {
        const first = group.find(({ name: word }) => word === "truth") ?? group[0], more = group.length > 1 ? ` +${group.length - 1}` : "";
        return {
          xref: "x domain", x: 1, xanchor: "left", xshift: 4, yref: ref, y: 1 - y / length, yanchor: "middle", name: NAME, tone: paint(first.tone),
          text: `${first.beyond}${cut(first.name, LONGEST - more.length - first.beyond.length)}${more}`,
          font: { size: 10, color: paint("--ink") }, hovertext: group.map(({ whole, name: word }) => whole ?? word).join("\n"),
        };
      });
    });
  }

  return { labels, room, NAME };
})();
