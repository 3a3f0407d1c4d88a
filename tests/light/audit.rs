//! The audit from a site to findings: rooms whose light is known exactly, so that what must be found and what must not
//! is known, too.

#![allow(clippy::unwrap_used, reason = "tests may panic")]

use crate::support::program::clerestory;
use crate::support::{
    Built, Paint, Plan, Quad, change, chapel, contents, copy, grey, load, on_threads, sides, v, write_picture,
};
use clerestory::audit::{self, Audit, Kind, Reason, Settings, Verdict, What};
use clerestory::panorama::{self, Picture, linear_to_srgb};
use clerestory::reference::{self, Eye, trace};
use clerestory::scene::{self, Scene, Surface};
use glam::{DVec3, Vec3};
use std::fs;
use std::sync::OnceLock;

/// Side of the photographs and width of the probes, pixels.
const SIDE: u32 = 128;
const PROBE: usize = 512;

/// Radiance of the room's surfaces: a picture of patches of many sizes on each, under light that changes slowly. The
/// same albedo is on the model as a texture only where a test gives it one; here it is a function of place.
fn pattern(p: Vec3) -> f32 {
    let wave = |k: f32, phase: f32| (k * p.x + phase).sin() * (k * p.y + 1.3 * phase).sin() + (k * p.z + phase).sin();
    0.5 + 0.12 * wave(9.0, 0.3) + 0.1 * wave(23.0, 1.1)
}

/// The room that was photographed: 6 × 5 × 3 m.
fn room() -> Vec<Quad> {
    sides(DVec3::ZERO, v(6.0, 5.0, 3.0), [0; 6])
}

fn plan(quads: Vec<Quad>, paints: &[Paint]) -> Plan {
    Plan::new(quads, paints).probe(v(1.3, 3.3, 1.4), PROBE).probe(v(4.6, 3.0, 1.7), PROBE).view(
        v(3.0, 1.0, 1.5),
        v(3.2, 5.0, 1.4),
        SIDE,
    )
}

/// The probes' pictures of the true room and its photograph.
struct Pictures {
    probes: Vec<Picture>,
    photo: Picture,
}

impl Pictures {
    /// By the radiance of surfaces.
    fn of(truth: &Plan, radiance: impl Fn(&Surface) -> Vec3 + Copy) -> Self {
        let real = truth.build();
        let probe = |(i, probe): (usize, &(DVec3, usize))| real.look(i, probe.1, |s| s.map_or(Vec3::ZERO, radiance));
        let photo = picture_of(&real.scene, &real.site.views[0].camera, radiance);
        Self { probes: truth.probes.iter().enumerate().map(probe).collect(), photo }
    }

    /// Those of the plain room with its pattern, for all tests that begin with them.
    fn patterned() -> &'static Self {
        static ONCE: OnceLock<Pictures> = OnceLock::new();
        ONCE.get_or_init(|| Self::of(&plan(room(), &[grey(0.5)]), patterned))
    }

    /// The site of a model with these pictures.
    fn in_site_of(&self, model: &Plan) -> Built {
        let site = model.build().with(&self.probes);
        add_photo(&site, &self.photo);
        site
    }
}

/// Gives a site's view its photograph.
fn add_photo(site: &Built, photo: &Picture) {
    write_picture(&site.folder.path().join("v0.exr"), photo);
    site.change(&[("name = \"v0\"", "name = \"v0\"\nphoto = \"v0.exr\"")]);
}

/// The site of the modelled room with pictures of the true one.
fn photographed(truth: &Plan, model: &Plan, radiance: impl Fn(&Surface) -> Vec3 + Copy) -> Built {
    Pictures::of(truth, radiance).in_site_of(model)
}

/// The room whose far wall is modelled here; it really stands at 5 m.
fn with_far_wall(y: f64) -> Plan {
    plan(sides(DVec3::ZERO, v(6.0, y, 3.0), [0; 6]), &[grey(0.5)])
}

/// What a camera sees, 16 rays a pixel.
fn picture_of(scene: &Scene, camera: &clerestory::site::Camera, radiance: impl Fn(&Surface) -> Vec3) -> Picture {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut picture = Picture::new(w, h);
    let origin = scene.local(camera.pose.position);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        for k in 0..16 {
            let at = |k: usize| (k as f64 + 0.5) / 4.0;
            let d = camera.direction((i % w) as f64 + at(k % 4), (i / w) as f64 + at(k / 4));
            let ray = scene::Ray { origin, direction: d.as_vec3() };
            if let Some(hit) = scene.tracer.closest(&ray, 1e-3) {
                *pixel += radiance(&scene.surface(&ray, &hit)) / 16.0;
            }
        }
    }
    picture
}

fn audited(built: &Built) -> Audit {
    let (site, scene) = load(built.folder.path());
    let settings = Settings { cells: 12, check_probes: false, ..Settings::default() };
    audit::audit(&site, &scene, "", &[], &settings, &|_, _, _| {}).unwrap()
}

/// Light that leaves a patterned wall.
fn patterned(s: &Surface) -> Vec3 {
    Vec3::splat(pattern(s.position))
}

fn share(audit: &Audit, verdict: Verdict) -> f64 {
    let v = &audit.views[0].verdicts;
    v.iter().filter(|w| **w == verdict).count() as f64 / v.len() as f64
}

#[test]
fn a_right_model_yields_nothing() {
    let audit = audited(&Pictures::patterned().in_site_of(&plan(room(), &[grey(0.5)])));
    assert!(audit.findings.iter().all(|f| f.kind != Kind::Geometry), "{:?}", audit.findings);
    assert_eq!(share(&audit, Verdict::Geometry), 0.0);
}

#[test]
fn a_moved_wall_is_found_with_sign_and_size() {
    for modelled in [4.85, 5.12] {
        let audit = audited(&Pictures::patterned().in_site_of(&with_far_wall(modelled)));
        let wall = audit.findings.iter().filter(|f| f.kind == Kind::Geometry);
        let wall = wall.max_by_key(|f| f.area_px).unwrap_or_else(|| panic!("the wall is found: {:?}", audit.doubts));
        let d = wall.displacement.expect("its displacement is measured");
        // positive is towards the camera's side, which lies at lesser y
        let expected = modelled - 5.0;
        assert!((d.metres - expected).abs() < 0.2 * expected.abs() + 0.01, "{d:?} for {expected}");
        assert!(d.metres.signum() == expected.signum());
    }
}

#[test]
fn a_wall_that_the_camera_faces_is_found_off_its_place_although_its_picture_looks_right() {
    let board = [Paint { albedo: 0.8, emission: 0.0, checker: true }];
    let with = |far: f64| {
        Plan::new(sides(DVec3::ZERO, v(5.0, far, 3.0), [0; 6]), &board)
            .probe(v(0.8, 2.2, 1.1), 2 * PROBE)
            .probe(v(4.3, 2.6, 1.9), 2 * PROBE)
            .view(v(2.5, 0.4, 1.5), v(2.5, 4.5, 1.5), SIDE)
    };
    let truth = with(4.5);
    let real = truth.build();
    // the texture's picture is in the photograph, and something finer, whose place can be told
    let painted = |s: &Surface| {
        let albedo = real.scene.filtered_albedo(s.triangle, s.barycentric, 0.0);
        (albedo + 0.22) * pattern(s.position)
    };
    // moved by eight centimetres along its normal, it is half a pixel elsewhere in the photograph
    let audit = audited(&photographed(&truth, &with(4.58), painted));
    let wall = audit.findings.iter().find(|f| f.what == What::Moved);
    let wall = wall.unwrap_or_else(|| panic!("the wall is found: {:?} {:?}", audit.findings, audit.doubts));
    let d = wall.displacement.expect("its displacement is measured");
    assert!((d.metres - 0.08).abs() < 0.02 && wall.area_px > 3000, "{d:?} over {} pixels", wall.area_px);
}

/// Where two rooms' surfaces part in the view, by the middles of its pixels.
fn parted(truth: &Plan, model: &Plan) -> Vec<bool> {
    let (real, modelled) = (truth.build(), model.build());
    let camera = real.site.views[0].camera;
    let (w, h) = (camera.width as usize, camera.height as usize);
    let distance = |scene: &Scene, i: usize| {
        let d = camera.direction((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let ray = scene::Ray { origin: scene.local(camera.pose.position), direction: d.as_vec3() };
        scene.tracer.closest(&ray, 1e-3).map_or(f32::MAX, |hit| hit.t)
    };
    (0..w * h).map(|i| (distance(&real.scene, i) - distance(&modelled.scene, i)).abs() > 0.01).collect()
}

/// Intersection over union of the largest finding of something missing with where it is.
fn overlap_of_missing(audit: &Audit, expected: &[bool]) -> f64 {
    let missing = audit.findings.iter().filter(|f| f.what == What::Missing).max_by_key(|f| f.area_px);
    let id = &missing.unwrap_or_else(|| panic!("{:?}", audit.doubts)).id;
    let mask = &audit.views[0].masks.iter().find(|m| m.0 == *id).unwrap().1;
    let count = |f: &dyn Fn(usize) -> bool| (0..expected.len()).filter(|i| f(*i)).count() as f64;
    count(&|i| mask[i] && expected[i]) / count(&|i| mask[i] || expected[i])
}

#[test]
fn an_opening_that_is_not_there_is_found_as_large_as_it_is() {
    // the model's far wall lacks a square of 1 m, beyond which there is nothing
    let mut open = room();
    open.remove(3);
    let around = [(0.0, 2.6, 0.0, 3.0), (3.6, 2.4, 0.0, 3.0), (2.6, 1.0, 0.0, 0.9), (2.6, 1.0, 1.9, 1.1)];
    open.extend(around.map(|(x, wide, z, high)| Quad(v(x, 5.0, z), v(wide, 0.0, 0.0), v(0.0, 0.0, high), 0)));
    // a landscape that nobody models
    let mut with_view = open.clone();
    with_view.push(Quad(v(-5.0, 9.0, -5.0), v(16.0, 0.0, 0.0), v(0.0, 0.0, 16.0), 0));
    let (truth, model) = (plan(room(), &[grey(0.5)]), plan(open, &[grey(0.5)]));
    let found = |truth: &Plan| {
        let origin = truth.build().scene.origin;
        let landscape = |s: &Surface| f64::from(s.position.y) + origin.y > 6.0;
        let radiance = |s: &Surface| Vec3::splat(pattern(s.position).powi(4) * if landscape(s) { 9.0 } else { 1.0 });
        audited(&photographed(truth, &model, radiance))
    };
    let audit = found(&truth);
    let overlap = overlap_of_missing(&audit, &parted(&truth, &model));
    assert!(overlap > 0.9, "{overlap:.2}");
    let wall = audit.findings.iter().find(|f| f.what == What::Missing).unwrap();
    assert!((wall.area_cm2 / 1e4 - 1.0).abs() < 0.1 && (wall.position[1] - 5.0).abs() < 0.05, "{wall:?}");
    // an opening that is there is none of a surface's
    let real = found(&plan(with_view, &[grey(0.5)]));
    assert!(real.findings.iter().all(|f| f.evidence[0].test != wall.evidence[0].test), "{:?}", real.findings);
}

#[test]
fn a_post_that_is_not_modelled_is_found_although_a_probe_beside_the_camera_sees_it_too() {
    let board = [Paint { albedo: 0.8, emission: 0.0, checker: true }];
    let with = |quads| plan(quads, &board).probe(v(3.05, 1.0, 1.5), PROBE);
    let mut posted = room();
    posted.push(Quad(v(2.9, 3.4, 0.0), v(0.35, 0.0, 0.0), v(0.0, 0.0, 2.4), 0));
    let (truth, model) = (with(posted), with(room()));
    let real = truth.build();
    let audit = audited(&photographed(&truth, &model, |s| {
        let post = (f64::from(s.position.y) + real.scene.origin.y - 3.4).abs() < 0.01;
        let albedo = real.scene.filtered_albedo(s.triangle, s.barycentric, 0.0);
        if post { Vec3::splat(0.15) } else { (albedo + 0.22) * pattern(s.position).powf(0.3) }
    }));
    let overlap = overlap_of_missing(&audit, &parted(&truth, &model));
    assert!(overlap > 0.6, "{overlap:.2}");
}

#[test]
fn paint_whose_borders_the_photograph_lacks_is_found_and_paint_that_is_there_is_not() {
    let mut quads = room();
    quads.push(Quad(v(2.4, 4.999, 0.9), v(1.2, 0.0, 0.0), v(0.0, 0.0, 1.1), 1));
    let model = plan(quads, &[grey(0.5), grey(0.3)]);
    let found = |real: &Pictures| {
        let all = audited(&real.in_site_of(&model)).findings;
        all.into_iter().filter(|f| f.material == "m1").map(|f| (f.kind, f.evidence[0].test.clone())).collect::<Vec<_>>()
    };
    assert_eq!(
        found(Pictures::patterned()),
        [(Kind::Texture, "odds of no border, times the share that tells".to_owned())]
    );
    let painted = model.build().scene;
    let dark = |s: &Surface| painted.materials[painted.mesh.materials[s.triangle as usize] as usize].name == "m1";
    let radiance = |s: &Surface| patterned(s) * if dark(s) { 0.6 } else { 1.0 };
    assert_eq!(found(&Pictures::of(&model, radiance)), []);
}

#[test]
fn a_post_that_is_not_there_is_found_by_its_contours_before_a_plain_wall() {
    let mut posted = room();
    posted.push(Quad(v(2.8, 3.4, 0.0), v(0.5, 0.0, 0.0), v(0.0, 0.0, 2.4), 1));
    let model = plan(posted, &[grey(0.5), grey(0.15)]);
    let origin = model.build().scene.origin;
    let post = |s: &Surface| (f64::from(s.position.y) + origin.y - 3.4).abs() < 0.01;
    let plain = |s: &Surface| Vec3::splat(0.4 + 0.01 * s.position.x) * if post(s) { 0.3 } else { 1.0 };
    let found = audited(&photographed(&plan(room(), &[grey(0.5)]), &model, plain)).findings;
    let of_post = found.iter().filter(|f| f.material == "m1");
    let all: Vec<_> = of_post.map(|f| (f.what, f.evidence[0].test.as_str())).collect();
    assert_eq!(all, [(What::Extra, "odds of no contour, times the share that tells")]);
    let right = audited(&photographed(&model, &model, plain)).findings;
    assert!(right.iter().all(|f| f.material != "m1"), "{right:?}");
}

/// Squares of 30 cm, each of its own grey.
fn squares(p: DVec3) -> f32 {
    let [x, z] = [p.x, p.z].map(|side| (side / 0.3).floor() as u64);
    0.2 + 0.6 * ((x * 7919 + z * 104_729 + 17).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f32 / (1 << 24) as f32
}

/// The room as a scan has it: its far wall has a colour every 3 cm, those of a square of 2.4 m turned by half a turn if asked for.
fn scanned(turned: bool) -> Built {
    const STEP: f64 = 0.03;
    let truth = plan(room(), &[grey(0.5)]);
    let origin = truth.build().scene.origin;
    let painted = |s: &Surface| f64::from(s.position.y) + origin.y > 4.999;
    let radiance = |s: &Surface| {
        let shade = if painted(s) { squares(s.position.as_dvec3() + origin) } else { 0.5 };
        Vec3::splat(shade + 0.02 * s.position.x)
    };
    let walls = room().into_iter().filter(|q| q.0.y < 4.9).collect();
    let site = photographed(&truth, &plan(walls, &[grey(0.5)]), radiance);
    let path = site.folder.path().join("model.obj");
    let mut text = fs::read_to_string(&path).unwrap();
    let first = text.lines().filter(|l| l.starts_with("v ")).count() + 1;
    for i in 0..201 * 101 {
        let at = v((i % 201) as f64 * STEP, 5.0, (i / 201) as f64 * STEP);
        let middle = v(3.0, 5.0, 1.5);
        let inside = turned && (at - middle).abs().max_element() < 1.2;
        let shows = if inside { 2.0 * middle - at } else { at };
        let shade = squares(shows);
        text += &format!("v {} {} {} {shade} {shade} {shade}\n", at.x, at.y, at.z);
    }
    for i in (0..200 * 100).map(|k| first + k / 200 * 201 + k % 200) {
        text += &format!("f {} {} {} {}\n", i, i + 1, i + 202, i + 201);
    }
    fs::write(path, text).unwrap();
    site
}

#[test]
fn colours_of_a_scan_that_were_turned_are_told_as_that() {
    let audit = audited(&scanned(true));
    let told = |audit: &Audit| -> Vec<(Kind, What)> {
        audit.findings.iter().chain(&audit.doubts).map(|f| (f.kind, f.what)).collect()
    };
    assert_eq!(told(&audit), [(Kind::Texture, What::Rotated)]);
    assert_eq!(told(&audited(&scanned(false))), []);
}

#[test]
fn a_plain_wall_cannot_be_tested_and_is_not_called_right() {
    let truth = plan(room(), &[grey(0.5)]);
    let audit = audited(&photographed(&truth, &with_far_wall(4.9), |s| Vec3::splat(0.4 + 0.01 * s.position.x)));
    assert!(audit.findings.is_empty(), "{:?}", audit.findings);
    assert_eq!(share(&audit, Verdict::Ok), 0.0);
    let view = &audit.views[0];
    let untextured = view.reasons.iter().filter(|r| **r == Reason::NoTexture).count();
    assert!(untextured * 2 > view.reasons.len(), "{:?}", view.summary.reasons);
}

#[test]
fn probes_beside_the_camera_tell_nothing_of_geometry() {
    let near = |quads| {
        Plan::new(quads, &[grey(0.5)]).probe(v(3.0, 1.0, 1.5), PROBE).view(v(3.0, 1.0, 1.5), v(3.2, 5.0, 1.4), SIDE)
    };
    let (truth, model) = (near(room()), near(sides(DVec3::ZERO, v(6.0, 4.8, 3.0), [0; 6])));
    let audit = audited(&photographed(&truth, &model, patterned));
    assert_eq!(share(&audit, Verdict::Ok), 0.0, "{:?}", audit.views[0].summary);
    assert!(audit.findings.iter().all(|f| f.kind != Kind::Geometry));
    assert!(audit.views[0].summary.reasons["no_parallax"] > 0.5, "{:?}", audit.views[0].summary.reasons);
}

#[test]
fn a_photograph_outside_the_model_and_a_black_model_are_untestable() {
    let outside =
        Plan::new(room(), &[grey(0.5)]).probe(v(3.0, 2.0, 1.5), PROBE).view(v(3.0, 9.0, 1.5), v(3.0, 20.0, 1.5), SIDE);
    let audit = audited(&photographed(&outside, &outside, patterned));
    assert_eq!(share(&audit, Verdict::Untestable), 1.0);
    assert!(audit.findings.is_empty() && audit.doubts.is_empty());
    let audit = audited(&Pictures::patterned().in_site_of(&plan(room(), &[grey(0.0)])));
    assert_eq!(share(&audit, Verdict::Ok), 0.0);
    assert!(audit.views[0].summary.reasons["black_albedo"] > 0.5, "{:?}", audit.views[0].summary.reasons);
}

#[test]
fn a_person_in_one_probe_and_a_clipped_window_are_no_faults() {
    let p = plan(room(), &[grey(0.5)]);
    let built = Pictures::patterned().in_site_of(&p);
    // a dark figure before the far wall, in the first probe only
    let real = p.build();
    let probe = real.look(0, PROBE, |s| {
        s.map_or(Vec3::ZERO, |s| {
            let at = s.position.as_dvec3() + real.scene.origin;
            let person = at.y > 4.9 && (2.6..3.2).contains(&at.x) && at.z < 1.8;
            if person { Vec3::splat(0.03) } else { patterned(s) }
        })
    });
    built.put(0, &probe);
    let mut photo = Pictures::patterned().photo.clone();
    for (i, pixel) in photo.pixels.iter_mut().enumerate() {
        if (20..50).contains(&(i % SIDE as usize)) && (20..60).contains(&(i / SIDE as usize)) {
            *pixel = Vec3::splat(50.0);
        }
    }
    write_picture(&built.folder.path().join("v0.exr"), &photo);
    let audit = audited(&built);
    let at_person =
        |f: &audit::Finding| f.position[1] > 4.9 && (2.4..3.4).contains(&f.position[0]) && f.position[2] < 2.0;
    assert!(!audit.findings.iter().any(at_person), "{:?}", audit.findings);
    let window = &audit.views[0].reasons[40 * SIDE as usize + 35];
    assert_eq!((*window, audit.views[0].verdicts[40 * SIDE as usize + 35]), (Reason::Clipped, Verdict::Untestable));
}

/// A room with chequered walls, path-traced, and the same with one wall's picture gone wrong.
#[test]
fn a_recoloured_wall_is_texture_and_a_cast_shadow_is_not() {
    let board = Paint { albedo: 0.8, emission: 0.0, checker: true };
    let lamp = Quad(v(2.0, 1.5, 2.99), v(1.5, 0.0, 0.0), v(0.0, 1.5, 0.0), 1);
    // a screen that casts a shadow onto the far wall
    let screen = Quad(v(2.2, 3.2, 2.0), v(1.2, 0.0, 0.0), v(0.0, 0.0, 0.5), 2);
    let mut quads = sides(DVec3::ZERO, v(5.0, 4.5, 3.0), [0, 0, 0, 3, 0, 0]);
    quads.extend([lamp, screen]);
    let paints = [board, Paint { albedo: 0.0, emission: 20.0, checker: false }, grey(0.4), board];
    let truth = Plan::new(quads, &paints).probe(v(1.2, 1.4, 1.4), 192).probe(v(3.9, 1.2, 1.6), 192).view(
        v(2.5, 0.5, 1.5),
        v(2.5, 4.5, 1.5),
        96,
    );
    let real = truth.build().trace(&truth, 64);
    let lights = real.lights();
    let settings = reference::ReferenceSettings { samples: 64, ..Default::default() };
    let eye = Eye::Camera(real.site.views[0].camera);
    let photo = trace(&real.scene, &lights, &eye, &settings).mean();
    add_photo(&real, &photo);
    let paint = "newmtl m3\nKd 0.8 0.8 0.8";
    let audit = |colour: &str| {
        change(&real.folder.path().join("model.mtl"), &[(paint, &format!("newmtl m3\nKd {colour}"))]);
        let (site, scene) = load(real.folder.path());
        audit::audit(&site, &scene, "", &[], &Settings { cells: 12, ..Settings::default() }, &|_, _, _| {}).unwrap()
    };
    let right = audit("0.8 0.8 0.8");
    assert!(right.findings.is_empty(), "{:?}", right.findings);
    let wrong = audit("0.8 0.5 0.25");
    let wall = wrong
        .findings
        .iter()
        .max_by_key(|f| f.area_px)
        .unwrap_or_else(|| panic!("the wall is found: {:?}", wrong.doubts));
    assert_eq!((wall.kind, wall.what, wall.material.as_str()), (Kind::Texture, What::Recoloured, "m3"));
}

#[test]
fn a_shifted_pose_is_refined_and_told() {
    let board = Paint { albedo: 0.8, emission: 0.0, checker: true };
    let p = Plan::new(room(), &[board]).probe(v(1.5, 1.2, 1.4), PROBE).probe(v(4.6, 1.5, 1.7), PROBE).view(
        v(3.0, 1.0, 1.5),
        v(3.2, 5.0, 1.4),
        SIDE,
    );
    let truth = p.build();
    let radiance = |s: &Surface| truth.scene.albedo(s.triangle, s.barycentric) * 0.5 + Vec3::splat(0.02);
    let built = photographed(&p, &p, radiance);
    // the site's camera is turned: five pixels at this focal length
    let f = truth.site.views[0].camera.focal.x;
    let shift = 5.0 / f * 4.0;
    built.change(&[("look_at = [3.2, 5.0, 1.4]", &format!("look_at = [{}, 5.0, 1.4]", 3.2 + shift))]);
    let audit = audited(&built);
    let pose = audit.views[0].summary.pose;
    println!("refined by {:.2} ± {:.2} px", pose.mean_px, pose.residual_px);
    assert!(pose.refined && (4.0..7.0).contains(&pose.mean_px), "{pose:?}");
    assert!(audit.findings.iter().all(|f| f.kind != Kind::Geometry), "{:?}", audit.findings);
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let written = |audit: &Audit| {
        let folder = tempfile::tempdir().unwrap();
        audit.write(folder.path()).unwrap();
        contents(folder.path())
    };
    let built = Pictures::patterned().in_site_of(&with_far_wall(4.85));
    // of one site file: the audit tells where the photographs lie
    let run = |threads| on_threads(threads, || written(&audited(&built)));
    assert!(run(1) == run(3));
}

/// The bundled chapel as somebody modelled it: faults.json says what must be found.
#[test]
fn the_chapels_faulty_twin_is_found_out() {
    let (site, scene) = load(&chapel().join("as_modelled.toml"));
    let lighting = &site.lightings()[0];
    let views = ["floor", "panels", "apse"].map(str::to_owned);
    let settings = Settings { cells: 24, ..Settings::default() };
    let audit = audit::audit(&site, &scene, lighting, &views, &settings, &|_, _, _| {}).unwrap();
    let known: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(chapel().join("faults.json")).unwrap()).unwrap();
    let mut found = Vec::new();
    for fault in known["faults"].as_array().unwrap() {
        let number = |key: &str, i: usize| fault[key][i].as_f64().unwrap();
        let middle = v(number("position", 0), number("position", 1), number("position", 2));
        let size = v(number("size_m", 0), number("size_m", 1), number("size_m", 2)).max_element();
        let id = fault["id"].as_str().unwrap();
        let hit = audit.findings.iter().find(|f| {
            f.kind.name() == fault["kind"].as_str().unwrap() && DVec3::from(f.position).distance(middle) < 0.6 * size
        });
        println!("{id}: {}", hit.map_or("not found".to_owned(), |f| format!("{} {}", f.id, f.what.name())));
        found.extend(hit.map(|f| (id.to_owned(), f.what.name())));
    }
    for expected in
        [("floor", "rotated"), ("ship", "mirrored"), ("rosette", "recoloured"), ("vine", "shifted"), ("crate", "extra")]
    {
        assert!(found.iter().any(|(id, what)| (id.as_str(), *what) == expected), "{expected:?} not in {found:?}");
    }
    // in the view from aside alone its shift might as well be a surface off its place
    let vines = audit.findings.iter().filter(|f| f.material == "painting_vine");
    assert!(vines.clone().all(|f| f.what.name() == "shifted"), "{:?}", vines.map(|f| &f.note).collect::<Vec<_>>());
}

/// A camera's JPEG leaves edges of its own, and little of what is faint.
#[test]
fn a_coded_photograph_of_a_right_model_yields_nothing() {
    let folder = tempfile::tempdir().unwrap();
    copy(&chapel(), folder.path());
    let photo = panorama::read(&chapel().join("photos/apse.exr")).unwrap();
    let mut bright: Vec<f32> = photo.pixels.iter().map(|p| p.max_element()).collect();
    bright.sort_by(f32::total_cmp);
    // one pixel in a hundred is clipped
    let gain = 1.0 / bright[bright.len() * 99 / 100];
    let code = |v: f32| (linear_to_srgb((v * gain).clamp(0.0, 1.0)) * 255.0).round() as u8;
    let bytes: Vec<u8> = photo.pixels.iter().flat_map(|p| p.to_array().map(code)).collect();
    let file = fs::File::create(folder.path().join("photos/apse.jpg")).unwrap();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(file, 60);
    encoder.encode(&bytes, photo.width as u32, photo.height as u32, image::ExtendedColorType::Rgb8).unwrap();
    change(&folder.path().join("site.toml"), &[("photos/apse.exr", "photos/apse.jpg")]);
    let (site, scene) = load(folder.path());
    let settings = Settings { cells: 24, ..Settings::default() };
    let audit =
        audit::audit(&site, &scene, &site.lightings()[0], &["apse".to_owned()], &settings, &|_, _, _| {}).unwrap();
    assert!(audit.findings.is_empty(), "{:?}", audit.findings);
}

#[test]
fn the_program_audits_and_names_what_is_missing() {
    let out = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| clerestory(&[&"audit", &"--out", &out.path()], arguments);
    let printed = run(&["sites/chapel/as_modelled.toml", "--view", "apse", "--json"]).json();
    let written: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.path().join("findings.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    for f in written["findings"].as_array().unwrap() {
        let mask = image::open(out.path().join(f["mask"].as_str().unwrap())).unwrap().into_luma8();
        assert_eq!(mask.dimensions(), (256, 256));
        let inside = mask.pixels().filter(|p| p.0[0] == 255).count() as u64;
        assert_eq!(inside, f["area_px"].as_u64().unwrap());
    }
    let said = run(&["sites/chapel", "--view", "nave"]).error_line();
    assert!(said.contains("nave") && said.contains("sacristy"), "{said}");
}
