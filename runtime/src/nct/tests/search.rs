//! HF and PF: the manual's examples (NCT 4.14) and the edges.

use plcc_abi::nct::{FlagLocation, NctSettings};
use plcc_abi::{Host, HostFn};

use crate::nct::host::NctHost;
use crate::nct::memory::NcMemory;

/// Runs a search with words at addresses: OP, then F0080, F0081 and the word at `answer`.
fn search(
    function: HostFn,
    area: u64,
    op: u16,
    words: &[(usize, &[u16])],
    answer: usize,
) -> [u16; 3] {
    let flags: Vec<FlagLocation> =
        (0..1000).map(|offset| FlagLocation { offset, unpacked: false }).collect();
    let settings = NctSettings { parameters: vec![(61, 8)], ..NctSettings::default() };
    let mut memory = NcMemory::new(&settings);
    let mut host = NctHost { flags: &flags, memory: &mut memory, time: None };
    let mut f = vec![0_u8; 1000];
    for &(start, words) in words {
        for (i, word) in words.iter().enumerate() {
            f[start + i * 2..][..2].copy_from_slice(&word.to_le_bytes());
        }
    }
    host.call(&mut f, function, [area, op.into(), 0, 0]);
    if area > 10 {
        assert_eq!((f[4], f[5], f[8] & !3), (0, 0, 0), "flags of other statements");
    }
    let found = u16::from_le_bytes([f[answer], f[answer + 1]]);
    [(f[8] & 1).into(), (f[8] >> 1 & 1).into(), found]
}

/// Row 0 is the spindle, eight pots after it; 5 stands in pot 3 as a wide tool.
const POTS: [u16; 9] = [0x4009, 1, 0, 0x4005, 0x4000, 7, 8, 0x8000, 0x4002];

#[test]
fn hf_finds_a_tool_whose_masked_bits_match() {
    let hf = |op, area: &[u16]| search(HostFn::NctHf, 120, op, &[(500, &POTS), (120, area)], 128);
    assert_eq!(hf(5, &[2, 0x500, 18, 0x3FFF]), [0, 0, 0x506]);
    assert_eq!(hf(9, &[2, 0x500, 18, 0x3FFF]), [0, 0, 0x500]);
    assert_eq!(hf(6, &[2, 0x500, 18, 0x3FFF]), [0, 1, 0]);
    // The last item that is not whole does not count.
    assert_eq!(hf(2, &[2, 0x500, 17, 0x3FFF]), [0, 1, 0]);
    assert_eq!(hf(5, &[2, 0x500, 0, 0x3FFF]), [0, 1, 0]);
    assert_eq!(hf(0x4005, &[2, 0x500, 18, 0x3FFF]), [0, 1, 0]);
}

#[test]
fn hf_of_bytes_compares_the_low_one() {
    let hf = |op, area: &[u16]| search(HostFn::NctHf, 120, op, &[(500, &POTS), (120, area)], 128);
    assert_eq!(hf(0xFF07, &[1, 0x500, 18, 0xFF]), [0, 0, 0x510]);
    assert_eq!(hf(0x40, &[0xAB01, 0x502, 16, 0xFFF0]), [0, 0, 0x507]);
}

#[test]
fn hf_refuses_a_wrong_area() {
    let hf = |area: &[u16]| search(HostFn::NctHf, 120, 5, &[(500, &POTS), (120, area)], 128);
    for area in [
        [0, 0x500, 18, 0xFFFF],
        [3, 0x500, 18, 0xFFFF],
        [2, 0x50A, 18, 0xFFFF],
        [2, 0x990, 11, 0xFFFF],
        [2, 0x1000, 0, 0xFFFF],
        [2, 0x500, 0xFFFF, 0xFFFF],
    ] {
        assert_eq!(hf(&area)[0], 1, "{area:x?}");
    }
    assert_eq!(search(HostFn::NctHf, 991, 5, &[], 0)[0], 1);
}

#[test]
fn pf_finds_the_nearest_free_pot() {
    let pf = |op, area: &[u16]| search(HostFn::NctPf, 130, op, &[(500, &POTS), (130, area)], 134);
    // The first pot is tested by width alone.
    assert_eq!(pf(0x4009, &[0x0102, 0x506]), [0, 0, 0x506]);
    // From pot 1, width 3: pot 4 ahead is free, pots 8 and 3 are not.
    assert_eq!(pf(0x4009, &[0x0102, 0x502]), [0, 0, 0x508]);
    // From pot 4, width 1: pots 5 and 3 no, 6 no, 2 back is free.
    assert_eq!(pf(9, &[0x0102, 0x508]), [0, 0, 0x504]);
    // Ahead only it is found all around: 5, 6, 7, 8, 1, 2.
    assert_eq!(pf(9, &[0x0002, 0x508]), [0, 0, 0x504]);
    // From pot 2, width 5: 7 is five ahead, three back.
    assert_eq!(pf(0x8000, &[0x0102, 0x504]), [0, 0, 0x514]);
    assert_eq!(pf(0xC000, &[0x0102, 0x504]), [0, 1, 0]);
    // The spindle is a start like any other; its neighbours are the first and the last pot.
    assert_eq!(pf(0x8000, &[0x0102, 0x500]), [0, 0, 0x514]);
}

#[test]
fn flags_overwrite_the_found_address_in_the_same_register() {
    // The register for what is found is F008, where the flags are: .0803 and .0502 lose theirs.
    let table = (803, [5_u16].as_slice());
    let area = [1, 0x803, 1, 0xFF];
    assert_eq!(search(HostFn::NctHf, 0, 5, &[table, (0, &area)], 8), [0, 0, 0x800]);
    let found = search(HostFn::NctPf, 4, 1, &[(500, &POTS), (4, &[2, 0x502])], 8);
    assert_eq!(found, [0, 0, 0x500]);
}

#[test]
fn of_two_pots_equally_near_pf_takes_the_one_ahead() {
    let pots = [0xC000, 1, 0, 1, 0x4001, 1, 0, 1, 1];
    let pf = |area: &[u16]| search(HostFn::NctPf, 130, 0, &[(500, &pots), (130, area)], 134);
    assert_eq!(pf(&[0x0102, 0x508]), [0, 0, 0x512]);
}

#[test]
fn pf_refuses_a_wrong_area() {
    let pf = |area: &[u16]| search(HostFn::NctPf, 130, 0, &[(500, &POTS), (130, area)], 134);
    for area in [[2, 0x518], [2, 0x498], [2, 0x50A], [2, 0x501], [0x202, 0x500], [1, 0x500]] {
        assert_eq!(pf(&area)[0], 1, "{area:x?}");
    }
    assert_eq!(search(HostFn::NctPf, 995, 0, &[], 0)[0], 1);
}
