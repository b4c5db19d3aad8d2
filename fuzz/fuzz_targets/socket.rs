//! Fuzzes the reader of requests of the socket; `plcc_tests::promises` says what must hold.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| plcc_tests::promises::socket(bytes));
