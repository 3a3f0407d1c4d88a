//! What tells irradiance: records, and where they end a volume.

use glam::Vec3;

use super::Source;
use crate::scene::{Scene, Surface};
use crate::shoot::Light;
use crate::volume::{Nearby, Volume};

/// What tells irradiance on surfaces, and the radiance behind windows.
pub trait Irradiance: Sync {
    /// What lights a point of a surface.
    fn at(&self, spot: &ShadingPoint, scratch: &mut Nearby) -> Lit;

    /// Whether the sun reaches a point whose [`Lit`] asks for it.
    fn in_sun(&self, _point: Vec3, _normal: Vec3) -> bool {
        false
    }

    /// Radiance of the sky.
    fn sky(&self, direction: Vec3) -> Vec3;

    /// Whether samples of a pixel that lie on one surface share irradiance and albedo, the albedo averaged over what
    /// they see, and pixels beside each other their irradiance; else every sample looks up both at one point.
    fn shares(&self) -> bool {
        true
    }
}

/// A point of the surface that a pixel shows.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint {
    /// Local metres.
    pub position: Vec3,
    /// Unit normal, on the side that is seen.
    pub normal: Vec3,
    /// A triangle that it is part of, or that the surface around it is.
    pub triangle: u32,
    /// How far off its plane another point of the same surface may lie, metres.
    pub(super) near_m: f32,
}

impl ShadingPoint {
    pub(super) fn new(surface: &Surface, near_m: f32) -> Self {
        let Surface { position, normal, triangle, .. } = *surface;
        Self { position, normal, triangle, near_m }
    }

    /// Whether another point lies on this one's surface.
    #[inline]
    pub(super) fn joins(&self, other: &Self) -> bool {
        other.normal.dot(self.normal) > 0.995 && self.normal.dot(other.position - self.position).abs() < self.near_m
    }
}

/// The light on a point of a surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lit {
    /// Irradiance if the sun does not reach the point.
    pub shade: Vec3,
    /// Irradiance if it does.
    pub sun: Vec3,
    /// Whether only a shadow ray tells which; otherwise both are the same.
    pub needs_shadow_ray: bool,
    /// Where the irradiance came from.
    pub source: Source,
    /// Where [`Lit::shade`] came from.
    pub shade_source: Source,
    /// How far probes agree, 0..=1.
    pub agreement: f32,
}

impl Lit {
    /// Irradiance that does not hang on the sun.
    pub fn known(irradiance: Vec3, source: Source, agreement: f32) -> Self {
        Self { shade: irradiance, sun: irradiance, needs_shadow_ray: false, source, shade_source: source, agreement }
    }
}

/// A scene lit by records and, where they end, by a volume.
pub struct Relit<'a> {
    /// The model.
    pub scene: &'a Scene,
    /// The probes' light.
    pub light: &'a Light,
    /// Light where no probe sees; `None` where that is not needed.
    pub volume: Option<&'a Volume<'a>>,
    /// Takes all light from the volume, none from records: to see what the volume alone is worth.
    pub volume_only: bool,
}

impl Irradiance for Relit<'_> {
    fn at(&self, spot: &ShadingPoint, scratch: &mut Nearby) -> Lit {
        self.lit(spot.position, spot.normal, scratch)
    }

    fn in_sun(&self, point: Vec3, normal: Vec3) -> bool {
        self.light.sun_reaches(self.scene, point, normal)
    }

    fn sky(&self, direction: Vec3) -> Vec3 {
        self.light.sky(direction)
    }
}

impl Relit<'_> {
    /// What lights a point of a surface.
    pub fn lit(&self, point: Vec3, normal: Vec3, scratch: &mut Nearby) -> Lit {
        let (scene, light) = (self.scene, self.light);
        let mut agreement = 1.0;
        if !self.volume_only
            && let Some(o) = light.observe(scene, point, normal)
        {
            agreement = o.agreement();
            match light.sunlit(&o) {
                Some(in_sun) => {
                    if let Some(e) = light.resolve(&o, in_sun, normal) {
                        return Lit::known(e, Source::Record, agreement);
                    }
                }
                None => {
                    let shade = light.resolve(&o, false, normal).map(|e| (e, Source::Record));
                    let (shade, shade_source) = shade.unwrap_or_else(|| self.unseen(point, normal, scratch));
                    return Lit {
                        shade,
                        sun: light.resolve(&o, true, normal).unwrap_or_default(),
                        needs_shadow_ray: true,
                        source: Source::Record,
                        shade_source,
                        agreement,
                    };
                }
            }
        }
        if self.volume.is_none()
            && let Some(e) = light.observe_untrusted(scene, point, normal)
        {
            return Lit::known(e, Source::Record, agreement);
        }
        let (indirect, source) = self.unseen(point, normal, scratch);
        let direct = light.unshadowed_sun(normal);
        Lit {
            sun: indirect + direct,
            needs_shadow_ray: direct != Vec3::ZERO,
            ..Lit::known(indirect, source, agreement)
        }
    }

    /// Irradiance without direct sun where no record tells, and where it is from.
    fn unseen(&self, point: Vec3, normal: Vec3, scratch: &mut Nearby) -> (Vec3, Source) {
        let (scene, light) = (self.scene, self.light);
        let neighbour = |e: Vec3| (e, Source::Neighbour);
        let Some(volume) = self.volume else {
            let found = light.observe_untrusted(scene, point, normal).or_else(|| light.neighbour(scene, point, normal));
            return found.map_or((Vec3::ZERO, Source::None), neighbour);
        };
        let near = volume.irradiance(scene, point, normal, scratch);
        // what records measured here or beside is better than a guess of what lies beyond
        if near.is_none_or(|n| n.is_guess())
            && let Some(e) = light.observe_untrusted(scene, point, normal).filter(|_| light.sun.is_none())
        {
            return neighbour(e);
        }
        let filled = near.unwrap_or_else(|| volume.gather(scene, light, point, normal, scratch));
        let beside = || light.seen_neighbour(scene, point, normal);
        // a crevice of a scan, all of whose rays end in it; what stands in the open is black if nobody says otherwise
        let lost = || light.neighbour(scene, point, normal).filter(|_| !filled.is_guess());
        match volume.is_open() && (filled.is_guess() || filled.irradiance == Vec3::ZERO) {
            true => beside().or_else(lost).map_or((filled.irradiance, Source::Volume), neighbour),
            false => (filled.irradiance, Source::Volume),
        }
    }
}
