//! Walks: a camera led through key frames, for `render --path`.

use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;
use std::path::Path;
use toml::Spanned;

use super::fault::{SiteError, Source};
use super::file::KeyFrameTable;
use super::numbers::List;
use super::pose::{finite, finite_number};
use super::{Camera, CameraSource, Pose, Site, View};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WalkFile {
    path: Table,
    key: Vec<Spanned<KeyFrameTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    frames: Spanned<u32>,
    size: Option<List<u32, 2>>,
    fov_y: Option<f64>,
    #[serde(default)]
    ease: bool,
}

/// A key frame.
#[derive(Clone, Copy, Debug)]
struct Key {
    position: DVec3,
    turn: DQuat,
    fov_y: f64,
    /// When it comes, 0..=1.
    at: f64,
}

/// Reads a walk and gives its frames as views named `frame_0001` and so on. Key frames come in proportion to the way and the
/// turn between them; places and fields of view run along monotone cubics (Fritsch and Carlson, *Monotone piecewise cubic
/// interpolation*, 1980), which never swing out past a key frame into a wall, turns the short way round (Shoemake, *Animating
/// rotation with quaternion curves*, 1985: slerp).
///
/// # Errors
///
/// A file that cannot be read, or the first fault with its place.
pub fn walk(site: &Site, path: &Path) -> Result<Vec<View>, SiteError> {
    let text = std::fs::read_to_string(path).map_err(|e| SiteError::Unreadable {
        path: path.to_owned(),
        why: e.to_string(),
        help: "Name a TOML file with a [path] and its [[key]] frames".to_owned(),
    })?;
    let source = Source { path, text: &text };
    let file: WalkFile = toml::from_str(&text).map_err(|e| source.parse_fault(&e))?;
    let Table { frames, size, fov_y, ease } = file.path;
    let (count, size) = (*frames.get_ref(), size.map_or([512, 512], |s| *s));
    if !(1..=100_000).contains(&count) || !size.iter().all(|s| (1..=16_384).contains(s)) {
        return Err(source.fault(
            frames.span(),
            "expected 1 to 100000 frames of 1 to 16384 pixels a side",
            "Correct frames or size",
        ));
    }
    let mut keys =
        file.key.iter().map(|k| key(site, &source, k, fov_y.unwrap_or(60.0))).collect::<Result<Vec<_>, _>>()?;
    time(&mut keys);
    if keys.is_empty() {
        return Err(source.fault(frames.span(), "a walk without key frames", "Add [[key]] tables"));
    }
    let frame = |i: u32| {
        let t = if count > 1 { f64::from(i) / f64::from(count - 1) } else { 0.0 };
        let (pose, fov_y) = at(&keys, if ease { t * t * (3.0 - 2.0 * t) } else { t });
        View {
            name: format!("frame_{:04}", i + 1),
            camera: Camera::with_fov(pose, size[0], size[1], fov_y),
            photo: None,
            mask: None,
            matches: Vec::new(),
            source: CameraSource::SiteFile,
        }
    };
    Ok((0..count).map(frame).collect())
}

fn key(site: &Site, source: &Source, table: &Spanned<KeyFrameTable>, usual_fov: f64) -> Result<Key, SiteError> {
    let k = table.get_ref();
    let fov_y = k.fov_y.as_ref().map_or(Ok(usual_fov), |fov| finite_number(source, fov))?;
    if !(1.0..=170.0).contains(&fov_y) {
        return Err(source.fault(table.span(), format!("a field of view of {fov_y}°"), "Give fov_y from 1 to 170"));
    }
    let pose = match (&k.view, &k.position) {
        (Some(name), None) => {
            let known = site.views.iter().find(|v| v.name == *name.get_ref());
            known.map(|v| v.camera.pose).ok_or_else(|| {
                let names: Vec<_> = site.views.iter().map(|v| v.name.as_str()).collect();
                let problem = format!("the site has no view “{}”", name.get_ref());
                source.fault(name.span(), problem, format!("The site's views: {}", names.join(", ")))
            })?
        }
        (None, Some(position)) => k.orientation().pose(source, &site.frame, finite(source, position)?)?,
        _ => {
            let help = "Give each key frame a position with an orientation, or the name of a view";
            return Err(source.fault(table.span(), "expected either a position or a view", help));
        }
    };
    Ok(Key { position: pose.position, turn: DQuat::from_mat3(&pose.rotation).normalize(), fov_y, at: 0.0 })
}

/// Says when each key frame comes, and turns each quaternion to the half that is nearer to the last one's.
fn time(keys: &mut [Key]) {
    /// A whole turn takes as long as so many metres.
    const METRES_PER_RADIAN: f64 = 1.0;
    let mut way = 0.0;
    for i in 1..keys.len() {
        let (last, key) = (keys[i - 1], &mut keys[i]);
        if last.turn.dot(key.turn) < 0.0 {
            key.turn = -key.turn;
        }
        way += key.position.distance(last.position) + METRES_PER_RADIAN * last.turn.angle_between(key.turn) + 1e-9;
        key.at = way;
    }
    keys.iter_mut().for_each(|k| k.at /= f64::max(way, f64::MIN_POSITIVE));
}

/// The camera at a time, 0..=1.
fn at(keys: &[Key], t: f64) -> (Pose, f64) {
    let last = keys.len() - 1;
    let i = keys.partition_point(|k| k.at <= t).saturating_sub(1).min(last.saturating_sub(1));
    let (a, b) = (keys[i], keys[(i + 1).min(last)]);
    let u = if b.at > a.at { ((t - a.at) / (b.at - a.at)).clamp(0.0, 1.0) } else { 0.0 };
    let along = |of: &dyn Fn(&Key) -> f64| monotone(keys, i, u, of);
    let position = DVec3::from([0, 1, 2].map(|c| along(&|k| k.position[c])));
    // the short way round from each key frame to the next: splines of quaternions swing where turns are wide
    let turn = a.turn.slerp(b.turn, u);
    let pose = Pose { position, rotation: DMat3::from_quat(turn.normalize()) };
    (pose, along(&|k| k.fov_y))
}

/// The monotone cubic through key frames, a share `u` of the way from number `i` to the next.
fn monotone(keys: &[Key], i: usize, u: f64, of: &dyn Fn(&Key) -> f64) -> f64 {
    let last = keys.len() - 1;
    if last == 0 {
        return of(&keys[0]);
    }
    let slope = |k: usize| (of(&keys[k + 1]) - of(&keys[k])) / (keys[k + 1].at - keys[k].at);
    let tangent = |k: usize| {
        let (before, after) = (slope(k.saturating_sub(1)), slope(k.min(last - 1)));
        // the harmonic mean; flat at a turning point
        if before * after > 0.0 { 2.0 * before * after / (before + after) } else { 0.0 }
    };
    let width = keys[i + 1].at - keys[i].at;
    let (p, q, m, n) = (of(&keys[i]), of(&keys[i + 1]), tangent(i) * width, tangent(i + 1) * width);
    let (u2, u3) = (u * u, u * u * u);
    p * (2.0 * u3 - 3.0 * u2 + 1.0) + m * (u3 - 2.0 * u2 + u) + q * (3.0 * u2 - 2.0 * u3) + n * (u3 - u2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(at: &[(f64, f64)]) -> Vec<Key> {
        let key = |&(x, turn): &(f64, f64)| Key {
            position: DVec3::new(x, 0.0, 1.6),
            turn: DQuat::from_rotation_z(turn),
            fov_y: 60.0,
            at: 0.0,
        };
        let mut keys: Vec<Key> = at.iter().map(key).collect();
        time(&mut keys);
        keys
    }

    #[test]
    fn a_walk_meets_its_key_frames_and_never_swings_past_them() {
        let keys = keys(&[(0.0, 0.0), (4.0, 0.5), (4.5, 3.0), (4.5, -3.0), (1.0, 0.0)]);
        for k in &keys {
            let (pose, _) = at(&keys, k.at);
            assert!(pose.position.distance(k.position) < 1e-9);
            assert!(DQuat::from_mat3(&pose.rotation).dot(k.turn).abs() > 1.0 - 1e-9);
        }
        let all: Vec<Pose> = (0..=1000).map(|i| at(&keys, f64::from(i) / 1000.0).0).collect();
        for w in all.windows(2) {
            assert!(w[0].position.distance(w[1].position) < 0.05 && (0.0..=4.5).contains(&w[1].position.x));
            assert!(
                w[0].rotation.y_axis.angle_between(w[1].rotation.y_axis) < 0.05,
                "no jump over the short way round"
            );
        }
    }
}
