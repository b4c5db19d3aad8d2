//! The loader for the controller: runs compiled artifacts, holds no compiler.

fn main() {}
