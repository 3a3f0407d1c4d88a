//! Each view as photographed and as relit.

use maud::{Markup, html};

use super::archive::ViewPictures;
use super::parts::file;

pub(super) fn pictures(views: &[ViewPictures]) -> Markup {
    html! {
        p {
            "Each view as photographed and as relit from the probes, at the same exposure."
            span class="screen" { " Move the slider, or drag in the picture: the photograph is on its left." }
            span class="paper" { " The photograph is on the left." }
        }
        div class="views" { @for v in views { (view(v)) } }
    }
}

fn view(view: &ViewPictures) -> Markup {
    let name = &view.name;
    let [width, height] = view.size;
    let picture = |src: &str, layer: Option<&str>, says: &str| {
        html! {
            img src=(file(src)) width=(width) height=(height) data-layer=[layer] alt={ "View " (name) ", " (says) };
        }
    };
    let Some(photo) = &view.photo else {
        return html! {
            figure id={ "view-" (name) } {
                (picture(&view.render, None, "relit from the probes"))
                figcaption { (name) }
            }
        };
    };
    html! {
        figure class="compare" id={ "view-" (name) } {
            div class="stack" {
                (picture(photo, None, "photograph"))
                (picture(&view.render, Some("render"), "relit from the probes"))
                @if let Some(marked) = &view.findings {
                    (picture(marked, Some("findings"), "photograph with the findings marked"))
                }
            }
            div class="controls" {
                input type="range" min="0" max="100" value="50"
                    aria-label={ "View " (name) ": share of the photograph that is shown, from the left" };
                @if view.findings.is_some() {
                    fieldset {
                        legend { "On the right:" }
                        label { input type="radio" name={ "right-" (name) } value="render" checked; " relit" }
                        label { input type="radio" name={ "right-" (name) } value="findings"; " findings" }
                    }
                }
            }
            figcaption {
                (name)
                @if let Some(stem) = &view.sheet {
                    " – audit sheet: " a href={ (file(stem)) ".svg" } { "SVG" } ", " a href={ (file(stem)) ".pdf" } { "PDF" }
                }
            }
        }
    }
}
