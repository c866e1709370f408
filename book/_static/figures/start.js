// A filter of a fixed point, from a start that can be dragged: where it ends, and what it claims.
(function (root) {
  "use strict";
  const { kernel, stage } = root;
  const { curve, digits, element, panel } = stage;

  root.figures.start = (host, settings) => {
    const { x_true: truth, sigma, styles, steps } = settings;
    const first = { x0: settings.x0, filter: "EKF", noise: Math.log10(settings.range_variance), noisy: false, seed: 1, k: steps };
    return stage.figure(host, "start", first, (self) => {
      const { state } = self;
      if (!(state.filter in kernel.FILTERS)) state.filter = "EKF";
      const plane = panel({ x: { range: [-20, 180], label: "x₁ (units)" }, y: { range: [-5, 150], label: "x₂ (units)" }, equal: true, label: "The plane with truth, path and ellipse" });
      const error = panel({ x: { range: [1, steps], label: "update", log: true }, y: { range: [1e-3, 300], label: "distance (units)", log: true }, label: "Error and claim against updates" });
      const says = element("p", { class: "says", "aria-live": "polite" });
      const key = () => [state.x0, state.filter, state.noise, state.noisy, state.seed].join(" ");
      let known = "", run = [];
      function upTo(count) {
        if (known !== key()) { known = key(); run = []; }
        const model = { R: [10 ** state.noise, 0, 0, settings.bearing_variance], wrap: false };
        if (!run.length) { run.push({ mean: state.x0, cov: [sigma ** 2, 0, 0, sigma ** 2] }); run.next = kernel.measurements(truth, model, state.noisy, state.seed); }
        while (run.length <= count) run.push(kernel.update(state.filter, run[run.length - 1], run.next(), model));
        return run;
      }
      let playing = false;
      function play() {
        if (playing) { playing = false; return; }
        if (stage.still()) { self.set({ k: steps }); return; }
        playing = true;
        self.set({ k: state.k >= steps ? 0 : state.k });
        const tick = () => {
          if (!playing) return;
          self.set({ k: Math.min(steps, state.k + Math.max(1, Math.round(state.k * 0.04))) });
          if (state.k >= steps) { playing = false; self.set({}); } else setTimeout(() => requestAnimationFrame(tick), state.k < 8 ? 250 : 0);
        };
        requestAnimationFrame(tick);
      }
      const stop = (changes) => { playing = false; self.set(changes); };
      const begin = stage.button("Play", play);
      begin.show = () => { begin.node.textContent = playing ? "Pause" : "Play"; };
      const controls = [
        stage.choice("Filter", Object.keys(kernel.FILTERS), () => state.filter, (filter) => self.set({ filter })),
        stage.slider("Noise of the range", { min: -5, max: 3, step: 0.1, shown: (v) => `${digits(10 ** (v / 2))} units` }, () => state.noise, (noise) => self.set({ noise })),
        stage.toggle("measurements with that noise", () => state.noisy, (noisy) => self.set({ noisy })),
        stage.button("One update", () => stop({ k: Math.min(steps, state.k >= steps ? 1 : state.k + 1) })), begin,
        stage.button("Start again", () => stop({ ...first, k: steps })),
      ];
      const place = stage.handle(plane, { name: "First estimate", get: () => state.x0, set: (x0) => stop({ x0 }), step: 2 });
      function draw() {
        const states = upTo(state.k).slice(0, state.k + 1), last = states[states.length - 1];
        const style = styles[state.filter], line = { stroke: style.color, "stroke-dasharray": style.dash };
        stage.clear(plane.drawing); stage.clear(error.drawing);
        stage.ellipse(plane, states[0], 1, { class: "prior" });
        curve(plane, states.map((s) => s.mean), { class: "way" });
        for (const s of states.slice(1, 4)) stage.dot(plane, s.mean, { r: 3.5, fill: style.color });
        stage.ellipse(plane, last, 1, { stroke: style.color, "stroke-width": 2 });
        stage.dot(plane, last.mean, { fill: style.color, class: "estimate" });
        stage.star(plane, truth);
        place();
        const off = states.map((s) => kernel.distance(s.mean, truth)), claims = states.map(kernel.claimed);
        curve(error, claims.map((v, i) => [i, v]).slice(1), { class: "bound", "stroke-width": 2 });
        curve(error, off.map((v, i) => [i, v]).slice(1), { ...line, "stroke-width": 2.2 });
        if (state.k > 0) {
          const write = (v, text, above) => stage.write(error, text, [1.25, Math.min(Math.max(v, 2e-3), 200)], { dy: above ? -7 : 16 });
          write(off[1], "error", off[1] >= claims[1]);
          write(claims[1], "claimed", off[1] < claims[1]);
        }
        const e = off[state.k], c = claims[state.k];
        says.replaceChildren(...(state.k
          ? ["After ", element("b", {}, String(state.k)), state.k === 1 ? " update the filter says that it is within " : " updates the filter says that it is within ", element("b", {}, digits(c)), ". It is ", element("b", {}, digits(e)), " away: ", element("b", {}, `${digits(kernel.deviations(last, truth))}`), " of its own deviations."]
          : [`Before the first update it knows the point to ${digits(c)} in each direction, and is ${digits(e)} away.`]));
        Object.assign(host.dataset, { error: e, claimed: c, k: state.k });
      }
      return { controls, draw, nodes: [element("div", { class: "panels" }, plane.picture, error.picture), says] };
    });
  };
})((globalThis.navfilters ??= {}));
