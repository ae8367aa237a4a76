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

// The contents mark the section that is being read, and keep its link in sight.
(() => {
  const contents = document.querySelector("nav");
  const links = [...contents.querySelectorAll("a")].map((link) => [link, document.getElementById(link.hash.slice(1))]);
  let marked = null;
  function follow() {
    const begun = links.filter(([, section]) => section && section.getBoundingClientRect().top < innerHeight / 3);
    const link = begun.length ? begun[begun.length - 1][0] : null;
    if (link === marked) return;
    if (marked) marked.removeAttribute("aria-current");
    if (link) link.setAttribute("aria-current", "true");
    contents.scrollLeft = link ? link.offsetLeft - contents.offsetLeft - 40 : 0;
    marked = link;
  }
  addEventListener("scroll", follow, { passive: true });
  follow();
})();

// A table says so while there are rows below those that it shows.
(() => {
  const regions = [...document.querySelectorAll(".scroll")];
  const look = (region) => region.classList.toggle("more", region.scrollTop + region.clientHeight < region.scrollHeight - 4);
  regions.forEach((region) => region.addEventListener("scroll", () => look(region), { passive: true }));
  const sizes = new ResizeObserver((changes) => changes.forEach((change) => look(change.target)));
  regions.forEach((region) => sizes.observe(region));
})();
