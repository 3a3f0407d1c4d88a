//! Writing all files of a plan.

use std::path::Path;

use super::coverage_sheet::coverage_sheet;
use super::dxf::plan_dxf;
use super::plan_sheet::plan_sheet;
use crate::plan::export::ply;
use crate::plan::export::tables::{self, Outward, PlanJson};
use crate::plan::stations::result::SitePlan;
use crate::report::error::ReportError;
use crate::report::files::{remove_earlier, write_file, write_json, write_sheet};
use crate::scene::Scene;
use crate::site::Site;

/// Writes a plan's sheets and DXF drawings, `plan.json`, `plan.csv` and, where the surface was checked, `coverage.ply`;
/// where it was not, an earlier plan's is removed. Gives what `plan.json` holds and the files' names.
///
/// # Errors
/// If a sheet cannot be drawn, or the file system refuses.
pub fn write_plan(
    site: &Site,
    scene: &Scene,
    plan: &SitePlan<'_>,
    folder: &Path,
) -> Result<(PlanJson, Vec<String>), ReportError> {
    let outward = &Outward::of(site, scene);
    let mut names = Vec::new();
    for (i, floor) in plan.floors.iter().enumerate() {
        let count = 2 * plan.floors.len();
        let sheets = [
            plan_sheet(site, [2 * i + 1, count], floor, outward),
            coverage_sheet(site, [2 * i + 2, count], floor, outward),
        ];
        for (stem, sheet) in tables::sheets(floor).into_iter().zip(sheets) {
            write_sheet(&sheet, folder, &stem)?;
            names.push(format!("{stem}.svg, .png, .pdf"));
        }
        let drawing = format!("{}.dxf", tables::sheets(floor)[0]);
        write_file(&folder.join(&drawing), plan_dxf(floor, outward).as_bytes())?;
        names.push(drawing);
    }
    let json = tables::json(site, plan, outward);
    write_json(&folder.join("plan.json"), &json)?;
    write_file(&folder.join("plan.csv"), tables::csv(plan, outward).as_bytes())?;
    names.extend(["plan.json".to_owned(), "plan.csv".to_owned()]);
    let path = folder.join("coverage.ply");
    if let Some(surface) = &plan.surface {
        let mut bytes = Vec::new();
        ply::write(surface, outward, &mut bytes).map_err(|source| ReportError::Io { path: path.clone(), source })?;
        write_file(&path, &bytes)?;
        names.push("coverage.ply".to_owned());
    } else {
        remove_earlier(&path)?;
    }
    Ok((json, names))
}
