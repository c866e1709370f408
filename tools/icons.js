// Draws the icons that the pages name. The shapes are Font Awesome Free's (CC BY 4.0), put above by book_pages.py.
(() => {
  "use strict";
  const SVG = "http://www.w3.org/2000/svg";
  const style = document.createElement("style");
  style.textContent = `
    .svg-inline--fa { display: inline-block; height: 1em; overflow: visible; vertical-align: -0.125em; box-sizing: content-box }
    .svg-inline--fa.fa-lg { font-size: 1.25em; line-height: 0.05em; vertical-align: -0.2em }`;
  document.head.append(style);

  const draw = (mark) => {
    const name = [...mark.classList].filter((c) => c.startsWith("fa-")).map((c) => c.slice(3)).find((c) => c in ICONS);
    if (!name) return;
    const [width, height, path] = ICONS[name];
    const svg = document.createElementNS(SVG, "svg"), shape = document.createElementNS(SVG, "path");
    for (const { name: key, value } of mark.attributes) svg.setAttribute(key, value);
    svg.classList.add("svg-inline--fa");
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("aria-hidden", "true");
    svg.setAttribute("focusable", "false");
    shape.setAttribute("fill", "currentColor");
    shape.setAttribute("d", path);
    svg.append(shape);
    mark.replaceWith(svg);
  };
  const all = (within) => within.querySelectorAll('i[class*="fa-"]').forEach(draw);
  const begin = () => {
    all(document);
    new MutationObserver((changes) => {
      for (const { addedNodes } of changes)
        for (const node of addedNodes)
          if (node instanceof Element) node.matches('i[class*="fa-"]') ? draw(node) : all(node);
    }).observe(document.body, { childList: true, subtree: true });
  };
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
