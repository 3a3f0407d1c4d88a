//! The page's sections: one function each, from data to HTML.

use super::data::{Archive, Audit, Check, Finding, Floor, Plan, Render, Run, Study, StudySummary, ViewPictures};
use crate::plan::output::counted;
use crate::report::Fingerprint;
use crate::report::svg::escape;
use crate::study::rounded;

/// A titled part of the page.
pub(super) struct Section {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) html: String,
}

/// What the archive holds, in the order in which a reader asks.
pub(super) fn all(archive: &Archive) -> Vec<Section> {
    let section = |id, title, html| Section { id, title, html };
    let mut parts = vec![section("glance", "At a glance", glance(archive))];
    if let Some(audit) = &archive.audit {
        parts.push(section("findings", "Findings", findings(audit)));
    }
    if !archive.views.is_empty() {
        parts.push(section("pictures", "Pictures", pictures(archive)));
    }
    if let Some(plan) = &archive.plan {
        parts.push(section("plan", "Where to put the tripod", floors(plan)));
    }
    if let Some(study) = &archive.study {
        parts.push(section("study", "Error against run time", study_part(study)));
    }
    if let Some(check) = &archive.check {
        parts.push(section("check", "The site’s health", health(check)));
    }
    parts.push(section("method", "How this was made", method(archive)));
    parts
}

fn glance(archive: &Archive) -> String {
    let walk = archive.viewer.as_ref().map_or_else(String::new, |file| {
        format!("<p><a href=\"{}\">Walk through the relit model</a></p>\n", escape(file))
    });
    walk + &facts(archive)
}

fn facts(archive: &Archive) -> String {
    let mut facts = Facts::default();
    if let Some(audit) = &archive.audit {
        let count = |kind: &str| audit.findings.iter().filter(|f| f.kind == kind).count();
        let kinds = format!("{} geometry, {} texture", count("geometry"), count("texture"));
        facts.add("Findings", &audit.findings.len().to_string(), &kinds);
        if !audit.views.is_empty() {
            let mean = audit.views.iter().map(|v| v.shares.untestable).sum::<f64>() / audit.views.len() as f64;
            facts.add("Untestable", &percent(mean), "of the photographs: neither right nor wrong");
        }
    }
    if let Some(render) = &archive.render {
        let errors: Vec<_> = render.views.iter().filter_map(|v| v.error.as_ref()).collect();
        if !errors.is_empty() {
            let flip = errors.iter().map(|e| e.all.flip).sum::<f64>() / errors.len() as f64;
            facts.add("Difference to the photographs", &format!("{flip:.3}"), "mean FLIP: 0 same, 1 black on white");
        }
        let seen = render.views.iter().map(|v| v.covered_fraction).sum::<f64>() / render.views.len().max(1) as f64;
        facts.add("Seen by probes", &percent(seen), "of the pixels; the volume fills the rest");
        let s = render.setup;
        let total = s.load_s + s.shoot_s + s.index_s + s.volume_s;
        facts.add("Set-up", &format!("{total:.1} s"), "reading, shooting, indexing, volume");
    }
    if let Some(plan) = &archive.plan {
        let stations: usize = plan.floors.iter().map(|f| f.stations.len()).sum();
        let bound: f64 = plan.floors.iter().map(|f| f.lower_bound).sum();
        facts.add("Planned stations", &stations.to_string(), &format!("at least {bound:.0} are needed"));
    }
    if let Some(check) = &archive.check {
        let [x, y, z] = check.model.size_m;
        facts.add("Model", &format!("{x:.1} × {y:.1} × {z:.1} m"), &format!("{} triangles", check.model.triangles));
        facts.add("Probes", &check.probes.len().to_string(), "panoramas taken inside");
    }
    let failed: Vec<String> = archive
        .runs
        .iter()
        .filter(|r| r.seconds.is_some() && !r.note.is_empty())
        .map(|r| format!("{} came to no end: {}", r.verb, r.note))
        .collect();
    facts.html() + &warnings(&failed)
}

/// A list of figures.
#[derive(Default)]
struct Facts(String);

impl Facts {
    fn add(&mut self, name: &str, value: &str, note: &str) {
        let (name, value, note) = (escape(name), escape(value), escape(note));
        self.0 += &format!("<div><dt>{name}</dt><dd>{value} <small>{note}</small></dd></div>\n");
    }

    fn html(self) -> String {
        format!("<dl class=\"facts\">\n{}</dl>\n", self.0)
    }
}

fn findings(audit: &Audit) -> String {
    let intro = if audit.findings.is_empty() {
        "<p>Nothing in the photographs contradicts the model, as far as it could be tested.</p>\n".to_owned()
    } else {
        "<p>What the photographs say of the model. Each finding is a proposal for a surveyor to confirm; the sheets have \
         a column for the verdict.</p>\n"
            .to_owned()
            + &finding_table("Findings", &audit.findings)
    };
    let doubts = if audit.doubts.is_empty() {
        String::new()
    } else {
        format!(
            "<h3>Doubts</h3>\n<p>Something disagrees here, but these photographs and probes do not show what it is.</p>\n{}",
            finding_table("Doubts", &audit.doubts)
        )
    };
    let rows: String = audit
        .views
        .iter()
        .map(|v| {
            let s = v.shares;
            let cells: String = [s.ok, s.geometry, s.texture, s.ambiguous, s.untestable]
                .iter()
                .map(|share| format!("<td class=\"number\" data-value=\"{share}\">{}</td>", percent(*share)))
                .collect();
            format!("<tr><th scope=\"row\">{}</th>{cells}</tr>\n", escape(&v.view))
        })
        .collect();
    let mut said = audit.warnings.clone();
    said.extend(audit.views.iter().flat_map(|v| v.warnings.iter().map(|w| format!("{}: {w}", v.view))));
    format!(
        "{intro}{doubts}<h3>What was tested</h3>\n<p>Shares of each photograph. Untestable is what no probe sees, what \
         shows too little parallax or texture, or is too dark or too bright: it is neither right nor wrong.</p>\n\
         <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"What was tested\">\n<table class=\"sortable\">\n<thead><tr>\
         <th scope=\"col\">View</th><th scope=\"col\" class=\"number\">Right</th><th scope=\"col\" class=\"number\">Geometry wrong</th>\
         <th scope=\"col\" class=\"number\">Texture wrong</th><th scope=\"col\" class=\"number\">Ambiguous</th>\
         <th scope=\"col\" class=\"number\">Untestable</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n{}",
        warnings(&said)
    )
}

fn finding_table(title: &str, list: &[Finding]) -> String {
    let row = |f: &Finding| {
        let position = f.position.map(|v| format!("{v:.2}")).join(", ");
        let (kind, what, view, note, id, material) =
            (escape(&f.kind), escape(&f.what), escape(&f.view), escape(&f.note), escape(&f.id), escape(&f.material));
        let class = if f.kind.chars().all(|c| c.is_ascii_lowercase()) { &f.kind } else { "" };
        let (off, shown) = f.displacement.map_or_else(
            || (String::new(), "–".to_owned()),
            |d| (d.metres.to_string(), format!("{:+.1} ± {:.1}", 100.0 * d.metres, 100.0 * d.uncertainty_m)),
        );
        format!(
            "<tr id=\"finding-{id}\"><th scope=\"row\">{id}</th><td><a href=\"#view-{view}\">{view}</a></td>\
             <td><span class=\"kind {class}\">{kind}</span> {what}</td>\
             <td class=\"number\" data-value=\"{}\">{}</td><td class=\"number\">{:.2}</td>\
             <td class=\"number\">{:.0}</td><td class=\"number\" data-value=\"{off}\">{shown}</td>\
             <td>{position}</td><td>{material}</td><td class=\"prose\">{note}</td></tr>\n",
            f.score,
            percent(f.score),
            f.size_m,
            f.area_cm2
        )
    };
    let rows: String = list.iter().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\">\n<table class=\"sortable\">\n\
         <caption>{title}; a column’s title sorts by it</caption>\n<thead><tr>\
         <th scope=\"col\">Id</th><th scope=\"col\">View</th><th scope=\"col\">What is wrong</th>\
         <th scope=\"col\" class=\"number\">Confidence</th><th scope=\"col\" class=\"number\">Extent, m</th>\
         <th scope=\"col\" class=\"number\">Area, cm²</th><th scope=\"col\" class=\"number\">Off its place, cm</th>\
         <th scope=\"col\">Place in the model</th><th scope=\"col\">Material</th><th scope=\"col\">Note</th>\
         </tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n"
    )
}

fn pictures(archive: &Archive) -> String {
    let errors = archive.render.as_ref().map(error_table).unwrap_or_default();
    let views: String = archive.views.iter().map(view).collect();
    format!(
        "<p>Each view as photographed and as relit from the probes, at the same exposure. Move the slider, or drag in \
         the picture: the photograph is on its left.</p>\n<div class=\"views\">\n{views}</div>\n{errors}"
    )
}

fn view(view: &ViewPictures) -> String {
    let (name, render) = (escape(&view.name), file(&view.render));
    let [width, height] = view.size;
    let picture = |src: &str, layer: &str, alt: &str| {
        let layer = if layer.is_empty() { String::new() } else { format!(" data-layer=\"{layer}\"") };
        format!("<img src=\"{src}\" width=\"{width}\" height=\"{height}\"{layer} alt=\"{alt}\">")
    };
    let relit = picture(&render, "render", &format!("View {name}, relit from the probes"));
    let Some(photo) = &view.photo else {
        return format!("<figure id=\"view-{name}\">{relit}<figcaption>{name}</figcaption></figure>\n");
    };
    let photo = picture(&file(photo), "", &format!("View {name}, photograph"));
    let (marked, choice) = match &view.findings {
        None => (String::new(), String::new()),
        Some(marked) => (
            picture(&file(marked), "findings", &format!("View {name}, photograph with the findings marked")),
            format!(
                "<fieldset><legend>On the right:</legend>\
                 <label><input type=\"radio\" name=\"right-{name}\" value=\"render\" checked> relit</label>\
                 <label><input type=\"radio\" name=\"right-{name}\" value=\"findings\"> findings</label></fieldset>\n"
            ),
        ),
    };
    let sheet = view.sheet.as_ref().map_or_else(String::new, |stem| {
        let stem = file(stem);
        format!(" – audit sheet: <a href=\"{stem}.svg\">SVG</a>, <a href=\"{stem}.png\">PNG</a>")
    });
    format!(
        "<figure class=\"compare\" id=\"view-{name}\">\n<div class=\"stack\">{photo}{relit}{marked}</div>\n\
         <div class=\"controls\"><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" \
         aria-label=\"View {name}: share of the photograph that is shown, from the left\">\n{choice}</div>\n\
         <figcaption>{name}{sheet}</figcaption>\n</figure>\n"
    )
}

fn error_table(render: &Render) -> String {
    let with_error = render.views.iter().filter_map(|v| Some((v, v.error.as_ref()?)));
    let rows: String = with_error
        .map(|(v, e)| {
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"number\">{}</td><td class=\"number\">{:.4}</td>\
                 <td class=\"number\">{:.4}</td><td class=\"number\">{}</td><td class=\"number\">{:.0}</td></tr>\n",
                escape(&v.name),
                percent(v.covered_fraction),
                e.all.flip,
                e.all.relmse,
                percent(e.all.median),
                1e3 * (v.rays_s + v.shade_s)
            )
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<h3>How far the pictures are from the photographs</h3>\n\
         <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Errors\">\n<table class=\"sortable\">\n<thead><tr>\
         <th scope=\"col\">View</th><th scope=\"col\" class=\"number\">Seen by probes</th><th scope=\"col\" class=\"number\">FLIP</th>\
         <th scope=\"col\" class=\"number\">Relative squared error</th><th scope=\"col\" class=\"number\">Median error</th>\
         <th scope=\"col\" class=\"number\">Milliseconds a frame</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n"
    )
}

fn floors(plan: &Plan) -> String {
    plan.floors.iter().enumerate().map(|(i, f)| floor(i, f)).collect()
}

fn floor(index: usize, floor: &Floor) -> String {
    let sheets: String = floor
        .sheets
        .iter()
        .map(|stem| {
            let (stem, name) = (file(stem), escape(stem));
            format!(
                "<figure class=\"zoom\">\n<div class=\"viewport\" tabindex=\"0\" role=\"group\" \
                 aria-label=\"{name}: + and − zoom, 0 shows all, arrows move\"><img src=\"{stem}.svg\" alt=\"Sheet {name}\"></div>\n\
                 <div class=\"controls\"><button type=\"button\" data-act=\"in\">Zoom in</button>\
                 <button type=\"button\" data-act=\"out\">Zoom out</button><button type=\"button\" data-act=\"reset\">Whole sheet</button></div>\n\
                 <figcaption>{name}: <a href=\"{stem}.svg\">SVG</a>, <a href=\"{stem}.png\">PNG</a></figcaption>\n</figure>\n"
            )
        })
        .collect();
    let rows: String = floor
        .stations
        .iter()
        .map(|s| {
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"number\">{:.1}</td><td class=\"number\" data-value=\"{}\">{}</td></tr>\n",
                escape(&s.name),
                s.position.map(|v| format!("{v:.2}")).join(", "),
                s.covers_m2,
                s.adds_fraction,
                percent(s.adds_fraction)
            )
        })
        .collect();
    let snippet: String = floor
        .stations
        .iter()
        .map(|s| {
            let [x, y, z] = s.position;
            format!("[[probe]]\nname = {:?}\nposition = [{x}, {y}, {z}]\nimage = \"probes/{}.exr\"\n\n", s.name, s.name)
        })
        .collect();
    format!(
        "<h3>{}</h3>\n<p>At {:.2} in the model’s units; {:.1} m² open. {} see {} of it; at least {:.0} are needed \
         for that, with the floor cut into places to stand and points to see. {:.1} m² are seen from no allowed place.</p>\n{sheets}\
         <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Stations\">\n<table class=\"sortable\">\n<thead><tr><th scope=\"col\">Station</th>\
         <th scope=\"col\">Position in the model</th><th scope=\"col\" class=\"number\">Sees, m²</th>\
         <th scope=\"col\" class=\"number\">Adds</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n\
         <details><summary>The stations as site-file blocks</summary>\n<pre id=\"stations-{index}\">{}</pre>\n\
         <button type=\"button\" class=\"copy\" data-of=\"stations-{index}\">Copy</button></details>\n",
        escape(&floor.name),
        floor.elevation,
        floor.area_m2,
        counted(floor.stations.len(), "station"),
        percent(floor.covered_fraction),
        floor.lower_bound,
        floor.unreachable_m2,
        escape(snippet.trim_end())
    )
}

fn study_part(study: &Study) -> String {
    let says = study_words(&study.summary);
    let table = match study.table.split_first() {
        None => String::new(),
        Some((head, rows)) => {
            let head: String = head.iter().map(|c| format!("<th scope=\"col\">{}</th>", escape(c))).collect();
            let row = |r: &Vec<String>| {
                let cells: String = r.iter().map(|c| format!("<td>{}</td>", escape(c))).collect();
                format!("<tr>{cells}</tr>\n")
            };
            let rows: String = rows.iter().map(row).collect();
            format!(
                "<details><summary>All runs</summary>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"All runs\">\n<table class=\"sortable\">\
                 <thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody></table>\n</div></details>\n"
            )
        }
    };
    format!(
        "{says}<figure class=\"zoom\">\n<div class=\"viewport\" tabindex=\"0\" role=\"group\" \
         aria-label=\"Study sheet: + and − zoom, 0 shows all, arrows move\"><img src=\"study.svg\" \
         alt=\"Error against run time of image-based shooting and of path tracing, both axes logarithmic\"></div>\n\
         <div class=\"controls\"><button type=\"button\" data-act=\"in\">Zoom in</button>\
         <button type=\"button\" data-act=\"out\">Zoom out</button><button type=\"button\" data-act=\"reset\">Whole sheet</button></div>\n\
         <figcaption>Error against run time: <a href=\"study.svg\">SVG</a>, <a href=\"study.png\">PNG</a>, <a href=\"study.csv\">CSV</a></figcaption>\n</figure>\n{table}"
    )
}

/// What the study comes to, in words.
fn study_words(summary: &StudySummary) -> String {
    let mut out = String::new();
    for s in &summary.speed_ups {
        let how = if s.how == "extrapolated" { ", extrapolated" } else { "" };
        let least = if s.how == "at_least" { "at least " } else { "" };
        out += &format!(
            "<li>For the same error ({} {:.4}), {} takes {least}<b>{}×</b> as long for a frame (95 %: {} to {}{how}), and \
             {least}{}× with all set-up ({} to {}).</li>\n",
            escape(&s.metric.to_uppercase()),
            s.error,
            escape(&s.against),
            rounded(s.frame.value),
            rounded(s.frame.low),
            rounded(s.frame.high),
            rounded(s.with_setup.value),
            rounded(s.with_setup.low),
            rounded(s.with_setup.high)
        );
    }
    let out = if out.is_empty() { out } else { format!("<ul>\n{out}</ul>\n") };
    let losses: String = summary.losses.iter().map(|l| format!("<li>{}</li>\n", escape(l))).collect();
    let losses = if losses.is_empty() {
        losses
    } else {
        format!("<h3>Where image-based shooting loses</h3>\n<ul>\n{losses}</ul>\n")
    };
    let recommended = summary.recommended.as_ref().map_or_else(String::new, |r| {
        format!(
            "<p>{}</p>\n<pre id=\"setting\">{}</pre>\n<button type=\"button\" class=\"copy\" data-of=\"setting\">Copy</button>\n",
            escape(&r.why),
            escape(&r.snippet)
        )
    });
    out + &losses + &recommended
}

fn health(check: &Check) -> String {
    let mut said: Vec<String> = check.causes.iter().map(|cause| cause.sentence.clone()).collect();
    said.extend(check.warnings.iter().cloned());
    said.extend(check.model.warnings.iter().cloned());
    said.extend(check.edge_warnings.iter().cloned());
    for probe in &check.probes {
        said.extend(probe.warnings.iter().map(|w| format!("Probe {}: {w}", probe.name)));
    }
    let verdict =
        if said.is_empty() { "<p>Nothing is wrong with the site’s files.</p>\n".into() } else { warnings(&said) };
    let metres = |d: Option<f64>| d.map_or_else(|| "–".into(), |d| format!("{d:.2}"));
    let probes: String = check
        .probes
        .iter()
        .map(|p| {
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n",
                escape(&p.name),
                metres(p.height_m),
                metres(p.nearest_m)
            )
        })
        .collect();
    let stages: String = check
        .stages
        .iter()
        .map(|s| {
            let needed = if s.needed { "needed" } else { "left out" };
            format!(
                "<tr><th scope=\"row\">{}</th><td>{needed}</td><td>{}</td></tr>\n",
                escape(&s.stage),
                escape(&s.why)
            )
        })
        .collect();
    format!(
        "{verdict}<h3>Stages of work</h3>\n<table><thead><tr><th scope=\"col\">Stage</th><th scope=\"col\">Verdict</th>\
         <th scope=\"col\">Why</th></tr></thead>\n<tbody>\n{stages}</tbody></table>\n<h3>Probes</h3>\n<table><thead><tr>\
         <th scope=\"col\">Probe</th><th scope=\"col\" class=\"number\">Above the floor, m</th>\
         <th scope=\"col\" class=\"number\">Nearest surface, m</th></tr></thead>\n<tbody>\n{probes}</tbody></table>\n"
    )
}

fn method(archive: &Archive) -> String {
    let run = |r: &Run| {
        let (time, note) = match r.seconds {
            Some(s) => (format!("{s:.1}"), r.note.clone()),
            None => ("–".into(), format!("left out: {}", r.note)),
        };
        format!(
            "<tr><th scope=\"row\">{}</th><td class=\"hash\">{}</td><td class=\"number\">{time}</td><td>{}</td></tr>\n",
            escape(&r.verb),
            escape(&r.command),
            escape(&note)
        )
    };
    let runs: String = archive.runs.iter().map(run).collect();
    let left: String = archive
        .render
        .iter()
        .flat_map(|r| &r.left_out)
        .fold(String::new(), |all, l| all + &format!("<li><b>{}</b>: {}</li>\n", escape(&l.stage), escape(&l.why)));
    let left = if left.is_empty() { left } else { format!("<p>Left out of rendering:</p>\n<ul>\n{left}</ul>\n") };
    let input = |f: &Fingerprint| {
        format!(
            "<tr><th scope=\"row\">{}</th><td class=\"number\">{}</td><td class=\"hash\">{}</td></tr>\n",
            escape(&f.file),
            f.bytes,
            escape(&f.sha256)
        )
    };
    let inputs: String = archive.inputs.iter().map(input).collect();
    format!(
        "<p>The method is Image-Based Shooting (Happa, Bashford-Rogers, Debattista and Chalmers, VAST 2010): every pixel \
         of a panorama taken inside the real room is shot onto the model, where it tells the light that arrives at the \
         surface it saw. Surfaces are taken as matt and opaque, and the scene as standing still.</p>\n\
         <h3>Commands</h3>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Commands\">\n<table><thead><tr><th scope=\"col\">Verb</th><th scope=\"col\">The same by hand</th>\
         <th scope=\"col\" class=\"number\">Seconds</th><th scope=\"col\">Note</th></tr></thead>\n<tbody>\n{runs}</tbody></table>\n</div>\n{left}\
         <h3>What was read</h3>\n<details><summary>{} files with their SHA-256</summary>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Files read\">\n<table><thead><tr>\
         <th scope=\"col\">File</th><th scope=\"col\" class=\"number\">Bytes</th><th scope=\"col\">SHA-256</th></tr></thead>\n\
         <tbody>\n{inputs}</tbody></table>\n</div></details>\n",
        archive.inputs.len()
    )
}

fn warnings(sentences: &[String]) -> String {
    if sentences.is_empty() {
        return String::new();
    }
    let items: String = sentences.iter().map(|s| format!("<li>{}</li>\n", escape(s))).collect();
    format!("<ul class=\"warnings\">\n{items}</ul>\n")
}

fn percent(share: f64) -> String {
    let p = 100.0 * share;
    if p == 0.0 || p.abs() >= 99.95 { format!("{p:.0} %") } else { format!("{p:.1} %") }
}

/// A file's name as a relative address: what a URL keeps for itself is percent-encoded.
fn file(name: &str) -> String {
    let mut out = String::new();
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) {
            out.push(char::from(byte));
        } else {
            out += &format!("%{byte:02X}");
        }
    }
    out
}
