//! Control flow between and within functions: goto, switch, suspend and resume, trap, host
//! calls; the same in the interpreter and in native code however the program is cut.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use plcc_abi::engine::NoHost;
use plcc_abi::pmi::PmiTables;
use plcc_abi::{
    Code, CodeMemory, Engine, Host, HostFn, OutOfBoundsAccess, Outcome, Program, Region,
    ResumePoint, Scan, SourceLine, Tables, TimeLimit, Trap, TrapCode, TrapSite, image,
};
use plcc_codegen::{CodegenOptions, JitMemory, Target, compile};
use plcc_ir::interp::Interpreter;
use plcc_ir::{Address, BinaryOp, ChunkBuilder, InstBuilder, IntCond, Module, Statement, Type};
use plcc_runtime::NativeEngine;
use plcc_runtime::native::LaterCode;

const IMAGE: u32 = 64;

fn builder(limit: usize) -> ChunkBuilder {
    let vars = Region { name: "vars".into(), offset: 0, size: IMAGE, bits: false };
    ChunkBuilder::new(IMAGE, vec![vars]).with_limit(limit)
}

fn at(offset: u32) -> Address {
    Address::fixed(plcc_ir::RegionId(0), offset)
}

fn program(module: &Module) -> Program {
    Program {
        files: vec!["test".into()],
        image_size: IMAGE,
        regions: module.regions.clone(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(PmiTables::default()),
        names: vec![],
    }
}

/// All engines for the program that `make` builds, cut into small and into large functions, each
/// with its name.
fn engines(make: impl Fn(&mut ChunkBuilder)) -> Vec<(String, Box<dyn Engine>)> {
    let mut engines: Vec<(String, Box<dyn Engine>)> = vec![];
    for limit in [1, 10, 1000] {
        let mut b = builder(limit);
        make(&mut b);
        let module = b.finish();
        for target in [Target::host().unwrap(), Target::host_baseline().unwrap()] {
            let code = compile(&module, &target, CodegenOptions::NONE).unwrap();
            let engine = NativeEngine::new(&code, &program(&module)).unwrap();
            let features = target.features().len();
            engines.push((format!("native, {features} features, {limit}"), Box::new(engine)));
        }
        engines.push((format!("interpreter {limit}"), Box::new(Interpreter::new(module))));
    }
    engines
}

fn statement(b: &mut ChunkBuilder, line: u32) {
    b.statement(Statement { file: 0, line, start: 0, end: 0 });
}

fn add(b: &mut ChunkBuilder, offset: u32, n: i64) {
    let v = b.func().load(Type::I32, at(offset));
    let v = b.func().binary_imm(BinaryOp::Add, v, n);
    b.func().store(at(offset), v);
}

/// A loop over many statements that is suspended twice in each round, and a second task that jumps
/// into the middle of it.
#[test]
fn a_loop_over_several_chunks_suspends_and_resumes() {
    let make = |b: &mut ChunkBuilder| {
        let (start, middle, top, out) = (b.place(), b.place(), b.place(), b.place());
        b.bind(start);
        b.task("first", start);
        add(b, 0, 1);
        b.bind(top);
        for line in 1..=20 {
            statement(b, line);
            add(b, 4, line.into());
        }
        b.suspend(middle);
        b.bind(middle);
        statement(b, 21);
        add(b, 8, 1);
        let count = b.func().load(Type::I32, at(8));
        let more = b.func().icmp_imm(IntCond::Ult, count, 4);
        let again = b.place();
        b.brif(more, again, out);
        b.bind(again);
        b.suspend(top);
        b.bind(out);
        statement(b, 22);
        add(b, 12, 1);
        b.ret();
        let second = b.place();
        b.bind(second);
        b.task("second", second);
        b.jump(middle);
        for task in [0, 1] {
            b.resume_points(task, &[middle, top]);
        }
    };
    for (name, mut engine) in engines(make) {
        let mut image = [0; IMAGE as usize];
        let mut call = |task, from: Option<u32>, image: &mut [u8]| {
            engine.call(task, from.map(ResumePoint), &mut Scan::new(image, &mut NoHost))
        };
        let words = |image: &[u8]| [0, 4, 8, 12].map(|offset| image::read_u32(image, offset));
        let mut from = None;
        for turn in 0..7 {
            let outcome = call(0, from, &mut image);
            // Registered in this order: the middle, the top.
            from = Some(turn % 2);
            assert_eq!(outcome, Outcome::Suspended(ResumePoint(turn % 2)), "{name}");
        }
        assert_eq!(words(&image), [1, 4 * 210, 3, 0], "{name}");
        assert_eq!(call(1, None, &mut image), Outcome::End, "{name}");
        assert_eq!(words(&image), [1, 4 * 210, 4, 1], "{name}");
        assert_eq!(call(0, from, &mut image), Outcome::End, "{name}");
        assert_eq!(words(&image), [1, 4 * 210, 5, 2], "{name}");
        let suspended = Outcome::Suspended(ResumePoint(0));
        assert_eq!(call(0, None, &mut image), suspended, "{name}");
        assert_eq!(words(&image), [2, 5 * 210, 5, 2], "{name}: starts at the top again");
        assert_eq!(call(0, None, &mut image), suspended, "{name}");
        assert_eq!(words(&image), [3, 6 * 210, 5, 2], "{name}: and whenever it is not resumed");
        for (task, beyond) in [(0, 2), (0, u32::MAX), (1, 2)] {
            let outcome = call(task, Some(beyond), &mut image);
            assert_eq!(outcome, Outcome::trap(TrapCode::Internal), "{name}");
        }
        assert_eq!(words(&image), [3, 6 * 210, 5, 2], "{name}: nothing was executed");
        assert_eq!(call(7, None, &mut image), Outcome::End, "{name}: no such task");
    }
}

/// The engine keeps where the first tasks start apart from the others.
#[test]
fn tasks_start_where_they_say_however_many_there_are() {
    for count in 1..5 {
        let make = |b: &mut ChunkBuilder| {
            for number in 0..count {
                let place = b.place();
                b.bind(place);
                b.task("task", place);
                let v = b.func().constant(Type::I32, 100 + number);
                b.func().store(at(0), v);
                b.ret();
            }
        };
        for (name, mut engine) in engines(make) {
            for task in 0..count + 2 {
                let mut image = [0; IMAGE as usize];
                let mut host = NoHost;
                let outcome =
                    engine.call(task as usize, None, &mut Scan::new(&mut image, &mut host));
                assert_eq!(outcome, Outcome::End, "{name}");
                // A task that does not exist executes nothing.
                let wanted = if task < count { 100 + task as i32 } else { 0 };
                assert_eq!(image::read_i32(&image, 0), wanted, "{name}, {task} of {count}");
            }
        }
    }
}

/// `goto_indirect` and `switch` by every number, in range and out.
#[test]
fn switch_and_goto_indirect_choose_by_number() {
    let make = |b: &mut ChunkBuilder| {
        let targets: Vec<_> = (0..30).map(|_| b.place()).collect();
        let (switch, indirect, default) = (b.place(), b.place(), b.place());
        // Labels first, so that their numbers are those of the targets.
        for &target in &targets {
            b.label(target);
        }
        b.bind(switch);
        b.task("switch", switch);
        let v = b.func().load(Type::I32, at(0));
        b.switch(v, targets.clone(), default);
        b.bind(indirect);
        b.task("indirect", indirect);
        let v = b.func().load(Type::I32, at(0));
        b.goto_indirect(v);
        for (number, &target) in targets.iter().enumerate() {
            b.bind(target);
            statement(b, 1);
            let v = b.func().constant(Type::I32, 100 + number as i64);
            b.func().store(at(4), v);
            b.ret();
        }
        b.bind(default);
        b.trap(TrapCode::Timeout);
    };
    for (name, mut engine) in engines(make) {
        // After the targets' labels stand those of the tasks and of functions that were cut.
        for number in (0..30).chain([1000, i32::MAX, -1, i32::MIN]) {
            for task in [0, 1] {
                let mut image = [0; IMAGE as usize];
                image::write_i32(&mut image, 0, number);
                let mut host = NoHost;
                let mut scan = Scan::new(&mut image, &mut host);
                let outcome = engine.call(task, None, &mut scan);
                let result = image::read_i32(&image, 4);
                match (number, task) {
                    (0..30, _) => {
                        assert_eq!((outcome, result), (Outcome::End, 100 + number), "{name}");
                    }
                    (_, 0) => assert_eq!(outcome, Outcome::trap(TrapCode::Timeout), "{name}"),
                    (_, _) => assert_eq!(outcome, Outcome::trap(TrapCode::Internal), "{name}"),
                }
            }
        }
    }
}

/// Stores before a trap are done, those after it are not.
#[test]
fn traps_stop_at_once() {
    for &code in TrapCode::ALL {
        let make = |b: &mut ChunkBuilder| {
            let (start, stop, go) = (b.place(), b.place(), b.place());
            b.bind(start);
            b.task("t", start);
            statement(b, 1);
            add(b, 0, 1);
            let v = b.func().load(Type::I32, at(0));
            let late = b.func().icmp_imm(IntCond::Sge, v, 3);
            b.brif(late, stop, go);
            b.bind(stop);
            b.trap(code);
            b.bind(go);
            statement(b, 2);
            add(b, 4, 1);
            b.ret();
        };
        for (name, mut engine) in engines(make) {
            let mut image = [0; IMAGE as usize];
            let outcomes: Vec<_> = (0..3)
                .map(|_| engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost)))
                .collect();
            assert_eq!(outcomes, [Outcome::End, Outcome::End, Outcome::trap(code)], "{name}");
            assert_eq!((image[0], image[4]), (3, 2), "{name}");
        }
    }
}

/// A trap at a site gives what the site says and the index that it is given; one at a site that does
/// not exist is an internal error.
#[test]
fn a_trap_site_says_what_is_to_blame() {
    let make = |b: &mut ChunkBuilder| {
        let start = b.place();
        b.bind(start);
        b.task("computed", start);
        let site = |line, array| {
            let statement = SourceLine { file: 0, line };
            TrapSite { code: TrapCode::ArrayBounds, statement, array }
        };
        assert_eq!([7, 8].map(|line| b.trap_site(site(line, Some(line * 8)))), [0, 1]);
        assert_eq!(b.trap_site(TrapSite { code: TrapCode::Timeout, ..site(9, None) }), 2);
        let [number, index] = [0, 4].map(|offset| b.func().load(Type::I32, at(offset)));
        b.func().trap_at(number, index);
        let start = b.place();
        b.bind(start);
        b.task("constant", start);
        let number = b.func().constant(Type::I32, 1);
        let index = b.func().load(Type::I32, at(4));
        b.func().trap_at(number, index);
    };
    let trap = |code, line, element: Option<(u32, i16)>| {
        let statement = Some(SourceLine { file: 0, line });
        let element = element.map(|(array, index)| OutOfBoundsAccess { array, index });
        Outcome::Trap(Trap { code, statement, element })
    };
    let bounds = |line, index| trap(TrapCode::ArrayBounds, line, Some((line * 8, index)));
    for (name, mut engine) in engines(make) {
        for (task, site, index, expected) in [
            (0, 0i32, 5, bounds(7, 5)),
            (0, 1, -1, bounds(8, -1)),
            (0, 0, 0x1_8000, bounds(7, i16::MIN)),
            (0, 2, 5, trap(TrapCode::Timeout, 9, None)),
            (0, 3, 5, Outcome::trap(TrapCode::Internal)),
            (0, -1, 5, Outcome::trap(TrapCode::Internal)),
            (1, 0, 300, bounds(8, 300)),
        ] {
            let mut image = [0; IMAGE as usize];
            image::write_i32(&mut image, 0, site);
            image::write_i32(&mut image, 4, index);
            let outcome = engine.call(task, None, &mut Scan::new(&mut image, &mut NoHost));
            assert_eq!(outcome, expected, "{name}, task {task}, site {site}, index {index}");
        }
    }
}

/// A host that records its calls and changes the image.
#[derive(Default)]
struct Recorder {
    calls: Vec<(HostFn, [u64; 4])>,
    /// The call, counted from 0, that panics.
    panics_at: Option<usize>,
}

impl Host for Recorder {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        self.calls.push((function, args));
        image[40] += 1;
        assert_ne!(self.panics_at, Some(self.calls.len() - 1), "a host that panics");
        match function {
            HostFn::PmacWordRead => 0xFFFF_FFFF_8000_0001,
            HostFn::PmacBits => 0x8000_0000_0000_0001,
            _ => (-2.5_f64).to_bits(),
        }
    }
}

fn calls(b: &mut ChunkBuilder) {
    let start = b.place();
    b.bind(start);
    b.task("t", start);
    let minus = b.func().constant(Type::I32, -1);
    let two = b.func().constant(Type::I32, 2);
    let half = b.func().fconst(0.5);
    let word = b.func().host_call(HostFn::PmacWordRead, &[minus, two]).unwrap();
    b.func().store(at(0), word);
    let bits = b.func().host_call(HostFn::PmacBits, &[half]).unwrap();
    b.func().store(at(8), bits);
    statement(b, 2);
    let minus = b.func().constant(Type::I32, -1);
    let half = b.func().fconst(0.5);
    let double = b.func().host_call(HostFn::PmacSin, &[half, minus]).unwrap();
    b.func().store(at(16), double);
    b.func().host_call(HostFn::PmacPlc, &[minus, minus, minus, minus]);
    b.func().host_call(HostFn::PmacSave, &[]);
    let seen = b.func().load(Type::I8, at(40));
    b.func().store(at(41), seen);
    b.ret();
}

#[test]
fn host_calls_pass_and_return_every_type() {
    for (name, mut engine) in engines(calls) {
        let mut image = [0; IMAGE as usize];
        let mut host = Recorder::default();
        let outcome = engine.call(0, None, &mut Scan::new(&mut image, &mut host));
        assert_eq!(outcome, Outcome::End);
        let (minus, half) = (0xFFFF_FFFF, 0.5_f64.to_bits());
        let expected = [
            (HostFn::PmacWordRead, [minus, 2, 0, 0]),
            (HostFn::PmacBits, [half, 0, 0, 0]),
            (HostFn::PmacSin, [half, minus, 0, 0]),
            (HostFn::PmacPlc, [minus; 4]),
            (HostFn::PmacSave, [0; 4]),
        ];
        assert_eq!(host.calls, expected, "{name}");
        assert_eq!(image::read_u64(&image, 0), 0x8000_0001, "{name}");
        assert_eq!(image::read_u64(&image, 8), 0x8000_0000_0000_0001, "{name}");
        assert_eq!(image::read_f64(&image, 16), -2.5, "{name}");
        assert_eq!(image[41], 5, "{name}: what the host changed is seen");
    }
}

/// [`calls`], ended by a suspension.
fn calls_then_suspends(b: &mut ChunkBuilder) {
    let (start, next) = (b.place(), b.place());
    b.bind(start);
    b.task("t", start);
    b.resume_points(0, &[next]);
    for line in 1..=5 {
        statement(b, line);
        b.func().host_call(HostFn::PmacSave, &[]);
        add(b, 0, 1);
    }
    let seen = b.func().load(Type::I8, at(40));
    b.func().store(at(41), seen);
    b.suspend(next);
    b.bind(next);
    b.ret();
}

/// A panic does not cross compiled code. Whichever call panics and however the chunk would have
/// ended: the host is not called again, the scan ends with a trap, the image is as it was at the
/// panic, and every further scan is refused.
#[test]
fn a_panic_of_the_host_traps_and_no_scan_runs_afterwards() {
    for (make, at) in
        [calls, calls_then_suspends].into_iter().flat_map(|m| (0..5).map(move |n| (m, n)))
    {
        for (name, mut engine) in engines(make) {
            // The interpreter unwinds; `PanicBarrier` makes a trap of that.
            if name.starts_with("interpreter") {
                continue;
            }
            let mut image = [0; IMAGE as usize];
            let mut host = Recorder { panics_at: Some(at), ..Recorder::default() };
            let outcome = engine.call(0, None, &mut Scan::new(&mut image, &mut host));
            assert_eq!(outcome, Outcome::trap(TrapCode::HostPanic), "{name}, call {at}");
            assert_eq!(host.calls.len(), at + 1, "{name}, call {at}: called again");
            assert_eq!(image[40], at as u8 + 1, "{name}, call {at}: what the host did stays");
            assert_eq!(image[41], 0, "{name}, call {at}: a store after the panic stays");
            let before = image;
            host.panics_at = None;
            let outcome = engine.call(0, None, &mut Scan::new(&mut image, &mut host));
            assert_eq!(outcome, Outcome::trap(TrapCode::HostPanic), "{name}: scans again");
            assert_eq!((host.calls.len(), image), (at + 1, before), "{name}: scans again");
        }
    }
}

/// Labels far apart, in one function.
#[test]
fn labels_far_apart_are_found() {
    let mut b = builder(1000);
    let places: Vec<_> = (0..200).map(|_| b.place()).collect();
    for &place in &places {
        b.label(place);
    }
    // Every 40th is in the first function, the others in one each.
    let far = |i: usize| i.is_multiple_of(40);
    for i in (0..200).filter(|&i| far(i)).chain((0..200).filter(|&i| !far(i))) {
        b.bind(places[i]);
        b.task("t", places[i]);
        let v = b.func().constant(Type::I32, i as i64);
        b.func().store(at(0), v);
        b.ret();
        if i == 160 {
            // Makes the function long enough to be cut.
            let end = b.place();
            b.bind(end);
            for _ in 0..1000 {
                b.func().store(at(4), v);
            }
            b.ret();
        }
    }
    let module = b.finish();
    assert!(module.funcs.len() > 1);
    let order: Vec<usize> =
        (0..200).filter(|&i| far(i)).chain((0..200).filter(|&i| !far(i))).collect();
    let code = compile(&module, &Target::host().unwrap(), CodegenOptions::NONE).unwrap();
    let mut engine = NativeEngine::new(&code, &program(&module)).unwrap();
    for (task, &i) in order.iter().enumerate() {
        let mut image = [0xFF; IMAGE as usize];
        engine.call(task, None, &mut Scan::new(&mut image, &mut NoHost));
        assert_eq!(image::read_u32(&image, 0) as usize, i);
    }
}

/// An image that is too short is never touched, and code for others is never entered.
#[test]
fn code_is_not_run_on_an_image_or_program_that_does_not_fit() {
    let mut b = builder(10);
    calls(&mut b);
    let module = b.finish();
    let program = program(&module);
    let code = compile(&module, &Target::host().unwrap(), CodegenOptions::NONE).unwrap();
    let mut engine = NativeEngine::new(&code, &program).unwrap();
    let mut image = [0; IMAGE as usize - 1];
    let outcome = engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
    assert_eq!(outcome, Outcome::trap(TrapCode::Internal));
    let refuse = |code: &Code, program: &Program| {
        assert!(NativeEngine::new(code, program).is_err());
    };
    let mut other = program.clone();
    other.image_size += 1;
    refuse(&code, &other);
    let mut other = program.clone();
    other.tasks[0].entry = code.labels.len() as u32;
    refuse(&code, &other);
    let foreign = Target::baseline("aarch64-unknown-linux-gnu").unwrap();
    if std::env::consts::ARCH != "aarch64" {
        refuse(&compile(&module, &foreign, CodegenOptions::NONE).unwrap(), &program);
    }
}

/// Makes code later, and lets so much time pass meanwhile as the epoch says.
struct Slow(Module, &'static AtomicU64, Duration);

impl LaterCode for Slow {
    fn make(self: Box<Self>) -> Result<(Code, Box<dyn CodeMemory>), String> {
        let Self(module, epoch, time) = *self;
        std::thread::sleep(time);
        epoch.store(time.as_nanos() as u64, Ordering::Relaxed);
        let code =
            compile(&module, &Target::host().unwrap(), CodegenOptions::NONE.of_part()).unwrap();
        let memory = JitMemory::new(&code).unwrap();
        Ok((code, Box::new(memory)))
    }
}

/// The time in which code is made that a scan has come to is not the scan's. Its lines and labels are known as those of other
/// code.
#[test]
fn making_code_later_takes_none_of_the_time_of_the_scan() {
    static EPOCH: AtomicU64 = AtomicU64::new(0);
    let make = || {
        let mut b = builder(100);
        let (start, rare, again) = (b.place(), b.place(), b.place());
        b.bind(start);
        b.task("scan", start);
        statement(&mut b, 1);
        add(&mut b, 0, 1);
        b.jump(rare);
        b.begin_function();
        b.bind(rare);
        b.func().set_optimize_for_size(true);
        statement(&mut b, 2);
        add(&mut b, 4, 1);
        let args = vec![b.func().constant(Type::I32, 1); 4];
        b.func().host_call(HostFn::PmacPlc, &args);
        b.jump(again);
        b.func().set_optimize_for_size(false);
        b.begin_function();
        b.bind(again);
        add(&mut b, 8, 1);
        b.ret();
        b.finish()
    };
    let whole = make();
    let mut module = whole.clone();
    let rest = module.split_off_rare(usize::MAX).unwrap();
    assert_eq!((module.funcs.len(), rest.funcs.len()), (2, 1));
    let of_part = CodegenOptions::NONE.of_part();
    let code = compile(&module, &Target::host().unwrap(), of_part).unwrap();
    assert!(!code.is_complete());
    let run = |host: &mut dyn Host, slow: bool| {
        EPOCH.store(0, Ordering::Relaxed);
        let mut engine = NativeEngine::new(&code, &program(&whole)).unwrap();
        if slow {
            engine.make_later(Box::new(Slow(rest.clone(), &EPOCH, Duration::from_millis(20))));
        }
        let mut image = [0; IMAGE as usize];
        let limit = TimeLimit { epoch: &EPOCH, limit: 10_000_000 };
        let outcome = engine.call(0, None, &mut Scan { image: &mut image, host, limit });
        (outcome, [0, 4, 8].map(|offset| image::read_u32(&image, offset)), engine)
    };
    let (outcome, image, mut engine) = run(&mut NoHost, true);
    assert_eq!((outcome, image), (Outcome::End, [1, 1, 1]));
    assert!(engine.has_later_code());
    let outcome = engine.call(0, None, &mut Scan::new(&mut [0; IMAGE as usize], &mut NoHost));
    assert_eq!(outcome, Outcome::End);
    // A host function that is called there and takes too long is stopped in its line.
    let mut late = LateHost::new(&EPOCH, 1, 0);
    late.step = 1 << 40;
    let (outcome, image, _) = run(&mut late, true);
    let line = Some(SourceLine { file: 0, line: 2 });
    assert_eq!((outcome, image), (Outcome::Trap(Trap::late(line)), [1, 1, 0]));
    // Without a compiler there is no such code.
    let (outcome, image, _) = run(&mut NoHost, false);
    assert_eq!((outcome, image), (Outcome::trap(TrapCode::Internal), [1, 0, 0]));
}

/// A host that makes the scan late in one of its calls, and gives it more time `extensions` times.
struct LateHost<'a> {
    time: TimeLimit<'a>,
    calls: u64,
    /// The call, counted from 1, in which the time is up.
    late_at: u64,
    extensions: u64,
    /// What is added to the epoch then.
    step: u64,
}

impl<'a> LateHost<'a> {
    fn new(epoch: &'a AtomicU64, late_at: u64, extensions: u64) -> Self {
        let time = TimeLimit { epoch, limit: 1 };
        Self { time, calls: 0, late_at, extensions, step: 1 }
    }
}

impl Host for LateHost<'_> {
    fn call(&mut self, image: &mut [u8], _: HostFn, _: [u64; 4]) -> u64 {
        self.calls += 1;
        image::write_u64(image, 40, self.calls);
        if self.calls >= self.late_at {
            self.time.epoch.fetch_add(self.step, Ordering::Relaxed);
        }
        1
    }

    fn extend_time(&mut self) -> Option<u64> {
        self.extensions = self.extensions.checked_sub(1)?;
        Some(self.time.epoch.load(Ordering::Relaxed) + 1)
    }
}

/// Stores after the call that was too late are undone, so that every engine leaves the same image.
#[test]
fn a_scan_ends_behind_the_host_function_in_which_its_time_is_up() {
    let make = |b: &mut ChunkBuilder| {
        let start = b.place();
        b.bind(start);
        b.task("t", start);
        for line in 1..=9 {
            statement(b, line);
            b.func().host_call(HostFn::PmacSave, &[]);
            add(b, 0, 1);
        }
        b.ret();
    };
    for (name, mut engine) in engines(make) {
        for (late_at, extensions, calls) in [(3, 0, 3), (3, 2, 5), (9, 0, 9), (10, 0, 9)] {
            let mut image = [0; IMAGE as usize];
            let epoch = AtomicU64::new(0);
            let mut host = LateHost::new(&epoch, late_at, extensions);
            let limit = host.time;
            let mut scan = Scan { image: &mut image, host: &mut host, limit };
            let outcome = engine.call(0, None, &mut scan);
            let ends = late_at == 10;
            // The statement that called it is to blame.
            let line = SourceLine { file: 0, line: calls as u32 };
            let trap = Outcome::Trap(Trap::late(Some(line)));
            let expected = if ends { Outcome::End } else { trap };
            assert_eq!(outcome, expected, "{name}, late in call {late_at}");
            assert_eq!(host.calls, calls, "{name}, late in call {late_at}");
            let words = (image::read_u64(&image, 40), image::read_u32(&image, 0));
            let stores = if ends { 9 } else { calls as u32 - 1 };
            assert_eq!(words, (calls, stores), "{name}, late in call {late_at}");
        }
    }
}

/// Code that asks whether it is late leaves a loop of its own accord; a loop that leads from chunk to
/// chunk is ended by the engine.
#[test]
fn endless_loops_end_when_the_time_is_up() {
    let make = |b: &mut ChunkBuilder| {
        let (start, top, out) = (b.place(), b.place(), b.place());
        let (next, round) = (b.place(), b.place());
        b.bind(start);
        b.task("asks", start);
        b.bind(top);
        statement(b, 1);
        add(b, 0, 1);
        let late = b.func().is_late();
        b.brif(late, out, top);
        b.bind(out);
        statement(b, 2);
        add(b, 4, 1);
        b.ret();
        b.bind(next);
        b.task("goes on", next);
        b.bind(round);
        statement(b, 3);
        add(b, 8, 1);
        b.jump(round);
    };
    for (name, mut engine) in engines(make) {
        let mut image = [0; IMAGE as usize];
        let epoch = Arc::new(AtomicU64::new(0));
        let limit = TimeLimit { epoch: &epoch, limit: 1 };
        let mut host = NoHost;
        let late = std::thread::spawn({
            let epoch = Arc::clone(&epoch);
            move || {
                std::thread::sleep(std::time::Duration::from_millis(1));
                epoch.store(1, Ordering::Relaxed);
            }
        });
        // Where each statement is a chunk of its own, both loops lead from chunk to chunk.
        let small = name.ends_with(" 1");
        let mut scan = Scan { image: &mut image, host: &mut host, limit };
        let outcome = engine.call(0, None, &mut scan);
        late.join().unwrap();
        let late_at = |line| Outcome::Trap(Trap::late(Some(SourceLine { file: 0, line })));
        // The time is up in a round, or, as the last one asked, before the second statement.
        let expected = if small { vec![late_at(1), late_at(2)] } else { vec![Outcome::End] };
        assert!(expected.contains(&outcome), "{name}: {outcome:?}");
        // The time may be up before the scan begins. Then the engine stops it between its first two
        // chunks, but code that asks does so only at the end of a round.
        assert!(small || image::read_u32(&image, 0) > 0, "{name}");
        if small {
            let mut scan = Scan { image: &mut image, host: &mut host, limit };
            let outcome = engine.call(1, None, &mut scan);
            assert_eq!(outcome, late_at(3), "{name}");
            assert!(image::read_u32(&image, 8) <= 1, "{name}");
        } else {
            assert_eq!(image::read_u32(&image, 4), 1, "{name}");
        }
    }
}

/// The next scan has a later limit, so that an epoch stored for the one before does not stop it.
#[test]
fn an_epoch_of_an_earlier_scan_stops_nothing() {
    for (name, mut engine) in engines(calls) {
        let epoch = AtomicU64::new(7);
        let mut host = LateHost::new(&epoch, 99, 0);
        let limit = TimeLimit { epoch: &epoch, limit: 8 };
        let mut image = [0; IMAGE as usize];
        let mut scan = Scan { image: &mut image, host: &mut host, limit };
        let outcome = engine.call(0, None, &mut scan);
        assert_eq!(outcome, Outcome::End, "{name}");
    }
}
