//! The manual's tables of names as data: keywords, and the variables that have a meaning.

use std::sync::LazyLock;

use crate::common::keywords::{self, Keyword};
use crate::common::tsv;

pub mod names;

/// What the manual is called in texts of `plcc explain`.
pub(crate) const MANUAL: &str = "NCT manual";

/// The keywords and signs of the language.
pub(crate) static KEYWORDS: LazyLock<Vec<Keyword>> = LazyLock::new(|| {
    let file = "frontend/src/nct/reference/keywords.tsv";
    tsv::built_in(keywords::load(file, include_str!("keywords.tsv")))
});

#[cfg(test)]
mod tests {
    use plcc_diag::SourceMap;

    use super::*;
    use crate::common::{MemoryLoader, Options};

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

    #[test]
    fn the_forms_with_a_variable_are_statements() {
        let forms = KEYWORDS.iter().flat_map(|keyword| keyword.form.split([' ', ',']));
        let forms: Vec<&str> = forms.filter(|form| form.ends_with("name")).collect();
        assert_eq!(forms.len(), 13);
        for form in forms {
            let statement = form.replace("name", "F020");
            let end = if statement.starts_with(['<', '=', '>']) { "Z" } else { "" };
            let text = format!(":001 {statement} {end} J1 :000 J0");
            let mut sources = SourceMap::new();
            let file = sources.add("a.nct", text.as_bytes());
            let loader = MemoryLoader::new();
            let (_, found) = crate::nct::check(&mut sources, file, &loader, &Options::default());
            assert_eq!(found, [], "{text}");
        }
    }
}
