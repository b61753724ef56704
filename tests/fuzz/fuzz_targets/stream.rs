//! The target `stream` of `retina_tests::fuzzed`, by coverage.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| retina_tests::fuzzed::stream(bytes));
