//! One camera, in each program's words: at (1, 2, 3), looking along +x with +z up. A point at (5, 1, 4) lies 4 m ahead,
//! 1 m to the right (−y) and 1 m up: at ideal (0.25, −0.25) with y down.

use super::solved::SolvedCamera;
use super::*;
use glam::{DMat3, DVec2, DVec3};
use std::fs;
use tempfile::TempDir;

/// World to camera: rows are the camera's right, down and forward.
const ROWS: &str = "0 -1 0 0 0 -1 1 0 0";
/// The same as a quaternion w, x, y, z, and −R·position.
const WXYZ: [f64; 4] = [0.5, 0.5, -0.5, 0.5];
const T: [f64; 3] = [2.0, 3.0, -1.0];

/// The camera as the program uses it, in a z-up model of metres.
fn pixel(c: &SolvedCamera, size: [u32; 2], point: DVec3) -> DVec2 {
    let DMat3 { x_axis: right, y_axis: down, z_axis: forward } = c.rotation;
    let pose = crate::site::Pose { position: c.position, rotation: DMat3::from_cols(right, forward, -down) };
    crate::site::Camera::new(pose, &c.intrinsics.model(size)).project(point).unwrap()
}

const POINT: DVec3 = DVec3::new(5.0, 1.0, 4.0);

/// The point's r².
const R2: f64 = 0.125;

/// Where Brown's terms move the point: radial ones to so many times its distance, tangential ones that go with x and with y.
fn brown(radial: f64, with_x: f64, with_y: f64) -> DVec2 {
    let (x, y) = (0.25, -0.25);
    let dx = x * radial + with_x * (R2 + 2.0 * x * x) + 2.0 * with_y * x * y;
    let dy = y * radial + with_y * (R2 + 2.0 * y * y) + 2.0 * with_x * x * y;
    DVec2::new(dx, dy)
}

#[track_caller]
fn near(found: DVec2, expected: [f64; 2]) {
    assert!(found.distance(DVec2::from_array(expected)) < 1e-9, "{found}, not {expected:?}");
}

fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn colmap_text(camera: &str) -> TempDir {
    let [w, x, y, z] = WXYZ;
    let [a, b, c] = T;
    let images = format!(
        "# a comment\n\n7 {w} {x} {y} {z} {a} {b} {c} 3 a b.jpg\n\n8 {w} {x} {y} {z} {a} {b} {c} 3 in/c.jpg\n1 2 -1 3 4 5\n"
    );
    folder(&[("cameras.txt", format!("# list\n3 {camera}\n").as_bytes()), ("images.txt", images.as_bytes())])
}

fn colmap_binary(model: u32, parameters: &[f64]) -> (Vec<u8>, Vec<u8>) {
    let mut cameras = 1u64.to_le_bytes().to_vec();
    cameras.extend(3u32.to_le_bytes());
    cameras.extend(model.to_le_bytes());
    cameras.extend(640u64.to_le_bytes());
    cameras.extend(480u64.to_le_bytes());
    parameters.iter().for_each(|p| cameras.extend(p.to_le_bytes()));
    let mut images = 2u64.to_le_bytes().to_vec();
    for (id, name, points) in [(7u32, "a b.jpg\0", 0u64), (8, "in/c.jpg\0", 2)] {
        images.extend(id.to_le_bytes());
        WXYZ.iter().chain(&T).for_each(|v| images.extend(v.to_le_bytes()));
        images.extend(3u32.to_le_bytes());
        images.extend(name.as_bytes());
        images.extend(points.to_le_bytes());
        images.extend(vec![1; 24 * points as usize]);
    }
    (cameras, images)
}

#[test]
fn colmaps_models_and_axes() {
    // distorted by hand
    let r2 = R2;
    let theta = r2.sqrt().atan();
    let fish = |k: [f64; 4]| {
        let t2 = theta * theta;
        theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))) / r2.sqrt() * 0.25
    };
    let opencv = |radial: f64, p1: f64, p2: f64| {
        let d = brown(radial, p2, p1);
        [320.0 + 400.0 * d.x, 240.0 + 410.0 * d.y]
    };
    let one = |d: f64| [320.0 + 400.0 * d, 240.0 - 400.0 * d];
    let cases: Vec<(u32, &str, Vec<f64>, [f64; 2])> = vec![
        (0, "SIMPLE_PINHOLE", vec![400.0, 320.0, 240.0], one(0.25)),
        (1, "PINHOLE", vec![400.0, 410.0, 320.0, 240.0], opencv(1.0, 0.0, 0.0)),
        (2, "SIMPLE_RADIAL", vec![400.0, 320.0, 240.0, 0.1], one(0.25 * (1.0 + 0.1 * r2))),
        (3, "RADIAL", vec![400.0, 320.0, 240.0, 0.1, -0.2], one(0.25 * (1.0 + 0.1 * r2 - 0.2 * r2 * r2))),
        (
            4,
            "OPENCV",
            vec![400.0, 410.0, 320.0, 240.0, 0.1, -0.2, 0.01, 0.02],
            opencv(1.0 + 0.1 * r2 - 0.2 * r2 * r2, 0.01, 0.02),
        ),
        (
            5,
            "OPENCV_FISHEYE",
            vec![400.0, 400.0, 320.0, 240.0, 0.1, 0.02, -0.03, 0.004],
            one(fish([0.1, 0.02, -0.03, 0.004])),
        ),
        (
            6,
            "FULL_OPENCV",
            vec![400.0, 410.0, 320.0, 240.0, 0.1, -0.2, 0.01, 0.02, 0.3, 0.05, 0.06, 0.07],
            opencv(
                (1.0 + 0.1 * r2 - 0.2 * r2.powi(2) + 0.3 * r2.powi(3))
                    / (1.0 + 0.05 * r2 + 0.06 * r2.powi(2) + 0.07 * r2.powi(3)),
                0.01,
                0.02,
            ),
        ),
        (8, "SIMPLE_RADIAL_FISHEYE", vec![400.0, 320.0, 240.0, 0.1], one(fish([0.1, 0.0, 0.0, 0.0]))),
        (9, "RADIAL_FISHEYE", vec![400.0, 320.0, 240.0, 0.1, 0.05], one(fish([0.1, 0.05, 0.0, 0.0]))),
    ];
    for (number, name, parameters, expected) in cases {
        let words = parameters.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let text = colmap_text(&format!("{name} 640 480 {words}"));
        let (cameras, images) = colmap_binary(number, &parameters);
        let binary = folder(&[("cameras.bin", &cameras), ("images.bin", &images)]);
        for folder in [text, binary] {
            let found = read(folder.path()).unwrap().cameras;
            let names: Vec<&str> = found.iter().map(|c| c.photo.as_str()).collect();
            assert_eq!(names, ["a b.jpg", "in/c.jpg"]);
            assert!(found[1].position.distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12);
            near(pixel(&found[1], [640, 480], POINT), expected);
        }
    }
}

#[test]
fn damaged_colmap_files_are_errors_with_their_place() {
    let (cameras, images) = colmap_binary(0, &[400.0, 320.0, 240.0]);
    for cut in 0..images.len() {
        let folder = folder(&[("cameras.bin", &cameras), ("images.bin", &images[..cut])]);
        let error = read(folder.path()).unwrap_err().to_string();
        assert!(error.contains("images.bin: byte ") && error.contains("cut short"), "{cut}: {error}");
    }
    for cut in 0..cameras.len() {
        let folder = folder(&[("cameras.bin", &cameras[..cut]), ("images.bin", &images)]);
        assert!(read(folder.path()).unwrap_err().to_string().contains("cameras.bin: byte "));
    }
    // counts that no file could hold
    let mut huge = images.clone();
    huge[..8].fill(0xff);
    let end = huge.len();
    huge[end - 56..end - 48].fill(0xff);
    let damaged = folder(&[("cameras.bin", &cameras), ("images.bin", &huge)]);
    assert!(read(damaged.path()).is_err());
    let mut strange = cameras.clone();
    strange[12] = 99;
    let damaged = folder(&[("cameras.bin", &strange), ("images.bin", &images)]);
    assert!(read(damaged.path()).unwrap_err().to_string().contains("model 99 is not known"));

    let pinhole = "PINHOLE 640 480 400 400 320 240";
    for (camera, expected) in [
        ("PINHOLE 640 480 400 400 320", "cameras.txt: line 2: expected 4 parameters of PINHOLE, found 3"),
        ("PINHOLE 640 x 400 400 320 240", "line 2: expected a whole number, found “x”"),
        ("PINHOLE 640 480 400 400 320 nan", "line 2: expected a number, found “nan”"),
        ("PINHOLE 640 480 0 400 320 240", "a focal length above zero"),
        ("THIN_PRISM_FISHEYE 640 480 1 1 1 1 0 0 0 0 0 0 0 0", "image_undistorter"),
        ("LENS 640 480 1", "LENS is not known"),
    ] {
        let error = read(colmap_text(camera).path()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    for (images, expected) in [
        ("1 0.5 0.5 -0.5 0.5 2 3 -1 4 a.jpg\n\n", "camera 4, which the cameras' file does not hold"),
        ("1 0.5 0.5 -0.5 0.9 2 3 -1 3 a.jpg\n\n", "line 1: expected a unit quaternion"),
        (
            "1 0.5 0.5 -0.5 0.5 2 3 -1 3 a.jpg\n2 0.5 0.5 -0.5 0.5 2 3 -1 3 b.jpg\n",
            "line 2: expected the image's line of points",
        ),
        ("1 0.5 0.5\n", "line 1: expected IMAGE_ID"),
    ] {
        let folder = colmap_text(pinhole);
        fs::write(folder.path().join("images.txt"), images).unwrap();
        let error = read(folder.path()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

fn xmp(rest: &str) -> String {
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n\
         <rdf:Description xmlns:xcr=\"http://www.capturingreality.com/ns/xcr/1.1#\" xcr:Version=\"3\" {rest}\n\
         </rdf:Description></rdf:RDF></x:xmpmeta>"
    )
}

#[test]
fn realitycaptures_units_axes_and_order_of_terms() {
    // 22.5 mm of 36 mm film, 640 pixels wide: 400 pixels; the centre 6.4 to the right, 3.2 down
    let lens = "xcr:FocalLength35mm=\"22.5\" xcr:Skew=\"0\" xcr:AspectRatio=\"1\" xcr:PrincipalPointU=\"0.01\" \
                xcr:PrincipalPointV=\"0.005\"";
    let pose = format!("<xcr:Rotation>{ROWS}</xcr:Rotation><xcr:Position>1 2 3</xcr:Position>");
    let coefficients = "<xcr:DistortionCoeficients>0.1 -0.2 0.3 0 0.02 0.01</xcr:DistortionCoeficients>";
    let distorted = xmp(&format!("{lens} xcr:DistortionModel=\"brown3t2\">{pose}{coefficients}"));
    let plain =
        xmp(&format!("xcr:Rotation=\"{ROWS}\" xcr:Position=\"1 2 3\" {lens} xcr:DistortionModel=\"perspective\">"));
    let folder = folder(&[
        ("a.xmp", distorted.as_bytes()),
        ("b.XMP", plain.as_bytes()),
        ("c.xmp", xmp("xcr:FocalLength35mm=\"20\">").as_bytes()),
    ]);
    let found = read(folder.path()).unwrap();
    assert_eq!(found.cameras.len(), 2);
    assert!(found.warnings[0].contains("1 hold no pose") && found.warnings[0].contains("c.xmp"));
    near(pixel(&found.cameras[1], [640, 480], POINT), [326.4 + 100.0, 243.2 - 100.0]);
    // in portrait the longer side is the height
    near(pixel(&found.cameras[1], [480, 640], POINT), [246.4 + 100.0, 323.2 - 100.0]);
    // t1 goes with x, as Metashape's p1
    let d = brown(1.0 + 0.1 * R2 - 0.2 * R2.powi(2) + 0.3 * R2.powi(3), 0.02, 0.01);
    near(pixel(&found.cameras[0], [640, 480], POINT), [326.4 + 400.0 * d.x, 243.2 + 400.0 * d.y]);
}

#[test]
fn byte_order_marks_and_folders_called_like_files_do_no_harm() {
    let colmap = colmap_text("PINHOLE 640 480 400 400 320 240");
    for name in ["cameras.txt", "images.txt"] {
        let path = colmap.path().join(name);
        fs::write(&path, format!("\u{feff}{}", fs::read_to_string(&path).unwrap())).unwrap();
    }
    assert_eq!(read(colmap.path()).unwrap().cameras.len(), 2);
    let pose = format!("xcr:Rotation=\"{ROWS}\" xcr:Position=\"1 2 3\" xcr:FocalLength35mm=\"22.5\">");
    let solved = folder(&[("a.xmp", xmp(&pose).as_bytes())]);
    fs::create_dir(solved.path().join("b.xmp")).unwrap();
    assert_eq!(read(solved.path()).unwrap().cameras.len(), 1);
}

fn metashape(chunk_transform: &str, reference: &str) -> String {
    // the camera's own transform takes its axes to the chunk's: columns right, down, forward, position
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\">\n<chunk label=\"Chunk 1\" enabled=\"true\">\n\
         <sensors next_id=\"2\">\n<sensor id=\"0\" label=\"x\" type=\"frame\"><resolution width=\"640\" height=\"480\"/>\n\
         <calibration type=\"frame\" class=\"initial\"><resolution width=\"640\" height=\"480\"/><f>500</f></calibration>\n\
         <calibration type=\"frame\" class=\"adjusted\"><resolution width=\"640\" height=\"480\"/><f>400</f><cx>6.4</cx>\
         <cy>-3.2</cy><b1>8</b1><b2>2</b2><k1>0.1</k1><k2>-0.2</k2><k3>0.3</k3><p1>0.02</p1><p2>0.01</p2></calibration>\n\
         </sensor>\n<sensor id=\"1\" type=\"equidistant_fisheye\"><resolution width=\"640\" height=\"480\"/>\n\
         <calibration type=\"equidistant_fisheye\" class=\"adjusted\"><f>300</f></calibration></sensor></sensors>\n\
         <cameras next_id=\"3\">\n<camera id=\"0\" sensor_id=\"0\" label=\"IMG_1\" enabled=\"1\">\
         <transform>0 0 1 0.5  -1 0 0 1  0 -1 0 1.5  0 0 0 1</transform><orientation>1</orientation></camera>\n\
         <group id=\"0\"><camera id=\"1\" sensor_id=\"1\" label=\"IMG_2\"><transform>0 0 1 0.5 -1 0 0 1 0 -1 0 1.5 0 0 0 1\
         </transform></camera></group>\n<camera id=\"2\" sensor_id=\"0\" label=\"IMG_3\"/>\n</cameras>\n\
         <reference>{reference}</reference>\n{chunk_transform}</chunk>\n</document>"
    )
}

const SIMILARITY: &str = "<transform><rotation locked=\"0\">0 -1 0 1 0 0 0 0 1</rotation><translation>10 20 30</translation>\
                          <scale>2</scale></transform>";

#[test]
fn metashapes_axes_offsets_and_order_of_terms() {
    let folder = folder(&[
        ("plain.xml", metashape("", "LOCAL_CS[\"Local\"]").as_bytes()),
        ("moved.xml", metashape(SIMILARITY, "").as_bytes()),
        ("globe.xml", metashape(SIMILARITY, "GEOGCS[\"WGS 84\"]").as_bytes()),
    ]);
    let at = |name: &str| read(&folder.path().join(name)).unwrap();
    let plain = at("plain.xml");
    assert!(!plain.geocentric && at("globe.xml").geocentric);
    assert!(plain.warnings[0].contains("1 cameras") && plain.warnings[0].contains("IMG_3"), "{:?}", plain.warnings);
    // half of (1, 2, 3): the point is halved too
    assert!(plain.cameras[0].position.distance(DVec3::new(0.5, 1.0, 1.5)) < 1e-12);
    let d = brown(1.0 + 0.1 * R2 - 0.2 * R2.powi(2) + 0.3 * R2.powi(3), 0.02, 0.01);
    let expected = [320.0 + 6.4 + d.x * (400.0 + 8.0) + d.y * 2.0, 240.0 - 3.2 + d.y * 400.0];
    near(pixel(&plain.cameras[0], [640, 480], POINT * 0.5), expected);
    // the chunk's transform turns by 90° about z, doubles and shifts: the picture stays
    let moved = at("moved.xml");
    let there = |p: DVec3| DVec3::new(-p.y, p.x, p.z) * 2.0 + DVec3::new(10.0, 20.0, 30.0);
    assert!(moved.cameras[0].position.distance(there(DVec3::new(0.5, 1.0, 1.5))) < 1e-12);
    near(pixel(&moved.cameras[0], [640, 480], there(POINT * 0.5)), expected);
    // equidistant: 300 pixels a radian
    let theta = 0.125f64.sqrt().atan();
    let along = 300.0 * theta / 2f64.sqrt();
    near(pixel(&plain.cameras[1], [640, 480], POINT * 0.5), [320.0 + along, 240.0 - along]);
}

#[test]
fn broken_xml_is_an_error_with_its_line() {
    let good = metashape(SIMILARITY, "");
    let pose = format!("<xcr:Rotation>{ROWS}</xcr:Rotation><xcr:Position>1 2 3</xcr:Position>");
    let lens = "xcr:FocalLength35mm=\"22.5\"";
    let cases = [
        ("a.xml", good[..good.len() - 30].to_owned(), vec!["line ", "cannot be read"]),
        ("b.xml", "<document/>".to_owned(), vec!["line 1, <document>", "expected a <chunk>"]),
        ("c.xml", good.replace("0 0 1 0.5  -1", "0 0 1 0.5"), vec!["<camera>", "expected 16 numbers"]),
        ("d.xml", good.replace("0 0 1 0.5  -1", "0 0 2 0.5  -1"), vec!["<camera>", "expected a rotation"]),
        ("e.xml", good.replace("<scale>2", "<scale>-2"), vec!["<transform>", "a scale above zero"]),
        ("f.xml", good.replace("width=\"640\"", "width=\"wide\""), vec!["width in pixels, found “wide”"]),
        ("g.xml", good.replace("<p2>", "<p3>1</p3><p2>"), vec!["p3 and p4"]),
        ("h.xml", good.replace("\"frame\"><res", "\"rpc\"><res"), vec!["“rpc” of IMG_1"]),
        ("i.xml", "<!DOCTYPE x [<!ENTITY a \"b\">]><document>&a;</document>".to_owned(), vec!["line 1"]),
        ("a.xmp", xmp(&format!("{lens}>{pose}"))[..300].to_owned(), vec!["cannot be read"]),
        ("b.xmp", xmp(&format!("{lens}>{}", pose.replace("1 2 3", "1 2"))), vec!["expected 3 numbers, found “1 2”"]),
        ("c.xmp", xmp(&format!("{lens}>{}", pose.replace("0 -1 0 0", "0 1 0 0"))), vec!["rotation matrix"]),
        ("d.xmp", xmp(&format!(">{pose}")), vec!["FocalLength35mm above zero"]),
        ("e.xmp", xmp(&format!("{lens} xcr:DistortionModel=\"division\">{pose}")), vec!["division", "Brown3"]),
        ("x.json", "{}".to_owned(), vec!["not a pose file known here"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (name, text, parts) in cases {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains(name) && parts.iter().all(|p| error.contains(p)), "{parts:?} expected in: {error}");
    }
    fs::write(folder.path().join("latin1.xml"), b"<document>\xe9</document>").unwrap();
    assert!(read(&folder.path().join("latin1.xml")).is_err());
}
