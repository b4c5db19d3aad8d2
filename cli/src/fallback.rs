//! Compiles programs of which the passes or code generation make something wrong.
//!
//! A program that is checked and lowered is right. If the passes panic on it, or the verifier or Cranelift refuses what
//! they made of one of its functions, that is a mistake in plcc. The function is then compiled as the front end wrote it:
//! it takes longer to run and does the same. A warning names its lines and asks for a report.
//!
//! Where the environment variable `PLCC_NO_FALLBACK` is set, as in tests and CI, such a mistake is an error instead, so that
//! nothing is hidden there.

use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};

use plcc_abi::printable;
use plcc_codegen::{CodegenError, CodegenOptions, InternalError, Optimization, panic_text};
use plcc_frontend::common::Lowered;
use plcc_ir::{FuncData, Module};

use crate::compile::{CompileError, Optimized};
use crate::failure;

/// After this many refused functions all are compiled as the front end wrote them.
const MOST_REFUSED: usize = 8;

/// Lowers a program, optimises it, and has `make` make what is wanted of it, once more for each function that is refused.
/// `lower` gives the same each time.
///
/// # Errors
/// Those of `lower` and `make`. A mistake of the passes is an error only if it is still there without them.
pub(crate) fn compiled<T>(
    lower: impl Fn() -> Result<Lowered, CompileError>,
    how: Optimization,
    make: impl Fn(&Optimized) -> Result<T, CompileError>,
) -> Result<(Optimized, T), CompileError> {
    if is_allowed() {
        return with_fallback(lower, how, make);
    }
    let optimized = Optimized::of(lower()?, how).0;
    let made = make(&optimized)?;
    Ok((optimized, made))
}

/// Whether a mistake of the compiler is not an error while the program can be compiled without optimisation.
pub(crate) fn is_allowed() -> bool {
    std::env::var_os("PLCC_NO_FALLBACK").is_none()
}

/// Does what [`compiled`] does where a mistake of the compiler is not an error: puts functions that `make` refuses back to what
/// the front end wrote.
fn with_fallback<T>(
    lower: impl Fn() -> Result<Lowered, CompileError>,
    how: Optimization,
    make: impl Fn(&Optimized) -> Result<T, CompileError>,
) -> Result<(Optimized, T), CompileError> {
    let lowered = lower()?;
    let mut is_plain = how == Optimization::NONE;
    let mut optimized = match catch_unwind(AssertUnwindSafe(|| Optimized::of(lowered, how).0)) {
        Ok(optimized) => optimized,
        Err(panic) => {
            warn("the program is", panic_text(&*panic));
            is_plain = true;
            lower()?.into()
        }
    };
    let mut refused: Vec<String> = vec![];
    loop {
        let error = match make(&optimized) {
            Ok(made) => return Ok((optimized, made)),
            Err(error) => error,
        };
        let CompileError::Codegen(CodegenError::Internal(internal)) = &error else {
            return Err(error);
        };
        let Some(name) = &internal.function else { return Err(error) };
        let plain = lower()?.module;
        let Some((_, own)) = plain.funcs().find(|(_, func)| func.name() == name) else {
            return Err(error);
        };
        if is_plain {
            return Err(error);
        }
        warn(&lines(&plain, own), &reason(internal));
        if refused.contains(name) || refused.len() == MOST_REFUSED {
            // Code generation has techniques of its own, which are left out with the passes.
            optimized = Optimized { module: plain, codegen: CodegenOptions::NONE, ..optimized };
            is_plain = true;
            continue;
        }
        refused.push(name.clone());
        optimized.module.replace_function(own);
    }
}

/// What is wrong, without the place: the warning names the lines.
fn reason(error: &InternalError) -> String {
    InternalError { place: None, ..error.clone() }.to_string()
}

/// The lines of a function, as the subject of a sentence.
fn lines(module: &Module, func: &FuncData) -> String {
    let insts = func.blocks().flat_map(|(_, block)| &block.insts);
    let lines: Vec<_> = insts.filter_map(|&inst| module.line(func.loc(inst))).collect();
    // Where statements of an included file are among them, those of the first one's file are named.
    let Some(first) = lines.first() else { return "a part of the program is".into() };
    let own = || lines.iter().filter(|line| line.file == first.file).map(|line| line.line);
    let (from, to) = (own().min().unwrap_or(first.line), own().max().unwrap_or(first.line));
    let file = module.files.get(first.file as usize).map_or("the program", |file| &file.name);
    match from == to {
        true => format!("line {from} of {file} is"),
        false => format!("lines {from} to {to} of {file} are"),
    }
}

/// Tells that something is compiled as it is.
fn warn(subject: &str, reason: &str) {
    let text = format!(
        "{subject} compiled without optimisation, since the compiler has made a mistake there: {reason}\n\
         The program does the same, and takes longer. {}",
        failure::request_for_report(&failure::command_line())
    );
    // Where nobody reads standard error the program runs nevertheless.
    let _ = writeln!(io::stderr(), "warning: {}", printable(&text));
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use plcc_abi::Dialect;
    use plcc_diag::SourceMap;
    use plcc_frontend::common::{MemoryLoader, Options};
    use plcc_ir::passes::OptLevel;
    use plcc_ir::text::{parse, print};

    use super::*;
    use crate::compile::{Checked, check, jit};

    /// A program of several functions, which the passes make shorter. Its last statement is in line 707.
    fn program() -> Checked {
        let mut sources = SourceMap::new();
        let many = "P1=(P1+P2)&7\n".repeat(700);
        let text = format!(
            "I5=2\nOPEN PLC1 CLEAR\n{many}CLOSE\nOPEN PLC2 CLEAR\nP2=P1|8\n\nP3=P2^1\nCLOSE\n"
        );
        let file = sources.add("two.pmc", text.as_bytes());
        let (options, loader) = (Options::default(), MemoryLoader::new());
        let (checked, found) = check(&mut sources, &[file], Dialect::Pmac, &loader, &options);
        checked.unwrap_or_else(|| panic!("{found:?}"))
    }

    fn optimized(checked: &Checked) -> Optimized {
        checked.optimized(OptLevel::Speed).unwrap()
    }

    /// The text of each function of a module.
    fn functions(module: &Module) -> Vec<String> {
        print(module).split("\nfn ").skip(1).map(str::to_owned).collect()
    }

    /// A module in which the last function adds a double to an integer.
    fn broken(optimized: &Optimized) -> Optimized {
        let text = print(&optimized.module);
        let at = text.rfind("    return").unwrap();
        let (before, after) = text.split_at(at);
        let wrong = "    v9001: f64 = fconst 1.0\n    v9002: i32 = iconst 1\n    v9003: f64 = fadd v9001, v9002\n";
        let module = parse(&format!("{before}{wrong}{after}")).unwrap();
        Optimized { module, ..optimized.clone() }
    }

    #[test]
    fn a_function_that_is_refused_is_compiled_as_it_was_lowered() {
        let checked = program();
        let plain = checked.lower().unwrap();
        let best = optimized(&checked);
        let (plain_texts, best_texts) = (functions(&plain.module), functions(&best.module));
        let tried = RefCell::new(0);
        let make = |optimized: &Optimized| {
            *tried.borrow_mut() += 1;
            if *tried.borrow() == 1 { jit(&broken(optimized)) } else { jit(optimized) }
        };
        let (made, _) = with_fallback(|| checked.lower(), Optimization::ALL, make).unwrap();
        assert_eq!(*tried.borrow(), 2);
        let texts = functions(&made.module);
        let last = texts.len() - 1;
        assert!(last > 0, "{texts:?}");
        assert_eq!(texts[last], plain_texts[last]);
        assert_eq!(texts[..last], best_texts[..last]);
        assert_ne!(plain_texts[last], best_texts[last]);
    }

    #[test]
    fn what_is_refused_in_every_form_is_an_error_after_a_bounded_number_of_trials() {
        let checked = program();
        let tried = RefCell::new(0);
        let make = |optimized: &Optimized| {
            *tried.borrow_mut() += 1;
            jit(&broken(optimized))
        };
        let made = with_fallback(|| checked.lower(), Optimization::ALL, make);
        let error = made.map(drop).unwrap_err();
        assert!(error.is_internal(), "{error}");
        assert_eq!(*tried.borrow(), 3);
    }

    /// A program is as the front end wrote it only if no pass has run, whatever code generation may do.
    #[test]
    fn passes_alone_are_left_out_of_a_function_that_is_refused() {
        let checked = program();
        let passes_alone = Optimization { codegen: CodegenOptions::NONE, ..Optimization::ALL };
        let tried = RefCell::new(0);
        let make = |optimized: &Optimized| {
            *tried.borrow_mut() += 1;
            if *tried.borrow() == 1 { jit(&broken(optimized)) } else { jit(optimized) }
        };
        assert!(with_fallback(|| checked.lower(), passes_alone, make).is_ok());
        assert_eq!(*tried.borrow(), 2);
    }

    #[test]
    fn a_warning_names_the_lines_of_the_function() {
        let plain = program().lower().unwrap();
        let all: Vec<String> =
            plain.module.funcs().map(|(_, func)| lines(&plain.module, func)).collect();
        assert!(all[0].starts_with("lines 3 to "), "{all:?}");
        assert!(
            all.len() > 1 && all.iter().any(|lines| lines.ends_with(" to 707 of two.pmc are")),
            "{all:?}"
        );
    }
}
