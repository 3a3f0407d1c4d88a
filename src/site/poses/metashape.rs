//! Agisoft Metashape's camera export (`File > Export > Export Cameras`, Agisoft XML).
//!
//! A camera's `transform` takes its axes (x right, y down, z forward) to the chunk's; the chunk's (or component's) takes
//! those to the world's by rotation, translation and scale. The lens is, after Metashape's manual (*Camera models*), with
//! x, y the ideal coordinates: x' = x (1 + k1 r² + …) + p1 (r² + 2x²) + 2 p2 x y, y' alike with p1 and p2 exchanged, and
//! u = w/2 + cx + x' (f + b1) + y' b2, v = h/2 + cy + y' f. So p1 and p2 are OpenCV's in the other order.

use glam::{DMat3, DMat4, DVec2, DVec3, UVec2};
use roxmltree::Node;
use std::collections::BTreeMap;
use std::path::Path;

use super::solved::{Intrinsics, PoseFile, PoseFileError, Result, Similarity, SolvedCamera, text};
use super::xml::{child, damaged, number, numbers, parse, value};
use crate::panorama::{Distortion, Lens};
use crate::site::frame::exact_rotation;

pub(super) fn read(path: &Path) -> Result<PoseFile> {
    let text = text(path)?;
    let document = parse(path, &text)?;
    let root = document.root_element();
    let chunks: Vec<Node> = root.descendants().filter(|n| n.has_tag_name("chunk")).collect();
    let Some(&chunk) = chunks.first() else {
        return Err(damaged(path, root, "expected a <chunk> with cameras (Metashape: File, Export, Export Cameras)"));
    };
    let mut found = PoseFile::default();
    if chunks.len() > 1 {
        found.warnings.push(format!("{} has {} chunks; the first is taken.", path.display(), chunks.len()));
    }
    let reference = child(chunk, "reference").and_then(|n| n.text()).unwrap_or_default().trim();
    found.geocentric = ["GEOGCS", "PROJCS", "GEOCCS", "COMPD_CS"].iter().any(|c| reference.starts_with(c));
    let sensors = sensors(path, chunk)?;
    let whole = child(chunk, "transform").map(|n| similarity(path, n)).transpose()?.flatten();
    let mut components = BTreeMap::new();
    for component in chunk.descendants().filter(|n| n.has_tag_name("component")) {
        if let (Some(id), Some(node)) = (component.attribute("id"), child(component, "transform")) {
            components.insert(id, similarity(path, node)?);
        }
    }
    let mut left_out = Vec::new();
    let cameras = chunk.descendants().filter(|n| n.has_tag_name("camera") && n.attribute("label").is_some());
    for node in cameras {
        let label = node.attribute("label").unwrap_or_default().to_owned();
        let sensor = node.attribute("sensor_id").and_then(|id| sensors.get(id).copied());
        let (Some(text), Some(sensor)) = (child(node, "transform").and_then(|n| n.text()), sensor) else {
            left_out.push(label);
            continue;
        };
        let intrinsics = sensor.map_err(|kind| PoseFileError::Unsupported {
            path: path.into(),
            what: format!("the camera type “{kind}” of {label} is not read here"),
            remedy: "set the camera type to Frame or Equidistant Fisheye, align and export again",
        })?;
        let m = DMat4::from_cols_array(&numbers::<16>(path, node, text)?).transpose();
        let rotation = exact_rotation(DMat3::from_mat4(m))
            .ok_or_else(|| damaged(path, node, "expected a rotation in the camera's transform"))?;
        let camera = SolvedCamera { photo: label, position: m.w_axis.truncate(), rotation, intrinsics };
        let component = node.attribute("component_id").and_then(|id| components.get(id).copied().flatten());
        found.cameras.push(match component.or(whole) {
            Some(to_world) => camera.moved(&to_world),
            None => camera,
        });
    }
    if !left_out.is_empty() {
        found.warnings.push(format!(
            "{} cameras of {} are not aligned, or spherical, and are left out: {}.",
            left_out.len(),
            path.display(),
            super::listed(&left_out)
        ));
    }
    Ok(found)
}

/// What a `<transform>` does; `None` where it is empty.
fn similarity(path: &Path, node: Node) -> Result<Option<Similarity>> {
    let (Some(rows), Some(shift)) = (child(node, "rotation"), child(node, "translation")) else { return Ok(None) };
    let turn: [f64; 9] = numbers(path, rows, rows.text().unwrap_or_default())?;
    let rotation = exact_rotation(DMat3::from_cols_array(&turn).transpose())
        .ok_or_else(|| damaged(path, rows, "expected the rows of a rotation matrix"))?;
    let shift: [f64; 3] = numbers(path, shift, shift.text().unwrap_or_default())?;
    let scale = number(path, node, "scale", 1.0)?;
    if scale <= 0.0 {
        return Err(damaged(path, node, format!("expected a scale above zero, found {scale}")));
    }
    Ok(Some(Similarity { scale, rotation, translation: DVec3::from_array(shift) }))
}

/// The lens of each sensor that photographs of views can have, or its type where that is not read here.
fn sensors<'a>(
    path: &Path,
    chunk: Node<'a, '_>,
) -> Result<BTreeMap<&'a str, std::result::Result<Intrinsics, &'a str>>> {
    let mut sensors = BTreeMap::new();
    for node in chunk.descendants().filter(|n| n.has_tag_name("sensor")) {
        let Some(id) = node.attribute("id") else { continue };
        let lens = match node.attribute("type").unwrap_or("frame") {
            "frame" => Lens::Perspective,
            "fisheye" | "equidistant_fisheye" => Lens::Fisheye,
            "spherical" => continue,
            other => {
                sensors.insert(id, Err(other));
                continue;
            }
        };
        let of = |class: &str| {
            node.children()
                .find(|n| n.has_tag_name("calibration") && n.attribute("class").unwrap_or("adjusted") == class)
        };
        // a sensor without calibration has no aligned camera
        let Some(calibration) = of("adjusted").or_else(|| of("initial")) else { continue };
        sensors.insert(id, Ok(intrinsics(path, node, calibration, lens)?));
    }
    Ok(sensors)
}

fn intrinsics(path: &Path, sensor: Node, node: Node, lens: Lens) -> Result<Intrinsics> {
    let resolution = child(node, "resolution").or_else(|| child(sensor, "resolution"));
    let side = |name| {
        let text = resolution.and_then(|r| value(r, name)).unwrap_or_default();
        text.parse::<u32>().ok().filter(|n| *n > 0).ok_or_else(|| {
            damaged(
                path,
                resolution.unwrap_or(sensor),
                format!("expected the picture's {name} in pixels, found “{text}”"),
            )
        })
    };
    let size = [side("width")?, side("height")?];
    let middle = 0.5 * UVec2::from(size).as_dvec2();
    let of = |name| number(path, node, name, 0.0);
    let (f, fx, fy) = (of("f")?, of("fx")?, of("fy")?);
    // before version 1.3: fx, fy, skew, and cx, cy from the corner
    let old = f == 0.0 && fx > 0.0;
    let (focal, centre, skew) = if old {
        (DVec2::new(fx, if fy > 0.0 { fy } else { fx }), DVec2::new(of("cx")?, of("cy")?), of("skew")?)
    } else {
        (DVec2::new(f + of("b1")?, f), middle + DVec2::new(of("cx")?, of("cy")?), of("b2")?)
    };
    if focal.min_element() <= 0.0 {
        return Err(damaged(path, node, format!("expected a focal length above zero, found {focal}")));
    }
    if of("p3")? != 0.0 || of("p4")? != 0.0 {
        return Err(PoseFileError::Unsupported {
            path: path.into(),
            what: "the lens has the tangential terms p3 and p4, which are not read here".into(),
            remedy: "leave them out of the camera optimisation and export again",
        });
    }
    let distortion = Distortion::brown([of("k1")?, of("k2")?, of("k3")?, of("k4")?], [of("p2")?, of("p1")?]);
    Ok(Intrinsics { size: Some(size), lens, focal, centre, skew, distortion })
}
