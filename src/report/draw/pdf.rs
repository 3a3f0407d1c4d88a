//! PDF of sheets, drawn by krilla from the very SVG that is shipped: lines stay lines, the one font that is shipped is
//! embedded, and archives take the report's (PDF/A-2b, ISO 19005-2).

use krilla::configure::{Archival, ConfigurationBuilder};
use krilla::error::KrillaError;
use krilla::geom::Size;
use krilla::metadata::{DateTime, Metadata};
use krilla::page::PageSettings;
use krilla::{Document, SerializeSettings};
use krilla_svg::{SurfaceExt, SvgSettings};
use resvg::usvg;

use super::png::options;
use crate::report::error::ReportError;

/// A PDF file with a page for each SVG sheet, as large as the sheet. The same bytes for the same sheets and time. With the
/// time when it was made (`YYYY-MM-DDThh:mm:ssZ`), which archives ask for, it is PDF/A-2b, unless a sheet breaks one of that
/// standard's rules: archives refuse such a file, people can read it.
///
/// # Errors
/// If an SVG cannot be read or drawn.
pub fn pdf(title: &str, sheets: &[&str], made: Option<&str>) -> Result<Vec<u8>, ReportError> {
    let bad = |what: String| ReportError::Drawing { what };
    let options = options(72.0); // PDF's unit is a point, 1/72 inch
    let trees: Result<Vec<_>, _> = sheets.iter().map(|svg| usvg::Tree::from_str(svg, &options)).collect();
    let trees = trees.map_err(|e| bad(e.to_string()))?;
    let metadata = Metadata::new().title(title.to_owned()).creator("clerestory".to_owned()).language("en".to_owned());
    let file = match made.and_then(date) {
        Some(date) => match drawn(&trees, metadata.clone().creation_date(date), true) {
            Err(KrillaError::Validation(_)) => drawn(&trees, metadata, false),
            file => file,
        },
        None => drawn(&trees, metadata, false),
    };
    file.map_err(|e| bad(format!("{e:?}")))
}

/// A time in Greenwich, `YYYY-MM-DDThh:mm:ssZ`.
fn date(text: &str) -> Option<DateTime> {
    let numbers: Vec<u16> = text.split(['-', 'T', ':', 'Z']).map_while(|n| n.parse().ok()).collect();
    let &[year, month, day, hour, minute, second] = numbers.as_slice() else { return None };
    let date = DateTime::new(year).month(month as u8).day(day as u8).hour(hour as u8).minute(minute as u8);
    Some(date.second(second as u8).utc_offset_hour(0).utc_offset_minute(0))
}

fn drawn(trees: &[usvg::Tree], metadata: Metadata, archival: bool) -> Result<Vec<u8>, KrillaError> {
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
    file.set_metadata(metadata);
    file.finish()
}
