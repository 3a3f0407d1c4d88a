//! `clerestory render SITE --gpu`: the light baked onto the model, drawn by the graphics card.

use clerestory::site::View;

use crate::cli::bake::BakeHow;

/// What is to be drawn.
#[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "nothing is drawn"))]
pub(super) struct Asked<'a> {
    pub(super) views: Vec<&'a View>,
    pub(super) lighting: String,
    pub(super) how: BakeHow,
    /// Rays a pixel.
    pub(super) samples: u32,
    /// Whether the views are a walk's frames.
    pub(super) walk: bool,
}

/// Without the feature, says how to get it.
#[cfg(not(feature = "gpu"))]
pub(super) fn run(
    _: &clerestory::site::Site,
    _: &Asked,
    _: &crate::cli::terminal::output::Output,
    _: &mut impl std::io::Write,
) -> anyhow::Result<()> {
    anyhow::bail!(
        "--gpu: this program was built without graphics cards. Build it with `cargo install --path . --features gpu`, or \
         leave --gpu away"
    )
}

#[cfg(feature = "gpu")]
pub(super) use with_card::run;

#[cfg(feature = "gpu")]
mod with_card {
    use anyhow::Context;
    use clerestory::bake::{Bake, BakeSettings};
    use clerestory::gpu::{self, Drawer};
    use clerestory::panorama::{Exposure, Layer};
    use clerestory::render::Timings;
    use clerestory::site::Site;
    use serde::Serialize;
    use std::io::{self, Write};
    use std::path::PathBuf;
    use std::time::Instant;

    use crate::cli::bake::baked;
    use crate::cli::render::gpu::Asked;
    use crate::cli::render::pictures::write;
    use crate::cli::render::walk_exposure::walk_exposures;
    use crate::cli::terminal::model::Model;
    use crate::cli::terminal::output::{Output, warn};
    use crate::cli::terminal::visible::visible;

    /// What was drawn, for scripts.
    #[derive(Serialize)]
    struct Outcome {
        /// The card, its driver, and whether it draws in software.
        adapter: String,
        setup: Timings,
        bake_s: f64,
        /// Handing the model to the card, and what the sun sees.
        upload_s: f64,
        vertices: usize,
        triangles: usize,
        views: Vec<Drawn>,
        peak_bytes: Option<u64>,
        warnings: Vec<String>,
    }

    /// A view or a frame of a walk.
    #[derive(Serialize)]
    struct Drawn {
        name: String,
        draw_s: f64,
        /// Copying the pixels back.
        read_s: f64,
        file: PathBuf,
    }

    /// Bakes, draws every view or frame, and tells `out` about it.
    pub(in super::super) fn run(
        site: &Site,
        asked: &Asked,
        output: &Output,
        out: &mut impl Write,
    ) -> anyhow::Result<()> {
        let Asked { views, lighting, how, samples, walk } = asked;
        // before the long work
        for view in views {
            gpu::samples_along(&view.camera, *samples).with_context(|| format!("view “{}”", view.name))?;
        }
        gpu::adapter()?;
        let start = Instant::now();
        let folder = output.folder(site)?;
        let Model { scene, health, .. } = Model::of(site, &folder)?;
        let load_s = start.elapsed().as_secs_f64();
        let settings = how.settings(BakeSettings { views: false, sun_apart: true, ..BakeSettings::default() });
        let (lighting, volume) = (std::slice::from_ref(lighting), how.volume.settings());
        let (Bake { baked, setup }, bake_s) = baked(site, &scene, lighting, volume, &settings, output.told)?;
        let setup = Timings { load_s: setup.timings.load_s + load_s, ..setup.timings };
        let start = Instant::now();
        let mut drawer = Drawer::new(&scene, &baked, 0)?;
        let upload_s = start.elapsed().as_secs_f64();
        let cameras: Vec<_> = views.iter().map(|v| v.camera).collect();
        let steady = match *walk {
            true => walk_exposures(&cameras, |c| Ok(vec![Exposure::of(&drawer.draw(c, *samples)?)]))?.pop(),
            false => None,
        };
        let bar = output.told.bar("{msg:16} {wide_bar} {percent:>3} %  {eta} left");
        bar.set_length(views.len() as u64);
        let mut done = Vec::new();
        for view in views {
            bar.set_message(visible(&view.name).into_owned());
            let picture = drawer.draw(&view.camera, *samples)?;
            let exposure = steady.unwrap_or_else(|| Exposure::of(&picture));
            let file = write(&[Layer::rgb("radiance", &picture)], &picture, view, &folder, exposure)?;
            let times = drawer.times();
            done.push(Drawn { name: view.name.clone(), draw_s: times.draw_s, read_s: times.read_s, file });
            bar.inc(1);
        }
        bar.finish_and_clear();
        let outcome = Outcome {
            adapter: drawer.adapter().to_owned(),
            setup,
            bake_s,
            upload_s,
            vertices: baked.vertices.len(),
            triangles: baked.triangles.len(),
            views: done,
            peak_bytes: clerestory::memory::peak(),
            warnings: site.warnings.iter().cloned().chain(health.warnings).collect(),
        };
        output.told.tell(&outcome, out, |out| print(&outcome, out))
    }

    fn print(o: &Outcome, out: &mut impl Write) -> io::Result<()> {
        warn("warning:", &o.warnings, out)?;
        let t = o.setup;
        writeln!(
            out,
            "load {:.2} s, shoot {:.2} s, index {:.2} s, volume {:.2} s, bake {:.2} s: {} vertices, {} triangles",
            t.load_s, t.shoot_s, t.index_s, t.volume_s, o.bake_s, o.vertices, o.triangles
        )?;
        writeln!(out, "{}: model handed over in {:.2} s", o.adapter, o.upload_s)?;
        for v in &o.views {
            let (draw, read) = (1e3 * v.draw_s, 1e3 * v.read_s);
            writeln!(out, "{:<16} drawn in {draw:.1} ms, read back in {read:.1} ms  {}", v.name, v.file.display())?;
        }
        let mean = |of: fn(&Drawn) -> f64| 1e3 * o.views.iter().map(of).sum::<f64>() / o.views.len().max(1) as f64;
        if o.views.len() > 1 {
            writeln!(out, "mean: drawn in {:.1} ms, read back in {:.1} ms", mean(|v| v.draw_s), mean(|v| v.read_s))?;
        }
        Ok(())
    }
}
