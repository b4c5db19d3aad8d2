//! Which statements of two versions belong together.

use std::collections::{BTreeMap, HashMap};

use similar::{Algorithm, DiffOp, capture_diff_slices};

use crate::Change;
use crate::unit::Unit;

/// A statement that differs, by its numbers in the two versions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    pub(crate) change: Change,
    pub(crate) old: Option<usize>,
    pub(crate) new: Option<usize>,
}

/// The statements that differ, in the order of the new version.
pub(crate) fn align(old: &[Unit], new: &[Unit]) -> Vec<Pair> {
    let meanings =
        |units: &[Unit]| -> Vec<String> { units.iter().map(|it| it.meaning.clone()).collect() };
    let (old_keys, new_keys) = (meanings(old), meanings(new));
    let ops = capture_diff_slices(Algorithm::Patience, &old_keys, &new_keys);
    // By the number in the old version, that in the new one.
    let mut same: Vec<(usize, usize)> = vec![];
    let (mut removed, mut added): (Vec<usize>, Vec<usize>) = (vec![], vec![]);
    for op in &ops {
        match *op {
            DiffOp::Equal { old_index, new_index, len } => {
                same.extend((0..len).map(|n| (old_index + n, new_index + n)));
            }
            DiffOp::Delete { old_index, old_len, .. } => {
                removed.extend(old_index..old_index + old_len)
            }
            DiffOp::Insert { new_index, new_len, .. } => {
                added.extend(new_index..new_index + new_len)
            }
            DiffOp::Replace { old_index, old_len, new_index, new_len } => {
                removed.extend(old_index..old_index + old_len);
                added.extend(new_index..new_index + new_len);
            }
        }
    }
    let mut pairs = vec![];
    let moved = take_moved(old, new, &mut removed, &mut added);
    for (from, to) in moved {
        let (Some(unit), Some(_)) = (old.get(from), new.get(to)) else { continue };
        if order_matters(unit, from, to, old, &same) {
            pairs.push(Pair { change: Change::Moved, old: Some(from), new: Some(to) });
        }
    }
    for from in removed {
        let to = take_changed(old, new, from, &mut added);
        let change = if to.is_some() { Change::Changed } else { Change::Removed };
        pairs.push(Pair { change, old: Some(from), new: to });
    }
    pairs.extend(added.into_iter().map(|to| Pair {
        change: Change::Added,
        old: None,
        new: Some(to),
    }));
    // A removed statement comes before the one that follows what stood in front of it.
    let before: BTreeMap<usize, usize> = same.iter().copied().collect();
    let place = |pair: &Pair| match (pair.new, pair.old) {
        (Some(new), _) => (new, 1),
        (None, old) => {
            let old = old.unwrap_or(0);
            (before.range(..old).next_back().map_or(0, |(_, new)| new + 1), 0)
        }
    };
    pairs.sort_by_key(place);
    pairs
}

/// Takes out the statements that both versions have, in different places.
fn take_moved(
    old: &[Unit],
    new: &[Unit],
    removed: &mut Vec<usize>,
    added: &mut Vec<usize>,
) -> Vec<(usize, usize)> {
    let mut by_meaning: HashMap<&str, Vec<usize>> = HashMap::new();
    for &to in added.iter().rev() {
        if let Some(unit) = new.get(to) {
            by_meaning.entry(unit.meaning.as_str()).or_default().push(to);
        }
    }
    let mut moved = vec![];
    removed.retain(|&from| {
        let Some(unit) = old.get(from) else { return true };
        let Some(to) = by_meaning.get_mut(unit.meaning.as_str()).and_then(Vec::pop) else {
            return true;
        };
        moved.push((from, to));
        false
    });
    added.retain(|to| moved.iter().all(|(_, taken)| taken != to));
    moved
}

/// Whether a statement has passed another one with which its order matters.
fn order_matters(
    unit: &Unit,
    from: usize,
    to: usize,
    old: &[Unit],
    same: &[(usize, usize)],
) -> bool {
    same.iter().filter(|&&(other, now)| (other < from) != (now < to)).any(|&(other, _)| {
        let Some(other) = old.get(other) else { return true };
        if unit.declares && other.declares {
            return false;
        }
        let meets = |a: &Unit, b: &Unit| {
            !a.writes.is_disjoint(&b.reads) || !a.writes.is_disjoint(&b.writes)
        };
        unit.directs || other.directs || unit.acts || meets(unit, other) || meets(other, unit)
    })
}

/// Takes out the added statement that an old one has become: one that gives the same variables values, or directs as it did.
fn take_changed(old: &[Unit], new: &[Unit], from: usize, added: &mut Vec<usize>) -> Option<usize> {
    let unit = old.get(from)?;
    let first_word = |unit: &Unit| unit.meaning.split(' ').next().unwrap_or_default().to_owned();
    let is_successor = |to: &usize| {
        new.get(*to).is_some_and(|other| {
            let same_writes = !unit.writes.is_empty() && unit.writes == other.writes;
            let same_form = unit.writes.is_empty()
                && other.writes.is_empty()
                && (first_word(unit) == first_word(other) || unit.directs && other.directs);
            same_writes || same_form
        })
    };
    let at = added.iter().position(is_successor)?;
    Some(added.remove(at))
}
