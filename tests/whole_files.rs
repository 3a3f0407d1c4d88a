//! Files appear whole or not at all, even if the program is stopped.

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

use clerestory::atomic_write::{remove_unfinished, write_atomically};

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
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let photo = root.join("sites/chapel/photos/floor.exr");
    let before = fs::read(&photo).unwrap();
    for verb in ["render", "audit", "plan", "study", "report", "register"] {
        for folder in ["sites/chapel/photos", "sites/chapel/model/../probes"] {
            let said = Command::new(env!("CARGO_BIN_EXE_clerestory"))
                .args([verb, "sites/chapel", "--out", folder])
                .current_dir(root)
                .output()
                .unwrap();
            let error = String::from_utf8(said.stderr).unwrap();
            assert_eq!(said.status.code(), Some(1), "{verb} {folder}: {error}");
            assert!(error.contains("the site's own files lie there") && error.contains("--out"), "{error}");
        }
    }
    assert_eq!(fs::read(&photo).unwrap(), before);
}

/// Stops long work at several moments: the exit code is a shell's own, and what lies in the folder is whole.
#[cfg(unix)]
#[test]
fn ctrl_c_leaves_no_rubbish() {
    for wait_ms in [300, 900, 1500] {
        let dir = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_clerestory"))
            .args(["simulate", "sites/chapel", "--size", "32", "--samples", "64", "--out"])
            .arg(dir.path())
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait_ms));
        let told = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let status = child.wait().unwrap();
        assert!(told.success(), "it was still at work");
        assert_eq!(status.code(), Some(130));
        let mut folders = vec![dir.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    clerestory::panorama::read(&path).unwrap();
                }
            }
        }
    }
}
