//! Failures: why a command could not do its work, and the exit statuses.

use std::fmt::Display;
use std::path::Path;

use crate::compile::CompileError;

/// Exit status: done.
pub(crate) const DONE: u8 = 0;
/// Exit status: the source has errors.
pub(crate) const ERRORS: u8 = 1;
/// Exit status: wrong usage, or a file that can't be read, written or used.
pub(crate) const USAGE: u8 = 2;
/// Exit status: the program was stopped by a run-time fault.
pub(crate) const STOPPED: u8 = 3;
/// Exit status: the compiler has made a mistake.
pub(crate) const INTERNAL: u8 = 4;

/// A command's failure. Its message says which file or option is meant.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// The user can do something about it: exit status 2.
    Usage(String),
    /// The compiler has made a mistake: exit status 4, with a request for a report.
    Internal(String),
}

impl Failure {
    /// A failure that the user can do something about.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }

    /// A failure because of a file: `path: what`.
    pub(crate) fn file(path: &Path, what: impl Display) -> Self {
        Self::Usage(format!("{}: {what}", path.display()))
    }

    /// A failure because of a mistake of the compiler.
    pub(crate) fn internal(error: impl Display) -> Self {
        Self::Internal(error.to_string())
    }

    /// The exit status.
    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Usage(_) => USAGE,
            Self::Internal(_) => INTERNAL,
        }
    }

    /// The text for people. For a mistake of the compiler it says what a report needs: the version,
    /// the machine, and the `command` line.
    pub(crate) fn text(&self, command: &str) -> String {
        match self {
            Self::Usage(message) => message.clone(),
            Self::Internal(message) => format!(
                "internal error of the compiler: {message}\n\
                 This is a mistake in plcc, not in your program. {}",
                request_for_report(command),
            ),
        }
    }
}

/// The command line of this process.
pub(crate) fn command_line() -> String {
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    words.collect::<Vec<_>>().join(" ")
}

/// What a person is asked for who meets a mistake of the compiler.
pub(crate) fn request_for_report(command: &str) -> String {
    format!(
        "Please report it, and send along:\n  \
         this message\n  \
         the version: plcc {} for {} {}\n  \
         the command line: {command}\n  \
         the source with the files that it includes and the machine file, if you may share \
         them; else the\n  smallest part of the source that shows the error",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS,
    )
}

impl From<CompileError> for Failure {
    fn from(error: CompileError) -> Self {
        let message = format!("the program can't be compiled: {error}");
        if error.is_internal() { Self::Internal(message) } else { Self::Usage(message) }
    }
}

#[cfg(test)]
mod tests {
    use plcc_codegen::CodegenError;
    use plcc_frontend::common::BrokenInvariant;

    use super::*;

    #[test]
    fn a_mistake_of_the_compiler_is_status_4_and_asks_for_a_report() {
        let error = BrokenInvariant::at("a value is missing", "mill.pmc", 12);
        let failure = Failure::from(CompileError::from(error));
        assert_eq!(failure.status(), 4);
        let text = failure.text("plcc build mill.pmc");
        for part in [
            "internal error",
            "a value is missing (at mill.pmc:12)",
            "report",
            env!("CARGO_PKG_VERSION"),
            "plcc build mill.pmc",
            "the source",
        ] {
            assert!(text.contains(part), "`{part}` is not in\n{text}");
        }
        let error = plcc_codegen::InternalError {
            function: Some("chunk3".into()),
            instruction: Some("inst7".into()),
            place: Some(("mill.pmc".into(), 12)),
            reason: "v1 is not defined".into(),
        };
        let error = CodegenError::Internal(Box::new(error));
        let failure = Failure::from(CompileError::from(error));
        assert_eq!(failure.status(), 4);
        let text = failure.text("plcc build mill.pmc");
        let place = "v1 is not defined; function `chunk3`, instruction inst7 (at mill.pmc:12)";
        assert!(text.contains(place) && text.contains("report"), "{text}");
    }

    #[test]
    fn what_the_user_can_mend_is_status_2() {
        let failure = Failure::from(CompileError::from(CodegenError::TooLong(None)));
        assert_eq!(failure.status(), 2);
        assert!(!failure.text("plcc build big.pmi").contains("report"));
    }
}
