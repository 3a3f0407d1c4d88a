//! Many short lists in one array (compressed rows).

/// Lists of numbers or other small things, one after the other in one array.
#[derive(Clone, Debug)]
pub(crate) struct Lists<T = u32> {
    /// Where each list starts; one more than there are lists.
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl<T: Copy + Default> Lists<T> {
    /// Sorts (list, item) pairs into `count` lists; the items of one list keep their order.
    pub(crate) fn of<I: Iterator<Item = (u32, T)>>(count: usize, pairs: impl Fn() -> I) -> Self {
        let mut starts = vec![0u32; count + 1];
        pairs().for_each(|(list, _)| starts[list as usize + 1] += 1);
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![T::default(); starts[count] as usize];
        for (list, item) in pairs() {
            let slot = &mut next[list as usize];
            items[*slot as usize] = item;
            *slot += 1;
        }
        Self { starts, items }
    }

    /// How many lists there are.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// One list.
    pub(crate) fn get(&self, i: usize) -> &[T] {
        &self.items[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The items of all lists.
    pub(crate) fn items_mut(&mut self) -> &mut [T] {
        &mut self.items
    }

    /// Adds a list.
    pub(crate) fn push(&mut self, list: &[T]) {
        self.items.extend_from_slice(list);
        self.starts.push(self.items.len() as u32);
    }
}

impl Lists {
    /// For each of `n` items the lists that hold it.
    pub(crate) fn transposed(&self, n: usize) -> Self {
        Self::of(n, || (0..self.len()).flat_map(|i| self.get(i).iter().map(move |item| (*item, i as u32))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_about_twice_lists_are_what_they_were() {
        let pairs = [(2, 7), (0, 3), (2, 1), (0, 9)];
        let lists = Lists::of(3, || pairs.into_iter());
        assert_eq!((lists.get(0), lists.get(1), lists.get(2)), (&[3, 9][..], &[][..], &[7, 1][..]));
        let back = lists.transposed(10).transposed(3);
        assert_eq!((back.len(), back.get(0), back.get(2)), (3, &[3, 9][..], &[1, 7][..]));
    }
}
