//! The executive of PMI.
