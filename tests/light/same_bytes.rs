//! The same input gives the same bytes on any number of threads.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

use crate::support::{Plan, closed, grey, options, v};
use clerestory::panorama::write_exr;
use glam::{DVec3, Vec3};
use std::fs;

/// From the site file to the EXR of every layer, with records of two probes, a sun, and a niche that no probe sees.
#[test]
fn one_two_and_three_threads_write_the_same_bytes() {
    let mut quads = closed(DVec3::ZERO, v(4.0, 3.0, 2.5), 0);
    quads.remove(1);
    quads.extend(closed(v(2.0, 0.5, 0.0), v(2.3, 2.5, 1.4), 0));
    let mut plan = Plan::new(quads, &[grey(0.6)])
        .probe(v(0.9, 1.4, 1.0), 64)
        .probe(v(1.1, 0.6, 0.7), 64)
        .view(v(3.7, 2.6, 1.7), v(2.0, 1.0, 0.4), 48)
        .view(v(0.4, 0.3, 1.2), v(3.5, 2.5, 1.0), 48);
    plan.more =
        "[environment]\nradiance = [1, 1, 1]\n[sun]\ndirection = [0.3, 0.2, 1]\nirradiance = [20, 19, 18]".to_owned();
    let built = plan.build().paint(&plan, |_, s| {
        s.map_or(Vec3::ONE, |s| Vec3::new(1.0, 0.9, 0.7) * (1.0 + s.position.x.sin() * s.position.y.cos().powi(2)))
    });
    let run = |threads: usize| -> Vec<Vec<u8>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let write = |(i, frame): (usize, &clerestory::render::Frame)| {
                let path = built.folder.path().join(format!("{threads}-{i}.exr"));
                let (width, height) = (frame.radiance.width, frame.radiance.height);
                write_exr(&path, width, height, &frame.layers(true), None).unwrap();
                fs::read(path).unwrap()
            };
            let frames = built.frames(&options(24));
            assert!(frames.iter().any(|f| f.covered_fraction < 0.9), "some of it must need the volume");
            frames.iter().enumerate().map(write).collect()
        })
    };
    let one = run(1);
    assert!(one == run(2), "two threads");
    assert!(one == run(3), "three threads");
    assert!(one[0] != one[1]);
}
