//! Walls, vaults, floors and roofs: an inner and an outer shell, joined by the sides of every opening.
//!
//! East is +x (the altar), south is +z, up is y. The nave is 12 × 6 m, its arcade opens to an aisle on the north, a door
//! in the south wall leads to the sacristy.

use glam::{DVec3, dvec2, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};

use super::Version;
use super::finish::*;
use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Line, Opening, Plane, Side, cuboid, level, panel, rectangle, reveal};

/// Where the ground is outside; floors inside are at 0.
const GROUND: f64 = -0.3;
/// Nave length and half width.
const LENGTH: f64 = 12.0;
const HALF: f64 = 3.0;
/// Height at which the nave's vault springs, and its rise.
const SPRING: f64 = 5.6;
const RISE: f64 = 2.0;
const VAULT_SEGMENTS: usize = 24;
/// The painted band.
const FRIEZE_BAND: [f64; 2] = [4.2, 4.55];
/// Where the aisle's ceiling is.
const CEILING: f64 = 4.0;
/// Height at which the arcade's arches spring; the columns end there.
pub const CAPITAL: f64 = 2.7;
/// Bay centres along the nave.
const BAYS: [f64; 4] = [1.5, 4.5, 7.5, 10.5];
/// The apse: half a decagon around this point.
const APSE: DVec3 = dvec3(12.4, 0.0, 0.0);
const APSE_RADIUS: f64 = 2.2;
const APSE_SPRING: f64 = 3.4;
/// Height of the apse's floor.
pub const APSE_FLOOR: f64 = 0.51;
const APSE_WALL: f64 = 0.5;
/// The sacristy's inner corner and side.
const SACRISTY: [f64; 2] = [8.8, 3.6];
const SACRISTY_SIDE: f64 = 2.8;
const SACRISTY_SPRING: f64 = 2.2;
const GROIN_SEGMENTS: usize = 16;

/// The nave's south wall, inner face.
pub const SOUTH: Plane = Plane { origin: dvec3(0.0, 0.0, HALF), along: DVec3::X, normal: DVec3::NEG_Z };
/// The arcade's face towards the nave.
pub const NORTH: Plane = Plane { origin: dvec3(0.0, 0.0, -HALF), along: DVec3::X, normal: DVec3::Z };
/// The west wall, inner face.
const WEST: Plane = Plane { origin: DVec3::ZERO, along: DVec3::Z, normal: DVec3::X };
/// The wall of the chancel arch, towards the nave.
const EAST: Plane = Plane { origin: dvec3(LENGTH, 0.0, 0.0), along: DVec3::Z, normal: DVec3::NEG_X };
/// The aisle's north wall, inner face.
pub const AISLE: Plane = Plane { origin: dvec3(0.0, 0.0, -5.4), along: DVec3::X, normal: DVec3::Z };

/// A side of the apse, 0 (north) to 4 (south); u runs to the right from its middle.
pub fn apse_side(k: usize) -> Plane {
    let a = (36.0 * k as f64 - 72.0).to_radians();
    let out = dvec3(a.cos(), 0.0, a.sin());
    let distance = APSE_RADIUS * (PI / 10.0).cos();
    Plane { origin: APSE + out * distance, along: dvec3(-a.sin(), 0.0, a.cos()), normal: -out }
}

/// The sacristy's south wall, inner face.
const SACRISTY_SOUTH: Plane =
    Plane { origin: dvec3(0.0, 0.0, SACRISTY[1] + SACRISTY_SIDE), along: DVec3::X, normal: DVec3::NEG_Z };

/// How thick walls are.
const SOUTH_WALL: f64 = 0.6;
const NORTH_WALL: f64 = 0.5;
const WEST_WALL: f64 = 0.7;
const AISLE_WALL: f64 = 0.6;
const SACRISTY_WALL: f64 = 0.4;

/// Everything that is wall, vault, floor or roof.
pub fn build(m: &mut Model, version: Version) {
    floors(m, version);
    south_wall(m);
    north_wall(m);
    west_wall(m);
    east_wall(m);
    vault(m);
    aisle(m, version);
    apse(m);
    sacristy(m);
    roofs(m);
}

/// A splayed window: the wider rim inside, the narrow one outside, and the sides between them.
struct Window {
    inner: Opening,
    outer: Opening,
}

impl Window {
    /// Half widths inside and outside, sill heights inside and outside, and the height at which both heads spring.
    fn new(centre: f64, half: [f64; 2], sill: [f64; 2], spring: f64) -> Self {
        let rim = |i: usize| Opening::arch(centre, half[i], sill[i], spring, 12);
        Self { inner: rim(0), outer: rim(1) }
    }

    fn cut(&self, m: &mut Model, plane: &Plane, thickness: f64) {
        reveal(m, &PLASTER, plane, &self.inner, &self.outer, thickness, true);
    }
}

/// Rectangles that hold the windows' outer rims: middle and halves of the sides.
pub fn windows() -> Vec<[DVec3; 3]> {
    let mut all = Vec::new();
    let mut add = |plane: &Plane, thickness: f64, windows: &[Window]| {
        for window in windows {
            let rim = || window.outer.low.iter().chain(&window.outer.high);
            let low = rim().copied().reduce(|a, b| a.min(b)).unwrap_or_default();
            let high = rim().copied().reduce(|a, b| a.max(b)).unwrap_or_default();
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            all.push([plane.at(middle.x, middle.y, thickness), plane.along * half.x, DVec3::Y * half.y]);
        }
    };
    add(&SOUTH, SOUTH_WALL, &south_windows());
    add(&SOUTH, SOUTH_WALL, &clerestory());
    add(&NORTH, NORTH_WALL, &clerestory());
    add(&WEST, WEST_WALL, &[rose_window()]);
    add(&AISLE, AISLE_WALL, &aisle_windows());
    add(&apse_side(1), APSE_WALL, &[apse_window()]);
    add(&apse_side(3), APSE_WALL, &[apse_window()]);
    add(&SACRISTY_SOUTH, SACRISTY_WALL, &[sacristy_window()]);
    all
}

fn south_windows() -> [Window; 2] {
    [4.5, 7.5].map(|x| Window::new(x, [0.85, 0.56], [1.4, 1.55], 3.05))
}

fn aisle_windows() -> [Window; 2] {
    [1.5, 7.5].map(|x| Window::new(x, [0.75, 0.52], [1.3, 1.45], 2.75))
}

fn apse_window() -> Window {
    Window::new(0.0, [0.52, 0.38], [1.55, 1.65], 2.75)
}

fn sacristy_window() -> Window {
    Window::new(10.2, [0.65, 0.5], [1.05, 1.15], 1.9)
}

fn rose_window() -> Window {
    let [inner, outer] = [1.05, 0.85].map(|r| Opening::circle(dvec2(0.0, ROSE.y), r, 24));
    Window { inner, outer }
}

fn inner(windows: &[Window]) -> Vec<Opening> {
    windows.iter().map(|w| w.inner.clone()).collect()
}

fn outer(windows: &[Window]) -> Vec<Opening> {
    windows.iter().map(|w| w.outer.clone()).collect()
}

fn clerestory() -> Vec<Window> {
    BAYS.map(|x| Window::new(x, [0.5, 0.4], [4.6, 4.68], 4.95)).into()
}

/// The cross-section of the nave's vault, or of a rib below it: height over z.
fn vault_line(half: f64, rise: f64) -> Line {
    let angle = |i: usize| PI * i as f64 / VAULT_SEGMENTS as f64;
    (0..=VAULT_SEGMENTS).map(|i| dvec2(-half * angle(i).cos(), SPRING + rise * angle(i).sin())).collect()
}

fn floors(m: &mut Model, version: Version) {
    m.object("floor");
    for (bay, centre) in BAYS.into_iter().enumerate() {
        let turned = version.faulty() && bay == 1;
        let (x, z) = ([centre - 1.4, centre + 1.4], [-2.8, 2.8]);
        let corners = [dvec2(x[0], z[0]), dvec2(x[1], z[0]), dvec2(x[1], z[1]), dvec2(x[0], z[1])];
        let metres = corners.map(|c| if turned { dvec2(c.y, c.x) } else { dvec2(c.x, -c.y) });
        m.face_towards(&BRICK, DVec3::Y, &corners.map(|c| dvec3(c.x, 0.0, c.y)), &metres);
    }
    let mut slab = |finish: &'static Finish, x: [f64; 2], z: [f64; 2]| {
        rectangle(m, finish, Side::Top, dvec3(x[0], 0.0, z[0]), dvec3(x[1], 0.0, z[1]));
    };
    for line in 0..5 {
        let x = 3.0 * f64::from(line);
        slab(&FLAG, [(x - 0.1_f64).max(0.0), (x + 0.1_f64).min(LENGTH)], [-2.8, 2.8]);
    }
    slab(&FLAG, [0.0, LENGTH], [-3.0, -2.8]);
    slab(&FLAG, [0.0, LENGTH], [2.8, 3.0]);
    slab(&FLAG, [0.3, LENGTH - 0.3], [-3.5, -3.0]);
    slab(&FLAG, [0.0, LENGTH], [-5.4, -3.5]);
    slab(&WOOD, [SACRISTY[0], SACRISTY[0] + SACRISTY_SIDE], [SACRISTY[1], SACRISTY[1] + SACRISTY_SIDE]);
}

fn south_wall(m: &mut Model) {
    m.object("south_wall");
    let (thickness, ends) = (SOUTH_WALL, [0.0, LENGTH]);
    let low = south_windows();
    let high = clerestory();
    let door = Opening::arch(10.2, 0.5, 0.0, 1.65, 12);
    let mut holes = inner(&low);
    holes.push(door.clone());
    panel(m, &ASHLAR, &SOUTH, &level(ends, 0.0), &level(ends, FRIEZE_BAND[0]), &holes);
    panel(m, &FRIEZE, &SOUTH, &level(ends, FRIEZE_BAND[0]), &level(ends, FRIEZE_BAND[1]), &[]);
    panel(m, &ASHLAR, &SOUTH, &level(ends, FRIEZE_BAND[1]), &level(ends, SPRING), &inner(&high));
    reveal(m, &ASHLAR, &SOUTH, &door, &door, thickness, true);
    low.iter().chain(&high).for_each(|w| w.cut(m, &SOUTH, thickness));
    cuboid(m, &CARVED, dvec3(0.0, 5.46, 2.92), dvec3(LENGTH, 5.58, 3.0), &[Side::South, Side::West, Side::East]);

    m.object("outside_south");
    let back = SOUTH.back(thickness);
    let band = FRIEZE_BAND[0];
    let mut piece = |x: [f64; 2], y: [f64; 2], holes: &[Opening]| {
        panel(m, &OUTSIDE, &back, &level(x, y[0]), &level(x, y[1]), holes);
    };
    piece([-0.7, 8.4], [GROUND, band], &outer(&low));
    piece([8.4, 12.0], [4.0, band], &[]);
    piece([12.0, APSE.x], [GROUND, band], &[]);
    piece([-0.7, APSE.x], [band, 6.3], &outer(&high));
}

fn north_wall(m: &mut Model) {
    m.object("arcade");
    let (thickness, ends) = (NORTH_WALL, [0.0, LENGTH]);
    let between = [0.3, LENGTH - 0.3];
    let arches = BAYS.map(|x| Opening::arch(x, 1.2, CAPITAL, CAPITAL, 20));
    let high = clerestory();
    let back = NORTH.back(thickness);
    for (plane, finish, top) in [(&NORTH, &ASHLAR, FRIEZE_BAND[0]), (&back, &PLASTER, CEILING)] {
        panel(m, finish, plane, &level(between, CAPITAL), &level(between, top), &arches);
        for ends in [[0.0, 0.3], [LENGTH - 0.3, LENGTH]] {
            panel(m, finish, plane, &level(ends, 0.0), &level(ends, top), &[]);
        }
    }
    rectangle(m, &ASHLAR, Side::East, dvec3(0.3, 0.0, -3.5), dvec3(0.3, CAPITAL, -3.0));
    rectangle(m, &ASHLAR, Side::West, dvec3(LENGTH - 0.3, 0.0, -3.5), dvec3(LENGTH - 0.3, CAPITAL, -3.0));
    arches.iter().for_each(|arch| reveal(m, &ASHLAR, &NORTH, arch, arch, thickness, false));
    panel(m, &FRIEZE, &NORTH, &level(ends, FRIEZE_BAND[0]), &level(ends, FRIEZE_BAND[1]), &[]);
    panel(m, &ASHLAR, &NORTH, &level(ends, FRIEZE_BAND[1]), &level(ends, SPRING), &inner(&high));
    high.iter().for_each(|w| w.cut(m, &NORTH, thickness));
    cuboid(m, &CARVED, dvec3(0.0, 5.46, -3.0), dvec3(LENGTH, 5.58, -2.92), &[Side::North, Side::West, Side::East]);

    m.object("outside_north");
    let x = [-0.7, APSE.x];
    panel(m, &OUTSIDE, &back, &level(x, 4.5), &level(x, 6.3), &outer(&high));
}

/// Middle of the rose window.
pub const ROSE: DVec3 = dvec3(0.0, 5.0, 0.0);

fn west_wall(m: &mut Model) {
    m.object("west_wall");
    let (thickness, ends, loft) = (WEST_WALL, [-HALF, HALF], 2.9);
    let portal = Opening::rectangle([-0.8, 0.8], [0.0, 2.3]);
    let rose = rose_window();
    panel(m, &ASHLAR, &WEST, &level(ends, 0.0), &level(ends, loft), std::slice::from_ref(&portal));
    panel(m, &ASHLAR, &WEST, &level(ends, loft), &vault_line(HALF, RISE), std::slice::from_ref(&rose.inner));
    reveal(m, &ASHLAR, &WEST, &portal, &portal, 0.25, true);
    for leaf in [[-0.8, 0.0], [0.0, 0.8]] {
        rectangle(m, &WOOD, Side::East, dvec3(-0.25, 0.0, leaf[0]), dvec3(-0.25, 2.3, leaf[1]));
    }
    rose.cut(m, &WEST, thickness);

    m.object("outside_west");
    let back = WEST.back(thickness);
    let gable = vec![dvec2(-3.5, 6.3), dvec2(0.05, 8.5), dvec2(3.6, 6.3)];
    panel(m, &OUTSIDE, &back, &level([-3.5, 3.6], GROUND), &gable, &[rose.outer]);
    let lean_to = vec![dvec2(-6.0, 4.1), dvec2(-3.5, 4.5)];
    panel(m, &OUTSIDE, &back, &level([-6.0, -3.5], GROUND), &lean_to, &[]);
}

fn east_wall(m: &mut Model) {
    m.object("chancel_arch");
    let ends = [-HALF, HALF];
    let arch = Opening::arch(0.0, APSE_RADIUS, 0.0, APSE_SPRING, 24);
    panel(m, &ASHLAR, &EAST, &level(ends, 0.0), &vault_line(HALF, RISE), std::slice::from_ref(&arch));
    reveal(m, &CARVED, &EAST, &arch, &arch, APSE.x - LENGTH, false);

    m.object("outside_east");
    let back = EAST.back(APSE.x - LENGTH);
    let gable = vec![dvec2(-3.5, 6.3), dvec2(0.05, 8.5), dvec2(3.6, 6.3)];
    let arch = Opening::arch(0.0, apse_outer_radius(), GROUND, APSE_SPRING, 24);
    panel(m, &OUTSIDE, &back, &level([-3.5, 3.6], GROUND), &gable, &[arch]);
    let lean_to = vec![dvec2(-6.0, 4.1), dvec2(-3.5, 4.5)];
    panel(m, &OUTSIDE, &back, &level([-6.0, -3.5], GROUND), &lean_to, &[]);
}

/// A barrel of half an ellipse, with three ribs 15 cm proud on corbels.
fn vault(m: &mut Model) {
    m.object("vault");
    let shell = vault_line(HALF, RISE);
    let rib = vault_line(HALF - 0.15, RISE - 0.15);
    let half_width = 0.18;
    let ribs = [3.0, 6.0, 9.0];
    let mut edges = vec![0.0];
    edges.extend(ribs.iter().flat_map(|x| [x - half_width, x + half_width]));
    edges.push(LENGTH);
    for x in edges.chunks(2) {
        barrel(m, &PLASTER, &shell, [x[0], x[1]]);
    }
    m.object("ribs");
    for x in ribs {
        let side = [x - half_width, x + half_width];
        barrel(m, &CARVED, &rib, side);
        for (at, towards) in [(side[0], DVec3::NEG_X), (side[1], DVec3::X)] {
            for (a, b) in rib.windows(2).zip(shell.windows(2)) {
                let corners = [a[0], a[1], b[1], b[0]];
                m.face_towards(&CARVED, towards, &corners.map(|c| dvec3(at, c.y, c.x)), &corners);
            }
        }
        for sign in [-1.0, 1.0] {
            corbel(m, x, sign);
        }
    }
}

fn barrel(m: &mut Model, finish: &'static Finish, line: &Line, x: [f64; 2]) {
    let mut run = 0.0;
    for pair in line.windows(2) {
        let next = run + pair[0].distance(pair[1]);
        let corners = [(x[0], pair[0]), (x[1], pair[0]), (x[1], pair[1]), (x[0], pair[1])];
        let points = corners.map(|(x, p)| dvec3(x, p.y, p.x));
        let centre = dvec3(0.5 * (x[0] + x[1]), SPRING - 1.0, 0.0);
        let metres = [dvec2(x[0], run), dvec2(x[1], run), dvec2(x[1], next), dvec2(x[0], next)];
        m.face_towards(finish, centre - points[0], &points, &metres);
        run = next;
    }
}

/// A tapered block on the nave wall that carries a rib's foot.
fn corbel(m: &mut Model, x: f64, sign: f64) {
    let ring = |y: f64, half: f64, out: f64| {
        [
            dvec3(x - half, y, sign * HALF),
            dvec3(x - half, y, sign * (HALF - out)),
            dvec3(x + half, y, sign * (HALF - out)),
            dvec3(x + half, y, sign * HALF),
        ]
    };
    let rings = [ring(4.95, 0.1, 0.08), ring(5.4, 0.24, 0.26), ring(SPRING, 0.24, 0.26)];
    let centre = dvec3(x, 5.3, sign * HALF);
    for pair in rings.windows(2) {
        for k in 0..3 {
            let corners = [pair[0][k], pair[0][k + 1], pair[1][k + 1], pair[1][k]];
            let outward = corners.iter().sum::<DVec3>() / 4.0 - centre;
            m.face_towards(&CARVED, outward.with_y(0.0), &corners, &corners.map(|c| dvec2(c.x + c.z, c.y)));
        }
    }
    for (ring, towards) in [(rings[0], DVec3::NEG_Y), (rings[2], DVec3::Y)] {
        m.face_towards(&CARVED, towards, &ring, &ring.map(|c| dvec2(c.x, c.z)));
    }
}

fn aisle(m: &mut Model, version: Version) {
    m.object("aisle");
    let (thickness, ends) = (AISLE_WALL, [0.0, LENGTH]);
    let windows = aisle_windows();
    let niches: &[f64] = if version.faulty() { &[4.5] } else { &[4.5, 10.5] };
    let mut holes = inner(&windows);
    holes.extend(niches.iter().map(|&x| Opening::arch(x, NICHE_RADIUS, NICHE_SILL, NICHE_SPRING, NICHE_SEGMENTS)));
    panel(m, &PLASTER, &AISLE, &level(ends, 0.0), &level(ends, CEILING), &holes);
    windows.iter().for_each(|w| w.cut(m, &AISLE, thickness));
    let (low, high) = (dvec3(0.0, 0.0, -5.4), dvec3(LENGTH, CEILING, -3.5));
    rectangle(m, &PLASTER, Side::East, low, dvec3(0.0, CEILING, -3.5));
    rectangle(m, &PLASTER, Side::West, dvec3(LENGTH, 0.0, -5.4), high);
    rectangle(m, &WOOD, Side::Bottom, dvec3(0.0, CEILING, -5.4), high);
    for x in 1..12 {
        let x = f64::from(x);
        let beam = [dvec3(x - 0.08, CEILING - 0.18, -5.4), dvec3(x + 0.08, CEILING, -3.5)];
        cuboid(m, &WOOD, beam[0], beam[1], &[Side::Top, Side::North, Side::South]);
    }
    m.object("niches");
    niches.iter().for_each(|&x| niche(m, x));

    m.object("outside_aisle");
    let x = [-0.7, APSE.x];
    panel(m, &OUTSIDE, &AISLE.back(thickness), &level(x, GROUND), &level(x, 4.1), &outer(&windows));
}

/// Height of a niche's floor.
pub const NICHE_SILL: f64 = 1.0;
const NICHE_SPRING: f64 = 2.0;
const NICHE_RADIUS: f64 = 0.45;
const NICHE_SEGMENTS: usize = 16;

/// A niche in the aisle's wall: half a cylinder under a quarter of a sphere.
fn niche(m: &mut Model, x: f64) {
    let point = |i: usize, r: f64, y: f64| {
        let a = PI * i as f64 / NICHE_SEGMENTS as f64;
        AISLE.at(x - r * a.cos(), y, r * a.sin())
    };
    let axis = AISLE.at(x, NICHE_SPRING, 0.0);
    let mut rows = vec![(NICHE_RADIUS, NICHE_SILL)];
    rows.extend((0..=NICHE_SEGMENTS / 2).map(|j| {
        let a = PI * j as f64 / NICHE_SEGMENTS as f64;
        (NICHE_RADIUS * a.cos(), NICHE_SPRING + NICHE_RADIUS * a.sin())
    }));
    let arc = |i: usize| PI * NICHE_RADIUS * i as f64 / NICHE_SEGMENTS as f64;
    for row in rows.windows(2) {
        for i in 0..NICHE_SEGMENTS {
            let corners = [
                point(i, row[0].0, row[0].1),
                point(i + 1, row[0].0, row[0].1),
                point(i + 1, row[1].0, row[1].1),
                point(i, row[1].0, row[1].1),
            ];
            let middle = corners.iter().sum::<DVec3>() / 4.0;
            let mut inward = axis - middle;
            if row[0].1 < NICHE_SPRING {
                inward.y = 0.0;
            }
            let metres = [
                dvec2(arc(i), row[0].1),
                dvec2(arc(i + 1), row[0].1),
                dvec2(arc(i + 1), row[1].1),
                dvec2(arc(i), row[1].1),
            ];
            m.face_towards(&PLASTER, inward, &corners, &metres);
        }
    }
    let rim: Vec<_> = (0..=NICHE_SEGMENTS).map(|i| point(i, NICHE_RADIUS, NICHE_SILL)).collect();
    let metres: Vec<_> = rim.iter().map(|p| dvec2(p.x, p.z)).collect();
    m.face_towards(&CARVED, DVec3::Y, &rim, &metres);
}

fn apse_outer_radius() -> f64 {
    APSE_RADIUS + APSE_WALL / (PI / 10.0).cos()
}

fn apse(m: &mut Model) {
    m.object("apse");
    let half = |radius: f64| radius * (PI / 10.0).sin();
    let (inside, outside) = (half(APSE_RADIUS), half(apse_outer_radius()));
    for k in 0..5 {
        let plane = apse_side(k);
        let windows: Vec<_> = if k % 2 == 1 { vec![apse_window()] } else { vec![] };
        let wall = |y: f64, half: f64| level([-half, half], y);
        panel(m, &ASHLAR, &plane, &wall(APSE_FLOOR, inside), &wall(APSE_SPRING, inside), &inner(&windows));
        windows.iter().for_each(|w| w.cut(m, &plane, APSE_WALL));
        panel(
            m,
            &OUTSIDE,
            &plane.back(APSE_WALL),
            &wall(GROUND, outside),
            &wall(APSE_SPRING, outside),
            &outer(&windows),
        );
    }
    m.object("conch");
    conch(m, &STARS, APSE_RADIUS, -1.0);
    m.object("outside_conch");
    conch(m, &ROOF, apse_outer_radius(), 1.0);
    apse_floor(m);
}

/// Half a dome of five gores, seen from inside (−1) or outside (+1).
fn conch(m: &mut Model, finish: &'static Finish, radius: f64, sign: f64) {
    let point = |k: usize, j: usize| {
        let (a, e) = ((36.0 * k as f64 - 90.0).to_radians(), FRAC_PI_2 * j as f64 / 12.0);
        APSE + dvec3(radius * e.cos() * a.cos(), APSE_SPRING + radius * e.sin(), radius * e.cos() * a.sin())
    };
    let metres =
        |k: usize, j: usize| dvec2(36f64.to_radians() * k as f64 * radius, FRAC_PI_2 * j as f64 / 12.0 * radius);
    for k in 0..5 {
        for j in 0..12 {
            let ring = [(k, j), (k + 1, j), (k + 1, j + 1), (k, j + 1)];
            let corners = ring.map(|(k, j)| point(k, j));
            let outward = corners.iter().sum::<DVec3>() / 4.0 - (APSE + DVec3::Y * APSE_SPRING);
            m.face_towards(finish, outward * sign, &corners, &ring.map(|(k, j)| metres(k, j)));
        }
    }
}

/// Three steps up to the altar; the third is the apse's floor.
fn apse_floor(m: &mut Model) {
    m.object("steps");
    let (rise, r) = (APSE_FLOOR / 3.0, APSE_RADIUS);
    let edges = [11.3, 11.6, 11.9, LENGTH];
    for k in 0..3 {
        let (x, top) = ([edges[k], edges[k + 1]], rise * (k + 1) as f64);
        rectangle(m, &FLAG, Side::West, dvec3(x[0], top - rise, -r), dvec3(x[0], top, r));
        rectangle(m, &FLAG, Side::North, dvec3(x[0], 0.0, -r), dvec3(x[1], top, -r));
        rectangle(m, &FLAG, Side::South, dvec3(x[0], 0.0, r), dvec3(x[1], top, r));
        if k < 2 {
            rectangle(m, &FLAG, Side::Top, dvec3(x[0], top, -r), dvec3(x[1], top, r));
        }
    }
    let mut floor = vec![dvec3(edges[2], APSE_FLOOR, -r)];
    floor.extend((0..=5).map(|k| {
        let a = (36.0 * f64::from(k) - 90.0).to_radians();
        APSE + dvec3(r * a.cos(), APSE_FLOOR, r * a.sin())
    }));
    floor.push(dvec3(edges[2], APSE_FLOOR, r));
    let metres: Vec<_> = floor.iter().map(|p| dvec2(p.x, p.z)).collect();
    m.face_towards(&FLAG, DVec3::Y, &floor, &metres);
}

fn sacristy(m: &mut Model) {
    m.object("sacristy");
    let ([x0, z0], side, thickness) = (SACRISTY, SACRISTY_SIDE, SACRISTY_WALL);
    let (radius, centre) = (0.5 * side, dvec2(x0 + 0.5 * side, z0 + 0.5 * side));
    let angle = |i: usize| PI * i as f64 / GROIN_SEGMENTS as f64;
    let lunette = |c: f64| -> Line {
        (0..=GROIN_SEGMENTS)
            .map(|i| dvec2(c - radius * angle(i).cos(), SACRISTY_SPRING + radius * angle(i).sin()))
            .collect()
    };
    let door = Opening::arch(10.2, 0.5, 0.0, 1.65, 12);
    let (window, south) = (sacristy_window(), SACRISTY_SOUTH);
    let (along_x, along_z) = ([x0, x0 + side], [z0, z0 + side]);
    panel(m, &PLASTER, &SOUTH.back(SOUTH_WALL), &level(along_x, 0.0), &lunette(centre.x), &[door]);
    panel(m, &PLASTER, &south, &level(along_x, 0.0), &lunette(centre.x), std::slice::from_ref(&window.inner));
    for (x, normal) in [(x0, DVec3::X), (x0 + side, DVec3::NEG_X)] {
        let wall = Plane { origin: dvec3(x, 0.0, 0.0), along: DVec3::Z, normal };
        panel(m, &PLASTER, &wall, &level(along_z, 0.0), &lunette(centre.y), &[]);
    }
    window.cut(m, &south, thickness);
    groin(m, &lunette(centre.x), &lunette(centre.y));

    m.object("outside_sacristy");
    let (low, high) = (dvec3(x0 - thickness, GROUND, z0), dvec3(x0 + side + thickness, 4.0, z0 + side + thickness));
    cuboid(m, &OUTSIDE, low, high, &[Side::North, Side::South, Side::Bottom, Side::Top]);
    rectangle(m, &ROOF, Side::Top, low, high);
    let range = [low.x, high.x];
    panel(m, &OUTSIDE, &south.back(thickness), &level(range, GROUND), &level(range, 4.0), &[window.outer]);
}

/// Two barrels that cross: the higher of the two at every point, its cells cut along the groins.
fn groin(m: &mut Model, along_x: &Line, along_z: &Line) {
    let n = GROIN_SEGMENTS;
    let point = |i: usize, j: usize| dvec3(along_x[i].x, along_x[i].y.max(along_z[j].y), along_z[j].x);
    for i in 0..n {
        for j in 0..n {
            let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let mut face = |ring: &[(usize, usize)]| {
                let corners: Vec<_> = ring.iter().map(|&(i, j)| point(i, j)).collect();
                let metres: Vec<_> = corners.iter().map(|p| dvec2(p.x, p.z)).collect();
                m.face_towards(&PLASTER, DVec3::NEG_Y, &corners, &metres);
            };
            if i == j {
                face(&[ring[0], ring[1], ring[2]]);
                face(&[ring[0], ring[2], ring[3]]);
            } else if i + j + 1 == n {
                face(&[ring[0], ring[1], ring[3]]);
                face(&[ring[1], ring[2], ring[3]]);
            } else {
                face(&ring);
            }
        }
    }
}

fn roofs(m: &mut Model) {
    m.object("outside_roofs");
    let x = [-0.7, APSE.x];
    let (south, ridge, north) = (dvec2(3.6, 6.3), dvec2(0.05, 8.5), dvec2(-3.5, 6.3));
    for (a, b) in [(south, ridge), (ridge, north), (dvec2(-3.5, 4.5), dvec2(-6.0, 4.1))] {
        let corners = [dvec3(x[0], a.y, a.x), dvec3(x[1], a.y, a.x), dvec3(x[1], b.y, b.x), dvec3(x[0], b.y, b.x)];
        m.face_towards(&ROOF, DVec3::Y, &corners, &corners.map(|c| dvec2(c.x, c.z)));
    }
    m.object("underside");
    let mut slab = |low: [f64; 2], high: [f64; 2]| {
        rectangle(m, &OUTSIDE, Side::Bottom, dvec3(low[0], GROUND, low[1]), dvec3(high[0], GROUND, high[1]));
    };
    slab([-0.7, -6.0], [APSE.x, 3.6]);
    slab([8.4, 3.6], [12.0, 6.8]);
    let rim: Vec<_> = (0..=5)
        .map(|k| {
            let a = (36.0 * f64::from(k) - 90.0).to_radians();
            APSE + dvec3(a.cos(), 0.0, a.sin()) * apse_outer_radius() + DVec3::Y * GROUND
        })
        .collect();
    let metres: Vec<_> = rim.iter().map(|p| dvec2(p.x, p.z)).collect();
    m.face_towards(&OUTSIDE, DVec3::NEG_Y, &rim, &metres);
}
