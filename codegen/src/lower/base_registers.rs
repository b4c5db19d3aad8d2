//! Short addresses.
//!
//! A long scan is fetched rather than computed, so bytes of code are time. An access whose
//! distance from its base fits a byte takes three bytes less on x86-64; so the stretches of the
//! image that a function touches most get bases of their own.

use plcc_ir::{FuncData, InstData, Module};

/// What a distance of one byte reaches from a base: from 128 before to 127 behind it.
const REACH: u32 = 256;
/// So many bases at most: each takes a register.
const BASES: usize = 2;
/// A base is worth its register and its making for so many accesses.
const WORTH: usize = 24;

/// Where in the image a function's bases best stand.
pub(super) fn bases(module: &Module, func: &FuncData) -> Vec<u32> {
    let mut places = vec![];
    for (_, block) in func.blocks() {
        for &inst in &block.insts {
            if let InstData::Load { at, .. } | InstData::Store { at, .. } = func.inst(inst)
                && at.index.is_none()
                && let Some(region) = module.region(at.region)
                && let Some(place) = region.offset.checked_add(at.offset)
                && place >= REACH / 2
            {
                places.push(place);
            }
        }
    }
    places.sort_unstable();
    let mut found = vec![];
    while found.len() < BASES
        && let Some((first, end)) = fullest(&places).filter(|(first, end)| end - first >= WORTH)
    {
        let Some(start) = places.drain(first..end).next() else { break };
        found.push(start.saturating_add(REACH / 2));
    }
    found
}

/// The most neighbours that one base reaches, in a sorted list: the first and behind the last.
fn fullest(places: &[u32]) -> Option<(usize, usize)> {
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
    use super::fullest;

    #[test]
    fn the_fullest_stretch_is_found() {
        assert_eq!(fullest(&[]), None);
        assert_eq!(fullest(&[0, 300, 310, 555, 556]), Some((1, 4)));
        assert_eq!(fullest(&[0, 0, 5, 300]), Some((0, 3)));
    }
}
