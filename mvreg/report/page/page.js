/* What links the view, the tables and the graph: one scan is chosen in all of them at once. */
"use strict";

(function () {
  const data = JSON.parse(document.getElementById("points").textContent);
  const scenes = JSON.parse(document.getElementById("scenes").textContent);
  const canvas = document.getElementById("view");
  const note = document.getElementById("note");
  const all = (selector) => [...document.querySelectorAll(selector)];
  let chosen = null;

  const viewer = createViewer(canvas, data, choose, (said) => { note.textContent = said; });
  const scene = document.getElementById("scene");
  const help = "drag to turn, shift and drag to move, wheel to zoom, click on a scan; or arrow keys, + and -, R";

  function choose(name) {
    chosen = name === chosen ? null : name;
    all("[data-scan]").forEach((row) => {
      const on = row.dataset.scan === chosen;
      row.classList.toggle("chosen", on);
      if (row.tagName === "TR") row.setAttribute("aria-selected", on);
    });
    all("circle[data-scan]").forEach((node) => node.setAttribute("stroke-width", node.dataset.scan === chosen ? 5 : 1));
    const row = all("#scans tr[data-scan]").find((one) => one.dataset.scan === chosen);
    if (row) row.scrollIntoView({ block: "nearest" });
    note.textContent = chosen ? chosen + (row ? ": " + row.dataset.said : "") : help;
    if (viewer) viewer.choose(chosen);
  }

  function show(number) {
    scene.value = String(number);
    if (viewer) viewer.show(scenes[number]);
  }

  if (viewer) {
    show(0);
    note.textContent = help;
    scene.addEventListener("change", () => show(Number(scene.value)));
    document.getElementById("colour").addEventListener("change", (event) => {
      viewer.colourBy(event.target.value);
      all("[data-legend]").forEach((one) => { one.hidden = one.dataset.legend !== event.target.value; });
    });
    document.getElementById("size").addEventListener("input", (event) => viewer.pointSize(Number(event.target.value)));
    document.getElementById("reset").addEventListener("click", () => viewer.reset());
  }
  all("input[data-show]").forEach((box) => box.addEventListener("change", () => {
    if (viewer) viewer.visible(box.dataset.show, box.checked);
  }));
  const everything = document.getElementById("everything");
  if (everything) everything.addEventListener("change", () => {
    all("input[data-show]").forEach((box) => {
      box.checked = everything.checked;
      if (viewer) viewer.visible(box.dataset.show, box.checked);
    });
  });
  all("[data-scene]").forEach((button) => button.addEventListener("click", () => {
    show(Number(button.dataset.scene));
    canvas.scrollIntoView({ block: "center" });
    canvas.focus({ preventScroll: true });
  }));

  // One scan of a table or graph is reached by Tab, the others from there by arrow keys.
  const steps = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1, Home: -Infinity, End: Infinity };
  function reach(from, to) {
    for (const [one, index] of [[from, "-1"], [to, "0"]]) {
      one.setAttribute("tabindex", index);
      one.querySelectorAll("input").forEach((box) => box.setAttribute("tabindex", index));
    }
    to.focus();
  }
  for (const [place, wanted] of [["#scans tbody", "tr[data-scan]"], ["#graph svg", "circle[data-scan]"]]) {
    const held = document.querySelector(place);
    if (!held) continue;
    const one = (event) => event.target.closest(wanted);
    held.addEventListener("click", (event) => {
      if (one(event) && event.target.tagName !== "INPUT") choose(one(event).dataset.scan);
    });
    held.addEventListener("keydown", (event) => {
      if (one(event) !== event.target) return;
      if (event.key === "Enter" || event.key === " ") choose(event.target.dataset.scan);
      else if (event.key in steps) {
        const every = [...held.querySelectorAll(wanted)].filter((other) => !other.hidden);
        const next = Math.max(0, Math.min(every.length - 1, every.indexOf(event.target) + steps[event.key]));
        reach(held.querySelector(`${wanted}[tabindex="0"]`) || event.target, every[next]);
      } else return;
      event.preventDefault();
    });
  }

  function unfold(name) {  // the rows that waited
    const button = document.querySelector(`[data-more="${name}"]`);
    if (!button) return;
    const rows = document.querySelector(`script[data-rows="${name}"]`).textContent;
    document.querySelector(`#${name} tbody`).insertAdjacentHTML("beforeend", rows);
    button.parentElement.remove();
  }
  all("[data-more]").forEach((button) => button.addEventListener("click", () => unfold(button.dataset.more)));

  all("table.sorts th button").forEach((button) => button.addEventListener("click", () => {
    const head = button.parentElement, table = head.closest("table"), body = table.tBodies[0];
    if (table.id) unfold(table.id);
    const column = [...head.parentElement.children].indexOf(head);
    const up = head.getAttribute("aria-sort") !== "ascending";
    [...head.parentElement.children].forEach((one) => one.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const value = (row) => {
      const cell = row.children[column];
      const text = cell.dataset.value !== undefined ? cell.dataset.value : cell.textContent.trim();
      const number = Number(text);
      return text === "" || text === "-" ? null : Number.isNaN(number) ? text : number;
    };
    const order = new Intl.Collator(undefined, { numeric: true });
    const rows = [...body.rows].map((row) => [row, value(row)]);
    body.replaceChildren();  // rows are laid out once, not at every step
    rows.sort(([, x], [, y]) => {
      if (x === null || y === null) return (x === null) - (y === null);
      const found = typeof x === "number" && typeof y === "number" ? x - y : order.compare(String(x), String(y));
      return up ? found : -found;
    });
    body.append(...rows.map(([row]) => row));
  }));

  const filter = document.getElementById("filter");
  if (filter) filter.addEventListener("input", () => {
    const wanted = filter.value.toLowerCase();
    all("#scans tbody tr").forEach((row) => { row.hidden = !row.textContent.toLowerCase().includes(wanted); });
    const [reached, first] = ["tr[tabindex='0']", "tr:not([hidden])"].map((one) => document.querySelector(`#scans tbody ${one}`));
    if (reached && reached.hidden && first) { reached.setAttribute("tabindex", "-1"); first.setAttribute("tabindex", "0"); }
  });
  const refused = document.getElementById("refused");
  if (refused) refused.addEventListener("change", () => {
    document.getElementById("graph").classList.toggle("all-links", refused.checked);
  });
  document.documentElement.dataset.ready = "true";
})();
