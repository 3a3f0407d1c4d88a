//! What a study measures error against: photographs, or a reference that knows its own noise.

pub(crate) mod views;

use glam::{DVec2, DVec3};

use super::metrics::blocks::Block;
use super::metrics::flip::flip_under;
use super::metrics::{TRIMMED, WINDOW, relative_floor, ssim_map, sum3, usable};
use crate::panorama::{Exposure, Picture};
use crate::site::Camera;

/// Side in pixels of the tiles that stand for a whole picture.
const TILE: u32 = 64;

/// So many blocks along the shorter side of a picture.
const BLOCKS_ALONG: usize = 4;

/// A rectangle of a picture: left, top, width and height in pixels.
pub(crate) type Rectangle = [u32; 4];

/// A part of a picture in which error is measured.
pub(crate) struct Tile {
    /// Where it is.
    pub(crate) at: Rectangle,
    /// The truth there.
    pub(crate) truth: Picture,
    /// Two independent measurements of it, if it has any: what they differ by is noise.
    pub(crate) halves: Option<[Picture; 2]>,
}

/// The truth of one view.
pub(crate) struct TruthView {
    /// The view's name.
    pub(crate) name: String,
    /// The view's camera.
    pub(crate) camera: Camera,
    /// Where error is measured: the whole picture, or some tiles of it.
    pub(crate) tiles: Vec<Tile>,
    /// The whole photograph, where the truth is one.
    pub(crate) photo: Option<Picture>,
    /// The exposure under which FLIP and SSIM look.
    exposure: Exposure,
    /// What keeps relative error from dividing by black: 0.01·(mean radiance)².
    floor: f64,
}

/// The tiles that stand for a picture: all of it for a `share` of 1, else tiles of 64 pixels a side that make up about that
/// share, spread evenly, at least one.
pub(crate) fn tiles(width: u32, height: u32, share: f64) -> Vec<Rectangle> {
    let side = TILE.min(width).min(height);
    let (columns, rows) = (width / side.max(1), height / side.max(1));
    let wanted = (share * f64::from(width) * f64::from(height) / f64::from(side * side)).round() as usize;
    if share >= 1.0 || wanted >= (columns * rows) as usize {
        return vec![[0, 0, width, height]];
    }
    let mut found: Vec<Rectangle> = Vec::new();
    for k in 0.. {
        // Roberts's additive recurrence on the plastic number
        let at = (DVec2::splat(0.5) + DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053) * f64::from(k)).fract();
        let cell = (at * DVec2::new(f64::from(columns), f64::from(rows))).as_uvec2() * side;
        let tile = [cell.x, cell.y, side, side];
        if !found.contains(&tile) {
            found.push(tile);
        }
        if found.len() >= wanted.max(1) {
            break;
        }
    }
    found
}

impl TruthView {
    /// The truth of a view; exposure and mean are those of `known`, all pixels whose truth is known.
    pub(crate) fn new(name: &str, camera: Camera, tiles: Vec<Tile>, known: &Picture) -> Self {
        let (exposure, floor) = (Exposure::of(known), relative_floor(&known.pixels));
        Self { name: name.to_owned(), camera, tiles, photo: None, exposure, floor }
    }

    /// A photograph as truth, in tiles that make up about a share of it.
    pub(crate) fn of_photo(name: &str, camera: Camera, photo: &Picture, share: f64) -> Self {
        let tile = |at| Tile { at, truth: cut(photo, at), halves: None };
        let tiles = tiles(camera.width, camera.height, share).into_iter().map(tile).collect();
        Self::new(name, camera, tiles, photo)
    }

    /// The share of the view's pixels that lie in tiles.
    pub(crate) fn share(&self) -> f64 {
        let inside: usize = self.tiles.iter().map(|t| t.truth.pixels.len()).sum();
        inside as f64 / (f64::from(self.camera.width) * f64::from(self.camera.height))
    }

    /// The tiles of a picture of the whole view.
    pub(crate) fn cut(&self, picture: &Picture) -> Vec<Picture> {
        self.tiles.iter().map(|t| cut(picture, t.at)).collect()
    }

    /// Number of blocks that [`TruthView::errors`] gives.
    pub(crate) fn blocks(&self) -> usize {
        self.tiles.iter().map(|t| grid(&t.truth).1).sum()
    }

    /// The errors of pictures of the tiles, block by block.
    pub(crate) fn errors(&self, pictures: &[Picture]) -> Vec<Block> {
        let mut all = Vec::new();
        // per counted pixel: its block, its error without and with the noise taken off
        let mut relative: Vec<(u32, f64, f64)> = Vec::new();
        for (tile, picture) in self.tiles.iter().zip(pictures) {
            let (side, count) = grid(&tile.truth);
            let first = all.len();
            let mut sums = vec![[0.0f64; 5]; count];
            let width = tile.truth.width;
            let columns = width.div_ceil(side);
            let block = |x: usize, y: usize| y / side * columns + x / side;
            let flip = flip_under(self.exposure, picture, &tile.truth);
            for (i, (&x, &t)) in picture.pixels.iter().zip(&tile.truth.pixels).enumerate() {
                let Some((x, t)) = usable(x, t) else { continue };
                let b = block(i % width, i / width);
                let plain = (x - t) * (x - t);
                let net = tile
                    .halves
                    .as_ref()
                    .map_or(plain, |[a, b]| (x - a.pixels[i].as_dvec3()) * (x - b.pixels[i].as_dvec3()));
                let weight = DVec3::ONE / (t * t + self.floor) / 3.0;
                relative.push(((first + b) as u32, sum3(plain * weight), sum3(net * weight)));
                let sum = &mut sums[b];
                sum[0] += 1.0;
                sum[1] += f64::from(flip[i]);
                sum[2] += sum3(net);
            }
            for (i, s) in ssim_map(picture, &tile.truth, self.exposure).into_iter().enumerate() {
                let across = width + 1 - WINDOW;
                let sum = &mut sums[block(i % across + WINDOW / 2, i / across + WINDOW / 2)];
                sum[3] += 1.0;
                sum[4] += s;
            }
            all.extend(sums.iter().map(|s| Block {
                pixels: s[0] as f32,
                flip: s[1] as f32,
                squared: s[2] as f32,
                windows: s[3] as f32,
                similarity: s[4] as f32,
                ..Block::default()
            }));
        }
        relative.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        relative.truncate(relative.len() - (relative.len() as f64 * TRIMMED) as usize);
        let mut sums = vec![(0u32, 0.0f64); all.len()];
        for (block, _, net) in relative {
            sums[block as usize].0 += 1;
            sums[block as usize].1 += net;
        }
        for (block, (kept, sum)) in all.iter_mut().zip(sums) {
            (block.kept, block.relative) = (kept as f32, sum as f32);
        }
        all
    }

    /// The noise of this truth, from its halves: its root mean square, which is half that of their difference, and FLIP of one
    /// half against the other, which is more visible than the truth's noise. `None` without halves.
    pub(crate) fn noise(&self) -> Option<[f64; 2]> {
        let (mut squares, mut flip, mut count) = (0.0, 0.0, 0usize);
        for tile in &self.tiles {
            let [a, b] = tile.halves.as_ref()?;
            squares += a.pixels.iter().zip(&b.pixels).map(|(a, b)| f64::from((*a - *b).length_squared())).sum::<f64>();
            flip += flip_under(self.exposure, a, b).iter().map(|e| f64::from(*e)).sum::<f64>();
            count += a.pixels.len();
        }
        Some([0.5 * (squares / (3.0 * count as f64)).sqrt(), flip / count as f64])
    }
}

/// Side of the blocks of a tile, and their number.
fn grid(tile: &Picture) -> (usize, usize) {
    let side = if tile.width.max(tile.height) <= TILE as usize {
        TILE as usize
    } else {
        (tile.width.min(tile.height) / BLOCKS_ALONG).max(8)
    };
    (side, tile.width.div_ceil(side) * tile.height.div_ceil(side))
}

/// The camera that sees a rectangle of what another sees, pixel for pixel as that does.
pub(crate) fn part_of(camera: &Camera, [x, y, width, height]: Rectangle) -> Camera {
    Camera { width, height, centre: camera.centre - DVec2::new(f64::from(x), f64::from(y)), ..*camera }
}

/// A rectangle of a picture.
pub(crate) fn cut(picture: &Picture, [x, y, width, height]: Rectangle) -> Picture {
    let [x, y, width, height] = [x, y, width, height].map(|v| v as usize);
    let row = |r: usize| &picture.pixels[r * picture.width + x..][..width];
    Picture { width, height, pixels: (y..y + height).flat_map(row).copied().collect() }
}

/// Pictures of the same width, one below the other.
pub(crate) fn stack(pictures: &[Picture]) -> Picture {
    let width = pictures.first().map_or(0, |p| p.width);
    let pixels = pictures.iter().flat_map(|p| p.pixels.iter().copied()).collect();
    Picture { width, height: pictures.iter().map(|p| p.height).sum(), pixels }
}

#[cfg(test)]
mod tests {
    use super::super::flip;
    use super::super::metrics::blocks::Metric;
    use super::super::{relmse, rmse, ssim};
    use super::*;
    use crate::site::{Camera, Pose};
    use glam::{DMat3, Vec3};

    fn waves(phase: f32) -> Picture {
        let mut p = Picture::new(96, 80);
        for (i, pixel) in p.pixels.iter_mut().enumerate() {
            let (x, y) = ((i % 96) as f32, (i / 96) as f32);
            *pixel = Vec3::new(1.5 + (0.3 * x + phase).sin(), 1.2 + (0.2 * y - phase).cos(), 1.0 + 0.01 * x * phase);
        }
        p
    }

    fn view(truth: &Picture, share: f64, halves: Option<[Picture; 2]>) -> TruthView {
        let pose = Pose { position: DVec3::ZERO, rotation: DMat3::IDENTITY };
        let camera = Camera::with_fov(pose, 96, 80, 60.0);
        let halves = |at| halves.as_ref().map(|h| h.each_ref().map(|h| cut(h, at)));
        let tile = |at| Tile { at, truth: cut(truth, at), halves: halves(at) };
        TruthView::new("v", camera, tiles(96, 80, share).into_iter().map(tile).collect(), truth)
    }

    #[test]
    fn blocks_add_up_to_the_plain_metrics() {
        let (truth, test) = (waves(0.3), waves(0.5));
        let view = view(&truth, 1.0, None);
        let blocks = view.errors(&view.cut(&test));
        assert_eq!((blocks.len(), view.blocks()), (20, 20));
        let expected = [
            rmse(&test.pixels, &truth.pixels),
            relmse(&test.pixels, &truth.pixels),
            flip(&test, &truth),
            ssim(&test, &truth),
        ];
        for (metric, expected) in Metric::ALL.into_iter().zip(expected) {
            let got = metric.over(&blocks, &[1.0; 20]);
            assert!((got / expected - 1.0).abs() < 1e-5, "{}: {got} {expected}", metric.name());
        }
    }

    #[test]
    fn a_truths_noise_is_taken_off() {
        let clean = waves(0.3);
        let noisy = |sign: f32| {
            let mut p = clean.clone();
            // far apart in frequency from the waves: independent of the test's error
            p.pixels.iter_mut().enumerate().for_each(|(i, p)| *p += sign * 0.1 * ((i * 7919 % 97) as f32 / 48.0 - 1.0));
            p
        };
        let (a, b) = (noisy(1.0), noisy(-1.0));
        let view = view(&clean, 1.0, Some([a, b]));
        let [noise, flip] = view.noise().unwrap();
        // half of |a − b| is the uniform draw itself, of spread 0.1/√3
        assert!((noise / (0.1 / 3f64.sqrt()) - 1.0).abs() < 0.03, "{noise}");
        assert!(flip > 0.0);
        let blocks = view.errors(&[waves(0.5)]);
        let net = Metric::Rmse.over(&blocks, &vec![1.0; blocks.len()]);
        let plain = rmse(&waves(0.5).pixels, &clean.pixels);
        assert!((net * net - (plain * plain - noise * noise)).abs() < 1e-3 * plain * plain);
    }

    #[test]
    fn tiles_are_apart_and_see_what_the_whole_sees() {
        let found = tiles(512, 512, 1.0 / 16.0);
        assert_eq!(found.len(), 4);
        for (i, a) in found.iter().enumerate() {
            assert!(a[0] + a[2] <= 512 && a[1] + a[3] <= 512);
            assert!(found[..i].iter().all(|b| a != b));
        }
        assert_eq!(tiles(40, 30, 0.01).len(), 1, "a small picture still has one");
        assert_eq!(tiles(512, 300, 1.0), [[0, 0, 512, 300]]);
        assert_eq!(tiles(96, 80, 0.5), [[0, 0, 96, 80]], "no room for tiles apart");
        let whole = view(&waves(0.3), 1.0, None);
        let at = [20, 9, 48, 40];
        let tile = Tile { at, truth: cut(&waves(0.3), at), halves: None };
        let view = TruthView::new("v", whole.camera, vec![tile], &waves(0.3));
        let through_tile = part_of(&view.camera, at).direction(3.5, 4.5);
        assert!((through_tile - whole.camera.direction(23.5, 13.5)).length() < 1e-12);
        assert!((view.share() - 0.25).abs() < 1e-12);
        assert_eq!(view.cut(&waves(0.3))[0], view.tiles[0].truth);
    }
}
