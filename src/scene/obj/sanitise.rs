//! A reader that stands between an OBJ file and tobj and hands on only what tobj gets right.
//!
//! It joins continued lines, decodes any bytes, leaves out normals, points and lines, resolves and checks indices,
//! and keeps colours in step with vertices. It counts lines, so that an error can name one. In place of `usemtl` it
//! writes `g` and the material's number: tobj then makes a model of each run and never looks for materials.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, BufRead, BufReader, Read};

use super::super::model::Oddities;
use super::super::text;

/// Longer lines are not text.
const LONGEST_LINE: usize = 64 << 20;

/// Faces after which a new run begins: tobj holds about 100 bytes a face of an unfinished run.
const RUN: u32 = 1 << 20;

/// Why reading stopped.
pub(super) enum Fault {
    /// A vertex has a colour, and colours were not asked for.
    NeedsColours,
    /// The file could not be read.
    Io(io::Error),
    /// The file is of another kind.
    NotObj(String),
    /// The current line makes no sense.
    Line(String),
}

/// The reader that tobj sees.
pub(super) struct Sanitised<R> {
    lines: Lines<R>,
    colours: bool,
    /// The statement being read, and what of it goes to tobj.
    text: String,
    out: String,
    taken: usize,
    numbers: BTreeMap<Option<String>, u32>,
    material: u32,
    /// Material, and whether corners have texture coordinates.
    run: Option<(u32, bool)>,
    run_faces: u32,
    texcoords: i64,
    /// Names after `usemtl`, by number; number 0 is for faces before any.
    pub(super) materials: Vec<Option<String>>,
    /// What stands after each `mtllib`.
    pub(super) libraries: Vec<String>,
    /// What was left out.
    pub(super) oddities: Oddities,
    /// Line of the current statement, from 1.
    pub(super) line: usize,
    /// Why reading stopped, if it did.
    pub(super) fault: Option<Fault>,
}

impl<R: Read> Sanitised<R> {
    /// A reader of an OBJ file's bytes. `colours`: give every vertex a colour, white where it has none.
    pub(super) fn new(file: R, colours: bool) -> Self {
        Self {
            lines: Lines {
                bytes: BufReader::with_capacity(1 << 18, file),
                number: 0,
                line: Vec::new(),
                after_cr: false,
            },
            colours,
            text: String::new(),
            out: String::new(),
            taken: 0,
            numbers: BTreeMap::from([(None, 0)]),
            material: 0,
            run: None,
            run_faces: 0,
            texcoords: 0,
            materials: vec![None],
            libraries: Vec::new(),
            oddities: Oddities::default(),
            line: 0,
            fault: None,
        }
    }

    /// The current statement, shortened.
    pub(super) fn statement(&self) -> String {
        let mut start = shorten(&self.text);
        if start.len() < self.text.trim().len() {
            start.push('…');
        }
        start
    }

    /// Reads statements until one has something for tobj; `false` at the end.
    fn advance(&mut self) -> Result<bool, Fault> {
        self.out.clear();
        self.taken = 0;
        while self.out.is_empty() {
            if !self.next_statement()? {
                return Ok(false);
            }
            let text = std::mem::take(&mut self.text);
            let done = self.sanitise(&text);
            self.text = text;
            done?;
        }
        Ok(true)
    }

    /// One line, or several that end in `\`.
    fn next_statement(&mut self) -> Result<bool, Fault> {
        self.text.clear();
        if !self.lines.next()? {
            return Ok(false);
        }
        self.line = self.lines.number;
        if self.line == 1 {
            self.look_at_first_line()?;
        }
        loop {
            let line = text::of(&self.lines.line);
            let continued = line.trim_end().strip_suffix('\\');
            self.text.push_str(continued.unwrap_or(&line));
            if continued.is_none() || !self.lines.next()? {
                return Ok(true);
            }
            self.text.push(' ');
        }
    }

    /// Tells other kinds of file apart, so that the message can say what it is.
    fn look_at_first_line(&mut self) -> Result<(), Fault> {
        let line = &mut self.lines.line;
        if line.starts_with(b"\xef\xbb\xbf") {
            line.drain(..3);
        }
        let kinds: [(&[u8], &str); 6] = [
            (b"solid ", "an STL file"),
            (b"Kaydara FBX", "an FBX file"),
            (b"<?xml", "an XML file, such as COLLADA"),
            (b"PK\x03\x04", "a ZIP archive"),
            (b"\xff\xfe", "text in UTF-16, which has to be saved as UTF-8"),
            (b"\xfe\xff", "text in UTF-16, which has to be saved as UTF-8"),
        ];
        let kind = kinds.iter().find(|(magic, _)| line.starts_with(magic)).map(|(_, kind)| *kind);
        match kind.or(line.contains(&0).then_some("a binary file")) {
            Some(kind) => Err(Fault::NotObj(kind.to_owned())),
            None => Ok(()),
        }
    }

    fn sanitise(&mut self, text: &str) -> Result<(), Fault> {
        let text = text.trim_start();
        let (keyword, rest) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
        match keyword {
            "v" => return self.vertex(uncommented(rest)),
            "vt" => return self.texture_coordinates(uncommented(rest)),
            "f" | "fo" => return self.face(uncommented(rest)),
            "newmtl" if self.oddities.vertices == 0 => {
                return Err(Fault::NotObj("a material (MTL) file".to_owned()));
            }
            "usemtl" => self.use_material(rest.trim()),
            "mtllib" => self.libraries.push(rest.trim().to_owned()),
            "p" | "l" => self.oddities.points_and_lines += 1,
            "curv" | "curv2" | "surf" => self.oddities.free_form += 1,
            _ => {}
        }
        Ok(())
    }

    /// `v x y z`, `v x y z w` or `v x y z r g b`.
    fn vertex(&mut self, rest: &str) -> Result<(), Fault> {
        self.oddities.vertices += 1;
        let mut words = rest.split_ascii_whitespace().map(known_number);
        let first_three = (words.next(), words.next(), words.next());
        let more = (words.next(), words.next(), words.next());
        let (Some(x), Some(y), Some(z)) = first_three else {
            return Err(Fault::Line(format!("expected v and three numbers, found “v {}”", shorten(rest))));
        };
        self.out.push('v');
        match more {
            // a weight: the point is divided by it
            (Some(w), None, _) => {
                let number = |word: &str| word.parse::<f64>().ok();
                let (Some(x), Some(y), Some(z), Some(w)) = (number(x), number(y), number(z), number(w)) else {
                    return Err(Fault::Line(format!("expected v and numbers, found “v {}”", shorten(rest))));
                };
                // writing to a String cannot fail
                let _ = write!(self.out, " {} {} {}", x / w, y / w, z / w);
            }
            _ => self.write_words([x, y, z]),
        }
        let colour = match more {
            (Some(r), Some(g), Some(b)) if [r, g, b].iter().all(|c| c.parse::<f64>().is_ok()) => Some([r, g, b]),
            _ => None,
        };
        self.oddities.coloured += u64::from(colour.is_some());
        match (colour, self.colours) {
            (Some(_), false) => return Err(Fault::NeedsColours),
            (Some(rgb), true) => self.write_words(rgb),
            (None, true) => self.write_words(["1"; 3]),
            (None, false) => {}
        }
        self.out.push('\n');
        Ok(())
    }

    fn write_words<const N: usize>(&mut self, words: [&str; N]) {
        for word in words {
            self.out.push(' ');
            self.out.push_str(word);
        }
    }

    /// `vt u`, `vt u v` or `vt u v w`.
    fn texture_coordinates(&mut self, rest: &str) -> Result<(), Fault> {
        let mut words = rest.split_ascii_whitespace().map(known_number);
        let Some(u) = words.next() else {
            return Err(Fault::Line("expected vt and two numbers, found “vt”".to_owned()));
        };
        let v = words.next().unwrap_or("0");
        self.texcoords += 1;
        self.out.push_str("vt");
        self.write_words([u, v]);
        self.out.push('\n');
        Ok(())
    }

    fn use_material(&mut self, name: &str) {
        let name = Some(name.to_owned()).filter(|name| !name.is_empty());
        self.material = *self.numbers.entry(name).or_insert_with_key(|name| {
            self.materials.push(name.clone());
            self.materials.len() as u32 - 1
        });
    }

    /// Corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`; indices count from 1, or back from the last with a minus.
    fn face(&mut self, rest: &str) -> Result<(), Fault> {
        let mut corners = 0;
        let mut textured = true;
        for corner in rest.split_ascii_whitespace() {
            corners += 1;
            let mut indices = corner.split('/');
            indices.next();
            textured &= indices.next().is_some_and(|vt| !vt.is_empty());
        }
        if corners < 3 {
            self.oddities.short_faces += 1;
            return Ok(());
        }
        self.begin_run(textured);
        self.out.push('f');
        for corner in rest.split_ascii_whitespace() {
            let mut indices = corner.split('/');
            self.out.push(' ');
            self.index(indices.next().unwrap_or(""), self.oddities.vertices as i64, "vertex")?;
            if textured {
                self.out.push('/');
                self.index(indices.next().unwrap_or(""), self.texcoords, "texture coordinate")?;
            }
        }
        self.out.push('\n');
        Ok(())
    }

    /// Writes an index, counted from 1, for one counted from 1 or back from the last.
    fn index(&mut self, word: &str, count: i64, what: &str) -> Result<(), Fault> {
        let Ok(index) = word.parse::<i64>() else {
            return Err(Fault::Line(format!("expected a face of {what} numbers, found “{}” in it", shorten(word))));
        };
        let resolved = if index < 0 { index.saturating_add(count + 1) } else { index };
        if !(1..=count).contains(&resolved) {
            return Err(Fault::Line(format!(
                "the face names {what} {index}, but {count} come before it, counted from 1"
            )));
        }
        if resolved == index {
            // as it stands: most are, and writing numbers takes time
            self.out.push_str(word);
        } else {
            let _ = write!(self.out, "{resolved}");
        }
        Ok(())
    }

    /// A new tobj model where the material changes, where texture coordinates begin or end, and before it grows large.
    fn begin_run(&mut self, textured: bool) {
        self.run_faces += 1;
        if self.run != Some((self.material, textured)) || self.run_faces > RUN {
            self.run = Some((self.material, textured));
            self.run_faces = 1;
            let _ = writeln!(self.out, "g {}", self.material);
        }
    }
}

/// What stands before a comment. A `#` inside a word begins none: some compilers print NaN as `1.#QNAN`.
fn uncommented(rest: &str) -> &str {
    rest.find(" #").or_else(|| rest.find("\t#")).map_or(rest, |i| &rest[..i])
}

/// Other spellings of NaN and infinity (`-1.#IND`, `nan(ind)`) as `nan`: their triangles are left out later, or take no texture.
fn known_number(word: &str) -> &str {
    if word.contains(['#', '(']) { "nan" } else { word }
}

fn shorten(text: &str) -> String {
    text.trim().chars().take(60).collect()
}

/// Gives no more than one statement at a time, so that the current line is that of what was read last.
impl<R: Read> Read for Sanitised<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.taken == self.out.len()
            && let Err(fault) = self.advance()
        {
            self.fault = Some(fault);
            return Err(io::Error::other("stopped"));
        }
        let n = (&self.out.as_bytes()[self.taken..]).read(buffer)?;
        self.taken += n;
        Ok(n)
    }
}

/// Lines that end in LF, CR LF or CR, counted.
struct Lines<R> {
    bytes: BufReader<R>,
    number: usize,
    line: Vec<u8>,
    after_cr: bool,
}

impl<R: Read> Lines<R> {
    /// Reads the next line into `line`, without its end; `false` at the end of the file.
    fn next(&mut self) -> Result<bool, Fault> {
        self.line.clear();
        let mut begun = false;
        loop {
            let ready = self.bytes.fill_buf().map_err(Fault::Io)?;
            if ready.is_empty() {
                self.number += usize::from(begun);
                return Ok(begun);
            }
            if std::mem::take(&mut self.after_cr) && ready[0] == b'\n' {
                self.bytes.consume(1);
                continue;
            }
            begun = true;
            let end = ready.iter().position(|b| matches!(b, b'\n' | b'\r'));
            self.line.extend_from_slice(&ready[..end.unwrap_or(ready.len())]);
            if self.line.len() > LONGEST_LINE {
                return Err(Fault::NotObj("a line of more than 64 MiB".to_owned()));
            }
            match end {
                Some(end) => {
                    self.after_cr = ready[end] == b'\r';
                    self.bytes.consume(end + 1);
                    self.number += 1;
                    return Ok(true);
                }
                None => {
                    let n = ready.len();
                    self.bytes.consume(n);
                }
            }
        }
    }
}
