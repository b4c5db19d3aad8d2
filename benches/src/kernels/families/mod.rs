//! Generates the kernels: the same families of programs in each language that can express them.

mod chains;
mod codes;
mod draft;
mod machines;
mod mixed;
mod motors;
mod numbers;
mod relays;
mod toggles;
mod values;

use super::{BitStyle, Expr, Kernel, Language, WordType};
use machines::Style;
use numbers::{arithmetic, arrays, float, timers};
use relays::{ladder, touch};

/// The number of input bits of the kernels that have bits.
const INPUTS: usize = 192;

/// All kernels, the same for the same seed. `percent` is their size; the figures in docs/dev/performance.md
/// are for 100.
pub fn all(seed: u64, percent: usize) -> Vec<Kernel> {
    use Language as L;
    let mut all = vec![];
    let size = |full: usize| (full * percent / 100).max(4);
    let languages = [L::Pmi, L::Nct, L::PmacMixed, L::Pmac, L::Plcc];
    for language in languages {
        // A PMAC has 1024 M-variables.
        let relays = if language.is_pmac() { 800 } else { 2000 };
        all.push(ladder(language, BitStyle::Conditions, size(relays), seed));
    }
    for (language, relays) in [(L::Nct, 2000), (L::Plcc, 800)] {
        all.push(ladder(language, BitStyle::Operators, size(relays), seed + 1));
    }
    for language in [L::Pmi, L::Nct, L::Pmac, L::Plcc] {
        all.push(arithmetic(language, size(100), seed + 2));
        all.push(machines::states(language, size(10), seed + 3));
        all.push(touch(language, size(24), seed + 4));
    }
    for language in [L::Pmi, L::Nct] {
        all.push(timers(language, size(200), seed + 5));
    }
    for language in [L::Pmi, L::Pmac] {
        all.push(arrays(language, size(200), seed + 6));
    }
    all.push(float(size(200), seed + 7));
    for language in [L::Pmi, L::Nct, L::Pmac, L::Plcc] {
        all.extend(habits(language, percent, seed + 8));
    }
    let order =
        |kernel: &Kernel| languages.iter().position(|&l| l.group() == kernel.language.group());
    all.sort_by_key(order);
    all
}

/// Programs of the kinds and in the styles that machine builders write, in which no regard is had to what the compiler
/// is good at.
fn habits(language: Language, percent: usize, seed: u64) -> Vec<Kernel> {
    let size = |full: usize| (full * percent / 100).max(4);
    let (nested, flat) = ([Style::Nested, Style::Chain], [Style::Flat, Style::ContactFirst]);
    // In a PMAC many flags are P-variables.
    let with_p = if language == Language::Pmac { Language::PmacMixed } else { language };
    let mut all = vec![
        machines::machines("nested machines", language, nested, size(12), seed),
        machines::machines("flat machines", language, flat, size(12), seed + 1),
        machines::long_machines(language, size(50), seed + 2),
        chains::chains(language, size(12), seed + 3),
        codes::codes(language, size(10), seed + 4),
        motors::motors(with_p, size(24), seed + 5),
        toggles::toggles(language, size(24), seed + 6),
        values::filters(language, size(24), seed + 7),
        mixed::mixed(with_p, size(48), seed + 8),
    ];
    match language {
        Language::Pmi => all.push(values::recipes(language, size(12), seed + 9)),
        Language::Pmac => {
            all.push(values::recipes(language, size(12), seed + 9));
            all.push(values::curves(language, size(12), seed + 10));
        }
        _ => {}
    }
    all
}

/// Relay logic alone, with a number of equations.
pub fn relay_logic(language: Language, equations: usize, seed: u64) -> Kernel {
    ladder(language, BitStyle::Conditions, equations, seed)
}

/// What words hold in a language.
fn word_type(language: Language) -> WordType {
    match language {
        Language::Pmi => WordType::Signed16,
        Language::Nct => WordType::Unsigned16,
        Language::PmacMixed | Language::Pmac => WordType::SmallInteger,
        Language::Plcc => WordType::Signed24,
    }
}

fn empty(name: &'static str, language: Language) -> Kernel {
    Kernel {
        name,
        language,
        style: BitStyle::Conditions,
        word_type: word_type(language),
        inputs: INPUTS,
        bits: INPUTS,
        input_words: 0,
        words: 0,
        elements: 0,
        start: vec![],
        real_elements: false,
        reals: 0,
        stmts: vec![],
    }
}

fn number(value: usize) -> Expr {
    Expr::Number(value as f64)
}

#[cfg(test)]
mod tests {
    use plcc_codegen::Optimization;

    use crate::kernels::Language;
    use crate::kernels::subject::Subject;

    #[test]
    fn the_same_seed_gives_the_same_programs() {
        let texts = |seed| super::all(seed, 5).iter().map(|k| k.source()).collect::<Vec<_>>();
        assert_eq!(texts(7), texts(7));
        assert_ne!(texts(7), texts(8));
    }

    #[test]
    fn programs_of_full_size_compile() {
        for language in [Language::Pmi, Language::Nct, Language::Pmac, Language::Plcc] {
            for kernel in super::habits(language, 100, 77) {
                let name = format!("{} {}", kernel.language.group(), kernel.name);
                let subject = Subject::new(&kernel, 77, Optimization::NONE);
                assert!(subject.is_ok(), "{name}: {:?}", subject.err());
            }
        }
    }
}
