//! Drawings in DXF R2000 (Autodesk, *DXF Reference*, AC1015), for CAD programs.
//!
//! Written by hand: what crates.io has stamps files with random numbers and the time, so that no two are alike, and leaves out
//! tables that CAD programs mend when they open them.

use glam::DVec2;
use std::fmt::Write;

/// A layer, its colour by AutoCAD's index, and its line type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layer {
    pub(crate) name: &'static str,
    pub(crate) colour: u8,
    pub(crate) dashed: bool,
}

/// A drawing under way. Lengths are the drawing's units.
pub(crate) struct Dxf {
    entities: String,
    next: u32,
    low: DVec2,
    high: DVec2,
}

/// Handles of what refers to each other; entities come after them.
const MODEL: u32 = 0x1F;
const PAPER: u32 = 0x1B;
const FIRST: u32 = 0x100;

impl Dxf {
    pub(crate) fn new() -> Self {
        Self { entities: String::new(), next: FIRST, low: DVec2::INFINITY, high: DVec2::NEG_INFINITY }
    }

    fn entity(&mut self, kind: &str, class: &str, layer: Layer) {
        let handle = self.next;
        self.next += 1;
        self.put(&[(0, kind)]);
        let _ = write!(self.entities, "  5\n{handle:X}\n330\n{MODEL:X}\n");
        self.put(&[(100, "AcDbEntity"), (8, layer.name), (100, class)]);
    }

    fn put(&mut self, pairs: &[(u16, &str)]) {
        put(&mut self.entities, pairs);
    }

    fn number(&mut self, code: u16, value: f64) {
        // no −0
        let _ = write!(self.entities, "{code:3}\n{:.6}\n", value + 0.0);
    }

    fn point(&mut self, code: u16, p: DVec2) {
        (self.low, self.high) = (self.low.min(p), self.high.max(p));
        self.number(code, p.x);
        self.number(code + 10, p.y);
    }

    /// A line from point to point.
    pub(crate) fn polyline(&mut self, layer: Layer, points: &[DVec2], closed: bool) {
        if points.len() < 2 {
            return;
        }
        self.entity("LWPOLYLINE", "AcDbPolyline", layer);
        let _ = write!(self.entities, " 90\n{}\n 70\n{}\n", points.len(), u8::from(closed));
        points.iter().for_each(|p| self.point(10, *p));
    }

    /// A circle.
    pub(crate) fn circle(&mut self, layer: Layer, centre: DVec2, radius: f64) {
        self.entity("CIRCLE", "AcDbCircle", layer);
        self.point(10, centre);
        self.number(30, 0.0);
        self.number(40, radius);
        (self.low, self.high) = (self.low.min(centre - radius), self.high.max(centre + radius));
    }

    /// A point that programs snap to, at a height of its own.
    pub(crate) fn place(&mut self, layer: Layer, at: DVec2, height: f64) {
        self.entity("POINT", "AcDbPoint", layer);
        self.point(10, at);
        self.number(30, height);
    }

    /// A line of text of a height, turned anticlockwise from east, from its lower left.
    pub(crate) fn text(&mut self, layer: Layer, at: DVec2, height: f64, turned_deg: f64, text: &str) {
        self.entity("TEXT", "AcDbText", layer);
        self.point(10, at);
        self.number(30, 0.0);
        self.number(40, height);
        let text = escaped(text);
        self.put(&[(1, &text)]);
        self.number(50, turned_deg);
        self.put(&[(100, "AcDbText")]);
    }

    /// The file, for drawing units of so many metres, and everything on `layers`.
    pub(crate) fn file(&self, layers: &[Layer], metres_per_unit: f64) -> String {
        let (low, high) = if self.low.is_finite() { (self.low, self.high) } else { (DVec2::ZERO, DVec2::ONE) };
        let mut out = String::new();
        let seed = format!("{:X}", self.next);
        let units = insertion_units(metres_per_unit).to_string();
        section(&mut out, "HEADER", |out| {
            put(
                out,
                &[(9, "$ACADVER"), (1, "AC1015"), (9, "$DWGCODEPAGE"), (3, "ANSI_1252"), (9, "$HANDSEED"), (5, &seed)],
            );
            put(out, &[(9, "$INSUNITS"), (70, &units), (9, "$MEASUREMENT"), (70, "1")]);
            for (name, p) in [("$EXTMIN", low), ("$EXTMAX", high)] {
                let [x, y] = [p.x, p.y].map(|v| format!("{v:.6}"));
                put(out, &[(9, name), (10, &x), (20, &y), (30, "0.0")]);
            }
        });
        section(&mut out, "CLASSES", |_| {});
        section(&mut out, "TABLES", |out| tables(out, layers, low, high));
        section(&mut out, "BLOCKS", |out| {
            block(out, "*Model_Space", MODEL, ["20", "21"]);
            block(out, "*Paper_Space", PAPER, ["1C", "1D"]);
        });
        section(&mut out, "ENTITIES", |out| *out += &self.entities);
        section(&mut out, "OBJECTS", objects);
        put(&mut out, &[(0, "EOF")]);
        out
    }
}

/// AutoCAD's number of a unit; 0 for none of its own.
fn insertion_units(metres: f64) -> u8 {
    let known = [(0.0254, 1), (0.3048, 2), (0.001, 4), (0.01, 5), (1.0, 6)];
    known.iter().find(|(m, _)| (metres / m - 1.0).abs() < 1e-9).map_or(0, |(_, number)| *number)
}

/// Text of the files' code page; what it has not is written as a number.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '^' => out += "^ ",
            ' '..='~' => out.push(c),
            _ => {
                let mut units = [0; 2];
                c.encode_utf16(&mut units).iter().for_each(|unit| {
                    let _ = write!(out, "\\U+{unit:04X}");
                });
            }
        }
    }
    out
}

fn put(out: &mut String, pairs: &[(u16, &str)]) {
    for (code, value) in pairs {
        let _ = write!(out, "{code:3}\n{value}\n");
    }
}

fn section(out: &mut String, name: &str, fill: impl FnOnce(&mut String)) {
    put(out, &[(0, "SECTION"), (2, name)]);
    fill(out);
    put(out, &[(0, "ENDSEC")]);
}

/// A table of entries, each with its handle, its class and what is its own.
fn table(out: &mut String, name: &str, handle: &str, entries: &[(String, &str, String)]) {
    let count = entries.len().to_string();
    put(out, &[(0, "TABLE"), (2, name), (5, handle), (330, "0"), (100, "AcDbSymbolTable"), (70, &count)]);
    if name == "DIMSTYLE" {
        put(out, &[(100, "AcDbDimStyleTable")]);
    }
    for (own, class, rest) in entries {
        let code = if name == "DIMSTYLE" { 105 } else { 5 };
        put(out, &[(0, name), (code, own), (330, handle), (100, "AcDbSymbolTableRecord"), (100, class)]);
        *out += rest;
    }
    put(out, &[(0, "ENDTAB")]);
}

fn tables(out: &mut String, layers: &[Layer], low: DVec2, high: DVec2) {
    let pairs = |pairs: &[(u16, &str)]| {
        let mut text = String::new();
        put(&mut text, pairs);
        text
    };
    let handle = |h: u32| format!("{h:X}");
    let middle = (low + high) / 2.0;
    let [x, y, height] =
        [middle.x, middle.y, 1.1 * (high.y - low.y).max(0.7 * (high.x - low.x))].map(|v| format!("{v:.6}"));
    let view = pairs(&[
        (2, "*ACTIVE"),
        (70, "0"),
        (10, "0.0"),
        (20, "0.0"),
        (11, "1.0"),
        (21, "1.0"),
        (12, &x),
        (22, &y),
        (40, &height),
        (41, "1.5"),
    ]);
    table(out, "VPORT", "8", &[(handle(0x30), "AcDbViewportTableRecord", view)]);
    let line = |name: &str, says: &str, dashes: &[(u16, &str)]| {
        let length: f64 =
            dashes.iter().filter(|d| d.0 == 49).filter_map(|d| d.1.parse::<f64>().ok()).map(f64::abs).sum();
        let (count, length) = ((dashes.len() / 2).to_string(), format!("{length:.3}"));
        pairs(&[(2, name), (70, "0"), (3, says), (72, "65"), (73, &count), (40, &length)]) + &pairs(dashes)
    };
    let lines = [
        (handle(0x14), "AcDbLinetypeTableRecord", line("ByBlock", "", &[])),
        (handle(0x15), "AcDbLinetypeTableRecord", line("ByLayer", "", &[])),
        (handle(0x16), "AcDbLinetypeTableRecord", line("Continuous", "Solid line", &[])),
        (
            handle(0x17),
            "AcDbLinetypeTableRecord",
            line("DASHED", "__ __", &[(49, "0.2"), (74, "0"), (49, "-0.1"), (74, "0")]),
        ),
    ];
    table(out, "LTYPE", "5", &lines);
    let zero = Layer { name: "0", colour: 7, dashed: false };
    let entries: Vec<_> = std::iter::once(&zero)
        .chain(layers)
        .zip(0x40u32..)
        .map(|(layer, own)| {
            let colour = layer.colour.to_string();
            let kind = if layer.dashed { "DASHED" } else { "Continuous" };
            let own_pairs = pairs(&[(2, layer.name), (70, "0"), (62, &colour), (6, kind), (370, "-3"), (390, "F")]);
            (handle(own), "AcDbLayerTableRecord", own_pairs)
        })
        .collect();
    table(out, "LAYER", "2", &entries);
    let style = pairs(&[
        (2, "Standard"),
        (70, "0"),
        (40, "0.0"),
        (41, "1.0"),
        (50, "0.0"),
        (71, "0"),
        (42, "2.5"),
        (3, "txt"),
        (4, ""),
    ]);
    table(out, "STYLE", "3", &[(handle(0x11), "AcDbTextStyleTableRecord", style)]);
    table(out, "VIEW", "6", &[]);
    table(out, "UCS", "7", &[]);
    table(out, "APPID", "9", &[(handle(0x12), "AcDbRegAppTableRecord", pairs(&[(2, "ACAD"), (70, "0")]))]);
    let dimension = pairs(&[(2, "Standard"), (70, "0")]);
    table(out, "DIMSTYLE", "A", &[(handle(0x27), "AcDbDimStyleTableRecord", dimension)]);
    let blocks = [
        (handle(MODEL), "AcDbBlockTableRecord", pairs(&[(2, "*Model_Space"), (340, "22")])),
        (handle(PAPER), "AcDbBlockTableRecord", pairs(&[(2, "*Paper_Space"), (340, "1E")])),
    ];
    table(out, "BLOCK_RECORD", "1", &blocks);
}

fn block(out: &mut String, name: &str, record: u32, [begin, end]: [&str; 2]) {
    let record = format!("{record:X}");
    put(out, &[(0, "BLOCK"), (5, begin), (330, &record), (100, "AcDbEntity"), (8, "0"), (100, "AcDbBlockBegin")]);
    put(out, &[(2, name), (70, "0"), (10, "0.0"), (20, "0.0"), (30, "0.0"), (3, name), (1, "")]);
    put(out, &[(0, "ENDBLK"), (5, end), (330, &record), (100, "AcDbEntity"), (8, "0"), (100, "AcDbBlockEnd")]);
}

/// The dictionaries that a file must have: groups, plot styles, and a layout each for model and paper.
fn objects(out: &mut String) {
    let dictionary = |out: &mut String, handle: &str, owner: &str, entries: &[(&str, &str)]| {
        put(out, &[(0, "DICTIONARY"), (5, handle), (330, owner), (100, "AcDbDictionary"), (281, "1")]);
        entries.iter().for_each(|(name, of)| put(out, &[(3, name), (350, of)]));
    };
    dictionary(out, "C", "0", &[("ACAD_GROUP", "D"), ("ACAD_LAYOUT", "1A"), ("ACAD_PLOTSTYLENAME", "E")]);
    dictionary(out, "D", "C", &[]);
    dictionary(out, "1A", "C", &[("Model", "22"), ("Layout1", "1E")]);
    put(out, &[(0, "ACDBDICTIONARYWDFLT"), (5, "E"), (330, "C"), (100, "AcDbDictionary"), (281, "1")]);
    put(out, &[(3, "Normal"), (350, "F"), (100, "AcDbDictionaryWithDefault"), (340, "F")]);
    put(out, &[(0, "ACDBPLACEHOLDER"), (5, "F"), (330, "E")]);
    for (handle, name, order, record) in [("22", "Model", "0", MODEL), ("1E", "Layout1", "1", PAPER)] {
        let (record, flags) = (format!("{record:X}"), if order == "0" { "1024" } else { "0" });
        put(out, &[(0, "LAYOUT"), (5, handle), (330, "1A"), (100, "AcDbPlotSettings"), (1, ""), (2, "none_device")]);
        put(out, &[(4, ""), (6, ""), (40, "0.0"), (41, "0.0"), (42, "0.0"), (43, "0.0"), (44, "0.0"), (45, "0.0")]);
        put(out, &[(46, "0.0"), (47, "0.0"), (48, "0.0"), (49, "0.0"), (140, "0.0"), (141, "0.0"), (142, "1.0")]);
        put(out, &[(143, "1.0"), (70, flags), (72, "1"), (73, "0"), (74, "5"), (7, ""), (75, "16"), (147, "1.0")]);
        put(out, &[(148, "0.0"), (149, "0.0"), (100, "AcDbLayout"), (1, name), (70, "1"), (71, order)]);
        put(out, &[(10, "0.0"), (20, "0.0"), (11, "420.0"), (21, "297.0"), (12, "0.0"), (22, "0.0"), (32, "0.0")]);
        put(out, &[(14, "0.0"), (24, "0.0"), (34, "0.0"), (15, "0.0"), (25, "0.0"), (35, "0.0"), (146, "0.0")]);
        put(out, &[(13, "0.0"), (23, "0.0"), (33, "0.0"), (16, "1.0"), (26, "0.0"), (36, "0.0"), (17, "0.0")]);
        put(out, &[(27, "1.0"), (37, "0.0"), (76, "0"), (330, &record)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYER: Layer = Layer { name: "WALLS", colour: 7, dashed: false };

    #[test]
    fn pairs_of_code_and_value_nest_as_they_must() {
        let mut dxf = Dxf::new();
        dxf.polyline(LAYER, &[DVec2::ZERO, DVec2::X], false);
        dxf.text(LAYER, DVec2::Y, 0.2, 0.0, "Šibenik\n^1");
        let file = dxf.file(&[LAYER], 0.3048);
        let lines: Vec<&str> = file.lines().collect();
        assert_eq!(lines.len() % 2, 0);
        let pairs: Vec<(u16, &str)> = lines.chunks(2).map(|p| (p[0].trim().parse().unwrap(), p[1])).collect();
        let count = |code: u16, value: &str| pairs.iter().filter(|p| **p == (code, value)).count();
        assert_eq!((count(0, "SECTION"), count(0, "ENDSEC"), count(0, "EOF")), (6, 6, 1));
        assert_eq!((count(0, "TABLE"), count(0, "ENDTAB")), (9, 9));
        // handles are given once
        let mut handles: Vec<&str> = pairs.iter().skip(8).filter(|p| p.0 == 5 || p.0 == 105).map(|p| p.1).collect();
        let all = handles.len();
        handles.sort_unstable();
        handles.dedup();
        assert_eq!(handles.len(), all);
        assert_eq!(count(1, "\\U+0160ibenik^ 1"), 1);
        assert_eq!(insertion_units(0.3048), 2);
    }
}
