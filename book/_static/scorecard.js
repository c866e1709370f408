// The scorecard's filters, search, order and exports. Without this script the tables stand as they are.
(function () {
  "use strict";
  const FILTERS = { paper: "paper", verdict: "verdict", kind: "kind", limit: "limit" };
  const ORDERS = { "as in the sources": null, "by verdict": "verdict", "by chapter": "page", "by name": "id" };

  function begin() {
    const host = document.querySelector(".claims-browser"), data = document.getElementById("ledger");
    if (!host || !data) return;
    const claims = JSON.parse(data.textContent), names = JSON.parse(host.dataset.names);
    const rows = new Map(claims.map((c) => [c.id, document.getElementById(`row-${c.id}`)]));
    const homes = new Map([...rows.values()].filter(Boolean).map((row) => [row, row.parentElement]));
    const folds = [...document.querySelectorAll("details.claims-work")];
    let all = false; // the whole of every table; otherwise a table is folded until something is looked for
    const state = { search: "", order: "", paper: "", verdict: "", kind: "", limit: "" };
    const make = (name, attributes, ...children) => {
      const node = Object.assign(document.createElement(name), attributes);
      node.append(...children);
      return node;
    };

    const controls = {};
    const labelled = (text, control) => make("label", {}, make("span", {}, text), control);
    controls.search = make("input", { type: "search", name: "search", oninput: () => change({ search: controls.search.value }) });
    const nodes = [labelled("Search", controls.search)];
    for (const [name, key] of Object.entries(FILTERS)) {
      const values = [...new Set(claims.map((c) => c[key]))].filter(Boolean);
      controls[name] = make("select", { name, onchange: () => change({ [name]: controls[name].value }) },
        make("option", { value: "" }, "all"), ...values.map((v) => make("option", { value: v }, names[v] ?? v)));
      nodes.push(labelled(name === "limit" ? "Limit" : name[0].toUpperCase() + name.slice(1), controls[name]));
    }
    controls.order = make("select", { name: "order", onchange: () => change({ order: controls.order.value }) },
      ...Object.keys(ORDERS).map((name) => make("option", { value: ORDERS[name] ?? "" }, name)));
    nodes.push(labelled("Order", controls.order));
    const count = make("p", { className: "claims-count" });
    count.setAttribute("aria-live", "polite");
    const save = (text, type, name) => make("button", { type: "button", onclick: () => {
      const link = make("a", { href: URL.createObjectURL(new Blob([text()], { type })), download: name });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    } }, name.endsWith("csv") ? "Save as CSV" : "Save as JSON");
    const quoted = (v) => `"${String(v).replace(/"/g, '""')}"`;
    const csv = () => [Object.keys(claims[0]), ...chosen().map((c) => Object.values(c))].map((line) => line.map(quoted).join(",")).join("\r\n") + "\r\n";
    nodes.push(save(csv, "text/csv", "claims.csv"), save(() => JSON.stringify(chosen(), null, 1), "application/json", "claims.json"),
      make("button", { type: "button", onclick: () => { all = true; change(Object.fromEntries(Object.keys(state).map((k) => [k, ""]))); } }, "Show all"));
    host.append(make("div", { className: "claims-controls" }, ...nodes), count);

    function chosen() {
      const words = state.search.toLowerCase().split(/\s+/).filter(Boolean);
      return claims.filter((c) => {
        const text = Object.values(c).join(" ").toLowerCase();
        return words.every((w) => text.includes(w)) && Object.entries(FILTERS).every(([name, key]) => !state[name] || c[key] === state[name]);
      });
    }
    function show() {
      for (const [name, control] of Object.entries(controls)) control.value = state[name];
      const found = chosen(), ids = new Set(found.map((c) => c.id));
      rows.forEach((row, id) => { if (row) row.hidden = !ids.has(id); });
      const sorted = state.order ? [...claims].sort((a, b) => a[state.order].localeCompare(b[state.order])) : claims;
      for (const c of sorted) { const row = rows.get(c.id); if (row) homes.get(row).append(row); }
      const looking = Object.values(state).some(Boolean);
      for (const fold of folds) fold.open = all || looking;
      // A source without a row left hides, heading and all.
      for (const table of new Set(homes.values())) {
        const section = table.closest("section"), left = [...table.querySelectorAll("tr[id]")].some((row) => !row.hidden);
        (section ?? table).hidden = !left;
      }
      count.textContent = found.length === claims.length ? `${claims.length} claims` : `${found.length} of ${claims.length} claims`;
    }
    function change(changes) {
      Object.assign(state, changes);
      const query = new URLSearchParams(Object.entries(state).filter(([, v]) => v));
      try { history.replaceState(null, "", String(query) ? `#${query}` : location.pathname + location.search); } catch { /* a page that is a file, in some browsers */ }
      show();
    }
    function fromAddress() {
      const hash = location.hash.slice(1);
      if (hash.startsWith("row-")) { // a link to one claim: it must be there
        Object.keys(state).forEach((key) => { state[key] = ""; });
        show();
        const row = document.getElementById(hash);
        if (row) {
          for (let fold = row.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
          row.querySelector("details").open = true;
          row.scrollIntoView({ block: "center" });
        }
        return;
      }
      const given = new URLSearchParams(hash);
      Object.keys(state).forEach((key) => { state[key] = given.get(key) ?? ""; });
      show();
    }
    addEventListener("hashchange", fromAddress);
    fromAddress();
    host.dataset.ready = "true";
  }
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
