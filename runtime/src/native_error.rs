//! Why compiled code can't be run: the errors of [`NativeEngine::new`](crate::NativeEngine::new).

use std::io;

use thiserror::Error;

/// Why code can't be run.
#[derive(Debug, Error)]
pub enum NativeError {
    /// The operating system gives no executable memory.
    #[error("the operating system gives no executable memory: {0}")]
    Map(#[from] io::Error),
    /// The program and the code were not made together, or the memory does not hold the code.
    #[error("the code does not fit the program: {0}")]
    Misfit(&'static str),
    /// The code is for another architecture, or for a processor with features that this one lacks.
    /// Holds the architecture and those features.
    #[error("the code is for {0}, not for this machine")]
    Machine(String),
}
