//! Checks arbitrary text. Nothing panics, and the place of every diagnostic lies in the text.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Controller, Limits, MemoryLoader, Options},
    pmac,
};
use plcc_random::Rng;

/// Checks a text, and lowers the program if there is one. Returns the number of errors.
fn errors(text: &[u8], controller: Controller) -> usize {
    let mut sources = SourceMap::new();
    let file = sources.add("main.pmc", text);
    let other = &b"#define AT_HOME P1=1\n#include \"main.pmc\"\n#endif\nP2="[..];
    let loader = MemoryLoader::new().with("other.h", other).with("main.pmc", text);
    let limits = Limits::None;
    let options = Options { limits, controller, ..Options::default() };
    let (program, all) = pmac::check(&mut sources, &[file], &loader, &options);
    if let Some(program) = program {
        program.lower().unwrap();
        program.interpreter();
        let _ = program.explain_arithmetic();
    }
    for diagnostic in &all {
        let labels = diagnostic.labels().iter().map(|label| label.span);
        for span in labels.chain([diagnostic.span]) {
            let inside = sources.text(span.file).get(span.range()).is_some();
            assert!(span.start <= span.end && inside, "{diagnostic:?}\n{text:?}");
        }
    }
    all.iter().filter(|d| d.is_error()).count()
}

const HEADS: [&str; 16] = [
    "",
    "OPEN PLC 1 CLEAR\n",
    "OPEN PLCC 1 CLEAR L1=",
    "OPEN PLC 1 CLEAR IF(",
    "OPEN PLC 1 CLEAR P1=",
    "OPEN PLC 1 CLEAR CMD\"",
    "OPEN PLC 1 CLEAR M(",
    "OPEN PROG 1 ",
    "OPEN PLC 1 CLEAR DISPLAY 1,2.2,",
    "#define A ",
    "#define A(",
    "#include ",
    "#ifdef ",
    "M1->",
    "P1..",
    "DEFINE COMP ",
];

#[test]
fn one_repeated_character_gives_diagnostics_and_no_panic() {
    // One byte of each kind beyond ASCII, as Windows-1252.
    for c in (0..128).chain([0x80, 0x8D, 0x93, 0x96, 0xE4, 0xFF]) {
        for head in HEADS {
            let mut text = head.as_bytes().to_vec();
            text.resize(text.len() + 100, c);
            errors(&text, Controller::Pmac);
        }
    }
}

#[test]
fn words_in_random_order_give_diagnostics_and_no_panic() {
    let words = [
        "OPEN",
        "PLC",
        "PLCC",
        "1",
        "31",
        "CLEAR",
        "CLOSE",
        "IF",
        "WHILE",
        "ELSE",
        "ENDIF",
        "ENDI",
        "ENDW",
        "END",
        "AND",
        "OR",
        "(",
        ")",
        "P1",
        "Q2",
        "M3",
        "I5",
        "L4",
        "P(",
        "M(",
        "=",
        "==",
        "!=",
        "!",
        "~",
        "<",
        ">",
        "+",
        "-",
        "*",
        "/",
        "%",
        "&",
        "|",
        "^",
        "&=",
        "SIN(",
        "ATAN2(",
        "$FF",
        "1.5",
        ".",
        "..",
        ",",
        "->",
        "X:$7F0,0,24,S",
        "Y:",
        "TWD:4,0.8.3,U",
        "CMD",
        "\"",
        "^A",
        "SEND",
        "DISPLAY",
        "ADDRESS",
        "ADR",
        "#1",
        "&2",
        "DISABLE",
        "ENA",
        "PAUSE",
        "RES",
        "#define",
        "#undef",
        "#ifdef",
        "#ifndef",
        "#else",
        "#endif",
        "#include",
        "\"other.h\"",
        "<x>",
        "NAME",
        "$(NAME)",
        "NAME",
        "DEFINE",
        "COMP",
        "GATHER",
        "UNDEFINE",
        "SAVE",
        "$$$",
        "PROG",
        "ROTARY",
        "\n",
        "\n",
        " ",
        " ",
        ";",
        "//",
        "\u{e9}",
        "\u{201c}",
        "\u{2212}",
    ];
    let mut rng = Rng::new(1);
    for _ in 0..500 {
        let count = 1 + rng.below(40);
        let text: String = (0..count).map(|_| words[rng.below(words.len())]).collect();
        errors(text.as_bytes(), Controller::Pmac);
        errors(format!("OPEN PLC 1 CLEAR {text}\nCLOSE").as_bytes(), Controller::Turbo);
        errors(format!("OPEN PLCC 2\n{}", text.replace(' ', "\n")).as_bytes(), Controller::Pmac);
    }
}

#[test]
fn random_bytes_give_diagnostics_and_no_panic() {
    let mut rng = Rng::new(7);
    for round in 0..1500 {
        let head = HEADS[round % HEADS.len()].as_bytes();
        let bytes = (0..rng.below(200)).map(|_| rng.below(256) as u8);
        let text: Vec<u8> = head.iter().copied().chain(bytes).collect();
        errors(&text, Controller::Pmac);
    }
}

#[test]
fn a_program_with_one_byte_changed_gives_no_panic() {
    let good =
        b"#define LAMP M1\n#define WHEN(x) P9\nM1->Y:$FFC2,8,1\nL1->X:$7F0,0,24,S\nP1..3=$F\n\
                 OPEN PLC 1 CLEAR\nIF(LAMP=1 AND P1>Q2)OR(P3~4)\nP2=SIN(P1)*-2%(M1|8)\nELSE\n\
                 CMD\"#1J+ P4=1\"\nENDIF\nWHILE(P2!<1)\nADR&2#1\nENDW\nDISPLAY 3,8.2,P2\nDISPLC2\n\
                 CLOSE\nOPEN PLCC 3\nL1=L1+1 ;up\nCLOSE\n";
    assert_eq!(errors(good, Controller::Pmac), 0);
    for at in 0..good.len() {
        for c in [b'9', b'(', b'"', 0xE4] {
            let mut text = good.to_vec();
            text[at] = c;
            errors(&text, Controller::Pmac);
        }
        errors(&good[..at], Controller::Pmac);
    }
}

#[test]
fn long_and_deeply_nested_statements_give_no_panic() {
    let plc =
        |text: &str| errors(format!("OPEN PLC 1\n{text}\nCLOSE").as_bytes(), Controller::Pmac);
    let wrapped = |n: usize, inner: &str| format!("{}{inner}{}", "(".repeat(n), ")".repeat(n));
    assert_eq!(plc(&format!("P1={}1", "P1+".repeat(50_000))), 0);
    assert_eq!(plc(&format!("IF(P1=1{})P2=1 ENDIF", " AND P1=1".repeat(20_000))), 0);
    assert_eq!(plc(&format!("P1={}P2", "-".repeat(50_000))), 0);
    assert_eq!(plc(&format!("P1={}", wrapped(256, "P2"))), 0);
    assert!(plc(&format!("P1={}", wrapped(100_000, "P2"))) > 0);
    assert!(plc(&format!("IF{}ENDIF", wrapped(100_000, "P2=1"))) > 0);
    assert!(plc(&"P(".repeat(100_000)) > 0);
    let nested = |n| format!("{}P1=1 {}", "IF(P1=1) ".repeat(n), "ENDIF ".repeat(n));
    assert_eq!(plc(&nested(256)), 0);
    assert!(plc(&nested(100_000)) > 0);
    let macros: String = (0..5000).map(|n| format!("#define A{} A{n}+A{n}\n", n + 1)).collect();
    errors(format!("{macros}P1=A5000\n").as_bytes(), Controller::Pmac);
}
