// ---- drawing ----

const each = (count, of) => Array.from({ length: count }, (_, k) => of(k)).join("");
/** With so many suns that cast shadows. */
const VERTEX = (suns) => `#version 300 es
layout(location=0) in vec3 at; layout(location=1) in vec2 uv; layout(location=2) in vec4 lightA;
layout(location=3) in vec4 lightB; layout(location=4) in vec4 info; layout(location=5) in vec3 tint;
${each(suns, (k) => `layout(location=${6 + k}) in vec4 adds${k}; uniform float share${k}; out vec3 sun${k};`)}
uniform mat4 matrix; uniform vec3 low, step; uniform float fade;
out vec3 place, e, colour; out vec2 st; flat out vec4 about;
vec3 rgbe(vec4 c) { return c.a == 0. ? vec3(0.) : (c.rgb + .5) * exp2(c.a - 136.); }
void main() {
  place = low + at * step; st = uv; about = info; colour = tint * tint * (tint * .305306011 + .682171111) + tint * .012522878;
  e = mix(rgbe(lightA), rgbe(lightB), fade);
  ${each(suns, (k) => `sun${k} = share${k} * rgbe(adds${k});`)}
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
const FRAGMENT = (layer, cut, keep, suns) => `#version 300 es
precision highp float; precision highp sampler2DShadow;
${each(suns, (k) => `in vec3 sun${k}; uniform mat4 towards${k}; uniform float off${k}; uniform sampler2DShadow shadow${k};`)}
in vec3 place, e, colour; in vec2 st; flat in vec4 about;
uniform sampler2D picture; uniform vec3 albedo, eye; uniform float cut, far; uniform vec3 palette[12];
out vec4 shown;
${keep ? KEEP : SHOW}
void main() {
  ${cut ? "if (place.z > cut) discard;" : ""}
  ${LOOK[layer] === LOOK[9] ? "" : "vec3 rho = albedo * colour * texture(picture, st).rgb, c = vec3(.35);"}
  ${layer === 1 || (layer > 2 && layer < 9) ? "vec3 n = normalize(cross(dFdx(place), dFdy(place))); float lamp = .55 + .45 * abs(dot(n, normalize(eye - place)));" : ""}
  vec3 total = e;
  ${suns ? "vec3 side = normalize(cross(dFdx(place), dFdy(place))); side *= sign(dot(side, eye - place));" : ""}
  ${each(suns, (k) => `if (sun${k} != vec3(0.)) total += sun${k} * textureLod(shadow${k}, (towards${k} * vec4(place + side * off${k}, 1.)).xyz, 0.);`)}
  ${LOOK[layer]}
  ${layer > 2 && layer < 9 ? "shown = vec4(srgb(c * c * lamp * (.75 + .5 * (dot(rho, vec3(.2126, .7152, .0722)) - .4))), 1.);" : ""}
}`;
// what each layer shows; 9 is how far a surface is, for picking
const LOOK = {
  0: "shown = vec4(show(rho * total * .318309886), 1.);",
  1: "shown = vec4(srgb(rho * lamp * (.85 + .15 * n.z)), 1.);",
  2: "shown = vec4(show(total * (.5 * .318309886)), 1.);",
  3: "int probe = int(about.g); c = probe == 255 ? vec3(.25) : palette[probe % 8];",
  4: "int kind = int(about.r) & 3; c = kind == 1 ? mix(palette[1], palette[4], about.b / 255.) : kind == 2 ? palette[3] : kind == 3 ? palette[6] : vec3(.2);",
  5: "c = palette[8 + min(int(about.r) >> 2, 3)];",
  9: "float d = clamp(length(place - eye) / far, 0., .999999) * 255.; vec3 c; c.r = floor(d); d = fract(d) * 255.; c.g = floor(d); c.b = floor(fract(d) * 255.); shown = vec4(c / 255., 1.);",
};
const SHADOW_VERTEX = `#version 300 es
layout(location=0) in vec3 at; uniform mat4 matrix; uniform vec3 low, step;
void main() { // what lies beyond the box casts its shadow all the same
  gl_Position = matrix * vec4(low + at * step, 1.); gl_Position.z = max(gl_Position.z, -1.);
}`;
const SHADOW_FRAGMENT = `#version 300 es
void main() {}`;
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
  shown = vec4(show(mix(rgbe(texture(skyA, uv)), rgbe(texture(skyB, uv)), fade)), ${keep ? 0 : 1});
}`;
/** Makes one pixel of 2 × 2 as a camera does, in linear light. A sample of sky with hardly any around it is a chink between two surfaces that meet. */
const MEAN_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D light; out vec4 shown;
${SHOW}
void main() {
  ivec2 at = 2 * ivec2(gl_FragCoord.xy);
  vec3 sum = vec3(0.);
  for (int k = 0; k < 4; k++) {
    ivec2 p = at + ivec2(k & 1, k >> 1);
    vec4 c = texelFetch(light, p, 0), around = vec4(0.);
    if (c.a < .5) {
      for (int n = 0; n < 4; n++) { vec4 b = texelFetch(light, p + ivec2(n < 2 ? 2 * n - 1 : 0, n < 2 ? 0 : 2 * n - 5), 0); around += b * b.a; }
      if (around.a > 2.5) c = around / around.a;
    }
    sum += c.rgb;
  }
  shown = vec4(show(.25 * sum), 1.);
}`;
// Okabe and Ito's colours, and the plan's: no station, one, two, three and more
const PALETTE = [
  [0.9, 0.62, 0], [0.84, 0.37, 0], [0.34, 0.71, 0.91], [0.94, 0.89, 0.26], [0, 0.45, 0.7], [0, 0.62, 0.45], [0.8, 0.47, 0.65], [0.95, 0.95, 0.95],
  [0.84, 0.37, 0], [0.94, 0.89, 0.26], [0.34, 0.71, 0.91], [0, 0.45, 0.7],
];
const LAYERS = ["Relit", "Neutral light", "Irradiance", "Which probe", "How sure", "Seen by how many"];
const css = (c) => `rgb(${c.map((v) => Math.round(255 * v)).join(" ")})`;
