//! In the making.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]
