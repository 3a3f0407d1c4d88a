//! A plan for a whole site: floors, stations on each, and what they see in plan and in space.

use glam::{DVec2, DVec3, Vec3};

use super::assemble::floor_plan;
use super::problem::FloorProblem;
use super::result::{FloorPlan, SitePlan, SurfaceCover, SurfacePlan};
use super::selection;
use crate::plan::PlanError;
use crate::plan::floors::find::{Found, find_floors};
use crate::plan::floors::floor::Floor;
use crate::plan::floors::raster::Map;
use crate::plan::visibility::surface::{PatchVisibility, Surface};
use crate::scene::Scene;
use crate::site::{Plan, Site};

/// What to plan.
#[derive(Clone, Debug)]
pub struct Options {
    /// Plan as if no probe had been taken.
    pub fresh: bool,
    /// Only the floors of these names (`ground` or `Ground floor`); all where it is empty.
    pub floors: Vec<String>,
    /// The most patches that the surface is cut into; 0 leaves the check in space out.
    pub patches: usize,
    /// Count small parts too that cannot be walked to and are open to what is not their floor.
    pub all_parts: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { fresh: false, floors: Vec::new(), patches: 150_000, all_parts: false }
    }
}

/// Plans a site. The same for any number of threads.
///
/// # Errors
///
/// No floor, an open model, no place for a tripod, or limits that exclude each other.
pub fn plan<'a>(site: &Site, scene: &'a Scene, options: &Options) -> Result<SitePlan<'a>, PlanError> {
    let limits = &site.plan;
    let Found { floors, mut warnings } = find_floors(scene, limits, options.all_parts)?;
    let wanted = wanted(&floors, &options.floors)?;
    // a place belongs to its floor whether that is planned or not
    let present = present(site, scene, &floors, options.fresh, &mut warnings);
    let fixed = fixed(site, scene, &floors, &present)?;
    let count: usize = fixed.iter().zip(&wanted).filter(|(_, wanted)| **wanted).map(|(f, _)| f.len()).sum();
    if count > limits.max_probes as usize {
        return Err(PlanError::TooManyFixed { fixed: count, most: limits.max_probes });
    }
    let mut problems = Vec::new();
    for (((floor, fixed), present), wanted) in floors.into_iter().zip(&fixed).zip(present).zip(wanted) {
        if wanted {
            problems.push(FloorProblem::new(floor, scene, limits, fixed, present)?);
        }
    }
    let mut chosen = selection::in_plan(&problems, limits);
    let house = selection::house(&problems).filter(|_| options.patches > 0);
    let space = house.map(|house| (Surface::new(scene, limits, options.patches), house));
    let mut reach = Vec::new();
    if let Some((surface, house)) = &space {
        reach = problems.iter().map(|problem| selection::reached(surface, problem, house)).collect();
        for (i, problem) in problems.iter().enumerate() {
            let left = selection::left(&chosen, limits);
            selection::in_space(problem, surface, &reach[i], limits, left, &mut chosen[i]);
        }
    }
    for (i, problem) in problems.iter().enumerate() {
        let left = selection::left(&chosen, limits);
        selection::link(problem, limits, left, &mut chosen[i]);
    }
    let mut plans = Vec::new();
    let mut names: Vec<String> = site.probes.iter().map(|p| p.name.clone()).collect();
    for (problem, chosen) in problems.into_iter().zip(&chosen) {
        let plan = floor_plan(problem, chosen, scene, limits, &mut names);
        warn(&plan, limits, &mut warnings);
        plans.push(plan);
    }
    let surface = space.map(|(surface, house)| surface_plan(surface, &mut plans, &reach, &house, limits));
    Ok(SitePlan { floors: plans, warnings, surface })
}

/// Which floors have one of some names: all, where there is none.
fn wanted(floors: &[Floor], names: &[String]) -> Result<Vec<bool>, PlanError> {
    let is = |floor: &Floor, name: &str| {
        floor.slug.eq_ignore_ascii_case(name.trim()) || floor.name.eq_ignore_ascii_case(name.trim())
    };
    if let Some(name) = names.iter().find(|n| !floors.iter().any(|f| is(f, n))) {
        let known: Vec<&str> = floors.iter().map(|f| f.slug.as_str()).collect();
        return Err(PlanError::UnknownFloor { name: name.clone(), known: known.join(", ") });
    }
    Ok(floors.iter().map(|f| names.is_empty() || names.iter().any(|n| is(f, n))).collect())
}

/// The probes that stand on each floor, with local positions.
fn present(
    site: &Site,
    scene: &Scene,
    floors: &[Floor],
    fresh: bool,
    warnings: &mut Vec<String>,
) -> Vec<Vec<(String, DVec3)>> {
    let mut present = vec![Vec::new(); floors.len()];
    for probe in site.probes.iter().filter(|_| !fresh) {
        let at = probe.pose.position - scene.origin;
        let off = |f: &Floor| (at.z as f32 - f.lens(at.truncate(), site.plan.probe_height_m)).abs();
        let on = (0..floors.len()).filter(|f| floors[*f].open.at(at.truncate()) && off(&floors[*f]) < 1.3);
        match on.min_by(|a, b| off(&floors[*a]).total_cmp(&off(&floors[*b]))) {
            Some(floor) => present[floor].push((probe.name.clone(), at)),
            None => warnings
                .push(format!("Probe “{}” stands on none of the floors: what it sees is not counted.", probe.name)),
        }
    }
    present
}

/// The fixed places of each floor, local: on the lowest floor where a tripod can stand there. Those where a probe has
/// been taken are left out.
fn fixed(
    site: &Site,
    scene: &Scene,
    floors: &[Floor],
    present: &[Vec<(String, DVec3)>],
) -> Result<Vec<Vec<DVec2>>, PlanError> {
    let mut fixed = vec![Vec::new(); floors.len()];
    for point in &site.plan.fixed {
        let at = *point - scene.origin.truncate();
        if present.iter().flatten().any(|(_, p)| p.truncate().distance(at) < 0.25) {
            continue;
        }
        let free = floors.iter().position(|f| f.standable.at(at));
        // closer to a wall than the clearance, if need be: it was asked for
        let floor = free.or_else(|| floors.iter().position(|f| f.walkable.at(at) && f.open.at(at)));
        let Some(floor) = floor else { return Err(blocked(site, scene, floors, at)) };
        fixed[floor].push(at);
    }
    Ok(fixed)
}

fn blocked(site: &Site, scene: &Scene, floors: &[Floor], at: DVec2) -> PlanError {
    let places = floors.iter().flat_map(|f| f.standable.cells().map(move |c| (f, f.standable.grid.middle(c))));
    let nearest = places.min_by(|a, b| a.1.distance_squared(at).total_cmp(&b.1.distance_squared(at)));
    let out = |p: DVec2| site.frame.plan_out(p + scene.origin.truncate()).map(|v| (v * 100.0).round() / 100.0);
    let (floor, free) = nearest.map_or_else(|| (String::new(), at), |(f, p)| (f.name.to_lowercase(), p));
    PlanError::FixedBlocked { at: out(at), free: out(free), floor }
}

fn warn(plan: &FloorPlan, limits: &Plan, warnings: &mut Vec<String>) {
    let name = &plan.floor.name;
    let covered = plan.covered_fraction();
    if covered < limits.target_coverage - 0.005 {
        warnings.push(format!(
            "{name}: {:.1} % of what can be seen is seen, {:.0} % were asked for; allow more with plan.max_probes.",
            100.0 * covered,
            100.0 * limits.target_coverage
        ));
    }
    if plan.groups > 1 {
        warnings.push(format!(
            "{name}: the stations fall into {} groups that have less than {:.0} % in common; use targets to register \
             them, or allow more stations.",
            plan.groups,
            100.0 * limits.overlap
        ));
    }
}

/// Looks at the model's surface from all stations, and tells each floor's share.
fn surface_plan<'a>(
    surface: Surface<'a>,
    plans: &mut [FloorPlan],
    reach: &[Vec<bool>],
    house: &Map,
    limits: &Plan,
) -> SurfacePlan<'a> {
    let stations: Vec<Vec3> =
        plans.iter().flat_map(|p| p.present.iter().chain(&p.stations)).map(|s| s.position.as_vec3()).collect();
    let mut interior = vec![false; surface.patches.len()];
    let mut reachable = interior.clone();
    let mut facing = Vec::new();
    for (plan, reach) in plans.iter().zip(reach) {
        let own = surface.reached(&selection::inside(&plan.floor, limits), house, true);
        for p in 0..own.len() {
            interior[p] |= own[p] || reach[p];
            reachable[p] |= reach[p];
        }
        facing.push(own);
    }
    let seen = PatchVisibility::from(&surface, &stations, &reachable);
    // a patch whose middle is hidden, but which is seen in part, counts as neither
    let mut number = 0;
    for ((plan, reach), facing) in plans.iter_mut().zip(reach).zip(facing) {
        let sum =
            |of: &dyn Fn(usize) -> bool| -> f64 { (0..reach.len()).filter(|p| of(*p)).map(|p| surface.areas[p]).sum() };
        let reachable_m2 = sum(&|p| reach[p]);
        plan.surface = Some(SurfaceCover {
            reachable_m2,
            covered_fraction: sum(&|p| reach[p] && seen.stations[p] > 0) / reachable_m2.max(f64::MIN_POSITIVE),
            unreachable_m2: sum(&|p| facing[p] && !reachable[p]),
        });
        for station in plan.present.iter_mut().chain(&mut plan.stations) {
            let new = sum(&|p| reach[p] && seen.first[p] == number);
            station.adds_surface_fraction = Some(new / reachable_m2.max(f64::MIN_POSITIVE));
            number += 1;
        }
    }
    SurfacePlan { surface, reachable, interior, seen }
}
