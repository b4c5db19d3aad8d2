//! What every language can be asked, and the list of the languages.
//!
//! The command line knows languages through [`Language`] and [`CheckedProgram`] alone. A further
//! language implements the two in a folder of its own and is added to [`LANGUAGES`].

use std::fmt;

use plcc_abi::{Dialect, Engine, GivenName, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use crate::common::{
    Controller, CrossReference, Exported, Expression, ExpressionCode, FileLoader, Logic,
    LowerError, Lowered, NumberFormat, Options, StatementInterpreter, Ways, Words,
};
use crate::presentation::{Presentation, Terminal};
use crate::{nct, pmac, pmi};

/// The languages, in the order of [`Dialect::ALL`]. Whatever is done for every language goes
/// through this list.
pub const LANGUAGES: &[&dyn Language] = &[&pmi::Pmi, &nct::Nct, &pmac::Pmac];

const _: () = assert!(LANGUAGES.len() == Dialect::ALL.len(), "LANGUAGES misses a language");

/// The language of a dialect.
#[allow(clippy::indexing_slicing, reason = "the assertion above holds the list to the dialects")]
pub fn language(dialect: Dialect) -> &'static dyn Language {
    LANGUAGES[dialect as usize]
}

/// What is left of a check when the words of the sources have been found: it gives the program and the diagnostics.
pub type RestOfCheck =
    Box<dyn FnOnce(&SourceMap) -> (Option<Box<dyn CheckedProgram>>, Vec<Diagnostic>)>;

/// Gives the title of a variable's class, by the variable's name.
pub type Titles<'t> = Box<dyn Fn(&str) -> &'static str + 't>;

/// A language: how its sources are recognised, checked and explained.
pub trait Language: Sync {
    /// The dialect of the programs; its name is the language's name on the command line.
    fn dialect(&self) -> Dialect;

    /// The name in headings, in capitals.
    fn title(&self) -> &'static str;

    /// Whose language it is, one line for `--help`.
    fn vendor(&self) -> &'static str;

    /// The extensions of file names, in small letters and without the point. An ending that several
    /// languages have decides nothing.
    fn file_extensions(&self) -> &'static [&'static str];

    /// Whether a text holds a word or sign that is only in programs of this language, such as
    /// `$INPUT`, `:001` or `OPEN PLC`. `plain` is the text in capitals, in which each comment and
    /// each text in quotes is replaced by a blank.
    fn has_marks(&self, plain: &str) -> bool;

    /// Whether several files can be one program, loaded in their order.
    fn joins_files(&self) -> bool {
        false
    }

    /// Whether `--controller` chooses among several controllers.
    fn has_controllers(&self) -> bool {
        false
    }

    /// Whether `--define` defines names for the program.
    fn takes_definitions(&self) -> bool {
        false
    }

    /// Whether [`check`](Self::check) makes a program in spite of errors, which `run --keep-going` runs.
    fn runs_despite_errors(&self) -> bool {
        false
    }

    /// What begins a comment.
    fn comment_signs(&self) -> &'static [&'static str];

    /// Whether a word is one of the language's keywords, in letters of any case.
    fn has_word(&self, _word: &str) -> bool {
        false
    }

    /// The codes of diagnostics for programs that are too long.
    fn length_codes(&self) -> LengthCodes;

    /// Reads and checks a program: one file, or several where the language
    /// [joins files](Self::joins_files). Included files are asked of `loader` and added to
    /// `sources`.
    ///
    /// The result is a program if no diagnostic is an error. PMAC makes one too if the only errors
    /// are broken structures: the PLCs that have them are empty in it (`run --keep-going`).
    fn check(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Option<Box<dyn CheckedProgram>>, Vec<Diagnostic>);

    /// Does what [`check`](Self::check) does in two parts, since editors ask for words more often than for the rest: first the
    /// words of the sources, also of programs with errors, then what `check` gives. A language may do all at first.
    fn words_and_rest(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Words, RestOfCheck);

    /// The words alone.
    fn words(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> Words {
        self.words_and_rest(sources, files, loader, options).0
    }

    /// Whether the warning with this code tells of something that is missing in a program and that
    /// another file of the same machine may provide. `plcc check` shows such a warning as a note.
    fn may_be_elsewhere(&self, _code: &str) -> bool {
        false
    }

    /// What `plcc explain` prints for a name of the language: a variable, a keyword, a word of
    /// memory. If the language has several controllers and none is given, the text says what the
    /// name means on each of them. `None` if the name has no meaning of its own.
    fn explain(&self, name: &str, controller: Option<Controller>) -> Option<String>;

    /// Every name that is in a table of [`explain`](Self::explain). A line for a family of
    /// names (`@CP100-@CP115`) counts as its first name.
    fn topics(&self) -> Vec<Topic>;

    /// Statements that editors write as a whole: the word that is typed, the text in the form of snippets of the Language
    /// Server Protocol, and what it does.
    fn snippets(&self) -> &'static [(&'static str, &'static str, &'static str)];

    /// The condition that two outputs of one line each are both on.
    fn both_on(&self, a: &str, b: &str) -> String;

    /// How numbers are written for people.
    fn numbers(&self) -> NumberFormat;

    /// Whether a scan that was suspended is one with its beginning when it goes on. Where it is not, each part that runs
    /// without a pause is a scan.
    fn scans_go_on(&self) -> bool;

    /// Whether the manual's display of statements shows those that the user has chosen, with the values above their text, rather
    /// than the whole program with the values at the right.
    fn chooses_statements(&self) -> bool {
        false
    }

    /// What a part of a program is called to which users go from the part before.
    fn part_title(&self) -> &'static str {
        "MODUL"
    }

    /// The control's terminal, if it has one, without a program.
    fn terminal(&self) -> Option<Box<dyn Terminal>> {
        None
    }

    /// The titles of the classes of variables, as the manual groups them, in the order in which they are shown.
    fn classes(&self) -> &'static [&'static str];

    /// The titles of the classes that the variables of a program with these tables belong to.
    fn titles<'t>(&self, tables: &'t Tables) -> Titles<'t>;

    /// Comments for the head of a program's listings. They say what the program's variables are,
    /// if the names alone do not.
    fn listing_comments(&self, _tables: &Tables) -> Vec<String> {
        Vec::new()
    }
}

/// The codes of diagnostics for programs that are too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LengthCodes {
    /// Too many instructions of IR.
    pub instructions: &'static str,
    /// Too many bytes of machine code.
    pub machine_code: &'static str,
}

/// A name that `plcc explain` can explain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// The name as it is written in programs.
    pub name: String,
    /// Its meaning in one line.
    pub meaning: String,
}

/// A program without errors, or one in which the PLCs that have errors are empty.
pub trait CheckedProgram: Presentation + fmt::Debug + Send + Sync {
    /// The language that the program is written in.
    fn dialect(&self) -> Dialect;

    /// The tables for the executive, and the IR as the front end makes it, before any pass.
    ///
    /// # Errors
    /// When the program is too long, or the compiler finds its own data inconsistent.
    fn lower(&self) -> Result<Lowered, LowerError>;

    /// What [`lower`](Self::lower) makes, but the variable `name` lies where it would if it were named `old`: in a language whose
    /// variables lie in the order of their names. So the machine code of a program can be compared with that of the same program
    /// before a name was given another spelling.
    ///
    /// # Errors
    /// As those of `lower`.
    fn lower_in_place_of(&self, _name: &str, _old: &str) -> Result<Lowered, LowerError> {
        self.lower()
    }

    /// The statement interpreter, as an engine like the others.
    fn interpreter(&self) -> Box<dyn Engine>;

    /// The statement interpreter, to be observed.
    fn statement_interpreter(&self) -> Box<dyn StatementInterpreter>;

    /// The place of each statement, by the number with which an
    /// [`Observer`](crate::common::Observer) is told of it. `None` for what is not a statement of its
    /// own to a reader: labels, the ends of conditions, the jump in front of an ELSE.
    fn statements(&self) -> Vec<Option<Span>>;

    /// The logic of each condition and each logical assignment, by the statements' numbers; `None` for statements that have
    /// none. `sources` are those that the program was read from.
    fn logic(&self, _sources: &SourceMap) -> Vec<Option<Logic>> {
        vec![]
    }

    /// Where control can go behind each statement, by the statements' numbers.
    fn ways(&self) -> Vec<Ways>;

    /// The numbers of the statements that called the subroutine in which the task that ran last
    /// is, outermost first. Empty in languages without subroutines.
    fn calls(&self, _image: &[u8]) -> Vec<u32> {
        vec![]
    }

    /// An expression or condition of the language over the program's variables, for breakpoints,
    /// triggers and watches; see `expression.rs` in the language's folder for what is one.
    ///
    /// # Errors
    /// What is wrong with it. Places are offsets in `text`, in the file 0: a source map that holds
    /// the text alone draws them.
    fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>>;

    /// The same expression as code; `None` where the language makes none of it.
    ///
    /// # Errors
    /// Those of [`expression`](Self::expression).
    fn expression_code(&self, _text: &str) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
        Ok(None)
    }

    /// Where each variable is read, written and tested.
    fn cross_reference(&self) -> CrossReference;

    /// What the text itself says of the variables: the names that a PMAC's `#define` gives them, and the comments behind
    /// their declarations. Of two for one variable the first counts.
    fn names_in_source(&self) -> Vec<GivenName> {
        vec![]
    }

    /// Whether a word means a variable, so that it can't be given to another one as an alias.
    fn has_name(&self, word: &str) -> bool {
        self.canonical(word).is_some()
    }

    /// The texts of PMI's keys in the order of their numbers, which begin with 1 (PMI 3.1.11). Other languages
    /// have none.
    fn key_texts(&self) -> Vec<String> {
        vec![]
    }

    /// Where the source has a number that PMI's DEBUG changes in a running program (PMI 5.2 `change`): the delay of the
    /// timer whose control contact is TC by the name `TC#DELAY`, a constant that is an INTEGER or LONG by its own name, an
    /// element of an array of them as `A[3]`. `None` for all other names, and in the other languages.
    fn place_of_value(&self, _name: &str) -> Option<Span> {
        None
    }

    /// The program in IEC 61131-3, under a name, with what the control does around it. `given` says what people say of the
    /// variables. `None` for languages that are not written so.
    ///
    /// # Errors
    /// The statements that can't be written so.
    fn export(
        &self,
        _name: &str,
        _given: &[GivenName],
    ) -> Option<Result<Exported, Vec<Diagnostic>>> {
        None
    }

    /// A line for each statement that says whether it is computed in integers or in floating point, or why the program
    /// can't be compiled. `None` for languages in which the types decide this.
    fn explain_arithmetic(&self) -> Option<Result<String, LowerError>> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_language_is_found_by_its_dialect() {
        for &dialect in Dialect::ALL {
            assert_eq!(language(dialect).dialect(), dialect);
            assert_eq!(language(dialect).title().to_lowercase(), dialect.name());
        }
    }
}
