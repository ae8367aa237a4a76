// The search of the documentation: pages before code. An object of the reference comes after whatever a page says.
var Scorer = {
  score: ([docname, title, anchor, description, score, filename, kind]) =>
    kind === "object" || kind === "index" || docname === "reference" ? score - 100 : score,
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
