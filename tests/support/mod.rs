//! Small sites for tests, written to a folder as a person would have them: OBJ, MTL, site file and EXR pictures.

#![allow(dead_code, clippy::unwrap_used, reason = "shared by several tests, of which each uses a part; may panic")]

use clerestory::panorama::{Layer, Picture, write_exr};
use clerestory::reference::{self, Eye, Lights, trace};
use clerestory::render::{self, Frame, Irradiance, Options, Relit};
use clerestory::scene::{self, Health, Ray, Scene, Surface};
use clerestory::site::{Pictures, Site};
use clerestory::volume;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::fs;
use tempfile::TempDir;

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
        let file = &self.site.probes[probe].pictures[0].path;
        write_exr(file, picture.width, picture.height, &[Layer::rgb("", picture)], None).unwrap();
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
        let lights = self.lights();
        let settings = reference::ReferenceSettings { samples, ..Default::default() };
        for (i, &(_, width)) in plan.probes.iter().enumerate() {
            let eye = Eye::Panorama { pose: self.site.probes[i].pose, width, height: width / 2 };
            let e = trace(&self.scene, &lights, &eye, &settings);
            self.put(i, &e.mean());
        }
        self
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

/// Asserts that every value is within a relative tolerance of what is expected.
#[track_caller]
pub(crate) fn assert_all(values: &[f32], expected: f32, tolerance: f32) {
    let worst = values.iter().map(|v| (v / expected - 1.0).abs()).fold(0.0, f32::max);
    assert!(worst <= tolerance, "worst of {} values is off by {worst} from {expected}", values.len());
}

/// √(mean squared difference) over the mean of the second.
pub(crate) fn relative_rmse(x: &[f32], truth: &[f32]) -> f32 {
    let n = truth.len() as f32;
    let square: f32 = x.iter().zip(truth).map(|(a, b)| (a - b) * (a - b)).sum::<f32>() / n;
    square.sqrt() / (truth.iter().sum::<f32>() / n)
}
