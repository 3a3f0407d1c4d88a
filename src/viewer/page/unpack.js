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

