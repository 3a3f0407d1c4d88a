// Baked triangles as linear radiance, the sky behind them, what the sun sees, and pixels as means of samples.

struct Frame {
    // a point relative to the eye → clip coordinates: x, y, w; z is the nearest distance, so that depth is nearest ÷ distance
    clip_x: vec3f, nearest: f32,
    clip_y: vec3f, samples: f32, // along a pixel's side
    clip_w: vec3f, far_off: f32, // how far off its surface a point asks for the sun, m
    eye: vec3f,
    // direction of the corner of the first sample, and what one sample to the right and down adds to it
    corner: vec3f,
    right: vec3f,
    down: vec3f,
    // a place → what the sun sees: across, up, depth, each 0..1
    sun_x: vec4f,
    sun_y: vec4f,
    sun_z: vec4f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var sky: texture_2d<f32>;
@group(0) @binding(2) var shadow: texture_depth_2d;
@group(0) @binding(3) var nearer: sampler_comparison;
@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var filtered: sampler;

override TEXTURED = true;
override SUN = false;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) place: vec3f, // relative to the eye
    @location(1) uv: vec2f,
    @location(2) reflectance: vec3f, // albedo ÷ π
    @location(3) irradiance: vec3f,
    @location(4) sunlight: vec3f,
}

@vertex
fn corner(
    @location(0) at: vec3f, @location(1) uv: vec2f, @location(2) reflectance: vec3f, @location(3) irradiance: vec3f,
    @location(4) sunlight: vec3f
) -> Corner {
    return Corner(in_picture(at), at - frame.eye, uv, reflectance, irradiance, sunlight);
}

fn in_picture(at: vec3f) -> vec4f {
    let p = at - frame.eye;
    return vec4f(dot(frame.clip_x, p), dot(frame.clip_y, p), frame.nearest, dot(frame.clip_w, p));
}

@fragment
fn radiance(in: Corner) -> @location(0) vec4f {
    let right = bounded(dpdx(in.uv));
    let down = bounded(dpdy(in.uv));
    let side = cross(dpdx(in.place), dpdy(in.place));
    var e = in.irradiance;
    if SUN {
        e += in.sunlight * sun_share(in.place, side);
    }
    var reflectance = in.reflectance;
    if TEXTURED {
        reflectance *= patch_mean(in.uv, right, down);
    }
    return vec4f(reflectance * e, 1.0);
}

// A way in the picture; none where a triangle that the eye stands in has none.
fn bounded(way: vec2f) -> vec2f {
    return select(vec2f(), way, dot(way, way) < 1e9);
}

// The picture's mean over a parallelogram, as `Texture::patch` has it: bilinear in the level whose texels are about half its
// shorter side wide, over places one and a half texels apart.
fn patch_mean(uv: vec2f, right: vec2f, down: vec2f) -> vec3f {
    let size = vec2f(textureDimensions(picture));
    let across = length(right * size);
    let along = length(down * size);
    let wide = max(0.6 * min(across, along), max(across, along) / 16.0);
    let most = f32(textureNumLevels(picture) - 1u);
    let level = clamp(floor(log2(max(wide * 1.41421356, 1.0))), 0.0, most);
    let apart = 1.5 * exp2(level);
    let columns = floor(clamp(across / apart + 0.5, 1.0, 16.0));
    let rows = floor(clamp(along / apart + 0.5, 1.0, 16.0));
    var sum = vec3f();
    for (var j = 0.5; j < rows; j += 1.0) {
        for (var i = 0.5; i < columns; i += 1.0) {
            let at = uv + right * (i / columns - 0.5) + down * (j / rows - 0.5);
            sum += textureSampleLevel(picture, filtered, at, level).rgb;
        }
    }
    return sum / (columns * rows);
}

// How much of the sun reaches a place; `side` is along its normal, on either side.
fn sun_share(place: vec3f, side: vec3f) -> f32 {
    let normal = normalize(side) * -sign(dot(side, place));
    let at = vec4f(place + frame.eye + normal * frame.far_off, 1.0);
    let seen = vec2f(dot(frame.sun_x, at), dot(frame.sun_y, at));
    return textureSampleCompareLevel(shadow, nearer, seen, dot(frame.sun_z, at));
}

@vertex
fn whole_picture(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    // one triangle over all of it, infinitely far away
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn sky_radiance(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let d = frame.corner + frame.right * at.x + frame.down * at.y;
    let size = vec2f(textureDimensions(sky));
    let across = (atan2(d.x, d.y) / 6.28318531 + 0.5) * size.x - 0.5;
    let along = atan2(length(d.xy), d.z) / 3.14159265 * size.y - 0.5;
    let x = i32(floor(across));
    let y = i32(floor(along));
    let above = mix(sky_cell(x, y), sky_cell(x + 1, y), fract(across));
    let below = mix(sky_cell(x, y + 1), sky_cell(x + 1, y + 1), fract(across));
    return vec4f(mix(above, below, fract(along)), 1.0);
}

// A cell of the sky; columns go on all around, and beyond a pole lies the other side of its row.
fn sky_cell(column: i32, row: i32) -> vec3f {
    let size = vec2i(textureDimensions(sky));
    var at = vec2i(column, row);
    if row < 0 {
        at = vec2i(column + size.x / 2, -1 - row);
    } else if row >= size.y {
        at = vec2i(column + size.x / 2, 2 * size.y - 1 - row);
    }
    at.x = (at.x + size.x) % size.x;
    return textureLoad(sky, at, 0).rgb;
}

// What the sun sees: depths alone.
@vertex
fn sun_corner(@location(0) at: vec3f) -> @builtin(position) vec4f {
    let p = vec4f(at, 1.0);
    // from 0..1, downwards, to clip coordinates
    let far = max(dot(frame.sun_z, p), 0.0); // what lies beyond the box casts its shadow all the same
    return vec4f(2.0 * dot(frame.sun_x, p) - 1.0, 1.0 - 2.0 * dot(frame.sun_y, p), far, 1.0);
}

@group(1) @binding(0) var light: texture_2d<f32>;

// A pixel as the mean of its samples.
@fragment
fn mean(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let side = i32(frame.samples);
    let first = vec2i(at.xy) * side;
    var sum = vec3f();
    for (var y = 0; y < side; y++) {
        for (var x = 0; x < side; x++) {
            sum += textureLoad(light, first + vec2i(x, y), 0).rgb;
        }
    }
    return vec4f(sum / (frame.samples * frame.samples), 1.0);
}
