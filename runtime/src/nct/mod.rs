//! The executive of NCT.
