//! A baked site as one page that needs nothing else: geometry, light and textures inside it, drawn with WebGL 2.
//!
//! What lies in `page` is the page; here its data are packed. Positions have 16 bits along each side
//! of the model's box, light one exponent a colour, all deflated and in base64; the browser inflates them itself.

mod error;
mod findings;
mod pack;
mod shot;

pub use error::ViewerError;

use base64::Engine;
use glam::Vec3;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::atomic_write::write_atomically;
use crate::bake::{BakeError, Baked, Run};
use crate::panorama::linear_to_code;
use crate::report::{SOFTWARE, escape};
use crate::scene::{Scene, Wrap};
use crate::site::Site;
use findings::{Mark, Shown};
use pack::{Block, deflated};
use shot::{Shot, shot};

/// What a page shows beside the model.
#[derive(Clone, Debug, Default)]
pub struct Extras {
    /// A folder that `clerestory audit` wrote into.
    pub findings: Option<PathBuf>,
    /// A `plan.json` that `clerestory plan` wrote.
    pub plan: Option<PathBuf>,
    /// The command that made the page.
    pub command: String,
}

/// What the page's script needs to know; lengths in local metres, program's axes.
#[derive(Serialize)]
struct About {
    site: String,
    software: &'static str,
    command: String,
    vertices: usize,
    triangles: usize,
    low: [f32; 3],
    high: [f32; 3],
    step: [f32; 3],
    /// The box's diagonal.
    size: f32,
    /// What to add to a local height for the site's own.
    height: f64,
    start: [f32; 3],
    lightings: Vec<Lighting>,
    sky: [usize; 2],
    materials: Vec<Range>,
    /// The same in fewer triangles, which follow all others; empty if there are none.
    coarse: Vec<Range>,
    /// How each picture goes on across and down, as OpenGL numbers it.
    pictures: Vec<[u32; 2]>,
    /// Least texture coordinates and their step; nothing without textures.
    uv: Option<[f32; 3]>,
    tinted: bool,
    views: Vec<Shot>,
    probes: Vec<Mark>,
    stations: Vec<Mark>,
    findings: Vec<Shown>,
}

#[derive(Serialize)]
struct Lighting {
    name: String,
    exposure: f32,
    /// The direction towards the sun whose light is kept apart.
    sun: Option<[f32; 3]>,
}

/// Some triangles of a material that lie close together.
#[derive(Serialize)]
struct Range {
    first: u32,
    count: u32,
    albedo: [f32; 3],
    /// Index of its picture; −1 for none.
    picture: i32,
    /// The box around them: least and greatest corner.
    low: [f32; 3],
    high: [f32; 3],
}

const STYLE: &str = include_str!("page/viewer.css");
const BODY: &str = include_str!("page/viewer.html");
const SCRIPT: &str = concat!(
    include_str!("page/unpack.js"),
    include_str!("page/shaders.js"),
    include_str!("page/open.js"),
    include_str!("page/draw.js"),
    include_str!("page/marks.js"),
    include_str!("page/controls.js"),
);

/// Writes the page of a baked site.
///
/// # Errors
///
/// Photographs, findings or a plan that cannot be used, or the file system's refusal.
pub fn write_viewer(
    path: &Path,
    site: &Site,
    scene: &Scene,
    baked: &Baked,
    extras: &Extras,
) -> Result<(), ViewerError> {
    let io = |source| BakeError::Io { path: path.to_owned(), source };
    let mut blocks = Vec::new();
    let (low, step) = geometry(baked, &mut blocks);
    blocks.push(hidden(scene, baked, low, step));
    let uv = texture_coordinates(baked, &mut blocks);
    let tinted = !scene.mesh.colours.is_empty();
    if tinted {
        let mut bytes = Vec::new();
        let code = |colour: Vec3| {
            let [r, g, b] = colour.to_array().map(linear_to_code);
            [r, g, b, 0]
        };
        pack::vertex_bytes(baked.vertices.iter().map(|v| code(v.colour)), &mut bytes);
        blocks.push(deflated(&bytes));
    }
    for (l, sky) in baked.skies.iter().enumerate() {
        let sunlight = sun(baked, l).map(|_| &baked.sunlight[l]);
        for colours in [&baked.irradiance[l], &sky.pixels].into_iter().chain(sunlight) {
            let mut bytes = Vec::new();
            let codes: Vec<[u8; 4]> = colours.iter().map(|c| pack::shared_exponent(*c)).collect();
            pack::vertex_bytes(codes.iter().copied(), &mut bytes);
            blocks.push(deflated(&bytes));
        }
    }
    let (numbers, pictures) = pictures(scene, baked, &mut blocks)?;
    let fine = runs(scene, baked, (&baked.triangles, &baked.materials, 0), &numbers);
    let coarse = runs(scene, baked, (&baked.coarse, &baked.coarse_materials, baked.triangles.len() as u32), &numbers);
    let mut views = Vec::new();
    for (i, view) in site.views.iter().enumerate() {
        let (shot, photo) = shot(scene, view, baked.views.get(i).unwrap_or(&baked.exposures))?;
        views.push(shot);
        blocks.extend(photo);
    }
    let high = low + step * 65535.0;
    let probe =
        |p: &crate::site::Probe| Mark { name: p.name.clone(), position: scene.local(p.pose.position).to_array() };
    let about = About {
        site: site.name.clone(),
        software: SOFTWARE,
        command: extras.command.clone(),
        vertices: baked.vertices.len(),
        triangles: baked.triangles.len(),
        low: low.to_array(),
        high: high.to_array(),
        step: step.to_array(),
        size: (high - low).length(),
        height: scene.origin.z,
        start: site.probes.first().map_or((low + high) / 2.0, |p| scene.local(p.pose.position)).to_array(),
        lightings: (baked.lightings.iter().zip(&baked.exposures).enumerate())
            .map(|(l, (name, exposure))| Lighting {
                name: if name.is_empty() { "as taken" } else { name }.into(),
                exposure: exposure.0,
                sun: sun(baked, l).map(|s| s.to_array()),
            })
            .collect(),
        sky: baked.skies.first().map_or([1, 1], |s| [s.width, s.height]),
        materials: fine,
        coarse,
        pictures,
        uv,
        tinted,
        views,
        probes: site.probes.iter().map(probe).collect(),
        stations: extras.plan.as_ref().map_or(Ok(Vec::new()), |plan| findings::stations(site, scene, plan))?,
        findings: extras.findings.as_ref().map_or(Ok(Vec::new()), |folder| findings::findings(site, scene, folder))?,
    };
    let head = head(&about, &blocks);
    write_atomically(path, io, |file| {
        file.write_all(head.as_bytes()).map_err(io)?;
        for (i, block) in blocks.iter().enumerate() {
            let text = base64::engine::general_purpose::STANDARD.encode(&block.bytes);
            writeln!(file, "<script type=\"text/plain\" id=\"b{i}\">{text}</script><script>P({i})</script>")
                .map_err(io)?;
        }
        write!(file, "<script>\n{SCRIPT}</script>\n</body>\n</html>\n").map_err(io)
    })?;
    Ok(())
}

/// The direction towards the sun of a lighting whose shadows the page casts.
fn sun(baked: &Baked, lighting: usize) -> Option<Vec3> {
    baked.suns[lighting].filter(|_| !baked.sunlight[lighting].is_empty())
}

/// All of the page before its data.
fn head(about: &About, blocks: &[Block]) -> String {
    // nothing in a name may end the script
    let json = |v: serde_json::Value| v.to_string().replace('<', "\\u003c");
    let data = json(serde_json::to_value(about).unwrap_or_default());
    let lengths: Vec<_> = blocks.iter().map(|b| serde_json::json!({"kind": b.kind, "bytes": b.bytes.len()})).collect();
    let lengths = json(lengths.into());
    let title = escape(&about.site);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n<meta \
         name=\"generator\" content=\"{}\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{BODY}<script>\n\
         const M = {data}, B = {lengths};\nlet got = 0;\nconst all = B.reduce((sum, b) => sum + b.bytes, 0);\nfunction P(i) {{ \
         got += B[i].bytes; document.getElementById(\"bar\").value = 0.5 * got / all; }}\n</script>\n",
        about.software
    )
}

/// Packs places, triangles, and what is known of each vertex; gives the box's least corner and the step of the 16 bits.
fn geometry(baked: &Baked, blocks: &mut Vec<Block>) -> (Vec3, Vec3) {
    let all = || baked.vertices.iter().map(|v| v.position);
    let (low, high) = all().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let step = ((high - low) / 65535.0).max(Vec3::splat(1e-9));
    let mut bytes = Vec::new();
    for c in 0..3 {
        let codes: Vec<u32> = all().map(|p| ((p[c] - low[c]) / step[c] + 0.5) as u32).map(|v| v.min(65535)).collect();
        pack::differences(&codes, 2, &mut bytes);
    }
    blocks.push(deflated(&bytes));
    bytes.clear();
    pack::corners(&baked.triangles, &mut bytes);
    blocks.push(deflated(&bytes));
    bytes.clear();
    pack::differences(baked.coarse.as_flattened(), 4, &mut bytes);
    blocks.push(deflated(&bytes));
    bytes.clear();
    let about = baked.vertices.iter().map(|v| {
        let probe = v.probe.map_or(255, |p| p.min(254) as u8);
        [v.source as u8 | v.seen_by.min(63) << 2, probe, (v.agreement * 255.0 + 0.5) as u8, 0]
    });
    pack::vertex_bytes(about, &mut bytes);
    blocks.push(deflated(&bytes));
    (low, step)
}

/// Packs the corners of triangles that are not drawn but cast shadows, in whole steps from the box's least corner.
fn hidden(scene: &Scene, baked: &Baked, low: Vec3, step: Vec3) -> Block {
    let corners = || baked.hidden.iter().flat_map(|t| scene.mesh.corners(*t));
    let mut bytes = Vec::new();
    for c in 0..3 {
        let codes: Vec<u32> = corners().map(|p| ((p[c] - low[c]) / step[c]).round() as i32 as u32).collect();
        pack::differences(&codes, 4, &mut bytes);
    }
    deflated(&bytes)
}

/// Packs texture coordinates with 24 bits; gives the least of them and the step; nothing where all are zero.
fn texture_coordinates(baked: &Baked, blocks: &mut Vec<Block>) -> Option<[f32; 3]> {
    const STEPS: f32 = 16_777_215.0;
    let all = || baked.vertices.iter().map(|v| v.uv);
    let low = all().fold(glam::Vec2::INFINITY, glam::Vec2::min);
    let span = (all().fold(glam::Vec2::NEG_INFINITY, glam::Vec2::max) - low).max_element();
    if !span.is_finite() || span <= 0.0 {
        return None;
    }
    // a power of two, so that whole texels stay whole
    let step = (span / STEPS).log2().ceil().exp2();
    let low = (low / step).floor() * step;
    let mut bytes = Vec::new();
    for c in 0..2 {
        let codes: Vec<u32> = all().map(|uv| ((uv[c] - low[c]) / step + 0.5) as u32).collect();
        pack::differences(&codes, 3, &mut bytes);
    }
    blocks.push(deflated(&bytes));
    Some([low.x, low.y, step])
}

/// The pictures of the materials in use as blocks, by the number of its texture the number of each, and how each goes on
/// beyond its rims.
#[expect(clippy::type_complexity, reason = "two lists")]
fn pictures(
    scene: &Scene,
    baked: &Baked,
    blocks: &mut Vec<Block>,
) -> Result<(Vec<Option<i32>>, Vec<[u32; 2]>), ViewerError> {
    let (mut numbers, mut pictures) = (vec![None; scene.textures.len()], Vec::new());
    for (m, _) in baked.materials.windows(2).enumerate().filter(|(_, ends)| ends[0] < ends[1]) {
        let (_, Some(t)) = scene.materials[m].with_white_lamps() else { continue };
        if numbers[t as usize].is_none() {
            let texture = &scene.textures[t as usize];
            let (bytes, kind) =
                texture.encoded().map_err(|why| BakeError::Picture { name: texture.name.clone(), why })?;
            blocks.push(Block { kind, bytes: bytes.to_vec() });
            numbers[t as usize] = Some(pictures.len() as i32);
            pictures.push(texture.wrap().map(Wrap::code));
        }
    }
    Ok((numbers, pictures))
}

/// Triangles, sorted by material, in runs that lie close together; `before` stand before them in the page's list.
fn runs(
    scene: &Scene,
    baked: &Baked,
    (triangles, materials, before): (&[[u32; 3]], &[u32], u32),
    numbers: &[Option<i32>],
) -> Vec<Range> {
    let range = |run: Run| {
        let (albedo, texture) = scene.materials[run.material].with_white_lamps();
        let picture = texture.and_then(|t| numbers[t as usize]).unwrap_or(-1);
        Range {
            first: before + run.triangles.start,
            count: run.triangles.len() as u32,
            albedo: albedo.to_array(),
            picture,
            low: run.low.to_array(),
            high: run.high.to_array(),
        }
    };
    baked.runs(triangles, materials).into_iter().map(range).collect()
}
