//! What compiled programs and their host agree on.
