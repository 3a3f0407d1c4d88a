//! Whether probes stand where a probe can stand, and whether their pictures are light.

use serde::Serialize;
use std::path::PathBuf;

use super::{Surroundings, winding_means_something};
use crate::panorama::{self, PanoramaError, PictureHealth};
use crate::scene::{Edges, Scene};
use crate::site::Site;

/// What is known about one probe.
#[derive(Clone, Debug, Serialize)]
pub struct ProbeCheck {
    /// The probe's name.
    pub name: String,
    /// In the model's own axes and units.
    pub position: [f64; 3],
    /// Distance of the nearest surface in metres; `None` where there is none around.
    pub nearest_m: Option<f32>,
    /// Height above the surface straight beneath in metres; `None` where there is none.
    pub height_m: Option<f32>,
    /// Share of directions in which a surface is nearer than 5 cm.
    pub close_share: f64,
    /// Share of hits on the back of a triangle, by its winding.
    pub back_share: f64,
    /// Share of directions in which there is no surface.
    pub open_share: f64,
    /// Its pictures, in the site's order.
    pub pictures: Vec<PictureCheck>,
    /// What is odd, a sentence each.
    pub warnings: Vec<String>,
}

/// What is known about one of a probe's pictures: counts of pixels.
#[derive(Clone, Debug, Serialize)]
pub struct PictureCheck {
    /// The lighting; empty for a lone picture.
    pub lighting: String,
    /// The file.
    pub file: PathBuf,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Pixels with a channel that is not a number.
    pub nan: usize,
    /// Pixels with an infinite channel.
    pub infinite: usize,
    /// Pixels with a negative channel.
    pub negative: usize,
    /// Pixels that are zero in every channel.
    pub black: usize,
    /// Pixels at the picture's largest value, where many share it.
    pub clipped: usize,
}

/// Checks all probes; reads their pictures one at a time.
pub(super) fn probes(site: &Site, scene: &Scene, edges: &Edges) -> Result<Vec<ProbeCheck>, PanoramaError> {
    let around: Vec<Surroundings> =
        site.probes.iter().map(|p| Surroundings::of(scene, scene.local(p.pose.position))).collect();
    let front_is_usual = usual_side(&around);
    let one = |(probe, around): (&crate::site::Probe, &Surroundings)| {
        let winding = winding_means_something(edges).then_some(front_is_usual);
        let mut warnings = place_warnings(around, winding);
        let mut pictures = Vec::new();
        for lit in &probe.pictures {
            let picture = panorama::read(&lit.path)?;
            let health = picture.health();
            warnings.extend(picture_warnings(&lit.lighting, &health));
            pictures.push(PictureCheck {
                lighting: lit.lighting.clone(),
                file: lit.path.clone(),
                width: picture.width,
                height: picture.height,
                nan: health.nan,
                infinite: health.infinite,
                negative: health.negative,
                black: health.black,
                clipped: health.clipped,
            });
        }
        Ok(ProbeCheck {
            name: probe.name.clone(),
            position: site.frame.point_out(probe.pose.position).to_array(),
            nearest_m: Some(around.nearest_m).filter(|d| d.is_finite()),
            height_m: around.beneath_m,
            close_share: around.close_share,
            back_share: around.back_share,
            open_share: around.open_share,
            pictures,
            warnings,
        })
    };
    site.probes.iter().zip(&around).map(one).collect()
}

/// Whether most probes see fronts. A shell may be wound either way; a probe that differs from the others stands on
/// the other side of a surface.
fn usual_side(around: &[Surroundings]) -> bool {
    let fronts = around.iter().filter(|a| a.back_share < 0.5).count();
    2 * fronts >= around.len()
}

/// `front_is_usual` is `None` where the model's winding means nothing.
fn place_warnings(around: &Surroundings, front_is_usual: Option<bool>) -> Vec<String> {
    let mut warnings = Vec::new();
    let wrong_share = match front_is_usual {
        Some(true) => around.back_share,
        Some(false) => 1.0 - around.back_share,
        None => 0.0,
    };
    // a probe in the open of a room sees the other side of a few thin things only
    let cramped = around.back_share > 0.8 && around.median_m < 0.5 && front_is_usual.is_some();
    if around.open_share > 0.999 {
        warnings.push("It sees nothing of the model: check its position, site.units and site.up.".to_owned());
        return warnings;
    }
    if around.close_share > 0.25 {
        warnings.push(format!(
            "It stands in or on a surface: {:.0} % of what surrounds it is nearer than 5 cm.",
            100.0 * around.close_share
        ));
    } else if wrong_share > 0.6 || cramped {
        let share = 100.0 * wrong_share.max(around.back_share);
        warnings
            .push(format!("It stands inside a wall or below a floor: it sees {share:.0} % of surfaces from behind."));
    }
    match around.beneath_m {
        None => warnings.push("There is no surface beneath it: it stands below the floor or outside.".to_owned()),
        Some(height) if height < 0.2 => {
            warnings.push(format!("It is only {:.0} cm above the surface beneath.", 100.0 * height));
        }
        Some(height) if height > 20.0 => {
            warnings.push(format!("It is {height:.0} m above the surface beneath: check its height and site.units."));
        }
        Some(_) => {}
    }
    if around.open_share > 0.5 {
        warnings.push(format!(
            "In {:.0} % of directions there is no surface: it may stand outside, or the model is open.",
            100.0 * around.open_share
        ));
    }
    warnings
}

fn picture_warnings(lighting: &str, health: &PictureHealth) -> Vec<String> {
    let share = |n: usize| 100.0 * n as f64 / health.pixels.max(1) as f64;
    let of = if lighting.is_empty() { "its picture".to_owned() } else { format!("its picture “{lighting}”") };
    let mut warnings = Vec::new();
    let mut warn = |count: usize, limit: f64, what: &str| {
        if count > 0 && share(count) > limit {
            warnings.push(format!("{count} pixels ({:.2} %) of {of} {what}.", share(count)));
        }
    };
    warn(health.nan, 0.0, "are not numbers and are left out");
    warn(health.infinite, 0.0, "are infinite and are left out");
    warn(health.negative, 0.0, "are negative and are left out");
    warn(health.black, 1.0, "are black: a nadir patch, or underexposed");
    warn(health.clipped, 0.0, "are clipped at the largest value: light is missing there; bracket more exposures");
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh};
    use glam::{DVec3, Vec3};

    /// Boxes with fronts outwards, or inwards for a room.
    fn scene(boxes: &[([f32; 3], [f32; 3], bool)]) -> Scene {
        let mut mesh = Mesh::default();
        for (low, high, room) in boxes {
            let base = mesh.positions.len() as u32;
            for i in 0..8 {
                let side = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
                mesh.positions.push(Vec3::new(side(0), side(1), side(2)));
            }
            let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            for [a, b, c, d] in quads {
                for mut t in [[a, b, c], [a, c, d]] {
                    if *room {
                        t.swap(1, 2);
                    }
                    mesh.triangles.push(t.map(|i| base + i));
                    mesh.materials.push(0);
                }
            }
        }
        let grey = Material { name: String::new(), albedo: Vec3::splat(0.5), texture: None, emission: Vec3::ZERO };
        Scene::new(mesh, vec![grey], Vec::new(), DVec3::ZERO)
    }

    const ROOM: ([f32; 3], [f32; 3], bool) = ([0.0; 3], [6.0, 5.0, 4.0], true);
    /// Its ends stand out of floor and ceiling.
    const PILLAR: ([f32; 3], [f32; 3], bool) = ([2.0, 2.0, -0.1], [3.0, 3.0, 4.1], false);

    #[test]
    fn a_probe_in_a_room_is_fine_and_one_in_a_pillar_is_not() {
        let scene = scene(&[ROOM, PILLAR]);
        let free = Surroundings::of(&scene, Vec3::new(1.0, 1.0, 1.6));
        assert!(free.back_share < 0.01 && free.open_share == 0.0);
        assert!((free.beneath_m.unwrap() - 1.6).abs() < 1e-4 && (free.nearest_m - 1.0).abs() < 0.01);
        assert_eq!(place_warnings(&free, Some(true)), Vec::<String>::new());
        let inside = Surroundings::of(&scene, Vec3::new(2.5, 2.5, 1.6));
        // floor and ceiling run through the pillar and show their fronts
        assert!(inside.back_share > 0.8);
        assert!(place_warnings(&inside, Some(true))[0].contains("inside a wall"));
        assert!(!place_warnings(&inside, None).iter().any(|w| w.contains("inside a wall")));
    }

    #[test]
    fn a_probe_on_a_wall_below_the_floor_or_far_away_is_told() {
        let scene = scene(&[ROOM]);
        let warnings = |x, y, z| place_warnings(&Surroundings::of(&scene, Vec3::new(x, y, z)), Some(true)).join(" ");
        assert!(warnings(0.01, 2.5, 1.6).contains("in or on a surface"));
        assert!(warnings(3.0, 2.5, -0.5).contains("no surface beneath"));
        assert!(warnings(3.0, 2.5, -0.5).contains("below a floor"));
        assert!(warnings(3000.0, 2.5, 1.6).contains("nothing of the model"));
        assert!(warnings(3.0, 2.5, 0.1).contains("only 10 cm above"));
    }

    /// A room whose fronts all point outwards: every probe sees backs, which then is the usual side.
    #[test]
    fn a_room_wound_outwards_is_no_fault() {
        let (low, high, _) = ROOM;
        let scene = scene(&[(low, high, false)]);
        let around = Surroundings::of(&scene, Vec3::new(3.0, 2.5, 1.6));
        assert!(around.back_share > 0.99 && !usual_side(&[around]));
        assert_eq!(place_warnings(&around, Some(false)), Vec::<String>::new());
    }

    #[test]
    fn pictures_tell_their_ill_pixels() {
        let health = PictureHealth { pixels: 1000, nan: 1, infinite: 2, negative: 3, black: 20, clipped: 5 };
        let warnings = picture_warnings("10:00", &health);
        assert_eq!(warnings.len(), 5);
        assert!(warnings[2].starts_with("3 pixels (0.30 %) of its picture “10:00” are negative"));
        assert_eq!(picture_warnings("", &PictureHealth { pixels: 1000, black: 5, ..Default::default() }).len(), 0);
    }
}
