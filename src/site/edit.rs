//! The site file's text with other poses in it: whatever else stands there, comments, blanks and line ends too, stays byte by
//! byte. The parser tells where each value stands; only those bytes are exchanged.

use glam::{DMat3, DQuat, DVec3};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::frame::{Frame, Pose};

/// A probe or view, by name, and the pose that it is to have.
#[derive(Clone, Debug)]
pub struct PoseChange {
    /// The key of its list in the site file: `probe` or `view`.
    pub list: &'static str,
    /// Its name.
    pub name: String,
    /// Its new pose.
    pub pose: Pose,
}

/// A site file's text after [`with_poses`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edited {
    /// The whole text.
    pub text: String,
    /// Poses that do not stand in the site file as numbers, and why, by their place among the changes.
    pub left: Vec<(usize, NotHere)>,
}

/// Why a pose cannot be written into the site file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotHere {
    /// Another program's file has it.
    #[error(
        "its pose comes from the file that [cameras] names. Correct it there, or leave it out of cameras.only and paste the block"
    )]
    Cameras,
    /// It follows from pairs of pixel and point.
    #[error("its pose comes from match pairs. Remove them and paste position and heading")]
    Matches,
}

/// The site file's text cannot be understood.
#[derive(Debug, thiserror::Error)]
#[error("the site file is not TOML: {0}")]
pub struct NotToml(#[from] toml::de::Error);

/// The decimals of lengths in model units that tell 0.1 mm.
pub fn length_decimals(frame: &Frame) -> usize {
    // a little less, so that 0.1 mm in metres is four decimals in spite of rounding
    let decimals = (frame.metres_per_unit * 1e4).log10() - 1e-9;
    if decimals.is_finite() { decimals.ceil().clamp(0.0, 12.0) as usize } else { 4 }
}

/// The decimals of degrees, and those of quaternions and matrices.
const DEGREE_DECIMALS: usize = 3;
const UNIT_DECIMALS: usize = 6;

/// A number with so many decimals at most and one at least; 0 has no sign.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0') } else { &text };
    let whole = text.trim_end_matches('.');
    let whole = if whole == "-0" { "0" } else { whole };
    if whole.contains('.') { whole.to_owned() } else { format!("{whole}.0") }
}

/// Text in quotes, as TOML has it: Rust's own escapes are others.
pub fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A rotation as the site file has it; of its two quaternions the one with w ≥ 0.
pub(crate) fn wxyz(q: DQuat) -> [f64; 4] {
    let q = if q.w < 0.0 { -q } else { q };
    [q.w, q.x, q.y, q.z]
}

/// Position (model's axes and units), heading, pitch and roll (degrees) as the site file has them, rounded to 0.1 mm and
/// 0.001°.
pub fn in_site_file(frame: &Frame, pose: &Pose) -> ([String; 3], [String; 3]) {
    let decimals = length_decimals(frame);
    let position = frame.point_out(pose.position).to_array().map(|v| number(v, decimals));
    let mut bearings = frame.bearings(&pose.rotation).map(|v| number(v, DEGREE_DECIMALS));
    if bearings[0] == "360.0" {
        bearings[0] = "0.0".to_owned();
    }
    (position, bearings)
}

/// The site file's `text` with these poses and nothing else changed. A position is written in the model's axes and units, an
/// orientation in the style that its table has; `look_at` becomes heading, pitch and roll, since it cannot say a roll.
///
/// # Errors
///
/// [`NotToml`] when the text cannot be parsed.
pub fn with_poses(text: &str, frame: &Frame, changes: &[PoseChange]) -> Result<Edited, NotToml> {
    let skipped = text.len() - text.strip_prefix('\u{feff}').unwrap_or(text).len();
    let (mark, body) = text.split_at(skipped);
    let parsed = DeTable::parse(body)?;
    let mut edits = Edits { text: body, all: Vec::new() };
    let mut left = Vec::new();
    for (i, change) in changes.iter().enumerate() {
        match table(parsed.get_ref(), change.list, &change.name) {
            None => left.push((i, NotHere::Cameras)),
            Some(t) if value(t, "position").is_none() && value(t, "match").is_some() => {
                left.push((i, NotHere::Matches));
            }
            Some(t) => edits.pose(t, frame, &change.pose),
        }
    }
    Ok(Edited { text: format!("{mark}{}", edits.applied()), left })
}

/// A named table of a list.
fn table<'a, 'i>(file: &'a DeTable<'i>, list: &str, name: &str) -> Option<&'a Spanned<DeValue<'i>>> {
    let named = |t: &&Spanned<DeValue>| t.get_ref().get("name").and_then(|n| n.get_ref().as_str()) == Some(name);
    file.get(list)?.get_ref().as_array()?.iter().find(named)
}

/// A key with its place, and its value.
fn entry<'a, 'i>(table: &'a Spanned<DeValue<'i>>, key: &str) -> Option<(Range<usize>, &'a Spanned<DeValue<'i>>)> {
    table.get_ref().as_table()?.get_key_value(key).map(|(k, v)| (k.span(), v))
}

fn value<'a, 'i>(table: &'a Spanned<DeValue<'i>>, key: &str) -> Option<&'a Spanned<DeValue<'i>>> {
    entry(table, key).map(|e| e.1)
}

/// What is to be exchanged in a text.
struct Edits<'a> {
    text: &'a str,
    all: Vec<(Range<usize>, String)>,
}

impl Edits<'_> {
    fn replace(&mut self, place: Range<usize>, by: String) {
        self.all.push((place, by));
    }

    fn applied(mut self) -> String {
        // stable: what is put in at one place stays in order
        self.all.sort_by_key(|(place, _)| (place.start, place.end));
        let mut out = String::with_capacity(self.text.len() + 256);
        let mut done = 0;
        for (place, by) in &self.all {
            out += self.text.get(done..place.start).unwrap_or_default();
            out += by;
            done = place.end;
        }
        out + self.text.get(done..).unwrap_or_default()
    }

    fn pose(&mut self, table: &Spanned<DeValue>, frame: &Frame, pose: &Pose) {
        let (position, bearings) = in_site_file(frame, pose);
        let mut after = "position";
        match value(table, "position") {
            Some(list) => self.numbers(list, &position),
            None => {
                self.put(table, "name", &[("position", format!("[{}]", position.join(", ")))]);
                after = "name";
            }
        }
        let from_camera = model_from_camera(frame, &pose.rotation);
        let unit = |v: f64| number(v, UNIT_DECIMALS);
        if let Some(list) = value(table, "rotation") {
            self.numbers(list, &wxyz(DQuat::from_mat3(&from_camera).normalize()).map(unit));
            return;
        }
        if let Some(rows) = value(table, "matrix") {
            let rows = rows.get_ref().as_array().map(|r| r.iter().collect::<Vec<_>>()).unwrap_or_default();
            for (i, row) in rows.into_iter().take(3).enumerate() {
                self.numbers(row, &from_camera.row(i).to_array().map(unit));
            }
            return;
        }
        let [heading, pitch, roll] = bearings;
        let wanted = [("heading", heading), ("pitch", pitch), ("roll", roll)];
        if let Some((key, target)) = entry(table, "look_at") {
            // a level horizon needs no roll
            let kept: Vec<String> = wanted
                .iter()
                .filter(|(key, v)| *key != "roll" || v != "0.0")
                .map(|(key, v)| format!("{key} = {v}"))
                .collect();
            let by = kept.join(&self.separator(table, key.start));
            self.replace(key.start..target.span().end, by);
            return;
        }
        // where a new key goes: behind the last of those there
        let mut missing = Vec::new();
        for (key, v) in wanted {
            match value(table, key) {
                Some(old) => {
                    self.put(table, after, &missing);
                    missing.clear();
                    (after, _) = (key, self.replace(old.span(), v));
                }
                None if v != "0.0" => missing.push((key, v)),
                None => {}
            }
        }
        self.put(table, after, &missing);
    }

    /// Exchanges the numbers of a list one by one: blanks, line ends and comments between them stay.
    fn numbers(&mut self, list: &Spanned<DeValue>, by: &[String]) {
        let Some(old) = list.get_ref().as_array().filter(|a| a.len() == by.len()) else {
            return self.replace(list.span(), format!("[{}]", by.join(", ")));
        };
        for (old, new) in old.iter().zip(by) {
            self.replace(old.span(), new.clone());
        }
    }

    /// Puts new keys behind one that is there.
    fn put(&mut self, table: &Spanned<DeValue>, after: &str, new: &[(&str, String)]) {
        let Some((key, old)) = entry(table, after) else { return };
        let separator = self.separator(table, key.start);
        let end = old.span().end;
        // behind a comment on the same line, if lines part keys
        let rest = self.text.get(end..).unwrap_or_default();
        let line = if separator == ", " { 0 } else { rest.find(['\r', '\n']).unwrap_or(rest.len()) };
        let text: String = new.iter().map(|(key, v)| format!("{separator}{key} = {v}")).collect();
        if !text.is_empty() {
            self.replace(end + line..end + line, text);
        }
    }

    /// What stands between two keys of a table: a comma in braces, else a line end with the indentation of the key at `at`.
    fn separator(&self, table: &Spanned<DeValue>, at: usize) -> String {
        if self.text.get(table.span().start..).is_some_and(|t| t.starts_with('{')) {
            return ", ".to_owned();
        }
        let before = self.text.get(..at).unwrap_or_default();
        let line = before.rfind('\n').map_or(0, |i| i + 1);
        let indentation: String = before[line..].chars().take_while(|c| c.is_whitespace()).collect();
        let end = if before.ends_with("\r\n") || before[..line].ends_with("\r\n") { "\r\n" } else { "\n" };
        format!("{end}{indentation}")
    }
}

/// From the camera's axes as a quaternion or matrix of the site file has them (+x right, +y up, −z forward) to the model's.
fn model_from_camera(frame: &Frame, rotation: &DMat3) -> DMat3 {
    let axis = |v: DVec3| frame.direction_out(*rotation * v);
    DMat3::from_cols(axis(DVec3::X), axis(DVec3::Z), axis(DVec3::NEG_Y))
}

#[cfg(test)]
mod tests;
