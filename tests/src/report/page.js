"use strict";
// Shows and hides curves, rows and pictures by backend, mode and rule.
const boxes = [...document.querySelectorAll(".filters input")];
const marked = [...document.querySelectorAll("[data-backend]")];
function show() {
  const off = new Set(boxes.filter(b => !b.checked).map(b => b.name + "=" + b.value));
  for (const e of marked) {
    const d = e.dataset;
    const hide = ["backend", "mode", "rule"].some(k => off.has(k + "=" + d[k]));
    e.classList.toggle("hidden", hide);
  }
}
boxes.forEach(b => b.addEventListener("change", show));
// Sorts the table by the column that is clicked, the other way at the second click.
for (const th of document.querySelectorAll("th")) {
  th.addEventListener("click", () => {
    const body = th.closest("table").tBodies[0];
    const sign = th.dataset.sign = th.dataset.sign === "1" ? "-1" : "1";
    const value = tr => tr.cells[th.cellIndex].dataset.value ?? tr.cells[th.cellIndex].textContent;
    const order = (a, b) => { const [x, y] = [value(a), value(b)]; return isNaN(x - y) ? x.localeCompare(y) : x - y; };
    body.append(...[...body.rows].sort((a, b) => sign * order(a, b)));
  });
}
