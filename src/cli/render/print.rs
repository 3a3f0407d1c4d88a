//! What `render` tells people.

use clerestory::radiometry::Fit;
use clerestory::render::{LeftOut, Timings};
use clerestory::report::{BakedFrames, NotDone, Rendered, VideoTimes};
use clerestory::study::{Comparison, median};
use std::io::{self, Write};

use crate::cli::terminal::output::warn;

/// Tells what was rendered.
pub(super) fn print(outcome: &Rendered, out: &mut impl Write) -> io::Result<()> {
    let Timings { load_s, shoot_s, index_s, volume_s } = outcome.setup;
    warn("!", &outcome.warnings, out)?;
    writeln!(out, "load {load_s:.2} s, shoot {shoot_s:.2} s, index {index_s:.2} s, volume {volume_s:.2} s")?;
    let mib = outcome.record_bytes as f64 / f64::from(1 << 20);
    writeln!(out, "{} records in {mib:.0} MiB", outcome.records)?;
    if let Some(BakedFrames { vertices, seconds, flip, video }) = &outcome.baked {
        let off: Vec<String> = flip.iter().map(|f| format!("{f:.3}")).collect();
        let off = if off.is_empty() {
            String::new()
        } else {
            format!("; FLIP to frames rendered in full: {}", off.join(", "))
        };
        writeln!(out, "drawn from light at {vertices} vertices, baked in {seconds:.2} s{off}")?;
        if let Some(VideoTimes { operator_s, frames, decode_s, product_s }) = video {
            let each = 1e3 / *frames as f64;
            writeln!(
                out,
                "{frames} pictures of each probe: operator found in {operator_s:.2} s; reading {:.0} ms, relighting {:.0} ms each",
                decode_s * each,
                product_s * each
            )?;
        }
    }
    if let Some(fit) = &outcome.gains {
        print_gains(fit, out)?;
    }
    for NotDone { what: LeftOut { stage, why }, saves } in &outcome.left_out {
        let saves = saves.map_or_else(String::new, |s| {
            format!("; saves about {:.2} s and {:.1} MiB", s.seconds, s.bytes as f64 / f64::from(1 << 20))
        });
        writeln!(out, "left out {stage}: {why}{saves}")?;
    }
    for view in &outcome.views {
        let frame_s = view.rays_s + view.shade_s;
        writeln!(
            out,
            "{}  {:.1} % seen by probes, {:.0} ms ({:.1} frames a second; its rays alone {:.0} ms)",
            view.file.display(),
            100.0 * view.covered_fraction,
            1e3 * frame_s,
            1.0 / frame_s,
            1e3 * view.rays_s
        )?;
        if let Some(error) = &view.error {
            print_parts(error, out)?;
        }
        if let (Some(fit), Some(error)) = (&view.fit, &view.error_after_fit) {
            let ([r, g, b], [v, w]) = (fit.gain, fit.vignetting);
            writeln!(
                out,
                "  photograph fitted to the render: gain [{r:.4}, {g:.4}, {b:.4}], vignetting [{v:.3}, {w:.3}]"
            )?;
            print_parts(error, out)?;
        }
    }
    print_means("", outcome.views.iter().filter_map(|v| v.error.as_ref()).collect(), out)?;
    print_means(" after the fit", outcome.views.iter().filter_map(|v| v.error_after_fit.as_ref()).collect(), out)
}

/// The probes' gains as lines for the site file.
fn print_gains(fit: &Fit, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "gains fitted from {} comparisons: two probes of one place are {:.1} % apart, {:.1} % before",
        fit.comparisons,
        100.0 * fit.spread,
        100.0 * fit.spread_before
    )?;
    for picture in &fit.pictures {
        let [r, g, b] = picture.gain;
        let [[v, w], [p, q]] = [picture.vignetting, picture.response];
        write!(out, "  {:<12} gain = [{r:.4}, {g:.4}, {b:.4}]", picture.name)?;
        if [v, w] != [0.0; 2] {
            write!(out, "; vignetting = [{v:.4}, {w:.4}]")?;
        }
        if [p, q] != [0.0; 2] {
            write!(out, "; response = [{p:.4}, {q:.4}]")?;
        }
        match picture.tied {
            true => writeln!(out)?,
            false => writeln!(out, "  not fitted: it sees too little of what others see")?,
        }
    }
    Ok(())
}

/// Errors of a view, whole and in parts.
fn print_parts(error: &Comparison, out: &mut impl Write) -> io::Result<()> {
    let parts = [
        ("all", &error.all),
        ("by records", &error.records),
        ("by the volume", &error.volume),
        ("where no probe sees", &error.unseen),
    ];
    for (name, e) in parts.into_iter().filter(|p| p.1.share > 0.0) {
        let (share, median) = (100.0 * e.share, 100.0 * e.median);
        writeln!(
            out,
            "  {name:<20} {share:5.1} % of pixels  FLIP {:.4}  relMSE {:.4}  median error {median:.1} %",
            e.flip, e.relmse
        )?;
    }
    if error.unlit_pixels > 0 {
        writeln!(out, "  {} pixels show a surface without any light", error.unlit_pixels)?;
    }
    Ok(())
}

/// Errors over several views.
fn print_means(when: &str, errors: Vec<&Comparison>, out: &mut impl Write) -> io::Result<()> {
    if errors.len() > 1 {
        let n = errors.len() as f64;
        let flip = errors.iter().map(|e| e.all.flip).sum::<f64>() / n;
        let relmse = errors.iter().map(|e| e.all.relmse).sum::<f64>() / n;
        writeln!(out, "mean over {} views{when}: FLIP {flip:.4}, relMSE {relmse:.4}", errors.len())?;
        let unseen: Vec<f64> = errors.iter().flat_map(|e| e.unseen_errors.iter().copied()).collect();
        let filled: Vec<f64> = errors.iter().flat_map(|e| e.filled_errors.iter().copied()).collect();
        let parts = [("where no probe sees", unseen), ("that no record lights", filled)];
        for (which, errors) in parts.into_iter().filter(|(_, errors)| !errors.is_empty()) {
            let (count, error) = (errors.len(), 100.0 * median(errors));
            writeln!(out, "all {count} pixels {which}{when}: median error {error:.1} %")?;
        }
    }
    Ok(())
}
