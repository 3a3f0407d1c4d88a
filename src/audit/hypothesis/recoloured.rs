//! Another colour than the model's: what is left of a difference once gloss and the lights around have had their share.

use glam::{Vec2, Vec3};

use crate::audit::likelihood::appearance::Texture;
use crate::audit::observe::geometry_buffer::GeometryBuffer;
use crate::audit::picture::colour::colour_of;
use crate::audit::picture::regions::{Region, bounds};
use crate::audit::view::Observations;
use crate::statistics::{median, quantile};

/// Shares of the pixels around a region whose light is less far along the line of lights than all that may fall on it.
const LIGHTS: [f64; 2] = [0.01, 0.99];

/// Pixels from a border that both its sides are looked at.
pub(crate) const ASIDE: isize = 4;

/// Surfaces meet at a border if the distances of the pixels on either side differ by less than this share.
const BESIDE: f32 = 0.05;

/// Of fewer pixels along its borders nothing is said.
pub(crate) const FEWEST: usize = 20;

impl Texture {
    /// Mean over pixels of the colour that the albedo lacks, as logarithms of red and blue over green, if a surface mirrors this
    /// share of what it may.
    fn chroma(&self, observed: &Observations, pixels: &[usize], mirrored: f32) -> Vec2 {
        let dull = |i: usize| {
            let light = observed.log_photo[i].map(f32::exp);
            let scattered = (light - observed.mirrored[i] * mirrored).max(light * 0.1);
            chroma(self.ratio[i] + (scattered / light).map(f32::ln))
        };
        pixels.iter().map(|i| dull(*i)).sum::<Vec2>() / pixels.len().max(1) as f32
    }

    /// ΔE00 over a region between the model's colours and what the photograph says they are, brightness apart, whatever the
    /// surface mirrors, and without what other light would do: around the region, the light's colours go along a line from one
    /// light to another.
    pub(crate) fn mean_colour(&self, observed: &Observations, region: &Region) -> f32 {
        let tested: Vec<usize> = region.pixels.iter().copied().filter(|i| self.tested[*i]).collect();
        let (line, [low, high]) = lights(observed, region, &tested);
        least_mirrored(|share| {
            let mean = self.chroma(observed, &tested, share);
            mean - line * mean.dot(line).clamp(low, high)
        })
    }

    /// ΔE00, brightness apart, of the change of colour that the albedo lacks at some pixels' borders with other materials beside
    /// them; `inside` tells which pixels these are.
    pub(crate) fn step(
        &self,
        surfaces: &GeometryBuffer,
        pixels: &[usize],
        inside: impl Fn(usize) -> bool,
    ) -> Option<f32> {
        let ratio = |i: usize| self.tested[i].then(|| self.ratio[i]);
        step(ratio, across_borders(surfaces.width, &surfaces.material, &surfaces.distance, pixels, inside))
    }
}

/// A pixel on either side of some pixels' borders with other materials that meet them, the inner one first.
pub(crate) fn across_borders(
    width: usize,
    material: &[u32],
    distance: &[f32],
    pixels: &[usize],
    inside: impl Fn(usize) -> bool,
) -> Vec<[usize; 2]> {
    let at = |i: usize, (dx, dy): (isize, isize), steps: isize| {
        let (x, y) = ((i % width) as isize + dx * steps, (i / width) as isize + dy * steps);
        let i = y * width as isize + x;
        (x >= 0 && x < width as isize && y >= 0 && (i as usize) < material.len()).then_some(i as usize)
    };
    // a frame may lie between: whatever is beyond the border tells
    let across = |i: usize, along: (isize, isize)| {
        let next = at(i, along, 1).filter(|j| !inside(*j) && material[*j] != material[i])?;
        let meet = (distance[i] / distance[next] - 1.0).abs() < BESIDE;
        let own = at(i, along, -ASIDE).filter(|j| inside(*j))?;
        let other = at(i, along, 1 + ASIDE).filter(|j| !inside(*j))?;
        Some([own, other]).filter(|_| meet)
    };
    let directions = [(1, 0), (-1, 0), (0, 1), (0, -1)];
    pixels.iter().flat_map(|&i| directions.into_iter().filter_map(move |along| across(i, along))).collect()
}

/// ΔE00 of the step of a colour's logarithm across borders. Paint ends where a material does, light goes on: what light alone has
/// made makes no step there. `None` where too few are known.
fn step(value: impl Fn(usize) -> Option<Vec3>, across: Vec<[usize; 2]>) -> Option<f32> {
    let steps: Vec<Vec3> = across.into_iter().filter_map(|[own, other]| Some(value(own)? - value(other)?)).collect();
    if steps.len() < FEWEST {
        return None;
    }
    let middle = |of: &dyn Fn(&Vec3) -> f32| median(steps.iter().map(of)).unwrap_or(0.0);
    Some(colour_of(middle(&|d| chroma(*d).x), middle(&|d| chroma(*d).y)))
}

/// Logarithms of red and blue over green.
fn chroma(log: Vec3) -> Vec2 {
    Vec2::new(log.x - log.y, log.z - log.y)
}

/// The least ΔE00 of a change of chroma that hangs on how much of what a surface may mirror it does.
fn least_mirrored(change: impl Fn(f32) -> Vec2) -> f32 {
    let shares = (0..=4).map(|k| k as f32 / 4.0);
    shares.map(&change).map(|c| colour_of(c.x, c.y)).fold(f32::INFINITY, f32::min)
}

/// The line along which the light's colours lie in and around a region, and how far along it light from around would change what
/// falls on the region's pixels.
fn lights(observed: &Observations, region: &Region, pixels: &[usize]) -> (Vec2, [f32; 2]) {
    let (w, e) = (observed.surfaces.width, &observed.irradiance);
    let of = |i: usize| chroma(e[i].map(f32::ln));
    let [left, top, right, bottom] = bounds(&region.pixels, w);
    let (wide, high) = (right.saturating_sub(left), bottom.saturating_sub(top));
    let columns = left.saturating_sub(wide / 2)..(right + wide / 2).min(w);
    let rows = top.saturating_sub(high / 2)..(bottom + high / 2).min(e.len() / w);
    let around = rows.flat_map(|y| columns.clone().map(move |x| y * w + x));
    let all: Vec<Vec2> = around.filter(|i| e[*i].min_element() > 0.0).map(of).collect();
    let line = principal_axis(&all);
    let mut along: Vec<f32> = all.iter().map(|l| l.dot(line)).collect();
    let here = pixels.iter().map(|i| of(*i).dot(line)).sum::<f32>() / pixels.len().max(1) as f32;
    let [low, high] = LIGHTS.map(|q| quantile(&mut along, q).unwrap_or(here) - here);
    (line, [low.min(0.0), high.max(0.0)])
}

/// Direction in which points are spread most; of length 1.
fn principal_axis(points: &[Vec2]) -> Vec2 {
    let n = points.len().max(1) as f32;
    let middle = points.iter().sum::<Vec2>() / n;
    let [xx, xy, yy] = points
        .iter()
        .map(|p| *p - middle)
        .fold([0.0f32; 3], |[xx, xy, yy], d| [xx + d.x * d.x / n, xy + d.x * d.y / n, yy + d.y * d.y / n]);
    Vec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 40;

    #[test]
    fn paint_ends_with_its_piece_and_light_does_not() {
        let inside = |i: usize| (10..30).contains(&(i % SIDE)) && (10..30).contains(&(i / SIDE));
        let material: Vec<u32> = (0..SIDE * SIDE).map(|i| u32::from(inside(i))).collect();
        let pixels: Vec<usize> = (0..SIDE * SIDE).filter(|i| inside(*i)).collect();
        // light that is redder and brighter to the right
        let light = |i: usize| Vec3::new(0.03, 0.02, 0.02) * (i % SIDE) as f32;
        let paint = |i: usize| if inside(i) { Vec3::new(0.3, 0.0, 0.0) } else { Vec3::ZERO };
        let level = [3.0; SIDE * SIDE];
        let told = |value: &dyn Fn(usize) -> Vec3, distance: &[f32]| {
            step(|i| Some(value(i)), across_borders(SIDE, &material, distance, &pixels, inside))
        };
        let lit = told(&light, &level).unwrap();
        assert!(lit < 0.5, "{lit}");
        let painted = told(&|i| light(i) + paint(i), &level).unwrap();
        assert!((painted - colour_of(0.3, 0.0)).abs() < 0.5 && painted > 5.0, "{painted}");
        // what is seen past an edge, far behind, lies in other light
        let apart: Vec<f32> = (0..SIDE * SIDE).map(|i| if inside(i) { 3.0 } else { 5.0 }).collect();
        assert!(told(&paint, &apart).is_none());
    }
}
