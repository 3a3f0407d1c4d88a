//! The model's surface coloured by how it is seen, as a PLY file that MeshLab and CloudCompare open.

use std::io::{self, Write};

use super::output::Outward;
use super::site::SurfacePlan;

/// What a colour means: the same as on the sheets.
const OUTSIDE: [u8; 3] = [200, 200, 200];
const UNREACHABLE: [u8; 3] = [0, 0, 0];
const UNSEEN: [u8; 3] = [213, 94, 0];
const SEEN: [[u8; 3]; 3] = [[240, 228, 66], [86, 180, 233], [0, 114, 178]];

/// Writes `coverage.ply` (binary, little-endian): for each piece of surface three vertices of its own in the model's
/// axes and units, coloured by the number of stations that see it (vermilion none, yellow 1, sky blue 2, blue 3 and
/// more; black what no allowed place sees; grey what does not face the rooms), and for each face `stations` and
/// `incidence`, the best angle of incidence in degrees (−1: not seen).
///
/// # Errors
///
/// If writing fails.
pub fn write(plan: &SurfacePlan<'_>, out: &Outward, file: &mut impl Write) -> io::Result<()> {
    let SurfacePlan { surface, reachable, interior, seen } = plan;
    let count = surface.patches.len();
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\ncomment stations: how many stations see a face; incidence: degrees, -1 \
         unseen\ncomment grey outside, black unreachable, vermilion unseen, yellow 1, sky blue 2, blue 3 or \
         more\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nproperty uchar \
         red\nproperty uchar green\nproperty uchar blue\nelement face {count}\nproperty list uchar int \
         vertex_indices\nproperty uchar stations\nproperty float incidence\nend_header\n",
        3 * count
    )?;
    for patch in 0..count {
        let colour = match (interior[patch], reachable[patch], seen.stations[patch]) {
            (false, false, _) => OUTSIDE,
            (_, false, _) => UNREACHABLE,
            (_, _, 0) => UNSEEN,
            (_, _, n) => SEEN[usize::from(n).min(3) - 1],
        };
        for corner in surface.patches.corners(&surface.scene.mesh, patch) {
            let p = out.frame.point_out(corner.as_dvec3() + out.origin);
            p.to_array().iter().try_for_each(|v| file.write_all(&v.to_le_bytes()))?;
            file.write_all(&colour)?;
        }
    }
    for patch in 0..count {
        file.write_all(&[3])?;
        (0..3).try_for_each(|k| file.write_all(&((3 * patch + k) as i32).to_le_bytes()))?;
        let n = seen.stations[patch];
        let incidence = if n == 0 { -1.0 } else { seen.cosine[patch].clamp(0.0, 1.0).acos().to_degrees() };
        file.write_all(&[n])?;
        file.write_all(&incidence.to_le_bytes())?;
    }
    Ok(())
}
