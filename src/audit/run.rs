//! From a site to an audit: every view with a photograph, and findings merged across views.

use rayon::prelude::*;

use crate::audit::decide::assess::assess;
use crate::audit::decide::merge::{gathered, weigh};
use crate::audit::error::AuditError;
use crate::audit::finding::Audit;
use crate::audit::observe::photo::Photo;
use crate::audit::view::{AuditScene, Settings, examine};
use crate::panorama;
use crate::photograph::Photograph;
use crate::register::{self, Misfit};
use crate::render::{Options, prepare};
use crate::scene::Scene;
use crate::site::{Site, View};
use crate::volume;

/// How far an audit has come: what is being done, steps done, steps in all.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Audits the views of a site that have a photograph; only those named, if any are. Probes that were not taken where the site has
/// them are left out, with a warning each, if they are to be checked.
///
/// # Errors
///
/// A picture that cannot be read or has another size than its view, a site without photographs or without probes that fit.
pub fn audit(
    site: &Site,
    scene: &Scene,
    lighting: &str,
    only: &[String],
    settings: &Settings,
    progress: Progress,
) -> Result<Audit, AuditError> {
    // read before the long work, so that a bad file is told at once
    let views = photographed(site, only, progress)?;
    if !settings.check_probes {
        return audited(site, scene, lighting, views, settings, progress);
    }
    let (fitting, left_out) = without_misfits(site, scene, lighting, settings)?;
    let mut audit = audited(&fitting, scene, lighting, views, settings, progress)?;
    audit.warnings.splice(0..0, left_out);
    Ok(audit)
}

/// The views that have a photograph, and these.
fn photographed<'a>(site: &'a Site, only: &[String], progress: Progress) -> Result<Vec<(&'a View, Photo)>, AuditError> {
    let wanted = |v: &&View| v.photo.is_some() && (only.is_empty() || only.contains(&v.name));
    let views: Vec<&View> = site.views.iter().filter(wanted).collect();
    if views.is_empty() {
        return Err(AuditError::NoPhotograph { site: site.file.display().to_string() });
    }
    progress("photographs", 0, views.len() + 2);
    let mut all = Vec::new();
    for (view, read) in views.par_iter().map(|view| (*view, Photograph::of(view))).collect::<Vec<_>>() {
        all.extend(read?.map(|photograph| (view, Photo::from(photograph))));
    }
    progress("probes", 1, views.len() + 2);
    Ok(all)
}

fn audited(
    site: &Site,
    scene: &Scene,
    lighting: &str,
    views: Vec<(&View, Photo)>,
    settings: &Settings,
    progress: Progress,
) -> Result<Audit, AuditError> {
    let steps = views.len() + 2;
    let cameras: Vec<_> = views.iter().map(|(view, _)| view.camera).collect();
    let options = Options {
        lightings: vec![lighting.to_owned()],
        probes: settings.probes,
        sun: true,
        volume: volume::VolumeSettings { cells: settings.cells, ..volume::VolumeSettings::default() },
        all_stages: true,
        volume_for_all: true,
    };
    let setup = prepare(site, scene, &cameras, &options)?;
    let light = &setup.lights[0].1;
    let volume = setup.volume(scene, 0);
    let mut prepared = AuditScene::new(scene, light, volume.as_ref());
    for probe in site.probes.iter().take(settings.probes) {
        if let Some(lit) = probe.picture(lighting) {
            prepared = prepared.with(probe, panorama::read(&lit.path)?);
        }
    }
    let mut seen = Vec::new();
    for (i, (view, photo)) in views.into_iter().enumerate() {
        progress(&view.name, i + 2, steps);
        let observed = examine(&prepared, &view.camera, &photo, settings);
        seen.push(assess(site, &prepared, view, photo, observed));
    }
    weigh(&mut seen, settings);
    progress("done", steps, steps);
    Ok(gathered(site, lighting, settings, seen))
}

/// The site without probes whose pictures do not fit the model where the site file has them, and a sentence for each: what such a
/// probe says of a surface is another surface's light, and the model would be blamed for it.
fn without_misfits(
    site: &Site,
    scene: &Scene,
    lighting: &str,
    settings: &Settings,
) -> Result<(Site, Vec<String>), AuditError> {
    let mut fitting = site.clone();
    fitting.probes.truncate(settings.probes);
    if fitting.probes.is_empty() {
        return Ok((fitting, Vec::new()));
    }
    let probes = Site { views: Vec::new(), ..fitting.clone() };
    let settings = register::RegisterSettings {
        lighting: Some(lighting.to_owned()),
        tilt_deg: register::TRIPOD_TILT_DEG,
        ..register::RegisterSettings::default()
    };
    let mut misfits = register::misfits(&probes, scene, &settings)?;
    // a picture that fits nowhere may as well speak against the model
    misfits.retain(|(_, misfit)| *misfit != Misfit::Nowhere);
    let names: Vec<&str> = misfits.iter().map(|(subject, _)| subject.name(&probes)).collect();
    fitting.probes.retain(|p| !names.contains(&p.name.as_str()));
    let told = misfits.iter().map(|(subject, misfit)| {
        format!("probe “{}” is left out of this audit: {}", subject.name(&probes), misfit.sentence())
    });
    let told: Vec<String> = told.collect();
    if fitting.probes.is_empty() {
        return Err(AuditError::NoProbeFits { site: site.file.display().to_string(), why: told.join(" ") });
    }
    Ok((fitting, told))
}
