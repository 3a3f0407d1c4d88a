//! How well a photograph shows a texture that is laid otherwise than the model has it: turned, mirrored, scaled or shifted.

use glam::{Mat2, Vec2};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use crate::audit::hypothesis::laying::independent::independent;
use crate::audit::hypothesis::laying::plane_picture::Plane;
use crate::audit::likelihood::structure::BAND;
use crate::audit::observe::uv_islands::Gradient;
use crate::audit::picture::fourier::{Complex, Fourier};
use crate::audit::picture::regions::{MOST_PX, bounds};
use crate::audit::picture::{EVEN, FEWEST, log_luminance};
use crate::audit::view::Observations;
use crate::edge_aware::EdgeAware;
use crate::scene::{Scene, Texture};

/// Sides of the grids that a texture's period is divided into.
const SIDES: [usize; 2] = [32, 128];

/// Sides of the blocks of pixels that are looked at where there are more than [`MOST_PX`].
const BLOCK_PX: usize = 32;

/// A box around pixels that is larger than this is not looked at whole, either.
const BOX_PX: usize = 8 * MOST_PX;

/// A pixel's place in a texture: its middle, and how far the pixel reaches to its right and down.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) at: Vec2,
    right: Vec2,
    down: Vec2,
    /// How far it moves when the surface comes a metre towards the camera's side.
    parallax: Vec2,
}

/// Pixels that show one texture, cut out of the picture.
pub(crate) struct TexturePatch<'a> {
    texture: Cow<'a, Texture>,
    /// Which of the cut-out's pixels hang together.
    filter: EdgeAware,
    /// Per pixel of the cut-out, 1 where there is a place, and the same smoothed.
    here: Vec<f32>,
    smoothed: Vec<f32>,
    /// The pixels' indices in the picture, and that one's width.
    seen_in: Vec<usize>,
    width: usize,
    /// Their indices in the cut-out, places, the structure that the photograph shows there and how much it counts.
    pixels: Vec<usize>,
    pub(crate) places: Vec<Place>,
    pub(crate) photo: Vec<f32>,
    pub(crate) weight: Vec<f32>,
    /// Middle of the places.
    pub(crate) centre: Vec2,
    /// Covariance of the patch of texture that a disk of radius 1 pixel has as its own: [uu, uv, vv].
    pub(crate) spread: [f32; 3],
    pub(crate) fourier: Fourier,
    pub(crate) side: usize,
    /// Transform of the texture's logarithm of brightness over the grid, x and y exchanged.
    pub(crate) period: Vec<Complex>,
}

/// A turn and scale of a texture about a middle, a shift, and how far the surface is off its place, metres towards the
/// camera's side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UvTransform {
    pub(crate) turn: Mat2,
    pub(crate) shift: Vec2,
    pub(crate) off_m: f32,
}

impl UvTransform {
    /// As the model has it.
    pub(crate) const AS_IS: Self = Self { turn: Mat2::IDENTITY, shift: Vec2::ZERO, off_m: 0.0 };
}

impl<'a> TexturePatch<'a> {
    /// Takes those of the pixels that could be tested and have the texture that most of them have; `None` where they are too
    /// few, or most have none.
    pub(crate) fn mapped(scene: &'a Scene, observed: &Observations, pixels: &[usize]) -> Option<Self> {
        let s = &observed.surfaces;
        let texture_of = |i: usize| scene.materials[s.material[i] as usize].texture;
        let tested = tested(observed, pixels);
        let mut votes = vec![0usize; scene.textures.len()];
        tested.iter().filter_map(|i| texture_of(*i)).for_each(|t| votes[t as usize] += 1);
        let (id, _) = votes.iter().enumerate().max_by_key(|(_, v)| **v).filter(|(_, v)| 2 * **v > tested.len())?;
        Self::at(Cow::Borrowed(&scene.textures[id]), observed, &tested, |i| {
            let at = scene.mesh.uv(s.triangle[i], s.barycentric[i]).filter(|_| texture_of(i) == Some(id as u32))?;
            place(observed, i, at, &Gradient::of(&scene.mesh, s.triangle[i])?)
        })
    }

    /// The same, the texture being what the view shows of the model in the plane in which most of the pixels lie; `None` also where they
    /// do not.
    pub(crate) fn in_plane(observed: &Observations, pixels: &[usize]) -> Option<Self> {
        let tested = tested(observed, pixels);
        Self::on(&Plane::of(observed, &tested)?, observed, &tested)
    }

    /// The same of pixels that could be tested, in a plane of theirs.
    pub(crate) fn on(plane: &Plane, observed: &Observations, tested: &[usize]) -> Option<Self> {
        let position = &observed.surfaces.position;
        Self::at(Cow::Owned(plane.picture(observed, 2 * SIDES[1])), observed, tested, |i| {
            if plane.holds(observed, i) { place(observed, i, plane.at(position[i]), &plane.gradient) } else { None }
        })
    }

    /// Takes a texture, and of the pixels those that have a place in it.
    fn at(
        texture: Cow<'a, Texture>,
        observed: &Observations,
        tested: &[usize],
        place: impl Fn(usize) -> Option<Place>,
    ) -> Option<Self> {
        let s = &observed.surfaces;
        let stride = tested.len().div_ceil(MOST_PX);
        let w = s.width;
        let block = |i: usize| (i % w / BLOCK_PX, i / w / BLOCK_PX);
        let in_turn = |(x, y): (usize, usize)| (x + y).is_multiple_of(stride);
        let chosen: Vec<(usize, Place)> =
            tested.iter().filter(|i| in_turn(block(**i))).filter_map(|i| place(*i).map(|p| (*i, p))).collect();
        if chosen.len() < FEWEST {
            return None;
        }
        let (all, places): (Vec<usize>, Vec<Place>) = chosen.into_iter().unzip();
        let joined = |i: usize, j: usize| s.paint.joined(i, j);
        let [left, top, right, bottom] = bounds(&all, w);
        let in_blocks = stride > 1 || (right - left) * (bottom - top) > BOX_PX;
        let (filter, pixels) = if !in_blocks {
            cut_out(right - left, bottom - top, &all, |i| (i / w - top) * (right - left) + i % w - left, joined)
        } else {
            // blocks one below the other, without what lies between them
            let blocks: BTreeSet<(usize, usize)> = all.iter().map(|i| block(*i)).collect();
            let slots: BTreeMap<(usize, usize), usize> = blocks.into_iter().zip(0..).collect();
            let inside = |i: usize| (slots[&block(i)] * BLOCK_PX + i / w % BLOCK_PX) * BLOCK_PX + i % w % BLOCK_PX;
            let joined = |i: usize, j: usize| block(i) == block(j) && joined(i, j);
            cut_out(BLOCK_PX, slots.len() * BLOCK_PX, &all, inside, joined)
        };
        // the albedo as it is, times what the photograph says it would have to be multiplied by
        let real = |i: &usize| log_luminance(observed.albedo[*i] * observed.texture.ratio[*i].map(f32::exp));
        let photo: Vec<f32> = all.iter().map(real).collect();
        let weight = all.iter().map(|i| observed.texture.structure.weight(*i)).collect();
        Some(Self { seen_in: all, width: w, ..Self::new(texture, filter, pixels, places, photo.into_iter(), weight) })
    }

    /// Takes a cut-out of a picture, which is all of it until told otherwise, its pixels that have a place in the texture, those places, the
    /// logarithm of what the photograph shows of the texture there and how much it counts.
    fn new(
        texture: Cow<'a, Texture>,
        filter: EdgeAware,
        pixels: Vec<usize>,
        places: Vec<Place>,
        photo: impl Iterator<Item = f32>,
        weight: Vec<f32>,
    ) -> Self {
        let mut here = vec![0.0f32; filter.width * filter.height];
        pixels.iter().for_each(|k| here[*k] = 1.0);
        let smoothed = filter.smoothed(&here, BAND);
        let (n, width) = (places.len() as f32, filter.width);
        let centre = places.iter().map(|p| p.at).sum::<Vec2>() / n;
        let spread = places.iter().fold([0.0; 3], |sum, p| {
            let (r, d) = (p.right, p.down);
            let own = [r.x * r.x + d.x * d.x, r.x * r.y + d.x * d.y, r.y * r.y + d.y * d.y];
            [0, 1, 2].map(|k| sum[k] + own[k] / n)
        });
        // as many steps to a period as it has pixels along the side that has more of them
        let pixels_across = 1.0 / spread[0].min(spread[2]).sqrt().max(1e-6);
        let side = (pixels_across as usize).next_power_of_two().clamp(SIDES[0], SIDES[1]);
        let fourier = Fourier::new(side);
        let (across, along) = texture.size();
        let level = Texture::level_of(across.max(along) as f32 / side as f32);
        let step = 1.0 / side as f32;
        let at = |k: usize| Vec2::new((k % side) as f32, (k / side) as f32) * step;
        let period = fourier.forward((0..side * side).map(|k| log_luminance(texture.sample(at(k), level))));
        let mut this = Self {
            texture,
            filter,
            here,
            smoothed,
            seen_in: pixels.clone(),
            width,
            pixels,
            places,
            photo: Vec::new(),
            weight,
            centre,
            spread,
            fourier,
            side,
            period,
        };
        this.photo = this.structure(photo);
        this
    }

    /// How many of the pixels count as independent of each other.
    pub(crate) fn independent(&self) -> f32 {
        independent(self.width, &self.seen_in, [&self.photo, &self.shown(UvTransform::AS_IS)], &self.weight)
    }

    /// The texture's width over its height, texels.
    pub(crate) fn aspect(&self) -> f32 {
        let (w, h) = self.texture.size();
        w as f32 / h as f32
    }

    /// Length in pixels of a shift, but for whole periods.
    pub(crate) fn length_px(&self, shift: Vec2) -> f32 {
        (shift - shift.round()).abs().dot(self.pixel().recip().min(Vec2::splat(1e6)))
    }

    /// By how many pixels the texture moves when the surface comes a metre towards the camera's side.
    pub(crate) fn parallax_px(&self) -> f32 {
        let mean = self.places.iter().map(|p| p.parallax).sum::<Vec2>() / self.places.len() as f32;
        (mean.abs() / self.pixel()).element_sum()
    }

    /// About how far a pixel reaches along each side of the texture.
    fn pixel(&self) -> Vec2 {
        Vec2::new(self.spread[0].sqrt(), self.spread[2].sqrt()).max(Vec2::splat(1e-6))
    }

    /// What is not smooth of values at the places.
    fn structure(&self, values: impl Iterator<Item = f32>) -> Vec<f32> {
        let mut plane = vec![0.0f32; self.here.len()];
        self.pixels.iter().zip(values).for_each(|(k, v)| plane[*k] = v);
        let smooth = self.filter.mean_with(&plane, &self.here, &self.smoothed, BAND);
        self.pixels.iter().map(|k| plane[*k] - smooth[*k]).collect()
    }

    /// The structure of the texture laid so.
    fn shown(&self, UvTransform { turn, shift, off_m }: UvTransform) -> Vec<f32> {
        self.structure(self.places.iter().map(|p| {
            let at = self.centre + turn * (p.at - self.centre) + shift + p.parallax * off_m;
            log_luminance(self.texture.patch(at, turn * p.right, turn * p.down, Texture::APART))
        }))
    }

    /// Correlation between the photograph's structure and that of the texture laid so.
    pub(crate) fn fit(&self, transform: UvTransform) -> f32 {
        let shown = self.shown(transform);
        let [mut sum, mut aa, mut bb, mut ab] = [0.0f32; 4];
        for ((a, b), w) in self.photo.iter().zip(&shown).zip(&self.weight) {
            sum += w;
            aa += w * a * a;
            bb += w * b * b;
            ab += w * a * b;
        }
        if aa.min(bb) < EVEN * sum { 0.0 } else { ab / (aa * bb).sqrt() }
    }

    /// Goes from a shift to where the fit is best near by, in ever shorter steps, the first of them this long (pixels).
    pub(crate) fn climbed(&self, from: UvTransform, first_px: f32, halvings: u32) -> (f32, UvTransform) {
        let mut best = (self.fit(from), from);
        for k in 0..=halvings {
            let step = self.pixel() * (first_px * 0.5f32.powi(k as i32));
            for d in [Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y] {
                let next = UvTransform { shift: best.1.shift + d * step, ..best.1 };
                let fit = self.fit(next);
                if fit > best.0 {
                    best = (fit, next);
                }
            }
        }
        best
    }

    /// The grid's step in pixels, along the side where it is longer.
    pub(crate) fn step_px(&self) -> f32 {
        self.pixel().recip().max_element() / self.side as f32
    }
}

/// Puts pixels of a picture into a smaller one, which `inside` gives their places in: which of its pixels hang together,
/// and where they are.
fn cut_out(
    width: usize,
    height: usize,
    pixels: &[usize],
    inside: impl Fn(usize) -> usize,
    joined: impl Fn(usize, usize) -> bool,
) -> (EdgeAware, Vec<usize>) {
    let mut from = vec![usize::MAX; width * height];
    let places: Vec<usize> = pixels.iter().map(|i| inside(*i)).collect();
    places.iter().zip(pixels).for_each(|(k, i)| from[*k] = *i);
    let both = |k: usize, l: usize| from[k] != usize::MAX && from[l] != usize::MAX && joined(from[k], from[l]);
    (EdgeAware::new(width, height, both), places)
}

pub(crate) fn tested(observed: &Observations, pixels: &[usize]) -> Vec<usize> {
    pixels.iter().copied().filter(|i| observed.texture.tested[*i]).collect()
}

/// What a pixel shows of a texture, where that has such a place and changes so along the surface; `None` without extent.
fn place(observed: &Observations, i: usize, at: Vec2, gradient: &Gradient) -> Option<Place> {
    let s = &observed.surfaces;
    // where a neighbour's ray meets the pixel's plane
    let step = |j: usize| {
        let height = s.normal[i].dot(s.position[i] - s.origin);
        let along = s.normal[i].dot(s.ray[j]);
        let to = s.origin + s.ray[j] * (height / along.min(-1e-6));
        gradient.step(to - s.position[i])
    };
    let (x, y) = (i % s.width, i / s.width);
    // at the picture's end, the way back; a picture of one pixel has neither
    let side = |at: usize, end: usize, next: usize| {
        if at + 1 < end { Some(step(i + next)) } else { (at > 0).then(|| -step(i - next)) }
    };
    let (right, down) = (side(x, s.width, 1)?, side(y, s.height, s.width)?);
    // where the ray meets the surface once it is off its place, brought back along the normal
    let (normal, ray) = (s.normal[i], s.ray[i]);
    let parallax = gradient.step(ray / normal.dot(ray).min(-1e-3) - normal);
    let finite = right.is_finite() && down.is_finite() && parallax.is_finite();
    finite.then_some(Place { at, right, down, parallax })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::reference::random::splitmix64;

    /// Side of a photograph that shows a texture straight on, half a period of it.
    const SIDE: usize = 48;

    /// Blotches of a few texels, the same left and right but for some.
    pub(crate) fn blotches() -> Texture {
        let value = |i: usize| splitmix64((i % 96 / 3 + i / 96 / 3 * 32) as u64) % 160 + 60;
        let texels = (0..96 * 96).map(|i| [value(i) as u8, value(i) as u8, value(i) as u8, 255]).collect();
        Texture::new("blotches".to_owned(), 96, 96, texels)
    }

    /// A photograph that shows the texture laid so, with noise of so many times its contrast.
    pub(crate) fn photographed(texture: &Texture, transform: UvTransform, noise: f32) -> TexturePatch<'_> {
        let step = 1.0 / 96.0;
        let place = |k: usize| Place {
            at: Vec2::new((k % SIDE) as f32 + 0.5, (k / SIDE) as f32 + 0.5) * step,
            right: Vec2::X * step,
            down: Vec2::Y * step,
            // seen slantwise, from nearer on the left
            parallax: Vec2::new(4.0 + (k % SIDE) as f32 / SIDE as f32, 2.0) * 0.1,
        };
        let places: Vec<Place> = (0..SIDE * SIDE).map(place).collect();
        let hash = |k: usize| ((k * 2_654_435_761) >> 9) % 1000;
        let middle = Vec2::splat(0.25);
        let photo: Vec<f32> = places
            .iter()
            .enumerate()
            .map(|(k, p)| {
                let at = middle + transform.turn * (p.at - middle) + transform.shift + p.parallax * transform.off_m;
                let shown = texture.patch(at, transform.turn * p.right, transform.turn * p.down, Texture::APART);
                log_luminance(shown) + noise * (hash(k) as f32 / 500.0 - 1.0)
            })
            .collect();
        let filter = EdgeAware::open(SIDE, SIDE);
        TexturePatch::new(
            Cow::Borrowed(texture),
            filter,
            (0..SIDE * SIDE).collect(),
            places,
            photo.into_iter(),
            vec![1.0; SIDE * SIDE],
        )
    }

    #[test]
    fn the_grid_has_its_peak_where_the_texture_lies() {
        let texture = blotches();
        let turn = Mat2::from_cols(Vec2::Y, Vec2::NEG_X);
        let shift = Vec2::new(0.3, 0.71);
        let laid = photographed(&texture, UvTransform { turn, shift, off_m: 0.0 }, 0.3);
        let (coarse, at) = laid.shifts(turn)[0];
        assert!(coarse > 0.4 && laid.length_px(at - shift) < 2.0, "{coarse} at {at}");
        let (fine, climbed) = laid.climbed(UvTransform { turn, shift: at, off_m: 0.0 }, 1.0, 2);
        assert!(fine > 0.7 && laid.length_px(climbed.shift - shift) < 0.5, "{fine} at {:?}", climbed.shift);
        assert!(laid.fit(UvTransform::AS_IS).abs() < 0.2);
    }
}
