//! Fuzzes the reader of IR in its text form; `plcc_tests::oracle` says what must hold.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| plcc_tests::oracle::ir_text(bytes));
