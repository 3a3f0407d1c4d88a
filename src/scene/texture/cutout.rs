//! Leaves and grilles that are drawn as cut-out pictures: what their alpha hides is cut out of the triangles, so that
//! everything that asks the geometry sees the holes.

use glam::Vec2;
use std::collections::BTreeMap;

use super::{Texture, Wrap};
use crate::scene::Mesh;
use crate::scene::model::{Channel, Cutout};

/// Pieces that all cut-outs of a model may become; past that, a triangle is kept or left out whole.
const MOST_PIECES: usize = 2_000_000;

/// Which texels of a picture are there, with sums over rectangles from the top left corner.
pub(in crate::scene) struct Mask {
    width: usize,
    height: usize,
    wrap: [Wrap; 2],
    /// Texels that are there above and left of each corner; `width + 1` numbers a row.
    sums: Vec<u32>,
}

/// How much of a rectangle of texels is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Share {
    None,
    Some,
    All,
}

impl Mask {
    /// The texels whose opacity times the factor is at least the cutoff, as glTF's alpha mode MASK has it.
    pub(in crate::scene) fn of(texture: &Texture, &Cutout { channel, factor, cutoff, .. }: &Cutout) -> Self {
        let (width, height) = texture.size();
        let by_alpha = match channel {
            Channel::Alpha => true,
            Channel::Grey => false,
            Channel::Either => (0..width * height).any(|i| texture.alpha(i % width, i / width) < 1.0),
        };
        let opacity = |x, y| if by_alpha { texture.alpha(x, y) } else { texture.brightness(x, y) };
        let mut sums = vec![0u32; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0;
            for x in 0..width {
                row += u32::from(opacity(x, y) * factor >= cutoff);
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Self { width, height, wrap: texture.wrap(), sums }
    }

    /// Texture coordinates in texels from the top left corner.
    fn place(&self, uv: Vec2) -> Vec2 {
        Vec2::new(uv.x * self.width as f32, (1.0 - uv.y) * self.height as f32)
    }

    /// What is there between two places.
    fn share(&self, low: Vec2, high: Vec2) -> Share {
        let low = low.floor().as_ivec2();
        // a texel that is only touched does not count
        let high = (high.ceil() - 1.0).as_ivec2().max(low);
        let [x0, x1] = self.wrap[0].span(low.x, high.x, self.width);
        let [y0, y1] = self.wrap[1].span(low.y, high.y, self.height);
        let sum = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        let there = (sum(x1 + 1, y1 + 1) + sum(x0, y0)) - (sum(x0, y1 + 1) + sum(x1 + 1, y0));
        match there as usize {
            0 => Share::None,
            n if n == (x1 + 1 - x0) * (y1 + 1 - y0) => Share::All,
            _ => Share::Some,
        }
    }

    fn is_there(&self, place: Vec2) -> bool {
        self.share(place, place) == Share::All
    }
}

/// Cuts what masks hide out of a mesh; `masks` are one a material. Gives how many triangles were touched.
///
/// A triangle is halved across its longest side in the picture until a piece is wholly there or wholly not, or is as small
/// as a texel, where its middle decides; halves that are both there are one again.
pub(in crate::scene) fn cut(mesh: &mut Mesh, masks: &[Option<Mask>]) -> usize {
    let (triangles, materials) = (std::mem::take(&mut mesh.triangles), std::mem::take(&mut mesh.materials));
    let mut cutter = Cutter { middles: BTreeMap::new(), pieces: Vec::new(), left: MOST_PIECES, mesh };
    let mut touched = 0;
    for (triangle, material) in triangles.into_iter().zip(materials) {
        let mask = masks.get(material as usize).and_then(Option::as_ref);
        let mapped = |mesh: &Mesh| triangle.iter().all(|i| mesh.uvs.get(*i as usize).is_some_and(|uv| uv.is_finite()));
        let share = match mask {
            Some(mask) if mapped(cutter.mesh) => cutter.pieces_of(mask, triangle),
            _ => Share::All,
        };
        touched += usize::from(share != Share::All);
        if share == Share::All {
            cutter.pieces.push(triangle);
        }
        cutter.mesh.triangles.append(&mut cutter.pieces);
        let count = cutter.mesh.triangles.len();
        cutter.mesh.materials.resize(count, material);
    }
    touched
}

struct Cutter<'a> {
    /// The vertex between two others.
    middles: BTreeMap<[u32; 2], u32>,
    /// What is there of the triangle at hand.
    pieces: Vec<[u32; 3]>,
    left: usize,
    mesh: &'a mut Mesh,
}

impl Cutter<'_> {
    /// What is there of a triangle; of one that is there in part, the pieces are kept.
    fn pieces_of(&mut self, mask: &Mask, triangle: [u32; 3]) -> Share {
        let [a, b, c] = triangle.map(|i| mask.place(self.mesh.uvs[i as usize]));
        let share = mask.share(a.min(b).min(c), a.max(b).max(c));
        if share != Share::Some {
            return share;
        }
        let sides = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
        let longest = (1..3).fold(0, |best, k| if sides[k] > sides[best] { k } else { best });
        if sides[longest] <= 1.0 || self.left == 0 {
            return if mask.is_there((a + b + c) / 3.0) { Share::All } else { Share::None };
        }
        self.left -= 1;
        let [p, q, r] = [0, 1, 2].map(|k| triangle[(longest + k) % 3]);
        let middle = self.middle(p, q);
        let halves = [[p, middle, r], [middle, q, r]];
        let shares = halves.map(|half| self.pieces_of(mask, half));
        match shares {
            [Share::All, Share::All] => Share::All,
            [Share::None, Share::None] => Share::None,
            _ => {
                let whole = halves.iter().zip(shares).filter(|(_, share)| *share == Share::All);
                self.pieces.extend(whole.map(|(half, _)| *half));
                Share::Some
            }
        }
    }

    /// The vertex in the middle between two, made where it is not there yet.
    fn middle(&mut self, p: u32, q: u32) -> u32 {
        let mesh = &mut *self.mesh;
        *self.middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
            let (p, q) = (p as usize, q as usize);
            mesh.positions.push((mesh.positions[p] + mesh.positions[q]) * 0.5);
            mesh.uvs.push((mesh.uvs[p] + mesh.uvs[q]) * 0.5);
            if !mesh.colours.is_empty() {
                mesh.colours.push((mesh.colours[p] + mesh.colours[q]) * 0.5);
            }
            mesh.positions.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn cutout(channel: Channel) -> Cutout {
        Cutout { map: None, channel, factor: 1.0, cutoff: 0.5 }
    }

    /// A square of 1 m under a picture of 32 × 32 texels, and what is there of it, m².
    fn left_of(there: impl Fn(f32, f32) -> bool) -> (Mesh, f32) {
        let n = 32;
        let texel = |i: usize| {
            let (x, y) = ((i % n) as f32 + 0.5, (i / n) as f32 + 0.5);
            [200, 200, 200, if there(x / n as f32, 1.0 - y / n as f32) { 255 } else { 0 }]
        };
        let texture = Texture::new("leaf".to_owned(), n, n, (0..n * n).map(texel).collect());
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let mut mesh = Mesh {
            positions: corners.map(|p| p.extend(0.0)).to_vec(),
            uvs: corners.to_vec(),
            colours: vec![Vec3::ONE; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![0, 0],
        };
        cut(&mut mesh, &[Some(Mask::of(&texture, &cutout(Channel::Alpha)))]);
        let area = (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum();
        (mesh, area)
    }

    #[test]
    fn alpha_tells_where_there_is_one_and_brightness_else() {
        let there = |texels: [[u8; 4]; 2], channel| {
            let mask = Mask::of(&Texture::new(String::new(), 2, 1, texels.to_vec()), &cutout(channel));
            [0.5, 1.5].map(|x| mask.is_there(Vec2::new(x, 0.5)))
        };
        let (leaf, drawn) = ([[0, 90, 0, 255], [200, 200, 200, 0]], [[0, 0, 0, 255], [255, 255, 255, 255]]);
        assert_eq!(there(leaf, Channel::Either), [true, false]);
        assert_eq!(there(drawn, Channel::Either), [false, true]);
        assert_eq!(there(leaf, Channel::Grey), [false, true]);
        assert_eq!(there(drawn, Channel::Alpha), [true, true]);
    }

    #[test]
    fn what_is_there_stays_and_what_is_not_goes() {
        let (mesh, area) = left_of(|_, _| true);
        assert_eq!((mesh.triangles, area), (vec![[0, 1, 2], [0, 2, 3]], 1.0), "nothing to cut leaves all as it was");
        assert_eq!(left_of(|_, _| false).1, 0.0);
        let (mesh, area) = left_of(|x, _| x < 0.5);
        assert!((area - 0.5).abs() < 1e-6, "{area}: along texels it is exact");
        assert!(mesh.triangles.iter().flatten().all(|i| mesh.uvs[*i as usize].x < 0.5 + 1.0 / 32.0));
        assert!(mesh.materials.len() == mesh.triangles.len() && mesh.colours.len() == mesh.positions.len());
        let disc = |x: f32, y: f32| Vec2::new(x - 0.5, y - 0.5).length() < 0.4;
        let (_, area) = left_of(disc);
        assert!((area / (std::f32::consts::PI * 0.16) - 1.0).abs() < 0.03, "{area}");
    }
}
