//! Every error of PMI's manual and every warning: which text causes it, and in which line.

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Limits, LintLevels, MemoryLoader, Options},
    pmi,
};

/// Checks a program that can include three other files. Returns the code, without `PMI-`, and the
/// line of each diagnostic.
fn findings(text: &str, limits: Limits) -> Vec<(String, u32)> {
    let loader = MemoryLoader::new()
        .with("inner.pmi", "X1 = T\n")
        .with("main.pmi", text)
        .with("nested.pmi", "? one\n$INCLUDE inner.pmi\n")
        .with("bad.pmi", "? one\nX2 = NONE\n");
    let mut sources = SourceMap::new();
    let file = sources.add("main.pmi", text.as_bytes());
    let options = Options { limits, lints: LintLevels::none(), ..Options::default() };
    let (program, diagnostics) = pmi::check(&mut sources, file, &loader, &options);
    let found: Vec<_> = diagnostics
        .iter()
        .map(|d| {
            let line = sources.line_col(d.span.file, d.span.start).0;
            (d.code.strip_prefix("PMI-").unwrap_or(d.code).to_owned(), line)
        })
        .collect();
    let errors = found.iter().any(|(code, _)| !code.starts_with('W'));
    assert_eq!(program.is_some(), !errors, "{text}");
    for d in &diagnostics {
        assert!(d.help.is_some() || !d.is_error(), "{} without help", d.message);
    }
    found
}

/// Expects these diagnostics of a program: code and line.
#[track_caller]
fn expect(text: &str, expected: &[(&str, u32)]) {
    let found = findings(text, Limits::Original);
    let found: Vec<_> = found.iter().map(|(code, line)| (code.as_str(), *line)).collect();
    assert_eq!(found, expected, "\n{text}");
}

/// Expects these diagnostics of an execution section, with some declarations in front of it. Its
/// lines are counted from 1.
#[track_caller]
fn expect_in_execution(text: &str, expected: &[(&str, u32)]) {
    let head = "$INPUT\nIN1=0/0\n$OUTPUT\nOUT1=1/0\n$INTEGER\nI,J,AI[5],CI[3]=[1,2,3],C2=2\n$LONG\nL,AL[3]\n$TIMER\nE/TC/DC=5\n$FLIPFLOP\nQ1/D1/CK1/PR1/CL1\n$KEY\nK=\"T\"\n$MCODE\n@M03/P\n$END\n";
    let lines = head.matches('\n').count() as u32;
    let expected: Vec<_> = expected.iter().map(|&(code, line)| (code, line + lines)).collect();
    expect(&format!("{head}{text}"), &expected);
}

#[test]
fn errors_in_directives_have_their_numbers() {
    expect("$INPUTZ\nLS=0/0\n$END\nX=LS\n", &[("1", 1)]);
    expect("$WHAT\nLS=0/0\n$END\nX=LS\n", &[("1", 1)]);
    expect("$END\n$INPUT\n", &[("1", 2)]);
    expect("$END\nX=T\n$END\n", &[("1", 3)]);
    expect("$INPUT\nLS=0/0\n\n? a comment\n", &[("2", 4)]);
    expect("", &[("2", 1)]);
    expect("$INPUT\nLS= # more\n", &[("2", 2)]);
    expect("$INPUT\nLS=0/0 # more\n", &[("2", 2)]);
    expect("LS=0/0\n$END\nX=LS\n", &[("3", 1)]);
    expect("$INPUT\nA=0/0\n$OUTPUT\nB=1/0\n$INPUT\nC=0/1\n$END\nX=C\n", &[("23", 5)]);
    expect("$INPUT X\n$END\n", &[("5", 1)]);
    // What follows a spoilt directive belongs to it.
    expect("$INPUT\nA=0/0\n$output\nB=1/0\n$END\nB=A\n", &[("5", 3)]);
    expect(".$INPUT\nA=0/0\n$End\nB=A\n", &[("5", 1), ("5", 3)]);
    expect("$WHAT\nQ=7\n;$INTEGER\nB[999]\n$END\n", &[("1", 1), ("5", 3), ("19", 4)]);
}

#[test]
fn errors_in_names_and_characters_have_their_numbers() {
    expect("$INPUT\nABCDEFG=0/0\n$END\n", &[("4", 2)]);
    expect_in_execution("ABCDEFG=T\n", &[("4", 1)]);
    expect_in_execution("X=ABCDEFG\n", &[("4", 1)]);
    expect_in_execution("x=T\n", &[("5", 1)]);
    expect_in_execution("X=123A\n", &[("5", 1)]);
    expect_in_execution("X=T;\n", &[("5", 1)]);
    expect_in_execution("X_1=T\n", &[("5", 1)]);
    expect("$INPUT\n=0/0\n$END\n", &[("9", 2)]);
    expect("$INPUT\n5=0/0\n$END\n", &[("9", 2)]);
    expect("$INPUT\nA=0/0\nA=0/1\n$END\n", &[("10", 3)]);
    expect("$INPUT\nT=0/0\nIF=0/1\n$END\n", &[("10", 2), ("10", 3)]);
    expect_in_execution("5=X\n", &[("9", 1)]);
    expect_in_execution("LAB: X=T\nLAB: Y=T\n", &[("10", 2)]);
    expect_in_execution("IN1: X=T\n", &[("10", 1)]);
}

#[test]
fn errors_of_include_have_their_numbers() {
    expect("$END\n$INCLUDE nested.pmi\n", &[("6", 2)]);
    expect("$END\nY=T\n$INCLUDE main.pmi\n", &[("6", 3)]);
    expect("$END\n$INCLUDE\n", &[("7", 2)]);
    expect("$END\n$INCLUDE # the name follows\n inner.pmi ? so\nX=X1\n", &[]);
    expect("$END\n$INCLUDE #\n? no\nX=T\n", &[("7", 2)]);
    expect("$END\nX=T\n$INCLUDE #", &[("7", 3)]);
    expect("$INPUT\nA=0/0\n$INCLUD X.PMI\nB=0/1\n$END\nX=B\n", &[("1", 3)]);
    expect("$END\n$INCLUDE a*b.pmi\n", &[("7", 2)]);
    expect("$END\n$INCLUDE none.pmi\n", &[("8", 2)]);
    expect("$END\n$INCLUDE C:\\OEM\\INNER.PMI ? fine\nX=X1\n", &[]);
    expect("$END\n$INCLUDE BAD.PMI\n", &[("31", 2)]);
}

#[test]
fn errors_in_inputs_and_outputs_have_their_numbers() {
    expect("$INPUT\nA 0/0\n$END\n", &[("11", 2)]);
    expect("$INPUT\nA=/0\n$END\n", &[("12", 2)]);
    expect("$INPUT\nA=-1/0\nB=0/-1\nC=0/2--1/B\n$END\n", &[("13", 2), ("16", 3), ("16", 4)]);
    expect("$INPUT\nA=2047/0\nB=2048/0\n$END\nX=B\n", &[("13", 3)]);
    expect("$OUTPUT\nA=0/0\n$INPUT\nB=0/1\n$END\n", &[("14", 4)]);
    expect("$INPUT\nA=0/0\n$OUTPUT\nB=0/1\n$END\n", &[("15", 4)]);
    expect("$INPUT\nA=0/8\nB=0/3-3/B\nC=0/5-2/BCD\n$END\n", &[("16", 2), ("16", 3), ("16", 4)]);
    expect("$INPUT\nA=0/0-3/BIN\n$END\n", &[("17", 2)]);
    expect("$INPUT\nA=0/0-3\n$END\n", &[("11", 2)]);
    expect("$INPUT\nA=0/0 3/B\n$END\n", &[("5", 2)]);
    expect("$INPUT\nA=0/0\nB=0/0\nC=0/0-3/B\n$END\n", &[]);
    expect("$OUTPUT\nA=0/0\nB=0/0-3/B\n$END\n", &[("X2", 3)]);
    expect("$INPUT\nA=0/0 B=0/1\n$END\n", &[("5", 2)]);
}

#[test]
fn errors_in_variables_and_constants_have_their_numbers() {
    let arrays = |n: usize| {
        let list: String = (0..n).map(|i| format!("A{i}[2]\n")).collect();
        format!("$INTEGER\n{list}$END\n")
    };
    expect(&arrays(256), &[]);
    expect(&arrays(258), &[("18", 258), ("18", 259)]);
    expect(
        "$LOGICAL\nA[1]\nB[256]\nC[255],D[2]\nE[-3]\n$END\n",
        &[("19", 2), ("19", 3), ("19", 5)],
    );
    expect("$INTEGER\nA[3]=[1,2]\nB[2]=[1,2,3]\n$END\nX=A[0]\n", &[("20", 2), ("20", 3)]);
    expect("$INTEGER\nA[]\nB[3]=[1,,2]\n$END\n", &[("12", 2), ("12", 3)]);
    expect("$INTEGER\nA=32768\nB=-32767,C=-32768\n$END\n", &[("30", 2), ("30", 3)]);
    expect("$LOGICAL\nA=2\nB=T,C[2]=[0,F]\n$END\n", &[("30", 2)]);
    expect("$INTEGER\nA=T\nB=1.5\n$END\n", &[("30", 2), ("30", 3)]);
    expect("$LONG\nA=1234567890\nB=999999999\n$END\n", &[("28", 2)]);
    expect("$INTEGER\nA B\nC,\nD,E\n$END\nX=E\n", &[("11", 2), ("9", 3)]);
}

#[test]
fn errors_in_texts_have_their_numbers() {
    expect("$FAULT\nA=\"X\",B[2]\n$INTEGER\nB[3],C\n$END\n", &[("11", 2)]);
    expect("$FAULT\nA=\"X\",B\n$INTEGER\nB[3],C\n$END\n", &[("11", 2)]);
    expect("$MESSAGE\nA=C,\"X ? Y\",C ? comment\n$INTEGER\nB[3],C\n$END\n", &[]);
    expect(
        "$MESSAGE\nA=\"X # Y\"\nB=\"X\nC=\"X\" \"Y\"\n$END\n",
        &[("11", 2), ("11", 3), ("11", 4)],
    );
    expect("$MESSAGE\nA=\"X\",NONE\nB=\"Y\",MAYBE\n$END\nMAYBE=T\n", &[("31", 2)]);
    expect("$KEY\nA=B\nC=\"D\",\n$END\n", &[("11", 2), ("5", 3)]);
}

#[test]
fn errors_in_timers_flipflops_and_codes_have_their_numbers() {
    expect("$TIMER\nX/A/B=5\n/C/D=5\n$END\nP=A&B\n", &[("21", 2), ("21", 3)]);
    expect(
        "$TIMER\nE/A/B=0\nD/C/D=32768\nE/G/H=\nE/K/L=32767\nE/M/N=-1\n$END\n",
        &[("22", 2), ("22", 3), ("12", 4), ("22", 6)],
    );
    expect("$FLIPFLOP\nA/B/C/D\nE/G/H/I/J\n$END\n", &[("11", 2)]);
    expect(
        "$MCODE\n@M300/P\n@G03/P\n@M3/P\nM03/P\n@M299/D\n$END\n",
        &[("24", 2), ("24", 3), ("24", 4), ("24", 5)],
    );
    expect("$GCODE\n@G200/P\n@G199/P\n$END\n", &[("24", 2)]);
    expect("$MCODE\n@M03\n@M04/X\n@M05/P,@M06/D\n$END\nX=@M03&@M04\n", &[("25", 2), ("25", 3)]);
    expect("$AUXAXIS\nX=1,2,-3\n$END\n", &[("W3", 1)]);
}

#[test]
fn errors_in_expressions_have_their_numbers() {
    expect_in_execution("X=NONE[1]\n", &[("29", 1)]);
    expect_in_execution("NONE[1]=T\n", &[("29", 1)]);
    expect_in_execution("X=NONE\n", &[("31", 1)]);
    expect_in_execution("X=Y\nY=T\n", &[]);
    expect_in_execution("X=@M04\n", &[("31", 1)]);
    expect_in_execution("X=((((((1))))))\n", &[("32", 1)]);
    expect_in_execution("X=(((((1)))))\n", &[]);
    expect_in_execution("X=AI[AI[AI[AI[AI[1]]]]]\n", &[]);
    expect_in_execution("X=AI[AI[AI[AI[AI[(1)]]]]]\n", &[("32", 1)]);
    expect_in_execution("AI[AI[AI[AI[AI[AI[1]]]]]]=1\n", &[("32", 1)]);
    expect_in_execution("IF (((((((1)))))))\nENDIF\n", &[("32", 1)]);
    expect_in_execution("IF ((((((1))))))\nENDIF\n", &[]);
    expect_in_execution("X=(1+2\n", &[("32", 1)]);
    expect_in_execution("X=1+2)\nIF(IN1))\nENDIF\n", &[("32", 1), ("32", 2)]);
    expect_in_execution(
        "X=\nX=1+\nX=--I\nX=//I\nX=-/I\nX=/-I\nX=+I\nX=I++J\nX=I!&J\nX=()\n",
        &(1..=10).map(|n| ("34", n)).collect::<Vec<_>>(),
    );
    expect_in_execution("X=I--J\nX=I*-J\nX=I/-J\nX=I//J\nX=I!/J\nX=I&/J\nX=-(-I)\n", &[]);
    expect_in_execution("X=I[1]\nI[1]=1\nX=T[1]\n", &[("35", 1), ("35", 2), ("35", 3)]);
    expect_in_execution("X=AI\nAI=1\n", &[("36", 1), ("36", 2)]);
    expect_in_execution("X=I J\nX=I(J)\nX=(I)J\n", &[("37", 1), ("37", 2), ("37", 3)]);
    expect_in_execution(
        "X=L*I\nX=I*L\nX=I/L\nX=I%L\nX=L/I+L%I\nX=L+L-L\nX=@SCODE*@SSO/100\n",
        &[("42", 1), ("42", 2), ("42", 3), ("42", 4), ("42", 7)],
    );
    expect_in_execution("X=I*32768\n", &[("42", 1)]);
    expect_in_execution(
        "X=AI[L]\nX=AI[40000]\nAI[L+1]=1\nX=AI[IN1]\n",
        &[("43", 1), ("43", 2), ("43", 3)],
    );
    expect_in_execution(
        "X=AI[5]\nAI[-1]=1\nX=AI[CI[2]+C2]\nX=AI[CI[0]+C2]\nX=@AUREQ[6]\nGOTO E\nX=AI[9]\nE:\n",
        &[("X1", 1), ("X1", 2), ("X1", 3), ("X1", 5), ("X1", 7)],
    );
    expect_in_execution("X=1.5\nX=1234567890\nX=999999999\n", &[("30", 1), ("28", 2)]);
    expect_in_execution("X=A=B=C\nA=T\nB=T\nC=T\n", &[]);
}

#[test]
fn errors_in_assignments_have_their_numbers() {
    expect_in_execution(
        "IN1=T\nDC=T\nQ1=T\nC2=1\nCI[1]=1\nK=1\n@MODE=1\nT=1\nF=0\n",
        &(1..=9).map(|n| ("41", n)).collect::<Vec<_>>(),
    );
    expect_in_execution("TC=T\nD1=T\nCK1=T\nOUT1=T\n@M03=F\n@FRO=1\n@NEWSC=F\n", &[]);
    expect_in_execution("X\nX Y\nX/=Y\n", &[("11", 1), ("11", 2), ("11", 3)]);
}

#[test]
fn errors_in_control_flow_have_their_numbers() {
    let nested = |n: usize| format!("{}{}", "IF(IN1)\n".repeat(n), "ENDIF\n".repeat(n));
    expect_in_execution(&nested(4), &[]);
    expect_in_execution(&nested(6), &[("38", 5), ("38", 6)]);
    expect_in_execution(
        "ELSE\nELSEIF(IN1)\nENDIF\nIF(IN1)\nELSE\nELSE\nELSEIF(IN1)\nENDIF\n",
        &[("39", 1), ("39", 2), ("39", 3), ("39", 6), ("39", 7)],
    );
    expect_in_execution("X=T\nIF(IN1)\nX=F\n", &[("39", 2)]);
    expect_in_execution(
        "IF IN1\nENDIF\nIF(IN1\nENDIF\nIF(IN1)&IN1\nENDIF\nIF()\nENDIF\n",
        &[("11", 1), ("32", 3), ("5", 5), ("34", 7)],
    );
    let gotos = format!("{}E:\n", "GOTO E\n".repeat(1002));
    expect_in_execution(&gotos, &[("44", 1001), ("44", 1002)]);
    expect_in_execution(
        "GOTO NONE\nGOTO\nGOTO 5\nGOTO IN1\nGOTO IF\n",
        &[("46", 1), ("46", 2), ("46", 3), ("46", 4), ("46", 5)],
    );
    expect_in_execution("A: X=T\nGOTO A\nB: GOTO B\n", &[("47", 2), ("47", 3)]);
    expect_in_execution("GOTO A\nIF(IN1)\nA: X=T\nELSE\nX=F\nENDIF\n", &[]);
}

#[test]
fn errors_in_continuations_have_their_numbers() {
    expect_in_execution("X=IN1& #anything\nIN1\n", &[]);
    expect_in_execution("X=IN1& #\n\nY=T\n", &[("34", 1)]);
    expect_in_execution("X=IN1 #\n? comment\nY=T\n", &[]);
    expect_in_execution("X=IN1& #\nNONE\n", &[("31", 2)]);
    expect_in_execution("X=IN1 ? not # here\nY=T\n", &[]);
    expect_in_execution("X=IN1& #\n", &[("2", 1)]);
    expect_in_execution("X=IN1 #\n", &[]);
}

#[test]
fn the_first_error_of_a_statement_is_told() {
    expect_in_execution("X=L*I+NONE\n", &[("42", 1)]);
    expect_in_execution("X=NONE+L*I\n", &[("31", 1)]);
    expect_in_execution("X=L*I+)\n", &[("42", 1)]);
    expect_in_execution("IN1=NONE+\n", &[("41", 1)]);
    expect_in_execution("AI[NONE]=L*I\n", &[("31", 1)]);
    expect("$INPUT\nA=0/0\nA=9999/0\n$INTEGER\nA[999],B\n$END\n", &[("10", 3), ("10", 5)]);
}

#[test]
fn limits_none_lifts_the_limits_of_the_control() {
    let free = |text: &str| {
        findings(text, Limits::None)
            .into_iter()
            .map(|(c, l)| format!("{c}@{l}"))
            .collect::<Vec<_>>()
    };
    let none: [String; 0] = [];
    assert_eq!(free("$INTEGER\nLONGNAME,A[1000],B[1]\n$END\nX=((((((((1))))))))\n"), none);
    assert_eq!(free("$END\nX=2147483647\nX=2147483648\n"), ["30@3"]);
    assert_eq!(free("$LONG\nA[16000000]\nB[1000000]\nC[2147483647]\n$END\n"), ["40@3", "40@4"]);
    let deep = |n: usize| format!("$END\nX={}1{}\n", "(".repeat(n), ")".repeat(n));
    assert_eq!(free(&deep(256)), none);
    assert_eq!(free(&deep(257)), ["32@2"]);
    let ifs = |n: usize| format!("$END\nX=T\n{}{}", "IF(X)\n".repeat(n), "ENDIF\n".repeat(n));
    assert_eq!(free(&ifs(256)), none);
    assert_eq!(free(&ifs(257)), ["38@259"]);
    assert_eq!(free(&format!("$END\nX=T ?{}\n", "x".repeat(100))), none);
    assert_eq!(free(&format!("$END\n{}E:\n", "GOTO E\n".repeat(1002))), none);
}

#[test]
fn suspicious_programs_get_warnings() {
    expect(&format!("$END\nX=T ?{}\n", "x".repeat(66)), &[]);
    expect(&format!("$END\nX=T ?{}\n", "x".repeat(67)), &[("W1", 2)]);
    expect("$KEY\nA=\u{201c}X\u{201d}\n$INTEGER\nB=\u{2212}5\n$END\n", &[("W2", 2)]);
    expect("$FAULT\nA=\"1234567890123456789012345678901234567890X\"\n$END\n", &[("W4", 2)]);
}

#[test]
fn text_after_a_complete_line_is_an_error() {
    expect(
        "$INPUT\nIN1=0/0 X\nIN2=0/1,\nIN3=0/2/BCD\nIN4=0/3-4\n$END\n",
        &[("5", 2), ("5", 3), ("5", 4), ("11", 5)],
    );
}

#[test]
fn missing_constants_are_missed_at_the_end_of_the_statement() {
    expect("$INTEGER\nA[3] = #\n [1, #\n 2]\n$END\n", &[("20", 4)]);
    expect("$INTEGER\nA[2] = [1, #\n 2, #\n 3, #\n 4]\n$END\n", &[("20", 4)]);
}

#[test]
fn a_value_that_is_no_number_is_no_constant() {
    let text = "$INTEGER\nA=B\nC=-D\nE=@FRO\nG=\"1\"\nH=,\nK=\n$LOGICAL\nM=-0\nN=2\n$END\n";
    let thirty = |line| ("30", line);
    let missing = [("12", 6), ("12", 7)];
    let all = [2, 3, 4, 5].map(thirty).into_iter().chain(missing).chain([9, 10].map(thirty));
    expect(text, &all.collect::<Vec<_>>());
}

#[test]
fn a_long_operand_is_told_at_its_operator_whatever_stands_behind_it() {
    for text in [
        "I = L * NONE",
        "I = L * )",
        "I = L * (",
        "I = L * (I",
        "I = L * -/I",
        "I = L * (I + , I)",
        "I = L * AI[9]",
        "I = 1 + L * ELSE",
    ] {
        expect_in_execution(text, &[("42", 1)]);
    }
    // The operator is on the first line, the other error on the second.
    expect_in_execution("I = L * #\n ,\n", &[("42", 1)]);
    expect_in_execution("I = I * #\n ,\n", &[("34", 2)]);
}

#[test]
fn a_comma_or_a_directive_leaves_parentheses_open() {
    for text in ["IF (I, J)\nENDIF", "I = (I + J, 1)", "I = (I $END)", "I = (,)", "I = (I + $LONG)"]
    {
        expect_in_execution(text, &[("32", 1)]);
    }
    expect_in_execution("I = I, J", &[("5", 1)]);
    expect_in_execution("I = AI[1, 2]", &[("5", 1)]);
}

#[test]
fn all_names_of_a_faulty_declaration_count_as_declared() {
    expect("$INTEGER\nA B, C D\n$END\nA = B + C + D\n", &[("11", 2)]);
    expect("$TIMER\nE TC DC = 5\n$END\nTC = DC\n", &[("11", 2)]);
}

#[test]
fn a_tab_in_a_text_is_a_blank() {
    let mut sources = SourceMap::new();
    let file = sources.add("main.pmi", b"$FAULT\nFLT = \"A\tB\"\n$END\nFLT = T\n");
    let options = Options::default();
    let (program, _) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
    let lowered = program.map(|program| program.lower());
    let Some(Ok(lowered)) = lowered else { panic!("it is lowered") };
    let plcc_abi::Tables::Pmi(tables) = lowered.program.tables else { panic!("PMI's tables") };
    let text = tables.faults.first().map(|fault| fault.text.clone());
    assert_eq!(text, Some(vec![plcc_abi::pmi::TextItem::Text("A B".to_owned())]));
}

#[test]
fn the_misprint_of_auhom_is_read_only() {
    expect_in_execution("X = @AUHOME[0]\n@AUHOME[0] = T\n", &[("41", 2)]);
}
