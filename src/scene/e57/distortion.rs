//! Lens distortion of pinhole pictures, which E57 itself has none of: the extension `dist` that Leica's programs write, with
//! OpenCV's names (`CV_K1` … `CV_HEIGHT`).

use glam::DVec2;

/// The extension's namespace.
const NAMESPACE: &str = "http://www.libe57.org/E57_LEICA_Camera_Distortion.txt";

/// A lens as the extension has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Calibrated {
    /// Focal lengths in pixels.
    pub(super) focal: DVec2,
    /// Principal point from the top-left corner, pixels.
    pub(super) centre: DVec2,
    /// k1, k2, k3, p1, p2.
    pub(super) distortion: [f64; 5],
    /// Whether it has the terms of a denominator, k4 to k6.
    pub(super) rational: bool,
    /// Width and height that the lengths belong to, where the file says them.
    pub(super) size: Option<[u32; 2]>,
}

/// The lens of each picture of a file, in its order; `None` where it has none. Empty where the XML cannot be read.
pub(super) fn distortions(xml: &str) -> Vec<Option<Calibrated>> {
    let Ok(document) = roxmltree::Document::parse(xml) else { return Vec::new() };
    let named = |name: &'static str| move |node: &roxmltree::Node| node.tag_name().name() == name;
    let Some(images) = document.root_element().children().find(named("images2D")) else { return Vec::new() };
    images
        .children()
        .filter(named("vectorChild"))
        .map(|image| image.children().find(|n| n.has_tag_name((NAMESPACE, "distortion"))).and_then(|d| calibrated(&d)))
        .collect()
}

/// `None` without a focal length: then the picture's own projection holds.
fn calibrated(node: &roxmltree::Node) -> Option<Calibrated> {
    // a number without text is 0, as everywhere in E57
    let number = |name: &str| {
        let text = node.children().find(|n| n.has_tag_name((NAMESPACE, name))).and_then(|n| n.text());
        text.and_then(|t| t.trim().parse::<f64>().ok()).unwrap_or(0.0)
    };
    let focal = DVec2::new(number("CV_FX"), number("CV_FY"));
    let size = [number("CV_WIDTH"), number("CV_HEIGHT")];
    (focal.min_element() > 0.0).then(|| Calibrated {
        focal,
        // OpenCV counts from the middle of the first pixel
        centre: DVec2::new(number("CV_CX"), number("CV_CY")) + 0.5,
        distortion: ["CV_K1", "CV_K2", "CV_K3", "CV_P1", "CV_P2"].map(number),
        rational: ["CV_K4", "CV_K5", "CV_K6"].map(number) != [0.0; 3],
        size: size.iter().all(|v| (1.0..=1e6).contains(v)).then(|| size.map(|v| v as u32)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_is_read_where_there_is_one() {
        let image = |inside: &str| format!("<vectorChild>{inside}</vectorChild>");
        let full = "<d:distortion><d:CV_K1>-0.1</d:CV_K1><d:CV_K2>.02</d:CV_K2><d:CV_P1> 1e-3 </d:CV_P1><d:CV_CX>319.5</d:CV_CX>\
                    <d:CV_CY>239.5</d:CV_CY><d:CV_FX>500</d:CV_FX><d:CV_FY>501</d:CV_FY><d:CV_WIDTH>640</d:CV_WIDTH>\
                    <d:CV_HEIGHT>480</d:CV_HEIGHT></d:distortion>";
        let empty = "<d:distortion><d:CV_K1>1</d:CV_K1><d:CV_FX/></d:distortion>";
        let xml = format!(
            "<e57Root xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\" xmlns:d=\"{NAMESPACE}\"><images2D>{}{}{}</images2D></e57Root>",
            image(full),
            image(empty),
            image("")
        );
        let found = distortions(&xml);
        let lens = Calibrated {
            focal: DVec2::new(500.0, 501.0),
            centre: DVec2::new(320.0, 240.0),
            distortion: [-0.1, 0.02, 0.0, 1e-3, 0.0],
            rational: false,
            size: Some([640, 480]),
        };
        assert_eq!(found, [Some(lens), None, None]);
        assert!(distortions("<e57Root").is_empty() && distortions("<e57Root/>").is_empty());
    }
}
