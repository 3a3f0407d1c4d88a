//! From the site file's keys to a checked [`Site`]: one file per table.

mod cameras;
mod lens;
mod light;
mod names;
mod photographs;
mod picture;
mod plan;
mod probe;
mod project;
mod resolver;
mod view;

use resolver::Resolver;

use std::path::Path;

use super::fault::{Faults, SiteError, Source};
use super::file::SiteFile;
use super::frame::{Frame, Up};
use super::parse::parsed;
use super::pose::finite_number;
use super::site::{Pictures, Places, Site};
use names::unique;
use probe::{with_exif_gains, with_lighting_warnings};

/// Reads and checks a site file's text. `path` is the file itself.
pub(in crate::site) fn site(path: &Path, text: &str, pictures: Pictures, places: Places) -> Result<Site, SiteError> {
    let source = Source { path, text };
    // what is wrong in one table says nothing of another: all is told at once
    let mut faults = Faults::default();
    let Some(file) = parsed(&source, &mut faults) else {
        return Err(faults.into_error().unwrap_or_else(|| source.without_model()));
    };
    let whole = faults.len() == 0;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut warnings = Vec::new();
    let frame = faults.keep(frame(&source, &file, &mut warnings));
    let frame = frame.unwrap_or(Frame { metres_per_unit: 1.0, up: Up::Y, north_deg: 0.0 });
    let resolver = Resolver { source, folder: folder.clone(), frame, pictures, places };
    let s = &resolver.source;

    let mut probes: Vec<_> = file.probe.iter().filter_map(|p| faults.keep(resolver.probe(p))).collect();
    faults.keep(unique(s, "probe", file.probe.iter().map(|p| &p.get_ref().name)));
    faults.keep(unique(s, "view", file.view.iter().map(|v| &v.get_ref().name)));
    let mut views = Vec::new();
    for table in &file.view {
        views.extend(faults.keep(resolver.view(table, &mut warnings)));
    }
    let cameras = file.cameras.as_ref();
    let pose_file =
        cameras.and_then(|table| faults.keep(resolver.cameras(table, &mut views, &mut probes, &mut warnings)));
    with_exif_gains(&mut probes, file.probe.iter().any(|p| p.get_ref().gain.is_some()));
    let project = faults.keep(project::project(s, &file.project)).unwrap_or_default();
    let name = match &file.site.name {
        Some(name) => name.get_ref().clone(),
        None => folder.file_name().map_or_else(|| "site".to_owned(), |n| n.to_string_lossy().into_owned()),
    };
    let model = faults.keep(resolver.existing(file.model.path.get_ref(), file.model.path.span(), "the model"));
    let environment = file.environment.as_ref().and_then(|e| faults.keep(resolver.environment(e)));
    let sun = file.sun.as_ref().and_then(|t| faults.keep(resolver.sun(&t.direction, &t.irradiance)));
    // which lightings there are is known only if all probes are
    let suns = file.sun.as_ref().filter(|_| whole && probes.len() >= file.probe.len());
    let suns = suns.and_then(|t| faults.keep(resolver.suns(t, &probes)));
    let plan = faults.keep(resolver.plan(&file.plan));
    if let Some(fault) = faults.into_error() {
        return Err(fault);
    }
    let site = Site {
        name,
        project,
        frame,
        model: model.unwrap_or_default(),
        vertex_colours: file.model.vertex_colours.unwrap_or_default(),
        environment,
        sun,
        suns: suns.unwrap_or_default(),
        pose_file,
        plan: plan.unwrap_or_default(),
        probes,
        views,
        warnings,
        file: resolver.source.path.to_owned(),
    };
    Ok(with_lighting_warnings(site))
}

fn frame(source: &Source, file: &SiteFile, warnings: &mut Vec<String>) -> Result<Frame, SiteError> {
    let metres_per_unit = match &file.site.units {
        Some(units) if units.get_ref().0.is_finite() && units.get_ref().0 > 0.0 => units.get_ref().0,
        Some(units) => {
            return Err(source.fault(
                units.span(),
                format!("expected metres per model unit above zero, found {}", units.get_ref().0),
                "Write \"m\", \"cm\", \"mm\", \"ft\", \"in\" or a positive number",
            ));
        }
        None => {
            warnings.push("The site file does not say site.units: metres are taken.".to_owned());
            1.0
        }
    };
    let up = match &file.site.up {
        Some(key) => Up::along(key.get_ref().0).ok_or_else(|| {
            source.fault(
                key.span(),
                format!("expected a direction, found {}", key.get_ref().0),
                "Give an axis, such as \"z\", or a vector that points up",
            )
        })?,
        None => {
            warnings.push("The site file does not say site.up: y is taken as the model's up axis.".to_owned());
            Up::Y
        }
    };
    let north_deg = file.site.north.as_ref().map_or(Ok(0.0), |n| finite_number(source, n))?;
    Ok(Frame { metres_per_unit, up, north_deg })
}
