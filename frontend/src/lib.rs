//! PMI, NCT and PMAC: source text to IR.
