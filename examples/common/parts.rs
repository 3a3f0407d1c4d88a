//! The parts a building is put together from: panels with openings, boxes, solids of revolution, tubes.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::{PI, TAU};

use super::mesh::{Finish, Model};

/// A line through (u, height) points with u rising; between them it is straight.
pub type Line = Vec<DVec2>;

/// A vertical plane: `along` is horizontal, `normal` points into the air.
#[derive(Clone, Copy)]
pub struct Plane {
    /// Where u = 0 at height 0.
    pub origin: DVec3,
    /// Direction of u.
    pub along: DVec3,
    /// Direction of the air.
    pub normal: DVec3,
}

impl Plane {
    /// The point at `u` along, at height `v`, `depth` metres behind the surface.
    pub fn at(&self, u: f64, v: f64, depth: f64) -> DVec3 {
        self.origin + self.along * u + DVec3::Y * v - self.normal * depth
    }

    /// The far side of a wall that is `thickness` thick.
    pub fn back(&self, thickness: f64) -> Self {
        Self { origin: self.origin - self.normal * thickness, along: self.along, normal: -self.normal }
    }
}

/// A hole in a panel, between a lower and an upper line over the same range of u.
#[derive(Clone)]
pub struct Opening {
    /// The lower rim.
    pub low: Line,
    /// The upper rim.
    pub high: Line,
}

impl Opening {
    /// Round-headed: from `sill` up to a half circle that springs at `spring`; `half` is half the width.
    pub fn arch(centre: f64, half: f64, sill: f64, spring: f64, segments: usize) -> Self {
        let high = half_circle(centre, half, segments).map(|(u, rise)| dvec2(u, spring + rise)).collect();
        Self { low: half_circle(centre, half, segments).map(|(u, _)| dvec2(u, sill)).collect(), high }
    }

    /// A round hole.
    pub fn circle(centre: DVec2, radius: f64, segments: usize) -> Self {
        let rim = |sign: f64| half_circle(centre.x, radius, segments).map(move |(u, r)| dvec2(u, centre.y + sign * r));
        Self { low: rim(-1.0).collect(), high: rim(1.0).collect() }
    }

    /// A rectangular hole.
    pub fn rectangle(u: [f64; 2], v: [f64; 2]) -> Self {
        Self { low: u.map(|u| dvec2(u, v[0])).to_vec(), high: u.map(|u| dvec2(u, v[1])).to_vec() }
    }

    fn range(&self) -> [f64; 2] {
        [self.low[0].x, self.low[self.low.len() - 1].x]
    }
}

fn half_circle(centre: f64, radius: f64, segments: usize) -> impl Iterator<Item = (f64, f64)> {
    (0..=segments).map(move |i| {
        let a = PI * i as f64 / segments as f64;
        (centre - radius * a.cos(), radius * a.sin())
    })
}

/// A level line.
pub fn level(u: [f64; 2], height: f64) -> Line {
    u.map(|u| dvec2(u, height)).to_vec()
}

/// The height of a line at `u`.
fn height(line: &Line, u: f64) -> f64 {
    let i = line.partition_point(|p| p.x <= u).clamp(1, line.len() - 1);
    let (a, b) = (line[i - 1], line[i]);
    if (u - a.x).abs() < 1e-9 { a.y } else { a.y + (b.y - a.y) * ((u - a.x) / (b.x - a.x)) }
}

/// The flat surface between two lines, less its openings. Openings must not lie above one another.
pub fn panel<'a>(m: &mut Model<'a>, finish: &'a Finish, plane: &Plane, low: &Line, high: &Line, holes: &[Opening]) {
    let range = [low[0].x, low[low.len() - 1].x];
    let lines = [low, high].into_iter().chain(holes.iter().flat_map(|h| [&h.low, &h.high]));
    let mut knots: Vec<f64> = lines.flatten().map(|p| p.x).filter(|u| (range[0]..=range[1]).contains(u)).collect();
    knots.sort_by(f64::total_cmp);
    knots.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    for pair in knots.windows(2) {
        let u = [pair[0], pair[1]];
        let middle = 0.5 * (u[0] + u[1]);
        let hole = holes.iter().find(|h| h.range()[0] < middle && middle < h.range()[1]);
        let mut piece = |low: &Line, high: &Line| {
            let (a, b) = (u.map(|u| height(low, u)), u.map(|u| height(high, u)));
            if b[0] - a[0] > 1e-6 || b[1] - a[1] > 1e-6 {
                let corners = [dvec2(u[0], a[0]), dvec2(u[1], a[1]), dvec2(u[1], b[1]), dvec2(u[0], b[0])];
                m.face_towards(finish, plane.normal, &corners.map(|c| plane.at(c.x, c.y, 0.0)), &corners);
            }
        };
        match hole {
            Some(hole) => {
                piece(low, &hole.low);
                piece(&hole.high, high);
            }
            None => piece(low, high),
        }
    }
}

/// The sides of an opening through a wall `thickness` thick: from its rim at the plane to the rim behind. With
/// `sill` false the lower side is left open.
pub fn reveal<'a>(
    m: &mut Model<'a>,
    finish: &'a Finish,
    plane: &Plane,
    front: &Opening,
    behind: &Opening,
    thickness: f64,
    sill: bool,
) {
    let ring = |o: &Opening| -> Vec<DVec2> { o.low.iter().chain(o.high.iter().rev()).copied().collect() };
    let (f, b) = (ring(front), ring(behind));
    let all: Vec<DVec3> = f.iter().map(|p| plane.at(p.x, p.y, 0.0)).collect();
    let centre = all.iter().sum::<DVec3>() / all.len() as f64 - plane.normal * (0.5 * thickness);
    let mut run = 0.0;
    for i in 0..f.len() {
        let j = (i + 1) % f.len();
        let length = f[i].distance(f[j]);
        let corners = [
            plane.at(f[i].x, f[i].y, 0.0),
            plane.at(f[j].x, f[j].y, 0.0),
            plane.at(b[j].x, b[j].y, thickness),
            plane.at(b[i].x, b[i].y, thickness),
        ];
        let metres = [dvec2(run, 0.0), dvec2(run + length, 0.0), dvec2(run + length, thickness), dvec2(run, thickness)];
        run += length;
        if length > 1e-6 && (sill || i + 1 >= front.low.len()) {
            let middle = corners.iter().sum::<DVec3>() / 4.0;
            m.face_towards(finish, centre - middle, &corners, &metres);
        }
    }
}

/// The six sides of a box: west, east, bottom, top, north, south.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// −x.
    West,
    /// +x.
    East,
    /// −y.
    Bottom,
    /// +y.
    Top,
    /// −z.
    North,
    /// +z.
    South,
}

const SIDES: [Side; 6] = [Side::West, Side::East, Side::Bottom, Side::Top, Side::North, Side::South];

/// A box, less the sides that lie on something.
pub fn cuboid<'a>(m: &mut Model<'a>, finish: &'a Finish, low: DVec3, high: DVec3, without: &[Side]) {
    for side in SIDES.into_iter().filter(|s| !without.contains(s)) {
        rectangle(m, finish, side, low, high);
    }
}

/// One side of a box, with texture coordinates from the site's own metres.
pub fn rectangle<'a>(m: &mut Model<'a>, finish: &'a Finish, side: Side, low: DVec3, high: DVec3) {
    let (x, z) = ([low.x, high.x], [low.z, high.z]);
    let (normal, corners): (DVec3, [DVec3; 4]) = match side {
        Side::West | Side::East => {
            let at = if side == Side::West { low.x } else { high.x };
            let n = if side == Side::West { DVec3::NEG_X } else { DVec3::X };
            (n, [dvec3(at, low.y, z[0]), dvec3(at, low.y, z[1]), dvec3(at, high.y, z[1]), dvec3(at, high.y, z[0])])
        }
        Side::Bottom | Side::Top => {
            let at = if side == Side::Bottom { low.y } else { high.y };
            let n = if side == Side::Bottom { DVec3::NEG_Y } else { DVec3::Y };
            (n, [dvec3(x[0], at, z[0]), dvec3(x[1], at, z[0]), dvec3(x[1], at, z[1]), dvec3(x[0], at, z[1])])
        }
        Side::North | Side::South => {
            let at = if side == Side::North { low.z } else { high.z };
            let n = if side == Side::North { DVec3::NEG_Z } else { DVec3::Z };
            (n, [dvec3(x[0], low.y, at), dvec3(x[1], low.y, at), dvec3(x[1], high.y, at), dvec3(x[0], high.y, at)])
        }
    };
    let flat = |p: DVec3| match side {
        Side::West | Side::East => dvec2(p.z, p.y),
        Side::Bottom | Side::Top => dvec2(p.x, -p.z),
        Side::North | Side::South => dvec2(p.x, p.y),
    };
    let mut metres = corners.map(flat);
    let extent = metres[2] - metres[0];
    if finish.grain && extent.y.abs() > extent.x.abs() {
        metres = metres.map(|p| dvec2(p.y, p.x));
    }
    m.face_towards(finish, normal, &corners, &metres);
}

/// A solid of revolution around the vertical through `base`: `profile` gives (radius, height) from the bottom up.
pub fn revolve<'a>(m: &mut Model<'a>, finish: &'a Finish, base: DVec3, profile: &[[f64; 2]], sides: usize) {
    let point = |i: usize, [r, y]: [f64; 2]| {
        let a = TAU * (i % sides) as f64 / sides as f64;
        base + dvec3(r * a.cos(), y, -r * a.sin())
    };
    // whole pictures around, so that no seam shows
    let widest = profile.iter().fold(0.0, |w: f64, p| w.max(p[0]));
    let around = (TAU * widest / finish.tile.x).round().max(1.0) * finish.tile.x;
    let mut run = 0.0;
    for pair in profile.windows(2) {
        let next = run + DVec2::from(pair[0]).distance(DVec2::from(pair[1]));
        for i in 0..sides {
            let u = [i, i + 1].map(|i| around * i as f64 / sides as f64);
            m.face(
                finish,
                &[point(i, pair[0]), point(i + 1, pair[0]), point(i + 1, pair[1]), point(i, pair[1])],
                &[dvec2(u[0], run), dvec2(u[1], run), dvec2(u[1], next), dvec2(u[0], next)],
            );
        }
        run = next;
    }
}

/// A round bar along a line of points; a closed line makes a ring, an open one gets flat ends. `up` is across the line.
pub fn tube<'a>(
    m: &mut Model<'a>,
    finish: &'a Finish,
    path: &[DVec3],
    radius: f64,
    sides: usize,
    closed: bool,
    up: DVec3,
) {
    let n = path.len();
    let ring = |i: usize| -> Vec<DVec3> {
        let (before, after) = if closed {
            (path[(i + n - 1) % n], path[(i + 1) % n])
        } else {
            (path[i.saturating_sub(1)], path[(i + 1).min(n - 1)])
        };
        let forward = (after - before).normalize_or(DVec3::X);
        let across = forward.cross(up).normalize_or(DVec3::X);
        let over = across.cross(forward);
        (0..sides)
            .map(|k| {
                let a = TAU * k as f64 / sides as f64;
                path[i] + (across * a.cos() + over * a.sin()) * radius
            })
            .collect()
    };
    let rings: Vec<_> = (0..n).map(ring).collect();
    for i in 0..if closed { n } else { n - 1 } {
        let (a, b) = (&rings[i], &rings[(i + 1) % n]);
        let axis = 0.5 * (path[i] + path[(i + 1) % n]);
        for k in 0..sides {
            let l = (k + 1) % sides;
            let corners = [a[k], a[l], b[l], b[k]];
            let outward = corners.iter().sum::<DVec3>() / 4.0 - axis;
            let metres = [dvec2(0.0, 0.0), dvec2(0.0, radius), dvec2(radius, radius), dvec2(radius, 0.0)];
            m.face_towards(finish, outward, &corners, &metres);
        }
    }
    if !closed {
        for (end, inside) in [(0, path[1]), (n - 1, path[n - 2])] {
            let metres: Vec<_> = rings[end].iter().map(|p| dvec2(p.x + p.z, p.y)).collect();
            m.face_towards(finish, path[end] - inside, &rings[end], &metres);
        }
    }
}

/// A picture on a wall: a slab `proud` metres thick with `frame` around the painted field of the finish's own size.
/// Looked at from the air it stands upright and is not mirrored, unless `flip` says so; `shift` moves the picture.
pub struct Painting<'a> {
    /// The wall, with `along` to the right of a person who looks at it.
    pub plane: Plane,
    /// The middle of the field: u, height.
    pub centre: DVec2,
    /// What is painted.
    pub finish: &'a Finish,
    /// Mirrored left to right.
    pub flip: bool,
    /// Metres by which the picture is moved to the right.
    pub shift: f64,
}

/// Hangs a painting in a frame 6 cm wide and 4 cm deep.
pub fn painting<'a>(m: &mut Model<'a>, frame: &'a Finish, painting: &Painting<'a>) {
    let Painting { plane, centre, finish, flip, shift } = painting;
    let half = finish.tile * 0.5;
    let (wide, deep) = (0.06, 0.04);
    let corner = |k: usize, extra: f64| {
        let sign = [dvec2(-1.0, -1.0), dvec2(1.0, -1.0), dvec2(1.0, 1.0), dvec2(-1.0, 1.0)][k % 4];
        *centre + sign * (half + extra)
    };
    let at = |c: DVec2, depth: f64| plane.at(c.x, c.y, depth);
    let field = [0, 1, 2, 3].map(|k| corner(k, 0.0));
    let metres = field.map(|c| {
        let p = c - (*centre - half);
        dvec2(if *flip { finish.tile.x - p.x } else { p.x } - shift, p.y)
    });
    m.face_towards(finish, plane.normal, &field.map(|c| at(c, -0.5 * deep)), &metres);
    for k in 0..4 {
        let (inner, outer) = ([corner(k, 0.0), corner(k + 1, 0.0)], [corner(k, wide), corner(k + 1, wide)]);
        let length = outer[0].distance(outer[1]);
        let strip = |a: f64, b: f64| [dvec2(0.0, a), dvec2(length, a), dvec2(length, b), dvec2(0.0, b)];
        let outward = plane.along * (outer[0].midpoint(outer[1]) - *centre).x
            + DVec3::Y * (outer[0].midpoint(outer[1]) - *centre).y;
        let front = [at(outer[0], -deep), at(outer[1], -deep), at(inner[1], -deep), at(inner[0], -deep)];
        m.face_towards(frame, plane.normal, &front, &strip(0.0, wide));
        let side = [at(outer[0], 0.0), at(outer[1], 0.0), at(outer[1], -deep), at(outer[0], -deep)];
        m.face_towards(frame, outward, &side, &strip(0.0, deep));
        let rim = [at(inner[0], -0.5 * deep), at(inner[1], -0.5 * deep), at(inner[1], -deep), at(inner[0], -deep)];
        m.face_towards(frame, -outward, &rim, &strip(0.0, deep));
    }
}
