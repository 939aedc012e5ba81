//! What a vertebra says it is: objects 0x1000, 0x1008, 0x100A and 0x1018.

/// Object 0x1000: no standard device profile (low 16 bits), three motors (high 16 bits).
pub const DEVICE_TYPE: u32 = 0x0003_0000;
/// Object 0x1008.
pub const DEVICE_NAME: &str = "Anguilla vertebra";
/// Object 0x100A.
pub const SOFTWARE_VERSION: &str = env!("CARGO_PKG_VERSION");
/// Object 0x1018:1: 0, because CiA has given this project no number.
pub const VENDOR: u32 = 0;
/// Object 0x1018:2: "eel" in ASCII, then the number of the product.
pub const PRODUCT: u32 = 0x6565_6C01;
/// Object 0x1018:3: major revision of the dictionary in the high half, minor in the low one.
pub const REVISION: u32 = 0x0001_0000;
