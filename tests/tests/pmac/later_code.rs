//! The general versions of PLCs, which an engine that compiles just in time makes only when a definition of an M-variable
//! first moves: the state is that of the statement interpreter after every servo cycle, before and after.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc::compile::{Optimized, code};
use plcc::later_code::jit_in_parts;
use plcc_abi::{Code, CodeMemory, Engine};
use plcc_codegen::{OptLevel, Target};
use plcc_frontend::common::Lowered;
use plcc_runtime::native::LaterCode;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::{Executive, NativeEngine, Purpose};

use super::checked::check;

/// A download in the statement interpreter and in native code whose general versions are made later.
struct Pair {
    interpreter: Box<dyn Engine>,
    oracle: PmacExecutive,
    engine: NativeEngine,
    executive: PmacExecutive,
    lowered: Lowered,
}

impl Pair {
    fn new(source: &str) -> Self {
        let program = check(source);
        let lowered = program.lower().unwrap();
        let executive = || PmacExecutive::new(&lowered.program, PmacOptions::default()).unwrap();
        Self {
            interpreter: program.interpreter(),
            oracle: executive(),
            engine: jit_in_parts(|| Ok(lowered.clone()), OptLevel::Speed).unwrap().engine,
            executive: executive(),
            lowered,
        }
    }

    fn run(&mut self, ticks: u32) {
        for tick in 0..ticks {
            let (mut expected, mut events) = (vec![], vec![]);
            self.oracle.tick(self.interpreter.as_mut(), &mut expected).unwrap();
            self.executive.tick(&mut self.engine, &mut events).unwrap();
            assert_eq!(events, expected, "tick {tick}");
            assert!(self.oracle.image() == self.executive.image(), "tick {tick}");
            assert!(self.oracle.checkpoint() == self.executive.checkpoint(), "tick {tick}");
        }
    }

    fn set(&mut self, name: &str, text: &str) {
        for executive in [&mut self.oracle, &mut self.executive] {
            let variable = executive.names().find(name, Purpose::Stimulus).unwrap();
            let value = executive.names().parse(variable, text).unwrap();
            executive.write(variable, value);
        }
    }

    fn get(&mut self, name: &str) -> String {
        let variable = self.executive.names().find(name, Purpose::Watch).unwrap();
        self.executive.read(variable).to_string()
    }
}

/// PLC 1 moves the definition of M1 in its fifth scan, through a number that the compiler does not know, and uses M1
/// before and after it in the same scan. PLC 2 uses it, too, and PLC 3 waits in a WHILE until it has moved.
const MOVING: &str = "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24,S\nM101->Y:$BC01,0,16\nM1=3\nP8=101\n\
    OPEN PLC 1 CLEAR\nP1=P1+1\nM2=M2+M1\nIF (P1=5)\nM(P8)=$07F2\nM1=9\nENDIF\nM2=M2+M1*2\nCLOSE\n\
    OPEN PLC 2 CLEAR\nP2=M1+P2\nIF (M2>500)\nM2=M1\nENDIF\nCLOSE\n\
    OPEN PLC 3 CLEAR\nWHILE (M1<9)\nP3=P3+M2\nENDWHILE\nP4=P4+M1\nCLOSE\n";

#[test]
fn code_is_made_when_the_program_moves_a_definition_in_a_scan() {
    let mut pair = Pair::new(MOVING);
    pair.run(6);
    assert!(!pair.engine.has_later_code(), "nothing has moved");
    pair.run(30);
    assert!(pair.engine.has_later_code());
    assert_eq!(pair.get("M1"), "9");
    assert_ne!(pair.get("P4"), "0", "PLC 3 has left its loop");
}

/// Also in a PLC that was suspended, which resumes in general code.
#[test]
fn code_is_made_when_a_definition_is_moved_from_outside() {
    let source = "I5=3\nI8=0\nM1->X:$07F0,0,24\nM2->Y:$FFC2,0,8\nM3->X:$07F5,0,24\n\
         OPEN PLC 0 CLEAR\nP9=P9+M3\nCLOSE\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nWHILE (M1<4)\nM2=M2+1\nP2=P2+M3\nENDWHILE\nM1=M1+1\nCLOSE\n";
    let mut pair = Pair::new(source);
    pair.run(20);
    assert!(!pair.engine.has_later_code());
    assert_eq!(pair.get("P1"), "1", "PLC 1 is suspended in its loop");
    pair.set("Y:$BC01", "$07F3");
    pair.run(1);
    assert!(pair.engine.has_later_code());
    pair.run(20);
    pair.set("X:$07F3", "4");
    pair.run(20);
    assert_ne!(pair.get("P1"), "1");
    // Back to the specialised code, and to the general code once more.
    for address in ["$07F0", "$07F6", "$07F0"] {
        pair.set("Y:$BC01", address);
        pair.run(10);
    }
}

/// A control goes on from a checkpoint that was taken after a definition had moved, in engines that have made no general
/// code yet, and changes between engines that have and such that have not.
#[test]
fn a_control_goes_on_from_a_checkpoint_in_code_that_is_made_then() {
    for ticks in [3, 8, 9, 10, 11, 20] {
        let mut pair = Pair::new(MOVING);
        pair.run(ticks);
        let checkpoint = pair.executive.checkpoint();
        let program = &pair.lowered.program;
        pair.executive = PmacExecutive::new(program, PmacOptions::default()).unwrap();
        pair.executive.resume(&checkpoint).unwrap();
        let fresh = jit_in_parts(|| Ok(pair.lowered.clone()), OptLevel::Speed).unwrap().engine;
        let mut used = std::mem::replace(&mut pair.engine, fresh);
        for _ in 0..6 {
            pair.run(5);
            std::mem::swap(&mut pair.engine, &mut used);
        }
        assert!(pair.engine.has_later_code() && used.has_later_code());
    }
}

/// Nothing can be compiled where an artifact runs, so it holds everything.
#[test]
fn an_artifact_holds_the_general_code_too() {
    let (mut lowered, _) = Optimized::of(check(MOVING).lower().unwrap(), OptLevel::Speed);
    let whole = code(&lowered, &Target::host_baseline().unwrap()).unwrap();
    assert!(whole.is_complete());
    assert!(whole.functions.len() == lowered.module.funcs.len());
    assert!(lowered.module.funcs.iter().any(|func| func.is_optimized_for_size()));
    lowered.module.split_off_rare(usize::MAX).unwrap();
    lowered.codegen = lowered.codegen.of_part();
    let part = code(&lowered, &Target::host_baseline().unwrap()).unwrap();
    assert!(!part.is_complete());
    let error = plcc::compile::artifact(&lowered.program, &part).unwrap_err();
    assert!(error.to_string().contains("lacks the code of a label"), "{error}");
}

/// What makes no code, as a compiler that finds an error of its own.
struct Failing(fn() -> String);

impl LaterCode for Failing {
    fn make(self: Box<Self>) -> Result<(Code, Box<dyn CodeMemory>), String> {
        Err(self.0())
    }
}

#[test]
fn code_that_cannot_be_made_stops_the_control_with_an_internal_error() {
    for failing in [Failing(|| "no".into()), Failing(|| panic!("not made"))] {
        let mut pair = Pair::new(MOVING);
        pair.engine.make_later(Box::new(failing));
        pair.run(6);
        let mut events = vec![];
        let stop = (0..30).find_map(|_| pair.executive.tick(&mut pair.engine, &mut events).err());
        assert_eq!(stop.unwrap().code, "INTERNAL ERROR");
        assert!(!pair.engine.has_later_code());
    }
}
