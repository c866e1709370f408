// Range and bearing of a fixed point: the ten filters of the first paper, on 2 x 2 matrices in double
// precision, with the covariance's update as it is printed. A matrix is [a, b, c, d], row by row.
(function (root) {
  "use strict";
  function build(root) {
  const add = (A, B) => A.map((a, i) => a + B[i]);
  const scale = (A, s) => A.map((a) => a * s);
  const mul = ([a, b, c, d], [e, f, g, h]) => [a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h];
  const transpose = ([a, b, c, d]) => [a, c, b, d];
  const apply = ([a, b, c, d], [x, y]) => [a * x + b * y, c * x + d * y];
  const outer = ([a, b], [c, d]) => [a * c, a * d, b * c, b * d];
  const determinant = ([a, b, c, d]) => a * d - b * c;
  const inverse = (A) => {
    const [a, b, c, d] = A;
    return scale([d, -b, -c, a], 1 / determinant(A));
  };
  const symmetric = ([a, b, c, d]) => [a, (b + c) / 2, (b + c) / 2, d];

  // Eigenvalues, the larger first, and the angle of the first axis.
  function eigen([a, b, , d]) {
    const half = (a + d) / 2, away = Math.hypot((a - d) / 2, b);
    const large = half + away;
    return { values: [large, (a * d - b * b) / large], angle: Math.atan2(2 * b, a - d) / 2 };
  }
  const norm = (A) => Math.max(...eigen(A).values.map(Math.abs));

  function cholesky([a, b, , d]) {
    const l = Math.sqrt(a);
    return [l, 0, b / l, Math.sqrt(d - (b / l) * (b / l))];
  }
  function symmetricRoot(P) {
    const { values, angle } = eigen(P);
    const c = Math.cos(angle), s = Math.sin(angle), V = [c, -s, s, c];
    return mul(mul(V, [Math.sqrt(values[0]), 0, 0, Math.sqrt(values[1])]), transpose(V));
  }

  const h = ([x, y]) => [Math.hypot(x, y), Math.atan2(y, x)];
  function jacobian([x, y]) {
    const r = Math.hypot(x, y), c = x / r, s = y / r;
    return [c, s, -s / r, c / r];
  }
  // tr(h'' P) / 2 for range and bearing.
  function bias([x, y], [a, b, , d]) {
    const r = Math.hypot(x, y), c = x / r, s = y / r;
    return [(s * s * a - 2 * s * c * b + c * c * d) / (2 * r),
      (2 * s * c * (a - d) - 2 * (c * c - s * s) * b) / (2 * r * r)];
  }
  const turned = (angle) => angle - 2 * Math.PI * Math.ceil(angle / (2 * Math.PI) - 0.5);
  const residual = (z, expected, wrap) => {
    const y = [z[0] - expected[0], z[1] - expected[1]];
    return wrap ? [y[0], turned(y[1])] : y;
  };

  function linearized({ mean, cov }, { R }) {
    const H = jacobian(mean), P_xz = mul(cov, transpose(H));
    return { z: h(mean), P_zz: add(R, mul(H, P_xz)), P_xz };
  }
  function secondOrder(prior, model) {
    const first = linearized(prior, model), b = bias(prior.mean, prior.cov);
    return { z: [first.z[0] + b[0], first.z[1] + b[1]],
      P_zz: add(first.P_zz, scale(outer(b, b), -1)), P_xz: first.P_xz };
  }
  // The Cholesky factor of the same state with its coordinates in the other order.
  function upper([a, b, c, d]) {
    const [l, , m, n] = cholesky([d, c, b, a]);
    return [n, m, 0, l];
  }
  const ROOTS = { cholesky, symmetric: symmetricRoot, upper };
  const POINTS = { alpha: 1, beta: 2, kappa: 1, root: "cholesky" };
  function sigmaPoints({ mean, cov }, points = POINTS) {
    const { alpha, kappa, root } = points;
    const S = ROOTS[root](cov);
    const gamma = Math.sqrt(alpha * alpha * (2 + kappa));
    const columns = [[gamma * S[0], gamma * S[2]], [gamma * S[1], gamma * S[3]]];
    return [[0, 0], ...columns, ...columns.map(([x, y]) => [-x, -y])]
      .map(([x, y]) => [mean[0] + x, mean[1] + y]);
  }
  function unscented(prior, model, points = POINTS) {
    const { alpha, beta, kappa } = points, spread = alpha * alpha * (2 + kappa);
    const weight = 0.5 / spread, central = 1 - 2 / spread + 1 - alpha * alpha + beta;
    const X = sigmaPoints(prior, points), Z = X.map(h);
    const away = Z.map((z) => residual(z, Z[0], model.wrap));
    const z = Z[0].map((v, i) => v + weight * away.reduce((sum, y) => sum + y[i], 0));
    const dZ = Z.map((value) => residual(value, z, model.wrap));
    let P_zz = add(model.R, scale(outer(dZ[0], dZ[0]), central)), P_xz = [0, 0, 0, 0];
    for (let i = 1; i < 5; i++) {
      const dX = [X[i][0] - prior.mean[0], X[i][1] - prior.mean[1]];
      P_zz = add(P_zz, scale(outer(dZ[i], dZ[i]), weight));
      P_xz = add(P_xz, scale(outer(dX, dZ[i]), weight));
    }
    return { z, P_zz, P_xz };
  }

  const noisier = (moments, extra) => ({ ...moments, P_zz: add(moments.P_zz, extra) });
  function bumpLinear(prior, model, moments) {
    return [prior, noisier(moments, mul(jacobian(prior.mean), moments.P_xz))];
  }
  function bumpPredicted(prior, model, moments) {
    return [prior, noisier(moments, add(moments.P_zz, scale(model.R, -1)))];
  }
  function bumpCircular(prior, model, moments) {
    const H = jacobian(prior.mean);
    return [prior, noisier(moments, scale(mul(H, transpose(H)), norm(prior.cov)))];
  }
  function bumpEquivalent(prior, model, moments) {
    const H = jacobian(prior.mean), J = inverse(H);
    const size = norm(symmetric(mul(mul(J, model.R), transpose(J))));
    return [prior, noisier(moments, add(scale(mul(H, transpose(H)), size), scale(model.R, -1)))];
  }
  function bumpState(prior, model, moments) {
    const H = jacobian(prior.mean), size = norm(prior.cov);
    return [{ mean: prior.mean, cov: [size, 0, 0, size] },
      { z: moments.z, P_zz: add(model.R, scale(mul(H, transpose(H)), size)),
        P_xz: scale(transpose(H), size) }];
  }
  const atMean = (prior, model, moments) => [prior, { ...moments, z: h(prior.mean) }];

  const FILTERS = {
    "EKF": [linearized], "B-EKF 1": [linearized, bumpLinear], "B-EKF 2": [linearized, bumpCircular],
    "B-EKF 3": [linearized, bumpEquivalent], "B-EKF 4": [linearized, bumpState],
    "mtSOF": [secondOrder], "B-mtSOF": [secondOrder, bumpLinear],
    "UKF": [unscented], "B-UKF": [unscented, bumpPredicted], "UKFz": [unscented, atMean],
  };

  function correct(prior, z, moments, wrap) {
    const K = mul(moments.P_xz, inverse(moments.P_zz));
    const step = apply(K, residual(z, moments.z, wrap));
    const reduction = mul(K, transpose(moments.P_xz));
    return { mean: [prior.mean[0] + step[0], prior.mean[1] + step[1]],
      cov: add(prior.cov, scale(symmetric(reduction), -1)) };
  }
  // One update. points: alpha, beta, kappa and root of the unscented filters.
  function update(name, prior, z, model, points) {
    const [moments, variant] = FILTERS[name], found = moments(prior, model, points);
    const [changed, expected] = variant ? variant(prior, model, found) : [prior, found];
    return correct(changed, z, expected, model.wrap);
  }

  // Repeatable normal numbers: mulberry32 and Box and Muller.
  function normals(seed) {
    let state = seed >>> 0;
    const uniform = () => {
      state = (state + 0x6d2b79f5) >>> 0;
      let t = Math.imul(state ^ (state >>> 15), state | 1);
      t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
      return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
    };
    return () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());
  }
  // The measurements of a run: of the truth itself, or with noise of R's size from a seed.
  function measurements(truth, model, noisy, seed = 1) {
    const exact = h(truth), normal = normals(seed);
    const sizes = [Math.sqrt(model.R[0]), Math.sqrt(model.R[3])];
    return () => (noisy ? exact.map((v, i) => v + sizes[i] * normal()) : exact);
  }

  const distance = ([a, b], [c, d]) => Math.hypot(a - c, b - d);
  const claimed = ({ cov }) => Math.sqrt(eigen(cov).values[0]);
  // How many of its own deviations the truth is away from an estimate.
  function deviations({ mean, cov }, truth) {
    const away = [truth[0] - mean[0], truth[1] - mean[1]], [a, b] = apply(inverse(cov), away);
    return Math.sqrt(Math.abs(away[0] * a + away[1] * b));
  }

  root.kernel = { FILTERS, POINTS, add, apply, bias, claimed, correct, deviations, distance, eigen, h,
    inverse, jacobian, linearized, measurements, mul, norm, normals, outer, residual, scale, secondOrder,
    sigmaPoints, symmetric, transpose, unscented, update };
  }
  build(root);
  root.kernel.source = `(${build})(globalThis.navfilters ??= {});`; // for workers, which cannot load a file's neighbour
})((globalThis.navfilters ??= {}));
