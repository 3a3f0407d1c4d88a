//! Changes of bytes and of text, deterministic by seed: mostly small, so that a good part of what comes out is still accepted.

/// Pseudo-random numbers: splitmix64 (Steele, Lea and Flood, OOPSLA 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`, 0 where that is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

const NUMBERS: [i64; 16] =
    [0, 1, -1, 2, 7, 127, 128, 255, 256, 32_767, 65_535, 65_536, i32::MAX as i64, u32::MAX as i64, i64::MAX, i64::MIN];

const WORDS: [&str; 22] = [
    "0",
    "-1",
    "1",
    "1e9",
    "-1e9",
    "1e38",
    "1e-12",
    "1e309",
    "-1e-320",
    "nan",
    "inf",
    "-inf",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "0.1",
    "\"\"",
    "[]",
    "{}",
    "true",
    "\u{feff}\u{1b}[2J",
];

/// One change, sometimes a few, to text or bytes; `other` is another input to take parts from.
pub fn mutated(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let is_text = std::str::from_utf8(&bytes).is_ok();
    loop {
        match (is_text, random.below(16)) {
            (true, 1..) => change_text(&mut bytes, other, random),
            (false, 4..) => change_in_place(&mut bytes, random),
            _ => reshape(&mut bytes, other, random),
        }
        if random.below(3) > 0 {
            return bytes;
        }
    }
}

/// A part of `length` things: mostly short.
fn part(length: usize, random: &mut Random) -> std::ops::Range<usize> {
    let start = random.below(length + 1);
    let most = if random.below(8) == 0 { length - start } else { (length - start).min(16) };
    start..start + random.below(most + 1)
}

/// Changes bytes and keeps their number.
pub fn change_in_place(bytes: &mut [u8], random: &mut Random) {
    let size = *random.pick(&[1, 1, 2, 4, 4, 8]);
    if bytes.len() < size {
        return;
    }
    let start = random.below(bytes.len() - size + 1);
    let at = if random.below(2) == 0 { start } else { start / size * size };
    let (place, is_little) = (at..at + size, random.below(2) == 0);
    let old = bytes[place.clone()]
        .iter()
        .enumerate()
        .fold(0u64, |sum, (i, byte)| sum | u64::from(*byte) << (8 * if is_little { i } else { size - 1 - i }));
    let small = 1 + random.below(4) as u64;
    let new = match random.below(8) {
        0 | 1 => old.wrapping_add(small),
        2 | 3 => old.wrapping_sub(small),
        4 => old ^ (1 << random.below(8 * size)),
        5 => *random.pick(&NUMBERS) as u64,
        6 if size == 4 => u64::from((random.below(4000) as f32 / 100.0 - 20.0).to_bits()),
        6 if size == 8 => (random.below(4000) as f64 / 100.0 - 20.0).to_bits(),
        6 => random.next(),
        _ => {
            let from = random.below(bytes.len() - size + 1);
            return bytes.copy_within(from..from + size, at);
        }
    };
    for (i, byte) in bytes[place].iter_mut().enumerate() {
        *byte = (new >> (8 * if is_little { i } else { size - 1 - i })) as u8;
    }
}

/// Takes out, doubles, inserts or cuts.
fn reshape(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    match random.below(9) {
        0 | 1 => drop(bytes.drain(part(bytes.len(), random))),
        2 | 3 => {
            let copy = bytes[part(bytes.len(), random)].to_vec();
            bytes.splice(at..at, copy);
        }
        4 | 5 => {
            let old = part(bytes.len(), random);
            bytes.splice(old, other[part(other.len(), random)].to_vec());
        }
        6 | 7 => {
            let noise: Vec<u8> = (0..random.below(17)).map(|_| random.next() as u8).collect();
            bytes.splice(at..at, noise);
        }
        _ => bytes.truncate(at),
    }
}

/// The word around a place: what holds no blank, bracket, quote or separator.
fn word_at(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let is_word = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b'+' | b'_');
    let start = bytes[..at].iter().rposition(|b| !is_word(b)).map_or(0, |i| i + 1);
    let end = bytes[at..].iter().position(|b| !is_word(b)).map_or(bytes.len(), |i| at + i);
    start..end
}

fn line_at(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
    let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |i| at + i + 1);
    start..end
}

/// Changes a number, a word or a line.
pub fn change_text(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = random.below(bytes.len());
    let kind = random.below(16);
    let word = if kind < 8 { number_near(bytes, at) } else { None }.unwrap_or_else(|| word_at(bytes, at));
    let line = line_at(bytes, at);
    let elsewhere = random.below(bytes.len());
    match kind {
        0..8 => {
            let old = std::str::from_utf8(&bytes[word.clone()]).ok().and_then(|text| text.parse::<f64>().ok());
            let new = match old {
                Some(old) => number(old, random),
                None => (*random.pick(&WORDS)).to_owned(),
            };
            bytes.splice(word, new.into_bytes());
        }
        8 => drop(bytes.splice(word, random.pick(&WORDS).bytes())),
        9 | 10 => {
            let copy = bytes[word_at(bytes, elsewhere)].to_vec();
            bytes.splice(word, copy);
        }
        11 => {
            let copy = other[word_at(other, random.below(other.len()))].to_vec();
            bytes.splice(word, copy);
        }
        12 => {
            let to = line_at(bytes, elsewhere).start;
            let copy = bytes[line].to_vec();
            bytes.splice(to..to, copy);
        }
        13 => {
            let copy = other[line_at(other, random.below(other.len()))].to_vec();
            bytes.splice(line.start..line.start, copy);
        }
        14 => drop(bytes.drain(line)),
        _ => {
            let (copy, to) = (bytes.drain(line).collect::<Vec<u8>>(), random.below(bytes.len() + 1));
            let to = line_at(bytes, to).start;
            bytes.splice(to..to, copy);
        }
    }
}

/// The first number at or behind a place.
fn number_near(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let digit = at + bytes[at..].iter().position(u8::is_ascii_digit)?;
    Some(word_at(bytes, digit))
}

fn number(old: f64, random: &mut Random) -> String {
    let tenth = random.below(1000) as f64 / 10f64.powi(random.below(6) as i32);
    let new = match random.below(10) {
        0 | 1 => old + 1.0,
        2 | 3 => old - 1.0,
        4 => -old,
        5 => old * 2.0,
        6 => old + tenth,
        7 => tenth,
        8 => random.below(9) as f64,
        _ => return (*random.pick(&WORDS[..17])).to_owned(),
    };
    new.to_string()
}
