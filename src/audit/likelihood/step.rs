//! Steps of a picture over the borders of a region: what a picture differs by from one side to the other.

use glam::{Mat3, Vec3};

use crate::audit::likelihood::agreement::unit;

/// Pixels from a border that both its sides are looked at.
pub(crate) const ASIDE: usize = 4;

/// Surfaces meet at a border if the distances of the pixels on either side differ by less than this share.
pub(crate) const BESIDE: f32 = 0.05;

/// A place on a region's border.
pub(crate) struct Place {
    /// The last pixel inside and the first one outside.
    pub(crate) last: usize,
    pub(crate) next: usize,
    /// Those that are looked at, inside and outside, if there are.
    pub(crate) own: Option<usize>,
    pub(crate) other: Option<usize>,
}

/// The places on the border of a region's pixels; `inside` tells which these are.
pub(crate) fn border<'a>(
    [width, height]: [usize; 2],
    pixels: &'a [usize],
    inside: &'a impl Fn(usize) -> bool,
) -> impl Iterator<Item = Place> + 'a {
    let at = move |i: usize, (dx, dy): (isize, isize), steps: usize| {
        let x = (i % width).checked_add_signed(dx * steps as isize).filter(|x| *x < width)?;
        let y = (i / width).checked_add_signed(dy * steps as isize).filter(|y| *y < height)?;
        Some(y * width + x)
    };
    let place = move |last: usize, (dx, dy): (isize, isize)| {
        let next = at(last, (dx, dy), 1).filter(|j| !inside(*j))?;
        let own = at(last, (-dx, -dy), ASIDE).filter(|j| inside(*j));
        let other = at(next, (dx, dy), ASIDE).filter(|j| !inside(*j));
        Some(Place { last, next, own, other })
    };
    let directions = [(1, 0), (-1, 0), (0, 1), (0, -1)];
    pixels.iter().flat_map(move |&i| directions.into_iter().filter_map(move |along| place(i, along)))
}

/// What a picture differs by from some pixels to those as far to the right of and below them as the two that are looked at across a border
/// are apart; `alike` tells whether nothing ends between two pixels.
pub(crate) fn steps<'a>(
    width: usize,
    picture: &'a [Vec3],
    pixels: impl Iterator<Item = usize> + 'a,
    alike: impl Fn(usize, usize) -> bool + 'a,
) -> impl Iterator<Item = Vec3> + 'a {
    let far = 2 * ASIDE + 1;
    let beside = move |i: usize| {
        let right = (i % width + far < width).then_some(i + far);
        let below = Some(i + far * width).filter(|j| *j < picture.len());
        right.into_iter().chain(below).map(move |j| [i, j])
    };
    pixels.flat_map(beside).filter(move |[i, j]| alike(*i, *j)).map(|[i, j]| picture[i] - picture[j])
}

/// Makes steps of a picture of one size in all channels: half of those where nothing ends are shorter than half a unit a channel, squared.
pub(crate) fn usual(width: usize, picture: &[Vec3], alike: impl Fn(usize, usize) -> bool) -> Mat3 {
    unit(steps(width, picture, 0..picture.len(), alike).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_has_a_place_a_pixel_of_its_sides() {
        const SIDE: usize = 40;
        let inside = |i: usize| (10..30).contains(&(i % SIDE)) && (10..30).contains(&(i / SIDE));
        let pixels: Vec<usize> = (0..SIDE * SIDE).filter(|i| inside(*i)).collect();
        let all: Vec<Place> = border([SIDE, SIDE], &pixels, &inside).collect();
        assert_eq!(all.len(), 4 * 20);
        let aside = |p: &Place| inside(p.own.unwrap()) && !inside(p.other.unwrap());
        assert!(all.iter().all(|p| inside(p.last) && !inside(p.next) && aside(p)));
        // what ends with the picture has no border there
        let left = |i: usize| i % SIDE < 2;
        let pixels: Vec<usize> = (0..SIDE * SIDE).filter(|i| left(*i)).collect();
        let all: Vec<Place> = border([SIDE, SIDE], &pixels, &left).collect();
        assert!(all.len() == SIDE && all.iter().all(|p| p.own.is_none() && p.other.is_some()));
    }

    #[test]
    fn half_of_the_usual_steps_are_shorter_than_a_unit() {
        let picture: Vec<Vec3> =
            (0..90 * 30).map(|i| Vec3::new(0.3, 0.2, 0.01) * ((i * i) % 97) as f32 + (i % 7) as f32).collect();
        let unit = usual(90, &picture, |_, _| true);
        let all: Vec<Vec3> = steps(90, &picture, 0..picture.len(), |_, _| true).map(|step| unit * step).collect();
        assert_eq!(all.len(), 81 * 30 + 90 * 21);
        let shorter = all.iter().filter(|s| s.length_squared() < 1.5).count();
        assert!((0.45..0.55).contains(&(shorter as f64 / all.len() as f64)), "{shorter}");
    }
}
