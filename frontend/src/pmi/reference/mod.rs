//! The manual's tables of names as data: keywords and executive variables.

use std::sync::LazyLock;

use crate::common::keywords::{self, Keyword};
use crate::common::tsv;

pub(crate) mod executive;

/// What the manual is called in texts of `plcc explain`.
pub(crate) const MANUAL: &str = "PMI manual";

/// The keywords and signs of the language.
pub(crate) static KEYWORDS: LazyLock<Vec<Keyword>> = LazyLock::new(|| {
    let file = "frontend/src/pmi/reference/keywords.tsv";
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
