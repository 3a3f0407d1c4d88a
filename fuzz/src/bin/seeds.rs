//! Writes small good files of all formats to `seeds/`: what fuzzing begins with. `cargo run --release --bin seeds`, in `fuzz/`.
//!
//! `cargo run --release --bin seeds -- FOLDER…` adds good files of others (of at most 16 KiB) to `corpus/`, which is not kept: every reader
//! that takes a file gets it.

use clerestory_fuzz::{READERS, folder, read};
use e57::{E57Writer, ImageFormat as Kind, PinholeImageProperties, Record, RecordDataType, RecordName, RecordValue};
use exr::prelude::*;
use image::{DynamicImage, ImageFormat};
use std::error::Error;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

type Done<T = ()> = std::result::Result<T, Box<dyn Error>>;

const HOME: &str = env!("CARGO_MANIFEST_DIR");

/// Larger files of others are left out.
const LARGEST: u64 = 16 << 10;

fn main() -> Done {
    let given: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    if !given.is_empty() {
        return collect(given);
    }
    pictures()?;
    scans()?;
    models()?;
    texts()
}

fn put(reader: &str, name: &str, bytes: &[u8]) -> Done {
    let folder = Path::new(HOME).join("seeds").join(reader);
    fs::create_dir_all(&folder)?;
    Ok(fs::write(folder.join(name), bytes)?)
}

fn collect(mut open: Vec<PathBuf>) -> Done {
    clerestory::memory::set_limit(clerestory_fuzz::MEMORY);
    std::panic::set_hook(Box::new(|_| ()));
    let own = folder()?;
    let mut taken = 0;
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(fs::read_dir(&path)?.flatten().map(|e| e.path()));
        } else if path.metadata()?.len() <= LARGEST {
            let bytes = fs::read(&path)?;
            for reader in READERS.iter().filter(|r| is_of(r, &bytes) && read(r, &bytes, own.path()).is_ok()) {
                let folder = Path::new(HOME).join("corpus").join(reader);
                fs::create_dir_all(&folder)?;
                fs::write(folder.join(path.file_name().unwrap_or_default()), &bytes)?;
                taken += 1;
            }
        }
    }
    println!("{taken} inputs");
    Ok(())
}

/// Whether bytes begin as a picture reader's format does: these readers open each other's.
fn is_of(reader: &str, bytes: &[u8]) -> bool {
    let heads: &[&[u8]] = match reader {
        "exr" => &[b"v/1\x01"],
        "hdr" => &[b"#?"],
        "png" => &[b"\x89PNG"],
        "jpeg" => &[b"\xff\xd8"],
        "tiff" => &[b"II*\0", b"MM\0*"],
        _ => return true,
    };
    heads.iter().any(|head| bytes.starts_with(head))
}

fn pictures() -> Done {
    let (width, height) = (7, 5);
    let value = |i: usize| (i * 37 % 50) as f32 / 10.0;
    let own = folder()?;
    let path = own.path().join("a.exr");
    let all = [
        ("plain", Compression::Uncompressed),
        ("rle", Compression::RLE),
        ("zips", Compression::ZIP1),
        ("zip", Compression::ZIP16),
        ("piz", Compression::PIZ),
        ("pxr24", Compression::PXR24),
        ("b44", Compression::B44),
        ("b44a", Compression::B44A),
        ("dwaa", Compression::DWAA(None)),
        ("dwab", Compression::DWAB(None)),
    ];
    let channels = |names: &[&str], half: bool| {
        let channel = |name: &&str| {
            let values = (0..width * height).map(value);
            let samples = if half {
                FlatSamples::F16(values.map(f16::from_f32).collect())
            } else {
                FlatSamples::F32(values.collect())
            };
            AnyChannel::new(*name, samples)
        };
        AnyChannels::sort(names.iter().map(channel).collect())
    };
    let write = |name: &str, names: &[&str], half, compression, blocks, attributes: LayerAttributes, display| -> Done {
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let layer = Layer::new((width, height), attributes, encoding, channels(names, half));
        Image::from_layers(ImageAttributes::new(display), vec![layer]).write().to_file(&path)?;
        put("exr", name, &fs::read(&path)?)
    };
    let display = IntegerBounds::new((0, 0), (width, height));
    for (name, compression) in all {
        let rgb = ["B", "G", "R"];
        write(
            &format!("lines-{name}.exr"),
            &rgb,
            true,
            compression,
            Blocks::ScanLines,
            LayerAttributes::default(),
            display,
        )?;
        let tiles = Blocks::Tiles(Vec2(4, 3));
        write(&format!("tiles-{name}.exr"), &rgb, false, compression, tiles, LayerAttributes::default(), display)?;
    }
    let window = LayerAttributes::named("beauty").with_position(Vec2(-2, 3));
    let named = ["beauty.A", "beauty.B", "beauty.G", "beauty.R", "Z"];
    let outside = IntegerBounds::new((-1, 2), (6, 8));
    write("window.exr", &named, true, Compression::ZIP16, Blocks::ScanLines, window, outside)?;
    let chroma = ["BY", "RY", "Y"];
    write(
        "chroma.exr",
        &chroma,
        true,
        Compression::Uncompressed,
        Blocks::ScanLines,
        LayerAttributes::default(),
        display,
    )?;

    let rgb8 = image::RgbImage::from_fn(9, 6, |x, y| image::Rgb([x as u8 * 28, y as u8 * 40, 77]));
    let colours: [(&str, DynamicImage); 8] = {
        let d = DynamicImage::ImageRgb8(rgb8);
        [
            ("l8", d.to_luma8().into()),
            ("la8", d.to_luma_alpha8().into()),
            ("rgba8", d.to_rgba8().into()),
            ("l16", d.to_luma16().into()),
            ("rgb16", d.to_rgb16().into()),
            ("rgba16", d.to_rgba16().into()),
            ("rgb32f", d.to_rgb32f().into()),
            ("rgb8", d),
        ]
    };
    for (name, picture) in &colours {
        for (reader, format) in [
            ("png", ImageFormat::Png),
            ("tiff", ImageFormat::Tiff),
            ("jpeg", ImageFormat::Jpeg),
            ("hdr", ImageFormat::Hdr),
        ] {
            let mut bytes = Cursor::new(Vec::new());
            // not each format takes each kind of pixel
            if picture.write_to(&mut bytes, format).is_ok() {
                put(reader, &format!("{name}.{reader}"), bytes.get_ref())?;
            }
        }
    }
    let flat = b"#?RADIANCE\nEXPOSURE=2\nCOLORCORR=1 2 0.5\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x20\x81\xff\x01\x00\x8c";
    put("hdr", "flat.hdr", flat)?;
    let old = b"#?RGBE\n\n-Y 2 +X 3\n\x80\x40\x20\x81\x01\x01\x01\x02\x01\x02\x03\x80\x80\x40\x20\x81\x01\x01\x01\x01";
    put("hdr", "old-runs.hdr", old)
}

/// A scan of 3 × 3 points with a picture.
fn scans() -> Done {
    let own = folder()?;
    let path = own.path().join("a.e57");
    let mut file = E57Writer::from_file(&path, "seed")?;
    let record = |name, data_type| Record { name, data_type };
    let single = RecordDataType::Single { min: None, max: None };
    let whole = |max| RecordDataType::Integer { min: 0, max };
    let mut scan = file.add_pointcloud(
        "setup",
        vec![
            record(RecordName::CartesianX, single.clone()),
            record(RecordName::CartesianY, single.clone()),
            record(RecordName::CartesianZ, single),
            record(RecordName::ColorRed, whole(255)),
            record(RecordName::ColorGreen, whole(255)),
            record(RecordName::ColorBlue, whole(255)),
            record(RecordName::RowIndex, whole(2)),
            record(RecordName::ColumnIndex, whole(2)),
        ],
    )?;
    for (row, column) in (0..9).map(|i| (i / 3, i % 3)) {
        let mut point = [2.0, column as f32 * 0.1, row as f32 * -0.1].map(RecordValue::Single).to_vec();
        point.extend([200, 180, 160, row, column].map(RecordValue::Integer));
        scan.add_point(point)?;
    }
    scan.finalize()?;
    let mut picture = file.add_image("picture")?;
    let pixel = 1e-5;
    let (width, height) = (2, 2);
    let (principal_x, principal_y, focal_length) = (1.0, 1.0, 2e-5);
    let lens = PinholeImageProperties {
        width,
        height,
        focal_length,
        pixel_width: pixel,
        pixel_height: pixel,
        principal_x,
        principal_y,
    };
    let mut png = Cursor::new(Vec::new());
    image::RgbImage::new(width, height).write_to(&mut png, ImageFormat::Png)?;
    png.set_position(0);
    picture.add_pinhole(Kind::Png, &mut png, lens, None)?;
    picture.finalize()?;
    file.finalize()?;
    put("e57", "structured.e57", &fs::read(&path)?)
}

fn models() -> Done {
    put("obj", "quad.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")?;
    put(
        "obj",
        "mapped.obj",
        b"mtllib a.mtl\no a\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 1 0\n\
        vt 1 1\nvn 0 0 1\ng b\ns 1\nusemtl red wall\nf 1/1/1 2/2/1 3/3/1\nusemtl c\nf -4//1 -2//1 -1//1\nl 1 2\np 3\n",
    )?;
    put("obj", "odd.obj", b"\xef\xbb\xbf# caf\xe9\r\nv 0 0 \\\r\n 0 2.5\r\nv 1e0 0 0\r\nv 1.5 .5 0\rv 1 1 0\nv 0 1 nan(ind)\nf 1 2 3 4 5\nf 1 2 4\n\
        vp 1 2\ncurv 0 1 1 2\n")?;
    put(
        "mtl",
        "two.mtl",
        b"newmtl a\nKa 0 0 0\nKd 0.5 .4 3e-1\nKe 1 1 1\nillum 2\nmap_Kd -s 1 1 1 -o 0 0 0 in.png\n\
        newmtl b\nKd spectral a.rfl\nTr 0.5\nd 1\nmap_Kd \"no such.png\"\nKd xyz 0.1 0.2 0.3\n",
    )?;
    put("ply", "ascii.ply", b"ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n\
        1 1 0 0 0 255\n0 1 0 9 9 9\n4 0 1 2 3 8 0 0 1 0 1 1 0 1\n")?;
    for (format, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let head = format!(
            "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty short z\n\
            element edge 1\nproperty int vertex1\nelement face 1\nproperty list uchar uint vertex_index\nend_header\n"
        );
        let mut bytes = head.into_bytes();
        let mut add = |little: &[u8]| if big { bytes.extend(little.iter().rev()) } else { bytes.extend(little) };
        for (x, y, z) in [(0f32, 0f64, 0i16), (1.0, 0.0, 0), (0.0, 1.0, 1)] {
            (add(&x.to_le_bytes()), add(&y.to_le_bytes()), add(&z.to_le_bytes()));
        }
        add(&7i32.to_le_bytes());
        add(&[3]);
        (0..3u32).for_each(|i| add(&i.to_le_bytes()));
        put("ply", &format!("{format}.ply"), &bytes)?;
    }
    let mut buffer: Vec<u8> = Vec::new();
    for v in [0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 1.] {
        buffer.extend(v.to_le_bytes());
    }
    [0u16, 1, 2, 0, 2, 3].iter().for_each(|i| buffer.extend(i.to_le_bytes()));
    let mut png = Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(2, 2, image::Rgba([200, 100, 50, 128])).write_to(&mut png, ImageFormat::Png)?;
    let json = |buffer_uri: &str, picture: &str, length: usize, more: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"children":[1],"rotation":[0,0,0,1]}},
{{"mesh":0,"translation":[0,0,2],"scale":[2,1,1]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
"materials":[{{"name":"m","alphaMode":"MASK","alphaCutoff":0.4,"emissiveFactor":[1,0.5,0],"pbrMetallicRoughness":{{"baseColorFactor":[0.9,0.8,0.7,1],
"baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":[0.1,0.2],"rotation":0.3,"scale":[2,2]}}}}}}}}}}],
"extensionsUsed":["KHR_texture_transform"],"textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33071,"wrapT":33648}}],"images":[{{{picture}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},{{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
{{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
{{"buffer":0,"byteOffset":80,"byteLength":12}}{more}],"buffers":[{{"byteLength":{length}{buffer_uri}}}]}}"#
        )
    };
    let uri = format!(r#","uri":"data:application/octet-stream;base64,{}""#, base64(&buffer));
    let picture = format!(r#""uri":"data:image/png;base64,{}""#, base64(png.get_ref()));
    put("gltf", "text.gltf", json(&uri, &picture, buffer.len(), "").as_bytes())?;
    let (from, length) = (buffer.len(), png.get_ref().len());
    let view = format!(r#",{{"buffer":0,"byteOffset":{from},"byteLength":{length}}}"#);
    buffer.extend(png.get_ref());
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut text = json("", r#""bufferView":3,"mimeType":"image/png""#, from + length, &view).into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((12 + 8 + text.len() as u32 + 8 + buffer.len() as u32).to_le_bytes());
    for (kind, part) in [(b"JSON", &text), (b"BIN\0", &buffer)] {
        glb.extend((part.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(part);
    }
    put("gltf", "binary.glb", &glb)
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |three: &[u8]| {
        let bits = (0..3).fold(0u32, |bits, i| bits << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        let letter =
            |i: usize| if i > three.len() { '=' } else { LETTERS[(bits >> (18 - 6 * i)) as usize & 63] as char };
        (0..4).map(letter).collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

fn texts() -> Done {
    put(
        "toml",
        "site.toml",
        include_bytes!("../../../sites/chapel/site.toml").replace(b"model/chapel.obj", b"m.obj").as_slice(),
    )?;
    put("toml", "scan.toml", b"[site]\nunits = \"ft\"\nup = [0, 0.1, 1]\nnorth = 12.5\n[project]\ntitle = \"T\"\ndate = \"2026-01-02\"\n\
        [model]\npath = \"m.obj\"\nvertex_colours = \"srgb\"\n[plan]\nprobe_height = 5\n[[probe]]\nname = \"a\"\nimage = \"a.exr\"\n\
        position = [0, 0, 5]\nheading = 90\npitch = -3\ngain = [1, 1.1, 0.9]\n[[view]]\nname = \"v\"\nposition = [0, 1, 5]\n\
        rotation = [1, 0, 0, 0]\nfx = 500\ncx = 255.5\nk1 = -0.1\nsize = [512, 512]\n[[view]]\nname = \"w\"\nposition = [1, 1, 5]\n\
        matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nfov_y = 50\nsize = [64, 48]\n[environment]\nradiance = [1, 1, 1]\n\
        [sun]\ndirection = [0.3, 0.2, 0.9]\nirradiance = [3, 3, 2]\n")?;
    put("walk", "walk.toml", b"[path]\nframes = 10\nsize = [64, 48]\nfov_y = 55.0\nease = true\n[[key]]\nposition = [0, 0, 1]\n\
        look_at = [1, 1, 1]\n[[key]]\nposition = [1, 0, 1]\nheading = 90\npitch = 5\n[[key]]\nposition = [1, 1, 1]\nrotation = [1, 0, 0, 0]\n")?;
    put("json", "outside.json", br#"{"rows":[{"camera":"apse","spp":16,"wall_s":1.5,"cpu_s":3,"rmse":0.1,"relmse_trim":0.02,"flip":0.1,"oidn_s":0.5,"oidn":{"rmse":0.05,"relmse_trim":0.01,"flip":0.05}},{"camera":"apse","spp":64,"wall_s":6,"cpu_s":12,"rmse":0.05,"relmse_trim":0.01,"flip":0.05,"oidn_s":null,"oidn":null}]}"#)?;
    put("json", "manifest.json", br#"{"software":"clerestory","site":"Chapel","made":"2026-01-01T00:00:00Z","runs":[{"verb":"check","seconds":1.25,"note":""},{"verb":"plan","seconds":null,"note":"left out"}]}"#)?;
    let line = "0.5 0.5 -0.5 0.5 2 3 -1 3";
    let models = [
        ("pinhole", "PINHOLE 640 480 400 410 320 240"),
        ("opencv", "OPENCV 640 480 400 410 320 240 0.1 -0.2 0.01 0.02"),
        ("fisheye", "OPENCV_FISHEYE 640 480 400 400 320 240 0.1 0.02 -0.03 0.004"),
        ("full", "FULL_OPENCV 640 480 400 410 320 240 0.1 -0.2 0.01 0.02 0.3 0.05 0.06 0.07"),
    ];
    for (name, camera) in models {
        let text =
            format!("# list\n7 {line} a b.jpg\n\n8 {line} in/c.jpg\n1 2 -1 3 4 5\n\n=====\n# list\n3 {camera}\n");
        put("colmap", &format!("{name}.txt"), text.as_bytes())?;
    }
    let (mut cameras, mut images) = (1u64.to_le_bytes().to_vec(), 1u64.to_le_bytes().to_vec());
    [3u32, 1].iter().for_each(|v| cameras.extend(v.to_le_bytes()));
    [640u64, 480].iter().for_each(|v| cameras.extend(v.to_le_bytes()));
    [400f64, 410., 320., 240.].iter().for_each(|v| cameras.extend(v.to_le_bytes()));
    images.extend(7u32.to_le_bytes());
    [0.5f64, 0.5, -0.5, 0.5, 2., 3., -1.].iter().for_each(|v| images.extend(v.to_le_bytes()));
    images.extend(3u32.to_le_bytes());
    images.extend(b"a.jpg\0");
    images.extend(1u64.to_le_bytes());
    images.extend([1; 24]);
    images.extend(b"\n=====\n");
    images.extend(cameras);
    put("colmap", "binary.bin", &images)?;
    put("xml", "realitycapture.xmp", br#"<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:Version="3" xcr:FocalLength35mm="22.5" xcr:Skew="0" xcr:AspectRatio="1" xcr:PrincipalPointU="0.01" xcr:PrincipalPointV="0.005" xcr:DistortionModel="brown3t2">
<xcr:Rotation>0 -1 0 0 0 -1 1 0 0</xcr:Rotation><xcr:Position>1 2 3</xcr:Position><xcr:DistortionCoeficients>0.1 -0.2 0.3 0 0.02 0.01</xcr:DistortionCoeficients>
</rdf:Description></rdf:RDF></x:xmpmeta>"#)?;
    put("xml", "metashape.xml", br#"<?xml version="1.0"?><document version="1.5.0"><chunk><sensors><sensor id="0" type="frame"><resolution width="640" height="480"/>
<calibration type="frame" class="adjusted"><resolution width="640" height="480"/><f>400</f><cx>1</cx><cy>-2</cy><k1>0.1</k1><k2>-0.2</k2><p1>0.01</p1><b1>3</b1></calibration></sensor></sensors>
<components><component id="0"><transform><rotation>1 0 0 0 1 0 0 0 1</rotation><translation>1 2 3</translation><scale>2</scale></transform></component></components>
<cameras><camera id="0" sensor_id="0" component_id="0" label="a.jpg"><transform>0 0 1 1 -1 0 0 2 0 -1 0 3 0 0 0 1</transform></camera></cameras></chunk></document>"#)
}

/// Bytes with each `old` made `new`.
trait Replace {
    fn replace(&self, old: &[u8], new: &[u8]) -> Vec<u8>;
}

impl Replace for [u8] {
    fn replace(&self, old: &[u8], new: &[u8]) -> Vec<u8> {
        let mut all = Vec::new();
        let mut rest = self;
        while let Some(at) = rest.windows(old.len()).position(|part| part == old) {
            all.extend([&rest[..at], new].concat());
            rest = &rest[at + old.len()..];
        }
        [&all, rest].concat()
    }
}
