#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| eel_fuzz::sdo::run(data));
