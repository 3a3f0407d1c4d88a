//! The path tracer against an outside one: `truth/room`, two pictures, each with two independent halves.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::data::shared;
use crate::support::load;
use clerestory::panorama;
use clerestory::reference::{Eye, Lights, ReferenceSettings, trace};
use glam::DVec3;

const BLOCK: usize = 16;

/// Blocks of 16 × 16 pixels, three channels each: is any farther off than chance allows? And the means?
#[test]
fn pictures_of_the_room_agree_with_an_outside_path_tracer() {
    let Some(folder) = shared("truth/room") else { return };
    let (site, scene) = load(&folder);
    let lights = Lights::load(&site, &scene).unwrap();
    // the outside renderer cut paths at 64 bounces
    let settings = ReferenceSettings { samples: 64, max_bounces: 64, ..ReferenceSettings::default() };
    let mut p_values = Vec::new();
    for view in &site.views {
        let ours = trace(&scene, &lights, &Eye::Camera(view.camera), &settings);
        let ours = [ours.half(0), ours.half(1)];
        let truth = ["a", "b"]
            .map(|half| panorama::read(&folder.join(format!("truth_halves/{}_{half}.exr", view.name))).unwrap());
        let mut totals = [DVec3::ZERO; 2];
        for y0 in (0..ours[0].height).step_by(BLOCK) {
            for x0 in (0..ours[0].width).step_by(BLOCK) {
                let mut sums = [DVec3::ZERO; 2];
                let (mut variance, mut fourth) = (DVec3::ZERO, DVec3::ZERO);
                for i in (y0..y0 + BLOCK).flat_map(|y| (x0..x0 + BLOCK).map(move |x| y * 256 + x)) {
                    for (sum, halves) in sums.iter_mut().zip([&ours, &truth]) {
                        let [a, b] = [&halves[0], &halves[1]].map(|half| half.pixels[i].as_dvec3());
                        *sum += 0.5 * (a + b);
                        let v = (0.5 * (a - b)).powf(2.0);
                        variance += v;
                        fourth += v * v;
                    }
                }
                totals[0] += sums[0];
                totals[1] += sums[1];
                // seen sky has no noise, only the rounding of f32
                let rounding = 2e-6 * sums[1];
                for c in 0..3 {
                    let variance = variance[c] + rounding[c].powi(2);
                    let t = (sums[0][c] - sums[1][c]) / variance.sqrt();
                    p_values.push(two_sided_p(t, variance * variance / fourth[c].max(variance * variance / 512.0)));
                }
            }
        }
        let ratio = totals[0] / totals[1];
        println!("view {}: mean over the truth's mean {ratio:.5}", view.name);
        assert!((ratio - 1.0).abs().max_element() < 0.005, "view {}: {ratio}", view.name);
    }
    // Šidák: the least of n independent p-values
    let n = p_values.len() as f64;
    let least = p_values.iter().copied().fold(1.0, f64::min);
    let p = 1.0 - (1.0 - least).powf(n);
    let low = p_values.iter().filter(|&&p| p < 0.05).count();
    println!(
        "{n} blocks and channels: least p {least:.2e}, after Šidák {p:.3}; {:.1} % below 0.05",
        100.0 * low as f64 / n
    );
    assert!(p > 0.01, "least p {least:e} of {n}: {p}");
}

/// Probability of a t farther from 0 with this many degrees of freedom (Welch and Satterthwaite: where a block's noise
/// is that of a few pixels on an edge, its estimate is poor). Wallace's normal equivalent, 1959; then erfc(|z|/√2) by
/// Numerical Recipes' fit, to 1.2·10⁻⁷ relative.
fn two_sided_p(t: f64, freedom: f64) -> f64 {
    let z = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * (freedom * (1.0 + t * t / freedom).ln()).sqrt();
    let x = z / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.5 * x);
    let coefficients = [
        -1.265_512_23,
        1.000_023_68,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_203_98,
        1.488_515_87,
        -0.822_152_23,
        0.170_872_77,
    ];
    let polynomial = coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    t * (-x * x + polynomial).exp()
}
