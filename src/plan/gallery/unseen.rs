//! What guards leave unseen.

use crate::plan::free_space::contour::from_segment;
use crate::plan::free_space::noding::{less, union};
use crate::plan::free_space::open_space::OpenSpace;
use crate::plan::visibility::isovist::{Isovist, Scratch};
use glam::DVec2;

/// What is not seen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unseen {
    /// Its area, hair-thin slivers included.
    pub(crate) area: f64,
    /// A point well inside each face that is no sliver, and the face's area; largest first.
    pub(crate) faces: Vec<(DVec2, f64)>,
    /// Those faces' rings, in no order.
    pub(crate) rings: Vec<Vec<Vec<DVec2>>>,
}

/// The open space less what the guards see. Faces that hold no circle of radius `clearance` (tried along a few lines)
/// are slivers.
pub(crate) fn unseen(open: &OpenSpace, guards: &[DVec2], clearance: f64) -> Unseen {
    let mut buffers = (Scratch::default(), Isovist::default());
    let mut seen = Vec::new();
    for &g in guards {
        let inside = open.pulled_in(g).is_some_and(|g| open.visibility_into(g, &mut buffers.0, &mut buffers.1));
        if inside && buffers.1.ring.len() > 2 {
            seen.push(vec![buffers.1.ring.iter().map(DVec2::to_array).collect::<Vec<_>>()]);
        }
    }
    let left = less(&region(open), &union(&seen));
    let mut result = Unseen::default();
    for shape in &left {
        let area: f64 = shape.iter().map(|c| area(c)).sum();
        result.area += area.max(0.0);
        if let Some((p, room)) = inner_point(shape)
            && room >= clearance
        {
            result.faces.push((p, area));
            result.rings.push(shape.iter().map(|c| c.iter().map(|&p| p.into()).collect()).collect());
        }
    }
    result.faces.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.x.total_cmp(&b.0.x)).then(a.0.y.total_cmp(&b.0.y)));
    result
}

type Contour = Vec<[f64; 2]>;

/// The polygons as shapes, borders turning left, holes right.
fn region(open: &OpenSpace) -> Vec<Vec<Contour>> {
    let turned = |ring: &Vec<DVec2>, left: bool| {
        let mut contour: Contour = ring.iter().map(DVec2::to_array).collect();
        if (area(&contour) > 0.0) != left {
            contour.reverse();
        }
        contour
    };
    let shape = |p: &crate::plan::free_space::polygon::Polygon| {
        std::iter::once(turned(&p.outer, true)).chain(p.holes.iter().map(|h| turned(h, false))).collect()
    };
    open.polygons().iter().map(shape).collect()
}

fn area(contour: &[[f64; 2]]) -> f64 {
    let points: Vec<DVec2> = contour.iter().map(|&p| DVec2::from(p)).collect();
    crate::plan::free_space::polygon::ring_area(&points)
}

/// The best of the middles of a shape's widest chords at a few heights, and its distance from the border.
fn inner_point(shape: &[Contour]) -> Option<(DVec2, f64)> {
    let edges: Vec<[DVec2; 2]> = shape
        .iter()
        .flat_map(|c| (0..c.len()).map(move |i| [DVec2::from(c[i]), DVec2::from(c[(i + 1) % c.len()])]))
        .collect();
    let mut ys: Vec<f64> = edges.iter().map(|e| e[0].y).collect();
    ys.sort_by(f64::total_cmp);
    ys.dedup();
    let (low, high) = (*ys.first()?, *ys.last()?);
    let mut gaps: Vec<(f64, f64)> = ys.windows(2).map(|w| (w[1] - w[0], (w[0] + w[1]) / 2.0)).collect();
    gaps.sort_by(|a, b| b.0.total_cmp(&a.0));
    let heights = gaps.iter().take(6).map(|g| g.1).chain([0.5, 0.37].map(|t| low + (high - low) * t));
    let mut best: Option<(DVec2, f64)> = None;
    for y in heights {
        let mut xs: Vec<f64> = edges
            .iter()
            .filter(|[a, b]| (a.y > y) != (b.y > y))
            .map(|[a, b]| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x))
            .collect();
        xs.sort_by(f64::total_cmp);
        for pair in xs.chunks_exact(2) {
            let p = DVec2::new((pair[0] + pair[1]) / 2.0, y);
            let room = edges.iter().map(|[a, b]| from_segment(p, *a, *b)).fold(f64::INFINITY, f64::min);
            if best.is_none_or(|(_, r)| room > r) {
                best = Some((p, room));
            }
        }
    }
    best
}
