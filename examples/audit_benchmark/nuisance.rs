//! What happens to a photograph, a pose or a probe without the model being wrong.

use clerestory::panorama::{Picture, linear_to_srgb, srgb_to_linear};
use clerestory::site::Camera;
use glam::{DMat3, DVec3, Vec3};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nuisance {
    Clean,
    Exposure(f32),
    WhiteBalance,
    Noise(f32),
    Jpeg(u8),
    Pose(f64),
    Distortion,
    Vignetting,
    Probes(usize),
    Drift,
    All,
}

impl Nuisance {
    pub const EACH: [Self; 16] = [
        Self::Clean,
        Self::Exposure(2.0),
        Self::Exposure(-2.0),
        Self::WhiteBalance,
        Self::Noise(0.02),
        Self::Jpeg(85),
        Self::Jpeg(60),
        Self::Pose(0.5),
        Self::Pose(1.0),
        Self::Pose(3.0),
        Self::Distortion,
        Self::Vignetting,
        Self::Probes(1),
        Self::Probes(2),
        Self::Drift,
        Self::All,
    ];

    pub fn title(self) -> String {
        match self {
            Self::Exposure(e) => format!("exposure {e:+.0} EV"),
            Self::Noise(s) => format!("noise {:.0} %", s * 100.0),
            Self::Jpeg(q) => format!("JPEG {q}"),
            Self::Pose(p) => format!("pose {p} px"),
            Self::Probes(n) => format!("{n} probes"),
            other => format!("{other:?}").to_lowercase(),
        }
    }

    /// How many probes are left.
    pub fn probes(self) -> usize {
        if let Self::Probes(n) = self { n } else { usize::MAX }
    }

    /// Gain of a probe's picture.
    pub fn gain(self, probe: usize) -> Vec3 {
        match self {
            Self::Drift | Self::All => {
                let ev = [0.25, -0.2, 0.1, -0.3][probe % 4];
                Vec3::splat(f32::exp2(ev))
                    * [Vec3::ONE, Vec3::new(1.04, 1.0, 0.95), Vec3::new(0.96, 1.0, 1.05)][probe % 3]
            }
            _ => Vec3::ONE,
        }
    }

    /// The photograph as it would have been taken.
    pub fn photograph(self, truth: &Picture) -> Picture {
        let mut p = truth.clone();
        let (w, h) = (p.width, p.height);
        let each = |p: &mut Picture, f: &dyn Fn(usize, Vec3) -> Vec3| {
            for (i, v) in p.pixels.iter_mut().enumerate() {
                *v = f(i, *v);
            }
        };
        match self {
            Self::Exposure(ev) => each(&mut p, &|_, v| v * f32::exp2(ev)),
            Self::WhiteBalance => each(&mut p, &|_, v| v * Vec3::new(1.2, 1.0, 0.8)),
            Self::Noise(s) => each(&mut p, &|i, v| v * (Vec3::ONE + normal(i) * s)),
            Self::Vignetting => each(&mut p, &|i, v| v * (1.0 - 0.35 * radius2(i, w, h))),
            Self::Jpeg(q) => p = jpeg(&p, q),
            Self::All => {
                each(&mut p, &|i, v| {
                    v * Vec3::new(1.1, 1.0, 0.92) * (1.0 - 0.2 * radius2(i, w, h)) * (Vec3::ONE + normal(i) * 0.01)
                });
                p = jpeg(&p, 85);
            }
            _ => {}
        }
        p
    }

    /// The camera as the site would have it.
    pub fn camera(self, truth: &Camera, depth_m: f64) -> Camera {
        match self {
            Self::Pose(px) => shifted(truth, px, depth_m),
            Self::All => shifted(truth, 1.0, depth_m),
            Self::Distortion => {
                let mut c = *truth;
                // a pixel and a half at the sides of 512
                let at = 0.5 * f64::from(c.width) / c.focal.x;
                c.distortion = c.distortion.bent(0.003 * f64::from(c.width) / (c.focal.x * at * at * at));
                c
            }
            _ => *truth,
        }
    }
}

/// A camera turned and moved so that its picture shifts by about so many pixels.
fn shifted(truth: &Camera, px: f64, depth_m: f64) -> Camera {
    let mut c = *truth;
    let angle = 0.75 * px / c.focal.x;
    c.pose.rotation *= DMat3::from_rotation_z(angle * 0.8) * DMat3::from_rotation_x(-angle * 0.6);
    c.pose.position += c.pose.rotation * DVec3::new(0.5, 0.2, -0.4) * px / c.focal.x * depth_m;
    c
}

fn radius2(i: usize, w: usize, h: usize) -> f32 {
    let (x, y) = ((i % w) as f32 - 0.5 * w as f32, (i / w) as f32 - 0.5 * h as f32);
    (x * x + y * y) / (0.25 * (w * w + h * h) as f32)
}

/// Three standard normal numbers, a function of the index.
fn normal(i: usize) -> Vec3 {
    let uniform = |k: u64| {
        let mut z = (i as u64 * 6 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    };
    let one = |k: u64| (-2.0 * uniform(k).max(1e-7).ln()).sqrt() * (std::f32::consts::TAU * uniform(k + 1)).cos();
    Vec3::new(one(0), one(2), one(4))
}

/// Exposed so that 2 % of the pixels are clipped, stored with 8 bits and this quality, and read back.
fn jpeg(p: &Picture, quality: u8) -> Picture {
    let mut all: Vec<f32> = p.pixels.iter().map(|v| v.max_element()).collect();
    let at = all.len() * 98 / 100;
    let white = *all.select_nth_unstable_by(at, f32::total_cmp).1;
    let bytes: Vec<u8> = p
        .pixels
        .iter()
        .flat_map(|v| (*v / white).to_array().map(|c| (linear_to_srgb(c.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8))
        .collect();
    let mut file = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, quality);
    image::ImageEncoder::write_image(encoder, &bytes, p.width as u32, p.height as u32, image::ExtendedColorType::Rgb8)
        .expect("a JPEG is written to memory");
    let back = image::load_from_memory(&file).expect("a JPEG reads back").into_rgb8();
    // as the program reads 8-bit files: what is clipped or darker than code 10 cannot be used
    let light = |c: [u8; 3]| match c {
        c if c.iter().any(|b| *b >= 252) => Vec3::NAN,
        c if c.iter().all(|b| *b < 10) => Vec3::ZERO,
        c => Vec3::from(c.map(|b| srgb_to_linear(f32::from(b) / 255.0))),
    };
    let pixels = back.pixels().map(|c| light(c.0)).collect();
    Picture { width: p.width, height: p.height, pixels }
}
