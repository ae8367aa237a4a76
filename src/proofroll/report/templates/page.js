"use strict";
// Text that the page keeps until it is needed, e.g. the curves.
const stored = unpack;

// Applies a function to the page, and to each part that is built later.
function everywhere(action) {
  action(document);
  document.addEventListener("built", (event) => action(event.target));
}

// The address: `#verdicts` is a place, `#tol=1e-5&kinds=loops&at=verdicts` a question and a place.
const address = (() => {
  const parts = [];  // of the question: [function that writes it into parameters, function that takes it from them]
  let taking = false;
  const read = () => {
    const text = location.hash.slice(1);
    return new URLSearchParams(text.includes("=") ? text : { at: decodeURIComponent(text) });
  };
  // The hash of the present question with a place.
  function asked(at) {
    const words = new URLSearchParams();
    parts.forEach(([write]) => write(words));
    const question = String(words).replaceAll("%2C", ",");
    return `#${[question, at && (question ? `at=${encodeURIComponent(at)}` : at)].filter(Boolean).join("&")}`;
  }
  function write(at, how) {
    const hash = asked(at);
    if (!taking && hash !== (location.hash || "#")) history[how](null, "", hash);
  }
  function take() {
    taking = true;
    const words = read();
    parts.forEach(([, of]) => of(words));
    taking = false;
  }
  document.addEventListener("DOMContentLoaded", take);
  addEventListener("hashchange", take);
  return {
    asked,
    at: () => read().get("at"),
    // A question asked in a section is a step of the back button; what is opened on the way is none.
    ask: (control) => write([control.closest("section")?.id].find((id) => id && id !== "answer"), "pushState"),
    note: () => write(read().get("at"), "replaceState"),
    keep: (...part) => parts.push(part),
  };
})();

// A fold is built when it is opened; until then it is a text, which may contain further folds.
const folds = (() => {
  const button = document.getElementById("unfold");
  const place = (number) => document.querySelector(`[data-fold="${number}"]`);
  let texts = null, atFirst = new Set();
  const ready = async () => (texts ??= JSON.parse(await stored("folds")));

  function build(empty) {
    const fold = empty.parentElement, made = document.createElement("template");
    made.innerHTML = texts[empty.dataset.fold];
    empty.replaceWith(made.content);
    fold.dispatchEvent(new Event("built", { bubbles: true }));
  }
  // The element with an id; builds the folds around it first.
  async function find(id) {
    if (document.getElementById(id)) return document.getElementById(id);
    await ready();
    const holding = (word) => texts.findIndex((text) => text.includes(word));
    const chain = [holding(` id="${id}"`)];
    while (chain[0] >= 0 && !place(chain[0])) chain.unshift(holding(`data-fold="${chain[0]}"`));
    if (chain[0] >= 0) chain.forEach((number) => build(place(number)));
    return document.getElementById(id);
  }
  document.addEventListener("toggle", async ({ target }) => {
    const empty = () => target.open && target.querySelector(":scope > [data-fold]");
    if (!empty()) return;
    await ready();
    if (empty()) build(empty());
  }, true);
  // Builds and opens every fold, some at a time where a reader waits, so that the page answers meanwhile.
  function* opening() {
    for (let folds = [...document.querySelectorAll("details")]; folds.length;) {
      const made = [];
      for (const fold of folds) {
        const empty = fold.querySelector(":scope > [data-fold]");
        if (empty) {
          build(empty);
          made.push(...fold.querySelectorAll("details"));
        }
        fold.open = true;
        yield;
      }
      folds = made;
    }
  }
  function open() { for (const _ of opening()); }
  const all = () => ready().then(open);
  // Opens every fold, or closes those that were closed at first.
  async function openSlowly() {
    const steps = opening(), pause = () => new Promise((go) => { setTimeout(go); });
    for (let begun = performance.now(); !steps.next().done;) {
      if (performance.now() - begun < 40) continue;
      await pause();
      begun = performance.now();
    }
  }
  button.addEventListener("click", async () => {
    const isOpening = button.getAttribute("aria-pressed") === "false";
    button.disabled = true;
    if (isOpening) {
      atFirst = new Set(document.querySelectorAll("details[open]"));
      button.textContent = "Opening all …";
      await ready();
      await openSlowly();
    } else document.querySelectorAll("details").forEach((fold) => { fold.open = atFirst.has(fold); });
    button.setAttribute("aria-pressed", String(isOpening));
    button.textContent = isOpening ? "Close all" : "Open all";
    button.disabled = false;
  });
  addEventListener("load", () => (window.requestIdleCallback ?? setTimeout)(ready));
  // What a reader opened is in the address: folds of the class "kept".
  const opened = () => [...document.querySelectorAll("details.kept[open]")];
  document.addEventListener("toggle", ({ target }) => { if (target.matches("details.kept")) address.note(); }, true);
  address.keep(
    (words) => { const names = opened().map((fold) => fold.id); if (names.length) words.set("open", names.join(",")); },
    (words) => {
      const names = (words.get("open") ?? "").split(",").filter(Boolean), there = opened();
      there.filter((fold) => !names.includes(fold.id)).forEach((fold) => { fold.open = false; });
      names.map((name) => document.getElementById(name)).forEach((fold) => { if (fold?.matches("details.kept")) fold.open = true; });
    },
  );
  return { find, all };
})();

// A link to evidence opens the folds around it.
(() => {
  async function reveal() {
    document.querySelectorAll(".target").forEach((element) => element.classList.remove("target"));
    const target = address.at() && (await folds.find(address.at()));
    if (!target) return;
    for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    for (const fold of target.querySelectorAll(":scope > details:only-of-type")) fold.open = true;
    target.classList.add("target");
    // A section that is not drawn has no place for what is in it yet.
    target.closest("main > section")?.style.setProperty("content-visibility", "visible");
    target.scrollIntoView();
    if (target.hasAttribute("tabindex")) target.focus({ preventScroll: true });
  }
  addEventListener("hashchange", reveal);
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[href^='#']");
    if (!link || event.ctrlKey || event.metaKey || event.shiftKey) return;
    const hash = address.asked(decodeURIComponent(link.hash.slice(1)));
    event.preventDefault();
    if (hash === location.hash) reveal();
    else location.hash = hash;
  });
  reveal();
})();

// Sections below the screen get their heights once the browser is idle, for links, searches and the scroll bar.
addEventListener("load", () => {
  const waiting = [...document.querySelectorAll("main > section")], idle = window.requestIdleCallback ?? setTimeout;
  function next() {
    const section = waiting.shift();
    if (!section) return;
    section.style.contentVisibility = "visible";
    idle(next);
  }
  idle(next);
});

// The rail marks the section that is being read; on a narrow screen a list of sections stands in its place.
(() => {
  const rail = document.querySelector(".rail"), jump = document.getElementById("jump");
  const links = [...rail.querySelectorAll("ul a")];
  const place = (link) => document.getElementById(link.hash.slice(1));
  links.forEach((link) => jump.append(new Option(link.textContent, link.hash)));
  jump.addEventListener("change", () => { location.hash = address.asked(jump.value.slice(1)); });
  let marked = null, waiting = false;
  function follow() {
    waiting = false;
    const begun = links.filter((link) => place(link)?.getBoundingClientRect().top < innerHeight / 3);
    const link = begun.at(-1) ?? links[0];
    if (link === marked) return;
    marked?.removeAttribute("aria-current");
    link.setAttribute("aria-current", "true");
    jump.value = link.hash;
    if (link.offsetTop < rail.scrollTop || link.offsetTop > rail.scrollTop + rail.clientHeight) rail.scrollTop = link.offsetTop - 60;
    marked = link;
  }
  addEventListener("scroll", () => { if (!waiting) { waiting = true; requestAnimationFrame(follow); } }, { passive: true });
  follow();
})();

// A table notes that rows follow below its visible ones; its edge fades while columns follow beyond it.
(() => {
  const look = (region) => {
    region.classList.toggle("more", region.scrollTop + region.clientHeight < region.scrollHeight - 4);
    region.classList.toggle("beyond", region.scrollLeft + region.clientWidth < region.scrollWidth - 4);
  };
  const sizes = new ResizeObserver((changes) => changes.forEach((change) => look(change.target)));
  everywhere((part) => part.querySelectorAll(".scroll").forEach((region) => {
    region.addEventListener("scroll", () => look(region), { passive: true });
    sizes.observe(region);
  }));
})();

// A button beside each command copies it; it comes with the part of the page that has the command. One copies the address.
(() => {
  everywhere((part) => part.querySelectorAll("dd > code").forEach((code) => {
    if (!code.textContent.startsWith("proofroll ")) return;
    const button = Object.assign(document.createElement("button"), { type: "button", className: "copy", textContent: "copy" });
    button.setAttribute("aria-label", "Copy the command");
    code.after(" ", button);
  }));
  document.addEventListener("click", async ({ target }) => {
    const button = target.closest?.("button.copy");
    if (!button) return;
    const code = button.parentElement.querySelector("code"), words = (button.dataset.words ??= button.textContent);
    try {
      await navigator.clipboard.writeText(code ? code.textContent : location.href);
      button.textContent = "copied";
    } catch {
      // A browser that forbids it has the command selected, and the address in its bar.
      if (code) getSelection().selectAllChildren(code);
      button.textContent = code ? "selected" : "copy it from the address bar";
    }
    setTimeout(() => { button.textContent = words; }, 2000);
  });
})();
