//! The variables of a download: how its M- and L-variables are defined, and which numbers are used.
//!
//! | numbers | are |
//! | --- | --- |
//! | M10 to M33, L10 to L33 | bits of one word, in a row |
//! | M40 to M63, L40 to L63 | bits of one or of several words |
//! | M70 to M81, L70 to L81 | fields and whole words, often over the same words as the bits |
//! | M84 to M89 | whatever else a definition can be |
//! | M90 to M93 | definitions of M10, M40, M70 and M84 |

use plcc_random::Rng;

use crate::idioms::renumbered;

/// The definitions and the pools of variables of a download.
pub(super) struct Memory {
    turbo: bool,
    /// The number of each defined M-variable with its definition.
    m: Vec<(usize, String)>,
    l: Vec<(usize, String)>,
    /// Of these each idiom takes what it needs. Few of them, so that idioms meet.
    bits: Vec<usize>,
    words: Vec<usize>,
    numbers: Vec<String>,
    pub(super) flags: Vec<usize>,
}

/// Numbers at which something ends: fields, the formats of numbers, indices.
const WHOLE: [i64; 26] = [
    0,
    1,
    2,
    3,
    5,
    7,
    8,
    10,
    15,
    16,
    31,
    63,
    100,
    127,
    255,
    256,
    1023,
    1024,
    4095,
    65535,
    65536,
    0x7F_FFFF,
    0x80_0000,
    0xFF_FFFF,
    0x7FFF_FFFF,
    0x1_0000_0000,
];
const FRACTIONS: [&str; 18] = [
    "9223372036854775807",
    "99999999999999999999",
    "0.000000000001",
    "549755813888.5",
    ".5",
    "0.25",
    "1.5",
    "2.5",
    "0.1",
    "0.999999",
    "1.0000001",
    "0.00000006",
    "0.00000003",
    "3.75",
    "8388607.5",
    "16777215.25",
    "1000000000000",
    "4503599627370497.5",
];

/// A number of a short list, or of a long one.
fn some(rng: &mut Rng, few: bool, from: usize, to: usize) -> Vec<usize> {
    let count = if few { 1 + rng.below(3) } else { 3 + rng.below(8) };
    let first = from + rng.below(to - from);
    (0..count)
        .map(
            |index| {
                if rng.chance(70) {
                    (first + index).min(to)
                } else {
                    from + rng.below(to - from + 1)
                }
            },
        )
        .collect()
}

impl Memory {
    pub(super) fn new(rng: &mut Rng, turbo: bool, few: bool) -> Self {
        let mut memory = Self {
            turbo,
            m: vec![],
            l: vec![],
            bits: some(rng, few, 10, 33),
            words: some(rng, few, 70, 81),
            numbers: vec![],
            flags: vec![1, 2, 3],
        };
        memory.bits.extend(some(rng, few, 40, 63));
        let places: Vec<String> = (0..3).map(|_| memory.place(rng)).collect();
        memory.m = memory.block(rng, &places);
        for (number, text) in memory.block(rng, &places) {
            memory.l.push((number, text));
        }
        for number in 84..=89 {
            let text = memory.odd(rng);
            memory.m.push((number, text));
        }
        for (number, of) in (90..).zip([10, 40, 70, 84]) {
            let text = match turbo {
                true => format!("Y:${:X},0,24", 0x4000 + of),
                false => format!("Y:${:X},0,16", 0xBC00 + of),
            };
            memory.m.push((number, text));
        }
        let count = if few { 2 + rng.below(4) } else { 5 + rng.below(9) };
        for index in 0..count {
            let number = match rng.below(12) {
                0 => format!("Q{}", index + 1),
                1 => format!(
                    "I{}",
                    rng.pick(&[10, 20, 21, 22, 89, 105, 122, 130, 168, 169, 170, 187, 194])
                ),
                2 => format!("P{}", 100 + index),
                _ => format!("P{}", index + 4),
            };
            memory.numbers.push(number);
        }
        memory
    }

    /// The words of the bits and fields.
    fn block(&self, rng: &mut Rng, places: &[String]) -> Vec<(usize, String)> {
        let mut all = vec![];
        let first = rng.pick(places).clone();
        for bit in 0..24 {
            all.push((10 + bit, format!("{first},{bit}")));
        }
        let how = rng.below(3);
        let (second, third) = (rng.pick(places).clone(), self.place(rng));
        for bit in 0..24 {
            let place =
                if how == 1 && bit % 2 == 1 || how == 2 && bit >= 12 { &third } else { &second };
            let at = match how {
                1 => bit / 2,
                2 => (bit + 5) % 24,
                _ => 23 - bit,
            };
            let width = *rng.pick(&["", ",1", ",1,S", ",1,U"]);
            all.push((40 + bit, format!("{place},{at}{width}")));
        }
        for number in 70..=81 {
            let place = if rng.chance(70) { rng.pick(places).clone() } else { self.place(rng) };
            all.push((number, field(rng, &place)));
        }
        all
    }

    /// A word for bits and fields, such as `Y:$FFC2`.
    fn place(&self, rng: &mut Rng) -> String {
        if rng.chance(4) {
            // A definition.
            let number = *rng.pick(&[10, 40, 70, 84]);
            return format!("Y:${:X}", if self.turbo { 0x4000 } else { 0xBC00 } + number);
        }
        let half = *rng.pick(&["X", "Y"]);
        let address = match (self.turbo, rng.below(5)) {
            (false, 0 | 1) => 0x770 + rng.below(16),
            (false, 2) => 0xFFC0 + rng.below(8),
            (false, 3) => 0xC000 + rng.below(4),
            (false, _) => 0x7F0 + rng.below(4),
            (true, 0 | 1) => 0x10F0 + rng.below(16),
            (true, 2) => 0x78400 + rng.below(4),
            (true, 3) => 0x78C00 + rng.below(4),
            (true, _) => 0x3440 + rng.below(4),
        };
        format!("{half}:${address:X}")
    }

    /// A definition of any other form, some over other variables.
    fn odd(&self, rng: &mut Rng) -> String {
        let (p, q) = if self.turbo { (0x6000, 0x8000) } else { (0x1000, 0x1400) };
        let near = rng.below(12);
        match rng.below(14) {
            0 => format!("D:${:X}", 0x28 + near),
            1 => format!("DP:${:X}", if self.turbo { 0x60400 } else { 0xD200 } + near),
            2 => format!("F:${:X}", if self.turbo { 0x60400 } else { 0xD200 } + near),
            3 | 4 => format!("L:${:X}", p + near),
            5 => format!("L:${:X}", q + near),
            6 => format!("X:${:X},0,24,S", p + near),
            7 => format!("Y:${:X},{},12", p + near, rng.below(12)),
            8 => "TWD:4,0.8.3,U".to_owned(),
            9 => format!("TWB:0,0,{},U", rng.pick(&[1, 4, 8])),
            10 => "TWS:8".to_owned(),
            11 => format!("X:${:X},0,24,S", rng.below(2) * 0x700),
            _ => "*".to_owned(),
        }
    }

    /// The lines that define all variables that a program may name.
    pub(super) fn definitions(&self) -> Vec<String> {
        let m = self.m.iter().map(|(number, text)| format!("M{number}->{text}"));
        let l = self.l.iter().map(|(number, text)| format!("L{number}->{text}"));
        m.chain(l).collect()
    }

    /// A row of a ladder: the numbers of variables go up by `by`, each in the block where it is.
    pub(super) fn row(line: &str, letters: &str, by: usize) -> String {
        let fixed = ["..", "->", "PLC", "ADR", "ADDRESS", "DISP"];
        if fixed.iter().any(|word| line.contains(word)) {
            return line.to_owned();
        }
        renumbered(line, |letter, old| {
            let block = match old {
                10..=33 => 10..34,
                40..=63 => 40..64,
                70..=81 => 70..82,
                84..=89 => 84..90,
                _ => old..old + 1,
            };
            match letter {
                _ if !letters.contains(letter) => old,
                'M' | 'L' => block.start + (old - block.start + by) % block.len(),
                'P' => old + by,
                // A place of the display, or any other constant.
                _ => (old + by) % 80,
            }
        })
    }

    /// A one-bit M-variable.
    pub(super) fn bit(&self, rng: &mut Rng) -> String {
        format!("M{}", rng.pick(&self.bits))
    }

    /// An M-variable of any width.
    pub(super) fn word(&self, rng: &mut Rng) -> String {
        match rng.chance(80) {
            true => format!("M{}", rng.pick(&self.words)),
            false => format!("M{}", 84 + rng.below(6)),
        }
    }

    pub(super) fn l_bit(&self, rng: &mut Rng) -> String {
        format!("L{}", rng.pick(&self.bits))
    }

    pub(super) fn l_word(&self, rng: &mut Rng) -> String {
        format!("L{}", rng.pick(&self.words))
    }

    /// An M-variable that holds a definition.
    pub(super) fn pointer(&self, rng: &mut Rng) -> String {
        format!("M{}", 90 + rng.below(4))
    }

    /// A definition that `pointer` may move, with a definition that a command may give it.
    pub(super) fn moved(&self, rng: &mut Rng) -> (usize, String) {
        match rng.below(4) {
            0 => (*rng.pick(&self.bits), format!("{},{}", self.place(rng), rng.below(24))),
            1 => (84 + rng.below(6), self.odd(rng)),
            _ => {
                let place = self.place(rng);
                (*rng.pick(&self.words), field(rng, &place))
            }
        }
    }

    /// An address to which a definition may point, as a number.
    pub(super) fn address(&self, rng: &mut Rng) -> String {
        let place = self.place(rng);
        place.get(2..).unwrap_or("$770").to_owned()
    }

    /// A row of a stimulus that changes a definition, or a word by its address.
    pub(super) fn memory_change(&self, rng: &mut Rng) -> (String, String) {
        match rng.below(3) {
            0 => (self.place(rng), rng.below(1 << 24).to_string()),
            1 => {
                let p = if self.turbo { 0x6000 } else { 0x1000 } + rng.below(12);
                (format!("{}:${p:X}", rng.pick(&["X", "Y"])), rng.below(1 << 24).to_string())
            }
            _ => (self.pointer(rng), self.address(rng)),
        }
    }

    /// A P-, Q- or I-variable.
    pub(super) fn number(&self, rng: &mut Rng) -> String {
        rng.pick(&self.numbers).clone()
    }

    /// A P-variable that is mostly 0 or 1.
    pub(super) fn flag(&self, rng: &mut Rng) -> String {
        format!("P{}", rng.pick(&self.flags))
    }

    /// An integer, mostly small, seldom negative, without a sign in front of it unless it is negative.
    pub(super) fn whole(&self, rng: &mut Rng) -> String {
        let number = match rng.below(4) {
            0 => rng.below(1 << 24) as i64,
            1 => *rng.pick(&WHOLE),
            _ => rng.below(20) as i64,
        };
        if rng.chance(20) { format!("-{number}") } else { number.to_string() }
    }

    /// Any number.
    pub(super) fn value(&self, rng: &mut Rng) -> String {
        if rng.chance(65) {
            return self.whole(rng);
        }
        let sign = if rng.chance(30) { "-" } else { "" };
        format!("{sign}{}", rng.pick(&FRACTIONS))
    }

    /// A power of two that is a bit of a word.
    pub(super) fn weight(&self, rng: &mut Rng) -> u32 {
        1 << if rng.chance(70) { rng.below(8) } else { rng.below(24) }
    }
}

/// A field of a word, or the whole word.
fn field(rng: &mut Rng, place: &str) -> String {
    if rng.chance(10) {
        return format!("{place},24");
    }
    let width = *rng.pick(&[1, 2, 3, 4, 4, 8, 8, 8, 12, 16, 20, 24, 24, 24]);
    let offset = if rng.chance(50) { 0 } else { rng.below(25 - width) };
    let offset = if rng.chance(60) { offset / 4 * 4 } else { offset };
    let format = match width % 4 {
        0 => *rng.pick(&["", ",U", ",U", ",S", ",S", ",D", ",C"]),
        _ => *rng.pick(&["", ",U", ",S"]),
    };
    format!("{place},{offset},{width}{format}")
}
