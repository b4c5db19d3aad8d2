//! One finding about a program: an error, a warning or a note.

use crate::Span;

/// How serious a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The program is refused.
    Error,
    /// The program is accepted, but perhaps does not do what its author meant.
    Warning,
    /// Something worth knowing, such as a part of the source that was skipped.
    Note,
}

impl Severity {
    /// The word for it in JSON: `error`, `warning` or `note`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// A further place in the source that explains a diagnostic, such as an earlier declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What is to be seen there, in a few words.
    pub text: String,
}

/// One finding: what is wrong, where, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub struct Diagnostic {
    /// Its code, such as `PMI-31`; [`find_code`](crate::find_code) has a page for each.
    pub code: &'static str,
    /// How serious it is.
    pub severity: Severity,
    /// What is wrong: one sentence without a full stop.
    pub message: String,
    /// The place that it is about.
    pub span: Span,
    /// Further places that explain it.
    pub labels: Vec<Label>,
    /// Further facts, each a sentence.
    pub notes: Vec<String>,
    /// What to do about it.
    pub help: Option<String>,
}

impl Diagnostic {
    fn new(severity: Severity, code: &'static str, span: Span, message: String) -> Self {
        Self { code, severity, message, span, labels: vec![], notes: vec![], help: None }
    }

    /// An error: the program is refused. `message` is one sentence without a full stop.
    pub fn error(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, span, message.into())
    }

    /// A warning: the program is accepted. `message` is one sentence without a full stop.
    pub fn warning(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, span, message.into())
    }

    /// A diagnostic that is itself a note: something worth knowing that is neither an error nor a
    /// warning. `message` is one sentence without a full stop. (To add a note to another diagnostic
    /// there is [`note`](Self::note).)
    pub fn standalone_note(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Note, code, span, message.into())
    }

    /// Adds a further place and says, in a few words, what is to be seen there.
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Adds a further fact, a sentence.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.notes.push(text.into());
        self
    }

    /// Says what to do about it.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// Whether it is an error, so that the program is refused.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}
