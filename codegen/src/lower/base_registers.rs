//! Base registers: which addresses a function keeps in registers to reach the image from.
//!
//! A long scan is bound by fetching instructions, so bytes of code are time. On x86-64 an access
//! whose distance from a base register fits a signed byte is three bytes shorter than one whose
//! distance does not. So the parts of the image that a function accesses most get base registers of
//! their own, besides the one for the beginning of the image.

use plcc_ir::passes::thresholds::base_registers::{
    MAX_BASES, MAX_BASES_WITH_LOCAL_BITS, MIN_ACCESSES,
};
use plcc_ir::{FuncData, InstData, Module};

use super::memory::{LOCAL_PLACES, local_place, place};

/// The bytes that a distance of one signed byte reaches: 128 before the base to 127 after it.
const REACH: i64 = 256;

/// The [places](super::memory) that a function's base registers best hold.
/// A function with local bits always has a base for them. Any other base is for a part of the image that is
/// accessed often enough, and only x86-64 has such bases.
pub(super) fn bases(module: &Module, func: &FuncData, is_x86: bool) -> Vec<i64> {
    let mut places = vec![];
    for (_, block) in func.blocks() {
        for &inst in &block.insts {
            match *func.inst(inst) {
                InstData::Load { ty: _, at } | InstData::Store { at, value: _ } => {
                    if at.index.is_none()
                        && let Some(place) = place(module, at)
                        && place >= REACH / 2
                    {
                        places.push(place);
                    }
                }
                InstData::Unpack { word: _, to: groups } | InstData::Pack { from: groups } => {
                    places.extend(groups.iter().map(|group| local_place(groups.bits(group).start)));
                }
                _ => {}
            }
        }
    }
    places.sort_unstable();
    let first_local = places.partition_point(|&place| place < LOCAL_PLACES);
    let has_local_bits = first_local < places.len();
    let mut found = vec![];
    if has_local_bits {
        let (first, end) =
            longest_run(places.get(first_local..).unwrap_or_default()).unwrap_or((0, 1));
        let start = places.drain(first_local + first..first_local + end).next();
        found.extend(start.map(|start| start.saturating_add(REACH / 2)));
    }
    let most = match (is_x86, has_local_bits) {
        (true, true) => MAX_BASES_WITH_LOCAL_BITS,
        (true, false) => MAX_BASES,
        (false, _) => 0,
    };
    while found.len() < most
        && let Some((first, end)) =
            longest_run(&places).filter(|(first, end)| end - first >= MIN_ACCESSES)
    {
        let Some(start) = places.drain(first..end).next() else { break };
        found.push(start.saturating_add(REACH / 2));
    }
    found
}

/// The longest run of offsets in a sorted list that one base reaches: the index of its first, and
/// that after its last. Of several equally long ones the first.
fn longest_run(places: &[i64]) -> Option<(usize, usize)> {
    let mut end = 0;
    let mut best = None;
    for (first, &start) in places.iter().enumerate() {
        while places.get(end).is_some_and(|&place| place - start < REACH) {
            end += 1;
        }
        if best.is_none_or(|(from, to)| end - first > to - from) {
            best = Some((first, end));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::longest_run;

    #[test]
    fn the_longest_run_of_near_offsets_is_found() {
        assert_eq!(longest_run(&[]), None);
        assert_eq!(longest_run(&[0, 300, 310, 555, 556]), Some((1, 4)));
        assert_eq!(longest_run(&[0, 0, 5, 300]), Some((0, 3)));
    }
}
