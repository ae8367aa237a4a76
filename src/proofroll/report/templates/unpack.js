"use strict";
// The text of a compressed element, as a promise; unpacked once.
const unpack = (() => {
  const texts = new Map();
  return (id) => {
    if (!texts.has(id)) {
      const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (sign) => sign.charCodeAt(0));
      texts.set(id, new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text());
    }
    return texts.get(id);
  };
})();
