//! Damaged, odd and absurd pictures: never a panic, never a hang, never a huge allocation; a clear message or the right
//! pixels.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use support::data::shared;
use support::program::program;

use clerestory::panorama::{Layer, PanoramaError, Picture, dimensions, read, write_exr, write_png};
use glam::Vec3;

fn corpus(folder: &str) -> Vec<PathBuf> {
    let Some(path) = shared(&format!("cursed/exr/{folder}")) else { return Vec::new() };
    let mut files: Vec<_> = fs::read_dir(path).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

/// Reads in a thread of its own, so that a panic or a hang is told with the file's name.
fn read_safely(path: &Path) -> Result<Picture, PanoramaError> {
    let (send, receive) = mpsc::channel();
    let file = path.to_path_buf();
    std::thread::spawn(move || drop(send.send((read(&file), dimensions(&file)))));
    match receive.recv_timeout(Duration::from_secs(10)) {
        Ok((Ok(picture), size)) => {
            assert_eq!(picture.pixels.len(), picture.width * picture.height);
            assert_eq!(size.unwrap(), (picture.width, picture.height), "{}", path.display());
            Ok(picture)
        }
        Ok((Err(error), _)) => {
            let message = error.to_string();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            assert!(message.contains(&name) && message.len() > name.len() + 20, "{message}");
            Err(error)
        }
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{} takes longer than 10 s", path.display()),
        Err(mpsc::RecvTimeoutError::Disconnected) => panic!("{} made the reader panic", path.display()),
    }
}

#[test]
fn damaged_files_are_told() {
    for path in corpus("invalid") {
        match read_safely(&path) {
            Ok(picture) => println!("{}: read, {} × {}", path.display(), picture.width, picture.height),
            Err(error) => println!("{error}"),
        }
    }
}

#[test]
fn odd_but_right_files_are_read() {
    for path in corpus("valid") {
        let picture = read_safely(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(picture.pixels.iter().all(|p| p.is_finite()), "{}", path.display());
        assert!(picture.pixels.iter().any(|p| *p != picture.pixels[0]), "{}", path.display());
    }
}

/// The largest difference over the larger of the values and a hundredth of the picture's mean.
fn difference(a: &Picture, b: &Picture) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let mean = b.pixels.iter().map(|p| p.abs()).sum::<Vec3>().element_sum() / (3 * b.pixels.len()) as f32;
    let relative = |(a, b): (&Vec3, &Vec3)| ((a - b).abs() / b.abs().max(Vec3::splat(0.01 * mean))).max_element();
    a.pixels.iter().zip(&b.pixels).map(relative).fold(0.0, f32::max)
}

#[test]
fn every_codec_gives_the_right_values() {
    let Some(folder) = shared("cursed/exr/valid") else { return };
    let file = |name: &str| read(&folder.join(format!("{name}.exr"))).unwrap();
    // (file, what it must equal, relative tolerance): lossless codecs and codecs that decode in one way only exactly;
    // DWA's cosine transform may round the other way in its last half-float bit (2⁻¹¹), twice in the dark
    let pairs = [
        ("zip", "uncompressed", 0.0),
        ("zips", "uncompressed", 0.0),
        ("rle", "uncompressed", 0.0),
        ("piz", "uncompressed", 0.0),
        ("b44", "decompressed_b44", 0.0),
        ("b44a", "decompressed_b44a", 0.0),
        ("pxr24", "decompressed_pxr24", 0.0),
        ("dwaa", "decompressed_dwaa", 0.02),
        ("dwab", "decompressed_dwab", 0.02),
        ("rgb_plus_y_dwaa", "rgb_plus_y_dwaa_ground_truth", 0.001),
        ("y_ry_by_dwaa", "y_ry_by_dwaa_ground_truth", 0.001),
        ("f16_zips", "f16_uncompressed", 0.0),
        ("f16_rle", "f16_uncompressed", 0.0),
        ("f16_piz", "f16_uncompressed", 0.0),
        ("f16_pxr24", "f16_uncompressed", 0.001),
        ("f16_b44", "f16_uncompressed", 0.2),
        ("f32_zips", "f32_zip", 0.0),
        ("f32_piz", "f32_zip", 0.0),
        ("f32_pxr24", "f32_zip", 1e-3),
        ("f16_zip", "f32_zip", 1e-3),
    ];
    for (name, expected, tolerance) in pairs {
        let off = difference(&file(name), &file(expected));
        println!("{name} against {expected}: {off}");
        assert!(off <= tolerance, "{name} against {expected}: {off}");
    }
}

fn little_picture() -> Picture {
    let mut picture = Picture::new(40, 20);
    for (i, p) in picture.pixels.iter_mut().enumerate() {
        *p = Vec3::new((i % 40) as f32 * 0.1, (i % 7) as f32, 1.0 / (1.0 + i as f32));
    }
    picture
}

/// The same picture in every format that can be written here, and as a hand-made Radiance file.
fn samples(folder: &Path) -> Vec<PathBuf> {
    let picture = little_picture();
    let (exr, png, hdr) = (folder.join("a.exr"), folder.join("a.png"), folder.join("a.hdr"));
    write_exr(&exr, 40, 20, &[Layer::rgb("", &picture)], Some("note")).unwrap();
    write_png(&png, &picture, clerestory::panorama::Exposure(0.5)).unwrap();
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 20 +X 40\n".to_vec();
    bytes.extend((0..20 * 40).flat_map(|i| [(i % 100 + 100) as u8, 128, 7, 128]));
    fs::write(&hdr, bytes).unwrap();
    vec![exr, png, hdr]
}

#[test]
fn a_file_cut_anywhere_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for path in samples(folder.path()) {
        assert!(read_safely(&path).is_ok(), "{}", path.display());
        let whole = fs::read(&path).unwrap();
        let cut = folder.path().join(format!("cut.{}", path.extension().unwrap().to_string_lossy()));
        for k in 0..40 {
            let length = whole.len() * k / 40;
            fs::write(&cut, &whole[..length]).unwrap();
            // a PNG's last 12 bytes hold no pixels
            assert!(read_safely(&cut).is_err() || length + 12 >= whole.len(), "{} at {length}", path.display());
        }
    }
}

#[test]
fn flipped_bytes_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = 0x2545_f491_4f6c_dd1du64;
    let mut next = move |n: usize| {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 16) as usize % n
    };
    let mut files = samples(folder.path());
    files.extend(corpus("valid").into_iter().filter(|f| fs::metadata(f).is_ok_and(|m| m.len() < 100_000)));
    for path in files {
        let whole = fs::read(&path).unwrap();
        let bent = folder.path().join(format!("bent.{}", path.extension().unwrap().to_string_lossy()));
        for round in 0..40 {
            let mut bytes = whole.clone();
            // headers decide most: every other round bends only the first 400 bytes
            let reach = if round % 2 == 0 { whole.len() } else { whole.len().min(400) };
            for _ in 0..1 + next(4) {
                bytes[next(reach)] = next(256) as u8;
            }
            fs::write(&bent, &bytes).unwrap();
            let _ = read_safely(&bent);
        }
    }
}

/// Replaces the bytes of a box attribute's value (4 little-endian i32) in an OpenEXR header.
fn set_window(bytes: &mut [u8], name: &str, window: [i32; 4]) {
    let needle: Vec<u8> = [name.as_bytes(), b"\0box2i\0", &16i32.to_le_bytes()].concat();
    let at = bytes.windows(needle.len()).position(|w| w == needle).unwrap() + needle.len();
    for (i, v) in window.into_iter().enumerate() {
        bytes[at + 4 * i..at + 4 * i + 4].copy_from_slice(&v.to_le_bytes());
    }
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_allocated() {
    let folder = tempfile::tempdir().unwrap();
    let files = samples(folder.path());
    let whole = fs::read(&files[0]).unwrap();
    let path = folder.path().join("absurd.exr");
    for window in [
        [0, 0, i32::MAX - 1, i32::MAX - 1],
        [0, 0, 1_000_000_000, 1],
        [0, 0, 1, 1_000_000_000],
        [i32::MIN, i32::MIN, i32::MAX, i32::MAX],
        [0, 0, 60_000, 60_000],
    ] {
        for names in [&["dataWindow"][..], &["displayWindow"][..], &["dataWindow", "displayWindow"][..]] {
            let mut bytes = whole.clone();
            names.iter().for_each(|name| set_window(&mut bytes, name, window));
            fs::write(&path, &bytes).unwrap();
            let error = read_safely(&path).expect_err(&format!("{names:?} {window:?}"));
            println!("{error}");
        }
    }
    let path = folder.path().join("absurd.hdr");
    for size in ["-Y 60000 +X 60000", "-Y 1 +X 4294967295", "-Y 4294967295 +X 4294967295", "-Y 0 +X 7"] {
        fs::write(&path, format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n")).unwrap();
        println!("{}", read_safely(&path).expect_err(size));
    }
}

/// The most memory that this process has held at once, bytes (proc(5)).
#[cfg(target_os = "linux")]
fn peak_bytes() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
}

/// Hundreds of bytes that stand for gigabytes: each is read or refused before memory is taken.
#[cfg(target_os = "linux")]
#[test]
fn small_files_do_not_cost_gigabytes() {
    let Some(folder) = shared("cursed/memory") else { return };
    let before = peak_bytes();
    for name in ["exrdisp.exr", "hdr-abort-under-limit.hdr", "iccp.png", "j16k.jpg", "texture-slow.jpg"] {
        let path = folder.join(name);
        let picture = read(&path).map(|p| (p.width, p.height)).map_err(|e| e.to_string());
        let texture = clerestory::scene::Texture::load(&path).map(|_| ()).map_err(|e| e.to_string());
        println!("{name}: {picture:?}, {texture:?}, peak {} MiB", peak_bytes() >> 20);
        assert!(peak_bytes() < before.max(100 << 20) + (400 << 20), "{name}: {} MiB", peak_bytes() >> 20);
        if ["exrdisp.exr", "hdr-abort-under-limit.hdr", "j16k.jpg"].contains(&name) {
            let refused = picture.unwrap_err();
            assert!(refused.contains(name) && refused.contains("--memory"), "{refused}");
        }
    }
}

/// With a hard limit, too, an error is said and the program ends by itself.
#[cfg(target_os = "linux")]
#[test]
fn under_a_hard_limit_there_is_an_error() {
    // 16384 × 8192: 1.5 GiB, which is allowed; a gigabyte is there
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.hdr");
    fs::write(&path, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n\x02\x02\x40\x00").unwrap();
    fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n").unwrap();
    let site = "[site]\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n[[probe]]\nname = \"p\"\nposition = [1, 1, 1]\n\
                heading = 0\nimage = \"large.hdr\"\n";
    fs::write(folder.path().join("site.toml"), site).unwrap();
    let run = |limit: &str, memory: &str| {
        let script = format!("ulimit -v {limit} && exec \"$0\" --threads 1 {memory} check \"$1\"");
        let mut shell = std::process::Command::new("sh");
        let done = shell.args(["-c", &script]).arg(program().get_program()).arg(folder.path()).output().unwrap();
        (done.status.code(), String::from_utf8(done.stderr).unwrap())
    };
    let (code, said) = run("1000000", "");
    assert!(code == Some(1) && said.contains("large.hdr") && said.contains("ulimit -v"), "{code:?} {said}");
    let (code, said) = run("unlimited", "--memory 512M");
    assert!(code == Some(1) && said.contains("512.0 MiB are allowed"), "{code:?} {said}");
}
