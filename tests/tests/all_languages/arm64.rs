//! Code for ARM64, executed: programs are compiled for both architectures. What the code for x86-64
//! does here, called by the control, is recorded: scans, calls of the host, every change of the image.
//! A C program with the same programs as objects for ARM64 does the scans again under qemu-user and
//! compares (`arm64_replay.c`). The test is skipped, with a word, where those tools are not installed (Debian:
//! `gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user`) or this machine is not an x86-64.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::Path;
use std::process::Command;

use plcc_abi::{Dialect, Engine, Host, HostFn, Outcome, Program, Scan, Tables};
use plcc_codegen::{CodegenOptions, OptLevel, Optimization, Target, compile, emit};
use plcc_frontend::common::Options;
use plcc_ir::Module;
use plcc_ir_tests::gen_ir;
use plcc_random::seeds;
use plcc_runtime::NativeEngine;
use plcc_tests::compile::EngineKind;
use plcc_tests::drive::Bench;
use plcc_tests::gen_program;
use plcc_tests::tools::is_there;

const REPLAY: &str = include_str!("arm64_replay.c");
const TARGET: &str = "aarch64-unknown-linux-gnu";

/// What a program did, in the form that `arm64_replay.c` reads and explains.
#[derive(Default)]
struct Records {
    bytes: Vec<u8>,
    /// The image after the changes recorded so far.
    known: Vec<u8>,
}

impl Records {
    fn numbers(&mut self, numbers: &[u32]) {
        self.bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }

    /// Records how the image differs from what is known of it.
    fn changes(&mut self, image: &[u8]) {
        if self.known.is_empty() {
            self.known = vec![0; image.len()];
        }
        let mut at = 0;
        while let Some(first) = (at..image.len()).find(|&at| image[at] != self.known[at]) {
            let end = (first..image.len()).find(|&at| image[at] == self.known[at]);
            let end = end.unwrap_or(image.len());
            self.bytes.push(b'W');
            self.numbers(&[first as u32, (end - first) as u32]);
            self.bytes.extend(&image[first..end]);
            at = end;
        }
        self.known.copy_from_slice(image);
    }
}

/// An engine that records what another one does.
struct Recorder<'a> {
    engine: Box<dyn Engine>,
    program: &'a Program,
    records: Records,
    scans: usize,
}

/// A host that records its calls.
struct RecordingHost<'a> {
    host: &'a mut dyn Host,
    records: &'a mut Records,
}

impl Host for RecordingHost<'_> {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        self.records.changes(image);
        self.records.bytes.push(b'H');
        self.records.numbers(&[function as u32]);
        self.records.bytes.extend(args.iter().flat_map(|arg| arg.to_le_bytes()));
        let result = self.host.call(image, function, args);
        self.records.bytes.extend(result.to_le_bytes());
        self.records.changes(image);
        self.records.bytes.push(0);
        result
    }
}

impl Engine for Recorder<'_> {
    fn call(
        &mut self,
        task: usize,
        from: Option<plcc_abi::ResumePoint>,
        scan: &mut Scan<'_>,
    ) -> Outcome {
        let Some(data) = self.program.tasks.get(task) else { return Outcome::End };
        let label = |point: plcc_abi::ResumePoint| data.resume_points[point.0 as usize];
        self.records.changes(scan.image);
        self.records.bytes.push(b'S');
        self.records.numbers(&[task as u32, from.map_or(data.entry, label)]);
        let mut host = RecordingHost { host: scan.host, records: &mut self.records };
        let mut recorded = Scan::new(scan.image, &mut host);
        let outcome = self.engine.call(task, from, &mut recorded);
        self.records.changes(scan.image);
        self.records.bytes.push(b'E');
        let numbers = match outcome {
            Outcome::End => [1, 0, 0, 0],
            Outcome::Suspended(point) => [2, label(point), 0, 0],
            Outcome::Trap(trap) => {
                let line = trap.statement.map_or(0, |statement| statement.line);
                let index = trap.element.map_or(0, |element| element.index as u16);
                [3, trap.code as u32, line, index.into()]
            }
        };
        self.records.numbers(&numbers);
        self.scans += 1;
        outcome
    }
}

/// A program as an object for ARM64, with what it did here.
struct Recorded {
    name: String,
    object: Vec<u8>,
    records: Vec<u8>,
    scans: usize,
}

/// The object of a program, whose symbols begin with its name.
fn object(program: &Program, module: &Module, name: &str) -> Vec<u8> {
    let target = Target::baseline(TARGET).unwrap();
    let code = compile(module, &target, CodegenOptions::ALL).unwrap();
    let options = emit::ObjectOptions { prefix: name.into(), ..emit::ObjectOptions::default() };
    emit::object(program, &code, &target, &options).unwrap()
}

/// Runs a program in its control.
fn record(name: String, bench: &Bench) -> Recorded {
    // The same passes as in the object, since which pure functions are called depends on them.
    let (program, engine) = bench.compiled.engine(EngineKind::JitSpeed).unwrap();
    let records = Records::default();
    let mut recorder = Recorder { engine, program: &program, records, scans: 0 };
    let mut machine = bench.machine(&program).unwrap();
    for _ in 0..bench.ticks {
        machine.step(&mut recorder).unwrap();
    }
    let Recorder { mut records, scans, .. } = recorder;
    records.bytes.push(b'Q');
    let [_, best] = bench.compiled.modules();
    Recorded { object: object(&program, best, &name), name, records: records.bytes, scans }
}

/// Runs generated IR on random images.
fn record_ir(name: String, seed: u64) -> Recorded {
    let mut module = gen_ir::generate(seed);
    let options = Optimization::from(OptLevel::Speed).run(&mut module).0;
    let program = Program {
        files: vec!["generated.pmi".into()],
        image_size: module.image_size,
        regions: module.regions.clone(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(plcc_abi::pmi::PmiTables::default()),
        names: vec![],
    };
    let code = compile(&module, &Target::host_baseline().unwrap(), options).unwrap();
    let engine = Box::new(NativeEngine::new(&code, &program).unwrap());
    let records = Records::default();
    let mut recorder = Recorder { engine, program: &program, records, scans: 0 };
    gen_ir::trace(&mut recorder, seed);
    let Recorder { mut records, scans, .. } = recorder;
    records.bytes.push(b'Q');
    Recorded { object: object(&program, &module, &name), name, records: records.bytes, scans }
}

/// The generated programs and the examples. `PLCC_SEEDS` has more of them generated.
fn programs() -> Vec<Recorded> {
    let mut all = vec![];
    for seed in seeds(8) {
        all.push(record_ir(format!("ir{seed}"), seed));
    }
    for dialect in [Dialect::Pmi, Dialect::Nct, Dialect::Pmac] {
        for seed in seeds(4) {
            let case = gen_program::generate(dialect, seed, 40);
            let bench = Bench::new(&case, dialect, &Options::default()).unwrap();
            all.push(record(format!("{}{seed}", dialect.name()), &bench));
        }
    }
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let lathe = Bench::open(
        &examples.join("pmi/lathe.pmi"),
        Some(&examples.join("pmi/lathe.csv")),
        400,
        Dialect::Pmi,
    );
    all.push(record("lathe".into(), &lathe.unwrap()));
    all
}

#[test]
fn code_for_arm64_does_what_code_for_this_machine_does() {
    let tools = ["aarch64-linux-gnu-gcc", "qemu-aarch64"];
    if cfg!(not(target_arch = "x86_64")) || !tools.into_iter().all(is_there) {
        return;
    }
    let folder = std::env::temp_dir().join(format!("plcc-arm64-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let programs = programs();
    let (mut headers, mut table) = (String::new(), String::new());
    let mut compiler = Command::new("aarch64-linux-gnu-gcc");
    compiler.args(["-O1", "-Wall", "-Wextra", "-Werror", "-o", "replay", "replay.c", "-I"]);
    compiler.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../codegen/include"));
    let mut replay = Command::new("qemu-aarch64");
    replay.args(["-L", "/usr/aarch64-linux-gnu", "./replay"]);
    for Recorded { name, object, records, .. } in &programs {
        fs::write(folder.join(format!("{name}.o")), object).unwrap();
        fs::write(folder.join(format!("{name}.rec")), records).unwrap();
        compiler.arg(format!("{name}.o"));
        replay.arg(format!("{name}.rec"));
        headers += &format!("#define PLCC_PREFIX {name}\n#include \"plcc.h\"\n");
        table += &format!(
            "{{ \"{name}\", &{name}_image_size, {name}_task_at, {name}_scan, {name}_trap_sites, \
             &{name}_trap_site_count }},\n"
        );
    }
    let source = REPLAY.replace("PROGRAMS\n", &headers).replace("TABLE", &table);
    fs::write(folder.join("replay.c"), source).unwrap();
    let compiled = compiler.current_dir(&folder).output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let replayed = replay.current_dir(&folder).output().unwrap();
    let text = String::from_utf8(replayed.stdout).unwrap();
    let errors = String::from_utf8_lossy(&replayed.stderr).into_owned();
    assert!(replayed.status.success(), "{text}\n{errors}\nkept: {}", folder.display());
    let expected: String =
        programs.iter().map(|done| format!("{}: {} scans\n", done.name, done.scans)).collect();
    assert_eq!(text, expected);
    fs::remove_dir_all(&folder).unwrap();
}
