//! Tests of the IR: its text form, the verifier, the passes, the interpreter, and the native code that
//! is made of it.
#![allow(clippy::indexing_slicing)]

mod counters;
mod decoders;
mod divide;
mod filetests;
mod integer_variables;
mod ir_text;
mod passes;
mod rows;
mod states;
mod text;
mod toggles;
mod vectors;
