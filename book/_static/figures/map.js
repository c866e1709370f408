// Where a filter fails: every point of the map is a first estimate, computed by a worker.
(function (root) {
  "use strict";
  const { kernel, stage } = root;
  const { digits, element, panel } = stage;
  const SIZE = 72, [LOW, HIGH] = [-200, 400];

  // Runs in the worker: rows of log10 of the last error over the first.
  function work() {
    onmessage = ({ data: { job, name, size, low, high, truth, sigma, R, noisy, steps } }) => {
      const { kernel } = globalThis.navfilters, model = { R, wrap: false }, cell = (high - low) / size;
      for (let i = 0; i < size; i++) {
        const row = new Float64Array(size);
        for (let j = 0; j < size; j++) {
          const x0 = [low + cell * (j + 0.5), low + cell * (i + 0.25)];
          let state = { mean: x0, cov: [sigma ** 2, 0, 0, sigma ** 2] };
          const next = kernel.measurements(truth, model, noisy, 1 + i * size + j);
          for (let k = 0; k < steps; k++) state = kernel.update(name, state, next(), model);
          row[j] = Math.log10(kernel.distance(state.mean, truth) / kernel.distance(x0, truth));
        }
        postMessage({ job, i, row });
      }
    };
  }

  root.figures.map = (host, settings) => {
    const { x_true: truth, x0, sigma, styles, steps } = settings;
    const first = { filter: "UKFz", sigma: Math.log10(sigma), noise: Math.log10(settings.range_variance), noisy: false, start: x0 };
    return stage.figure(host, "map", first, (self) => {
      const { state } = self;
      if (!(state.filter in kernel.FILTERS)) state.filter = first.filter;
      const plane = panel({ height: 420, x: { range: [LOW, HIGH], label: "first estimate x₁ (units)" }, y: { range: [LOW, HIGH], label: "first estimate x₂ (units)" }, label: "Map of first estimates" });
      const error = panel({ height: 420, x: { range: [1, steps], label: "update", log: true }, y: { range: [1e-3, 1e3], label: "distance (units)", log: true }, label: "The run that starts at the ring" });
      const canvas = element("canvas", { width: SIZE, height: SIZE });
      const image = element("svg:image", { x: plane.box.left, y: plane.box.top, width: plane.box.right - plane.box.left, height: plane.box.bottom - plane.box.top, preserveAspectRatio: "none", style: "image-rendering: pixelated" });
      plane.picture.insertBefore(image, plane.picture.querySelector(".axes"));
      const says = element("p", { class: "says", "aria-live": "polite" });
      const address = URL.createObjectURL(new Blob([kernel.source, `(${work})();`], { type: "text/javascript" }));
      const context = canvas.getContext("2d");
      let worker = null, asked = "", rows = 0, failing = 0;
      // The shades of the printed maps: light gains six digits, the darkest none; black is worse than the start, vermilion no number.
      const shades = [[253, 231, 37], [115, 208, 86], [31, 162, 135], [46, 111, 142], [70, 52, 128]];
      function shade(v) {
        if (Number.isNaN(v)) return [213, 94, 0];
        if (v > 0) return [0, 0, 0];
        const t = (4 * Math.max(0, v + 6)) / 6, at = Math.min(3, Math.floor(t));
        return shades[at].map((c, i) => c + (t - at) * (shades[at + 1][i] - c));
      }
      function received({ data: { i, row } }) {
        const pixels = context.createImageData(SIZE, 1);
        row.forEach((v, j) => {
          failing += !(v <= -1);
          pixels.data.set([...shade(v), 255], 4 * j);
        });
        context.putImageData(pixels, 0, SIZE - 1 - i);
        rows += 1;
        if (rows % 8 === 0 || rows === SIZE) { image.setAttribute("href", canvas.toDataURL()); report(); }
      }
      function ask() {
        const key = [state.filter, state.sigma, state.noise, state.noisy].join(" ");
        if (key === asked) return;
        asked = key;
        worker?.terminate();
        worker = new Worker(address);
        worker.onmessage = received;
        rows = failing = 0;
        worker.postMessage({ name: state.filter, size: SIZE, low: LOW, high: HIGH, truth, sigma: 10 ** state.sigma, R: [10 ** state.noise, 0, 0, settings.bearing_variance], noisy: state.noisy, steps });
      }
      let story = "";
      function report() {
        const share = rows === SIZE ? `On ${(100 * failing / SIZE ** 2).toFixed(0)} % of the starts (darkest, black and vermilion) ${steps} updates do not gain one decimal digit. ` : `Computing: ${Math.round(100 * rows / SIZE)} %. `;
        says.replaceChildren(share, story);
        Object.assign(host.dataset, { rows, failing: failing / SIZE ** 2 });
      }
      const controls = [
        stage.choice("Filter", Object.keys(kernel.FILTERS), () => state.filter, (filter) => self.set({ filter })),
        stage.slider("Deviation of the start", { min: 0, max: 4, step: 0.1, shown: (v) => `${digits(10 ** v)} units` }, () => state.sigma, (v) => self.set({ sigma: v })),
        stage.slider("Noise of the range", { min: -5, max: 3, step: 0.1, shown: (v) => `${digits(10 ** (v / 2))} units` }, () => state.noise, (noise) => self.set({ noise })),
        stage.toggle("measurements with that noise", () => state.noisy, (noisy) => self.set({ noisy })),
      ];
      const place = stage.handle(plane, { name: "The run's first estimate", get: () => state.start, set: (start) => self.set({ start }), step: 10 });
      plane.picture.addEventListener("click", (event) => { const [a, b] = plane.at(event); if (a > LOW && a < HIGH && b > LOW && b < HIGH) self.set({ start: [Math.round(a), Math.round(b)] }); });
      function draw() {
        ask();
        stage.clear(plane.drawing); stage.clear(error.drawing);
        stage.star(plane, truth);
        place();
        const model = { R: [10 ** state.noise, 0, 0, settings.bearing_variance], wrap: false }, next = kernel.measurements(truth, model, state.noisy, 1);
        const run = [{ mean: state.start, cov: [10 ** (2 * state.sigma), 0, 0, 10 ** (2 * state.sigma)] }];
        for (let k = 0; k < steps; k++) run.push(kernel.update(state.filter, run[k], next(), model));
        const style = styles[state.filter], off = run.map((s) => kernel.distance(s.mean, truth));
        stage.curve(error, run.map((s, i) => [i, kernel.claimed(s)]).slice(1), { class: "bound", "stroke-width": 2 });
        stage.curve(error, off.map((v, i) => [i, v]).slice(1), { stroke: style.color, "stroke-dasharray": style.dash, "stroke-width": 2.2 });
        story = `From (${state.start.map(digits).join(", ")}) it ends ${digits(off[steps])} units away, and claims ${digits(kernel.claimed(run[steps]))}.`;
        host.dataset.error = off[steps];
        report();
      }
      return { controls, draw, nodes: [element("div", { class: "panels" }, plane.picture, error.picture), says] };
    });
  };
})((globalThis.navfilters ??= {}));
