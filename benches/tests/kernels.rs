//! Small kernels of every family end in the same state in native code, in the statement interpreter,
//! and in C in each layout and style. Nothing is timed.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use plcc_benches::kernels::c::Variant;
use plcc_benches::kernels::c_process::{CProcess, Compiler};
use plcc_benches::kernels::subject::Subject;
use plcc_benches::kernels::{Inputs, families};
use plcc_codegen::Optimization;

const SEED: u64 = 3;
const SCANS: usize = 100;

#[test]
fn kernels_end_in_the_same_state_as_their_c() {
    let folder = std::env::temp_dir().join(format!("plcc-kernels-test-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let compiler = Compiler { command: "cc".into(), level: "-O1" };
    for kernel in families::all(SEED, 6) {
        let name = format!("{} {}", kernel.language.group(), kernel.name);
        let mut subject = Subject::new(&kernel, SEED, Optimization::ALL)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        // These programs are short; here they have truth values in 32 bits nevertheless.
        let mut with_wide_bits = Optimization::ALL;
        with_wide_bits.passes.by_length = false;
        let mut wide = Subject::new(&kernel, SEED, with_wide_bits).unwrap();
        let mut program = CProcess::start(&kernel, &compiler, &folder, SEED).unwrap();
        for inputs in Inputs::ALL {
            let wanted = subject.state_after(inputs, SCANS, false);
            assert_eq!(subject.state_after(inputs, SCANS, true), wanted, "{name} {inputs:?}");
            for (number, variant) in Variant::all(&kernel).iter().enumerate() {
                let found = program.state_after(number, inputs, SCANS).unwrap();
                assert_eq!(found, wanted, "{name} {inputs:?} {}", variant.name());
            }
            assert_eq!(wide.state_after(inputs, SCANS, true), wanted, "{name} {inputs:?}");
            // Otherwise the comparison would say nothing.
            assert!(wanted.iter().any(|&value| value != 0.0), "{name}: everything is 0");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
