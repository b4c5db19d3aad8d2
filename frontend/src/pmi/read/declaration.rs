//! Reads the statements of the specification section (PMI 3.1).

use plcc_abi::pmi::{TimerKind, Type};
use plcc_diag::{Diagnostic, Span};

use crate::common::{Limits, closest};
use crate::pmi::read::{
    cursor::Cursor,
    diagnostic::{HelpIfNone, Result, error},
    lexer::text_of,
    ports::port_lines,
    section::{DIRECTIVES, Section, directive_meant},
    syntax::{Declaration, DeclarationForm, PortLines, TextItem, Timer, VariableDeclaration},
    token::{Kind, RESERVED, Token},
};

/// How many elements an array may have for the original compiler (PMI 2.2.7).
const ELEMENTS: std::ops::RangeInclusive<u32> = 2..=255;

/// Reads the statements of the specification section one after the other.
pub(super) struct DeclarationReader {
    limits: Limits,
    /// The part that is being read; none before the first directive, or after an unknown one.
    pub(super) section: Option<Section>,
    /// Whether the statements are after a directive that is not known, so that nothing is known of
    /// them either.
    is_after_unknown: bool,
}

impl DeclarationReader {
    pub(super) fn new(limits: Limits) -> Self {
        Self { limits, section: None, is_after_unknown: false }
    }

    /// Reads one statement, and returns what is wrong with its form too.
    pub(super) fn read(
        &mut self,
        cursor: &mut Cursor<'_>,
    ) -> (Declaration, Option<Box<Diagnostic>>) {
        let section = self.section;
        let (form, result) = match section {
            _ if cursor.kind() == Some(Kind::Directive) => self.directive(cursor),
            Some(section) => self.form(cursor, section),
            None => (DeclarationForm::Unknown, self.unknown(cursor)),
        };
        if result.is_err()
            && let Some(section) = directive_meant(cursor)
        {
            self.section = Some(section);
            self.is_after_unknown = false;
        }
        (Declaration { section, form }, result.err())
    }

    /// A statement as those of a part of the section are written.
    fn form(&self, cursor: &mut Cursor<'_>, section: Section) -> (DeclarationForm, Result) {
        match section {
            Section::Input | Section::Output => {
                let mut lines = PortLines::default();
                let result = port_lines(cursor, &mut lines);
                (DeclarationForm::Lines(lines), result)
            }
            Section::Logical => self.variables(cursor, Type::Logical),
            Section::Integer => self.variables(cursor, Type::Integer),
            Section::Long => self.variables(cursor, Type::Long),
            Section::Fault | Section::Message => {
                let (mut name, mut items) = (None, vec![]);
                let result = announcement(cursor, &mut name, &mut items);
                (DeclarationForm::Announcement { name, items }, result)
            }
            Section::Key => {
                let (mut name, mut text) = (None, None);
                let result = key(cursor, &mut name, &mut text);
                (DeclarationForm::Key { name, text }, result)
            }
            Section::MCode | Section::GCode => {
                let mut found = vec![];
                let (letter, last) =
                    if section == Section::MCode { ('M', 299) } else { ('G', 199) };
                let result = codes(cursor, letter, last, &mut found);
                (DeclarationForm::Codes(found), result)
            }
            Section::Timer => {
                let mut found = Timer::default();
                let result = timer(cursor, &mut found);
                (DeclarationForm::Timer(found), result)
            }
            Section::FlipFlop => {
                let mut pins = vec![];
                let result = flipflop(cursor, &mut pins);
                (DeclarationForm::FlipFlop(pins), result)
            }
            Section::AuxAxis => {
                let (mut name, mut numbers) = (None, vec![]);
                let result = auxiliary(cursor, &mut name, &mut numbers);
                (DeclarationForm::Auxiliary { name, numbers }, result)
            }
            Section::End => (DeclarationForm::Unknown, Ok(())),
        }
    }

    /// The error of a statement before the first directive, or after an unknown one.
    fn unknown(&self, cursor: &mut Cursor<'_>) -> Result {
        if self.is_after_unknown {
            // The form of the statement is not known, but text that is not a token is always wrong.
            let bad = |token: &Token| matches!(token.kind, Kind::Bad(_));
            let Some(at) = cursor.tokens.iter().position(bad) else { return Ok(()) };
            cursor.at = at;
            return Err(cursor.error_here(5, "").into());
        }
        let what = format!("a directive is expected, not {}", cursor.found());
        let help = "start with $INPUT, $OUTPUT, $INTEGER…; $END comes before the logic";
        Err(cursor.error_here(3, what).help_if_none(help).into())
    }

    fn directive(&mut self, cursor: &mut Cursor<'_>) -> (DeclarationForm, Result) {
        let Some(token) = cursor.token() else { return (DeclarationForm::Unknown, Ok(())) };
        let word = cursor.slice(token);
        let known = DIRECTIVES.iter().find(|(name, _)| *name == word);
        if let Some(&(_, section)) = known {
            cursor.at += 1;
            self.section = Some(section);
            return (DeclarationForm::Directive(Some(section)), end(cursor));
        }
        let known = DIRECTIVES.iter().map(|(name, _)| *name);
        let near = closest(word, known.chain(["$INCLUDE"]));
        // The statements that follow are read as those of the directive with the nearest name.
        if near != Some("$INCLUDE") {
            self.section = near
                .and_then(|near| DIRECTIVES.iter().find(|(name, _)| *name == near))
                .map(|&(_, section)| section);
            self.is_after_unknown = self.section.is_none();
        }
        let problem = error(1, cursor.span_of(token), format!("`{word}` is not a directive"));
        let problem = match near {
            Some(near) => problem.did_you_mean(near.to_owned()),
            None => problem.help(
                "the directives are $INPUT $OUTPUT $LOGICAL $INTEGER $LONG $FAULT $MESSAGE $KEY \
                 $MCODE $GCODE $TIMER $FLIPFLOP $AUXAXIS $INCLUDE $END",
            ),
        };
        (DeclarationForm::Directive(None), Err(problem.into()))
    }

    /// `NAME`, `NAME = constant`, `NAME[n]`, `NAME[n] = [constants]`, with commas between them.
    fn variables(&self, cursor: &mut Cursor<'_>, ty: Type) -> (DeclarationForm, Result) {
        let mut variables = vec![];
        let result = loop {
            match self.variable(cursor, ty, &mut variables) {
                Ok(true) => {}
                Ok(false) => break Ok(()),
                Err(problem) => break Err(problem),
            }
        };
        (DeclarationForm::Variables(variables), result)
    }

    /// One of them. Returns whether another one follows.
    fn variable(
        &self,
        cursor: &mut Cursor<'_>,
        ty: Type,
        variables: &mut Vec<VariableDeclaration>,
    ) -> Result<bool> {
        let name = new_name(cursor)?;
        let variable =
            VariableDeclaration { ty, name, elements: None, constants: None, is_whole: false };
        variables.push(variable);
        let Some(variable) = variables.last_mut() else { return Ok(false) };
        if cursor.kind() == Some(Kind::LBracket) {
            variable.elements = Some(self.elements(cursor, name)?);
        }
        if cursor.eat(Kind::Eq) {
            let is_array = variable.elements.is_some();
            variable.constants = Some(constants(cursor, ty, is_array)?);
        }
        variable.is_whole = true;
        if cursor.kind().is_none() {
            return Ok(false);
        }
        if !cursor.eat(Kind::Comma) {
            let what = format!("`,` is expected, not {}", cursor.found());
            return Err(cursor.error_here(11, what).into());
        }
        Ok(true)
    }

    /// `[n]` of a declaration.
    fn elements(&self, cursor: &mut Cursor<'_>, name: Token) -> Result<u32> {
        cursor.at += 1;
        let (written, span) = number(cursor)?;
        let count = u32::try_from(written).unwrap_or(0);
        let allowed = match self.limits {
            Limits::Original => ELEMENTS.contains(&count),
            Limits::None => count > 0,
        };
        if !allowed {
            let help = match self.limits {
                Limits::Original => "an array has 2 to 255 elements; `--limits none` allows any",
                Limits::None => "an array has at least one element",
            };
            let what = format!("{} cannot have {written} elements", cursor.slice(name));
            return Err(error(19, span, what).help(help).into());
        }
        expect(cursor, Kind::RBracket, "]")?;
        Ok(count)
    }
}

/// The value of a constant, or the values of an array of constants, each with its place.
fn constants(cursor: &mut Cursor<'_>, ty: Type, is_array: bool) -> Result<Vec<(i32, Span)>> {
    if !is_array {
        return Ok(vec![constant(cursor, ty)?]);
    }
    expect(cursor, Kind::LBracket, "[")?;
    let mut values = vec![];
    loop {
        values.push(constant(cursor, ty)?);
        if cursor.eat(Kind::RBracket) {
            return Ok(values);
        }
        if !cursor.eat(Kind::Comma) {
            let what = format!("`,` or `]` is expected, not {}", cursor.found());
            return Err(cursor.error_here(11, what).into());
        }
    }
}

/// The value of a constant of type `ty`, with its sign, and its place.
fn constant(cursor: &mut Cursor<'_>, ty: Type) -> Result<(i32, Span)> {
    let start = cursor.span();
    let negative = cursor.eat(Kind::Minus);
    let span = start.to(cursor.span());
    let value = match cursor.token() {
        Some(token) => match (token.kind, cursor.slice(token)) {
            (Kind::Number(value), _) => {
                let value = i64::from(value);
                if negative { -value } else { value }
            }
            (Kind::Name, "T") if ty == Type::Logical && !negative => 1,
            (Kind::Name, "F") if ty == Type::Logical && !negative => 0,
            (Kind::Name | Kind::Executive | Kind::Text, _) => {
                let what = format!("{} is not a constant of this type", cursor.found());
                return Err(error(30, span, what).help(range_of(ty)).into());
            }
            _ => {
                let what = format!("a constant is expected, not {}", cursor.found());
                return Err(cursor.error_here(12, what).into());
            }
        },
        None => return Err(cursor.error_here(12, "a constant is expected here").into()),
    };
    cursor.at += 1;
    let fits = match ty {
        Type::Logical => (0..=1).contains(&value) && !negative,
        Type::Integer => (-32_767..=32_767).contains(&value),
        Type::Long => (-2_147_483_647..=2_147_483_647).contains(&value),
    };
    if !fits {
        let what = format!("{value} is not a constant of this type");
        return Err(error(30, span, what).help(range_of(ty)).into());
    }
    Ok((value as i32, span))
}

/// The values that a constant of a type may have, as a help says it.
fn range_of(ty: Type) -> &'static str {
    match ty {
        Type::Logical => "a LOGICAL is 0, 1, T or F",
        Type::Integer => "an INTEGER is -32767 to 32767; a LONG holds more",
        Type::Long => "a LONG is -2147483647 to 2147483647",
    }
}

/// Refuses anything more in the statement.
pub(super) fn end(cursor: &Cursor<'_>) -> Result {
    match cursor.kind() {
        None => Ok(()),
        Some(_) => Err(cursor
            .error_here(5, format!("{} is too much in this statement", cursor.found()))
            .help_if_none("remove it, or put it on a line of its own")
            .into()),
    }
}

/// Reads a name that the statement is to declare.
pub(super) fn new_name(cursor: &mut Cursor<'_>) -> Result<Token> {
    let token = cursor.token();
    if cursor.kind() == Some(Kind::Executive) {
        let what = format!("{} belongs to the executive", cursor.found());
        let help = "a name of the program starts with a letter";
        return Err(cursor.error_here(10, what).help(help).into());
    }
    match cursor.name().zip(token) {
        Some(((name, span), _)) if RESERVED.contains(&name) => {
            Err(error(10, span, format!("{name} is a reserved word"))
                .help("IF, ELSE, ELSEIF, ENDIF, GOTO, T and F cannot be declared")
                .into())
        }
        Some((_, token)) => Ok(token),
        None => {
            Err(cursor.error_here(9, format!("a name is expected, not {}", cursor.found())).into())
        }
    }
}

/// Takes the token `kind`, which is written `what`.
pub(super) fn expect(cursor: &mut Cursor<'_>, kind: Kind, what: &str) -> Result {
    if cursor.eat(kind) {
        return Ok(());
    }
    Err(cursor.error_here(11, format!("`{what}` is expected, not {}", cursor.found())).into())
}

/// Reads a number of a declaration. A minus sign is read too, since a negative number has the
/// error of a number out of range.
pub(super) fn number(cursor: &mut Cursor<'_>) -> Result<(i64, Span)> {
    let span = cursor.span();
    match (cursor.kind(), cursor.second_kind()) {
        (Some(Kind::Number(value)), _) => {
            cursor.at += 1;
            Ok((value.into(), span))
        }
        (Some(Kind::Minus), Some(Kind::Number(value))) => {
            cursor.at += 2;
            Ok((-i64::from(value), span))
        }
        _ => Err(cursor
            .error_here(12, format!("a number is expected, not {}", cursor.found()))
            .into()),
    }
}

/// `NAME = "TEXT", VARIABLE…` of a fault or message.
fn announcement(
    cursor: &mut Cursor<'_>,
    name: &mut Option<Token>,
    items: &mut Vec<TextItem>,
) -> Result {
    *name = Some(new_name(cursor)?);
    expect(cursor, Kind::Eq, "=")?;
    loop {
        let Some(token) = cursor.token() else {
            return Err(cursor.error_here(11, "a text or a variable is expected here").into());
        };
        match token.kind {
            Kind::Text => items.push(TextItem::Text(text_of(cursor.slice(token)))),
            Kind::Name | Kind::Executive => items.push(TextItem::Name(token)),
            _ => {
                let what = format!("a text or a variable is expected, not {}", cursor.found());
                return Err(cursor.error_here(11, what).into());
            }
        }
        cursor.at += 1;
        if cursor.kind() == Some(Kind::LBracket) {
            return Err(array_in_text(cursor.span_of(token)).into());
        }
        if cursor.kind().is_none() {
            return Ok(());
        }
        expect(cursor, Kind::Comma, ",")?;
    }
}

/// `NAME = "TEXT"` of `$KEY`.
fn key(cursor: &mut Cursor<'_>, name: &mut Option<Token>, text: &mut Option<String>) -> Result {
    *name = Some(new_name(cursor)?);
    expect(cursor, Kind::Eq, "=")?;
    match cursor.token() {
        Some(token) if token.kind == Kind::Text => *text = Some(text_of(cursor.slice(token))),
        _ => {
            let what = format!("a text in quotes is expected, not {}", cursor.found());
            return Err(cursor.error_here(11, what).into());
        }
    }
    cursor.at += 1;
    end(cursor)
}

/// `@M03/P, @M05/D…`: M or G codes from 00 to `last`.
fn codes(
    cursor: &mut Cursor<'_>,
    letter: char,
    last: u32,
    found: &mut Vec<(Token, bool)>,
) -> Result {
    loop {
        let span = cursor.span();
        let Some(token) = cursor.token().filter(|token| token.kind == Kind::Executive) else {
            let what = format!("a code like @{letter}03 is expected, not {}", cursor.found());
            return Err(cursor.error_here(24, what).into());
        };
        let name = cursor.slice(token);
        let digits = name.strip_prefix('@').and_then(|rest| rest.strip_prefix(letter));
        let valid = digits.is_some_and(|digits| {
            let canonical = digits.len() == 2 || digits.len() == 3 && !digits.starts_with('0');
            canonical && digits.parse::<u32>().is_ok_and(|number| number <= last)
        });
        if !valid {
            return Err(error(24, span, format!("`{name}` is not one of the {letter} codes"))
                .help(format!("they are @{letter}00 to @{letter}{last}"))
                .into());
        }
        cursor.at += 1;
        let when = if cursor.eat(Kind::Slash) { cursor.name() } else { None };
        found.push((token, matches!(when, Some(("D", _)))));
        if !matches!(when, Some(("P" | "D", _))) {
            let place = when.map_or(cursor.span(), |(_, span)| span);
            let what = format!("{name} needs /P (prompt) or /D (delayed)");
            let mut problem = cursor.error_here(25, what);
            // The error points at a wrong word, not at what follows it.
            if when.is_some() {
                problem.span = place;
            }
            return Err(problem
                .help_if_none(
                    "P: before the block's motion, D: after it; write for instance @M03/P",
                )
                .into());
        }
        if cursor.kind().is_none() {
            return Ok(());
        }
        expect(cursor, Kind::Comma, ",")?;
    }
}

/// `E/TC/DC = P`: type, control contact, delayed contact, delay in units of 20 ms.
fn timer(cursor: &mut Cursor<'_>, found: &mut Timer) -> Result {
    let span = cursor.span();
    found.kind = Some(match cursor.name() {
        Some(("E", _)) => TimerKind::E,
        Some(("D", _)) => TimerKind::D,
        Some((other, _)) => {
            return Err(error(21, span, format!("`{other}` is not a type of timer"))
                .help("E delays switching on, D switching off: E/TC/DC = 50")
                .into());
        }
        None => {
            let what = format!("E or D is expected, not {}", cursor.found());
            return Err(cursor.error_here(21, what).into());
        }
    });
    expect(cursor, Kind::Slash, "/")?;
    found.control = Some(new_name(cursor)?);
    expect(cursor, Kind::Slash, "/")?;
    found.delayed = Some(new_name(cursor)?);
    expect(cursor, Kind::Eq, "=")?;
    let (preset, span) = number(cursor)?;
    if !(1..=32_767).contains(&preset) {
        return Err(error(22, span, format!("{preset} is not a delay"))
            .help("a delay is 1 to 32767 units of 20 ms")
            .into());
    }
    found.preset = Some((preset as i32, span));
    end(cursor)
}

/// `Q/D/CK/PR/CL`: output, data, clock, preset, clear.
fn flipflop(cursor: &mut Cursor<'_>, pins: &mut Vec<Token>) -> Result {
    pins.push(new_name(cursor)?);
    for _ in 1..5 {
        expect(cursor, Kind::Slash, "/")?;
        pins.push(new_name(cursor)?);
    }
    end(cursor)
}

/// `NAME = NUMBER, NUMBER…` of `$AUXAXIS`.
fn auxiliary(cursor: &mut Cursor<'_>, name: &mut Option<Token>, numbers: &mut Vec<i32>) -> Result {
    *name = Some(new_name(cursor)?);
    expect(cursor, Kind::Eq, "=")?;
    loop {
        numbers.push(constant(cursor, Type::Long)?.0);
        if cursor.kind().is_none() {
            return Ok(());
        }
        expect(cursor, Kind::Comma, ",")?;
    }
}

/// The error of an array, or an element of one, in a text.
pub(crate) fn array_in_text(span: Span) -> Diagnostic {
    error(11, span, "an array has no place in a fault's or message's text")
        .help("copy the element to a variable and name that")
}
