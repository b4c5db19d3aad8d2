//! The variables of a program, and how a statement names them.

use plcc_random::Rng;

/// The variables that a program uses. Few of them, so that idioms meet; F bits and F words share bytes, I and Y bits
/// words.
pub(super) struct Pool {
    inputs: Vec<usize>,
    outputs: Vec<usize>,
    /// Bytes of F, each of which is used as bits, as a word, and as half of the word before.
    bytes: Vec<usize>,
    counters: Vec<usize>,
    timers: Vec<usize>,
}

/// Numbers at which something ends.
const VALUES: [u32; 17] =
    [0, 1, 2, 3, 7, 9, 10, 15, 99, 100, 255, 256, 9999, 10000, 0x7FFF, 0x8000, 0xFFFF];

/// The status flags, which statements write.
const FLAGS: [&str; 9] =
    ["F0040", "F0046", "F0046", "F0047", "F0053", "F0080", "F0081", "F0082", "F0083"];

impl Pool {
    pub(super) fn new(rng: &mut Rng, few: bool) -> Self {
        let mut some = |all: &[usize]| -> Vec<usize> {
            let count = if few { 1 + rng.below(2) } else { 3 + rng.below(5) };
            (0..count).map(|_| *rng.pick(all)).collect()
        };
        Self {
            // Bytes of the images: boards 0 and 1, flags.
            inputs: some(&[0, 1, 2, 10, 11, 40, 41, 44, 65]),
            outputs: some(&[0, 1, 2, 10, 40, 41, 44, 45, 65]),
            bytes: some(&[20, 21, 22, 30, 100, 101, 120, 498, 499, 500, 510]),
            counters: some(&[0, 1, 5, 19]),
            timers: some(&[0, 1, 2, 49]),
        }
    }

    /// A byte of a list, or a neighbour.
    fn near(rng: &mut Rng, list: &[usize]) -> usize {
        let byte = *rng.pick(list);
        if rng.chance(25) { byte + 1 } else { byte }
    }

    /// A bit that a condition tests or L loads.
    pub(super) fn bit(&self, rng: &mut Rng) -> String {
        let digit = rng.below(8);
        match rng.below(12) {
            0..=3 => format!("I{:02}{digit}", Self::near(rng, &self.inputs)),
            4 => format!("V{:02}{digit}", Self::near(rng, &self.inputs)),
            5 => format!("P{:02}{digit}", rng.below(12)),
            6 | 7 => format!("Y{:02}{digit}", Self::near(rng, &self.outputs)),
            8 => (*rng.pick(&FLAGS)).to_owned(),
            _ => format!("F{:03}{digit}", Self::near(rng, &self.bytes)),
        }
    }

    /// Something that may be a condition alone.
    pub(super) fn tested(&self, rng: &mut Rng) -> String {
        match rng.below(10) {
            0 => format!("Q{:02}", rng.pick(&self.counters)),
            1 => format!("T{:02}", rng.pick(&self.timers)),
            2 => format!("H{:02}", rng.pick(&self.timers)),
            3 => format!("M{}", rng.below(3)),
            _ => self.bit(rng),
        }
    }

    /// A bit that S stores, U sets and D clears; for U and D a Y is left out.
    pub(super) fn output_bit(&self, rng: &mut Rng) -> String {
        let digit = rng.below(8);
        match rng.below(10) {
            0 => format!("O{:02}{digit}", rng.below(12)),
            1..=5 => format!("Y{:02}{digit}", Self::near(rng, &self.outputs)),
            _ => format!("F{:03}{digit}", Self::near(rng, &self.bytes)),
        }
    }

    pub(super) fn counter(&self, rng: &mut Rng) -> String {
        format!("Q{:02}", rng.pick(&self.counters))
    }

    pub(super) fn timer(&self, rng: &mut Rng) -> String {
        format!("{}{:02}", rng.pick(&["T", "T", "T", "H"]), rng.pick(&self.timers))
    }

    /// An F word of the program's.
    pub(super) fn f_word(&self, rng: &mut Rng) -> String {
        format!("F{:03}", Self::near(rng, &self.bytes))
    }

    /// A word that L loads and operations take.
    pub(super) fn word(&self, rng: &mut Rng) -> String {
        match rng.below(18) {
            0 | 1 => format!("I{:02}", Self::near(rng, &self.inputs)),
            2 => format!("V{:02}", Self::near(rng, &self.inputs)),
            3 => format!("P{:02}", rng.pick(&[0, 1, 2, 10, 39])),
            4 => format!("Y{:02}", Self::near(rng, &self.outputs)),
            5 => self.counter(rng),
            6 => self.timer(rng),
            7 => format!("RH0{:02}", rng.pick(&[0, 6, 28, 29, 60, 61])),
            8 => format!("RP0{}", rng.pick(&["01", "39"])),
            9 => "FI490".to_owned(),
            10 => format!("M{}", rng.below(3)),
            11 => format!("F00{}", rng.pick(&[0, 2, 3, 4, 5, 7, 8])),
            _ => self.f_word(rng),
        }
    }

    /// A word that S stores.
    pub(super) fn output_word(&self, rng: &mut Rng) -> String {
        match rng.below(14) {
            0 | 1 => {
                let byte = Self::near(rng, &self.outputs);
                // On boards a word begins at an even byte.
                let byte = if byte < 40 { byte & !1 } else { byte };
                format!("Y{byte:02}")
            }
            2 => format!("O{:02}", rng.pick(&[0, 2, 10, 38])),
            3 | 4 => self.counter(rng),
            5 => self.timer(rng),
            6 => format!("RH0{}", 60 + rng.below(3)),
            7 => "FI490".to_owned(),
            8 => format!("F00{}", rng.pick(&[0, 3, 4, 7, 8])),
            9 => format!("M{}", rng.below(3)),
            _ => self.f_word(rng),
        }
    }

    pub(super) fn value(&self, rng: &mut Rng) -> u32 {
        match rng.below(4) {
            0 => rng.below(0x1_0000) as u32,
            1 => 1 << rng.below(16),
            2 => *rng.pick(&VALUES),
            _ => rng.below(20) as u32,
        }
    }

    /// A constant behind an operation: decimal without its comma, or hexadecimal.
    pub(super) fn constant(&self, rng: &mut Rng) -> String {
        let value = self.value(rng);
        if rng.chance(40) { format!(".{value:04X}") } else { value.to_string() }
    }

    /// A row of the stimulus.
    pub(super) fn change(&self, rng: &mut Rng) -> (String, String) {
        let digit = rng.below(8);
        match rng.below(12) {
            0..=4 => {
                let name = format!("I{:02}{digit}", Self::near(rng, &self.inputs));
                (name, rng.below(2).to_string())
            }
            5 => (format!("I{:02}", Self::near(rng, &self.inputs)), self.value(rng).to_string()),
            6 => (format!("RH0{:02}", rng.pick(&[0, 6, 28, 29])), self.value(rng).to_string()),
            7 => (format!("RP0{}", rng.pick(&["01", "39"])), self.value(rng).to_string()),
            8 => (self.counter(rng), self.value(rng).to_string()),
            9 => {
                // The pointer of LFI and SFI, the phase of GF and CF.
                let name = *rng.pick(&["F490", "F494"]);
                let values =
                    [0x120, 0x021, 0x500, 0x999, 0x1000, 0xA00, 0x010, 0x013, 0x004, 0x490];
                (name.to_owned(), rng.pick(&values).to_string())
            }
            10 => {
                let name = format!("F{:03}{digit}", Self::near(rng, &self.bytes));
                (name, rng.below(2).to_string())
            }
            _ => (self.f_word(rng), self.value(rng).to_string()),
        }
    }
}

/// A line with the numbers of the next row: those after one of `letters`, and constants where it has a comma.
pub(super) fn row(line: &str, letters: &str, by: usize) -> String {
    let mut result = String::new();
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, others) = rest.split_at(digits.max(first.len_utf8()));
        rest = others;
        let Ok(old) = number.parse::<usize>() else {
            result.push_str(number);
            continue;
        };
        let mut before = result.chars().rev();
        let (letter, other) = (before.next().unwrap_or(' '), before.next().unwrap_or(' '));
        let new =
            if letters.contains(letter) { moved(letter, other, number, old, by) } else { None };
        let constant = letters.contains(',') && ",=<>+-*".contains(letter);
        match new {
            Some(new) => result.push_str(&new),
            // A shift by more than 15 is an error.
            None if constant && letter != other => {
                result.push_str(&((old + by) % 65536).to_string())
            }
            None => result.push_str(number),
        }
    }
    result
}

/// The number of a variable in a later row. None for what stays: labels, areas, indirect words.
fn moved(letter: char, other: char, number: &str, old: usize, by: usize) -> Option<String> {
    let octal = |old: usize, bytes: usize| {
        let index = (old / 10 * 8 + old % 10 + by) % (bytes * 8);
        index / 8 * 10 + index % 8
    };
    Some(match (letter, other, number.len()) {
        ('H' | 'P', 'R', _) | ('I', 'F', _) | ('F', 'H' | 'P' | 'C' | 'G', _) => return None,
        ('P' | 'O', _, 3) => format!("{:03}", octal(old, 40)),
        ('I' | 'Y' | 'V' | 'U' | 'D', _, 3) => format!("{:03}", octal(old, 100)),
        ('F', _, 4) if old >= 200 => format!("{:04}", octal(old, 1000)),
        ('F', _, 3) if old >= 20 => format!("{:03}", (old + 2 * by) % 1000),
        ('Q', _, 2) => format!("{:02}", (old + by) % 24),
        ('T', _, 2) => format!("{:02}", (old + by) % 50),
        ('H', _, 2) => format!("{:02}", (old + by) % 100),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::row;

    #[test]
    fn rows_count_in_octal_where_bits_do() {
        let line = "(V007AI007) NLF020 +5 SRH060 UF0206 LFI490 HF200 UQ05 C010 <<3 Z";
        let wanted = "(V011AI011) NLF024 +7 SRH060 UF0210 LFI490 HF200 UQ07 C010 <<3 Z";
        assert_eq!(row(line, "VIFQ,", 2), wanted);
    }
}
