//! The lints: each finds something in a program written for it and nothing in the corrected program, and
//! those that are on by default find nothing in the examples.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use plcc_abi::Dialect;
use plcc_diag::lints::{LINTS, Level, Lint, find_lint, lint_of_code};
use plcc_diag::{Diagnostic, Severity, SourceMap};
use plcc_frontend::common::{LintLevels, Machine, MemoryLoader, Options};
use plcc_frontend::{detect, language};

/// A lint, a program in which it finds something, and the line of the finding; then the corrected program.
struct Case {
    lint: &'static str,
    dialect: Dialect,
    wrong: &'static str,
    line: u32,
    right: &'static str,
}

const fn pmi(lint: &'static str, line: u32, wrong: &'static str, right: &'static str) -> Case {
    Case { lint, dialect: Dialect::Pmi, wrong, line, right }
}

const fn nct(lint: &'static str, line: u32, wrong: &'static str, right: &'static str) -> Case {
    Case { lint, dialect: Dialect::Nct, wrong, line, right }
}

const fn pmac(lint: &'static str, line: u32, wrong: &'static str, right: &'static str) -> Case {
    Case { lint, dialect: Dialect::Pmac, wrong, line, right }
}

const CASES: &[Case] = &[
    pmi(
        "near-name",
        4,
        "$LOGICAL\nREADY\n$END\nREDAY = T\nX = READY\nY = X\nX = Y\n",
        "$LOGICAL\nREADY\n$END\nREADY = T\nX = READY\nY = X\nX = Y\n",
    ),
    // Names that differ in a digit are not reported.
    pmi("near-name", 4, "$LOGICAL\nPUMP\n$END\nPUMPS = PUMP\n", "$LOGICAL\nPB1\n$END\nPB2 = PB1\n"),
    pmi(
        "unassigned-output",
        2,
        "$OUTPUT\nLAMP = 2/0\nOTHER = 2/1\n$END\nOTHER = T\n",
        "$OUTPUT\nLAMP = 2/0\nOTHER = 2/1\n$END\nOTHER = T\nLAMP = F\n",
    ),
    pmi(
        "number-in-logical",
        4,
        "$INPUT\nTPOS = 0/0-3/BCD\n$END\nTOOL = @NTOOL\nA = TPOS = TOOL\nB = A\nA = B\n",
        "$INPUT\nTPOS = 0/0-3/BCD\n$INTEGER\nTOOL\n$END\nTOOL = @NTOOL\nA = TPOS = TOOL\nB = A\nA = B\n",
    ),
    // A constant, and a comparison. Whether a number is 0 may be all that is asked.
    pmi(
        "number-in-logical",
        2,
        "$END\nMODE = 3\nA = MODE\nB = A\nA = B\n",
        "$END\nMODE = 1\nA = MODE\nB = A\nA = B\n",
    ),
    pmi(
        "number-in-logical",
        3,
        "$END\nMODE = @FRO\nA = MODE = 5\nB = A\nA = B\n",
        "$END\nMODE = @FRO\nA = MODE = 1\nB = A\nA = B\n",
    ),
    pmi(
        "delayed-contact-never-read",
        2,
        "$TIMER\nE/TC/TD = 5\n$END\nTC = A\nA = TC\n",
        "$TIMER\nE/TC/TD = 5\n$END\nTC = A\nA = TD\n",
    ),
    pmi(
        "input-never-read",
        3,
        "$INPUT\nA = 0/0\nESTOP = 0/1\n$END\nB = A\nC = B\nB = C\n",
        "$INPUT\nA = 0/0\nESTOP = 0/1\n$END\nB = A & ESTOP\nC = B\nB = C\n",
    ),
    // What lines can be.
    pmi(
        "value-out-of-range",
        4,
        "$INPUT\nTPOS = 0/0-4/BCD\n$END\nA = TPOS = 20\nB = A\nA = B\n",
        "$INPUT\nTPOS = 0/0-4/BCD\n$END\nA = TPOS = 19\nB = A\nA = B\n",
    ),
    pmi(
        "value-out-of-range",
        4,
        "$OUTPUT\nS = 0/0-2/TWOC\n$END\nS = 4\n",
        "$OUTPUT\nS = 0/0-2/TWOC\n$END\nS = -4\n",
    ),
    pmi(
        "output-assigned-twice",
        4,
        "$OUTPUT\nLAMP = 2/0\n$END\nLAMP = A\nLAMP = B\nA = T\nB = A\n",
        "$OUTPUT\nLAMP = 2/0\n$END\nLAMP = A + B\nA = T\nB = A\n",
    ),
    // Both branches assign it, and a later statement always; but not where the later one is in an IF.
    pmi(
        "output-assigned-twice",
        5,
        "$OUTPUT\nLAMP = 2/0\n$END\nIF (A)\nLAMP = T\nENDIF\nLAMP = A\nA = T\n",
        "$OUTPUT\nLAMP = 2/0\n$END\nLAMP = F\nIF (A)\nLAMP = T\nENDIF\nA = T\n",
    ),
    pmi(
        "code-never-reset",
        2,
        "$MCODE\n@M03/P\n$END\nX = @M03\n",
        "$MCODE\n@M03/P\n$END\nX = @M03\n@M03 = F\n",
    ),
    pmi(
        "control-never-assigned",
        2,
        "$TIMER\nE/TC/DC = 5\n$END\nX = DC\n",
        "$TIMER\nE/TC/DC = 5\n$END\nX = DC\nTC = X\n",
    ),
    pmi(
        "control-never-assigned",
        2,
        "$FLIPFLOP\nQ/D/CLK/PR/CLR\n$END\nX = Q\nD = X\n",
        "$FLIPFLOP\nQ/D/CLK/PR/CLR\n$END\nX = Q\nD = X\nCLK = Q\n",
    ),
    pmi("value-out-of-range", 2, "$END\n@FRO = 200\n", "$END\n@FRO = 150\n"),
    pmi("value-out-of-range", 2, "$END\nX = @MODRQ = 3\n", "$END\nX = @MODRQ = 2\n"),
    pmi(
        "constant-condition",
        2,
        "$END\nIF (1 = 2)\nX = T\nENDIF\n",
        "$END\nIF (@FRO = 2)\nX = T\nENDIF\n",
    ),
    pmi(
        "unreachable",
        3,
        "$END\nGOTO L1\nX = T\nL1: Y = T\n",
        "$END\nIF (Y)\nGOTO L1\nENDIF\nX = T\nL1: Y = T\n",
    ),
    nct(
        "read-never-written",
        2,
        ":001\nF0200 U012 Z\nJ1\n:000 J0",
        ":001\nF0200 U012 Z\nI000 UF0200 Z\nJ1\n:000 J0",
    ),
    nct(
        "constant-condition",
        2,
        ":001 LRH062\n<0 U012 Z\nJ1 :000 J0",
        ":001 LRH062\n=0 U012 Z\nJ1 :000 J0",
    ),
    nct(
        "constant-condition",
        2,
        ":001 ,5\n=6 U012 Z\nJ1 :000 J0",
        ":001 ,5 +LRH062\n=6 U012 Z\nJ1 :000 J0",
    ),
    nct("unreachable", 2, ":001 J1 :000 J0\n:010 U012 R", ":001 C010 J1 :000 J0\n:010 U012 R"),
    nct(
        "unreachable",
        2,
        ":001 G003\nU012\n:003 J1 :000 J0",
        ":001 I000 G003 Z\nU012\n:003 J1 :000 J0",
    ),
    nct(
        "falls-through",
        3,
        ":001 C010 C011 J1 :000 J0\n:010 U012\n:011 U013 R",
        ":001 C010 C011 J1 :000 J0\n:010 U012 R\n:011 U013 R",
    ),
    nct(
        "falls-through",
        3,
        ":001 C010 U013 J1 :000 J0\n:010 U012\nI000 U014 Z",
        ":001 C010 U013 J1 :000 J0\n:010 U012\nI000 U014 Z R",
    ),
    nct(
        "strobe-without-fin",
        2,
        ":001\nI520 U012 Z\nJ1 :000 J0",
        ":001\nI520 U012 D547 Z\nJ1 :000 J0",
    ),
    nct(
        "timer-never-started",
        2,
        ":001\nT05 U012 Z\nJ1 :000 J0",
        ":001 ,50 ST05\nT05 U012 Z\nJ1 :000 J0",
    ),
    nct("written-in-two-modules", 2, ":001 U012 J1 :000\nU012\nJ0", ":001 U012 J1 :000\nU013\nJ0"),
    nct(
        "message-without-text",
        2,
        ":001 U710\nU711\nJ1 :000 J0 :199 DOOR OPEN$",
        ":001 U710\nU711\nJ1 :000 J0 :199 DOOR OPEN,NO OIL$",
    ),
    nct(
        "text-never-used",
        2,
        ":001 U710 J1 :000 J0 :199 DOOR OPEN,\nNO OIL$",
        ":001 U710 U711 J1 :000 J0 :199 DOOR OPEN,\nNO OIL$",
    ),
    pmac(
        "same-bit-twice",
        5,
        "M1->Y:$C002,8,1\nM2->Y:$C002,8,1\nOPEN PLC 1 CLEAR\nM1=P1\nM2=P2\nCLOSE\nENABLE PLC1\n",
        "M1->Y:$C002,8,1\nM2->Y:$C002,9,1\nOPEN PLC 1 CLEAR\nM1=P1\nM2=P2\nCLOSE\nENABLE PLC1\n",
    ),
    nct(
        "lost-z",
        5,
        ":001\nI001\n  I002 U013\nZ\nI003 U014 Z\nI004 U015 Z Z\nJ1\n:000 J0\n",
        ":001\nI001\n  I002 U013 Z\nZ\nI003 U014 Z\nI004 U015 Z\nJ1\n:000 J0\n",
    ),
    // A text without indentation says nothing.
    nct(
        "lost-z",
        6,
        ":001\nI001\n\tI002 U013\nE\n\tD013\nI003 U014 Z\nZ Z\nJ1\n:000 J0\n",
        ":001\nI001\nI002 U013\nE\nD013\nZ\nI003 U014 Z\nZ\nJ1\n:000 J0\n",
    ),
    pmac(
        "value-out-of-range",
        3,
        "I5=2 M1->Y:$FFC2,8,1\nOPEN PLC 2 CLEAR\nM1=2\nCLOSE\n",
        "I5=2 M1->Y:$FFC2,8,1\nOPEN PLC 2 CLEAR\nM1=1\nCLOSE\n",
    ),
    pmac(
        "constant-condition",
        3,
        "I5=2\nOPEN PLC 2 CLEAR\nIF (1=2)\nP1=1\nENDIF\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nIF (P1=2)\nP1=1\nENDIF\nCLOSE\n",
    ),
    pmac(
        "unreachable",
        6,
        "I5=2\nOPEN PLC 2 CLEAR\nWHILE (1=1)\nP1=P1+1\nENDWHILE\nP2=1\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nWHILE (P1<9)\nP1=P1+1\nENDWHILE\nP2=1\nCLOSE\n",
    ),
    pmac(
        "undefined-m-variable",
        3,
        "I5=2\nOPEN PLC 2 CLEAR\nM1=1\nCLOSE\n",
        "I5=2 M1->Y:$FFC2,8,1\nOPEN PLC 2 CLEAR\nM1=1\nCLOSE\n",
    ),
    pmac(
        "assigned-undefined",
        4,
        "I5=2 M1->Y:$FFC2,8,1\nOPEN PLC 2 CLEAR\nM1=1\nM2=1\nCLOSE\n",
        "I5=2 M1->Y:$FFC2,8,1 M2->Y:$FFC2,9,1\nOPEN PLC 2 CLEAR\nM1=1\nM2=1\nCLOSE\n",
    ),
    // One that is only read is the matter of the other lint, and so are downloads without any definition.
    pmac(
        "assigned-undefined",
        3,
        "I5=2 M1->*\nOPEN PLC 2 CLEAR\nM3=M1\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nP1=M3\nCLOSE\n",
    ),
    pmac(
        "input-assigned",
        3,
        "I5=2 M1->Y:$FFC2,0,1\nOPEN PLC 2 CLEAR\nM1=1\nCLOSE\n",
        "I5=2 M1->Y:$FFC2,8,1\nOPEN PLC 2 CLEAR\nM1=1\nCLOSE\n",
    ),
    pmac(
        "plc-never-enabled",
        5,
        "I5=2 DISABLE PLC0..31\nOPEN PLC 2 CLEAR\nP1=1\nCLOSE\nOPEN PLC 3 CLEAR\nP2=1\nCLOSE\nENABLE PLC2\n",
        "I5=2 DISABLE PLC0..31\nOPEN PLC 2 CLEAR\nP1=1\nCLOSE\nOPEN PLC 3 CLEAR\nP2=1\nCLOSE\nENABLE PLC2,3\n",
    ),
    // A program enables it; and one that is disabled by itself is meant so.
    pmac(
        "plc-never-enabled",
        5,
        "I5=2 DISABLE PLC2..4\nOPEN PLC 2 CLEAR\nENABLE PLC 3\nCLOSE\nOPEN PLC 4 CLEAR\nP2=1\nCLOSE\n\
         OPEN PLC 3 CLEAR\nP2=1\nCLOSE\nENABLE PLC2\n",
        "I5=2 DISABLE PLC2..3 DISABLE PLC4\nOPEN PLC 2 CLEAR\nENABLE PLC 3\nCLOSE\nOPEN PLC 4 CLEAR\nP2=1\nCLOSE\n\
         OPEN PLC 3 CLEAR\nP2=1\nCLOSE\nENABLE PLC2\n",
    ),
    pmac(
        "repeats-every-scan",
        3,
        "I5=2\nOPEN PLC 2 CLEAR\nSEND\"READY\"\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nSEND\"READY\"\nDISABLE PLC 2\nCLOSE\n",
    ),
    pmac(
        "shared-timer",
        6,
        "I5=2 M90->X:$700,0,24,S\nOPEN PLC 2 CLEAR\nM90=100\nCLOSE\nOPEN PLC 3 CLEAR\nM90=50\nCLOSE\n",
        "I5=2 M90->X:$700,0,24,S M91->Y:$700,0,24,S\nOPEN PLC 2 CLEAR\nM90=100\nCLOSE\n\
         OPEN PLC 3 CLEAR\nM91=50\nCLOSE\n",
    ),
    pmac(
        "motor-not-activated",
        2,
        "I5=2\n&1 #2->1000Y\nOPEN PROG 1 CLEAR\nY1\nCLOSE\n",
        "I5=2 I200=1\n&1 #2->1000Y\nOPEN PROG 1 CLEAR\nY1\nCLOSE\n",
    ),
    pmac(
        "plc-never-runs",
        2,
        "I5=1\nOPEN PLC 2 CLEAR\nP1=1\nCLOSE\n",
        "I5=3\nOPEN PLC 2 CLEAR\nP1=1\nCLOSE\n",
    ),
    pmac(
        "empty-command",
        4,
        "I5=2\nOPEN PLC 2 CLEAR\nIF (P1=1)\nCMD\"\"\nENDIF\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nIF (P1=1)\nCMD\"&1A\"\nENDIF\nCLOSE\n",
    ),
    pmac(
        "position-beyond-display",
        4,
        "I5=2\nOPEN PLC 2 CLEAR\nIF (P1=1)\nDISP 75 \"READY NOW\"\nENDIF\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nIF (P1=1)\nDISP 70 \"READY NOW\"\nENDIF\nCLOSE\n",
    ),
    pmac(
        "endless-wait",
        3,
        "I5=2\nOPEN PLC 2 CLEAR\nWHILE (P1=0)\nENDWHILE\nP2=1\nCLOSE\n",
        "I5=2\nOPEN PLC 2 CLEAR\nWHILE (P1=0)\nENDWHILE\nP2=1\nCLOSE\nOPEN PLC 3 CLEAR\nP1=P2\nCLOSE\n",
    ),
];

/// Every lint on.
fn all_on() -> LintLevels {
    let mut levels = LintLevels::default();
    LINTS.iter().for_each(|lint| levels.set(lint, Level::Warn));
    levels
}

/// The diagnostics of a text, and the files that they are in.
fn check(dialect: Dialect, text: &[u8], lints: LintLevels) -> (SourceMap, Vec<Diagnostic>) {
    let mut sources = SourceMap::new();
    let file = sources.add("program", text);
    let options = Options { lints, ..Options::default() };
    let (_, found) = language(dialect).check(&mut sources, &[file], &MemoryLoader::new(), &options);
    (sources, found)
}

/// The lines of a lint's findings.
fn lines(case: &Case, text: &str, levels: LintLevels) -> Vec<(u32, Severity)> {
    let (sources, found) = check(case.dialect, text.as_bytes(), levels);
    let name = |d: &Diagnostic| lint_of_code(d.code).map(|lint| lint.name);
    let errors: Vec<_> =
        found.iter().filter(|d| d.is_error() && name(d) != Some(case.lint)).collect();
    assert!(errors.is_empty(), "{}: {errors:?}\n{text}", case.lint);
    let of_lint = found.iter().filter(|d| name(d) == Some(case.lint));
    of_lint.map(|d| (sources.line_col(d.span.file, d.span.start).0, d.severity)).collect()
}

#[test]
fn each_lint_finds_its_mistake_and_nothing_in_the_corrected_program() {
    let mut seen = Vec::new();
    for case in CASES {
        let lint = find_lint(case.lint).expect("the lint exists");
        let told = lines(case, case.wrong, all_on());
        assert_eq!(told, [(case.line, Severity::Warning)], "{}\n{}", case.lint, case.wrong);
        assert_eq!(lines(case, case.right, all_on()), [], "{}\n{}", case.lint, case.right);

        let mut levels = LintLevels::default();
        levels.set(lint, Level::Allow);
        assert_eq!(lines(case, case.wrong, levels.clone()), [], "{} allowed", case.lint);
        levels.set(lint, Level::Deny);
        let denied = lines(case, case.wrong, levels);
        assert_eq!(denied, [(case.line, Severity::Error)], "{} denied", case.lint);

        let by_default = lines(case, case.wrong, LintLevels::default());
        assert_eq!(by_default.is_empty(), lint.default == Level::Allow, "{} default", case.lint);
        seen.push((case.lint, case.dialect));
    }
    for lint in LINTS {
        for code in lint.codes {
            let is_tested = seen.iter().any(|(name, dialect)| {
                *name == lint.name && code.starts_with(language(*dialect).title())
            });
            assert!(is_tested, "{code} ({}) has no program", lint.name);
        }
    }
}

#[test]
fn a_comment_silences_a_lint_for_the_next_statement() {
    for case in CASES {
        let mark = if case.dialect == Dialect::Pmi { "?" } else { ";" };
        let comment = format!("{mark} plcc: allow {}", case.lint);
        let mut text: Vec<&str> = case.wrong.split('\n').collect();
        // A comment may stand anywhere between lines but at the top of NCT's first module.
        text.insert(case.line as usize - 1, &comment);
        assert_eq!(lines(case, &text.join("\n"), all_on()), [], "{}", text.join("\n"));
    }
}

/// Adds the lints that find something in the files below a folder, each with the file.
fn findings_in(folder: &Path, found: &mut Vec<(&'static Lint, String)>) {
    for entry in folder.read_dir().unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            findings_in(&path, found);
            continue;
        }
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), &bytes);
        let known = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
        if !["pmi", "nct", "plc", "pmc", "pmac"].contains(&known.as_str()) {
            continue;
        }
        let Ok(dialect) = detect::detect(&path, sources.text(file)) else { continue };
        let loader = MemoryLoader::new();
        let machine = std::fs::read_to_string(path.with_extension("machine.toml"));
        let machine = machine.map(|text| Machine::parse(&text).unwrap());
        let machine = machine.unwrap_or_default();
        let lints = LintLevels::of_machine(&machine).unwrap();
        let options = Options { machine, lints, ..Options::default() };
        let (_, diagnostics) = language(dialect).check(&mut sources, &[file], &loader, &options);
        found.extend(
            diagnostics
                .iter()
                .filter_map(|d| Some((lint_of_code(d.code)?, path.display().to_string()))),
        );
    }
}

#[test]
fn lints_that_are_on_find_nothing_in_the_examples() {
    let mut found = Vec::new();
    findings_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples"), &mut found);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn the_table_in_the_docs_has_every_lint() {
    let docs = include_str!("../../../docs/lints.md");
    for lint in LINTS {
        let row = docs.lines().find(|line| line.starts_with(&format!("| `{}` |", lint.name)));
        let row = row.unwrap_or_else(|| panic!("{} is not in the table", lint.name));
        let on = if lint.default == Level::Allow { "no |" } else { "yes |" };
        assert!(row.ends_with(on), "{row}");
        for code in lint.codes {
            let title = code.split('-').next().unwrap_or("");
            assert!(row.contains(title), "{row}: {title}");
        }
    }
}
