//! A view's figures, and tables of them.

use clerestory::audit::{Judged, Kind, Reason, Settings};

use crate::cases::Case;
use crate::measure::{mean, median, overlap};
use crate::plant::Fault;
use crate::truth::Truth;

/// What a view gave.
#[derive(Default)]
pub struct Row {
    pub ours: Vec<f64>,
    /// The same where pixels that show nothing of the fault count as wrong, too.
    pub whole: Vec<f64>,
    pub alone: Vec<f64>,
    pub difference: Vec<f64>,
    pub ssim: Vec<f64>,
    pub flip: Vec<f64>,
    pub found: usize,
    pub missed: usize,
    pub false_regions: usize,
    pub kind_right: usize,
    pub what_right: usize,
    pub displacement: Vec<f64>,
    pub sign_right: usize,
    pub wrongly_ok: Vec<f64>,
}

impl Row {
    pub fn add(&mut self, o: &Row) {
        for (a, b) in [
            (&mut self.ours, &o.ours),
            (&mut self.whole, &o.whole),
            (&mut self.alone, &o.alone),
            (&mut self.difference, &o.difference),
            (&mut self.ssim, &o.ssim),
            (&mut self.flip, &o.flip),
            (&mut self.displacement, &o.displacement),
            (&mut self.wrongly_ok, &o.wrongly_ok),
        ] {
            a.extend(b);
        }
        self.found += o.found;
        self.missed += o.missed;
        self.false_regions += o.false_regions;
        self.kind_right += o.kind_right;
        self.what_right += o.what_right;
        self.sign_right += o.sign_right;
    }
}

pub fn line_of(r: &Row) -> String {
    format!(
        "found {} false {} kind {} what {} off {:?} ok {:.2}",
        r.found, r.false_regions, r.kind_right, r.what_right, r.displacement, r.wrongly_ok[0]
    )
}

/// Prints a table in Markdown; `first` names its first column.
pub fn table(first: &str, rows: &[(String, Row)]) {
    println!(
        "\n| {first} | n | AP | AP, all pixels | own test | difference | SSIM | FLIP | F1 | false | kind | what | \
         displacement off | sign | called ok |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    for (name, r) in rows.iter().filter(|r| !r.1.ours.is_empty()) {
        let f1 = 2.0 * r.found as f64 / (2 * r.found + r.missed + r.false_regions).max(1) as f64;
        let signs = r.displacement.len();
        println!(
            "| {name} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {f1:.2} | {} | {} | {} | {} | {} | {:.2} |",
            r.ours.len(),
            mean(&r.ours),
            mean(&r.whole),
            mean(&r.alone),
            mean(&r.difference),
            mean(&r.ssim),
            mean(&r.flip),
            r.false_regions,
            format_args!("{}/{}", r.kind_right, r.found),
            format_args!("{}/{}", r.what_right, r.found),
            if signs > 0 { format!("{:.0} %", 100.0 * median(&mut r.displacement.clone())) } else { "–".into() },
            if signs > 0 { format!("{}/{signs}", r.sign_right) } else { "–".into() },
            mean(&r.wrongly_ok),
        );
    }
}

/// Fills a row's figures about regions.
pub fn regions(row: &mut Row, case: &Case, seen: &Truth, judged: &[Judged]) {
    let (truth, alike) = (&seen.wrong[..], &seen.alike[..]);
    let size = truth.iter().filter(|t| **t).count();
    let sure: Vec<(&Judged, Vec<usize>)> = judged
        .iter()
        .filter(|j| j.reason(Settings::default().false_alarms) == Reason::None)
        .map(|j| (j, j.pixels().iter().copied().filter(|i| !alike[*i]).collect()))
        .collect();
    let inside = |pixels: &[usize]| pixels.iter().filter(|i| truth[**i]).count() * 2 >= pixels.len();
    // a fault that came out in several pieces is found if the pieces together cover it
    let pieces: Vec<usize> = sure.iter().filter(|j| inside(&j.1)).flat_map(|j| j.1.iter().copied()).collect();
    let one = sure.iter().max_by(|a, b| overlap(&a.1, truth, size).total_cmp(&overlap(&b.1, truth, size))).map(|j| j.0);
    let best = sure.iter().map(|j| overlap(&j.1, truth, size)).fold(0.0, f64::max);
    let found = best.max(overlap(&pieces, truth, size)) >= 0.3;
    row.false_regions = sure.iter().filter(|j| !inside(&j.1) && overlap(&j.1, truth, size) < 0.3).count();
    row.found = usize::from(found);
    row.missed = usize::from(!found);
    if let (true, Some(j)) = (found, one) {
        let kind = if case.fault.is_texture() { Kind::Texture } else { Kind::Geometry };
        row.kind_right = usize::from(j.kind == kind || seen.is_fine());
        row.what_right = usize::from(case.fault.names().contains(&j.what.name()));
        if let (Fault::Displace(d), Some(m)) = (case.fault, j.displacement) {
            // the model was moved by d: the real surface is −d from it
            row.displacement.push((m.metres + f64::from(d)).abs() / f64::from(d.abs()));
            row.sign_right = usize::from(m.metres * f64::from(d) < 0.0);
        }
    }
}
