//! Where the truth of a site's views comes from.

use std::path::Path;

use super::{Tile, TruthView, cut, part_of, stack, tiles};
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

/// Photographs as truth.
pub(crate) fn photographed(views: &[&View], share: f64) -> Result<Vec<TruthView>, StudyError> {
    let mut all = Vec::new();
    for view in views {
        let Some((photo, _)) = photograph::read_masked(view)? else { continue };
        let truth = TruthView::of_photo(&view.name, view.camera, &photo, share);
        all.push(TruthView { photo: Some(photo), ..truth });
    }
    Ok(all)
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
            let cameras = rectangles.iter().map(|at| part_of(&view.camera, *at));
            let (samples, seed) = (options.reference_samples, options.seed.wrapping_mul(2));
            let traced = trace(scene, lights, cameras, samples, seed, &|| true).unwrap_or_default();
            let halves = [0, 1].map(|h| stack(&traced.iter().map(|e: &Estimate| e.half(h)).collect::<Vec<_>>()));
            for (file, half) in files.iter().zip(&halves) {
                write_exr(file, half.width, half.height, &[Layer::rgb("", half)], None)?;
            }
            halves
        };
        let mut below = 0;
        let mut tiles = Vec::new();
        for at in rectangles {
            let [_, _, width, height] = at;
            let pair = halves.each_ref().map(|h| cut(h, [0, below, width, height]));
            let mut truth = pair[0].clone();
            truth.pixels.iter_mut().zip(&pair[1].pixels).for_each(|(a, b)| *a = 0.5 * (*a + *b));
            tiles.push(Tile { at, truth, halves: Some(pair) });
            below += height;
        }
        let known = stack(&tiles.iter().map(|t| t.truth.clone()).collect::<Vec<_>>());
        all.push(TruthView::new(&view.name, view.camera, tiles, &known));
    }
    Ok(all)
}

pub(crate) fn note(truth: &[TruthView], photographs: bool, options: &Options) -> TruthNote {
    let noise: Option<Vec<[f64; 2]>> = truth.iter().map(TruthView::noise).collect();
    let mean =
        |part: fn(&[f64; 2]) -> f64| noise.as_ref().map(|n| n.iter().map(part).sum::<f64>() / n.len().max(1) as f64);
    TruthNote {
        kind: if photographs { "photographs" } else { "reference" }.to_owned(),
        samples: (!photographs).then_some(options.reference_samples),
        noise_rmse: mean(|[rmse, _]| rmse * rmse).map(f64::sqrt),
        noise_flip: mean(|[_, flip]| *flip),
    }
}
