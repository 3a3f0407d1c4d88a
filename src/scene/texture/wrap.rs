//! What a picture shows beyond its edge.

/// How a picture goes on along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// It begins anew.
    #[default]
    Repeat,
    /// Its last texel goes on.
    Clamp,
    /// It comes again mirrored.
    Mirror,
}

impl Wrap {
    /// The texel of `n` that stands at any place.
    #[inline]
    pub(super) fn texel(self, i: i32, n: usize) -> usize {
        // mostly it is there already
        if (i as usize) < n {
            return i as usize;
        }
        let last = n.saturating_sub(1);
        match self {
            Self::Repeat => i64::from(i).rem_euclid(n as i64) as usize,
            Self::Clamp => usize::try_from(i).unwrap_or(0).min(last),
            Self::Mirror => {
                let folded = i64::from(i).rem_euclid(2 * n as i64) as usize;
                if folded < n { folded } else { 2 * n - 1 - folded }
            }
        }
    }

    /// Texels, the last included, that hold all those from `first` to `last`; perhaps more.
    pub(super) fn span(self, first: i32, last: i32, n: usize) -> [usize; 2] {
        let whole = [0, n.saturating_sub(1)];
        let cell = |i: i32| i64::from(i).div_euclid(n as i64);
        if self != Self::Clamp && cell(first) != cell(last) {
            return whole;
        }
        let (a, b) = (self.texel(first, n), self.texel(last, n));
        [a.min(b), a.max(b)]
    }

    /// Its number in OpenGL and glTF.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Repeat => 10_497,
            Self::Clamp => 33_071,
            Self::Mirror => 33_648,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_go_on_as_their_names_say() {
        let row = |wrap: Wrap| (-4..7).map(|i| wrap.texel(i, 3)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Repeat), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0]);
        assert_eq!(row(Wrap::Clamp), [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2]);
        assert_eq!(row(Wrap::Mirror), [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
    }

    #[test]
    fn a_span_holds_every_texel_between_its_ends() {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for first in -9..9 {
                for last in first..9 {
                    let [low, high] = wrap.span(first, last, 4);
                    assert!(
                        (first..=last).all(|i| (low..=high).contains(&wrap.texel(i, 4))),
                        "{wrap:?} {first} {last}"
                    );
                }
            }
        }
    }
}
