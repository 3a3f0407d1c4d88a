//! Fewer candidates that cover the same: redundant ones dropped, two replaced by one, three by two.

use super::coverage::Coverage;
use super::reduce::within;

/// Looks at so many replacements in one call: keeps large problems quick, whatever the machine.
const BUDGET: usize = 20_000_000;

/// A cover that changes: how often each element is covered.
struct Cover<'a> {
    coverage: &'a Coverage,
    chosen: Vec<usize>,
    times: Vec<u32>,
    work: usize,
}

/// The chosen candidates, fewer where possible. The first `fixed` of them stay. What is covered stays covered, but for
/// candidates whose loss leaves the covered weight at least `needed`.
pub(crate) fn improve(coverage: &Coverage, chosen: &[usize], fixed: usize, needed: f64) -> Vec<usize> {
    let mut cover = Cover { coverage, chosen: chosen.to_vec(), times: vec![0; coverage.elements()], work: 0 };
    for &c in chosen {
        cover.add(c, 1);
    }
    cover.drop_redundant(fixed, needed);
    while cover.work < BUDGET && (cover.replace(fixed, 2) || cover.replace(fixed, 3)) {
        cover.drop_redundant(fixed, needed);
    }
    cover.chosen
}

impl Cover<'_> {
    fn add(&mut self, candidate: usize, by: i32) {
        for &e in self.coverage.covers(candidate) {
            let times = &mut self.times[e as usize];
            *times = times.saturating_add_signed(by);
        }
    }

    /// Drops those that cover least alone, as long as enough stays covered.
    fn drop_redundant(&mut self, fixed: usize, needed: f64) {
        let weight = |e: usize| self.coverage.weight(e);
        let mut covered: f64 = (0..self.times.len()).filter(|&e| self.times[e] > 0).map(weight).sum();
        loop {
            let alone = |c: usize| -> f64 {
                let own = self.coverage.covers(c).iter().filter(|&&e| self.times[e as usize] == 1);
                own.map(|&e| self.coverage.weight(e as usize)).sum()
            };
            let least =
                (fixed..self.chosen.len()).map(|k| (alone(self.chosen[k]), k)).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((loss, k)) = least.filter(|(loss, _)| *loss == 0.0 || covered - loss >= needed) else { return };
            covered -= loss;
            let c = self.chosen.remove(k);
            self.add(c, -1);
        }
    }

    /// Replaces `n` (2 or 3) chosen candidates by one fewer, once; whether it did.
    fn replace(&mut self, fixed: usize, n: usize) -> bool {
        let near = self.neighbours(fixed);
        for a in fixed..self.chosen.len() {
            for &b in &near[a] {
                if b > a && n == 2 && self.try_replace(&[a, b]) {
                    return true;
                }
                if n == 3 && b > a {
                    let mut thirds: Vec<usize> = near[a].iter().chain(&near[b]).copied().collect();
                    thirds.retain(|&c| c > a && c != b && (c > b || !near[a].contains(&c)));
                    thirds.sort_unstable();
                    thirds.dedup();
                    for c in thirds {
                        if self.try_replace(&[a, b, c]) {
                            return true;
                        }
                    }
                }
                if self.work >= BUDGET {
                    return false;
                }
            }
        }
        false
    }

    /// For each chosen candidate, which others share a candidate that covers something only the one covers and
    /// something only the other does.
    fn neighbours(&mut self, fixed: usize) -> Vec<Vec<usize>> {
        let mut owner = vec![u32::MAX; self.times.len()];
        for k in fixed..self.chosen.len() {
            for &e in self.coverage.covers(self.chosen[k]) {
                if self.times[e as usize] == 1 {
                    owner[e as usize] = k as u32;
                }
            }
        }
        let mut near = vec![Vec::new(); self.chosen.len()];
        let mut owners = Vec::new();
        for c in 0..self.coverage.candidates() {
            owners.clear();
            owners.extend(self.coverage.covers(c).iter().map(|&e| owner[e as usize]).filter(|&o| o != u32::MAX));
            owners.sort_unstable();
            owners.dedup();
            self.work += owners.len() * owners.len();
            for &a in &owners {
                near[a as usize].extend(owners.iter().filter(|&&b| b != a).map(|&b| b as usize));
                if near[a as usize].len() > 4096 {
                    near[a as usize].sort_unstable();
                    near[a as usize].dedup();
                }
            }
        }
        for list in &mut near {
            list.sort_unstable();
            list.dedup();
        }
        near
    }

    fn try_replace(&mut self, group: &[usize]) -> bool {
        // what only the group covers
        let mut own: Vec<u32> = Vec::new();
        for &k in group {
            own.extend_from_slice(self.coverage.covers(self.chosen[k]));
        }
        own.sort_unstable();
        let mut needs: Vec<u32> = Vec::new();
        for run in own.chunk_by(|a, b| a == b) {
            if run.len() as u32 == self.times[run[0] as usize] {
                needs.push(run[0]);
            }
        }
        let Some(by) = self.covering(&needs, group.len() - 1) else { return false };
        let mut out: Vec<usize> = group.to_vec();
        out.sort_unstable();
        for k in out.into_iter().rev() {
            let c = self.chosen.remove(k);
            self.add(c, -1);
        }
        for c in by {
            self.chosen.push(c);
            self.add(c, 1);
        }
        true
    }

    /// At most `n` candidates that cover all of a rising list, if there are such.
    fn covering(&mut self, needs: &[u32], n: usize) -> Option<Vec<usize>> {
        let Some(&rarest) = needs.iter().min_by_key(|&&e| self.coverage.covered_by(e as usize).len()) else {
            return Some(Vec::new());
        };
        if n == 0 {
            return None;
        }
        let coverage = self.coverage;
        for &c in coverage.covered_by(rarest as usize) {
            self.work += needs.len();
            let has = coverage.covers(c as usize);
            if n == 1 {
                if within(needs, has) {
                    return Some(vec![c as usize]);
                }
                continue;
            }
            let rest: Vec<u32> = needs.iter().copied().filter(|e| has.binary_search(e).is_err()).collect();
            if let Some(mut more) = self.covering(&rest, n - 1) {
                more.push(c as usize);
                return Some(more);
            }
            if self.work >= BUDGET {
                return None;
            }
        }
        None
    }
}
