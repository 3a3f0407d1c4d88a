//! Reading numbers out of XML, with places for errors.

use roxmltree::{Document, Node};
use std::path::Path;

use super::solved::{PoseFileError, Result};

/// The parsed file.
pub(super) fn parse<'a>(path: &Path, text: &'a str) -> Result<Document<'a>> {
    Document::parse(text).map_err(|e| PoseFileError::Damaged {
        path: path.into(),
        place: format!("line {}", e.pos().row),
        what: format!("the XML cannot be read ({e})"),
    })
}

/// Something wrong at an element.
pub(super) fn damaged(path: &Path, node: Node, what: impl Into<String>) -> PoseFileError {
    let row = node.document().text_pos_at(node.range().start).row;
    let place = format!("line {row}, <{}>", node.tag_name().name());
    PoseFileError::Damaged { path: path.into(), place, what: what.into() }
}

/// The first child element of this name, whatever its namespace.
pub(super) fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|n| n.is_element() && n.tag_name().name() == name)
}

/// An attribute of this local name, or the text of a child element of it.
pub(super) fn value<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    let attribute = node.attributes().find(|a| a.name() == name).map(|a| a.value());
    attribute.or_else(|| child(node, name)?.text()).map(str::trim)
}

/// Exactly `N` finite numbers.
pub(super) fn numbers<const N: usize>(path: &Path, node: Node, text: &str) -> Result<[f64; N]> {
    let all: Option<Vec<f64>> =
        text.split_whitespace().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    all.and_then(|v| <[f64; N]>::try_from(v).ok())
        .ok_or_else(|| damaged(path, node, format!("expected {N} numbers, found “{}”", shortened(text))))
}

/// A number, or `default` where it is not given.
pub(super) fn number(path: &Path, node: Node, name: &str, default: f64) -> Result<f64> {
    let Some(text) = value(node, name) else { return Ok(default) };
    let [v] = numbers::<1>(path, node, text)
        .map_err(|_| damaged(path, node, format!("expected a number for {name}, found “{}”", shortened(text))))?;
    Ok(v)
}

fn shortened(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { short + "…" } else { short }
}
