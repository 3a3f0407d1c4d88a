//! An SVG builder in millimetres: what a sheet is drawn with.
//!
//! Every number is written with at most three decimals, so that the same sheet is the same bytes. Groups carry a class
//! and may carry an id, so that a sheet can be restyled or taken apart later. `y` runs down, as in SVG.

use std::collections::BTreeMap;
use std::fmt::Write;

use base64::Engine;

use super::style::{Fill, Hatch, Style, number};

/// A point on the sheet: millimetres from its left and its top edge.
pub type Point = [f64; 2];

/// Where a text stands against its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// It is centred there.
    Middle,
    /// It ends there.
    End,
}

/// How a text looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Text {
    /// Height of the letters' em in millimetres.
    pub size: f64,
    /// Bold or plain.
    pub bold: bool,
    /// Its place against the point.
    pub anchor: Anchor,
    /// `#rrggbb`.
    pub colour: &'static str,
    /// A white rim of so many millimetres, that keeps it readable on a drawing; 0 for none.
    pub halo: f64,
    /// Degrees clockwise about its point.
    pub turn: f64,
}

impl Text {
    /// Plain black text of this size that begins at its point.
    pub const fn new(size: f64) -> Self {
        Self { size, bold: false, anchor: Anchor::Start, colour: "#000000", halo: 0.0, turn: 0.0 }
    }

    /// The same in bold.
    pub const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// The same, placed otherwise against its point.
    pub const fn anchor(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same in another colour.
    pub const fn colour(self, colour: &'static str) -> Self {
        Self { colour, ..self }
    }

    /// The same with a white rim of this width.
    pub const fn halo(self, halo: f64) -> Self {
        Self { halo, ..self }
    }

    /// The same, turned clockwise.
    pub const fn turn(self, turn: f64) -> Self {
        Self { turn, ..self }
    }
}

/// A drawing under construction.
#[derive(Clone, Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    head: String,
    hatches: BTreeMap<String, Hatch>,
    clips: Vec<[f64; 4]>,
    body: String,
}

impl Svg {
    /// An empty white sheet of this many millimetres. `title` and `description` are what a screen reader says.
    pub fn new(width: f64, height: f64, title: &str, description: &str) -> Self {
        let head = format!("<title>{}</title>\n<desc>{}</desc>\n", escape(title), escape(description));
        Self { width, height, head, hatches: BTreeMap::new(), clips: Vec::new(), body: String::new() }
    }

    /// What `draw` draws, as a group with a class and an id; the id must be used once in a sheet. Empty: none.
    pub fn group(&mut self, class: &str, id: &str, draw: impl FnOnce(&mut Self)) {
        let id = if id.is_empty() { String::new() } else { format!(r#" id="{}""#, escape(id)) };
        self.push(format_args!("<g class=\"{}\"{id}>", escape(class)));
        draw(self);
        self.push(format_args!("</g>"));
    }

    /// What `draw` draws, cut at the edge of a rectangle `[x, y, width, height]`.
    pub fn clipped(&mut self, rectangle: [f64; 4], draw: impl FnOnce(&mut Self)) {
        self.push(format_args!("<g clip-path=\"url(#clip-{})\">", self.clips.len()));
        self.clips.push(rectangle);
        draw(self);
        self.push(format_args!("</g>"));
    }

    /// A line between two points.
    pub fn line(&mut self, from: Point, to: Point, style: &Style) {
        self.polyline(&[from, to], style);
    }

    /// A line through points.
    pub fn polyline(&mut self, points: &[Point], style: &Style) {
        if points.len() > 1 {
            let data = path(points, false);
            self.path(&data, style);
        }
    }

    /// An area with an outline: rings by the even-odd rule, so that an inner ring is a hole.
    pub fn area<R: AsRef<[Point]>>(&mut self, rings: &[R], style: &Style) {
        let data: String = rings.iter().map(|r| path(r.as_ref(), true)).collect();
        if !data.is_empty() {
            self.path(&data, style);
        }
    }

    /// A rectangle by its upper left corner, width and height.
    pub fn rectangle(&mut self, [x, y, width, height]: [f64; 4], style: &Style) {
        let style = self.attributes(style);
        let (x, y, width, height) = (number(x), number(y), number(width), number(height));
        self.push(format_args!(r#"<rect x="{x}" y="{y}" width="{width}" height="{height}"{style}/>"#));
    }

    /// A circle.
    pub fn circle(&mut self, [x, y]: Point, radius: f64, style: &Style) {
        let style = self.attributes(style);
        let (x, y, radius) = (number(x), number(y), number(radius));
        self.push(format_args!(r#"<circle cx="{x}" cy="{y}" r="{radius}"{style}/>"#));
    }

    /// A line of text; `at` is on its base line.
    pub fn text(&mut self, at: Point, text: &str, look: &Text) {
        let anchor = match look.anchor {
            Anchor::Start => "",
            Anchor::Middle => r#" text-anchor="middle""#,
            Anchor::End => r#" text-anchor="end""#,
        };
        let weight = if look.bold { r#" font-weight="bold""# } else { "" };
        let (x, y) = (number(at[0]), number(at[1]));
        let turn = match look.turn {
            0.0 => String::new(),
            turn => format!(r#" transform="rotate({} {x} {y})""#, number(turn)),
        };
        let (size, text) = (number(look.size), escape(text));
        if look.halo > 0.0 {
            let halo = number(2.0 * look.halo);
            self.push(format_args!(
                r##"<text x="{x}" y="{y}" font-size="{size}"{weight}{anchor}{turn} fill="none" stroke="#ffffff" stroke-width="{halo}" stroke-linejoin="round" aria-hidden="true">{text}</text>"##
            ));
        }
        let colour = look.colour;
        self.push(format_args!(
            r#"<text x="{x}" y="{y}" font-size="{size}"{weight}{anchor}{turn} fill="{colour}">{text}</text>"#
        ));
    }

    /// A PNG picture, stretched over a rectangle, with what a screen reader says of it.
    pub fn png(&mut self, [x, y, width, height]: [f64; 4], png: &[u8], says: &str) {
        let data = base64::engine::general_purpose::STANDARD.encode(png);
        let (x, y, width, height, says) = (number(x), number(y), number(width), number(height), escape(says));
        self.push(format_args!(
            r#"<image x="{x}" y="{y}" width="{width}" height="{height}" preserveAspectRatio="none" xlink:href="data:image/png;base64,{data}"><title>{says}</title></image>"#
        ));
    }

    /// The whole file.
    pub fn finish(&self) -> String {
        let (width, height) = (number(self.width), number(self.height));
        let mut out = format!(
            concat!(
                "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n",
                r#"<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="{0}mm" height="{1}mm" "#,
                r#"viewBox="0 0 {0} {1}" role="img" font-family="'DejaVu Sans', Verdana, sans-serif">"#,
                "\n"
            ),
            width, height
        );
        out += &self.head;
        if !self.hatches.is_empty() || !self.clips.is_empty() {
            out += "<defs>\n";
            for (id, hatch) in &self.hatches {
                out += &hatch.definition(id);
            }
            for (i, [x, y, w, h]) in self.clips.iter().enumerate() {
                let (x, y, w, h) = (number(*x), number(*y), number(*w), number(*h));
                out += &format!(
                    "<clipPath id=\"clip-{i}\"><rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/></clipPath>\n"
                );
            }
            out += "</defs>\n";
        }
        out += &format!("<rect class=\"paper\" width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n");
        out += &self.body;
        out += "</svg>\n";
        out
    }

    fn path(&mut self, data: &str, style: &Style) {
        let style = self.attributes(style);
        self.push(format_args!(r#"<path d="{data}"{style}/>"#));
    }

    fn attributes(&mut self, style: &Style) -> String {
        let mut out = String::new();
        match style.fill {
            Fill::None => out += r#" fill="none""#,
            Fill::Plain(colour) => out += &format!(r#" fill="{colour}" fill-rule="evenodd""#),
            Fill::Hatch(hatch) => {
                let id = hatch.id();
                out += &format!(r#" fill="url(#{id})" fill-rule="evenodd""#);
                self.hatches.insert(id, hatch);
            }
        }
        if style.fill_opacity < 1.0 && style.fill != Fill::None {
            out += &format!(r#" fill-opacity="{}""#, number(style.fill_opacity));
        }
        if style.stroke_width > 0.0 {
            let (colour, width) = (style.stroke, number(style.stroke_width));
            out += &format!(r#" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round""#);
            if let Some([on, off]) = style.dash {
                out += &format!(r#" stroke-dasharray="{} {}""#, number(on), number(off));
            }
        }
        out
    }

    fn push(&mut self, line: std::fmt::Arguments<'_>) {
        // writing to a String cannot fail
        let _ = writeln!(self.body, "{line}");
    }
}

/// SVG path data through points.
fn path(points: &[Point], closed: bool) -> String {
    let mut out = String::new();
    for (i, &[x, y]) in points.iter().enumerate() {
        let _ = write!(out, "{}{} {}", if i == 0 { 'M' } else { 'L' }, number(x), number(y));
    }
    if closed && !out.is_empty() {
        out.push('Z');
    }
    out
}

/// Text as it may stand in XML and HTML, in an element or an attribute; characters that XML forbids are dropped.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            c if c < ' ' && !"\t\n\r".contains(c) => {}
            '\u{fffe}' | '\u{ffff}' => {}
            c => out.push(c),
        }
    }
    out
}
