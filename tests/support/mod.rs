//! Small sites for tests, written to a folder as a person would have them: OBJ, MTL, site file and EXR pictures.

#![allow(
    dead_code,
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "shared by several tests, of which each uses a part; may panic, and says what is skipped"
)]

pub(crate) mod data;
pub(crate) mod program;

use clerestory::panorama::{Layer, Picture, write_exr};
use clerestory::reference::{self, Eye, Lights, trace};
use clerestory::render::{self, Frame, Irradiance, Options, Relit};
use clerestory::scene::{self, Health, Material, Mesh, Ray, Scene, Surface};
use clerestory::site::{Pictures, Probe, Site};
use clerestory::volume;
use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The folder of the bundled chapel.
pub(crate) fn chapel() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("sites/chapel")
}

/// A site and its model.
pub(crate) fn load(path: &Path) -> (Site, Scene) {
    let site = Site::load(path).unwrap();
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    (site, scene)
}

/// What `work` comes to on so many threads.
pub(crate) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// Writes a picture as OpenEXR.
pub(crate) fn write_picture(file: &Path, picture: &Picture) {
    write_exr(file, picture.width, picture.height, &[Layer::rgb("", picture)], None).unwrap();
}

/// Puts other words in the place of some in a file, wherever they stand; they must be there.
#[track_caller]
pub(crate) fn change(file: &Path, changes: &[(&str, &str)]) {
    let mut text = fs::read_to_string(file).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{old:?} is not in {}", file.display());
        text = text.replace(old, new);
    }
    fs::write(file, text).unwrap();
}

/// All files in a folder and below, relative to it, in order.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    fn walk(folder: &Path, root: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else {
                found.push(path.strip_prefix(root).unwrap().to_owned());
            }
        }
    }
    let mut found = Vec::new();
    walk(folder, folder, &mut found);
    found.sort();
    found
}

/// The same with their bytes.
pub(crate) fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    files(folder).into_iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect()
}

/// Copies a folder with all that is in it.
pub(crate) fn copy(from: &Path, to: &Path) {
    for name in files(from) {
        let target = to.join(&name);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(from.join(name), target).unwrap();
    }
}

/// A picture of one colour as a PNG file.
pub(crate) fn png(width: u32, height: u32, rgb: [u8; 3]) -> Vec<u8> {
    encoded(&image::RgbImage::from_pixel(width, height, image::Rgb(rgb)).into())
}

/// A picture as a PNG file.
pub(crate) fn encoded(picture: &image::DynamicImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A rectangle or parallelogram: corner, two edges, and its material's index.
#[derive(Clone, Copy)]
pub(crate) struct Quad(pub(crate) DVec3, pub(crate) DVec3, pub(crate) DVec3, pub(crate) usize);

/// A material.
#[derive(Clone, Copy)]
pub(crate) struct Paint {
    pub(crate) albedo: f64,
    pub(crate) emission: f64,
    /// A checkerboard of black and white texels, 8 squares a side over each quad.
    pub(crate) checker: bool,
}

/// What a test site is made of; lengths in metres, z up.
#[derive(Clone)]
pub(crate) struct Plan {
    pub(crate) quads: Vec<Quad>,
    pub(crate) paints: Vec<Paint>,
    /// Position, and width of the panorama in pixels.
    pub(crate) probes: Vec<(DVec3, usize)>,
    /// Position, target, and side of the picture in pixels.
    pub(crate) views: Vec<(DVec3, DVec3, u32)>,
    /// More tables of the site file; directions only, no lengths.
    pub(crate) more: String,
    /// How the model is written: its unit, and where its origin lies.
    pub(crate) metres_per_unit: f64,
    pub(crate) offset: DVec3,
}

/// A site on disk, and loaded.
pub(crate) struct Built {
    pub(crate) folder: TempDir,
    pub(crate) site: Site,
    pub(crate) scene: Scene,
    offset: DVec3,
}

pub(crate) fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A matt grey.
pub(crate) fn grey(albedo: f64) -> Paint {
    Paint { albedo, emission: 0.0, checker: false }
}

/// The six sides of a box: floor, ceiling, south, north, west, east.
pub(crate) fn sides(low: DVec3, high: DVec3, materials: [usize; 6]) -> Vec<Quad> {
    let (x, y, z) = (DVec3::X * (high.x - low.x), DVec3::Y * (high.y - low.y), DVec3::Z * (high.z - low.z));
    let all = [(low, x, y), (low + z, x, y), (low, x, z), (low + y, x, z), (low, y, z), (low + x, y, z)];
    all.iter().zip(materials).map(|(&(corner, u, v), m)| Quad(corner, u, v, m)).collect()
}

/// The sides of a box in one material.
pub(crate) fn closed(low: DVec3, high: DVec3, material: usize) -> Vec<Quad> {
    sides(low, high, [material; 6])
}

/// A box of so many metres with its least corner at the origin, as an OBJ file.
pub(crate) fn closed_box(x: u32, y: u32, z: u32) -> String {
    let corners: String =
        (0..8).map(|i| format!("v {} {} {}\n", x * (i & 1), y * (i >> 1 & 1), z * (i >> 2 & 1))).collect();
    format!("{corners}f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n")
}

/// The greatest corner of the common room, whose least one is the origin.
pub(crate) const HIGH: DVec3 = DVec3::new(4.0, 3.0, 2.5);

/// A room, a probe 64 pixels wide off its middle, a view from a corner.
pub(crate) fn room(albedo: f64) -> Plan {
    let plan = Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(albedo)]);
    plan.probe(v(1.7, 1.4, 1.3), 64).view(v(0.3, 0.4, 1.6), v(3.5, 2.5, 0.8), 24)
}

/// The room with a panel whose back no probe sees, and a view of that back.
pub(crate) fn room_with_panel(albedo: f64) -> Plan {
    let mut plan = room(albedo);
    plan.quads.push(Quad(v(2.8, 0.8, 0.6), DVec3::Y * 1.2, DVec3::Z * 1.2, 0));
    plan.views = vec![(v(3.7, 2.6, 1.75), v(1.5, 0.5, 0.75), 24)];
    plan
}

/// A room without a ceiling under an even sky and the sun, with a block that hides part of it from both probes.
pub(crate) fn sunny_room(block: [usize; 6], probe_width: usize, sun: &str) -> Plan {
    let mut quads = closed(DVec3::ZERO, HIGH, 0);
    quads.remove(1);
    quads.extend(sides(v(2.0, 0.5, 0.0), v(2.3, 2.5, 1.4), block));
    let mut plan =
        Plan::new(quads, &[grey(0.6)]).probe(v(0.9, 1.4, 1.0), probe_width).probe(v(1.1, 0.6, 0.7), probe_width);
    plan.more = format!("[environment]\nradiance = [1, 1, 1]\n[sun]\ndirection = [0.3, 0.2, 1]\nirradiance = {sun}");
    plan
}

/// A room whose sides have these radiances, the darkest opposite the brightest: fifteen decades in one probe.
pub(crate) struct Decades {
    plan: Plan,
    pub(crate) built: Built,
}

impl Decades {
    const LEVELS: [f32; 6] = [1.0, 30.0, 1e-3, 1e3, 1e-6, 1e9];

    pub(crate) fn new() -> Self {
        let mut plan = room(0.5);
        plan.quads = sides(DVec3::ZERO, HIGH, [0, 1, 2, 3, 4, 5]);
        plan.probes[0].1 = 256;
        plan.paints = vec![grey(0.5); 6];
        let level = |scene: &Scene, s: &Surface| {
            let material = &scene.materials[scene.mesh.materials[s.triangle as usize] as usize];
            Self::LEVELS[material.name[1..].parse::<usize>().unwrap()]
        };
        let built = plan.build().paint(&plan, |scene, s| s.map_or(Vec3::ZERO, |s| Vec3::splat(level(scene, s))));
        Self { plan, built }
    }

    /// Radiance over what it should be, on each side at these shares of its edges.
    pub(crate) fn shown(&self, relit: &Relit, shares: &[(f64, f64)]) -> Vec<f32> {
        let mut all = Vec::new();
        for (Quad(corner, u, w, _), level) in self.plan.quads.iter().zip(Self::LEVELS) {
            let normal = u.cross(*w).normalize();
            let normal = if normal.dot(0.5 * HIGH - *corner) > 0.0 { normal } else { -normal };
            let at = |a: f64, b: f64| self.built.local(*corner + *u * a + *w * b);
            all.extend(shares.iter().map(|&(a, b)| 0.5 * irradiance(relit, at(a, b), normal.as_vec3()).x / PI / level));
        }
        all
    }
}

/// The room of radiance 2 within walls of 10 cm and a second probe somewhere in, on or behind one of them, whose picture is
/// black but where it sees into the room.
pub(crate) fn room_with_probe_at_wall(at: DVec3) -> (Plan, Built) {
    let mut plan = room(0.5).probe(at, 32);
    plan.quads.extend(closed(DVec3::splat(-0.1), HIGH + 0.1, 0));
    let built = plan.build();
    built.put(0, &built.look(0, 64, |_| Vec3::splat(2.0)));
    let inside = |p: DVec3| p.cmpge(DVec3::splat(-1e-4)).all() && p.cmple(HIGH + 1e-4).all();
    let seen = |s: &Surface| inside(s.position.as_dvec3() + built.scene.origin);
    built.put(1, &built.look(1, 32, |s| Vec3::splat(if s.is_some_and(seen) { 2.0 } else { 0.0 })));
    (plan, built)
}

/// The share of radiances that are not 2 to within 1 %.
pub(crate) fn share_off_2(shown: &[f32]) -> f64 {
    shown.iter().filter(|l| (*l / 2.0 - 1.0).abs() > 0.01).count() as f64 / shown.len() as f64
}

/// 200 × 2 × 2 m, with a cross wall that leaves a gap: the volume's cells are larger than the room is wide.
pub(crate) fn long_low_room() -> Plan {
    let mut quads = closed(DVec3::ZERO, v(200.0, 2.0, 2.0), 0);
    quads.push(Quad(v(20.0, 0.0, 0.0), DVec3::Y * 1.5, DVec3::Z * 2.0, 0));
    Plan::new(quads, &[grey(1.0)])
        .probe(v(5.0, 1.0, 1.0), 256)
        .probe(v(40.0, 1.0, 1.0), 256)
        .view(v(30.0, 0.6, 1.0), v(20.0, 0.6, 1.0), 16)
        .view(v(2.0, 1.0, 1.0), v(199.0, 1.0, 1.0), 16)
}

/// Radiance that differs from place to place, so that a shift would show.
pub(crate) fn gradient(scene: &Scene, s: Option<&Surface>) -> Vec3 {
    s.map_or(Vec3::ZERO, |s| {
        let (low, high) = scene.mesh.bounds();
        let p = (s.position - low) / (high - low);
        Vec3::splat(1.0 + 4.0 * p.x + 2.0 * p.y * p.z)
    })
}

/// A model of quadrilaterals that is in no file: corner, two edges, albedo and emission of each.
pub(crate) fn scene_of(quads: &[(Vec3, Vec3, Vec3, f32, f32)]) -> Scene {
    let mut mesh = Mesh::default();
    let mut materials = Vec::new();
    for (i, &(corner, u, v, albedo, emission)) in quads.iter().enumerate() {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([corner, corner + u, corner + u + v, corner + v]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        mesh.materials.extend([i as u32; 2]);
        let (albedo, emission) = (Vec3::splat(albedo), Vec3::splat(emission));
        materials.push(Material { name: format!("quad {i}"), albedo, texture: None, emission });
    }
    Scene::new(mesh, materials, vec![], DVec3::ZERO)
}

impl Plan {
    pub(crate) fn new(quads: Vec<Quad>, paints: &[Paint]) -> Self {
        Self {
            quads,
            paints: paints.to_vec(),
            probes: vec![],
            views: vec![],
            more: String::new(),
            metres_per_unit: 1.0,
            offset: DVec3::ZERO,
        }
    }

    pub(crate) fn probe(mut self, at: DVec3, width: usize) -> Self {
        self.probes.push((at, width));
        self
    }

    pub(crate) fn view(mut self, from: DVec3, to: DVec3, size: u32) -> Self {
        self.views.push((from, to, size));
        self
    }

    /// Writes the site, without its probes' pictures, and loads it.
    pub(crate) fn build(&self) -> Built {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: String| fs::write(folder.path().join(name), text).unwrap();
        put("model.obj", self.obj());
        put("model.mtl", self.mtl());
        put("site.toml", self.toml());
        if self.paints.iter().any(|p| p.checker) {
            let board = image::GrayImage::from_fn(64, 64, |x, y| image::Luma([255 * ((x / 8 + y / 8) % 2) as u8]));
            image::DynamicImage::from(board).to_rgb8().save(folder.path().join("checker.png")).unwrap();
        }
        let site = Site::load_with(folder.path(), Pictures::MayBeMissing).unwrap();
        let scene = scene::load(&site, &mut Health::default()).unwrap();
        Built { folder, site, scene, offset: self.offset }
    }

    fn out(&self, p: DVec3) -> DVec3 {
        (p + self.offset) / self.metres_per_unit
    }

    fn obj(&self) -> String {
        let mut text = "mtllib model.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n".to_owned();
        for (i, &Quad(corner, u, v, material)) in self.quads.iter().enumerate() {
            for p in [corner, corner + u, corner + u + v, corner + v].map(|p| self.out(p)) {
                writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
            }
            let k = 4 * i + 1;
            writeln!(text, "usemtl m{material}\nf {}/1 {}/2 {}/3 {}/4", k, k + 1, k + 2, k + 3).unwrap();
        }
        text
    }

    fn mtl(&self) -> String {
        let mut text = String::new();
        for (i, p) in self.paints.iter().enumerate() {
            let Paint { albedo: a, emission: e, checker } = *p;
            writeln!(text, "newmtl m{i}\nKd {a} {a} {a}\nKe {e} {e} {e}").unwrap();
            if checker {
                text += "map_Kd checker.png\n";
            }
        }
        text
    }

    pub(crate) fn toml(&self) -> String {
        let mut text = format!(
            "[site]\nname = \"Test\"\nunits = {:?}\nup = \"z\"\n[model]\npath = \"model.obj\"\n{}\n",
            self.metres_per_unit, self.more
        );
        let point = |p: DVec3| format!("[{:?}, {:?}, {:?}]", self.out(p).x, self.out(p).y, self.out(p).z);
        for (i, (at, _)) in self.probes.iter().enumerate() {
            writeln!(text, "[[probe]]\nname = \"p{i}\"\nposition = {}\nimage = \"p{i}.exr\"", point(*at)).unwrap();
        }
        for (i, (from, to, size)) in self.views.iter().enumerate() {
            let (from, to) = (point(*from), point(*to));
            writeln!(
                text,
                "[[view]]\nname = \"v{i}\"\nposition = {from}\nlook_at = {to}\nfov_y = 80\nsize = [{size}, {size}]"
            )
            .unwrap();
        }
        text
    }
}

/// Cells of the volume along the scene's longest side.
pub(crate) fn options(cells: u32) -> Options {
    Options {
        lightings: vec![String::new()],
        probes: usize::MAX,
        sun: true,
        volume: volume::VolumeSettings { cells, ..volume::VolumeSettings::default() },
        all_stages: false,
        volume_for_all: false,
    }
}

impl Built {
    /// A position of the plan, local to the scene.
    pub(crate) fn local(&self, p: DVec3) -> Vec3 {
        self.scene.local(p + self.offset)
    }

    /// Writes a probe's picture.
    pub(crate) fn put(&self, probe: usize, picture: &Picture) {
        write_picture(&self.site.probes[probe].pictures[0].path, picture);
    }

    /// What a probe sees where `radiance` tells what surfaces send out (none: the sky), each pixel the mean of 16 rays.
    pub(crate) fn look(&self, probe: usize, width: usize, radiance: impl Fn(Option<&Surface>) -> Vec3) -> Picture {
        let mut picture = Picture::new(width, (width / 2).max(1));
        let pose = self.site.probes[probe].pose;
        let origin = self.scene.local(pose.position);
        for y in 0..picture.height {
            for x in 0..width {
                let sum: Vec3 = (0..16)
                    .map(|k| {
                        let u = Vec2::new((k % 4) as f32 + 0.5, (k / 4) as f32 + 0.5) / 4.0;
                        let phi = ((x as f32 + u.x) / width as f32 - 0.5) * 2.0 * PI;
                        let theta = (y as f32 + u.y) / picture.height as f32 * PI;
                        let d = Vec3::new(theta.sin() * phi.sin(), theta.sin() * phi.cos(), theta.cos());
                        let ray = Ray { origin, direction: pose.rotation.as_mat3() * d };
                        let hit = self.scene.tracer.closest(&ray, 1e-3);
                        radiance(hit.map(|h| self.scene.surface(&ray, &h)).as_ref())
                    })
                    .sum();
                picture.pixels[y * width + x] = sum / 16.0;
            }
        }
        picture
    }

    /// Paints every probe with what [`Built::look`] sees; `widths` as in the plan.
    pub(crate) fn paint(self, plan: &Plan, radiance: impl Fn(&Scene, Option<&Surface>) -> Vec3) -> Self {
        for (i, &(_, width)) in plan.probes.iter().enumerate() {
            self.put(i, &self.look(i, width, |s| radiance(&self.scene, s)));
        }
        self
    }

    /// Gives every probe the same radiance everywhere.
    pub(crate) fn furnace(self, plan: &Plan, radiance: f32) -> Self {
        self.paint(plan, |_, _| Vec3::splat(radiance))
    }

    /// Path-traces every probe.
    pub(crate) fn trace(self, plan: &Plan, samples: u32) -> Self {
        let pictures = self.traced(plan, samples);
        self.with(&pictures)
    }

    /// What path tracing gives for every probe.
    pub(crate) fn traced(&self, plan: &Plan, samples: u32) -> Vec<Picture> {
        let lights = self.lights();
        let settings = reference::ReferenceSettings { samples, ..Default::default() };
        let one = |(probe, &(_, width)): (&Probe, &(DVec3, usize))| {
            let eye = Eye::Panorama { pose: probe.pose, width, height: width / 2 };
            trace(&self.scene, &lights, &eye, &settings).mean()
        };
        self.site.probes.iter().zip(&plan.probes).map(one).collect()
    }

    /// Writes a picture for every probe.
    pub(crate) fn with(self, pictures: &[Picture]) -> Self {
        pictures.iter().enumerate().for_each(|(i, picture)| self.put(i, picture));
        self
    }

    /// Changes the site file as [`change`] does.
    #[track_caller]
    pub(crate) fn change(&self, changes: &[(&str, &str)]) {
        change(&self.folder.path().join("site.toml"), changes);
    }

    /// The lights of the site file and model.
    pub(crate) fn lights(&self) -> Lights {
        Lights::load(&self.site, &self.scene).unwrap()
    }

    /// Runs the whole way from the site file to light that can be asked for, and asks.
    pub(crate) fn relit<T>(&self, options: &Options, ask: impl FnOnce(&Relit) -> T) -> T {
        let site = Site::load(self.folder.path()).unwrap();
        let cameras: Vec<_> = site.views.iter().map(|v| v.camera).collect();
        let setup = render::prepare(&site, &self.scene, &cameras, options).unwrap();
        let light = &setup.lights[0].1;
        let volume = setup.volume(&self.scene, 0);
        ask(&Relit { scene: &self.scene, light, volume: volume.as_ref(), volume_only: false })
    }

    /// The views, relit.
    pub(crate) fn frames(&self, options: &Options) -> Vec<Frame> {
        self.relit(options, |relit| {
            let frame = |v: &clerestory::site::View| render::render(&self.scene, relit, &v.camera, 4, &|_, _| {});
            self.site.views.iter().map(frame).collect()
        })
    }

    /// The radiance of the first view, relit with 16 cells; every layer is checked to be finite.
    pub(crate) fn picture(&self) -> Vec<f32> {
        let frames = self.frames(&options(16));
        frames.iter().for_each(assert_finite);
        frames[0].radiance.pixels.iter().map(|p| p.x).collect()
    }
}

/// Irradiance that a relit scene has at a point.
pub(crate) fn irradiance(relit: &Relit, point: Vec3, normal: Vec3) -> Vec3 {
    let lit = relit.lit(point, normal, &mut Default::default());
    if lit.needs_shadow_ray && relit.in_sun(point, normal) { lit.sun } else { lit.shade }
}

/// No NaN, no infinity but the sky's depth, no negative light, albedo and agreement within 0..=1.
pub(crate) fn assert_finite(frame: &Frame) {
    for i in 0..frame.depth.len() {
        let (l, a, n) = (frame.radiance.pixels[i], frame.albedo.pixels[i], frame.normal.pixels[i]);
        assert!(Picture::valid(l), "radiance {l} in pixel {i}");
        assert!(Picture::valid(a) && a.max_element() <= 1.0 + 1e-6, "albedo {a} in pixel {i}");
        assert!(n.is_finite() && (n.length() - 1.0).abs() < 1e-4 || n == Vec3::ZERO, "normal {n} in pixel {i}");
        assert!((0.0..=1.0).contains(&frame.agreement[i]), "agreement {} in pixel {i}", frame.agreement[i]);
        let sky = frame.source[i] == render::Source::None;
        assert!(sky || frame.depth[i].is_finite() && frame.depth[i] > 0.0, "depth {} in pixel {i}", frame.depth[i]);
    }
    assert!((0.0..=1.0).contains(&frame.covered_fraction));
}

/// Asserts that every value is within a relative tolerance of what is expected; NaN never is.
#[track_caller]
pub(crate) fn assert_all(values: &[f32], expected: f32, tolerance: f32) {
    let worst = values.iter().map(|v| (v / expected - 1.0).abs()).max_by(f32::total_cmp).unwrap_or(0.0);
    assert!(worst <= tolerance, "worst of {} values is off by {worst} from {expected}", values.len());
}

/// √(mean squared difference) over the mean of the second.
pub(crate) fn relative_rmse(x: &[f32], truth: &[f32]) -> f32 {
    let n = truth.len() as f32;
    let square: f32 = x.iter().zip(truth).map(|(a, b)| (a - b) * (a - b)).sum::<f32>() / n;
    square.sqrt() / (truth.iter().sum::<f32>() / n)
}
