//! Checks arbitrary and very long text. Nothing panics, the place of every diagnostic lies in the
//! text, and the time grows no faster than the length.
#![allow(clippy::unwrap_used)]

use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::{
    common::{Limits, MemoryLoader, Options},
    pmi,
};
use plcc_random::Rng;

/// Checks a text, and lowers the program if there is one. Returns the number of errors.
fn errors(text: &[u8], limits: Limits) -> usize {
    check(text, limits).iter().filter(|d| d.is_error()).count()
}

/// The same; returns all diagnostics.
fn check(text: &[u8], limits: Limits) -> Vec<Diagnostic> {
    let mut sources = SourceMap::new();
    let file = sources.add("main.pmi", text);
    let options = Options { limits, ..Options::default() };
    let (program, all) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
    if let Some(program) = program {
        program.lower().unwrap();
        program.interpreter();
    }
    for diagnostic in &all {
        let span = diagnostic.span;
        assert!(span.start <= span.end && sources.text(span.file).get(span.range()).is_some());
    }
    all
}

#[test]
fn one_repeated_character_gives_diagnostics_and_no_panic() {
    for limits in [Limits::Original, Limits::None] {
        for c in 0..=255u8 {
            for head in
                ["", "$END\n", "$END\nX=", "$END\nIF(", "$INTEGER\nA=", "$KEY\nA=\"", "$END\n#"]
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
        "$INPUT",
        "$OUTPUT",
        "$INTEGER",
        "$TIMER",
        "$KEY",
        "$END",
        "$INCLUDE",
        "IF",
        "ELSE",
        "ENDIF",
        "GOTO",
        "A",
        "B1",
        "@FRO",
        "@NVINT",
        "T",
        "=",
        "/",
        "/=",
        "(",
        ")",
        "[",
        "]",
        "-",
        "+",
        "*",
        "%",
        "&",
        "!",
        ",",
        ":",
        "#",
        "?",
        "\"",
        "\n",
        "\n",
        "\r",
        " ",
        "0",
        "7",
        "99999",
        "\u{201c}",
        "\u{2212}",
        "\u{feff}",
        "é",
        "a",
        "2/0-7/BCD",
    ];
    let mut rng = Rng::new(1);
    for round in 0..400 {
        let mut text = String::from(if round % 2 == 0 { "$END\n" } else { "" });
        for _ in 0..400 {
            text.push_str(words[rng.below(words.len())]);
        }
        errors(text.as_bytes(), if round % 3 == 0 { Limits::None } else { Limits::Original });
    }
}

/// Each suggestion of a name compares with all names, so their number is limited. Without the limit
/// many errors among many names would take very long.
#[test]
fn many_misspelt_names_are_all_reported_and_the_first_with_suggestions() {
    let mut text = "$END\n".to_owned();
    for i in 0..20_000 {
        text.push_str(&format!("R{i} = RR{}\n", i % 10));
    }
    let all = check(text.as_bytes(), Limits::Original);
    let suggests =
        |diagnostic: &&Diagnostic| diagnostic.help.iter().any(|help| help.contains("did you mean"));
    assert_eq!(all.len(), 20_000);
    let suggestions = all.iter().filter(suggests).count();
    assert!((1..100).contains(&suggestions), "{suggestions}");
}

#[test]
fn length_is_never_limited() {
    let terms = format!("$END\nA=T\nX=A{}\n", "+A*/A".repeat(50_000));
    assert_eq!(errors(terms.as_bytes(), Limits::Original), 0);
    let lines = format!("$END\nA=T\nX=A{}\n", "&A#\n".repeat(50_000));
    assert_eq!(errors(lines.as_bytes(), Limits::Original), 0);
    let name = "A".repeat(300_000);
    assert_eq!(errors(format!("$END\n{name}=T\nX={name}\n").as_bytes(), Limits::None), 0);
    let ladder = format!("$END\nA=T\nIF(A)\n{}ENDIF\n", "ELSEIF(A)\nA=A\n".repeat(20_000));
    assert_eq!(errors(ladder.as_bytes(), Limits::Original), 0);
}
