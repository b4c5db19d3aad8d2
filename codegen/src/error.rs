//! What can go wrong.

use thiserror::Error;

/// Why no code came out.
#[derive(Debug, Error)]
pub enum CodegenError {
    /// The target's name means nothing, or code for it can't be made.
    #[error("code for target `{triple}` can't be made: {reason}")]
    Target {
        /// The target as asked for.
        triple: String,
        /// Why not.
        reason: String,
    },
    /// Cranelift refuses a function: a fault of this compiler.
    #[error(
        "function `{function}` can't be compiled (a fault of plcc; please report it): {reason}"
    )]
    Function {
        /// The function's name in the IR.
        function: String,
        /// What Cranelift says.
        reason: String,
    },
    /// The system gives no memory to execute code in.
    #[error("no executable memory: {reason}")]
    Memory {
        /// Why not.
        reason: String,
    },
    /// The code is too long to be addressed.
    #[error("the program's code is over 2 GiB long; split the program")]
    TooLong,
}
