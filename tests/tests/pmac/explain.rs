//! Snapshots of the whole output of `plcc check --explain-arithmetic`, and whether it says what the
//! compiler does.
#![allow(clippy::unwrap_used)]

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmac,
};
use plcc_ir::InstData;
use plcc_ir::passes::{self, OptLevel};

fn explain(text: &str) -> String {
    let mut sources = SourceMap::new();
    let file = sources.add("a.pmc", text.as_bytes());
    let options = Options::default();
    let (program, found) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    assert!(found.iter().all(|d| !d.is_error()), "{found:?}");
    program.unwrap().explain_arithmetic().unwrap()
}

#[test]
fn integers_are_explained_with_what_they_depend_on() {
    let text = "\
I5=2
#define LAMP M1
#define BLINK IF(P9%2=1) LAMP=1 ELSE LAMP=0 ENDIF
M1->Y:$FFC2,8,1
M2->Y:$FFC2,0,8
M3->*
OPEN PLC 1 CLEAR
LAMP=M2&1 ; the lamp
P1=M2*M2+M3   // a sum
IF(P1=3 ; three
AND M1=0)
P2=P1&$F|P3
P2=P1+P3-I20
ENDIF
WHILE(LAMP=0)
ENDWHILE
BLINK
DISPLAY 1,5.0,P1
M(P1)=M2
CMD\"P1=0.5\"
CLOSE
";
    insta::assert_snapshot!(explain(text));
}

#[test]
fn the_reason_for_floating_point_is_explained() {
    let text = "\
I5=2
M1->L:$700
M2->D:$28
M3->Y:$700,0,24,D
M4->X:$700,0,24,S
L1->X:$701,0,24,S
OPEN PLC 1 CLEAR
P1=M4*0.5
P1=M1
P1=M2+1
P1=M3
P1=-M4/2
P1=M4%M4
P1=M4%0
P1=P1*P2
P1=M4*M4*M4
P1=P(M4)
P1=M(1)+1
P1=SQRT(M4)
P1=SIN(0)
P1=INT(M4/2)
M(P1*P2)=1
P1=P1|P2|P3|P4|P5|P6|P7
IF(M4>0.5)
ENDIF
CLOSE
OPEN PLCC 1 CLEAR
L1=L1+1
L1=L1+P1
P1=L1*0.1
IF(L1>5)
ENDIF
CLOSE
";
    insta::assert_snapshot!(explain(text));
}

/// Whether the frequent code of a PLC with one statement calls a host function that integers can do
/// without.
fn calls_for_arithmetic(statement: &str) -> bool {
    let text = format!("{DEFINITIONS}OPEN PLC 1 CLEAR\n{statement}\nCLOSE\n");
    let mut sources = SourceMap::new();
    let file = sources.add("a.pmc", text.as_bytes());
    let options = Options::default();
    let (program, _) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    let mut module = program.unwrap().lower().unwrap().module;
    passes::optimize(&mut module, OptLevel::Speed);
    let blocks = module.funcs().flat_map(|(_, func)| func.blocks().map(move |(_, b)| (func, b)));
    let frequent = blocks.filter(|(_, block)| !block.cold && !block.optimize_for_size);
    let mut insts = frequent.flat_map(|(func, b)| b.insts.iter().map(|&inst| func.inst(inst)));
    insts.any(|data| match data {
        InstData::HostCall { function, .. } => function.integer_form().is_some(),
        _ => false,
    })
}

const DEFINITIONS: &str = "I5=2\nM2->Y:$FFC2,0,8\nM4->X:$700,0,24,S\n";

#[test]
fn what_is_explained_as_integers_is_compiled_to_integers() {
    for statement in [
        "P1=M2&1",
        "P1=M2*M2+M4",
        "M2=M4%10",
        "P1=M4%-7|M2",
        "P1=P2&$F|P3",
        "P1=P2%100",
        "P1=P2&P3&P4&P5&P6&P7",
        "P1=ABS(P2&M4)^INT(M2)",
        "IF (P1&4=4 AND M2~3) P2=M4 ENDIF",
        "WHILE (Q1|I20!<3) ENDWHILE",
        "M4=(P1|P2)+1",
        "I20=P1&1",
    ] {
        let explained = explain(&format!("{DEFINITIONS}OPEN PLC 1 CLEAR\n{statement}\nCLOSE\n"));
        let all = explained.contains("0 in floating point");
        assert!(all, "{explained}");
        assert!(!calls_for_arithmetic(statement), "{statement}");
    }
    // The sum of two integers is exact in floating point, and checked.
    let mixed = "P1=(P2+P3)&$FF";
    let explained = explain(&format!("{DEFINITIONS}OPEN PLC 1 CLEAR\n{mixed}\nCLOSE\n"));
    let found = explained.contains("floating point: `+`; all else integer while the result of `+`");
    assert!(found, "{explained}");
    assert!(!calls_for_arithmetic(mixed));
    // An operator at the end of a long statement is found too.
    let terms: Vec<String> = (2..120).map(|number| format!("P{number}")).collect();
    let long = format!("P1=({})&7", terms.join("+"));
    assert!(!calls_for_arithmetic(&long));
    // Where floating point is explained, the control's rules for fractions are needed.
    for statement in ["P1=M4%P2", "P1=M4%0.5", "P1=P2%P3&1"] {
        let explained = explain(&format!("{DEFINITIONS}OPEN PLC 1 CLEAR\n{statement}\nCLOSE\n"));
        assert!(explained.contains("1 in floating point"), "{explained}");
        assert!(calls_for_arithmetic(statement), "{statement}");
    }
}
