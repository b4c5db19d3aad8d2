//! Warnings of constants outside of the range of the I-variable that they are assigned to.

use plcc_abi::pmac::{Kind, Range};
use plcc_diag::Diagnostic;

use crate::pmac::ast::{Download, Expr, Target};
use crate::pmac::origin::TextRange;
use crate::pmac::reference::tables::i_range;

/// Warns of every constant, in on-line text, PLCs and COMMANDs, that rolls over in the I-variable
/// that it is assigned to, in the order of the text. Assignments to ranges (`I0..99=0`) are left
/// out, since they often sweep over many variables of different ranges.
pub(crate) fn warnings(download: &Download) -> Vec<Diagnostic> {
    let mut found: Vec<(TextRange, Diagnostic)> = download
        .assignments()
        .filter_map(|(target, expr, at)| Some((at, warning(download, target, expr, at)?)))
        .collect();
    found.sort_by_key(|(at, _)| at.start);
    found.into_iter().map(|(_, diagnostic)| diagnostic).collect()
}

/// The warning of an assignment, if it needs one.
fn warning(download: &Download, target: Target, expr: Expr, at: TextRange) -> Option<Diagnostic> {
    let Target::Var(Kind::I, number) = target else { return None };
    let number = u32::from(number);
    let value = download.constant(expr)?;
    let range = i_range(download.controller, number).filter(|range| !holds(*range, value))?;
    let (low, high) = match range {
        Range::Integer(low, high) => (low as f64, high as f64),
        Range::Real(low, high) => (low, high),
    };
    let stored = range.convert(value);
    Some(download.origins.diagnose(at, |span| {
        let message = format!("I{number} takes {low} to {high}: {value} becomes {stored}");
        Diagnostic::warning("PMAC-W5", span, message)
            .help(format!("`plcc explain I{number}` says what it means"))
    }))
}

/// Whether a value is in a range, after rounding if the range is of integers.
fn holds(range: Range, value: f64) -> bool {
    match range {
        Range::Integer(low, high) => (low as f64..=high as f64).contains(&value.round()),
        Range::Real(low, high) => (low..=high).contains(&value),
    }
}

#[cfg(test)]
mod tests {
    use crate::common::{Controller, LintLevels, MemoryLoader, Options};
    use crate::pmac::check;

    fn warnings(source: &str, controller: Controller) -> Vec<String> {
        let mut map = plcc_diag::SourceMap::new();
        let file = map.add("m.pmc", source.as_bytes());
        let options = Options { controller, lints: LintLevels::none(), ..Options::default() };
        let (program, diagnostics) = check(&mut map, &[file], &MemoryLoader::new(), &options);
        assert!(program.is_some());
        let line = |d: &plcc_diag::Diagnostic| map.line_col(d.span.file, d.span.start).0;
        let told = |d: &plcc_diag::Diagnostic| format!("{} {}: {}", d.code, line(d), d.message);
        diagnostics.iter().map(told).collect()
    }

    #[test]
    fn constants_out_of_range_get_a_warning() {
        let text = "I5=2 I8=256\nI4=4.5\nI100=-1\nOPEN PLC 1 CLEAR\n\
                    I12=0\nI136=--2.5\nCMD\"I9=4\"\nCLOSE\n";
        assert_eq!(
            warnings(text, Controller::Pmac),
            [
                "PMAC-W5 1: I8 takes 0 to 255: 256 becomes 0",
                "PMAC-W5 2: I4 takes 0 to 3: 4.5 becomes 1",
                "PMAC-W5 3: I100 takes 0 to 1: -1 becomes 1",
                "PMAC-W5 5: I12 takes 1 to 8388607: 0 becomes 8388607",
                "PMAC-W5 6: I136 takes -2 to 2: 2.5 becomes -1.5",
                "PMAC-W5 7: I9 takes 0 to 3: 4 becomes 0",
            ]
        );
        let text = "I5=2 I8=8388608\nI12=0\nOPEN PLC 1 CLEAR I5111=8388608 CLOSE\n";
        assert_eq!(
            warnings(text, Controller::Turbo),
            [
                "PMAC-W5 1: I8 takes 0 to 255: 8388608 becomes 0",
                "PMAC-W5 3: I5111 takes -8388608 to 8388607: 8388608 becomes -8388608",
            ]
        );
    }

    #[test]
    fn values_in_range_or_unknown_get_no_warning() {
        let text = "I5=2 I8=255.4 I8=-0.4 I136=2 I122=-1 I46=99999 I125=$FFFFFF I5=*\nI0..4=9\n\
                    OPEN PLC 1 CLEAR\nI8=P1 I8=255+1 I(8)=256 P8=256 M8=256\nCLOSE\n";
        assert_eq!(warnings(text, Controller::Pmac), Vec::<String>::new());
    }
}
