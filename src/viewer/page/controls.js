// ---- going about ----

function moved() {
  S.dirty = true;
  if (!S.view) return;
  S.view = null;
  $("view").value = "";
  controls();
}

function look(view) {
  S.view = view;
  [S.eye, S.tan, S.base] = [view.position.slice(), view.tan.slice(), view.exposures];
  const [right, forward] = [view.right, view.forward];
  S.yaw = Math.atan2(forward[0], forward[1]);
  S.pitch = Math.asin(reduced(forward[2], -1, 1));
  const level = [Math.cos(S.yaw), -Math.sin(S.yaw), 0];
  S.roll = Math.atan2(-dot(right, cross(level, forward)), dot(right, level));
  if (view.photo) $("photo").src = view.photo;
  $("photo").alt = `Photograph of the view ${view.name}`;
  S.orbit = false;
  controls();
}

function turn(dx, dy) {
  S.yaw += dx;
  S.pitch = reduced(S.pitch + dy, -1.55, 1.55);
  S.roll = 0;
  if (S.orbit && S.pivot) S.eye = add(S.pivot, axes()[2], -S.far);
  moved();
}

function go(right, forward, up) {
  if (S.orbit && S.pivot) {
    S.far = Math.max(M.size * 1e-3, S.far - forward);
    turn(right / S.far, up / S.far);
    return;
  }
  S.eye = add(S.eye, [Math.sin(S.yaw), Math.cos(S.yaw), 0], forward);
  S.eye = add(S.eye, [Math.cos(S.yaw), -Math.sin(S.yaw), 0], right);
  S.eye = add(S.eye, [0, 0, 1], up);
  moved();
}

/** Goes along the line of sight. */
function approach(by) {
  if (S.orbit && S.pivot) return go(0, by, 0);
  S.eye = add(S.eye, axes()[2], by);
  moved();
}

function setOrbit(on) {
  S.orbit = on;
  if (on) {
    S.pivot = pick($("gl").clientWidth / 2, $("gl").clientHeight / 2) || M.low.map((v, k) => (v + M.high[k]) / 2);
    const way = add(S.pivot, S.eye, -1);
    S.far = norm(way);
    S.yaw = Math.atan2(way[0], way[1]);
    S.pitch = Math.asin(reduced(way[2] / S.far, -1, 1));
    S.roll = 0;
    moved();
  }
  controls();
}

function setTape(on) {
  S.tape = on;
  S.points = [];
  tell(on ? ["Click one end, then the other."] : []);
  controls();
}

function legend() {
  const some = {
    3: [...M.probes.map((p, i) => [p.name, PALETTE[i % 8]]), ["none", [0.25, 0.25, 0.25]]],
    4: [["probes agree", PALETTE[4]], ["probes differ", PALETTE[1]], ["not seen: from what lights it", PALETTE[3]], ["guessed from beside", PALETTE[6]]],
    5: [["none", PALETTE[8]], ["1", PALETTE[9]], ["2", PALETTE[10]], ["3 and more", PALETTE[11]]],
  }[S.layer];
  $("legend").replaceChildren(...(some || []).map(([name, c]) => {
    const item = document.createElement("span"), swatch = document.createElement("i");
    swatch.style.background = css(c);
    item.append(swatch, name);
    return item;
  }));
}

function controls() {
  const press = (id, on) => $(id).setAttribute("aria-pressed", String(on));
  press("walk", !S.orbit);
  press("orbit", S.orbit);
  press("tape", S.tape);
  press("marks", S.marks);
  press("finds", S.finds);
  $("gl").classList.toggle("tape", S.tape);
  $("view").value = S.view ? "v" + M.views.indexOf(S.view) : "";
  $("photorow").hidden = !(S.view && S.view.photo);
  $("photosays").textContent = $("wipe").value + " %";
  $("light").value = S.light;
  const [a, b, fade] = lightings();
  $("lightsays").textContent = fade > 0 ? `${M.lightings[a].name} → ${M.lightings[b].name}, ${Math.round(100 * fade)} %` : M.lightings[a].name;
  $("stops").value = S.stops;
  $("stopsays").textContent = `${S.stops > 0 ? "+" : ""}${S.stops.toFixed(1)} stops`;
  $("layer").value = S.layer;
  $("cut").value = S.cut;
  $("cutsays").textContent = S.cut >= 1000 ? "nothing" : `${(cutAt() + M.height).toFixed(2)} m`;
  legend();
  S.dirty = true;
}

/** What the address keeps. */
function address() {
  const n = (v) => Number(v.toFixed(4));
  const at = [...S.eye, S.yaw, S.pitch, S.roll, ...S.tan].map(n).join(",");
  return `#${S.view ? "view=" + encodeURIComponent(S.view.name) + "&" : ""}at=${at}&light=${n(S.light)}&stops=${n(S.stops)}&show=${S.layer}&cut=${S.cut}`;
}

function fromAddress() {
  const given = new URLSearchParams(location.hash.slice(1)), number = (name, or) => (given.has(name) ? Number(given.get(name)) || 0 : or);
  document.body.classList.toggle("bare", given.has("bare"));
  const view = M.views.find((v) => v.name === given.get("view")), at = (given.get("at") || "").split(",").map(Number);
  if (view) look(view);
  else if (at.length === 10 && at.every(Number.isFinite)) {
    [S.eye, S.yaw, S.pitch, S.roll, S.tan] = [at.slice(0, 3), at[3], at[4], at[5], at.slice(6)];
    S.view = null;
  } else if (!S.started) {
    if (M.views.length) look(M.views[0]);
    else Object.assign(S, { eye: M.start.slice(), tan: [-1, 1, -0.7, 0.7] });
  }
  S.started = true;
  S.light = reduced(number("light", S.light), 0, M.lightings.length - 1);
  S.stops = reduced(number("stops", S.stops), -4, 4);
  S.layer = reduced(Math.round(number("show", S.layer)), 0, 5);
  S.cut = reduced(number("cut", S.cut), 0, 1000);
  controls();
}

let kept = 0;
function keep() {
  clearTimeout(kept);
  kept = setTimeout(() => {
    if (!document.body.classList.contains("bare")) history.replaceState(null, "", address());
  }, 400);
}

function listen() {
  const canvas = $("gl"), fingers = new Map();
  const set = (id, event, change) => $(id).addEventListener(event, () => {
    change($(id));
    controls();
    keep();
  });
  set("light", "input", (e) => (S.light = Number(e.value)));
  set("stops", "input", (e) => (S.stops = Number(e.value)));
  set("cut", "input", (e) => (S.cut = Number(e.value)));
  set("wipe", "input", () => 0);
  set("layer", "change", (e) => (S.layer = Number(e.value)));
  set("marks", "click", () => (S.marks = !S.marks));
  set("finds", "click", () => (S.finds = !S.finds));
  set("walk", "click", () => setOrbit(false));
  set("orbit", "click", () => setOrbit(true));
  set("tape", "click", () => setTape(!S.tape));
  set("view", "change", (e) => {
    const i = Number(e.value.slice(1));
    if (e.value[0] === "v") look(M.views[i]);
    if (e.value[0] === "f") goTo(M.findings[i]);
  });
  $("link").addEventListener("click", async () => {
    const link = location.href.split("#")[0] + address();
    try {
      await navigator.clipboard.writeText(link);
      tell(["The link to this very view is on the clipboard."]);
    } catch {
      tell(["Copy this link:", link]);
    }
  });
  const span = () => {
    const [a, b] = [...fingers.values()];
    return [Math.hypot(a.x - b.x, a.y - b.y), (a.x + b.x) / 2, (a.y + b.y) / 2];
  };
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, { x: e.offsetX, y: e.offsetY, way: 0 });
  });
  canvas.addEventListener("pointermove", (e) => {
    const finger = fingers.get(e.pointerId);
    if (!finger) return;
    const [dx, dy] = [e.offsetX - finger.x, e.offsetY - finger.y], step = M.size / 400;
    const before = fingers.size === 2 ? span() : null;
    Object.assign(finger, { x: e.offsetX, y: e.offsetY, way: finger.way + Math.hypot(dx, dy) });
    if (before) {
      const now = span();
      approach((now[0] - before[0]) * step);
      go((before[1] - now[1]) * step, 0, (now[2] - before[2]) * step);
    } else if (finger.way > 4) {
      const [l, r] = rim(), k = (S.orbit ? 1.6 : 1) * ((r - l) / canvas.clientWidth);
      turn(S.orbit ? dx * k : -dx * k, S.orbit ? -dy * k : dy * k);
    }
    keep();
  });
  const lift = (e) => {
    const finger = fingers.get(e.pointerId);
    fingers.delete(e.pointerId);
    if (finger && finger.way <= 4 && e.type === "pointerup") click(finger.x, finger.y);
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    approach((-Math.sign(e.deltaY) * M.size) / 60);
    keep();
  }, { passive: false });
  addEventListener("keydown", key);
  addEventListener("keyup", (e) => S.keys.delete(e.key.length === 1 ? e.key.toLowerCase() : e.key));
  addEventListener("blur", () => S.keys.clear());
  addEventListener("resize", () => (S.dirty = true));
  addEventListener("hashchange", fromAddress);
}

function goTo(f) {
  const view = M.views.find((v) => v.name === f.view);
  if (view) {
    look(view);
    $("wipe").value = 50;
  }
  tellFinding(f);
  controls();
}

function click(x, y) {
  $("gl").focus();
  if (S.tape) return measure(pick(x, y));
  const w = $("gl").clientWidth, h = $("gl").clientHeight;
  const near = (p) => p && Math.hypot(p[0] - x, p[1] - y) < 12;
  const found = S.finds && M.findings.find((f) => [f.position, ...f.points].some((p) => near(project(p, w, h))));
  if (found) goTo(found);
}

const WALK = { ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0], ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1],
  w: [0, 1, 0], s: [0, -1, 0], a: [-1, 0, 0], d: [1, 0, 0], e: [0, 0, 1], q: [0, 0, -1] };

function key(e) {
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  const name = e.key.length === 1 ? e.key.toLowerCase() : e.key, own = ["INPUT", "SELECT"].includes(e.target.tagName);
  if (own) return;
  if (WALK[name]) {
    S.keys.add(name);
    e.preventDefault();
  } else if (name >= "1" && name <= "9" && M.views[name - 1]) look(M.views[name - 1]);
  else if (name === "l") S.layer = (S.layer + 1) % LAYERS.length;
  else if (name === "t") setTape(!S.tape);
  else if (name === "o") setOrbit(!S.orbit);
  else if (name === "," || name === ".") S.light = reduced(Math.round(S.light + (name === "." ? 1 : -1)), 0, M.lightings.length - 1);
  else if (name === "+" || name === "=") S.stops = reduced(S.stops + 0.5, -4, 4);
  else if (name === "-") S.stops = reduced(S.stops - 0.5, -4, 4);
  else if (name === "Escape") setTape(false);
  else return;
  S.fast = e.shiftKey;
  controls();
  keep();
}

function options() {
  const option = (value, label) => Object.assign(document.createElement("option"), { value, textContent: label });
  const group = (label, all) => {
    const g = Object.assign(document.createElement("optgroup"), { label });
    g.append(...all);
    return g;
  };
  $("view").append(option("", "free"), group("Views", M.views.map((v, i) => option("v" + i, v.name))));
  if (M.findings.length) $("view").append(group("Findings", M.findings.map((f, i) => option("f" + i, `${f.id} ${f.what} (${f.view})`))));
  $("layer").append(...LAYERS.map((l, i) => option(i, l)));
  $("light").max = M.lightings.length - 1;
  $("lightrow").hidden = M.lightings.length < 2;
  $("finds").hidden = !M.findings.length;
  $("title").textContent = M.site;
  $("source").textContent = `${M.vertices} vertices, ${M.triangles} triangles; made with ${M.software}: ${M.command}`;
  $("pane").open = innerWidth > 640;
}

let last = 0;
function tick(now) {
  const seconds = Math.min(0.1, (now - last) / 1000);
  last = now;
  for (const name of S.keys) {
    const k = seconds * reduced(M.size / 12, 0.5, 4) * (S.fast ? 4 : 1);
    go(...WALK[name].map((v) => v * k));
    keep();
  }
  if (S.dirty) {
    // frames that follow each other tell how fast this machine is
    if (now - S.rough < 1000) S.pace += 0.3 * (now - S.rough - S.pace);
    // what was too slow once is not tried again
    if (S.pace > 60 && S.scale === 1) [S.scale, S.slow] = [0.5, true];
    else if (S.pace < 25 && !S.slow) S.scale = 1;
    S.dirty = false;
    S.rough = now;
    draw();
  } else if (S.rough && now - S.rough > 250) {
    S.rough = 0;
    draw(true);
  }
  requestAnimationFrame(tick);
}

async function start() {
  if (!gl) {
    return fail("This page draws the model with WebGL 2, which this browser or its graphics driver does not offer. Open it in a current Firefox, Chrome, Edge or Safari, or open the .glb file that “clerestory bake” writes in another viewer.");
  }
  if (!("DecompressionStream" in window)) return fail("This browser cannot unpack the model (DecompressionStream). Use one from 2023 or later.");
  try {
    await open();
    options();
    fromAddress();
    listen();
    $("wait").hidden = true;
    draw(true);
    window.viewer = { state: S, draw, ready: true, pick };
    requestAnimationFrame(tick);
  } catch (e) {
    fail(`The model cannot be shown: ${e.message}`);
  }
}
start();
