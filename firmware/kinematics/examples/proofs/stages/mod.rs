//! The stages of the kernel, each as a trace and as the scripts that prove it.

pub mod columns_proofs;
pub mod direct;
pub mod direct_proofs;
pub mod inverse;
pub mod inverse_proofs;
pub mod inverse_ranges;
pub mod jacobian_proofs;
pub mod primitives;

use crate::script::Script;

/// Returns all scripts.
pub fn scripts() -> Vec<Script> {
    let mut scripts = primitives::scripts();
    scripts.extend(inverse_proofs::scripts());
    scripts.extend(direct_proofs::scripts());
    scripts.extend(columns_proofs::scripts());
    scripts.extend(jacobian_proofs::scripts());
    scripts
}
