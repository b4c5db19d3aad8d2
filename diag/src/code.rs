//! The pages of diagnostic codes: what each code means and how to fix its cause.

use crate::codes;

/// What `plcc explain` prints about one code: the code's page.
#[derive(Clone, Copy, Debug)]
pub struct CodeInfo {
    /// The code: the manual's own error number (`PMI-31`), an error of ours that the manual does
    /// not have (`PMI-X1`), a warning (`PMI-W1`) or a note (`PMAC-N1`).
    pub code: &'static str,
    /// What is wrong, in a few words.
    pub title: &'static str,
    /// What it means and why it is refused or warned of.
    pub meaning: &'static str,
    /// An example of wrong code and the same example corrected, or what else to do.
    pub fix: &'static str,
}

/// The pages of all codes: one table for each language, one for part programs, and one for test scripts.
pub static TABLES: &[&[CodeInfo]] = &[
    codes::pmi::CODES,
    codes::nct::CODES,
    codes::pmac::CODES,
    codes::sim::CODES,
    codes::plctest::CODES,
];

/// Finds the page of a code, which may be in upper or lower case; `None` if no code is so called.
pub fn find_code(code: &str) -> Option<&'static CodeInfo> {
    TABLES.iter().flat_map(|t| t.iter()).find(|info| info.code.eq_ignore_ascii_case(code))
}

#[cfg(test)]
mod tests {
    use super::TABLES;

    #[test]
    fn codes_are_unique_and_their_pages_are_filled() {
        let mut seen = std::collections::HashSet::new();
        for info in TABLES.iter().flat_map(|t| t.iter()) {
            assert!(seen.insert(info.code), "{} is there twice", info.code);
            for text in [info.title, info.meaning, info.fix] {
                assert!(!text.trim().is_empty(), "{} has an empty part", info.code);
            }
        }
    }
}
