//! Planning a whole site: made buildings with the usual ills, real models, and the verb.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test that cannot go on")]

use crate::support::data::shared;
use crate::support::program::clerestory;
use crate::support::{Built, Plan, Quad, closed, grey, on_threads, sides, v};
use clerestory::plan::PlanError;
use clerestory::plan::export::tables::{self, Outward};
use clerestory::plan::stations::result::{FloorPlan, SitePlan};
use clerestory::plan::stations::run::{Options, plan};
use clerestory::scene::{self, Health, Ray, Scene};
use clerestory::site::{Pictures, Site};
use glam::{DVec2, DVec3, Vec3};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

/// Fewer patches than the verb takes: the check in space is quicker.
fn quick() -> Options {
    Options { patches: 4000, ..Options::default() }
}

fn built(quads: Vec<Quad>, more: &str) -> Built {
    let mut site = Plan::new(quads, &[grey(0.5)]);
    site.more = more.to_owned();
    site.build()
}

fn planned(built: &Built) -> SitePlan<'_> {
    plan(&built.site, &built.scene, &quick()).unwrap()
}

/// A building and its plan, made once for the tests that look at it.
struct Shared {
    built: OnceLock<(Site, Scene)>,
    plan: OnceLock<SitePlan<'static>>,
}

impl Shared {
    /// Plans it on three threads.
    fn of(&'static self, quads: fn() -> Vec<Quad>) -> (&'static Site, &'static Scene, &'static SitePlan<'static>) {
        let (site, scene) = self.built.get_or_init(|| {
            let Built { site, scene, .. } = built(quads(), "");
            (site, scene)
        });
        (site, scene, self.plan.get_or_init(|| on_threads(3, || plan(site, scene, &quick())).unwrap()))
    }
}

static HOUSE: Shared = Shared { built: OnceLock::new(), plan: OnceLock::new() };
static SUITE: Shared = Shared { built: OnceLock::new(), plan: OnceLock::new() };

fn refused(quads: Vec<Quad>, more: &str) -> PlanError {
    let built = built(quads, more);
    let refused = plan(&built.site, &built.scene, &quick());
    refused.err().expect("no plan should be found")
}

fn box_of(low: [f64; 3], high: [f64; 3]) -> Vec<Quad> {
    closed(DVec3::from(low), DVec3::from(high), 0)
}

/// A rectangle in a plane of constant x or y, from the floor up.
fn wall(from: [f64; 2], to: [f64; 2], low: f64, high: f64) -> Quad {
    Quad(v(from[0], from[1], low), v(to[0] - from[0], to[1] - from[1], 0.0), v(0.0, 0.0, high - low), 0)
}

fn level(low: [f64; 2], high: [f64; 2], z: f64) -> Quad {
    Quad(v(low[0], low[1], z), v(high[0] - low[0], 0.0, 0.0), v(0.0, high[1] - low[1], 0.0), 0)
}

/// Rays tell that each station has ground beneath at probe height, clearance around its lens and legs, and a roof or
/// walls about it.
fn assert_stands(scene: &Scene, floor: &FloorPlan, clearance: f32) {
    for station in &floor.stations {
        let lens = station.position.as_vec3();
        let down = scene.tracer.closest(&Ray { origin: lens, direction: Vec3::NEG_Z }, 1e-3).expect("ground beneath");
        assert!((down.t - 1.6).abs() < 0.06, "{}: ground {} m beneath", station.name, down.t);
        for height in [0.35, 0.8, 1.2, 1.6] {
            let origin = lens - Vec3::Z * (1.6 - height);
            for i in 0..90 {
                let (sin, cos) = (i as f32 / 90.0 * std::f32::consts::TAU).sin_cos();
                let ray = Ray { origin, direction: Vec3::new(cos, sin, 0.0) };
                let near = scene.tracer.closest(&ray, 1e-3).map_or(f32::INFINITY, |h| h.t);
                assert!(near > clearance - 0.01, "{}: {near} m clear at height {height}", station.name);
            }
        }
    }
}

/// A house of 10 × 8 m: an upper floor over its western 6 m, the rest a hall with a stair up to it; a table.
fn house() -> Vec<Quad> {
    let mut quads = sides(v(0.0, 0.0, 0.0), v(10.0, 8.0, 6.0), [0; 6]);
    quads.extend(box_of([0.0, 0.0, 2.75], [6.0, 8.0, 3.0]));
    for i in 0..15 {
        let (x, z) = (9.0 - 0.2 * f64::from(i), 0.2 * f64::from(i + 1));
        quads.extend(box_of([x - 0.2, 0.0, 0.0], [x, 1.2, z]));
    }
    quads.extend(box_of([2.0, 3.0, 0.72], [4.0, 4.2, 0.78]));
    // a wall with a door parts the upper floor
    quads.extend(box_of([3.0, 0.0, 3.0], [3.15, 5.0, 6.0]));
    quads.extend(box_of([3.0, 6.0, 3.0], [3.15, 8.0, 6.0]));
    quads
}

#[test]
fn a_house_with_stair_and_gallery_has_two_floors() {
    let (site, scene, plan) = HOUSE.of(house);
    let names: Vec<&str> = plan.floors.iter().map(|f| f.floor.name.as_str()).collect();
    assert_eq!(names, ["Ground floor", "First floor"]);
    let json = tables::json(site, plan, &Outward::of(site, scene));
    assert!((json.floors[0].elevation - 0.0).abs() < 0.01 && (json.floors[1].elevation - 3.0).abs() < 0.01);
    let (ground, first) = (&json.floors[0], &json.floors[1]);
    // the stair's upper part blocks sight; cells that walls touch count as wall
    assert!(ground.area_m2 > 72.0 && ground.area_m2 <= 80.0, "{}", ground.area_m2);
    assert!(first.area_m2 > 43.0 && first.area_m2 <= 48.5, "{}", first.area_m2);
    for floor in &plan.floors {
        assert_stands(scene, floor, 0.3);
        assert!(floor.covered_fraction() >= 0.97, "{} {}", floor.floor.name, floor.covered_fraction());
        assert!(floor.lower_bound <= floor.needed && floor.lower_bound >= 1);
        assert_eq!(floor.groups, 1, "{}", floor.floor.name);
    }
    // the gallery looks over the hall, which is not its own floor to see
    assert!(plan.floors[1].floor.open.area() > 70.0);
    // two rooms, one door: one station in each
    assert!(plan.floors[1].stations.len() >= 2);
    assert!(ground.stations.iter().all(|s| (s.position[2] - 1.6).abs() < 0.05), "nobody stands on the table");
}

/// Planned alone, a floor has the fixed places that it has among all.
#[test]
fn a_fixed_place_stays_on_its_floor_whichever_is_planned() {
    for at in ["[8, 2]", "[2, 2]"] {
        let house = built(house(), &format!("[plan]\nfixed = [{at}]"));
        for (name, expected) in [("ground", 1), ("first", 0)] {
            let options = Options { floors: vec![name.to_owned()], patches: 0, ..Options::default() };
            let plan = plan(&house.site, &house.scene, &options).unwrap();
            let [floor] = plan.floors.as_slice() else { panic!("{} floors", plan.floors.len()) };
            assert_eq!(floor.floor.slug, name);
            assert_eq!(floor.stations.iter().filter(|s| s.fixed).count(), expected, "{at} on the {name} floor");
        }
    }
}

#[test]
fn a_floor_that_is_kept_out_is_not_called_narrow() {
    let house = built(house(), "[plan]\nkeep_out = [[[-1, -1], [6.5, -1], [6.5, 9], [-1, 9]]]");
    let plan = planned(&house);
    assert_eq!(plan.floors.len(), 1);
    let told = plan.warnings.iter().find(|w| w.starts_with("A level of")).unwrap();
    assert!(told.contains("check plan.keep_out") && !told.contains("clearance"), "{told}");
}

#[test]
fn a_closet_whose_door_is_shut_still_counts() {
    let mut quads = sides(v(0.0, 0.0, 0.0), v(10.0, 8.0, 3.0), [0; 6]);
    quads.extend(box_of([8.0, 2.5, 0.0], [10.0, 2.6, 3.0]));
    quads.extend(box_of([7.9, 0.0, 0.0], [8.0, 2.6, 3.0]));
    let built = built(quads, "");
    let plan = planned(&built);
    let json = tables::json(&built.site, &plan, &Outward::of(&built.site, &built.scene));
    let floor = &json.floors[0];
    assert!(floor.left_out_m2 == 0.0 && floor.area_m2 > 77.0, "{} {}", floor.left_out_m2, floor.area_m2);
    assert!(floor.stations.iter().any(|s| s.position[0] > 8.0 && s.position[1] < 2.5), "{:?}", floor.stations);
}

#[test]
fn no_sight_leaks_through_a_door_that_is_five_centimetres_ajar() {
    let mut quads = vec![level([-15.0, -15.0], [20.0, 19.0], 0.0), level([0.0, 0.0], [5.0, 4.0], 3.0)];
    quads.extend([
        wall([0.0, 0.0], [5.0, 0.0], 0.0, 3.0),
        wall([0.0, 4.0], [5.0, 4.0], 0.0, 3.0),
        wall([0.0, 0.0], [0.0, 4.0], 0.0, 3.0),
        wall([5.0, 0.0], [5.0, 1.98], 0.0, 3.0),
        wall([5.0, 2.03], [5.0, 4.0], 0.0, 3.0),
    ]);
    let room = built(quads, "");
    let plan = planned(&room);
    let [floor] = plan.floors.as_slice() else { panic!("{} floors", plan.floors.len()) };
    assert!(floor.floor.open.area() > 18.5 && floor.floor.open.area() <= 20.0, "{}", floor.floor.open.area());
    let inside = |p: DVec3| (0.0..5.0).contains(&p.x) && (0.0..4.0).contains(&p.y);
    assert!(floor.stations.iter().all(|s| inside(s.position + room.scene.origin)));
    assert_stands(&room.scene, floor, 0.3);
    assert_eq!((floor.stations.len(), floor.lower_bound), (1, 1));
}

/// Inner and outer shell 80 cm apart, on one floor: a tripod would fit in between.
#[test]
fn nobody_is_sent_into_a_hollow_wall() {
    let mut quads = vec![level([0.0, 0.0], [8.0, 7.0], 0.0), level([0.0, 0.0], [8.0, 7.0], 3.5)];
    let shell = |a: f64, b: [f64; 2], out: bool| {
        let corners = [[a, a], [b[0], a], [b[0], b[1]], [a, b[1]]];
        // wound so that fronts face away from the hollow: out of the house, or into the room
        (0..4).map(move |i| {
            let (p, q) = (corners[i], corners[(i + 1) % 4]);
            if out { wall(p, q, 0.0, 3.5) } else { wall(q, p, 0.0, 3.5) }
        })
    };
    quads.extend(shell(0.0, [8.0, 7.0], true));
    quads.extend(shell(0.8, [7.2, 6.2], false));
    let house = built(quads, "");
    let plan = planned(&house);
    let [floor] = plan.floors.as_slice() else { panic!("{} floors", plan.floors.len()) };
    let area = 6.4 * 5.4;
    assert!((floor.area_m2 / area - 1.0).abs() < 0.05, "{} of {area}", floor.area_m2);
    assert_eq!(floor.stations.len(), 1);
}

/// Columns that touch each other and the wall, doubled faces, and a hole in the floor.
#[test]
fn touching_columns_and_a_hole_in_the_floor_do_no_harm() {
    let mut quads = sides(v(0.0, 0.0, 0.0), v(9.0, 6.0, 4.0), [0; 6]);
    quads.remove(0);
    quads.extend([
        level([0.0, 0.0], [9.0, 4.0], 0.0),
        level([0.0, 4.0], [6.0, 6.0], 0.0),
        level([7.0, 4.0], [9.0, 6.0], 0.0),
    ]);
    for (x, y) in [(3.0, 2.0), (3.5, 2.5), (4.0, 2.0), (0.0, 3.0)] {
        quads.extend(box_of([x, y, 0.0], [x + 0.5, y + 0.5, 4.0]));
    }
    let doubled = box_of([3.0, 2.0, 0.0], [3.5, 2.5, 4.0]);
    quads.extend(doubled);
    let hall = built(quads, "");
    let plan = planned(&hall);
    let [floor] = plan.floors.as_slice() else { panic!("{} floors", plan.floors.len()) };
    // the hole of 2 m² still counts as floor to be seen, but nobody stands in it
    assert!((floor.area_m2 - 53.0).abs() < 2.5, "{}", floor.area_m2);
    assert!(floor.covered_fraction() > 0.97);
    assert_stands(&hall.scene, floor, 0.3);
}

#[test]
fn faults_are_told_in_one_line_each() {
    let room = || sides(v(0.0, 0.0, 0.0), v(5.0, 4.0, 3.0), [0; 6]);
    // no floor: walls and ceiling only
    let mut bare = room();
    bare.remove(0);
    assert!(matches!(refused(bare, ""), PlanError::OpenModel { .. }), "only its roof can be walked on");
    let walls = room().split_off(2);
    assert!(matches!(refused(walls, ""), PlanError::NoFloor { .. }));
    // open: a floor in a field
    assert!(matches!(refused(vec![level([0.0, 0.0], [30.0, 20.0], 0.0)], ""), PlanError::OpenModel { .. }));
    // too narrow for the clearance
    let narrow = refused(room(), "[plan]\nclearance = 2.5");
    assert!(
        matches!(narrow, PlanError::NoPlace { floors: 1, widest_m, .. } if (1.8..2.1).contains(&widest_m)),
        "{narrow}"
    );
    let kept_out = refused(room(), "[plan]\nkeep_out = [[[-1, -1], [6, -1], [6, 5], [-1, 5]]]");
    assert!(matches!(kept_out, PlanError::NoPlace { .. }), "{kept_out}");
    let [narrow_told, kept_out_told] = [&narrow, &kept_out].map(ToString::to_string);
    assert!(narrow_told.contains("lower plan.clearance") && !narrow_told.contains("keep_out"), "{narrow_told}");
    assert!(kept_out_told.contains("check plan.keep_out") && !kept_out_told.contains("clearance"), "{kept_out_told}");
    // limits that exclude each other
    let outside = refused(room(), "[plan]\nfixed = [[9, 2]]");
    assert!(matches!(outside, PlanError::FixedBlocked { at: [9.0, 2.0], .. }), "{outside}");
    let many = refused(room(), "[plan]\nfixed = [[1, 1], [2, 1]]\nmax_probes = 1");
    assert!(matches!(many, PlanError::TooManyFixed { fixed: 2, most: 1 }), "{many}");
    for error in [narrow, kept_out, outside, many] {
        let line = error.to_string();
        assert!(!line.contains('\n') && line.len() > 40, "{line}");
    }
}

/// Three rooms in a row with doors.
fn suite() -> Vec<Quad> {
    let mut quads = sides(v(0.0, 0.0, 0.0), v(15.0, 5.0, 3.0), [0; 6]);
    for x in [5.0, 10.0] {
        quads.extend(box_of([x, 0.0, 0.0], [x + 0.2, 1.0, 3.0]));
        quads.extend(box_of([x, 2.0, 0.0], [x + 0.2, 5.0, 3.0]));
    }
    quads
}

#[test]
fn limits_are_kept() {
    let corner = "keep_out = [[[0, 0], [4, 0], [4, 5], [0, 5]]]";
    let suite = built(suite(), &format!("[plan]\nfixed = [[12.0, 3.5]]\n{corner}\nrange = 6.0\nclearance = 0.5"));
    let plan = planned(&suite);
    let floor = &plan.floors[0];
    let at = |i: usize| floor.stations[i].position + suite.scene.origin;
    let fixed: Vec<usize> = (0..floor.stations.len()).filter(|i| floor.stations[*i].fixed).collect();
    assert!(fixed.len() == 1 && at(fixed[0]).truncate().distance(glam::dvec2(12.0, 3.5)) < 1e-6);
    assert!((0..floor.stations.len()).all(|i| at(i).x > 4.0));
    assert_stands(&suite.scene, floor, 0.5);
    let reach =
        floor.stations.iter().flat_map(|s| s.region.outline().into_iter().map(|p| p.distance(s.position.truncate())));
    assert!(reach.fold(0.0, f64::max) <= 6.0 + 1e-9);
    assert!(floor.curve.windows(2).all(|w| w[0] <= w[1] + 1e-12));
    // the order on foot visits each once
    let mut walk = floor.walk.clone();
    walk.sort_unstable();
    assert_eq!(walk, (0..floor.stations.len()).collect::<Vec<_>>());
}

#[test]
fn at_most_k_stations_see_most() {
    let (.., all) = SUITE.of(suite);
    let two = built(suite(), "[plan]\nmax_probes = 2");
    let two = planned(&two);
    assert!(all.floors[0].stations.len() >= 3 && two.floors[0].stations.len() == 2);
    assert!(two.floors[0].covered_fraction() < all.floors[0].covered_fraction());
    assert!(two.warnings.iter().any(|w| w.contains("max_probes")));
}

#[test]
fn a_second_visit_plans_only_what_is_missing() {
    let (_, scene, first) = SUITE.of(suite);
    let stations: Vec<DVec3> = first.floors[0].stations.iter().map(|s| s.position + scene.origin).collect();
    let taken = |n: usize| {
        let mut site = Plan::new(suite(), &[grey(0.5)]);
        stations.iter().take(n).for_each(|at| site.probes.push((*at, 8)));
        site.build()
    };
    let (again, done) = (taken(1), taken(stations.len()));
    let (again, done) = (planned(&again), planned(&done));
    let (again, done) = (&again.floors[0], &done.floors[0]);
    assert!(again.present.len() == 1 && !again.stations.is_empty() && again.stations.len() < stations.len());
    assert!(again.present_fraction > 0.2 && again.covered_fraction() > 0.97);
    assert!(done.stations.is_empty() && done.lower_bound == 0, "{} more", done.stations.len());
}

#[test]
fn the_same_for_any_number_of_threads() {
    let (site, scene, of_three) = HOUSE.of(house);
    let written = |plan: &SitePlan| {
        let out = Outward::of(site, scene);
        let mut text = serde_json::to_string(&tables::json(site, plan, &out)).unwrap();
        text += &tables::csv(plan, &out);
        let mut ply = Vec::new();
        clerestory::plan::export::ply::write(plan.surface.as_ref().unwrap(), &out, &mut ply).unwrap();
        (text, ply)
    };
    let of_one = on_threads(1, || plan(site, scene, &quick())).unwrap();
    assert!(written(&of_one) == written(of_three));
}

/// A coverage.ply has as many bytes as its header says.
#[test]
fn the_ply_is_whole() {
    let room = built(sides(v(0.0, 0.0, 0.0), v(5.0, 4.0, 3.0), [0; 6]), "");
    let plan = planned(&room);
    let mut ply = Vec::new();
    let out = Outward::of(&room.site, &room.scene);
    clerestory::plan::export::ply::write(plan.surface.as_ref().unwrap(), &out, &mut ply).unwrap();
    let header = ply.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let text = String::from_utf8(ply[..header].to_vec()).unwrap();
    let count = |what: &str| -> usize {
        let line = text.lines().find(|l| l.starts_with(what)).unwrap();
        line.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let (vertices, faces) = (count("element vertex"), count("element face"));
    // pieces share their corners
    assert!(3 * vertices < 2 * 3 * faces && faces <= plan.surface.as_ref().unwrap().surface.patches.len());
    assert_eq!(ply.len(), header + vertices * 15 + faces * (1 + 12 + 1 + 4 + 4));
    let surface = plan.surface.as_ref().unwrap();
    let area: f64 = surface.surface.areas.iter().sum();
    assert!((area - 94.0).abs() < 1e-3);
    // one lens in an empty room sees all of it but what it meets too obliquely
    assert!(plan.floors[0].surface.unwrap().covered_fraction > 0.9);
}

fn real(path: &Path) -> (Site, Scene) {
    let site = Site::load_with(path, Pictures::MayBeMissing).unwrap();
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    (site, scene)
}

/// A site file in a folder of its own for a model elsewhere.
fn site_for(model: &Path, up: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "[site]\nname = \"Real\"\nunits = \"m\"\nup = \"{up}\"\n[model]\npath = {:?}\n",
        model.canonicalize().unwrap()
    );
    fs::write(folder.path().join("site.toml"), text).unwrap();
    folder
}

fn figures(site: &Site, scene: &Scene, options: &Options) -> tables::PlanJson {
    let plan = plan(site, scene, options).unwrap();
    for floor in &plan.floors {
        assert_stands(scene, floor, 0.3);
    }
    let json = tables::json(site, &plan, &Outward::of(site, scene));
    for f in &json.floors {
        println!(
            "{} {}: {:.1} m², {} stations (at least {}), {:.3} in plan, {:?} in space",
            f.name,
            f.elevation,
            f.area_m2,
            f.stations.len(),
            f.lower_bound,
            f.covered_fraction,
            f.surface.as_ref().map(|s| s.covered_fraction)
        );
    }
    json
}

#[test]
fn sibenik_has_nave_choir_and_side_chapels() {
    let Some(path) = shared("truth/sibenik") else { return };
    let (site, scene) = real(&path);
    let json = figures(&site, &scene, &Options { fresh: true, patches: 0, ..Options::default() });
    let elevations: Vec<f64> = json.floors.iter().map(|f| f.elevation).collect();
    // measured on the model: nave −15.30 with aisles a step up, choir, chapels beside it
    assert!(elevations.len() == 3 && elevations[0] <= -15.1 && elevations[0] >= -15.35, "{elevations:?}");
    assert!((elevations[1] + 13.73).abs() < 0.05 && (elevations[2] + 11.65).abs() < 0.05, "{elevations:?}");
    // nave and aisles end at 6.9 m: what is hollow east of them, under the northern chapel and in the side apses, cannot
    // be walked to
    let ground = &json.floors[0];
    assert!(ground.stations.iter().all(|s| s.position[0] < 7.0) && ground.groups == 1, "{:?}", ground.stations);
    assert!(ground.left_out_m2 > 5.0 && ground.left_out_m2 < 40.0, "{}", ground.left_out_m2);
    assert!(json.warnings.iter().any(|w| w.contains("--all-parts")), "{:?}", json.warnings);
}

#[test]
fn a_real_church_has_one_floor_and_pews_are_none() {
    let Some(path) = shared("models/ctk_church/CTK_Church.obj") else { return };
    let folder = site_for(&path, "z");
    let (site, scene) = real(folder.path());
    let json = figures(&site, &scene, &quick());
    assert_eq!(json.floors.len(), 1);
    assert!(json.floors[0].elevation.abs() < 0.01 && json.floors[0].covered_fraction > 0.98);
}

/// The scan lies askew in its file; turned upright first.
#[test]
fn a_scanned_room_with_holes_has_its_floor() {
    let Some(path) = shared("models/copyroom/copyroom_c2000_opt.obj") else { return };
    let up = Vec3::new(-0.002, -0.801, -0.598).normalize();
    let turn = glam::Quat::from_rotation_arc(up, Vec3::Z);
    let text = fs::read_to_string(&path).unwrap();
    let turned = |line: &str| -> String {
        let Some(rest) = line.strip_prefix("v ") else {
            return if line.starts_with('f') || line.starts_with("vt") { line.to_owned() } else { String::new() };
        };
        let numbers: Vec<f32> = rest.split_whitespace().take(3).map(|n| n.parse().unwrap()).collect();
        let p = turn * Vec3::from_slice(&numbers);
        format!("v {} {} {}", p.x, p.y, p.z)
    };
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("room.obj");
    fs::write(&obj, text.lines().map(|l| turned(l) + "\n").collect::<String>()).unwrap();
    let site = site_for(&obj, "z");
    let (site, scene) = real(site.path());
    let json = figures(&site, &scene, &quick());
    assert_eq!(json.floors.len(), 1);
    assert!((json.floors[0].elevation + 1.32).abs() < 0.06, "{}", json.floors[0].elevation);
    assert!(json.floors[0].area_m2 < 9.0);
}

#[test]
fn the_verb_writes_its_files_and_prints_blocks_that_paste() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| clerestory(&[&"plan", &"sites/chapel", &"--out", &folder.path()], more);
    let text = run(&["--fresh"]).text();
    let blocks: toml::Table =
        text.lines().filter(|l| !l.starts_with('!')).map(|l| format!("{l}\n")).collect::<String>().parse().unwrap();
    let probes = blocks["probe"].as_array().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&fs::read(folder.path().join("plan.json")).unwrap()).unwrap();
    let floors = json["floors"].as_array().unwrap();
    let names: Vec<&str> = floors.iter().map(|f| f["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Ground floor", "First floor"]);
    let stations: Vec<&serde_json::Value> = floors.iter().flat_map(|f| f["stations"].as_array().unwrap()).collect();
    assert_eq!(stations.len(), probes.len());
    for (station, probe) in stations.iter().zip(probes) {
        assert_eq!(station["name"].as_str(), probe["name"].as_str());
        let at = |i: usize| (station["position"][i].as_f64(), probe["position"][i].as_float());
        assert!((0..3).all(|i| at(i).0 == at(i).1));
    }
    for key in ["elevation", "area_m2", "covered_fraction", "lower_bound", "curve", "unreachable_m2", "surface"] {
        assert!(floors[0].get(key).is_some(), "{key}");
    }
    for name in ["plan-ground", "coverage-ground", "plan-first", "coverage-first"] {
        let svg = fs::read_to_string(folder.path().join(format!("{name}.svg"))).unwrap();
        roxmltree::Document::parse(&svg).unwrap();
        let png = image::open(folder.path().join(format!("{name}.png"))).unwrap();
        let a4 = [(1240, 1754), (1754, 1240)];
        assert!(a4.contains(&(png.width(), png.height())), "{} × {}", png.width(), png.height());
    }
    let csv = fs::read_to_string(folder.path().join("plan.csv")).unwrap();
    assert_eq!(csv.lines().count(), stations.len() + 1);
    assert!(folder.path().join("coverage.ply").exists());
    // a tape ends on the line that the drawing has for its wall
    for (floor, slug) in floors.iter().zip(["ground", "first"]) {
        let dxf = fs::read_to_string(folder.path().join(format!("plan-{slug}.dxf"))).unwrap();
        let walls = polylines(&dxf, "WALLS");
        assert!(walls.len() > 5 && !polylines(&dxf, "SIGHT_LINES").is_empty());
        for tape in floor["stations"].as_array().unwrap().iter().flat_map(|s| s["tapes"].as_array().unwrap()) {
            let to = DVec2::new(tape["to"][0].as_f64().unwrap(), -tape["to"][2].as_f64().unwrap());
            let off = walls.iter().flat_map(|w| w.windows(2)).map(|w| from_segment(to, w[0], w[1])).fold(9.9, f64::min);
            // stations that stand higher or lower meet their wall elsewhere
            let level = (tape["to"][1].as_f64().unwrap() - floor["elevation"].as_f64().unwrap() - 1.6).abs() < 0.01;
            assert!(off < 0.005 || !level, "{slug}: {to} is {off} m off");
        }
    }
    // what is there already is counted
    let again = run(&["--json", "--no-surface", "--floor", "ground"]).json();
    assert_eq!(again["floors"].as_array().unwrap().len(), 1);
    assert_eq!(again["floors"][0]["existing"].as_array().unwrap().len(), 3);
    assert!(!folder.path().join("coverage.ply").exists(), "the earlier plan's");
    let line = run(&["--floor", "attic"]).error_line();
    assert!(line.contains("attic") && line.contains("ground, first"), "{line}");
}

/// The polylines on a layer of a DXF file; closed ones end where they begin.
fn polylines(dxf: &str, layer: &str) -> Vec<Vec<DVec2>> {
    let lines: Vec<&str> = dxf.lines().map(str::trim).collect();
    let pairs: Vec<(&str, &str)> = lines.chunks(2).map(|p| (p[0], p[1])).collect();
    let starts = (0..pairs.len()).filter(|i| pairs[*i] == ("0", "LWPOLYLINE"));
    let one = |start: usize| {
        let own: Vec<_> = pairs[start + 1..].iter().take_while(|p| p.0 != "0").collect();
        let all =
            |code: &str| own.iter().filter(|p| p.0 == code).map(|p| p.1.parse::<f64>().unwrap()).collect::<Vec<_>>();
        let mut points: Vec<DVec2> = all("10").into_iter().zip(all("20")).map(DVec2::from).collect();
        if all("70") == [1.0] {
            points.push(points[0]);
        }
        own.contains(&&("8", layer)).then_some(points)
    };
    starts.filter_map(one).collect()
}

fn from_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-30)).clamp(0.0, 1.0);
    p.distance(a.lerp(b, t))
}
