//! What people who know other languages write: structured text, instruction lists, C, part programs.
//! [`explain`] gives an error of a statement a message and a help that say what was probably meant and how
//! PMI writes it. The error's number and place stay the same.

use std::sync::LazyLock;

use plcc_diag::Diagnostic;

use crate::common::{Explanation, Habits, explanation, help, tsv};
use crate::pmi::{
    analyse::{
        numbers_of_other_languages::{delay, other_number},
        words_of_other_languages::{declaration, directive, operator, statement, truth_value},
    },
    read::{
        cursor::Cursor,
        section::Section,
        token::{Kind, Token},
    },
};

/// The help for all that was meant as a comment.
const COMMENT: &str = "a comment begins with `?` and goes on to the end of the line";

/// What they write in other words or signs.
pub(super) static HABITS: LazyLock<Habits> = LazyLock::new(|| {
    let file = "frontend/src/pmi/analyse/other_languages.tsv";
    tsv::built_in(Habits::load(file, include_str!("other_languages.tsv")))
});

/// A statement with an error, and the token at which the error is.
pub(super) struct ErrorSite<'s, 'c> {
    cursor: &'s Cursor<'c>,
    /// The index of that token.
    at: usize,
    /// The error's code.
    pub(super) code: &'static str,
    /// The part of the specification section in which the statement is; `None` in the execution
    /// section.
    pub(super) section: Option<Section>,
}

impl<'c> ErrorSite<'_, 'c> {
    fn token(&self, index: usize) -> Option<Token> {
        self.cursor.tokens.get(index).copied()
    }

    fn kind(&self, index: usize) -> Option<Kind> {
        self.token(index).map(|token| token.kind)
    }

    /// The text of the statement's token `index`; empty where there is none.
    pub(super) fn word(&self, index: usize) -> &'c str {
        self.token(index).map_or("", |token| self.cursor.slice(token))
    }

    /// The text of the token at the error.
    pub(super) fn found(&self) -> &'c str {
        self.word(self.at)
    }

    /// The text of the token in front of the error.
    fn before(&self) -> &'c str {
        self.at.checked_sub(1).map_or("", |index| self.word(index))
    }

    /// The text of the token after that at the error.
    fn after(&self) -> &'c str {
        self.word(self.at + 1)
    }

    /// Whether there is no blank between two tokens, of which `index` is the second one.
    fn is_glued(&self, index: usize) -> bool {
        let first = index.checked_sub(1).and_then(|index| self.token(index));
        first.zip(self.token(index)).is_some_and(|(first, second)| first.end == second.start)
    }

    /// The statement's text from an offset in its file on.
    fn text_from(&self, offset: u32) -> &'c str {
        let end = self.cursor.statement.end as usize;
        self.cursor.text.get(offset as usize..end).unwrap_or("")
    }

    /// A number such as `16#FF` before the error. PMI takes its `#` for the sign that continues a statement on
    /// the next line, so the error is on that next line.
    pub(super) fn number_before_hash(&self) -> Option<&'c str> {
        let before = self.token(self.at.checked_sub(1)?)?;
        let between =
            self.cursor.text.get(before.end as usize..self.token(self.at)?.start as usize)?;
        let digits =
            between.strip_prefix('#')?.split(|c: char| !c.is_ascii_alphanumeric()).next()?;
        let from = before.start as usize;
        self.cursor.text.get(from..before.end as usize + 1 + digits.len())
    }

    /// The longest word around the beginning of the token at the error whose characters all satisfy `is_part`.
    pub(super) fn around(&self, is_part: impl Fn(char) -> bool) -> &'c str {
        let start = self.token(self.at).map_or(0, |token| token.start as usize);
        let before = self.cursor.text.get(..start).unwrap_or("");
        let from = before.trim_end_matches(&is_part).len();
        let rest = self.cursor.text.get(from..).unwrap_or("");
        rest.get(..rest.find(|c| !is_part(c)).unwrap_or(rest.len())).unwrap_or("")
    }
}

/// Says of an error in a statement what was probably meant, if it looks like a habit from another
/// language. `section` is the part of the specification section in which the statement is, `None`
/// in the execution section.
pub(crate) fn explain(
    cursor: &Cursor<'_>,
    section: Option<Section>,
    mut problem: Box<Diagnostic>,
) -> Box<Diagnostic> {
    let start = problem.span.start;
    let Some(at) = cursor.tokens.iter().position(|token| token.start >= start) else {
        return problem;
    };
    let site = ErrorSite { cursor, at, code: problem.code, section };
    let found = comment(&site)
        .or_else(|| assignment(&site, &problem))
        .or_else(|| symbol(&site))
        .or_else(|| keyword(&site))
        .or_else(|| name(&site))
        .or_else(|| delay(&site))
        .or_else(|| other_number(&site))
        .or_else(|| address(&site))
        .or_else(|| index(&site));
    if let Some(explanation) = found {
        if problem.code == "PMI-10" && explanation.message.is_some() {
            // The label shows an earlier declaration, which does not help: what was meant is not a declaration.
            *problem = Diagnostic::error(problem.code, problem.span, "");
        }
        explanation.explain(&mut problem);
    }
    problem
}

/// Comments of other languages, and braces.
fn comment(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let Token { end, .. } = site.token(site.at)?;
    let rest = site.text_from(end);
    match site.found() {
        ";" if rest.trim().is_empty() => {
            return explanation(
                "a statement does not end with `;`",
                "leave the `;` out: a statement ends with its line",
            );
        }
        ";" if rest.contains('=') => {
            let help = "put each statement on a line of its own; a comment begins with `?`";
            return explanation("`;` neither ends a statement nor begins a comment", help);
        }
        ";" => return explanation("`;` does not begin a comment", COMMENT),
        "{" | "}"
            if site.cursor.text.get(site.cursor.statement_span().range())?.contains('}')
                && rest.contains('}') =>
        {
            return explanation("`{` does not begin a comment", COMMENT);
        }
        sign @ ("{" | "}") => {
            let help = "the body of an IF begins on the next line and ends with ENDIF";
            return explanation(format!("`{sign}` does not enclose the body of an IF"), help);
        }
        "'" if rest.contains('\'') && site.section.is_some() => {
            return explanation("`'` begins no text", "put the text between double quotes: \"…\"");
        }
        "'" => return explanation("`'` does not begin a comment", COMMENT),
        _ => {}
    }
    // Two signs that begin a comment elsewhere. After an operand, `//` would divide by a negation,
    // and `--` subtract one.
    let begins = |first: usize| {
        let operand = first == 0
            || matches!(
                site.kind(first - 1),
                Some(
                    Kind::Name
                        | Kind::Executive
                        | Kind::Number(_)
                        | Kind::Text
                        | Kind::RParen
                        | Kind::RBracket
                )
            );
        let signs = match (site.kind(first)?, site.kind(first + 1)?) {
            (Kind::Slash, Kind::Slash) if operand => "//",
            (Kind::Minus, Kind::Minus) if operand && site.at >= first + 2 => "--",
            (Kind::Slash, Kind::Star) => "/*",
            (Kind::LParen, Kind::Star) => "(*",
            _ => return None,
        };
        site.is_glued(first + 1).then_some(signs)
    };
    let signs = (0..=site.at).find_map(begins)?;
    explanation(format!("`{signs}` does not begin a comment"), COMMENT)
}

/// Assignments of other languages: `:=`, `+=`, `++` and similar ones.
fn assignment(site: &ErrorSite<'_, '_>, problem: &Diagnostic) -> Option<Explanation> {
    let name = site.word(0);
    let colon = |index| site.word(index) == ":" && site.word(index + 1) == "=";
    let named = matches!(site.kind(0), Some(Kind::Name | Kind::Executive));
    let is_label = site.at == 0 && site.kind(0) == Some(Kind::Name) && colon(1)
        || colon(site.at)
        || site.found() == "=" && site.before() == ":";
    if is_label && named {
        let message = "`:=` is not a sign of PMI: an assignment is written with `=`";
        return explanation(message, format!("write {name} = …; a colon follows a label"));
    }
    // In another statement, `:=` has made a label of this name.
    let made_label = problem.labels().first().is_some_and(|label| {
        let after = site.cursor.text.get(label.span.end as usize..).unwrap_or("").trim_start();
        label.span.file == problem.span.file
            && after.strip_prefix(':').is_some_and(|rest| rest.trim_start().starts_with('='))
    });
    if made_label {
        return help(
            "where it is a label an assignment was probably meant: write `=` in place of `:=`",
        );
    }
    if site.at != 1 || site.code != "PMI-11" || site.section.is_some() {
        return None;
    }
    let sign = site.found();
    let compound = match sign {
        "+" | "-" | "*" | "%" | "&" | "!" => site.after() == "=",
        "|" | "^" => return None,
        "/=" => true,
        _ => false,
    };
    if compound {
        let sign = sign.trim_end_matches('=');
        let message = format!("`{sign}=` is not an assignment");
        return explanation(message, format!("write {name} = {name} {sign} …"));
    }
    if matches!(sign, "+" | "-") && site.after() == sign {
        let message = format!("`{sign}{sign}` is not an assignment");
        return explanation(message, format!("write {name} = {name} {sign} 1"));
    }
    None
}

/// Operators that are written with other signs.
fn symbol(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let known = HABITS.help("sign", site.found()).map(|help| (site.found().to_owned(), help));
    let known = known.or_else(|| {
        let signs = site.is_glued(site.at).then(|| [site.before(), site.found()].concat())?;
        let help = HABITS.help("glued signs", &signs)?;
        Some((signs, help))
    });
    if let Some((sign, help)) = known {
        return explanation(format!("`{sign}` is not an operator"), help);
    }
    if site.found() == "!" && site.code == "PMI-34" {
        return explanation(
            "`!` is OR, and is written between two operands",
            "NOT is written `/`: /A",
        );
    }
    None
}

/// Keywords of other languages.
fn keyword(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let found = site.found();
    let first = site.word(0);
    let code = site.code;
    if code == "PMI-1" {
        return directive(found);
    }
    if matches!(found, "THEN" | "DO") && code == "PMI-5" && site.section.is_none() {
        let help = format!("leave {found} out: the body begins on the next line");
        return explanation(format!("there is no {found} after a condition"), help);
    }
    let is_keyword = matches!(first, "IF" | "ELSEIF" | "ELSE" | "ENDIF" | "GOTO");
    if is_keyword && code == "PMI-10" && site.section.is_some() && site.after() != "=" {
        let help = "statements come after $END: write $END on a line of its own in front of the \
                    first one";
        return explanation(format!("{first} is in front of $END"), help);
    }
    let is_if = matches!(first, "IF" | "ELSEIF");
    if is_if && code == "PMI-11" && site.at == 1 {
        return help(format!("write {first} (condition), without THEN, on a line of its own"));
    }
    if is_if && code == "PMI-5" && matches!(site.kind(site.at), Some(Kind::Name | Kind::Executive))
    {
        let from = site.token(site.at)?.start;
        let rest = site.text_from(from).trim_end();
        let rest = rest.strip_suffix("ENDIF").unwrap_or(rest).trim_end();
        let rest: String = rest.chars().take(30).collect();
        if site.before() == ")" {
            return help(format!(
                "write the condition, `{rest}` and ENDIF on lines of their own; one pair of \
                 parentheses encloses the whole condition"
            ));
        }
        return help(format!(
            "put parentheses around the whole condition, `{rest}` on the next line, and an ENDIF \
             after it"
        ));
    }
    // After a variable whose `=` is missing, an operator would follow.
    let is_word = matches!(
        site.kind(1),
        None | Some(Kind::Name | Kind::Executive | Kind::Number(_) | Kind::LParen | Kind::Bad(_))
    );
    let is_first = site.section.is_none() && site.at <= 1;
    if is_first && is_word && matches!(code, "PMI-11" | "PMI-4" | "PMI-9") {
        return statement(first, site.word(1));
    }
    if site.section.is_some()
        && let Some(explanation) = declaration(site)
    {
        return Some(explanation);
    }
    match code {
        "PMI-37" | "PMI-34" => operator(found),
        "PMI-31" => operator(found).or_else(|| truth_value(found)),
        "PMI-30" => truth_value(found),
        _ => None,
    }
}

/// Names with characters that PMI's names can't have, and M and G codes without `@`.
fn name(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    if site.found().starts_with('_') {
        let whole = site.around(|c| c.is_ascii_alphanumeric() || c == '_');
        let joined: String = whole.chars().filter(|c| *c != '_').collect();
        let joined = joined.to_ascii_uppercase();
        let message = format!("`_` has no place in a name: `{whole}`");
        if site.section.is_none()
            && let Some(explanation) = statement(&joined, "")
        {
            return Some(Explanation { message: Some(message), ..explanation });
        }
        let help = match joined.as_str() {
            "ENDIF" | "ELSEIF" | "GOTO" => format!("write {joined}"),
            "ENDVAR" => "leave it out: a directive goes on until the next one".to_owned(),
            _ => format!(
                "a name is a letter and up to five letters and digits, such as {}",
                joined.get(..6).unwrap_or(&joined)
            ),
        };
        return explanation(message, help);
    }
    let ports = matches!(site.section, Some(Section::Input | Section::Output));
    if ports && site.at == 1 && site.is_glued(1) && matches!(site.code, "PMI-11" | "PMI-30") {
        let whole = site.around(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '.'));
        if whole.contains(['-', '.']) {
            let message = format!("`{whole}` is not a name");
            return explanation(message, "a name is a letter and up to five letters and digits");
        }
    }
    if site.code != "PMI-24" {
        return None;
    }
    let letters = site.found().trim_start_matches('@');
    let (kind, number) = letters.split_at_checked(1)?;
    let number: u16 = number.parse().ok()?;
    let last = match (kind, site.section) {
        ("M", Some(Section::MCode)) => 299,
        ("G", Some(Section::GCode)) => 199,
        ("M", _) => return help("M codes are declared after $MCODE"),
        ("G", _) => return help("G codes are declared after $GCODE"),
        _ => return None,
    };
    (number <= last).then(|| help(format!("write @{kind}{number:02}/P or @{kind}{number:02}/D")))?
}

/// Addresses that other languages use as operands: `I0.1`, `%Q0.1`.
fn address(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let fraction = |index| site.kind(index).is_some() && site.word(index).starts_with('.');
    let ports = matches!(site.section, Some(Section::Input | Section::Output));
    let executive = site.found().starts_with('@') || site.before().starts_with('@');
    if executive || !matches!(site.code, "PMI-12" | "PMI-30" | "PMI-31" | "PMI-34") {
        return None;
    }
    let percent = site.found() == "%"
        && matches!(site.kind(site.at + 1), Some(Kind::Name))
        && fraction(site.at + 2);
    let is_address = percent
        || ports && site.code == "PMI-30" && site.found().contains('.')
        || fraction(site.at + 1) && site.is_glued(site.at + 1)
        || fraction(site.at) && site.is_glued(site.at);
    if !is_address || matches!(site.section, Some(Section::Timer | Section::Key)) {
        return None;
    }
    let written = site.around(|c| c.is_ascii_alphanumeric() || matches!(c, '%' | '.' | '_'));
    if written.starts_with('.') && !ports {
        return None;
    }
    match site.section {
        Some(Section::Input | Section::Output) => {
            let digits = written.trim_start_matches(|c: char| !c.is_ascii_digit());
            let (port, bit) = digits.split_once('.').filter(|(_, bit)| !bit.is_empty())?;
            explanation(
                format!("`{written}` is not a line of a port"),
                format!("a line is written port/bit: {port}/{bit}"),
            )
        }
        Some(_) => None,
        None => {
            let help = "declare a name for the line after $INPUT or $OUTPUT (NAME = port/bit) and \
                        write the name";
            explanation(format!("the address `{written}` is not an operand"), help)
        }
    }
}

/// Indices in parentheses, and more than one of them.
fn index(site: &ErrorSite<'_, '_>) -> Option<Explanation> {
    let array = |index: usize| index.checked_sub(1).map_or("", |index| site.word(index));
    match (site.code, site.found()) {
        ("PMI-36", name) if site.after() == "(" => explanation(
            format!("the index of {name} is in parentheses"),
            format!("write {name}[…]"),
        ),
        ("PMI-11", "(") if site.at == 1 && site.section.is_none() => {
            let name = array(site.at);
            help(format!("an element of an array is written {name}[…]; nothing is called"))
        }
        ("PMI-5", ",") => {
            let open = (0..site.at).rev().find(|index| site.word(*index) == "[")?;
            let name = array(open);
            explanation(
                format!("{name} has one index"),
                format!("compute one index of several: {name}[10*ROW + COLUMN]"),
            )
        }
        ("PMI-11" | "PMI-34", "[") if site.before() == "]" => explanation(
            "an array has one index",
            "compute one index of several: LIST[10*ROW + COLUMN]",
        ),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_habits_are_well_formed() {
        assert!(super::HABITS.help("operator", "MOD").is_some());
        assert_eq!(super::HABITS.help("operator", "NAME"), None);
    }
}
