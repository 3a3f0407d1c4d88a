//! What a model is made of.

use clerestory::scene::Mesh;
use std::collections::BTreeMap;

/// Connected parts of the model (triangles that share a corner's place): a number for each triangle.
pub fn objects(mesh: &Mesh) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..mesh.triangles.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    let mut at: BTreeMap<[i64; 3], usize> = BTreeMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for &c in corners {
            let key = mesh.positions[c as usize].to_array().map(|v| (f64::from(v) * 1e3).round() as i64);
            let other = *at.entry(key).or_insert(t);
            let (a, b) = (root(&mut parent, t), root(&mut parent, other));
            parent[a.max(b)] = a.min(b);
        }
    }
    (0..parent.len()).map(|t| root(&mut parent, t)).collect()
}
