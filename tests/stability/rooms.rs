//! Rows about relighting: small sites from file to picture. In a closed room where every direction has the same radiance
//! L, every relit surface shows L: a furnace.

use glam::{DVec3, Vec3};

use super::support::{
    Built, Decades, Plan, Quad, gradient, long_low_room, on_threads, options, relative_rmse, room, room_with_panel,
    room_with_probe_at_wall, share_off_2, v,
};
use super::ulp::{asked, nudge, shown};
use super::{Row, worst};

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

    let decades = Decades::new();
    let shares = [(0.25, 0.25), (0.5, 0.5), (0.6, 0.75)];
    let (decades, of_decades) = asked(&decades.built, &options(16), |relit| decades.shown(relit, &shares));

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
        Row::new("albedo 0 under light", "radiance of a black room", "0 (absolute)")
            .off(black.into_iter().fold(0.0, f32::max), 0.0)
            .amplified(of_black),
        Row::new("albedo 1", "radiance of a white furnace", "L").off(worst(white, 3.0), 2e-3).amplified(of_white),
        Row::new("10⁻⁶ to 10⁹ in one probe", "radiance inside each of six walls", "each wall's own L")
            .off(worst(decades, 1.0), 1e-3)
            .amplified(of_decades),
        Row::new("NaN, infinite and negative pixels, one in seven", "radiance of a furnace", "L")
            .off(worst(ill, 2.0), 0.05)
            .amplified(of_ill),
        Row::new("a third of a panorama is no light", "radiance of a furnace behind a panel", "L")
            .off(worst(hidden, 2.0), 0.02)
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

    let long = long_low_room();
    let built = long.build().furnace(&long, 2.0);
    let (of_long, amplified) = asked(&built, &options(64), |relit| shown(&built, relit));
    let [far, millimetres, broken, nudged] = [far, millimetres, broken, nudged].map(|plan| against(&plan));
    vec![
        Row::new("coordinates at 5·10⁶ m", "picture with records and volume", "the same room at the origin, RMS")
            .off(far.0, 1e-3)
            .amplified(far.1),
        Row::new("a model in millimetres", "the same picture", "the same room in metres, RMS")
            .off(millimetres.0, 1e-3)
            .amplified(millimetres.1),
        Row::new("zero-area, duplicated, inside-out triangles", "the same picture", "the clean room, RMS")
            .off(broken.0, 1e-3)
            .amplified(broken.1),
        Row::new("corners moved by one ulp", "the same picture", "the unmoved room, RMS")
            .off(nudged.0, 1e-2)
            .amplified(nudged.0 / f64::from(f32::EPSILON)),
        Row::new("a room of 200 × 2 × 2 m", "radiance of a furnace, seen and unseen", "L")
            .off(worst(of_long, 2.0), 0.05)
            .amplified(amplified),
    ]
}

/// Probes on, in and behind walls; probes and records that coincide.
fn probes() -> Vec<Row> {
    let mut off = 0.0f64;
    for at in [v(0.0, 1.4, 1.3), v(1e-6, 1.4, 1.3), v(-1e-6, 1.4, 1.3), v(-0.05, 1.4, 1.3), v(-2.0, 1.4, 1.3)] {
        off = off.max(share_off_2(&room_with_probe_at_wall(at).1.picture()));
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
        )
        .off(off, 0.02)
        .counted(),
        Row::new("two probes in one place", "picture of coinciding records", "the picture of one, RMS")
            .off(relative_rmse(&twice, &alone), 1e-5)
            .amplified(of_twice),
        Row::new("two probes 1 µm apart", "picture of records at 1 µm spacing", "the picture of one, RMS")
            .off(relative_rmse(&beside, &alone), 1e-4)
            .amplified(of_beside),
    ]
}

/// Sums run in a fixed order, whoever does them.
fn threads() -> Row {
    let plan = room_with_panel(0.5);
    let built = plan.build().paint(&plan, gradient);
    let [one, three] = [1, 3].map(|threads| on_threads(threads, || built.picture()));
    let differ = one.iter().zip(&three).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    Row::new(
        "one thread and three",
        "pixels of a picture with records and volume that differ in any bit",
        "0 (absolute)",
    )
    .off(differ as f64, 0.0)
    .counted()
}
