//! Mutations of bytes and of text, and the checksums that formats would refuse them by.

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

const WORDS: [&str; 20] = [
    "0",
    "-1",
    "1",
    "1e9",
    "1e38",
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

/// Longer inputs are cut.
const LONGEST: usize = 1 << 16;

/// One to three changes; `other` is another input to take parts from.
pub fn mutated(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let is_text = std::str::from_utf8(&bytes).is_ok();
    for _ in 0..1 + random.below(3) {
        if is_text && random.below(3) > 0 { change_text(&mut bytes, random) } else { change(&mut bytes, other, random) }
    }
    bytes.truncate(LONGEST);
    bytes
}

fn range(length: usize, random: &mut Random) -> std::ops::Range<usize> {
    let start = random.below(length + 1);
    let most = if random.below(4) == 0 { length - start } else { (length - start).min(16) };
    start..start + random.below(most + 1)
}

fn change(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(9) {
        0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
        1 if !bytes.is_empty() => bytes[at] = random.next() as u8,
        2 | 3 => {
            let (size, number) = (*random.pick(&[1, 2, 4, 8]), *random.pick(&NUMBERS));
            let little = number.to_le_bytes();
            let big = number.to_be_bytes();
            let new = if random.below(2) == 0 { &little[..size] } else { &big[8 - size..] };
            if let Some(old) = bytes.get_mut(at..at + size) {
                old.copy_from_slice(new);
            }
        }
        4 => drop(bytes.drain(range(bytes.len(), random))),
        5 => {
            let part = bytes[range(bytes.len(), random)].to_vec();
            bytes.splice(at..at, part);
        }
        6 => {
            let part = other[range(other.len(), random)].to_vec();
            let old = range(bytes.len(), random);
            bytes.splice(old, part);
        }
        7 => {
            let length = random.below(17);
            let part: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
            bytes.splice(at..at, part);
        }
        _ if random.below(8) == 0 => bytes.truncate(at),
        _ => {}
    }
}

/// Changes a word or a line.
fn change_text(bytes: &mut Vec<u8>, random: &mut Random) {
    let is_word = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b'+' | b'_');
    let at = random.below(bytes.len());
    let start = (0..at).rev().find(|i| !is_word(bytes[*i])).map_or(0, |i| i + 1);
    let end = (at..bytes.len()).find(|i| !is_word(bytes[*i])).unwrap_or(bytes.len()).max(start);
    let line_start = (0..at).rev().find(|i| bytes[*i] == b'\n').map_or(0, |i| i + 1);
    let line_end = (at..bytes.len()).find(|i| bytes[*i] == b'\n').map_or(bytes.len(), |i| i + 1);
    let line = bytes[line_start..line_end.max(line_start)].to_vec();
    match random.below(5) {
        0 | 1 => drop(bytes.splice(start..end, random.pick(&WORDS).bytes())),
        2 => {
            let number = random.below(1000) as f64 / 10f64.powi(random.below(6) as i32);
            drop(bytes.splice(start..end, number.to_string().into_bytes()));
        }
        3 => drop(bytes.splice(line_start..line_start, line)),
        _ => drop(bytes.drain(line_start..line_end.max(line_start))),
    }
}

/// Makes checksums right again, so that changes get past them.
pub fn mend_checksums(reader: &str, bytes: &mut [u8]) {
    match reader {
        "png" => mend_png(bytes),
        "e57" => mend_e57(bytes),
        _ => {}
    }
}

/// Cyclic redundancy check with a reflected polynomial.
fn crc(polynomial: u32, bytes: impl Iterator<Item = u8>) -> u32 {
    !bytes.fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { (c >> 1) ^ polynomial } else { c >> 1 })
    })
}

/// Each chunk: length, type, data, CRC-32 of type and data (W3C, *PNG*, 5.3).
fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let Some(end) = at.checked_add(8 + length).filter(|end| end + 4 <= bytes.len()) else { return };
        let sum = crc(0xedb8_8320, bytes[at + 4..end].iter().copied());
        bytes[end..end + 4].copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}

/// Each page of 1024 bytes ends in the CRC-32C of the rest (ASTM E2807, 6.2).
fn mend_e57(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(1024) {
        let sum = crc(0x82f6_3b78, page[..1020].iter().copied());
        page[1020..].copy_from_slice(&sum.to_be_bytes());
    }
}
