//! The executive of PMAC.
