//! Things that stand in the real room and not in the model, where the photograph shows them.
//!
//! The model shows a surface behind such a thing instead. The photograph is then brighter or darker than all that can be
//! said of that surface: what each probe saw of it, what the render makes of that, and its albedo under smooth light. Where
//! something is only in a probe's way, the albedo vouches for the model; where a shadow falls, or paint differs, the probes
//! do.

use glam::Vec3;
use rayon::prelude::*;

use super::probe_view::ProbeView;
use super::regions::{Region, closed, components, opened};
use super::surfaces::NONE;
use super::view::{Maps, Prepared};
use super::{EdgeAware, log_luminance};
use crate::panorama::Picture;
use crate::statistics::median;

/// Differences are averaged over windows of this standard deviation, pixels.
const WINDOW: f32 = 1.5;

/// Logarithm of brightness beyond all that is predicted, from which on something else is seen …
pub(super) const EXCESS: f32 = 0.25;

/// … and so many times what half of the picture differs from its render by.
const TIMES: f32 = 5.0;

/// A probe that looks at a surface along the camera's ray, but for this angle in radians, sees the same thing before it.
const ALONG: f32 = 0.05;

/// Beside what is that far beyond, this share of it counts, too.
const LOW: f32 = 0.5;

/// Less than this share of a window, seen by a probe, tells nothing.
const SEEN_SHARE: f32 = 0.3;

/// It is sure if its size, times the square of its strength over the threshold, is at least this share of the picture: at the
/// edges of sunlight and behind lattices, small regions of right models are a little beyond. Less than the second is no
/// doubt, either.
pub(super) const SURE_SHARE: f32 = 5e-3;
pub(super) const DOUBT_SHARE: f32 = 2.5e-3;

/// A surface that is hidden by something is told already if fewer than this share of it is beyond.
pub(super) const FEW: f32 = 0.2;

/// What the evidence of a thing before the model's surfaces is called.
pub(super) const EVIDENCE: &str = "brightness beyond all that is predicted";

/// What stands before the model's surfaces.
pub(super) struct Silhouette {
    pub(super) region: Region,
    /// Mean logarithm of brightness beyond all that is predicted, and what it must be above.
    pub(super) excess: f32,
    pub(super) threshold: f32,
    /// Most of it is seen by more than one probe.
    pub(super) several: bool,
}

/// Looks for what the photograph shows and nothing predicts, in regions of at least so many pixels.
/// Also how far each pixel is beyond; NaN where nothing is predicted or no probe sees it.
pub(super) fn silhouettes(prepared: &Prepared, maps: &Maps, least: usize) -> (Vec<Silhouette>, Vec<f32>) {
    let Beyond { by, seen, usual } = beyond(prepared, maps);
    let (w, h) = maps.size();
    let far = by.iter().zip(&seen).map(|(b, s)| b.filter(|_| *s > 0).map_or(f32::NAN, f32::abs)).collect();
    (outlined(&by, &seen, w, h, EXCESS.max(TIMES * usual), least), far)
}

/// Regions where what nothing predicts is over a threshold on the average; some of each is seen by a probe.
fn outlined(by: &[Option<f32>], seen: &[u8], w: usize, h: usize, threshold: f32, least: usize) -> Vec<Silhouette> {
    let one = |is: bool| if is { 1.0 } else { 0.0 };
    let known: Vec<f32> = by.iter().map(|b| one(b.is_some())).collect();
    let values: Vec<f32> = by.iter().map(|b| b.unwrap_or(0.0)).collect();
    let open = EdgeAware::open(w, h);
    let mean = open.mean(&values, &known, WINDOW);
    let share = open.smoothed(&seen.iter().map(|s| one(*s > 0)).collect::<Vec<_>>(), WINDOW);
    let mut all = Vec::new();
    // brighter and darker apart: what is beside an edge that is a little off its place is both
    for sign in [1.0, -1.0] {
        let over = |least: f32| mean.iter().map(|m| sign * m >= least).collect::<Vec<bool>>();
        let asked: Vec<bool> = over(threshold).iter().zip(&share).map(|(o, s)| *o && *s >= SEEN_SHARE).collect();
        let high = opened(&asked, w, h, 2);
        let low = closed(&opened(&over(LOW * threshold), w, h, 1), w, h, 2);
        all.extend(components(&low, &high, w, least, |_, _| true).into_iter().map(|region| {
            let excess = region.pixels.iter().map(|i| sign * mean[*i]).sum::<f32>() / region.pixels.len() as f32;
            let asked = region.pixels.iter().filter(|i| seen[**i] > 0).count();
            let several = 2 * region.pixels.iter().filter(|i| seen[**i] > 1).count() > asked;
            Silhouette { region, excess, threshold, several }
        }));
    }
    all
}

/// What the photograph shows beyond all that is predicted.
struct Beyond {
    /// Per pixel, as a logarithm of brightness: more than the greatest prediction or, negative, less than the least.
    by: Vec<Option<f32>>,
    /// Number of probes that see the surface, and not along the camera's ray.
    seen: Vec<u8>,
    /// What half of the picture differs from its render by.
    usual: f32,
}

fn beyond(prepared: &Prepared, maps: &Maps) -> Beyond {
    let s = &maps.surfaces;
    let n = s.triangle.len();
    let usable = |i: usize| maps.usable[i] > 0.0 && s.triangle[i] != NONE && maps.log_photo[i].is_finite();
    let photo: Vec<Option<f32>> =
        (0..n).map(|i| usable(i).then(|| log_luminance(maps.log_photo[i].map(f32::exp)))).collect();
    // differences from a prediction, with what half of the picture has of it taken out
    let centred = |difference: &(dyn Fn(usize) -> Option<f32> + Sync)| -> Vec<Option<f32>> {
        let of = |i: usize| difference(i).filter(|d| d.is_finite());
        let mut all: Vec<Option<f32>> = (0..n).into_par_iter().map(of).collect();
        let middle = median(all.iter().flatten().copied()).unwrap_or(0.0);
        all.iter_mut().flatten().for_each(|d| *d -= middle);
        all
    };
    let over = |prediction: &(dyn Fn(usize) -> Option<f32> + Sync)| centred(&|i| Some(photo[i]? - prediction(i)?));
    // what gloss may add or take explains a difference
    let dull = |difference: f32, probe: Option<usize>, i: usize, log: f32| {
        let [below, above] = maps.gloss.bounds(probe, i, Vec3::splat(log.exp()));
        difference - difference.clamp(below.min_element(), above.max_element())
    };
    let rendered = over(&|i| Some(maps.render.pixels[i]).filter(|p| Picture::valid(*p)).map(log_luminance));
    let usual = median(rendered.iter().flatten().map(|d| d.abs())).unwrap_or(0.0);
    let scattered = |i: usize| {
        let e = maps.irradiance[i];
        (e.min_element() > 0.0).then(|| log_luminance(maps.albedo[i] * e / std::f32::consts::PI))
    };
    let mut smooth = over(&scattered);
    for (i, d) in smooth.iter_mut().enumerate() {
        *d = d.zip(scattered(i)).map(|(d, log)| dull(d, None, i, log));
    }
    // what a probe beside the camera sees there, the render shows, too
    let along = |probe: &ProbeView, i: usize| s.ray[i].angle_between(s.position[i] - probe.origin) < ALONG;
    let echoes =
        |i: usize| prepared.probes.iter().zip(&maps.sights.of).any(|(p, sights)| sights[i].is_some() && along(p, i));
    let mut by: Vec<Option<f32>> = (0..n)
        .into_par_iter()
        .map(|i| Some(if echoes(i) { smooth[i]? } else { nearest(rendered[i]?, smooth[i]?) }))
        .collect();
    let mut seen = vec![0u8; n];
    for (k, probe) in prepared.probes.iter().enumerate() {
        let lights: Vec<Option<f32>> = (0..n)
            .into_par_iter()
            .map(|i| {
                let level = maps.level(k, i).filter(|_| usable(i) && !along(probe, i))?;
                let log = probe.log_radiance(s.position[i], level);
                log.is_finite().then(|| log_luminance(log.map(f32::exp)))
            })
            .collect();
        // the photograph as soft as the probe: beside an edge, a probe's pixel holds what is on both sides
        let asked = centred(&|i| {
            let (light, soft) = (lights[i]?, maps.geometry.soft(k, i));
            soft.is_finite().then(|| log_luminance(soft.map(f32::exp)) - light)
        });
        for i in 0..n {
            if let (Some(b), Some(d), Some(light)) = (by[i], asked[i], lights[i]) {
                by[i] = Some(nearest(b, dull(d, Some(k), i, light)));
                seen[i] += 1;
            }
        }
    }
    Beyond { by, seen, usual }
}

/// Of two differences the smaller; none where they have different signs: then something between both is predicted.
fn nearest(a: f32, b: f32) -> f32 {
    if a * b <= 0.0 { 0.0 } else { a.signum() * a.abs().min(b.abs()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_between_predictions_is_predicted() {
        assert_eq!(nearest(0.3, -0.2), 0.0);
        assert_eq!(nearest(0.3, 0.2), 0.2);
        assert_eq!(nearest(-0.1, -0.2), -0.1);
        assert_eq!(nearest(0.0, 0.2), 0.0);
    }

    #[test]
    fn a_thing_before_the_wall_is_outlined_where_some_probe_sees_the_wall() {
        let (w, h) = (64, 48);
        let thing = |i: usize| (20..32).contains(&(i % w)) && (10..40).contains(&(i / w));
        // a bar two pixels wide is an edge that is a little off its place
        let edge = |i: usize| (50..52).contains(&(i % w));
        let by: Vec<Option<f32>> = (0..w * h).map(|i| Some(if thing(i) || edge(i) { 0.5 } else { 0.02 })).collect();
        let found = outlined(&by, &vec![2; w * h], w, h, EXCESS, 40);
        assert!(found.len() == 1 && found[0].several);
        let right = found[0].region.pixels.iter().filter(|i| thing(**i)).count();
        assert!(right > 300 && found[0].region.pixels.len() < 440 && found[0].excess > EXCESS, "{right}");
        // darker counts as much; what no probe sees is light that nobody knows
        let dark: Vec<Option<f32>> = by.iter().map(|b| b.map(|b| -b)).collect();
        assert_eq!(outlined(&dark, &vec![2; w * h], w, h, EXCESS, 40).len(), 1);
        let alone = outlined(&by, &vec![1; w * h], w, h, EXCESS, 40);
        assert!(alone.len() == 1 && !alone[0].several);
        assert!(outlined(&by, &vec![0; w * h], w, h, EXCESS, 40).is_empty());
    }
}
