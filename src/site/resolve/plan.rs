//! The `[plan]` table.

use glam::DVec2;
use toml::Spanned;

use super::super::Plan;
use super::super::fault::SiteError;
use super::super::file::{Pair, PlanTable};
use super::Resolver;

impl Resolver<'_> {
    pub(super) fn plan(&self, t: &PlanTable) -> Result<Plan, SiteError> {
        let default = Plan::default();
        let number = |key: &Option<Spanned<f64>>, default: f64, ok: fn(f64) -> bool, expected: &str| {
            key.as_ref().map_or(Ok(default), |k| self.number(k, ok, expected))
        };
        let max_probes = match &t.max_probes {
            Some(n) if *n.get_ref() == 0 => {
                return Err(self.source.fault(n.span(), "expected at least 1 probe, found 0", "Correct the number"));
            }
            Some(n) => *n.get_ref(),
            None => default.max_probes,
        };
        let vertical_field_deg = match &t.vertical_field {
            Some(field) => {
                let [low, high] = **field.get_ref();
                if !(-90.0 <= low && low < high && high <= 90.0) {
                    return Err(self.source.fault(
                        field.span(),
                        format!("expected two angles from -90 to 90 degrees, the lower first, found [{low}, {high}]"),
                        "Write [-90, 90] for a whole sphere",
                    ));
                }
                [low, high]
            }
            None => default.vertical_field_deg,
        };
        let keep_out = t.keep_out.iter().map(|ring| {
            if ring.get_ref().len() < 3 {
                return Err(self.source.fault(
                    ring.span(),
                    "expected a polygon of at least three corners",
                    "Add corners",
                ));
            }
            ring.get_ref().iter().map(|p| self.plan_point(p)).collect()
        });
        Ok(Plan {
            probe_height_m: number(
                &t.probe_height,
                default.probe_height_m,
                |v| v > 0.0,
                "a height in metres above zero",
            )?,
            clearance_m: number(&t.clearance, default.clearance_m, |v| v >= 0.0, "metres, zero or greater")?,
            range_m: number(&t.range, default.range_m, |v| v >= 0.0, "metres, zero (no limit) or greater")?,
            incidence_deg: number(
                &t.incidence,
                default.incidence_deg,
                |v| v > 0.0 && v <= 90.0,
                "degrees above 0, at most 90",
            )?,
            target_coverage: number(
                &t.target_coverage,
                default.target_coverage,
                |v| v > 0.0 && v <= 1.0,
                "a share above 0, at most 1",
            )?,
            max_probes,
            overlap: number(&t.overlap, default.overlap, |v| (0.0..=1.0).contains(&v), "a share from 0 to 1")?,
            vertical_field_deg,
            keep_out: keep_out.collect::<Result<_, _>>()?,
            fixed: t.fixed.iter().map(|p| self.plan_point(p)).collect::<Result<_, _>>()?,
        })
    }

    /// A point in plan, in the program's x and y.
    fn plan_point(&self, pair: &Pair) -> Result<DVec2, SiteError> {
        let local = self.frame.plan_in(**pair.get_ref());
        if local.is_finite() {
            return Ok(local);
        }
        Err(self.source.fault(
            pair.span(),
            format!("expected finite numbers, found {:?}", **pair.get_ref()),
            "Measure it again, or leave it out",
        ))
    }
}
