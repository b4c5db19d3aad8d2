//! A second generator of random programs for each language. It was written from the manuals and from
//! the forms of real programs alone, without looking at the generators `gen_…` or at the compiler, so that it
//! writes what they do not: it takes a few idioms of the field (a shift register, a decoder, an
//! edge, a moved definition, …) and lets them meet on the same few variables.
//!
//! A program is one of three kinds, chosen by its seed: a few statements, several dozen to a few
//! hundred, or rows of statements that differ in their numbers only.

/// Writes a formatted line. The text is made first, since making it may draw random numbers.
macro_rules! line {
    ($writer:expr, $($text:tt)*) => {{
        let text = format!($($text)*);
        $writer.line(text);
    }};
}

pub mod nct;
pub mod pmac;
pub mod pmi;

use std::fmt;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use plcc_random::Rng;

use crate::gen_pmi::Case;
use crate::shrink;

/// Why a program does not pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// It has errors, which are the generator's.
    Invalid(String),
    /// The compiler can't make its code.
    Refused(String),
    /// An engine does something else than the statement interpreter.
    Differs(String),
    /// The compiler or an engine panics.
    Panics,
}

impl Failure {
    /// The compiler can't make its code, and says why.
    pub fn refused(why: impl fmt::Display) -> Self {
        Self::Refused(why.to_string())
    }

    /// Whether both fail in the same way, so that a program stays an example of its failure while it is
    /// reduced.
    fn is_like(&self, other: &Self) -> bool {
        let rule = |why: &str| why.split(';').next().map(str::to_owned);
        match (self, other) {
            (Self::Refused(why), Self::Refused(other)) => rule(why) == rule(other),
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Invalid(why) => write!(f, "the generator wrote a program with errors: {why}"),
            Self::Refused(why) => write!(f, "the program can't be compiled: {why}"),
            Self::Differs(why) => write!(f, "{why}"),
            Self::Panics => write!(f, "the compiler or an engine panics"),
        }
    }
}

/// The first seed of continuous integration. `scripts/next-seeds` moves it on.
const FIRST_SEED: &str = include_str!("../random/first_seed");

/// The seeds that a test runs: 500 from the number in `tests/random/first_seed` on, unless the
/// environment variables `PLCC_SEEDS` and `PLCC_FIRST` say otherwise.
///
/// # Panics
/// If the file or a variable has no number.
pub fn seeds() -> Range<u64> {
    let number = |text: &str| text.trim().parse::<u64>();
    let variable = |name| std::env::var(name).ok().map(|text| number(&text));
    let first = variable("PLCC_FIRST").unwrap_or_else(|| number(FIRST_SEED));
    let count = variable("PLCC_SEEDS").unwrap_or(Ok(500));
    assert!(first.is_ok() && count.is_ok(), "PLCC_FIRST, PLCC_SEEDS and first_seed are numbers");
    let first = first.unwrap_or_default();
    first..first + count.unwrap_or_default()
}

/// Runs programs, as many at a time as there are processors. `generate` makes the program of a seed, `run`
/// runs it in all engines.
///
/// # Panics
/// If a program fails. The message has the first ones that do, reduced to the lines and words that matter, and the
/// seeds of all.
pub fn all_pass(
    seeds: Range<u64>,
    generate: impl Fn(u64) -> Case + Sync,
    run: impl Fn(u64, &Case) -> Result<(), Failure> + Sync,
) {
    let tried = |seed, case: &Case| {
        catch_unwind(AssertUnwindSafe(|| run(seed, case))).unwrap_or(Err(Failure::Panics))
    };
    let next = AtomicU64::new(seeds.start);
    let failed: Mutex<Vec<(u64, String)>> = Mutex::default();
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return;
            }
            let case = generate(seed);
            if let Err(failure) = tried(seed, &case) {
                // A long run shows what it finds when it finds it.
                eprintln!("== seed {seed} is reduced: {failure}");
                let known = failed.lock().map_or(0, |failed| failed.len());
                let text = if known < SHOWN {
                    reduced(&case, &failure, |case| tried(seed, case))
                } else {
                    failure.to_string()
                };
                eprintln!("== seed {seed}: {text}");
                if let Ok(mut failed) = failed.lock() {
                    failed.push((seed, text));
                }
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    let failed = failed.into_inner().unwrap_or_default();
    let shown: Vec<String> =
        failed.iter().map(|(seed, text)| format!("== seed {seed}: {text}")).collect();
    assert!(failed.is_empty(), "{} programs fail\n{}", failed.len(), shown.join("\n"));
}

/// How many programs that fail are reduced and shown.
const SHOWN: usize = 8;

/// A program that fails, reduced to what matters.
fn reduced(case: &Case, failure: &Failure, run: impl Fn(&Case) -> Result<(), Failure>) -> String {
    let fails = |case: &Case| run(case).is_err_and(|other| other.is_like(failure));
    if matches!(failure, Failure::Invalid(_)) {
        return failure.to_string();
    }
    let with_source = |source: &str| Case { source: source.to_owned(), ..case.clone() };
    let source = shrink::lines(&case.source, |source| fails(&with_source(source)));
    let with_stimulus = |rows: &str| Case { stimulus: rows.to_owned(), ..with_source(&source) };
    let stimulus = shrink::lines(&case.stimulus, |rows| {
        rows.starts_with("tick") && fails(&with_stimulus(rows))
    });
    let case = Case { stimulus, ..case.clone() };
    let with_source = |source: &str| Case { source: source.to_owned(), ..case.clone() };
    let source = shrink::words(&source, |source| fails(&with_source(source)));
    let case = with_source(&source);
    let last = run(&case).err().unwrap_or_else(|| failure.clone());
    let Case { source, stimulus, .. } = case;
    format!("{last}\n--- program\n{source}--- stimulus\n{stimulus}")
}

/// How long a program is, and of what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Two or three idioms on few variables.
    Few,
    /// All idioms, 50 to 300 statements.
    Many,
    /// 20 to 60 statements of the same form.
    Rows,
}

impl Kind {
    fn of(rng: &mut Rng) -> Self {
        match rng.below(50) {
            0 => Self::Many,
            1..=5 => Self::Rows,
            _ => Self::Few,
        }
    }
}

/// How many lines a part of a program has when no more statements are nested: some idioms hold idioms that hold idioms.
pub(crate) const LONG: usize = 350;

/// The text with other numbers, as in the next row of a ladder. `number` gives the new number for each number of a
/// variable with its letter, and for each constant with a blank.
pub(crate) fn renumbered(text: &str, number: impl Fn(char, usize) -> usize) -> String {
    let mut result = String::new();
    let mut rest = text;
    // What a number belongs to: nothing, the letter of a variable, or a longer word.
    let mut before = Some(' ');
    while let Some(letter) = rest.chars().next() {
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        // A name may begin with digits.
        let is_name = rest[digits..].starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        let old = rest.get(..digits).filter(|_| !is_name).and_then(|text| text.parse().ok());
        if let (Some(before), Some(old)) = (before, old) {
            // Zeros at the front stay.
            let width = if rest.starts_with('0') { digits } else { 1 };
            result.push_str(&format!("{:0width$}", number(before, old)));
            rest = rest.get(digits..).unwrap_or_default();
        } else {
            result.push(letter);
            rest = rest.get(letter.len_utf8()..).unwrap_or_default();
        }
        let mut last = result.chars().rev();
        let is_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$');
        before = match (last.next(), last.next()) {
            (Some(letter), Some(other)) if is_word(letter) => {
                (letter.is_ascii_alphabetic() && !is_word(other)).then_some(letter)
            }
            (Some(letter), None) if is_word(letter) => {
                letter.is_ascii_alphabetic().then_some(letter)
            }
            _ => Some(' '),
        };
    }
    result
}

#[cfg(test)]
mod tests {
    use super::renumbered;

    #[test]
    fn numbers_of_variables_and_constants_are_told_apart() {
        let row = "IF (M10=1 AND P(P20+5)!=SIN(M9)) I040=P1 AAM5=$F0 P2=.5+1.5";
        let changed =
            renumbered(row, |letter, old| if "PM".contains(letter) { old + 2 } else { old });
        assert_eq!(changed, "IF (M12=1 AND P(P22+5)!=SIN(M11)) I040=P3 AAM5=$F0 P4=.5+1.5");
        let changed = renumbered(row, |letter, old| if letter == ' ' { old + 2 } else { old });
        assert_eq!(changed, "IF (M10=3 AND P(P20+7)!=SIN(M9)) I040=P1 AAM5=$F0 P2=.5+3.5");
    }
}
