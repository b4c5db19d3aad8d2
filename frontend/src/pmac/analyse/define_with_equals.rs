//! `#define X=P1`: the name is X and stands for `=P1`, so nearly each use of it is an error. It gets one error, at the
//! definition, in the place of these.

use plcc_diag::{Diagnostic, SourceMap, Span};

/// Replaces the errors in uses of names whose definition has `=` after the name by one error a definition.
pub(crate) fn one_error_a_definition(sources: &SourceMap, diagnostics: &mut Vec<Diagnostic>) {
    let mut told: Vec<(Span, Diagnostic)> = vec![];
    diagnostics.retain(|diagnostic| {
        let definitions = diagnostic.labels().iter().map(|label| label.span);
        let Some((equals, name)) =
            definitions.filter_map(|span| Some((span, defined_with_equals(sources, span)?))).next()
        else {
            return true;
        };
        if !diagnostic.is_error() {
            return true;
        }
        if told.iter().all(|(earlier, _)| *earlier != equals) {
            let meant = sources.slice(equals).trim_start_matches('=').trim();
            let message =
                format!("`=` belongs to what {name} stands for: `{}`", sources.slice(equals));
            let error = Diagnostic::error(diagnostic.code, equals, message)
                .label(diagnostic.span, "so this can't be read")
                .help(format!("a blank follows the name: #define {name} {meant}"))
                .replace(format!(" {meant}"));
            told.push((equals, error));
        }
        false
    });
    diagnostics.extend(told.into_iter().map(|(_, error)| error));
}

/// The name of the definition whose replacement is at this place, if the replacement follows the name with `=`.
fn defined_with_equals(sources: &SourceMap, replacement: Span) -> Option<&str> {
    let (line, _) = sources.line_col(replacement.file, replacement.start);
    let text = sources.line_text(replacement.file, line);
    let rest = text.trim_start().strip_prefix('#')?.trim_start();
    let directive = rest.get(..6).filter(|word| word.eq_ignore_ascii_case("define"))?;
    let rest = rest.get(directive.len()..)?.trim_start();
    let name = rest.split('=').next()?;
    let is_name = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    (is_name && sources.slice(replacement).starts_with('=')).then_some(name)
}
