//! Changes inside what formats wrap: chunks, pages and compressed data, with lengths and checksums made right again, so that
//! they reach what lies behind.

use crate::mutate::{Random, change_in_place, change_text, mutated};
use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};
use std::io::Read;

/// An input changed as suits its reader, now and then as plain bytes; `other` is another input to take parts from.
pub fn changed(reader: &str, bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    if random.below(16) == 0 {
        return mutated(bytes, other, random);
    }
    let inside = match reader {
        "png" => change_png(bytes, other, random),
        "e57" => change_e57(bytes, random),
        "gltf" if bytes.starts_with(b"glTF") => change_glb(bytes, other, random),
        "ply" => change_headed(bytes, b"end_header\n", random),
        "hdr" => change_headed(bytes, b"\n\n", random),
        "tiff" | "exr" => {
            let mut bytes = bytes.to_vec();
            change_in_place(&mut bytes, random);
            Some(bytes)
        }
        _ => None,
    };
    inside.unwrap_or_else(|| mutated(bytes, other, random))
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at.checked_add(N)?)?.try_into().ok()
}

/// Text up to a mark, bytes from there.
fn change_headed(bytes: &[u8], mark: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    std::str::from_utf8(bytes).err()?;
    let head = bytes.windows(mark.len()).position(|part| part == mark)? + mark.len();
    let (mut text, mut body) = (bytes[..head].to_vec(), bytes[head..].to_vec());
    match random.below(3) {
        0 => change_text(&mut text, &bytes[..head], random),
        _ => change_in_place(&mut body, random),
    }
    Some([text, body].concat())
}

/// Cyclic redundancy check with a reflected polynomial.
fn crc(polynomial: u32, bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ polynomial } else { c >> 1 })
    })
}

type Chunk = ([u8; 4], Vec<u8>);

/// Each chunk: length, type, data, CRC-32 of type and data (W3C, *PNG*, 5.3).
fn change_png(bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let mut chunks = png_chunks(bytes)?;
    let first = chunks.iter().position(|(kind, _)| kind == b"IDAT")?;
    let one = random.below(chunks.len());
    match random.below(8) {
        0..4 => change_pixels(&mut chunks, first, random)?,
        4 | 5 => change_in_place(&mut chunks[one].1, random),
        6 => {
            let others = png_chunks(other)?;
            let taken =
                others.get(random.below(others.len())).filter(|(kind, _)| kind != b"IDAT" && kind != b"IEND")?;
            chunks.insert(1 + random.below(first), taken.clone());
        }
        _ => chunks[one].1 = mutated(&chunks[one].1, other, random),
    }
    let mut out = bytes[..8].to_vec();
    for (kind, data) in chunks {
        let named = [&kind[..], &data].concat();
        out.extend((data.len() as u32).to_be_bytes());
        out.extend(&named);
        out.extend(crc(0xedb8_8320, &named).to_be_bytes());
    }
    Some(out)
}

fn png_chunks(bytes: &[u8]) -> Option<Vec<Chunk>> {
    let (mut chunks, mut at) = (Vec::new(), 8);
    while at < bytes.len() {
        let length = u32::from_be_bytes(number(bytes, at)?) as usize;
        let data = bytes.get(at + 8..(at + 8).checked_add(length)?)?;
        chunks.push((number(bytes, at + 4)?, data.to_vec()));
        at += 12 + length;
    }
    Some(chunks)
}

/// Changes what the pixels' chunks hold in compressed form.
fn change_pixels(chunks: &mut Vec<Chunk>, first: usize, random: &mut Random) -> Option<()> {
    let packed: Vec<u8> =
        chunks.iter().filter(|(kind, _)| kind == b"IDAT").flat_map(|(_, data)| data.clone()).collect();
    let (mut pixels, mut again) = (Vec::new(), Vec::new());
    // what is damaged is kept as far as it goes
    let _ = ZlibDecoder::new(&packed[..]).take(1 << 16).read_to_end(&mut pixels);
    change_in_place(&mut pixels, random);
    ZlibEncoder::new(&pixels[..], Compression::fast()).read_to_end(&mut again).ok()?;
    chunks.retain(|(kind, _)| kind != b"IDAT");
    chunks.insert(first, (*b"IDAT", again));
    Some(())
}

/// Each page of 1024 bytes ends in the CRC-32C of the rest; the head names the file's length and where its XML lies
/// (ASTM E2807, 6.2 and 7).
fn change_e57(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    const PAGE: usize = 1024;
    const DATA: usize = PAGE - 4;
    let mut all: Vec<u8> = bytes.chunks_exact(PAGE).flat_map(|page| page[..DATA].to_vec()).collect();
    let offset = usize::try_from(u64::from_le_bytes(number(&all, 24)?)).ok()?;
    let length = usize::try_from(u64::from_le_bytes(number(&all, 32)?)).ok()?;
    let start = offset / PAGE * DATA + offset % PAGE;
    let end = start.checked_add(length).filter(|end| start >= 48 && start < *end && *end <= all.len())?;
    match random.below(8) {
        0 => change_in_place(&mut all[..48], random),
        1..4 => change_in_place(&mut all[48..start], random),
        _ => {
            let mut xml = all[start..end].to_vec();
            change_text(&mut xml, &all[start..end], random);
            all[32..40].copy_from_slice(&(xml.len() as u64).to_le_bytes());
            all.splice(start..end, xml);
            all.resize(all.len().next_multiple_of(DATA), 0);
            let size = (all.len() / DATA * PAGE) as u64;
            all[16..24].copy_from_slice(&size.to_le_bytes());
        }
    }
    let paged = |data: &[u8]| [data, &crc(0x82f6_3b78, data).to_be_bytes()[..]].concat();
    Some(all.chunks_exact(DATA).flat_map(paged).collect())
}

/// A head of 12 bytes, then chunks of length, type and data in fours (Khronos, *glTF 2.0*, 4.4).
fn change_glb(bytes: &[u8], other: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let (mut chunks, mut at) = (Vec::<Chunk>::new(), 12);
    while at < bytes.len() {
        let length = u32::from_le_bytes(number(bytes, at)?) as usize;
        chunks.push((number(bytes, at + 4)?, bytes.get(at + 8..(at + 8).checked_add(length)?)?.to_vec()));
        at += 8 + length;
    }
    let one = if random.below(4) > 0 { 0 } else { random.below(chunks.len()) };
    let (kind, data) = chunks.get_mut(one)?;
    match (*kind == *b"JSON", random.below(8)) {
        (_, 0) => *data = mutated(data, other, random),
        (true, _) => {
            let own = data.clone();
            change_text(data, &own, random);
        }
        (false, _) => change_in_place(data, random),
    }
    data.resize(data.len().next_multiple_of(4), b' ');
    let body: Vec<u8> =
        chunks.iter().flat_map(|(kind, data)| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat()).collect();
    Some([&bytes[..8], &(12 + body.len() as u32).to_le_bytes()[..], &body].concat())
}
