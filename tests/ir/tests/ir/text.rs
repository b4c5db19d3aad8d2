//! IR as text: a module that was printed reads back unchanged, and no text makes the reader panic.
#![allow(clippy::unwrap_used)]

use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{self, OptLevel};
use plcc_ir::text::{parse, print};
use plcc_ir::verify::verify;
use plcc_ir_tests::gen_ir::{generate, trace};
use plcc_random::Rng;

#[test]
fn printed_modules_read_back_unchanged() {
    for seed in 0..150 {
        let mut module = generate(seed);
        for _ in 0..2 {
            let text = print(&module);
            let read = parse(&text).unwrap_or_else(|error| panic!("seed {seed}: {error}\n{text}"));
            assert_eq!(print(&read), text, "seed {seed}");
            assert_eq!(verify(&read), [], "seed {seed}");
            assert_eq!(read.statements, module.statements);
            assert_eq!(read.files, module.files);
            let ran = |module| trace(&mut Interpreter::new(module), seed);
            assert_eq!(ran(read), ran(module.clone()), "seed {seed}");
            passes::optimize(&mut module, OptLevel::Speed);
        }
    }
}

#[test]
fn mangled_text_is_read_or_refused() {
    let bits = ["v0", "block1", "L0", "}", "{", "(", ")", "\"", ";", "|", "@", "-1", "\n", "bits"];
    let mut rng = Rng::new(5);
    let (mut read, mut refused) = (0, 0);
    for seed in 0..60 {
        // All of the text with a few mistakes: with many, or if its end is missing, it is always refused.
        let whole: Vec<char> = print(&generate(seed)).chars().collect();
        for _ in 0..20 {
            let mut text = whole.clone();
            for _ in 0..1 + rng.below(4) {
                let at = rng.below(text.len());
                match rng.below(4) {
                    0 => drop(text.splice(at..at, rng.pick(&bits).chars())),
                    1 => drop(text.remove(at)),
                    2 => text[at] = char::from(rng.below(128) as u8),
                    _ => {
                        let with = rng.below(text.len());
                        text.swap(at, with);
                    }
                }
            }
            let mangled: String = text.iter().collect();
            match parse(&mangled) {
                Ok(module) => {
                    verify(&module);
                    print(&module);
                    read += 1;
                }
                Err(error) => {
                    let lines = mangled.lines().count() + 1;
                    assert!((1..=lines).contains(&error.line), "{error} of {lines}");
                    refused += 1;
                }
            }
        }
    }
    assert!(read > 20 && refused > 500, "{read} are read, {refused} refused");
}
