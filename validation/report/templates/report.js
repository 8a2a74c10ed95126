"use strict";
// The index's filter and sorting, the swap of views, and the copy button. Pages read well without.

function index(table) {
  const body = table.tBodies[0];
  const rows = Array.from(body.rows);
  const words = document.getElementById("words");
  const boxes = Array.from(document.querySelectorAll("#filters input[name=outcome]"));
  const texts = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));

  function filter() {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    const outcomes = new Set(boxes.filter((box) => box.checked).map((box) => box.value));
    let shown = 0;
    for (const row of rows) {
      const fits = outcomes.has(row.dataset.outcome)
        && wanted.every((word) => texts.get(row).includes(word));
      row.hidden = !fits;
      shown += fits;
    }
    document.getElementById("shown").textContent = `${shown} of ${rows.length}`;
    document.getElementById("nothing").hidden = shown > 0;
  }
  words.addEventListener("input", filter);
  boxes.forEach((box) => box.addEventListener("change", filter));
  document.getElementById("filters").addEventListener("submit", (event) => event.preventDefault());
  filter();  // a browser may bring back what was typed before

  function order(column, downwards) {
    const value = (row) => row.cells[column].dataset.sort;
    const numbers = rows.every((row) => value(row) === "" || !Number.isNaN(Number(value(row))));
    const compare = (a, b) => {
      const [one, other] = [value(a), value(b)];
      if (one === "" || other === "") return (one === "") - (other === "");  // no value: last
      const sign = numbers ? Number(one) - Number(other) : one.localeCompare(other, "en", { numeric: true });
      return downwards ? -sign : sign;
    };
    body.append(...rows.slice().sort(compare));
  }
  Array.from(table.tHead.rows[0].cells).forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const downwards = head.getAttribute("aria-sort") === "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", downwards ? "descending" : "ascending");
      order(column, downwards);
    });
  });
}

function swap(views) {
  const buttons = Array.from(document.querySelectorAll("[data-view]"));
  const slider = document.getElementById("split");
  if (!buttons.length) return;
  views.classList.add("live");
  function show(name) {
    views.dataset.shown = name;
    buttons.forEach((button) => button.setAttribute("aria-pressed", button.dataset.view === name));
  }
  function split(share) {
    const percent = Math.min(Math.max(share, 0), 1) * 100;
    views.style.setProperty("--split", `${percent}%`);
    slider.value = percent;
  }
  buttons.forEach((button) => button.addEventListener("click", () => show(button.dataset.view)));
  slider.addEventListener("input", () => split(slider.value / 100));
  views.addEventListener("pointermove", (event) => {
    if (views.dataset.shown !== "split") return;
    const box = views.getBoundingClientRect();
    split((event.clientX - box.left) / box.width);
  });
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const button = buttons[Number(event.key) - 1];
    if (button) show(button.dataset.view);
  });
  split(0.5);
}

function copy(button) {
  const source = document.getElementById(button.dataset.copy);
  button.addEventListener("click", async () => {
    let done = true;
    try {
      await navigator.clipboard.writeText(source.textContent);
    } catch {
      // Without the clipboard's permission the text is marked, ready for the keyboard.
      getSelection().selectAllChildren(source);
      done = document.execCommand("copy");
    }
    button.textContent = done ? "copied" : "marked";
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  });
}

const table = document.getElementById("cases");
if (table) index(table);
const views = document.getElementById("views");
if (views) swap(views);
document.querySelectorAll("[data-copy]").forEach(copy);
