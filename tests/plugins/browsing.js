"use strict";
// What a reader of a page would notice, measured. Each question is answered with what is wrong: nothing is good.
window.reading = (() => {
  const all = () => [...document.body.querySelectorAll("*")].filter((element) => element.checkVisibility({ visibilityProperty: true }));
  const named = (element) => `${element.tagName}.${element.getAttribute("class") ?? ""} ${element.getAttribute("aria-label") ?? ""}`;
  const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));

  // An svg without content has a size of its own, but no box.
  const pictured = (element) => [...element.querySelectorAll("svg, canvas")].some((picture) => {
    const { width, height } = picture.getBBox?.() ?? picture.getBoundingClientRect();
    return width > 20 && height > 20;
  });

  // Scrolls to every figure that is not folded away and waits so many milliseconds for its picture: the captions of those that stay empty.
  async function undrawn(which, patience) {
    const empty = [];
    for (const figure of document.querySelectorAll(which)) {
      if (!figure.checkVisibility()) continue;
      figure.scrollIntoView({ block: "center", behavior: "instant" });
      for (let waited = 0; !pictured(figure) && waited < patience; waited += 20) await pause(20);
      if (!pictured(figure)) empty.push(figure.textContent.trim());
    }
    return empty;
  }

  // Ids of the sections in which there is nothing but headings: no text, and no picture.
  function empty() {
    const silent = (section) => {
      const copy = section.cloneNode(true);
      copy.querySelectorAll("h1, h2, h3, h4, h5, h6, script, style").forEach((element) => element.remove());
      return !copy.textContent.trim() && !pictured(section);
    };
    return [...document.querySelectorAll("section[id]")].filter(silent).map((section) => section.id);
  }

  // Texts in which a number like 1e-4 stands in two lines.
  function broken() {
    const found = [], texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), range = document.createRange();
    for (let text; (text = texts.nextNode());) {
      if (!/\de-\d/.test(text.data) || text.parentElement.closest("script, style, svg")) continue;
      for (const number of text.data.matchAll(/\d[\d.]*e-\d+/g)) {
        range.setStart(text, number.index);
        range.setEnd(text, number.index + number[0].length);
        if (new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size > 1) found.push(`${number[0]} in ${text.data.trim()}`);
      }
    }
    return found;
  }

  // Where links lead to and a reader who follows them sees nothing for so many milliseconds, everything being folded before.
  async function lost(which, patience) {
    const links = new Map([...document.querySelectorAll(which)].map((link) => [link.hash, link]));
    const found = [];
    document.querySelectorAll("details").forEach((fold) => { fold.open = false; });
    for (const link of links.values()) {
      link.click();
      const there = () => document.getElementById(decodeURIComponent(link.hash.slice(1)));
      const seen = () => there()?.checkVisibility() && (!there().matches("details") || there().open);
      for (const end = performance.now() + patience; !seen() && performance.now() < end;) await pause(0);
      if (!seen()) found.push(link.hash);
      const target = there();
      for (let fold = target?.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = false;
    }
    return found;
  }

  // The browser itself reads a colour, however it is written.
  const brush = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const known = new Map();
  function rgba(colour) {
    if (!known.has(colour)) {
      brush.clearRect(0, 0, 1, 1);
      brush.fillStyle = colour;
      brush.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = brush.getImageData(0, 0, 1, 1).data;
      known.set(colour, [r, g, b, a / 255]);
    }
    return known.get(colour);
  }
  const over = ([r, g, b, a], [x, y, z]) => [a * r + (1 - a) * x, a * g + (1 - a) * y, a * b + (1 - a) * z];
  function behind(element) {
    if (!element) return [255, 255, 255];
    const colour = rgba(getComputedStyle(element).backgroundColor);
    return colour[3] === 1 ? colour : over(colour, behind(element.parentElement));
  }
  const opacity = (element) => (element ? getComputedStyle(element).opacity * opacity(element.parentElement) : 1);
  // Relative luminance as WCAG 2.2 defines it, of sRGB.
  function luminance(colour) {
    const [r, g, b] = colour.slice(0, 3).map((part) => part / 255).map((s) => (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  }

  // Every text whose contrast with what is behind it is below the least.
  function faint(least) {
    const found = [];
    for (const element of all()) {
      const text = [...element.childNodes].filter((node) => node.nodeType === 3).map((node) => node.data.trim()).join("");
      if (!text || element.closest("script, style, noscript, svg, .skip")) continue;
      const ground = behind(element), [r, g, b, a] = rgba(getComputedStyle(element).color);
      const light = [luminance(ground), luminance(over([r, g, b, a * opacity(element)], ground))].sort((x, y) => x - y);
      const ratio = (light[1] + 0.05) / (light[0] + 0.05);
      if (ratio < least) found.push(`${named(element)}: "${text.slice(0, 30)}" ${ratio.toFixed(2)}`);
    }
    return found;
  }

  // How far the page reaches past the right edge of the screen, and what does so without lying in something that scrolls.
  // A phone widens its layout to a page that is too wide, a moment later: the screen stays as it is.
  function wide() {
    const edge = Math.min(document.documentElement.clientWidth, screen.width);
    const scrolls = (element) => element && (getComputedStyle(element).overflowX !== "visible" || scrolls(element.parentElement));
    const found = all().filter((element) => element.getBoundingClientRect().right > edge + 1 && !scrolls(element.parentElement));
    return [document.scrollingElement.scrollWidth - edge, found.map(named)];
  }

  // What is wider than the paper, and what hides a part of itself behind a scroll bar that paper does not have.
  function cut() {
    const shown = all().filter((element) => !element.closest("svg, .vh, .canvas"));
    const beyond = shown.filter((element) => element.getBoundingClientRect().right > document.documentElement.clientWidth + 1);
    const hidden = shown.filter((element) => getComputedStyle(element).overflowX !== "visible" && element.scrollWidth > element.clientWidth + 1);
    return [beyond.map(named), hidden.map(named)];
  }

  // Everything that a keyboard must reach, numbered in the order of the page; and from now on each that gets the focus.
  function reachable() {
    const found = all().filter((element) => element.matches("a[href]:not([tabindex='-1']), button, summary, input, select, [tabindex='0']") && !element.disabled);
    found.forEach((element, number) => { element.dataset.number = number; });
    return found.map(named);
  }
  function visits() {
    const found = [];
    addEventListener("focusin", ({ target }) => {
      const style = getComputedStyle(target), { top, bottom } = target.getBoundingClientRect();
      found.push({
        number: Number(target.dataset.number ?? -1),
        outlined: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1,
        seen: bottom > 0 && top < innerHeight,
      });
    });
    return found;
  }

  // Whatever moves by itself for longer than a frame.
  const moving = () => all().filter((element) => {
    const { transitionDuration, animationDuration, scrollBehavior } = getComputedStyle(element);
    return parseFloat(transitionDuration) > 0.01 || parseFloat(animationDuration) > 0.01 || scrollBehavior === "smooth";
  }).map(named);

  return { undrawn, broken, empty, lost, faint, wide, cut, reachable, visits, moving };
})();
