//! Whether anything lets PLCs run.

use plcc_diag::Diagnostic;

use crate::pmac::read::download::DownloadReader;

/// Warns if nothing sets I5.
pub(crate) fn warn_of_i5(read: &mut DownloadReader<'_>) {
    // A missing file or a template without a value may set it.
    if read.preprocessed.incomplete || !read.preprocessed.undefined_templates.is_empty() {
        return;
    }
    if read.assigns_i5 || read.diagnostics.iter().any(Diagnostic::is_error) {
        return;
    }
    if let Some(at) = read.has_plc {
        read.tell(at, |span| {
            Diagnostic::warning("PMAC-W2", span, "no PLC will run: nothing sets I5")
                .note("I5 is 0 unless the text says otherwise")
                .help("add I5=2 for background PLCs, I5=3 for PLC0 as well")
        });
    }
}
