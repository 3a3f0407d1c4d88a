//! The cube cross: six perspective faces unfolded.

use glam::{DVec2, DVec3};

use crate::panorama::lens::camera_model::rectangle;

/// One face as it lies in the cross, seen from inside.
struct Face {
    column: f64,
    row: f64,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

const fn face(column: f64, row: f64, forward: DVec3, right: DVec3, up: DVec3) -> Face {
    Face { column, row, forward, right, up }
}

const UP: Face = face(1.0, 0.0, DVec3::Z, DVec3::X, DVec3::NEG_Y);
const LEFT: Face = face(0.0, 1.0, DVec3::NEG_X, DVec3::Y, DVec3::Z);
const FRONT: Face = face(1.0, 1.0, DVec3::Y, DVec3::X, DVec3::Z);
const RIGHT: Face = face(2.0, 1.0, DVec3::X, DVec3::NEG_Y, DVec3::Z);
const DOWN: Face = face(1.0, 2.0, DVec3::NEG_Z, DVec3::X, DVec3::Y);
const BACK_BELOW: Face = face(1.0, 3.0, DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z);
const BACK_BESIDE: Face = face(3.0, 1.0, DVec3::NEG_Y, DVec3::NEG_X, DVec3::Z);

static VERTICAL: [Face; 6] = [FRONT, RIGHT, LEFT, UP, DOWN, BACK_BELOW];
static HORIZONTAL: [Face; 6] = [FRONT, RIGHT, LEFT, UP, DOWN, BACK_BESIDE];

/// The faces of a cross of this shape and a face's size in pixels.
fn unfolded(width: usize, height: usize) -> (&'static [Face; 6], DVec2) {
    let (w, h) = (width as f64, height as f64);
    if width > height { (&HORIZONTAL, DVec2::new(w / 4.0, h / 3.0)) } else { (&VERTICAL, DVec2::new(w / 3.0, h / 4.0)) }
}

/// Which of the six faces, in 0..6, holds pixel coordinates.
pub(crate) fn face_at(width: usize, height: usize, x: f64, y: f64) -> Option<usize> {
    let (faces, size) = unfolded(width, height);
    let (column, row) = (x / size.x, y / size.y);
    let holds = |start: f64, at: f64| start <= at && at <= start + 1.0;
    faces.iter().position(|f| holds(f.column, column) && holds(f.row, row))
}

pub(crate) fn direction(width: usize, height: usize, x: f64, y: f64) -> Option<DVec3> {
    let (faces, size) = unfolded(width, height);
    let face = &faces[face_at(width, height, x, y)?];
    let a = 2.0 * (x / size.x - face.column) - 1.0;
    let b = 1.0 - 2.0 * (y / size.y - face.row);
    Some((face.forward + face.right * a + face.up * b).normalize())
}

pub(crate) fn pixel(width: usize, height: usize, d: DVec3) -> DVec2 {
    let (faces, size) = unfolded(width, height);
    let nearer = |best: &'static Face, f: &'static Face| if d.dot(f.forward) > d.dot(best.forward) { f } else { best };
    let face = faces.iter().fold(&faces[0], nearer);
    let depth = d.dot(face.forward);
    let (a, b) = (d.dot(face.right) / depth, d.dot(face.up) / depth);
    DVec2::new(face.column + 0.5 * (a + 1.0), face.row + 0.5 * (1.0 - b)) * size
}

/// A pixel that lies across faces counts with its part on each, so that all sum to 4π at any picture size.
pub(crate) fn solid_angle(width: usize, height: usize, x: usize, y: usize) -> f64 {
    let (faces, size) = unfolded(width, height);
    let span = |at: usize, size: f64, start: f64| {
        let edge = |at: usize| (2.0 * (at as f64 / size - start) - 1.0).clamp(-1.0, 1.0);
        (edge(at), edge(at + 1))
    };
    let part = |face: &Face| {
        let (a0, a1) = span(x, size.x, face.column);
        let (b0, b1) = span(y, size.y, face.row);
        if a1 > a0 && b1 > b0 { rectangle(a0, a1, b0, b1) } else { 0.0 }
    };
    faces.iter().map(part).sum()
}
