//! Faults whose masks are known: whole audits of models that somebody has made wrong, beside photographs in which masks say where.

use clerestory::audit::{Audit, AuditedView, Settings, Verdict, audit};
use clerestory::scene::{self, Health};
use clerestory::site::Site;
use std::collections::BTreeMap;
use std::path::Path;

use crate::measure::overlap;

/// Audits each site and compares its photographs with the masks in the folder that follows it, a picture `VIEW.png` a view.
pub fn masked(sites_and_folders: &[String]) {
    let [mut faulty, mut wrongly_ok] = [0usize; 2];
    for pair in sites_and_folders.chunks_exact(2) {
        let site = Site::load(Path::new(&pair[0])).unwrap();
        let scene = scene::load(&site, &mut Health::default()).unwrap();
        let lighting = site.lightings()[0].clone();
        let audited = audit(&site, &scene, &lighting, &[], &Settings::default(), &|_, _, _| {}).unwrap();
        println!("# {}: {} findings, {} doubts", pair[0], audited.findings.len(), audited.doubts.len());
        for view in &audited.views {
            let file = Path::new(&pair[1]).join(format!("{}.png", view.summary.view));
            // not all views show a fault
            if file.exists() {
                let fault = at_the_audits_size(&image::open(&file).unwrap().into_luma8(), view);
                faulty += fault.iter().filter(|f| **f).count();
                wrongly_ok += compare(&audited, view, &fault);
            }
        }
    }
    let share = 100.0 * wrongly_ok as f64 / faulty.max(1) as f64;
    println!("{wrongly_ok} of {faulty} pixels of faults called ok ({share:.2} %)");
}

/// Which of the audit's pixels a mask of the photograph's size has.
fn at_the_audits_size(mask: &image::GrayImage, view: &AuditedView) -> Vec<bool> {
    let (by, width) = (view.summary.reduced_by, view.render.width as u32);
    let within = |i: u32| mask.get_pixel(i % width * by, i / width * by).0[0] > 127;
    (0..view.verdicts.len() as u32).map(within).collect()
}

/// Prints what findings and verdicts say of a fault, and counts its pixels that are called ok.
fn compare(audited: &Audit, view: &AuditedView, fault: &[bool]) -> usize {
    let size = fault.iter().filter(|f| **f).count();
    let mut found = vec![false; fault.len()];
    let mut told: BTreeMap<&str, usize> = BTreeMap::new();
    for (id, mask) in &view.masks {
        let finding = audited.findings.iter().find(|f| f.id == *id);
        let touches = mask.iter().zip(fault).any(|(m, f)| *m && *f);
        if let Some(finding) = finding.filter(|_| touches) {
            found.iter_mut().zip(mask).for_each(|(all, m)| *all |= *m);
            *told.entry(finding.what.name()).or_default() += mask.iter().filter(|m| **m).count();
        }
    }
    let region: Vec<usize> = (0..found.len()).filter(|i| found[*i]).collect();
    let count = |verdict: Verdict| (0..fault.len()).filter(|i| fault[*i] && view.verdicts[*i] == verdict).count();
    let [ok, untestable] = [Verdict::Ok, Verdict::Untestable].map(count);
    let overlap = overlap(&region, fault, size);
    println!(
        "#     {} {size} px: IoU {overlap:.2}, told as {told:?}; {ok} ok, {untestable} untestable",
        view.summary.view
    );
    ok
}
