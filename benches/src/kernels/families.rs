//! Generates the kernels: the same families of programs in each language that can express them.

use plcc_random::Rng;

use super::{BitStyle, Expr, Kernel, Language, Op, Stmt, WordType};

/// The number of input bits of the kernels that have bits.
const INPUTS: usize = 192;

/// All kernels, the same for the same seed. `percent` is their size; the figures in docs/performance.md
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
        all.push(states(language, size(10), seed + 3));
        all.push(touch(language, size(24), seed + 4));
    }
    for language in [L::Pmi, L::Nct] {
        all.push(timers(language, size(200), seed + 5));
    }
    for language in [L::Pmi, L::Pmac] {
        all.push(arrays(language, size(200), seed + 6));
    }
    all.push(float(size(200), seed + 7));
    let order =
        |kernel: &Kernel| languages.iter().position(|&l| l.group() == kernel.language.group());
    all.sort_by_key(order);
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
        stmts: vec![],
    }
}

fn number(value: usize) -> Expr {
    Expr::Number(value as f64)
}

/// Relay logic: equations of two to nine contacts. Most are relays of equations shortly before,
/// some are inputs, and some are relays of later equations, whose values are from the scan before.
fn ladder(language: Language, style: BitStyle, count: usize, seed: u64) -> Kernel {
    let name = match (style, language) {
        (BitStyle::Operators, _) => "operators",
        (_, Language::PmacMixed) => "ladder in M and P",
        _ => "ladder",
    };
    let mut rng = Rng::new(seed);
    let mut kernel = Kernel { style, bits: INPUTS + count, ..empty(name, language) };
    for index in 0..count {
        let groups = 1 + rng.below(3);
        let mut parts: Vec<Expr> = vec![];
        for _ in 0..groups {
            let contacts = if groups == 1 { 2 + rng.below(2) } else { 1 + rng.below(3) };
            let contact = |rng: &mut Rng| {
                let bit = match rng.below(10) {
                    0..3 => rng.below(INPUTS),
                    3..8 => INPUTS + (index + count - 1 - rng.below(40.min(count))) % count,
                    _ => INPUTS + rng.below(count),
                };
                if rng.below(3) == 0 { Expr::NotBit(bit) } else { Expr::Bit(bit) }
            };
            let mut group: Vec<Expr> = (0..contacts).map(|_| contact(&mut rng)).collect();
            match (group.len(), groups) {
                (1, _) => parts.extend(group.pop()),
                (_, 1) => parts.append(&mut group),
                _ => parts.push(Expr::Any(group)),
            }
        }
        let value = match parts.len() {
            1 => parts.remove(0),
            _ => Expr::All(parts),
        };
        kernel.stmts.push(Stmt::SetBit(INPUTS + index, value));
    }
    kernel
}

/// Sums, products, remainders and comparisons of words, some of which are inputs.
fn arithmetic(language: Language, count: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let name = if language == Language::Pmac { "integers in P" } else { "arith16" };
    let (input_words, words) = (8, 40);
    let mut kernel = Kernel { inputs: 0, bits: 0, input_words, words, ..empty(name, language) };
    for _ in 0..count {
        let mut any = || Expr::Word(rng.below(words));
        let (a, b, c) = (any(), any(), any());
        let to = input_words + rng.below(words - input_words);
        let (factor, bound) = (2 + rng.below(7), 100 + rng.below(900));
        let sum = Expr::op(Op::Add, Expr::op(Op::Mul, a, number(factor)), b);
        let stmt = match rng.below(4) {
            0 | 1 if language == Language::Nct => {
                Stmt::SetWord(to, Expr::op(Op::Mask, sum, number(0x3FF)))
            }
            0 if language.is_pmac() => Stmt::SetWord(to, Expr::op(Op::Mask, sum, number(0x3FF))),
            0 | 1 => Stmt::SetWord(to, Expr::op(Op::Rem, sum, number(bound))),
            2 => {
                let above = Expr::op(Op::Gt, c, number(bound));
                let more = Expr::op(Op::Add, Expr::Word(to), number(factor));
                Stmt::If(above, vec![Stmt::SetWord(to, number(0))], vec![Stmt::SetWord(to, more)])
            }
            _ => {
                let more = Expr::op(Op::Add, Expr::Word(to), number(1));
                let full = Expr::op(Op::Gt, Expr::Word(to), number(999));
                kernel.stmts.push(Stmt::SetWord(to, more));
                Stmt::If(full, vec![Stmt::SetWord(to, number(0))], vec![])
            }
        };
        kernel.stmts.push(stmt);
    }
    kernel
}

/// Machines of 20 states; the states of one are numbers in a word. Half of them are written as
/// separate conditions, which may pass through several states in one scan, half as one chain.
fn states(language: Language, machines: usize, seed: u64) -> Kernel {
    const STATES: usize = 20;
    let mut rng = Rng::new(seed);
    let mut kernel =
        Kernel { words: machines, bits: INPUTS + machines * 4, ..empty("states", language) };
    for machine in 0..machines {
        let mut chain = vec![];
        for state in (0..STATES).rev() {
            let is_here = Expr::op(Op::Eq, Expr::Word(machine), number(state));
            let go_on = if rng.chance(50) {
                Expr::Bit(rng.below(INPUTS))
            } else {
                Expr::All(vec![Expr::Bit(rng.below(INPUTS)), Expr::NotBit(rng.below(INPUTS))])
            };
            let next =
                number(if rng.chance(80) { (state + 1) % STATES } else { rng.below(STATES) });
            let output = INPUTS + machine * 4 + state % 4;
            let lamp = Expr::All(vec![Expr::Bit(rng.below(INPUTS)), Expr::Bit(rng.below(INPUTS))]);
            let work = vec![
                Stmt::SetBit(output, lamp),
                Stmt::If(go_on, vec![Stmt::SetWord(machine, next)], vec![]),
            ];
            if machine % 2 == 0 {
                chain.push(Stmt::If(is_here, work, vec![]));
            } else {
                chain = vec![Stmt::If(is_here, work, chain)];
            }
        }
        kernel.stmts.extend(chain);
    }
    kernel
}

/// A touch panel: keys with one-shots that toggle lights, lamps that blink, and the number of the
/// text to show.
fn touch(language: Language, keys: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let mut kernel = Kernel { bits: INPUTS + 4 * keys, words: 1, ..empty("touch", language) };
    let part = |part: usize, key: usize| INPUTS + part * keys + key;
    for key in 0..keys {
        let (edge, last, light, lamp) = (part(0, key), part(1, key), part(2, key), part(3, key));
        let pressed = rng.below(INPUTS);
        let once = Expr::All(vec![Expr::Bit(pressed), Expr::NotBit(last)]);
        kernel.stmts.push(Stmt::SetBit(edge, once));
        kernel.stmts.push(Stmt::SetBit(last, Expr::Bit(pressed)));
        let toggled = Expr::Any(vec![
            Expr::All(vec![Expr::Bit(edge), Expr::NotBit(light)]),
            Expr::All(vec![Expr::NotBit(edge), Expr::Bit(light)]),
        ]);
        kernel.stmts.push(Stmt::SetBit(light, toggled));
        let blink = Expr::Any(vec![Expr::Bit(edge), Expr::Bit(rng.below(INPUTS))]);
        kernel.stmts.push(Stmt::SetBit(lamp, Expr::All(vec![Expr::Bit(light), blink])));
        let text = vec![Stmt::SetWord(0, number(100 + key))];
        kernel.stmts.push(Stmt::If(Expr::Bit(edge), text, vec![]));
    }
    kernel
}

/// Counters that run while a contact is closed, and contacts that close when they are full.
fn timers(language: Language, count: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let mut kernel = Kernel { bits: INPUTS + count, words: count, ..empty("timers", language) };
    for timer in 0..count {
        let (word, full) = (Expr::Word(timer), number(5 + rng.below(50)));
        let runs = Expr::Bit(rng.below(INPUTS));
        let more = Stmt::SetWord(timer, Expr::op(Op::Add, word.clone(), number(1)));
        let below = Expr::op(Op::Lt, word.clone(), full.clone());
        let clear = Stmt::SetWord(timer, number(0));
        kernel.stmts.push(Stmt::If(runs, vec![Stmt::If(below, vec![more], vec![])], vec![clear]));
        let output = INPUTS + timer;
        kernel.stmts.push(match language {
            Language::Pmi => Stmt::SetBit(output, Expr::op(Op::Eq, word, full)),
            _ => {
                // Kernels have no constant bits, so that the contact gets the value of an input.
                let on = Stmt::SetBit(output, Expr::Bit(0));
                let off = Stmt::SetBit(output, Expr::Bit(1));
                Stmt::If(Expr::op(Op::Eq, word, full), vec![on], vec![off])
            }
        });
    }
    kernel
}

/// Elements of an array at computed indices.
fn arrays(language: Language, count: usize, seed: u64) -> Kernel {
    const ELEMENTS: usize = 64;
    let mut rng = Rng::new(seed);
    let (input_words, words) = (8, 24);
    let mut kernel = Kernel {
        inputs: 0,
        bits: 0,
        input_words,
        words,
        elements: ELEMENTS,
        ..empty("arrays", language)
    };
    for _ in 0..count {
        let mut index = || {
            let (word, step) = (rng.below(words), rng.below(50));
            let moved = Expr::op(Op::Add, Expr::Word(word), number(step));
            let length = if rng.chance(50) { ELEMENTS } else { ELEMENTS - 1 - rng.below(20) };
            Expr::op(Op::Rem, moved, number(length))
        };
        let (from, to) = (index(), index());
        let word = input_words + rng.below(words - input_words);
        let element = Expr::Element(Box::new(from));
        kernel.stmts.push(match rng.below(3) {
            0 => {
                let sum = Expr::op(Op::Add, element, Expr::Word(word));
                Stmt::SetElement(to, Expr::op(Op::Rem, sum, number(1000)))
            }
            1 => {
                let sum = Expr::op(Op::Add, element, Expr::Word(rng.below(input_words)));
                Stmt::SetWord(word, Expr::op(Op::Rem, sum, number(1000)))
            }
            _ => Stmt::SetElement(to, element),
        });
    }
    kernel
}

/// Products and sums of doubles that stay small.
fn float(count: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let (input_words, words) = (8, 64);
    let mut kernel = Kernel {
        inputs: 0,
        bits: 0,
        input_words,
        words,
        word_type: WordType::Double,
        ..empty("floating point", Language::Pmac)
    };
    for _ in 0..count {
        let mut any = || Expr::Word(rng.below(words));
        let (a, b, c, d) = (any(), any(), any(), any());
        let to = input_words + rng.below(words - input_words);
        let part = |word, factor| Expr::op(Op::Mul, word, Expr::Number(factor));
        kernel.stmts.push(match rng.below(3) {
            0 => {
                let sum = Expr::op(Op::Add, part(a, 0.25), part(b, 0.25));
                Stmt::SetWord(to, Expr::op(Op::Sub, sum, part(c, 0.375)))
            }
            1 => {
                let product = Expr::op(Op::Mul, Expr::op(Op::Mul, a, b), Expr::Number(0.002));
                let product = Expr::op(Op::Sub, part(c, 0.5), part(product, 0.125));
                let small = Expr::op(Op::Lt, d.clone(), Expr::Number(50.0));
                Stmt::If(
                    small,
                    vec![Stmt::SetWord(to, product)],
                    vec![Stmt::SetWord(to, part(d, 0.5))],
                )
            }
            _ => {
                let above = Expr::op(Op::Gt, a, b);
                let half = Stmt::SetWord(to, part(c, 0.5));
                let other = Expr::op(Op::Add, part(Expr::Word(to), 0.5), part(d, 0.375));
                Stmt::If(above, vec![half], vec![Stmt::SetWord(to, other)])
            }
        });
    }
    kernel
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_same_seed_gives_the_same_programs() {
        let texts = |seed| super::all(seed, 5).iter().map(|k| k.source()).collect::<Vec<_>>();
        assert_eq!(texts(7), texts(7));
        assert_ne!(texts(7), texts(8));
    }
}
