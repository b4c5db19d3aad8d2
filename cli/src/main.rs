//! Native code for the PLC programs of machine tools.

fn main() {}
