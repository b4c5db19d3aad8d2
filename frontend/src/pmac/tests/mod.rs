//! What is accepted and what is refused, form by form.

mod decided;

use plcc_abi::HostFn;
use plcc_diag::SourceMap;

use super::check;
use crate::common::{Controller, LintLevels, LowerError, MemoryLoader, Options};

fn codes_for(text: &str, controller: Controller) -> Vec<(&'static str, u32, String)> {
    let mut map = SourceMap::new();
    let file = map.add("m.pmc", text.as_bytes());
    // What is tested here are the other diagnostics; lints have tests of their own.
    let options = Options { controller, lints: LintLevels::none(), ..Options::default() };
    let (_, diagnostics) = check(&mut map, &[file], &MemoryLoader::new(), &options);
    diagnostics
        .iter()
        .map(|d| (d.code, map.line_col(d.span.file, d.span.start).0, d.message.to_string()))
        .collect()
}

fn codes(text: &str) -> Vec<(&'static str, u32)> {
    codes_for(text, Controller::Pmac).into_iter().map(|(code, line, _)| (code, line)).collect()
}

/// The diagnostics, with their lines, of statements in a PLC, which begin on line 2.
fn plc(body: &str) -> Vec<(&'static str, u32)> {
    codes(&format!("I5=2\nOPEN PLC 1 CLEAR {body}\nCLOSE\n"))
}

#[test]
fn statements_are_accepted() {
    for body in [
        "P1=0P2=1",
        "IF(P1=1)P2=1ELSE P2=0ENDIFP3=1",
        "IF(P1=1)IF(P2=1)P3=1ENDIFENDIF",
        "IF(P1=1)P2=1ENDI IF(P1=1)P2=1END IF",
        "WHILE(P1=1)ENDW WHILE (P1=1) P1=0 END WHILE WHILE(M90>0)ENDWHILE",
        "DISPLC5ENAPLC3",
        "DISABLE PLC 1..31 ENABLE PLC1,2,3 DIS PLCC 3 PAU PLC4 RES PLC4 PAUSE PLC 1..3,7",
        "P0197=1 I00=1 P(P1+1)=2 M(5000+P1)=3 I(P1)=4 Q(2)=P(Q1)",
        "P510..560=0 I500,4,100=0",
        "P1=-P2*-3/-(P4)",
        "P1=$FF P2=.5 P3=5. P4=0.25",
        "WHILE (M440&M540&M640=0) ENDW",
        "IF (P1=1 AND P2=2 OR P3!=1) ENDI",
        "IF ((P1=1) AND (P2=2 OR (P3>4))) ENDI",
        "IF (P1=1) AND (P2=2) OR (P3=3)\nAND (P4=4)\nENDI",
        "IF (P1=1)\nOR(P2=1)\nP1=2\nENDIF",
        "IF ((P1+1)*2!>5) ENDI IF (P1!~2) ENDI IF(P1~2)ENDI IF (P1!<2)ENDI",
        "CMD\"#1J/\" COMMAND^A",
        "COMMAND\"&1A\" CMD\"\\\" CMD \"#1J+#2J-\" COMMAND\"ENA PLC 4\" CMD\"P1=P2+1\" CMD\"M1->Y:$FFC2,8\"",
        "ADR&1 ADDRESS#1 ADDRESS #1&2 ADR &1 #2",
        "ADDRESS#P3 ADR&P4CMD\"A\" ADDRESS &Q2 #M(P1+1) ADR#1&P2 ADDRESS#P(3)&2",
        "SEND\"text\" SENDS\"a\" SENDP^K",
        "DISPLAY 5 \"text\" DISP\"abc\" DISP 10,8.3,P1 DISPLAY 1, 4.0, M(P1)",
        "COMMANDS\"#1J/\" CMDP\"P1\" CMDR\"x\" COMMANDA^K",
        "CMD\u{201D}#1HM\u{201D} SEND\u{201C}a\u{201D} P1=2",
        "P1&=3 M1|=P2 Q1^=7 P(3)&=1",
        "P1=SIN(P2)+COS ( 3 )*ATAN2(P1)-SQRT(ABS(INT(LN(EXP(1)))))",
        "P1=P2%8 P1=P2&$F|P3^1",
        "MSR4,910,P1 MACROSLVWRITE4,MI910,P2",
        "p1=p2+sin(p3) if(m1=1)cmd\"#1k\"endif",
        "P1\n=\nP2\n+\n3",
        "\tP1=1\u{c}P2=1",
        "M1=P1*(P2+(P3-(P4)))",
        "IF(P1=1)ELSE ENDIF",
        "IF(P1=1)P2=1 ELSE IF(P1=2)P2=3 ENDIF ENDIF",
        "CLEAR P1=1",
        "P1=1 RET",
        "COMMAND\"#1$*\",COMMAND\"#2$*\" , CMD\"#3$*\"",
        "ADDRESS&P5\n&COMMAND\"A\"",
        "ADDRESS#P5\n&COMMAND\"K\" ADDRESS#1&CMD\"K\" &CMD\"K\"",
        "IF(P1=1)ENDI\nRETURN\n",
        "CMD\"wx$78014,p(p1+10)\" CMD\"WY:$78010,$FF,P1*2\" CMD\"&1E\" CMD\"D\" CMD\"DKILL\"",
    ] {
        let found: Vec<_> =
            plc(body).into_iter().filter(|(c, _)| !c.starts_with("PMAC-W")).collect();
        assert!(
            found.is_empty() || body.contains("M(5000"),
            "{body}: {:?}",
            codes_for(&format!("I5=2\nOPEN PLC 1 CLEAR {body}\nCLOSE\n"), Controller::Pmac)
        );
    }
}

#[test]
fn on_line_text_is_accepted() {
    for line in [
        "M1->Y:$FFC2,8,1",
        "M0->X:$0,24",
        "M90->X:$0700,0,24,S",
        "M145->X:$0C0,11,1",
        "M1->*",
        "M102->Y:49155,8,16,S",
        "M161->D:$002B",
        "M191->L:$0822",
        "M192->L:$0822,0,48",
        "M193->D:$0822,0,48,S",
        "M50->DP:$D201",
        "M51->F:$D7FF",
        "M100->TWD:4,0.8.3,U",
        "M101->TWB:0,0,8,U",
        "M102->TWS:1",
        "M103->TWR:0,0",
        "M1..8->*",
        "M103->X:$C003,24,S",
        "M1->Y$FFC2,8",
        "M1 -> Y : $ FFC2 , 8 , 1",
        "M1->",
        "M1..5->",
        "CLOSE",
        "CLOSE ALL",
        "DELETE GATHER",
        "DEL GAT",
        "DELETE TRACE",
        "ENDGAT",
        "END GATHER",
        "ENDGATHER",
        "#1->100X",
        "#1->X",
        "&1#1->1000X+50Y#2->Y",
        "#1->0",
        "#3->I",
        "&1",
        "A",
        "K",
        "I5=2",
        "SAVE",
        "$$$",
        "$$$***",
        "I13=0",
        "WX:$700,1,2",
        "WY$FFC2,$FF",
        "WP$D800,$050060,$0AF080",
        "RHP:$D800,3",
        "RX:$700,5",
        "RHX:$700",
        "RHY$720,3",
        "ENABLE PLC 0",
        "DISABLE PLC 1..31",
        "DIS PLC1,2,3",
        "P1..10",
        "PASSWORD={abc}",
        "STOPINVERSE",
        "CLRF",
        "SETPHASE1,2",
        "TRIGGER",
        "GATHER",
        "GAT TRIG",
        "UNDEFINE ALL",
        "UNDEF",
        "I5=*",
        "I100..199=*",
        "P1=SIN (45) P1",
        "I125=I125|$20000",
        "342",
        "-5",
        "J+",
        "#1J+#2J-",
        "#1J/",
        "J=2000",
        "J^-500",
        "HOME",
        "HM",
        "#1HMZ",
        "&1B1R",
        "%100",
        "%",
        "B1R",
        "&1B1R&2B8R",
        "?",
        "??",
        "???",
        "^A",
        "TYPE",
        "VER",
        "DATE",
        "SIZE",
        "LIST PLC 1",
        "LIST",
        "DEFINE GATHER",
        "DEF GAT 100",
        "DEFINE TBUF 1",
        "DEF ROT 100",
        "DEFINE UBUFFER 256",
        "DELETE PLCC 3",
        "DEL ROT",
        "MS0,I910=7",
        "MACROSLAVE$$$0",
        "FRAX(X,Y)",
        "ABS",
        "INC(X)",
        "PMATCH",
        "Z",
        "S",
        "H",
        "R",
        "Q",
        "V",
        "F",
        "P",
        "O10",
        "X=0",
        "LMOVERLAY 1",
        "I0..99=0",
        "I500,4,100=0",
        "DELETE GATHER DELETE TRACE",
        "CLS",
        "DEFINE COMP 4,1000\n1 2 3\n-4\n5",
        "#1 DEF COMP 3,#1,100\n1\n2",
        "L1->X:$700,0,24,S",
        "OPEN PLC 5 CLEAR CLOSE",
        "OPENPLC5CLEARCLOSE",
        "OPEN PLC 8\nCLEAR\nP1=1\nCLOSE",
        "#define A P1\nA=5",
        "OPEN PROG 1 CLEAR\nLINEAR X10 ; CLOSE\nCMD\"CLOSE\"\nCLOSE",
        "OPEN ROTARY\nX1\nCLOSE",
        "OPEN FORWARD\nCLEAR\nP1=#1P\nCLOSE",
        "P100=1 P101=2 M1=1",
        "HOME 1..4,5",
        "@0",
        "MFLUSH",
        "\u{1a}P1=1",
        "\u{4}",
        "#",
        "&",
        "PC",
        "PE LIST PE",
    ] {
        let found: Vec<_> = codes_for(&format!("I5=2\n{line}\n"), Controller::Pmac)
            .into_iter()
            .filter(|(c, ..)| !c.starts_with("PMAC-N"))
            .collect();
        assert!(found.is_empty(), "{line}: {found:?}");
    }
}

#[test]
fn errors_have_their_numbers_and_lines() {
    for (body, code) in [
        ("P1=+1", "PMAC-3"),
        ("IF (P1) ENDI", "PMAC-3"),
        ("IF (P1==1) ENDI", "PMAC-3"),
        ("IF (P1<=1) ENDI", "PMAC-3"),
        ("P1024=1", "PMAC-X1"),
        ("P1,3,99999999999999999999=1", "PMAC-X1"),
        ("P1=M2000", "PMAC-X1"),
        ("ADR&9", "PMAC-X1"),
        ("L1=1", "PMAC-3"),
        ("P1=L1", "PMAC-3"),
        ("X10", "PMAC-3"),
        ("DWELL 10", "PMAC-3"),
        ("PUMP=1", "PMAC-3"),
        ("P1=(P2", "PMAC-3"),
        ("P1=P2×3", "PMAC-4"),
        ("ENABLE PLC 32", "PMAC-3"),
        ("CMD\"#1J/", "PMAC-3"),
        ("IF P1=1 ENDI", "PMAC-3"),
        ("J+", "PMAC-3"),
        ("P5", "PMAC-3"),
        ("IF ((P1=1)+2=3) ENDI", "PMAC-3"),
        ("IF (P1=1=1) ENDI", "PMAC-3"),
        ("IF (P1=1 AND P2) ENDI", "PMAC-3"),
        ("AND (P1=1)", "PMAC-3"),
        ("WHILE (P1=1) AND P2=1 ENDW", "PMAC-3"),
        ("P1=P(1=1)", "PMAC-3"),
        ("DISABLE PLC 6..4", "PMAC-3"),
        ("MX=1-M1", "PMAC-3"),
    ] {
        assert_eq!(plc(body), [(code, 2)], "{body}");
    }
    assert_eq!(codes("I5=2\nM1->Y:$FFC2,20,8\n"), [("PMAC-3", 2)]);
    assert_eq!(codes("I5=2\nM1->Y:$1FFC2,0\n"), [("PMAC-X1", 2)]);
    assert_eq!(codes("I5=2\nMX->Y:$FFC2,8\n"), [("PMAC-3", 2)]);
    assert_eq!(codes("I5=2\nOPEN PLC 5 CLEAR CLSE\n"), [("PMAC-3", 2)]);
    assert_eq!(codes("I5=2\nDELETE GATHR\n"), [("PMAC-3", 2)]);
    assert_eq!(codes("I5=2\n#1HMZK#2homek\n"), []);
    assert_eq!(codes("IF (P1=1)\n"), [("PMAC-5", 1)]);
    assert_eq!(codes("X10 Y10\n"), [("PMAC-5", 1)]);
    assert_eq!(codes("FOO=1\n"), [("PMAC-3", 1)]);
    assert_eq!(codes("I5=2\nOPEN PLC 1\nP1=1\nOPEN PLC 2\nP2=1\nCLOSE\n"), [("PMAC-7", 4)]);
    assert_eq!(
        codes("I5=2\nOPEN PLC0 CLEAR\nADR&1\nDIS PLCC1\nCLOSE"),
        [("PMAC-3", 3), ("PMAC-3", 4)]
    );
    assert_eq!(codes("I5=2\nOPEN PLCC1 CLEAR\nL1=L2\nL1=1\nCLOSE"), [("PMAC-3", 3), ("PMAC-3", 4)]);
}

#[test]
fn misspelt_words_get_a_suggestion() {
    for (body, help) in [
        ("WHIEL (P1=1)\nENDWHILE", "did you mean WHILE?"),
        ("WHILE (P1=1)\nENDWHLE", "did you mean ENDWHILE?"),
        (
            "WHITE=1",
            "define the name before it is used, for a variable that is free: #define WHITE P100",
        ),
        (
            "SAVE",
            "SAVE is not allowed here: statements belong in buffers, and there COMMAND\"…\" gives \
             on-line commands",
        ),
        ("IF (P1=1 && P2=1) ENDIF", "conditions are joined with AND"),
        ("IF (P1=1 || P2=1) ENDIF", "conditions are joined with OR"),
        ("IF (!(P1=1)) ENDIF", "`!` is part of comparators: != !> !< !~"),
        ("P1=P[5]", "the number of an indirect variable is in parentheses: P(P1+5)"),
        ("P1=1E5", "write its digits out"),
        ("P1=1.5e-3", "write its digits out"),
    ] {
        let mut map = SourceMap::new();
        let text = format!("I5=2\nOPEN PLC 1\n{body}\nCLOSE\n");
        let file = map.add("m", text.as_bytes());
        let (_, found) = check(&mut map, &[file], &MemoryLoader::new(), &Options::default());
        let helps: Vec<_> = found.iter().map(|d| d.help.as_deref()).collect();
        assert_eq!(helps, [Some(help)], "{body}: {found:?}");
    }
    assert_eq!(plc("IF(P1=1)P2=1ENDIF WHILE(P1=2)P1=3ENDWHILEP3=1"), []);
}

#[test]
fn misspelt_names_get_a_defined_name_as_suggestion() {
    for (line, help) in [
        ("PUNP=1", "did you mean PUMP?"),
        ("P1=PUMMP", "did you mean PUMP?"),
        ("pump=1", "did you mean PUMP? capitals count in names"),
        ("P1=LATER", "LATER is defined further down: its #define must come before"),
        ("IF (VALVE_17 > P2)", "did you mean VALVE_18?"),
        (
            "WIPER=1",
            "define the name before it is used, for a variable that is free: #define WIPER P100",
        ),
        ("dispvalu=1", "did you mean dispvalve?"),
    ] {
        let names = "#define PUMP P1\n#define VALVE_18 P2\n#define dispvalve P3\n";
        let text = format!("{names}OPEN PLC1\n{line}\nCLOSE\n#define LATER 1\n");
        let mut map = SourceMap::new();
        let file = map.add("m", text.as_bytes());
        let (_, found) = check(&mut map, &[file], &MemoryLoader::new(), &Options::default());
        let error = found.iter().find(|d| d.is_error()).unwrap();
        assert_eq!(error.help.as_deref(), Some(help), "{line}");
    }
}

/// Fuzzing found that the first of these texts was read without end.
#[test]
fn a_line_with_only_a_decimal_point_is_one_error() {
    assert_eq!(codes("\n."), [("PMAC-3", 2)]);
    assert_eq!(codes("P1=1\n.\nP2=2\n"), [("PMAC-3", 2)]);
    assert_eq!(plc("\n.\nP1=1"), [("PMAC-3", 3)]);
}

#[test]
fn unclosed_ifs_and_whiles_are_reported_at_close() {
    for body in [
        "IF (P1=1)\n\nCLOSE",
        "ENDIF\n\nCLOSE",
        "ELSE\n\nCLOSE",
        "WHILE(P1=1)\nENDIF\nCLOSE",
        "IF(P1=1)\nENDWHILE\nCLOSE",
        "IF(P1=1)ELSE\nELSE ENDIF\nCLOSE",
    ] {
        assert_eq!(codes(&format!("I5=2\nOPEN PLC 1 CLEAR\n{body}\n")), [("PMAC-9", 5)], "{body}");
    }
    assert_eq!(codes("I5=2\nOPEN PLC 1\nP1=1\n\n"), [("PMAC-W1", 3)]);
    assert_eq!(codes("OPEN PLC 1\nP1=1\nCLOSE"), [("PMAC-W2", 1)]);
}

#[test]
fn missing_ends_are_reported_at_the_last_line_with_text() {
    let tail = "#ifdef X\n P5=1\n#endif\n ; end\n\n";
    assert_eq!(codes(&format!("I5=2\nOPEN PLC 1\nP1=1\n{tail}")), [("PMAC-W1", 7)]);
    let text = format!("I5=2\nOPEN PLC 1\nIF (P1=1)\n{tail}");
    assert_eq!(codes(&text), [("PMAC-W1", 7), ("PMAC-9", 7)]);
    assert_eq!(codes(&format!("OPEN PROG 1\nX1\n{tail}")), [("PMAC-W1", 6)]);
    assert_eq!(codes("#ifndef X\nP1=1\n#ifdef Y\n; end\n\n"), [("PMAC-9", 4), ("PMAC-9", 4)]);
}

#[test]
fn every_wrong_statement_is_reported_once() {
    let text = "I5=2\nOPEN PLC 1\nIF (P1) P2=+1 ENDIF\nWHILE(FOO=1)\nBAR=2 P1=1\nENDW\nCLOSE\n";
    let found = codes(text);
    assert_eq!(found, [("PMAC-3", 3), ("PMAC-3", 3), ("PMAC-3", 4), ("PMAC-3", 5)]);
}

#[test]
fn statements_of_one_line_have_an_error_each() {
    for (line, errors) in [
        ("P1=+1 P2=+2 P3=3", 2),
        ("P1==2P(P2)==3M1|=+4", 3),
        ("I5,2,1=+1 P6..7=+1 P8=3", 2),
        ("SEND P1=+1 CMD\"P1=1 P3=3\" P2=+1", 3),
        ("P1=+1 DISPLC40 DISABLE PLC 41 CMD\"A\" ADR#1", 3),
        ("IF (P1) AND (P2=+1) P3=+1 ENDIF", 2),
        // What may be the rest of the wrong one is not judged.
        ("P1=(3 P2=+1 P3=(P4", 1),
        ("IF P1=+1 P2=+2 ENDIF", 1),
        ("IF (P1=1) AND P2=+1 P3=+2 ENDIF", 1),
        ("IF (P1 P2=+3) ENDIF", 1),
        ("P1=+1+P2=+3", 1),
        ("P1=DISTANCE*SENDING", 1),
        ("CMD P1=1\"P2=+1", 1),
    ] {
        assert_eq!(plc(line).len(), errors, "{line}");
    }
    assert_eq!(codes("P1=+1 P2=+2 IF P3=+3"), [("PMAC-3", 1), ("PMAC-3", 1), ("PMAC-3", 1)]);
}

#[test]
fn turbo_pmac_has_more_addresses_variables_and_motors() {
    let text = "M1->Y:$78C00,0\nP8191=1 I5111=5\nOPEN PLC1 CLEAR ADR&16 CLOSE #32->X\n";
    assert!(codes_for(text, Controller::Turbo).iter().all(|(c, ..)| *c == "PMAC-W2"));
    assert_eq!(codes(text).first(), Some(&("PMAC-X1", 1)));
}

#[test]
fn depth_is_bounded_and_length_is_not() {
    let deep = |n: usize| format!("P1={}1{}", "(".repeat(n), ")".repeat(n));
    assert_eq!(plc(&deep(256)), []);
    assert_eq!(plc(&deep(257)), [("PMAC-3", 2)]);
    assert_eq!(plc(&format!("P1=1{}", "+1".repeat(200_000))), []);
    assert_eq!(plc(&format!("P1={}1", "-".repeat(100_000))), []);
    let nested = |n: usize| format!("{}{}", "IF(P1=1)".repeat(n), "ENDIF".repeat(n));
    assert_eq!(plc(&nested(256)), []);
    assert_eq!(plc(&nested(257)), [("PMAC-9", 3)]);
}

#[test]
fn errors_in_expanded_macros_show_the_definition() {
    let mut map = SourceMap::new();
    let file = map.add("m", b"#define BAD P1=+1\nOPEN PLC1\nBAD\nCLOSE\n");
    let (_, diagnostics) = check(&mut map, &[file], &MemoryLoader::new(), &Options::default());
    let found = diagnostics.iter().find(|d| d.is_error()).unwrap();
    assert_eq!(map.line_col(file, found.span.start), (3, 1));
    assert_eq!(map.line_col(file, found.labels()[0].span.start).0, 1);
}

#[test]
fn names_are_not_called_undefined_when_an_included_file_is_missing() {
    let text = "#include \"none.h\"\nI5=2\nOPEN PLC LIFT CLEAR\nIF (UP=1)\nGO_UP TIME=50 MSEC\n\
                ENDIF\nLOOP_END\nP1=+1\nADDRESS&2 m1MOVE = 0\nCLOSE\n";
    assert_eq!(codes(text), [("PMAC-X2", 1), ("PMAC-3", 8)]);
    // Without the include each of them is an error; the refused OPEN takes its buffer with it.
    let complete = text.trim_start_matches("#include \"none.h\"");
    assert_eq!(codes(complete), [("PMAC-3", 3)]);
    assert_eq!(codes(&complete.replace("LIFT", "5")).len(), 5);
}

#[test]
fn what_display_cannot_show_is_refused() {
    for line in ["DISPLAY 4294967296\"A\"", "DISP 5,81.0,P1", "DISP 5,8.41,P1", "DISP 5,0.0,P1"] {
        assert_eq!(plc(line), [("PMAC-3", 2)], "{line}");
    }
    assert_eq!(plc("DISP 5,80.40,P1 DISPLAY 79 \"A\""), []);
}

#[test]
fn a_return_in_the_middle_is_for_motion_programs() {
    assert_eq!(plc("IF(P1=1)RETURN ENDIF"), [("PMAC-3", 2)]);
}

#[test]
fn every_l_variable_of_a_range_must_be_defined() {
    let text = "I5=2\nL1->X:$7F8,0\nL2->X:$7F8,1\nOPEN PLCC 1 CLEAR\nL1..2=1\nL1..3=1\nCLOSE\n";
    assert_eq!(codes(text), [("PMAC-3", 6)]);
}

/// A program that is not what reading and analysing promise is not translated into anything.
#[test]
fn the_lowering_reports_its_own_defects_with_their_place() {
    let text = "I5=2\nL1->X:$7F8,0,24\nOPEN PLC 1 CLEAR\nP1=P2%7\nCLOSE\n\
                OPEN PLCC 1 CLEAR\nL1=L1/3\nCLOSE\n";
    let mut sources = plcc_diag::SourceMap::new();
    let file = sources.add("main.pmc", text.as_bytes());
    let options = Options::default();
    let (program, _) = super::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    let program = program.expect("it has no errors");
    assert!(program.lower().is_ok());
    let defect = |change: &dyn Fn(&mut super::Program)| {
        let mut broken = program.clone();
        change(&mut broken);
        let error = broken.lower().expect_err("it is broken");
        let LowerError::Internal(error) = error else { panic!("{error}") };
        (error.message, error.place.map_or(0, |(_, line)| line))
    };
    use super::ast::{Op, StmtKind};
    let jump = defect(&|broken| broken.download.plcs[1].code[0].kind = StmtKind::Jump(7));
    assert_eq!(jump, ("there is no statement 7".to_owned(), 4));
    let undefined = defect(&|broken| broken.download.l_defs.clear());
    assert_eq!(undefined, ("L1 is defined as None".to_owned(), 7));
    let operand = defect(&|broken| {
        let StmtKind::Assign(_, expr) = broken.download.plcs[1].code[0].kind else { return };
        broken.download.ops[expr.start as usize] = Op::Neg;
    });
    assert_eq!(operand, ("an expression lacks an operand".to_owned(), 4));
    let endless = defect(&|broken| broken.download.plcs[1].code[0].kind = StmtKind::EndWhile(0));
    assert_eq!(endless, ("an ENDWHILE has no WHILE".to_owned(), 4));
}

/// The host functions that a PLC with one statement calls after the passes, each with whether the
/// call's block is cold.
fn calls(statement: &str) -> Vec<(HostFn, bool)> {
    let text = format!("I5=2\nOPEN PLC 1 CLEAR\n{statement}\nCLOSE\n");
    let mut sources = plcc_diag::SourceMap::new();
    let file = sources.add("main.pmc", text.as_bytes());
    let options = Options::default();
    let (program, _) = super::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    let mut lowered = program.expect("it has no errors").lower().expect("it can be lowered");
    plcc_ir::passes::optimize(&mut lowered.module, plcc_ir::passes::OptLevel::Speed);
    let mut calls = vec![];
    for func in &lowered.module.funcs {
        for (_, block) in func.blocks() {
            for &inst in &block.insts {
                if let plcc_ir::InstData::HostCall { function, .. } = func.inst(inst) {
                    calls.push((*function, block.cold));
                }
            }
        }
    }
    calls
}

#[test]
fn the_slow_sides_of_guards_are_cold() {
    // Integrality checks of a statement's variables, and of single operands.
    assert_eq!(calls("P1=P2&P3+P4"), [(HostFn::PmacAnd, true)]);
    assert_eq!(calls("P1=SIN(P2)|P3"), [(HostFn::PmacSin, false), (HostFn::PmacOr, true)]);
    assert_eq!(calls("P(P1)=1"), [(HostFn::PmacBits, true)]);
    // Calls without guard.
    assert_eq!(calls("P1=EXP(P2)%P3"), [(HostFn::PmacExp, false), (HostFn::PmacMod, false)]);
}
