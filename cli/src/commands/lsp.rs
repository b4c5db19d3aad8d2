//! `plcc lsp`: the Language Server Protocol on standard input and output.

use std::path::Path;

use clap::Parser;
use plcc_codegen::{Optimization, Target};
use plcc_diag::Diagnostic;
use plcc_frontend::CheckedProgram;
use plcc_lsp::{Compiler, Run};

use super::lsp_run;
use super::test::scripts;
use crate::args::{Cli, Command};
use crate::compile::{Optimized, code};
use crate::failure::{DONE, Failure};
use crate::report::Report;

pub(crate) fn lsp(report: &Report) -> Result<u8, Failure> {
    plcc_lsp::serve_stdio(&WholeCompiler { report }).map_err(|error| {
        Failure::usage(format!(
            "standard input is not a stream of messages of the Language Server Protocol, which an editor \
             writes: {error}"
        ))
    })?;
    Ok(DONE)
}

/// What the server asks of the compiler as a whole.
struct WholeCompiler<'r> {
    report: &'r Report,
}

impl Compiler for WholeCompiler<'_> {
    fn code(&self, program: &dyn CheckedProgram, renamed: Option<(&str, &str)>) -> Option<Vec<u8>> {
        let lowered = match renamed {
            Some((new, old)) => program.lower_in_place_of(new, old),
            None => program.lower(),
        };
        let (optimized, _) = Optimized::of(lowered.ok()?, Optimization::ALL);
        Some(code(&optimized, &Target::host().ok()?).ok()?.bytes.clone())
    }

    fn mistakes_of_script(&self, path: &Path, text: &str) -> Vec<Diagnostic> {
        // As `plcc test` with its own settings, but nothing is compiled.
        let words = ["plcc", "test", "--engine=interp", "--"].map(AsRef::<Path>::as_ref);
        match Cli::try_parse_from(words.into_iter().chain([path])).map(|cli| cli.command) {
            Ok(Command::Test(args)) => scripts::mistakes(path, text, &args, self.report),
            _ => vec![],
        }
    }

    fn open_run(&self, path: &Path, program: &Path) -> Result<Box<dyn Run>, String> {
        lsp_run::open(path, program)
    }
}
