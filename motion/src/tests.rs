//! Motors and programs without an engine.
