//! A draft in the words of a site file.

use std::path::{Component, Path, PathBuf};

use super::found::{Found, Shape, by_lighting};
use super::guess::Guessed;
use super::names::unique;
use super::scans::ScanLens;
use super::{Findings, Gathered};
use crate::site::edit::{number, quoted, wxyz};

/// So many photographs without a place are written out; the others are counted.
const WRITTEN_OUT: usize = 12;

/// The site file's text.
pub(super) fn site_file(f: &Findings) -> String {
    let units = remark(&f.guess.unit, |unit| unit.name.to_owned());
    let up = remark(&f.guess.up, |up| format!("{} up", up.name()));
    let direction = f.guess.up.value.direction();
    let up_key = match f.guess.up.value.name() {
        name if name.starts_with('[') => format!("[{:.5}, {:.5}, {:.5}]", direction.x, direction.y, direction.z),
        name => quoted(&name),
    };
    let colours = if f.coloured {
        "vertex_colours = \"srgb\"        # guessed: programs that colour scans mostly write sRGB; else \"linear\"\n"
    } else {
        ""
    };
    let head = format!(
        "# Written by `clerestory init`: what was guessed says so. docs/site-file.md has every key.\n\
         # Paths are relative to this file; positions are in the model's own axes and units.\n\n\
         [site]\nname = {}\nunits = {}        # {units}\nup = {up_key}        # {up}\n\
         north = 0.0        # degrees clockwise, seen from above, from the model's own north to true north\n\n\
         [model]\npath = {}\n{colours}",
        quoted(&f.name),
        quoted(f.guess.unit.value.key),
        path(f.folder, f.model)
    );
    let parts = [
        head,
        cameras(f.folder, f.pictures),
        scanned(f.folder, f.pictures),
        probes(f.folder, f.pictures),
        photographs(f.folder, f.pictures),
    ];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("\n")
}

/// How a value was come by.
fn remark<T>(guessed: &Guessed<T>, name: impl Fn(&T) -> String) -> String {
    match &guessed.rival {
        None => format!("guessed: {}", guessed.why),
        Some(rival) => format!("NOT SURE, look at it: {}; {} would do as well", guessed.why, name(rival)),
    }
}

fn cameras(folder: &Path, pictures: &Gathered) -> String {
    let Some(file) = &pictures.pose_file else { return String::new() };
    let mut out = String::new();
    let mut line = |text: &str| {
        // what cannot be used stands there to be mended
        out += if pictures.left_out.is_some() { "# " } else { "" };
        out += text;
        out.push('\n');
    };
    if let Some(why) = &pictures.left_out {
        line(&format!("Left out: {}", why.replace(['\n', '\r'], " ")));
    }
    line("[cameras]        # solved by another program; scale, matrix and translation bring them to the model's axes");
    line(&format!("path = {}", path(folder, &file.path)));
    line(&format!("photos = {}", path(folder, &pictures.solved_folder)));
    if !pictures.solved_probes.is_empty() {
        let names: Vec<String> = pictures.solved_probes.iter().map(|name| quoted(name)).collect();
        line(&format!("probes = [{}]        # they light the place; the others are views", names.join(", ")));
    }
    out
}

/// Pictures that a scan file holds with their poses.
fn scanned(folder: &Path, pictures: &Gathered) -> String {
    let list = |numbers: &[f64], decimals: usize| {
        let numbers: Vec<String> = numbers.iter().map(|v| number(*v, decimals)).collect();
        format!("[{}]", numbers.join(", "))
    };
    let mut out = String::new();
    for picture in &pictures.scanned {
        if out.is_empty() {
            out += "# Pictures of the scan, with the poses that it has for them.\n";
        }
        let (table, key) = if picture.is_probe { ("probe", "image") } else { ("view", "photo") };
        out += &format!(
            "\n[[{table}]]\nname = {}\nposition = {}\nrotation = {}\n{key} = {}\n",
            quoted(&picture.name),
            list(&picture.position.to_array(), 4),
            list(&wxyz(picture.rotation), 8),
            path(folder, &picture.path)
        );
        if let Some(ScanLens { focal, centre, distortion }) = picture.lens {
            let kind = if picture.is_probe { "projection = \"perspective\"\n" } else { "" };
            let [fx, fy, cx, cy] = [focal.x, focal.y, centre.x, centre.y].map(|v| number(v, 3));
            out += &format!("{kind}fx = {fx}\nfy = {fy}\ncx = {cx}\ncy = {cy}\n");
            for (key, value) in ["k1", "k2", "k3", "p1", "p2"].iter().zip(distortion).filter(|(_, v)| *v != 0.0) {
                out += &format!("{key} = {}\n", number(value, 9));
            }
        }
        if let (Some(mask), false) = (&picture.mask, picture.is_probe) {
            out += &format!("mask = {}\n", path(folder, mask));
        }
    }
    out
}

fn probes(folder: &Path, pictures: &Gathered) -> String {
    let mut out = String::new();
    let mut names: Vec<String> = pictures.scanned.iter().filter(|p| p.is_probe).map(|p| p.name.clone()).collect();
    for (base, all) in by_lighting(&pictures.panoramas) {
        let Some((_, first)) = all.first() else { continue };
        let name = unique(&base, &mut names);
        let image = match &all[..] {
            [(lighting, one)] if lighting.is_empty() => path(folder, &one.path),
            several => {
                let one =
                    |(lighting, p): &(String, &Found)| format!("{} = {}", quoted(lighting), path(folder, &p.path));
                let all = several.iter().map(one).collect::<Vec<_>>().join(", ");
                format!("{{ {all} }}        # guessed: times at the end of names")
            }
        };
        if out.is_empty() {
            out += "# Probes. Add `position = [x, y, z]` and `heading` where you know them; `register` finds the others.\n";
        }
        out += &format!("\n[[probe]]\nname = {}\nimage = {image}\n{}", quoted(&name), projection(first));
    }
    out
}

/// What a probe's pixels show, as far as its shape tells.
fn projection(picture: &Found) -> String {
    match picture.shape {
        Shape::Panorama => String::new(),
        Shape::Square => {
            "projection = \"angular\"        # guessed: square pictures may also be \"mirror-ball\" or \"fisheye\"\n"
                .to_owned()
        }
        Shape::Cross => "projection = \"cube-cross\"        # guessed from its shape\n".to_owned(),
        Shape::Photograph => format!("projection = \"perspective\"\n{}", field_of_view(picture)),
    }
}

fn field_of_view(picture: &Found) -> String {
    match picture.fov_y {
        Some(fov) => format!("fov_y = {fov:.2}        # degrees, by EXIF: right to some 5 %\n"),
        None => "fov_y = 60.0        # NOT KNOWN: EXIF tells no focal length; degrees from the bottom to the top\n"
            .to_owned(),
    }
}

/// Photographs without a place, as comments: a view needs one.
fn photographs(folder: &Path, pictures: &Gathered) -> String {
    if pictures.unposed.is_empty() {
        return String::new();
    }
    let mut out = "# Photographs that no camera file knows. To use one, take the # away and give where it was taken: position\n\
                   # with look_at or heading, or four pairs or more of a pixel and the point of the model that it shows.\n"
        .to_owned();
    let mut names: Vec<String> = pictures.scanned.iter().filter(|p| !p.is_probe).map(|p| p.name.clone()).collect();
    for picture in pictures.unposed.iter().take(WRITTEN_OUT) {
        let block = format!(
            "[[view]]\nname = {}\nphoto = {}\n{}match = [{{ pixel = [0, 0], point = [0.0, 0.0, 0.0] }}]\n",
            quoted(&unique(&picture.stem(), &mut names)),
            path(folder, &picture.path),
            field_of_view(picture)
        );
        out += "#\n";
        block.lines().for_each(|line| out += &format!("# {line}\n"));
    }
    if let Some(more) = pictures.unposed.len().checked_sub(WRITTEN_OUT).filter(|n| *n > 0) {
        out += &format!("#\n# and {more} photographs more.\n");
    }
    out
}

/// A path in quotes, relative to a folder where the two have a way between them.
fn path(folder: &Path, file: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or(path.to_owned());
    let (from, to) = (whole(folder), whole(file));
    let mut same = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if same == 0 {
        return quoted(&to.to_string_lossy());
    }
    // two places that have only the root in common: the whole path says more
    if same == 1 && from.components().count() > 2 {
        same = 0;
    }
    let up = if same == 0 { 0 } else { from.components().count() - same };
    let steps = std::iter::repeat_n(Component::ParentDir, up).chain(to.components().skip(same));
    let steps: PathBuf = steps.collect();
    let written = steps.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/");
    quoted(if written.is_empty() { "." } else { &written })
}
