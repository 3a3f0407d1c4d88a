//! How much each test suspects each pixel.

use super::bins::{BINS, Bins};
use super::structure::odds_of;
use super::texture::Texture;
use super::view::Maps;

/// Above these a pixel is marked. Each is some way above the greatest value that faultless models give but for a few
/// pixels at edges, which are too thin to become regions.
pub(super) const ODDS: f32 = 3.0;
pub(super) const COLOUR: f32 = 6.5;
pub(super) const MISMATCH: f32 = 3.0;
pub(super) const PIXELS_OFF: f32 = 0.7;
pub(super) const GAIN: f32 = 250.0;
/// How many times better than what is left a displacement must explain a difference.
pub(super) const RATIO: f32 = 1.0;
/// What is this many times as strong as half of the picture at its brightness is a fault, if it is above the threshold.
const NOISE: f32 = 5.0;
/// A piece of a texture is wrong as a whole from these odds on, with less than half of its structure there, if at least
/// this share of it has structure …
const PIECE_ODDS: f32 = 8.0;
const STRUCTURED_SHARE: f32 = 0.25;
/// … or if this share of it is marked.
const MARKED_SHARE: f32 = 0.6;
/// Fewer tested pixels tell nothing of a piece.
const PIECE_PX: usize = 60;
/// A pixel counts as marked from this share of the threshold on.
pub(super) const LOW: f32 = 0.75;

/// Scores per pixel; 1 is the threshold.
pub(super) struct Scores {
    pub(super) texture: Vec<f32>,
    pub(super) geometry: Vec<f32>,
}

impl Scores {
    pub(super) fn of(maps: &Maps) -> Self {
        let (t, g) = (&maps.texture, &maps.geometry);
        let n = t.tested.len();
        // what most of the picture has at a brightness is the picture's noise there, and not the model's fault
        let bins = Bins::new(&maps.log_photo);
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
        let structure = |i: usize| if t.tested[i] { t.odds[i] / ODDS } else { 0.0 };
        let mut texture: Vec<f32> = (0..n).map(|i| colour[i].max(structure(i))).collect();
        let geometry = (0..n)
            .map(|i| {
                let bridged = maps.bridged.score[i];
                if g.able[i] == 0 {
                    return bridged;
                }
                let wrong = g.mismatch[i] / MISMATCH;
                let off = g.best_m[i].abs() * g.parallax[i] / PIXELS_OFF;
                let moved = (g.ratio[i] / RATIO).min(g.gain[i] / GAIN).min(off);
                wrong.max(moved).max(bridged)
            })
            .collect();
        for piece in &maps.surfaces.pieces.pixels {
            if let Some(score) = whole(t, &texture, maps.surfaces.width, piece) {
                piece.iter().for_each(|&i| texture[i] = texture[i].max(score));
            }
        }
        Self { texture, geometry }
    }

    /// The greater of both, to rank pixels by.
    pub(super) fn both(&self) -> Vec<f32> {
        self.texture.iter().zip(&self.geometry).map(|(a, b)| a.max(*b)).collect()
    }
}

/// The score that all of a piece of texture deserves, if it is wrong as a whole.
fn whole(t: &Texture, scores: &[f32], width: usize, piece: &[usize]) -> Option<f32> {
    let tested: Vec<usize> = piece.iter().copied().filter(|i| t.tested[*i]).collect();
    if tested.len() < PIECE_PX {
        return None;
    }
    let marked: Vec<f32> = tested.iter().map(|i| scores[*i]).filter(|s| *s >= LOW).collect();
    let structured = tested.iter().filter(|i| t.structured[**i]).count();
    // what no window tells by itself, all of them together may
    let as_one = marked.len() as f32 >= MARKED_SHARE * tested.len() as f32 || {
        let enough = structured as f32 >= STRUCTURED_SHARE * tested.len() as f32;
        let (odds, slope) = if enough { odds_of(t, width, piece) } else { (0.0, 1.0) };
        odds >= PIECE_ODDS && slope < 0.5
    };
    as_one.then(|| (marked.iter().sum::<f32>() / marked.len().max(1) as f32).max(1.0))
}
