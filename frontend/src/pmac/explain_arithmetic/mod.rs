//! The text that `--explain-arithmetic` prints: for each statement whether integers or doubles
//! compute it, and why.
//!
//! Which arithmetic computes a statement is decided by passes over IR (`integers` and `speculate`
//! of `plcc-ir`), which know nothing of the source. To say why in the user's words, this analyses
//! the statements themselves by the same rules; `tests/tests/pmac/explain.rs` holds the two
//! together.

mod analysis;
mod range_analysis;

use std::fmt::Write as _;

use plcc_abi::pmac::Kind;
use plcc_diag::SourceMap;

use self::analysis::{Name, Reason, analyse, bounds_of};
use self::range_analysis::Bounds;
use crate::pmac::analyse::assumptions::places_after_load;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Bin, Download, Func, Stmt, StmtKind, Target};
use crate::pmac::tasks::{TaskKind, tasks};

/// The text for a download. Under the name of each PLC and PLCC it has a line for each statement
/// that computes something: file, line, source, whether that is computed in integers, and if not,
/// which variable or operation forces floating point. The last line counts both kinds.
pub(crate) fn explain(download: &Download, loaded: &Loaded, sources: &SourceMap) -> String {
    let places = places_after_load(loaded);
    let bounds = |(kind, number): Name| bounds_of(download, &places, kind, number);
    let mut out = String::new();
    let (mut integer, mut real) = (0, 0);
    for (kind, code) in tasks(download, loaded) {
        if matches!(kind, TaskKind::Command(_)) {
            continue;
        }
        let _ = writeln!(out, "{}", kind.name());
        for stmt in code {
            let Some(line) = statement(download, stmt, &bounds) else { continue };
            *(if line.starts_with("integer") { &mut integer } else { &mut real }) += 1;
            let (span, _) = download.origins.place(stmt.at);
            let (number, _) = sources.line_col(span.file, span.start);
            let text = sources.text(span.file);
            let source = text.get(span.start as usize..span.end as usize).unwrap_or("");
            let source = uncommented(source);
            let _ = writeln!(out, "  {}:{number}: {source}: {line}", sources.path(span.file));
        }
    }
    let _ = writeln!(out, "{integer} in integers, {real} in floating point");
    out
}

/// A statement on one line, without the comments inside it.
fn uncommented(source: &str) -> String {
    let mut words = Vec::new();
    for line in source.lines() {
        let mut quoted = false;
        let end = line.char_indices().find_map(|(at, c)| {
            quoted ^= c == '"';
            let comment = c == ';' || line.get(at..).is_some_and(|rest| rest.starts_with("//"));
            (comment && !quoted).then_some(at)
        });
        words.extend(line.get(..end.unwrap_or(line.len())).unwrap_or("").split_whitespace());
    }
    words.join(" ")
}

/// What is said of a statement; `None` if it computes nothing.
fn statement(download: &Download, stmt: &Stmt, bounds: &impl Fn(Name) -> Bounds) -> Option<String> {
    let expr = Download::computed(&stmt.kind)?;
    if stmt.integer {
        return Some("integer (24 bits)".into());
    }
    let found = analyse(download.ops(expr), bounds);
    if let Some(reason) = found.forced {
        return Some(format!("floating point: {}", in_words(reason)));
    }
    if let StmtKind::Assign(Target::Indirect(_, index), _) = stmt.kind
        && let Some(reason) = analyse(download.ops(index), bounds).forced
    {
        return Some(format!("floating point: {} in the variable's number", in_words(reason)));
    }
    if found.assumed.is_empty() {
        return Some("integer".into());
    }
    let names: Vec<String> = found.assumed.iter().map(|&name| variable(name)).collect();
    let verb = if names.len() == 1 { "holds an integer" } else { "hold integers" };
    Some(format!("integer while {} {verb}", names.join(", ")))
}

/// A variable as users write it, such as `M145`.
fn variable((kind, number): Name) -> String {
    format!("{}{number}", letter(kind))
}

fn letter(kind: Kind) -> char {
    match kind {
        Kind::I => 'I',
        Kind::P => 'P',
        Kind::Q => 'Q',
        Kind::M => 'M',
        Kind::L => 'L',
    }
}

/// A reason in words.
fn in_words(reason: Reason) -> String {
    match reason {
        Reason::Constant(value) => format!("the constant {value}"),
        Reason::Variable(name) => {
            format!("{} is no U or S field of a word", variable(name))
        }
        Reason::Indirect(kind) => {
            format!("{}(…) may be any {0}-variable", letter(kind))
        }
        Reason::Operator(Bin::Div) => "the quotient of `/` may have a fraction".into(),
        Reason::Operator(Bin::Mod) => {
            "`%` by something else than a constant integer above or below 0".into()
        }
        Reason::Operator(bin) => {
            let sign = match bin {
                Bin::Add => '+',
                Bin::Sub => '-',
                Bin::Mul => '*',
                Bin::And => '&',
                Bin::Or => '|',
                _ => '^',
            };
            format!("the result of `{sign}` may be too large for exact integers")
        }
        Reason::Function(func) => format!("the result of {} may have a fraction", name(func)),
        Reason::Many => "it reads too many P-, Q- and I-variables to check for integers".into(),
    }
}

fn name(func: Func) -> &'static str {
    crate::pmac::ast::FUNCTIONS.iter().find(|known| known.1 == func).map_or("", |known| known.0)
}
