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
    if (host.dataset.instead) host.closest(".cell")?.previousElementSibling?.classList.add("stands-in");
  }
  document.addEventListener("DOMContentLoaded", () => {
    document.querySelectorAll("[data-figure]").forEach(start);
  });
})((globalThis.navfilters ??= {}));
