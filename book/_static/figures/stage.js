// What every computing figure shares: axes, ellipses, handles, controls, and its state in the address.
(function (root) {
  "use strict";
  const SVG = "http://www.w3.org/2000/svg";

  function element(name, attributes = {}, ...children) {
    const made = name.startsWith("svg:") ? document.createElementNS(SVG, name.slice(4))
      : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
      else if (value !== null && value !== undefined) made.setAttribute(key, value);
    }
    made.append(...children);
    return made;
  }
  const clear = (node) => node.replaceChildren();

  // Three digits; powers of ten where a number is tiny or huge.
  function digits(value) {
    if (!Number.isFinite(value)) return "not a number";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-3 || size >= 1e5)) {
      const power = Math.floor(Math.log10(size));
      return `${(value / 10 ** power).toPrecision(2)} × 10${superscript(power)}`;
    }
    if (size >= 1000) return Number(value.toPrecision(3)).toLocaleString("en");
    return size >= 100 ? value.toFixed(0) : value.toPrecision(3).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
  }
  const superscript = (n) => String(n).replace(/[-\d]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));

  const ticks = {
    linear([low, high]) {
      const raw = (high - low) / 4, power = 10 ** Math.floor(Math.log10(raw));
      const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
      const first = Math.ceil(low / step - 1e-9);
      return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => [(first + i) * step, String(Number(((first + i) * step).toPrecision(6)))]);
    },
    log([low, high]) {
      const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
      const step = Math.ceil((last - first + 1) / 7);
      return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, i) => {
        const power = first + i * step;
        return [10 ** power, power === 0 ? "1" : power === 1 ? "10" : `10${superscript(power)}`];
      });
    },
  };

  // A panel with axes. x and y: {range, label, log}. X and Y map values to the picture, x and y back.
  function panel({ width = 440, height = 340, x, y, label, equal = false }) {
    const box = { left: 66, right: width - 12, top: 12, bottom: height - 46 };
    if (equal) { // as many units a pixel upwards as sideways
      const unit = (x.range[1] - x.range[0]) / (box.right - box.left);
      y = { ...y, range: [y.range[0], y.range[0] + unit * (box.bottom - box.top)] };
    }
    const picture = element("svg:svg", { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": label });
    const axes = element("svg:g", { class: "axes", "aria-hidden": "true" });
    const id = `clip-${(panel.count = (panel.count || 0) + 1)}`;
    const clip = element("svg:clipPath", { id }, element("svg:rect", { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top }));
    const drawing = element("svg:g", { "clip-path": `url(#${id})` }), handles = element("svg:g");
    const place = (axis, from, to) => {
      const f = axis.log ? Math.log10 : (v) => v, [low, high] = axis.range.map(f);
      const forward = (v) => from + ((f(axis.log ? Math.max(v, 1e-300) : v) - low) / (high - low)) * (to - from);
      const back = (p) => { const v = low + ((p - from) / (to - from)) * (high - low); return axis.log ? 10 ** v : v; };
      return [forward, back];
    };
    const [X, backX] = place(x, box.left, box.right), [Y, backY] = place(y, box.bottom, box.top);
    for (const [value, text] of ticks[x.log ? "log" : "linear"](x.range)) {
      axes.append(element("svg:line", { class: "grid", x1: X(value), x2: X(value), y1: box.top, y2: box.bottom }),
        element("svg:text", { x: X(value), y: box.bottom + 17, "text-anchor": "middle" }, text));
    }
    for (const [value, text] of ticks[y.log ? "log" : "linear"](y.range)) {
      axes.append(element("svg:line", { class: "grid", x1: box.left, x2: box.right, y1: Y(value), y2: Y(value) }),
        element("svg:text", { x: box.left - 7, y: Y(value) + 4.5, "text-anchor": "end" }, text));
    }
    axes.append(element("svg:path", { class: "spine", d: `M${box.left},${box.top}V${box.bottom}H${box.right}` }),
      element("svg:text", { x: (box.left + box.right) / 2, y: height - 8, "text-anchor": "middle" }, x.label),
      element("svg:text", { transform: `translate(13 ${(box.top + box.bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, y.label));
    picture.append(element("svg:defs", {}, clip), axes, drawing, handles);
    const at = (event) => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(picture.getScreenCTM().inverse());
      return [backX(point.x), backY(point.y)];
    };
    return { picture, drawing, handles, X, Y, at, box, x, y };
  }

  const number = (v) => (Math.abs(v) < 1e6 ? v.toFixed(2) : v > 0 ? "1e6" : "-1e6");
  const path = (points) => points.length ? "M" + points.map(([a, b]) => `${number(a)},${number(b)}`).join("L") : "";
  function curve({ drawing, X, Y }, points, attributes) {
    const finite = points.filter(([a, b]) => Number.isFinite(a) && Number.isFinite(b));
    drawing.append(element("svg:path", { fill: "none", d: path(finite.map(([a, b]) => [X(a), Y(b)])), ...attributes }));
  }
  // The ellipse of so many deviations.
  function ellipse(axes, { mean, cov }, deviations, attributes) {
    const { values, angle } = root.kernel.eigen(cov);
    if (!(values[0] > 0 && values[1] > 0)) return;
    const [a, b] = values.map((v) => deviations * Math.sqrt(v)), c = Math.cos(angle), s = Math.sin(angle);
    const points = Array.from({ length: 73 }, (_, i) => {
      const t = (i * Math.PI) / 36, u = a * Math.cos(t), v = b * Math.sin(t);
      return [mean[0] + c * u - s * v, mean[1] + s * u + c * v];
    });
    curve(axes, points, attributes);
  }
  function dot({ drawing, X, Y }, [a, b], attributes) {
    if (Number.isFinite(a) && Number.isFinite(b)) drawing.append(element("svg:circle", { cx: number(X(a)), cy: number(Y(b)), r: 5, ...attributes }));
  }
  function star({ drawing, X, Y }, [a, b]) {
    const points = Array.from({ length: 10 }, (_, i) => {
      const r = i % 2 ? 3.4 : 8.5, t = (i * Math.PI) / 5 - Math.PI / 2;
      return [X(a) + r * Math.cos(t), Y(b) + r * Math.sin(t)];
    });
    drawing.append(element("svg:path", { class: "truth", d: path(points) + "Z" }));
  }
  function write({ drawing, X, Y }, text, [a, b], attributes = {}) {
    drawing.append(element("svg:text", { x: X(a), y: Y(b), ...attributes }, text));
  }

  // A point that can be dragged, or moved with the arrow keys (with Shift in small steps). On an axis of
  // powers of ten a step is one of decades.
  function handle(axes, { name, get, set, step }) {
    const knob = element("svg:circle", { class: "handle", r: 9, tabindex: 0, role: "button" });
    const inside = (value, [low, high]) => Math.min(high, Math.max(low, value));
    const move = ([a, b]) => set([inside(a, axes.x.range), inside(b, axes.y.range)]);
    const moved = (axis, value, size) => (axis.log ? value * 10 ** size : value + size);
    const rounded = (axis, value) => (axis.log ? Number(value.toPrecision(3)) : Math.round(value * 10) / 10);
    knob.addEventListener("pointerdown", (event) => { knob.setPointerCapture(event.pointerId); event.preventDefault(); knob.focus(); });
    knob.addEventListener("pointermove", (event) => { if (knob.hasPointerCapture(event.pointerId)) { const [a, b] = axes.at(event); move([rounded(axes.x, a), rounded(axes.y, b)]); } });
    knob.addEventListener("keydown", (event) => {
      const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!ways) return;
      event.preventDefault();
      const size = event.shiftKey ? step / 10 : step, [a, b] = get();
      move([moved(axes.x, a, size * ways[0]), moved(axes.y, b, size * ways[1])]);
    });
    axes.handles.append(knob);
    return () => {
      const [a, b] = get();
      knob.setAttribute("cx", axes.X(a));
      knob.setAttribute("cy", axes.Y(b));
      knob.setAttribute("aria-label", `${name} at ${digits(a)}, ${digits(b)}: drag it, or use the arrow keys`);
    };
  }

  const labelled = (text, control) => element("label", {}, element("span", {}, text), control);
  function choice(text, options, get, set) {
    const control = element("select", { onchange: () => set(control.value) }, ...options.map((o) => element("option", { value: o }, o)));
    return { node: labelled(text, control), show: () => { control.value = get(); } };
  }
  function slider(text, { min, max, step, shown = digits }, get, set) {
    const control = element("input", { type: "range", min, max, step, oninput: () => set(Number(control.value)) });
    const value = element("span");
    return { node: element("label", {}, element("span", {}, text, " ", value), control), show: () => { control.value = get(); value.textContent = shown(get()); control.setAttribute("aria-valuetext", value.textContent); } };
  }
  function toggle(text, get, set) {
    const control = element("input", { type: "checkbox", onchange: () => set(control.checked) });
    return { node: element("label", { class: "toggle" }, control, element("span", {}, text)), show: () => { control.checked = get(); } };
  }
  const button = (text, press) => ({ node: element("button", { type: "button", onclick: press }, text), show() {} });

  // ---- the state of a figure, in the address behind #
  function fromAddress(name, state) {
    const given = new URLSearchParams(location.hash.slice(1));
    if (given.get("figure") !== name) return { ...state };
    const read = (key, like) => {
      const text = given.get(key);
      if (text === null) return like;
      if (Array.isArray(like)) { const values = text.split(",").map(Number); return values.length === like.length && values.every(Number.isFinite) ? values : like; }
      if (typeof like === "boolean") return text === "true";
      if (typeof like === "number") return Number.isFinite(Number(text)) ? Number(text) : like;
      return text;
    };
    return Object.fromEntries(Object.entries(state).map(([key, like]) => [key, read(key, like)]));
  }
  function toAddress(name, state, first) {
    const changed = Object.entries(state).filter(([key, value]) => String(value) !== String(first[key]));
    const query = new URLSearchParams([["figure", name], ...changed.map(([k, v]) => [k, String(v)])]);
    history.replaceState(null, "", changed.length ? `#${query}` : location.pathname + location.search);
  }

  // A figure: state, controls and one drawing, at most once a frame.
  function figure(host, name, first, build) {
    const state = fromAddress(name, first);
    let waiting = false, timer = 0;
    const paint = () => { waiting = false; draw(); };
    const self = {
      state, host, name,
      set(changes) {
        Object.assign(state, changes);
        if (!waiting) { waiting = true; requestAnimationFrame(paint); }
        clearTimeout(timer);
        timer = setTimeout(() => { try { toAddress(name, state, first); } catch { /* some browsers refuse it in a page that is a file */ } }, 300);
      },
    };
    const { nodes, controls, draw: inner } = build(self);
    function draw() {
      controls.forEach((control) => control.show());
      inner();
    }
    clear(host);
    host.append(element("div", { class: "controls" }, ...controls.map((control) => control.node)), ...nodes);
    host.figure = self;
    self.draw = draw;
    draw();
    host.dataset.ready = "true";
    return self;
  }
  const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

  root.figures ??= {};
  root.stage = { button, choice, clear, curve, digits, dot, element, ellipse, figure, handle, panel, slider, star, still, toggle, write };
})((globalThis.navfilters ??= {}));
