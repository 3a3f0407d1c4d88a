//! Makes the bundled chapel.
#![allow(clippy::print_stdout, missing_docs, unreachable_pub)]
mod chapel;
fn main() {
    let dir = std::env::args().nth(1).unwrap();
    for (name, v) in [("model", chapel::Version::Truth), ("as_modelled", chapel::Version::AsModelled)] {
        let m = chapel::model(v);
        let d = format!("{dir}/{name}");
        std::fs::create_dir_all(&d).unwrap();
        std::fs::write(format!("{d}/chapel.obj"), m.obj("chapel.mtl")).unwrap();
        std::fs::write(format!("{d}/chapel.mtl"), m.mtl()).unwrap();
        for f in m.finishes() {
            if let Some(t) = f.texture { std::fs::write(format!("{d}/{t}"), chapel::paint::picture(t).unwrap().unwrap()).unwrap(); }
        }
        println!("{name}: {} triangles {} positions {} uvs", m.triangles(), m.positions.len(), m.uvs.len());
    }
}
