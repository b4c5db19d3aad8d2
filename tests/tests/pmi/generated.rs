//! The programs that the generator of PMI programs makes have no errors.
#![allow(clippy::unwrap_used)]

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmi,
};
use plcc_tests::gen_pmi::generate;

#[test]
fn generated_programs_are_valid() {
    for seed in 0..200 {
        let case = generate(seed, 10 + seed as usize % 60);
        let mut sources = SourceMap::new();
        let file = sources.add("generated.pmi", case.source.as_bytes());
        let options = Options::default();
        let (program, all) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
        let errors: Vec<_> = all
            .iter()
            .filter(|d| d.is_error())
            .map(|d| {
                (d.code, &d.message, sources.slice(d.span), sources.line_col(file, d.span.start).0)
            })
            .collect();
        assert!(program.is_some(), "seed {seed}\n{}\n{errors:?}", case.source);
    }
}
