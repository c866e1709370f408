// How well anyone could know the position, from the matrices of a flight: the bound of Cramer and Rao
// under other noises of the two sensors, for three kinds of knowledge of the thrust.
(function (root) {
  "use strict";
  const { stage } = root;
  const { curve, digits, element, panel } = stage;
  const MODELS = {
    known: { words: "thrust known", dash: "" },
    strength: { words: "its strength unknown", dash: "9 3 2 3" },
    vectors: { words: "unknown vectors", dash: "6 4" },
  };
  const LOW = 1e-4, HIGH = 0.08, GRID = Array.from({ length: 13 }, (_, i) => LOW * (HIGH / LOW) ** (i / 12));

  // A B', of square matrices of n rows, flat.
  function times(A, B, n, made) {
    for (let i = 0; i < n; i++) for (let j = 0; j < n; j++) {
      let sum = 0;
      for (let l = 0; l < n; l++) sum += A[i * n + l] * B[j * n + l];
      made[i * n + j] = sum;
    }
    return made;
  }
  // [F g; 0 1]: a state with the strength as its seventh component.
  function widened(F, push) {
    const made = new Float64Array(49);
    for (let i = 0; i < 6; i++) { for (let j = 0; j < 6; j++) made[i * 7 + j] = F[i * 6 + j]; made[i * 7 + 6] = push ? push[i] : 0; }
    made[48] = 1;
    return made;
  }
  // One update by two angles that see the position alone. R: variance of each, and what they share.
  function measured(P, H, [variance, shared], n) {
    const [a, b, c, d, e, f] = H, X = new Float64Array(n), Y = new Float64Array(n);
    for (let i = 0; i < n; i++) {
      const p = P[i * n], q = P[i * n + 1], r = P[i * n + 2];
      X[i] = a * p + b * q + c * r;
      Y[i] = d * p + e * q + f * r;
    }
    const s = a * X[0] + b * X[1] + c * X[2] + variance, t = d * Y[0] + e * Y[1] + f * Y[2] + variance;
    const u = a * Y[0] + b * Y[1] + c * Y[2] + shared, size = s * t - u * u;
    for (let i = 0; i < n; i++) {
      const k = (X[i] * t - Y[i] * u) / size, l = (Y[i] * s - X[i] * u) / size;
      for (let j = 0; j < n; j++) P[i * n + j] -= k * X[j] + l * Y[j];
    }
  }

  function prepared({ transitions, burns }) {
    const F = { known: transitions.map((f) => Float64Array.from(f)), vectors: transitions.map((f) => Float64Array.from(f)), strength: transitions.map((f) => widened(f, null)) };
    for (const { k, coasting, push } of burns) { F.vectors[k] = Float64Array.from(coasting); F.strength[k] = widened(transitions[k], push); }
    return F;
  }
  // Deviations of the position after each measurement, and sigma_p over the last 2000 s, in metres.
  function bound(settings, F, model, R) {
    const n = model === "strength" ? 7 : 6, noise = Object.fromEntries(settings.burns.map(({ k, noise }) => [k, noise]));
    const P = new Float64Array(n * n), half = new Float64Array(n * n);
    let total = 0;
    const path = [];
    for (let i = 0; i < n; i++) P[i * n + i] = 1;
    const first = F[model].length - settings.weights.length + 1;
    for (let k = 0; k < F[model].length; k++) {
      times(F[model][k], times(F[model][k], P, n, half), n, P); // F P F', P being symmetric
      if (model === "vectors" && noise[k]) noise[k].forEach((v, i) => { P[i] += v; });
      measured(P, settings.seen[k], R, n);
      path.push(settings.scale * Math.sqrt(P[0] + P[n + 1] + P[2 * n + 2]));
      if (k + 1 >= first) {
        const M = settings.weights[k + 1 - first];
        for (let i = 0; i < 6; i++) for (let j = 0; j < 6; j++) total += M[i * 6 + j] * P[i * n + j];
      }
    }
    return { path, last: Math.sqrt(total) };
  }
  const covariance = (earth, star, shared) => [earth ** 2 + (star / 3600) ** 2, shared * earth ** 2];

  // The noise of the Earth sensor at which a falling curve of the bound reaches a value; NaN where none does.
  function reached(at, curve, value) {
    const i = curve.findIndex((v) => v >= value);
    if (i < 1) return NaN;
    let [low, high] = [GRID[i - 1], GRID[i]];
    for (let j = 0; j < 12; j++) { const middle = Math.sqrt(low * high); if (at(middle) >= value) high = middle; else low = middle; }
    return Math.sqrt(low * high);
  }

  root.figures.bound = (host, settings) => {
    const first = { earth: settings.earth, star: settings.star, shared: 0 }, F = prepared(settings), names = Object.keys(MODELS);
    return stage.figure(host, "bound", first, (self) => {
      const { state } = self;
      const clamp = (v, low, high) => Math.min(high, Math.max(low, v));
      const time = panel({ x: { range: [0, 20], label: "time (1000 s)" }, y: { range: [10, 1e5], label: "bound on the position error (m)", log: true }, label: "The bound against time" });
      const noise = panel({ x: { range: [LOW, HIGH], label: "noise of the Earth sensor (deg)", log: true }, y: { range: [10, 1e5], label: "bound in the last 2000 s (m)", log: true }, label: "The bound against the noise of the Earth sensor" });
      const says = element("p", { class: "says", "aria-live": "polite" });
      const controls = [
        stage.slider("Earth sensor", { min: Math.log10(LOW), max: Math.log10(HIGH), step: 0.01, shown: () => `${digits(state.earth)}°` }, () => Math.log10(state.earth), (v) => self.set({ earth: Number((10 ** v).toPrecision(3)) })),
        stage.slider("of its variance common to both angles", { min: 0, max: 0.99, step: 0.01, shown: (v) => `${Math.round(100 * v)} %` }, () => state.shared, (shared) => self.set({ shared })),
        stage.slider("Star sensor", { min: 0, max: 20, step: 0.1, shown: (v) => `${digits(v)}″` }, () => state.star, (star) => self.set({ star })),
        stage.button("As stated (A)", () => self.set({ ...first })),
        stage.button("For three deviations (D)", () => self.set({ earth: Number((first.earth / 3).toPrecision(4)), star: Number((first.star / 3).toPrecision(4)), shared: 0 })),
      ];
      const at = (model, earth) => bound(settings, F, model, covariance(earth, state.star, state.shared));
      let now = {}, known = "", curves = {}, needed = {};
      const place = stage.handle(noise, { name: "Noise and bound", get: () => [state.earth, now.known.last], set: ([earth]) => self.set({ earth: Number(earth.toPrecision(3)) }), step: 0.1 });
      function draw() {
        state.earth = clamp(state.earth, LOW, HIGH); state.star = clamp(state.star, 0, 20); state.shared = clamp(state.shared, 0, 0.99);
        now = Object.fromEntries(names.map((model) => [model, at(model, state.earth)]));
        if (known !== `${state.star} ${state.shared}`) {
          known = `${state.star} ${state.shared}`;
          for (const model of names) {
            curves[model] = GRID.map((earth) => at(model, earth).last);
            needed[model] = reached((earth) => at(model, earth).last, curves[model], settings.printed);
          }
        }
        stage.clear(time.drawing); stage.clear(noise.drawing);
        for (const [start, end] of settings.fire) time.drawing.append(element("svg:rect", { class: "band", x: time.X(start / 1000), width: time.X(end / 1000) - time.X(start / 1000), y: time.box.top, height: time.box.bottom - time.box.top }));
        for (const [axes, [low, high]] of [[time, [0, 20]], [noise, [LOW, HIGH]]]) {
          curve(axes, [[low, settings.printed], [high, settings.printed]], { class: "paper" });
          stage.write(axes, `paper, ${Math.round(settings.printed)} m`, [low, settings.printed], { dx: 6, dy: -6 });
        }
        names.forEach((model, i) => {
          const style = { class: "bound", "stroke-width": 2.2, "stroke-dasharray": MODELS[model].dash };
          curve(time, now[model].path.map((v, k) => [(k + 1) / 10, v]), style);
          curve(noise, GRID.map((earth, k) => [earth, curves[model][k]]), style);
          const y = noise.box.top + 16 + 17 * i;
          noise.drawing.append(element("svg:path", { ...style, fill: "none", d: `M${noise.box.left + 8},${y - 4}h34` }), element("svg:text", { x: noise.box.left + 50, y }, MODELS[model].words));
          stage.dot(noise, [needed[model], settings.printed], { r: 4, class: "was", stroke: "currentColor" });
        });
        place();
        const bounds = names.map((model) => `${digits(Number(now[model].last.toPrecision(3)))} m`), enough = names.map((model) => (needed[model] ? `${digits(Number(needed[model].toPrecision(2)))}°` : "no Earth sensor"));
        const bold = (texts) => texts.flatMap((text, i) => [i ? (i === 2 ? " or " : ", ") : "", element("b", {}, text)]);
        says.replaceChildren("Nobody without bias has less than ", ...bold(bounds), ` over the last 2000 s: with the thrust known, its strength unknown, a vector unknown in each interval. The ${Math.round(settings.printed)} m would take `, ...bold(enough), ".");
        Object.assign(host.dataset, Object.fromEntries(names.flatMap((model) => [[model, now[model].last], [`${model}Needs`, needed[model]]])));
      }
      return { controls, draw, nodes: [element("div", { class: "panels" }, time.picture, noise.picture), says] };
    });
  };
})((globalThis.navfilters ??= {}));
