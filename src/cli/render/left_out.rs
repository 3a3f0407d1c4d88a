//! What `render` does not do for a site that does not need it.

use clerestory::check::Saving;
use clerestory::panorama;
use clerestory::render::{LeftOut, Options, Setup, shoot_probes};
use clerestory::report::NotDone;
use clerestory::scene::{Scene, Spared};
use clerestory::site::Site;

/// The light of the lightings that nobody asked for.
pub(super) fn unasked(site: &Site, scene: &Scene, options: &Options) -> anyhow::Result<Option<Setup>> {
    let others = site.lightings().into_iter().filter(|l| !options.lightings.contains(l)).collect::<Vec<_>>();
    if others.is_empty() {
        return Ok(None);
    }
    let options = Options { lightings: others, all_stages: false, ..options.clone() };
    Ok(Some(shoot_probes(site, scene, &options)?))
}

/// What no probe and no view can reach, in words.
pub(super) fn not_loaded(spared: Spared) -> NotDone {
    let Spared { triangles, textures, seconds, bytes } = spared;
    let pictures = match textures {
        0 => String::new(),
        1 => ", with a picture that only they have".to_owned(),
        n => format!(", with {n} pictures that only they have"),
    };
    let why =
        format!("{triangles} triangles lie behind closed walls that part them from all probes and views{pictures}");
    NotDone { what: LeftOut { stage: "unreached", why }, saves: Some(Saving { seconds, bytes }) }
}

/// What was not done, and what that saved. `pictures_s` is what reading the pictures took that were read.
pub(super) fn not_done(
    site: &Site,
    all_stages: bool,
    options: &Options,
    unreached: Option<NotDone>,
    setup: &Setup,
    pictures_s: f64,
) -> anyhow::Result<Vec<NotDone>> {
    let mut all: Vec<NotDone> =
        setup.left_out.iter().map(|what| NotDone { what: what.clone(), saves: None }).chain(unreached).collect();
    let (mut read, mut spared, mut count) = (0usize, 0usize, 0usize);
    for lit in site.probes.iter().take(options.probes).flat_map(|p| &p.pictures) {
        let (width, height) = panorama::dimensions(&lit.path)?;
        if options.lightings.contains(&lit.lighting) {
            read += width * height;
        } else {
            (spared, count) = (spared + width * height, count + 1);
        }
    }
    // with all stages they were
    if count > 0 && !all_stages {
        let why = format!("{count} pictures of lightings that were not asked for are not decoded");
        let seconds = (pictures_s + setup.timings.index_s) * spared as f64 / read.max(1) as f64;
        let bytes = (spared * size_of::<glam::Vec3>()) as u64;
        all.push(NotDone { what: LeftOut { stage: "lightings", why }, saves: Some(Saving { seconds, bytes }) });
    }
    Ok(all)
}
