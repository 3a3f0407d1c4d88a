//! Where to put the tripod, floor by floor.

use maud::{Markup, html};

use super::parts::{percent, sheet, snippet, sortable};
use crate::plan::export::tables::{FloorJson, PlanJson, StationJson, at_least, counted};
use crate::site::edit::quoted;

pub(super) fn floors(plan: &PlanJson) -> Markup {
    html! { @for (i, f) in plan.floors.iter().enumerate() { (floor(i, f)) } }
}

fn floor(index: usize, floor: &FloorJson) -> Markup {
    let drawn = |stem: &str| {
        let what = if stem.starts_with("coverage") { "how often it is seen" } else { "where to put the tripod" };
        sheet(stem, &format!("{}: {what}", floor.name), &["svg", "png", "pdf"])
    };
    let blocks: Vec<String> = floor.stations.iter().map(block).collect();
    html! {
        div class="floor" {
            div class="lead" {
                h3 { (floor.name) }
                p { (in_words(floor)) }
                @for stem in floor.sheets.iter().take(1) { (drawn(stem)) }
            }
            @for stem in floor.sheets.iter().skip(1) { (drawn(stem)) }
            div class="stations" {
                (stations(&floor.stations))
                @if !blocks.is_empty() {
                    details {
                        summary { "The stations as site-file blocks" }
                        (snippet(&format!("stations-{index}"), &blocks.join("\n\n")))
                    }
                }
            }
        }
    }
}

fn in_words(floor: &FloorJson) -> String {
    let seen = percent(floor.covered_fraction);
    let stations = match floor.stations.len() {
        0 => format!("No new station is needed: {seen} of it is seen."),
        n => {
            let see = if n == 1 { "sees" } else { "see" };
            format!("{} {see} {seen} of it; {}.", counted(n, "station"), at_least(floor.lower_bound))
        }
    };
    let hidden = match floor.unreachable_m2 {
        m2 if m2 < 0.05 => String::new(),
        m2 => format!(" {m2:.1} m² cannot be seen from any allowed place."),
    };
    format!("Elevation {:.2} in the model’s units; {:.1} m² open. {stations}{hidden}", floor.elevation, floor.area_m2)
}

fn stations(stations: &[StationJson]) -> Markup {
    let columns = [("Station", false), ("Position in the model", false), ("Sees, m²", true), ("Adds", true)];
    let rows = html! {
        @for s in stations {
            tr {
                th scope="row" { (s.name) }
                td { (s.position.map(|v| format!("{v:.2}")).join(", ")) }
                td class="number" { (format!("{:.1}", s.covers_m2)) }
                td class="number" data-value=(s.adds_fraction) { (percent(s.adds_fraction)) }
            }
        }
    };
    sortable("Stations", &columns, &rows)
}

/// A station as the site file takes it.
fn block(s: &StationJson) -> String {
    let [x, y, z] = s.position;
    format!("[[probe]]\nname = {}\nposition = [{x}, {y}, {z}]\nimage = \"probes/{}.exr\"", quoted(&s.name), s.name)
}
