//! Another colour than the model's: what is left of a difference once the lights around have had their share.

use glam::Vec2;

use crate::audit::likelihood::appearance::Texture;
use crate::audit::picture::colour::{chroma, colour_of};
use crate::audit::picture::regions::{Region, bounds};
use crate::audit::view::Observations;
use crate::statistics::quantile;

/// Shares of the pixels around a region whose light is less far along the line of lights than all that may fall on it.
const LIGHTS: [f64; 2] = [0.01, 0.99];

impl Texture {
    /// ΔE00 over a region between the model's colours and what the photograph says they are, brightness apart, and without what other
    /// light would do: around the region, the light's colours go along a line from one light to another.
    pub(crate) fn mean_colour(&self, observed: &Observations, region: &Region) -> f32 {
        let tested: Vec<usize> = region.pixels.iter().copied().filter(|i| self.tested[*i]).collect();
        let (line, [low, high]) = lights(observed, region, &tested);
        let mean = tested.iter().map(|i| chroma(self.ratio[*i])).sum::<Vec2>() / tested.len().max(1) as f32;
        colour_of(mean - line * mean.dot(line).clamp(low, high))
    }
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
