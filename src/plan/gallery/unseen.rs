//! What guards leave unseen.

use crate::plan::free_space::contour::from_segment;
use crate::plan::free_space::noding::less;
use crate::plan::free_space::open_space::OpenSpace;
use crate::plan::free_space::polygon::{Polygon, Ring, ring_area};
use glam::DVec2;

/// What is not seen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unseen {
    /// Its area, hair-thin slivers included.
    pub(crate) area: f64,
    /// The faces that are no slivers, in no order.
    pub(crate) faces: Vec<Face>,
}

/// A connected part of what is not seen.
#[derive(Clone, Debug)]
pub(crate) struct Face {
    pub(crate) outline: Polygon,
    pub(crate) area: f64,
    /// A point well inside.
    pub(crate) middle: DVec2,
}

/// The open space less what the guards see. Faces that hold no circle of radius `clearance` (tried along a few lines)
/// are slivers.
pub(crate) fn unseen(open: &OpenSpace, guards: &[DVec2], clearance: f64) -> Unseen {
    let rings = guards.iter().filter_map(|g| Some(open.visibility(open.pulled_in(*g)?)?.ring));
    let seen: Vec<Polygon> = rings.filter(|r| r.len() > 2).map(|outer| Polygon { outer, holes: Vec::new() }).collect();
    let mut result = Unseen::default();
    for outline in less(open.polygons(), &seen) {
        let area: f64 = outline.rings().map(|r| ring_area(r)).sum();
        result.area += area.max(0.0);
        if let Some((middle, room)) = inner_point(&outline)
            && room >= clearance
        {
            result.faces.push(Face { outline, area, middle });
        }
    }
    result
}

/// The best of the middles of a polygon's widest chords at a few heights, and its distance from the border.
fn inner_point(polygon: &Polygon) -> Option<(DVec2, f64)> {
    let of_ring = |ring: &Ring| (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]]).collect::<Vec<_>>();
    let edges: Vec<[DVec2; 2]> = polygon.rings().flat_map(of_ring).collect();
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
