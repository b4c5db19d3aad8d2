//! Fuzzes the reader of IR in its text form; `plcc_tests::promises` says what must hold.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| plcc_tests::promises::ir_text(bytes));
