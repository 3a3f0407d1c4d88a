//! Directions all around.

/// Points spread evenly over the unit sphere: a Fibonacci lattice (González, *Measurement of areas on a sphere using
/// Fibonacci and latitude–longitude lattices*, 2010).
pub(crate) fn sphere(count: usize) -> impl Iterator<Item = glam::Vec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        glam::DVec3::new(radius * cos, radius * sin, z).as_vec3()
    })
}
