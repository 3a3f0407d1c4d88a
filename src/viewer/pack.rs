//! Numbers as a browser can unpack them: differences in byte planes, deflated. `page/unpack.js` holds the other half.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::Vec3;
use std::io::Write;

/// A part of the page's data.
pub(super) struct Block {
    pub(super) kind: &'static str,
    pub(super) bytes: Vec<u8>,
}

/// Deflated (RFC 1950), the same bytes for the same input.
pub(super) fn deflated(bytes: &[u8]) -> Block {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(8));
    // memory takes everything
    let _ = encoder.write_all(bytes);
    Block { kind: "deflate", bytes: encoder.finish().unwrap_or_default() }
}

/// Codes of so many bytes each as planes, the highest bytes first.
fn planes(codes: impl Iterator<Item = u32> + Clone, wide: u32, bytes: &mut Vec<u8>) {
    for plane in (0..wide).rev() {
        bytes.extend(codes.clone().map(|c| (c >> (8 * plane)) as u8));
    }
}

/// Numbers of so many bytes each as differences, 0, −1, 1, −2, … as 0, 1, 2, 3, …, in planes.
pub(super) fn differences(values: &[u32], wide: u32, bytes: &mut Vec<u8>) {
    let unused = 32 - 8 * wide;
    let mut last = 0u32;
    let codes: Vec<u32> = (values.iter())
        .map(|&v| {
            // differences wrap around at so many bytes
            let d = (v.wrapping_sub(last) << unused) as i32 >> unused;
            last = v;
            ((d << 1) ^ (d >> 31)) as u32
        })
        .collect();
    planes(codes.iter().copied(), wide, bytes);
}

/// Corners of triangles, as how far each is below the first vertex that has not been named yet: vertices stand in the order
/// of their first use, so that a new one is 0.
pub(super) fn corners(triangles: &[[u32; 3]], bytes: &mut Vec<u8>) {
    let mut next = 0u32;
    let codes: Vec<u32> = (triangles.iter().flatten())
        .map(|&v| {
            let code = next.wrapping_sub(v);
            next += u32::from(code == 0);
            code
        })
        .collect();
    planes(codes.iter().copied(), 4, bytes);
}

/// Bytes of vertices, as planes of differences.
pub(super) fn vertex_bytes<const N: usize>(values: impl Iterator<Item = [u8; N]> + Clone, bytes: &mut Vec<u8>) {
    for plane in 0..N {
        let mut last = 0u8;
        bytes.extend(values.clone().map(|v| {
            let d = v[plane].wrapping_sub(last);
            last = v[plane];
            d
        }));
    }
}

/// A colour with one exponent (Ward, *Real pixels*, Graphics Gems II, 1991): value = (code + ½) · 2^(exponent − 136); zeros for
/// black. Channels keep 8 bits of the brightest; lights beyond 2¹¹⁹ are the brightest that there is.
pub(super) fn shared_exponent(c: Vec3) -> [u8; 4] {
    let peak = c.max_element();
    if peak.is_nan() || peak < 1e-36 {
        return [0; 4];
    }
    // frexp: peak = m · 2^e with m in ½..1
    let exponent = ((peak.to_bits() >> 23) as i32 - 126).min(119);
    let scale = (8.0 - exponent as f32).exp2();
    let code = |v: f32| (v.max(0.0) * scale) as u8;
    [code(c.x), code(c.y), code(c.z), (exponent + 128) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `page/unpack.js` unpacks it.
    fn unpacked(c: [u8; 4]) -> Vec3 {
        let scale = (f32::from(c[3]) - 136.0).exp2();
        if c[3] == 0 { Vec3::ZERO } else { Vec3::from([c[0], c[1], c[2]].map(|v| (f32::from(v) + 0.5) * scale)) }
    }

    #[test]
    fn colours_keep_their_light_from_the_darkest_to_the_brightest() {
        for scale in [1e-20, 1e-6, 0.3, 1.0, 7.9, 255.9, 1e9, 1e30] {
            let c = Vec3::new(1.0, 0.5, 0.02) * scale;
            let off = (unpacked(shared_exponent(c)) - c).abs() / c.max_element();
            assert!(off.max_element() <= 1.0 / 256.0, "{scale}: {off}");
        }
        assert_eq!(shared_exponent(Vec3::ZERO), [0; 4]);
        assert!(unpacked(shared_exponent(Vec3::splat(f32::MAX))).x > 1e35);
    }

    #[test]
    fn differences_are_small_where_numbers_are_near_and_wrap() {
        let mut bytes = Vec::new();
        differences(&[0xffff, 0, 1, 0xfffe], 2, &mut bytes);
        // −1, 1, 1, −3: high bytes, then low ones
        assert_eq!(bytes, [0, 0, 0, 0, 1, 2, 2, 5]);
        bytes.clear();
        corners(&[[0, 1, 2], [2, 1, 3]], &mut bytes);
        assert_eq!(bytes[18..], [0, 0, 0, 1, 2, 0]);
    }
}
