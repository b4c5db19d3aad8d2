//! What people who know other languages write: instruction lists, structured text, C, part programs.
//! [`explain`] gives errors messages and helps that say what was probably meant and how NCT writes it. The
//! numbers and places of errors stay the same.

use std::sync::LazyLock;

use plcc_diag::Diagnostic;

use crate::common::{
    EXPLAINED_ERRORS, Explanation, Habits, Surroundings, explanation, help,
    tell_small_letters_once, tsv,
};

/// The help for all that was meant as a comment.
const COMMENT: &str = "a comment begins with `;` and goes on to the end of the line";

/// The numbers of the errors that are about how a statement is written. The other errors are about texts,
/// numbers out of range, and missing parts of the program.
const OF_STATEMENTS: &[&str] = &[
    "2", "7", "9", "13", "14", "15", "17", "18", "19", "20", "23", "27", "30", "31", "33", "44",
    "45", "47", "48", "50", "51", "56", "57", "59", "62", "63", "71", "73", "75",
];

/// What they write in other words or signs.
static HABITS: LazyLock<Habits> = LazyLock::new(|| {
    let file = "frontend/src/nct/analyse/other_languages.tsv";
    tsv::built_in(Habits::load(file, include_str!("other_languages.tsv")))
});

/// Says of each error in `text` what was probably meant, if it looks like a habit from another
/// language. The errors are in the order of the text. What was meant as one thing, such as a comment or an
/// assignment, is read as several statements; it keeps its first error alone.
pub(crate) fn explain(text: &str, found: &mut Vec<Diagnostic>) {
    let mut left = EXPLAINED_ERRORS;
    // Where the comment, number or assignment ends that the last error was about.
    let (mut read_end, mut assignment_end) = (0, None);
    found.retain_mut(|diagnostic| {
        let range = diagnostic.span.range();
        if range.start < read_end {
            return false;
        }
        if !diagnostic.is_error() || left == 0 {
            return true;
        }
        left -= 1;
        let site = ErrorSite {
            around: Surroundings::new(text, range.start, range.end),
            code: diagnostic.code,
        };
        if !site.is(OF_STATEMENTS) {
            return true;
        }
        let (mut is_comment, mut is_assignment) = (false, false);
        let meaning = comment(&site)
            .inspect(|meaning| is_comment = meaning.message.is_some())
            .or_else(|| assignment(&site).inspect(|_| is_assignment = true))
            .or_else(|| word(&site))
            .or_else(|| switch_of_input(&site))
            .or_else(|| digits(&site))
            .or_else(|| symbol(&site))
            .or_else(|| constant(&site));
        if hexadecimal_operand(&site).is_some() {
            read_end = range.start + digits_after(text, range.start);
        }
        if is_comment {
            let rest = text.get(range.start..).unwrap_or("");
            read_end = range.start + rest.find(['\r', '\n']).unwrap_or(rest.len());
        }
        if is_assignment {
            let end = assignment_end.replace(range.end);
            let between = end.and_then(|end| text.get(end..range.start));
            if between.is_some_and(|between| between.bytes().all(|b| matches!(b, b' ' | b'\t'))) {
                return false;
            }
        }
        if let Some(explanation) = meaning {
            explanation.explain(diagnostic);
        }
        true
    });
    tell_small_letters(text, found);
}

/// How many hexadecimal digits stand at a place of a text.
fn digits_after(text: &str, at: usize) -> usize {
    text.get(at..).map_or(0, |rest| rest.bytes().take_while(u8::is_ascii_hexdigit).count())
}

/// The line around an error, and the error's code.
struct ErrorSite<'a> {
    around: Surroundings<'a>,
    code: &'static str,
}

impl ErrorSite<'_> {
    /// Whether the error has one of these numbers of the manual's list.
    fn is(&self, numbers: &[&str]) -> bool {
        self.code.strip_prefix("NCT-").is_some_and(|number| numbers.contains(&number))
    }

    /// The part at the error without blanks.
    fn written(&self) -> String {
        self.around.at.chars().filter(|c| !c.is_whitespace()).collect()
    }
}

/// Signs with which comments begin in other languages, at an error or in front of it on its line.
fn comment(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    for sign in ["//", "(*", "--"] {
        let after_sign = before.contains(sign) && site.is(&["44", "7", "13", "18", "19"]);
        let second = |text: &str| text.starts_with(sign.get(1..).unwrap_or(""));
        let first = |text: &str| text.ends_with(sign.get(..1).unwrap_or(""));
        if at.starts_with(sign) || after_sign || first(before) && second(at) {
            let names = "what follows it is read as statements";
            let message = if after_sign {
                format!("`{sign}` in front of this does not begin a comment")
            } else {
                format!("`{sign}` does not begin a comment: {names}")
            };
            return explanation(message, COMMENT);
        }
    }
    let inner = after.split(')').next().unwrap_or("");
    if site.code == "NCT-18"
        && at.starts_with(|c: char| c.is_ascii_alphabetic())
        && after.contains(')')
        && inner.chars().all(|c| c.is_ascii_alphabetic() || c == ' ')
    {
        return explanation("parentheses enclose conditions, not comments", COMMENT);
    }
    if site.code != "NCT-44" || at == "x" && before.ends_with('0') {
        return None;
    }
    let line_begins = before.trim().is_empty();
    let sign = before.trim_start().chars().next().filter(|c| "?'#{!\"%".contains(*c));
    match (at.chars().next()?, sign) {
        (c @ ('?' | '\'' | '{' | '"'), _) if line_begins => {
            explanation(format!("`{c}` does not begin a comment"), COMMENT)
        }
        ('#' | '!', _) if line_begins && after.starts_with(' ') => {
            explanation(format!("`{at}` does not begin a comment"), COMMENT)
        }
        (_, Some(sign)) => {
            explanation(format!("`{sign}` in front of this does not begin a comment"), COMMENT)
        }
        (c, _) if c.is_ascii_lowercase() => {
            let (word, _) = site.around.word(|c| c.is_ascii_alphanumeric());
            let word = word.trim_start_matches(|c: char| c.is_ascii_digit());
            let capitals = word.to_ascii_uppercase();
            let written = format!("statements are written in capitals: `{capitals}`");
            let perhaps_text = word.len() > 1 && word.chars().all(char::is_alphabetic);
            help(if perhaps_text { format!("{written}; {COMMENT}") } else { written })
        }
        _ => None,
    }
}

/// Assignments of other languages: `Y012=1`, `Q05:=10`, `F010=F020`.
fn assignment(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, .. } = site.around;
    let colon = site.around.is_followed_by(":=") || at == ":" && site.around.is_followed_by("=");
    let equals = site.around.is_followed_by("=") && !site.around.is_followed_by("==");
    let compares = "nothing is assigned with `=`, which compares register OP";
    let (target, message) =
        if at.starts_with('=') && !at.starts_with("==") && site.is(&["17", "33"]) {
            (last_address(before.trim_end().trim_end_matches(':'))?, compares)
        } else if at == ":" && colon {
            (last_address(before)?, "`:=` is not a sign of NCT: nothing is assigned with `=`")
        } else if (equals || colon) && site.is(&["17", "9", "19"]) {
            (last_address(at)?, compares)
        } else {
            return None;
        };
    let digits: String = target.chars().filter(char::is_ascii_digit).collect();
    let what = match (target.chars().next()?, digits.len()) {
        ('Y', 3) => {
            format!("U{digits} switches {target} on, D{digits} off: I001 U{digits} E D{digits} Z")
        }
        ('F', 4) => format!("UF{digits} sets {target} to 1, DF{digits} to 0"),
        ('I' | 'V' | 'P', _) => {
            format!("{target} … Z runs where the bit is on, N{target} … Z where it is off")
        }
        ('M', _) => format!("store the time to start a timer: ,50 SM{digits}"),
        (timer @ ('T' | 'H'), _) => {
            format!("store the time to start a timer: ,50 S{timer}{digits:0>2}")
        }
        (_, _) => format!("load a value and store it: ,10 S{target} or LI00 S{target}"),
    };
    explanation(message, what)
}

/// The name of a bit, word, counter or timer at the end of a text: `Y012` of `I001 Y012`.
fn last_address(text: &str) -> Option<&str> {
    let text = text.trim_end();
    let letters = text.trim_end_matches(|c: char| c.is_ascii_digit());
    let from = letters.char_indices().next_back().filter(|(_, c)| "IYVPFQTHM".contains(*c))?.0;
    (letters.len() < text.len()).then(|| text.get(from..))?
}

/// Words of other languages.
fn word(site: &ErrorSite<'_>) -> Option<Explanation> {
    let (word, from) = site.around.word(|c| c.is_ascii_alphabetic() || c == '_');
    let line = [site.around.before, site.around.at, site.around.after].concat();
    let before = line.get(..from).unwrap_or("");
    let after = line.get(from + word.len()..).unwrap_or("");
    // Statements are single letters that may follow each other without blanks, so only a word
    // that is alone counts: ST50 stores to a timer, LD0 begins with a letter too many.
    if word.len() <= 2 && after.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let mut contexts = vec!["word"];
    if before.trim().is_empty() && after.starts_with(' ') {
        contexts.insert(0, "line");
    }
    if before.contains('(') {
        contexts.insert(0, "condition");
    }
    let message = format!("`{word}` is not a word of NCT");
    explanation(message, HABITS.help_in(&contexts, &word)?)
}

/// `UI002`: U and D switch outputs and flags. In German instruction lists, U is AND.
fn switch_of_input(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { at, after, .. } = site.around;
    let written = site.written();
    let mut rest = written.chars().chain(after.chars());
    let switch = rest.next().filter(|c| matches!(c, 'U' | 'D'))?;
    let name = rest.next().filter(|c| "IPTHM".contains(*c))?;
    let digits: String = rest.take_while(char::is_ascii_digit).collect();
    if !site.is(&["9", "56"]) || digits.len() < 2 || at.len() > 4 {
        return None;
    }
    match name {
        'I' | 'P' => explanation(
            format!("{name}{digits} is an input, which {switch} can't switch"),
            format!(
                "{switch}{digits} switches output Y{digits}; to do something where the input is on, \
                 write {name}{digits} … Z"
            ),
        ),
        _ => explanation(
            format!("{switch} switches outputs and flags, no timers"),
            format!("load the time and store it to start the timer: ,50 S{name}{digits}"),
        ),
    }
}

/// Addresses with too few or too many digits, or with a point.
fn digits(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    if site.code == "NCT-7" && at.starts_with(|c: char| c.is_ascii_digit()) {
        // A digit that no letter, comma or point introduces: the address in front of it was complete.
        let first = at.chars().next()?;
        if before.ends_with('J') || before.ends_with("J0") || before.ends_with("J1") {
            return explanation(
                format!("`{first}` is one digit too many"),
                "J0, J1 and J2 end modules; a jump is written G and a label: G010",
            );
        }
        let (number, from) = site.around.word(|c| c.is_ascii_digit());
        let line = [before, at, after].concat();
        let parts = (line.get(..from), line.get(from + number.len()..));
        let begins_line = parts.0.is_some_and(|text| text.trim_start().is_empty());
        let follows_address =
            parts.0.is_some_and(|text| text.ends_with([' ', '\t']) && last_address(text).is_some());
        if (begins_line || follows_address)
            && parts.1.is_some_and(|text| text.trim_start().len() < text.len() || text.is_empty())
        {
            let label = if begins_line && number.len() == 3 {
                format!("; a label: :{number}")
            } else {
                String::new()
            };
            let written = format!("a decimal constant begins with a comma: ,{number}{label}");
            return explanation(format!("`{number}` alone is not a statement"), written);
        }
        let address = last_address(before)?;
        let what = match address.chars().next()? {
            'T' => "20 ms timers are T00 to T49",
            'H' => "timers of seconds are H00 to H99",
            'M' => "timers of minutes are M0 to M9; M codes belong in part programs",
            'Q' => "counters are Q00 to Q31",
            'F' => "a bit is F and four digits, a word F and three",
            _ => "a bit has three digits, a word two: I001, LI00",
        };
        return explanation(format!("`{first}` is one digit too many after {address}"), what);
    }
    if !site.is(&["9", "19"]) {
        return None;
    }
    let written = site.written();
    let number: String = written.chars().rev().take_while(char::is_ascii_digit).collect();
    let number: String = number.chars().rev().collect();
    let letters = written.get(..written.len() - number.len()).unwrap_or("");
    let point = after.strip_prefix('.').and_then(|rest| rest.chars().next());
    if let Some(bit) = point.filter(char::is_ascii_digit)
        && number.len() <= 2
        && !number.is_empty()
    {
        let letters = letters.replace('Q', "Y");
        let message = format!("a bit is written without a point, not `{written}.{bit}`");
        let byte = number.trim_start_matches('0');
        let byte = if byte.is_empty() { "0" } else { byte };
        return explanation(
            message,
            format!("write {letters}{number:0>2}{bit}: byte {byte}, bit {bit}"),
        );
    }
    if after.starts_with(['B', 'W', 'X', 'D']) && number.is_empty() {
        let (bit, word) = if letters.ends_with('F') { ("0000", "000") } else { ("001", "00") };
        return letters.ends_with(['I', 'Y', 'V', 'P', 'F']).then(|| {
            help(format!(
                "no letter says how long it is: {letters}{bit} is a bit, {letters}{word} a word"
            ))
        })?;
    }
    if letters == "F" && number.len() == 3 && !after.starts_with(|c: char| c.is_ascii_digit()) {
        return help(format!(
            "F{number} is a word, which LF{number} loads; a bit of it has a fourth digit, F{number}0 to F{number}7"
        ));
    }
    if letters == "G" && matches!(number.len(), 1 | 2) && !after.starts_with(['O', 'I']) {
        return help(format!(
            "a jump has a label of three digits, G{number:0>3}; G codes belong in part programs"
        ));
    }
    if let Some((letter, digits)) = hexadecimal_operand(site) {
        return help(format!(
            "a hexadecimal constant is a point and four digits: {letter}.{digits}"
        ));
    }
    if let Some(letter) = letters.strip_suffix('O')
        && number.len() == 2
        && ["U", "D", "I", "Y", "V", "P", "NI", "NY"].contains(&letter)
    {
        let meant = format!("{letter}0{number}");
        let text = format!(
            "the digit 0 is meant, not the letter O: {meant}; an address O has three digits"
        );
        return help(text)
            .map(|it| if written == site.around.at { it.replacing(meant) } else { it });
    }
    // The letter O or I in the place of a digit has a help of its own.
    if after.starts_with(['O', 'I', 'l']) {
        return None;
    }
    let count = match letters.chars().next_back()? {
        _ if number.is_empty() => return None,
        'Q' | 'T' | 'H' => 2,
        'I' | 'Y' | 'V' | 'P' | 'O' | 'U' | 'D' | 'G' | 'C' | ':' if number.len() == 1 => 3,
        'G' | 'C' | ':' => 3,
        _ => return None,
    };
    let zeros = format!("{number:0>count$}");
    let meant = format!("{letters}{zeros}");
    let is_whole = written == site.around.at;
    (number.len() < count).then(|| {
        let found = help(format!("write {count} digits: {meant}"));
        found.map(|it| if is_whole { it.replacing(meant) } else { it })
    })?
}

/// A hexadecimal number that follows A or O without a point, `A00FE`, if the error is in it: the letter, and the digits.
fn hexadecimal_operand(site: &ErrorSite<'_>) -> Option<(char, String)> {
    let Surroundings { before, at, after } = site.around;
    let operator = before.trim_end_matches(|c: char| c.is_ascii_digit());
    let letter = operator.chars().next_back().filter(|c| matches!(c, 'A' | 'O'))?;
    let rest = [before.get(operator.len()..)?, at, after].concat();
    let digits: String = rest.chars().take_while(char::is_ascii_hexdigit).collect();
    let has_letter = digits.contains(|c: char| c.is_ascii_alphabetic());
    (site.is(&["9", "19", "73"]) && digits.len() == 4 && has_letter).then_some((letter, digits))
}

/// Operators of other languages.
fn symbol(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    if let Some(help) = HABITS.help("operator", at) {
        return explanation(format!("`{at}` is not an operator"), help);
    }
    let relation = if at == "!" && after.starts_with('=') { "!=" } else { at };
    if let Some(help) = HABITS.help("relation", relation) {
        return explanation(format!("`{relation}` is not a relation"), help);
    }
    match at {
        "!" | "~" if after.starts_with(|c: char| c.is_ascii_uppercase() || c == '(') => {
            explanation(format!("`{at}` is not an operator"), "NOT is written N: NI001")
        }
        _ if site.is(&["45"]) && at.starts_with('/') && at.ends_with(char::is_alphabetic) => help(
            "NOT is written N: NI001; `/` divides register OP by a variable, /LI00, or a number, /5",
        ),
        _ if site.is(&["18"]) && at == "L" && after.starts_with(char::is_alphabetic) => {
            help("parentheses hold conditions; load the value in front of them: LQ05 (>5 A I001)")
        }
        _ if site.is(&["44"]) && at == "%" && before.trim().is_empty() => {
            help("NCT's addresses have no `%`: I001, Y012; a part program is not a PLC program")
        }
        _ if site.is(&["13"]) && is_block(before, at, after) => explanation(
            "this looks like a block of a part program",
            "a PLC program has labels, :010, and statements such as I001 U012 Z",
        ),
        _ if site.is(&["17"])
            && at.starts_with('Q')
            && after.trim_start().starts_with(['+', '-']) =>
        {
            help(format!("U{at} adds 1 to the counter, D{at} subtracts 1"))
        }
        _ if site.is(&["7"]) && matches!(at, "++" | "--") => {
            help("UQ05 adds 1 to counter Q05, DQ05 subtracts 1")
        }
        _ => None,
    }
}

/// Whether a block of a part program is on the line: `N10 G0 X100`.
fn is_block(before: &str, at: &str, after: &str) -> bool {
    let number = |c: char| c.is_ascii_digit();
    let code = after.trim_start_matches(number).trim_start();
    before.trim().is_empty()
        && at.strip_prefix('N').is_some_and(|rest| rest.starts_with(number))
        && code
            .strip_prefix(['G', 'M', 'X', 'Y', 'Z', 'T', 'S', 'F'])
            .is_some_and(|c| c.starts_with(number))
}

/// Constants without a comma, and those of other languages.
fn constant(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    let number: String = [at, after].concat();
    let number: String = number.chars().skip(1).take_while(char::is_ascii_digit).collect();
    let introduced = at.chars().next()?;
    let label = before.trim_start();
    if at == ":" && label.len() == 3 && label.bytes().all(|b| b.is_ascii_digit()) {
        return help(format!("the colon comes before the label: :{label}"));
    }
    if introduced == 'L' && number.len() == 3 && after.contains(':') {
        return explanation(
            "`L` begins no label",
            format!("a label is a colon and three digits: :{number}"),
        );
    }
    if matches!(introduced, 'L' | 'K' | '#') && !number.is_empty() && site.is(&["51", "7", "44"]) {
        if introduced == '#' && before.ends_with(|c: char| c.is_ascii_digit()) {
            return hexadecimal(after);
        }
        return explanation(
            format!("`{introduced}` begins no constant"),
            format!("a decimal constant begins with a comma: ,{number}"),
        );
    }
    match at {
        "#" => hexadecimal(after),
        "x" if before.ends_with('0') => hexadecimal(after),
        "," if after.starts_with('$') => hexadecimal(after.get(1..).unwrap_or("")),
        "," if after.starts_with('-') => {
            let value = after.chars().skip(1).take_while(char::is_ascii_digit).collect::<String>();
            let value: u32 = value.parse().ok().filter(|value| *value <= 32_768)?;
            let word = 0x1_0000 - value;
            help(format!(
                "a constant has no sign: write its two's complement, .{:04X}",
                word & 0xFFFF
            ))
        }
        "," => {
            let end = after.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(after.len());
            let word = after.get(..end).unwrap_or("");
            let digits = word.strip_suffix('H').unwrap_or(word);
            let valid = word.len() > 1 && digits.bytes().all(|b| b.is_ascii_hexdigit());
            if valid { hexadecimal(digits) } else { None }
        }
        _ => None,
    }
}

/// The help for a hexadecimal number whose digits are at the beginning of a text.
fn hexadecimal(text: &str) -> Option<Explanation> {
    let digits: String = text.trim_start().chars().take_while(char::is_ascii_hexdigit).collect();
    let value = u16::from_str_radix(&digits, 16).ok()?;
    help(format!("a hexadecimal constant is a point and four digits: .{value:04X}"))
}

/// Of a program that is written in small letters throughout, keeps the first error about them alone,
/// and leaves out what follows from them: the labels and the ends of modules that are not read.
fn tell_small_letters(text: &str, found: &mut Vec<Diagnostic>) {
    // Comments after other signs than `;` have small letters too.
    if found.iter().any(|diagnostic| diagnostic.help.as_deref() == Some(COMMENT)) {
        return;
    }
    let code = text.lines().map(|line| line.split(';').next().unwrap_or(""));
    let is_small = |diagnostic: &Diagnostic| {
        let at = text.get(diagnostic.span.range()).unwrap_or("");
        diagnostic.code == "NCT-44" && at.starts_with(|c: char| c.is_ascii_lowercase())
    };
    let follows = |diagnostic: &Diagnostic| diagnostic.code == "NCT-61";
    tell_small_letters_once(code.flat_map(str::bytes), found, is_small, follows);
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_habits_are_well_formed() {
        assert!(super::HABITS.help("condition", "AND").is_some());
        assert_eq!(super::HABITS.help("condition", "NAME"), None);
    }
}
