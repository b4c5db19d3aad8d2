//! Downloads that change definitions of M-variables while they run, in native code. The state is that of the statement
//! interpreter after every servo cycle, and the host executes no more statements than those that name a variable whose
//! definition has changed.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::cell::Cell;
use std::rc::Rc;

use plcc::later_code::jit_in_parts;
use plcc_abi::{Engine, Host, HostFn, Outcome, ResumePoint, Scan};
use plcc_codegen::OptLevel;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::{Event, Executive, NativeEngine, Purpose};

use super::checked::check;

/// An engine that counts the accesses to M-variables which the code leaves to the host.
struct Counting {
    engine: NativeEngine,
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
}

/// A download in the statement interpreter and in native code, side by side.
struct Pair {
    interpreter: Box<dyn Engine>,
    oracle: PmacExecutive,
    engine: Counting,
    executive: PmacExecutive,
    tick: u32,
}

impl Pair {
    fn new(source: &str) -> Self {
        let program = check(source);
        let made = jit_in_parts(|| Ok(program.lower().unwrap()), OptLevel::Speed).unwrap();
        let executive = || PmacExecutive::new(&made.program, PmacOptions::default()).unwrap();
        let (oracle, executive) = (executive(), executive());
        Self {
            interpreter: program.interpreter(),
            oracle,
            engine: Counting { engine: made.engine, calls: Rc::default() },
            executive,
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
            let (ours, theirs) = (self.oracle.image(), self.executive.image());
            let differs = || ours.iter().zip(theirs).position(|(a, b)| a != b);
            assert!(ours == theirs, "tick {}: offset {:?}", self.tick, differs());
            self.tick += 1;
        }
        (all, self.engine.calls.get())
    }

    fn set(&mut self, name: &str, text: &str) {
        for executive in [&mut self.oracle, &mut self.executive] {
            let variable = executive.names().find(name, Purpose::Stimulus).unwrap();
            let value = executive.names().parse(variable, text).unwrap();
            executive.write(variable, value);
        }
    }

    fn get(&mut self, name: &str) -> f64 {
        let variable = self.executive.names().find(name, Purpose::Watch).unwrap();
        self.executive.read(variable).to_string().parse().unwrap()
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
    let mut pair = Pair::new(&source);
    // M1 is seen to be moved, so the host is asked for it from the beginning, once in a scan, and for nothing else.
    let (_, calls) = pair.run(17);
    assert!((1..=17).contains(&calls), "{calls}");
    // PLC 1 moves M1 to $07F2 in its one scan.
    let (_, calls) = pair.run(40);
    assert!((1..=41).contains(&calls), "{calls}");
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
    let mut pair = Pair::new(&source);
    let (events, _) = pair.run(100);
    assert_eq!(events.len(), 4, "{events:?}");
    let (events, calls) = pair.run(40);
    assert!(events.is_empty() && calls > 0);
}

/// Code cannot access a field of the format D directly, so it asks the host for it; all others are accessed directly.
#[test]
fn a_definition_that_code_cannot_access_stays_with_the_host() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM3->D:$07F2\n\
         OPEN PLC 1 CLEAR\nM2=M2+1\nM1=M2\nM3=M2\nCLOSE\n";
    let mut pair = Pair::new(source);
    let (_, calls) = pair.run(5);
    assert_eq!(calls, 5, "M3");
}

/// When a definition becomes what it was before, specialised code runs again.
#[test]
fn a_definition_that_returns_makes_specialised_code_valid_again() {
    let source = format!("I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM3->*\nM1=1\n{LOGIC}");
    let mut pair = Pair::new(&source);
    let (_, calls) = pair.run(20);
    assert_eq!(calls, 0);
    pair.set("Y:$BC01", "$07F1");
    let (_, calls) = pair.run(20);
    assert_eq!(calls, 20, "the statement that names M1 through the host");
    pair.set("Y:$BC01", "$07F0");
    let (_, calls) = pair.run(200);
    assert_eq!(calls, 0);
}

/// General code has the host execute the statements that name the M-variable whose
/// definition has changed, each by one call, and executes all others itself.
#[test]
fn only_statements_that_name_a_moved_variable_go_through_the_host() {
    let source = "I5=2\nM1->Y:$FFC2,0,1\nM2->Y:$FFC2,1,1\nM3->Y:$07F0,0,24,S\nM4->X:$07F1,8,8\nM5->*\n\
         OPEN PLC 1 CLEAR\nADDRESS&2\nP1=P1+1\nM3=M3+P1%7\nM4=M3\nM5=M4&$F0|M3\nM1=M4&1\n\
         IF (M1=1 AND M3>20)\nP2=P2+M4\nELSE\nP3=P3+1\nENDIF\nQ5=M3/3\nI15=M3\nM2=M1^1\n\
         IF (M2=1)\nP4=P4+M5\nENDIF\nP(M1+8)=M4\nP10..12=M3+1\nCLOSE\n";
    let mut pair = Pair::new(source);
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
    assert_eq!(calls, 0);
}

/// The array of the PMAC manual (User's Guide): a definition that the program visibly changes in every
/// scan is left to the host, and everything else is specialised from the first tick on.
#[test]
fn a_definition_moved_in_every_scan_is_left_to_the_host() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM34->L:$1028\nM35->Y:$BC22,0,16\nM50->Y:$07F1,0,24\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (P1<5)\nM35=$1028+P1\nM34=M34+P1+M1\nP1=P1+1\nENDWHILE\n\
         CLOSE\nOPEN PLC 2 CLEAR\nM50=M50+1\nM1=M50&7\nCLOSE\n";
    let mut pair = Pair::new(source);
    for _ in 0..8 {
        let (_, calls) = pair.run(120);
        // PLC 1 and PLC 2 take turns. PLC 1 asks for M35 once and for M34 twice in a scan.
        assert!((100..=60 * 3).contains(&calls), "{calls}");
    }
}

/// The same where the compiler cannot see it, since the number of the changed variable is computed: general code runs,
/// and has the host execute the statements that name M34.
#[test]
fn a_definition_moved_through_a_computed_number_is_left_to_the_host() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM34->L:$1028\nM35->Y:$BC22,0,16\nM50->Y:$07F1,0,24\nP8=35\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (P1<5)\nM(P8)=$1028+P1\nM34=M34+P1+M1\nP1=P1+1\n\
         ENDWHILE\nCLOSE\nOPEN PLC 2 CLEAR\nM50=M50+1\nM1=M50&7\nCLOSE\n";
    let mut pair = Pair::new(source);
    pair.run(400);
    let (_, calls) = pair.run(120);
    assert!((100..=60 * 3).contains(&calls), "{calls}");
}

/// PLCs that are suspended in a WHILE when a definition moves resume there.
#[test]
fn waiting_plcs_resume_where_they_were() {
    let source = "I5=3\nI8=0\nM1->X:$07F0,0,24\nM2->Y:$FFC2,0,8\nM11->Y:$BC01,0,16\n\
         OPEN PLC 0 CLEAR\nP10=P10+1\nWHILE (P10<7)\nP10=P10+1\nM2=M2+1\nENDWHILE\nP11=P11+1\nCLOSE\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (M1<3)\nP1=P1+1\nENDWHILE\nP2=P2+1\n\
         WHILE (M1<6)\nP3=P3+1\nWHILE (P3%4!=0)\nP3=P3+1\nENDWHILE\nENDWHILE\nM1=0\nCLOSE\n\
         OPEN PLC 2 CLEAR\nP5=P5+1\nIF (P5%9=0)\nM1=M1+1\nENDIF\nCLOSE\n\
         OPEN PLC 3 CLEAR\nP6=P6+1\nIF (P6%50=0)\nM11=$07F0+P6/50\nM1=2\nENDIF\nCLOSE\n";
    let mut pair = Pair::new(source);
    pair.run(2000);
    assert!(pair.get("P2") > 10.0 && pair.get("P11") > 10.0);
}

/// A checkpoint is restored, in both executives, when the code assumes other definitions than it did
/// when the checkpoint was taken.
#[test]
fn checkpoints_do_not_depend_on_what_code_assumes() {
    let source = "I5=2\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM11->Y:$BC01,0,16\nM1=3\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1%25=0)\nM11=$07F0+P1/25\nENDIF\nM1=M1+1\nP2=P2+M1\n\
         M2=P2\nCLOSE\n";
    let mut pair = Pair::new(source);
    pair.run(20);
    let early = pair.executive.checkpoint();
    pair.run(40);
    let late = pair.executive.checkpoint();
    for checkpoint in [&early, &late, &early] {
        pair.executive.resume(checkpoint).unwrap();
        pair.oracle.resume(checkpoint).unwrap();
        pair.run(30);
    }
    assert_eq!(pair.get("P1"), 50.0);
}

/// M20 moves the definition of M11 to where that of another variable is, which nobody can know before.
#[test]
fn a_variable_that_was_moved_may_move_others() {
    let source = "I5=2\nM5->X:$07F0,0,24\nM12->X:$07F2,0,24\nM11->Y:$07F5,0,16\nM20->Y:$BC0B,0,16\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=3)\nM20=$BC05\nENDIF\n\
         IF (P1=6)\nM11=$07F1\nM5=M5+100\nENDIF\nIF (P1=9)\nM20=$BC0C\nENDIF\n\
         IF (P1=12)\nM11..12=$07F3\nM12=M12+100\nENDIF\nM5=M5+1\nM12=M12+1\nCLOSE\n";
    let mut pair = Pair::new(source);
    pair.run(60);
    assert!(pair.get("X:$07F1") > 100.0 && pair.get("X:$07F3") > 2000.0);
}

/// A range may move the definitions of its own variables.
#[test]
fn an_assignment_to_a_range_may_move_its_own_definitions() {
    let source = "I5=2\nM1->Y:$BC02,0,16\nM2->X:$07F0,0,24\nM3->X:$07F2,0,24\nM4->Y:$BC03,0,16\n\
         OPEN PLC 1 CLEAR\nP1=P1+1\nIF (P1=3)\nM1..2=$07F1\nENDIF\nIF (P1=12)\nM4=$07F3\n\
         ENDIF\nIF (P1=15)\nM1..4=$07F4\nENDIF\nM2=M2+1\nM3=M3+1\nCLOSE\n";
    let mut pair = Pair::new(source);
    pair.run(60);
    assert_eq!(pair.get("X:$07F1"), 2033.0 + 12.0);
}
