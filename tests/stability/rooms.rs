//! Rows about relighting: small sites from file to picture. In a closed room where every direction has the same radiance
//! L, every relit surface shows L: a furnace.

use clerestory::panorama::Picture;
use clerestory::render::Relit;
use clerestory::scene::{Scene, Surface};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

use super::support::{Built, Plan, Quad, assert_finite, closed, grey, irradiance, options, relative_rmse, sides, v};
use super::{Row, worst};

const HIGH: DVec3 = DVec3::new(4.0, 3.0, 2.5);

fn room(albedo: f64) -> Plan {
    let plan = Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(albedo)]);
    plan.probe(v(1.7, 1.4, 1.3), 64).view(v(0.3, 0.4, 1.6), v(3.5, 2.5, 0.8), 24)
}

/// With a panel whose back no probe sees, and a view of that back.
fn room_with_panel(albedo: f64) -> Plan {
    let mut plan = room(albedo);
    plan.quads.push(Quad(v(2.8, 0.8, 0.6), DVec3::Y * 1.2, DVec3::Z * 1.2, 0));
    plan.views = vec![(v(3.7, 2.6, 1.75), v(1.5, 0.5, 0.75), 24)];
    plan
}

/// Light that differs from place to place, so that a shift would show.
fn gradient(scene: &Scene, s: Option<&Surface>) -> Vec3 {
    s.map_or(Vec3::ZERO, |s| {
        let (low, high) = scene.mesh.bounds();
        let p = (s.position - low) / (high - low);
        Vec3::splat(1.0 + 4.0 * p.x + 2.0 * p.y * p.z)
    })
}

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = extremes();
    rows.extend(geometry());
    rows.extend(probes());
    rows.push(walls_a_millimetre_apart());
    rows.extend(sun_patch());
    rows.extend(one_pixel());
    rows.push(side_chamber());
    rows.push(nothing_there());
    rows
}

/// Albedo 0 and 1, fifteen decades, ill pixels.
fn extremes() -> Vec<Row> {
    let black = room(0.0);
    let black = black.build().furnace(&black, 3.0).picture();
    let white = room(1.0);
    let white = white.build().furnace(&white, 3.0).picture();

    let mut decades = room(0.5);
    decades.quads = sides(DVec3::ZERO, HIGH, [0, 1, 2, 3, 4, 5]);
    decades.probes[0].1 = 256;
    decades.paints = vec![grey(0.5); 6];
    const LEVELS: [f32; 6] = [1.0, 30.0, 1e-3, 1e3, 1e-6, 1e9];
    let built = decades.build().paint(&decades, |scene, s| {
        let level = |name: &str| LEVELS[name[1..].parse::<usize>().unwrap()];
        let material = |s: &Surface| &scene.materials[scene.mesh.materials[s.triangle as usize] as usize];
        s.map_or(Vec3::ZERO, |s| Vec3::splat(level(&material(s).name)))
    });
    let of_decades = built.relit(&options(16), |relit| {
        let side = |(Quad(corner, u, w, _), level): (&Quad, f32)| {
            let normal = u.cross(*w).normalize();
            let normal = if normal.dot(0.5 * HIGH - *corner) > 0.0 { normal } else { -normal };
            let at = |a: f64, b: f64| built.local(*corner + *u * a + *w * b);
            let e =
                [(0.25, 0.25), (0.5, 0.5), (0.6, 0.75)].map(|(a, b)| irradiance(relit, at(a, b), normal.as_vec3()).x);
            worst(e.map(|e| 0.5 * e / PI as f32), level)
        };
        decades.quads.iter().zip(LEVELS).map(side).fold(0.0, f64::max)
    });

    // white, so that what has to come from the volume is L too
    let plan = room(1.0);
    let built = plan.build();
    let mut picture = built.look(0, 64, |_| Vec3::splat(2.0));
    let bad = [Vec3::NAN, Vec3::INFINITY, Vec3::splat(-5.0), Vec3::new(1.0, f32::NAN, 1.0), Vec3::splat(-1e9)];
    picture.pixels.iter_mut().enumerate().filter(|(i, _)| i * 31 % 7 == 0).for_each(|(i, p)| *p = bad[i % 5]);
    built.put(0, &picture);
    let ill = worst(built.picture(), 2.0);
    vec![
        Row::new(
            "albedo 0 under light",
            "radiance of a black room",
            "0 (absolute)",
            black.into_iter().fold(0.0, f32::max),
            0.0,
        ),
        Row::new("albedo 1", "radiance of a white furnace", "L", worst(white, 3.0), 2e-3),
        Row::new(
            "10⁻⁶ to 10⁹ in one probe",
            "radiance inside each of six walls",
            "each wall's own L",
            of_decades,
            1e-3,
        ),
        Row::new("NaN, infinite and negative pixels, one in seven", "radiance of a furnace", "L", ill, 0.05),
    ]
}

/// Far and small coordinates, the long room, broken triangles; one unit in the last place of light and geometry.
fn geometry() -> Vec<Row> {
    let plan = room_with_panel(0.5);
    let near = plan.build().paint(&plan, gradient);
    let clean = near.picture();
    let against = |plan: &Plan| f64::from(relative_rmse(&plan.build().paint(plan, gradient).picture(), &clean));
    let mut far = plan.clone();
    far.offset = v(5e6, -5e6, 250.0);
    let mut millimetres = plan.clone();
    millimetres.metres_per_unit = 1e-3;
    let mut broken = plan.clone();
    let Quad(corner, u, w, _) = plan.quads[0];
    let more = [Quad(corner, u, DVec3::ZERO, 0), Quad(corner, u, u * 2.0, 0), plan.quads[2], plan.quads[6]];
    broken.quads.extend(more);
    broken.quads[0] = Quad(corner, w, u, 0);

    // each input up or down by one unit in its last place, by turns
    let nudge = |i: usize| 1.0 + if i.is_multiple_of(3) { f32::EPSILON } else { -0.5 * f32::EPSILON };
    let lit = near.look(0, 64, |s| gradient(&near.scene, s));
    let mut moved = lit.clone();
    moved.pixels.iter_mut().enumerate().for_each(|(i, p)| *p *= nudge(i));
    near.put(0, &moved);
    let of_light = f64::from(relative_rmse(&near.picture(), &clean)) / f64::from(f32::EPSILON);
    let mut nudged = plan.clone();
    for (i, q) in nudged.quads.iter_mut().enumerate() {
        q.0 *= f64::from(nudge(i));
    }
    nudged.probes[0].0 *= f64::from(nudge(1));
    let of_geometry = against(&nudged) / f64::from(f32::EPSILON);

    let high = v(200.0, 2.0, 2.0);
    let mut quads = closed(DVec3::ZERO, high, 0);
    quads.push(Quad(v(20.0, 0.0, 0.0), DVec3::Y * 1.5, DVec3::Z * 2.0, 0));
    let long = Plan::new(quads, &[grey(1.0)])
        .probe(v(5.0, 1.0, 1.0), 256)
        .probe(v(40.0, 1.0, 1.0), 256)
        .view(v(30.0, 0.6, 1.0), v(20.0, 0.6, 1.0), 16)
        .view(v(2.0, 1.0, 1.0), v(199.0, 1.0, 1.0), 16);
    let frames = long.build().furnace(&long, 2.0).frames(&options(64));
    frames.iter().for_each(assert_finite);
    let of_long = worst(frames.iter().flat_map(|f| f.radiance.pixels.iter().map(|p| p.x)), 2.0);
    vec![
        Row::new(
            "coordinates at 5·10⁶ m",
            "picture with records and volume",
            "the same room at the origin, RMS",
            against(&far),
            1e-3,
        ),
        Row::new(
            "a model in millimetres",
            "the same picture",
            "the same room in metres, RMS",
            against(&millimetres),
            1e-3,
        )
        .amplified(of_light),
        Row::new(
            "zero-area, duplicated, inside-out triangles",
            "the same picture",
            "the clean room, RMS",
            against(&broken),
            1e-3,
        ),
        Row::new(
            "corners moved by one ulp",
            "the same picture",
            "the unmoved room, RMS",
            of_geometry * f64::from(f32::EPSILON),
            1e-2,
        )
        .amplified(of_geometry),
        Row::new("a room of 200 × 2 × 2 m", "radiance of a furnace, seen and unseen", "L", of_long, 0.05),
    ]
}

/// Probes on, in and behind walls; probes and records that coincide.
fn probes() -> Vec<Row> {
    let mut off = 0.0f64;
    for at in [v(0.0, 1.4, 1.3), v(1e-6, 1.4, 1.3), v(-1e-6, 1.4, 1.3), v(-0.05, 1.4, 1.3), v(-2.0, 1.4, 1.3)] {
        let mut plan = room(0.5).probe(at, 32);
        plan.quads.extend(closed(DVec3::splat(-0.1), HIGH + 0.1, 0));
        let built = plan.build();
        built.put(0, &built.look(0, 64, |_| Vec3::splat(2.0)));
        let inside = |p: DVec3| p.cmpge(DVec3::splat(-1e-4)).all() && p.cmple(HIGH + 1e-4).all();
        let seen = |s: &Surface| inside(s.position.as_dvec3() + built.scene.origin);
        built.put(1, &built.look(1, 32, |s| Vec3::splat(if s.is_some_and(seen) { 2.0 } else { 0.0 })));
        let shown = built.picture();
        let wrong = shown.iter().filter(|l| (*l / 2.0 - 1.0).abs() > 0.01).count();
        off = off.max(wrong as f64 / shown.len() as f64);
    }
    let one = room(0.5);
    let picture = one.build().paint(&one, gradient).picture();
    let twice = room(0.5).probe(v(1.7, 1.4, 1.3), 64);
    let twice = twice.build().paint(&twice, gradient).picture();
    let beside = room(0.5).probe(v(1.7 + 1e-6, 1.4, 1.3), 64);
    let beside = beside.build().paint(&beside, gradient).picture();
    vec![
        Row::new(
            "a probe on, in or behind a wall",
            "share of pixels off by 1 % where a good probe sees",
            "0 (absolute)",
            off,
            0.02,
        ),
        Row::new(
            "two probes in one place",
            "picture of coinciding records",
            "the picture of one, RMS",
            relative_rmse(&twice, &picture),
            1e-5,
        ),
        Row::new(
            "two probes 1 µm apart",
            "picture of records at 1 µm spacing",
            "the picture of one, RMS",
            relative_rmse(&beside, &picture),
            1e-4,
        ),
    ]
}

/// Two rooms, one of radiance 1 and one of 1000, behind walls 1 mm apart that are not quite parallel.
fn walls_a_millimetre_apart() -> Row {
    let mut quads = closed(DVec3::ZERO, v(2.0, 3.0, 2.5), 0);
    quads.extend(closed(v(2.001, 0.0, 0.0), v(4.0, 3.0, 2.5), 0));
    // turned by 0.1 mm over its height
    quads[5] = Quad(v(2.0, 0.0, 0.0), v(0.0, 3.0, 0.0), v(1e-4, 0.0, 2.5), 0);
    let plan = Plan::new(quads, &[grey(0.5)])
        .probe(v(1.0, 1.5, 1.25), 64)
        .probe(v(3.0, 1.5, 1.25), 64)
        .view(v(0.3, 1.5, 1.2), v(2.0, 1.4, 1.2), 24)
        .view(v(3.7, 1.5, 1.2), v(2.0, 1.4, 1.2), 24);
    let built = plan.build();
    for (probe, level) in [1.0, 1000.0].into_iter().enumerate() {
        built.put(probe, &built.look(probe, 64, |_| Vec3::splat(level)));
    }
    // a probe's pixel is 10 cm wide there; closer to the wall than a tenth of that, a floor that runs on is not told apart
    let error = built.relit(&options(16), |relit| {
        let side = |x: f64, inward: f64, level: f32| {
            let wall = [(0.7, 0.9), (1.5, 1.2), (2.2, 2.0)]
                .map(|(y, z)| (v(x + inward * 4e-5 * z, y, z), Vec3::X * inward as f32));
            let floor = [(0.7, 0.03), (1.5, 0.1), (2.2, 0.5)].map(|(y, d)| (v(x + inward * d, y, 0.0), Vec3::Z));
            let at = |(p, n): (DVec3, Vec3)| 0.5 * irradiance(relit, built.local(p), n).x / PI as f32;
            worst(wall.into_iter().chain(floor).map(at), level)
        };
        side(2.0, -1.0, 1.0).max(side(2.001, 1.0, 1000.0))
    });
    Row::new(
        "walls 1 mm apart, turned by 0.1 mm",
        "radiance of wall and floor on either side, 1 and 1000, from 3 cm off on",
        "its own side's L",
        error,
        2e-3,
    )
}

/// Irradiance at `point` with normal `n` from a floor rectangle of radiance 1, by Gauss–Legendre in double precision.
fn from_floor([x0, x1, y0, y1]: [f64; 4], point: DVec3, n: DVec3) -> f64 {
    let steps = 400;
    let mut sum = 0.0;
    for i in 0..steps * steps {
        let at = |k: usize, low: f64, high: f64| low + (high - low) * (k as f64 + 0.5) / steps as f64;
        let d = v(at(i % steps, x0, x1), at(i / steps, y0, y1), 0.0) - point;
        let r2 = d.length_squared();
        sum += n.dot(d).max(0.0) * -d.z / (r2 * r2);
    }
    sum * (x1 - x0) * (y1 - y0) / (steps * steps) as f64
}

/// A patch 10⁶ times as bright as its surroundings, inside one volume cell with shadow: what no probe sees is lit by it
/// as a form factor says, and the shadow beside it keeps its own light.
fn sun_patch() -> Vec<Row> {
    const PATCH: [f64; 4] = [3.1, 3.4, 1.2, 1.5];
    const BRIGHT: f32 = 1e6;
    let mut plan = room_with_panel(0.01);
    plan.probes[0] = (v(1.7, 1.4, 2.3), 512);
    // the panel hangs lower, so that the probe sees the patch over it
    plan.quads[6] = Quad(v(2.8, 0.8, 0.3), DVec3::Y * 1.2, DVec3::Z * 0.6, 0);
    plan.quads[6].0 = v(2.45, 0.8, 0.3);
    let built = plan.build().paint(&plan, |scene, s| {
        let bright = |p: DVec3| p.z < 1e-3 && p.x > PATCH[0] && p.x < PATCH[1] && p.y > PATCH[2] && p.y < PATCH[3];
        s.map_or(Vec3::ZERO, |s| Vec3::splat(if bright(s.position.as_dvec3() + scene.origin) { BRIGHT } else { 1.0 }))
    });
    let behind = |relit: &Relit| {
        let off = [(1.1, 0.5), (1.4, 0.6), (1.7, 0.75)].map(|(y, z)| {
            let point = v(2.45, y, z);
            let e = irradiance(relit, built.local(point), Vec3::X).x;
            let expected = f64::from(BRIGHT) * from_floor(PATCH, point, DVec3::X);
            (f64::from(e) / expected - 1.0).abs()
        });
        off.into_iter().fold(0.0, f64::max)
    };
    // the patch lights the panel from half a metre: its light is far from even over one cell of the volume
    let mut many = options(64);
    many.volume.rays = 2048;
    let fine = built.relit(&many, behind);
    built.relit(&options(8), |relit| {
        let beside = [v(3.2, 1.0, 0.0), v(3.2, 1.7, 0.0), v(3.6, 1.35, 0.0)];
        let shadow = beside.map(|p| irradiance(relit, built.local(p), Vec3::Z).x * 0.01 / PI as f32);
        let title = "sun patch 10⁶ brighter than the shadow in its cell";
        let expected = "double-precision form factor";
        vec![
            Row::new(title, "irradiance behind a panel, from the patch, cells of 50 cm", expected, behind(relit), 0.6),
            Row::new("the same patch", "the same, cells of 6 cm, 2048 rays", expected, fine, 0.1),
            Row::new(
                "the same patch",
                "radiance in the shadow 20 cm beside it, same cell",
                "the shadow's own L",
                worst(shadow, 1.0),
                2e-3,
            ),
        ]
    })
}

/// A probe with 99 % of its energy in one pixel.
fn one_pixel() -> Vec<Row> {
    let plan = room(0.5);
    let built = plan.build();
    let mut picture = Picture::new(64, 32);
    picture.pixels.fill(Vec3::ONE);
    let solid_angle = |row: usize| (PI * (row as f64 + 0.5) / 32.0).sin();
    let total: f64 = (0..32).map(|row| 64.0 * solid_angle(row)).sum();
    // 99 times the rest; it falls on the ceiling's middle, which the view does not show
    let at = 3;
    picture.pixels[at * 64 + 20] = Vec3::splat((99.0 * (total - solid_angle(at)) / solid_angle(at)) as f32);
    built.put(0, &picture);
    let mut shown = built.picture();
    shown.sort_by(f32::total_cmp);
    // the view's pixels but those within the bright pixel's footprint
    let far = shown[..shown.len() * 9 / 10].iter().copied();
    vec![Row::new(
        "one pixel with 99 % of a probe's energy",
        "radiance of nine tenths of a view, away from it",
        "L",
        worst(far, 1.0),
        2e-3,
    )]
}

/// A white side chamber that no probe sees but for its door: its light is the sum of a series that converges slowly.
fn side_chamber() -> Row {
    // the door is 0.5 × 1 m of the chamber's 24 m²
    let mut quads = closed(DVec3::ZERO, HIGH, 0);
    quads.remove(5);
    let (x, top) = (HIGH.x, HIGH.z);
    quads.extend([
        Quad(v(x, 0.0, 0.0), DVec3::Y * 2.5, DVec3::Z * top, 0),
        Quad(v(x, 2.5, 1.0), DVec3::Y * 0.5, DVec3::Z * (top - 1.0), 0),
    ]);
    let mut chamber = closed(v(x, 1.0, 0.0), v(x + 2.0, 3.0, 2.0), 0);
    chamber.remove(4);
    quads.extend(chamber);
    let plan = Plan::new(quads, &[grey(0.999)]).probe(v(0.5, 0.5, 1.5), 128).view(
        v(x + 0.3, 1.2, 1.0),
        v(x + 2.0, 2.0, 1.0),
        16,
    );
    let built: Built = plan.build().furnace(&plan, 2.0);
    let frames = built.frames(&options(32));
    frames.iter().for_each(assert_finite);
    let shown = worst(frames[0].radiance.pixels.iter().map(|p| p.x), 2.0);
    Row::new("unseen chamber of albedo 0.999 behind a door", "radiance of a furnace by exchange", "L", shown, 0.2)
}

/// No window, no texture, no photograph: the plain room has none of them, and no probe is a typed error.
fn nothing_there() -> Row {
    let plan = room(0.5);
    let built = plan.build().furnace(&plan, 2.0);
    let none = clerestory::render::Options { probes: 0, ..options(8) };
    let refused = clerestory::render::prepare(&built.site, &built.scene, &[], &none).is_err();
    let error = if refused { worst(built.picture(), 2.0) } else { 1.0 };
    Row::new("no window, texture, photograph; no probe", "a furnace; a typed error", "L; the error", error, 2e-3)
}
