//! What people who know other languages write: structured text, instruction lists, BASIC, C, part
//! programs, Power PMAC. [`explain`] gives an error a message and a help that say what was probably meant and
//! how PMAC writes it. The error's code and place stay the same.

use std::sync::LazyLock;

use plcc_diag::MessageText;

use super::cursor::{Cursor, MISSING, ParseError};
use super::online::PERHAPS_A_NAME;
use super::words::{self, MOTION, ONLINE, PLC};
use super::words_of_other_languages::{directive, function, operand, statement};
use crate::common::{Controller, Explanation, Habits, Surroundings, explanation, help, tsv};

/// The help for all that was meant as a comment.
const COMMENT: &str = "a comment begins with `;` or `//` and goes on to the end of the line";

/// What they write in other words.
pub(crate) static HABITS: LazyLock<Habits> = LazyLock::new(|| {
    let file = "frontend/src/pmac/read/other_languages.tsv";
    tsv::built_in(Habits::load(file, include_str!("other_languages.tsv")))
});

/// The line around an error.
pub(super) struct ErrorSite<'a> {
    pub(super) around: Surroundings<'a>,
    /// The word of letters, digits and `_` around the beginning of the error's place.
    pub(super) word: String,
    /// What is in front of the word on its line.
    pub(super) before: String,
    /// What is after the word on its line.
    pub(super) after: String,
    /// The last character of the lines before, other than blanks.
    line_before_ends: Option<char>,
    /// The error's code.
    pub(super) code: &'static str,
    pub(super) controller: Controller,
}

impl<'a> ErrorSite<'a> {
    fn new(text: &'a str, error: &ParseError, controller: Controller) -> Self {
        let (start, end) = (error.at.start as usize, error.at.end as usize);
        let around = Surroundings::new(text, start, end);
        let (word, from) = around.word(is_part);
        let line = [around.before, around.at, around.after].concat();
        let before = line.get(..from).unwrap_or("").to_owned();
        let after = line.get(from + word.len()..).unwrap_or("").to_owned();
        let line_start = start.saturating_sub(around.before.len());
        let earlier = Surroundings::before(text, line_start);
        let line_before_ends = earlier.trim_end().chars().next_back();
        let code = error.code;
        Self { around, word, before, after, line_before_ends, code, controller }
    }

    /// Whether nothing but blanks is in front of the word on its line.
    pub(super) fn begins_line(&self) -> bool {
        self.before.trim().is_empty()
    }
}

/// Whether a character may be a part of a name.
fn is_part(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// What [`explain`] has found out about an error.
pub(super) enum Explained {
    /// Nothing: the error is left as it is.
    No,
    /// The error says what was probably meant.
    Yes,
    /// The error is about this name, which is not defined.
    UndefinedName(String),
}

/// Says of an error in `text` what was probably meant, if it looks like a habit from another
/// language.
pub(super) fn explain(text: &str, controller: Controller, error: &mut ParseError) -> Explained {
    // The other errors are about numbers, structure and limits, whatever the language.
    if !matches!(error.code, "PMAC-3" | "PMAC-5") {
        return Explained::No;
    }
    let site = ErrorSite::new(text, error, controller);
    if error.message.ends_with(MISSING) {
        let operator = site.around.at.starts_with(|c: char| "=+-*/%&|^,".contains(c));
        if error.help.is_none() && operator {
            error.help = Some("finish the expression on this line".into());
        }
        return Explained::No;
    }
    if let Some(name) = undefined_name(&site, error) {
        return Explained::UndefinedName(name);
    }
    let meaning = comment(&site)
        .or_else(|| template(&site))
        .or_else(|| number(&site))
        .or_else(|| brace(&site))
        .or_else(|| assignment(&site))
        .or_else(|| directive(&site))
        .or_else(|| definition(&site))
        .or_else(|| function(&site))
        .or_else(|| operand(&site))
        .or_else(|| statement(&site))
        .or_else(|| quotes(&site));
    let Some(Explanation { message, help, .. }) = meaning else { return Explained::No };
    if let Some(message) = message {
        error.message = message.into();
    }
    error.help = Some(help.into());
    Explained::Yes
}

/// Signs with which comments begin in other languages.
fn comment(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    let first = before.trim().is_empty();
    let sign = match at {
        "(" if after.starts_with('*') => "(*",
        "'" if !sends(before) => "'",
        "?" | "#" | "!" | "*" if first && after.starts_with(' ') => at,
        _ if before.trim_end().ends_with("--") && before.trim_end().len() > 2 => "--",
        "REM" | "Rem" | "rem" if first => at,
        _ => return None,
    };
    explanation(format!("`{sign}` does not begin a comment"), COMMENT)
}

/// Whether a line's beginning ends with a word such as SEND, which a text in quotes follows.
fn sends(before: &str) -> bool {
    let before = before.trim_end().to_ascii_uppercase();
    ["CMD", "COMMAND", "SEND", "SENDS", "SENDP", "DISPLAY", "DISP", "="]
        .iter()
        .any(|word| before.ends_with(word))
}

/// Placeholders for values that another tool fills in before the download.
fn template(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    let rest = [at, after].concat();
    let opened =
        ["$(", "${", "%(", "{{", "<%", "@{"].iter().find(|sign| rest.starts_with(**sign))?;
    if *opened == "%(" && before.trim_end().ends_with(|c: char| is_part(c) || c == ')') {
        return None;
    }
    let end = rest.find([')', '}', '>']).map_or(rest.len(), |end| end + 1);
    let end = end + usize::from(rest.get(end..).is_some_and(|rest| rest.starts_with('}')));
    let written = rest.get(..end).unwrap_or(&rest);
    explanation(
        format!("`{written}` is the place of a value that nothing has filled in"),
        "run the tool that fills this template before; here `--define NAME=VALUE` replaces $(NAME) \
         and $(NAME=DEFAULT)",
    )
}

/// Numbers as other languages write them.
fn number(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    let upper = site.word.to_ascii_uppercase();
    let hexadecimal = |digits: &str| {
        let valid = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_hexdigit());
        valid.then(|| help(format!("hexadecimal numbers are written ${digits}")))?
    };
    let letter = |c: char| c.is_ascii_alphabetic() && !c.is_ascii_hexdigit();
    if at == "$" && after.starts_with(letter) {
        return help("hexadecimal digits follow `$`, 0 to 9 and A to F");
    }
    if at == "#" {
        let base = before.trim_end_matches(|c: char| c.is_ascii_digit());
        let base = before.get(base.len()..).unwrap_or("");
        let digits: String = after.chars().take_while(|c| is_part(*c)).collect();
        let expected = before.trim_end().ends_with(|c: char| "=+-*/(<>&|^%".contains(c));
        return match base {
            "2" => u64::from_str_radix(&digits, 2).ok().and_then(decimal),
            "16" => hexadecimal(&digits.to_ascii_uppercase()),
            "" if expected => hexadecimal(&digits.to_ascii_uppercase()),
            _ => None,
        };
    }
    if !upper.starts_with(|c: char| c.is_ascii_digit()) || upper.bytes().all(|b| b.is_ascii_digit())
    {
        let comma = at == "," && before.ends_with(|c: char| c.is_ascii_digit());
        let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
        let whole = before.trim_end_matches(|c: char| c.is_ascii_digit());
        let whole = before.get(whole.len()..).unwrap_or("");
        return (comma && !digits.is_empty() && before.contains('='))
            .then(|| help(format!("the decimal sign is a point: {whole}.{digits}")))?;
    }
    if let Some(digits) = upper.strip_prefix("0X").or(upper.strip_suffix('H')) {
        return hexadecimal(digits);
    }
    let binary = upper.strip_prefix("0B").or(upper.strip_suffix('B'))?;
    u64::from_str_radix(binary, 2).ok().and_then(decimal)
}

/// The help for a binary number.
fn decimal(value: u64) -> Option<Explanation> {
    help(format!("there are decimal numbers, {value}, and hexadecimal ones, ${value:X}"))
}

/// Braces of C.
fn brace(site: &ErrorSite<'_>) -> Option<Explanation> {
    let sign = site.around.at;
    matches!(sign, "{" | "}" | "[" | "]").then_some(())?;
    if matches!(sign, "[" | "]") {
        return None;
    }
    explanation(
        format!("`{sign}` does not enclose statements"),
        "an IF ends with ENDIF, a WHILE with ENDWHILE, a program with CLOSE",
    )
}

/// Assignments of other languages: `:=`, `+=`, `++` and similar ones, two in one statement, and lines that
/// continue the line before.
fn assignment(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    let variable = is_variable(at);
    let rest = after.trim_start();
    if variable && site.code == "PMAC-3" && !rest.starts_with('=') && !before.contains('=') {
        for sign in ["+", "-", "*", "/", "%"] {
            let Some(rest) = rest.strip_prefix(sign) else { continue };
            if rest.starts_with('=') {
                return explanation(
                    format!("`{sign}=` is not an assignment"),
                    format!("write {at}={at}{sign}…"),
                );
            }
            if rest.starts_with(sign) {
                return explanation(
                    format!("`{sign}{sign}` is not an assignment"),
                    format!("write {at}={at}{sign}1"),
                );
            }
        }
        if rest.starts_with('[') {
            return explanation(
                "brackets follow no variable",
                "each number is a variable of its own, P1; P(P2+1) is the one that a value chooses",
            );
        }
        if let Some(bit) =
            after.strip_prefix('.').filter(|r| r.starts_with(|c: char| c.is_ascii_digit()))
        {
            let bit: String = bit.chars().take_while(char::is_ascii_digit).collect();
            return explanation(
                format!("`{at}.{bit}` is not a bit"),
                format!("a bit is an M-variable of its own: M100->Y:$FFC2,{bit}"),
            );
        }
    }
    let colon = (variable || at == ":") && [at, rest].concat().contains(":=");
    let name = if variable { at } else { before.trim().trim_end_matches('=') };
    if colon && is_variable(name) && (rest.starts_with(":=") || at == ":") {
        return explanation("`:=` is not an assignment", format!("write {name}=…"));
    }
    if at != "=" {
        return None;
    }
    if before.contains('=') {
        let help = "write an assignment for each variable, and IF (P2>3) P1=1 ELSE P1=0 ENDIF for a \
                    comparison";
        return explanation("a statement assigns to one variable", help);
    }
    let open = site.line_before_ends.filter(|c| "=+-*/%&|^,(".contains(*c))?;
    is_variable(before.trim()).then(|| {
        explanation(
            format!("this line goes on with the line before, which ends with `{open}`"),
            format!("finish the line before: something is missing after its `{open}`"),
        )
    })?
}

/// Whether a text is a variable: its letter and its number.
fn is_variable(text: &str) -> bool {
    let number = text.strip_prefix(|c: char| "IPQMLipqml".contains(c)).unwrap_or("");
    !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
}

/// How many bytes at the beginning of a name the controller takes for one of its own words or variables; 0 if
/// none.
fn known_beginning(name: &str) -> usize {
    let digits = name.bytes().skip(1).take_while(u8::is_ascii_digit).count();
    if digits > 0 && is_variable(name.get(..=digits).unwrap_or("")) {
        return digits + 1;
    }
    let word = words::find(Cursor::new(name), PLC.or(ONLINE).or(MOTION));
    word.map_or(0, |(_, after)| after.pos)
}

/// If the error is caused by a name that no #define defines, returns the name and says so in the error. Such a
/// name is a word without a meaning to which something is assigned, or a name whose beginning the
/// controller takes for a word or a variable.
fn undefined_name(site: &ErrorSite<'_>, error: &mut ParseError) -> Option<String> {
    let name = site.word.trim_start_matches(|c: char| c.is_ascii_digit());
    let known = known_beginning(name);
    let (beginning, rest) = name.split_at_checked(known)?;
    let is_name = rest.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    // Statements may follow each other without blanks: ENDIFP2=1.
    let is_statement = is_variable(rest) || known > 0 && known_beginning(rest) == rest.len();
    let is_directive = site.before.trim_end().ends_with('#');
    if !is_name || is_statement || is_directive {
        return None;
    }
    let after = site.after.trim_start();
    let assigned = after.starts_with('=') && !after.starts_with("==");
    if known == 0 {
        let unknown = error.help.as_deref() == Some(PERHAPS_A_NAME);
        let is_plc = name.get(..3).is_some_and(|start| start.eq_ignore_ascii_case("PLC"))
            && name.bytes().skip(3).all(|b| b.is_ascii_digit());
        if !unknown || !assigned || !site.begins_line() || name.len() < 2 || is_plc {
            return None;
        }
    } else {
        let compared = after.starts_with(['!', '<', '>', '~']);
        let small = rest.contains(|c: char| c.is_ascii_lowercase());
        let value = small && site.before.trim_end().ends_with('=');
        if !assigned && !compared && !value && !rest.contains('_') || site.before.contains("->") {
            return None;
        }
        let effect = if beginning.eq_ignore_ascii_case("CLOSE") {
            format!("`{beginning}` in front of it closes the buffer")
        } else {
            format!("only its beginning, `{beginning}`, is known")
        };
        error.message = format!("`{name}` is not defined: {effect}").into();
    }
    error.help = Some(MessageText::from(format!(
        "define the name before it is used, for a variable that is free: #define {name} P100"
    )));
    Some(name.to_owned())
}

/// Definitions of M-variables whose addresses hold a name or are written as in other languages.
fn definition(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    if is_variable(at) && after.trim_start().starts_with("->") {
        return help("M-variables are parts of the memory: M1->Y:$FFC2,8");
    }
    let arrow = before.contains("->");
    if arrow && before.trim_end().ends_with("->") && at.len() == 1 {
        return help("a definition names a word of the memory, and its bits: M1->Y:$FFC2,8");
    }
    if !arrow {
        let assigned =
            before.trim_end().strip_suffix('=').is_some_and(|name| is_variable(name.trim()));
        let space = matches!(at, "X" | "Y" | "DP" | "L" | "D" | "F" | "x" | "y");
        return (assigned && space && (after.starts_with(':') || after.starts_with('$')))
            .then(|| help("a definition is written with `->`: M1->Y:$FFC2,8"))?;
    }
    let address = at.rsplit(':').next().unwrap_or("");
    let glued: String = after.chars().take_while(|c| is_part(*c)).collect();
    let defined_as = before.rsplit("->").next().unwrap_or("").trim_start();
    let written = if at.contains(':') {
        [address, &glued].concat()
    } else if defined_as.contains([':', '$']) && !defined_as.contains([',', ' ', '\t']) {
        site.word.clone()
    } else {
        return None;
    };
    let name = written.trim_start_matches('$');
    let upper = name.to_ascii_uppercase();
    let is_hexadecimal =
        |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_hexdigit());
    if let Some(digits) = upper.strip_prefix("0X").or(upper.strip_suffix('H'))
        && is_hexadecimal(digits)
    {
        return explanation(
            format!("`{written}` is not an address"),
            format!("hexadecimal numbers are written ${digits}"),
        );
    }
    let zeros = upper.replace('O', "0");
    if zeros != upper && zeros.len() >= 3 && is_hexadecimal(&zeros) {
        return explanation(
            format!("`{written}` has the letter O in it"),
            format!("write the digit 0: ${zeros}"),
        );
    }
    if at == "(" || at == "$" && after.starts_with('(') {
        return help("an address is a number without parentheses: M1->Y:$FFC2,8");
    }
    if after.starts_with('.') && glued.is_empty() {
        return help("a comma separates address and bit: M1->Y:$FFC2,8");
    }
    if name.is_empty() || at.contains(':') && glued.is_empty() {
        return None;
    }
    if !written.starts_with('$') && !before.ends_with('$') && is_hexadecimal(name) {
        return explanation(
            format!("`{written}` is not a decimal number"),
            format!("hexadecimal numbers are written ${name}"),
        );
    }
    if !name.contains(|c: char| c.is_ascii_alphabetic()) {
        return None;
    }
    explanation(
        format!("`{name}` is neither a number nor defined"),
        format!("write the address, or define the name before: #define {name} …"),
    )
}

/// Texts without quotes, or in single quotes.
fn quotes(site: &ErrorSite<'_>) -> Option<Explanation> {
    let Surroundings { before, at, after } = site.around;
    if !sends(before) || before.trim_end().ends_with('=') {
        let text = at == "\"" && before.trim_end().ends_with('=');
        return text.then(|| help("a variable holds a number; SEND\"text\" writes a text"))?;
    }
    let rest = [at, after].concat();
    let rest = rest.trim();
    if rest.contains('"') || !rest.starts_with(|c: char| c.is_alphanumeric() || "#&'".contains(c)) {
        return None;
    }
    let inner = rest.trim_matches('\'');
    let statement = before.trim();
    let message =
        if rest.starts_with('\'') { "a text is in double quotes" } else { "a text is in quotes" };
    explanation(message, format!("write {statement}\"{inner}\""))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_habits_are_well_formed() {
        assert!(super::HABITS.help("function", "ROUND").is_some());
        assert_eq!(super::HABITS.help("function", "NAME"), None);
    }
}
