//! Runs the lathe of PMI's manual (6.2) with its stimulus again and again: all engines agree after
//! every scan, and every statement is executed.
//!
//! The million scans take a minute, in release:
//! `cargo test --release -p plcc-tests --test pmi lathe -- --ignored`.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use std::{
    fs,
    path::Path,
    sync::{Arc, Mutex},
};

use crate::harness::{Change, Machines, checked};
use plcc_abi::{Engine, Outcome, ResumePoint, Scan};
use plcc_frontend::{common::Options, pmi};

/// The statement interpreter, whose counts can be read while the machines have it.
#[derive(Clone)]
struct Counting(Arc<Mutex<pmi::Interpreter>>);

impl Engine for Counting {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.0.lock().unwrap().call(task, from, scan)
    }
}

/// Runs the lathe; its stimulus starts again with its last tick + 1.
fn lathe(scans: u32) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/pmi");
    let source = fs::read_to_string(folder.join("lathe.pmi")).unwrap();
    let program = checked(&source, &Options::default()).unwrap();
    let counting = Counting(Arc::new(Mutex::new(program.counting_interpreter())));
    let mut machines = Machines::new(&program, Box::new(counting.clone()));
    let stimulus = fs::read_to_string(folder.join("lathe.csv")).unwrap();
    let changes = machines.stimulus(&stimulus).unwrap();
    let period = changes.iter().map(|change| change.tick).max().unwrap() + 1;
    let rows: Vec<Vec<Change>> = (0..period)
        .map(|tick| changes.iter().filter(|change| change.tick == tick).copied().collect())
        .collect();
    for scan in 0..scans {
        let ticked = machines.tick(&rows[(scan % period) as usize]);
        let (result, _) = ticked.unwrap_or_else(|difference| panic!("scan {scan}: {difference}"));
        assert_eq!(result, Ok(()), "scan {scan}");
    }
    let counting = counting.0.lock().unwrap();
    let line = |at: u32| source[..at as usize].matches('\n').count() + 1;
    let missed: Vec<usize> =
        counting.counts().filter(|(_, count)| *count == 0).map(|(s, _)| line(s.start)).collect();
    assert_eq!(missed, Vec::<usize>::new(), "lines that never ran");
    // Assignments outside every IF run once a scan.
    let scans = u64::from(scans);
    assert!(counting.counts().all(|(_, count)| count <= scans));
    assert!(counting.counts().filter(|(_, count)| *count == scans).count() > 60);
}

#[test]
fn thousands_of_scans_of_the_lathe_agree() {
    lathe(2000);
}

#[test]
#[ignore = "takes a minute in release"]
fn a_million_scans_of_the_lathe_agree() {
    lathe(1_000_000);
}
