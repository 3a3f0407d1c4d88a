//! Lists of a fixed length in the site file. The parser takes the first numbers of a longer list and says nothing, so
//! that `[6,6, 1,2, 1,6]`, written with decimal commas, would be the point (6, 6, 1): here every list is counted.

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

/// Exactly `N` of something, in brackets.
#[derive(Clone, Copy)]
pub(super) struct List<T, const N: usize>([T; N]);

impl<T, const N: usize> Deref for List<T, N> {
    type Target = [T; N];

    fn deref(&self) -> &[T; N] {
        &self.0
    }
}

/// What lists are made of.
pub(super) trait Item: Copy {
    /// What several of them are called.
    const MANY: &'static str;

    /// Its value where it is a whole number that may be left of one torn apart at its comma.
    fn whole(&self) -> Option<i64> {
        None
    }
}

impl Item for f64 {
    const MANY: &'static str = "numbers";

    fn whole(&self) -> Option<i64> {
        (self.fract() == 0.0 && self.abs() < 1e15).then_some(*self as i64)
    }
}

impl Item for u32 {
    const MANY: &'static str = "whole numbers";
}

impl<T: Item, const N: usize> Item for List<T, N> {
    const MANY: &'static str = "lists";
}

/// Parts a problem from its cure in what is told to the parser. See [`super::fault`].
pub(super) const CURE: &str = "\u{1f}";

impl<'de, T: Item + Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ListVisitor(PhantomData))
    }
}

struct ListVisitor<T, const N: usize>(PhantomData<T>);

impl<'de, T: Item + Deserialize<'de>, const N: usize> Visitor<'de> for ListVisitor<T, N> {
    type Value = List<T, N>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a list of {N} {}", T::MANY)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<List<T, N>, A::Error> {
        let mut found = Vec::with_capacity(N);
        while let Some(item) = list.next_element::<T>()? {
            found.push(item);
        }
        match <[T; N]>::try_from(found.as_slice()) {
            Ok(items) => Ok(List(items)),
            Err(_) => Err(A::Error::custom(format!(
                "expected a list of {N} {}, found {}{CURE}{}",
                T::MANY,
                found.len(),
                cure(&found, N)
            ))),
        }
    }
}

/// What to do about a list that has not `wanted` items: decimal commas are taken for what they are where there are more
/// numbers than wanted, all of them whole.
fn cure<T: Item>(found: &[T], wanted: usize) -> String {
    let whole: Option<Vec<i64>> = found.iter().map(T::whole).collect();
    let torn = whole.filter(|numbers| numbers.len() > wanted);
    match torn {
        // a part after a comma has no sign
        Some(numbers) if numbers.len() == 2 * wanted && numbers.iter().skip(1).step_by(2).all(|n| *n >= 0) => {
            let joined: Vec<String> = numbers.chunks(2).map(|n| format!("{}.{}", n[0], n[1])).collect();
            format!("Decimals take a point, not a comma. Did you mean [{}]?", joined.join(", "))
        }
        Some(_) => "Decimals take a point, not a comma: write 1.6 for 1,6".to_owned(),
        None => "Correct the list".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn told(list: &str) -> String {
        let read = toml::from_str::<BTreeMap<String, List<f64, 3>>>(&format!("v = {list}\n"));
        read.map_or_else(|e| e.message().to_owned(), |_| "right".to_owned())
    }

    #[test]
    fn every_list_is_counted_and_decimal_commas_are_named() {
        assert_eq!(told("[6.6, 1, -2]"), "right");
        assert!(told("[6.6, 1.2]").contains("expected a list of 3 numbers, found 2"));
        assert!(told("[6,6, -1,2, 1,6]").ends_with("Did you mean [6.6, -1.2, 1.6]?"), "{}", told("[6,6, -1,2, 1,6]"));
        assert!(told("[6,6, 1,2, 3]").contains("Decimals take a point"));
        assert!(told("[6, -1, 2, -3, 4, 5]").contains("write 1.6"), "no number ends in −1");
        assert!(told("[6.6, 1.2, 1.6, 2.5]").contains("Correct the list"));
    }
}
