//! Irradiance over a tile of pixels, asked for only where it changes.
//!
//! Irradiance varies slowly along a surface, albedo fast (Ward and Heckbert, *Irradiance gradients*, 1992). So it is
//! asked for on a lattice eight pixels wide; between lattice points of one surface and nearly one value it is bilinear,
//! elsewhere cells are halved down to single pixels. Every pixel takes values of its own surface only.

use glam::Vec3;

use super::{Lit, ShadingPoint};

/// Pixels between lattice points.
const STEP: usize = 8;

/// Irradiances that differ by less than this share of their mean are interpolated between.
const ALIKE: f32 = 0.03;

/// A pixel's column and row.
type LatticePoint = (usize, usize);

/// A tile of pixels, rows from the top.
pub(super) struct Lattice<'a, F> {
    pub(super) wide: usize,
    pub(super) tall: usize,
    /// What each pixel shows; `None` for the sky.
    pub(super) spots: &'a [Option<ShadingPoint>],
    /// Filled in for every pixel that shows a surface.
    pub(super) lits: &'a mut [Option<Lit>],
    /// Tells the light on a spot.
    pub(super) ask: F,
}

impl<F: FnMut(&ShadingPoint) -> Lit> Lattice<'_, F> {
    /// Finds the light on all spots.
    pub(super) fn fill(&mut self) {
        let (columns, rows) = (stops(self.wide), stops(self.tall));
        for &y in &rows {
            for &x in &columns {
                let i = y * self.wide + x;
                self.lits[i] = self.spots[i].as_ref().map(&mut self.ask);
            }
        }
        let pairs = |all: &[usize]| -> Vec<[usize; 2]> {
            if all.len() > 1 { all.windows(2).map(|w| [w[0], w[1]]).collect() } else { vec![[0, 0]] }
        };
        for ys in pairs(&rows) {
            for xs in pairs(&columns) {
                self.cell(xs, ys);
            }
        }
    }

    /// Fills a cell whose corners are known.
    fn cell(&mut self, xs @ [x0, x1]: [usize; 2], ys @ [y0, y1]: [usize; 2]) {
        if x1 - x0 <= 1 && y1 - y0 <= 1 || self.even(xs, ys) {
            return;
        }
        let (xm, ym) = (x0.midpoint(x1), y0.midpoint(y1));
        let (split_x, split_y) = (xm > x0, ym > y0);
        if split_x {
            self.between((xm, y0), &[[(x0, y0), (x1, y0)]]);
            self.between((xm, y1), &[[(x0, y1), (x1, y1)]]);
        }
        if split_y {
            self.between((x0, ym), &[[(x0, y0), (x0, y1)]]);
            self.between((x1, ym), &[[(x1, y0), (x1, y1)]]);
        }
        if split_x && split_y {
            self.between(
                (xm, ym),
                &[[(x0, ym), (x1, ym)], [(xm, y0), (xm, y1)], [(x0, y0), (x1, y1)], [(x0, y1), (x1, y0)]],
            );
        }
        for ys in halves(ys, ym, split_y) {
            for xs in halves(xs, xm, split_x) {
                self.cell(xs, ys);
            }
        }
    }

    /// Fills a cell by bilinear interpolation if its corners lie on one surface and are lit alike.
    fn even(&mut self, [x0, x1]: [usize; 2], [y0, y1]: [usize; 2]) -> bool {
        let known = |x: usize, y: usize| Some((self.spots[y * self.wide + x]?, self.lits[y * self.wide + x]?));
        let (Some(a), Some(b), Some(c), Some(d)) = (known(x0, y0), known(x1, y0), known(x0, y1), known(x1, y1)) else {
            return false;
        };
        let same = |p: &(ShadingPoint, Lit), q: &(ShadingPoint, Lit)| p.0.joins(&q.0) && alike(&p.1, &q.1);
        if !(same(&a, &b) && same(&a, &c) && same(&a, &d) && same(&b, &c)) {
            return false;
        }
        let (nx, ny) = (1.0 / (x1 - x0).max(1) as f32, 1.0 / (y1 - y0).max(1) as f32);
        for y in y0..=y1 {
            let fy = (y - y0) as f32 * ny;
            let (left, right) = (mixed(&a.1, &c.1, fy), mixed(&b.1, &d.1, fy));
            for x in x0..=x1 {
                let i = y * self.wide + x;
                if self.lits[i].is_none()
                    && let Some(spot) = &self.spots[i]
                {
                    let lit =
                        if a.0.joins(spot) { mixed(&left, &right, (x - x0) as f32 * nx) } else { (self.ask)(spot) };
                    self.lits[i] = Some(lit);
                }
            }
        }
        true
    }

    /// Finds the light half way between pixels: from the first pair that lies on its surface and is lit alike.
    fn between(&mut self, (x, y): LatticePoint, pairs: &[[LatticePoint; 2]]) {
        let i = y * self.wide + x;
        let (Some(spot), None) = (&self.spots[i], &self.lits[i]) else { return };
        let (mut next, mut torn) = (None, false);
        for &[(x0, y0), (x1, y1)] in pairs {
            let (a, b) = (y0 * self.wide + x0, y1 * self.wide + x1);
            let known = |k: usize| self.lits[k].filter(|_| self.spots[k].is_some_and(|s| s.joins(spot)));
            match (known(a), known(b)) {
                (Some(from), Some(to)) if alike(&from, &to) => {
                    let share =
                        if x1 != x0 { (x - x0) as f32 / (x1 - x0) as f32 } else { (y - y0) as f32 / (y1 - y0) as f32 };
                    self.lits[i] = Some(mixed(&from, &to, share));
                    return;
                }
                (Some(_), Some(_)) => torn = true,
                (one, other) if x0.abs_diff(x1).max(y0.abs_diff(y1)) <= 2 => next = next.or(one).or(other),
                _ => {}
            }
        }
        // at the edge of a surface, the light of the pixel beside
        self.lits[i] = next.filter(|_| !torn).or_else(|| Some((self.ask)(spot)));
    }
}

/// The places of lattice points along a side: every few pixels, and the last.
fn stops(length: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..length).step_by(STEP).collect();
    if all.last().is_some_and(|&last| last + 1 < length) {
        all.push(length - 1);
    }
    all
}

/// A span cut in two at its middle, or whole.
fn halves([a, b]: [usize; 2], middle: usize, split: bool) -> impl Iterator<Item = [usize; 2]> {
    let parts = if split { [Some([a, middle]), Some([middle, b])] } else { [Some([a, b]), None] };
    parts.into_iter().flatten()
}

/// Whether one can interpolate between two lights.
fn alike(a: &Lit, b: &Lit) -> bool {
    let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= 0.5 * ALIKE * (a + b).max_element();
    a.needs_shadow_ray == b.needs_shadow_ray
        && a.source == b.source
        && a.shade_source == b.shade_source
        && near(a.shade, b.shade)
        && (!a.needs_shadow_ray || near(a.sun, b.sun))
}

#[inline]
fn mixed(a: &Lit, b: &Lit, share: f32) -> Lit {
    Lit {
        shade: a.shade.lerp(b.shade, share),
        sun: a.sun.lerp(b.sun, share),
        agreement: a.agreement + (b.agreement - a.agreement) * share,
        ..*a
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Source;

    /// The light on every pixel of a wall and how often it was asked for; beyond column `edge` another wall stands 1 m
    /// farther back.
    fn filled(wide: usize, tall: usize, edge: usize, light: impl Fn(f32, f32) -> f32) -> (Vec<Option<Lit>>, usize) {
        let spot = |i: usize| {
            let (x, y) = (i % wide, i / wide);
            let depth = if x < edge { 0.0 } else { 1.0 };
            ShadingPoint {
                position: Vec3::new(x as f32, y as f32, depth),
                normal: Vec3::NEG_Z,
                triangle: 0,
                near_m: 0.01,
            }
        };
        let spots: Vec<_> = (0..wide * tall).map(|i| Some(spot(i))).collect();
        let mut lits = vec![None; spots.len()];
        let mut asked = 0;
        let ask = |s: &ShadingPoint| {
            asked += 1;
            Lit::known(Vec3::splat(light(s.position.x, s.position.y)), Source::Record, 1.0)
        };
        Lattice { wide, tall, spots: &spots, lits: &mut lits, ask }.fill();
        (lits, asked)
    }

    fn check(lits: &[Option<Lit>], wide: usize, light: impl Fn(f32, f32) -> f32, within: f32) {
        for (i, lit) in lits.iter().enumerate() {
            let (seen, real) = (lit.unwrap().shade.x, light((i % wide) as f32, (i / wide) as f32));
            assert!((seen - real).abs() <= within * real, "{} {}: {seen} not {real}", i % wide, i / wide);
        }
    }

    #[test]
    fn a_slope_of_light_is_kept_from_few_points() {
        let light = |x: f32, y: f32| 400.0 + 0.5 * x + 0.25 * y;
        for (wide, tall) in [(64, 16), (61, 13), (9, 1), (1, 9), (1, 1)] {
            let (lits, asked) = filled(wide, tall, wide, light);
            check(&lits, wide, light, 1e-5);
            assert!(asked <= (wide / STEP + 2) * (tall / STEP + 2), "{asked}");
        }
    }

    #[test]
    fn light_does_not_cross_an_edge_nor_is_a_step_of_it_smeared() {
        let light = |x: f32, _: f32| if x < 29.0 { 1.0 } else { 50.0 };
        // the step lies on the edge of a wall, then in the middle of one
        for edge in [29, 64] {
            let (lits, asked) = filled(64, 16, edge, light);
            check(&lits, 64, light, 1e-6);
            assert!(asked < 64 * 16 / 4, "{asked}");
        }
    }
}
