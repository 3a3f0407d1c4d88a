//! Error against run time of other programs, measured elsewhere.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

use super::StudyError;
use super::metrics::blocks::Metric;

/// Another program's curve: (seconds a frame on the wall, of all processors; errors), in order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// What made the pictures.
    pub name: String,
    /// Its points.
    pub points: Vec<OutsidePoint>,
    /// What a reader must know.
    pub note: String,
}

/// One point of such a curve, averaged over views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutsidePoint {
    /// Seconds a frame on the wall.
    pub wall_s: f64,
    /// Seconds of processor time a frame.
    pub cpu_s: f64,
    /// RMSE, relative MSE, FLIP.
    errors: [f64; 3],
    /// Whether only some views were measured, and the others carried on by those views' ratio.
    pub carried: bool,
}

impl OutsidePoint {
    /// The error in a metric; `None` where it was not measured.
    pub fn error(&self, metric: Metric) -> Option<f64> {
        match metric {
            Metric::Rmse => Some(self.errors[0]),
            Metric::RelMse => Some(self.errors[1]),
            Metric::Flip => Some(self.errors[2]),
            Metric::Ssim => None,
        }
    }
}

#[derive(Deserialize)]
struct File {
    rows: Vec<Row>,
    #[serde(default)]
    note: String,
}

#[derive(Deserialize)]
struct Row {
    camera: String,
    spp: u32,
    wall_s: f64,
    cpu_s: f64,
    #[serde(flatten)]
    plain: Errors,
    oidn_s: Option<f64>,
    oidn: Option<Errors>,
}

#[derive(Clone, Copy, Deserialize)]
struct Errors {
    rmse: f64,
    relmse_trim: f64,
    flip: f64,
}

impl Errors {
    fn all(self) -> [f64; 3] {
        [self.rmse, self.relmse_trim, self.flip]
    }
}

/// Reads outside figures: JSON with `rows` of `camera` (a view's name), `spp`, `wall_s`, `cpu_s`, `rmse`, `relmse_trim`,
/// `flip`, and, with a denoiser, `oidn_s` (its own seconds) and `oidn` (the same errors after it). Gives a curve for
/// plain path tracing and one with the denoiser, over the views named in `views`.
///
/// # Errors
/// A file that cannot be read, is not such JSON, or knows none of the views.
pub fn read(path: &Path, views: &[String]) -> Result<Vec<Outside>, StudyError> {
    let bad = |why: String| StudyError::Outside { path: path.to_owned(), why };
    let text = std::fs::read_to_string(path).map_err(|e| bad(e.to_string()))?;
    let file: File = serde_json::from_str(&text).map_err(|e| bad(e.to_string()))?;
    let rows: Vec<&Row> = file.rows.iter().filter(|r| views.contains(&r.camera)).collect();
    if rows.is_empty() {
        return Err(bad(format!("it has no row for any of the views {}", views.join(", "))));
    }
    let plain = rows.iter().map(|r| (r.camera.as_str(), r.spp, [r.wall_s, r.cpu_s], r.plain.all()));
    let denoised = rows.iter().filter_map(|r| {
        let (more, errors) = (r.oidn_s?, r.oidn?);
        let busy = r.cpu_s / r.wall_s;
        Some((r.camera.as_str(), r.spp, [r.wall_s + more, r.cpu_s + more * busy], errors.all()))
    });
    let curve = |name: &str, points: Vec<Measured>| Outside {
        name: name.to_owned(),
        points: averaged(&points),
        note: file.note.clone(),
    };
    let mut all = vec![curve("outside path tracing", plain.collect())];
    let denoised: Vec<Measured> = denoised.collect();
    if !denoised.is_empty() {
        all.push(curve("outside path tracing with denoiser", denoised));
    }
    Ok(all)
}

/// A view, samples a pixel, seconds (wall, processor), errors.
type Measured<'a> = (&'a str, u32, [f64; 2], [f64; 3]);

/// Means over views at each number of samples. Where only some views have a number, the last mean is carried on by the
/// ratio that those views show.
fn averaged(rows: &[Measured]) -> Vec<OutsidePoint> {
    let mut by_samples: BTreeMap<u32, Vec<&Measured>> = BTreeMap::new();
    for row in rows {
        by_samples.entry(row.1).or_default().push(row);
    }
    let views = by_samples.values().map(Vec::len).max().unwrap_or(0);
    let values = |r: &Measured| [r.2[0], r.2[1], r.3[0], r.3[1], r.3[2]];
    let mean = |rows: &[&Measured]| -> [f64; 5] {
        std::array::from_fn(|k| rows.iter().map(|r| values(r)[k]).sum::<f64>() / rows.len() as f64)
    };
    let mut points: Vec<OutsidePoint> = Vec::new();
    let mut last: Option<(u32, [f64; 5])> = None;
    for (&samples, rows) in &by_samples {
        let here = mean(rows);
        let (value, carried) = match last {
            Some((before, value)) if rows.len() < views => {
                let same: Vec<&Measured> =
                    by_samples[&before].iter().filter(|b| rows.iter().any(|r| r.0 == b.0)).copied().collect();
                if same.len() < rows.len() {
                    continue;
                }
                let there = mean(&same);
                (std::array::from_fn(|k| value[k] * here[k] / there[k]), true)
            }
            None if rows.len() < views => continue,
            _ => (here, false),
        };
        let [wall_s, cpu_s, a, b, c] = value;
        points.push(OutsidePoint { wall_s, cpu_s, errors: [a, b, c], carried });
        last = Some((samples, value));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_that_goes_further_carries_the_mean_on() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let row = |camera: &str, spp: u32, flip: f64| {
            serde_json::json!({"camera": camera, "spp": spp, "wall_s": spp, "cpu_s": 2 * spp, "rmse": flip,
                "relmse_trim": flip, "flip": flip, "oidn_s": 0.5, "oidn": {"rmse": 0.1, "relmse_trim": 0.1, "flip": flip / 2.0}})
        };
        let rows =
            serde_json::json!({"rows": [row("a", 1, 0.8), row("b", 1, 0.4), row("a", 4, 0.4), row("other", 1, 9.0)]});
        std::fs::write(file.path(), rows.to_string()).unwrap();
        let views = ["a".to_owned(), "b".to_owned()];
        let curves = read(file.path(), &views).unwrap();
        assert_eq!(curves.len(), 2);
        let points = &curves[0].points;
        assert_eq!((points.len(), points[0].carried, points[1].carried), (2, false, true));
        assert!((points[0].error(Metric::Flip).unwrap() - 0.6).abs() < 1e-12);
        assert!((points[1].error(Metric::Flip).unwrap() - 0.3).abs() < 1e-12, "0.6 · 0.4/0.8");
        assert!((curves[1].points[0].wall_s - 1.5).abs() < 1e-12 && (curves[1].points[0].cpu_s - 3.0).abs() < 1e-12);
        let strangers = read(file.path(), &["nobody".to_owned()]);
        assert!(strangers.unwrap_err().to_string().contains("nobody"));
    }
}
