"use strict";
// The viewer of one baked site. M (what there is), B (the data blocks' lengths) and P (progress) are set by the page's head.
const $ = (id) => document.getElementById(id);
/** Whether pictures are drawn by the processor: then smoothing and sharp textures wait until nothing moves. */
const soft = (() => {
  const test = document.createElement("canvas").getContext("webgl2"), about = test && test.getExtension("WEBGL_debug_renderer_info");
  const name = about ? String(test.getParameter(about.UNMASKED_RENDERER_WEBGL)) : "";
  if (test) test.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
})();
const gl = $("gl").getContext("webgl2", { antialias: !soft, alpha: false, powerPreference: "high-performance" });
const ink = $("over").getContext("2d");
const reduced = (v, low, high) => Math.min(high, Math.max(low, v));
const add = (a, b, k = 1) => [a[0] + b[0] * k, a[1] + b[1] * k, a[2] + b[2] * k];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.sqrt(dot(a, a));
const metres = (v) => (v < 10 ? v.toFixed(3) : v.toFixed(2)) + " m";

// ---- data: base64, inflated, byte planes, differences ----

function fail(text) {
  $("wait").hidden = false;
  $("bar").hidden = true;
  $("says").textContent = text;
}

async function block(i) {
  const element = $("b" + i);
  const text = atob(element.textContent);
  element.remove();
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  if (B[i].kind !== "deflate") return new Blob([bytes], { type: B[i].kind });
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Numbers of so many bytes each whose bytes lie in planes, the highest first. */
function planes(bytes, from, count, wide) {
  const all = new Uint32Array(count);
  for (let p = 0; p < wide; p++) {
    const at = from + p * count;
    for (let k = 0; k < count; k++) all[k] = (all[k] << 8) | bytes[at + k];
  }
  return all;
}

/** Sums up differences: 0, −1, 1, −2, … as 0, 1, 2, 3, …. */
function summed(codes, wide) {
  const mask = wide === 4 ? 0xffffffff : 2 ** (8 * wide) - 1;
  let last = 0;
  for (let k = 0; k < codes.length; k++) {
    last = (last + ((codes[k] >>> 1) ^ -(codes[k] & 1))) & mask;
    codes[k] = last;
  }
  return codes;
}

/** Indices, as how far they are below the first that has not been named yet. */
function indices(bytes, count) {
  const codes = planes(bytes, 0, count, 4);
  let next = 0;
  for (let k = 0; k < count; k++) {
    const code = codes[k];
    codes[k] = next - code;
    if (code === 0) next++;
  }
  return codes;
}

/** Bytes a vertex, from planes of differences. */
function interleaved(bytes, count, wide) {
  const all = new Uint8Array(count * wide);
  for (let p = 0; p < wide; p++) {
    let last = 0;
    for (let k = 0; k < count; k++) {
      last = (last + bytes[p * count + k]) & 255;
      all[k * wide + p] = last;
    }
  }
  return all;
}

// ---- drawing ----

const VERTEX = `#version 300 es
layout(location=0) in vec3 at; layout(location=1) in vec2 uv; layout(location=2) in vec4 lightA;
layout(location=3) in vec4 lightB; layout(location=4) in vec4 info; layout(location=5) in vec3 tint;
uniform mat4 matrix; uniform vec3 low, step; uniform float fade;
out vec3 place, e, colour; out vec2 st; flat out vec4 about;
vec3 rgbe(vec4 c) { return c.a == 0. ? vec3(0.) : (c.rgb + .5) * exp2(c.a - 136.); }
void main() {
  place = low + at * step; st = uv; about = info; colour = tint * tint * (tint * .305306011 + .682171111) + tint * .012522878;
  e = mix(rgbe(lightA), rgbe(lightB), fade);
  gl_Position = matrix * vec4(place, 1.);
}`;
const SRGB = `
uniform float exposure;
vec3 srgb(vec3 c) { // within half a code of sRGB's curve by square roots, which are fast everywhere
  vec3 a = sqrt(max(c, vec3(0.))), b = sqrt(a), d = sqrt(b);
  return mix(12.92 * c, .662002687 * a + .684122060 * b - .323583601 * d - .0225411470 * c, step(.0031308, c));
}`;
const SHOW = `${SRGB}
vec3 show(vec3 radiance) {
  vec3 c = radiance * exposure; float peak = max(c.r, max(c.g, c.b));
  if (peak > .8) { float over = (peak - .8) / .2; c *= (.8 + .2 * over / (1. + over)) / peak; }
  return srgb(c);
}`;
/** Light as it is, for a picture of which several pixels become one before it is shown. */
const KEEP = `${SRGB}
vec3 show(vec3 radiance) { return min(radiance * exposure, vec3(6e4)); }`;
const FRAGMENT = (layer, cut, keep) => `#version 300 es
precision highp float;
in vec3 place, e, colour; in vec2 st; flat in vec4 about;
uniform sampler2D picture; uniform vec3 albedo, eye; uniform float cut, far; uniform vec3 palette[12];
out vec4 shown;
${keep ? KEEP : SHOW}
void main() {
  ${cut ? "if (place.z > cut) discard;" : ""}
  ${LOOK[layer] === LOOK[9] ? "" : "vec3 rho = albedo * colour * texture(picture, st).rgb, c = vec3(.35);"}
  ${layer === 1 || (layer > 2 && layer < 9) ? "vec3 n = normalize(cross(dFdx(place), dFdy(place))); float lamp = .55 + .45 * abs(dot(n, normalize(eye - place)));" : ""}
  ${LOOK[layer]}
  ${layer > 2 && layer < 9 ? "shown = vec4(srgb(c * c * lamp * (.75 + .5 * (dot(rho, vec3(.2126, .7152, .0722)) - .4))), 1.);" : ""}
}`;
// what each layer shows; 9 is how far a surface is, for picking
const LOOK = {
  0: "shown = vec4(show(rho * e * .318309886), 1.);",
  1: "shown = vec4(srgb(rho * lamp * (.85 + .15 * n.z)), 1.);",
  2: "shown = vec4(show(e * (.5 * .318309886)), 1.);",
  3: "int probe = int(about.g); c = probe == 255 ? vec3(.25) : palette[probe % 8];",
  4: "int kind = int(about.r) & 3; c = kind == 1 ? mix(palette[1], palette[4], about.b / 255.) : kind == 2 ? palette[3] : kind == 3 ? palette[6] : vec3(.2);",
  5: "c = palette[8 + min(int(about.r) >> 2, 3)];",
  9: "float d = clamp(length(place - eye) / far, 0., .999999) * 255.; vec3 c; c.r = floor(d); d = fract(d) * 255.; c.g = floor(d); c.b = floor(fract(d) * 255.); shown = vec4(c / 255., 1.);",
};
const SKY_VERTEX = `#version 300 es
out vec2 at; void main() { at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4. - 1.; gl_Position = vec4(at, 1., 1.); }`;
const SKY_FRAGMENT = (keep) => `#version 300 es
precision highp float;
in vec2 at; uniform mat3 rays; uniform sampler2D skyA, skyB; uniform float fade; uniform int layer; out vec4 shown;
${keep ? KEEP : SHOW}
vec3 rgbe(vec4 c) { c *= 255.; return c.a < .5 ? vec3(0.) : (c.rgb + .5) * exp2(c.a - 136.); }
void main() {
  if (layer != 0) { shown = vec4(.09, .094, .11, 1.); return; }
  vec3 d = normalize(rays * vec3(at, 1.));
  vec2 uv = vec2(atan(d.x, d.y) / 6.28318531 + .5, acos(clamp(d.z, -1., 1.)) / 3.14159265);
  shown = vec4(show(mix(rgbe(texture(skyA, uv)), rgbe(texture(skyB, uv)), fade)), 1.);
}`;
/** Makes one pixel of 2 × 2 as a camera does, in linear light. */
const MEAN_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D light; out vec4 shown;
${SHOW}
void main() {
  ivec2 at = 2 * ivec2(gl_FragCoord.xy);
  vec3 sum = vec3(0.);
  for (int k = 0; k < 4; k++) sum += texelFetch(light, at + ivec2(k & 1, k >> 1), 0).rgb;
  shown = vec4(show(.25 * sum), 1.);
}`;
// Okabe and Ito's colours, and the plan's: no station, one, two, three and more
const PALETTE = [
  [0.9, 0.62, 0], [0.84, 0.37, 0], [0.34, 0.71, 0.91], [0.94, 0.89, 0.26], [0, 0.45, 0.7], [0, 0.62, 0.45], [0.8, 0.47, 0.65], [0.95, 0.95, 0.95],
  [0.84, 0.37, 0], [0.94, 0.89, 0.26], [0.34, 0.71, 0.91], [0, 0.45, 0.7],
];
const LAYERS = ["Relit", "Neutral light", "Irradiance", "Which probe", "How sure", "Seen by how many"];
const css = (c) => `rgb(${c.map((v) => Math.round(255 * v)).join(" ")})`;

function program(vertex, fragment) {
  const p = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(p, shader);
  }
  gl.linkProgram(p);
  if (!gl.getProgramParameter(p, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(p) || "a shader does not link");
  const found = {};
  for (let i = gl.getProgramParameter(p, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
    const name = gl.getActiveUniform(p, i).name;
    found[name.replace("[0]", "")] = gl.getUniformLocation(p, name);
  }
  return { p, at: found };
}

const G = { lights: [], skies: [], pictures: [] };
const S = { eye: [0, 0, 0], yaw: 0, pitch: 0, roll: 0, tan: [-1, 1, -0.7, 0.7], view: null, light: 0, stops: 0, layer: 0, cut: 1000,
  base: null, orbit: false, pivot: null, tape: false, points: [], marks: true, finds: true, keys: new Set(), dirty: true, told: null, scale: 1, pace: 40, rough: 0 };

function buffer(data, target = gl.ARRAY_BUFFER) {
  const b = gl.createBuffer();
  gl.bindBuffer(target, b);
  gl.bufferData(target, data, gl.STATIC_DRAW);
  return b;
}

/** Whether the picture that is bound shall stay sharp where it is seen from aside. */
function sharpen(on) {
  const sharp = gl.getExtension("EXT_texture_filter_anisotropic");
  if (sharp) gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, on ? 8 : 1);
}

function texture(source, width, height) {
  const t = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, t);
  if (width) {
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, source);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    return t;
  }
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, source);
  gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  sharpen(!soft);
  return t;
}

async function open() {
  let done = 0;
  const next = async () => {
    const data = await block(done++);
    $("bar").value = 0.5 + (0.5 * done) / B.length;
    $("says").textContent = "Unpacking …";
    await new Promise((go) => setTimeout(go));
    return data;
  };
  const n = M.vertices;
  const vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  let bytes = await next();
  const at = new Uint16Array(4 * n);
  for (let c = 0; c < 3; c++) summed(planes(bytes, 2 * n * c, n, 2), 2).forEach((v, k) => (at[4 * k + c] = v));
  buffer(at);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, false, 8, 0);
  buffer(indices(await next(), 3 * M.triangles), gl.ELEMENT_ARRAY_BUFFER);
  bytes = await next();
  buffer(interleaved(bytes, n, 4));
  gl.enableVertexAttribArray(4);
  gl.vertexAttribPointer(4, 4, gl.UNSIGNED_BYTE, false, 4, 0);
  if (M.uv) {
    bytes = await next();
    const uv = new Float32Array(2 * n);
    for (let c = 0; c < 2; c++) {
      summed(planes(bytes, 3 * n * c, n, 3), 3).forEach((v, k) => (uv[2 * k + c] = M.uv[c] + v * M.uv[2]));
    }
    buffer(uv);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 8, 0);
  }
  gl.vertexAttrib3f(5, 1, 1, 1);
  if (M.tinted) {
    const tint = interleaved(await next(), n, 4);
    buffer(tint);
    gl.enableVertexAttribArray(5);
    gl.vertexAttribPointer(5, 3, gl.UNSIGNED_BYTE, true, 4, 0);
  }
  for (let l = 0; l < M.lightings.length; l++) {
    G.lights.push(buffer(interleaved(await next(), n, 4)));
    G.skies.push(texture(interleaved(await next(), M.sky[0] * M.sky[1], 4), ...M.sky));
  }
  for (const wrap of M.pictures) {
    G.pictures.push(texture(await createImageBitmap(await next(), { imageOrientation: "flipY", colorSpaceConversion: "none", premultiplyAlpha: "none" })));
    [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T].forEach((side, k) => gl.texParameteri(gl.TEXTURE_2D, side, wrap[k]));
  }
  G.white = texture(new Uint8Array([255, 255, 255, 255]), 1, 1);
  for (const view of M.views) if (view.photo) view.photo = URL.createObjectURL(await next());
  G.vao = vao;
  G.models = new Map();
  G.sky = [false, true].map((keep) => program(SKY_VERTEX, SKY_FRAGMENT(keep)));
  if (gl.getExtension("EXT_color_buffer_float")) G.mean = program(SKY_VERTEX, MEAN_FRAGMENT);
  G.pick = gl.createFramebuffer();
  const dot = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, dot);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  const depth = gl.createRenderbuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, 1, 1);
  gl.bindFramebuffer(gl.FRAMEBUFFER, G.pick);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, dot, 0);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
}

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
function model(layer, keep) {
  const name = `${layer}${S.cut < 1000}${keep}`;
  if (!G.models.has(name)) G.models.set(name, program(VERTEX, FRAGMENT(layer, S.cut < 1000, keep)));
  return G.models.get(name);
}

/** The runs of triangles that may be seen, the nearest first. */
function seen([l, r, b, t]) {
  const [right, up, forward] = axes();
  const sides = [add(right, forward, -l), add(forward.map((v) => v * r), right, -1), add(up, forward, -b), add(forward.map((v) => v * t), up, -1), forward];
  const shifts = sides.map((side) => dot(side, S.eye)), found = [];
  for (const m of M.materials) {
    const inside = sides.every((side, k) => side.reduce((sum, v, c) => sum + v * (v > 0 ? m.high[c] : m.low[c]), 0) >= shifts[k]);
    if (inside) found.push([m.low.reduce((sum, v, c) => sum + Math.max(v - S.eye[c], 0, S.eye[c] - m.high[c]) ** 2, 0), m]);
  }
  return found.sort((p, q) => p[0] - q[0]).map((f) => f[1]);
}

function paint(layer, tan, keep = false) {
  const [a, b, fade] = lightings(), { p, at: u } = model(layer, keep);
  gl.bindVertexArray(G.vao);
  for (const [slot, of] of [[2, a], [3, b]]) {
    gl.bindBuffer(gl.ARRAY_BUFFER, G.lights[of]);
    gl.enableVertexAttribArray(slot);
    gl.vertexAttribPointer(slot, 4, gl.UNSIGNED_BYTE, false, 4, 0);
  }
  gl.useProgram(p);
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
  for (const m of seen(tan)) {
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

/** Draws; `fine` once nothing moves: then each pixel is the mean of four, as cameras and `render` make them; a slow machine draws coarsely before. */
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
  const [w, h] = [Math.round(canvas.clientWidth * scale), Math.round(canvas.clientHeight * scale)];
  for (const c of [canvas, $("over")]) if (c.width !== w || c.height !== h) [c.width, c.height] = [w, h];
  if (mean) paintFine(w, h);
  else {
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, w, h);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    paint(S.layer, rim());
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
    if (S.pace > 60) S.scale = 0.5;
    else if (S.pace < 25) S.scale = 1;
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
