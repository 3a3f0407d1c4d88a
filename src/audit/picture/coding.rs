//! What JPEG coding has taken from a photograph.
//!
//! A coder cuts the picture into blocks of 8 × 8 pixels, transforms each by cosines and rounds every coefficient to whole
//! steps (ITU-T T.81, annex A.3). What is less than half a step is gone, so that a model whose structure has it there is
//! no less right for it: differences that the coder hides are none. Which coefficients are gone, and how long the steps
//! are, shows in the picture itself (Fan and de Queiroz, *Identification of bitmap compression history*, 2003), so that
//! it does not matter what kind of file a coded picture came in.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::picture::FEWEST;
use crate::panorama::{linear_to_srgb, luminance};

/// Pixels along each side of a block, and in all.
const SIDE: usize = 8;
const BLOCK: usize = SIDE * SIDE;

/// Coefficients of a decoded picture may be this far from whole steps: its pixels are whole numbers.
const ROUNDING: f32 = 1.2;

/// Longest step that is looked for; a coder has up to 255, but not where anything is left.
const LONGEST: usize = 64;

/// Shorter steps, in whole numbers of pixels' values, hide nothing that matters.
const SHORTEST: usize = 3;

/// Mean cosine of coefficients in units of a step, a turn for each, from which on they come in such steps: 1 if all do.
const IN_STEPS: f32 = 0.6;

type Block = [f32; BLOCK];

/// How a photograph is coded.
pub(crate) struct Coding {
    width: usize,
    /// Length of a step, per coefficient.
    step: Block,
    /// Per block, which coefficients are not zero.
    kept: Vec<u64>,
    /// Per pixel, by how much its value grows with the logarithm of its light.
    slope: Vec<f32>,
}

/// The pixels of a set that lie in one block.
struct Part {
    kept: u64,
    /// Index in the set, place in the block, and the pixel's slope.
    pixels: Vec<(u32, u8, f32)>,
}

/// Some of a coded photograph's pixels, by the blocks that they lie in.
pub(crate) struct Coded {
    step: Block,
    parts: Vec<Part>,
}

impl Coding {
    /// Looks for the blocks of a linear picture whose white is 1; `None` where it shows none.
    pub(crate) fn of(width: usize, height: usize, pixels: &[Vec3]) -> Option<Self> {
        let across = width.div_ceil(SIDE);
        // beyond the picture's end, its last pixels
        let at = |b: usize, k: usize| {
            let (x, y) = (b % across * SIDE + k % SIDE, b / across * SIDE + k / SIDE);
            y.min(height - 1) * width + x.min(width - 1)
        };
        let value: Vec<f32> = pixels.iter().map(|p| brightness(*p)).collect();
        let blocks: Vec<Block> = (0..across * height.div_ceil(SIDE))
            .into_par_iter()
            .map(|b| cosines(std::array::from_fn(|k| value[at(b, k)])))
            .collect();
        // what is cut off at black or white has moved from its step
        let whole = |p: Vec3| p.is_finite() && p.min_element() > 0.0 && p.max_element() < 1.0;
        let entire = |b: &usize| (0..BLOCK).all(|k| whole(pixels[at(*b, k)]));
        let told: Vec<&Block> = (0..blocks.len()).filter(entire).map(|b| &blocks[b]).collect();
        let step = steps(&told)?;
        let kept = |b: &Block| (0..BLOCK).filter(|k| 2.0 * b[*k].abs() >= step[*k]).fold(0, |bits, k| bits | 1 << k);
        let slope = pixels.iter().map(|p| slope(*p)).collect();
        Some(Self { width, step, kept: blocks.iter().map(kept).collect(), slope })
    }

    /// Sorts pixels, given by their indices in the picture, by their blocks.
    pub(crate) fn coded(&self, pixels: &[usize]) -> Coded {
        let mut parts: Vec<Option<Part>> = self.kept.iter().map(|_| None).collect();
        for (k, &i) in pixels.iter().enumerate() {
            let (x, y) = (i % self.width, i / self.width);
            let block = y / SIDE * self.width.div_ceil(SIDE) + x / SIDE;
            let part = parts[block].get_or_insert_with(|| Part { kept: self.kept[block], pixels: Vec::new() });
            part.pixels.push((k as u32, (y % SIDE * SIDE + x % SIDE) as u8, self.slope[i]));
        }
        Coded { step: self.step, parts: parts.into_iter().flatten().collect() }
    }
}

impl Coded {
    /// Takes from structure, logarithms of brightness, the waves that the coder dropped from the photograph and would have
    /// dropped from this.
    pub(crate) fn leave(&self, structure: &mut [f32]) {
        for part in &self.parts {
            let mut waves = part.waves(structure);
            for (k, wave) in waves.iter_mut().enumerate() {
                if part.kept >> k & 1 == 0 && 2.0 * wave.abs() < self.step[k] {
                    *wave = 0.0;
                }
            }
            let block = from_cosines(waves);
            part.pixels.iter().for_each(|&(i, at, slope)| structure[i as usize] = block[usize::from(at)] / slope);
        }
    }
}

impl Part {
    /// The block's waves, of what of a set's values lies in it.
    fn waves(&self, values: &[f32]) -> Block {
        let mut block = [0.0; BLOCK];
        self.pixels.iter().for_each(|&(i, at, slope)| block[usize::from(at)] = slope * values[i as usize]);
        cosines(block)
    }
}

/// Brightness as a coder sees it: of the values that are stored, 0 to 255, from their middle.
fn brightness(p: Vec3) -> f32 {
    let stored = |v: f32| if v.is_finite() { linear_to_srgb(v.clamp(0.0, 1.0)) } else { 1.0 };
    255.0 * Vec3::new(0.299, 0.587, 0.114).dot(p.map(stored)) - 128.0
}

/// By how much a stored value grows with the logarithm of its light.
fn slope(p: Vec3) -> f32 {
    let light = luminance(p).clamp(1e-3, 1.0);
    let far = 0.05f32;
    255.0 * (linear_to_srgb(light * far.exp()) - linear_to_srgb(light * (-far).exp())) / (2.0 * far)
}

/// The lengths of the steps that coefficients come in; `None` where most of those that tell come in none.
fn steps(blocks: &[&Block]) -> Option<Block> {
    let (mut telling, mut told) = (0, 0);
    let mut steps = [0.0f32; BLOCK];
    for k in 0..BLOCK {
        let sizes: Vec<f32> = blocks.iter().map(|b| b[k].abs()).filter(|s| *s > ROUNDING).collect();
        if sizes.len() >= FEWEST {
            telling += 1;
            if let Some(step) = step(&sizes) {
                told += 1;
                steps[k] = step;
            }
        } else {
            // steps are longer for finer waves, and this one's are too long for anything to be left
            let coarser = [(k >= SIDE).then(|| k - SIDE), (k % SIDE > 0).then(|| k - 1)];
            steps[k] = coarser.into_iter().flatten().fold(0.0, |m, c| m.max(steps[c]));
        }
    }
    (told > 0 && 2 * told >= telling).then_some(steps)
}

/// The step that these sizes come in, if they do.
fn step(sizes: &[f32]) -> Option<f32> {
    let in_steps = |step: usize| {
        let turns = sizes.iter().map(|s| s / step as f32).filter(|t| *t > 0.5);
        let (sum, count) = turns.fold((0.0f32, 0), |(s, n), t| (s + (std::f32::consts::TAU * t).cos(), n + 1));
        if count < FEWEST { 0.0 } else { sum / count as f32 }
    };
    let all = (SHORTEST..=LONGEST).map(|step| (in_steps(step), step));
    let best = all.fold((IN_STEPS, 0), |best, one| if one.0 > best.0 { one } else { best });
    (best.1 > 0).then_some(best.1 as f32)
}

/// The transform's rows: orthonormal cosines.
fn rows() -> &'static [[f32; SIDE]; SIDE] {
    static ROWS: std::sync::OnceLock<[[f32; SIDE]; SIDE]> = std::sync::OnceLock::new();
    ROWS.get_or_init(|| {
        std::array::from_fn(|u| {
            let scale = if u == 0 { 1.0 / SIDE as f32 } else { 2.0 / SIDE as f32 }.sqrt();
            std::array::from_fn(|x| scale * (std::f32::consts::PI * u as f32 * (x as f32 + 0.5) / SIDE as f32).cos())
        })
    })
}

/// The coefficients of a block, rows of falling waves' length from the top.
fn cosines(block: Block) -> Block {
    let rows = rows();
    let across: Block =
        std::array::from_fn(|k| (0..SIDE).map(|x| rows[k % SIDE][x] * block[k / SIDE * SIDE + x]).sum());
    std::array::from_fn(|k| (0..SIDE).map(|y| rows[k / SIDE][y] * across[y * SIDE + k % SIDE]).sum())
}

/// And back.
fn from_cosines(waves: Block) -> Block {
    let rows = rows();
    let down: Block = std::array::from_fn(|k| (0..SIDE).map(|v| rows[v][k / SIDE] * waves[v * SIDE + k % SIDE]).sum());
    std::array::from_fn(|k| (0..SIDE).map(|u| rows[u][k % SIDE] * down[k / SIDE * SIDE + u]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::srgb_to_linear;

    const WIDE: usize = 128;

    /// Noise of some contrast, with fine waves fainter than long ones, as a decoded picture with steps of this length; or
    /// as it is.
    fn picture(step: Option<f32>) -> Vec<Vec3> {
        let hash = |k: usize| ((k * 2_654_435_761) >> 9) % 1000;
        let mut stored = vec![0.0f32; WIDE * WIDE];
        for b in 0..WIDE / SIDE * (WIDE / SIDE) {
            let wave =
                |k: usize| 60.0 * (hash(b * BLOCK + k) as f32 / 500.0 - 1.0) / (1.0 + (k / SIDE + k % SIDE) as f32);
            let rounded = |v: f32| step.map_or(v, |s| (v / s).round() * s);
            let block = from_cosines(std::array::from_fn(|k| rounded(wave(k))));
            for (k, v) in block.iter().enumerate() {
                let (x, y) = (b % (WIDE / SIDE) * SIDE + k % SIDE, b / (WIDE / SIDE) * SIDE + k / SIDE);
                stored[y * WIDE + x] = (v + 128.0).round();
            }
        }
        stored.iter().map(|v| Vec3::splat(srgb_to_linear(v / 255.0))).collect()
    }

    #[test]
    fn cosines_go_there_and_back() {
        let block: Block = std::array::from_fn(|k| (k * 37 % 64) as f32);
        let waves = cosines(block);
        assert!((waves[0] - block.iter().sum::<f32>() / SIDE as f32).abs() < 1e-3);
        assert!(from_cosines(waves).iter().zip(block).all(|(a, b)| (a - b).abs() < 1e-3));
    }

    #[test]
    fn a_picture_shows_the_steps_that_it_was_coded_with() {
        assert!(Coding::of(WIDE, WIDE, &picture(None)).is_none());
        for step in [6.0, 11.0] {
            let coding = Coding::of(WIDE, WIDE, &picture(Some(step))).unwrap();
            let told = coding.step.iter().filter(|s| **s == step).count();
            assert!(told > BLOCK / 2, "{told} of {step}: {:?}", coding.step);
        }
    }

    #[test]
    fn what_coding_drops_is_no_structure_and_what_it_keeps_is() {
        let mut photo = picture(Some(11.0));
        let even = Vec3::splat(srgb_to_linear(128.0 / 255.0));
        // one block without anything in it
        (0..BLOCK).for_each(|k| photo[k / SIDE * WIDE + k % SIDE] = even);
        let coding = Coding::of(WIDE, WIDE, &photo).unwrap();
        let first: Vec<usize> = (0..BLOCK).map(|k| k / SIDE * WIDE + k % SIDE).collect();
        let coded = coding.coded(&first);
        let checks = |contrast: f32| -> Vec<f32> {
            (0..BLOCK).map(|k| if (k / 4 % 2 + k / 32) % 2 == 0 { contrast } else { -contrast }).collect()
        };
        let (mut faint, mut strong) = (checks(0.005), checks(0.3));
        coded.leave(&mut faint);
        coded.leave(&mut strong);
        assert!(faint.iter().all(|v| v.abs() < 1e-6), "{faint:?}");
        assert!(strong.iter().zip(checks(0.3)).all(|(a, b)| a * b > 0.0));
    }
}
