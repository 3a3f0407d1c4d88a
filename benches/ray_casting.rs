//! Primary rays of a site's views at 512×512 on 2 threads, one by one and in packets, and incoherent rays. Elements
//! are rays. For the comparison with Embree see compare_embree.sh.

mod rays;

use clerestory::scene::Tracer;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rays::{View, cast_packets, cast_single};

type Cast = fn(&Tracer, &View) -> (usize, f64);

fn ray_casting(c: &mut Criterion) {
    let Some(path) = rays::site() else { return };
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(2).build() else { return };
    for side in [1, 2] {
        let Ok((scene, views)) = rays::load(&path, side) else { return };
        if side == 1 {
            c.bench_function("build", |b| b.iter(|| pool.install(|| Tracer::new(&scene.mesh))));
        }
        let mut group = c.benchmark_group(format!("primary rays, {} a pixel", side * side));
        group.sample_size(10);
        group.throughput(Throughput::Elements(views.iter().map(|v| v.directions.len() as u64).sum()));
        for (name, cast) in [("single", cast_single as Cast), ("packets", cast_packets)] {
            group.bench_function(BenchmarkId::from_parameter(name), |b| {
                b.iter(|| pool.install(|| views.iter().map(|v| cast(&scene.tracer, v).0).sum::<usize>()));
            });
        }
        group.finish();
        if side == 1 {
            let scattered: Vec<View> = views.iter().map(rays::scattered).collect();
            let mut group = c.benchmark_group("scattered rays");
            group.sample_size(10);
            group.throughput(Throughput::Elements(scattered.iter().map(|v| v.directions.len() as u64).sum()));
            for (name, cast) in [("single", cast_single as Cast), ("packets", cast_packets)] {
                group.bench_function(BenchmarkId::from_parameter(name), |b| {
                    b.iter(|| pool.install(|| scattered.iter().map(|v| cast(&scene.tracer, v).0).sum::<usize>()));
                });
            }
            group.finish();
        }
    }
}

criterion_group!(benches, ray_casting);
criterion_main!(benches);
