//! Pieces whose paint ends where the photograph goes on.
//!
//! Over a flat surface light goes on, and paint ends where its piece does. At a right piece's borders the photograph steps as the
//! model's albedo does; where it goes on instead, the model's paint is not in the room, be it another picture, another colour or
//! another brightness. The borders of all that is mapped in one piece are looked at together, so that faint paint is told, too.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::hypothesis::recoloured::{ASIDE, FEWEST, across_borders};
use crate::audit::likelihood::agreement::unit;
use crate::audit::likelihood::structure::BLACK;
use crate::audit::view::Observations;
use crate::statistics::median;

/// Two places lie on one flat surface if the line between them leaves either by less than this sine of an angle.
const FLAT: f32 = 0.1;

/// Degrees of freedom of Student's distribution, which what is off about paint and light follows: some of it is far off.
const FREEDOM: f32 = 3.0;

/// A piece whose borders may not be in the photograph.
pub(crate) struct Unseen {
    /// Its number among the segments.
    pub(crate) piece: usize,
    /// Logarithm of the odds that the photograph goes on over half of the borders, a place on them for one sample: what is off about
    /// paint or light is so all along them.
    pub(crate) odds: f32,
    /// The share of its borders with other materials that these are: on one flat surface with a greater piece.
    pub(crate) told: f32,
}

/// What the borders of the picture's pieces say: each border of the smaller of its two pieces, the greater being what it lies in.
pub(crate) fn unseen_borders(observed: &Observations, least: usize) -> Vec<Unseen> {
    let (s, t) = (&observed.surfaces, &observed.texture);
    let flat = |[i, j]: [usize; 2]| {
        let line = s.position[j] - s.position[i];
        let most = FLAT * line.length();
        line.dot(s.normal[i]).abs() <= most && line.dot(s.normal[j]).abs() <= most
    };
    let tested = |[i, j]: [usize; 2]| t.tested[i] && t.tested[j];
    let size = |i: usize| s.segments.pixels[s.segments.of[i] as usize].len();
    let albedo = |i: usize| (observed.albedo[i] + Vec3::splat(BLACK)).map(f32::ln);
    // what differs within pieces over as many pixels is no paint's step
    let unit = {
        let far = 2 * ASIDE as usize + 1;
        let along = (0..s.width * s.height).filter(|i| i % s.width + far < s.width).map(|i| [i, i + far]);
        let pairs = along.filter(|[i, j]| s.segments.of[*i] == s.segments.of[*j]);
        let differences: Vec<Vec3> = pairs.filter(|p| tested(*p)).map(|[i, j]| t.ratio[i] - t.ratio[j]).collect();
        unit(differences)
    };
    let one = |piece: usize| {
        let pixels = &s.segments.pixels[piece];
        if pixels.len() < least {
            return None;
        }
        let inside = |i: usize| s.segments.of[i] as usize == piece;
        let across = across_borders(s.width, &s.material, &s.distance, pixels, inside);
        let all = across.len();
        let beside = across.into_iter().filter(|p| tested(*p) && flat(*p) && size(p[1]) > pixels.len());
        let odds: Vec<f32> = beside
            .map(|[i, j]| {
                let model = albedo(i) - albedo(j);
                let photograph = model + t.ratio[i] - t.ratio[j];
                unlikeliness(unit * (photograph - model)) - unlikeliness(unit * photograph)
            })
            .collect();
        let told = odds.len() as f32 / all.max(1) as f32;
        (odds.len() >= FEWEST).then(|| Unseen { piece, odds: median(odds).unwrap_or(0.0), told })
    };
    (0..s.segments.pixels.len()).into_par_iter().filter_map(one).collect()
}

/// The negative logarithm of the density of what is off about a step, but for a constant.
fn unlikeliness(off: Vec3) -> f32 {
    0.5 * (FREEDOM + 3.0) * (off.length_squared() / FREEDOM).ln_1p()
}
