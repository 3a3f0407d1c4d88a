//! Rows about plans and fits: polygons that touch and degenerate, poses from points that nearly do.

use clerestory::audit::{self, audit};
use clerestory::panorama::Picture;
use clerestory::plan::free_space::open_space::OpenSpace;
use clerestory::plan::free_space::polygon::Polygon;
use clerestory::site::{Camera, Match, Pose, Resection, Site};
use glam::{DVec2, DVec3, Vec3, dvec2, dvec3};

use super::Row;
use super::support::{HIGH, Plan, closed, grey, options, v, write_picture};
use super::ulp::nudge;

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = polygons();
    rows.push(nearly_coplanar());
    rows.push(collinear_exposure());
    rows
}

/// A square of 10 × 10 with a square hole of 2 × 2, seen from beside the hole: 100 − 4 open, and of these 76 in sight,
/// since the hole's shadow is a trapezoid 2 and 6 wide and 6 deep.
fn polygons() -> Vec<Row> {
    let square = |x0: f64, y0: f64, side: f64| {
        vec![dvec2(x0, y0), dvec2(x0 + side, y0), dvec2(x0 + side, y0 + side), dvec2(x0, y0 + side)]
    };
    // the origin lies so far from that of coordinates
    let seen = |p: &Polygon, origin: f64| {
        let space = OpenSpace::new(std::slice::from_ref(p)).unwrap();
        (space.area(), space.visibility(dvec2(1.0, 5.0) + origin).map_or(0.0, |i| i.area()))
    };
    let off =
        |(area, sight): (f64, f64), taken: f64| ((area / (96.0 - taken) - 1.0).abs()).max((sight / 76.0 - 1.0).abs());
    // every point twice, and points in the middle of edges
    let fussy = |ring: &[DVec2]| -> Vec<DVec2> {
        let next = |i: usize| ring[(i + 1) % ring.len()];
        (0..ring.len()).flat_map(|i| [ring[i], ring[i], 0.5 * (ring[i] + next(i))]).collect()
    };
    let plain = Polygon { outer: square(0.0, 0.0, 10.0), holes: vec![square(4.0, 4.0, 2.0)] };
    let collinear = Polygon { outer: fussy(&plain.outer), holes: vec![fussy(&plain.holes[0])] };
    // behind the hole, out of sight: one hole touches the wall in a point, another touches that one along an edge
    let mut touching = plain.clone();
    touching.holes.push(vec![dvec2(10.0, 5.0), dvec2(9.0, 5.5), dvec2(9.0, 4.5)]);
    touching.holes.push(vec![dvec2(9.0, 4.5), dvec2(9.0, 5.5), dvec2(8.0, 5.0)]);
    let mut sliver = plain.clone();
    sliver.holes.push(vec![dvec2(7.0, 4.9), dvec2(9.0, 5.0), dvec2(7.0, 4.9 + 1e-9)]);
    // all corners up or down by one unit in the last place of double precision
    let amplified = |p: &Polygon, origin: f64| {
        let move_ring = |ring: &[DVec2]| -> Vec<DVec2> {
            let factor = |i: usize| if i.is_multiple_of(3) { 1.0 + f64::EPSILON } else { 1.0 - f64::EPSILON };
            ring.iter().enumerate().map(|(i, p)| *p * factor(i)).collect()
        };
        let moved = Polygon { outer: move_ring(&p.outer), holes: p.holes.iter().map(|h| move_ring(h)).collect() };
        let ((area, sight), (area_moved, sight_moved)) = (seen(p, origin), seen(&moved, origin));
        ((area_moved / area - 1.0).abs()).max((sight_moved / sight - 1.0).abs()) / f64::EPSILON
    };
    let far = Polygon {
        outer: plain.outer.iter().map(|p| *p + 5e6).collect(),
        holes: plain.holes.iter().map(|h| h.iter().map(|p| *p + 5e6).collect()).collect(),
    };
    let row = |case, polygon: &Polygon, expected, taken: f64, origin: f64, bound: f64, most: f64| {
        let error = off(seen(polygon, origin), taken);
        let row = Row::new(case, "open area and area in sight", expected).off(error, bound);
        row.amplified_within(amplified(polygon, origin), most)
    };
    vec![
        row("polygon with repeated and collinear points", &collinear, "96 and 76", 0.0, 0.0, 1e-12, 1e4),
        row("holes that touch a wall and each other", &touching, "95 and 76", 1.0, 0.0, 1e-5, 1e4),
        row("a sliver of a hole, 1 nm wide", &sliver, "96 and 76", 0.0, 0.0, 1e-5, 1e4),
        // its coordinates are 5·10⁵ times its size
        row("a plan at coordinates of 5·10⁶ m", &far, "96 and 76", 0.0, 5e6, 1e-8, 5e6),
    ]
}

/// A camera 5 m before a wall, from ten points on it that stand out by 1 mm at most: the place it was taken from, or a
/// refusal, but never another place.
fn nearly_coplanar() -> Row {
    let camera = Camera::with_fov(Pose::look_at([1.0, -5.0, 1.6].into(), [1.5, 0.0, 1.8].into()), 1600, 1200, 55.0);
    let matches = |moved: f64| -> Vec<Match> {
        let one = |i: i32| {
            let (a, b) = (f64::from(i * 7 % 10) / 9.0, f64::from(i * 3 % 10) / 9.0);
            let point = dvec3(-0.5 + 4.0 * a, 1e-3 * f64::from(i % 3 - 1), 0.4 + 2.4 * b);
            let up = if i % 2 == 0 { moved } else { -moved };
            Match { pixel: camera.project(point).unwrap() * (1.0 + up), point }
        };
        (0..10).map(one).collect()
    };
    let place = |moved: f64| Resection::of(&camera, &matches(moved), false).map(|r| r.camera.pose.position);
    let error = place(0.0).map_or(0.0, |p| (p - camera.pose.position).length() / 5.0);
    let ulp = f64::from(f32::EPSILON);
    let moved = place(0.0).ok().zip(place(ulp).ok()).map_or(0.0, |(a, b)| (a - b).length() / 5.0);
    let expected = "the true place, or a typed refusal";
    Row::new("pose from ten points within 1 mm of a plane", "the camera's place, over its distance", expected)
        .off(error, 1e-6)
        .amplified(moved / ulp)
}

/// A photograph of which only a thin ring about its middle can be used: there, exposure and vignetting, which grows with
/// the squared radius, are one column of the fit. Each of them alone is anybody's guess; what both together say of the
/// ring is not.
fn collinear_exposure() -> Row {
    const SIDE: u32 = 128;
    const GAIN: [f32; 3] = [2.0, 1.25, 0.8];
    let plan = Plan::new(closed(DVec3::ZERO, HIGH, 0), &[grey(0.6)]).probe(v(1.7, 1.4, 1.3), 128).view(
        v(0.3, 0.4, 1.6),
        v(3.5, 2.5, 0.8),
        SIDE,
    );
    let built = plan.build().paint(&plan, |scene, s| {
        let low = scene.mesh.bounds().0;
        s.map_or(Vec3::ZERO, |s| Vec3::splat(1.0 + 0.3 * (s.position - low).element_sum()))
    });
    let truth = &built.frames(&options(16))[0].radiance;
    let from_middle = |i: usize| {
        let at = |k: usize| (k as f64 + 0.5 - 0.5 * f64::from(SIDE)) / (0.5 * f64::from(SIDE));
        (at(i % SIDE as usize).powi(2) + at(i / SIDE as usize).powi(2)) / 2.0
    };
    let ring = |i: usize| (0.2..0.32).contains(&from_middle(i));
    let mask =
        image::GrayImage::from_fn(SIDE, SIDE, |x, y| image::Luma([255 * u8::from(ring((y * SIDE + x) as usize))]));
    let folder = built.folder.path();
    mask.save(folder.join("mask.png")).unwrap();
    let mut site = Site::load(folder).unwrap();
    site.views[0].photo = Some(folder.join("photo.exr"));
    site.views[0].mask = Some(folder.join("mask.png"));
    let settings = audit::Settings { refine_pose: false, cells: 16, ..audit::Settings::default() };
    // what the fit says of the ring's middle, per channel, over what was done to the photograph
    let fitted = |factor: &dyn Fn(usize) -> f32| -> Vec<f64> {
        let mut photo =
            Picture { pixels: truth.pixels.iter().map(|p| *p / Vec3::from(GAIN)).collect(), ..truth.clone() };
        photo.pixels.iter_mut().enumerate().for_each(|(i, p)| *p *= factor(i));
        write_picture(&folder.join("photo.exr"), &photo);
        let found = audit(&site, &built.scene, "", &[], &settings, &|_, _, _| {}).unwrap();
        let view = &found.views[0].summary;
        let stops = view.exposure_ev + 0.26 * view.vignetting_ev;
        (0..3).map(|c| stops.exp2() * view.white_balance[c] / f64::from(GAIN[c])).collect()
    };
    let (values, moved) = (fitted(&|_| 1.0), fitted(&nudge));
    let error = values.iter().map(|g| (g - 1.0).abs()).fold(0.0, f64::max);
    let change = values.iter().zip(&moved).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max);
    Row::new(
        "exposure from collinear data: usable on a thin ring only",
        "gain on the ring from exposure, white balance and vignetting",
        "what the photograph was divided by",
    )
    .off(error, 0.02)
    .amplified(change / f64::from(f32::EPSILON))
}
