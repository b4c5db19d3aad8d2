//! Snapshots of the whole output of `plcc check --explain-arithmetic`.
#![allow(clippy::unwrap_used)]

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmac,
};

fn explain(text: &str) -> String {
    let mut sources = SourceMap::new();
    let file = sources.add("a.pmc", text.as_bytes());
    let options = Options::default();
    let (program, found) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    assert!(found.iter().all(|d| !d.is_error()), "{found:?}");
    program.unwrap().explain_arithmetic()
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
