// ---- names, findings, the tape ----

/** A point's place on the canvas in device pixels, or null where it is behind. */
function project(p, w, h) {
  const [l, r, b, t] = rim(), [right, up, forward] = axes(), d = add(p, S.eye, -1), z = dot(d, forward);
  if (z < M.size * 2e-4) return null;
  return [(w * (dot(d, right) / z - l)) / (r - l), (h * (t - dot(d, up) / z)) / (t - b), z];
}

function text(words, x, y, scale, colour) {
  ink.font = `${13 * scale}px "DejaVu Sans", Verdana, sans-serif`;
  ink.lineWidth = 4 * scale;
  ink.strokeStyle = "#000";
  ink.lineJoin = "round";
  ink.strokeText(words, x, y);
  ink.fillStyle = colour;
  ink.fillText(words, x, y);
}

function overlay(w, h, scale) {
  ink.clearRect(0, 0, w, h);
  const places = (all) => all.map((m) => [m, project(m.position, w, h)]).filter(([, p]) => p);
  if (S.finds) {
    for (const f of M.findings) {
      ink.fillStyle = f.kind === "texture" ? "#56b4e9" : "#ff7a1a";
      for (const point of f.points) {
        const p = project(point, w, h);
        if (p) ink.fillRect(p[0] - 1.5 * scale, p[1] - 1.5 * scale, 3 * scale, 3 * scale);
      }
    }
    for (const [f, p] of places(M.findings)) text(f.id, p[0], p[1], scale, f === S.told ? "#ffb000" : "#fff");
  }
  if (S.marks) {
    for (const [all, corners] of [[M.probes, 12], [M.stations, 3]]) {
      for (const [m, [x, y]] of places(all)) {
        ink.beginPath();
        for (let k = 0; k <= corners; k++) {
          const a = (2 * Math.PI * k) / corners - Math.PI / 2;
          ink.lineTo(x + 6 * scale * Math.cos(a), y + 6 * scale * Math.sin(a));
        }
        ink.fillStyle = corners === 3 ? "#009e73" : "#ffb000";
        ink.fill();
        ink.lineWidth = 2 * scale;
        ink.strokeStyle = "#000";
        ink.stroke();
        text(m.name, x + 10 * scale, y + 4 * scale, scale, "#fff");
      }
    }
  }
  const ends = S.points.map((p) => project(p, w, h)).filter((p) => p);
  ink.strokeStyle = ink.fillStyle = "#ffb000";
  ink.lineWidth = 2.5 * scale;
  for (const p of ends) {
    ink.beginPath();
    ink.arc(p[0], p[1], 4 * scale, 0, 7);
    ink.fill();
  }
  if (ends.length === 2) {
    ink.beginPath();
    ends.forEach((p) => ink.lineTo(p[0], p[1]));
    ink.stroke();
    const way = add(S.points[1], S.points[0], -1);
    text(metres(norm(way)), (ends[0][0] + ends[1][0]) / 2 + 8 * scale, (ends[0][1] + ends[1][1]) / 2, scale, "#ffb000");
  }
  const view = S.view, photo = $("photo");
  photo.hidden = !(view && view.photo && Number($("wipe").value) > 0);
  if (photo.hidden) return;
  const [l, r, b, t] = rim(), [vl, vr, vb, vt] = S.tan, [cw, ch] = [w / scale, h / scale];
  photo.style.left = `${(cw * (vl - l)) / (r - l)}px`;
  photo.style.top = `${(ch * (t - vt)) / (t - b)}px`;
  photo.style.width = `${(cw * (vr - vl)) / (r - l)}px`;
  photo.style.height = `${(ch * (vt - vb)) / (t - b)}px`;
  const x = (w * (vl + ((vr - vl) * Number($("wipe").value)) / 100 - l)) / (r - l);
  ink.fillStyle = "#fff";
  ink.fillRect(x - scale, 0, 2 * scale, h);
  photo.style.clipPath = `inset(0 ${100 - Number($("wipe").value)}% 0 0)`;
}

function tell(lines, finding = null) {
  S.told = finding;
  $("words").hidden = lines.length === 0;
  $("words").replaceChildren(...lines.map((line) => Object.assign(document.createElement("p"), { textContent: line })));
  S.dirty = true;
}

function tellFinding(f) {
  tell([`${f.id}: ${f.kind}, ${f.what} (score ${f.score.toFixed(2)})`, f.words, `In the view “${f.view}”: move the photograph's slider to compare.`].filter(Boolean), f);
}

function measure(p) {
  if (!p) return tell(["There is no surface there."]);
  S.points = S.points.length === 1 ? [S.points[0], p] : [p];
  if (S.points.length === 1) return tell(["Now the other end."]);
  const way = add(S.points[1], S.points[0], -1);
  tell([`${metres(norm(way))}; level ${metres(Math.hypot(way[0], way[1]))}, up ${metres(Math.abs(way[2]))}`]);
}

