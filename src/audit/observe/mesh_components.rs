//! Parts of a model: triangles that hang together by their corners, such as a bench or a column.

use crate::scene::Mesh;

/// Per triangle the number of its part, from 0 in the order of their first triangle. Corners count as one when they lie
/// at the same place to the last bit, whatever their texture coordinates.
pub(crate) fn parts(mesh: &Mesh) -> Vec<u32> {
    let key = |c: u32| mesh.positions[c as usize].to_array().map(|v| (v + 0.0).to_bits());
    let mut corners: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    corners.sort_unstable_by_key(|c| (key(*c), *c));
    // each corner's root, to begin with the first one at its place
    let mut root: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for pair in corners.windows(2) {
        if key(pair[0]) == key(pair[1]) {
            root[pair[1] as usize] = root[pair[0] as usize];
        }
    }
    for [a, b, c] in &mesh.triangles {
        join(&mut root, *a, *b);
        join(&mut root, *a, *c);
    }
    let mut number = vec![u32::MAX; root.len()];
    let mut next = 0;
    mesh.triangles
        .iter()
        .map(|t| {
            let r = find(&mut root, t[0]) as usize;
            if number[r] == u32::MAX {
                number[r] = next;
                next += 1;
            }
            number[r]
        })
        .collect()
}

fn find(root: &mut [u32], mut i: u32) -> u32 {
    while root[i as usize] != i {
        root[i as usize] = root[root[i as usize] as usize];
        i = root[i as usize];
    }
    i
}

fn join(root: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn triangles_hang_together_by_the_places_of_their_corners() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let mesh = Mesh {
            positions: vec![
                at(0., 0.),
                at(1., 0.),
                at(0., 1.),
                at(5., 5.),
                at(6., 5.),
                at(5., 6.),
                at(1., 0.),
                at(0., 1.),
                at(1., 1.),
            ],
            uvs: vec![],
            colours: vec![],
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 8, 7]],
            materials: vec![0; 3],
        };
        assert_eq!(parts(&mesh), [0, 1, 0]);
    }
}
