//! How much each test suspects each pixel.

use crate::audit::likelihood::appearance::Texture;
use crate::audit::likelihood::structure::odds_of;
use crate::audit::picture::by_luminance::{BINS, Bins};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// Above these a pixel is marked. Each is some way above the greatest value that faultless models give but for a few
/// pixels at edges, which are too thin to become regions.
pub(crate) const ODDS: f32 = 3.0;
pub(crate) const COLOUR: f32 = 6.5;
pub(crate) const MISMATCH: f32 = 3.0;
pub(crate) const PIXELS_OFF: f32 = 0.7;
pub(crate) const GAIN: f32 = 250.0;
/// How many times better than what is left a displacement must explain a difference.
pub(crate) const RATIO: f32 = 1.0;
/// What is this many times as strong as half of the picture at its brightness is a fault, if it is above the threshold.
const NOISE: f32 = 5.0;
/// A piece of a texture is wrong as a whole from these odds on, with less than half of its structure there, if at least
/// this share of it has structure …
const PIECE_ODDS: f32 = 8.0;
const STRUCTURED_SHARE: f32 = 0.25;
/// … or if this share of it is marked.
const MARKED_SHARE: f32 = 0.6;
/// … or if three quarters of it have so many times the structure beyond the model's that three quarters of the picture have less of,
/// as a logarithm.
pub(crate) const LACKING: f32 = 0.7;
/// Fewer tested pixels tell nothing of a piece.
const PIECE_PX: usize = 60;
/// A pixel counts as marked from this share of the threshold on.
pub(crate) const LOW: f32 = 0.75;

/// Scores per pixel; 1 is the threshold.
pub(crate) struct Scores {
    pub(crate) texture: Vec<f32>,
    pub(crate) geometry: Vec<f32>,
}

impl Scores {
    pub(crate) fn of(observed: &Observations) -> Self {
        let (t, g) = (&observed.texture, &observed.geometry);
        let n = t.tested.len();
        // what most of the picture has at a brightness is the picture's noise there, and not the model's fault
        let bins = Bins::new(&observed.log_photo);
        let level = |values: &[f32], counts: &dyn Fn(usize) -> bool| bins.quantile(values, 0.5, counts);
        let tested = |i: usize| t.tested[i];
        let over = |values: &[f32], least: f32, times: f32, usual: [f32; BINS]| -> Vec<f32> {
            let of = |i: usize| values[i] / least.max(times * usual[bins.of[i]]);
            (0..n).map(|i| if t.tested[i] { of(i) } else { 0.0 }).collect()
        };
        let colour = over(&t.colour, COLOUR, NOISE, level(&t.colour, &tested));
        // over a whole piece, coding and noise average out
        let in_all = over(&t.piece_colour, COLOUR, NOISE, level(&t.piece_colour, &tested));
        let colour: Vec<f32> = colour.iter().zip(&in_all).map(|(c, p)| c.max(*p)).collect();
        let structure = |i: usize| if t.tested[i] { t.structure.odds[i] / ODDS } else { 0.0 };
        let mut texture: Vec<f32> = (0..n).map(|i| colour[i].max(structure(i))).collect();
        let geometry = (0..n)
            .map(|i| {
                let continued = observed.continued.score[i];
                if g.able[i] == 0 {
                    return continued;
                }
                let wrong = g.mismatch[i] / MISMATCH;
                let off = g.best_m[i].abs() * g.parallax[i] / PIXELS_OFF;
                let moved = (g.ratio[i] / RATIO).min(g.gain[i] / GAIN).min(off);
                wrong.max(moved).max(continued)
            })
            .collect();
        let segments = &observed.surfaces.segments;
        for (k, piece) in segments.pixels.iter().enumerate() {
            let whole = whole(t, &texture, observed.surfaces.width, piece);
            // however far off most colours of a picture are, paint that is another ends where its piece does
            let of_piece = |i: usize| segments.of[i] as usize == k;
            let step = if piece.len() < PIECE_PX { None } else { t.step(&observed.surfaces, piece, of_piece) };
            let step = step.map(|s| s / COLOUR);
            if let Some(score) = whole.into_iter().chain(step).reduce(f32::max) {
                piece.iter().for_each(|&i| texture[i] = texture[i].max(score));
            }
        }
        Self { texture, geometry }
    }

    /// The greater of both, to rank pixels by.
    pub(crate) fn both(&self) -> Vec<f32> {
        self.texture.iter().zip(&self.geometry).map(|(a, b)| a.max(*b)).collect()
    }
}

/// What three quarters of some pixels have more of than [`crate::audit::likelihood::structure::Structure::lacking`].
pub(crate) fn lacking(t: &Texture, pixels: &[usize]) -> f32 {
    let mut all: Vec<f32> = pixels.iter().filter(|i| t.tested[**i]).map(|i| t.structure.lacking[*i]).collect();
    quantile(&mut all, 0.25).unwrap_or(f32::NEG_INFINITY)
}

/// The score that all of a piece of texture deserves, if it is wrong as a whole.
fn whole(t: &Texture, scores: &[f32], width: usize, piece: &[usize]) -> Option<f32> {
    let tested: Vec<usize> = piece.iter().copied().filter(|i| t.tested[*i]).collect();
    if tested.len() < PIECE_PX {
        return None;
    }
    let marked: Vec<f32> = tested.iter().map(|i| scores[*i]).filter(|s| *s >= LOW).collect();
    let structured = tested.iter().filter(|i| t.structure.structured[**i]).count();
    // what no window tells by itself, all of them together may
    let as_one = marked.len() as f32 >= MARKED_SHARE * tested.len() as f32
        || {
            let enough = structured as f32 >= STRUCTURED_SHARE * tested.len() as f32;
            let (odds, slope) = if enough { odds_of(&t.structure, width, piece) } else { (0.0, 1.0) };
            odds >= PIECE_ODDS && slope < 0.5
        }
        || lacking(t, &tested) >= LACKING;
    as_one.then(|| (marked.iter().sum::<f32>() / marked.len().max(1) as f32).max(1.0))
}
