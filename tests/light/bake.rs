//! Light as a linear operator and baking, from the site file to the files that other programs open.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::program::clerestory;
use crate::support::{
    Built, HIGH, Plan, change, closed, grey, load, on_threads, options, sunny_room, v, write_picture,
};
use clerestory::bake::{self, Bake, Baked, BakedLight, Pieces, bake, write_glb, write_ply};
use clerestory::panorama::{self, Picture, Radiometry};
use clerestory::render::{Irradiance, Options, Relit, Source, pictures, prepare_for, render};
use clerestory::scene::{Mesh, Scene};
use clerestory::shoot::Light;
use clerestory::site::{Site, walk};
use clerestory::study::flip;
use clerestory::transfer::{Point, Transfer};
use clerestory::volume::Volume;
use glam::{DVec3, Vec3};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::sync::OnceLock;

#[path = "../../examples/common/direct.rs"]
mod direct;
use direct::direct;

fn room_plan() -> Plan {
    sunny_room([0; 6], 64, "[20, 19, 18]").view(v(3.7, 2.6, 1.7), v(2.0, 1.0, 0.4), 48)
}

/// The sunny room with its probes' pictures, which are traced once.
fn room() -> Built {
    static TRACED: OnceLock<Vec<Picture>> = OnceLock::new();
    let built = room_plan().build();
    let pictures = TRACED.get_or_init(|| built.traced(&room_plan(), 64));
    built.with(pictures)
}

/// Points all over the room's surfaces, on the sides that it shows.
fn points(built: &Built) -> Vec<Point> {
    let scene = &built.scene;
    let inside = |p: Vec3, low: DVec3, high: DVec3| p.cmpgt(built.local(low)).all() && p.cmplt(built.local(high)).all();
    let shown = |&(p, n): &Point| {
        let above = p + n * 0.01;
        inside(above, DVec3::ZERO, HIGH) && !inside(above, v(2.0, 0.5, -1.0), v(2.3, 2.5, 1.4))
    };
    let mut all = Vec::new();
    for t in 0..scene.mesh.triangles.len() as u32 {
        let ([a, b, c], n) = (scene.mesh.corners(t), scene.mesh.normal(t));
        for i in 1..12 {
            for j in 1..12 - i {
                let p = a + (b - a) * (i as f32 / 12.0) + (c - a) * (j as f32 / 12.0);
                all.extend([(p, n), (p, -n)].into_iter().filter(shown));
            }
        }
    }
    all
}

/// Those of some points that a light's probes do not see.
fn unseen(scene: &Scene, seen: Option<&Light>, points: &[Point]) -> Vec<Point> {
    let hidden = |(p, n): &&Point| seen.is_none_or(|light| light.observe(scene, *p, *n).is_none());
    points.iter().filter(hidden).copied().collect()
}

/// The operator gives what shooting and rendering anew give, for its own lighting and its multiples up to 10⁹; scaling a
/// colour alone leaves weights that hang on the light a little off.
#[test]
fn a_sparse_product_relights_as_shooting_anew_does() {
    let built = room();
    let site = Site::load(built.folder.path()).unwrap();
    let scene = &built.scene;
    let points = points(&built);
    let setup = prepare_for(&site, scene, |seen| unseen(scene, seen, &points), &options(24)).unwrap();
    let (light, transport) = (&setup.lights[0].1, &setup.transports[0]);
    let volume = Volume::new(scene, transport, light);
    let relit = Relit { scene, light, volume: Some(&volume), volume_only: false };
    let own = pictures(&site, "", 2, 0).unwrap();
    let fed: Vec<(&Picture, Radiometry)> = own.iter().map(|(p, r)| (p, *r)).collect();
    let transfer = Transfer::new(&relit, &fed, &points);
    let found = direct(&relit, &points);
    let share = |source: Source| found.iter().filter(|f| f.1 == source).count() as f64 / found.len() as f64;
    let (records, volume) = (share(Source::Record), share(Source::Volume));
    assert!(records > 0.3 && volume > 0.1 && records + volume > 0.98, "{records} and {volume}");
    let sun = light.sun.unwrap().irradiance;
    for (scale, sky) in
        [(Vec3::ONE, 1.0), (Vec3::splat(1e9), 1e9), (Vec3::splat(1e-6), 1e-6), (Vec3::new(1.0, 2.0, 0.5), 1.0)]
    {
        let scaled: Vec<Picture> = own
            .iter()
            .map(|(p, _)| Picture { pixels: p.pixels.iter().map(|l| *l * scale).collect(), ..p.clone() })
            .collect();
        let anew: Vec<_> = light
            .records
            .iter()
            .zip(&scaled)
            .zip(&own)
            .map(|((r, p), (_, radiometry))| (r.hits().clone(), p, *radiometry))
            .collect();
        let outside = clerestory::shoot::Outside::Uniform(Vec3::splat(sky));
        let given = clerestory::site::Sun { irradiance: sun * scale, ..light.sun.unwrap() };
        let light = Light::new(scene, anew, Some(given), Some(outside));
        let volume = Volume::new(scene, transport, &light);
        let relit = Relit { scene, light: &light, volume: Some(&volume), volume_only: false };
        let truth = direct(&relit, &points);
        let measured = transfer.measure(&scaled.iter().collect::<Vec<_>>());
        let product = transfer.light(&measured, light.sun.map_or(Vec3::ZERO, |s| s.irradiance), Vec3::splat(sky));
        let mut off: Vec<f32> = product
            .iter()
            .zip(&truth)
            .map(|(a, (b, _))| (*a - *b).abs().max_element() / b.max_element().max(1e-3 * scale.max_element()))
            .collect();
        off.sort_by(f32::total_cmp);
        let (median, most) = (off[off.len() / 2], off[off.len() - 1]);
        if scale.min_element() == scale.max_element() {
            assert!(most <= 1e-5, "scale {scale}: off by {most}");
        } else {
            assert!(median <= 0.01 && most > 1e-5, "scale {scale}: median {median}, most {most}");
        }
    }
}

/// A volume that lightings share names their records by cells, and takes for seen what has light there: lightings whose pictures
/// differ in size, or in where they show light, have one each. All are lit as each is alone, in any order.
#[test]
fn lightings_whose_pictures_differ_are_lit_as_each_alone() {
    lit_as_each_alone(32, 0);
    lit_as_each_alone(64, 24);
}

/// With a second lighting whose pictures are so wide, and show no light in so many columns.
fn lit_as_each_alone(width: usize, covered: usize) {
    let mut quads = closed(DVec3::ZERO, HIGH, 0);
    quads.extend(closed(v(2.0, 0.5, 0.0), v(2.3, 2.5, 1.4), 0));
    let plan = Plan::new(quads, &[grey(0.6)]).probe(v(0.9, 1.4, 1.0), 64).probe(v(1.1, 0.6, 0.7), 64);
    let built = plan.build();
    let (folder, scene) = (built.folder.path(), &built.scene);
    for i in 0..2 {
        for (lighting, width) in [("large", 64), ("small", width)] {
            let mut picture = built.look(i, width, |s| s.map_or(Vec3::ZERO, |s| Vec3::splat(s.position.x.exp())));
            if lighting == "small" {
                let hidden = picture.pixels.iter_mut().enumerate().filter(|(k, _)| k % width < covered);
                hidden.for_each(|(_, p)| *p = Vec3::NAN);
            }
            write_picture(&folder.join(format!("{lighting}{i}.exr")), &picture);
        }
        let both = format!("{{ large = \"large{i}.exr\", small = \"small{i}.exr\" }}");
        built.change(&[(&format!("\"p{i}.exr\""), &both)]);
    }
    let site = Site::load(folder).unwrap();
    let points = points(&built);
    let lit = |lightings: &[&str]| -> Vec<Vec<(Vec3, Source)>> {
        let options = Options { lightings: lightings.iter().map(|l| (*l).to_owned()).collect(), ..options(24) };
        let setup = prepare_for(&site, scene, |seen| unseen(scene, seen, &points), &options).unwrap();
        assert_eq!(setup.transports.len(), lightings.len());
        let volumes = setup.volumes(scene);
        let relit = |((_, light), volume): (&(String, Light), &Option<Volume>)| {
            direct(&Relit { scene, light, volume: volume.as_ref(), volume_only: false }, &points)
        };
        setup.lights.iter().zip(&volumes).map(relit).collect()
    };
    let [large, small] = ["large", "small"].map(|lighting| lit(&[lighting]).remove(0));
    assert!(large.iter().any(|l| l.1 == Source::Volume));
    assert!(lit(&["large", "small"]) == [large.clone(), small.clone()], "the large one first");
    assert!(lit(&["small", "large"]) == [small, large], "the small one first");
}

/// That no volume was needed is said once, and only if there is none.
#[test]
fn a_volume_is_left_out_once_or_not_at_all() {
    let quads = closed(DVec3::ZERO, HIGH, 0);
    let plan = Plan::new(quads, &[grey(0.6)]).probe(v(1.0, 1.4, 1.0), 32).probe(v(3.0, 1.9, 1.3), 32);
    let built = plan.build().furnace(&plan, 0.2);
    let folder = built.folder.path();
    fs::copy(folder.join("p0.exr"), folder.join("evening.exr")).unwrap();
    // the second probe has no picture of the evening
    built.change(&[
        ("\"p0.exr\"", "{ noon = \"p0.exr\", evening = \"evening.exr\" }"),
        ("\"p1.exr\"", "{ noon = \"p1.exr\" }"),
    ]);
    let site = Site::load(folder).unwrap();
    let options = Options { lightings: vec!["noon".to_owned(), "evening".to_owned()], ..options(8) };
    let floor: Point = (built.local(v(2.0, 1.5, 0.0)), Vec3::Z);
    // so many volumes, and how often one is left out, if lightings with so few probes need it
    let cast = |fewer_than: usize| {
        let wanted = |seen: Option<&Light>| match seen {
            Some(light) if light.records.len() < fewer_than => vec![floor],
            _ => Vec::new(),
        };
        let setup = prepare_for(&site, &built.scene, wanted, &options).unwrap();
        (setup.transports.len(), setup.left_out.iter().filter(|l| l.stage == "volume").count())
    };
    assert_eq!([1, 2, 3].map(cast), [(0, 1), (1, 0), (2, 0)]);
}

fn baked(built: &Built, threads: usize, settings: &bake::BakeSettings) -> Baked {
    let site = Site::load(built.folder.path()).unwrap();
    on_threads(threads, || bake(&site, &built.scene, &options(24), settings, &|_| ()).unwrap().baked)
}

/// What is drawn from a bake, direct sun kept apart, looks as what is rendered from the records themselves.
#[test]
fn a_view_drawn_from_a_bake_is_as_rendered() {
    let built = room();
    let scene = &built.scene;
    let site = Site::load(built.folder.path()).unwrap();
    let settings =
        bake::BakeSettings { vertices: 40_000, views: false, sun_apart: true, ..bake::BakeSettings::default() };
    let Bake { baked, setup } = bake(&site, scene, &options(24), &settings, &|_| ()).unwrap();
    let (light, volumes) = (&setup.lights[0].1, setup.volumes(scene));
    let pieces = Pieces::new(scene, &baked);
    let relit = Relit { scene, light, volume: volumes[0].as_ref(), volume_only: false };
    let drawn = BakedLight::new(&baked, 0, &relit, &pieces);
    let camera = site.views[0].camera;
    let [drawn, full] =
        [&drawn as &dyn Irradiance, &relit].map(|light| render(scene, light, &camera, 4, &|_, _| ()).radiance);
    let off = flip(&drawn, &full);
    assert!(off > 0.0 && off < 0.03, "{off}");
}

/// Per edge (its ends' places) how many triangles run along it one way and the other.
fn edges(baked: &Baked) -> BTreeMap<[[u32; 3]; 2], [usize; 2]> {
    let place = |v: u32| (baked.vertices[v as usize].position + 0.0).to_array().map(f32::to_bits);
    let mut all: BTreeMap<_, [usize; 2]> = BTreeMap::new();
    for t in &baked.triangles {
        for e in 0..3 {
            let (a, b) = (place(t[e]), place(t[(e + 1) % 3]));
            all.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    all
}

/// Cut for the edges of a sun patch and of shadows, a closed room stays closed: at each edge two sides meet, wound alike.
#[test]
fn cutting_opens_no_crack_and_follows_the_light() {
    let quads = closed(DVec3::ZERO, HIGH, 0);
    let plan = Plan::new(quads, &[grey(0.6)]).probe(v(1.0, 1.4, 1.0), 64).probe(v(3.0, 1.9, 1.3), 64);
    let step = |p: Vec3| if p.x + 0.3 * p.y > 0.4 { 8.0 } else { 1.0 };
    let built = plan.build().paint(&plan, |_, s| s.map_or(Vec3::ZERO, |s| Vec3::splat(step(s.position))));
    let settings = bake::BakeSettings { vertices: 20_000, error: 0.1, views: false, ..bake::BakeSettings::default() };
    let baked = baked(&built, 2, &settings);
    assert!(baked.vertices.len() <= settings.vertices && baked.vertices.len() > 2_000, "{}", baked.vertices.len());
    assert!(baked.hidden.is_empty());
    let edges = edges(&baked);
    assert!(edges.values().all(|ways| *ways == [1, 1]), "a crack or a fold");
    // short edges lie where light changes, long ones where it does not
    let length = |e: &[[u32; 3]; 2]| {
        let [a, b] = e.map(|p| Vec3::from(p.map(f32::from_bits)));
        (a.distance(b), 0.5 * (a + b))
    };
    let shortest = edges.keys().map(length).fold((f32::INFINITY, Vec3::ZERO), |s, e| if e.0 < s.0 { e } else { s });
    assert!(shortest.0 < 0.012 && (shortest.1.x + 0.3 * shortest.1.y - 0.4).abs() < 0.3, "{shortest:?}");
    // what is between vertices is as the room has it, away from the step
    let off = baked.triangles.iter().map(|t| {
        let mean = |of: &dyn Fn(usize) -> f32| t.iter().map(|v| of(*v as usize)).sum::<f32>() / 3.0;
        let middle = t.iter().map(|v| baked.vertices[*v as usize].position).sum::<Vec3>() / 3.0;
        let truth = std::f32::consts::PI * step(middle) / 0.6;
        let far = (middle.x + 0.3 * middle.y - 0.4).abs() > 0.6;
        if far { (mean(&|v| baked.irradiance[0][v].x) / truth - 1.0).abs() } else { 0.0 }
    });
    let mut off: Vec<f32> = off.collect();
    off.sort_by(f32::total_cmp);
    assert!(off[off.len() / 2] < 0.02, "{}", off[off.len() / 2]);
}

/// The files are the same bytes on any number of threads, and our own reader finds in them what was put there.
#[test]
fn a_baked_file_is_the_same_on_any_threads_and_reads_back() {
    let built = room();
    let settings = bake::BakeSettings { vertices: 8_000, error: 0.1, views: false, ..bake::BakeSettings::default() };
    let write = |baked: &Baked| -> (Vec<u8>, Vec<u8>) {
        let [glb, ply] = ["baked.glb", "baked.ply"].map(|n| built.folder.path().join(n));
        write_glb(&glb, &built.scene, baked, 0, serde_json::Map::new()).unwrap();
        write_ply(&ply, &built.scene, &built.site.frame, baked, 0, "test").unwrap();
        (fs::read(glb).unwrap(), fs::read(ply).unwrap())
    };
    let one = write(&baked(&built, 1, &settings));
    let baked = baked(&built, 3, &settings);
    assert!(one == write(&baked), "three threads");
    let area = |m: &Mesh| (0..m.triangles.len() as u32).map(|t| f64::from(m.area(t))).sum::<f64>();
    let own: f64 = baked
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| baked.vertices[v as usize].position);
            f64::from((b - a).cross(c - a).length()) / 2.0
        })
        .sum();
    for (name, up) in [("baked.glb", "y"), ("baked.ply", "z")] {
        let text = format!("[site]\nname = \"Again\"\nunits = \"m\"\nup = \"{up}\"\n[model]\npath = \"{name}\"\n");
        fs::write(built.folder.path().join("again.toml"), text).unwrap();
        let (_, scene) = load(&built.folder.path().join("again.toml"));
        // no more than slivers go lost
        assert!((area(&scene.mesh) / own - 1.0).abs() < 1e-4, "{name}");
        assert_eq!(scene.mesh.colours.len(), scene.mesh.positions.len(), "{name}: light as colours");
        let world = |scene: &Scene| scene.origin + scene.mesh.bounds().0.as_dvec3();
        assert!(world(&scene).distance(world(&built.scene)) < 1e-3, "{name}: in its place");
    }
}

/// A walk through two places and a view gives frames that stand where it says.
#[test]
fn a_walk_leads_through_its_key_frames() {
    let built = room_plan().build();
    let file = built.folder.path().join("walk.toml");
    fs::write(&file, "[path]\nframes = 5\nsize = [16, 8]\n[[key]]\nposition = [1, 1, 1]\nlook_at = [3, 1, 1]\n[[key]]\nview = \"v0\"\nfov_y = 40\n").unwrap();
    let frames = walk(&built.site, &file).unwrap();
    assert_eq!((frames.len(), frames[4].name.as_str()), (5, "frame_0005"));
    assert!(frames[4].camera.pose.position.distance(built.site.views[0].camera.pose.position) < 1e-9);
    assert!((frames[4].camera.fov_y_deg() - 40.0).abs() < 1e-6);
    fs::write(&file, "[path]\nframes = 5\n[[key]]\nview = \"nowhere\"\n").unwrap();
    let told = walk(&built.site, &file).unwrap_err().to_string();
    assert!(told.contains("nowhere") && told.contains("v0") && told.contains(":4:"), "{told}");
    // decimal commas make four numbers of two
    fs::write(&file, "[path]\nframes = 5\nsize = [6,4, 4,8]\n[[key]]\nview = \"v0\"\n").unwrap();
    let told = walk(&built.site, &file).unwrap_err().to_string();
    assert!(told.contains("expected a list of 2 whole numbers, found 4") && told.contains(":3:"), "{told}");
}

/// Light from numbered pictures: a walk's frames are as bright as theirs, the last picture stays, and a gap is an error with its number.
#[test]
fn numbered_pictures_light_the_frames_of_a_walk() {
    let built = room();
    let folder = built.folder.path();
    for i in 0..2 {
        let picture = panorama::read(&folder.join(format!("p{i}.exr"))).unwrap();
        for (n, times) in [(1, 1.0), (2, 0.5), (3, 2.0)] {
            let pixels = picture.pixels.iter().map(|p| *p * times).collect();
            write_picture(&folder.join(format!("p{i}_{n:03}.exr")), &Picture { pixels, ..picture.clone() });
        }
        change(&folder.join("site.toml"), &[(&format!("p{i}.exr"), &format!("p{i}_###.exr"))]);
    }
    let still = "position = [3.6, 2.5, 1.7]\nlook_at = [2, 1, 0.4]\n";
    fs::write(folder.join("walk.toml"), format!("[path]\nframes = 4\nsize = [32, 24]\n[[key]]\n{still}")).unwrap();
    let render = || {
        let (walk, out) = (folder.join("walk.toml"), folder.join("out"));
        let given: [&dyn AsRef<OsStr>; 6] = [&"render", &folder, &"--path", &walk, &"--out", &out];
        clerestory(&given, &["--cells", "16", "--vertices", "4000", "--json"])
    };
    render().text();
    let frame = |i: usize| panorama::read(&folder.join(format!("out/frame_{i:04}.exr"))).unwrap();
    let first = frame(1);
    for (i, times) in [(2, 0.5), (3, 2.0), (4, 2.0)] {
        for (a, b) in frame(i).pixels.iter().zip(&first.pixels) {
            assert!((*a - *b * times).abs().max_element() <= 2e-3 * times * b.max_element(), "{i}: {a}, {b}");
        }
    }
    fs::remove_file(folder.join("p0_002.exr")).unwrap();
    let told = render().error();
    assert!(told.contains("number 2 is missing") && told.contains("site.toml:"), "{told}");
}

/// A program that was built without graphics cards says how to build one with them.
#[cfg(not(feature = "gpu"))]
#[test]
fn without_the_feature_a_graphics_card_is_asked_for_in_vain() {
    let told = clerestory(&[], &["render", "sites/chapel", "--gpu"]);
    assert!(told.code == Some(1) && told.stderr.contains("--features gpu"), "{told:?}");
}
