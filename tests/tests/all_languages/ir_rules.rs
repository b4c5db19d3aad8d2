//! The IR of the front ends follows the verifier's rules before and after the passes, and the verifier
//! can prove that every scan of PMI and PMAC ends.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, Limits, Lowered, MemoryLoader, Options};
use plcc_frontend::{nct, pmac, pmi};
use plcc_ir::Module;
use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::verify::{every_scan_ends, verify};
use plcc_tests::{gen_pmac, gen_pmi};

fn check(lowered: Lowered, ends: bool, source: &str) -> Module {
    let mut module = lowered.module;
    assert_eq!(verify(&module), [], "{source}");
    assert_eq!(every_scan_ends(&module), ends, "{source}");
    optimize(&mut module, OptLevel::Speed);
    assert_eq!(verify(&module), [], "{source}");
    assert_eq!(every_scan_ends(&module), ends, "{source}");
    module
}

fn pmi_module(source: &str, ends: bool) {
    let mut sources = SourceMap::new();
    let file = sources.add("a.pmi", source.as_bytes());
    let options = Options { limits: Limits::None, ..Options::default() };
    let (program, all) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
    check(program.unwrap_or_else(|| panic!("{all:?}")).lower().unwrap(), ends, source);
}

#[test]
fn every_scan_of_pmi_ends() {
    pmi_module(include_str!("../../../examples/pmi/lathe.pmi"), true);
    for seed in 0..20 {
        pmi_module(&gen_pmi::generate(seed, 40).source, true);
    }
}

#[test]
fn every_scan_of_pmac_ends() {
    for seed in 0..20 {
        let source = gen_pmac::generate(seed, 40).source;
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmc", source.as_bytes());
        let options = Options { controller: Controller::Pmac, ..Options::default() };
        let (program, all) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
        let program = program.unwrap_or_else(|| panic!("{all:?}"));
        check(program.lower().unwrap(), true, &source);
    }
}

#[test]
fn nct_modules_with_backward_jumps_may_not_end() {
    for (source, ends) in
        [(":001 LF500 J1 :000 J0", true), (":001 :010 LF500 G010 J1 :000 J0", false)]
    {
        let mut sources = SourceMap::new();
        let file = sources.add("a.nct", source.as_bytes());
        let (program, all) =
            nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
        check(program.unwrap_or_else(|| panic!("{all:?}")).lower().unwrap(), ends, source);
    }
}
