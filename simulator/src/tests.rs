//! Tests with variables that are nothing but a table of names.
