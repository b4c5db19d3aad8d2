//! PMI programs in the statement interpreter, the IR interpreter, the JIT and as artifacts: the
//! same variables and lines after every scan, the same events, the same stop.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use crate::harness::{Ended, run};
use plcc_frontend::common::Options;
use plcc_random::seeds;
use plcc_tests::{gen_pmi::generate, shrink};

/// Runs a case; a difference is shown in the smallest program and stimulus that still has it.
fn agree(source: &str, stimulus: &str, ticks: u32) -> Ended {
    let options = Options::default();
    match run(source, stimulus, ticks, &options) {
        Ok(ended) => ended,
        Err(first) => {
            let differs = |source: &str, stimulus: &str| {
                run(source, stimulus, ticks, &options).is_err_and(|e| e.starts_with("tick"))
            };
            let source = shrink::lines(source, |source| differs(source, stimulus));
            let stimulus =
                shrink::lines(stimulus, |rows| rows.starts_with("tick") && differs(&source, rows));
            let still = run(&source, &stimulus, ticks, &options).err().unwrap_or(first);
            panic!("{still}\n--- program\n{source}--- stimulus\n{stimulus}");
        }
    }
}

#[test]
fn generated_programs_agree() {
    let (mut stopped, mut said) = (0, 0);
    for seed in seeds(40) {
        let case = generate(seed, 20 + seed as usize % 50);
        let ended = agree(&case.source, &case.stimulus, case.ticks);
        if let Some(stop) = &ended.stop {
            assert_eq!(stop.code, "NO PMI DATA");
            stopped += 1;
        }
        said += ended.events.len();
    }
    assert!(stopped > 0, "no program was stopped");
    assert!(said > 0, "nothing was ever said");
}

/// Statements so long that they are cut into several chunks, so that values of every type are kept from
/// one chunk to the next.
#[test]
fn long_statements_agree() {
    let mut source = "$INTEGER\nA,B,C[7]\n$LONG\nL,R\n$END\nB=B+1\n".to_owned();
    source.push_str("R=L-((B&T)+(A*B*((");
    for i in 0..6000 {
        source.push_str(["A+", "B*3-", "C[B%3+2]-", "(L>B)+"][i % 4]);
    }
    source.push_str("1))/7))\nX=R/=0\nC[(B%3");
    for i in 0..3000 {
        source.push_str(["+A-A", "+C[1]-C[1]"][i % 2]);
    }
    source.push_str(")+2]=B\n");
    let stimulus = "tick,name,value\n0,A,3\n1,L,70000\n2,A,-9\n3,C[1],5\n";
    assert_eq!(run(&source, stimulus, 10, &Options::default()).unwrap().stop, None);
}

/// An index outside its array stops a scan in the middle, wherever in a statement it stands: what
/// stands before it is done in every engine, what stands after it is not.
#[test]
fn every_engine_stops_at_the_same_statement() {
    for statement in [
        "A[I]=1",
        "A[3]=A[I]",
        "A[A[I]]=1",
        "X=T!A[I]",
        "IF(A[I])",
        "A[0]=L/A[I]",
        "B[I]=T",
        "TC=B[I]",
        "CK=B[I]",
        "OUT=B[I]",
        "@M03=B[I]",
        "G=A[-I]",
    ] {
        let close = if statement.starts_with("IF") { "ENDIF\n" } else { "" };
        let source = format!(
            "$OUTPUT\nOUT=1/0\nGO=2/0-7/BCD\n$INTEGER\nI,A[5],G\n$LOGICAL\nB[5]\n$LONG\nL\n\
             $TIMER\nE/TC/DC=2\n$FLIPFLOP\nQ/D/CK/PR/CL\n$MCODE\n@M03/P\n$FAULT\nF1=\"I IS\",I\n\
             $END\nOUT=T\nGO=I+40\nF1=I>3\nX=F\n{statement}\n{close}X=T\nGO=12\n"
        );
        let stimulus = "tick,name,value\n0,A[0],1\n0,@M03,1\n1,I,4\n2,I,5\n2,PORT9.0,1\n";
        let ended = agree(&source, stimulus, 9);
        // -I is outside from tick 1 on.
        let last = if statement.ends_with("[-I]") { 1 } else { 2 };
        assert_eq!(ended.ticks, last + 1, "{statement}");
        assert_eq!(ended.stop.unwrap().code, "NO PMI DATA", "{statement}");
        assert_eq!(ended.events.len(), 1, "{statement}");
    }
}
