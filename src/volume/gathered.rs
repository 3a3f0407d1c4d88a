//! What the rays of one place on an unseen surface found, without light.

use glam::Vec3;

/// What the rays from one cache point found. A ray's weight is its direction × its share of the hemisphere: Σ over rays of
/// weight × radiance is the vector irradiance of a channel.
pub(super) struct Gathered {
    pub(super) cache_point: u32,
    /// Number of rays cast.
    pub(super) rays: u32,
    pub(super) sky: Vec<SkyRay>,
    pub(super) seen: Vec<SeenRay>,
    pub(super) unseen: Vec<UnseenRay>,
    /// The unseen surfaces for which another gathered place stands, added up by place, in order.
    pub(super) links: Vec<Link>,
}

/// A ray into the sky.
pub(super) struct SkyRay {
    pub(super) weight: Vec3,
    pub(super) direction: Vec3,
}

/// A ray to a surface that a probe's cell sees, with its albedo/π.
pub(super) struct SeenRay {
    pub(super) weight: Vec3,
    pub(super) rho: Vec3,
    pub(super) probe: u32,
    pub(super) cell: u32,
}

/// A ray to a surface that no probe sees, with its albedo/π.
pub(super) struct UnseenRay {
    pub(super) weight: Vec3,
    pub(super) rho: Vec3,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Whether the sun reaches it.
    pub(super) sunlit: bool,
    /// The cache point that speaks for it, and whether that is linked: then it holds all but direct sun.
    pub(super) cache_point: Option<u32>,
    pub(super) linked: bool,
}

/// Light from another gathered place.
pub(super) struct Link {
    /// Index of the other among the gathered.
    pub(super) other: u32,
    /// Per channel Σ weight × albedo/π: times the other's irradiance this is vector irradiance.
    pub(super) weights: [Vec3; 3],
}
