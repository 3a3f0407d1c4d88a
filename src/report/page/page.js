"use strict";
// Everything is readable without this script: it only adds the slider, the zoom, sorting and copying.
document.documentElement.classList.add("scripted");

for (const figure of document.querySelectorAll("figure.compare")) {
  const stack = figure.querySelector(".stack");
  const range = figure.querySelector("input[type=range]");
  const cut = () => stack.style.setProperty("--cut", range.value + "%");
  range.addEventListener("input", cut);
  const move = (event) => {
    const box = stack.getBoundingClientRect();
    range.value = Math.round((100 * (event.clientX - box.left)) / box.width);
    cut();
  };
  stack.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    stack.setPointerCapture(event.pointerId);
    move(event);
  });
  stack.addEventListener("pointermove", (event) => event.buttons && move(event));
  const pick = () => {
    const wanted = figure.querySelector("input[type=radio]:checked");
    for (const image of stack.querySelectorAll("img[data-layer]")) {
      image.hidden = wanted !== null && image.dataset.layer !== wanted.value;
    }
  };
  for (const radio of figure.querySelectorAll("input[type=radio]")) radio.addEventListener("change", pick);
  figure.classList.add("live");
  cut();
  pick();
}

for (const figure of document.querySelectorAll("figure.zoom")) {
  const viewport = figure.querySelector(".viewport");
  const image = viewport.querySelector("img");
  let scale = 1, x = 0, y = 0;
  const draw = () => {
    const box = viewport.getBoundingClientRect();
    scale = Math.min(16, Math.max(1, scale));
    x = Math.min(0, Math.max(box.width * (1 - scale), x));
    y = Math.min(0, Math.max(box.height * (1 - scale), y));
    image.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
  };
  const zoom = (factor, px, py) => {
    const box = viewport.getBoundingClientRect();
    const [cx, cy] = [px ?? box.width / 2, py ?? box.height / 2];
    const before = scale;
    scale = Math.min(16, Math.max(1, scale * factor));
    x = cx - ((cx - x) * scale) / before;
    y = cy - ((cy - y) * scale) / before;
    draw();
  };
  const pan = (dx, dy) => { x += dx; y += dy; draw(); };
  const reset = () => { scale = 1; x = 0; y = 0; draw(); };
  const keys = {
    "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": reset,
    ArrowLeft: () => pan(60, 0), ArrowRight: () => pan(-60, 0), ArrowUp: () => pan(0, 60), ArrowDown: () => pan(0, -60),
  };
  viewport.addEventListener("keydown", (event) => {
    const act = keys[event.key];
    // an unzoomed plan leaves the arrows to the page
    if (act && !event.ctrlKey && !event.metaKey && (scale > 1 || !event.key.startsWith("Arrow"))) {
      event.preventDefault();
      act();
    }
  });
  viewport.addEventListener("wheel", (event) => {
    // the page keeps its wheel unless the reader asks for zoom
    if (!event.ctrlKey && document.activeElement !== viewport) return;
    event.preventDefault();
    const box = viewport.getBoundingClientRect();
    zoom(Math.exp(-event.deltaY / 300), event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  viewport.addEventListener("pointermove", (event) => {
    if (event.buttons && scale > 1) { event.preventDefault(); pan(event.movementX, event.movementY); }
  });
  viewport.addEventListener("dragstart", (event) => event.preventDefault());
  figure.querySelector("[data-act=in]").addEventListener("click", () => zoom(1.5));
  figure.querySelector("[data-act=out]").addEventListener("click", () => zoom(1 / 1.5));
  figure.querySelector("[data-act=reset]").addEventListener("click", reset);
  figure.classList.add("live");
}

for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const key = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent.trim();
      const compare = (a, b) => {
        const [p, q] = [key(a), key(b)];
        const numeric = p !== "" && q !== "" && !isNaN(p) && !isNaN(q);
        return numeric ? p - q : p.localeCompare(q);
      };
      const rows = [...table.tBodies[0].rows].sort((a, b) => (down ? compare(b, a) : compare(a, b)));
      table.tBodies[0].append(...rows);
    });
  });
}

for (const button of document.querySelectorAll("button.copy")) {
  button.addEventListener("click", async () => {
    const text = document.getElementById(button.dataset.of).textContent;
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      // some browsers refuse on a page opened from disk: select it, for the reader's own copy command
      getSelection().selectAllChildren(document.getElementById(button.dataset.of));
      button.textContent = "Selected: copy it with the keyboard";
    }
  });
}

// paper shows what is folded away
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details:not([open])")) {
    details.open = true;
    details.dataset.printed = "";
  }
});
addEventListener("afterprint", () => {
  for (const details of document.querySelectorAll("details[data-printed]")) {
    details.open = false;
    delete details.dataset.printed;
  }
});
