// Starts the figures of a page. Each is a <div data-figure="name"> that holds its settings; what it
// needs is loaded beside this script, so that a page without figures loads nothing else.
(function (root) {
  "use strict";
  const here = document.currentScript.src.replace(/[^/]*$/, "");
  const loaded = {};
  const script = (name) => loaded[name] ??= new Promise((done, failed) => {
    const tag = Object.assign(document.createElement("script"), { src: here + name, onload: done, onerror: failed });
    document.head.append(tag);
  });
  async function start(host) {
    const settings = JSON.parse(host.querySelector("script[type='application/json']").textContent);
    await script("kernel.js");
    await script("stage.js");
    await script(`${host.dataset.figure}.js`);
    root.figures[host.dataset.figure](host.querySelector(".stage"), settings);
    host.classList.add("computes");
    let cell = host.closest(".cell"), wanted = null;
    for (let i = host.dataset.instead ? Number(host.dataset.instead) || 1 : 0; cell && i > 0; i--) {
      cell = cell.previousElementSibling;
      cell?.classList.add("stands-in");
      wanted ??= location.hash && cell?.querySelector(`[id="${CSS.escape(decodeURIComponent(location.hash.slice(1)))}"]`);
    }
    if (wanted) host.scrollIntoView(); // the address of a picture whose place the figure takes
  }
  document.addEventListener("DOMContentLoaded", () => {
    document.querySelectorAll("[data-figure]").forEach(start);
  });
})((globalThis.navfilters ??= {}));
