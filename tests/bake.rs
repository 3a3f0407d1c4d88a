//! Light as a linear operator, baking and the viewer, from the site file to the files that other programs open.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic like tests")]

mod support;

use clerestory::panorama::{Picture, Radiometry};
use clerestory::render::{Irradiance, Relit, pictures, prepare_for};
use clerestory::scene::Scene;
use clerestory::shoot::Light;
use clerestory::site::Site;
use clerestory::transfer::{LOT, Point, Transfer};
use clerestory::volume::{Nearby, Volume};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use support::{Built, Plan, closed, grey, options, v};

/// A room open to the south with a sun, a block that hides part of it from both probes, and stripes of light.
fn room() -> (Plan, Built) {
    let mut quads = closed(DVec3::ZERO, v(4.0, 3.0, 2.5), 0);
    quads.remove(1);
    quads.extend(closed(v(2.0, 0.5, 0.0), v(2.3, 2.5, 1.4), 0));
    let mut plan = Plan::new(quads, &[grey(0.6)]).probe(v(0.9, 1.4, 1.0), 64).probe(v(1.1, 0.6, 0.7), 64).view(
        v(3.7, 2.6, 1.7),
        v(2.0, 1.0, 0.4),
        48,
    );
    plan.more =
        "[environment]\nradiance = [1, 1, 1]\n[sun]\ndirection = [0.3, 0.2, 1]\nirradiance = [20, 19, 18]".to_owned();
    let built = plan.build().paint(&plan, |_, s| {
        s.map_or(Vec3::ONE, |s| Vec3::new(1.0, 0.9, 0.7) * (1.0 + s.position.x.sin() * s.position.y.cos().powi(2)))
    });
    (plan, built)
}

/// Points all over the room's surfaces, on the sides that it shows.
fn points(built: &Built) -> Vec<Point> {
    let scene = &built.scene;
    let inside = |p: Vec3, low: DVec3, high: DVec3| p.cmpgt(built.local(low)).all() && p.cmplt(built.local(high)).all();
    let shown = |&(p, n): &Point| {
        let above = p + n * 0.01;
        inside(above, DVec3::ZERO, v(4.0, 3.0, 2.5)) && !inside(above, v(2.0, 0.5, -1.0), v(2.3, 2.5, 1.4))
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

/// Irradiance as rendering finds it.
fn direct(relit: &Relit, points: &[Point]) -> Vec<Vec3> {
    points
        .chunks(LOT)
        .flat_map(|points| {
            let mut near = Nearby::default();
            points
                .iter()
                .map(|&(p, n)| {
                    let lit = relit.lit(p, n, &mut near);
                    if lit.asks && !relit.in_sun(p, n) { lit.shade } else { lit.sun }
                })
                .collect::<Vec<_>>()
        })
        .collect()
}

/// The operator gives what shooting and rendering anew give, for its own lighting and its multiples up to 10⁹; scaling a
/// colour alone leaves weights that hang on the light a little off.
#[test]
fn a_sparse_product_relights_as_shooting_anew_does() {
    let (_, built) = room();
    let site = Site::load(built.folder.path()).unwrap();
    let scene = &built.scene;
    let points = points(&built);
    let setup = prepare_for(&site, scene, |seen| unseen(scene, seen, &points), &options(24)).unwrap();
    let (light, transport) = (&setup.lights[0].1, &setup.transports[0]);
    let volume = Volume::new(scene, transport, light);
    let relit = Relit { scene, light, volume: Some(&volume), volume_only: false };
    let own = pictures(&site, "", 2).unwrap();
    let fed: Vec<(&Picture, Radiometry)> = own.iter().map(|(p, r)| (p, *r)).collect();
    let transfer = Transfer::new(&relit, Some(transport), &fed, &points);
    let shares = transfer.shares();
    assert!(shares.records > 0.3 && shares.volume > 0.1 && shares.guessed < 0.02, "{shares:?}");
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
            .map(|((r, p), (_, radiometry))| (Arc::new(again(&site, scene, r.hits().origin)), p, *radiometry))
            .collect();
        let outside = clerestory::shoot::Outside::Uniform(Vec3::splat(sky));
        let given = clerestory::site::Sun { irradiance: sun * scale, ..light.sun.unwrap() };
        let light = Light::new(scene, &anew, Some(given), Some(outside));
        let volume = Volume::new(scene, transport, &light);
        let relit = Relit { scene, light: &light, volume: Some(&volume), volume_only: false };
        let truth = direct(&relit, &points);
        let measured = transfer.measure(&scaled.iter().collect::<Vec<_>>());
        let product = transfer.light(&measured, light.sun.map_or(Vec3::ZERO, |s| s.irradiance));
        let mut off: Vec<f32> = product
            .iter()
            .zip(&truth)
            .map(|(a, b)| (*a - *b).abs().max_element() / b.max_element().max(1e-3 * scale.max_element()))
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

/// The hits of the probe at a place.
fn again(site: &Site, scene: &Scene, origin: Vec3) -> clerestory::shoot::Hits {
    let probe = site.probes.iter().find(|p| scene.local(p.pose.position) == origin).unwrap();
    let chart = clerestory::shoot::Chart::latlong(64, 32);
    clerestory::shoot::Hits::shoot(scene, origin, probe.pose.rotation.as_mat3(), chart)
}
