//! IR to machine code.
