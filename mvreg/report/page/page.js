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

  all("tr[data-scan], circle[data-scan]").forEach((one) => {
    one.addEventListener("click", (event) => { if (event.target.tagName !== "INPUT") choose(one.dataset.scan); });
    one.addEventListener("keydown", (event) => {
      if ((event.key === "Enter" || event.key === " ") && event.target === one) { choose(one.dataset.scan); event.preventDefault(); }
    });
  });

  all("table.sorts th button").forEach((button) => button.addEventListener("click", () => {
    const head = button.parentElement, table = head.closest("table"), body = table.tBodies[0];
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
    [...body.rows].sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === null || y === null) return (x === null) - (y === null);
      const found = typeof x === "number" && typeof y === "number" ? x - y : order.compare(String(x), String(y));
      return up ? found : -found;
    }).forEach((row) => body.appendChild(row));
  }));

  const filter = document.getElementById("filter");
  if (filter) filter.addEventListener("input", () => {
    const wanted = filter.value.toLowerCase();
    all("#scans tbody tr").forEach((row) => { row.hidden = !row.textContent.toLowerCase().includes(wanted); });
  });
  const refused = document.getElementById("refused");
  if (refused) refused.addEventListener("change", () => {
    document.getElementById("graph").classList.toggle("all-links", refused.checked);
  });
  document.documentElement.dataset.ready = "true";
})();
