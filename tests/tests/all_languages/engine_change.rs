//! A task that one engine suspends resumes in another: resume points and the image mean the same in
//! all of them. PLCs of PMAC are suspended in WHILE loops, NCT's module :000 at safepoints, also
//! inside subroutines. A different engine makes each call of a task.
#![allow(clippy::unwrap_used)]

use plcc_abi::{Dialect, Engine, Outcome, ResumePoint, Scan, TrapCode};
use plcc_frontend::common::Options;
use plcc_tests::compile::EngineKind;
use plcc_tests::drive::Bench;
use plcc_tests::gen_pmi::Case;
use plcc_tests::{gen_nct, gen_pmac};

/// Several engines that take turns: each makes one call, then the next one does.
struct Relay {
    engines: Vec<Box<dyn Engine>>,
    turn: usize,
    /// How often a task resumed in another engine than the one that had suspended it.
    handed_over: usize,
}

impl Engine for Relay {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.handed_over += usize::from(from.is_some());
        self.turn = (self.turn + 1) % self.engines.len();
        self.engines[self.turn].call(task, from, scan)
    }
}

/// Compares a run in the statement interpreter with one in which all engines take turns. Gives how
/// often a task resumed in another engine.
fn compare(case: &Case, dialect: Dialect) -> usize {
    let source = &case.source;
    let bench = Bench::new(case, dialect, &Options::default()).unwrap();
    let (program, mut oracle) = bench.compiled.engine(EngineKind::Statements).unwrap();
    // Once more the statement interpreter: with an even number, tasks that run by turns would
    // always meet the same ones.
    let ways = EngineKind::ALL.into_iter().chain([EngineKind::Statements]);
    let engines = ways.map(|way| bench.compiled.engine(way).unwrap().1).collect();
    let mut relay = Relay { engines, turn: 0, handed_over: 0 };
    let mut expected = bench.machine(&program).unwrap();
    let mut found = bench.machine(&program).unwrap();
    for tick in 0..bench.ticks {
        let (ours, theirs) = (expected.step(&mut *oracle), found.step(&mut relay));
        assert_eq!(ours, theirs, "tick {tick}\n{source}");
        let (ours, theirs) = (expected.state(&program), found.state(&program));
        let differs = ours.iter().zip(&theirs).position(|(a, b)| a != b);
        assert_eq!(differs, None, "tick {tick}: an offset in the image\n{source}");
    }
    relay.handed_over
}

fn case(source: &str, ticks: u32) -> Case {
    let (source, stimulus) = (source.to_owned(), "tick,name,value\n".to_owned());
    Case { source, stimulus, watch: vec![], ticks }
}

#[test]
fn pmac_loops_resume_in_another_engine() {
    let source = "I5=3\nI8=0\nM1->X:$07F0,0,24\n\
         OPEN PLC 0 CLEAR\nP10=P10+1\nWHILE (P10%7!=0)\nP10=P10+1\nENDWHILE\nP11=P11+1\nCLOSE\n\
         OPEN PLC 1 CLEAR\nP1=0\nWHILE (M1<3)\nP1=P1+1\nENDWHILE\nP2=P2+1\nWHILE (M1<6)\n\
         P3=P3+1\nWHILE (P3%4!=0)\nP3=P3+1\nENDWHILE\nENDWHILE\nM1=0\nCLOSE\n\
         OPEN PLC 2 CLEAR\nP5=P5+1\nIF (P5%9=0)\nM1=M1+1\nENDIF\nCLOSE\n\
         OPEN PLCC 3 CLEAR\nWHILE (P6<5)\nP6=P6+1\nENDWHILE\nP6=0\nCLOSE\n";
    assert!(compare(&case(source, 400), Dialect::Pmac) > 300);
}

#[test]
fn generated_downloads_resume_in_another_engine() {
    let cases = (0..16).map(|seed| gen_pmac::generate(seed, 20 + seed as usize % 60));
    let handed_over: usize = cases.map(|case| compare(&case, Dialect::Pmac)).sum();
    assert!(handed_over > 20, "{handed_over}");
}

#[test]
fn nct_calls_and_loops_resume_in_another_engine() {
    // :000 counts in subroutines, one of which is called by its number.
    let source = ":001 J1 :000 LF500 +5 SF600 :003 LF510 +1 SF510 C004 CF600 G003 J0 \
                  :004 LF502 +2 SF502 C005 R :005 LF504 +3 SF504 R";
    let handed_over = compare(&case(source, 60), Dialect::Nct);
    assert!(handed_over > 50, "{handed_over}");
}

#[test]
fn generated_modules_resume_in_another_engine() {
    let cases = (0..100).map(|seed| gen_nct::generate(seed, 20 + seed as usize % 150));
    let handed_over: usize = cases.map(|case| compare(&case, Dialect::Nct)).sum();
    assert!(handed_over > 50, "{handed_over}");
}

/// A resume point that the task does not have stops it, whatever the engine, and runs nothing.
#[test]
fn a_resume_point_that_does_not_exist_is_a_trap() {
    let pmac = "OPEN PLC 1 CLEAR\nWHILE (P1<5)\nP1=P1+1\nENDWHILE\nCLOSE\n";
    let nct = ":001 J1 :000 LF500 :003 +1 SF500 G003 J0";
    for (source, dialect, points) in [(pmac, Dialect::Pmac, 1), (nct, Dialect::Nct, 1)] {
        let bench = Bench::new(&case(source, 1), dialect, &Options::default()).unwrap();
        for way in EngineKind::ALL {
            let (program, mut engine) = bench.compiled.engine(way).unwrap();
            assert_eq!(program.tasks[0].resume_points.len(), points, "{way:?}");
            let before = bench.machine(&program).unwrap().executive.image().to_vec();
            for beyond in [points as u32, u32::MAX] {
                let mut image = before.clone();
                let mut host = plcc_abi::engine::NoHost;
                let mut scan = Scan::new(&mut image, &mut host);
                let outcome = engine.call(0, Some(ResumePoint(beyond)), &mut scan);
                assert_eq!(outcome, Outcome::trap(TrapCode::Internal), "{way:?}");
                assert!(image == before, "{way:?}");
            }
        }
    }
}
