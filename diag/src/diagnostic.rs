//! One finding about a program: an error, a warning or a note.

use std::borrow::Cow;

use crate::Span;

/// A text of a diagnostic. Most are in the compiler and need no memory of their own, which counts
/// where a source of a mebibyte is nothing but mistakes.
pub type MessageText = Cow<'static, str>;

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

/// Gives back what `format!` has reserved beyond a text's end.
fn without_spare_capacity(mut text: MessageText) -> MessageText {
    if let Cow::Owned(owned) = &mut text {
        owned.shrink_to_fit();
    }
    text
}

/// A further place in the source that explains a diagnostic, such as an earlier declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What is to be seen there, in a few words.
    pub text: MessageText,
}

/// A text that is to stand in the place of another one, which mends what a diagnostic tells of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replacement {
    /// What is replaced.
    pub span: Span,
    /// What is to stand there.
    pub text: MessageText,
}

/// What few diagnostics have. It is outside of them, so that the others stay small.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Details {
    replacement: Option<Replacement>,
    labels: Vec<Label>,
    notes: Vec<MessageText>,
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
    pub message: MessageText,
    /// The place that it is about.
    pub span: Span,
    /// What to do about it.
    pub help: Option<MessageText>,
    details: Option<Box<Details>>,
}

impl Diagnostic {
    fn new(severity: Severity, code: &'static str, span: Span, message: MessageText) -> Self {
        let message = without_spare_capacity(message);
        Self { code, severity, message, span, help: None, details: None }
    }

    /// An error: the program is refused. `message` is one sentence without a full stop.
    pub fn error(code: &'static str, span: Span, message: impl Into<MessageText>) -> Self {
        Self::new(Severity::Error, code, span, message.into())
    }

    /// A warning: the program is accepted. `message` is one sentence without a full stop.
    pub fn warning(code: &'static str, span: Span, message: impl Into<MessageText>) -> Self {
        Self::new(Severity::Warning, code, span, message.into())
    }

    /// A diagnostic that is itself a note: something worth knowing that is neither an error nor a
    /// warning. `message` is one sentence without a full stop. (To add a note to another diagnostic
    /// there is [`note`](Self::note).)
    pub fn standalone_note(
        code: &'static str,
        span: Span,
        message: impl Into<MessageText>,
    ) -> Self {
        Self::new(Severity::Note, code, span, message.into())
    }

    /// Adds a further place and says, in a few words, what is to be seen there.
    pub fn label(mut self, span: Span, text: impl Into<MessageText>) -> Self {
        let labels = &mut self.details.get_or_insert_default().labels;
        // Most have one, and the usual reserve would be four.
        labels.reserve_exact(1);
        labels.push(Label { span, text: text.into() });
        self
    }

    /// Adds a further fact, a sentence.
    pub fn note(mut self, text: impl Into<MessageText>) -> Self {
        self.add_note(text);
        self
    }

    /// Does what [`note`](Self::note) does, to a diagnostic that is not just being made.
    pub fn add_note(&mut self, text: impl Into<MessageText>) {
        let notes = &mut self.details.get_or_insert_default().notes;
        notes.reserve_exact(1);
        notes.push(text.into());
    }

    /// Says what to do about it.
    pub fn help(mut self, text: impl Into<MessageText>) -> Self {
        self.help = Some(without_spare_capacity(text.into()));
        self
    }

    /// Says what was probably meant in the place of what the diagnostic is about. Editors offer to write that.
    pub fn did_you_mean(self, text: impl Into<MessageText>) -> Self {
        let text = text.into();
        let help = format!("did you mean {text}?");
        self.replace(text).help(help)
    }

    /// Gives the text that mends it in the place of what it is about, for editors.
    pub fn replace(mut self, text: impl Into<MessageText>) -> Self {
        self.set_replacement(text);
        self
    }

    /// Gives the text that mends it, and where it is to stand; a span without length is a place where it is inserted.
    pub fn replace_at(mut self, span: Span, text: impl Into<MessageText>) -> Self {
        let replacement = Replacement { span, text: text.into() };
        self.details.get_or_insert_default().replacement = Some(replacement);
        self
    }

    /// Does what [`replace`](Self::replace) does, to a diagnostic that is not just being made.
    pub fn set_replacement(&mut self, text: impl Into<MessageText>) {
        let replacement = Replacement { span: self.span, text: text.into() };
        self.details.get_or_insert_default().replacement = Some(replacement);
    }

    /// The text that mends it, if that is known.
    pub fn replacement(&self) -> Option<&Replacement> {
        self.details.as_ref().and_then(|details| details.replacement.as_ref())
    }

    /// Further places that explain it.
    pub fn labels(&self) -> &[Label] {
        self.details.as_ref().map_or(&[], |details| &details.labels)
    }

    /// Further facts, each a sentence.
    pub fn notes(&self) -> &[MessageText] {
        self.details.as_ref().map_or(&[], |details| &details.notes)
    }

    /// Whether it is an error, so that the program is refused.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}
