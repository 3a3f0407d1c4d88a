//! Where the truth of a site's views comes from.

use std::path::Path;

use super::{Tile, TruthNoise, TruthView, cut, stack, tiles};
use crate::panorama;
use crate::panorama::{Layer, Picture, write_exr};
use crate::photograph;
use crate::reference::{Estimate, Lights};
use crate::scene::Scene;
use crate::site::View;
use crate::study::StudyError;
use crate::study::measure::trace;
use crate::study::options::Options;
use crate::study::state::TruthNote;

/// Photographs as truth, and whole.
pub(crate) type Photographed = (Vec<TruthView>, Vec<Option<Picture>>);

pub(crate) fn photographed(views: &[&View], share: f64) -> Result<Photographed, StudyError> {
    let (mut truth, mut photos) = (Vec::new(), Vec::new());
    for view in views {
        let Some((photo, _)) = photograph::read_masked(view)? else { continue };
        let (w, h) = (view.camera.width, view.camera.height);
        let tile = |r: [u32; 4]| Tile { x: r[0], y: r[1], truth: cut(&photo, r), halves: None };
        let tiles = tiles(w, h, share).into_iter().map(tile).collect();
        truth.push(TruthView::new(&view.name, view.camera, tiles, &photo));
        photos.push(Some(photo));
    }
    Ok((truth, photos))
}

/// References, traced, or read again where they have been traced for the same study (`known`).
pub(crate) fn referenced(
    scene: &Scene,
    lights: &Lights,
    views: &[&View],
    options: &Options,
    folder: &Path,
    known: bool,
    doing: &dyn Fn(&str),
) -> Result<Vec<TruthView>, StudyError> {
    let mut all = Vec::new();
    for view in views {
        let rectangles = tiles(view.camera.width, view.camera.height, options.share);
        let blank =
            |r: &[u32; 4]| Tile { x: r[0], y: r[1], truth: Picture::new(r[2] as usize, r[3] as usize), halves: None };
        let empty = rectangles.iter().map(blank).collect();
        let outline = TruthView::new(&view.name, view.camera, empty, &Picture::new(0, 0));
        let files = ["a", "b"].map(|half| folder.join(format!("study-truth-{}-{half}.exr", view.name)));
        let [width, height] = [rectangles[0][2], rectangles.iter().map(|r| r[3]).sum()];
        let fits = |half: &Picture| [half.width, half.height] == [width, height].map(|side: u32| side as usize);
        let kept = match &files {
            [a, b] if known && a.exists() && b.exists() => Some([panorama::read(a)?, panorama::read(b)?]),
            _ => None,
        };
        let halves: [Picture; 2] = if let Some(halves) = kept.filter(|halves| halves.iter().all(fits)) {
            halves
        } else {
            doing(&view.name);
            let seed = 2 * options.seed;
            let traced = trace(scene, lights, &outline, options.reference_samples, seed, &|| true).unwrap_or_default();
            let halves = [0, 1].map(|h| stack(&traced.iter().map(|e: &Estimate| e.half(h)).collect::<Vec<_>>()));
            for (file, half) in files.iter().zip(&halves) {
                write_exr(file, half.width, half.height, &[Layer::rgb("", half)], None)?;
            }
            halves
        };
        let mut below = 0;
        let mut tiles = Vec::new();
        for r in &rectangles {
            let pair = halves.each_ref().map(|h| cut(h, [0, below, r[2], r[3]]));
            let mut truth = pair[0].clone();
            truth.pixels.iter_mut().zip(&pair[1].pixels).for_each(|(a, b)| *a = 0.5 * (*a + *b));
            tiles.push(Tile { x: r[0], y: r[1], truth, halves: Some(pair) });
            below += r[3];
        }
        let known = stack(&tiles.iter().map(|t| t.truth.clone()).collect::<Vec<_>>());
        all.push(TruthView::new(&view.name, view.camera, tiles, &known));
    }
    Ok(all)
}

pub(crate) fn note(truth: &[TruthView], photographs: bool, options: &Options) -> TruthNote {
    let noise: Option<Vec<_>> = truth.iter().map(TruthView::noise).collect();
    let mean =
        |part: fn(&TruthNoise) -> f64| noise.as_ref().map(|n| n.iter().map(part).sum::<f64>() / n.len().max(1) as f64);
    TruthNote {
        kind: if photographs { "photographs" } else { "reference" }.to_owned(),
        samples: (!photographs).then_some(options.reference_samples),
        noise_rmse: mean(|n| n.rmse * n.rmse).map(f64::sqrt),
        noise_flip: mean(|n| n.flip),
    }
}
