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
    for (_, value) in tree.get_mut().iter_mut() {
        if let DeValue::Array(items) = value.get_mut() {
            retain(items, |item| !mended.tables.contains(&item.span().start));
        }
    }
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
            if let DeValue::Array(items) = value.get_mut() {
                retain(items, |item| self.mend(item, false, at, &mut found));
            }
            self.mend(&mut value, key.span().contains(&at), at, &mut found).then_some((key, value))
        });
        *top = rest.collect();
        found
    }

    /// Takes the key where the fault lies out of a value; whether the value can stay: not where the fault lies in itself.
    fn mend(&mut self, value: &mut Spanned<DeValue>, named: bool, at: usize, found: &mut Option<bool>) -> bool {
        let span = value.span();
        if found.is_some() {
            return true;
        }
        if let DeValue::Table(table) = value.get_mut() {
            let before = table.len();
            let kept = std::mem::take(table).into_iter();
            *table = kept.filter(|(k, v)| !(k.span().contains(&at) || v.span().contains(&at))).collect();
            if table.len() < before {
                *found = Some(false);
                self.tables.insert(span.start);
                return true;
            }
        }
        if !named && !span.contains(&at) {
            return true;
        }
        *found = Some(!self.tables.insert(span.start));
        false
    }
}

/// Keeps some items of a list.
fn retain<'a>(items: &mut DeArray<'a>, mut keep: impl FnMut(&mut Spanned<DeValue<'a>>) -> bool) {
    let all = std::mem::replace(items, DeArray::new()).into_iter();
    *items = all.filter_map(|mut item| keep(&mut item).then_some(item)).collect();
}
