// Where an unscented filter samples, what the samples become in range and bearing, and what comes of it.
(function (root) {
  "use strict";
  const { kernel, stage } = root;
  const { curve, digits, panel, element } = stage;
  const NAMES = { "Cholesky factor": "cholesky", "Cholesky factor, coordinates swapped": "upper", "symmetric root": "symmetric" };
  const LAST = 200;

  root.figures["sigma-points"] = (host, settings) => {
    const { x_true: truth, x0, sigma, styles, landmarks } = settings;
    const z = kernel.h(truth), color = styles.UKF.color;
    const first = { alpha: 1, beta: 2, kappa: 1, root: "Cholesky factor", wrap: false, k: 1 };
    return stage.figure(host, "sigma-points", first, (self) => {
      const { state } = self;
      if (!(state.root in NAMES)) state.root = first.root;
      const plane = panel({ x: { range: [-220, 260], label: "x₁ (units)" }, y: { range: [-120, 260], label: "x₂ (units)" }, equal: true, label: "Sigma points in the plane" });
      const polar = panel({ x: { range: [-3.3, 3.3], label: "bearing (rad)" }, y: { range: [0, 330], label: "range (units)" }, label: "Sigma points in range and bearing" });
      const error = panel({ x: { range: [1, LAST], label: "update" }, y: { range: [1e-3, 300], label: "error (units)", log: true }, label: "Error against updates" });
      const says = element("p", { class: "says", "aria-live": "polite" });
      const number = (name, min, max, step) => stage.slider(name, { min, max, step, shown: (v) => String(v) }, () => state[name], (v) => self.set({ [name]: v }));
      const controls = [
        number("alpha", 0.1, 2, 0.01), number("beta", 0, 5, 0.1), number("kappa", -1.5, 10, 0.1),
        stage.choice("Root of P", Object.keys(NAMES), () => state.root, (v) => self.set({ root: v })),
        stage.toggle("angles wrapped", () => state.wrap, (wrap) => self.set({ wrap })),
        stage.slider("Before update", { min: 1, max: LAST, step: 1, shown: (v) => String(v) }, () => state.k, (k) => self.set({ k })),
      ];
      function draw() {
        const points = { alpha: state.alpha, beta: state.beta, kappa: state.kappa, root: NAMES[state.root] };
        const model = { R: [settings.range_variance, 0, 0, settings.bearing_variance], wrap: state.wrap };
        const run = [{ mean: x0, cov: [sigma ** 2, 0, 0, sigma ** 2] }];
        for (let k = 1; k <= LAST; k++) run.push(kernel.update("UKF", run[k - 1], z, model, points));
        const prior = run[state.k - 1], X = kernel.sigmaPoints(prior, points), Z = X.map(kernel.h);
        const expected = kernel.unscented(prior, model, points);
        [plane, polar, error].forEach(({ drawing }) => stage.clear(drawing));
        stage.ellipse(plane, prior, 1, { stroke: color, "stroke-width": 2 });
        X.forEach((x, i) => stage.dot(plane, x, { fill: i ? color : "none", stroke: color, r: i ? 5 : 4 }));
        stage.star(plane, truth);
        const across = ([r, t]) => [t, r];
        const { P_zz: [a, b, , d] } = expected;
        stage.ellipse(polar, { mean: across(expected.z), cov: [d, b, b, a] }, 1, { class: "bound", "stroke-width": 2 });
        Z.forEach((v, i) => stage.dot(polar, across(v), { fill: i ? color : "none", stroke: color, r: i ? 5 : 4 }));
        stage.star(polar, across(z));
        const off = run.map((s) => kernel.distance(s.mean, truth));
        for (const mark of landmarks) {
          curve(error, [[mark, 1e-3], [mark, 300]], { class: "bound", "stroke-dasharray": "2 4" });
          stage.write(error, String(mark), [mark, 120], { dx: 4 });
        }
        curve(error, off.map((v, i) => [i, v]).slice(1), { stroke: color, "stroke-width": 2.2 });
        stage.dot(error, [state.k, off[state.k]], { fill: color, class: "estimate" });
        says.replaceChildren(`Update ${state.k} expects ${digits(expected.z[0])} units and ${digits(expected.z[1])} rad, and gets ${digits(z[0])} and ${digits(z[1])}. Error after it: `, element("b", {}, digits(off[state.k])), ` units; after ${LAST} updates: `, element("b", {}, digits(off[LAST])), ".");
        Object.assign(host.dataset, { error: off[state.k], last: off[LAST] });
      }
      return { controls, draw, nodes: [element("div", { class: "panels" }, plane.picture, polar.picture, error.picture), says] };
    });
  };
})((globalThis.navfilters ??= {}));
