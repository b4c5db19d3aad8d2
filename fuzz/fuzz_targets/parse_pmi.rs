//! Fuzzes the compiler with PMI programs; `plcc_tests::oracle` says what must hold.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| plcc_tests::oracle::parse_pmi(bytes));
