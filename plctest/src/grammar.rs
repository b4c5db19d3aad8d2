//! The grammar of a line, in chumsky.
//!
//! Conditions and values are the program's language, so that here they are pieces of text up to the next word of a
//! script's own. No rule is recursive, and each character is looked at a bounded number of times.

use std::ops::Range;

use chumsky::prelude::*;

use crate::script::Length;

/// A piece of a line: its range of bytes.
pub(crate) type Part = Range<usize>;

/// A line, with ranges of bytes in the place of texts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Line {
    Program(Part),
    Machine(Part),
    Simulate,
    Never(Part),
    Always(Part),
    After(Part, (Length, Part)),
    Test(Part),
    End,
    Set(Part),
    Pulse(Part, Option<(Length, Part)>),
    Force(Part),
    Release(Part),
    Wait(Part, (Length, Part)),
    Expect(Part),
    Hold(Part, (Length, Part)),
    Run(Length, Part),
    PowerCycle,
}

/// The first words of lines.
pub const KEYWORDS: &[&str] = &[
    "program", "machine", "simulate", "never", "always", "after", "test", "end", "set", "pulse",
    "force", "release", "wait", "expect", "hold", "run", "power",
];

/// What a line has to look like that begins with a keyword.
pub fn form(keyword: &str) -> Option<&'static str> {
    Some(match keyword {
        "program" => "program \"turret.pmi\"",
        "machine" => "machine \"lathe.machine.toml\"",
        "simulate" => "simulate",
        "never" => "never CONDITION",
        "always" => "always CONDITION",
        "after" => "after CONDITION, CONDITION within 2 s",
        "test" => "test \"what it shows\"",
        "end" => "end",
        "set" => "set NAME = VALUE",
        "pulse" => "pulse NAME for 200 ms",
        "force" => "force NAME = VALUE",
        "release" => "release NAME",
        "wait" => "wait until CONDITION within 5 s",
        "expect" => "expect CONDITION, expect message \"TEXT\" or expect stop \"CODE\"",
        "hold" => "hold CONDITION for 1 s",
        "run" => "run 10 ticks or run 200 ms",
        "power" => "power cycle",
        _ => return None,
    })
}

type Extra<'t> = extra::Err<Rich<'t, char>>;

/// A parser of text that gives an `O`: a short name for the bounds that chumsky needs.
pub(crate) trait Grammar<'t, O>: Parser<'t, &'t str, O, Extra<'t>> + Clone {}
impl<'t, O, P: Parser<'t, &'t str, O, Extra<'t>> + Clone> Grammar<'t, O> for P {}

fn blank<'t>() -> impl Grammar<'t, ()> {
    one_of(" \t").repeated().at_least(1).labelled("a blank")
}

/// A word, which ends where no letter or digit follows.
fn word<'t>(word: &'static str) -> impl Grammar<'t, ()> {
    let more = any().filter(|c: &char| c.is_alphanumeric() || *c == '_');
    just(word).then(more.not()).ignored().labelled(format!("`{word}`"))
}

/// A text in quotes; its range is that of the text.
fn quoted<'t>() -> impl Grammar<'t, Part> {
    none_of('"')
        .repeated()
        .to_span()
        .map(|span: SimpleSpan| span.into_range())
        .delimited_by(just('"'), just('"'))
        .labelled("a text in quotes")
}

/// What stands before `stop`, without blanks at its end; it may not be empty.
fn text_until<'t, S>(stop: impl Grammar<'t, S>, what: &'static str) -> impl Grammar<'t, Part> {
    any()
        .and_is(stop.not())
        .repeated()
        .at_least(1)
        .to_span()
        .map(|span: SimpleSpan| span.into_range())
        .labelled(what)
}

/// A number and a unit.
fn length<'t>() -> impl Grammar<'t, (Length, Part)> {
    let digits = any().filter(char::is_ascii_digit).repeated().at_least(1);
    let number = digits.then(just('.').then(digits).or_not()).to_slice().labelled("a number");
    let unit = choice((
        word("ticks").to(None),
        word("tick").to(None),
        word("ms").to(Some(1_000_000)),
        word("s").to(Some(1_000_000_000)),
        word("min").to(Some(60_000_000_000)),
    ))
    .labelled("a unit: ticks, ms, s or min");
    number
        .then_ignore(blank().or_not())
        .then(unit)
        .try_map(|(number, unit): (&str, Option<u64>), span| {
            of(number, unit).map_err(|why| Rich::custom(span, why))
        })
        .map_with(|length, with| {
            let span: SimpleSpan = with.span();
            (length, span.into_range())
        })
}

/// The longest time, in ticks and in nanoseconds.
const MAX_TICKS: u64 = 1_000_000_000;
const MAX_NS: u64 = 1_000_000 * 1_000_000_000;

/// A number with a unit, in nanoseconds; without a unit, in ticks.
fn of(number: &str, unit: Option<u64>) -> Result<Length, String> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let Some(unit) = unit else {
        let ticks = number.parse().ok().filter(|ticks| *ticks <= MAX_TICKS);
        return match ticks {
            Some(ticks) => Ok(Length::Ticks(ticks)),
            None if fraction.is_empty() => Err(format!("{MAX_TICKS} ticks are the most")),
            None => Err("ticks are whole numbers".into()),
        };
    };
    let too_long = || "11 days are the longest time".to_owned();
    let whole: u64 = whole.parse().map_err(|_| too_long())?;
    let whole = whole.checked_mul(unit).filter(|ns| *ns <= MAX_NS).ok_or_else(too_long)?;
    // Digits beyond nanoseconds round up.
    let mut ns = 0;
    let mut scale = unit;
    for digit in fraction.bytes().map(|byte| u64::from(byte - b'0')) {
        ns += (digit * scale).div_ceil(10);
        scale = scale.div_ceil(10);
    }
    Ok(Length::Time(whole + ns))
}

/// A line, without its comment.
pub(crate) fn line<'t>() -> impl Grammar<'t, Line> {
    let rest = |what| text_until(empty().then(end()), what);
    let after = |keyword| word(keyword).then(blank());
    let within = blank().then(word("within")).labelled("`within`");
    let over = blank().then(word("for")).labelled("`for`");
    let file = choice((
        after("program").ignore_then(quoted()).map(Line::Program),
        after("machine").ignore_then(quoted()).map(Line::Machine),
        word("simulate").to(Line::Simulate),
        after("never").ignore_then(rest("a condition")).map(Line::Never),
        after("always").ignore_then(rest("a condition")).map(Line::Always),
        after("after")
            .ignore_then(text_until(within.clone(), "a condition"))
            .then_ignore(within.clone().then(blank()))
            .then(length())
            .map(|(conditions, length)| Line::After(conditions, length)),
        after("test").ignore_then(quoted()).map(Line::Test),
        word("end").to(Line::End),
    ));
    let acts = choice((
        after("set").ignore_then(rest("`NAME = VALUE`")).map(Line::Set),
        after("pulse")
            .ignore_then(text_until(over.clone(), "a name"))
            .then(over.clone().ignore_then(blank()).ignore_then(length()).or_not())
            .map(|(names, length)| Line::Pulse(names, length)),
        after("force").ignore_then(rest("`NAME = VALUE`")).map(Line::Force),
        after("release").ignore_then(rest("a name")).map(Line::Release),
        after("power").ignore_then(word("cycle")).to(Line::PowerCycle),
    ));
    let waits = choice((
        after("wait")
            .ignore_then(after("until"))
            .ignore_then(text_until(within.clone(), "a condition"))
            .then_ignore(within.then(blank()))
            .then(length())
            .map(|(condition, length)| Line::Wait(condition, length)),
        after("expect").ignore_then(rest("a condition, `message` or `stop`")).map(Line::Expect),
        after("hold")
            .ignore_then(text_until(over.clone(), "a condition"))
            .then_ignore(over.then(blank()))
            .then(length())
            .map(|(condition, length)| Line::Hold(condition, length)),
        after("run").ignore_then(length()).map(|(length, part)| Line::Run(length, part)),
    ));
    choice((file, acts, waits)).padded_by(one_of(" \t").repeated()).then_ignore(end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_nanoseconds_rounded_up() {
        for (text, expected) in [
            ("10 ticks", Length::Ticks(10)),
            ("1 tick", Length::Ticks(1)),
            ("200 ms", Length::Time(200_000_000)),
            ("1.5s", Length::Time(1_500_000_000)),
            ("2 min", Length::Time(120_000_000_000)),
            ("0.0000000001 s", Length::Time(1)),
        ] {
            let read = length().parse(text).into_output().map(|(length, _)| length);
            assert_eq!(read, Some(expected), "{text}");
        }
        for text in
            ["1.5 ticks", "99999999999 ticks", "99999999999999999999 s", "20000 min ", "5", "5 h"]
        {
            assert!(length().parse(text).has_errors(), "{text}");
        }
        assert_eq!(Length::Time(50_000_001).ticks(20_000_000), 3);
        assert_eq!(Length::Time(0).ticks(20_000_000), 0);
    }

    #[test]
    fn conditions_end_at_the_scripts_own_words() {
        let text = "wait until (P1=1) AND (P2=2)  within 5 s";
        let Some(Line::Wait(condition, _)) = line().parse(text).into_output() else {
            unreachable!("it is a wait");
        };
        assert_eq!(text.get(condition), Some("(P1=1) AND (P2=2)"));
        assert!(line().parse("wait until A within").has_errors());
        assert!(line().parse("runs 10 ticks").has_errors());
        assert_eq!(line().parse("  power  cycle ").into_output(), Some(Line::PowerCycle));
    }
}
