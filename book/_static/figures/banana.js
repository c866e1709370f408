// A sphere of equal range, taken for its tangent plane: where the errors lie, what the filter reports,
// and what its NEES must become.
(function (root) {
  "use strict";
  const { kernel, stage } = root;
  const { curve, digits, element, panel } = stage;
  const RUNS = 600, DOF = 9;

  root.figures.banana = (host, settings) => {
    const { weak, distance, tight, misalignment, styles } = settings, color = styles.EKF.color;
    const first = { misalignment, noise: 1, seed: 1 };
    const kappaOf = (angle, noise) => ((weak * angle) / misalignment) ** 2 / (2 * distance) / (tight * noise);
    const expected = (kappa) => DOF + 3 * kappa ** 2;
    return stage.figure(host, "banana", first, (self) => {
      const { state } = self;
      const cloud = panel({ x: { range: [-4, 4], label: "weak direction (its deviations)" }, y: { range: [-4, 16], label: "along the bend (its deviations)" }, label: "Errors of many runs with the filter's ellipses" });
      const test = panel({ x: { range: [0, 2 * misalignment], label: "misalignment (deg)" }, y: { range: [5, 100], label: "mean NEES", log: true }, label: "NEES against the misalignment" });
      const says = element("p", { class: "says", "aria-live": "polite" });
      const controls = [
        stage.slider("Misalignment left", { min: 0, max: 2 * misalignment, step: misalignment / 50, shown: (v) => `${digits(v)}°` }, () => state.misalignment, (v) => self.set({ misalignment: v })),
        stage.slider("Range noise", { min: 0.25, max: 4, step: 0.05, shown: (v) => `× ${digits(v)}` }, () => state.noise, (noise) => self.set({ noise })),
        stage.button("Other runs", () => self.set({ seed: state.seed + 1 })),
        stage.button("Start again", () => self.set({ ...first })),
      ];
      function draw() {
        const kappa = kappaOf(state.misalignment, state.noise), normal = kernel.normals(state.seed);
        stage.clear(cloud.drawing); stage.clear(test.drawing);
        let sum = 0;
        for (let i = 0; i < RUNS; i++) {
          const z = normal(), t = kappa * z * z + normal();
          let others = 0;
          for (let j = 0; j < DOF - 2; j++) others += normal() ** 2;
          sum += z * z + t * t + others;
          stage.dot(cloud, [z, t], { r: 1.8, fill: color, "fill-opacity": 0.55 });
        }
        const mean = sum / RUNS;
        for (const size of [1, 2, 3]) stage.ellipse(cloud, { mean: [0, 0], cov: [1, 0, 0, 1] }, size, { class: "bound", "stroke-width": 1.6 });
        const grid = Array.from({ length: 81 }, (_, i) => -4 + i / 10);
        curve(cloud, grid.map((z) => [z, kappa * z * z]), { class: "way", "stroke-width": 2 });
        const angles = Array.from({ length: 61 }, (_, i) => (i * 2 * misalignment) / 60);
        curve(test, angles.map((a) => [a, expected(kappaOf(a, state.noise))]), { class: "way", "stroke-width": 2 });
        curve(test, [[0, DOF], [2 * misalignment, DOF]], { class: "bound", "stroke-dasharray": "2 4" });
        stage.dot(test, [state.misalignment, mean], { fill: color, class: "estimate" });
        const gap = ((weak * state.misalignment) / misalignment) ** 2 / (2 * distance);
        says.replaceChildren("Sphere and plane are ", element("b", {}, `${digits(gap)} m`), ` apart one deviation out; the range is known to ${digits(tight * state.noise)} m if all else is given. NEES: `, element("b", {}, mean.toFixed(1)), ` over ${RUNS} runs, ${digits(expected(kappa))} expected, 9 for an honest filter.`);
        Object.assign(host.dataset, { mean, expected: expected(kappa) });
      }
      return { controls, draw, nodes: [element("div", { class: "panels" }, cloud.picture, test.picture), says] };
    });
  };
})((globalThis.navfilters ??= {}));
