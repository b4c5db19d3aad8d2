//! Which of the operands of a statement hold what it gave: those that would change it if they were turned, alone or together.

/// How many combinations of values are tried at most to find operands that hold a result together.
const MOST: usize = 4096;

/// For each operand, whether turning it changes the result, alone or with others; in such a group every operand is needed.
/// `options` are the other values of each operand, `is_on` tells those apart that are 0; `changes` says whether the result is another
/// one with some of them: pairs of an operand's index and the value.
pub(crate) fn holding<T: Copy>(
    options: &[Vec<T>],
    is_on: impl Fn(T) -> bool,
    mut changes: impl FnMut(&[(usize, T)]) -> bool,
) -> Vec<bool> {
    let mut holds = vec![false; options.len()];
    // What does not change the result alone may do so with others.
    let mut rest: Vec<(usize, T)> = vec![];
    for (operand, values) in options.iter().enumerate() {
        for &value in values {
            match changes(&[(operand, value)]) {
                true => set(&mut holds, operand),
                false => rest.push((operand, value)),
            }
        }
    }
    rest.retain(|(operand, _)| !holds.get(*operand).copied().unwrap_or(true));
    let operands = rest.chunk_by(|a, b| a.0 == b.0).count();
    let product = rest.chunk_by(|a, b| a.0 == b.0).map(|values| values.len() + 1);
    let combinations = product.fold(1_usize, usize::saturating_mul);
    let sizes = if combinations <= MOST { operands } else { largest_size(rest.len()) };
    let mut found: Vec<Vec<usize>> = vec![];
    for size in 2..=sizes {
        let mut chosen = vec![];
        combine(&rest, size, 0, &mut chosen, &mut |group| {
            let members: Vec<usize> = group.iter().map(|(operand, _)| *operand).collect();
            let has_smaller = |known: &Vec<usize>| {
                known.len() < members.len() && known.iter().all(|one| members.contains(one))
            };
            if !found.iter().any(has_smaller) && changes(group) {
                members.iter().for_each(|&operand| set(&mut holds, operand));
                found.push(members);
            }
        });
    }
    if sizes < operands {
        by_shrinking(&rest, is_on, &mut holds, &mut changes);
    }
    holds
}

fn set(holds: &mut [bool], operand: usize) {
    if let Some(holds) = holds.get_mut(operand) {
        *holds = true;
    }
}

/// The size of the largest groups that are all tried, of a number of values.
fn largest_size(values: usize) -> usize {
    if values * values <= MOST { 2 } else { 1 }
}

/// Shows all groups of `size` values of different operands.
fn combine<T: Copy, S: FnMut(&[(usize, T)])>(
    values: &[(usize, T)],
    size: usize,
    from: usize,
    chosen: &mut Vec<(usize, T)>,
    show: &mut S,
) {
    if chosen.len() == size {
        return show(chosen);
    }
    for (at, &value) in values.iter().enumerate().skip(from) {
        if chosen.last().is_none_or(|last| last.0 != value.0) {
            chosen.push(value);
            combine(values, size, at + 1, chosen, show);
            chosen.pop();
        }
    }
}

/// Where there are too many operands to try all groups: turns on all that are off, or off all that are on, then fewer, as long as
/// the result is another one. That finds the open contacts of a long chain, all of which have to be closed.
fn by_shrinking<T: Copy>(
    values: &[(usize, T)],
    is_on: impl Fn(T) -> bool,
    holds: &mut [bool],
    changes: &mut impl FnMut(&[(usize, T)]) -> bool,
) {
    let first = |group: &[(usize, T)]| group.first().copied();
    let all: Vec<(usize, T)> = values.chunk_by(|a, b| a.0 == b.0).filter_map(first).collect();
    let (on, off): (Vec<_>, Vec<_>) = all.iter().partition(|(_, value)| is_on(*value));
    // Some may be needed as they are: leaving out one or two of them is tried as well.
    let mut starts = vec![all];
    let without = |group: &[(usize, T)], at: usize| {
        let kept = group.iter().enumerate().filter(|(index, _)| *index != at);
        kept.map(|(_, value)| *value).collect::<Vec<_>>()
    };
    for group in [on, off] {
        for at in 0..group.len() {
            let fewer = without(&group, at);
            starts.extend((at..fewer.len()).map(|other| without(&fewer, other)));
            starts.push(fewer);
        }
        starts.push(group);
    }
    for start in starts {
        if !changes(&start) {
            continue;
        }
        for &kept in &start {
            if holds.get(kept.0).copied().unwrap_or(true) {
                continue;
            }
            let mut group = start.clone();
            // This one is taken away last.
            for &(operand, _) in start.iter().filter(|(operand, _)| *operand != kept.0) {
                let fewer: Vec<_> = group.iter().copied().filter(|one| one.0 != operand).collect();
                if changes(&fewer) {
                    group = fewer;
                }
            }
            let fewer: Vec<_> = group.iter().copied().filter(|one| one.0 != kept.0).collect();
            if !changes(&fewer) {
                set(holds, kept.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The operands that hold the result of a formula of logical operands.
    fn of(values: &[bool], formula: impl Fn(&[bool]) -> bool) -> Vec<usize> {
        let options: Vec<Vec<bool>> = values.iter().map(|&value| vec![!value]).collect();
        let now = formula(values);
        let holds = holding(
            &options,
            |value| value,
            |turned| {
                let mut values = values.to_vec();
                turned.iter().for_each(|&(at, value)| values[at] = value);
                formula(&values) != now
            },
        );
        (0..values.len()).filter(|&at| holds[at]).collect()
    }

    #[test]
    fn contacts_in_a_row_hold_it_off_that_are_open() {
        assert_eq!(of(&[true, false, true], |v| v[0] && v[1] && v[2]), [1]);
        assert_eq!(of(&[false, false, true], |v| v[0] && v[1] && v[2]), [0, 1]);
        assert_eq!(of(&[true, true], |v| v[0] && v[1]), [0, 1]);
    }

    #[test]
    fn contacts_beside_each_other_hold_it_on_together() {
        assert_eq!(of(&[true, true, false], |v| v[0] || v[1] || v[2]), [0, 1]);
        assert_eq!(of(&[true, false], |v| v[0] || v[1]), [0]);
        assert_eq!(of(&[false, false, false], |v| v[0] && v[1] || v[2]), [0, 1, 2]);
        assert_eq!(of(&[false, true, true], |v| v[0] && v[1]), [0]);
    }

    #[test]
    fn the_open_contacts_of_a_long_chain_are_found() {
        let mut values = [true; 40];
        for open in [3, 17, 30, 31, 39] {
            values[open] = false;
        }
        assert_eq!(of(&values, |v| v.iter().all(|&closed| closed)), [3, 17, 30, 31, 39]);
        // A contact that must stay open stands in the chain, too.
        let chain = |v: &[bool]| !v[0] && v.iter().skip(1).all(|&closed| closed);
        values[0] = false;
        assert_eq!(of(&values, chain), [3, 17, 30, 31, 39]);
    }
}
