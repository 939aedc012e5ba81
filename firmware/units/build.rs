//! Tells the crate whether the target has the DSP multiplies (SMMUL, SMMLA).
//!
//! Stable rustc does not show `target_feature = "dsp"` to `cfg`, so the target's name decides:
//! Armv7E-M has them, Armv7-M and every other machine take the fallback with the same bits.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(eel_dsp)");
    let target = std::env::var("TARGET").unwrap_or_default();
    if target.starts_with("thumbv7em-") {
        println!("cargo::rustc-cfg=eel_dsp");
    }
}
