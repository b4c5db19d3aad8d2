//! What PMI programs compute, statement by statement, in the statement interpreter.

#![allow(clippy::panic, clippy::unwrap_used)]

mod support;

use plcc_abi::{Outcome, SourceLine, TrapCode};
use support::Control;

/// Assigns each expression to an INTEGER, a LONG and a LOGICAL and expects these three values.
#[track_caller]
fn evaluate(cases: &[(&str, i32, i32, i32)]) {
    for &(expression, integer, long, logical) in cases {
        let text = format!(
            "$INTEGER\nI,A=300,B=300,C=7,Z=0,N=-5,M[4]=[10,20,30,40]\n$LONG\nL,LA=100000,LN=-7\n$LOGICAL\nX,T1=T,F1=F\n$END\nI={expression}\nL={expression}\nX={expression}\n"
        );
        let mut control = Control::new(&text);
        assert_eq!(control.scan(), Outcome::End);
        let found = (control.get("I"), control.get("L"), control.get("X"));
        assert_eq!(found, (integer, long, logical), "{expression}");
    }
}

/// PMI 2.3.3.7, rules and examples.
#[test]
fn expressions_of_several_types_have_the_documented_values() {
    evaluate(&[
        ("T1+T1", 2, 2, 1),
        ("T1-F1-T1-T1", -1, -1, 1),
        ("32767+1", -32768, -32768, 1),
        ("LA+1", -31071, 100_001, 1),
        ("LA-LA", 0, 0, 0),
        ("LA+A", -30_772, 100_300, 1),
        ("-T1", -1, -1, 1),
        ("-LA", 31_072, -100_000, 1),
        ("32768", -32768, 32_768, 1),
        ("-32768", -32768, -32_768, 1),
        ("65535+1", 0, 65_536, 1),
    ]);
}

/// PMI 2.3.3.7 g: what a division takes of a product.
#[test]
fn products_have_the_documented_values() {
    evaluate(&[
        ("A*B", 24_464, 24_464, 1),
        ("A*B/C", 12_857, 12_857, 1),
        ("(A*B)/C", 12_857, 12_857, 1),
        ("((A*B))%C", 1, 1, 1),
        ("-A*B/C", -12_857, -12_857, 1),
        ("-(A*B)/C", -3494, -3494, 1),
        ("A*B*1/C", 3494, 3494, 1),
        ("A*(B/C)", 12_600, 12_600, 1),
        ("A*B/Z", 24_464, 24_464, 1),
        ("A*B+0/C", 24_464, 24_464, 1),
        ("A*B*C/1", -25_360, -25_360, 1),
    ]);
}

/// PMI 2.3.3.5, 2.3.3.6, 2.3.7.
#[test]
fn divisions_have_the_documented_values() {
    evaluate(&[
        ("11%5", 1, 1, 1),
        ("N/2", -2, -2, 1),
        ("N%2", -1, -1, 1),
        ("7/Z", 7, 7, 1),
        ("7%Z", 7, 7, 1),
        ("LA/C", 14_285, 14_285, 1),
        ("LA%C", 5, 5, 1),
        ("LA/1", -31_072, -31_072, 1),
        ("LN/2", -3, -3, 1),
        ("C/T1", 7, 7, 1),
        ("C/F1", 7, 7, 1),
        ("8/4/2", 1, 1, 1),
        ("A+B/C*2", 384, 384, 1),
    ]);
}

/// PMI 2.3.1, 2.3.2, 2.3.5, 2.3.7: logic, relations and what binds how.
#[test]
fn logic_and_relations_have_the_documented_values() {
    evaluate(&[
        ("T&F", 0, 0, 0),
        ("T!F", 1, 1, 1),
        ("/T!F", 0, 0, 0),
        ("/T&T", 0, 0, 0),
        ("/(T&F)", 1, 1, 1),
        ("A&C", 1, 1, 1),
        ("/A", 0, 0, 0),
        ("/Z", 1, 1, 1),
        ("A=B", 1, 1, 1),
        ("A=B=C", 0, 0, 0),
        ("A=B=1", 1, 1, 1),
        ("1<2<3", 1, 1, 1),
        ("3>2>1", 0, 0, 0),
        ("LA>32767", 1, 1, 1),
        ("A/=C&C<=7", 1, 1, 1),
        ("F!T&F!T", 1, 1, 1),
        ("1+1=2&2*2=4", 1, 1, 1),
        ("2000*(A>100)", 2000, 2000, 1),
        ("A>=40000", 0, 0, 0),
        ("-LA<0", 1, 1, 1),
    ]);
}

/// PMI 2.2.7: elements by constants and by what is computed.
#[test]
fn array_elements_are_chosen_by_any_index() {
    evaluate(&[
        ("M[0]+M[3]", 50, 50, 1),
        ("M[C-4]", 40, 40, 1),
        ("M[T1]", 20, 20, 1),
        ("M[M[0]/10]", 20, 20, 1),
    ]);
}

#[test]
fn an_index_outside_stops_where_it_stands() {
    for (index, value) in [("I", 5), ("-I", -5), ("I*I", 25)] {
        let text = format!("$INTEGER\nI,A[5]\n$END\nI=5\nX=T\nA[{index}]=1\nY=T\n");
        let mut control = Control::new(&text);
        let statement = Some(SourceLine { file: 0, line: 6 });
        let Outcome::Trap(trap) = control.scan() else { panic!("{index}") };
        assert_eq!((trap.code, trap.statement), (TrapCode::ArrayBounds, statement), "{index}");
        assert_eq!(trap.element.map(|element| element.index), Some(value), "{index}");
        assert_eq!((control.get("X"), control.get("Y"), control.get("I")), (1, 0, 5));
    }
}

/// PMI 3.3.3: each part of an IF, and what is nested.
#[test]
fn if_and_else_run_the_branch_that_is_chosen() {
    let text = "$INTEGER\nA,R\n$END\nR=0\nIF(A=1)\nR=1\nELSEIF(A=2)\nR=2\nIF(A=2)\nR=R+10\nENDIF\nELSEIF(A=2)\nR=99\nELSE\nR=3\nENDIF\nIF(A>5)\nR=R+100\nENDIF\n";
    let mut control = Control::new(text);
    for (a, r) in [(1, 1), (2, 12), (3, 3), (6, 103)] {
        control.set("A", a);
        control.scan();
        assert_eq!(control.get("R"), r, "A={a}");
    }
}

/// PMI 3.3.4 and the rulings: a GOTO may lead into a body of an IF; at the end of the body
/// execution goes on after the ENDIF.
#[test]
fn goto_may_jump_into_an_if() {
    let text = "$INTEGER\nA,R\n$END\nR=0\nIF(A)\nGOTO IN\nENDIF\nR=1\nIF(A=9)\nR=2\nIN: R=R+10\nELSEIF(A=0)\nR=R+20\nELSE\nR=R+40\nENDIF\nR=R+100\nIF(A=5)\nGOTO END\nENDIF\nR=R+1000\nEND:\n";
    let mut control = Control::new(text);
    for (a, r) in [(0, 1121), (1, 1110), (5, 110)] {
        control.set("A", a);
        control.scan();
        assert_eq!(control.get("R"), r, "A={a}");
    }
}

#[test]
fn reset_only_codes_can_only_be_cleared() {
    let mut control =
        Control::new("$MCODE\n@M03/P\n$END\nIF(C)\n@M03=F\nELSE\n@M03=T\nENDIF\nC=C\n@NEWSC=T\n");
    control.scan();
    assert_eq!((control.get("@M03"), control.get("@NEWSC")), (0, 0));
    control.set("@M03", 1);
    control.set("@NEWSC", 1);
    control.scan();
    assert_eq!((control.get("@M03"), control.get("@NEWSC")), (1, 1));
    control.set("C", 1);
    control.scan();
    assert_eq!(control.get("@M03"), 0);
}

#[test]
fn keys_are_longs_numbered_from_one() {
    let mut control = Control::new("$KEY\nA=\"X\"\nB=\"Y\"\n$END\n@OTX00=B\n@OTX01=A+B\n");
    control.scan();
    assert_eq!((control.get("@OTX00"), control.get("@OTX01")), (2, 3));
}

/// PMI 3.1.9.2: TC true in scan k makes DC true in scan k+P; too short a pulse never does.
#[test]
fn a_timer_of_type_e_switches_on_late() {
    let mut control = Control::new("$INPUT\nS=0/0\n$TIMER\nE/TC/DC=3\n$END\nTC=S\nO=DC\n");
    let mut outputs = String::new();
    for s in "0111111001100111110".chars() {
        control.set("S", i32::from(s == '1'));
        control.scan();
        outputs.push(if control.get("O") == 1 { '1' } else { '0' });
    }
    assert_eq!(outputs, "0000111000000000110");
}

/// PMI 3.1.9.3: the contact goes at once with TC and falls P scans after it; not at power-up.
#[test]
fn a_timer_of_type_d_switches_off_late() {
    let mut control = Control::new("$INPUT\nS=0/0\n$TIMER\nD/TC/DC=3\n$END\nTC=S\nO=DC\n");
    let mut outputs = String::new();
    for s in "0001100000100110000".chars() {
        control.set("S", i32::from(s == '1'));
        control.scan();
        outputs.push(if control.get("O") == 1 { '1' } else { '0' });
    }
    assert_eq!(outputs, "0001111100111111110");
}

/// PMI 3.1.10.1 and the rulings: clear wins, then preset, then a rising clock.
#[test]
fn clear_and_preset_of_a_flipflop_override_its_clock() {
    let text =
        "$INPUT\nA=0/0\nB=0/1\nC=0/2\n$FLIPFLOP\nQ/D/CK/PR/CL\n$END\nPR=A\nCL=B\nD=/Q\nCK=C\n";
    let mut control = Control::new(text);
    for (preset, clear, clock, q) in [
        (0, 0, 0, 0),
        (0, 0, 1, 1),
        (0, 0, 1, 1),
        (0, 0, 0, 1),
        (0, 0, 1, 0),
        (1, 0, 0, 1),
        (1, 1, 0, 0),
        (1, 0, 0, 1),
        (0, 1, 1, 0),
        (0, 0, 1, 0),
    ] {
        control.set("A", preset);
        control.set("B", clear);
        control.set("C", clock);
        control.scan();
        assert_eq!(control.get("Q"), q, "PR={preset} CL={clear} CK={clock}");
    }
}
