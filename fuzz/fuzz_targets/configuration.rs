//! Fuzzes the reader of configuration files; `plcc_tests::promises` says what must hold.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| plcc_tests::promises::configuration(bytes));
