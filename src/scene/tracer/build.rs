//! Building both trees from one of obvhs's.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2 as Built;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use rayon::prelude::*;

use super::bvh2::Bvh2;
use super::bvh4::Bvh4;
use super::hit::Triangles;
use super::triangle::Corners;
use crate::scene::mesh::Mesh;

/// obvhs recurses as deep as the tree, which coincident triangles make very deep.
const STACK_BYTES: usize = 256 << 20;

/// How much boxes are larger than their triangles, as a part of the [largest](reach) coordinate: more than the rounding of
/// any box test, so that no box is missed whose triangle is hit.
const MARGIN: f32 = 2e-6;

/// What lies so many times as far from the origin as nine tenths of all triangles has a margin of its own, so that one stray
/// triangle does not make all boxes huge.
const STRAY: f32 = 64.0;

/// On Šibenik cathedral the slower presets, which split triangles, gain nothing worth their memory.
const PRESET: BvhBuildParams = BvhBuildParams::medium_build();

/// The triangles in the order of the leaves, and both trees over them.
type Trees = (Triangles, Bvh2, Bvh4);

pub(super) fn build(mesh: &Mesh) -> Trees {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(rayon::current_num_threads())
        .stack_size(STACK_BYTES)
        .thread_name(|_| "tree".to_owned())
        .build();
    match pool {
        Ok(pool) => pool.install(|| plant(mesh)),
        Err(_) => plant(mesh), // no more threads to be had: all but absurdly deep trees fit the caller's stack
    }
}

fn plant(mesh: &Mesh) -> Trees {
    let mut tree = sown(mesh);
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, PRESET.reinsertion_batch_ratio, None);
    collapse(&mut tree, PRESET.max_prims_per_leaf, PRESET.collapse_traversal_cost);
    let again = PRESET.reinsertion_batch_ratio * PRESET.post_collapse_reinsertion_batch_ratio_multiplier;
    optimizer.run(&mut tree, again, None);
    let (bvh2, ids) = Bvh2::new(&tree);
    let corners = ids.par_iter().map(|&i| Corners::new(mesh.corners(i))).collect();
    let bvh4 = Bvh4::new(&bvh2);
    (Triangles { corners, ids }, bvh2, bvh4)
}

/// A triangle's largest coordinate.
fn reach(mesh: &Mesh, triangle: u32) -> f32 {
    mesh.corners(triangle).iter().fold(0.0, |most, corner| most.max(corner.abs().max_element()))
}

/// The largest coordinate of all triangles but strays.
fn usual_reach(mesh: &Mesh) -> f32 {
    let mut all: Vec<f32> = (0..mesh.triangles.len() as u32).into_par_iter().map(|i| reach(mesh, i)).collect();
    let most = all.iter().fold(0.0f32, |most, r| most.max(*r));
    let usual = all.len() * 9 / 10;
    if all.is_empty() { 0.0 } else { most.min(STRAY * *all.select_nth_unstable_by(usual, f32::total_cmp).1) }
}

/// A tree with one triangle a leaf.
fn sown(mesh: &Mesh) -> Built {
    let usual = usual_reach(mesh);
    let boxes: Vec<Aabb> = (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .map(|i| {
            let tight = Aabb::from_points(&mesh.corners(i).map(Vec3A::from));
            let margin = Vec3A::splat(MARGIN * reach(mesh, i).max(usual));
            Aabb::new(tight.min - margin, tight.max + margin)
        })
        .collect();
    PlocBuilder::with_capacity(boxes.len()).build(
        PRESET.ploc_search_distance,
        &boxes,
        (0..boxes.len() as u32).collect(),
        PRESET.sort_precision,
        PRESET.search_depth_threshold,
    )
}
