//! From a site file's text to its tables. The parser stops at the first key that it cannot use; here that key is left out and
//! the rest parsed again, so that a person learns of all faults at once.

use serde::Deserialize;
use std::collections::BTreeSet;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Deserializer, Error};

use super::fault::{Faults, Source};
use super::file::SiteFile;

/// So many faults are enough to mend at once.
const MOST: usize = 20;

/// The tables, without the probes and views that hold a fault; `None` where too little remains.
pub(super) fn parsed(source: &Source, faults: &mut Faults) -> Option<SiteFile> {
    let (mut tree, torn) = DeTable::parse_recoverable(source.text);
    if let Some(first) = torn.first() {
        // what follows it may well be its consequence
        faults.add(Some(source.parse_fault(first)));
        return None;
    }
    let mut mended = Mended::default();
    loop {
        let error = match SiteFile::deserialize(Deserializer::from(tree.clone())) {
            Ok(file) if mended.tables.is_empty() => return Some(file),
            Ok(_) => break,
            Err(error) => error,
        };
        if error.message().starts_with("missing field `model`") {
            // perhaps since it held a fault
            faults.add((faults.len() == 0).then(|| source.without_model()));
            return None;
        }
        let follows = mended.take_fault(tree.get_mut(), &error);
        faults.add((follows != Some(true)).then(|| source.parse_fault(&error)));
        follows?;
        if faults.len() >= MOST {
            return None;
        }
    }
    let top = std::mem::take(tree.get_mut()).into_iter().map(|(key, mut value)| {
        if let DeValue::Array(items) = value.get_mut() {
            let whole = std::mem::replace(items, DeArray::new())
                .into_iter()
                .filter(|item| !mended.tables.contains(&item.span().start));
            *items = whole.collect();
        }
        (key, value)
    });
    *tree.get_mut() = top.collect();
    SiteFile::deserialize(Deserializer::from(tree)).ok()
}

/// What was taken away so far.
#[derive(Default)]
struct Mended {
    /// Where tables begin that lost a key: what they then lack is no fault of the file.
    tables: BTreeSet<usize>,
}

impl Mended {
    /// Takes the key at fault away, or the table where none is; whether the fault only follows from what was taken before.
    /// `None` where nothing is there to take.
    fn take_fault(&mut self, top: &mut DeTable, error: &Error) -> Option<bool> {
        let at = error.span()?.start;
        let mut found = None;
        let rest = std::mem::take(top).into_iter().filter_map(|(key, mut value)| {
            let named = key.span().contains(&at);
            if let DeValue::Array(items) = value.get_mut() {
                let kept = std::mem::replace(items, DeArray::new())
                    .into_iter()
                    .filter_map(|item| self.mend(item, false, at, &mut found));
                *items = kept.collect();
            }
            Some((key, self.mend(value, named, at, &mut found)?))
        });
        *top = rest.collect();
        found
    }

    /// A value without the key in it where the fault lies; `None` where it lies in the value itself.
    fn mend<'a>(
        &mut self,
        mut value: Spanned<DeValue<'a>>,
        named: bool,
        at: usize,
        found: &mut Option<bool>,
    ) -> Option<Spanned<DeValue<'a>>> {
        let span = value.span();
        if found.is_some() {
            return Some(value);
        }
        if let DeValue::Table(table) = value.get_mut() {
            let before = table.len();
            let kept = std::mem::take(table).into_iter();
            *table = kept.filter(|(k, v)| !(k.span().contains(&at) || v.span().contains(&at))).collect();
            if table.len() < before {
                *found = Some(false);
                self.tables.insert(span.start);
                return Some(value);
            }
        }
        if !named && !span.contains(&at) {
            return Some(value);
        }
        *found = Some(!self.tables.insert(span.start));
        None
    }
}
