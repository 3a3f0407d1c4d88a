/** The camera's axes: right, up, forward. */
function axes() {
  const [sy, cy, sp, cp] = [Math.sin(S.yaw), Math.cos(S.yaw), Math.sin(S.pitch), Math.cos(S.pitch)];
  const forward = [sy * cp, cy * cp, sp], level = [cy, -sy, 0], above = cross(level, forward);
  const [sr, cr] = [Math.sin(S.roll), Math.cos(S.roll)];
  return [add(level.map((v) => v * cr), above, -sr), add(above.map((v) => v * cr), level, sr), forward];
}

/** Tangents of the canvas's left, right, lower and upper rim, so that all of the view's picture fits in. */
function rim() {
  const [l, r, b, t] = S.tan, aspect = $("gl").clientWidth / Math.max(1, $("gl").clientHeight);
  const wide = Math.max(1, (aspect * (t - b)) / (r - l)), tall = Math.max(1, (r - l) / (aspect * (t - b)));
  const x = (l + r) / 2, y = (b + t) / 2, w = ((r - l) / 2) * wide, h = ((t - b) / 2) * tall;
  return [x - w, x + w, y - h, y + h];
}

function matrix([l, r, b, t]) {
  const [right, up, forward] = axes(), near = M.size * 2e-4, far = M.size * 4;
  const p = [[2 / (r - l), 0, -(r + l) / (r - l)], [0, 2 / (t - b), -(t + b) / (t - b)]];
  const rows = p.map(([x, y, z]) => add(add(right.map((v) => v * x), up, y), forward, z));
  const d = (far + near) / (far - near), all = [...rows, forward.map((v) => v * d), forward];
  const shift = all.map((row) => -dot(row, S.eye));
  shift[2] -= (2 * far * near) / (far - near);
  const m = new Float32Array(16);
  for (let i = 0; i < 4; i++) {
    for (let j = 0; j < 3; j++) m[4 * j + i] = all[i][j];
    m[12 + i] = shift[i];
  }
  return m;
}

const cutAt = () => (S.cut >= 1000 ? 1e9 : M.low[2] + (M.high[2] - M.low[2]) * (S.cut / 1000));

/** The two lightings beside where the slider stands, and how far it is from the first. */
function lightings() {
  const first = Math.min(Math.floor(S.light), M.lightings.length - 1), second = Math.min(first + 1, M.lightings.length - 1);
  return [first, second, S.light - first];
}

function exposure() {
  const [a, b, fade] = lightings(), of = S.base || M.lightings.map((l) => l.exposure);
  return Math.exp((1 - fade) * Math.log(of[a]) + fade * Math.log(of[b])) * 2 ** S.stops;
}

/** The program of a layer; one that cuts nothing lets hidden surfaces go unpainted. */
function model(layer, keep, suns) {
  const name = `${layer}${S.cut < 1000}${keep}${suns}`;
  if (!G.models.has(name)) G.models.set(name, program(VERTEX(suns), FRAGMENT(layer, S.cut < 1000, keep, suns)));
  return G.models.get(name);
}

/** The runs of triangles that may be seen, the nearest first. */
function seen([l, r, b, t], runs) {
  const [right, up, forward] = axes();
  const sides = [add(right, forward, -l), add(forward.map((v) => v * r), right, -1), add(up, forward, -b), add(forward.map((v) => v * t), up, -1), forward];
  const shifts = sides.map((side) => dot(side, S.eye)), found = [];
  for (const m of runs) {
    const inside = sides.every((side, k) => side.reduce((sum, v, c) => sum + v * (v > 0 ? m.high[c] : m.low[c]), 0) >= shifts[k]);
    if (inside) found.push([m.low.reduce((sum, v, c) => sum + Math.max(v - S.eye[c], 0, S.eye[c] - m.high[c]) ** 2, 0), m]);
  }
  return found.sort((p, q) => p[0] - q[0]).map((f) => f[1]);
}

/** Lightings whose sun casts shadows in a layer, and how much of each there is. */
function suns(layer) {
  const [a, b, fade] = lightings();
  return [[a, 1 - fade], [b, fade]].filter(([l, share]) => share > 0 && G.suns[l] && [0, 2].includes(layer));
}

/** What the sun of a lighting sees of all triangles, those left out of pictures too: depths, and the matrix that leads to them. */
function shadow(l) {
  if (G.shadows[l]) return G.shadows[l];
  const size = Math.min(4096, gl.getParameter(gl.MAX_TEXTURE_SIZE)), sun = M.lightings[l].sun;
  const level = cross(Math.abs(sun[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], sun).map((v, _, all) => v / norm(all));
  // each axis with the least and the most of the model's box along it
  const sides = [level, cross(sun, level), sun].map((axis) => {
    const reach = (most) => axis.reduce((sum, v, c) => sum + v * (v > 0 === most ? M.high[c] : M.low[c]), 0);
    return [axis, reach(false), reach(true)];
  });
  const m = new Float32Array(16);
  sides.forEach(([axis, low, high], i) => {
    const turned = i === 2 ? -1 : 1;
    for (let c = 0; c < 3; c++) m[4 * c + i] = (turned * 2 * axis[c]) / (high - low);
    m[12 + i] = (-turned * (high + low)) / (high - low);
  });
  m[15] = 1;
  const depths = gl.createTexture(), frame = gl.createFramebuffer();
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, depths);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, size, size);
  for (const [name, value] of [["MIN_FILTER", gl.LINEAR], ["MAG_FILTER", gl.LINEAR], ["WRAP_S", gl.CLAMP_TO_EDGE], ["WRAP_T", gl.CLAMP_TO_EDGE], ["COMPARE_MODE", gl.COMPARE_REF_TO_TEXTURE], ["COMPARE_FUNC", gl.LEQUAL]]) {
    gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], value);
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depths, 0);
  gl.drawBuffers([gl.NONE]);
  gl.viewport(0, 0, size, size);
  gl.clear(gl.DEPTH_BUFFER_BIT);
  gl.bindVertexArray(G.vao);
  gl.useProgram(G.shadow.p);
  gl.uniformMatrix4fv(G.shadow.at.matrix, false, m);
  gl.uniform3fv(G.shadow.at.low, M.low);
  gl.uniform3fv(G.shadow.at.step, M.step);
  gl.enable(gl.DEPTH_TEST);
  gl.disable(gl.CULL_FACE);
  // what casts shadows a little nearer to the sun, what receives them farther off it: no light where walls meet, none missing
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(-0.5, -2);
  const coarse = M.coarse.reduce((sum, m) => sum + m.count, 0);
  gl.drawElements(gl.TRIANGLES, 3 * (coarse || M.triangles), gl.UNSIGNED_INT, coarse ? 12 * M.triangles : 0);
  gl.bindVertexArray(G.hiddenVao);
  gl.drawArrays(gl.TRIANGLES, 0, G.hidden);
  gl.disable(gl.POLYGON_OFFSET_FILL);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
  const wide = Math.max(sides[0][2] - sides[0][1], sides[1][2] - sides[1][1]);
  // from −1 … 1 to the texture's 0 … 1
  const towards = m.map((v, k) => (k % 4 < 3 ? 0.5 * v + (k > 11 ? 0.5 : 0) : v));
  return (G.shadows[l] = { depths, towards, off: (2 * wide) / size });
}

function paint(layer, tan, keep = false, coarse = false) {
  const [a, b, fade] = lightings(), sunny = suns(layer), { p, at: u } = model(layer, keep, sunny.length);
  gl.bindVertexArray(G.vao);
  const slots = [[2, G.lights[a]], [3, G.lights[b]], ...sunny.map(([l], k) => [6 + k, G.suns[l]])];
  for (const [slot, of] of slots) {
    gl.bindBuffer(gl.ARRAY_BUFFER, of);
    gl.enableVertexAttribArray(slot);
    gl.vertexAttribPointer(slot, 4, gl.UNSIGNED_BYTE, false, 4, 0);
  }
  gl.useProgram(p);
  sunny.forEach(([l, share], k) => {
    const { depths, towards, off } = shadow(l);
    gl.activeTexture(gl.TEXTURE2 + k);
    gl.bindTexture(gl.TEXTURE_2D, depths);
    gl.uniform1i(u["shadow" + k], 2 + k);
    gl.uniform1f(u["share" + k], share);
    gl.uniform1f(u["off" + k], off);
    gl.uniformMatrix4fv(u["towards" + k], false, towards);
  });
  gl.uniformMatrix4fv(u.matrix, false, matrix(tan));
  gl.uniform3fv(u.low, M.low);
  gl.uniform3fv(u.step, M.step);
  gl.uniform1f(u.fade, fade);
  gl.uniform1f(u.exposure, exposure());
  gl.uniform3fv(u.eye, S.eye);
  gl.uniform1f(u.cut, cutAt());
  gl.uniform1f(u.far, M.size * 4);
  gl.uniform3fv(u.palette, PALETTE.flat());
  gl.uniform1i(u.picture, 0);
  gl.activeTexture(gl.TEXTURE0);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.CULL_FACE);
  let last = null;
  for (const m of seen(tan, coarse && M.coarse.length ? M.coarse : M.materials)) {
    if (!last || last.picture !== m.picture || last.albedo.some((v, c) => v !== m.albedo[c])) {
      gl.bindTexture(gl.TEXTURE_2D, m.picture < 0 ? G.white : G.pictures[m.picture]);
      gl.uniform3fv(u.albedo, m.albedo);
      last = m;
    }
    gl.drawElements(gl.TRIANGLES, 3 * m.count, gl.UNSIGNED_INT, 12 * m.first);
  }
  if (layer === 9) return;
  const { p: sky, at: v } = G.sky[Number(keep)], [right, up, forward] = axes(), [l, r, bottom, t] = tan;
  gl.useProgram(sky);
  gl.disable(gl.CULL_FACE);
  gl.depthFunc(gl.LEQUAL);
  const middle = add(add(forward, right, (l + r) / 2), up, (bottom + t) / 2);
  gl.uniformMatrix3fv(v.rays, false, [...right.map((x) => (x * (r - l)) / 2), ...up.map((x) => (x * (t - bottom)) / 2), ...middle]);
  gl.uniform1f(v.fade, fade);
  gl.uniform1f(v.exposure, exposure());
  gl.uniform1i(v.layer, layer);
  [a, b].forEach((of, k) => {
    gl.activeTexture(gl.TEXTURE0 + k);
    gl.bindTexture(gl.TEXTURE_2D, G.skies[of]);
  });
  gl.uniform1i(v.skyA, 0);
  gl.uniform1i(v.skyB, 1);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  gl.depthFunc(gl.LESS);
}

/** The picture of light of twice the size, made where it is not there yet. */
function lightMap(w, h) {
  if (G.map && G.map.w === w && G.map.h === h) return G.map;
  if (G.map) {
    gl.deleteTexture(G.map.light);
    gl.deleteRenderbuffer(G.map.depth);
    gl.deleteFramebuffer(G.map.frame);
  }
  G.map = { w, h, light: gl.createTexture(), depth: gl.createRenderbuffer(), frame: gl.createFramebuffer() };
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, G.map.light);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, 2 * w, 2 * h);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  gl.bindRenderbuffer(gl.RENDERBUFFER, G.map.depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, 2 * w, 2 * h);
  gl.bindFramebuffer(gl.FRAMEBUFFER, G.map.frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, G.map.light, 0);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, G.map.depth);
  return G.map;
}

/** Draws relit surfaces at twice the size and takes means in linear light. */
function paintFine(w, h) {
  const map = lightMap(w, h);
  gl.bindFramebuffer(gl.FRAMEBUFFER, map.frame);
  gl.viewport(0, 0, 2 * w, 2 * h);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  paint(S.layer, rim(), true);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.viewport(0, 0, w, h);
  gl.useProgram(G.mean.p);
  gl.disable(gl.DEPTH_TEST);
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, map.light);
  gl.uniform1i(G.mean.at.light, 0);
  gl.uniform1f(G.mean.at.exposure, 1);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}

/** The most pixels that are drawn at twice the size. */
const FINE = 4e6;

/** Draws; `fine` once nothing moves: then each pixel is the mean of four, as cameras and `render` make them; a slow machine draws fewer triangles and pixels before. */
function draw(fine = false) {
  const canvas = $("gl"), device = window.devicePixelRatio || 1;
  const mean = fine && G.mean && [0, 2].includes(S.layer) && canvas.clientWidth * canvas.clientHeight * device ** 2 <= FINE;
  const scale = device * (mean ? 1 : fine ? (soft ? 2 : 1) : S.scale);
  if (soft && G.fine !== fine) {
    for (const t of G.pictures) {
      gl.bindTexture(gl.TEXTURE_2D, t);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, fine ? gl.LINEAR_MIPMAP_LINEAR : gl.LINEAR_MIPMAP_NEAREST);
      sharpen(fine);
    }
    G.fine = fine;
  }
  suns(S.layer).forEach(([l]) => shadow(l));
  const [w, h] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
  for (const c of [canvas, $("over")]) if (c.width !== w || c.height !== h) [c.width, c.height] = [w, h];
  if (mean) paintFine(w, h);
  else {
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, w, h);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    paint(S.layer, rim(), false, !fine && S.scale < 1);
  }
  overlay(w, h, scale);
}

/** What lies under a place of the canvas (CSS pixels), or null. */
function pick(x, y) {
  const [l, r, b, t] = rim(), w = $("gl").clientWidth, h = $("gl").clientHeight;
  const tx = l + ((r - l) * x) / w, ty = t - ((t - b) * y) / h, e = (0.5 * (r - l)) / w;
  gl.bindFramebuffer(gl.FRAMEBUFFER, G.pick);
  gl.viewport(0, 0, 1, 1);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  paint(9, [tx - e, tx + e, ty - e, ty + e]);
  const c = new Uint8Array(4);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, c);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  S.dirty = true;
  if (c[3] === 0) return null;
  const [right, up, forward] = axes(), d = add(add(forward, right, tx), up, ty);
  return add(S.eye, d, ((c[0] + (c[1] + (c[2] + 0.5) / 255) / 255) / 255) * M.size * 4 / norm(d));
}

