//! The grammar of a line: comments, `/`, words.

use chumsky::prelude::*;
use plcc_abi::machine::simulator::Decimal;

/// What a line consists of, each with the range of its bytes in the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Item {
    /// A letter and its number.
    Word {
        /// The letter in capitals.
        letter: char,
        /// The number; `None` where it has more digits than a number may have.
        number: Option<Decimal>,
    },
    /// `/`, with the number behind it.
    Skip(Option<u32>),
    /// Something with which no word begins.
    Bad,
}

/// An item with its first byte and the one after its first character.
pub(super) type Placed = (Item, usize, usize);

/// The most digits before the point, and behind it.
const MAX_WHOLE: usize = 9;
const MAX_FRACTION: usize = 6;

fn number(text: &str) -> Option<Decimal> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let whole = whole.trim_start_matches(['+', '-']);
    let fits = whole.len() <= MAX_WHOLE && fraction.len() <= MAX_FRACTION;
    Decimal::parse(text).filter(|_| fits)
}

/// The grammar of one line. It takes every text: where no word begins, there is an [`Item::Bad`].
fn line<'s>() -> impl Parser<'s, &'s str, Vec<Placed>> {
    // Blanks do not matter anywhere (cnc-side 1.17).
    let blank = any().filter(|c: &char| c.is_whitespace()).ignored();
    let comment = just('(')
        .then(any().filter(|c| *c != ')').repeated())
        .then(just(')'))
        .ignored()
        .or(just(';').then(any().repeated()).ignored());
    let gap = blank.repeated();
    let digits = any()
        .filter(char::is_ascii_digit)
        .then_ignore(gap)
        .repeated()
        .at_least(1)
        .collect::<String>();
    let point = just('.').then_ignore(gap);
    let whole =
        digits.then(point.ignore_then(digits.or_not()).or_not()).map(|(whole, fraction)| {
            let fraction: Option<Option<String>> = fraction;
            match fraction {
                None => whole,
                Some(fraction) => format!("{whole}.{}", fraction.unwrap_or_default()),
            }
        });
    let fraction = point.ignore_then(digits).map(|fraction| format!(".{fraction}"));
    let sign = one_of("+-").then_ignore(gap).or_not();
    let signed = sign.then(whole.or(fraction)).map(|(sign, digits)| {
        let sign = sign.map_or(String::new(), String::from);
        number(&format!("{sign}{digits}"))
    });
    let word = any()
        .filter(char::is_ascii_alphabetic)
        .then_ignore(gap)
        .then(signed)
        .map(|(letter, number)| Item::Word { letter: letter.to_ascii_uppercase(), number });
    let skip = just('/')
        .then_ignore(gap)
        .ignore_then(digits.or_not())
        .map(|digits| Item::Skip(digits.map(|digits: String| digits.parse().unwrap_or(u32::MAX))));
    let placed = |item: Item, span: SimpleSpan| (item, span.start, span.end);
    let item = word.or(skip).map_with(move |item, e| Some(placed(item, e.span())));
    let nothing = comment.or(blank).to(None);
    let known = nothing.or(item).repeated().collect::<Vec<Option<Placed>>>();
    // Behind the first place where no word begins nothing is read, so that no text takes long.
    let bad = any().map_with(move |_, e| placed(Item::Bad, e.span()));
    let rest = bad.then_ignore(any().repeated()).or_not();
    known.then(rest).map(|(known, bad)| known.into_iter().flatten().chain(bad).collect())
}

/// Reads a line. The items stand in the line's order; behind an [`Item::Bad`] there is nothing more.
pub(super) fn items(text: &str) -> Vec<Placed> {
    let mut items = line().parse(text).into_output().unwrap_or_default();
    for (_, start, end) in &mut items {
        let first = text.get(*start..).and_then(|rest| rest.chars().next());
        *end = *start + first.map_or(1, char::len_utf8);
    }
    items
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        let shown = |(item, start, _)| match item {
            Item::Word { letter, number } => {
                let number = number.and_then(|number| number.times(1000));
                format!("{letter}{}", number.map_or("?".into(), |number| number.to_string()))
            }
            Item::Skip(number) => format!("/{number:?}"),
            Item::Bad => format!("bad {start}"),
        };
        items(text).into_iter().map(shown).collect()
    }

    #[test]
    fn words_are_read_whatever_their_blanks_and_case() {
        assert_eq!(
            words("n10 g 1 X - 1.5 y.25 F100."),
            ["N10000", "G1000", "X-1500", "Y250", "F100000"]
        );
        assert_eq!(words("/2 M3 (a ; b) S+5 ; rest ("), ["/Some(2)", "M3000", "S5000"]);
        assert_eq!(words("/M3"), ["/None", "M3000"]);
        assert_eq!(words("X1234567890 Y1.1234567"), ["X?", "Y?"]);
        assert_eq!(words("  (only a comment) "), [""; 0]);
    }

    #[test]
    fn where_no_word_begins_the_line_ends() {
        assert_eq!(words("G1 X"), ["G1000", "bad 3"]);
        assert_eq!(words("G1 X1.2.3 Y1"), ["G1000", "X1200", "bad 7"]);
        assert_eq!(words("G1 (open"), ["G1000", "bad 3"]);
        assert_eq!(words("é"), ["bad 0"]);
        assert_eq!(words("X--1"), ["bad 0"]);
    }
}
