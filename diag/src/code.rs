//! The table of codes: what each means and how to mend it.

use crate::codes;

/// A code's page, as `plcc explain` prints it.
#[derive(Clone, Copy, Debug)]
pub struct CodeInfo {
    /// `PMI-31`, `PMI-X1`, `PMI-W1`…
    pub code: &'static str,
    /// A few words.
    pub title: &'static str,
    /// What it means and why it is refused or warned of.
    pub meaning: &'static str,
    /// A wrong example and its mend.
    pub mend: &'static str,
}

/// All tables, one a language.
pub static TABLES: &[&[CodeInfo]] = &[codes::pmi::CODES, codes::nct::CODES, codes::pmac::CODES];

/// Finds a code, whatever its case.
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
            assert!(seen.insert(info.code), "{} stands twice", info.code);
            for text in [info.title, info.meaning, info.mend] {
                assert!(!text.trim().is_empty(), "{} has an empty part", info.code);
            }
        }
    }
}
