//! Why a site cannot be planned.

use super::free_space::polygon::PolygonError;

/// Why no plan was made; each says what to change.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Nothing can be walked on.
    #[error(
        "no floor found: the model has no level surface of some size with {headroom_m:.1} m of free height above it; \
         check site.up and site.units, lower plan.probe_height, or model the floor"
    )]
    NoFloor {
        /// Free height asked for.
        headroom_m: f32,
    },
    /// Level surfaces, but none enclosed.
    #[error(
        "no floor found indoors, the model is open: its {area_m2:.0} m² of level surface have no walls around them (a \
         roof, terrain, or a floor without walls); model floor and walls, or check site.up and site.units"
    )]
    OpenModel {
        /// Level surface found.
        area_m2: f64,
    },
    /// Floors, but no place on them.
    #[error("no place for a tripod on any of {floors} floors: {}", no_place(*clearance_m, *widest_m))]
    NoPlace {
        /// Floors found.
        floors: usize,
        /// Clearance asked for.
        clearance_m: f64,
        /// The greatest clearance there is, kept out or not.
        widest_m: f64,
    },
    /// A fixed place where nothing can stand.
    #[error(
        "plan.fixed: no tripod can stand at [{}, {}]; the nearest free place is [{}, {}] on the {floor}",
        at[0], at[1], free[0], free[1]
    )]
    FixedBlocked {
        /// The place, in the model's horizontal axes and units.
        at: [f64; 2],
        /// A place near it that is free.
        free: [f64; 2],
        /// Its floor.
        floor: String,
    },
    /// More fixed places than stations.
    #[error(
        "plan.fixed names {fixed} places, but at most {most} stations are allowed; raise plan.max_probes or fix fewer"
    )]
    TooManyFixed {
        /// Fixed places.
        fixed: usize,
        /// Most stations.
        most: u32,
    },
    /// A floor's name that is not there.
    #[error("there is no floor “{name}”; the model has: {known}")]
    UnknownFloor {
        /// The name.
        name: String,
        /// The floors.
        known: String,
    },
    /// An outline that is no polygon.
    #[error("the {floor}'s outline cannot be used: {source}")]
    Outline {
        /// The floor.
        floor: String,
        /// Why.
        source: PolygonError,
    },
}

/// Why no tripod can stand on a floor, given its greatest clearance.
pub(super) fn no_place(clearance_m: f64, widest_m: f64) -> String {
    if widest_m < clearance_m {
        format!(
            "with plan.clearance = {clearance_m} nothing is left, since the widest place is {widest_m:.2} m from its \
             nearest obstacle; lower plan.clearance"
        )
    } else {
        "there is room, but all of it is kept out or not level where a tripod's legs stand; check plan.keep_out and \
         the floor"
            .to_owned()
    }
}
