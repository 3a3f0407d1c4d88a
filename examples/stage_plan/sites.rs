//! Four sites to measure beside the bundled chapel and Šibenik: two models as others made them, the chapel with one
//! probe, and the chapel without its textures.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::Outcome;

/// Writes the sites into a folder, takes their probes with the program, and names what it has made.
pub(crate) fn make(program: &str, folder: &Path) -> Outcome<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let models = root.join("../shared/data/models");
    let chapel = root.join("sites/chapel");
    for (name, text) in [("ctk_church", CTK_CHURCH), ("copyroom", COPYROOM)] {
        let site = folder.join(name);
        copy(&models.join(name), &site.join("model"))?;
        fs::write(site.join("site.toml"), text)?;
    }
    // the panes shine, as nothing else lights a church that is modelled closed
    change(&folder.join("ctk_church/model/CTK_Church.mtl"), |text| {
        text.replace("newmtl Glass", "newmtl Glass\nKe 5 5 5")
    })?;

    for name in ["one-probe", "untextured"] {
        copy(&chapel, &folder.join(name))?;
    }
    change(&folder.join("one-probe/site.toml"), |text| {
        let mut parts = text.split("[[probe]]");
        let (head, first) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        let views = text.find("[[view]]").map_or("", |i| &text[i..]);
        format!("{head}[[probe]]{first}{views}")
    })?;
    let materials = folder.join("untextured/model/chapel.mtl");
    change(&materials, |text| {
        text.lines().filter(|l| !l.trim().starts_with("map_Kd")).map(|l| format!("{l}\n")).collect()
    })?;

    for name in ["ctk_church", "copyroom"] {
        let site = folder.join(name);
        let done = Command::new(program).arg("simulate").arg(&site).args(["--samples", "16", "--probes"]).output()?;
        if !done.status.success() {
            return Err(format!("{}: {}", site.display(), String::from_utf8_lossy(&done.stderr)).into());
        }
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Outcome<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let path = entry?.path();
        let Some(name) = path.file_name() else { continue };
        if path.is_dir() {
            copy(&path, &to.join(name))?;
        } else {
            fs::copy(&path, to.join(name))?;
        }
    }
    Ok(())
}

fn change(file: &Path, by: impl Fn(&str) -> String) -> Outcome<()> {
    let before = fs::read_to_string(file)?;
    let after = by(&before);
    if before == after {
        return Err(format!("{}: there was nothing to change", file.display()).into());
    }
    Ok(fs::write(file, after)?)
}

/// A church as a room of one surface, z up, without pictures; stations where its acoustics were measured.
const CTK_CHURCH: &str = r#"[site]
name = "Christ the King"
units = "m"
up = "z"

[model]
path = "model/CTK_Church.obj"

[[probe]]
name = "nave"
position = [8, 6.65, 1.7]
image = "nave.exr"

[[probe]]
name = "altar"
position = [3.66, 6.65, 1.5]
image = "altar.exr"

[[view]]
name = "nave"
position = [16, 8, 1.6]
look_at = [3, 6, 2]
fov_y = 60
size = [384, 256]
"#;

/// A scanned room with one picture and many holes, through which an even sky lights it. It lies as the scanner held it.
const COPYROOM: &str = r#"[site]
name = "Copy room"
units = "m"
up = "y"

[model]
path = "model/copyroom_c2000_opt.obj"

[environment]
radiance = [1, 1, 1]

[[probe]]
name = "middle"
position = [0.5, 0, 0]
image = "middle.exr"

[[probe]]
name = "end"
position = [0.5, 0.3, 1.2]
image = "end.exr"

[[view]]
name = "room"
position = [0.8, 0.2, -1]
look_at = [0.3, 0, 2]
fov_y = 70
size = [384, 256]
"#;
