use super::pdf::pdf;
use super::png::{png, text_width, wrap};
use super::style::{BLACK, BLUE, Hatch, Pattern, Style, VERMILION};
use super::svg::{Svg, Text};

fn sheet() -> Svg {
    let mut svg = Svg::new(60.0, 40.0, "A <test>", "two hatches & a word");
    svg.group("areas", "areas", |svg| {
        let square = |x: f64| [[x, 5.0], [x + 20.0, 5.0], [x + 20.0, 25.0], [x, 25.0]];
        let hole = [[10.0, 10.0], [15.0, 10.0], [15.0, 15.0], [10.0, 15.0]];
        svg.area(&[&square(5.0), &hole], &Style::hatch(Hatch::new(Pattern::Lines(45), BLUE)).outlined(BLACK, 0.3));
        svg.area(&[square(30.0)], &Style::fill(VERMILION).opacity(0.5));
    });
    svg.text([5.0, 35.0], "Š – “5 m²”", &Text::new(4.0).bold().halo(0.4));
    svg
}

fn pixels(dpi: f32) -> image::RgbaImage {
    let bytes = png(&sheet().finish(), dpi).unwrap();
    image::load_from_memory(&bytes).unwrap().to_rgba8()
}

#[test]
fn a_sheet_is_well_formed_and_escaped() {
    let text = sheet().finish();
    let document = roxmltree::Document::parse(&text).unwrap();
    let title = document.descendants().find(|n| n.has_tag_name("title")).unwrap();
    assert_eq!(title.text(), Some("A <test>"));
}

#[test]
fn a_picture_has_the_sheets_size_and_colours() {
    let picture = pixels(254.0); // ten pixels a millimetre
    assert_eq!(picture.dimensions(), (600, 400));
    assert_eq!(picture.get_pixel(590, 10).0, [255, 255, 255, 255], "paper");
    let half = picture.get_pixel(400, 150).0;
    assert!(half[0] > 225 && (170..180).contains(&half[1]), "half of vermilion on white: {half:?}");
    let hole = (105..145).all(|x| picture.get_pixel(x, 125).0 == [255; 4]);
    assert!(hole, "the hole is left white by the even-odd rule");
    let hatched = (60..95).filter(|&x| picture.get_pixel(x, 150).0 != [255; 4]).count();
    assert!((3..30).contains(&hatched), "a hatch leaves paper between its lines: {hatched} of 35 pixels inked");
}

#[test]
fn letters_are_drawn_with_the_shipped_font() {
    let picture = pixels(254.0);
    let inked = |from: u32, to: u32| (from..to).any(|x| (300..360).any(|y| picture.get_pixel(x, y).0[0] < 100));
    assert!(inked(50, 80), "the first letter stands");
    let end = 50 + (10.0 * text_width("Š – “5 m²”", 4.0, true)) as u32;
    assert!(inked(end - 25, end) && !inked(end + 5, 600), "and the text ends where its width says");
}

#[test]
fn numbers_that_are_not_finite_leave_no_trace() {
    let mut svg = sheet();
    svg.circle([f64::NAN, f64::INFINITY], 3.0, &Style::line(BLACK, 0.2));
    let text = svg.finish();
    assert!(!text.contains("NaN") && !text.contains("inf"));
    png(&text, 50.0).unwrap();
}

#[test]
fn lines_wrap_at_spaces() {
    let lines = wrap("a surveyor plans where to put a probe", 25.0, 3.0, false);
    assert!(lines.len() > 1 && lines.iter().all(|l| text_width(l, 3.0, false) <= 25.0), "{lines:?}");
    assert_eq!(lines.join(" "), "a surveyor plans where to put a probe");
}

#[test]
fn a_pdf_has_a_page_as_large_as_each_sheet_and_is_the_same_each_time() {
    let sheet = |wide: f64| {
        let mut svg = Svg::new(wide, 100.0, "Šibenik", "a sheet");
        svg.text([10.0, 20.0], "plan · 5 m²", &Text::new(5.0).bold());
        svg.line([10.0, 30.0], [50.0, 30.0], &Style::line(BLACK, 0.3));
        svg.finish()
    };
    let (one, other) = (sheet(210.0), sheet(100.0));
    let made = Some("2026-11-23T02:03:04Z");
    let file = pdf("Šibenik", &[&one, &other], made).unwrap();
    assert!(file.starts_with(b"%PDF-") && file.ends_with(b"%%EOF"));
    let text = String::from_utf8_lossy(&file);
    assert_eq!(text.matches("/MediaBox").count(), 2);
    // 100 mm in points, a font that is there, and what makes it one for archives
    assert!(text.contains("283.46") && text.contains("/FontFile"), "{}", text.len());
    let archival = |file: &[u8]| String::from_utf8_lossy(file).contains("<pdfaid:part>2</pdfaid:part>");
    assert!(archival(&file) && text.contains("/OutputIntents"));
    let mut foreign = Svg::new(50.0, 50.0, "x", "y");
    foreign.text([5.0, 5.0], "\u{6f22}", &Text::new(5.0));
    assert!(!archival(&pdf("x", &[&foreign.finish()], made).unwrap()), "a letter is missing");
    assert_eq!(file, pdf("Šibenik", &[&one, &other], made).unwrap());
    assert!(pdf("x", &["<svg"], None).is_err());
}
