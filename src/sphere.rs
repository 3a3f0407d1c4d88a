//! Directions all around.

use glam::Vec3;

/// Points spread evenly over the unit sphere: a Fibonacci lattice (González, *Measurement of areas on a sphere using
/// Fibonacci and latitude–longitude lattices*, 2010).
pub(crate) fn sphere(count: usize) -> impl Iterator<Item = Vec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        glam::DVec3::new(radius * cos, radius * sin, z).as_vec3()
    })
}

/// Two unit vectors across a direction and each other. They turn with it smoothly, but at two directions that hardly a
/// surface faces; [`Vec3::any_orthonormal_pair`] turns over wherever rounding gives z another sign: on every upright wall.
pub(crate) fn across(direction: Vec3) -> (Vec3, Vec3) {
    const ODD: Vec3 = Vec3::new(0.311, 0.647, 0.696);
    let first = direction.cross(ODD);
    let first = if first.length_squared() > 1e-6 { first.normalize() } else { direction.any_orthonormal_vector() };
    (first, direction.cross(first))
}
