//! Records with a program made by hand: full queues, ticks that are missing, damaged files.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use plcc_abi::image::{read_u32, write_u32};
use plcc_abi::pmi::{PmiTables, Special};
use plcc_abi::{Engine, Outcome, Program, ResumePoint, Scan, Tables, Task};
use rtrb::{Consumer, RingBuffer};

use super::ReplaceableExecutive;
use super::file::FrameKind;
use super::queue::{FRAME_HEADER, read_frame_header};
use super::*;
use plcc_runtime::Executive;
use plcc_runtime::online_change::TakeOver;
use plcc_runtime::pmi::{PmiExecutive, PmiOptions};

/// Counts its scans in the image.
struct Counter;

impl Engine for Counter {
    fn call(&mut self, _: usize, _: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let count = read_u32(scan.image, 8);
        write_u32(scan.image, 8, count + 1);
        Outcome::End
    }
}

fn small_program() -> Program {
    let tables = PmiTables {
        special: Special { ipl: 0, estop: 1, crset: 2 },
        ports: 64,
        ..PmiTables::default()
    };
    Program {
        files: vec![],
        image_size: 64 + 2048,
        regions: vec![],
        tasks: vec![Task { name: "scan".into(), entry: 0, resume_points: vec![] }],
        tables: Tables::Pmi(tables),
        names: vec![],
    }
}

fn executive() -> Box<PmiExecutive> {
    Box::new(PmiExecutive::new(&small_program(), PmiOptions::default()).unwrap())
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
    // The second checkpoint, after 30 s and another 7.5 s in which it has waited for idle time, found no room any more.
    assert_eq!(ticks, 1500 + 375 + 100);
    assert!(replayer.end().unwrap().1, "the hash after the last tick");
    assert_eq!(read_u32(replayer.executive().image(), 8), 10_100);
    assert!(matches!(
        replayer.go_to(9000, &mut Counter),
        Err(ReplayError::NotKept { tick: 9000, .. })
    ));
    let _ = std::fs::remove_file(path);
}

/// The ticks that a record's last run has, each as (number, whether ticks before it are missing); all
/// of them go as recorded.
fn replayed_ticks(recording: &Recording) -> Vec<(u64, bool)> {
    let mut replayer = Replayer::new(recording, recording.last_run().unwrap(), 0, executive());
    let mut ticks = vec![];
    while let Some(replayed) = replayer.step(&mut Counter, &mut vec![]).unwrap() {
        assert!(replayed.matches, "{replayed:?}");
        ticks.push((replayed.tick, replayed.after_gap));
    }
    assert!(replayer.end().unwrap().1, "the end");
    ticks
}

#[test]
fn a_checkpoint_that_is_wanted_between_an_action_and_its_tick_loses_no_tick() {
    let (path, mut control, wants_checkpoint) = recorded("wanted");
    control.tick(&mut Counter, &mut vec![]).unwrap();
    control.skip_ticks(1);
    wants_checkpoint.store(true, Ordering::Relaxed);
    control.tick(&mut Counter, &mut vec![]).unwrap();
    control.tick(&mut Counter, &mut vec![]).unwrap();
    control.end_record(None).unwrap();
    let recording = Recording::open(&path).unwrap();
    let run = recording.last_run().unwrap();
    assert_eq!(run.gaps, []);
    assert_eq!(run.spans.iter().map(|span| span.first).collect::<Vec<_>>(), [0, 3]);
    assert_eq!(replayed_ticks(&recording), [(0, false), (2, false), (3, false)]);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn ticks_that_were_not_written_are_missing_and_do_not_differ() {
    let path = std::env::temp_dir().join(format!("plcc-unwritten-{}.plcrec", std::process::id()));
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let create = RecordFile::create;
    let program = RecordedProgram::Unknown;
    let mut file = create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let wants_checkpoint = file.wants_checkpoint();
    let (queue, mut frames) = RingBuffer::new(80_000);
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_queue(queue, file.wants_checkpoint(), &control));
    let run = |control: &mut ReplaceableExecutive, ticks: u64| {
        (0..ticks).for_each(|_| control.tick(&mut Counter, &mut vec![]).unwrap());
    };
    run(&mut control, 2);
    drain(&mut frames, &mut file);
    // As the thread that writes does while the file can't be written.
    run(&mut control, 3);
    let waiting = frames.slots();
    frames.read_chunk(waiting).unwrap().commit_all();
    wants_checkpoint.store(true, Ordering::Relaxed);
    run(&mut control, 1);
    control.end_record(None).unwrap();
    drain(&mut frames, &mut file);
    let recording = Recording::open(&path).unwrap();
    assert_eq!(replayed_ticks(&recording), [(0, false), (1, false), (5, true)]);
    let run = recording.last_run().unwrap();
    let mut replayer = Replayer::new(&recording, run, 0, executive());
    let missing = replayer.go_to(3, &mut Counter);
    assert!(matches!(missing, Err(ReplayError::NotKept { tick: 3, .. })), "{missing:?}");
    assert_eq!(replayer.missing(), Some(2..5));
    let _ = std::fs::remove_file(path);
}

#[test]
fn an_end_behind_damaged_ticks_does_not_differ() {
    let (path, mut control, _) = recorded("damaged-end");
    (0..3).for_each(|_| control.tick(&mut Counter, &mut vec![]).unwrap());
    control.end_record(None).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let ticks = bytes.windows(4).position(|bytes| bytes == [0x89, 0x52, 0x42, 4]).unwrap();
    bytes[ticks + super::block::HEADER] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.last_run().unwrap().gaps, [Gap { before: 3, lost: false }]);
    assert_eq!(replayed_ticks(&recording), []);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn frames_are_read_as_they_were_written() {
    let header = super::queue::frame_header(FrameKind::Gap, 0x0102_0304, u64::MAX - 5);
    assert_eq!(read_frame_header(&header), Some((FrameKind::Gap, 0x0102_0304, u64::MAX - 5)));
    assert_eq!(read_frame_header(&header[..FRAME_HEADER - 1]), None);
}

/// A new record for a test, a control that records into it in simulated time, and the flag that asks for a
/// checkpoint.
fn recorded(name: &str) -> (std::path::PathBuf, ReplaceableExecutive, Arc<AtomicBool>) {
    let folder = std::env::temp_dir().join(format!("plcc-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("r.plcrec");
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let program = RecordedProgram::Unknown;
    let file = RecordFile::create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let wants_checkpoint = file.wants_checkpoint();
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_file(file, &control));
    (path, control, wants_checkpoint)
}

#[test]
fn a_record_that_is_removed_is_begun_again() {
    let folder = std::env::temp_dir().join(format!("plcc-removed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("r.plcrec");
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let create = RecordFile::create;
    let program = RecordedProgram::Unknown;
    let mut file = create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let wants_checkpoint = file.wants_checkpoint();
    let (queue, mut frames) = RingBuffer::new(80_000);
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_queue(queue, file.wants_checkpoint(), &control));
    control.tick(&mut Counter, &mut vec![]).unwrap();
    drain(&mut frames, &mut file);
    let is_wanted = || wants_checkpoint.load(std::sync::atomic::Ordering::Relaxed);
    file.flush().unwrap();
    assert!(!is_wanted());

    // Somebody removes the file: it is noticed with the next ticks, and the checkpoint begins another one.
    std::fs::remove_file(&path).unwrap();
    control.tick(&mut Counter, &mut vec![]).unwrap();
    drain(&mut frames, &mut file);
    file.flush().unwrap();
    assert!(is_wanted());
    // The whole folder goes: the checkpoint can't be written before it is there again.
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(file.take(FrameKind::Checkpoint, 2, &[&[0; 32]]).is_err());
    std::fs::create_dir_all(&folder).unwrap();
    control.tick(&mut Counter, &mut vec![]).unwrap();
    control.end_record(None).unwrap();
    drain(&mut frames, &mut file);

    let recording = Recording::open(&path).unwrap();
    let run = recording.last_run().unwrap();
    assert_eq!((run.first_tick(), run.end.as_ref().unwrap().ticks), (2, 3));
    let mut replayer = Replayer::new(&recording, run, 0, executive());
    let replayed = replayer.step(&mut Counter, &mut vec![]).unwrap().unwrap();
    assert!(replayed.matches && replayed.tick == 2, "{replayed:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Appends a block with a right checksum after a record's file.
fn append(path: &std::path::Path, bytes: &[u8]) {
    use std::io::Write;
    let mut file = std::fs::OpenOptions::new().append(true).open(path).unwrap();
    file.write_all(bytes).unwrap();
}

#[test]
fn a_small_block_with_very_many_ticks_is_damage() {
    let (path, mut control, _) = recorded("many-ticks");
    control.tick(&mut Counter, &mut vec![]).unwrap();
    control.end_record(None).unwrap();
    for (size, is_block) in [(16 << 20, true), (65 << 20, false)] {
        let mut block = vec![];
        super::block::write(super::block::Kind::Ticks, 1, &vec![0; size], &mut block);
        assert!(block.len() < 300_000);
        append(&path, &block);
        let recording = Recording::open(&path).unwrap();
        assert_eq!(recording.damaged_bytes(), if is_block { 0 } else { block.len() as u64 });
        let span = recording.last_run().unwrap().spans.last().unwrap();
        assert!(matches!(recording.ticks(span), Err(RecordError::Damaged(_))));
        assert!(matches!(recording.end_of(span), Err(RecordError::Damaged(_))));
    }
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

/// Headers that overlap, each of a block to the end of the file: reading every one of them whole would take
/// hours.
#[test]
fn a_record_full_of_headers_is_searched_only_so_long() {
    let (path, mut control, _) = recorded("headers");
    control.tick(&mut Counter, &mut vec![]).unwrap();
    control.end_record(None).unwrap();
    let mut header = vec![];
    super::block::write(super::block::Kind::Checkpoint, 1, &[], &mut header);
    let (count, size) = (100_000_usize, header.len());
    let length = (count * size / 2) as u32;
    for field in [4, 8] {
        header[field..field + 4].copy_from_slice(&length.to_le_bytes());
    }
    append(&path, &header.repeat(count));
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.damaged_bytes(), (count * size) as u64);
    assert_eq!(recording.last_run().unwrap().spans.len(), 1);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

/// Records 80 ticks into `disk/r.plcrec` of a folder by the link `r.plcrec` to it, so that `disk/r.plcrec.1` gets the older
/// part. Gives the folder, the file, its older part and the link.
#[cfg(unix)]
fn record_by_a_link() -> (tempfile::TempDir, [std::path::PathBuf; 3]) {
    let folder = tempfile::tempdir().unwrap();
    let disk = folder.path().join("disk");
    std::fs::create_dir(&disk).unwrap();
    let (path, link) = (disk.join("r.plcrec"), folder.path().join("r.plcrec"));
    std::fs::write(&path, "").unwrap();
    std::os::unix::fs::symlink(&path, &link).unwrap();
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let (keep, program) = (Keep::Time(Duration::from_secs(1)), RecordedProgram::Unknown);
    let file = RecordFile::create(&link, keep, Appending::No, header, program).unwrap();
    let wants_checkpoint = file.wants_checkpoint();
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_file(file, &control));
    for _ in 0..80 {
        wants_checkpoint.store(true, std::sync::atomic::Ordering::Relaxed);
        control.tick(&mut Counter, &mut vec![]).unwrap();
    }
    control.end_record(None).unwrap();
    let older = disk.join("r.plcrec.1");
    (folder, [path, older, link])
}

#[cfg(unix)]
#[test]
fn a_link_to_a_record_is_followed() {
    let (_folder, [_, older, link]) = record_by_a_link();
    assert!(older.exists() && link.is_symlink());
    let recording = Recording::open(&link).unwrap();
    let run = recording.last_run().unwrap();
    assert_eq!((run.first_tick(), run.end.as_ref().unwrap().ticks), (0, 80));
}

/// A recorder that is killed may have renamed the newest part, and not have begun another.
#[cfg(unix)]
#[test]
fn an_older_part_alone_is_read() {
    let (_folder, [path, older, link]) = record_by_a_link();
    std::fs::rename(&path, &older).unwrap();
    for name in [&path, &link] {
        let recording = Recording::open(name).unwrap();
        let run = recording.last_run().unwrap();
        assert_eq!((run.spans.is_empty(), run.end.as_ref().unwrap().ticks), (false, 80));
    }
    let spans = Recording::open(&path).unwrap().last_run().unwrap().spans.len();
    // While it renames, both names may be found to mean the same file, which is read once.
    std::fs::hard_link(&older, &path).unwrap();
    assert_eq!(Recording::open(&path).unwrap().last_run().unwrap().spans.len(), spans);
}

/// The executive of a program whose image is much longer.
fn large_program() -> Program {
    let mut program = small_program();
    program.image_size = 4 << 20;
    program
}

/// After an online change to a program whose checkpoints have no room in the queue, and back.
#[test]
fn a_program_with_larger_checkpoints_gets_a_larger_queue() {
    use plcc_runtime::compare;
    let path = std::env::temp_dir().join(format!("plcc-larger-{}.plcrec", std::process::id()));
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let program = RecordedProgram::Unknown;
    let file = RecordFile::create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let mut control = ReplaceableExecutive::new(executive());
    let (recorder, thread) = RecordThread::start(file, &control, |_| ()).unwrap();
    control.record(recorder);
    let programs = thread.programs();
    let run = |control: &mut ReplaceableExecutive| {
        (0..100).for_each(|_| control.tick(&mut Counter, &mut vec![]).unwrap());
    };
    run(&mut control);
    let change = |control: &mut ReplaceableExecutive, from: &Program, to: &Program| {
        let mut executive: Box<dyn Executive + Send> =
            Box::new(PmiExecutive::new(to, PmiOptions::default()).unwrap());
        let number = programs.add(RecordedProgram::Unknown);
        let queue = programs.larger_queue(executive.as_ref());
        assert_eq!(queue.is_some(), to.image_size > from.image_size);
        let mut recorder_program = RecorderProgram::new(number, executive.as_ref(), queue);
        let mut engine: Option<Box<dyn Engine + Send>> = Some(Box::new(Counter));
        let plan = compare(from, to).unwrap().plan;
        let program = &mut recorder_program;
        let change = control.change_program(&mut executive, &mut engine, program, &plan);
        assert_eq!(change, TakeOver::Done);
    };
    let (small, large) = (small_program(), large_program());
    // One that was prepared and is not carried out changes nothing.
    drop(programs.larger_queue(&PmiExecutive::new(&large, PmiOptions::default()).unwrap()));
    change(&mut control, &small, &large);
    run(&mut control);
    change(&mut control, &large, &small);
    run(&mut control);
    control.end_record(None).unwrap();
    thread.finish().unwrap();
    let recording = Recording::open(&path).unwrap();
    let recorded = recording.last_run().unwrap();
    assert_eq!(recorded.gaps, []);
    assert_eq!(recorded.end.as_ref().unwrap().ticks, 300);
    assert_eq!(recorded.spans.len(), 3, "{:?}", recorded.spans);
    let _ = std::fs::remove_file(path);
}

/// In real time a checkpoint waits for idle time, but not for ever.
#[test]
fn a_checkpoint_is_taken_in_idle_time() {
    let path = std::env::temp_dir().join(format!("plcc-idle-{}.plcrec", std::process::id()));
    let header = RunHeader::new(Duration::ZERO, 20_000_000, true, vec![]);
    let program = RecordedProgram::Unknown;
    let mut file =
        RecordFile::create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let (queue, mut frames) = RingBuffer::new(1 << 20);
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_queue(queue, file.wants_checkpoint(), &control));
    let mut run = |control: &mut ReplaceableExecutive, ticks: u64| {
        (0..ticks).for_each(|_| control.tick(&mut Counter, &mut vec![]).unwrap());
        drain(&mut frames, &mut file);
    };
    // One every 30 s, which are 1500 ticks.
    run(&mut control, 1499);
    assert!(!control.waits_for_idle_time());
    run(&mut control, 1);
    assert!(control.waits_for_idle_time());
    control.checkpoint_in_idle_time(Duration::ZERO);
    assert!(control.waits_for_idle_time(), "there was no time for it");
    run(&mut control, 10);
    control.checkpoint_in_idle_time(Duration::from_secs(60));
    assert!(!control.waits_for_idle_time());
    run(&mut control, 1500 + 374);
    assert!(control.waits_for_idle_time());
    run(&mut control, 2);
    assert!(!control.waits_for_idle_time(), "it has waited for 7.5 s");
    control.end_record(None).unwrap();
    run(&mut control, 0);
    file.flush().unwrap();
    let recording = Recording::open(&path).unwrap();
    let recorded = recording.last_run().unwrap();
    assert_eq!((&recorded.gaps[..], recorded.end.as_ref().unwrap().ticks), (&[][..], 3386));
    let starts: Vec<u64> = recorded.spans.iter().map(|span| span.first).collect();
    assert_eq!(starts, [0, 1510, 3385]);
    let _ = std::fs::remove_file(path);
}

/// Counts how often it is called.
struct Counted(u64);

impl Engine for Counted {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.0 += 1;
        Counter.call(task, from, scan)
    }
}

#[test]
fn a_record_that_grows_is_read_on_from_where_the_replay_stands() {
    let path = std::env::temp_dir().join(format!("plcc-growing-{}.plcrec", std::process::id()));
    let header = RunHeader::new(Duration::ZERO, 20_000_000, false, vec![]);
    let program = RecordedProgram::Unknown;
    let mut file =
        RecordFile::create(&path, Keep::default(), Appending::No, header, program).unwrap();
    let (queue, mut frames) = RingBuffer::new(80_000);
    let mut control = ReplaceableExecutive::new(executive());
    control.record(Recorder::to_queue(queue, file.wants_checkpoint(), &control));
    let mut run = |ticks: u64| {
        (0..ticks).for_each(|_| control.tick(&mut Counter, &mut vec![]).unwrap());
        drain(&mut frames, &mut file);
        file.flush().unwrap();
    };
    run(100);
    let mut recording = Recording::open(&path).unwrap();
    let mut state = ReplayState::new(executive());
    let mut engine = Counted(0);
    fn ticks(recording: &Recording) -> RunTicks<'_> {
        RunTicks { recording, run: recording.last_run().unwrap(), generation: 0 }
    }
    let last = ticks(&recording).range().unwrap().1;
    assert_eq!(last, 99);
    state.go_to(ticks(&recording), last, &mut engine).unwrap();
    state.step(ticks(&recording), &mut engine, &mut vec![]).unwrap();
    assert_eq!(engine.0, 100);
    run(50);
    recording.refresh().unwrap();
    assert_eq!(ticks(&recording).range().unwrap().1, 149);
    state.read_on(ticks(&recording)).unwrap();
    state.go_to(ticks(&recording), 149, &mut engine).unwrap();
    assert_eq!(engine.0, 149, "nothing was run twice");
    let replayed = state.step(ticks(&recording), &mut engine, &mut vec![]).unwrap().unwrap();
    assert!(replayed.matches && replayed.tick == 149, "{replayed:?}");
    let _ = std::fs::remove_file(path);
}
