//! The `[plan]` table.

use glam::DVec2;

use super::super::Plan;
use super::super::fault::SiteError;
use super::super::file::{Number, Pair, PlanTable};
use super::Resolver;

impl Resolver<'_> {
    pub(super) fn plan(&self, t: &PlanTable) -> Result<Plan, SiteError> {
        let mut plan = Plan::default();
        if let Some(n) = &t.max_probes {
            plan.max_probes = *n.get_ref();
            if plan.max_probes == 0 {
                return Err(self.source.fault(n.span(), "expected at least 1 probe, found 0", "Correct the number"));
            }
        }
        if let Some(field) = &t.vertical_field {
            let [low, high] = **field.get_ref();
            if !(-90.0 <= low && low < high && high <= 90.0) {
                return Err(self.source.fault(
                    field.span(),
                    format!("expected two angles from -90 to 90 degrees, the lower first, found [{low}, {high}]"),
                    "Write [-90, 90] for a whole sphere",
                ));
            }
            plan.vertical_field_deg = [low, high];
        }
        let set = |value: &mut f64, key: &Option<Number>, ok: fn(f64) -> bool, expected: &str| {
            if let Some(key) = key {
                *value = self.number(key, ok, expected)?;
            }
            Ok::<(), SiteError>(())
        };
        set(&mut plan.probe_height_m, &t.probe_height, |v| v > 0.0, "a height in metres above zero")?;
        set(&mut plan.clearance_m, &t.clearance, |v| v >= 0.0, "metres, zero or greater")?;
        set(&mut plan.range_m, &t.range, |v| v >= 0.0, "metres, zero (no limit) or greater")?;
        set(&mut plan.incidence_deg, &t.incidence, |v| v > 0.0 && v <= 90.0, "degrees above 0, at most 90")?;
        set(&mut plan.target_coverage, &t.target_coverage, |v| v > 0.0 && v <= 1.0, "a share above 0, at most 1")?;
        set(&mut plan.overlap, &t.overlap, |v| (0.0..=1.0).contains(&v), "a share from 0 to 1")?;
        for ring in &t.keep_out {
            if ring.get_ref().len() < 3 {
                return Err(self.source.fault(
                    ring.span(),
                    "expected a polygon of at least three corners",
                    "Add corners",
                ));
            }
            plan.keep_out.push(self.plan_points(ring.get_ref())?);
        }
        plan.fixed = self.plan_points(&t.fixed)?;
        Ok(plan)
    }

    /// Points in plan, in the program's x and y.
    fn plan_points(&self, pairs: &[Pair]) -> Result<Vec<DVec2>, SiteError> {
        let one = |pair: &Pair| {
            let local = self.frame.plan_in(**pair.get_ref());
            if local.is_finite() {
                return Ok(local);
            }
            Err(self.source.fault(
                pair.span(),
                format!("expected finite numbers, found {:?}", **pair.get_ref()),
                "Measure it again, or leave it out",
            ))
        };
        pairs.iter().map(one).collect()
    }
}
