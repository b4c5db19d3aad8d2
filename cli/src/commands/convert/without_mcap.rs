//! What takes the place of `mcap.rs` in a plcc that was built without the feature `mcap`: it writes no MCAP files, and says so.

use std::io;
use std::path::Path;

use plcc_host::run::TraceText;
use plcc_record::RecordedRun;
use plcc_runtime::{Event, Executive, VariableKey};

use super::{RanProgram, Watches};

/// An MCAP file, of which there is none.
pub(super) enum Mcap {}

impl Mcap {
    /// Gives an error that says how to build a plcc that writes such files.
    pub(super) fn create(
        _: &Path,
        _: &TraceText,
        _: &Watches,
        _: &[RanProgram],
        _: &RecordedRun,
    ) -> io::Result<Self> {
        Err(io::Error::other(
            "this plcc was built without MCAP; the feature `mcap` adds it (`cargo install --locked --path cli --features \
             mcap`), and `--to csv`, `vcd` and `fst` write the same values",
        ))
    }

    pub(super) fn tick(
        &mut self,
        _: (u64, u64),
        _: &[Option<VariableKey>],
        _: &dyn Executive,
        _: &[Event],
    ) -> io::Result<()> {
        match *self {}
    }

    pub(super) fn finish(self) -> io::Result<()> {
        match self {}
    }
}
