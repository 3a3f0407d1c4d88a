//! What one fault explains of the others: a thing that the model lacks stands in the probes' way, too.
//!
//! Where the model lacks a thing, photographs that show it differ from what the probes saw, and that is the fault. But a probe
//! behind it saw it instead of the floor and the walls beyond, and photographs that show those differ from that probe just as much. Of
//! such a place nothing can be said: no probe saw it. Where the thing stands is known once two photographs show it: where what both
//! have of it meets (Laurentini, *The visual hull concept for silhouette-based image understanding*, PAMI 1994).

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::decide::assessed::{Assessed, Eye, Found};
use crate::audit::finding::{Kind, What};
use crate::audit::picture::regions::mask_of;
use crate::audit::verdict::{Reason, Verdict};

/// A region is explained if at least this share of what tells of it is.
const SHARE: f64 = 0.9;

/// Two photographs show one thing if at least this share of either's region meets the other's.
const MEET: f64 = 0.3;

/// Steps along a line of sight.
const STEPS: usize = 48;

/// A thing that the model lacks, as one photograph shows it.
struct Silhouette<'a> {
    view: usize,
    eye: &'a Eye,
    found: &'a Found,
    mask: Vec<bool>,
}

impl Silhouette<'_> {
    /// Whether the photograph shows the thing where this place is.
    fn holds(&self, point: Vec3) -> bool {
        self.eye.before(point).is_some_and(|i| self.mask[i])
    }

    /// The share of what it shows that may as well be what the other one does.
    fn meets(&self, other: &Self) -> f64 {
        let eye = (self.eye.camera.pose.position - self.eye.origin).as_vec3();
        let meet = |end: Vec3| along(eye, end).any(|p| other.holds(p));
        let ends = self.eye.places(&self.found.pixels);
        let (met, all) = ends.fold((0u32, 0u32), |(met, all), end| (met + u32::from(meet(end)), all + 1));
        f64::from(met) / f64::from(all.max(1))
    }
}

/// Places between two others.
fn along(from: Vec3, to: Vec3) -> impl Iterator<Item = Vec3> {
    (1..STEPS).map(move |k| from.lerp(to, k as f32 / STEPS as f32))
}

/// Takes away findings and doubts that are explained by a thing which two photographs show standing in the probes' way; what
/// they are of is untestable.
pub(crate) fn take_hidden(assessed: &mut [Assessed]) {
    let hidden = hidden(assessed);
    for (a, hidden) in assessed.iter_mut().zip(hidden) {
        let mut each = hidden.iter();
        let (gone, left): (Vec<Found>, Vec<Found>) =
            std::mem::take(&mut a.found).into_iter().partition(|_| *each.next().unwrap_or(&false));
        a.found = left;
        for f in gone {
            for i in (0..f.mask.len()).filter(|i| f.mask[*i]) {
                if !a.found.iter().any(|other| other.mask[i]) {
                    (a.view.verdicts[i], a.view.reasons[i]) = (Verdict::Untestable, Reason::Unseen);
                }
            }
        }
        a.view.count();
    }
}

/// Per view, which of its findings and doubts are explained so.
fn hidden(assessed: &[Assessed]) -> Vec<Vec<bool>> {
    let stands = |f: &&Found| f.finding.reason == Reason::None && f.finding.what == What::Missing;
    let mut things: Vec<Silhouette> = Vec::new();
    for (view, a) in assessed.iter().enumerate() {
        for found in a.found.iter().filter(stands) {
            let mask = mask_of(&found.pixels, a.eye.distance.len());
            things.push(Silhouette { view, eye: &a.eye, found, mask });
        }
    }
    let pairs = (0..things.len()).flat_map(|a| (a + 1..things.len()).map(move |b| (a, b)));
    let both: Vec<(&Silhouette, &Silhouette)> = pairs
        .map(|(a, b)| (&things[a], &things[b]))
        .filter(|(a, b)| a.view != b.view && a.meets(b) >= MEET && b.meets(a) >= MEET)
        .collect();
    let explained = |f: &Found| {
        let others = both.iter().filter(|(a, b)| !std::ptr::eq(a.found, f) && !std::ptr::eq(b.found, f));
        f.finding.kind == Kind::Geometry && others.into_iter().any(|(a, b)| stands_before(a, b, f))
    };
    assessed.iter().map(|a| a.found.par_iter().map(&explained).collect()).collect()
}

/// Whether a thing that two photographs show stands between a region and the probes that tell of it.
fn stands_before(a: &Silhouette, b: &Silhouette, region: &Found) -> bool {
    let hides = |from: Vec3, to: Vec3| along(from, to).any(|p| a.holds(p) && b.holds(p));
    let hidden = region.sightlines.iter().filter(|s| s.probes.iter().all(|p| hides(s.point, *p))).count();
    hidden > 0 && hidden as f64 >= SHARE * region.sightlines.len() as f64
}
