//! Which parts of a scan the photograph shows laid otherwise than the model has them.
//!
//! A scan is not mapped in pieces. So it is looked at through windows, and where one shows another laying, that is followed over the
//! surface for as far as it tells more of the photograph than the model's own.

use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeSet;

use crate::audit::hypothesis::laying::independent::independent;
use crate::audit::hypothesis::laying::plane_picture::Plane;
use crate::audit::hypothesis::laying::retextured::{Relaid, laying_odds, near, searched, tried};
use crate::audit::hypothesis::laying::texture_alignment::{TexturePatch, UvTransform, tested};
use crate::audit::likelihood::structure;
use crate::audit::picture::ODDS;
use crate::audit::view::Observations;
use crate::scene::Scene;

/// Sides of the windows that a scan is looked at through, pixels, and of the squares that a part of it is made of.
const WINDOW_PX: usize = 64;
const SQUARE_PX: usize = 16;

/// A window on one smooth surface.
struct Window {
    plane: Plane,
    tested: Vec<usize>,
}

impl Window {
    /// The part of a surface that was tested around a pixel, if that is a third of the window and more.
    fn around(observed: &Observations, label: u32, middle: [usize; 2]) -> Option<Self> {
        let (w, h) = observed.size();
        let half = WINDOW_PX / 2;
        let side = |at: usize, most: usize| at.saturating_sub(half)..(at + half).min(most);
        let all = side(middle[1], h).flat_map(|y| side(middle[0], w).map(move |x| y * w + x));
        let tested: Vec<usize> =
            all.filter(|i| observed.texture.tested[*i] && observed.surfaces.label[*i] == label).collect();
        if 3 * tested.len() < WINDOW_PX * WINDOW_PX {
            return None;
        }
        Some(Self { plane: Plane::of(observed, &tested)?, tested })
    }

    fn patch<'a>(&self, observed: &'a Observations) -> Option<TexturePatch<'a>> {
        TexturePatch::on(&self.plane, observed, &self.tested)
    }
}

/// Another laying in space: what the photograph shows at one point the model has at another, and so on all around.
struct Laying {
    from: Vec3,
    to: Vec3,
    /// But for its shift, which is another on each patch.
    transform: UvTransform,
}

impl Laying {
    fn new(plane: &Plane, patch: &TexturePatch, transform: UvTransform) -> Self {
        // a picture repeats, the plane does not: the nearest place
        let shift = transform.shift - transform.shift.round();
        Self { from: plane.point(patch.centre), to: plane.point(patch.centre + shift), transform }
    }

    /// The same on another patch.
    fn on(&self, plane: &Plane, patch: &TexturePatch) -> UvTransform {
        let step = self.transform.turn * plane.gradient.step(plane.point(patch.centre) - self.from);
        let shift = plane.at(self.to + plane.along(step)) - patch.centre;
        UvTransform { shift, ..self.transform }
    }
}

/// Parts of a scan that the photograph shows laid otherwise: their pixels, and how.
pub(crate) fn parts(scene: &Scene, observed: &Observations) -> Vec<(Vec<usize>, Relaid)> {
    if scene.mesh.colours.is_empty() {
        return Vec::new();
    }
    let (w, h) = observed.size();
    let side = |most: usize| (WINDOW_PX / 2..most).step_by(WINDOW_PX);
    let middles: Vec<[usize; 2]> = side(h).flat_map(|y| side(w).map(move |x| [x, y])).collect();
    let mut seeds: Vec<([usize; 2], Laying, Relaid, f32)> = middles
        .par_iter()
        .filter_map(|&middle| {
            let window = Window::around(observed, label(observed, middle), middle)?;
            // only where the photograph does not follow the model's own structure
            if structure::odds_of(&observed.texture.structure, w, &window.tested).0 <= 0.0 {
                return None;
            }
            let patch = window.patch(observed)?;
            let told = tried(&patch, middles.len());
            let found = searched(&patch, told, observed.placement.usual_m(&window.tested))?;
            Some((middle, Laying::new(&window.plane, &patch, found.transform), found, told))
        })
        .collect();
    seeds.sort_by(|a, b| b.2.odds.total_cmp(&a.2.odds).then(a.0.cmp(&b.0)));
    let mut taken = vec![false; w * h];
    let mut parts = Vec::new();
    for (middle, laying, found, told) in &seeds {
        if taken[middle[1] * w + middle[0]] {
            continue;
        }
        let (pixels, part) = followed(observed, *middle, laying, *found);
        pixels.iter().for_each(|i| taken[*i] = true);
        if part.odds > *told {
            parts.push((pixels, part));
        }
    }
    parts
}

/// The smooth surface in a pixel.
fn label(observed: &Observations, [x, y]: [usize; 2]) -> u32 {
    observed.surfaces.label[y * observed.surfaces.width + x]
}

/// Follows a laying over a surface, from a window that shows it to its neighbours.
fn followed(observed: &Observations, from: [usize; 2], laying: &Laying, found: Relaid) -> (Vec<usize>, Relaid) {
    let (w, h) = observed.size();
    let label = label(observed, from);
    let start = from.map(|v| v / SQUARE_PX);
    let mut asked = BTreeSet::from([start]);
    let mut edge = vec![start];
    let mut part: Vec<([usize; 2], [f32; 2])> = Vec::new();
    while !edge.is_empty() {
        let told: Vec<_> = edge
            .into_par_iter()
            .filter_map(|square| {
                let window = Window::around(observed, label, square.map(|v| v * SQUARE_PX + SQUARE_PX / 2))?;
                let patch = window.patch(observed)?;
                let (as_is, _) = near(&patch, UvTransform::AS_IS);
                let (best, _) = near(&patch, laying.on(&window.plane, &patch));
                let odds = patch.independent() * laying_odds(as_is, best);
                (odds > ODDS).then_some((square, [as_is, best]))
            })
            .collect();
        edge = Vec::new();
        for (square, values) in told {
            part.push((square, values));
            let [x, y] = square;
            for next in [[x + 1, y], [x.wrapping_sub(1), y], [x, y + 1], [x, y.wrapping_sub(1)]] {
                if next[0] < w.div_ceil(SQUARE_PX) && next[1] < h.div_ceil(SQUARE_PX) && asked.insert(next) {
                    edge.push(next);
                }
            }
        }
    }
    let mean = |of: &dyn Fn(&[f32; 2]) -> f32| part.iter().map(|p| of(&p.1)).sum::<f32>() / part.len().max(1) as f32;
    let squares: BTreeSet<[usize; 2]> = part.iter().map(|p| p.0).collect();
    let of =
        |i: &usize| observed.surfaces.label[*i] == label && squares.contains(&[i % w / SQUARE_PX, i / w / SQUARE_PX]);
    let pixels: Vec<usize> = (0..w * h).filter(of).collect();
    // what goes on from window to window, such as an edge, tells no more in all of them than in one
    let structure = &observed.texture.structure;
    let tested = tested(observed, &pixels);
    let [photo, model] = [0, 1].map(|k| tested.iter().map(|i| structure.bands[k][*i]).collect::<Vec<f32>>());
    let weight: Vec<f32> = tested.iter().map(|i| structure.weight(*i)).collect();
    let told = independent(w, &tested, [&photo, &model], &weight);
    let odds = told * mean(&|[as_is, best]| laying_odds(*as_is, *best));
    (pixels, Relaid { odds, as_is: mean(&|p| p[0]), best: mean(&|p| p[1]), ..found })
}
