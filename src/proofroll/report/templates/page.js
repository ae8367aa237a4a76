"use strict";
// Text that the page keeps until it is needed, e.g. the curves.
const stored = unpack;

// A link to evidence opens what it lies in.
(() => {
  function reveal() {
    document.querySelectorAll(".target").forEach((element) => element.classList.remove("target"));
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    target.classList.add("target");
    target.scrollIntoView();
  }
  addEventListener("hashchange", reveal);
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[href^='#']");
    if (link && link.hash === location.hash) reveal();
  });
  reveal();
})();
