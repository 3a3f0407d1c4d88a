//! Visibility on generated buildings of 100, 1 000 and 10 000 corners with 20 holes: one query from a random place.
//!
//! `cargo bench --bench visibility`

use clerestory::plan::free_space::open_space::OpenSpace;
use clerestory::plan::visibility::isovist::{Isovist, Scratch};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec2;
use std::hint::black_box;

#[path = "../examples/gallery_building/building.rs"]
mod building;

fn visibility(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("visibility");
    for corners in [100, 1000, 10_000] {
        let polygon = building::building(corners, 20, 1);
        let open = OpenSpace::new(std::slice::from_ref(&polygon)).expect("is a polygon");
        let places = building::places(&open, 1000);
        let (mut scratch, mut seen) = (Scratch::default(), Isovist::default());
        let mut next = 0;
        group.bench_function(BenchmarkId::from_parameter(open.corners().len()), |b| {
            b.iter(|| {
                next = (next + 1) % places.len();
                let place: DVec2 = black_box(places[next]);
                open.visibility_into(place, &mut scratch, &mut seen)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, visibility);
criterion_main!(benches);
