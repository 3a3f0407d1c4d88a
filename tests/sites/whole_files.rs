//! Files appear whole or not at all, even if the program is stopped.

use crate::support::program::{Done, clerestory, program};
use crate::support::{chapel, files};
use clerestory::atomic_write::{remove_unfinished, write_atomically};
use std::fs;
use std::io::Write;
use std::process::Stdio;
use std::time::Duration;

#[test]
fn what_is_stopped_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    fs::write(&path, "old").unwrap();
    let stopped = write_atomically(
        &path,
        |e| e,
        |file| {
            file.write_all(b"half")?;
            remove_unfinished();
            Ok(())
        },
    );
    assert!(stopped.is_err(), "the file was taken from under the writer");
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    write_atomically(&path, |e| e, |file| file.write_all(b"new")).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

/// `render`'s picture of the view “floor” is called floor.exr, as the photograph is.
#[test]
fn no_verb_writes_where_the_sites_own_files_lie() {
    let photo = chapel().join("photos/floor.exr");
    let before = fs::read(&photo).unwrap();
    for verb in ["render", "audit", "plan", "study", "report", "register"] {
        for folder in ["sites/chapel/photos", "sites/chapel/model/../probes"] {
            let said = clerestory(&[], &[verb, "sites/chapel", "--out", folder]);
            assert_eq!(said.code, Some(1), "{verb} {folder}: {said:?}");
            assert!(
                said.stderr.contains("the site's own files lie there") && said.stderr.contains("--out"),
                "{said:?}"
            );
        }
    }
    assert_eq!(fs::read(&photo).unwrap(), before);
}

const ROOM: &str = "v 0 0 0\nv 6 0 0\nv 6 5 0\nv 0 5 0\nv 0 0 3\nv 6 0 3\nv 6 5 3\nv 0 5 3\nvt 0 0\nf 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\n\
                    f 3 4 8 7\nf 2 3 7 6\nusemtl a\nf 1/1 4/1 8/1 5/1\n";

/// The site file names the model, which names its materials, which name their pictures.
#[test]
fn no_verb_writes_where_the_models_own_pictures_lie() {
    let site = tempfile::tempdir().unwrap();
    let picture = site.path().join("pictures/plan-ground.png");
    fs::create_dir(site.path().join("pictures")).unwrap();
    image::RgbImage::new(2, 2).save(&picture).unwrap();
    fs::write(site.path().join("m.obj"), format!("mtllib m.mtl\n{ROOM}")).unwrap();
    fs::write(site.path().join("m.mtl"), "newmtl a\nmap_Kd pictures/plan-ground.png\n").unwrap();
    let text = "[site]\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n[[view]]\nname = \"plan-ground\"\n\
                position = [2, 2, 1.6]\nlook_at = [0, 2, 1.6]\nfov_y = 60\nsize = [8, 8]\n";
    fs::write(site.path().join("site.toml"), text).unwrap();
    let before = fs::read(&picture).unwrap();
    for verb in ["plan", "render", "bake", "view", "study", "audit", "register", "report"] {
        let said = Done::of(program().args([verb, ".", "--out", "pictures"]).current_dir(site.path()));
        assert!(said.code == Some(1) && said.stderr.contains("own files lie there"), "{verb}: {said:?}");
    }
    assert_eq!(fs::read(&picture).unwrap(), before);
    assert_eq!(fs::read_dir(picture.parent().unwrap()).unwrap().count(), 1);
}

/// A report's page and manifest name its files, so a name that they could not say is refused before any work.
#[cfg(unix)]
#[test]
fn names_that_are_no_utf_8_are_refused_at_once() {
    use std::os::unix::ffi::OsStrExt;
    let dir = tempfile::tempdir().unwrap();
    let name = dir.path().join(std::ffi::OsStr::from_bytes(b"r\xff"));
    for verb in ["report", "render", "plan"] {
        let start = std::time::Instant::now();
        let said = program().args([verb, "sites/chapel", "--out"]).arg(&name).output().unwrap();
        let error = String::from_utf8_lossy(&said.stderr);
        assert!(said.status.code() == Some(1) && error.contains("no UTF-8"), "{verb}: {error}");
        assert!(!name.exists() && start.elapsed().as_secs() < 5);
    }
}

/// Sites and folders may begin with a dash: with `--` or `=` before them, as everywhere.
#[test]
fn names_that_begin_with_a_dash_are_no_options() {
    let dir = tempfile::tempdir().unwrap();
    let site = dir.path().join("-site");
    fs::create_dir(&site).unwrap();
    fs::write(site.join("m.obj"), ROOM).unwrap();
    fs::write(site.join("site.toml"), "[site]\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n").unwrap();
    let given = ["report", "--quiet", "--without", "render,audit,study", "--out=-r", "--", "-site"];
    Done::of(program().args(given).current_dir(dir.path())).text();
    let manifest: serde_json::Value =
        serde_json::from_slice(&fs::read(dir.path().join("-r/manifest.json")).unwrap()).unwrap();
    for run in manifest["runs"].as_array().unwrap() {
        let note = run["note"].as_str().unwrap();
        assert!(note.is_empty() || note == "not asked for" || note.starts_with("the site has no"), "{run}");
    }
}

/// Stops long work at several moments: the exit code is a shell's own, and what lies in the folder is whole.
#[cfg(unix)]
#[test]
fn ctrl_c_leaves_no_rubbish() {
    for wait_ms in [300, 900, 1500] {
        let dir = tempfile::tempdir().unwrap();
        let mut child = program()
            .args(["simulate", "sites/chapel", "--size", "32", "--samples", "64", "--out"])
            .arg(dir.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait_ms));
        let told = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let status = child.wait().unwrap();
        assert!(told.success(), "it was still at work");
        assert_eq!(status.code(), Some(130));
        for name in files(dir.path()) {
            clerestory::panorama::read(&dir.path().join(name)).unwrap();
        }
    }
}
