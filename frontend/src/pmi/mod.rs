//! The PMI language (Sieb & Meyer SERIES 8).
//!
//! `read` makes statements of the text, `analyse` a checked program of the statements. The
//! layout of the process image, the IR (`lower`) and the statement interpreter (`oracle`) are made
//! from the checked program.
//! Where the manual is silent or contradicts itself, the rulings in the project's `docs/pmi.md`
//! decide.
//!
//! Architecture Invariant: a checked program has no trees. All expressions are operations in
//! postfix order in one vector, all statements are steps with jump targets in another, so no
//! function recurses on the length of a program.

mod access;
mod analyse;
mod ast;
mod contacts;
mod export;
mod expression;
mod language;
mod layout;
mod lower;
mod names_in_source;
mod oracle;
mod presentation;
mod read;
mod reference;
mod tables;
mod words;

use plcc_abi::Engine;
use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::common::{CrossReference, FileLoader, Limits, LowerError, Lowered, Options, Words};
use ast::Checked;
use read::syntax::Text;

pub use language::Pmi;
pub use oracle::Interpreter;
pub use reference::executive::{executive_names, explain};

/// A program without errors.
#[derive(Clone, Debug)]
pub struct Program {
    checked: ast::Checked,
    /// What was read of the sources, for the words of displays.
    text: std::sync::Arc<Text>,
    layout: layout::Layout,
    /// The files, shared by all that is made of the program.
    sources: SourceMap,
    /// The limits that the program was checked with; they hold for [`expression`](Self::expression)
    /// too.
    limits: Limits,
    /// The table of names for expressions.
    names: expression::NameTable,
    /// What is shown of the program.
    known: std::sync::OnceLock<presentation::Known>,
}

/// Reads and checks the program in `file`; included files are asked of `loader` and added to
/// `sources`. There is a program where no diagnostic is an error.
pub fn check(
    sources: &mut SourceMap,
    file: FileId,
    loader: &dyn FileLoader,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let (checked, text, diagnostics) = analyse::check(sources, file, loader, options);
    finish((checked, text), diagnostics, sources, options)
}

/// Finds the words of the sources, and then does the same.
pub(crate) fn words_and_rest(
    sources: &mut SourceMap,
    file: FileId,
    loader: &dyn FileLoader,
    options: &Options,
) -> (Words, impl FnOnce(&SourceMap) -> (Option<Program>, Vec<Diagnostic>) + use<>) {
    let (checked, text, diagnostics) = analyse::check(sources, file, loader, options);
    let words = words::words(&checked, &text, sources);
    let options = options.clone();
    (words, move |sources: &SourceMap| finish((checked, text), diagnostics, sources, &options))
}

/// The program that was read, if no diagnostic is an error, and the diagnostics with the lints.
fn finish(
    (checked, text): (Checked, Text),
    mut diagnostics: Vec<Diagnostic>,
    sources: &SourceMap,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    if !diagnostics.iter().any(Diagnostic::is_error) {
        diagnostics.extend(analyse::lints::find(&checked));
        diagnostics.sort_by_key(|diagnostic| (diagnostic.span.file, diagnostic.span.start));
    }
    options.lints.apply(sources, &mut diagnostics, &["?"], Some('#'));
    if diagnostics.iter().any(Diagnostic::is_error) {
        return (None, diagnostics);
    }
    let layout = layout::Layout::new(&checked);
    let (sources, names) = (sources.clone(), expression::NameTable::default());
    let (limits, known) = (options.limits, std::sync::OnceLock::new());
    let text = text.into();
    (Some(Program { checked, text, layout, sources, limits, names, known }), diagnostics)
}

impl Program {
    /// The program as IR, with the executive's tables.
    ///
    /// # Errors
    /// When the program is too long, or the compiler finds its own data inconsistent.
    pub fn lower(&self) -> Result<Lowered, LowerError> {
        self.lower_with(&self.layout)
    }

    /// The same, with the variable `name` where it would be if it were named `old`.
    fn lower_in_place_of(&self, name: &str, old: &str) -> Result<Lowered, LowerError> {
        let spelled = |it| if it == name { old } else { it };
        self.lower_with(&layout::Layout::in_order_of(&self.checked, spelled))
    }

    fn lower_with(&self, layout: &layout::Layout) -> Result<Lowered, LowerError> {
        let module = lower::lower(&self.checked, layout, &self.sources)?;
        let ids = (0..self.sources.len() as u32).map(FileId);
        let names = ids.map(|id| self.sources.path(id).to_owned()).collect();
        let program = tables::program(&self.checked, layout, names, module.tasks.clone())?;
        Ok(Lowered { program, module, return_stack: None })
    }

    /// Where each variable is read, written and tested.
    pub fn cross_reference(&self) -> CrossReference {
        analyse::cross_reference::cross_reference(&self.checked, &self.sources)
    }

    /// The statement interpreter, as an engine like the others.
    pub fn interpreter(&self) -> Box<dyn Engine> {
        Box::new(Interpreter::new(&self.checked, &self.layout))
    }

    /// A statement interpreter that counts how often each statement runs.
    pub fn counting_interpreter(&self) -> Interpreter {
        Interpreter::new(&self.checked, &self.layout).counting()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::MemoryLoader;

    fn program(text: &str) -> Program {
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmi", text.as_bytes());
        check(&mut sources, file, &MemoryLoader::new(), &Options::default()).0.unwrap()
    }

    #[test]
    fn delays_and_constants_are_found_in_the_source() {
        let text = "$LOGICAL\nL=T\n$INTEGER\nC = -12, A[2]=[3, #\n 4], V\n$TIMER\nE/TC/DC = 50\n$KEY\nK=\"X\"\n\
                    $END\nTC=T\nV=C\n";
        let program = program(text);
        let place = |name: &str| {
            let span = program.checked.place_of_value(name)?;
            program.sources.text(span.file).get(span.start as usize..span.end as usize)
        };
        for (name, value) in [("TC#DELAY", "50"), ("C", "-12"), ("A[0]", "3"), ("A[1]", "4")] {
            assert_eq!(place(name), Some(value), "{name}");
        }
        for name in ["TC", "DC#DELAY", "V", "L", "K", "A", "A[2]", "C[0]", "A[", "X"] {
            assert_eq!(place(name), None, "{name}");
        }
    }

    #[test]
    fn what_lowering_misses_is_an_internal_error_with_its_line() {
        let sound = program("$TIMER\nE/TC/DC = 5\n$END\nX = T\nTC = X\n");
        assert!(sound.lower().is_ok());
        let message = |broken: Program| broken.lower().unwrap_err().to_string();

        let mut broken = sound.clone();
        broken.layout = layout::Layout::default();
        assert_eq!(message(broken), "region `logical` is missing");

        let mut broken = sound.clone();
        broken.layout.counters.clear();
        assert_eq!(message(broken), "the timer of TC is missing (at a.pmi:5)");

        let mut broken = sound.clone();
        broken.checked.symbols.pop();
        assert!(message(broken).ends_with("is missing (at a.pmi:4)"));

        let mut broken = sound;
        broken.checked.steps.iter_mut().for_each(|step| {
            step.action =
                ast::Action::Assign { target: ast::Target::Scalar(ast::SymbolId(0)), value: 0..0 };
        });
        assert_eq!(message(broken), "an operand is missing (at a.pmi:4)");
    }
}
