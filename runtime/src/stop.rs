//! Why a control stops its program, and where in the source that was.

use std::fmt;

use plcc_abi::{SourceLine, TrapCode};

/// A line of a source, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The source's name as given when the program was compiled.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
}

impl Place {
    /// The place of a statement of a program; `None` if the program has no such source.
    pub(crate) fn new(files: &[String], statement: SourceLine) -> Option<Self> {
        let SourceLine { file, line } = statement;
        Some(Self { file: files.get(file as usize)?.clone(), line })
    }

    /// Says at the end of a sentence where the watchdog stopped a scan, if that is known.
    pub(crate) fn where_stopped(place: Option<&Self>) -> String {
        place.map_or_else(String::new, |place| format!("; it was stopped in {place}"))
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {} of {}", self.line, self.file)
    }
}

/// Why a control stopped its program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stop {
    /// The control's own code: `NO PMI DATA`, `PLC TIMEOUT1`, `CALL DEPTH`, `WATCHDOG`; or
    /// `INTERNAL ERROR` for an error in plcc.
    pub code: String,
    /// What happened, for people; the same in every engine. It names the line.
    pub message: String,
    /// The statement that is to blame, if any is.
    pub place: Option<Place>,
}

impl Stop {
    /// The stop after a trap that no program of the control's language can cause, the same for
    /// every control. The outputs are not written from the scan in which it happened.
    pub(crate) fn internal_error(code: TrapCode) -> Self {
        let what = match code {
            TrapCode::HostPanic => {
                "a function of the control failed while the program called it".to_owned()
            }
            _ => format!("a scan ended as none of this language can end (`{}`)", code.name()),
        };
        Self {
            code: "INTERNAL ERROR".into(),
            message: format!(
                "{what} (an error in plcc; please report it with the program); the outputs were \
                 not written from this scan, and the control does not scan again"
            ),
            place: None,
        }
    }
}
