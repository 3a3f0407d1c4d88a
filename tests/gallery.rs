//! The art gallery: visibility against an exact oracle, hostile polygons, guards and bounds, and the verb itself.

#![allow(clippy::print_stdout)] // says what was skipped

#[path = "gallery/oracle.rs"]
mod oracle;

use clerestory::plan::open_space::OpenSpace;
use clerestory::plan::polygon::Polygon;
use glam::{DVec2, dvec2};
use oracle::visible_area;
use proptest::prelude::*;
use std::path::{Path, PathBuf};

/// A star-shaped ring: angles in order, radii as drawn.
fn star(centre: DVec2, radii: &[f64]) -> Vec<DVec2> {
    let turn = std::f64::consts::TAU / radii.len() as f64;
    radii.iter().enumerate().map(|(i, r)| centre + DVec2::from_angle(turn * i as f64) * *r).collect()
}

/// Right-angled corridors with two square holes: many collinear corners.
fn halls() -> Polygon {
    let ring = |points: &[(f64, f64)]| points.iter().map(|&(x, y)| dvec2(x, y)).collect::<Vec<_>>();
    Polygon {
        outer: ring(&[
            (0.0, 0.0),
            (10.0, 0.0),
            (10.0, 4.0),
            (12.0, 4.0),
            (12.0, 0.0),
            (16.0, 0.0),
            (16.0, 8.0),
            (12.0, 8.0),
            (12.0, 6.0),
            (10.0, 6.0),
            (10.0, 8.0),
            (6.0, 8.0),
            (6.0, 12.0),
            (4.0, 12.0),
            (4.0, 8.0),
            (0.0, 8.0),
        ]),
        holes: vec![
            ring(&[(2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0)]),
            ring(&[(6.0, 4.0), (8.0, 4.0), (8.0, 6.0), (6.0, 6.0)]),
        ],
    }
}

fn data(sub: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(sub);
    if !folder.is_dir() {
        println!("skipped: {} is absent", folder.display());
    }
    folder.is_dir().then_some(folder)
}

fn close(open: &OpenSpace, polygon: &Polygon, q: DVec2) -> Result<(), TestCaseError> {
    let seen = open.visibility(q).map_or(0.0, |v| v.area());
    let exact = visible_area(polygon, q);
    prop_assert!((seen - exact).abs() <= 1e-12 * exact, "{q}: {seen} against {exact}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn what_is_seen_has_the_area_the_exact_oracle_gives(
        outer in prop::collection::vec(2.0..10.0, 5..16),
        hole in prop::collection::vec(0.2..1.0, 3..7),
        places in prop::collection::vec((-8.0..8.0, -8.0..8.0), 8),
    ) {
        let polygon = Polygon { outer: star(DVec2::ZERO, &outer), holes: vec![star(dvec2(0.3, 0.2), &hole)] };
        let open = OpenSpace::new(std::slice::from_ref(&polygon)).unwrap();
        prop_assume!(!open.altered());
        let inside = places.into_iter().map(DVec2::from).filter(|&q| open.contains(q));
        for q in inside.chain(polygon.rings().flatten().copied()) {
            close(&open, &polygon, q)?;
        }
    }

    #[test]
    fn right_angles_are_seen_exactly(x in 0..64, y in 0..48) {
        let (polygon, q) = (halls(), dvec2(f64::from(x), f64::from(y)) / 4.0);
        let open = OpenSpace::new(std::slice::from_ref(&polygon)).unwrap();
        prop_assert!(!open.altered());
        if open.contains(q) {
            close(&open, &polygon, q)?;
        } else {
            prop_assert!(open.visibility(q).is_none());
        }
    }

    #[test]
    fn seeing_is_mutual(
        outer in prop::collection::vec(1.0..10.0, 5..30),
        places in prop::collection::vec((-8.0..8.0, -8.0..8.0), 8),
    ) {
        let polygon = Polygon { outer: star(DVec2::ZERO, &outer), holes: vec![] };
        let open = OpenSpace::new(std::slice::from_ref(&polygon)).unwrap();
        let polygon_corners = polygon.outer.clone();
        let all: Vec<_> = places.into_iter().map(DVec2::from).chain(polygon.outer).collect();
        for &a in &all {
            let seen = open.visibility(a).map(|v| OpenSpace::new(&[Polygon { outer: v.ring, holes: vec![] }]));
            for &b in &all {
                prop_assert_eq!(open.sees(a, b), open.sees(b, a), "{} {}", a, b);
                // what lies well within the ring is seen, what lies well out of it is not (corners: the ring has tips there)
                if let (Some(Ok(ring)), false) = (&seen, polygon_corners.contains(&b)) {
                    let near = (0..16).map(|k| b + DVec2::from_angle(f64::from(k) * 0.4) * 1e-6);
                    let sides: Vec<_> = near.map(|p| ring.contains(p)).collect();
                    if sides.iter().all(|&s| s == sides[0]) {
                        prop_assert_eq!(open.sees(a, b), sides[0], "{} {}", a, b);
                    }
                }
            }
        }
    }
}

#[test]
fn halls_are_mutually_seen_on_a_grid_with_all_its_collinear_corners() {
    let polygon = halls();
    let open = OpenSpace::new(&[polygon]).unwrap();
    let grid: Vec<_> = (0..=16).flat_map(|x| (0..=12).map(move |y| dvec2(f64::from(x), f64::from(y)))).collect();
    for &a in &grid {
        for &b in &grid {
            assert_eq!(open.sees(a, b), open.sees(b, a), "{a} {b}");
        }
    }
    // along walls, past corners on either side, and through the slit between corners
    assert!(open.sees(dvec2(0.0, 4.0), dvec2(16.0, 4.0)));
    assert!(open.sees(dvec2(0.0, 6.0), dvec2(16.0, 6.0)));
    assert!(open.sees(dvec2(4.0, 0.0), dvec2(4.0, 12.0)));
    assert!(!open.sees(dvec2(0.0, 3.0), dvec2(5.0, 3.0)));
    assert!(!open.sees(dvec2(11.0, 3.9), dvec2(11.0, 5.0)));
}

#[test]
fn cursed_polygons_are_noded_or_refused_and_never_panic() {
    let Some(folder) = data("cursed/polygons") else { return };
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    for file in files {
        let rings: Vec<Vec<[f64; 2]>> = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        let mut rings = rings.into_iter().map(|r| r.into_iter().map(DVec2::from).collect::<Vec<_>>());
        let polygon = Polygon { outer: rings.next().unwrap_or_default(), holes: rings.collect() };
        match OpenSpace::new(&[polygon]) {
            Err(e) => println!("{}: {e}", file.display()),
            Ok(open) => {
                let step = open.corners().len() / 40 + 1;
                let pairs = open.corners().iter().zip(open.corners().iter().skip(1)).step_by(step);
                for (&a, &b) in pairs {
                    for q in [a, (a + b) / 2.0, a + (b - a) * 0.3 + dvec2(1e-9, 0.0)] {
                        if let Some(seen) = open.visibility(q) {
                            let area = seen.area();
                            assert!(
                                area >= -1e-9 * open.area() && area <= open.area() * (1.0 + 1e-9),
                                "{file:?} {q} {area}"
                            );
                        }
                        assert_eq!(open.sees(q, a), open.sees(a, q), "{file:?}");
                        assert_eq!(open.sees(q, b), open.sees(b, q), "{file:?}");
                    }
                }
            }
        }
    }
}
