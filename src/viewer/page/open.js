
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

const G = { lights: [], suns: [], shadows: [], skies: [], pictures: [] };
const S = { eye: [0, 0, 0], yaw: 0, pitch: 0, roll: 0, tan: [-1, 1, -0.7, 0.7], view: null, light: 0, stops: 0, layer: 0, cut: 1000,
  base: null, orbit: false, pivot: null, tape: false, points: [], marks: true, finds: true, keys: new Set(), dirty: true, told: null, scale: soft ? 0.5 : 1, pace: 40, rough: 0 };

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
  const fine = indices(await next(), 3 * M.triangles);
  bytes = await next();
  const corners = new Uint32Array(fine.length + bytes.length / 4);
  corners.set(fine);
  corners.set(summed(planes(bytes, 0, bytes.length / 4, 4), 4), fine.length);
  buffer(corners, gl.ELEMENT_ARRAY_BUFFER);
  bytes = await next();
  buffer(interleaved(bytes, n, 4));
  gl.enableVertexAttribArray(4);
  gl.vertexAttribPointer(4, 4, gl.UNSIGNED_BYTE, false, 4, 0);
  bytes = await next();
  G.hidden = bytes.length / 12;
  const hidden = new Float32Array(3 * G.hidden);
  for (let c = 0; c < 3; c++) summed(planes(bytes, 4 * G.hidden * c, G.hidden, 4), 4).forEach((v, k) => (hidden[3 * k + c] = v | 0));
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
    G.suns.push(M.lightings[l].sun && buffer(interleaved(await next(), n, 4)));
  }
  for (const wrap of M.pictures) {
    G.pictures.push(texture(await createImageBitmap(await next(), { imageOrientation: "flipY", colorSpaceConversion: "none", premultiplyAlpha: "none" })));
    [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T].forEach((side, k) => gl.texParameteri(gl.TEXTURE_2D, side, wrap[k]));
  }
  G.white = texture(new Uint8Array([255, 255, 255, 255]), 1, 1);
  for (const view of M.views) if (view.photo) view.photo = URL.createObjectURL(await next());
  G.vao = vao;
  G.hiddenVao = gl.createVertexArray();
  gl.bindVertexArray(G.hiddenVao);
  buffer(hidden);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
  G.models = new Map();
  G.shadow = program(SHADOW_VERTEX, SHADOW_FRAGMENT);
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

