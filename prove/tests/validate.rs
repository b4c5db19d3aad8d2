//! Whether the optimised IR does what the unoptimised IR does is proved, and wrong rewrites are refuted.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::time::{Duration, Instant};

use plcc_abi::Dialect;
use plcc_ir::Module;
use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::text::{parse, print};
use plcc_prove::validate::{Validation, Verdict};

/// A program before and after the passes; `None` where it has errors.
fn versions(dialect: Dialect, text: &str) -> Option<[Module; 2]> {
    let before = support::Bench::try_new(dialect, text)?.lowered.module;
    let mut after = before.clone();
    optimize(&mut after, OptLevel::Speed);
    Some([before, after])
}

/// What is found out about each function, and the time it took.
fn answers(before: &Module, after: &Module, time: Duration) -> Vec<(String, Verdict, Duration)> {
    let validation = Validation::new(before, after);
    let answer = |number| {
        let begin = Instant::now();
        let answer = validation.function(number, time);
        (answer.function, answer.verdict, begin.elapsed())
    };
    (0..validation.len()).map(answer).collect()
}

const PMI: &str = "$INPUT\nA = 0/0\nB = 0/1\nC = 0/2\n$OUTPUT\nX = 1/0\nY = 1/1\nZ = 1/2\n$INTEGER\nN, M\n$END\n\
                   X = A & B ! C\nIF (A)\nN = N + 1\nY = C\nENDIF\nIF (N > 20)\nM = N / 10\nENDIF\nZ = M = 3\n";

const NCT: &str = ":000\nJ0\n:001\nI510 U547 Z\n(I470AI540) U470 D471 Z\nI520\n  LRH000\n  =6\n    D547 UF0200\n    ,250 ST00\n  Z\nZ\n\
                   LY40 A.FF00 SY40\nLRH028 SRH078\nJ1\n";

const PMAC: &str = "I5=2\nOPEN PLC 1 CLEAR\nP1=P2+P3*2\nIF (P1>10)\nP4=P4+1\nELSE\nP4=0\nENDIF\nWHILE (P5<10)\nP5=P5+1\n\
                    ENDWHILE\nP6=P7/3\nCLOSE\n";

/// Programs of all languages whose passes are proved to be right: what `PLCC_VALIDATE` names, files divided by blanks, or these.
#[test]
fn what_passes_make_of_programs_is_proved() {
    if let Ok(files) = std::env::var("PLCC_VALIDATE") {
        for file in files.split(' ') {
            let text = String::from_utf8_lossy(&std::fs::read(file).unwrap()).into_owned();
            let dialect = match file {
                it if it.ends_with(".pmi") => Dialect::Pmi,
                it if it.contains("nct") => Dialect::Nct,
                _ => Dialect::Pmac,
            };
            let Some([before, after]) = versions(dialect, &text) else { continue };
            for (name, verdict, time) in answers(&before, &after, Duration::from_secs(20)) {
                eprintln!("{file} {name} {time:?} {verdict:?}");
                assert!(!matches!(verdict, Verdict::Refuted(_)), "{file} {name}");
            }
        }
        return;
    }
    for (dialect, text) in [(Dialect::Pmi, PMI), (Dialect::Nct, NCT), (Dialect::Pmac, PMAC)] {
        let Some([before, after]) = versions(dialect, text) else { panic!("{dialect:?}") };
        for (name, verdict, time) in answers(&before, &after, Duration::from_secs(60)) {
            eprintln!("{dialect:?} {name} {time:?}");
            assert!(matches!(verdict, Verdict::Proved), "{dialect:?} {name}: {verdict:?}");
        }
    }
}

/// A text of IR with one line changed, for each line in which that can be done.
fn changed(text: &str, from: &str, to: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let places = lines.iter().enumerate().filter(|(_, line)| line.contains(from));
    let change = |(at, line): (usize, &&str)| {
        let new = line.replacen(from, to, 1);
        let mut all: Vec<&str> = lines.clone();
        all[at] = &new;
        all.join("\n") + "\n"
    };
    places.map(change).collect()
}

/// Ten kinds of wrong rewrites: what is proved of one is found to be the same by no run, and most are refuted.
#[test]
fn wrong_rewrites_are_refuted() {
    const KINDS: [(&str, &str); 10] = [
        (" = and ", " = or "),
        (" = or ", " = xor "),
        (" = add ", " = sub "),
        ("icmp sgt", "icmp sge"),
        ("icmp slt", "icmp ult"),
        (" = ashr ", " = lshr "),
        (" = fadd ", " = fsub "),
        ("    store ", "    ;; store "),
        ("iconst 1\u{0}", "iconst 2\u{0}"),
        (" = sext ", " = zext "),
    ];
    let (mut refuted, mut proved, mut open) = (0, 0, vec![]);
    for (dialect, text) in [(Dialect::Pmi, PMI), (Dialect::Nct, NCT), (Dialect::Pmac, PMAC)] {
        let [before, after] = versions(dialect, text).unwrap();
        let text = print(&after).replace('\n', "\u{0}\n");
        for (from, to) in KINDS {
            for wrong in changed(&text, from, to) {
                let Ok(wrong) = parse(&wrong.replace('\u{0}', "")) else { continue };
                for (name, verdict, _) in answers(&before, &wrong, Duration::from_secs(4)) {
                    match verdict {
                        Verdict::Refuted(difference) => {
                            refuted += 1;
                            assert!(!difference.what.is_empty());
                        }
                        Verdict::Proved => {
                            eprintln!("same: {from} to {to}");
                            proved += 1;
                        }
                        Verdict::Undecided(reason) => {
                            open.push(format!("{dialect:?} {from} {name} {reason:?}"));
                        }
                    }
                }
            }
        }
    }
    eprintln!("{refuted} refuted, {proved} proved, {open:#?}");
    assert!(refuted >= 20, "{refuted} refuted, {proved} proved, {open:#?}");
    assert!(open.len() <= refuted / 4, "{open:#?}");
}
