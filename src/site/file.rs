//! The site file's keys and those of a walk's key frames, and nothing else: this is the one place that knows them.

use glam::DVec3;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};
use std::collections::BTreeMap;
use std::fmt;
use toml::Spanned;

use super::VertexColours;
use super::numbers::List;

pub(super) type Number = Spanned<f64>;
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

/// The keys of a table that say how something is turned.
pub(super) struct Orientation<'a> {
    pub(super) heading: &'a Option<Number>,
    pub(super) pitch: &'a Option<Number>,
    pub(super) roll: &'a Option<Number>,
    pub(super) rotation: &'a Option<Quaternion>,
    pub(super) matrix: &'a Option<Matrix>,
    pub(super) look_at: &'a Option<Vector>,
}

/// The keys of a table that tell its lens.
pub(super) struct LensKeys<'a> {
    pub(super) fov_y: &'a Option<Number>,
    pub(super) focal: [&'a Option<Number>; 2],
    pub(super) centre: [&'a Option<Number>; 2],
    pub(super) radial: [&'a Option<Number>; 4],
    pub(super) tangential: [&'a Option<Number>; 2],
}

/// A table with the keys of a pose, perhaps those of a lens too, and its own before, between and after them. One struct holds
/// them all, since serde's `flatten` loses where in the text each stands.
macro_rules! posed_table {
    ($table:ident { $($before:tt)* } pose { $($after:tt)* }) => {
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub(super) struct $table {
            $($before)*
            pub(super) position: Option<Vector>,
            heading: Option<Number>,
            pitch: Option<Number>,
            roll: Option<Number>,
            rotation: Option<Quaternion>,
            matrix: Option<Matrix>,
            look_at: Option<Vector>,
            $($after)*
        }

        impl $table {
            pub(super) fn orientation(&self) -> Orientation<'_> {
                let Self { heading, pitch, roll, rotation, matrix, look_at, .. } = self;
                Orientation { heading, pitch, roll, rotation, matrix, look_at }
            }
        }
    };
    ($table:ident { $($before:tt)* } pose { $($between:tt)* } lens { $($after:tt)* }) => {
        posed_table! { $table { $($before)* } pose {
            $($between)*
            fov_y: Option<Number>,
            fx: Option<Number>,
            fy: Option<Number>,
            cx: Option<Number>,
            cy: Option<Number>,
            k1: Option<Number>,
            k2: Option<Number>,
            k3: Option<Number>,
            k4: Option<Number>,
            p1: Option<Number>,
            p2: Option<Number>,
            $($after)*
        } }

        impl $table {
            pub(super) fn lens(&self) -> LensKeys<'_> {
                let Self { fov_y, fx, fy, cx, cy, k1, k2, k3, k4, p1, p2, .. } = self;
                LensKeys { fov_y, focal: [fx, fy], centre: [cx, cy], radial: [k1, k2, k3, k4], tangential: [p1, p2] }
            }
        }
    };
}

posed_table! { ProbeTable
    { pub(super) name: Text, }
    pose {
        pub(super) image: Spanned<ImageKey>,
        pub(super) projection: Option<Spanned<ProjectionKey>>,
    }
    lens {
        pub(super) gain: Option<Spanned<GainKey>>,
        pub(super) vignetting: Option<Pair>,
        pub(super) response: Option<Pair>,
    }
}

posed_table! { ViewTable
    { pub(super) name: Text, }
    pose { pub(super) projection: Option<Spanned<LensKey>>, }
    lens {
        pub(super) size: Option<Spanned<List<u32, 2>>>,
        pub(super) photo: Option<Text>,
        pub(super) mask: Option<Text>,
        #[serde(rename = "match", default)]
        pub(super) pairs: Vec<Spanned<MatchTable>>,
    }
}

// a key frame of a walk
posed_table! { KeyFrameTable
    { pub(super) view: Option<Text>, }
    pose { pub(super) fov_y: Option<Number>, }
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

/// Reads a type that can be written in several ways, which `$expected` names and the visitor's methods take.
macro_rules! written {
    ($type:ident, $expected:literal, $($visit:tt)*) => {
        impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Ways;
                impl<'de> Visitor<'de> for Ways {
                    type Value = $type;

                    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                        f.write_str($expected)
                    }

                    $($visit)*
                }
                deserializer.deserialize_any(Ways)
            }
        }
    };
}

/// Metres in a model unit.
pub(super) struct Units(pub(super) f64);

written! { Units, "\"m\", \"cm\", \"mm\", \"ft\", \"in\" or the number of metres in a model unit",
    fn visit_str<E: Error>(self, text: &str) -> Result<Units, E> {
        metres_in(text).map(Units).ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Units, E> {
        Ok(Units(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Units, E> {
        Ok(Units(number as f64))
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

/// The model's up direction: an axis by its name, or a vector.
pub(super) struct UpKey(pub(super) DVec3);

written! { UpKey, "\"y\", \"z\", \"x\", one of them with a minus, or a vector [x, y, z] that points up",
    fn visit_str<E: Error>(self, text: &str) -> Result<UpKey, E> {
        let name = text.trim().to_ascii_lowercase();
        let (sign, axis) = match name.strip_prefix('-').or(name.strip_prefix('−')) {
            Some(axis) => (-1.0, axis),
            None => (1.0, name.strip_prefix('+').unwrap_or(&name)),
        };
        match axis {
            "x" => Ok(UpKey(DVec3::X * sign)),
            "y" => Ok(UpKey(DVec3::Y * sign)),
            "z" => Ok(UpKey(DVec3::Z * sign)),
            _ => Err(E::invalid_value(Unexpected::Str(text), &self)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<UpKey, A::Error> {
        List::<f64, 3>::deserialize(SeqAccessDeserializer::new(list)).map(|list| UpKey(DVec3::from_array(*list)))
    }
}

/// Which of a pose file's photographs are probes: `"all"`, or a list of them.
pub(super) enum ProbesKey {
    All,
    These(Vec<Text>),
}

written! { ProbesKey, "\"all\", or a list of photographs",
    fn visit_str<E: Error>(self, text: &str) -> Result<ProbesKey, E> {
        match text {
            "all" => Ok(ProbesKey::All),
            _ => Err(E::invalid_value(Unexpected::Str(text), &self)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<ProbesKey, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(ProbesKey::These)
    }
}

/// Radiance per stored value: of all channels, or of red, green and blue.
pub(super) struct GainKey(pub(super) [f64; 3]);

written! { GainKey, "a number, or three numbers for red, green and blue",
    fn visit_f64<E: Error>(self, number: f64) -> Result<GainKey, E> {
        Ok(GainKey([number; 3]))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<GainKey, E> {
        Ok(GainKey([number as f64; 3]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<GainKey, A::Error> {
        // one gain in brackets is as clear as one without
        match Vec::<f64>::deserialize(SeqAccessDeserializer::new(list))?[..] {
            [one] => Ok(GainKey([one; 3])),
            [r, g, b] => Ok(GainKey([r, g, b])),
            ref other => Err(Error::invalid_length(other.len(), &self)),
        }
    }
}

/// A probe's picture, or its picture under each lighting in the file's order.
pub(super) enum ImageKey {
    One(String),
    PerLighting(Vec<(Text, Text)>),
}

written! { ImageKey, "a picture's path, or a table of lighting = path",
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
