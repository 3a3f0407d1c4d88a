//! No NaN leaves a public function, whatever numbers go in.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{Built, Plan, options, room_with_panel, v, write_picture};
use clerestory::audit::{self, Photo, audit};
use clerestory::panorama::{EnvironmentSampler, Exposure, Panorama, Picture, Projection};
use clerestory::plan::cover::coverage::Coverage;
use clerestory::plan::free_space::open_space::OpenSpace;
use clerestory::plan::free_space::polygon::Polygon;
use clerestory::plan::gallery;
use clerestory::reference::{Lights, ReferenceSettings, Sky, irradiance};
use clerestory::report::style::Style;
use clerestory::report::{Svg, Text};
use clerestory::site::Site;
use clerestory::study::{self, Block, Curve, Metric, Resamples, order, pareto, rounded};
use glam::{DMat3, DVec2, Vec3};
use proptest::collection::vec;
use proptest::prelude::*;

/// What a float can hold, the odd ones as often as all others.
fn float() -> impl Strategy<Value = f32> {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, 0.0, -0.0];
    prop_oneof![prop::sample::select(odd.to_vec()), -1e3f32..1e3, any::<f32>()]
}

fn double() -> impl Strategy<Value = f64> {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, 0.0, -0.0];
    prop_oneof![prop::sample::select(odd.to_vec()), -1e3f64..1e3, any::<f64>()]
}

fn pixel() -> impl Strategy<Value = Vec3> {
    (float(), float(), float()).prop_map(Vec3::from)
}

fn picture(width: usize, height: usize) -> impl Strategy<Value = Picture> {
    vec(pixel(), width * height).prop_map(move |pixels| Picture { width, height, pixels })
}

fn told(numbers: impl IntoIterator<Item = f64>) {
    numbers.into_iter().enumerate().for_each(|(i, n)| assert!(!n.is_nan(), "number {i} is NaN"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn metrics_and_exposures(x in picture(13, 12), t in picture(13, 12)) {
        for (x, t) in [(&x, &t), (&t, &x), (&x, &x), (&Picture::new(0, 0), &t), (&x, &Picture::new(3, 1))] {
            let (a, b) = (&x.pixels, &t.pixels);
            let odd = |i: usize| i % 2 == 1;
            told([study::rmse(a, b), study::relmse(a, b), study::relmse_where(a, b, odd), study::flip(x, t)]);
            told([study::ssim(x, t), study::median_relative_error(a, b, odd), f64::from(Exposure::of(t).0)]);
            if (x.width, x.height) == (t.width, t.height) {
                told([study::mean_where(&study::flip_map(x, t), odd)]);
            }
            let exposure = Exposure::of(x);
            for p in b.iter().flat_map(|p| [exposure.show(*p), exposure.clip(*p)]) {
                assert!(p.min_element() >= 0.0 && p.max_element() <= 1.0, "{p}");
            }
        }
    }

    #[test]
    fn figures_of_a_study(points in vec((double(), double()), 0..6), at in double(), sums in vec(any::<[f32; 7]>(), 1..5)) {
        let curve = Curve::new(points.clone());
        told(curve.time_at(at).into_iter().chain(curve.error_at(at)).map(|f| f.0));
        told(order(&points));
        assert_eq!(pareto(&points).len(), points.len());
        assert!(!rounded(at).contains("NaN") && !rounded(at).contains("inf"));
        let blocks: Vec<Block> = sums.into_iter().map(Block::from).collect();
        let draws = Resamples::new(&[blocks.len()], 20);
        for metric in Metric::ALL {
            let i = draws.interval(|weights| metric.over(&blocks, weights));
            told([i.value, i.low, i.high]);
        }
    }

    #[test]
    fn plans(rings in vec(vec((double(), double()), 0..7), 1..3), at in (double(), double()), weights in vec(double(), 0..5)) {
        let mut rings = rings.into_iter().map(|r| r.into_iter().map(DVec2::from).collect::<Vec<_>>());
        let outer = rings.next().unwrap();
        let at = DVec2::from(at);
        let room = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)].map(DVec2::from).to_vec();
        for polygon in [Polygon { outer, holes: rings.collect() }, Polygon { outer: room, holes: vec![] }] {
            let Ok(open) = OpenSpace::new(&[polygon]) else { continue };
            told([open.area(), gallery::covered_fraction(&open, &[at, DVec2::ONE])]);
            told(open.visibility(at).map(|i| i.area()));
            told(open.pulled_in(at).into_iter().flat_map(|p| p.to_array()));
            assert!(!open.contains(at) || at.is_finite());
        }
        let all: Vec<u32> = (0..weights.len() as u32).collect();
        told([Coverage::new(weights, [all.clone(), all]).coverable()]);
    }

    #[test]
    fn drawings(points in vec((double(), double()), 1..5), size in double()) {
        let points: Vec<[f64; 2]> = points.into_iter().map(<[f64; 2]>::from).collect();
        let mut svg = Svg::new(100.0, size, "t", "d");
        svg.polyline(&points, &Style::line("#000000", size).dashed(size, size));
        svg.area(&[&points], &Style::fill("#000000"));
        svg.circle(points[0], size, &Style::fill("#000000"));
        svg.text(points[0], "x", &Text::new(size).turn(size).halo(size));
        svg.clipped([size; 4], |svg| svg.rectangle([size; 4], &Style::line("#000000", 1.0)));
        let text = svg.finish();
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}

fn room() -> (Plan, Built) {
    let plan = room_with_panel(0.5);
    let built = plan.build();
    (plan, built)
}

/// Pictures of one number, and of all of them by turns.
fn hostile(width: usize, height: usize) -> Vec<Picture> {
    let odd = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-45, 1e30, f32::MAX, 1.0];
    let of = |f: &dyn Fn(usize) -> Vec3| {
        let mut p = Picture::new(width, height);
        p.pixels.iter_mut().enumerate().for_each(|(i, p)| *p = f(i));
        p
    };
    let mut all: Vec<Picture> = odd.iter().map(|x| of(&|_| Vec3::splat(*x))).collect();
    all.push(of(&|i| Vec3::new(odd[i % 8], odd[i / 3 % 8], odd[i / 7 % 8])));
    all
}

#[test]
fn relit_pictures_and_volumes() {
    let (_, built) = room();
    for picture in hostile(32, 16) {
        built.put(0, &picture);
        for frame in built.frames(&options(8)) {
            let light = frame.radiance.pixels.iter().chain(&frame.albedo.pixels);
            assert!(light.clone().all(|p| !p.is_nan() && p.min_element() >= 0.0), "{:?}", picture.pixels[1]);
            told(frame.agreement.iter().chain(&frame.depth).map(|x| f64::from(*x)));
            told([frame.covered_fraction]);
        }
    }
}

#[test]
fn the_path_tracer_under_any_sky() {
    let (_, built) = room();
    for picture in hostile(32, 16) {
        let sky = Panorama::new(picture, Projection::LatLong, DMat3::IDENTITY);
        let sky = Sky::Image(Box::new(EnvironmentSampler::new(sky)));
        let lights = Lights::new(&built.scene, Some(sky), None);
        // on the roof, under the open sky
        let at = built.local(v(1.0, 1.0, 2.5));
        let settings = ReferenceSettings { samples: 64, ..ReferenceSettings::default() };
        let (e, noise) = irradiance(&built.scene, &lights, at, Vec3::Z, &settings);
        assert!(!e.is_nan() && !noise.is_nan(), "{e} ± {noise}");
    }
}

#[test]
fn sites_with_numbers_that_are_none_are_refused() {
    let (plan, built) = room();
    let file = built.folder.path().join("site.toml");
    let sane = std::fs::read_to_string(&file).unwrap();
    built.put(0, &Picture::new(32, 16));
    assert!(Site::load(&file).is_ok());
    for bad in ["nan", "inf", "-inf"] {
        for (before, number) in
            [("position = [", "1.7"), ("look_at = [", "1.5"), ("fov_y = ", "80"), ("units = ", "1.0")]
        {
            let broken = sane.replacen(&format!("{before}{number}"), &format!("{before}{bad}"), 1);
            assert_ne!(broken, sane, "{before}");
            std::fs::write(&file, &broken).unwrap();
            assert!(Site::load(&file).is_err(), "{before}{bad}");
        }
        for more in [
            format!("[environment]\nradiance = [{bad}, 1, 1]"),
            format!("[sun]\ndirection = [0, {bad}, 1]\nirradiance = [1, 1, 1]"),
            format!("[sun]\ndirection = [0, 0, 1]\nirradiance = [1, 1, {bad}]"),
            format!("[plan]\nprobe_height = {bad}"),
        ] {
            let sick = Plan { more, ..plan.clone() };
            std::fs::write(&file, sick.toml()).unwrap();
            assert!(Site::load(&file).is_err(), "{}", sick.more);
        }
    }
}

#[test]
fn an_audit_of_any_photograph() {
    let (_, built) = room();
    built.put(0, &built.look(0, 32, |s| Vec3::splat(s.map_or(1.0, |s| 1.0 + s.position.z.abs()))));
    let mut site = Site::load(built.folder.path()).unwrap();
    let photo = built.folder.path().join("photo.exr");
    site.views[0].photo = Some(photo.clone());
    let settings = audit::Settings { cells: 8, check_probes: false, ..audit::Settings::default() };
    for picture in hostile(24, 24) {
        assert_eq!(Photo::new(picture.clone()).unusable.len(), 24 * 24);
        write_picture(&photo, &picture);
        let Ok(found) = audit(&site, &built.scene, "", &[], &settings, &|_, _, _| {}) else { continue };
        for view in &found.views {
            let s = &view.summary;
            told([s.exposure_ev, s.vignetting_ev, s.noise, s.pose.mean_px, s.pose.max_px, s.pose.residual_px]);
            told(s.white_balance.into_iter().chain(s.reasons.values().copied()));
            told([s.shares.ok, s.shares.texture, s.shares.geometry, s.shares.ambiguous, s.shares.untestable]);
        }
    }
}
