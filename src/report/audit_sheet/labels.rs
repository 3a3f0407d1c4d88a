//! Labels that would lie on each other are moved beside their places.

use std::f64::consts::TAU;

use crate::report::Point;

/// Where labels of a width `wide` go that want to stand at places in a rectangle `[x, y, width, height]`: each at the
/// nearest free place around its own, the first ones first; at its own where the rectangle is full.
pub(super) fn apart(wanted: &[Point], wide: f64, [x, y, width, height]: [f64; 4]) -> Vec<Point> {
    /// Circles that are tried, half a width apart, and places on each.
    const CIRCLES: [u32; 2] = [12, 16];
    let half = 0.5 * wide;
    let mut placed: Vec<Point> = Vec::with_capacity(wanted.len());
    for &[u, v] in wanted {
        let own = [u.clamp(x + half, x + width - half), v.clamp(y + half, y + height - half)];
        let around = (0..=CIRCLES[0]).flat_map(|circle| {
            let places = if circle == 0 { 1 } else { CIRCLES[1] };
            (0..places).map(move |i| {
                let (sin, cos) = (TAU * f64::from(i) / f64::from(places)).sin_cos();
                let far = half * f64::from(circle);
                [own[0] + far * cos, own[1] + far * sin]
            })
        });
        let inside =
            |p: &Point| (x + half..=x + width - half).contains(&p[0]) && (y + half..=y + height - half).contains(&p[1]);
        let free = |p: &Point| placed.iter().all(|q| (p[0] - q[0]).hypot(p[1] - q[1]) >= wide);
        placed.push(around.filter(inside).find(free).unwrap_or(own));
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_that_want_one_place_stand_beside_each_other_within_their_frame() {
        let frame = [10.0, 20.0, 60.0, 40.0];
        // nine at a corner, and one that nothing hinders
        let mut wanted = vec![[10.0, 60.0]; 9];
        wanted.push([50.0, 30.0]);
        let placed = apart(&wanted, 5.0, frame);
        for (i, p) in placed.iter().enumerate() {
            assert!((12.5..=67.5).contains(&p[0]) && (22.5..=57.5).contains(&p[1]), "{p:?}");
            assert!(placed[..i].iter().all(|q| (p[0] - q[0]).hypot(p[1] - q[1]) >= 5.0), "{p:?}");
        }
        assert_eq!((placed[0], placed[9]), ([12.5, 57.5], [50.0, 30.0]));
    }
}
