//! Programs made by hand, and an engine that is a closure.

mod area;
mod search;
mod tick;

use super::{NctExecutive, NctLoadError, NctOptions};
use plcc_abi::nct::{FLAG_BYTES, FlagLocation, NctTables};
use plcc_abi::{Engine, Outcome, Program, Region, ResumePoint, Scan, Tables, Task};

/// An NCT program without code: bits of I, V and Y unpacked, F packed.
pub(super) fn program(tables: NctTables, tasks: usize) -> Program {
    let mut regions = Vec::new();
    let mut end = 0;
    let mut region = |name: &str, size: u32, bits: bool| {
        let offset = end;
        end += size.next_multiple_of(8);
        regions.push(Region { name: name.into(), offset, size, bits });
        offset
    };
    region("context", 144, false);
    region("lines_in", 40, false);
    region("lines_out", 40, false);
    for (name, count) in [("rh", 200), ("q", 32), ("t", 50), ("h", 100), ("m", 10), ("rp", 41)] {
        region(name, count * 2, false);
    }
    let mut unpacked = |bytes: &str, bits: &str| -> Vec<FlagLocation> {
        region(bytes, 0, false);
        let start = region(bits, 800, true);
        (0..100).map(|byte| FlagLocation { offset: start + byte * 8, unpacked: true }).collect()
    };
    let inputs = unpacked("input_bytes", "input_bits");
    let previous = unpacked("previous_bytes", "previous_bits");
    let outputs = unpacked("output_bytes", "output_bits");
    let start = region("flag_bytes", FLAG_BYTES as u32, false);
    let flags = (0..FLAG_BYTES as u32).map(|n| FlagLocation { offset: start + n, unpacked: false });
    let tables = NctTables { inputs, previous, outputs, flags: flags.collect(), ..tables };
    let task = |n| Task { name: format!(":00{n}"), entry: n as u32, resume_points: vec![] };
    Program {
        files: vec!["test.plc".into()],
        image_size: end,
        regions,
        tasks: (0..tasks).map(task).collect(),
        tables: Tables::Nct(tables),
        names: vec![],
    }
}

/// An engine that calls a closure with the module and the scan.
pub(super) struct Script<F>(pub(super) F);

impl<F: FnMut(usize, &mut Scan<'_>) -> Outcome> Engine for Script<F> {
    fn call(&mut self, task: usize, _: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        (self.0)(task, scan)
    }
}

#[test]
fn tables_that_do_not_fit_are_refused() {
    let refused = |change: fn(&mut NctTables), tasks| {
        let mut damaged = program(NctTables::default(), tasks);
        let Tables::Nct(tables) = &mut damaged.tables else { panic!("NCT's tables") };
        change(tables);
        NctExecutive::new(&damaged, NctOptions::default()).map(drop)
    };
    let damaged = |what: &str| Err(NctLoadError::Damaged(what.into()));
    assert_eq!(refused(|_| {}, 2), Ok(()));
    assert_eq!(refused(|_| {}, 1), damaged("its module :000 or :001 is missing"));
    let short = refused(|tables| tables.flags.truncate(999), 2);
    assert_eq!(short, damaged("its table of local variables has 999 entries, not 1000"));
    let outside = refused(|tables| tables.outputs[3].offset = u32::MAX, 2);
    assert_eq!(outside, damaged("its table of outputs points outside the image"));
}
