//! Checks arbitrary text. Nothing panics, and the place of every diagnostic lies in the text.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Limits, MemoryLoader, Options},
    nct,
};
use plcc_random::Rng;

/// Checks a text, and lowers the program if there is one. Returns the number of errors.
fn errors(text: &[u8], limits: Limits) -> usize {
    let mut sources = SourceMap::new();
    let file = sources.add("main.nct", text);
    let options = Options { limits, ..Options::default() };
    let (program, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &options);
    if let Some(program) = program {
        program.lower().unwrap();
        program.interpreter();
        program.cross_reference().to_string();
    }
    for diagnostic in &all {
        let span = diagnostic.span;
        assert!(span.start <= span.end && sources.text(span.file).get(span.range()).is_some());
    }
    all.iter().filter(|d| d.is_error()).count()
}

#[test]
fn one_repeated_character_gives_diagnostics_and_no_panic() {
    for limits in [Limits::Original, Limits::None] {
        for c in 0..=255u8 {
            for head in ["", ":001", ":001 [", ":001 (I000A", ":001 L", ":199 A", ":001 I000", "/*"]
            {
                let mut text = head.as_bytes().to_vec();
                text.resize(text.len() + 400, c);
                errors(&text, limits);
            }
        }
    }
}

#[test]
fn words_in_random_order_give_diagnostics_and_no_panic() {
    let words = [
        ":001", ":000", ":002", ":010", "J0", "J1", "J2", "R", "G010", "C010", "GF020", "CF020",
        "I000", "NY012", "(", ")", "[", "]", "A", "O", "X", "N", "E", "Z", "U012", "DF0100",
        "UQ01", "LF020", "SF020", "LFI020", "SFI020", "+", "-", "*", "/", "=", "<", ">=", "1",
        ".FF", ",7", "<<3", "BIN", "BCD", "HF120", "MUL100", ":199", "TEXT", "$", ";", "\n", " ",
        "/*", "*/", "\u{e9}",
    ];
    let mut rng = Rng::new(1);
    for _ in 0..3000 {
        let count = 1 + rng.below(40);
        let text: String = (0..count).map(|_| words[rng.below(words.len())]).collect();
        errors(text.as_bytes(), Limits::Original);
        errors(format!(":001 {text} Z J1 :000 J0").as_bytes(), Limits::None);
    }
}

#[test]
fn random_bytes_give_diagnostics_and_no_panic() {
    let mut rng = Rng::new(7);
    for _ in 0..2000 {
        let bytes: Vec<u8> = (0..rng.below(200)).map(|_| rng.below(256) as u8).collect();
        errors(&bytes, Limits::None);
    }
}

#[test]
fn a_program_with_one_byte_changed_gives_no_panic() {
    let good = b":001 (I000AY012) U013 E D013 Z [LF020+3] SF022 I001 C010 Z J1 :000 J0 :010 ,5 \
                 SFI022 HF120 R :199 ERROR 1,ERROR 2$";
    assert_eq!(errors(good, Limits::Original), 0);
    for at in 0..good.len() {
        for c in [b' ', b'0', b'9', b'Z', b'E', b'(', b']', b'$', b';', 0, 0xE4] {
            let mut text = good.to_vec();
            text[at] = c;
            errors(&text, Limits::Original);
        }
        errors(&good[..at], Limits::Original);
    }
}

#[test]
fn long_and_deeply_nested_conditions_give_no_panic() {
    let chain = "I000A".repeat(50_000);
    assert_eq!(errors(format!(":001 ({chain}I001) U012 Z J1 :000 J0").as_bytes(), Limits::None), 0);
    let deep = |n| format!(":001 {}I000{} U012 Z J1 :000 J0", "(".repeat(n), ")".repeat(n));
    assert_eq!(errors(deep(8).as_bytes(), Limits::Original), 0);
    assert!(errors(deep(9).as_bytes(), Limits::Original) > 0);
    assert_eq!(errors(deep(256).as_bytes(), Limits::None), 0);
    assert!(errors(deep(100_000).as_bytes(), Limits::None) > 0);
}

/// Ruling: nesting beyond 256 is an error of ours, whatever the limits; 12 is the original one's.
#[test]
fn parentheses_nest_8_levels_or_without_limits_256() {
    for (limits, depth, code) in [
        (Limits::Original, 8, None),
        (Limits::Original, 9, Some("NCT-12")),
        (Limits::None, 256, None),
        (Limits::None, 257, Some("NCT-X1")),
    ] {
        let (open, close) = ("(".repeat(depth), ")".repeat(depth));
        let text = format!(":001 {open}I000{close} Z J1 :000 J0");
        let mut sources = SourceMap::new();
        let file = sources.add("main.nct", text.as_bytes());
        let options = Options { limits, ..Options::default() };
        let (_, all) = nct::check(&mut sources, file, &MemoryLoader::new(), &options);
        let codes: Vec<_> = all.iter().map(|d| d.code).collect();
        assert_eq!(codes, code.into_iter().collect::<Vec<_>>(), "{depth}");
    }
}
