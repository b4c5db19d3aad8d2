//! Downloads that change definitions of M-variables while they run, in native code that is recompiled
//! for the new definitions. The state is that of the statement interpreter after every servo cycle;
//! once the definitions stay the same, no access goes through the host any more; and the code is
//! recompiled no more often than the settings allow.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use plcc::compile::jit;
use plcc::later_code::jit_in_parts;
use plcc::recompile::PmacRecompiler;
use plcc_abi::pmac::{Assumption, Controller, Definition, Layout};
use plcc_abi::{Engine, Host, HostFn, Outcome, ResumePoint, Scan};
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::pmac;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions, Recompiler, Recompiling, Settings};
use plcc_runtime::{Event, Executive, NativeEngine, Purpose};

const WITHOUT_DELAY: Settings = Settings {
    settled_after: 1,
    patience: 40,
    max_recompilations: 99,
    max_per_variable: 3,
    in_thread: false,
};

/// An engine that counts the accesses to M-variables which the code leaves to the host.
struct Counting {
    engine: Recompiling,
    calls: Rc<Cell<u32>>,
}

struct CountingHost<'a> {
    host: &'a mut dyn Host,
    calls: &'a Cell<u32>,
}

impl Host for CountingHost<'_> {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        let reaches_m = [HostFn::PmacMRead, HostFn::PmacMWrite, HostFn::PmacStatement];
        if reaches_m.contains(&function) {
            self.calls.set(self.calls.get() + 1);
        }
        self.host.call(image, function, args)
    }
}

impl Engine for Counting {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let mut host = CountingHost { host: scan.host, calls: &self.calls };
        self.engine.call(
            task,
            from,
            &mut Scan { host: &mut host, image: scan.image, limit: scan.limit },
        )
    }

    fn begin_tick(&mut self, image: &mut [u8]) {
        self.engine.begin_tick(image);
    }
}

fn check(source: &str) -> pmac::Program {
    let mut sources = SourceMap::new();
    let file = sources.add("moving.pmc", source.as_bytes());
    let (program, all) =
        pmac::check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    if let Some(error) = all.iter().find(|d| d.is_error()) {
        panic!("{source}\n{}", plcc_diag::render::draw(&sources, error, false));
    }
    program.unwrap()
}

fn recompiler(program: &pmac::Program) -> Box<dyn Recompiler> {
    Box::new(PmacRecompiler::new(Box::new(program.clone()), OptLevel::Speed))
}

/// A download in the statement interpreter and in code that is recompiled, side by side.
struct Pair {
    interpreter: Box<dyn Engine>,
    oracle: PmacExecutive,
    engine: Counting,
    executive: PmacExecutive,
    layout: Layout,
    tick: u32,
}

impl Pair {
    fn new(source: &str, settings: Settings) -> Self {
        let program = check(source);
        let native = jit_in_parts(|| Ok(program.lower().unwrap()), OptLevel::Speed).unwrap().engine;
        let compiler = recompiler(&program);
        Self::with(&program, native, compiler, settings)
    }

    fn with(
        program: &pmac::Program,
        native: NativeEngine,
        compiler: Box<dyn Recompiler>,
        settings: Settings,
    ) -> Self {
        let tables = program.lower().unwrap().program;
        let executive = || PmacExecutive::new(&tables, PmacOptions::default()).unwrap();
        let engine =
            Recompiling::new(native, program.assumptions(), Controller::Pmac, compiler, settings);
        Self {
            interpreter: program.interpreter(),
            oracle: executive(),
            engine: Counting { engine, calls: Rc::default() },
            executive: executive(),
            layout: Layout::new(Controller::Pmac),
            tick: 0,
        }
    }

    /// Runs ticks and compares both after each. Gives the events, and how many accesses went through the
    /// host.
    fn run(&mut self, ticks: u32) -> (Vec<Event>, u32) {
        self.engine.calls.set(0);
        let mut all = vec![];
        for _ in 0..ticks {
            let (mut expected, mut events) = (vec![], vec![]);
            self.oracle.tick(self.interpreter.as_mut(), &mut expected).unwrap();
            self.executive.tick(&mut self.engine, &mut events).unwrap();
            assert_eq!(events, expected, "tick {}", self.tick);
            all.append(&mut events);
            // The whole image but the bytes that describe the state of the code.
            let layout = &self.layout;
            for (start, end) in [
                (0, layout.reference_definitions),
                (layout.thumbwheels, layout.differing_definitions),
                (layout.q_base, layout.size),
            ] {
                let (start, end) = (start as usize, end as usize);
                let (ours, theirs) =
                    (&self.oracle.image()[start..end], &self.executive.image()[start..end]);
                let differs = || ours.iter().zip(theirs).position(|(a, b)| a != b).unwrap();
                assert!(ours == theirs, "tick {}: offset {}", self.tick, start + differs());
            }
            self.tick += 1;
        }
        (all, self.engine.calls.get())
    }

    fn replacements(&self) -> u32 {
        self.engine.engine.replacements()
    }

    fn set(&mut self, name: &str, text: &str) {
        for executive in [&mut self.oracle, &mut self.executive] {
            let variable = executive.find(name, Purpose::Stimulus).unwrap();
            let value = executive.parse(variable, text).unwrap();
            executive.set(variable, value);
        }
    }

    fn get(&mut self, name: &str) -> f64 {
        let variable = self.executive.find(name, Purpose::Watch).unwrap();
        self.executive.get(variable).to_string().parse().unwrap()
    }
}

/// A PLC with logic on M-variables whose definitions another PLC changes.
const LOGIC: &str = "OPEN PLC 2 CLEAR\nM2=M1*3+1\nIF (M2>20)\nM3=M3^1\nENDIF\nP9=P9+M2\nCLOSE\n";

#[test]
fn code_follows_definitions_moved_by_an_initialising_plc() {
    let source = format!(
        "I5=3\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24,S\nM3->Y:$FFC2,3,1\nM100->Y:$BC01,0,16\n\
         M1=5\nDISABLE PLC 1\nOPEN PLC 1 CLEAR\nM100=$07F2\nDISABLE PLC 1\nCLOSE\n\
         OPEN PLC 3 CLEAR\nP1=P1+1\nIF (P1=10)\nENABLE PLC 1\nENDIF\nCLOSE\n{LOGIC}"
    );
    let mut pair = Pair::new(&source, WITHOUT_DELAY);
    // M1 is seen to be moved, so it is left to the host at first, and then it does not move.
    let (_, calls) = pair.run(1);
    assert!(calls <= 1);
    pair.run(2);
    assert_eq!(pair.replacements(), 1);
    let (_, calls) = pair.run(14);
    assert_eq!((calls, pair.replacements()), (0, 1));
    // PLC 1 moves M1 to $07F2 in its one scan; PLC 2 asks the host at most until the second tick.
    let (_, calls) = pair.run(12);
    assert!(calls > 0, "PLC 1 writes a definition through the host");
    assert_eq!(pair.replacements(), 2);
    let (_, calls) = pair.run(40);
    assert_eq!((calls, pair.replacements()), (0, 2));
    pair.set("X:$07F2", "9");
    pair.run(4);
    assert_eq!(pair.get("M2"), 28.0);
}

#[test]
fn code_follows_definitions_moved_by_commands() {
    let source = format!(
        "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24,S\nM3->Y:$FFC2,3,1\nM4->*\nM1=4\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=5)\nCOMMAND\"M1->L:$1005\"\nENDIF\n\
         IF (P1=15)\nCOMMAND\"M2->X:$07F5,0,16\"\nCOMMAND\"M3->L:$1402\"\nENDIF\n\
         IF (P1=25)\nCOMMAND\"M4->Y:$07F6,4,8,S\"\nENDIF\nCLOSE\n\
         OPEN PLCC 3 CLEAR\nM4=M4+1\nCLOSE\n{LOGIC}"
    );
    let mut pair = Pair::new(&source, WITHOUT_DELAY);
    pair.run(4);
    assert_eq!(pair.replacements(), 1, "all are seen to be moved, and rest");
    for changes in 2..=4 {
        let (events, calls) = pair.run(20);
        assert!(!events.is_empty());
        assert!(calls > 0);
        assert_eq!(pair.replacements(), changes);
    }
    let (_, calls) = pair.run(40);
    assert_eq!((calls, pair.replacements()), (0, 4));
}

/// Code cannot access a field of the format D directly, so it stays with the host; all others are
/// accessed directly again.
#[test]
fn a_definition_that_code_cannot_access_stays_with_the_host() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM3->D:$07F2\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=5)\nCOMMAND\"M1->X:$07F3,0,16,D\"\nENDIF\n\
         IF (P1=20)\nCOMMAND\"M3->X:$07F2,0,24\"\nENDIF\n\
         IF (P1=40)\nCOMMAND\"M1->X:$07F4,0,16\"\nENDIF\n\
         M2=M2+1\nM1=M2\nM3=M2\nCLOSE\n";
    let mut pair = Pair::new(source, WITHOUT_DELAY);
    pair.run(3);
    let (_, calls) = pair.run(1);
    assert_eq!((calls, pair.replacements()), (1, 1), "M3");
    pair.run(8);
    assert_eq!(pair.replacements(), 2);
    let (_, calls) = pair.run(5);
    assert_eq!(calls, 10, "M1 and M3");
    pair.run(8);
    assert_eq!(pair.replacements(), 3);
    let (_, calls) = pair.run(5);
    assert_eq!(calls, 5, "M1");
    pair.run(15);
    assert_eq!(pair.replacements(), 4);
    let (_, calls) = pair.run(10);
    assert_eq!(calls, 0);
}

/// When a definition becomes what it was before, the code that was compiled for it is used again.
#[test]
fn a_definition_that_returns_needs_no_recompilation() {
    let source = format!("I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM3->*\nM1=1\n{LOGIC}");
    let mut pair =
        Pair::new(&source, Settings { settled_after: 100, patience: 1000, ..WITHOUT_DELAY });
    let (_, calls) = pair.run(20);
    assert_eq!(calls, 0);
    pair.set("Y:$BC01", "$07F1");
    let (_, calls) = pair.run(20);
    assert_eq!(calls, 20, "the statement that names M1 through the host");
    pair.set("Y:$BC01", "$07F0");
    let (_, calls) = pair.run(200);
    assert_eq!((calls, pair.replacements()), (0, 0));
}

/// Code that is not recompiled has the host execute the statements that name the M-variable whose
/// definition has changed, each by one call, and executes all others itself.
#[test]
fn only_statements_that_name_a_moved_variable_go_through_the_host() {
    let source = "I5=2\nM1->Y:$FFC2,0,1\nM2->Y:$FFC2,1,1\nM3->Y:$07F0,0,24,S\nM4->X:$07F1,8,8\nM5->*\n\
         OPEN PLC 1 CLEAR\nADDRESS&2\nP1=P1+1\nM3=M3+P1%7\nM4=M3\nM5=M4&$F0|M3\nM1=M4&1\n\
         IF (M1=1 AND M3>20)\nP2=P2+M4\nELSE\nP3=P3+1\nENDIF\nQ5=M3/3\nI15=M3\nM2=M1^1\n\
         IF (M2=1)\nP4=P4+M5\nENDIF\nP(M1+8)=M4\nP10..12=M3+1\nCLOSE\n";
    let settings = Settings { settled_after: u32::MAX, patience: u32::MAX, ..WITHOUT_DELAY };
    let mut pair = Pair::new(source, settings);
    let (_, calls) = pair.run(20);
    assert_eq!(calls, 0);
    // M3 becomes a word of its own, that of M1 and M2, half of P7, half of Q7, and the definition of M2.
    let before = pair.get("Y:$BC03");
    for address in ["$07F1", "$FFC2", "$1007", "$1407", "$BC02"] {
        pair.set("Y:$BC03", address);
        let (_, calls) = pair.run(10);
        // Seven statements name M3. Two name M2, whose definition M3 changes in most scans at last.
        let most = if address == "$BC02" { 90 } else { 70 };
        assert!((70..=most).contains(&calls), "{address}: {calls}");
    }
    pair.set("Y:$BC03", &before.to_string());
    pair.set("Y:$BC02", "$FFC2");
    pair.run(1);
    let (_, calls) = pair.run(20);
    assert_eq!((calls, pair.replacements()), (0, 0));
}

/// The array of the PMAC manual (User's Guide): a definition that the program visibly changes in every
/// scan is left to the host, and everything else is specialised from the first tick on.
#[test]
fn a_definition_moved_in_every_scan_is_left_to_the_host() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM34->L:$1028\nM35->Y:$BC22,0,16\nM50->Y:$07F1,0,24\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (P1<5)\nM35=$1028+P1\nM34=M34+P1+M1\nP1=P1+1\nENDWHILE\n\
         CLOSE\nOPEN PLC 2 CLEAR\nM50=M50+1\nM1=M50&7\nCLOSE\n";
    let mut pair = Pair::new(source, Settings { settled_after: 10, ..WITHOUT_DELAY });
    for _ in 0..8 {
        let (_, calls) = pair.run(120);
        // PLC 1 and PLC 2 take turns. PLC 1 asks for M35 once and for M34 twice in a scan.
        assert!((100..=60 * 3).contains(&calls), "{calls}");
    }
    assert_eq!(pair.replacements(), 0);
}

/// The same where the compiler cannot see it, since the number of the changed variable is computed.
#[test]
fn a_definition_moved_through_a_computed_number_is_left_to_the_host() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM34->L:$1028\nM35->Y:$BC22,0,16\nM50->Y:$07F1,0,24\nP8=35\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (P1<5)\nM(P8)=$1028+P1\nM34=M34+P1+M1\nP1=P1+1\n\
         ENDWHILE\nCLOSE\nOPEN PLC 2 CLEAR\nM50=M50+1\nM1=M50&7\nCLOSE\n";
    // PLC 1 has every other tick, so M34 rests for a tick at most, but for the end of the loop.
    let mut pair = Pair::new(source, Settings { settled_after: 3, ..WITHOUT_DELAY });
    pair.run(400);
    assert_eq!(pair.replacements(), 2, "once at a rest, and once to leave M34 to the host");
    let (_, calls) = pair.run(120);
    assert!((100..=60 * 3).contains(&calls), "{calls}");
}

/// For definitions that change again and again after a while, code is recompiled a few times only:
/// there is a limit for each definition and one for all.
#[test]
fn recompilations_are_limited_for_each_definition_and_in_all() {
    let mover = |number: u32, address: u32, every: u32| {
        format!("IF (P1%{every}=0)\nM{}=${address:X}+P2\nENDIF\nP3=P3+M{number}\n", number + 100)
    };
    let mut source = String::from("I5=2\n");
    for number in 1..=8 {
        let address = 0xBC00 + number;
        source += &format!("M{number}->X:$0780,0,24\nM{}->Y:${address:X},0,16\n", number + 100);
    }
    source += "OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1%10=0)\nP2=P2+1\nENDIF\n";
    for number in 1..=8 {
        source += &mover(number, 0x0780 + 16 * number, 10 * number);
    }
    source += "CLOSE\n";
    let mut pair = Pair::new(&source, WITHOUT_DELAY);
    pair.run(1500);
    let changes = pair.replacements();
    assert!((3..=3 * 8 + 8).contains(&changes), "{changes}");
    pair.run(1000);
    assert_eq!(pair.replacements(), changes, "all of them are left to the host");
    let mut pair = Pair::new(&source, Settings { max_recompilations: 4, ..WITHOUT_DELAY });
    pair.run(1500);
    assert_eq!(pair.replacements(), 4);
    let mut pair = Pair::new(&source, Settings { max_recompilations: 0, ..WITHOUT_DELAY });
    pair.run(200);
    assert_eq!(pair.replacements(), 0);
}

/// PLCs that are suspended in a WHILE when the code is replaced resume there.
#[test]
fn waiting_plcs_resume_where_they_were_in_new_code() {
    let source = "I5=3\nI8=0\nM1->X:$07F0,0,24\nM2->Y:$FFC2,0,8\nM11->Y:$BC01,0,16\n\
         OPEN PLC 0 CLEAR\nP10=P10+1\nWHILE (P10<7)\nP10=P10+1\nM2=M2+1\nENDWHILE\nP11=P11+1\nCLOSE\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (M1<3)\nP1=P1+1\nENDWHILE\nP2=P2+1\n\
         WHILE (M1<6)\nP3=P3+1\nWHILE (P3%4!=0)\nP3=P3+1\nENDWHILE\nENDWHILE\nM1=0\nCLOSE\n\
         OPEN PLC 2 CLEAR\nP5=P5+1\nIF (P5%9=0)\nM1=M1+1\nENDIF\nCLOSE\n\
         OPEN PLC 3 CLEAR\nP6=P6+1\nIF (P6%50=0)\nM11=$07F0+P6/50\nM1=2\nENDIF\nCLOSE\n";
    let settings = Settings { settled_after: 0, max_per_variable: 255, ..WITHOUT_DELAY };
    let mut pair = Pair::new(source, settings);
    pair.run(2000);
    assert!(pair.replacements() > 10, "{}", pair.replacements());
    assert!(pair.get("P2") > 10.0 && pair.get("P11") > 10.0);
}

/// A checkpoint is restored, in both executives, when the code assumes other definitions than it did
/// when the checkpoint was taken.
#[test]
fn checkpoints_do_not_depend_on_what_code_assumes() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM11->Y:$BC01,0,16\nM1=3\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1%25=0)\nM11=$07F0+P1/25\nENDIF\nM1=M1+1\nP2=P2+M1\n\
         M2=P2\nCLOSE\n";
    let mut pair = Pair::new(source, WITHOUT_DELAY);
    pair.run(20);
    let early = pair.executive.checkpoint();
    let changes = pair.replacements();
    pair.run(40);
    assert!(pair.replacements() > changes, "other code runs now");
    let late = pair.executive.checkpoint();
    for checkpoint in [&early, &late, &early] {
        pair.executive.resume(checkpoint).unwrap();
        pair.oracle.resume(checkpoint).unwrap();
        pair.run(30);
    }
    assert_eq!(pair.get("P1"), 50.0);
}

/// A range may move the definitions of its own variables.
#[test]
fn an_assignment_to_a_range_may_move_its_own_definitions() {
    let source = "I5=2\nM1->Y:$BC02,0,16\nM2->X:$07F0,0,24\nM3->X:$07F2,0,24\nM4->Y:$BC03,0,16\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=3)\nM1..2=$07F1\nENDIF\nIF (P1=12)\nM4=$07F3\n\
         ENDIF\nIF (P1=15)\nM1..4=$07F4\nENDIF\nM2=M2+1\nM3=M3+1\nCLOSE\n";
    let mut pair = Pair::new(source, WITHOUT_DELAY);
    pair.run(60);
    assert_eq!(pair.get("X:$07F1"), 2033.0 + 12.0);
}

/// The resume points of tasks do not depend on the definitions that the code assumes.
#[test]
fn resume_points_do_not_depend_on_what_code_assumes() {
    use plcc_ir::Terminator;
    let source = format!(
        "I5=3\nM1->X:$07F0,0,24\nM2->Y:$FFC2,0,8\nM3->D:$07F1\n{LOGIC}\
         OPEN PLC 1 CLEAR\nWHILE (M1<3)\nP1=P1+1\nWHILE (M2=0)\nENDWHILE\nENDWHILE\n\
         WHILE (M3<M1)\nENDWHILE\nCLOSE\nOPEN PLCC 4 CLEAR\nWHILE (P4<M1)\nENDWHILE\nCLOSE\n"
    );
    let program = check(&source);
    let assumed = |definition| -> Vec<Assumption> {
        (1..=3).map(|number| Assumption { number, definition }).collect()
    };
    let resumes = |assumed: &[Assumption]| {
        let lowered = program.lower_for(assumed).unwrap();
        assert_eq!(plcc_ir::verify::verify(&lowered.module), []);
        // Every statement that ends a loop, by its place in the source.
        let mut resumes = vec![];
        for func in &lowered.module.funcs {
            for (_, block) in func.blocks() {
                if let Some(Terminator::Suspend(label)) = &block.terminator {
                    resumes.push(*label);
                }
            }
        }
        resumes.sort();
        resumes.dedup();
        (resumes, lowered.module.tasks, lowered.program)
    };
    let first = resumes(program.assumptions());
    assert_eq!(first.0.len(), 4);
    for other in [
        vec![],
        assumed(None),
        assumed(Some(Definition::Star)),
        assumed(Some(Definition::L { address: 0x1003 })),
        vec![Assumption { number: 1, definition: Some(Definition::Star) }],
    ] {
        assert_eq!(resumes(&other), first, "{other:?}");
    }
}

/// A compiler in a thread of its own delays no tick; its code is used as soon as it is there.
#[test]
fn a_compiler_in_its_own_thread_delays_no_tick() {
    /// A compiler that begins when it is told to.
    struct Waiting(Box<dyn Recompiler>, Receiver<()>);
    impl Recompiler for Waiting {
        fn recompile(&mut self, assumed: &[Assumption]) -> Result<NativeEngine, String> {
            self.1.recv().map_err(|error| error.to_string())?;
            self.0.recompile(assumed)
        }
    }
    let source = format!("I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM3->*\nM1=1\n{LOGIC}");
    let program = check(&source);
    let (native, _) = jit(&program.lower().unwrap().into()).unwrap();
    let (begin, told) = channel();
    let compiler = Box::new(Waiting(recompiler(&program), told));
    let mut pair =
        Pair::with(&program, native, compiler, Settings { in_thread: true, ..WITHOUT_DELAY });
    pair.set("Y:$BC01", "$07F5");
    pair.run(12);
    assert_eq!(pair.replacements(), 0, "the compiler has not begun");
    begin.send(()).unwrap();
    // The limit only ends a test in which the compiler never ends.
    let start = Instant::now();
    while pair.replacements() == 0 && start.elapsed() < Duration::from_secs(300) {
        pair.run(1);
    }
    let (_, calls) = pair.run(40);
    assert_eq!((calls, pair.replacements()), (0, 1));
}

/// A compiler that fails is not called again; the present code is used further.
#[test]
fn a_compiler_that_fails_is_not_asked_again() {
    struct Failing(Arc<AtomicU32>);
    impl Recompiler for Failing {
        fn recompile(&mut self, _: &[Assumption]) -> Result<NativeEngine, String> {
            self.0.fetch_add(1, Ordering::Relaxed);
            Err("no".into())
        }
    }
    let source = format!(
        "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM3->*\nM101->Y:$BC01,0,16\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1%5=0)\nM101=$07F0+P1\nENDIF\nCLOSE\n{LOGIC}"
    );
    let program = check(&source);
    let (native, _) = jit(&program.lower().unwrap().into()).unwrap();
    let count = Arc::new(AtomicU32::new(0));
    let mut pair =
        Pair::with(&program, native, Box::new(Failing(Arc::clone(&count))), WITHOUT_DELAY);
    pair.run(100);
    assert_eq!(count.load(Ordering::Relaxed), 1);
    assert_eq!(pair.replacements(), 0);
}
