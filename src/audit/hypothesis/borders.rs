//! Whether the photograph shows a region's borders: paint ends where its piece does, and light goes on.
//!
//! At a right piece's borders the photograph steps as the model's albedo does; where it goes on instead, the model's paint is not in
//! the room, be it another picture, another colour or another brightness. The borders of all that is mapped in one piece are looked
//! at together, so that faint paint is told, too.

use glam::{Vec2, Vec3};

use crate::audit::likelihood::agreement::USUAL;
use crate::audit::likelihood::step::{BESIDE, Place, border};
use crate::audit::picture::colour::{chroma, colour_of};
use crate::audit::picture::regions::mask_of;
use crate::audit::picture::{FEWEST, student};
use crate::audit::view::Observations;
use crate::statistics::median;

/// A pixel on either side of a border between materials, the inner one first.
type Across = [usize; 2];

impl Observations {
    /// Logarithm of how much likelier it is that the photograph goes on over a region's borders than that it shows the model's,
    /// times the share of the borders that tell: on one flat surface with a greater piece, which is what this one
    /// lies in. NaN where too few do. All along a border the same may be off about paint or light, so that its places count as one.
    pub(crate) fn no_border(&self, all: &[Across]) -> f32 {
        let segments = &self.surfaces.segments;
        let size = |i: usize| segments.pixels[segments.of[i] as usize].len();
        let telling = all.iter().filter(|a| self.are_on_one_surface(a) && size(a[1]) > size(a[0]));
        let odds: Vec<f32> = telling.map(|across| odds(self.steps(across))).collect();
        let told = odds.len() as f32 / all.len() as f32;
        if odds.len() < FEWEST { f32::NAN } else { told * median(odds).unwrap_or(f32::NAN) }
    }

    /// ΔE00, brightness apart, of the change of colour that the albedo lacks at a region's outline, in whatever planes; what light
    /// alone has made, such as the glow beside a sunlit cloth, makes no step there. `None` where too few are known.
    pub(crate) fn colour_step(&self, all: &[Across]) -> Option<f32> {
        let ratio = &self.texture.ratio;
        let tested = all.iter().filter(|[i, j]| self.tested(*i, *j));
        let steps: Vec<Vec2> = tested.map(|[i, j]| chroma(ratio[*i] - ratio[*j])).collect();
        let middle = |of: fn(&Vec2) -> f32| median(steps.iter().map(of)).unwrap_or(0.0);
        (steps.len() >= FEWEST).then(|| colour_of(Vec2::new(middle(|c| c.x), middle(|c| c.y))))
    }

    /// Whether the photograph shows an outline of some pixels that the model lacks, on a surface that goes on in the model: over half of
    /// its places it steps otherwise than the model does, by more than the model steps at all. What is not the model's there is a thing of
    /// its own, and no other paint.
    pub(crate) fn outlined(&self, pixels: &[usize]) -> bool {
        let all = self.across(pixels, |_| true);
        is_own_outline(&self.on_one_surface(&all).collect::<Vec<_>>())
    }

    /// How unlikely it is that what the photograph steps by at the outline of some pixels is what the model steps by, on surfaces that go on
    /// in the model: the negative logarithm over half of what tells, above what it is within pieces, times the share of the outline that tells;
    /// 0 where too little does.
    pub(crate) fn own_outline(&self, pixels: &[usize]) -> f32 {
        let all = self.across(pixels, |_| true);
        let told: Vec<f32> =
            self.on_one_surface(&all).map(|[model, photo]| unlikeliness((photo - model).length_squared())).collect();
        let share = told.len() as f32 / all.len() as f32;
        let usual = unlikeliness(USUAL);
        if told.len() < FEWEST { 0.0 } else { share * (median(told).unwrap_or(usual) - usual) }
    }

    /// Places on some pixels' borders with other materials that meet them.
    pub(crate) fn borders(&self, pixels: &[usize]) -> Vec<Across> {
        let s = &self.surfaces;
        let ends = |p: &Place| s.material[p.last] != s.material[p.next];
        // a frame may lie between: whatever is beyond the border tells
        self.across(pixels, |p| ends(p) && self.meet(p))
    }

    fn meet(&self, place: &Place) -> bool {
        let distance = &self.surfaces.distance;
        (distance[place.last] / distance[place.next] - 1.0).abs() < BESIDE
    }

    /// Places on some pixels' outline where surfaces meet or go on.
    pub(crate) fn outline(&self, pixels: &[usize]) -> Vec<Across> {
        self.across(pixels, |p| self.meet(p))
    }

    /// Places on some pixels' borders that have what is asked for.
    fn across(&self, pixels: &[usize], asked: impl Fn(&Place) -> bool) -> Vec<Across> {
        let s = &self.surfaces;
        let mask = mask_of(pixels, self.albedo.len());
        let inside = |i: usize| mask[i];
        let places = border([s.width, s.height], pixels, &inside).filter(asked);
        places.filter_map(|p| Some([p.own?, p.other?])).collect()
    }

    /// What the model's albedo steps by at a place, and what the photograph shows, in units of what that differs by within pieces.
    fn steps(&self, &[i, j]: &Across) -> [Vec3; 2] {
        let t = &self.texture;
        let model = t.unit * (t.paint[i] - t.paint[j]);
        [model, model + t.unit * (t.ratio[i] - t.ratio[j])]
    }

    fn tested(&self, i: usize, j: usize) -> bool {
        self.texture.tested[i] && self.texture.tested[j]
    }

    fn are_on_one_surface(&self, &[i, j]: &Across) -> bool {
        self.tested(i, j) && self.surfaces.coplanar(i, j)
    }

    /// The steps at those places where one surface goes on.
    fn on_one_surface<'a>(&'a self, all: &'a [Across]) -> impl Iterator<Item = [Vec3; 2]> + 'a {
        all.iter().filter(|across| self.are_on_one_surface(across)).map(|across| self.steps(across))
    }
}

/// Whether over half of some places, and not too few, what the photograph steps by is farther from the model's step than no step is.
fn is_own_outline(steps: &[[Vec3; 2]]) -> bool {
    let own = |[model, photo]: &&[Vec3; 2]| photo.distance(*model) > model.length();
    steps.len() >= FEWEST && 2 * steps.iter().filter(own).count() > steps.len()
}

/// Logarithm of how much likelier the photograph goes on than steps as the model does.
pub(crate) fn odds([model, photo]: [Vec3; 2]) -> f32 {
    unlikeliness((photo - model).length_squared()) - unlikeliness(photo.length_squared())
}

/// How unlikely what is off about a step is, given its squared length in three channels.
fn unlikeliness(squared: f32) -> f32 {
    student::unlikeliness(squared.into(), 3.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thing_has_an_outline_that_the_model_lacks_and_paint_has_the_models() {
        let (plaster, frame) = (Vec3::new(0.2, 0.1, 0.0), Vec3::new(3.0, 2.0, 1.0));
        let steps = |own: usize, of_model: usize| -> Vec<[Vec3; 2]> {
            let own = std::iter::repeat_n([plaster, frame], own);
            own.chain(std::iter::repeat_n([frame, 1.5 * frame], of_model)).collect()
        };
        assert!(is_own_outline(&steps(FEWEST, 0)) && is_own_outline(&steps(31, 30)));
        assert!(!is_own_outline(&steps(0, 60)) && !is_own_outline(&steps(30, 30)));
        assert!(!is_own_outline(&steps(FEWEST - 1, 0)), "too few to tell");
    }

    #[test]
    fn a_step_that_is_not_there_is_likelier_the_farther_it_stands_out() {
        let model = Vec3::new(2.0, 1.0, 0.5);
        assert!(odds([model, model]) < -1.0 && odds([model, Vec3::ZERO]) > 1.0);
        assert_eq!(odds([model, 0.5 * model]), 0.0);
        assert!(odds([2.0 * model, Vec3::ZERO]) > odds([model, Vec3::ZERO]));
        // a model without a step says nothing
        assert_eq!(odds([Vec3::ZERO, model]), 0.0);
    }
}
