//! PDF of sheets, drawn by krilla from the very SVG that is shipped: lines stay lines, the one font that is shipped is
//! embedded, and archives take it (PDF/A-2b, ISO 19005-2).

use krilla::configure::{Archival, ConfigurationBuilder};
use krilla::error::KrillaError;
use krilla::geom::Size;
use krilla::metadata::Metadata;
use krilla::page::PageSettings;
use krilla::{Document, SerializeSettings};
use krilla_svg::{SurfaceExt, SvgSettings};
use std::sync::{Arc, LazyLock};
use usvg::fontdb;

use super::png::{BOLD, PLAIN};
use crate::report::error::ReportError;

// krilla stands on an older usvg than the pictures do, with a database of its own
static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(PLAIN.to_vec());
    fonts.load_font_data(BOLD.to_vec());
    Arc::new(fonts)
});

/// A PDF file with a page for each SVG sheet, as large as the sheet. The same bytes for the same sheets. It is PDF/A-2b,
/// but where a letter is missing in the font: archives refuse such a file, people can read the rest of it.
///
/// # Errors
/// If an SVG cannot be read or drawn.
pub fn pdf(title: &str, sheets: &[&str]) -> Result<Vec<u8>, ReportError> {
    let bad = |what: String| ReportError::Drawing { what };
    let options = usvg::Options {
        fontdb: FONTS.clone(),
        font_family: "DejaVu Sans".into(),
        // PDF's unit is a point, 1/72 inch
        dpi: 72.0,
        ..usvg::Options::default()
    };
    let trees: Result<Vec<_>, _> = sheets.iter().map(|svg| usvg::Tree::from_str(svg, &options)).collect();
    let trees = trees.map_err(|e| bad(e.to_string()))?;
    let file = match drawn(title, &trees, true) {
        Err(KrillaError::Validation(_)) => drawn(title, &trees, false),
        file => file,
    };
    file.map_err(|e| bad(format!("{e:?}")))
}

fn drawn(title: &str, trees: &[usvg::Tree], archival: bool) -> Result<Vec<u8>, KrillaError> {
    let configuration = match archival {
        true => ConfigurationBuilder::new().with_archival_validator(Archival::A2_B),
        false => ConfigurationBuilder::new(),
    };
    let configuration = configuration.finish().unwrap_or_default();
    let mut file = Document::new_with(SerializeSettings { configuration, ..SerializeSettings::default() });
    for tree in trees {
        let Some(size) = Size::from_wh(tree.size().width(), tree.size().height()) else { continue };
        let mut page = file.start_page_with(PageSettings::new(size));
        let mut surface = page.surface();
        surface.draw_svg(tree, size, SvgSettings::default());
        surface.finish();
        page.finish();
    }
    let metadata = Metadata::new().title(title.to_owned()).creator("clerestory".to_owned());
    file.set_metadata(metadata.language("en".to_owned()));
    file.finish()
}
