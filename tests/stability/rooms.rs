//! Rows about relighting: small sites from file to picture. In a closed room where every direction has the same radiance
//! L, every relit surface shows L: a furnace.

use clerestory::scene::{Scene, Surface};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

use super::support::{Built, Plan, Quad, closed, grey, irradiance, options, relative_rmse, sides, v};
use super::ulp::{asked, nudge, shown};
use super::{Row, worst};

pub(crate) const HIGH: DVec3 = DVec3::new(4.0, 3.0, 2.5);

pub(crate) fn room(albedo: f64) -> Plan {
    let plan = Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(albedo)]);
    plan.probe(v(1.7, 1.4, 1.3), 64).view(v(0.3, 0.4, 1.6), v(3.5, 2.5, 0.8), 24)
}

/// With a panel whose back no probe sees, and a view of that back.
pub(crate) fn room_with_panel(albedo: f64) -> Plan {
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
    rows.push(threads());
    rows
}

/// The first view's radiance, relit with 16 cells, and what a unit in the last place of the light does to it.
fn picture(built: &Built) -> (Vec<f32>, f64) {
    asked(built, &options(16), |relit| shown(built, relit))
}

/// Albedo 0 and 1, fifteen decades, ill pixels.
fn extremes() -> Vec<Row> {
    let black = room(0.0);
    let (black, of_black) = picture(&black.build().furnace(&black, 3.0));
    let white = room(1.0);
    let (white, of_white) = picture(&white.build().furnace(&white, 3.0));

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
    let (decades, of_decades) = asked(&built, &options(16), |relit| {
        let side = |(Quad(corner, u, w, _), level): (&Quad, f32)| {
            let normal = u.cross(*w).normalize();
            let normal = if normal.dot(0.5 * HIGH - *corner) > 0.0 { normal } else { -normal };
            let at = |a: f64, b: f64| built.local(*corner + *u * a + *w * b);
            let e = [(0.25, 0.25), (0.5, 0.5), (0.6, 0.75)];
            e.map(|(a, b)| 0.5 * irradiance(relit, at(a, b), normal.as_vec3()).x / PI as f32 / level)
        };
        decades.quads.iter().zip(LEVELS).flat_map(side).collect()
    });

    // white, so that what has to come from the volume is L too
    let plan = room(1.0);
    let built = plan.build();
    let mut spoilt = built.look(0, 64, |_| Vec3::splat(2.0));
    let bad = [Vec3::NAN, Vec3::INFINITY, Vec3::splat(-5.0), Vec3::new(1.0, f32::NAN, 1.0), Vec3::splat(-1e9)];
    spoilt.pixels.iter_mut().enumerate().filter(|(i, _)| i * 31 % 7 == 0).for_each(|(i, p)| *p = bad[i % 5]);
    built.put(0, &spoilt);
    let (ill, of_ill) = picture(&built);

    // a third of the panorama shows no light at all: a tripod, a person, a lens cap
    let plan = room_with_panel(1.0);
    let built = plan.build();
    let mut covered = built.look(0, 64, |_| Vec3::splat(2.0));
    covered.pixels.iter_mut().enumerate().filter(|(i, _)| i % 64 < 21).for_each(|(_, p)| *p = Vec3::NAN);
    built.put(0, &covered);
    let (hidden, of_hidden) = picture(&built);
    vec![
        Row::new(
            "albedo 0 under light",
            "radiance of a black room",
            "0 (absolute)",
            black.into_iter().fold(0.0, f32::max),
            0.0,
        )
        .amplified(of_black),
        Row::new("albedo 1", "radiance of a white furnace", "L", worst(white, 3.0), 2e-3).amplified(of_white),
        Row::new(
            "10⁻⁶ to 10⁹ in one probe",
            "radiance inside each of six walls",
            "each wall's own L",
            worst(decades, 1.0),
            1e-3,
        )
        .amplified(of_decades),
        Row::new(
            "NaN, infinite and negative pixels, one in seven",
            "radiance of a furnace",
            "L",
            worst(ill, 2.0),
            0.05,
        )
        .amplified(of_ill),
        Row::new(
            "a third of a panorama is no light",
            "radiance of a furnace behind a panel",
            "L",
            worst(hidden, 2.0),
            0.02,
        )
        .amplified(of_hidden),
    ]
}

/// Far and small coordinates, the long room, broken triangles; one unit in the last place of light and geometry.
fn geometry() -> Vec<Row> {
    let plan = room_with_panel(0.5);
    let (clean, _) = picture(&plan.build().paint(&plan, gradient));
    let against = |plan: &Plan| {
        let (shown, amplification) = picture(&plan.build().paint(plan, gradient));
        (f64::from(relative_rmse(&shown, &clean)), amplification)
    };
    let mut far = plan.clone();
    far.offset = v(5e6, -5e6, 250.0);
    let mut millimetres = plan.clone();
    millimetres.metres_per_unit = 1e-3;
    let mut broken = plan.clone();
    let Quad(corner, u, w, _) = plan.quads[0];
    let more = [Quad(corner, u, DVec3::ZERO, 0), Quad(corner, u, u * 2.0, 0), plan.quads[2], plan.quads[6]];
    broken.quads.extend(more);
    broken.quads[0] = Quad(corner, w, u, 0);

    let mut nudged = plan.clone();
    for (i, q) in nudged.quads.iter_mut().enumerate() {
        q.0 *= f64::from(nudge(i));
    }
    nudged.probes[0].0 *= f64::from(nudge(1));

    let high = v(200.0, 2.0, 2.0);
    let mut quads = closed(DVec3::ZERO, high, 0);
    quads.push(Quad(v(20.0, 0.0, 0.0), DVec3::Y * 1.5, DVec3::Z * 2.0, 0));
    let long = Plan::new(quads, &[grey(1.0)])
        .probe(v(5.0, 1.0, 1.0), 256)
        .probe(v(40.0, 1.0, 1.0), 256)
        .view(v(30.0, 0.6, 1.0), v(20.0, 0.6, 1.0), 16)
        .view(v(2.0, 1.0, 1.0), v(199.0, 1.0, 1.0), 16);
    let built = long.build().furnace(&long, 2.0);
    let (of_long, amplified) = asked(&built, &options(64), |relit| shown(&built, relit));
    let [far, millimetres, broken, nudged] = [far, millimetres, broken, nudged].map(|plan| against(&plan));
    vec![
        Row::new(
            "coordinates at 5·10⁶ m",
            "picture with records and volume",
            "the same room at the origin, RMS",
            far.0,
            1e-3,
        )
        .amplified(far.1),
        Row::new("a model in millimetres", "the same picture", "the same room in metres, RMS", millimetres.0, 1e-3)
            .amplified(millimetres.1),
        Row::new(
            "zero-area, duplicated, inside-out triangles",
            "the same picture",
            "the clean room, RMS",
            broken.0,
            1e-3,
        )
        .amplified(broken.1),
        Row::new("corners moved by one ulp", "the same picture", "the unmoved room, RMS", nudged.0, 1e-2)
            .amplified(nudged.0 / f64::from(f32::EPSILON)),
        Row::new("a room of 200 × 2 × 2 m", "radiance of a furnace, seen and unseen", "L", worst(of_long, 2.0), 0.05)
            .amplified(amplified),
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
    let (alone, _) = picture(&one.build().paint(&one, gradient));
    let twice = room(0.5).probe(v(1.7, 1.4, 1.3), 64);
    let (twice, of_twice) = picture(&twice.build().paint(&twice, gradient));
    let beside = room(0.5).probe(v(1.7 + 1e-6, 1.4, 1.3), 64);
    let (beside, of_beside) = picture(&beside.build().paint(&beside, gradient));
    vec![
        Row::new(
            "a probe on, in or behind a wall",
            "share of pixels off by 1 % where a good probe sees",
            "0 (absolute)",
            off,
            0.02,
        )
        .counted(),
        Row::new(
            "two probes in one place",
            "picture of coinciding records",
            "the picture of one, RMS",
            relative_rmse(&twice, &alone),
            1e-5,
        )
        .amplified(of_twice),
        Row::new(
            "two probes 1 µm apart",
            "picture of records at 1 µm spacing",
            "the picture of one, RMS",
            relative_rmse(&beside, &alone),
            1e-4,
        )
        .amplified(of_beside),
    ]
}

/// Sums run in a fixed order, whoever does them.
fn threads() -> Row {
    let plan = room_with_panel(0.5);
    let built = plan.build().paint(&plan, gradient);
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| built.picture())
    });
    let differ = one.iter().zip(&three).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    Row::new(
        "one thread and three",
        "pixels of a picture with records and volume that differ in any bit",
        "0 (absolute)",
        differ as f64,
        0.0,
    )
    .counted()
}
