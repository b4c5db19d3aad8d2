//! Chooses values of variables, most of them at limits where an operator's result changes its form.

use plcc_abi::image::{read_u64, write_f64, write_u32};
use plcc_abi::pmac::{Definition, Layout};

use super::generate::{INPUTS, WORDS};
use plcc_random::Rng;

/// Magnitudes at which something changes: of bits, bytes, words, 32-bit integers, fixed point and
/// doubles.
pub(crate) const EDGES: &[f64] = &[
    0.0,
    1.0,
    2.0,
    0.5,
    1.5,
    2.5,
    0.25,
    0.999_999_999_999_999_9,
    1.000_000_000_000_000_2,
    5.960_464_477_539_063e-8,
    2.980_232_238_769_531_3e-8,
    3.0,
    7.0,
    8.0,
    10.0,
    100.0,
    127.0,
    128.0,
    255.0,
    256.0,
    1023.0,
    1024.0,
    65_535.0,
    65_536.0,
    999_999.0,
    1_000_000.0,
    8_388_607.0,
    8_388_608.0,
    8_388_609.0,
    16_777_215.0,
    16_777_216.0,
    16_777_217.0,
    2_147_483_647.0,
    2_147_483_647.5,
    2_147_483_648.0,
    2_147_483_649.0,
    4_294_967_295.0,
    4_294_967_296.0,
    34_359_738_367.0,
    34_359_738_368.0,
    549_755_813_887.0,
    549_755_813_888.0,
    549_755_813_889.0,
    70_368_744_177_664.5,
    140_737_488_355_327.0,
    140_737_488_355_328.0,
    4_503_599_627_370_495.5,
    4_503_599_627_370_496.0,
    4_503_599_627_370_497.0,
    9_007_199_254_740_991.0,
    9_007_199_254_740_992.0,
    9_007_199_254_740_994.0,
    9_223_372_036_854_774_784.0,
    9_223_372_036_854_775_808.0,
    18_446_744_073_709_551_616.0,
    1e22,
    1e300,
    f64::MAX,
    f64::MIN_POSITIVE,
    5e-324,
    1e-300,
    1e-9,
    0.1,
    123_456.789,
    30.0,
    45.0,
    90.0,
    360.0,
];

/// How many of the edges are integers of 32 bits or less, and few others stand among them.
const SMALL: usize = 35;

/// The last integers of 32 bits.
const LIMITS: [f64; 4] = [-2_147_483_648.0, -2_147_483_648.0, -2_147_483_647.0, 2_147_483_647.0];

/// Words at whose bits something changes.
const FULL: [u32; 10] =
    [0, 1, 0xFF_FFFF, 0x80_0000, 0x7F_FFFF, 0x12_3456, 0x99_9999, 0xAA_AAAA, 0x55_5555, 0xFF];

/// A value of a variable. What the round is decides how often it is an integer of 32 bits, so that
/// every way through a program is taken.
fn value(rng: &mut Rng, round: usize) -> f64 {
    let small = match round % 4 {
        0 => 100,
        1 => 97,
        2 => 80,
        _ => 20,
    };
    if round.is_multiple_of(2) && rng.chance(12) {
        return *rng.pick(&LIMITS);
    }
    let magnitude = match (rng.chance(small), rng.below(4)) {
        (true, 0) => rng.below(20) as f64,
        (true, 1) => {
            let bits = 1 + rng.below(31);
            ((rng.bits() & ((1 << bits) - 1)) as f64).floor()
        }
        (true, _) => loop {
            let edge = EDGES[rng.below(SMALL)];
            if edge.fract() == 0.0 && edge <= 2_147_483_648.0 {
                break edge;
            }
        },
        (false, 0) => rng.below(1_000_000) as f64 / 64.0,
        (false, 1) => {
            let any = f64::from_bits(rng.bits()).abs();
            if any.is_finite() { any } else { 3.7 }
        }
        (false, _) => *rng.pick(EDGES),
    };
    // No variable holds -0, and 2^31 alone is not an integer of 32 bits.
    let minus = rng.chance(if magnitude == 2_147_483_648.0 { 80 } else { 40 });
    (if minus { -magnitude } else { magnitude }) + 0.0
}

/// Fills everything that statements read.
pub fn fill(image: &mut [u8], layout: &Layout, rng: &mut Rng, round: usize) {
    for number in 0..INPUTS {
        write_f64(image, layout.p_offset(number), value(rng, round));
        write_f64(image, layout.q_offset(number), value(rng, round));
        write_f64(image, layout.i_offset(100 + number), value(rng, round));
    }
    for number in 1000..1024 {
        write_f64(image, layout.p_offset(number), value(rng, round));
    }
    for number in 0..64 {
        let at = layout.mdef + 8 * number;
        // An undefined one has its value where its definition would stand.
        if Definition::decode(read_u64(image, at)) == Definition::Star {
            write_u32(image, at, rng.bits() as u32 & 0x1F_FFFF);
        }
    }
    let radians = rng.below(2) as f64;
    write_f64(image, layout.i_offset(15), radians);
    for address in WORDS {
        for half in [0, 4] {
            let word = if rng.chance(50) { *rng.pick(&FULL) } else { rng.bits() as u32 };
            write_u32(image, layout.words + 8 * address + half, word & 0xFF_FFFF);
        }
    }
}
