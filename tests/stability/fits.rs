//! Rows about plans and fits: polygons that touch and degenerate, poses from points that nearly do.

use clerestory::plan::open_space::OpenSpace;
use clerestory::plan::polygon::Polygon;
use clerestory::site::{Camera, Match, Pose, Resection};
use glam::{DVec2, dvec2, dvec3};

use super::Row;

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = polygons();
    rows.push(nearly_coplanar());
    rows
}

/// A square of 10 × 10 with a square hole of 2 × 2, seen from beside the hole: 100 − 4 open, and of these 76 in sight,
/// since the hole's shadow is a trapezoid 2 and 6 wide and 6 deep.
fn polygons() -> Vec<Row> {
    let square = |x0: f64, y0: f64, side: f64| {
        vec![dvec2(x0, y0), dvec2(x0 + side, y0), dvec2(x0 + side, y0 + side), dvec2(x0, y0 + side)]
    };
    let from = dvec2(1.0, 5.0);
    let seen = |p: &Polygon| {
        let space = OpenSpace::new(std::slice::from_ref(p)).unwrap();
        (space.area(), space.visibility(from).map_or(0.0, |i| i.area()))
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
    let mut moved = plain.clone();
    moved.outer.iter_mut().for_each(|p| *p *= 1.0 + f64::EPSILON);
    moved.holes[0].iter_mut().for_each(|p| *p *= 1.0 - f64::EPSILON / 2.0);
    let amplification = (seen(&moved).1 / seen(&plain).1 - 1.0).abs() / f64::EPSILON;
    let shifted = |d: f64| Polygon {
        outer: plain.outer.iter().map(|p| *p + d).collect(),
        holes: plain.holes.iter().map(|h| h.iter().map(|p| *p + d).collect()).collect(),
    };
    let far = OpenSpace::new(&[shifted(5e6)]).unwrap();
    let far = (far.area(), far.visibility(from + 5e6).map_or(0.0, |i| i.area()));
    vec![
        Row::new(
            "polygon with repeated and collinear points",
            "open area and area in sight",
            "96 and 76",
            off(seen(&collinear), 0.0),
            1e-12,
        )
        .amplified(amplification),
        Row::new(
            "holes that touch a wall and each other",
            "open area and area in sight",
            "95 and 76",
            off(seen(&touching), 1.0),
            1e-5,
        ),
        Row::new(
            "a sliver of a hole, 1 nm wide",
            "open area and area in sight",
            "96 and 76",
            off(seen(&sliver), 0.0),
            1e-5,
        ),
        Row::new("a plan at coordinates of 5·10⁶ m", "open area and area in sight", "96 and 76", off(far, 0.0), 1e-8),
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
    Row::new(
        "pose from ten points within 1 mm of a plane",
        "the camera's place, over its distance",
        expected,
        error,
        1e-6,
    )
    .amplified(moved / ulp)
}
