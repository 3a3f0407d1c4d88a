//! A site's model as a laser scanner would see it, written as E57: a structured scan per setup, coloured by albedo, and
//! pictures with their poses.

use clerestory::panorama::linear_to_srgb;
use clerestory::scene::{Ray, Scene};
use e57::{
    E57Writer, ImageFormat, PinholeImageProperties, Record, RecordDataType, RecordName, RecordValue,
    SphericalImageProperties, Transform,
};
use glam::{DMat3, DQuat, DVec3, Vec3};
use std::path::Path;

/// Where a scanner stands.
pub(crate) struct Setup {
    /// Metres in the program's axes.
    pub(crate) position: DVec3,
    /// Where its first column looks, degrees anticlockwise from east.
    pub(crate) turned_deg: f64,
}

impl Setup {
    fn rotation(&self) -> DQuat {
        DQuat::from_rotation_z(self.turned_deg.to_radians())
    }

    fn transform(&self) -> Transform {
        transform(self.rotation(), self.position)
    }
}

fn transform(q: DQuat, p: DVec3) -> Transform {
    Transform {
        rotation: e57::Quaternion { w: q.w, x: q.x, y: q.y, z: q.z },
        translation: e57::Translation { x: p.x, y: p.y, z: p.z },
    }
}

/// A picture to put beside the scans.
pub(crate) enum Picture {
    /// Latitude/longitude, as PNG; it was taken at a setup and its centre looks along that one's +x.
    Panorama { png: Vec<u8>, size: [u32; 2], setup: usize },
    /// A pinhole picture as PNG with its focal length in pixels, where it was taken, from the camera's axes (x right, y up) to
    /// the program's, and its mask.
    Pinhole { png: Vec<u8>, size: [u32; 2], focal: f64, position: DVec3, rotation: DMat3, mask: Option<Vec<u8>> },
}

/// Scans `scene` from each setup by `rows` × 2 · `rows` rays and writes an E57 file.
///
/// # Errors
///
/// What the crate says.
pub(crate) fn write(
    path: &Path,
    scene: &Scene,
    setups: &[Setup],
    rows: usize,
    pictures: &[Picture],
) -> Result<(), Box<dyn std::error::Error>> {
    let mut file = E57Writer::from_file(path, "scan")?;
    for (i, setup) in setups.iter().enumerate() {
        let mut scan = file.add_pointcloud(&format!("setup {i}"), prototype(rows))?;
        scan.set_transform(Some(setup.transform()));
        for row in 0..rows {
            for column in 0..2 * rows {
                if let Some(point) = point(scene, setup, row, column, rows) {
                    scan.add_point(point)?;
                }
            }
        }
        scan.finalize()?;
    }
    for (i, picture) in pictures.iter().enumerate() {
        let mut image = file.add_image(&format!("picture {i}"))?;
        match picture {
            Picture::Panorama { png, size: [width, height], setup } => {
                image.set_name(&format!("panorama-{setup}"));
                image.set_transform(setups[*setup].transform());
                let properties = SphericalImageProperties {
                    width: *width,
                    height: *height,
                    pixel_width: std::f64::consts::TAU / f64::from(*width),
                    pixel_height: std::f64::consts::PI / f64::from(*height),
                };
                image.add_spherical(ImageFormat::Png, &mut png.as_slice(), properties, None)?;
            }
            Picture::Pinhole { png, size: [width, height], focal, position, rotation, mask } => {
                image.set_name(&format!("photograph-{i}"));
                image.set_transform(transform(DQuat::from_mat3(rotation), *position));
                let properties = PinholeImageProperties {
                    width: *width,
                    height: *height,
                    focal_length: focal * 1e-5,
                    pixel_width: 1e-5,
                    pixel_height: 1e-5,
                    principal_x: f64::from(*width) / 2.0,
                    principal_y: f64::from(*height) / 2.0,
                };
                let mut mask = mask.as_deref();
                let mask = mask.as_mut().map(|m| m as &mut dyn std::io::Read);
                image.add_pinhole(ImageFormat::Png, &mut png.as_slice(), properties, mask)?;
            }
        }
        image.finalize()?;
    }
    file.finalize()?;
    Ok(())
}

fn prototype(rows: usize) -> Vec<Record> {
    let single = RecordDataType::Single { min: None, max: None };
    let whole = |max: usize| RecordDataType::Integer { min: 0, max: max as i64 };
    let record = |name, data_type| Record { name, data_type };
    vec![
        record(RecordName::CartesianX, single.clone()),
        record(RecordName::CartesianY, single.clone()),
        record(RecordName::CartesianZ, single),
        record(RecordName::ColorRed, whole(255)),
        record(RecordName::ColorGreen, whole(255)),
        record(RecordName::ColorBlue, whole(255)),
        record(RecordName::RowIndex, whole(rows - 1)),
        record(RecordName::ColumnIndex, whole(2 * rows - 1)),
    ]
}

/// What the scanner sees in one direction; nothing where its ray leaves the model.
fn point(scene: &Scene, setup: &Setup, row: usize, column: usize, rows: usize) -> Option<Vec<RecordValue>> {
    let step = std::f64::consts::PI / rows as f64;
    let azimuth = (column as f64 + 0.5) * step;
    let elevation = std::f64::consts::FRAC_PI_2 - (row as f64 + 0.5) * step;
    let local = DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
    let ray = Ray { origin: scene.local(setup.position), direction: (setup.rotation() * local).as_vec3() };
    let hit = scene.tracer.closest(&ray, 0.0)?;
    let surface = scene.surface(&ray, &hit);
    let albedo: Vec3 = scene.albedo(hit.triangle, surface.barycentric);
    let [x, y, z] = (local * f64::from(hit.t)).as_vec3().to_array();
    let [red, green, blue] = albedo.to_array().map(|v| (255.0 * linear_to_srgb(v)).round() as i64);
    Some(vec![
        RecordValue::Single(x),
        RecordValue::Single(y),
        RecordValue::Single(z),
        RecordValue::Integer(red),
        RecordValue::Integer(green),
        RecordValue::Integer(blue),
        RecordValue::Integer(row as i64),
        RecordValue::Integer(column as i64),
    ])
}
