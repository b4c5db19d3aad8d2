//! How a language writes numbers for people.

/// How a language writes numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberFormat {
    /// What stands before hexadecimal digits.
    pub prefix: &'static str,
    /// What stands after them.
    pub suffix: &'static str,
    /// The widths of its words in bits, the narrowest first. Wider numbers have 64 bits.
    pub widths: &'static [u32],
    /// Whether the manual has a number beside a statement in both forms, decimal and hexadecimal.
    pub both_beside: bool,
}

impl NumberFormat {
    /// The bits of a number in the narrowest width of the language that holds it, and that width.
    fn bits(&self, number: i64) -> (u64, u32) {
        let fits = |width: u32| number >= -(1 << (width - 1)) && number < 1 << width;
        match self.widths.iter().copied().find(|&width| width < 63 && fits(width)) {
            Some(width) => (number as u64 & ((1 << width) - 1), width),
            None => (number as u64, 64),
        }
    }

    /// A number in hexadecimal digits, as many as the word has.
    pub fn hexadecimal(&self, number: i64) -> String {
        let (bits, width) = self.bits(number);
        let digits = (width / 4) as usize;
        format!("{}{bits:0digits$X}{}", self.prefix, self.suffix)
    }

    /// The bits of a number's word in groups of four, the highest first.
    pub fn binary(&self, number: i64) -> String {
        let (bits, width) = self.bits(number);
        let group = |at: u32| format!("{:04b}", bits >> (4 * at) & 0xF);
        let groups: Vec<String> = (0..width / 4).rev().map(group).collect();
        groups.join(" ")
    }

    /// A number as it stands beside the statement that read or wrote it; 0 and 1 are the same in every form.
    pub fn beside(&self, number: i64) -> String {
        match number {
            0..=1 => number.to_string(),
            _ if self.both_beside => format!("{number} {}", self.hexadecimal(number)),
            _ => number.to_string(),
        }
    }
}
