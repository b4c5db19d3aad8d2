//! Generates a PMAC program of logic on M-variables and counters in P-variables, for the benchmark
//! in which definitions of M-variables change.

use std::fmt::Write as _;

use plcc_random::Rng;

/// The address of the first Y word with the bits of inputs and outputs, 16 in each word.
pub const BITS: u32 = 0x07C0;
/// So many of these words, the first ones, change from scan to scan.
pub const INPUT_WORDS: u32 = 2;
/// The address of the first X word.
const WORDS: u32 = 0x07D0;
const BIT_COUNT: usize = 96;
/// The numbers of words, counters and flags together.
const COUNT: usize = 32;
/// The first of these are words in M-variables, the others counters and flags in P-variables.
const WORD_COUNT: usize = 8;

/// The name of a word, or of a counter or flag.
fn number_name(index: usize) -> String {
    if index < WORD_COUNT { format!("M{}", 500 + index) } else { format!("P{index}") }
}

/// A download of about `statements` statements, the same for the same seed.
pub fn download(statements: usize, seed: u64) -> String {
    let mut rng = Rng::new(seed);
    let mut out = String::from("I5=3\n");
    for index in 0..BIT_COUNT {
        let (word, bit) = (BITS + index as u32 / 16, index % 16);
        let _ = writeln!(out, "M{index}->Y:${word:X},{bit},1");
    }
    for index in 0..COUNT {
        let _ = writeln!(out, "M{}->X:${:X},0,24,S", 500 + index, WORDS + index as u32);
    }
    out.push_str("OPEN PLC 1 CLEAR\n");
    let mut done = 0;
    while done < statements {
        let mut bit = || rng.below(BIT_COUNT);
        let (a, b, to) = (bit(), bit(), 32 + bit() % 64);
        let form = rng.below(6);
        let (least, most) = if form == 3 { (0, WORD_COUNT) } else { (WORD_COUNT, COUNT) };
        let mut number = || number_name(least + rng.below(most - least));
        let (x, z) = (number(), number());
        let (count, text) = match form {
            0 => (1, format!("M{to}=M{a}&M{b}|M{}", a + 1 - a % 2)),
            1 => (2, format!("IF (M{a}=1 AND M{b}=0)\n{x}={x}+1\nENDIF")),
            2 => (2, format!("IF ({x}>1000)\n{x}=0\nENDIF")),
            3 => (1, format!("{x}=({x}^{z})&$FFFF|M{a}")),
            4 => {
                let once = format!("IF ({x}=0)\n{z}={z}+1\n{x}=1\nENDIF");
                (5, format!("IF (M{a}=1)\n{once}\nELSE\n{x}=0\nENDIF"))
            }
            _ => (1, format!("{x}={z}%100+M{b}*3")),
        };
        let _ = writeln!(out, "{text}");
        done += count;
    }
    out + "CLOSE\n"
}

/// The numbers whose bits the inputs take in turn.
pub fn patterns() -> Vec<u64> {
    let mut rng = Rng::new(1);
    (0..64).map(|_| rng.bits()).collect()
}

#[cfg(test)]
mod tests {
    use super::download;

    #[test]
    fn the_same_seed_gives_the_same_statements() {
        assert_eq!(download(40, 7), download(40, 7));
        assert_ne!(download(40, 7), download(40, 8));
    }
}
