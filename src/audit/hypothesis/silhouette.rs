//! Silhouette matching: where in a picture a part's outline fits best, by correlation at all small shifts.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::hypothesis::FARTHEST_M;
use crate::audit::likelihood::step::BESIDE;
use crate::audit::picture::regions::{bounds, dilated, mask_of};
use crate::audit::picture::{FEWEST, POSE_PX, correlation};
use crate::audit::view::{AuditScene, Observations};
use crate::components::members;
use crate::edge_aware::EdgeAware;
use crate::panorama::luminance;
use crate::statistics::median;

/// The test works on pictures of about this size.
const SIDE: usize = 512;

/// Less than so many times what half of the outlines are off by is no shift.
const TIMES: f32 = 4.0;

/// With fewer outlines than this nobody knows what they are usually off by: then less than so many pixels is no shift.
const ENOUGH: usize = 5;
const ALONE_PX: f32 = 1.25;

/// Structure is what is finer than the second of these standard deviations and coarser than the first, pixels.
const BAND: [f32; 2] = [0.7, 6.0];

/// Neighbouring pixels along an outline are alike: so many tell as much as one.
const ALIKE_PX: f32 = 8.0;

/// Correlation from which on an outline counts as found.
pub(crate) const FOUND: f32 = 0.6;

/// What outlines are off by together, pixels, and by how much more than that one must be to be off its place: a pose is
/// trusted as far as parts agree.
pub(crate) fn registration(shifts: &[[f32; 2]]) -> ([f32; 2], f32) {
    if shifts.len() < ENOUGH {
        return ([0.0; 2], ALONE_PX);
    }
    let common = [0, 1].map(|c| median(shifts.iter().map(|s| s[c])).unwrap_or(0.0));
    let off = |s: &[f32; 2]| (s[0] - common[0]).hypot(s[1] - common[1]);
    (common, POSE_PX.max(TIMES * median(shifts.iter().map(off)).unwrap_or(0.0)))
}

/// Where a part's outline fits best.
pub(crate) struct Fit<'a> {
    pub(crate) members: &'a [usize],
    /// Pixels to the right and down.
    pub(crate) shift: [f32; 2],
    /// Correlation where it fits best.
    pub(crate) best: f32,
    /// Logarithm of the odds against its own place, after all the shifts that are tried.
    pub(crate) odds: f32,
}

/// The pictures at the test's size.
pub(crate) struct Small {
    /// Pixels of the audit's size to a pixel, along each side.
    pub(crate) by: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Focal length in pixels.
    focal: f32,
    pub(crate) part: Vec<u32>,
    pub(crate) distance: Vec<f32>,
    /// Structure of what the model makes: in the probes' light, and its albedo in smooth light. Where a part is off its
    /// place, what the probes saw of the real one is in the first and not in the second.
    models: [Vec<f32>; 2],
    /// Where a probe sees the surface: elsewhere its light is a guess, and so is what the first shows.
    seen: Vec<bool>,
    photo: Vec<f32>,
    /// 1 where the photograph can be used.
    usable: Vec<f32>,
}

impl Small {
    pub(crate) fn new(prepared: &AuditScene, observed: &Observations) -> Self {
        let s = &observed.surfaces;
        let by = s.width.max(s.height).div_ceil(SIDE);
        let (width, height) = (s.width / by, s.height / by);
        let middle = |i: usize| (i / width * by + by / 2) * s.width + i % width * by + by / 2;
        let mean = |f: &(dyn Fn(usize) -> f32 + Sync)| -> Vec<f32> {
            let of = |i: usize| {
                let first = i / width * by * s.width + i % width * by;
                let all = (0..by * by).map(|k| f(first + k / by * s.width + k % by));
                all.sum::<f32>() / (by * by) as f32
            };
            (0..width * height).into_par_iter().map(of).collect()
        };
        let usable: Vec<f32> =
            mean(&|i| observed.usable[i]).iter().map(|u| if *u > 0.99 { 1.0 } else { 0.0 }).collect();
        let ln = |v: f32| v.max(1e-6).ln();
        let photo = mean(&|i| {
            if observed.log_photo[i].is_finite() { ln(luminance(observed.log_photo[i].map(f32::exp))) } else { 0.0 }
        });
        let lit = |i: usize| ln(luminance(observed.render.pixels[i].max(Vec3::ZERO)));
        let plain = |i: usize| {
            let smooth = luminance(observed.albedo[i] * observed.irradiance[i]);
            if smooth > 0.0 { ln(smooth / std::f32::consts::PI) } else { lit(i) }
        };
        let seen = mean(&|i| f32::from(observed.sights.of.iter().any(|probe| probe[i].is_some())));
        let all = vec![1.0; width * height];
        let open = EdgeAware::open(width, height);
        let band = |values: &[f32], weights: &[f32]| -> Vec<f32> {
            let [fine, coarse] = BAND.map(|sigma| open.mean(values, weights, sigma));
            fine.iter().zip(&coarse).map(|(f, c)| (f - c).clamp(-1.0, 1.0)).collect()
        };
        Self {
            by,
            width,
            height,
            focal: s.focal / by as f32,
            part: (0..width * height).map(|i| prepared.part(s.triangle[middle(i)])).collect(),
            distance: (0..width * height).map(|i| s.distance[middle(i)]).collect(),
            models: [band(&mean(&lit), &all), band(&mean(&plain), &all)],
            seen: seen.iter().map(|s| *s > 0.5).collect(),
            photo: band(&photo, &usable),
            usable,
        }
    }

    /// Each part's pixels, by its number.
    pub(crate) fn members(&self) -> Vec<Vec<usize>> {
        members(&self.part)
    }

    /// The shift at which a part's outline fits the photograph best.
    pub(crate) fn fit<'a>(&self, members: &'a [usize]) -> Option<Fit<'a>> {
        let (w, h) = (self.width, self.height);
        let part = self.part[*members.first()?];
        let behind = |i: usize, j: usize| self.part[j] != part && self.distance[j] > self.distance[i] * (1.0 + BESIDE);
        // the side on which a pixel steps: left, right, above, below
        let side = |i: usize| {
            let (x, y) = (i % w, i / w);
            [
                x > 0 && behind(i, i - 1),
                x + 1 < w && behind(i, i + 1),
                y > 0 && behind(i, i - w),
                y + 1 < h && behind(i, i + w),
            ]
            .into_iter()
            .position(|steps| steps)
        };
        let outline: Vec<(usize, usize)> = members.iter().filter_map(|i| Some((*i, side(*i)?))).collect();
        if outline.len() < FEWEST {
            return None;
        }
        let reach = self.reach(members);
        // what is around it, each pixel with one side
        let mut free = vec![true; w * h];
        let sides = [0, 1, 2, 3].map(|side| {
            let own: Vec<usize> = outline.iter().filter(|o| o.1 == side).map(|o| o.0).collect();
            let near = dilated(&mask_of(&own, w * h), w, h, 2);
            (0..w * h).filter(|i| near[*i] && std::mem::take(&mut free[*i])).collect::<Vec<_>>()
        });
        let seen = sides.each_ref().map(|side| side.iter().copied().filter(|i| self.seen[*i]).collect());
        let fits = self.models.iter().zip([seen, sides]);
        let fits = fits.filter_map(|(model, sides)| self.fit_of(model, members, &sides, reach));
        fits.reduce(|a, b| if b.best > a.best { b } else { a })
    }

    /// Furthest shift of a part along each side, pixels: no farther off its place than it is long, or than is looked for.
    fn reach(&self, members: &[usize]) -> isize {
        let [left, top, right, bottom] = bounds(members, self.width);
        let distance = median(members.iter().map(|i| self.distance[*i])).unwrap_or(f32::INFINITY);
        let farthest = (FARTHEST_M * self.focal / distance).ceil() as usize;
        farthest.min((right - left).max(bottom - top)) as isize
    }

    /// The same for one picture of the model, over the pixels around an outline's sides (left, right, above, below), for shifts up to `reach`
    /// along each axis. Each side tells by itself: what has moved fits there on all of them; where a shadow ends as one side would, the others
    /// do not. It tells of a shift so far as that goes across it: along itself an edge is the same everywhere.
    fn fit_of<'a>(
        &self,
        model: &[f32],
        members: &'a [usize],
        sides: &[Vec<usize>; 4],
        reach: isize,
    ) -> Option<Fit<'a>> {
        let band = sides.concat();
        if band.len() < FEWEST {
            return None;
        }
        let at = |dx: isize, dy: isize| self.correlation(model, &band, [dx, dy]);
        let mut best = (f32::NEG_INFINITY, [0, 0]);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (c, _) = at(dx, dy);
                if c > best.0 {
                    best = (c, [dx, dy]);
                }
            }
        }
        let (best, [x, y]) = best;
        if x.abs() == reach || y.abs() == reach {
            return None;
        }
        // finer: the parabola through the best and its neighbours
        let finer = |before: f32, after: f32| {
            let bend = before + after - 2.0 * best;
            if bend < -1e-6 && bend.is_finite() { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let shift =
            [x as f32 + finer(at(x - 1, y).0, at(x + 1, y).0), y as f32 + finer(at(x, y - 1).0, at(x, y + 1).0)];
        if at(0, 0).1 == 0.0 {
            return None;
        }
        let odds = |side: &Vec<usize>| {
            let [(own, _), (best, told)] = [[0, 0], [x, y]].map(|shift| self.correlation(model, side, shift));
            let gap = |c: f32| (1.0 - c.clamp(0.0, 0.99).powi(2)).ln();
            if told > 0.0 && own.is_finite() { 0.5 * told / ALIKE_PX * (gap(own) - gap(best)) } else { 0.0 }
        };
        let shifts = ((2 * reach + 1) as f32).powi(2).ln();
        let [right, down] = [x, y].map(|d| (d * d) as f32 / (x * x + y * y).max(1) as f32);
        let odds = sides.iter().zip([right, right, down, down]).map(|(side, across)| across * odds(side)).sum::<f32>()
            - shifts;
        Some(Fit { members, shift, best, odds })
    }

    /// Correlation of the model's structure with the photograph's at a shift, and over how many pixels.
    fn correlation(&self, model: &[f32], band: &[usize], [dx, dy]: [isize; 2]) -> (f32, f32) {
        let (w, h) = (self.width as isize, self.height as isize);
        let pairs = band.iter().filter_map(|&i| {
            let (x, y) = (i as isize % w + dx, i as isize / w + dy);
            let inside = x >= 0 && y >= 0 && x < w && y < h;
            let j = inside.then(|| (y * w + x) as usize)?;
            (self.usable[j] != 0.0).then(|| (model[i], self.photo[j]))
        });
        let (c, n) = correlation(pairs);
        // what is mostly shifted out of the picture is not compared
        if n < 0.7 * band.len() as f64 { (f32::NEG_INFINITY, 0.0) } else { (c, n as f32) }
    }

    /// Shifted pixels of this size as those of the audit's, in order.
    pub(crate) fn at_full_size(&self, observed: &Observations, members: &[usize], [dx, dy]: [isize; 2]) -> Vec<usize> {
        let mut all = vec![];
        for &i in members {
            let (x, y) = ((i % self.width) as isize + dx, (i / self.width) as isize + dy);
            if x < 0 || y < 0 || x >= self.width as isize || y >= self.height as isize {
                continue;
            }
            for k in 0..self.by * self.by {
                let (x, y) = (x as usize * self.by + k % self.by, y as usize * self.by + k / self.by);
                all.push(y * observed.surfaces.width + x);
            }
        }
        all.sort_unstable();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_are_trusted_as_far_as_they_agree() {
        // too few to know
        assert_eq!(registration(&[[3.0, 0.0]; ENOUGH - 1]), ([0.0; 2], ALONE_PX));
        // a pose that is a little off is no fault of the parts
        let mut shifts = vec![[0.5, -0.2]; ENOUGH];
        shifts.push([4.0, 0.0]);
        assert_eq!(registration(&shifts), ([0.5, -0.2], POSE_PX));
        // nor is one among many that scatter
        let wide: Vec<[f32; 2]> = (0..8).map(|k| [if k % 2 == 0 { 0.5 } else { -0.5 }, 0.0]).collect();
        assert!(registration(&wide).1 >= TIMES * 0.5);
    }

    const WIDE: usize = 64;

    /// Whether a pixel is within a square of 20 pixels, so far from the left.
    fn within(i: usize, left: usize) -> bool {
        (left..left + 20).contains(&(i % WIDE)) && (22..42).contains(&(i / WIDE))
    }

    /// A square 20 pixels from the left before a wall, as the model and as the photograph have it.
    fn small(model: impl Fn(usize) -> f32, photo: impl Fn(usize) -> f32) -> Small {
        let all = |shown: &dyn Fn(usize) -> f32| (0..WIDE * WIDE).map(shown).collect::<Vec<f32>>();
        Small {
            by: 1,
            focal: 100.0,
            width: WIDE,
            height: WIDE,
            part: (0..WIDE * WIDE).map(|i| u32::from(within(i, 20))).collect(),
            distance: all(&|i| if within(i, 20) { 2.0 } else { 4.0 }),
            models: [all(&model), all(&model)],
            seen: vec![true; WIDE * WIDE],
            photo: all(&photo),
            usable: vec![1.0; WIDE * WIDE],
        }
    }

    fn hash(k: usize) -> f32 {
        ((k.wrapping_mul(2_654_435_761) >> 7) % 1000) as f32 / 1000.0 - 0.5
    }

    /// A patterned square before a patterned wall, and a photograph in which it stands so many pixels beside.
    fn square(beside: usize) -> Small {
        let shown =
            |i: usize, left: usize| if within(i, left) { 0.4 + 0.5 * hash(i - left) } else { 0.3 * hash(i + 7777) };
        small(|i| shown(i, 20), |i| shown(i, 20 + beside))
    }

    #[test]
    fn a_part_is_found_where_its_outline_fits() {
        for beside in [0, 4] {
            let small = square(beside);
            let members = small.members();
            let fit = small.fit(&members[1]).unwrap();
            let off = (fit.shift[0] - beside as f32).hypot(fit.shift[1]);
            assert!(off < 0.3 && (fit.odds > 0.0) == (beside > 0), "{:?}, odds {}", fit.shift, fit.odds);
            // the wall ends nowhere before something
            assert!(small.fit(&members[0]).is_none());
        }
    }

    #[test]
    fn a_shadow_that_ends_as_one_side_would_is_no_other_place() {
        // the right half is in the sun, up to four pixels from the edge
        let shown = |i: usize, lit: usize| {
            let light = if !within(i, 20) || i % WIDE >= lit { 0.0 } else { [0.1, 0.6][usize::from(i % WIDE >= 30)] };
            light + 0.02 * hash(i)
        };
        let small = small(|i| shown(i, 40), |i| shown(i, 36));
        let fit = small.fit(&small.members()[1]).map(|fit| (fit.shift, fit.odds));
        assert!(fit.is_some_and(|([right, _], odds)| (right + 4.0).abs() < 0.5 && odds < 0.0), "{fit:?}");
    }

    #[test]
    fn what_lies_along_an_edge_does_not_tell_of_a_shift_along_it() {
        // a plain board of 48 by 8 pixels before a wall whose pattern is three pixels beside the model's
        let board = |i: usize| (28..36).contains(&(i / WIDE)) && (8..56).contains(&(i % WIDE));
        let shown = |i: usize, beside: usize| {
            let around = (24..40).contains(&(i / WIDE));
            if board(i) || !around { 0.0 } else { hash(i / WIDE * 97 + (i % WIDE + WIDE - beside) % WIDE) }
        };
        let mut small = small(|i| shown(i, 0), |i| shown(i, 3));
        small.part = (0..WIDE * WIDE).map(|i| u32::from(board(i))).collect();
        small.distance = (0..WIDE * WIDE).map(|i| if board(i) { 2.0 } else { 4.0 }).collect();
        let members = small.members();
        let fit = small.fit(&members[1]).unwrap();
        // its ends are 8 pixels each, which say too little
        assert!(fit.shift[0] > 2.5 && fit.best > 0.9 && fit.odds < 5.0, "{:?}, odds {}", fit.shift, fit.odds);
    }
}
