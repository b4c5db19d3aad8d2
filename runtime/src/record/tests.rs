//! A recorder whose queue is full for a while, with a program made by hand.

use std::time::Duration;

use plcc_abi::image::{read_u32, write_u32};
use plcc_abi::pmi::{PmiTables, Special};
use plcc_abi::{Engine, Outcome, Program, ResumePoint, Scan, Tables, Task};
use rtrb::{Consumer, RingBuffer};

use super::file::FrameKind;
use super::thread::{FRAME_HEADER, read_frame_header};
use super::*;
use crate::Executive;
use crate::pmi::{PmiExecutive, PmiOptions};
use crate::swap::ReplaceableExecutive;

/// Counts its scans in the image.
struct Counter;

impl Engine for Counter {
    fn call(&mut self, _: usize, _: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let count = read_u32(scan.image, 8);
        write_u32(scan.image, 8, count + 1);
        Outcome::End
    }
}

fn executive() -> Box<PmiExecutive> {
    let tables = PmiTables {
        special: Special { ipl: 0, estop: 1, crset: 2 },
        ports: 64,
        ..PmiTables::default()
    };
    let program = Program {
        files: vec![],
        image_size: 64 + 2048,
        regions: vec![],
        tasks: vec![Task { name: "scan".into(), entry: 0, resume_points: vec![] }],
        tables: Tables::Pmi(tables),
    };
    Box::new(PmiExecutive::new(&program, PmiOptions::default()).unwrap())
}

/// Puts everything that is in a queue into a file.
fn drain(frames: &mut Consumer<u8>, file: &mut RecordFile) {
    let waiting = frames.slots();
    let bytes: Vec<u8> = frames.read_chunk(waiting).unwrap().into_iter().collect();
    let mut rest = bytes.as_slice();
    while let Some((kind, length, tick)) = read_frame_header(rest) {
        let content = &rest[FRAME_HEADER..FRAME_HEADER + length];
        file.take(kind, tick, &[content]).unwrap();
        rest = &rest[FRAME_HEADER + length..];
    }
    assert!(rest.is_empty(), "only whole frames are in the queue");
}

#[test]
fn ticks_for_which_there_is_no_room_are_told_and_the_record_goes_on() {
    let path = std::env::temp_dir().join(format!("plcc-recorder-{}.plcrec", std::process::id()));
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let create = RecordFile::create;
    let program = RecordedProgram::Unknown;
    let mut file = create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let (queue, mut frames) = RingBuffer::new(80_000);
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_queue(queue, file.wants_checkpoint(), &control));
    let run = |control: &mut ReplaceableExecutive, ticks: u64| {
        (0..ticks).for_each(|_| control.tick(&mut Counter, &mut vec![]).unwrap());
    };
    // Nobody empties the queue meanwhile.
    run(&mut control, 10_000);
    control.skip_ticks(7);
    drain(&mut frames, &mut file);
    run(&mut control, 100);
    control.end_record(None).unwrap();
    drain(&mut frames, &mut file);

    let recording = Recording::open(&path).unwrap();
    let recorded = recording.last_run().unwrap();
    assert_eq!(recorded.gaps, [Gap { before: 10_007, lost: true }]);
    assert_eq!(recorded.end.as_ref().unwrap().ticks, 10_107);
    let mut replayer = Replayer::new(&recording, recorded, 0, executive());
    let (mut ticks, mut gaps) = (0, vec![]);
    while let Some(replayed) = replayer.step(&mut Counter, &mut vec![]).unwrap() {
        assert!(replayed.matches, "{replayed:?}");
        ticks += 1;
        if replayed.after_gap {
            gaps.push(replayed.tick);
        }
    }
    assert_eq!(gaps, [10_007]);
    // The second checkpoint, after 30 s, found no room any more.
    assert_eq!(ticks, 1500 + 100);
    assert!(replayer.end().unwrap().1, "the hash behind the last tick");
    assert_eq!(read_u32(replayer.executive().image(), 8), 10_100);
    assert!(matches!(
        replayer.go_to(9000, &mut Counter),
        Err(ReplayError::NotKept { tick: 9000, .. })
    ));
    let _ = std::fs::remove_file(path);
}

#[test]
fn frames_are_read_as_they_were_written() {
    let header = super::thread::frame_header(FrameKind::Gap, 0x0102_0304, u64::MAX - 5);
    assert_eq!(read_frame_header(&header), Some((FrameKind::Gap, 0x0102_0304, u64::MAX - 5)));
    assert_eq!(read_frame_header(&header[..FRAME_HEADER - 1]), None);
}
