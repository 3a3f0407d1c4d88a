//! From the site file's keys to a checked [`Site`].

use glam::{DVec2, DVec3, Vec3};
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

use super::camera::{Camera, Distortion};
use super::fault::{SiteError, Source};
use super::file::{
    EnvironmentTable, ImageKey, PlanTable, ProbeTable, ProjectionKey, SiteFile, SunTable, UpKey, ViewTable,
};
use super::files::{find_loosely, is_url};
use super::frame::{Frame, Pose, Up};
use super::pose::{Orientation, finite, finite_number};
use super::{Environment, LitPicture, Match, Pictures, Plan, Probe, Site, Sun, UnposedView, View};
use crate::panorama::{self, Projection};

/// Largest relative difference between a picture's aspect and its projection's.
const ASPECT_TOLERANCE: f64 = 0.01;

/// Reads and checks a site file's text. `path` is the file itself.
pub(super) fn site(path: &Path, text: &str, pictures: Pictures) -> Result<Site, SiteError> {
    let source = Source { path, text };
    let file: SiteFile = toml::from_str(text).map_err(|e| source.parse_fault(&e))?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut warnings = Vec::new();
    let frame = frame(&source, &file, &mut warnings)?;
    let resolver = Resolver { source, folder: folder.clone(), frame, pictures };
    let s = &resolver.source;

    let probes = file.probe.iter().map(|p| resolver.probe(p)).collect::<Result<Vec<_>, _>>()?;
    unique(s, "probe", file.probe.iter().map(|p| &p.get_ref().name))?;
    unique(s, "view", file.view.iter().map(|v| &v.get_ref().name))?;
    let mut views = Vec::new();
    let mut unposed = Vec::new();
    for table in &file.view {
        match resolver.view(table)? {
            Posed::View(view) => views.push(view),
            Posed::Not(view) => {
                warnings.push(format!(
                    "View “{}” has no position: it is left out until its pose is known from its {} matches.",
                    view.name,
                    view.matches.len()
                ));
                unposed.push(view);
            }
        }
    }
    let name = match &file.site.name {
        Some(name) => name.get_ref().clone(),
        None => folder.file_name().map_or_else(|| "site".to_owned(), |n| n.to_string_lossy().into_owned()),
    };
    let site = Site {
        name,
        frame,
        model: resolver.existing(file.model.path.get_ref(), file.model.path.span(), "the model")?,
        environment: file.environment.as_ref().map(|e| resolver.environment(e)).transpose()?,
        sun: file.sun.as_ref().map(|t| resolver.sun(t)).transpose()?,
        plan: resolver.plan(&file.plan)?,
        probes,
        views,
        unposed,
        warnings,
        file: resolver.source.path.to_owned(),
    };
    Ok(with_lighting_warnings(site))
}

fn frame(source: &Source, file: &SiteFile, warnings: &mut Vec<String>) -> Result<Frame, SiteError> {
    let metres_per_unit = match &file.site.units {
        Some(units) if units.get_ref().0.is_finite() && units.get_ref().0 > 0.0 => units.get_ref().0,
        Some(units) => {
            return Err(source.fault(
                units.span(),
                format!("expected metres per model unit above zero, found {}", units.get_ref().0),
                "Write \"m\", \"cm\", \"mm\", \"ft\", \"in\" or a positive number",
            ));
        }
        None => {
            warnings.push("The site file does not say site.units: metres are taken.".to_owned());
            1.0
        }
    };
    let up = match file.site.up {
        Some(UpKey::Y) => Up::Y,
        Some(UpKey::Z) => Up::Z,
        None => {
            warnings.push("The site file does not say site.up: y is taken as the model's up axis.".to_owned());
            Up::Y
        }
    };
    let north_deg = file.site.north.as_ref().map_or(Ok(0.0), |n| finite_number(source, n))?;
    Ok(Frame { metres_per_unit, up, north_deg })
}

enum Posed {
    View(View),
    Not(UnposedView),
}

struct Resolver<'a> {
    source: Source<'a>,
    folder: PathBuf,
    frame: Frame,
    pictures: Pictures,
}

impl Resolver<'_> {
    fn existing(&self, name: &str, at: Range<usize>, what: &str) -> Result<PathBuf, SiteError> {
        let fault = |problem: String, help: String| Err(self.source.fault(at.clone(), problem, help));
        if name.trim().is_empty() {
            return fault(
                format!("expected the path of {what}, found empty text"),
                "Give a path relative to this file".into(),
            );
        }
        if is_url(name) {
            return fault(
                format!("expected a path on this machine, found the URL “{name}”"),
                "Download the file and give its path relative to this file".into(),
            );
        }
        let path = self.folder.join(name);
        if path.is_file() {
            return Ok(path);
        }
        if path.is_dir() {
            return fault(
                format!("expected {what}, found the folder “{}”", path.display()),
                "Name the file in it".into(),
            );
        }
        let help = match find_loosely(&self.folder, name) {
            Some(near) => {
                let near = near.strip_prefix(&self.folder).unwrap_or(&near).display().to_string();
                format!("Did you mean “{near}”? Letter case counts, and folders are separated by /")
            }
            None => "Paths are relative to this file; check the name, or put the file there".to_owned(),
        };
        fault(format!("there is no file “{}” for {what}", path.display()), help)
    }

    /// Where a picture that is still to be made will be; `None` where it is there already or has to be.
    fn to_be_made(&self, name: &str) -> Option<PathBuf> {
        let path = self.folder.join(name);
        let may_be = self.pictures == Pictures::MayBeMissing && !name.trim().is_empty() && !is_url(name);
        (may_be && !path.exists()).then_some(path)
    }

    /// A picture that exists and whose aspect can be its projection's.
    fn panorama(&self, name: &str, at: Range<usize>, projection: &Projection) -> Result<PathBuf, SiteError> {
        let path = self.existing(name, at.clone(), "the picture")?;
        let (width, height) = self.size_of(&path, at.clone())?;
        let (shape, aspects): (_, &[f64]) = match projection {
            Projection::LatLong => ("twice as wide as high", &[2.0]),
            Projection::Angular | Projection::MirrorBall | Projection::Fisheye => ("square", &[1.0]),
            Projection::CubeCross => ("a cross of 3 × 4 or 4 × 3 squares", &[0.75, 4.0 / 3.0]),
            Projection::Perspective { .. } => return Ok(path),
        };
        let aspect = f64::from(width) / f64::from(height);
        if aspects.iter().any(|a| (aspect / a - 1.0).abs() <= ASPECT_TOLERANCE) {
            return Ok(path);
        }
        Err(self.source.fault(
            at,
            format!("expected a picture that is {shape}, found {width} × {height} pixels in “{name}”"),
            "Crop the picture, or set projection to what it is",
        ))
    }

    /// Width and height, from the picture's header alone.
    fn size_of(&self, path: &Path, at: Range<usize>) -> Result<(u32, u32), SiteError> {
        let why = match panorama::dimensions(path).map(|(w, h)| (u32::try_from(w), u32::try_from(h))) {
            Ok((Ok(width), Ok(height))) => return Ok((width, height)),
            Ok(_) => format!("{}: the picture is too large", path.display()),
            Err(why) => why.to_string(),
        };
        let help = "Give an OpenEXR, Radiance HDR, PNG, JPEG or TIFF picture";
        Err(self.source.fault(at, format!("the picture cannot be read: {why}"), help))
    }

    fn environment(&self, table: &Spanned<EnvironmentTable>) -> Result<Environment, SiteError> {
        let t = table.get_ref();
        match (&t.image, &t.radiance) {
            (Some(image), None) => {
                let projection = self.projection(&t.projection, &None)?;
                if let (Projection::Perspective { .. }, Some(key)) = (projection, &t.projection) {
                    return Err(self.source.fault(
                        key.span(),
                        "an environment cannot be a perspective picture",
                        "Give a panorama: latlong, angular, mirror-ball, fisheye or cube-cross",
                    ));
                }
                let path = self.panorama(image.get_ref(), image.span(), &projection)?;
                let heading = t.heading.as_ref().map_or(Ok(0.0), |h| finite_number(&self.source, h))?;
                Ok(Environment::Image { path, rotation: self.frame.rotation(heading, 0.0, 0.0), projection })
            }
            (None, Some(radiance)) => Ok(Environment::Uniform(self.colour(radiance, "radiance")?)),
            (Some(_), Some(radiance)) => Err(self.source.fault(
                radiance.span(),
                "the environment has both an image and a radiance",
                "Keep one of them",
            )),
            (None, None) => Err(self.source.fault(
                table.span(),
                "the environment has neither an image nor a radiance",
                "Add image = \"sky.exr\" or radiance = [r, g, b], or leave the table out",
            )),
        }
    }

    fn sun(&self, table: &SunTable) -> Result<Sun, SiteError> {
        let towards = self.frame.direction_in(finite(&self.source, &table.direction)?);
        let direction = towards.try_normalize().ok_or_else(|| {
            self.source.fault(
                table.direction.span(),
                "the direction has no length",
                "Give a vector that points towards the sun",
            )
        })?;
        Ok(Sun { direction: direction.as_vec3(), irradiance: self.colour(&table.irradiance, "irradiance")? })
    }

    fn colour(&self, rgb: &Spanned<[f64; 3]>, what: &str) -> Result<Vec3, SiteError> {
        let v = finite(&self.source, rgb)?;
        if v.min_element() >= 0.0 && v.as_vec3().is_finite() {
            return Ok(v.as_vec3());
        }
        Err(self.source.fault(
            rgb.span(),
            format!("expected a {what} of three numbers, zero or greater, found {v}"),
            "Light cannot be negative",
        ))
    }

    fn projection(
        &self,
        key: &Option<Spanned<ProjectionKey>>,
        fov_y: &Option<Spanned<f64>>,
    ) -> Result<Projection, SiteError> {
        let kind = key.as_ref().map_or(ProjectionKey::LatLong, |k| *k.get_ref());
        match (kind, key, fov_y) {
            (ProjectionKey::Perspective, _, Some(fov)) => {
                Ok(Projection::Perspective { fov_y: self.field_of_view(fov)?.to_radians() })
            }
            (ProjectionKey::Perspective, Some(key), None) => Err(self.source.fault(
                key.span(),
                "a perspective picture needs fov_y",
                "Add fov_y = its vertical field of view in degrees",
            )),
            (_, _, Some(fov)) => Err(self.source.fault(
                fov.span(),
                "fov_y belongs to projection = \"perspective\" only",
                "Remove fov_y, or set the projection",
            )),
            (ProjectionKey::Angular, ..) => Ok(Projection::Angular),
            (ProjectionKey::MirrorBall, ..) => Ok(Projection::MirrorBall),
            (ProjectionKey::Fisheye, ..) => Ok(Projection::Fisheye),
            (ProjectionKey::CubeCross, ..) => Ok(Projection::CubeCross),
            (ProjectionKey::LatLong | ProjectionKey::Perspective, ..) => Ok(Projection::LatLong),
        }
    }

    fn field_of_view(&self, fov: &Spanned<f64>) -> Result<f64, SiteError> {
        self.number(fov, |v| v > 0.0 && v < 180.0, "a field of view between 0 and 180 degrees")
    }

    fn number(&self, key: &Spanned<f64>, ok: impl Fn(f64) -> bool, expected: &str) -> Result<f64, SiteError> {
        let v = *key.get_ref();
        if v.is_finite() && ok(v) {
            return Ok(v);
        }
        Err(self.source.fault(key.span(), format!("expected {expected}, found {v}"), "Correct the number"))
    }

    fn probe(&self, table: &Spanned<ProbeTable>) -> Result<Probe, SiteError> {
        let t = table.get_ref();
        safe_name(&self.source, &t.name, "probe")?;
        let orientation = Orientation {
            heading: &t.heading,
            pitch: &t.pitch,
            roll: &t.roll,
            rotation: &t.rotation,
            matrix: &t.matrix,
            look_at: &t.look_at,
        };
        let pose = orientation.pose(&self.source, &self.frame, finite(&self.source, &t.position)?)?;
        let projection = self.projection(&t.projection, &t.fov_y)?;
        let picture = |lighting: &str, name: &str, at: Range<usize>| {
            let path = self.to_be_made(name).map_or_else(|| self.panorama(name, at, &projection), Ok)?;
            Ok(LitPicture { lighting: lighting.to_owned(), path })
        };
        let pictures = match t.image.get_ref() {
            ImageKey::One(name) => vec![picture("", name, t.image.span())?],
            ImageKey::PerLighting(table) if table.is_empty() => {
                return Err(self.source.fault(
                    t.image.span(),
                    "the table of lightings is empty",
                    "Give image = \"picture.exr\", or at least one \"lighting\" = \"picture.exr\"",
                ));
            }
            ImageKey::PerLighting(table) => table
                .iter()
                .map(|(lighting, path)| {
                    lighting_name(&self.source, lighting)?;
                    picture(lighting.get_ref(), path.get_ref(), path.span())
                })
                .collect::<Result<_, SiteError>>()?,
        };
        let gain = t.gain.as_ref().map_or(Ok(1.0), |g| self.number(g, |v| v > 0.0, "a gain above zero"))? as f32;
        Ok(Probe { name: t.name.get_ref().clone(), pose, pictures, projection, gain })
    }

    fn view(&self, table: &Spanned<ViewTable>) -> Result<Posed, SiteError> {
        let t = table.get_ref();
        safe_name(&self.source, &t.name, "view")?;
        let name = t.name.get_ref().clone();
        let file = |key: &Option<Spanned<String>>, what: &str| {
            key.as_ref().map(|k| self.existing(k.get_ref(), k.span(), what)).transpose()
        };
        let photo = match t.photo.as_ref().and_then(|k| self.to_be_made(k.get_ref())) {
            Some(path) => Some(path),
            None => file(&t.photo, "the photograph")?,
        };
        let mask = file(&t.mask, "the mask")?;
        let [width, height] = self.picture_size_of(table, photo.as_deref(), mask.as_deref())?;
        let matches = self.matches(t, width, height)?;
        let Some(position) = &t.position else {
            if matches.len() >= 4 {
                return Ok(Posed::Not(UnposedView { name, size: [width, height], matches, photo, mask }));
            }
            return Err(self.source.fault(
                table.span(),
                "the key `position` is missing",
                "Add position = [x, y, z], or at least four match pairs of pixel and model point",
            ));
        };
        let orientation = Orientation {
            heading: &t.heading,
            pitch: &t.pitch,
            roll: &t.roll,
            rotation: &t.rotation,
            matrix: &t.matrix,
            look_at: &t.look_at,
        };
        let pose = orientation.pose(&self.source, &self.frame, finite(&self.source, position)?)?;
        let camera = self.camera(table, pose, width, height)?;
        Ok(Posed::View(View { name, camera, photo, mask, matches }))
    }

    /// The view's size in pixels: as given, or its photograph's.
    fn picture_size_of(
        &self,
        table: &Spanned<ViewTable>,
        photo: Option<&Path>,
        mask: Option<&Path>,
    ) -> Result<[u32; 2], SiteError> {
        let t = table.get_ref();
        let at = |key: &Option<Spanned<String>>| key.as_ref().map_or(table.span(), Spanned::span);
        let photo_size = photo.filter(|p| p.exists()).map(|p| self.size_of(p, at(&t.photo))).transpose()?;
        let size = match (&t.size, photo_size) {
            (Some(size), _) if size.get_ref().iter().all(|n| (1..=65_536).contains(n)) => *size.get_ref(),
            (Some(size), _) => {
                return Err(self.source.fault(
                    size.span(),
                    format!("expected width and height from 1 to 65536 pixels, found {:?}", size.get_ref()),
                    "Correct the size",
                ));
            }
            (None, Some((width, height))) => [width, height],
            (None, None) => {
                return Err(self.source.fault(
                    table.span(),
                    "the key `size` is missing",
                    "Add size = [width, height] in pixels, or a photo, whose size is then taken",
                ));
            }
        };
        let mask_size = mask.map(|p| self.size_of(p, at(&t.mask))).transpose()?;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        for (what, found, key) in [("photograph", photo_size, &t.photo), ("mask", mask_size, &t.mask)] {
            if let Some((w, h)) = found
                && (f64::from(w) / f64::from(h) / aspect - 1.0).abs() > ASPECT_TOLERANCE
            {
                return Err(self.source.fault(
                    at(key),
                    format!(
                        "expected a {what} in the view's aspect, {} × {}, found {w} × {h} pixels",
                        size[0], size[1]
                    ),
                    "Set size to the photograph's, and crop neither",
                ));
            }
        }
        Ok(size)
    }

    fn matches(&self, t: &ViewTable, width: u32, height: u32) -> Result<Vec<Match>, SiteError> {
        let one = |pair: &Spanned<super::file::MatchTable>| {
            let pixel = DVec2::from_array(*pair.get_ref().pixel.get_ref());
            let inside = pixel.cmpge(DVec2::ZERO).all() && pixel.x <= f64::from(width) && pixel.y <= f64::from(height);
            if !inside {
                return Err(self.source.fault(
                    pair.get_ref().pixel.span(),
                    format!("expected a pixel in the picture of {width} × {height}, found {pixel}"),
                    "Count from the top left corner",
                ));
            }
            Ok(Match { pixel, point: self.frame.point_in(finite(&self.source, &pair.get_ref().point)?) })
        };
        t.pairs.iter().map(one).collect()
    }

    fn camera(&self, table: &Spanned<ViewTable>, pose: Pose, width: u32, height: u32) -> Result<Camera, SiteError> {
        let t = table.get_ref();
        let pixels = |key: &Option<Spanned<f64>>, default: f64, positive: bool| match key {
            None => Ok(default),
            Some(v) if positive => self.number(v, |v| v > 0.0, "a focal length in pixels above zero"),
            Some(v) => finite_number(&self.source, v),
        };
        let mut camera = match (&t.fov_y, &t.fx, &t.fy) {
            (Some(fov), None, None) => Camera::with_fov(pose, width, height, self.field_of_view(fov)?),
            (None, None, None) => {
                return Err(self.source.fault(
                    table.span(),
                    "the view has neither fov_y nor fx",
                    "Add fov_y in degrees, or fx (and fy, cx, cy) in pixels",
                ));
            }
            (Some(fov), _, _) => {
                return Err(self.source.fault(
                    fov.span(),
                    "the view has both fov_y and a focal length",
                    "Keep one of them",
                ));
            }
            (None, fx, fy) => {
                let mut camera = Camera::with_fov(pose, width, height, 90.0);
                let x = pixels(if fx.is_some() { fx } else { fy }, 0.0, true)?;
                camera.focal = DVec2::new(x, pixels(fy, x, true)?);
                camera
            }
        };
        camera.centre = DVec2::new(pixels(&t.cx, camera.centre.x, false)?, pixels(&t.cy, camera.centre.y, false)?);
        let term = |key: &Option<Spanned<f64>>| pixels(key, 0.0, false);
        camera.distortion =
            Distortion { k: [term(&t.k1)?, term(&t.k2)?, term(&t.k3)?], p: [term(&t.p1)?, term(&t.p2)?] };
        Ok(camera)
    }

    fn plan(&self, t: &PlanTable) -> Result<Plan, SiteError> {
        let default = Plan::default();
        let number = |key: &Option<Spanned<f64>>, default: f64, ok: fn(f64) -> bool, expected: &str| {
            key.as_ref().map_or(Ok(default), |k| self.number(k, ok, expected))
        };
        let max_probes = match &t.max_probes {
            Some(n) if *n.get_ref() == 0 => {
                return Err(self.source.fault(n.span(), "expected at least 1 probe, found 0", "Correct the number"));
            }
            Some(n) => *n.get_ref(),
            None => default.max_probes,
        };
        let keep_out = t.keep_out.iter().map(|ring| {
            if ring.get_ref().len() < 3 {
                return Err(self.source.fault(
                    ring.span(),
                    "expected a polygon of at least three corners",
                    "Add corners",
                ));
            }
            ring.get_ref().iter().map(|p| self.plan_point(*p, ring.span())).collect()
        });
        Ok(Plan {
            probe_height_m: number(
                &t.probe_height,
                default.probe_height_m,
                |v| v > 0.0,
                "a height in metres above zero",
            )?,
            clearance_m: number(&t.clearance, default.clearance_m, |v| v >= 0.0, "metres, zero or greater")?,
            range_m: number(&t.range, default.range_m, |v| v >= 0.0, "metres, zero (no limit) or greater")?,
            incidence_deg: number(
                &t.incidence,
                default.incidence_deg,
                |v| v > 0.0 && v <= 90.0,
                "degrees above 0, at most 90",
            )?,
            target_coverage: number(
                &t.target_coverage,
                default.target_coverage,
                |v| v > 0.0 && v <= 1.0,
                "a share above 0, at most 1",
            )?,
            max_probes,
            keep_out: keep_out.collect::<Result<_, _>>()?,
            fixed: t.fixed.iter().map(|p| self.plan_point(*p.get_ref(), p.span())).collect::<Result<_, _>>()?,
        })
    }

    /// A pair of the model's horizontal axes, in the program's x and y.
    fn plan_point(&self, [a, b]: [f64; 2], at: Range<usize>) -> Result<DVec2, SiteError> {
        let point = match self.frame.up {
            Up::Y => DVec3::new(a, 0.0, b),
            Up::Z => DVec3::new(a, b, 0.0),
        };
        let local = self.frame.point_in(point).truncate();
        if local.is_finite() {
            return Ok(local);
        }
        Err(self.source.fault(
            at,
            format!("expected finite numbers, found [{a}, {b}]"),
            "Measure it again, or leave it out",
        ))
    }
}

fn unique<'a>(source: &Source, what: &str, names: impl Iterator<Item = &'a Spanned<String>>) -> Result<(), SiteError> {
    let mut seen = BTreeSet::new();
    for name in names {
        // file systems may not tell letter case
        if !seen.insert(name.get_ref().to_lowercase()) {
            return Err(source.fault(
                name.span(),
                format!("there are two {what}s named “{}”", name.get_ref()),
                "Give each its own name; letter case alone does not count",
            ));
        }
    }
    Ok(())
}

/// Names become file names, on any system.
fn safe_name(source: &Source, name: &Spanned<String>, what: &str) -> Result<(), SiteError> {
    let n = name.get_ref();
    let stem = n.split('.').next().unwrap_or(n).to_ascii_uppercase();
    let device = matches!(stem.as_str(), "CON" | "PRN" | "AUX" | "NUL")
        || (stem.len() == 4
            && (stem.starts_with("COM") || stem.starts_with("LPT"))
            && stem.ends_with(|c: char| c.is_ascii_digit()));
    let problem = if n.trim().is_empty() {
        "it is empty".to_owned()
    } else if let Some(c) = n.chars().find(|c| c.is_control() || "/\\:*?\"<>|".contains(*c)) {
        format!("it holds {c:?}")
    } else if n.starts_with([' ', '.']) || n.ends_with([' ', '.']) {
        "it begins or ends with a blank or a dot".to_owned()
    } else if device {
        "the name is reserved on some systems".to_owned()
    } else if n.len() > 100 {
        "it is longer than 100 bytes".to_owned()
    } else {
        return Ok(());
    };
    Err(source.fault(
        name.span(),
        format!("the name “{n}” cannot name this {what}'s files: {problem}"),
        "Use letters, digits, blanks inside, - and _",
    ))
}

fn lighting_name(source: &Source, name: &Spanned<String>) -> Result<(), SiteError> {
    let n = name.get_ref();
    if !n.trim().is_empty() && !n.chars().any(|c| c.is_control() || c == '/' || c == '\\') {
        return Ok(());
    }
    Err(source.fault(
        name.span(),
        format!("“{n}” cannot name a lighting"),
        "Use a time such as \"10:00\" or a word; not empty, and without / and \\",
    ))
}

fn with_lighting_warnings(mut site: Site) -> Site {
    let all = site.lightings();
    for probe in &site.probes {
        let missing: Vec<_> = all.iter().filter(|l| probe.pictures.iter().all(|p| &p.lighting != *l)).collect();
        if missing.is_empty() {
            continue;
        }
        let named = |l: &String| if l.is_empty() { "the unnamed lighting".to_owned() } else { format!("“{l}”") };
        let list = missing.into_iter().map(named).collect::<Vec<_>>().join(", ");
        site.warnings.push(format!("Probe “{}” has no picture for {list}, which other probes have.", probe.name));
    }
    site
}
