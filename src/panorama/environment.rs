//! Drawing directions from a panorama in proportion to its light.

use glam::{Mat3, Vec2, Vec3};

use super::projection::latlong;
use super::projection::latlong::{latlong_pixel_fast, neighbours};
use super::{Panorama, Picture, Projection, convert};

/// The widest table that is kept; larger panoramas are averaged down for drawing (not for radiance).
const MAX_WIDTH: usize = 2048;

/// A panorama as a light source: draws directions and tells their density.
///
/// A pixel is drawn in proportion to its luminance times its solid angle, then a place around its centre from the
/// bilinear kernel. The density is therefore the bilinear interpolation of the pixels' shares: it follows the
/// bilinearly interpolated radiance itself and is positive wherever that is, so estimates are unbiased.
#[derive(Clone, Debug)]
pub struct EnvironmentSampler {
    panorama: Panorama,
    to_world: Mat3,
    width: usize,
    height: usize,
    /// Each pixel's share; all sum to 1.
    shares: Vec<f32>,
    /// Sum of shares up to the end of each row.
    rows: Vec<f64>,
    /// Within each row, the sum of shares up to the end of each pixel.
    columns: Vec<f64>,
}

/// A direction drawn from an [`EnvironmentSampler`].
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentSample {
    /// Unit direction towards the light, in the program's axes.
    pub direction: Vec3,
    /// Radiance that arrives from there.
    pub radiance: Vec3,
    /// Density of drawing this direction, per steradian; 0 only where the panorama is black all over.
    pub pdf: f32,
}

impl EnvironmentSampler {
    /// Prepares a panorama. Projections other than latitude/longitude are converted to it first, at a size that keeps
    /// their resolution.
    pub fn new(panorama: Panorama) -> Self {
        let panorama = if panorama.projection == Projection::LatLong {
            panorama
        } else {
            let (width, height) = convert::latlong_size(&panorama);
            let picture = convert::convert(&panorama, Projection::LatLong, width, height);
            Panorama::new(picture, Projection::LatLong, panorama.rotation)
        };
        let (width, height, luminance) = table(panorama.picture());
        let weight = |i: usize| f64::from(luminance[i]) * latlong::solid_angle(width, height, i / width);
        let mut total = 0.0;
        let mut rows = Vec::with_capacity(height);
        let mut columns = Vec::with_capacity(width * height);
        for y in 0..height {
            let mut row = 0.0;
            for x in 0..width {
                row += weight(y * width + x);
                columns.push(row);
            }
            total += row;
            rows.push(total);
        }
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        rows.iter_mut().chain(&mut columns).for_each(|c| *c *= scale);
        let shares = (0..width * height).map(|i| (weight(i) * scale) as f32).collect();
        Self { to_world: panorama.rotation.as_mat3(), panorama, width, height, shares, rows, columns }
    }

    /// Radiance that arrives from direction `d` (program's axes, unit).
    pub fn radiance(&self, d: Vec3) -> Vec3 {
        self.panorama.radiance(d)
    }

    /// Draws a direction from two uniform numbers in 0..1.
    pub fn sample(&self, u: Vec2) -> EnvironmentSample {
        let (y, v) = pick(&self.rows, f64::from(u.y));
        let row = &self.columns[y * self.width..(y + 1) * self.width];
        let (x, u) = pick(row, f64::from(u.x));
        let (x, y) = (x as f64 + 0.5 + tent(u), y as f64 + 0.5 + tent(v));
        // beyond a pole, latitude/longitude's formula goes down the other side by itself
        let local = latlong::direction(self.width, self.height, x, y).as_vec3();
        let direction = self.to_world * local;
        EnvironmentSample { direction, radiance: self.radiance(direction), pdf: self.density(local) }
    }

    /// Density per steradian with which [`sample`](Self::sample) draws direction `d` (program's axes, unit).
    pub fn pdf(&self, d: Vec3) -> f32 {
        self.density(self.panorama.to_camera * d)
    }

    fn density(&self, local: Vec3) -> f32 {
        use std::f32::consts::PI;
        let p = latlong_pixel_fast(local, self.width as f32, self.height as f32);
        let (pixels, f) = neighbours(self.width, self.height, p);
        let [top, bottom] = pixels.map(|row| {
            let [left, right] = row.map(|[x, y]| self.shares[y * self.width + x]);
            left + (right - left) * f.x
        });
        // dΩ = sin θ · 2π/width · π/height per pixel of area
        let sin = local.truncate().length().max(1e-7);
        let pixel = 2.0 * PI * PI * sin / (self.width * self.height) as f32;
        (top + (bottom - top) * f.y) / pixel
    }
}

/// The entry of a running sum that `u` in 0..1 of its total falls into, and where in it, in 0..1.
fn pick(sums: &[f64], u: f64) -> (usize, f64) {
    let target = u * sums.last().copied().unwrap_or(0.0);
    let i = sums.partition_point(|&s| s <= target).min(sums.len() - 1);
    let start = if i > 0 { sums[i - 1] } else { 0.0 };
    let width = sums[i] - start;
    (i, if width > 0.0 { ((target - start) / width).clamp(0.0, 1.0) } else { 0.5 })
}

/// The inverse of the cumulated bilinear kernel 1 − |t| on −1..1.
fn tent(u: f64) -> f64 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}

/// Luminance averaged down to at most [`MAX_WIDTH`] wide: width, height and values.
fn table(picture: &Picture) -> (usize, usize, Vec<f32>) {
    let factor = picture.width.div_ceil(MAX_WIDTH);
    // an even width, so that what lies across a pole is a pixel; never more cells than pixels, so that cells reach as
    // far as the pixels they hold
    let width = (picture.width / factor / 2 * 2).max(1);
    let height = (picture.height / factor).max(1);
    let brightness = |pixels: &[Vec3]| pixels.iter().map(|&p| luminance(p)).collect();
    if (width, height) == (picture.width, picture.height) {
        return (width, height, brightness(&picture.pixels));
    }
    (width, height, brightness(&convert::shrink(picture, width, height).pixels))
}

/// Brightness by which light is drawn: the mean of the channels, so that no colour is ever out of reach.
fn luminance(p: Vec3) -> f32 {
    (p.x + p.y + p.z) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    /// A dim sky with a one-pixel sun, a black ground and light at the pole.
    fn sky(width: usize, height: usize) -> Picture {
        let mut picture = Picture::new(width, height);
        for y in 0..height / 2 {
            for x in 0..width {
                picture.pixels[y * width + x] = Vec3::new(0.2, 0.3, 0.5 + (x % 5) as f32 * 0.1);
            }
        }
        picture.pixels[height / 4 * width + width / 3] = Vec3::splat(2e4);
        picture
    }

    fn sampler(width: usize, height: usize) -> EnvironmentSampler {
        let rotation = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(0.9);
        EnvironmentSampler::new(Panorama::new(sky(width, height), Projection::LatLong, rotation))
    }

    /// A low-discrepancy point (Roberts' R2 sequence).
    fn point(i: usize) -> Vec2 {
        let at = |a: f64| (0.5 + a * i as f64).fract() as f32;
        Vec2::new(at(0.754_877_666_246_692_8), at(0.569_840_290_998_053_3))
    }

    /// Sum over a fine grid of directions of f · dΩ.
    fn integral(n: usize, f: impl Fn(Vec3) -> f64) -> f64 {
        let row = |y| {
            let omega = Projection::LatLong.solid_angle(2 * n, n, 0, y);
            let at = |x| Projection::LatLong.direction(2 * n, n, x as f64 + 0.5, y as f64 + 0.5);
            (0..2 * n).filter_map(at).map(|d: DVec3| f(d.as_vec3()) * omega).sum::<f64>()
        };
        (0..n).map(row).sum()
    }

    #[test]
    fn densities_sum_to_one() {
        for (w, h) in [(64, 32), (33, 17), (5000, 40)] {
            let sampler = sampler(w, h);
            let sum = integral(1000, |d| f64::from(sampler.pdf(d)));
            assert!((sum - 1.0).abs() < 0.01, "{w} × {h}: {sum}");
        }
    }

    #[test]
    fn samples_estimate_irradiance_without_bias() {
        for (w, h) in [(64, 32), (33, 17), (3000, 1500)] {
            let sampler = sampler(w, h);
            let n = Vec3::new(0.3, -0.5, 0.8).normalize();
            let truth = integral(2000, |d| f64::from(sampler.radiance(d).z * n.dot(d).max(0.0)));
            let count = 100_000;
            let mut sum = 0.0;
            for i in 0..count {
                let s = sampler.sample(point(i));
                assert!((s.direction.length() - 1.0).abs() < 1e-5 && s.pdf > 0.0);
                assert!(
                    (sampler.pdf(s.direction) / s.pdf - 1.0).abs() < 0.02,
                    "{} {}",
                    s.pdf,
                    sampler.pdf(s.direction)
                );
                sum += f64::from(s.radiance.z * n.dot(s.direction).max(0.0) / s.pdf);
            }
            let estimate = sum / f64::from(count as u32);
            assert!((estimate / truth - 1.0).abs() < 0.01, "{w} × {h}: {estimate} for {truth}");
        }
    }

    #[test]
    fn directions_fall_as_often_as_their_density_says() {
        // Pearson's chi-square over 8 × 16 cells, each expecting at least 5 hits
        let sampler = sampler(64, 32);
        let (rows, columns, count) = (8, 16, 200_000);
        let cell = |d: Vec3| {
            let p = Projection::LatLong.pixel(columns, rows, d.as_dvec3()).unwrap();
            (p.y as usize).min(rows - 1) * columns + (p.x as usize).min(columns - 1)
        };
        let mut expected = vec![0.0; rows * columns];
        let n = 1600;
        for y in 0..n {
            let omega = Projection::LatLong.solid_angle(2 * n, n, 0, y);
            for x in 0..2 * n {
                let d = Projection::LatLong.direction(2 * n, n, x as f64 + 0.5, y as f64 + 0.5).unwrap().as_vec3();
                expected[cell(d)] += f64::from(sampler.pdf(d)) * omega * f64::from(count);
            }
        }
        let mut random = 0x9e37_79b9_7f4a_7c15u64;
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut seen = vec![0.0; rows * columns];
        for _ in 0..count {
            seen[cell(sampler.sample(Vec2::new(next(), next())).direction)] += 1.0;
        }
        let (mut chi2, mut cells) = (0.0, 0.0);
        for (e, s) in expected.iter().zip(&seen) {
            if *e >= 5.0 {
                chi2 += (s - e).powi(2) / e;
                cells += 1.0;
            } else {
                assert!(*s < 30.0, "{s} hits where {e} are expected");
            }
        }
        // mean k, variance 2k: five standard deviations
        let k: f64 = cells - 1.0;
        assert!(k > 50.0 && chi2 < k + 5.0 * (2.0 * k).sqrt(), "chi-square {chi2} with {k} degrees of freedom");
    }

    #[test]
    fn density_is_positive_wherever_there_is_light() {
        for (w, h) in [(64, 32), (33, 17), (5000, 100)] {
            let sampler = sampler(w, h);
            for i in 0..300_000 {
                let u = point(i);
                let d = latlong::direction(1, 1, f64::from(u.x), f64::from(u.y)).as_vec3();
                assert!(sampler.radiance(d) == Vec3::ZERO || sampler.pdf(d) > 0.0, "{w} × {h}: {d}");
            }
        }
    }

    #[test]
    fn other_projections_and_black_are_sampled_too() {
        let mut ball = Picture::new(200, 200);
        ball.pixels.fill(Vec3::ONE);
        let sampler = EnvironmentSampler::new(Panorama::new(ball, Projection::Angular, DMat3::IDENTITY));
        let s = sampler.sample(Vec2::new(0.3, 0.6));
        assert!(s.radiance.distance(Vec3::ONE) < 1e-5);
        assert!((s.pdf * 4.0 * std::f32::consts::PI - 1.0).abs() < 0.01, "{}", s.pdf);

        let black = Panorama::new(Picture::new(8, 4), Projection::LatLong, DMat3::IDENTITY);
        let s = EnvironmentSampler::new(black).sample(Vec2::new(0.3, 0.6));
        assert!(s.pdf == 0.0 && s.radiance == Vec3::ZERO && s.direction.is_finite());
    }
}
