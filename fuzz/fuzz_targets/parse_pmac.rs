#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| plcc_tests::oracle::parse_pmac(bytes));
