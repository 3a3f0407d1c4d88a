//! Where a picture may have been taken: features of shape and texture, compared at all headings at once.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex32 as Complex;
use rustfft::{Fft, FftDirection};

use super::eye::{Eye, SEARCHED, level, tilts};
use super::model::{GeometryBuffer, LocalPose};
use super::picture::{Level, log_at};
use super::raster::{LEAST_SINE, Raster};
use crate::scene::Scene;

/// Features a cell has: the structure tensor's xx, yy and xy, each strength of an edge saturating.
const CHANNELS: usize = 3;

/// Features of a sphere's cells, upright: rows are level.
pub(super) struct Features {
    pub(super) channels: [Vec<f32>; CHANNELS],
    /// 1 where the picture tells something, times the cell's solid angle.
    pub(super) weight: Vec<f32>,
}

/// Adds the outer product of the gradient per cell; rows by the poles have none.
fn add(tensor: &mut [Vec<f32>; CHANNELS], raster: &Raster, values: &[f32], i: usize) {
    let sine = raster.sine(i);
    if sine < LEAST_SINE {
        return;
    }
    let [l, r, u, d] = raster.around(i).map(|j| values[j]);
    let (x, y) = (0.5 * (r - l) / sine, 0.5 * (d - u));
    tensor[0][i] += x * x;
    tensor[1][i] += y * y;
    tensor[2][i] += std::f32::consts::SQRT_2 * x * y;
}

/// Turns sums of squared gradients into bounded edge strengths with a direction, spread over neighbouring cells.
fn finished(raster: &Raster, tensor: [Vec<f32>; CHANNELS], weight: Vec<f32>, usual: f32) -> Features {
    let n = raster.len();
    let trace: Vec<f32> = (0..n).map(|i| tensor[0][i] + tensor[1][i]).collect();
    let channels = tensor.map(|c| {
        let bounded: Vec<f32> = (0..n)
            .map(|i| if trace[i] > 0.0 { c[i] / trace[i] * (trace[i] / (trace[i] + usual)).sqrt() } else { 0.0 })
            .collect();
        // as far as places and tilts that are tried lie apart
        (0..raster.full / 64).fold(bounded, |soft, _| raster.soften(&soft, &weight))
    });
    Features { channels, weight }
}

/// What the model shows at a pose.
pub(super) fn of_model(scene: &Scene, raster: &Raster, pose: &LocalPose) -> Features {
    let buffer = GeometryBuffer::cast(scene, raster, pose);
    let n = raster.len();
    let weight: Vec<f32> = (0..n).map(|i| raster.sine(i)).collect();
    let mut tensor: [Vec<f32>; CHANNELS] = std::array::from_fn(|_| vec![0.0; n]);
    let hit = |i: usize| buffer.distance[i].is_finite();
    let plane = |i: usize| {
        // how far the plane passes by, against the distance: told apart are parallel planes
        if hit(i) {
            (buffer.normal[i].dot(raster.directions[i]) * buffer.distance[i]).abs().max(0.01).ln()
        } else {
            0.0
        }
    };
    let maps: [Vec<f32>; 6] = [
        (0..n).map(|i| buffer.log_albedo[i]).collect(),
        (0..n).map(|i| SHAPE * buffer.normal[i].x).collect(),
        (0..n).map(|i| SHAPE * buffer.normal[i].y).collect(),
        (0..n).map(|i| SHAPE * buffer.normal[i].z).collect(),
        (0..n).map(|i| DEPTH * plane(i)).collect(),
        (0..n).map(|i| if hit(i) && !buffer.lamp[i] { 0.0 } else { OPEN }).collect(),
    ];
    for map in &maps {
        let soft = raster.soften(map, &weight);
        (0..n).for_each(|i| add(&mut tensor, raster, &soft, i));
    }
    finished(raster, tensor, weight, USUAL)
}

/// Squared differences per cell that count half; a picture has more of them than a model.
const USUAL: f32 = 0.01;

/// What a change counts for in units of log albedo: of a normal's component, of the logarithm of a plane's distance, and from a
/// surface to a window or lamp.
const SHAPE: f32 = 0.7;
const DEPTH: f32 = 0.3;
const OPEN: f32 = 2.0;

/// What a picture shows, turned upright by `upright` (from the picture's axes to level ones).
fn of_picture(raster: &Raster, level: &Level, upright: Mat3) -> Features {
    let back = upright.transpose();
    let found: Vec<Option<f32>> = raster.directions.iter().map(|d| log_at(level, back * *d)).collect();
    let weight: Vec<f32> =
        found.iter().enumerate().map(|(i, v)| if v.is_some() { raster.sine(i) } else { 0.0 }).collect();
    let log: Vec<f32> = found.iter().map(|v| v.unwrap_or(0.0)).collect();
    of_log(raster, &log, weight)
}

/// What a picture shows, in its own cells.
pub(super) fn of_own(level: &Level) -> Features {
    of_log(&level.raster, &level.log, level.weight.clone())
}

fn of_log(raster: &Raster, log: &[f32], weight: Vec<f32>) -> Features {
    let mut tensor: [Vec<f32>; CHANNELS] = std::array::from_fn(|_| vec![0.0; raster.len()]);
    for i in 0..raster.len() {
        if weight[i] > 0.0 && raster.around(i).iter().all(|&j| weight[j] > 0.0) {
            add(&mut tensor, raster, log, i);
        }
    }
    finished(raster, tensor, weight, 4.0 * USUAL)
}

/// Rows of features as Fourier series, ready to be compared at all headings: frequencies up to the half, since what is
/// transformed is real.
pub(super) struct Spectra {
    /// Each channel times weight.
    channels: [Vec<Complex>; CHANNELS],
    /// Weight times the sum of squares of all channels.
    squares: Vec<Complex>,
}

/// A picture's features made ready to be compared with many models.
pub(super) struct Masked {
    /// From the picture's axes to level ones.
    upright: Mat3,
    mask: Vec<Complex>,
    channels: [Vec<Complex>; CHANNELS],
    sums: [f32; CHANNELS],
    total: f32,
    variance: f32,
}

/// A place and a turn that the features speak for.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) pose: LocalPose,
    /// Correlation of the features, −1..=1.
    pub(super) score: f32,
}

/// Features that vary less than this over a window tell nothing.
const LEAST_VARIANCE: f32 = 1e-3;

/// Fourier transforms along rows.
pub(super) struct Headings {
    pub(super) raster: Raster,
    forward: Radix4<f32>,
    back: Radix4<f32>,
}

impl Headings {
    /// For a sphere that is so many cells round, a power of two.
    pub(super) fn new(full: usize) -> Self {
        let radix4 = |direction| Radix4::new(full, direction);
        let (forward, back) = (radix4(FftDirection::Forward), radix4(FftDirection::Inverse));
        Self { raster: Raster::sphere(full), forward, back }
    }

    fn transformed(&self, values: impl Iterator<Item = f32>) -> Vec<Complex> {
        let mut grid: Vec<Complex> = values.map(|v| Complex::new(v, 0.0)).collect();
        self.forward.process(&mut grid);
        let w = self.raster.width;
        grid.chunks_exact(w).flat_map(|row| row[..w / 2 + 1].iter().copied()).collect()
    }

    /// The model's features from a place, upright.
    pub(super) fn model(&self, scene: &Scene, place: Vec3) -> Spectra {
        let pose = LocalPose { origin: place, rotation: Mat3::IDENTITY };
        let Features { channels, weight } = of_model(scene, &self.raster, &pose);
        let squares = (0..weight.len()).map(|i| weight[i] * channels.iter().map(|c| c[i] * c[i]).sum::<f32>());
        let squares = self.transformed(squares);
        let channels = channels.map(|c| self.transformed(c.iter().zip(&weight).map(|(c, w)| c * w)));
        Spectra { channels, squares }
    }

    /// Correlation at each shift of the product of two, summed over rows: Σ a(x) b(x + s).
    fn correlate(&self, pairs: &[(&[Complex], &[Complex])]) -> Vec<f32> {
        let w = self.raster.width;
        let mut sum = vec![Complex::default(); w];
        for (a, b) in pairs {
            for (a, b) in a.chunks_exact(w / 2 + 1).zip(b.chunks_exact(w / 2 + 1)) {
                for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
                    *s += a.conj() * b;
                }
            }
        }
        // frequencies above the half are conjugates of those below
        for k in 1..w.div_ceil(2) {
            sum[w - k] = sum[k].conj();
        }
        self.back.process(&mut sum);
        sum.iter().map(|v| v.re / w as f32).collect()
    }

    /// Pearson's correlation of the picture's features with the model's for each shift of the model's columns.
    fn compare(&self, masked: &Masked, model: &Spectra) -> Vec<f32> {
        let w = self.raster.width;
        // the model's weights are the rows' solid angles alone, so the picture's mask weighs for both
        let m = &masked.mask;
        let mean = model.channels.each_ref().map(|channel| self.correlate(&[(m, channel)]));
        let squares = self.correlate(&[(m, &model.squares)]);
        let product = self.correlate(&[0, 1, 2].map(|c| (&*masked.channels[c], &*model.channels[c])));
        (0..w)
            .map(|s| {
                let mut covariance = product[s];
                let mut variance = squares[s];
                for (mean, sum) in mean.iter().zip(masked.sums) {
                    covariance -= sum * mean[s] / masked.total;
                    variance -= mean[s] * mean[s] / masked.total;
                }
                // where the model shows next to nothing, rounding must not decide
                if variance < LEAST_VARIANCE * masked.total || masked.variance <= 0.0 {
                    return -1.0;
                }
                covariance / (masked.variance * variance).sqrt()
            })
            .collect()
    }

    /// A picture's features, turned upright. The model's side carries the solid angle, so the picture's side must not.
    pub(super) fn masked(&self, level: &Level, upright: Mat3) -> Masked {
        let f = of_picture(&self.raster, level, upright);
        let n = self.raster.len();
        let seen = |i: usize| if f.weight[i] > 0.0 { 1.0 } else { 0.0 };
        let mask = self.transformed((0..n).map(seen));
        let channels = f.channels.each_ref().map(|c| self.transformed((0..n).map(|i| c[i] * seen(i))));
        let total: f32 = f.weight.iter().sum();
        let sums: [f32; CHANNELS] = std::array::from_fn(|c| (0..n).map(|i| f.channels[c][i] * f.weight[i]).sum());
        let squares: f32 = (0..n).map(|i| f.weight[i] * f.channels.iter().map(|c| c[i] * c[i]).sum::<f32>()).sum();
        let variance = squares - sums.iter().map(|s| s * s).sum::<f32>() / total.max(1e-9);
        Masked { upright, mask, channels, sums, total: total.max(1e-9), variance }
    }

    /// The headings at which an upright picture is most like the model from a place.
    pub(super) fn peaks(&self, picture: &Masked, place: Vec3, model: &Spectra) -> Vec<Candidate> {
        /// Headings kept.
        const PEAKS: usize = 3;
        let w = self.raster.width;
        let scores = self.compare(picture, model);
        let peak = |s: &usize| scores[*s] >= scores[(*s + 1) % w] && scores[*s] >= scores[(*s + w - 1) % w];
        let mut peaks: Vec<usize> = (0..w).filter(peak).collect();
        peaks.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]).then(a.cmp(b)));
        peaks.truncate(PEAKS);
        let candidate = |s: usize| {
            // the model's column x + s shows what the upright picture's column x does: turned right by s columns
            let turn = Mat3::from_rotation_z(-(s as f32) * self.raster.cell_angle());
            Candidate { pose: LocalPose { origin: place, rotation: turn * picture.upright }, score: scores[s] }
        };
        peaks.into_iter().map(candidate).collect()
    }
}

/// How far apart places are tried, metres.
const STEP_M: f32 = 0.35;

/// The model's features from places round a pose.
pub(super) struct Surveyed {
    pub(super) headings: Headings,
    pub(super) origin: Vec3,
    /// By place, local metres.
    models: Vec<(Vec3, Spectra)>,
}

impl Surveyed {
    /// From places round the pose that is given for a picture.
    pub(super) fn round(scene: &Scene, eye: &Eye, radius_m: f32) -> Self {
        let headings = Headings::new(level(&eye.levels, SEARCHED).raster.full);
        let origin = eye.given.origin;
        let models = ball(origin, radius_m).into_par_iter().map(|p| (p, headings.model(scene, p))).collect();
        Self { headings, origin, models }
    }

    /// The poses that a picture's features speak for, at all headings and tilts up to so many degrees about those given: the best
    /// headings of each place and tilt, best first.
    pub(super) fn search(&self, levels: &[Level], given: &Mat3, tilt_deg: f32) -> Vec<Candidate> {
        let level = level(levels, SEARCHED);
        let pictures: Vec<Masked> =
            tilts(given, tilt_deg).par_iter().map(|upright| self.headings.masked(level, *upright)).collect();
        let at = |(place, model): &(Vec3, Spectra)| -> Vec<Candidate> {
            pictures.iter().flat_map(|picture| self.headings.peaks(picture, *place, model)).collect()
        };
        let mut all: Vec<Candidate> = self.models.par_iter().flat_map_iter(at).collect();
        // stable: equals stay in the order of places
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        all
    }
}

/// Places around one, a step apart.
fn ball(middle: Vec3, radius: f32) -> Vec<Vec3> {
    let n = (radius / STEP_M).ceil() as i32;
    let axis = -n..=n;
    let all = axis.clone().flat_map(|x| {
        let axis = axis.clone();
        axis.clone().flat_map(move |y| axis.clone().map(move |z| Vec3::new(x as f32, y as f32, z as f32) * STEP_M))
    });
    all.filter(|p| p.length() <= radius + 0.5 * STEP_M).map(|p| middle + p).collect()
}
