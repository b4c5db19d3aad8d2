//! Tests of the IR: text form, verifier, passes and interpreter, and native code made of it.
#![allow(clippy::indexing_slicing)]

mod divide;
mod filetests;
mod passes;
mod rules;
mod text;
