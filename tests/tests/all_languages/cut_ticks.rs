//! A tick in which the watchdog stopped a scan is shown up to the line at which the scan stood.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::Path;

use clap::Parser;
use plcc::compile::{self, Checked};
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Limits, Options};
use plcc_host::args::RunArgs;
use plcc_host::session;
use plcc_host::session::replay::recorded_executive;
use plcc_record::Recording;
use plcc_replay::{DebuggedProgram, Debugger, Recorded, Session};

use crate::watchdog::LateAt;

#[derive(Parser)]
struct Args {
    #[command(flatten)]
    run: RunArgs,
}

fn check(path: &Path, dialect: Dialect) -> (Checked, SourceMap) {
    let mut sources = SourceMap::new();
    let file = sources.add(path.to_string_lossy(), &fs::read(path).unwrap());
    let options = Options { limits: Limits::None, ..Options::default() };
    let (checked, found) = compile::check(&mut sources, &[file], dialect, &Disk, &options);
    (checked.unwrap_or_else(|| panic!("{found:?}")), sources)
}

#[test]
fn a_tick_that_was_cut_is_shown_up_to_the_line_where_its_scan_stood() {
    let nct = ":001\nLF500 +1 SF500\nADD220\nLF500 SF510\nADD220\nLF500 SF520\nJ1\n:000\nJ0\n";
    let pmac = "I5=2\nOPEN PLC 3 CLEAR\nP1=P1+1\nSEND\"a\"\nP2=P1\nSEND\"b\"\nP3=P1\nCLOSE\nENABLE PLC 3\n";
    // Each is stopped in its second tick; the lines are those of the statements of that tick, the one where it stood last.
    for (name, dialect, source, at, last, before) in
        [("a.nct", Dialect::Nct, nct, 3, 3, 2), ("a.pmc", Dialect::Pmac, pmac, 4, 6, 5)]
    {
        let folder = std::env::temp_dir().join(format!("plcc-cut-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (path, record) = (folder.join(name), folder.join("r.plcrec"));
        fs::write(&path, source).unwrap();
        let (checked, sources) = check(&path, dialect);
        let tables = checked.lower().unwrap().program;
        // With a watchdog the record has what the clock decides; the engine's host decides here when a scan is late.
        let words =
            ["run", "--ticks", "9", "--watchdog", "60s", "--record", record.to_str().unwrap()];
        let args = Args::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"));
        let mut engine = LateAt::new(checked.interpreter(), at);
        assert_eq!(session::run(&tables, &mut engine, &args.run, None), 3, "{name}");

        let recording = Recording::open(&record).unwrap();
        let header = recording.runs().last().unwrap().header.clone();
        let executive = || recorded_executive(&header, &tables).unwrap();
        let (executive, view) = (executive(), executive());
        let history =
            Recorded::new(&record, recording, header.run, 0, executive, checked.interpreter());
        let program = DebuggedProgram::new(checked.into_program(), sources, tables.clone());
        let session = Session::offline(program, Box::new(history.unwrap()), view, false);
        let mut debugger = Debugger::new(session);
        debugger.go_to_tick(1).unwrap();
        let trace = debugger.trace().unwrap().clone();
        let line = |statement: u32| debugger.program().places().place(statement).unwrap().line;
        let lines: Vec<u32> = trace.steps.iter().map(|step| line(step.statement)).collect();
        assert_eq!(lines.last(), Some(&last), "{name}: {lines:?}");
        assert!(lines.contains(&before) && !lines.contains(&(last + 1)), "{name}: {lines:?}");
        assert!(trace.cut && trace.stop.is_some(), "{name}");
        // Going back finds what the cut scan has written.
        debugger.go_to_end_of_tick(1).unwrap();
        let written = if dialect == Dialect::Nct { "F500" } else { "P2" };
        debugger.go_to_last_writer(written).unwrap();
        assert_eq!(debugger.position().tick, 1, "{name}");
        fs::remove_dir_all(&folder).unwrap();
    }
}
