//! Materials from MTL files, forgiving where exporters differ; what is odd becomes a warning with its line.

use glam::Vec3;
use std::path::Path;

use super::Wrap;
use super::model::{Channel, Cutout, Map, ModelMaterial, UNKNOWN_ALBEDO};

/// Reads the text of an MTL file. `warnings` gets a sentence for each oddity.
pub(super) fn read(path: &Path, text: &str, warnings: &mut Vec<String>) -> Vec<ModelMaterial> {
    let mut reader = Reader { path, line: 0, kd_given: false, warnings };
    let mut materials: Vec<ModelMaterial> = Vec::new();
    for (line, statement) in statements(text) {
        reader.line = line;
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((&statement, ""));
        let (keyword, rest) = (keyword.to_ascii_lowercase(), rest.trim());
        if keyword == "newmtl" {
            reader.finish(materials.last_mut());
            materials.push(reader.start(rest));
        } else if let Some(material) = materials.last_mut() {
            reader.statement(material, &keyword, rest);
        } else if matches!(keyword.as_str(), "kd" | "ke" | "map_kd") {
            reader.warn(&format!("{keyword} comes before any newmtl and is ignored"));
        }
    }
    reader.finish(materials.last_mut());
    materials
}

/// Lines without comments, continuations joined, with the number of their first line.
fn statements(text: &str) -> impl Iterator<Item = (usize, String)> + '_ {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut statement = first.trim().to_owned();
        while let Some(begun) = statement.strip_suffix('\\') {
            // a Windows path may end in a backslash only by mistake; joining is what the format says
            statement = format!("{begun} {}", lines.next().map_or("", |(_, l)| l.trim()));
        }
        Some((number + 1, statement.trim().to_owned()))
    })
    .filter(|(_, s)| !s.is_empty() && !s.starts_with('#'))
}

struct Reader<'a> {
    path: &'a Path,
    line: usize,
    kd_given: bool,
    warnings: &'a mut Vec<String>,
}

impl Reader<'_> {
    fn warn(&mut self, what: &str) {
        self.warnings.push(format!("{}:{}: {what}.", self.path.display(), self.line));
    }

    fn start(&mut self, name: &str) -> ModelMaterial {
        self.kd_given = false;
        if name.is_empty() {
            self.warn("newmtl without a name");
        }
        ModelMaterial { name: name.to_owned(), albedo: Vec3::splat(UNKNOWN_ALBEDO), ..ModelMaterial::default() }
    }

    /// Settles what needs the whole material.
    fn finish(&mut self, material: Option<&mut ModelMaterial>) {
        let Some(material) = material else { return };
        let Some(map) = &mut material.map else { return };
        map.plain_albedo = material.albedo;
        // the picture that paints has holes only by its alpha: dark paint is none
        if let Some(cutout) = &mut material.cutout
            && cutout.channel == Channel::Either
            && cutout.map.as_ref().is_some_and(|own| own.name == map.name)
        {
            cutout.channel = Channel::Alpha;
        }
        if !self.kd_given {
            material.albedo = Vec3::ONE;
        } else if material.albedo == Vec3::ZERO {
            map.plain_albedo = Vec3::splat(UNKNOWN_ALBEDO);
            material.albedo = Vec3::ONE;
            self.line = map.line;
            self.warn(&format!(
                "material “{}” has Kd 0 0 0 beside a picture, a known exporter's fault; Kd is taken as 1",
                material.name
            ));
        }
    }

    fn statement(&mut self, material: &mut ModelMaterial, keyword: &str, rest: &str) {
        match keyword {
            "kd" => {
                if let Some(kd) = self.colour(&material.name, "Kd", rest) {
                    self.kd_given = true;
                    material.albedo = self.reflectance(&material.name, kd);
                }
            }
            "ke" => {
                if let Some(ke) = self.colour(&material.name, "Ke", rest) {
                    material.emission = ke.max(Vec3::ZERO);
                    if ke.min_element() < 0.0 {
                        self.warn(&format!("material “{}” has a negative Ke, taken as 0", material.name));
                    }
                }
            }
            "map_kd" => material.map = self.map(&material.name, "map_Kd", rest),
            "d" | "tr" => {
                let value = rest.split_whitespace().filter_map(number).next_back();
                let clear = value.is_some_and(|v| if keyword == "d" { v < 1.0 } else { v > 0.0 });
                // some exporters write Tr 1 for opaque beside d 1: only a lone d or Tr below 1 is surely clear
                if clear && !(keyword == "tr" && value == Some(1.0)) {
                    self.warn(&format!(
                        "material “{}” is transparent ({keyword} {rest}), which is not modelled: it is taken as opaque",
                        material.name
                    ));
                }
            }
            "map_d" => {
                let (map, channel) = (self.map(&material.name, keyword, rest), channel(rest));
                material.cutout = map.map(|map| Cutout { map: Some(map), channel, factor: 1.0, cutoff: 0.5 });
            }
            "map_ke" => self.warn(&format!("material “{}” has {keyword}, which is not modelled", material.name)),
            _ => {}
        }
    }

    /// One or three numbers.
    fn colour(&mut self, material: &str, keyword: &str, rest: &str) -> Option<Vec3> {
        let numbers: Vec<f32> = rest.split_whitespace().map_while(number).collect();
        match numbers[..] {
            [r, g, b, ..] => Some(Vec3::new(r, g, b)),
            // the format lets one number stand for all three
            [grey] => Some(Vec3::splat(grey)),
            [r, g] => {
                self.warn(&format!(
                    "material “{material}” has {keyword} with two numbers; the third is taken as the second"
                ));
                Some(Vec3::new(r, g, g))
            }
            [] => {
                self.warn(&format!(
                    "material “{material}” has “{keyword} {rest}”; expected three numbers, so it is ignored"
                ));
                None
            }
        }
    }

    fn reflectance(&mut self, material: &str, kd: Vec3) -> Vec3 {
        let clamped = kd.clamp(Vec3::ZERO, Vec3::ONE);
        if clamped != kd {
            self.warn(&format!(
                "material “{material}” has Kd {} {} {}; a surface reflects between 0 and 1, so it is clamped",
                kd.x, kd.y, kd.z
            ));
        }
        clamped
    }

    /// The picture that a `map_` statement names after its options; the name may hold blanks.
    fn map(&mut self, material: &str, keyword: &str, rest: &str) -> Option<Map> {
        let (options, name) = split_options(rest);
        let turned = options.iter().any(|(option, values)| {
            let same = if option == "-s" { 1.0 } else { 0.0 };
            matches!(option.as_str(), "-s" | "-o" | "-t") && values.iter().filter_map(|v| number(v)).any(|v| v != same)
        });
        if turned {
            self.warn(&format!(
                "material “{material}” scales or shifts its picture by -s or -o, which is not modelled"
            ));
        }
        let name = name.trim().trim_matches('"');
        if name.is_empty() {
            self.warn(&format!("material “{material}” has a {keyword} without a file name"));
            return None;
        }
        let clamped = options.iter().any(|(option, values)| option == "-clamp" && values == &["on"]);
        let wrap = [if clamped { Wrap::Clamp } else { Wrap::Repeat }; 2];
        Some(Map { name: name.to_owned(), file: self.path.to_owned(), line: self.line, wrap, ..Map::default() })
    }
}

/// A finite number.
fn number(text: &str) -> Option<f32> {
    text.parse().ok().filter(|v: &f32| v.is_finite())
}

/// What of its picture a `map_d` asks for: by `-imfchan` alpha is `m`, and all else a colour.
fn channel(rest: &str) -> Channel {
    let asked = split_options(rest).0.into_iter().find(|(option, _)| option == "-imfchan");
    match asked.as_ref().and_then(|(_, words)| words.first().copied()) {
        None => Channel::Either,
        Some("m") => Channel::Alpha,
        Some(_) => Channel::Grey,
    }
}

/// Options in small letters with their words, and what follows them.
fn split_options(rest: &str) -> (Vec<(String, Vec<&str>)>, &str) {
    let mut options = Vec::new();
    let mut rest = rest.trim_start();
    while rest.starts_with('-') {
        let (option, after) = next_word(rest);
        let option = option.to_ascii_lowercase();
        // words that each option takes: (always, at most as long as they are numbers)
        let (words, numbers) = match option.as_str() {
            "-o" | "-s" | "-t" => (0, 3),
            "-mm" => (0, 2),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan" | "-type" | "-colorspace" | "-texres" => (1, 0),
            "-bm" | "-boost" => (0, 1),
            _ => break,
        };
        rest = after;
        let mut values = Vec::new();
        while values.len() < words || values.len() < numbers && number(next_word(rest).0).is_some() {
            let (word, after) = next_word(rest);
            values.push(word);
            rest = after;
        }
        options.push((option, values));
    }
    (options, rest)
}

fn next_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}
