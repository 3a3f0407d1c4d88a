//! What the page shows: the verbs' own results.

use crate::audit::Audit;
use crate::check::Check;
use crate::plan::export::tables::PlanJson;
use crate::report::manifest::{Fingerprint, Run};
use crate::report::rendered::Rendered;
use crate::site::Project;
use crate::study::Summary;

/// All that a page shows; what was not done is `None`.
#[derive(Default)]
pub struct Archive {
    /// The site's name.
    pub site: String,
    /// What the site file says of the work.
    pub project: Project,
    /// The files' health.
    pub check: Option<Check>,
    /// Where to put the tripod.
    pub plan: Option<PlanJson>,
    /// How views were rendered.
    pub render: Option<Rendered>,
    /// Pictures of each view that stand beside each other.
    pub views: Vec<ViewPictures>,
    /// What the photographs say.
    pub audit: Option<Audit>,
    /// Error against run time.
    pub study: Option<Summary>,
    /// The viewer's file beside the page.
    pub viewer: Option<String>,
    /// The verbs that were run, in order.
    pub runs: Vec<Run>,
    /// Whether all sheets are in `report.pdf`, too.
    pub sheets_pdf: bool,
    /// Every file that was read.
    pub inputs: Vec<Fingerprint>,
}

/// The pictures of a view, by file name in the report's folder, all of the same size and exposure.
#[derive(Clone, Debug, Default)]
pub struct ViewPictures {
    /// The view's name.
    pub name: String,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// The photograph.
    pub photo: Option<String>,
    /// The relit view.
    pub render: String,
    /// The photograph with what the audit found marked on it.
    pub findings: Option<String>,
    /// Stem of the audit's sheet.
    pub sheet: Option<String>,
}
