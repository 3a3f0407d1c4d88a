//! Makes a set cover smaller without changing how many candidates it takes.

use super::coverage::Coverage;
use crate::lists::Lists;

/// What is left of a problem: candidates that belong to some best cover, and independent parts.
pub(crate) struct Reduced {
    pub(crate) forced: Vec<usize>,
    pub(crate) parts: Vec<(Coverage, Vec<usize>)>,
}

/// Takes what must be taken, drops candidates that cover no more than another, drops elements that are covered
/// whenever another is, until nothing changes; then splits into parts that share nothing.
pub(crate) fn reduce(coverage: &Coverage) -> Reduced {
    let mut row_in: Vec<bool> = (0..coverage.elements()).map(|e| !coverage.covered_by(e).is_empty()).collect();
    let mut column_in = vec![true; coverage.candidates()];
    let mut forced = Vec::new();
    loop {
        let (columns, rows) = lists(coverage, &row_in, &column_in);
        let mut changed = drop_columns(&columns, &rows, &mut column_in);
        let (columns, rows) = lists(coverage, &row_in, &column_in);
        changed |= drop_rows(&columns, &rows, &mut row_in);
        for e in 0..coverage.elements() {
            if row_in[e]
                && let &[only] = rows.get(e)
            {
                changed = true;
                column_in[only as usize] = false;
                forced.push(only as usize);
                for &covered in columns.get(only as usize) {
                    row_in[covered as usize] = false;
                }
            }
        }
        if !changed {
            return Reduced { forced, parts: parts(&columns, &rows, &row_in, &column_in) };
        }
    }
}

/// The candidates whose elements lie within no other's, of equal ones the first; in rising order.
pub fn maximal(coverage: &Coverage) -> Vec<usize> {
    let mut column_in: Vec<bool> = (0..coverage.candidates()).map(|c| !coverage.covers(c).is_empty()).collect();
    // equal ones first, so that the dear comparison meets each but once
    let mut order: Vec<usize> = (0..coverage.candidates()).collect();
    order.sort_by(|&a, &b| coverage.covers(a).cmp(coverage.covers(b)).then(a.cmp(&b)));
    for pair in order.windows(2) {
        if coverage.covers(pair[0]) == coverage.covers(pair[1]) {
            column_in[pair[1]] = false;
        }
    }
    let row_in = vec![true; coverage.elements()];
    let (columns, rows) = lists(coverage, &row_in, &column_in);
    drop_columns(&columns, &rows, &mut column_in);
    (0..column_in.len()).filter(|&c| column_in[c]).collect()
}

/// Whether a rising list lies within another.
pub(crate) fn within(small: &[u32], large: &[u32]) -> bool {
    if small.len() > large.len() {
        return false;
    }
    let mut rest = large;
    small.iter().all(|s| match rest.iter().position(|l| l >= s) {
        Some(k) if rest[k] == *s => {
            rest = &rest[k + 1..];
            true
        }
        _ => false,
    })
}

fn lists(coverage: &Coverage, row_in: &[bool], column_in: &[bool]) -> (Lists, Lists) {
    let mut columns = Lists::default();
    let mut list = Vec::new();
    for (c, &is_in) in column_in.iter().enumerate() {
        list.clear();
        if is_in {
            list.extend(coverage.covers(c).iter().copied().filter(|&e| row_in[e as usize]));
        }
        columns.push(&list);
    }
    let rows = columns.transposed(row_in.len());
    (columns, rows)
}

/// For each list a mark for every item, shared by some: a list that lacks a mark of another does not hold it.
fn marks(lists: &Lists) -> Vec<u128> {
    let mark = |item: &u32| 1_u128 << (item.wrapping_mul(0x9e37_79b1) >> 25);
    (0..lists.len()).map(|i| lists.get(i).iter().map(mark).fold(0, |all, m| all | m)).collect()
}

/// Drops each column that lies within another; of equal ones the first stays.
fn drop_columns(columns: &Lists, rows: &Lists, column_in: &mut [bool]) -> bool {
    let mut changed = false;
    let marks = marks(columns);
    for c in 0..columns.len() {
        if !column_in[c] {
            continue;
        }
        let list = columns.get(c);
        let Some(&rarest) = list.iter().min_by_key(|&&e| rows.get(e as usize).len()) else {
            column_in[c] = false;
            changed = true;
            continue;
        };
        let dominated = rows.get(rarest as usize).iter().map(|&d| d as usize).any(|d| {
            let other = columns.get(d);
            let wins = other.len() > list.len() || (other.len() == list.len() && d < c);
            wins && marks[c] & !marks[d] == 0 && column_in[d] && within(list, other)
        });
        if dominated {
            column_in[c] = false;
            changed = true;
        }
    }
    changed
}

/// Drops each row whose candidates include all of another row's; of equal ones the first stays.
fn drop_rows(columns: &Lists, rows: &Lists, row_in: &mut [bool]) -> bool {
    let mut changed = false;
    let marks = marks(rows);
    for s in 0..rows.len() {
        if !row_in[s] {
            continue;
        }
        let list = rows.get(s);
        let Some(&shortest) = list.iter().min_by_key(|&&c| columns.get(c as usize).len()) else { continue };
        for r in columns.get(shortest as usize).iter().map(|&r| r as usize) {
            let other = rows.get(r);
            let loses = other.len() > list.len() || (other.len() == list.len() && r > s);
            if loses && marks[s] & !marks[r] == 0 && row_in[r] && within(list, other) {
                row_in[r] = false;
                changed = true;
            }
        }
    }
    changed
}

fn parts(columns: &Lists, rows: &Lists, row_in: &[bool], column_in: &[bool]) -> Vec<(Coverage, Vec<usize>)> {
    let mut of_row = vec![u32::MAX; row_in.len()];
    let mut result = Vec::new();
    for seed in 0..row_in.len() {
        if !row_in[seed] || of_row[seed] != u32::MAX {
            continue;
        }
        let mut names = Vec::new();
        let mut front = vec![seed as u32];
        of_row[seed] = 0;
        let mut count = 1;
        while let Some(r) = front.pop() {
            for &c in rows.get(r as usize).iter().filter(|&&c| column_in[c as usize]) {
                names.push(c as usize);
                for &other in columns.get(c as usize) {
                    if row_in[other as usize] && of_row[other as usize] == u32::MAX {
                        of_row[other as usize] = count;
                        count += 1;
                        front.push(other);
                    }
                }
            }
        }
        names.sort_unstable();
        names.dedup();
        let own = |&c: &usize| columns.get(c).iter().filter(|&&r| row_in[r as usize]).map(|&r| of_row[r as usize]);
        result.push((Coverage::new(vec![1.0; count as usize], names.iter().map(own)), names));
    }
    result
}
