//! The lints of PMAC: what the language allows and a programmer seldom means. They look at the
//! download and at its state after load, so they are asked only where there is no error.

mod flow;
mod motors;
mod plcs;
mod variables;

use plcc_diag::{Diagnostic, Span};

use super::load::Loaded;
use crate::pmac::ast::Download;
use crate::pmac::origin::TextRange;

/// What the lints look at.
pub(super) struct Checked<'a> {
    /// The download.
    pub(super) download: &'a Download,
    /// Its state after load.
    pub(super) loaded: &'a Loaded,
    /// Whether the download has motion programs, which are skipped and may write variables.
    pub(super) has_motion: bool,
    found: Vec<Diagnostic>,
}

/// All findings of the lints, in no particular order.
pub(crate) fn find(download: &Download, loaded: &Loaded, has_motion: bool) -> Vec<Diagnostic> {
    let mut checked = Checked { download, loaded, has_motion, found: Vec::new() };
    variables::value_out_of_range(&mut checked);
    variables::undefined_m_variables(&mut checked);
    variables::shared_timers(&mut checked);
    variables::inputs_assigned(&mut checked);
    variables::same_bit_twice(&mut checked);
    plcs::never_runs(&mut checked);
    plcs::never_enabled(&mut checked);
    plcs::repeats_every_scan(&mut checked);
    plcs::texts(&mut checked);
    flow::conditions(&mut checked);
    motors::not_activated(&mut checked);
    checked.found
}

impl Checked<'_> {
    /// Adds a finding at a place of the preprocessed text.
    fn add(&mut self, at: TextRange, make: impl FnOnce(Span) -> Diagnostic) {
        let diagnostic = self.download.origins.diagnose(at, make);
        self.found.push(diagnostic);
    }
}
