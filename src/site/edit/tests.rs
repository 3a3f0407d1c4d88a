//! Poses that come back, and text that stays.

use super::*;
use crate::site::{Pictures, Site};

const HEAD: &str = "\u{feff}# A site, with odd layout.\r\n[site]\r\nunits = \"cm\"   # measured\r\nup = \"y\"\r\nnorth = 12.5\r\n\r\n[model]\r\npath = \"m.obj\"\r\n\r\n";

const TABLES: &str = r#"[[probe]]                 # by the door
  name = "level"          # no orientation at all
  position = [ 10, 160.0 , -3e2 ]  # tape
  image = "a.exr"

[[probe]]
name = "heading"
heading = 90              # to the altar
position = [1, 2, 3]
image = "b.exr"
gain = 2.0

[[probe]]
name = "quaternion"
position = [1, 2, 3]
rotation = [1.0, 0.0, 0.0, 0.0]   # w first
image = "c.exr"

[[view]]
name = "matrix"
position = [
  1.0,  # right
  2.0,
  3.0,
]
matrix = [[1, 0, 0],   # right
          [0, 1, 0],
          [0, 0, 1]]
fov_y = 50.0
size = [64, 48]

[[view]]
name = "target"
position = [1, 2, 3]
look_at = [4, 2, 3]       # the window
fov_y = 50.0
size = [64, 48]

[plan]
probe_height = 1.5 # last
"#;

fn loaded(text: &str) -> Site {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let file = folder.path().join("site.toml");
    std::fs::write(&file, text).unwrap();
    Site::load_with(&file, Pictures::MayBeMissing).unwrap()
}

fn pose(site: &Site, list: &str, name: &str) -> Pose {
    match list {
        "probe" => site.probes.iter().find(|p| p.name == name).unwrap().pose,
        _ => site.views.iter().find(|v| v.name == name).unwrap().camera.pose,
    }
}

/// The lines that say nothing of a pose.
fn others(text: &str) -> Vec<&str> {
    let about = ["position", "heading", "pitch", "roll", "rotation", "matrix", "look_at"];
    let list = |l: &&str| l.starts_with([' ', ']']) && !l.contains('=');
    let keys = |l: &&str| about.iter().any(|k| l.trim_start().starts_with(k));
    text.split('\n').filter(|l| !keys(l) && !list(l)).collect()
}

#[test]
fn poses_come_back_and_all_else_stays() {
    let names =
        [("probe", "level"), ("probe", "heading"), ("probe", "quaternion"), ("view", "matrix"), ("view", "target")];
    for end in ["\n", "\r\n"] {
        let text = HEAD.to_owned() + &TABLES.replace('\n', end);
        let before = loaded(&text);
        for [heading, pitch, roll] in [[123.45678, -3.21, 1.5], [0.0, 0.0, 0.0], [359.9999, 80.0, -170.0]] {
            let changes: Vec<PoseChange> = (0..)
                .zip(names)
                .map(|(i, (list, name))| PoseChange {
                    list,
                    name: name.to_owned(),
                    pose: Pose {
                        position: DVec3::new(1.234_567 + f64::from(i), -0.000_04, 7.891_01),
                        rotation: before.frame.rotation(heading + 10.0 * f64::from(i), pitch, roll),
                    },
                })
                .collect();
            let Edited { text: edited, left } = with_poses(&text, &before.frame, &changes).unwrap();
            assert!(left.is_empty());
            let after = loaded(&edited);
            for c in &changes {
                let got = pose(&after, c.list, &c.name);
                assert!(got.position.distance(c.pose.position) < 1e-4, "{edited}");
                let turn = DQuat::from_mat3(&(got.rotation.transpose() * c.pose.rotation));
                let degrees = (2.0 * turn.xyz().length().atan2(turn.w.abs())).to_degrees();
                assert!(degrees < 1e-3, "{}: {degrees}\u{b0} off in\n{edited}", c.name);
            }
            assert_eq!(others(&edited), others(&text));
            for comment in ["# tape", "# to the altar", "# w first", "  # right", "],   # right", "# the window"] {
                assert!(edited.contains(comment), "{comment} in\n{edited}");
            }
            assert_eq!(edited.matches('\r').count() == edited.matches('\n').count(), end == "\r\n");
            // once more changes nothing
            assert_eq!(with_poses(&edited, &before.frame, &changes).unwrap().text, edited);
            // two probes alone leave the rest of the file alone
            let one = with_poses(&text, &before.frame, &changes[..1]).unwrap().text;
            let rest = |t: &str| t.split("[[probe]]").skip(2).collect::<String>();
            assert_eq!(rest(&one), rest(&text));
        }
    }
}

#[test]
fn lists_in_braces_are_edited_too() {
    let text = "probe = [{ name = \"a\", position = [1, 2, 3], image = \"a.exr\" }] # all\n[model]\npath = \"m.obj\"\n[site]\nunits = \"m\"\nup = \"z\"\n";
    let frame = loaded(text).frame;
    let pose = Pose { position: DVec3::new(0.5, 2.0, 3.0), rotation: frame.rotation(45.0, 5.0, 0.0) };
    let change = PoseChange { list: "probe", name: "a".to_owned(), pose };
    let edited = with_poses(text, &frame, &[change]).unwrap().text;
    let expected = "{ name = \"a\", position = [0.5, 2.0, 3.0], heading = 45.0, pitch = 5.0, image = \"a.exr\" }";
    assert!(edited.contains(expected), "{edited}");
}

#[test]
fn what_stands_elsewhere_is_told() {
    let text = "[[view]]\nname = \"m\"\nphoto = \"m.jpg\"\nmatch = [{ pixel = [1, 2], point = [3, 4, 5] }]\n";
    let frame = Frame { metres_per_unit: 0.001, up: crate::site::Up::Z, north_deg: 0.0 };
    let pose = Pose { position: DVec3::ONE, rotation: DMat3::IDENTITY };
    let change = |name: &str| PoseChange { list: "view", name: name.to_owned(), pose };
    let edited = with_poses(text, &frame, &[change("m"), change("solved")]).unwrap();
    assert_eq!(edited.left, [(0, NotHere::Matches), (1, NotHere::Cameras)]);
    assert_eq!(edited.text, text);
    assert!(with_poses("[[view", &frame, &[]).is_err());
}

#[test]
fn names_are_quoted_as_toml_reads_them() {
    for name in ["e\u{301}cole", "the \"old\" nave", "C:\\nave", "bell\u{7}", "St Mary's"] {
        let text = format!("name = {}\n", quoted(name));
        let read: toml::Table = toml::from_str(&text).unwrap_or_else(|e| panic!("{text}{e}"));
        assert_eq!(read["name"].as_str(), Some(name), "{text}");
    }
    // an accent of its own is a character as others
    assert_eq!(quoted("e\u{301}cole"), "\"e\u{301}cole\"");
}

#[test]
fn digits_tell_a_tenth_of_a_millimetre() {
    let decimals =
        |metres_per_unit| length_decimals(&Frame { metres_per_unit, up: crate::site::Up::Y, north_deg: 0.0 });
    assert_eq!([1.0, 0.01, 0.001, 0.3048, 1e-6].map(decimals), [4, 2, 1, 4, 0]);
    let shown = [(1.60004, 4), (-0.00004, 4), (1600.0, 0), (90.0, 3), (2.5, 0)].map(|(v, d)| number(v, d));
    assert_eq!(shown, ["1.6", "0.0", "1600.0", "90.0", "2.0"]);
}
