//! Labels that would lie on each other are moved beside their places, or left out.

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

/// Where the middles of names of these widths and one height go beside the first of some marks of a radius: below, above, right or left of
/// each, as far as they are free of each other and of all marks within a rectangle `[x, y, width, height]`; `None` where no side is.
pub(super) fn beside(
    marks: &[Point],
    widths: &[f64],
    height: f64,
    radius: f64,
    [x, y, w, h]: [f64; 4],
) -> Vec<Option<Point>> {
    // its middle and half of its sides
    type Room = (Point, [f64; 2]);
    let meet = |(p, a): &Room, (q, b): &Room| (0..2).all(|k| (p[k] - q[k]).abs() < a[k] + b[k]);
    let mut taken: Vec<Room> = marks.iter().map(|p| (*p, [radius; 2])).collect();
    let mut place = |(own, (&[u, v], width)): (usize, (&Point, &f64))| {
        let half = [0.5 * width, 0.5 * height];
        let [across, down] = half.map(|side| side + radius);
        let free = |p: &Point| {
            let inside =
                (x + half[0]..=x + w - half[0]).contains(&p[0]) && (y + half[1]..=y + h - half[1]).contains(&p[1]);
            inside && !taken.iter().enumerate().any(|(k, other)| k != own && meet(&(*p, half), other))
        };
        let found = [[u, v + down], [u, v - down], [u + across, v], [u - across, v]].into_iter().find(free);
        taken.extend(found.map(|p| (p, half)));
        found
    };
    marks.iter().zip(widths).enumerate().map(&mut place).collect()
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

    #[test]
    fn names_stand_beside_their_marks_and_not_on_others() {
        let frame = [0.0, 0.0, 100.0, 50.0];
        let names = |marks: &[Point]| beside(marks, &vec![8.0; marks.len()], 2.5, 1.5, frame);
        assert_eq!(names(&[[50.0, 20.0]]), [Some([50.0, 22.75])]);
        // at the frame's lower end it stands above
        assert_eq!(names(&[[50.0, 48.0]]), [Some([50.0, 45.25])]);
        // one mark below another, and one between two
        assert_eq!(names(&[[50.0, 20.0], [50.0, 23.0]]), [Some([50.0, 17.25]), Some([50.0, 25.75])]);
        let row: Vec<Point> = (0..12).map(|k| [20.0 + 2.0 * f64::from(k), 20.0]).collect();
        let placed: Vec<Point> = names(&row).into_iter().flatten().collect();
        assert!((5..12).contains(&placed.len()), "{placed:?}");
        for (i, p) in placed.iter().enumerate() {
            assert!(placed[..i].iter().all(|q| (p[0] - q[0]).abs() >= 8.0 || (p[1] - q[1]).abs() >= 2.5), "{placed:?}");
        }
    }
}
