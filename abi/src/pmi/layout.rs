//! Sizes and counts that the compiler and the executive of PMI share.

/// Bytes of the physical lines, one a port: 16 MAX boards of 128 ports (rulings, PMI).
pub const PORTS: u32 = 16 * 128;
