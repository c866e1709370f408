// The table of cures by patients: choose a pair, and see how its error and its claim went.
(function (root) {
  "use strict";
  const { stage } = root;
  const { curve, digits, element, panel } = stage;
  const WORDS = { "-1": "more cautious than need be", 0: "honest", 1: "over-confident" };
  const shade = (ratio) => (ratio === null ? 5 : [1.5, 3, 10, 100, 1000].filter((limit) => ratio >= limit).length);
  const powers = (line, step) => line.map((v) => (v === null ? NaN : 10 ** (step * v)));

  root.figures.cures = (host, settings) => {
    const { courses, rows, pairs, reasons, parameters, step, styles } = settings;
    const table = host.closest(".computing").querySelector("table.cures"), patients = [...table.tHead.rows[0].cells].slice(1).map((cell) => cell.textContent);
    const first = { row: "EKF", patient: settings.patient, value: "" };
    const hash = decodeURIComponent(location.hash.slice(1)), named = hash && table.querySelector(`[id="${CSS.escape(hash)}"]`);
    if (named) first.row = named.querySelector("th").textContent;
    const cure = (row) => row.replace(/ \*$/, "");
    const values = (row, patient) => pairs[cure(row)][patient] ?? [];
    // A row has the value of the cure's text, or with a star the one of the least error.
    const chosen = ({ row, patient, value }) => {
      const all = values(row, patient);
      if (value !== "") return all.find((pair) => String(pair.value) === value) ?? all[0];
      const order = (pair) => (pair.settled ? pair.ratio ?? Infinity : Infinity);
      return row.endsWith("*") ? all.reduce((a, b) => (order(b) < order(a) ? b : a), all[0]) : all[0];
    };
    return stage.figure(host, "cures", first, (self) => {
      const { state } = self;
      if (!rows.includes(state.row)) state.row = first.row;
      if (!patients.includes(state.patient)) state.patient = first.patient;
      let under = null; // the pair under the pointer
      const picture = element("div", { class: "picture" }), says = element("p", { class: "says", "aria-live": "polite" });
      const scroll = element("div", { class: "grid-of-cures" }, table);
      const cells = rows.map((row) => [...[...table.tBodies[0].rows].find((line) => line.cells[0].textContent === row).cells].slice(1));
      table.setAttribute("role", "grid");
      table.setAttribute("aria-label", "Cures by patients");
      const choose = (i, j) => self.set({ row: rows[i], patient: patients[j], value: "" });
      cells.forEach((line, i) => line.forEach((cell, j) => {
        const pair = chosen({ row: rows[i], patient: patients[j], value: "" });
        cell.setAttribute("role", "gridcell");
        cell.setAttribute("aria-label", `${rows[i]} on ${patients[j]}: ${!pair ? "cannot act" : pair.settled ? `${digits(pair.ratio ?? NaN)} times the reference, ${WORDS[pair.honest]}` : "lost"}`);
        if (pair) cell.dataset.shade = shade(pair.settled ? pair.ratio : null);
        if (pair?.settled && pair.honest === 0) cell.classList.add("honest");
        cell.addEventListener("click", () => { under = null; choose(i, j); });
        cell.addEventListener("focus", () => { if (rows[i] !== state.row || patients[j] !== state.patient) choose(i, j); });
        cell.addEventListener("pointerenter", (event) => { if (event.pointerType === "mouse") { under = { row: rows[i], patient: patients[j], value: "" }; self.set({}); } });
      }));
      table.addEventListener("pointerleave", () => { under = null; self.set({}); });
      table.addEventListener("keydown", (event) => {
        const i = rows.indexOf(state.row), j = patients.indexOf(state.patient);
        const to = { ArrowUp: [i - 1, j], ArrowDown: [i + 1, j], ArrowLeft: [i, j - 1], ArrowRight: [i, j + 1], Home: [i, 0], End: [i, patients.length - 1] }[event.key];
        if (!to || !cells[to[0]]?.[to[1]]) return;
        event.preventDefault();
        cells[to[0]][to[1]].tabIndex = 0;
        cells[to[0]][to[1]].focus();
      });
      const select = element("select", { onchange: () => self.set({ value: select.value }) }), name = element("span");
      const parameter = { node: element("label", {}, name, select), show() {
        const all = values(state.row, state.patient), several = all.length > 1, sorted = [...all].sort((a, b) => a.value - b.value);
        name.textContent = several ? parameters[cure(state.row)] : "Parameter";
        select.disabled = !several;
        select.replaceChildren(...(several ? sorted.map((pair) => element("option", { value: String(pair.value) }, digits(pair.value))) : [element("option", { value: "" }, "–")]));
        if (several) select.value = String(chosen(state).value);
      } };
      const of = (text, options, key) => stage.choice(text, options, () => state[key], (v) => self.set({ [key]: v, value: "" }));
      const controls = [of("Cure", rows, "row"), of("Patient", patients, "patient"), parameter];

      function drawn({ row, patient }, pair) {
        const { updates, since, reference, unit } = courses[patient];
        const lines = pair ? [powers(pair.error, step), powers(pair.claim, step)] : [[], []];
        const all = [...lines.flat(), reference].filter((v) => v > 0 && Number.isFinite(v)).map(Math.log10);
        const low = Math.floor(Math.min(...all) - 0.1), high = Math.max(low + 2, Math.min(low + 16, Math.ceil(Math.max(...all) + 0.1)));
        const last = updates[updates.length - 1], even = updates[2] - updates[1] > 2 || last < 10;
        const axes = panel({ width: 360, height: 270, x: { range: [even ? 0 : 1, last], label: "update", log: !even }, y: { range: [10 ** low, 10 ** high], label: `root mean square (${unit})`, log: true }, label: `Error and claim of ${row} on ${patient}` });
        const ends = [since, last].map(axes.X);
        if (since < last) axes.drawing.append(element("svg:rect", { class: "band", x: ends[0], width: ends[1] - ends[0], y: axes.box.top, height: axes.box.bottom - axes.box.top }));
        curve(axes, [[axes.x.range[0], reference], [last, reference]], { class: "paper" });
        const colour = styles[cure(row)]?.color ?? styles.EKF.color;
        curve(axes, lines[1].map((v, k) => [updates[k], v]), { class: "bound", "stroke-width": 2.2 });
        curve(axes, lines[0].map((v, k) => [updates[k], v]), { stroke: colour, "stroke-width": 2.4 });
        const ending = lines.map((line) => line[line.length - 1] ?? NaN), [e, c] = ending;
        const label = (v, text, above) => { if (v > 0) stage.write(axes, text, [last, Math.min(Math.max(v, 10 ** low), 10 ** high)], { dx: -4, dy: above ? -7 : 16, "text-anchor": "end" }); };
        label(e, "error", !(e < c));
        label(c, "claimed", e < c);
        picture.replaceChildren(axes.picture);
        return ending;
      }
      function draw() {
        const shown = under ?? state, pair = chosen(shown), { unit, reference } = courses[shown.patient];
        cells.flat().forEach((cell) => { cell.tabIndex = -1; cell.removeAttribute("aria-selected"); });
        const now = cells[rows.indexOf(state.row)][patients.indexOf(state.patient)];
        now.tabIndex = 0;
        now.setAttribute("aria-selected", "true");
        const [error, claim] = drawn(shown, pair), of = element("b", {}, `${shown.row.replace(" *", "")} on ${shown.patient}`);
        if (!pair) says.replaceChildren(of, `: cannot act. The cure ${reasons[cure(shown.row)]?.[shown.patient] ?? "was not tried"}.`);
        else if (!pair.settled) {
          says.replaceChildren(of, pair.value === null ? "" : `, ${parameters[cure(shown.row)]} ${digits(pair.value)}`, ": ", element("b", {}, `${Math.round(100 * pair.lost)} % of the runs are lost`),
            ". How far, and how sure the filter is, is decided by rounding, and so is the course.", pair.error.length ? "" : " Its course is not stored.");
        } else {
          const with_ = pair.value === null ? "" : `, ${parameters[cure(shown.row)]} ${digits(pair.value)}`;
          says.replaceChildren(of, `${with_}: `, element("b", {}, pair.ratio === null ? "no number" : `${digits(pair.ratio)} times`), ` the reference of ${digits(reference)} ${unit}, `,
            element("b", {}, WORDS[pair.honest]), ` (NEES ${pair.honesty === null ? "no number" : `${pair.honesty > 1000 ? "more than 1000" : digits(pair.honesty)} of its expectation`}); ${Math.round(100 * pair.lost)} % of the runs are lost.`,
            pair.error.length ? "" : " Its course is not stored.");
        }
        Object.assign(host.dataset, { ratio: pair?.ratio ?? NaN, honesty: pair?.honesty ?? NaN, honest: pair?.honest ?? "", settled: pair?.settled ?? "", value: pair?.value ?? "", error, claim });
      }
      if (named) requestAnimationFrame(() => named.scrollIntoView({ block: "center" }));
      return { controls, draw, nodes: [element("div", { class: "cures-and-course" }, element("div", { class: "course" }, picture, says), scroll)] };
    });
  };
})((globalThis.navfilters ??= {}));
