//! An image file under readers and writers in other processes, which are killed at random moments: no
//! reader ever sees a torn tick, and the control never takes a torn set of inputs.
//!
//! The process runs itself again as readers and writers. Every tick fills the image with a byte of its
//! own, so that words of two ticks would show; every set of inputs gives the same number to all inputs
//! of a writer. `PLCC_IMAGE_TICKS` says how many ticks are run, 100000 without it.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs)]

use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use plcc_abi::pmi::{Format, Lines, PmiTables, Role, Special, Symbol, Type};
use plcc_abi::{Program, Region, Tables, Task};
use plcc_host::image_file::{Content, Publisher, State, SymbolTable};
use plcc_image::{ImageReader, InputWriter, Number};

/// How many inputs each of the two writers gives.
const INPUTS: u32 = 32;
/// Where the bytes of the pattern begin, and how many there are.
const PATTERN: (usize, usize) = (2304, 2048);
/// Readers, and writers.
const CHILDREN: [&str; 4] = ["reader", "reader", "writer-0", "writer-1"];

fn program() -> Program {
    let symbol = |(number, offset): (u32, u32)| Symbol {
        name: format!("I{number}"),
        ty: Type::Integer,
        offset,
        elements: None,
        role: Role::Input(Lines { port: number as u16, low: 0, count: 8, format: Format::Binary }),
        dumped: true,
        retained: false,
    };
    let image_size = (PATTERN.0 + PATTERN.1) as u32;
    let special = Special { ipl: 128, estop: 129, crset: 130 };
    let symbols = (0..2 * INPUTS).map(|number| symbol((number, number * 2))).collect();
    Program {
        files: vec![],
        image_size,
        regions: vec![Region { name: "all".into(), offset: 0, size: image_size, bits: false }],
        tasks: vec![Task { name: "scan".into(), entry: 0, resume_points: vec![] }],
        tables: Tables::Pmi(PmiTables { symbols, special, ports: 256, ..PmiTables::default() }),
        names: vec![],
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    match (arguments.get(1).map(String::as_str), arguments.get(2)) {
        (Some("reader"), Some(folder)) => read(Path::new(folder)),
        (Some(writer @ ("writer-0" | "writer-1")), Some(folder)) => {
            write(Path::new(folder), if writer == "writer-0" { 0 } else { INPUTS });
        }
        // Arguments of `cargo test` choose tests by name; this is one test.
        _ => control(),
    }
}

/// A reader: ends with a panic where it sees a torn tick. A file says how many ticks it has read.
fn read(folder: &Path) {
    let Ok(reader) = ImageReader::open(&folder.join("image")) else { return };
    let (mut last, mut count) = (0, 0_u64);
    loop {
        let Some(tick) = reader.read() else { continue };
        let pattern = &tick.image[PATTERN.0..];
        let byte = tick.ticks as u8;
        assert!(pattern.iter().all(|&other| other == byte), "a torn tick: {}", tick.ticks);
        assert!(tick.ticks >= last, "an older tick");
        last = tick.ticks;
        count += 1;
        if count.is_multiple_of(100) {
            let name = format!("reader-{}", std::process::id());
            std::fs::write(folder.join(name), count.to_string()).unwrap();
        }
    }
}

/// A writer of all inputs from `first` on.
fn write(folder: &Path, first: u32) {
    let Ok(mut writer) = InputWriter::open(&folder.join("image"), "writer") else { return };
    writer.set_timeout(Duration::from_millis(20), false);
    let inputs: Vec<_> =
        (first..first + INPUTS).filter_map(|n| writer.claim(&format!("I{n}")).ok()).collect();
    for value in (1..=255).cycle() {
        for &input in &inputs {
            writer.set(input, Number::Int(value)).unwrap();
        }
        // Another process has the mailbox when this one was taken for dead.
        writer.publish().unwrap();
        if value % 16 == 0 {
            std::thread::yield_now();
        }
    }
}

/// The control.
fn control() {
    let ticks = std::env::var("PLCC_IMAGE_TICKS").ok();
    let ticks: u64 = ticks.map_or(100_000, |ticks| ticks.parse().unwrap());
    let folder = std::env::temp_dir().join(format!("plcc-processes-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let program = program();
    let mut image = vec![0; program.image_size as usize];
    let content = Content {
        program: &program,
        fingerprint: 1,
        image: &image,
        used: &[],
        tick_ns: 1_000_000,
        generation: 0,
        safe_outputs: &[],
        symbols: &SymbolTable::new(&*plcc_runtime::names_of(&program)),
        rules: &[],
    };
    let mut publisher = Publisher::create(&folder.join("image"), &content).unwrap();
    let done = AtomicBool::new(false);
    let killed = AtomicU64::new(0);
    let (mut tick, mut sets, mut events) = (0_u64, 0_u64, 0_u64);
    std::thread::scope(|scope| {
        let children = scope.spawn(|| kill_children(&folder, &done, &killed));
        let mut inputs = [0_i64; 2 * INPUTS as usize];
        let begin = Instant::now();
        let enough = |killed: u64, sets: u64| killed >= 8 && sets >= 100 && seen(&folder) > 0;
        while tick < ticks
            || !tick.is_multiple_of(1000)
            || !enough(killed.load(Ordering::Relaxed), sets)
        {
            assert!(begin.elapsed() < Duration::from_secs(3000), "nothing happens");
            if children.is_finished() {
                break;
            }
            tick += 1;
            let mut changed = false;
            let now = begin.elapsed().as_nanos() as u64;
            let take = |slot: u32, value: Number| {
                let Number::Int(value) = value else { panic!("{value}") };
                inputs[slot as usize] = value;
                changed = true;
            };
            publisher.take_inputs(now, false, take, |_| events += 1);
            if changed {
                sets += 1;
                for half in inputs.chunks(INPUTS as usize) {
                    // Inputs may be safe, one by one.
                    let mut given = half.iter().filter(|&&value| value != 0);
                    let first = given.next();
                    assert!(given.all(|value| Some(value) == first), "a torn set: {half:?}");
                }
            }
            image[PATTERN.0..].fill(tick as u8);
            publisher.publish(&image, tick, now, State::Running, 0);
            // A control has time between two ticks, in which readers can read.
            std::thread::sleep(Duration::from_micros(1));
        }
        done.store(true, Ordering::Relaxed);
        let ended = children.join().unwrap();
        assert!(ended.is_empty(), "processes that ended by themselves: {ended:?}");
    });
    let (seen, killed) = (seen(&folder), killed.load(Ordering::Relaxed));
    println!(
        "{tick} ticks, {seen} read by other processes, {sets} sets of inputs taken, {events} events, \
         {killed} processes killed"
    );
    assert!(events > 0);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// How many ticks readers have seen.
fn seen(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let of_readers =
        files.filter(|entry| entry.file_name().to_string_lossy().starts_with("reader-"));
    let counts = of_readers.map(|entry| std::fs::read_to_string(entry.path()).unwrap());
    counts.filter_map(|count| count.parse::<u64>().ok()).sum()
}

/// Starts readers and writers, and kills one after the other at random moments. Gives how those have ended
/// that were not killed.
fn kill_children(folder: &Path, done: &AtomicBool, killed: &AtomicU64) -> Vec<String> {
    let program: PathBuf = std::env::current_exe().unwrap();
    let start = |role: &str| Command::new(&program).arg(role).arg(folder).spawn().unwrap();
    let mut children: Vec<(&str, Child)> = CHILDREN.map(|role| (role, start(role))).into();
    let mut ended = vec![];
    let mut random = plcc_random::Rng::new(u64::from(std::process::id()));
    while !done.load(Ordering::Relaxed) && ended.is_empty() {
        std::thread::sleep(Duration::from_micros(1000 + random.below(60_000) as u64));
        let victim = random.below(CHILDREN.len());
        let (role, child) = &mut children[victim];
        if let Some(status) = child.try_wait().unwrap() {
            ended.push(format!("{role}: {status}"));
            continue;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        killed.fetch_add(1, Ordering::Relaxed);
        *child = start(role);
    }
    for (role, mut child) in children {
        if let Some(status) = child.try_wait().unwrap() {
            ended.push(format!("{role}: {status}"));
        }
        let _ = child.kill();
        let _ = child.wait();
    }
    ended
}
