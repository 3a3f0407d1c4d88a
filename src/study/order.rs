//! The order in which a plan would take a site's probes: each next one sees most of what none before it sees.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::plan::visibility::surface::Surface;
use crate::scene::Scene;
use crate::site::{Probe, Site};

/// The surface is judged in at most about so many pieces.
const PATCHES: usize = 20_000;

/// A probe's place in the order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranked {
    /// Its index in the site file.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The share, 0..=1 by area, that it and all before it see of what all probes together see.
    pub seen: f64,
}

/// The probes that have a picture of a lighting, in plan order: greedy by area of the model's surface, under the plan's limits of
/// range and incidence; of equals the first in the site file.
pub fn plan_order(site: &Site, scene: &Scene, lighting: &str) -> Vec<Ranked> {
    let surface = Surface::new(scene, &site.plan, PATCHES);
    let area = |patch: &usize| surface.areas[*patch];
    let sees = |probe: &Probe| -> Vec<bool> {
        let station = scene.local(probe.pose.position);
        (0..surface.patches.len()).into_par_iter().map(|p| surface.sees(station, p).is_some()).collect()
    };
    let with_picture = site.probes.iter().enumerate().filter(|(_, probe)| probe.picture(lighting).is_some());
    let mut left: Vec<(usize, Vec<bool>)> = with_picture.map(|(index, probe)| (index, sees(probe))).collect();
    let seen_by_any = |p: &usize| left.iter().any(|(_, sees)| sees[*p]);
    let all: f64 = (0..surface.patches.len()).filter(seen_by_any).map(|p| area(&p)).sum();
    let mut order = Vec::new();
    let mut seen = vec![false; surface.patches.len()];
    let mut sum = 0.0;
    while !left.is_empty() {
        let adds = |sees: &[bool]| -> f64 { (0..seen.len()).filter(|p| sees[*p] && !seen[*p]).map(|p| area(&p)).sum() };
        let gains: Vec<f64> = left.iter().map(|(_, sees)| adds(sees)).collect();
        let best = (1..gains.len()).fold(0, |best, i| if gains[i] > gains[best] { i } else { best });
        let (index, sees) = left.remove(best);
        sum += gains[best];
        seen.iter_mut().zip(sees).for_each(|(seen, here)| *seen |= here);
        let share = if all > 0.0 { (sum / all).min(1.0) } else { 0.0 };
        order.push(Ranked { index, name: site.probes[index].name.clone(), seen: share });
    }
    order
}

/// The order in words; `None` of fewer than two probes.
pub fn order_said(order: &[Ranked]) -> Option<String> {
    let one = |r: &Ranked| format!("{} ({:.0} %)", r.name, 100.0 * r.seen);
    let list = order.iter().map(one).collect::<Vec<_>>().join(", ");
    (order.len() > 1).then(|| {
        format!(
            "Probes in plan order, with the share that each and those before it see of what all probes see: {list}."
        )
    })
}
