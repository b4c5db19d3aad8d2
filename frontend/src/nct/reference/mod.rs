//! The manual's tables of names as data.

use std::sync::LazyLock;

use crate::common::keywords::{self, Keyword};
use crate::common::tsv;

pub mod names;

/// What the manual's keywords are called in messages.
pub(crate) const MANUAL: &str = "NCT manual";

/// The keywords and signs of the language.
pub(crate) static KEYWORDS: LazyLock<Vec<Keyword>> = LazyLock::new(|| {
    let file = "frontend/src/nct/reference/keywords.tsv";
    tsv::built_in(keywords::load(file, include_str!("keywords.tsv")))
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keywords_are_well_formed() {
        assert!(KEYWORDS.len() > 20);
        for keyword in KEYWORDS.iter() {
            let spellings: Vec<&str> = keyword.names.split(' ').collect();
            for spelling in &spellings {
                let page = keywords::explain(&KEYWORDS, &spelling.to_lowercase(), MANUAL).unwrap();
                assert!(page.contains(keyword.meaning), "{spelling}: another has the name");
            }
        }
    }
}
