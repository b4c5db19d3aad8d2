//! The manuals' tables of I- and M-variables as data, and what `plcc explain` and the listings say
//! of them.

use std::sync::LazyLock;

use crate::common::keywords::{self, Keyword};
use crate::common::tsv;

pub mod describe;
pub mod listing_comments;
pub(crate) mod memory;
pub mod tables;

/// How `plcc explain` names the manual that the keywords are from; a section follows.
pub(crate) const MANUAL: &str = "PMAC guide,";

/// The words and signs of the language, from `keywords.tsv`.
pub(crate) static KEYWORDS: LazyLock<Vec<Keyword>> = LazyLock::new(|| {
    let file = "frontend/src/pmac/reference/keywords.tsv";
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
