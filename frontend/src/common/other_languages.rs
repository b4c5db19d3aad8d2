//! What is said to people who know other languages: structured text, instruction lists, C, part
//! programs. Each language has a table of habits, `other_languages.tsv`: the words and signs that
//! such people write, and what the language has in their place. The language's own code says in
//! which context an error is and reads what is written there; [`Habits`] finds the row.

use plcc_diag::Diagnostic;

use super::tsv::{self, TsvError};

/// For how many errors of a program it is looked up what was probably meant. A text that is no
/// program at all may have an error in each of very many lines.
pub(crate) const EXPLAINED_ERRORS: usize = 1000;

/// What was probably meant: a help, and a message in place of the error's own if that would mislead.
pub(crate) struct Explanation {
    pub(crate) message: Option<String>,
    pub(crate) help: String,
    /// What to write in the place of what the error is about, where that alone mends it.
    pub(crate) replacement: Option<String>,
}

impl Explanation {
    /// The same, with what to write in the place of what the error is about.
    pub(crate) fn replacing(self, text: String) -> Self {
        Self { replacement: Some(text), ..self }
    }

    /// Says of an error what was probably meant.
    pub(crate) fn explain(self, error: &mut Diagnostic) {
        if let Some(message) = self.message {
            error.message = message.into();
        }
        if let Some(text) = self.replacement {
            error.set_replacement(text);
        }
        error.help = Some(self.help.into());
    }
}

/// An explanation with a message in place of the error's own.
pub(crate) fn explanation(
    message: impl Into<String>,
    help: impl Into<String>,
) -> Option<Explanation> {
    Some(Explanation { message: Some(message.into()), help: help.into(), replacement: None })
}

/// An explanation beside the error's own message.
pub(crate) fn help(help: impl Into<String>) -> Option<Explanation> {
    Some(Explanation { message: None, help: help.into(), replacement: None })
}

/// The table of a language. Its columns are the context in which something is written, the words or
/// signs, divided by blanks, and the help. In the help, `{}` is what was written.
pub(crate) struct Habits(Vec<(&'static str, &'static str, &'static str)>);

impl Habits {
    /// Reads the table `text`, which is in `file`.
    ///
    /// # Errors
    /// The first row that is malformed, or has a word that its context has already.
    pub(crate) fn load(file: &'static str, text: &'static str) -> Result<Self, TsvError> {
        let mut habits = Self(vec![]);
        for row in tsv::rows(file, text, &["context", "written", "help"]) {
            let row = row?;
            let (context, written) = (row.text("context")?, row.text("written")?);
            for word in written.split(' ') {
                if habits.help(context, word).is_some() {
                    return Err(row.error("written", format!("`{word}` is in an earlier row too")));
                }
            }
            habits.0.push((context, written, row.text("help")?));
        }
        Ok(habits)
    }

    /// The help for what is written in a context.
    pub(crate) fn help(&self, context: &str, written: &str) -> Option<String> {
        let (.., help) = self.0.iter().find(|(place, words, _)| {
            *place == context && words.split(' ').any(|word| word == written)
        })?;
        Some(help.replace("{}", written))
    }

    /// Whether something is written in a context.
    pub(crate) fn has(&self, context: &str, written: &str) -> bool {
        self.help(context, written).is_some()
    }

    /// The help for what is written in the first of these contexts that has it.
    pub(crate) fn help_in(&self, contexts: &[&str], written: &str) -> Option<String> {
        contexts.iter().find_map(|context| self.help(context, written))
    }
}

/// Of a program that is written in small letters throughout, keeps the first error about them
/// alone, with a note. `code` are the bytes of the program without comments and texts; `is_small`
/// finds the errors about small letters, `follows` those that only follow from them.
pub(crate) fn tell_small_letters_once(
    code: impl Iterator<Item = u8>,
    found: &mut Vec<Diagnostic>,
    is_small: impl Fn(&Diagnostic) -> bool,
    follows: impl Fn(&Diagnostic) -> bool,
) {
    let (mut small, mut capital) = (0_usize, 0_usize);
    for letter in code {
        small += usize::from(letter.is_ascii_lowercase());
        capital += usize::from(letter.is_ascii_uppercase());
    }
    let others = found.iter().filter(|diagnostic| is_small(diagnostic)).count();
    let Some(others) = others.checked_sub(1).filter(|_| small > 9 * capital) else { return };
    let elsewhere = match others {
        0 => String::new(),
        1 => ", at 1 other place too".to_owned(),
        others => format!(", at {others} other places too"),
    };
    let note = format!(
        "the whole program is in small letters{elsewhere}; `tr a-z A-Z < FILE` writes it in capitals"
    );
    let mut is_told = false;
    found.retain_mut(|diagnostic| {
        if !is_small(diagnostic) {
            return !follows(diagnostic);
        }
        if !std::mem::replace(&mut is_told, true) {
            diagnostic.add_note(note.clone());
            return true;
        }
        false
    });
}
