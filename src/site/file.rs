//! The site file's keys, and nothing else: this is the one place that knows them.

use glam::DVec3;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt;
use toml::Spanned;

use super::VertexColours;
use super::numbers::List;

type Number = Spanned<f64>;
pub(super) type Text = Spanned<String>;
pub(super) type Vector = Spanned<List<f64, 3>>;
pub(super) type Pair = Spanned<List<f64, 2>>;
pub(super) type Quaternion = Spanned<List<f64, 4>>;
pub(super) type Matrix = Spanned<List<List<f64, 3>, 3>>;

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SiteFile {
    #[serde(default)]
    pub(super) site: SiteTable,
    #[serde(default)]
    pub(super) project: ProjectTable,
    pub(super) model: ModelTable,
    pub(super) environment: Option<Spanned<EnvironmentTable>>,
    pub(super) sun: Option<SunTable>,
    pub(super) cameras: Option<Spanned<CamerasTable>>,
    #[serde(default)]
    pub(super) probe: Vec<Spanned<ProbeTable>>,
    #[serde(default)]
    pub(super) view: Vec<Spanned<ViewTable>>,
    #[serde(default)]
    pub(super) plan: PlanTable,
}

#[derive(serde::Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct SiteTable {
    pub(super) name: Option<Text>,
    pub(super) units: Option<Spanned<Units>>,
    pub(super) up: Option<Spanned<UpKey>>,
    pub(super) north: Option<Number>,
}

#[derive(serde::Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct ProjectTable {
    pub(super) title: Option<Text>,
    pub(super) institution: Option<Text>,
    pub(super) author: Option<Text>,
    pub(super) date: Option<Spanned<DateKey>>,
    pub(super) rights: Option<Text>,
}

/// A date: TOML's own, or text.
#[derive(serde::Deserialize)]
#[serde(untagged)]
pub(super) enum DateKey {
    Toml(toml::value::Datetime),
    Text(String),
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelTable {
    pub(super) path: Text,
    pub(super) vertex_colours: Option<VertexColours>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvironmentTable {
    pub(super) image: Option<Text>,
    pub(super) radiance: Option<Vector>,
    pub(super) heading: Option<Number>,
    pub(super) projection: Option<Spanned<ProjectionKey>>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SunTable {
    pub(super) direction: Vector,
    pub(super) irradiance: Vector,
    #[serde(default)]
    pub(super) under: BTreeMap<Text, LightingSunTable>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightingSunTable {
    pub(super) direction: Vector,
    pub(super) irradiance: Vector,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CamerasTable {
    pub(super) path: Text,
    pub(super) photos: Option<Text>,
    pub(super) masks: Option<Text>,
    pub(super) only: Option<Vec<Text>>,
    pub(super) probes: Option<Spanned<ProbesKey>>,
    pub(super) lighting: Option<Text>,
    pub(super) scale: Option<Number>,
    pub(super) rotation: Option<Quaternion>,
    pub(super) matrix: Option<Matrix>,
    pub(super) translation: Option<Vector>,
}

/// Which of a pose file's photographs are probes: `"all"`, or a list of them.
pub(super) enum ProbesKey {
    All,
    These(Vec<Text>),
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProbeTable {
    pub(super) name: Text,
    pub(super) position: Option<Vector>,
    pub(super) heading: Option<Number>,
    pub(super) pitch: Option<Number>,
    pub(super) roll: Option<Number>,
    pub(super) rotation: Option<Quaternion>,
    pub(super) matrix: Option<Matrix>,
    pub(super) look_at: Option<Vector>,
    pub(super) image: Spanned<ImageKey>,
    pub(super) projection: Option<Spanned<ProjectionKey>>,
    pub(super) fov_y: Option<Number>,
    pub(super) fx: Option<Number>,
    pub(super) fy: Option<Number>,
    pub(super) cx: Option<Number>,
    pub(super) cy: Option<Number>,
    pub(super) k1: Option<Number>,
    pub(super) k2: Option<Number>,
    pub(super) k3: Option<Number>,
    pub(super) k4: Option<Number>,
    pub(super) p1: Option<Number>,
    pub(super) p2: Option<Number>,
    pub(super) gain: Option<Spanned<GainKey>>,
    pub(super) vignetting: Option<Pair>,
    pub(super) response: Option<Pair>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewTable {
    pub(super) name: Text,
    pub(super) position: Option<Vector>,
    pub(super) heading: Option<Number>,
    pub(super) pitch: Option<Number>,
    pub(super) roll: Option<Number>,
    pub(super) rotation: Option<Quaternion>,
    pub(super) matrix: Option<Matrix>,
    pub(super) look_at: Option<Vector>,
    pub(super) projection: Option<Spanned<LensKey>>,
    pub(super) fov_y: Option<Number>,
    pub(super) fx: Option<Number>,
    pub(super) fy: Option<Number>,
    pub(super) cx: Option<Number>,
    pub(super) cy: Option<Number>,
    pub(super) k1: Option<Number>,
    pub(super) k2: Option<Number>,
    pub(super) k3: Option<Number>,
    pub(super) k4: Option<Number>,
    pub(super) p1: Option<Number>,
    pub(super) p2: Option<Number>,
    pub(super) size: Option<Spanned<List<u32, 2>>>,
    pub(super) photo: Option<Text>,
    pub(super) mask: Option<Text>,
    #[serde(rename = "match", default)]
    pub(super) pairs: Vec<Spanned<MatchTable>>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MatchTable {
    pub(super) pixel: Pair,
    pub(super) point: Vector,
}

#[derive(serde::Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct PlanTable {
    pub(super) probe_height: Option<Number>,
    pub(super) clearance: Option<Number>,
    pub(super) range: Option<Number>,
    pub(super) incidence: Option<Number>,
    pub(super) target_coverage: Option<Number>,
    pub(super) max_probes: Option<Spanned<u32>>,
    pub(super) overlap: Option<Number>,
    pub(super) vertical_field: Option<Pair>,
    #[serde(default)]
    pub(super) keep_out: Vec<Spanned<Vec<Pair>>>,
    #[serde(default)]
    pub(super) fixed: Vec<Pair>,
}

#[derive(serde::Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ProjectionKey {
    #[serde(rename = "latlong")]
    LatLong,
    Angular,
    MirrorBall,
    Fisheye,
    CubeCross,
    Perspective,
}

#[derive(serde::Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(super) enum LensKey {
    Perspective,
    Fisheye,
}

/// Metres in a model unit.
pub(super) struct Units(pub(super) f64);

impl<'de> Deserialize<'de> for Units {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UnitsVisitor).map(Units)
    }
}

/// Metres in a unit by any of its names.
pub(crate) fn metres_in(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" => Some(1.0),
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => Some(0.01),
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => Some(0.001),
        "ft" | "foot" | "feet" => Some(0.3048),
        "in" | "inch" | "inches" => Some(0.0254),
        _ => None,
    }
}

struct UnitsVisitor;

impl Visitor<'_> for UnitsVisitor {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("\"m\", \"cm\", \"mm\", \"ft\", \"in\" or the number of metres in a model unit")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<f64, E> {
        metres_in(text).ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(text), &self))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<f64, E> {
        Ok(number)
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<f64, E> {
        Ok(number as f64)
    }
}

/// The model's up direction: an axis by its name, or a vector.
pub(super) struct UpKey(pub(super) DVec3);

impl<'de> Deserialize<'de> for UpKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UpVisitor).map(UpKey)
    }
}

struct UpVisitor;

impl<'de> Visitor<'de> for UpVisitor {
    type Value = DVec3;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("\"y\", \"z\", \"x\", one of them with a minus, or a vector [x, y, z] that points up")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<DVec3, E> {
        let name = text.trim().to_ascii_lowercase();
        let (sign, axis) = match name.strip_prefix('-').or(name.strip_prefix('−')) {
            Some(axis) => (-1.0, axis),
            None => (1.0, name.strip_prefix('+').unwrap_or(&name)),
        };
        match axis {
            "x" => Ok(DVec3::X * sign),
            "y" => Ok(DVec3::Y * sign),
            "z" => Ok(DVec3::Z * sign),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<DVec3, A::Error> {
        let list = List::<f64, 3>::deserialize(serde::de::value::SeqAccessDeserializer::new(list))?;
        Ok(DVec3::from_array(*list))
    }
}

impl<'de> Deserialize<'de> for ProbesKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ProbesVisitor)
    }
}

struct ProbesVisitor;

impl<'de> Visitor<'de> for ProbesVisitor {
    type Value = ProbesKey;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("\"all\", or a list of photographs")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<ProbesKey, E> {
        match text {
            "all" => Ok(ProbesKey::All),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<ProbesKey, A::Error> {
        let mut names = Vec::new();
        while let Some(name) = list.next_element()? {
            names.push(name);
        }
        Ok(ProbesKey::These(names))
    }
}

/// Radiance per stored value: of all channels, or of red, green and blue.
pub(super) struct GainKey(pub(super) [f64; 3]);

impl<'de> Deserialize<'de> for GainKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(GainVisitor).map(GainKey)
    }
}

struct GainVisitor;

impl<'de> Visitor<'de> for GainVisitor {
    type Value = [f64; 3];

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, or three numbers for red, green and blue")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<[f64; 3], E> {
        Ok([number; 3])
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<[f64; 3], E> {
        Ok([number as f64; 3])
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<[f64; 3], A::Error> {
        let mut numbers: Vec<f64> = Vec::new();
        while let Some(number) = list.next_element()? {
            numbers.push(number);
        }
        let count = numbers.len();
        // one gain in brackets is as clear as one without
        match numbers[..] {
            [one] => Ok([one; 3]),
            [r, g, b] => Ok([r, g, b]),
            _ => Err(Error::invalid_length(count, &self)),
        }
    }
}

/// A probe's picture, or its picture under each lighting in the file's order.
pub(super) enum ImageKey {
    One(String),
    PerLighting(Vec<(Text, Text)>),
}

impl<'de> Deserialize<'de> for ImageKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ImageVisitor)
    }
}

struct ImageVisitor;

impl<'de> Visitor<'de> for ImageVisitor {
    type Value = ImageKey;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a picture's path, or a table of lighting = path")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<ImageKey, E> {
        Ok(ImageKey::One(text.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ImageKey, A::Error> {
        // the parser sorts keys; their places in the text bring back the file's order
        let mut by_place = BTreeMap::new();
        while let Some((lighting, path)) = map.next_entry::<Text, Text>()? {
            by_place.insert(lighting.span().start, (lighting, path));
        }
        Ok(ImageKey::PerLighting(by_place.into_values().collect()))
    }
}
