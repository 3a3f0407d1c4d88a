//! Rows about light that is stiff: thin walls, sun patches, one bright pixel, a chamber that hardly absorbs.

use clerestory::panorama::Picture;
use clerestory::render::Options;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

use super::support::{HIGH, Plan, Quad, closed, grey, irradiance, options, room, room_with_panel, v};
use super::ulp::{asked, shown};
use super::{Row, worst};

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = vec![walls_a_millimetre_apart()];
    rows.extend(sun_patch());
    rows.push(one_pixel());
    rows.push(side_chamber());
    rows.extend(nothing_there());
    rows
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
    // a probe's pixel is 10 cm wide there: the floor is asked from a thousandth of that from its wall on
    let (values, amplification) = asked(&built, &options(16), |relit| {
        let side = |x: f64, inward: f64, level: f32| {
            let wall = [(0.7, 0.9), (1.5, 1.2), (2.2, 2.0)]
                .map(|(y, z)| (v(x + inward * 4e-5 * z, y, z), Vec3::X * inward as f32));
            let floor = [1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.5]
                .into_iter()
                .flat_map(|d| [0.7, 1.5, 1.53, 2.2].map(|y| (v(x + inward * d, y, 0.0), Vec3::Z)));
            let at = |(p, n): (DVec3, Vec3)| 0.5 * irradiance(relit, built.local(p), n).x / PI as f32 / level;
            wall.into_iter().chain(floor).map(at).collect::<Vec<_>>()
        };
        [side(2.0, -1.0, 1.0), side(2.001, 1.0, 1000.0)].concat()
    });
    Row::new(
        "walls 1 mm apart, turned by 0.1 mm",
        "radiance of wall and floor on either side, 1 and 1000, from 0.1 mm off on",
        "its own side's L",
    )
    .off(worst(values, 1.0), 2e-3)
    .amplified(amplification)
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
    let places = [(1.1, 0.5), (1.4, 0.6), (1.7, 0.75)].map(|(y, z)| v(2.45, y, z));
    let expected = places.map(|p| f64::from(BRIGHT) * from_floor(PATCH, p, DVec3::X));
    let behind = |cells: u32, rays: u32| {
        let mut options: Options = options(cells);
        options.volume.rays = rays;
        asked(&built, &options, |relit| {
            let of = |(p, e): (&DVec3, f64)| (f64::from(irradiance(relit, built.local(*p), Vec3::X).x) / e) as f32;
            places.iter().zip(expected).map(of).collect()
        })
    };
    // the patch lights the panel from half a metre: its light is far from even over a coarse cell of the volume
    let title = "sun patch 10⁶ brighter than the shadow in its cell";
    let steps = [
        (8, 192, "irradiance behind a panel, from the patch, cells of 50 cm, 192 rays", 0.6),
        (32, 512, "the same, cells of 12 cm, 512 rays", 0.1),
        (64, 2048, "the same, cells of 6 cm, 2048 rays", 0.1),
    ];
    let mut rows: Vec<Row> = steps
        .into_iter()
        .map(|(cells, rays, computed, bound)| {
            let (values, amplification) = behind(cells, rays);
            Row::new(title, computed, "double-precision form factor")
                .off(worst(values, 1.0), bound)
                .amplified(amplification)
        })
        .collect();
    let (shadow, amplification) = asked(&built, &options(8), |relit| {
        let beside = [v(3.2, 1.0, 0.0), v(3.2, 1.7, 0.0), v(3.6, 1.35, 0.0)];
        beside.map(|p| irradiance(relit, built.local(p), Vec3::Z).x * 0.01 / PI as f32).to_vec()
    });
    let computed = "radiance in the shadow 20 cm beside it, same cell";
    rows.push(Row::new(title, computed, "the shadow's own L").off(worst(shadow, 1.0), 2e-3).amplified(amplification));
    rows
}

/// A probe with 99 % of its energy in one pixel.
fn one_pixel() -> Row {
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
    let (far, amplification) = asked(&built, &options(16), |relit| {
        // the view's pixels but those within the bright pixel's footprint
        let mut shown = shown(&built, relit);
        shown.sort_by(f32::total_cmp);
        shown.truncate(shown.len() * 9 / 10);
        shown
    });
    Row::new("one pixel with 99 % of a probe's energy", "radiance of nine tenths of a view, away from it", "L")
        .off(worst(far, 1.0), 2e-3)
        .amplified(amplification)
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
    let built = plan.build().furnace(&plan, 2.0);
    let (values, amplification) = asked(&built, &options(32), |relit| shown(&built, relit));
    Row::new("unseen chamber of albedo 0.999 behind a door", "radiance of a furnace by exchange", "L")
        .off(worst(values, 2.0), 0.2)
        .amplified(amplification)
}

/// The plain room has no window, no texture and no photograph; without a probe nothing can be relit, and that is said.
fn nothing_there() -> [Row; 2] {
    let plan = room(0.5);
    let built = plan.build().furnace(&plan, 2.0);
    let (values, amplification) = asked(&built, &options(16), |relit| shown(&built, relit));
    let none = Options { probes: 0, ..options(8) };
    let refused = clerestory::render::prepare(&built.site, &built.scene, &[], &none).is_err();
    [
        Row::new("no window, no texture, no photograph", "radiance of a furnace", "L")
            .off(worst(values, 2.0), 2e-3)
            .amplified(amplification),
        Row::new("no probe", "answers but the typed refusal", "0 (absolute)").off(u8::from(!refused), 0.0).counted(),
    ]
}
