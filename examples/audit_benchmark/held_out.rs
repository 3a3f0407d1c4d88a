//! Real photographs of a model that is trusted: pictures held out of a site's own probes are audited by the others. What is found is false,
//! but for what the model lacks.

use clerestory::audit::{Settings, audit};
use clerestory::panorama::{self, Projection};
use clerestory::scene::{self, Health};
use clerestory::site::{Camera, CameraSource, Probe, Site, View};
use std::path::Path;

/// Audits every `every`th perspective probe of a site as a photograph, in as many rounds.
pub fn held_out(path: &str, every: usize) {
    let site = Site::load(Path::new(path)).unwrap();
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    let lighting = site.lightings()[0].clone();
    let (mut photographs, mut found) = (0, 0);
    for round in 0..every {
        let probes = site.probes.iter().enumerate();
        let (held, kept): (Vec<_>, Vec<_>) = probes.partition(|(k, _)| k % every == round);
        let views: Vec<View> = held.into_iter().filter_map(|(_, p)| view(p, &lighting)).collect();
        if views.is_empty() {
            continue;
        }
        let probes = kept.into_iter().map(|(_, p)| p.clone()).collect();
        let part = Site { probes, views, ..site.clone() };
        let audited = audit(&part, &scene, &lighting, &[], &Settings::default(), &|_, _, _| {}).unwrap();
        photographs += audited.views.len();
        found += audited.findings.len();
        let names: Vec<&str> = audited.views.iter().map(|v| v.summary.view.as_str()).collect();
        println!("# {}: {} findings, {} doubts", names.join(", "), audited.findings.len(), audited.doubts.len());
        for f in &audited.findings {
            println!(
                "#     {} in {} {:.2} {} px, {}: {}",
                f.id, f.view, f.score, f.area_px, f.evidence[0].test, f.note
            );
        }
    }
    println!("{found} findings in {photographs} photographs");
}

/// A perspective probe's picture as a photograph.
fn view(probe: &Probe, lighting: &str) -> Option<View> {
    let Projection::Perspective { fov_y } = probe.projection else { return None };
    let path = &probe.picture(lighting)?.path;
    let picture = panorama::read(path).unwrap();
    let camera = Camera::with_fov(probe.pose, picture.width as u32, picture.height as u32, fov_y.to_degrees());
    Some(View {
        name: probe.name.clone(),
        camera,
        photo: Some(path.clone()),
        mask: None,
        matches: vec![],
        source: CameraSource::SiteFile,
    })
}
