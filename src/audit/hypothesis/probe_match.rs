//! Parts of the model that stand beside their place in a probe's own picture.
//!
//! A part that is nearer to the camera than the model has it, or farther, hardly changes the photograph. A probe from the
//! side sees it move. So parts that the photograph shows are looked for in each probe's picture, too: as a photograph
//! from there would show them.

use glam::Vec3;
use rayon::prelude::*;

use crate::audit::hypothesis::silhouette::{FEWEST, FOUND, Fit, REACH, Small, registration};
use crate::audit::likelihood::appearance;
use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE};
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::view::{AuditScene, Observations};
use crate::panorama::luminance;
use crate::site::{Camera, Pose};

/// A cutout of a probe's picture has at most so many pixels along each side.
const LARGEST_PX: f32 = 160.0;

/// A part that a probe sees smaller than so many pixels across tells nothing.
const SMALLEST_PX: f32 = 6.0;

/// Share of its distance that a part is moved by to see where it goes.
const NUDGE: f32 = 0.01;

/// Pixels around a part, beyond the furthest shift.
const MARGIN_PX: f32 = 8.0;

/// What the photograph shows in its place has moved along the camera's ray: the probe must see that it did, but for the
/// angle whose cosine this is.
const ALONG: f32 = 0.85;

/// Logarithm of the odds from which on a probe's picture of another place counts: it is smaller than the photograph, and lit by
/// what it shows.
const SURE: f32 = 32.0;

/// What a probe says of a part.
pub(crate) struct ProbeMatch {
    /// Which of the parts that were asked for.
    pub(crate) which: usize,
    /// Logarithm of the odds against the model's place.
    pub(crate) odds: f32,
}

/// Where a probe's picture shows the outline of a part.
struct InProbe {
    which: usize,
    shift: [f32; 2],
    /// Unit direction in which it moves when the part moves along the camera's ray.
    towards: [f32; 2],
    odds: f32,
    others: Vec<[f32; 2]>,
}

/// Asks all probes for parts, given by their numbers and pixels in the photograph, and tells of those whose outline some
/// probe shows elsewhere.
pub(crate) fn probe_matches(
    prepared: &AuditScene,
    observed: &Observations,
    parts: &[(u32, Vec<usize>)],
) -> Vec<ProbeMatch> {
    let mut all: Vec<ProbeMatch> = vec![];
    for probe in &prepared.probes {
        let told: Vec<InProbe> = parts
            .par_iter()
            .enumerate()
            .filter_map(|(which, (part, pixels))| asked(prepared, observed, probe, which, *part, pixels))
            .collect();
        let shifts: Vec<[f32; 2]> = told.iter().flat_map(|t| t.others.iter().copied().chain([t.shift])).collect();
        let (common, least) = registration(&shifts);
        // each part in each probe is a chance to err
        let tries = ((parts.len() * prepared.probes.len()).max(1) as f32).ln();
        for t in told {
            let px = (t.shift[0] - common[0]).hypot(t.shift[1] - common[1]);
            let along = ((t.shift[0] - common[0]) * t.towards[0] + (t.shift[1] - common[1]) * t.towards[1]).abs();
            if px <= least || along < ALONG * px || t.odds < SURE + tries {
                continue;
            }
            let found = ProbeMatch { which: t.which, odds: t.odds - tries };
            match all.iter_mut().find(|w| w.which == t.which) {
                Some(other) if other.odds >= found.odds => {}
                Some(other) => *other = found,
                None => all.push(found),
            }
        }
    }
    all.sort_by_key(|w| w.which);
    all
}

/// Looks for one part in one probe's picture.
fn asked(
    prepared: &AuditScene,
    observed: &Observations,
    probe: &ProbeView,
    which: usize,
    part: u32,
    pixels: &[usize],
) -> Option<InProbe> {
    let s = &observed.surfaces;
    let count = pixels.len() as f32;
    let centre = pixels.iter().map(|i| s.position[*i]).sum::<Vec3>() / count;
    let radius = pixels.iter().map(|i| s.position[*i].distance(centre)).fold(0.0f32, f32::max);
    let distance = centre.distance(probe.origin);
    let sides = 2.0 * radius / distance / probe.pixel_angle();
    if distance < 1.5 * radius || sides < SMALLEST_PX {
        return None;
    }
    let whole = sides + 2.0 * (REACH as f32 + MARGIN_PX);
    let side = whole.min(LARGEST_PX).ceil();
    let pixel = probe.pixel_angle() * whole / side;
    let to_program = |p: Vec3| p.as_dvec3() + prepared.scene.origin;
    let pose = Pose::look_at(to_program(probe.origin), to_program(centre));
    let fov = 2.0 * f64::from(0.5 * side * pixel).atan();
    let camera = Camera::with_fov(pose, side as u32, side as u32, fov.to_degrees());
    let along =
        camera.project(to_program(centre + (centre - s.origin) * NUDGE))? - camera.project(to_program(centre))?;
    let towards = along.normalize_or_zero().as_vec2().to_array();
    let small = cutout(prepared, probe, &camera);
    let mine: Vec<usize> = (0..small.part.len()).filter(|i| small.part[*i] == part).collect();
    if mine.len() < FEWEST {
        return None;
    }
    let fit = small.fit(&mine).filter(|f| f.best >= FOUND)?;
    let members = small.members();
    let beside = members.iter().enumerate().filter(|(k, m)| *k as u32 != part && m.len() >= FEWEST);
    let fits: Vec<Fit> = beside.filter_map(|(_, m)| small.fit(m)).filter(|f| f.best >= FOUND).collect();
    Some(InProbe { which, shift: fit.shift, towards, odds: fit.odds, others: fits.iter().map(|f| f.shift).collect() })
}

/// What a camera in a probe's place sees, by the model and by the probe's picture.
fn cutout(prepared: &AuditScene, probe: &ProbeView, camera: &Camera) -> Small {
    let scene = prepared.scene;
    let s = GeometryBuffer::look(scene, camera);
    let n = s.triangle.len();
    let e = appearance::irradiance(scene, &s, prepared.light, prepared.volume);
    let lit = |i: usize| {
        let albedo = scene.filtered_albedo(s.triangle[i], s.barycentric[i], s.footprint(i));
        luminance(albedo * e[i]) / std::f32::consts::PI
    };
    let known: Vec<f32> =
        (0..n).map(|i| if s.triangle[i] != NONE && e[i].min_element() > 0.0 { 1.0 } else { 0.0 }).collect();
    let model: Vec<f32> = (0..n).map(|i| if known[i] > 0.0 { lit(i).max(1e-6).ln() } else { 0.0 }).collect();
    let seen: Vec<f32> = (0..n)
        .map(|i| luminance(probe.log_radiance(probe.origin + s.ray[i], 0).map(f32::exp)).max(1e-6).ln())
        .collect();
    let usable: Vec<f32> = seen.iter().map(|v| if v.is_finite() { 1.0 } else { 0.0 }).collect();
    let seen: Vec<f32> = seen.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
    let part = s.triangle.iter().map(|t| prepared.part(*t)).collect();
    Small::of(s.width, s.height, part, s.distance, &[(model, known)], &seen, usable)
}
