//! Downloads of the second generator do the same in every engine.

use plcc_frontend::common::Controller;
use plcc_tests::idioms::{all_pass, pmac::generate, seeds};

use super::engines::{compare, run};

fn is_turbo(seed: u64) -> bool {
    seed % 4 == 1
}

#[test]
fn downloads_of_idioms_agree() {
    all_pass(
        seeds(),
        |seed| generate(seed, is_turbo(seed)),
        |seed, case| {
            let controller = if is_turbo(seed) { Controller::Turbo } else { Controller::Pmac };
            run(&case.source, &case.stimulus, case.ticks, controller).map(|_| ())
        },
    );
}

/// Programs that this test once found, as it reduced them: the compiler could not make code for an element whose index
/// is read from an input beside a value that may be an integer.
#[test]
fn elements_with_an_index_from_an_input_agree() {
    for statement in [
        "P13=INT(P13)|P(M11)",
        "P1=P1|1-(P(M11)&64)",
        "M(P1^M11)=I(M11)%1000000000000",
        "P4=(-P4)^Q(M11)",
        "M11=P1*2|P(M11)",
        "IF(P4&4~1 OR P(M11)&1=1)\nP5=P5+1\nENDIF",
        "IF(P14%14-P(M11)%1023=4095)\nP5=P5+1\nENDIF",
        "IF((P1*M53+P(M11)&1)&1<0)\nP5=P5+1\nENDIF",
        "IF((M85&32)=1 OR P(M11)%1<1)\nP5=P5+1\nENDIF",
    ] {
        for program in ["PLC 0", "PLC 1", "PLCC 1"] {
            let source = format!(
                "I5=3\nM11->Y:$FFC3,0,4\nM53->X:$7F0,1\nM85->L:$1405\nP3=2.5\nP1=6\n\
                 OPEN {program} CLEAR\n{statement}\nCLOSE\n"
            );
            let stimulus = "tick,name,value\n1,M11,3\n3,P1,0.5\n4,P4,12\n6,M11,1\n8,Q1,7\n";
            compare(&source, stimulus, 12, Controller::Pmac);
        }
    }
}
