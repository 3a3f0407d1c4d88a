//! Cuts the surface where light changes.

use glam::Vec3;
use rayon::prelude::*;

use super::BakeSettings;
use super::mesh::{Edges, Middle, Sample, Surface, longest, morton};
use crate::panorama::luminance;
use crate::render::{Irradiance, Relit, Source};
use crate::statistics::median;
use crate::volume::Nearby;

/// Light at samples, under all lightings.
#[derive(Default)]
pub(super) struct SampleLight {
    /// How many irradiances a sample has.
    pub(super) values: usize,
    /// Those of a sample beside each other.
    irradiance: Vec<Vec3>,
    /// Per sample where the light came from, under the first lighting.
    pub(super) source: Vec<Source>,
    /// Per sample how far probes agree, 0..=1, under the lighting where they agree least.
    pub(super) agreement: Vec<f32>,
}

/// Irradiances of one sample, where they came from, and how far probes agree.
type Told<'a> = (&'a [Vec3], Source, f32);

impl SampleLight {
    /// The irradiances of a sample.
    pub(super) fn at(&self, sample: u32) -> &[Vec3] {
        &self.irradiance[sample as usize * self.values..][..self.values]
    }

    fn told(&self, sample: u32) -> Told<'_> {
        (self.at(sample), self.source[sample as usize], self.agreement[sample as usize])
    }

    fn append(&mut self, mut other: Self) {
        self.irradiance.append(&mut other.irradiance);
        self.source.append(&mut other.source);
        self.agreement.append(&mut other.agreement);
    }

    fn push(&mut self, one: Told) {
        self.irradiance.extend(one.0);
        self.source.push(one.1);
        self.agreement.push(one.2);
    }
}

/// Edges longer than this share of the coarse length are looked into even where their ends are lit alike.
const BLIND: f32 = 0.3;

/// From edges this share of the coarse length on, an edge half as long may be twice as far off: what it blurs is half as wide.
const FULL: f32 = 0.25;

/// So many samples share what look-ups found.
const LOT: usize = 512;

/// Nothing is looked at from nearer than this, metres.
const NEAR_M: f32 = 1.0;

/// Light below this share of what is usual counts as dark: differences down there are not seen.
const DARK: f32 = 0.15;

/// Cuts a surface whose corners are lit until light between corners is known within the error asked for, or edges are as
/// short as wanted, or there are as many samples as allowed. Where these do not suffice, an edge counts by how long it is as
/// seen from the nearest of the `eyes`.
pub(super) fn refine(
    surface: &mut Surface,
    lit: &mut SampleLight,
    lights: &Lights,
    settings: &BakeSettings,
    [coarse, finest]: [f32; 2],
    eyes: &[Vec3],
    progress: &(dyn Fn(usize) + Sync),
) {
    let dark: Vec<f32> = (0..lit.values)
        .map(|l| {
            let all = lit.irradiance.iter().skip(l).step_by(lit.values).map(|e| luminance(*e)).filter(|e| *e > 0.0);
            DARK * median(all).unwrap_or(0.0)
        })
        .collect();
    // differences of light as an eye sees them
    let differ = |a: &[Vec3], b: &[Vec3]| -> f32 {
        let one = |l: usize| {
            let most = a[l].max(b[l]).max_element();
            (a[l] - b[l]).abs().max_element() / (most + dark[l]).max(f32::MIN_POSITIVE)
        };
        (0..dark.len()).map(one).fold(0.0, f32::max)
    };
    // middles that were looked up, with their light
    let (mut candidates, mut seen): (Vec<Sample>, _) = (Vec::new(), lights.none());
    loop {
        let edges = surface.edges();
        let tested: Vec<u32> = (0..edges.runs.len() as u32)
            .into_par_iter()
            .filter(|&r| {
                let run = &edges.runs[r as usize];
                let length = surface.length(run.ends);
                if length <= finest || state(surface, &edges, r) == Middle::Even {
                    return false;
                }
                let [a, b] = sample_ends(surface, &edges, run);
                length > BLIND * coarse || differ(lit.at(a), lit.at(b)) > settings.error
            })
            .collect();
        let unasked = |r: &u32| state(surface, &edges, *r) == Middle::Unasked;
        let new: Vec<u32> = tested.iter().copied().filter(unasked).collect();
        let asked: Vec<Sample> = new.par_iter().map(|&r| middle(surface, &edges, r)).collect();
        seen.append(lights.at(&asked));
        for (&r, at) in new.iter().zip(asked) {
            set(surface, &edges, r, Middle::Uneven(candidates.len() as u32));
            candidates.push(at);
        }
        let off = |&r: &u32| {
            let Middle::Uneven(k) = state(surface, &edges, r) else { return 0.0 };
            let run = &edges.runs[r as usize];
            let [a, b] = sample_ends(surface, &edges, run);
            let (a, b) = (lit.at(a), lit.at(b));
            let between: Vec<Vec3> = a.iter().zip(b).map(|(a, b)| 0.5 * (*a + *b)).collect();
            let (off, length) = (differ(seen.at(k), &between), surface.length(run.ends));
            let far = || eyes.iter().map(|e| e.distance(candidates[k as usize].position)).fold(f32::INFINITY, f32::min);
            if off > settings.error * f32::max(1.0, FULL * coarse / length) {
                off * length / far().max(NEAR_M)
            } else {
                0.0
            }
        };
        let off: Vec<f32> = tested.par_iter().map(off).collect();
        let mut worst = vec![0.0f32; edges.count];
        for (&r, &off) in tested.iter().zip(&off) {
            let run = &edges.runs[r as usize];
            worst[run.edge as usize] = worst[run.edge as usize].max(off);
            if off == 0.0 {
                set(surface, &edges, r, Middle::Even);
            }
        }
        let room = settings.vertices.saturating_sub(surface.samples.len());
        // the worst first: what is left over for them is worth more than what lies in their order
        let mut most = room / 2;
        let known = |middle: Middle| {
            let Middle::Uneven(k) = middle else { return None };
            Some((candidates[k as usize], seen.told(k)))
        };
        progress(surface.samples.len());
        loop {
            let marked = marked(&worst, most);
            if !marked.contains(&true) {
                return;
            }
            if split(surface, lit, lights, &edges, marked, room, known) {
                break;
            }
            // what hangs on them took too much room
            most /= 2;
        }
        // little room is no use
        if 64 * settings.vertices.saturating_sub(surface.samples.len()) < settings.vertices {
            return;
        }
    }
}

/// Cuts edges longer than wanted, until none is left; nothing is lit.
pub(super) fn cut_long(surface: &mut Surface, coarse: f32, most: usize) {
    loop {
        let edges = surface.edges();
        let mut marked = vec![false; edges.count];
        for run in &edges.runs {
            marked[run.edge as usize] = surface.length(run.ends) > coarse;
        }
        let room = most.saturating_sub(surface.samples.len());
        if !marked.contains(&true)
            || !split(surface, &mut SampleLight::default(), &Lights::default(), &edges, marked, room, |_| None)
        {
            return;
        }
    }
}

/// The edges to be cut: all that are off, or the worst where there are more than that.
fn marked(worst: &[f32], most: usize) -> Vec<bool> {
    let mut order: Vec<u32> = (0..worst.len() as u32).filter(|e| worst[*e as usize] > 0.0).collect();
    if order.len() > most {
        order.select_nth_unstable_by(most, |a, b| worst[*b as usize].total_cmp(&worst[*a as usize]).then(a.cmp(b)));
        order.truncate(most);
    }
    let mut marked = vec![false; worst.len()];
    order.into_iter().for_each(|e| marked[e as usize] = true);
    marked
}

/// Cuts marked edges, and the longest edge of each piece that has one. `known` gives for a run the sample at its middle and
/// its light where that was looked up, by what is known of it. False, and nothing done, where there is no room for so many.
fn split<'a>(
    surface: &mut Surface,
    lit: &mut SampleLight,
    lights: &Lights,
    edges: &Edges,
    mut marked: Vec<bool>,
    room: usize,
    known: impl Fn(Middle) -> Option<(Sample, Told<'a>)> + Sync,
) -> bool {
    let edge_of = |at: u32| edges.runs[edges.run_of[at as usize] as usize].edge as usize;
    // pieces at edges that were marked last
    let mut near: Vec<u32> = (0..surface.pieces.len() as u32).collect();
    loop {
        let unmarked = |&i: &u32| {
            let any = (0..3).any(|e| marked[edge_of(3 * i + e)]);
            let at = 3 * i + longest(&surface.places, &surface.pieces[i as usize].corners, |_| any)? as u32;
            (!marked[edge_of(at)]).then_some(at)
        };
        let more: Vec<u32> = near.par_iter().filter_map(unmarked).collect();
        if more.is_empty() {
            break;
        }
        more.iter().for_each(|&at| marked[edge_of(at)] = true);
        near = more.par_iter().flat_map_iter(|&at| edges.around(at)).map(|at| at / 3).collect();
    }
    let cut: Vec<u32> = (0..edges.runs.len() as u32)
        .into_par_iter()
        .filter(|&r| marked[edges.runs[r as usize].edge as usize])
        .collect();
    if cut.len() > room {
        return false;
    }
    surface.keep_coarse();
    let unknown = |r: &&u32| known(state(surface, edges, **r)).is_none();
    let asked: Vec<Sample> = cut.par_iter().filter(unknown).map(|&r| middle(surface, edges, r)).collect();
    let found = lights.at(&asked);
    let first = surface.samples.len() as u32;
    // per run its number among those that are cut, counted from 1
    let mut number_of = vec![0u32; edges.runs.len()];
    let (mut place_of, mut last, mut next) = (Vec::with_capacity(cut.len()), None, 0);
    for (&r, number) in cut.iter().zip(1..) {
        let run = &edges.runs[r as usize];
        if last != Some(run.edge) {
            last = Some(run.edge);
            let [a, b] = run.ends.map(|p| surface.places[p as usize]);
            surface.places.push(0.5 * (a + b));
        }
        place_of.push(surface.places.len() as u32 - 1);
        number_of[r as usize] = number;
        match known(state(surface, edges, r)) {
            Some((at, light)) => {
                surface.samples.push(at);
                lit.push(light);
            }
            None => {
                surface.samples.push(asked[next]);
                lit.push(found.told(next as u32));
                next += 1;
            }
        }
    }
    surface.cut(|at| {
        let number = number_of[edges.run_of[at as usize] as usize].checked_sub(1)?;
        Some((place_of[number as usize], first + number))
    });
    true
}

/// The sample at the middle of a run.
fn middle(surface: &Surface, edges: &Edges, run: u32) -> Sample {
    let run = &edges.runs[run as usize];
    let [a, b] = run.ends.map(|p| surface.places[p as usize]);
    surface.sample(0.5 * (a + b), edges.of(run).iter().map(|at| at / 3))
}

/// The samples at the ends of a run.
fn sample_ends(surface: &Surface, edges: &Edges, run: &super::mesh::Run) -> [u32; 2] {
    let at = edges.of(run)[0];
    let samples = surface.pieces[at as usize / 3].samples;
    [samples[at as usize % 3], samples[(at as usize + 1) % 3]]
}

/// What is known of the light at a run's middle; all its pieces know the same.
fn state(surface: &Surface, edges: &Edges, run: u32) -> Middle {
    let at = edges.of(&edges.runs[run as usize])[0] as usize;
    surface.pieces[at / 3].middles[at % 3]
}

fn set(surface: &mut Surface, edges: &Edges, run: u32, known: Middle) {
    for at in edges.of(&edges.runs[run as usize]).iter().map(|at| *at as usize) {
        surface.pieces[at / 3].middles[at % 3] = known;
    }
}

/// What tells light at samples.
#[derive(Clone, Copy, Default)]
pub(super) struct Lights<'a> {
    /// One a lighting.
    pub(super) relit: &'a [Relit<'a>],
    /// Tell light without direct sun and light with it, in the place of what there is.
    pub(super) sun_apart: bool,
}

impl Lights<'_> {
    /// The light at no sample.
    fn none(&self) -> SampleLight {
        let values = self.relit.len() * if self.sun_apart { 2 } else { 1 };
        SampleLight { values, ..SampleLight::default() }
    }

    /// The light at samples, as rendering finds it.
    pub(super) fn at(&self, samples: &[Sample]) -> SampleLight {
        let Some(Relit { scene, .. }) = self.relit.first() else {
            let (source, agreement) = (vec![Source::None; samples.len()], vec![1.0; samples.len()]);
            return SampleLight { source, agreement, ..SampleLight::default() };
        };
        // those that lie together one after the other: what was found for one serves the next
        let bounds = scene.mesh.bounds();
        let key = |(i, s): (u32, &Sample)| (morton(s.position, bounds), i);
        let mut order: Vec<(u32, u32)> = (0..).zip(samples).map(key).collect();
        order.par_sort_unstable();
        let lots: Vec<SampleLight> = order.par_chunks(LOT).with_max_len(1).map(|lot| self.lot(samples, lot)).collect();
        let mut sorted = self.none();
        lots.into_iter().for_each(|lot| sorted.append(lot));
        let mut number_of = vec![0; samples.len()];
        (0..).zip(&order).for_each(|(number, (_, sample))| number_of[*sample as usize] = number);
        let mut lit = self.none();
        number_of.into_iter().for_each(|number| lit.push(sorted.told(number)));
        lit
    }

    /// The light at some of the samples.
    fn lot(&self, samples: &[Sample], lot: &[(u32, u32)]) -> SampleLight {
        let mut near: Vec<Nearby> = self.relit.iter().map(|_| Nearby::default()).collect();
        let mut all = self.none();
        for s in lot.iter().map(|(_, i)| &samples[*i as usize]) {
            let (mut source, mut agreement) = (Source::None, 1.0f32);
            for (l, (relit, near)) in self.relit.iter().zip(&mut near).enumerate() {
                let lit = relit.lit(s.position, s.normal, near);
                let direct = if self.sun_apart { relit.light.unshadowed_sun(s.normal) } else { Vec3::ZERO };
                let asks = lit.needs_shadow_ray || direct != Vec3::ZERO;
                let in_sun = asks && relit.in_sun(s.position, s.normal);
                let shaded = lit.needs_shadow_ray && !in_sun;
                let (e, from) = if shaded { (lit.shade, lit.shade_source) } else { (lit.sun, lit.source) };
                // a sum of the greatest numbers may leave them
                let finite = |e: Vec3| {
                    if e.is_finite() { e.max(Vec3::ZERO) } else { Vec3::splat(f32::MAX).min(e.max(Vec3::ZERO)) }
                };
                if self.sun_apart {
                    // what records say of a place that they know lit, or shaded, and what it would be otherwise
                    let (shade, sun) = match (lit.needs_shadow_ray, in_sun) {
                        (true, _) => (lit.shade, lit.sun),
                        (false, true) => (e * (1.0 - luminance(direct) / luminance(e)).max(0.0), e),
                        (false, false) => (e, e + direct),
                    };
                    all.irradiance.extend([finite(shade), finite(sun.max(shade))]);
                } else {
                    all.irradiance.push(finite(e));
                }
                if l == 0 {
                    source = from;
                }
                agreement = agreement.min(lit.agreement);
            }
            all.source.push(source);
            all.agreement.push(agreement);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_lighting_samples_have_no_light() {
        let samples = [Sample { position: Vec3::ZERO, normal: Vec3::Z }; 3];
        let lit = Lights::default().at(&samples);
        assert_eq!(lit.told(2), (&[][..], Source::None, 1.0));
    }
}
