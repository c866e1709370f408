// The two updates that decide: scrub through their steps, and take tilt, flatness or correlation away.
(function (root) {
  "use strict";
  const { kernel, stage } = root;
  const { digits, element, panel } = stage;

  // The update's two parts, along the line of sight and along the tangent.
  function parts(prior, z, model, moments) {
    const K = kernel.mul(moments.P_xz, kernel.inverse(moments.P_zz)), y = kernel.residual(z, moments.z, model.wrap);
    return [[K[0] * y[0], K[2] * y[0]], [K[1] * y[1], K[3] * y[1]]];
  }
  // The state after update 1 with its ellipse turned, rounded, or without what correlates range and bearing.
  const REPAIRS = {
    "as it is": (state) => state,
    "turned to the new tangent": ({ mean, cov }) => {
      const r = Math.hypot(...mean), c = mean[0] / r, s = mean[1] / r, V = [c, -s, s, c];
      const [long, short] = kernel.eigen(cov).values;
      return { mean, cov: kernel.mul(kernel.mul(V, [short, 0, 0, long]), kernel.transpose(V)) };
    },
    "rounded": ({ mean, cov }) => { const [long] = kernel.eigen(cov).values; return { mean, cov: [long, 0, 0, long] }; },
    "decorrelated": ({ mean, cov }) => {
      const H = kernel.jacobian(mean), J = kernel.inverse(H), D = kernel.mul(kernel.mul(H, cov), kernel.transpose(H));
      return { mean, cov: kernel.symmetric(kernel.mul(kernel.mul(J, [D[0], 0, 0, D[3]]), kernel.transpose(J))) };
    },
  };

  root.figures["two-updates"] = (host, settings) => {
    const { x_true: truth, x0, sigma, styles } = settings;
    const model = { R: [settings.range_variance, 0, 0, settings.bearing_variance], wrap: false }, z = kernel.h(truth);
    const color = styles.EKF.color;
    return stage.figure(host, "two-updates", { at: 2, repair: "as it is" }, (self) => {
      const { state } = self;
      if (!(state.repair in REPAIRS)) state.repair = "as it is";
      const plane = panel({ x: { range: [0, 165], label: "x₁ (units)" }, y: { range: [50, 150], label: "x₂ (units)" }, equal: true, label: "Estimates, ellipses and steps of two updates" });
      const says = element("p", { class: "says", "aria-live": "polite" });
      const controls = [
        stage.slider("Updates", { min: 0, max: 2, step: 0.01, shown: (v) => v.toFixed(2) }, () => state.at, (at) => self.set({ at })),
        stage.choice("The ellipse after update 1", Object.keys(REPAIRS), () => state.repair, (repair) => self.set({ repair })),
      ];
      function draw() {
        const prior = { mean: x0, cov: [sigma ** 2, 0, 0, sigma ** 2] };
        const one = kernel.update("EKF", prior, z, model), repaired = REPAIRS[state.repair](one);
        const two = kernel.update("EKF", repaired, z, model);
        const from = [prior, repaired, two][Math.floor(state.at)], number = Math.floor(state.at), t = state.at - number;
        stage.clear(plane.drawing);
        const circle = Array.from({ length: 90 }, (_, i) => [z[0] * Math.cos(i / 57), z[0] * Math.sin(i / 57)]);
        stage.curve(plane, circle, { class: "bound", "stroke-dasharray": "2 4", "stroke-width": 1.6 });
        stage.write(plane, "measured range", [118, 78]);
        let mean = from.mean;
        if (number < 2) { // first along the line of sight, then along what the filter takes for the circle
          const [range, bearing] = parts(from, z, model, kernel.linearized(from, model));
          const a = Math.min(1, 2 * t), b = Math.max(0, 2 * t - 1);
          const corner = from.mean.map((v, i) => v + a * range[i]);
          mean = corner.map((v, i) => v + b * bearing[i]);
          stage.curve(plane, [from.mean, corner, mean], { class: "step" });
        }
        [prior, one, two].forEach((s, i) => { if (i < state.at) stage.dot(plane, s.mean, { r: 4, stroke: color, class: "was" }); });
        const size = number === 0 ? 1 : number === 1 ? 1 : 100;
        stage.ellipse(plane, from, size, { stroke: color, "stroke-width": 2 });
        stage.dot(plane, mean, { fill: color, class: "estimate" });
        stage.star(plane, truth);
        stage.write(plane, "truth", truth, { dx: 10, dy: 5 });
        const error = kernel.distance(mean, truth);
        const text = [
          `Update 1, ${t < 0.5 ? "the range's part: along the line of sight" : "the bearing's part: along the tangent, which leaves the circle"}.`,
          `Update 2, ${t < 0.5 ? "the range's part: along the ellipse" : "the bearing's part: next to nothing"}.`,
          "After update 2, with the ellipse of 100 deviations.",
        ][number];
        says.replaceChildren(element("b", {}, text), ` Distance from the truth: ${digits(error)} units. `,
          `Errors after updates 0, 1, 2: ${[prior, one, two].map((s) => digits(kernel.distance(s.mean, truth))).join(", ")}.`);
        Object.assign(host.dataset, { error, one: kernel.distance(one.mean, truth), two: kernel.distance(two.mean, truth) });
      }
      return { controls, draw, nodes: [element("div", { class: "panels" }, plane.picture), says] };
    });
  };
})((globalThis.navfilters ??= {}));
