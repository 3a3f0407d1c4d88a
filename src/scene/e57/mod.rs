//! Scans from E57 (ASTM E2807, *3D Imaging Data Exchange*), the one door to the crate e57.
//!
//! A structured setup, whose points have rows and columns, becomes a mesh (`grid`) with a picture of its points' colours
//! (`raster`); of what several see, the finest stays (`overlap`). Pictures with poses are listed for `init` to take out (`pictures`). Both are in the
//! file's own axes: metres, z up.

mod distortion;
mod grid;
mod overlap;
mod pictures;
mod raster;

pub use pictures::{ScanPicture, ScanPictures, ScanProjection};

use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordName};
use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};
use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::Wrap;
use super::error::SceneError;
use super::model::{ImportedModel, Map, ModelMaterial, UNKNOWN_ALBEDO, centre};
use crate::site::Frame;
use grid::{Cell, Grid, Placement};
use raster::{Raster, Texel};

type Reader = E57Reader<BufReader<File>>;

/// So many points of all setups together are meshed, and give their colours; of more, rows and columns are left out evenly.
/// Few remain of them where setups overlap.
const MOST_POINTS: u64 = 16_000_000;
const MOST_TEXELS: u64 = 64_000_000;

/// Where a scanner stood.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// In the file's axes, metres.
    pub position: DVec3,
    /// The scanner's own up direction, in the file's axes.
    pub up: DVec3,
}

/// Opens a file; whatever the crate says or panics of becomes one error.
fn opened<T>(path: &Path, work: impl FnOnce(&mut Reader) -> Result<T, SceneError>) -> Result<T, SceneError> {
    let damaged = |problem: String| SceneError::malformed(path, problem);
    File::open(path).map_err(|e| SceneError::io(path, &e))?;
    let done = catch_unwind(AssertUnwindSafe(|| {
        let mut reader = E57Reader::from_file(path).map_err(|e| damaged(decode_error(&e)))?;
        work(&mut reader)
    }));
    done.unwrap_or_else(|_| Err(damaged("the file is damaged: its parts contradict each other".to_owned())))
}

/// The crate's error.
fn decode_error(error: &e57::Error) -> String {
    format!("the file is no valid E57: {error}")
}

fn placement(transform: Option<&e57::Transform>) -> Placement {
    let Some(t) = transform else { return Placement { position: DVec3::ZERO, rotation: DMat3::IDENTITY } };
    let q = DQuat::from_xyzw(t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w);
    // some writers leave all four at 0
    let q = if q.length_squared() > 1e-12 { q.normalize() } else { DQuat::IDENTITY };
    let position = DVec3::new(t.translation.x, t.translation.y, t.translation.z);
    Placement { position, rotation: DMat3::from_quat(q) }
}

/// Where the scanners of all setups with a pose stood.
///
/// # Errors
///
/// A file that cannot be read or is damaged.
pub fn setups(path: &Path) -> Result<Vec<Setup>, SceneError> {
    opened(path, |reader| {
        let clouds = reader.pointclouds();
        let placed = clouds.iter().filter_map(|cloud| cloud.transform.as_ref()).map(|t| placement(Some(t)));
        let finite = placed.filter(|p| p.position.is_finite() && p.rotation.is_finite());
        Ok(finite.map(|p| Setup { position: p.position, up: p.rotation.z_axis }).collect())
    })
}

/// Reads the structured setups of an E57 file as a mesh each.
///
/// # Errors
///
/// A file that cannot be read or is damaged, and one without a structured setup.
pub(super) fn read(path: &Path, frame: &Frame) -> Result<ImportedModel, SceneError> {
    let size = std::fs::metadata(path).map_err(|e| SceneError::io(path, &e))?.len();
    opened(path, |reader| {
        let clouds = reader.pointclouds();
        let (structured, loose): (Vec<&PointCloud>, Vec<&PointCloud>) =
            clouds.iter().filter(|c| c.records > 0).partition(|c| is_structured(c));
        if structured.is_empty() {
            return Err(unstructured(path, &loose, reader.images().len()));
        }
        let all: u64 = structured.iter().map(|c| c.records).fold(0, u64::saturating_add);
        // a point takes a byte at least: a header alone must not keep the machine busy
        if all > size {
            return Err(SceneError::malformed(path, format!("{all} points are announced, more than the file holds")));
        }
        let thin = |most: u64| ((all as f64 / most as f64).sqrt().ceil() as i64).max(1);
        let texel = thin(MOST_TEXELS);
        let steps = Steps { texel, mesh: (thin(MOST_POINTS) as u64).next_multiple_of(texel as u64) as i64 };
        let scans = structured.iter().map(|cloud| scan(reader, cloud, steps)).collect::<Result<Vec<_>, _>>();
        let model = scans.and_then(|scans| joined(path, &scans, frame));
        let mut model = model.map_err(|problem| SceneError::malformed(path, problem))?;
        let mut odd = |sentence: String| model.oddities.others.push(sentence);
        if steps.mesh > 1 {
            let colours = if texel > 1 { format!("every {}", nth(texel)) } else { "all".to_owned() };
            odd(format!(
                "{all} points are more than are meshed: every {} row and column is, with the colours of {colours}.",
                nth(steps.mesh)
            ));
        }
        if !loose.is_empty() {
            odd(format!("{} scans without rows and columns are left out.", loose.len()));
        }
        if structured.iter().any(|c| !c.has_color()) {
            odd("Scans without colours are shaded by their intensity, which is no albedo.".to_owned());
        }
        Ok(model)
    })
}

fn is_structured(cloud: &PointCloud) -> bool {
    let has = |name: &RecordName| cloud.prototype.iter().any(|record| record.name == *name);
    has(&RecordName::RowIndex) && has(&RecordName::ColumnIndex)
}

fn unstructured(path: &Path, loose: &[&PointCloud], pictures: usize) -> SceneError {
    let points: u64 = loose.iter().map(|c| c.records).fold(0, u64::saturating_add);
    let why = match (points, pictures) {
        (0, 0) => "the file holds no points".to_owned(),
        (0, n) => format!("the file holds {n} pictures and no points"),
        _ => format!(
            "its {points} points have no rows and columns, so that nothing tells which of them are neighbours on a surface; \
             export it as structured (gridded) E57 with a scan per setup, or mesh the points in CloudCompare or MeshLab \
             and save that as PLY"
        ),
    };
    SceneError::Empty { path: path.to_owned(), why }
}

/// Every so-manieth row and column of a scan gives colours, and is meshed.
#[derive(Clone, Copy)]
struct Steps {
    texel: i64,
    mesh: i64,
}

/// What a setup saw.
struct Scan {
    grid: Grid,
    colours: Raster,
    at: Placement,
}

/// Reads a setup.
fn scan(reader: &mut Reader, cloud: &PointCloud, steps: Steps) -> Result<Scan, String> {
    let mut simple = reader.pointcloud_simple(cloud).map_err(|e| decode_error(&e))?;
    simple.apply_pose(false);
    let (mut cells, mut texels) = (Vec::new(), Vec::new());
    for point in simple {
        let point = point.map_err(|e| decode_error(&e))?;
        let is_of = |step: i64| point.row % step == 0 && point.column % step == 0;
        let CartesianCoordinate::Valid { x, y, z } = point.cartesian else { continue };
        let local = DVec3::new(x, y, z).as_vec3();
        if !is_of(steps.texel) || !local.is_finite() || local.length_squared() < 1e-8 {
            continue;
        }
        let (Ok(row), Ok(column)) = (i32::try_from(point.row), i32::try_from(point.column)) else {
            return Err(format!("a point is in row {} and column {}", point.row, point.column));
        };
        let colour = point.color.map_or([1.0; 3], |c| [c.red, c.green, c.blue]);
        // what is no number becomes 0
        texels.push(Texel { place: [row, column], colour: colour.map(|v| (255.0 * v).round() as u8) });
        if is_of(steps.mesh) {
            cells.push(Cell { place: [row, column], local });
        }
    }
    let colours = Raster::of(&texels, steps.texel)?;
    let grid = Grid::of(&cells, steps.mesh, colours.columns())?;
    Ok(Scan { grid, colours, at: placement(cloud.transform.as_ref()) })
}

/// All setups as one model, each with a material of its own.
fn joined(path: &Path, scans: &[Scan], frame: &Frame) -> Result<ImportedModel, String> {
    let placed = |at: &Placement, p: Vec3| at.rotation * p.as_dvec3() + at.position;
    let mut model = ImportedModel::default();
    let all = scans.iter().flat_map(|scan| scan.grid.points().iter().map(move |p| placed(&scan.at, *p)));
    model.origin = centre(all, frame);
    let grids: Vec<(&Grid, Placement)> = scans.iter().map(|scan| (&scan.grid, scan.at)).collect();
    for (Scan { grid, colours, at }, mut triangles) in scans.iter().zip(overlap::finest(&grids)) {
        if triangles.is_empty() {
            continue;
        }
        let used = renumbered(&mut triangles, grid.points().len());
        let points = used.iter().map(|i| placed(at, grid.points()[*i as usize]));
        let first = model.add_vertices(points, frame)?;
        let mesh = &mut model.mesh;
        mesh.uvs.extend(used.iter().map(|i| DVec2::from(colours.uv(grid.place(*i))).as_vec2()));
        mesh.materials.extend(std::iter::repeat_n(model.own.len() as u32, triangles.len()));
        mesh.triangles.extend(triangles.into_iter().map(|corners| corners.map(|i| first + i)));
        let material = painted(path, model.own.len(), colours.png()?);
        model.material_names.push(Some(material.name.clone()));
        model.own.push(material);
    }
    model.oddities.vertices = model.mesh.positions.len() as u64;
    Ok(model)
}

/// A setup's material, by its number.
fn painted(path: &Path, number: usize, picture: Vec<u8>) -> ModelMaterial {
    let name = format!("setup {}", number + 1);
    let map = Map {
        name: format!("{name}.png"),
        file: path.to_owned(),
        line: 0,
        plain_albedo: Vec3::splat(UNKNOWN_ALBEDO),
        embedded: Some(picture.into()),
        wrap: [Wrap::Repeat, Wrap::Clamp],
    };
    ModelMaterial { name, albedo: Vec3::ONE, map: Some(map), ..ModelMaterial::default() }
}

/// The ordinal of a step.
fn nth(step: i64) -> String {
    match step {
        2 => "second".to_owned(),
        3 => "third".to_owned(),
        n => format!("{n}th"),
    }
}

/// Numbers the corners of triangles anew, without the points that none has; the old numbers of those that remain.
fn renumbered(triangles: &mut [[u32; 3]], points: usize) -> Vec<u32> {
    let (mut new, mut used) = (vec![u32::MAX; points], Vec::new());
    for corner in triangles.iter_mut().flatten() {
        let number = &mut new[*corner as usize];
        if *number == u32::MAX {
            *number = used.len() as u32;
            used.push(*corner);
        }
        *corner = *number;
    }
    used
}
