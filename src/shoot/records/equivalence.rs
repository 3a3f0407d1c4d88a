//! Looking records up in the probe's chart against the paper's radius search in a k-d tree: the same records, the same
//! weights.

use glam::{Mat3, Vec2, Vec3};
use std::sync::Arc;

use super::*;
use crate::scene::Ray;
use crate::scene::testing::{boxes, grey};
use crate::shoot::{Chart, KdTree};

/// A room with a pillar and half a ceiling, every wall of two triangles.
fn pillared_room() -> Scene {
    let room = (Vec3::new(-3.0, -2.0, -1.5), Vec3::new(3.5, 2.5, 1.5));
    let pillar = (Vec3::new(1.2, 0.8, -1.5), Vec3::new(1.9, 1.4, 1.5));
    let mut mesh = boxes(&[room, pillar]);
    // the first box's fourth triangle is one half of its upper side
    mesh.triangles.remove(3);
    mesh.materials.pop();
    grey(mesh, 0.6)
}

/// A picture in which no two pixels are alike.
fn confetti(width: usize, height: usize) -> Picture {
    let mut picture = Picture::new(width, height);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        *pixel = Vec3::new(0.1, 0.2, 0.3) + Vec3::new(i as f32 * 0.618, i as f32 * 0.755, i as f32 * 0.57).fract();
    }
    picture
}

/// One sight of a place by a probe.
struct Sight {
    /// Relative to the probe.
    p: Vec3,
    normal: Vec3,
    place: Vec2,
    tolerance_m: f32,
}

/// The definition: every record within a radius, weighed by how far it is in the chart (a tent one cell wide) and by how
/// far it is on the point's surface; `admits` says that no wall is in between.
fn search(
    records: &Records,
    tree: &KdTree<(usize, usize)>,
    radius_m: f32,
    sight: &Sight,
    admits: impl Fn(usize) -> bool,
) -> (Observation, usize) {
    let chart = &records.hits.chart;
    let mut sums = Observation::default();
    let mut found = 0;
    tree.within(sight.p, radius_m, |&(row, x), _| {
        let record = &records.records[chart.row(row).start + x];
        let weight = tent(chart, row, x, sight.place) * surely(record, sight);
        if weight > 0.0 && admits(chart.row(row).start + x) {
            found += 1;
            sums.of(record.sunlit).add(Vec3::from(record.light), weight);
        }
    });
    (sums, found)
}

/// How far the seen place is on a record's surface.
fn surely(record: &Record, sight: &Sight) -> f32 {
    let n = unpack_normal(record.normal);
    let near = (n.dot(sight.p) - record.plane).abs() < sight.tolerance_m;
    if near { record.agreement(n.dot(sight.normal)) } else { 0.0 }
}

/// 1 where a place is the middle of a cell, 0 a cell away, the product over rows and columns. Past the first and last row
/// the picture goes on as it ends.
fn tent(chart: &Chart, row: usize, x: usize, place: Vec2) -> f32 {
    let n = chart.row(row).len() as f32;
    let down = row as f32 - (place.y - 0.5).clamp(0.0, chart.rows() as f32 - 1.0);
    let across = if chart.wraps() {
        let across = x as f32 - (place.x * n - 0.5);
        across - n * (across / n).round()
    } else {
        x as f32 - (place.x * n - 0.5).clamp(0.0, n - 1.0)
    };
    (1.0 - down.abs()).max(0.0) * (1.0 - across.abs()).max(0.0)
}

/// A tree over the positions, relative to the probe, of all records of surfaces, and the least cosine of incidence.
fn index(records: &Records) -> (KdTree<(usize, usize)>, f32) {
    let hits = &records.hits;
    let to_world = hits.to_probe.transpose();
    let mut entries = Vec::new();
    let mut grazing = 1.0f32;
    for row in 0..hits.chart.rows() {
        for (x, cell) in hits.chart.row(row).enumerate() {
            let record = &records.records[cell];
            if record.plane.is_finite() {
                let d = to_world * hits.chart.middle(row, x);
                let cos = -unpack_normal(record.normal).dot(d);
                grazing = grazing.min(cos);
                entries.push((d * (-record.plane / cos), (row, x)));
            }
        }
    }
    (KdTree::new(entries), grazing)
}

/// The chart and a search by radius agree at many points of a room, to 10⁻⁴ of what they say.
fn chart_equals_search(chart: Chart, picture: &Picture, sun: Option<Vec3>) {
    let scene = pillared_room();
    let origin = Vec3::new(0.1, -0.2, 0.05);
    let to_world = Mat3::from_rotation_z(0.4) * Mat3::from_rotation_x(0.2);
    let hits = Arc::new(Hits::shoot(&scene, origin, to_world, chart));
    let records = Records::new(&scene, hits.clone(), &measured(&hits.chart, picture, &Radiometry::default()), sun);
    let (tree, grazing) = index(&records);
    assert!(grazing > 0.1, "the room is made to be seen well: {grazing}");
    let (mut compared, mut edges, mut sunlit) = (0, 0, 0);
    for i in 0..2000 {
        // camera rays from another corner of the room, all around
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
        let (sin, cos) = (i as f32 * 2.4).sin_cos();
        let direction = Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
        let ray = Ray { origin: Vec3::new(-1.1, 1.3, -0.4), direction };
        let Some(hit) = scene.tracer.closest(&ray, 1e-3) else { continue };
        let surface = scene.surface(&ray, &hit);
        let observed = records.observe(&scene, surface.position, surface.normal);
        let p = surface.position - origin;
        let place = hits.chart.place(hits.to_probe * p);
        let (Some(place), true) = (place, surface.normal.dot(p) < 0.0) else {
            assert_eq!(observed.weight(), 0.0);
            continue;
        };
        let angle = hits.chart.cell_angle();
        let sight = Sight { p, normal: surface.normal, place, tolerance_m: p.length() * angle };
        // The footprint's bound: a record that counts is within two cells of the point's direction (row and column), and
        // its plane within one cell's width of the point, so it is that far along the plane ÷ the cosine of incidence.
        let radius_m = p.length() * angle * (2.0 + 3.0 / grazing);
        let hidden_by = |cell: usize| {
            let (hit, n) = (&hits.cells[cell], unpack_normal(hits.cells[cell].normal));
            hit.is_hit() && hides(n.dot(p) - hit.plane, n.dot(sight.normal), sight.tolerance_m)
        };
        let behind = hits.chart.around(place).iter().any(|&(cell, _)| hidden_by(cell));
        let (point, normal) = (surface.position, surface.normal);
        let admits = |cell: usize| !behind || hits.joined(&scene, cell, point, normal, sight.tolerance_m);
        let (searched, found) = search(&records, &tree, radius_m, &sight, admits);
        for (a, b) in [(observed.shade, searched.shade), (observed.sun, searched.sun), (observed.edge, searched.edge)] {
            assert!((a.weight - b.weight).abs() <= 1e-4 * b.weight + 1e-6, "{i}: {a:?} {b:?}");
            assert!((a.sum - b.sum).length() <= 1e-4 * b.sum.length() + 1e-6, "{i}: {a:?} {b:?}");
        }
        compared += usize::from(found > 0);
        edges += usize::from((1..4).contains(&found));
        sunlit += usize::from(searched.sun.weight > 0.0);
    }
    assert!(compared > 200 && edges > 5, "seen {compared}, at edges {edges}");
    assert_eq!(sunlit > 20, sun.is_some(), "in the sun {sunlit}");
}

#[test]
fn latlong_chart_equals_radius_search() {
    chart_equals_search(Chart::latlong(256, 128), &confetti(256, 128), None);
}

#[test]
fn latlong_chart_equals_radius_search_in_sun_and_shade() {
    let sun = Vec3::new(0.5, 0.3, 0.8).normalize();
    chart_equals_search(Chart::latlong(192, 96), &confetti(192, 96), Some(sun));
}

#[test]
fn perspective_chart_equals_radius_search() {
    chart_equals_search(Chart::perspective(160, 120, 1.2), &confetti(160, 120), None);
}
