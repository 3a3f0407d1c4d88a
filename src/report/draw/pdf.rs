//! PDF of sheets, drawn by svg2pdf from the very SVG that is shipped: lines stay lines, and the one font that is shipped is
//! embedded.

use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, TextStr};
use std::collections::HashMap;
use std::sync::{Arc, LazyLock};
use svg2pdf::usvg::{self, fontdb};
use svg2pdf::{ConversionOptions, to_chunk};

use super::png::{BOLD, PLAIN};
use crate::report::error::ReportError;

// svg2pdf stands on an older usvg than the pictures do, with a database of its own
static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(PLAIN.to_vec());
    fonts.load_font_data(BOLD.to_vec());
    Arc::new(fonts)
});

/// A PDF file with a page for each SVG sheet, as large as the sheet. The same bytes for the same sheets.
///
/// # Errors
/// If an SVG cannot be read or drawn.
pub fn pdf(title: &str, sheets: &[&str]) -> Result<Vec<u8>, ReportError> {
    /// PDF's unit is a point, 1/72 inch.
    const DPI: f32 = 72.0;
    let bad = |what: String| ReportError::Drawing { what };
    let options = usvg::Options {
        fontdb: FONTS.clone(),
        font_family: "DejaVu Sans".into(),
        dpi: DPI,
        ..usvg::Options::default()
    };
    let mut last = Ref::new(1);
    let mut next = || {
        last = last.next();
        last
    };
    let (catalogue, pages) = (next(), next());
    let mut file = Pdf::new();
    let mut kids = Vec::new();
    for svg in sheets {
        let tree = usvg::Tree::from_str(svg, &options).map_err(|e| bad(e.to_string()))?;
        let (width, height) = (tree.size().width(), tree.size().height());
        let (chunk, drawing) = to_chunk(&tree, ConversionOptions::default()).map_err(|e| bad(e.to_string()))?;
        // each drawing counts its parts from 1
        let mut own: HashMap<Ref, Ref> = HashMap::new();
        let chunk = chunk.renumber(|old| *own.entry(old).or_insert_with(&mut next));
        let Some(drawing) = own.get(&drawing).copied() else { return Err(bad("a sheet came out empty".to_owned())) };
        let (page, content) = (next(), next());
        kids.push(page);
        file.extend(&chunk);
        let mut put = Content::new();
        // a drawing is one unit wide and high
        put.transform([width, 0.0, 0.0, height, 0.0, 0.0]);
        put.x_object(Name(b"S"));
        file.stream(content, &put.finish());
        let mut page = file.page(page);
        page.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(content);
        page.resources().x_objects().pair(Name(b"S"), drawing);
        page.finish();
    }
    file.catalog(catalogue).pages(pages);
    file.pages(pages).count(kids.len() as i32).kids(kids);
    let info = next();
    file.document_info(info).title(TextStr(title)).creator(TextStr("clerestory"));
    Ok(file.finish())
}
