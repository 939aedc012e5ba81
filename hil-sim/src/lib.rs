//! In the making.
pub mod plant;
