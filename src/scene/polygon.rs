//! Cutting a face of more than three corners into triangles.

use glam::{DVec2, DVec3};

/// Past this many corners cutting ears takes too long, and a fan has to do.
const MOST_CORNERS: usize = 4096;

/// Cuts a face into triangles that cover it, concave or not, by cutting ears in the plane of Newell's normal. `false`
/// where only a fan was possible: too many corners, or corners on one line.
pub(super) fn triangulate(face: &[u32], points: &[DVec3], add: &mut impl FnMut([u32; 3])) -> bool {
    if let [a, b, c] = *face {
        add([a, b, c]);
        return true;
    }
    let normal = newell(face, points);
    if face.len() > MOST_CORNERS || !normal.is_finite() || normal == DVec3::ZERO {
        fan(face, add);
        return false;
    }
    let flat: Vec<DVec2> = face.iter().map(|&i| project(points[i as usize], normal)).collect();
    let mut left: Vec<usize> = (0..face.len()).collect();
    let mut at = 0;
    let mut refused = 0;
    while left.len() > 3 && refused < left.len() {
        let n = left.len();
        let ear = [left[(at + n - 1) % n], left[at % n], left[(at + 1) % n]];
        if is_ear(ear, &left, &flat) {
            add(ear.map(|i| face[i]));
            left.remove(at % n);
            // the next ear is sought one corner on, which keeps triangles from all meeting at one corner
            at = (at % n) % (n - 1);
            refused = 0;
        } else {
            refused += 1;
        }
        at += 1;
    }
    let rest: Vec<u32> = left.into_iter().map(|i| face[i]).collect();
    fan(&rest, add);
    rest.len() == 3
}

fn fan(face: &[u32], add: &mut impl FnMut([u32; 3])) {
    for pair in face.windows(2).skip(1) {
        add([face[0], pair[0], pair[1]]);
    }
}

/// Twice the area of a polygon, as a vector along its normal (Newell's sums, about the first corner).
fn newell(face: &[u32], points: &[DVec3]) -> DVec3 {
    let first = points[face[0] as usize];
    let arm = |i: u32| points[i as usize] - first;
    face.windows(2).map(|p| arm(p[0]).cross(arm(p[1]))).sum()
}

/// Drops the axis that the normal is nearest to, keeping the winding counter-clockwise.
fn project(p: DVec3, normal: DVec3) -> DVec2 {
    let n = normal.abs();
    let (flat, sign) = if n.z >= n.x && n.z >= n.y {
        (DVec2::new(p.x, p.y), normal.z)
    } else if n.y >= n.x {
        (DVec2::new(p.z, p.x), normal.y)
    } else {
        (DVec2::new(p.y, p.z), normal.x)
    };
    if sign < 0.0 { DVec2::new(flat.y, flat.x) } else { flat }
}

/// Whether a corner turns left and no other corner lies in its triangle.
fn is_ear([a, b, c]: [usize; 3], left: &[usize], flat: &[DVec2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    let (pa, pb, pc) = (flat[a], flat[b], flat[c]);
    if side(pa, pb, pc) <= 0.0 {
        return false;
    }
    let inside = |p: DVec2| side(pa, pb, p) >= 0.0 && side(pb, pc, p) >= 0.0 && side(pc, pa, p) >= 0.0;
    // a corner repeated at the same place (a bridge to a hole) is no obstacle
    left.iter().all(|&i| [a, b, c].contains(&i) || [pa, pb, pc].contains(&flat[i]) || !inside(flat[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[DVec3]) -> (Vec<[u32; 3]>, bool) {
        let face: Vec<u32> = (0..points.len() as u32).collect();
        let mut triangles = Vec::new();
        let proper = triangulate(&face, points, &mut |t| triangles.push(t));
        (triangles, proper)
    }

    fn area(triangles: &[[u32; 3]], points: &[DVec3]) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| move |t: &[u32; 3]| t[k] as usize);
        triangles.iter().map(|t| 0.5 * (points[b(t)] - points[a(t)]).cross(points[c(t)] - points[a(t)]).length()).sum()
    }

    /// An L, whose fan from its first corner would cover ground outside it; in all planes and both windings.
    #[test]
    fn a_concave_face_keeps_its_area() {
        let l = [(4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
        let planes: [fn(f64, f64) -> DVec3; 3] =
            [|x, y| DVec3::new(x, y, 2.0), |x, y| DVec3::new(y, 7.0, x), |x, y| DVec3::new(1.0, x, y)];
        for plane in planes {
            let mut points: Vec<DVec3> = l.iter().map(|&(x, y)| plane(x, y)).collect();
            for _ in 0..2 {
                let (triangles, proper) = cut(&points);
                assert!(proper && triangles.len() == 4);
                assert!((area(&triangles, &points) - 6.0).abs() < 1e-12);
                points.reverse();
            }
        }
    }

    #[test]
    fn an_arrow_of_four_corners_is_cut_at_its_notch() {
        let points = [(0.0, 0.0), (4.0, 2.0), (0.0, 4.0), (1.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let (triangles, proper) = cut(&points);
        assert!(proper);
        assert!((area(&triangles, &points) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn corners_on_a_line_make_a_fan() {
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::X * f64::from(i)).collect();
        let (triangles, proper) = cut(&points);
        assert!(!proper && triangles.len() == 3);
    }
}
