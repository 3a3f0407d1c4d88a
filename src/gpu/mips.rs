//! Pyramids of pictures as graphics cards want them: each side half of the last one's, rounded down.

use glam::Vec3;
use rayon::prelude::*;
use std::borrow::Cow;

use crate::panorama::{LINEAR, linear_to_code};
use crate::scene::Texture;

/// Size and sRGB texels of a level.
pub(super) type Level<'a> = ([usize; 2], Cow<'a, [[u8; 4]]>);

/// All levels of a texture, from the first whose sides are at most `side` texels. Where sides are powers of two they are the
/// texture's own, which rounds sides up elsewhere.
pub(super) fn levels(texture: &Texture, side: usize) -> Vec<Level<'_>> {
    let own = |level: usize| texture.level(level).map(|(size, texels)| (size, Cow::Borrowed(texels)));
    let mut levels: Vec<Level> = Vec::new();
    let mut next = own(0);
    for level in 1.. {
        let Some(last) = next else { break };
        let [width, height] = last.0;
        next = if width.max(height) == 1 {
            None
        } else if width.is_power_of_two() && height.is_power_of_two() && matches!(last.1, Cow::Borrowed(_)) {
            own(level)
        } else {
            let half = [width, height].map(|n| (n / 2).max(1));
            Some((half, Cow::Owned(reduced(last.0, &last.1, half))))
        };
        if width.max(height) <= side || next.is_none() {
            levels.push(last);
        }
    }
    levels
}

/// The texels that one of `fewer` covers of a row of `n`, with their shares.
fn covered(i: usize, n: usize, fewer: usize) -> impl Iterator<Item = (usize, f32)> {
    let wide = n as f32 / fewer as f32;
    let (start, end) = (i as f32 * wide, (i + 1) as f32 * wide);
    let share = move |t: usize| (t, ((t + 1) as f32).min(end) - (t as f32).max(start));
    (start as usize..n.min(end.ceil() as usize)).map(share).map(move |(t, s)| (t, s / wide))
}

/// A picture averaged down in linear light, every texel by the area that it has in the smaller one's.
fn reduced([width, height]: [usize; 2], texels: &[[u8; 4]], [fewer, lower]: [usize; 2]) -> Vec<[u8; 4]> {
    let linear: &[f32; 256] = &LINEAR;
    let texel = |x: usize, y: usize| {
        let mut sum = Vec3::ZERO;
        for (v, tall) in covered(y, height, lower) {
            for (u, wide) in covered(x, width, fewer) {
                let [r, g, b, _] = texels[v * width + u].map(|c| linear[usize::from(c)]);
                sum += Vec3::new(r, g, b) * (wide * tall);
            }
        }
        let [r, g, b] = sum.to_array().map(linear_to_code);
        [r, g, b, 255]
    };
    (0..fewer * lower).into_par_iter().map(|i| texel(i % fewer, i / fewer)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::srgb_to_linear;

    fn texture(width: usize, height: usize) -> Texture {
        let texel = |i: usize| [(i * 37 % 256) as u8, (i * 91 % 256) as u8, 128, 255];
        Texture::new(String::new(), width, height, (0..width * height).map(texel).collect())
    }

    /// Mean of the first channel, linear.
    fn mean((_, texels): &Level) -> f32 {
        texels.iter().map(|t| srgb_to_linear(f32::from(t[0]) / 255.0)).sum::<f32>() / texels.len() as f32
    }

    #[test]
    fn sides_are_halved_and_rounded_down_and_light_is_kept() {
        for (width, height) in [(64, 16), (63, 17), (5, 3), (1, 9), (1, 1), (100, 64)] {
            let texture = texture(width, height);
            let all = levels(&texture, 4096);
            for (k, level) in all.iter().enumerate() {
                assert_eq!(level.0, [width, height].map(|n| (n >> k).max(1)), "{width} × {height}, level {k}");
                assert_eq!(level.1.len(), level.0[0] * level.0[1]);
                assert!((mean(level) / mean(&all[0]) - 1.0).abs() < 0.02, "{width} × {height}, level {k}");
                assert!(level.1.iter().all(|t| t[2] == 128), "what is even stays even");
            }
            assert_eq!(all.len(), (width.max(height)).ilog2() as usize + 1);
        }
    }

    #[test]
    fn a_picture_too_large_for_a_card_begins_at_a_level_that_it_holds() {
        let texture = texture(100, 64);
        let sizes: Vec<_> = levels(&texture, 32).iter().map(|l| l.0).collect();
        assert_eq!(sizes, [[25, 16], [12, 8], [6, 4], [3, 2], [1, 1]]);
        // powers of two are taken as they are
        assert!(levels(&self::texture(64, 16), 4096).iter().all(|l| matches!(l.1, Cow::Borrowed(_))));
    }
}
