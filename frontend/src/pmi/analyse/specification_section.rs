//! The specification section (PMI 3.1): directives, faults, messages, keys, M and G codes, and what
//! all declarations share. `declaration.rs` and `ports.rs` read the others.

use plcc_abi::pmi::Type;
use plcc_diag::{Diagnostic, MessageText, Span};

use crate::common::{Limits, closest};
use crate::pmi::{
    analyse::names::{Names, RESERVED},
    ast::{Checked, Meaning, SymbolId},
    read::{
        cursor::Cursor,
        diagnostic::{self, error},
        lexer::text_of,
        token::{Kind, Token},
    },
};

pub(crate) type Result<T = ()> = std::result::Result<T, Box<Diagnostic>>;

/// A directive's part of the section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Section {
    Input,
    Output,
    Logical,
    Integer,
    Long,
    Fault,
    Message,
    Key,
    MCode,
    GCode,
    Timer,
    FlipFlop,
    AuxAxis,
    End,
}

impl Section {
    /// A help that says how its statements are written.
    fn form(self) -> &'static str {
        match self {
            Self::Input | Self::Output => {
                "write NAME = port/bit, or NAME = port/bit-bit/type for a group: TOOLN = 2/0-7/BCD"
            }
            Self::Logical | Self::Integer | Self::Long => {
                "write NAME, NAME[n], NAME = constant or NAME[n] = [constant, constant…], with \
                 commas between them"
            }
            Self::Fault | Self::Message => "write NAME = \"text\", VARIABLE, \"text\"…",
            Self::Key => "write NAME = \"text\"",
            Self::MCode => "write @M03/P or @M03/D, with commas between them",
            Self::GCode => "write @G84/P or @G84/D, with commas between them",
            Self::Timer => "write E/CONTROL/DELAYED = units of 20 ms, or D/CONTROL/DELAYED",
            Self::FlipFlop => "write five names: Q/D/CK/PR/CL",
            Self::AuxAxis => "write NAME = number, number…",
            Self::End => "put declarations in front of $END",
        }
    }
}

/// The directives, except `$INCLUDE`, which is done when the files are cut into statements.
const DIRECTIVES: [(&str, Section); 14] = [
    ("$INPUT", Section::Input),
    ("$OUTPUT", Section::Output),
    ("$LOGICAL", Section::Logical),
    ("$INTEGER", Section::Integer),
    ("$LONG", Section::Long),
    ("$FAULT", Section::Fault),
    ("$MESSAGE", Section::Message),
    ("$KEY", Section::Key),
    ("$MCODE", Section::MCode),
    ("$GCODE", Section::GCode),
    ("$TIMER", Section::Timer),
    ("$FLIPFLOP", Section::FlipFlop),
    ("$AUXAXIS", Section::AuxAxis),
    ("$END", Section::End),
];

/// A fault or message whose text may name variables that are declared later. They are looked up
/// when all declarations are read.
pub(crate) struct PendingAnnouncement {
    pub(crate) symbol: SymbolId,
    pub(crate) fault: bool,
    pub(crate) items: Vec<PendingItem>,
}

/// A part of such a text: characters, or the name of a variable and where it stands.
pub(crate) enum PendingItem {
    Text(String),
    Name(String, Span),
}

/// The specification section's state.
pub(crate) struct SpecificationSection<'a> {
    pub(crate) names: &'a mut Names,
    pub(crate) checked: &'a mut Checked,
    pub(crate) pending: Vec<PendingAnnouncement>,
    pub(crate) warnings: Vec<Diagnostic>,
    pub(crate) limits: Limits,
    /// The part that is being read; none before the first directive, or after an unknown one.
    pub(crate) section: Option<Section>,
    /// Whether the statements stand after a directive that is not known, so that nothing is known
    /// of them either.
    behind_unknown: bool,
    /// The directives so far, and where they stand.
    seen: Vec<(Section, Span)>,
    /// How many arrays are declared.
    pub(crate) arrays: u32,
    /// How many bytes all arrays together take.
    pub(crate) bytes: u64,
    /// Which lines the inputs and outputs use.
    pub(crate) ports: crate::pmi::analyse::ports::Ports,
}

impl<'a> SpecificationSection<'a> {
    pub(crate) fn new(names: &'a mut Names, checked: &'a mut Checked, limits: Limits) -> Self {
        Self {
            names,
            checked,
            pending: vec![],
            warnings: vec![],
            limits,
            section: None,
            behind_unknown: false,
            seen: vec![],
            arrays: 0,
            bytes: 0,
            ports: crate::pmi::analyse::ports::Ports::default(),
        }
    }

    /// Reads one statement.
    pub(crate) fn statement(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let result = self.read(cursor);
        if result.is_err()
            && let Some(section) = directive_meant(cursor)
        {
            self.section = Some(section);
            self.behind_unknown = false;
        }
        result
    }

    fn read(&mut self, cursor: &mut Cursor<'_>) -> Result {
        if cursor.kind() == Some(Kind::Directive) {
            return self.directive(cursor);
        }
        let Some(section) = self.section else {
            if self.behind_unknown {
                self.declare_unknown(cursor);
                // The form of the statement is not known, but text that is no token is always
                // wrong.
                let bad = |token: &Token| matches!(token.kind, Kind::Bad(_));
                let Some(at) = cursor.tokens.iter().position(bad) else { return Ok(()) };
                cursor.at = at;
                return Err(cursor.error_here(5, "").into());
            }
            let problem =
                cursor.error_here(3, format!("a directive is expected, not {}", cursor.found()));
            self.declare_unknown(cursor);
            return Err(Box::new(problem.help_if_none(
                "start with $INPUT, $OUTPUT, $INTEGER…; $END stands before the logic",
            )));
        };
        let result = match section {
            Section::Input | Section::Output => self.port_line(cursor, section),
            Section::Logical => self.variables(cursor, Type::Logical),
            Section::Integer => self.variables(cursor, Type::Integer),
            Section::Long => self.variables(cursor, Type::Long),
            Section::Fault | Section::Message => self.announcement(cursor, section),
            Section::Key => self.key(cursor),
            Section::MCode => self.codes(cursor, 'M', 299),
            Section::GCode => self.codes(cursor, 'G', 199),
            Section::Timer => self.timer(cursor),
            Section::FlipFlop => self.flipflop(cursor),
            Section::AuxAxis => self.auxiliary(cursor),
            Section::End => Ok(()),
        };
        if result.is_err() {
            self.declare_unknown(cursor);
        }
        result.map_err(|problem| Box::new(problem.help_if_none(section.form())))
    }

    fn directive(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let Some(token) = cursor.token() else { return Ok(()) };
        let word = cursor.slice(token);
        let span = cursor.span_of(token);
        let known = DIRECTIVES.iter().find(|(name, _)| *name == word);
        let Some(&(_, section)) = known else {
            let known = DIRECTIVES.iter().map(|(name, _)| *name);
            let near = closest(word, known.chain(["$INCLUDE"]));
            // The statements that follow are read as those of the directive with the nearest name.
            if near != Some("$INCLUDE") {
                self.section = near
                    .and_then(|near| DIRECTIVES.iter().find(|(name, _)| *name == near))
                    .map(|&(_, section)| section);
                self.behind_unknown = self.section.is_none();
            }
            let help = match near {
                Some(near) => format!("did you mean {near}?"),
                None => {
                    "the directives are $INPUT $OUTPUT $LOGICAL $INTEGER $LONG $FAULT $MESSAGE \
                         $KEY $MCODE $GCODE $TIMER $FLIPFLOP $AUXAXIS $INCLUDE $END"
                        .to_owned()
                }
            };
            return Err(error(1, span, format!("`{word}` is no directive")).help(help).into());
        };
        cursor.at += 1;
        self.section = Some(section);
        let earlier = self.seen.iter().find(|(seen, _)| *seen == section).map(|&(_, at)| at);
        if let Some(at) = earlier {
            return Err(error(23, span, format!("{word} stands a second time"))
                .label(at, "it stands here already")
                .help("put all its statements after the first one")
                .into());
        }
        self.seen.push((section, span));
        if section == Section::AuxAxis {
            self.warnings.push(
                Diagnostic::warning(
                    diagnostic::AUXAXIS,
                    span,
                    "$AUXAXIS is kept, but nothing acts on it",
                )
                .note("the manual does not give its statements: name = number[, number…]"),
            );
        }
        self.end(cursor)
    }

    /// Refuses anything more in the statement.
    pub(crate) fn end(&self, cursor: &Cursor<'_>) -> Result {
        match cursor.kind() {
            None => Ok(()),
            Some(_) => Err(cursor
                .error_here(5, format!("{} is too much in this statement", cursor.found()))
                .help_if_none("remove it, or put it on a line of its own")
                .into()),
        }
    }

    /// Declares all names in a statement with an error as unknown, so that no use of them is
    /// reported. Names with `@` are declared only where they can be M or G codes.
    fn declare_unknown(&mut self, cursor: &Cursor<'_>) {
        let codes = matches!(self.section, Some(Section::MCode | Section::GCode) | None);
        for token in cursor.tokens {
            if token.kind == Kind::Name || codes && token.kind == Kind::Executive {
                self.names.declare_unknown(cursor.slice(*token), cursor.span_of(*token));
            }
        }
    }

    /// Reads a name that the statement is to declare.
    pub(crate) fn new_name<'c>(&self, cursor: &mut Cursor<'c>) -> Result<(&'c str, Span)> {
        if cursor.kind() == Some(Kind::Executive) {
            let what = format!("{} belongs to the executive", cursor.found());
            return Err(cursor
                .error_here(10, what)
                .help("a name of the program starts with a letter")
                .into());
        }
        match cursor.name() {
            Some((name, span)) if RESERVED.contains(&name) => {
                Err(error(10, span, format!("{name} is a reserved word"))
                    .help("IF, ELSE, ELSEIF, ENDIF, GOTO, T and F cannot be declared")
                    .into())
            }
            Some(found) => Ok(found),
            None => Err(cursor
                .error_here(9, format!("a name is expected, not {}", cursor.found()))
                .into()),
        }
    }

    /// Declares a name; one that is declared already is an error.
    pub(crate) fn declare(
        &mut self,
        (name, span): (&str, Span),
        ty: Type,
        elements: Option<u32>,
        meaning: Meaning,
    ) -> Result<SymbolId> {
        self.names
            .declare(name, span, ty, elements, meaning)
            .map_err(|earlier| duplicate(name, span, earlier))
    }

    /// Refuses a name that is declared already. It is called before the rest of the statement is
    /// read, since the first error of a statement is the one that is reported.
    pub(crate) fn check_new(&self, (name, span): (&str, Span)) -> Result {
        let known = self.names.find(name).and_then(|id| self.names.get(id));
        match known.filter(|symbol| symbol.meaning != Meaning::Unknown) {
            Some(symbol) => Err(duplicate(name, span, symbol.declared)),
            None => Ok(()),
        }
    }

    /// Takes the token `kind`, which is written `what`.
    pub(crate) fn expect(&self, cursor: &mut Cursor<'_>, kind: Kind, what: &str) -> Result {
        if cursor.eat(kind) {
            return Ok(());
        }
        Err(cursor.error_here(11, format!("`{what}` is expected, not {}", cursor.found())).into())
    }

    /// Reads a number of a declaration. A minus sign is read too, since a negative number has the
    /// error of a number out of range.
    pub(crate) fn number(&self, cursor: &mut Cursor<'_>) -> Result<(i64, Span)> {
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
    fn announcement(&mut self, cursor: &mut Cursor<'_>, section: Section) -> Result {
        let name = self.new_name(cursor)?;
        let symbol = self.declare(name, Type::Logical, None, Meaning::Variable)?;
        self.expect(cursor, Kind::Eq, "=")?;
        let mut items = vec![];
        let mut length = 0;
        loop {
            let Some(token) = cursor.token() else {
                return Err(cursor.error_here(11, "a text or a variable is expected here").into());
            };
            match token.kind {
                Kind::Text => {
                    let text = text_of(cursor.slice(token));
                    length += text.chars().count();
                    items.push(PendingItem::Text(text));
                }
                Kind::Name | Kind::Executive => {
                    let name = cursor.slice(token).to_owned();
                    items.push(PendingItem::Name(name, cursor.span_of(token)));
                }
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
                break;
            }
            self.expect(cursor, Kind::Comma, ",")?;
        }
        if length > 40 {
            let what = format!("the text has {length} characters; the control shows 40");
            self.warnings.push(
                Diagnostic::warning(diagnostic::LONG_TEXT, cursor.statement_span(), what)
                    .help("what is after the 40th character is cut; shorten the text"),
            );
        }
        let fault = section == Section::Fault;
        self.pending.push(PendingAnnouncement { symbol, fault, items });
        Ok(())
    }

    /// `NAME = "TEXT"` of `$KEY`. The name is a constant: the number of the key, from 1.
    fn key(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let name = self.new_name(cursor)?;
        let position = self.checked.keys.len() as i32 + 1;
        self.declare(name, Type::Long, None, Meaning::Constant(vec![position]))?;
        self.checked.keys.push((name.0.to_owned(), String::new()));
        self.expect(cursor, Kind::Eq, "=")?;
        let text = match cursor.token() {
            Some(token) if token.kind == Kind::Text => text_of(cursor.slice(token)),
            _ => {
                let what = format!("a text in quotes is expected, not {}", cursor.found());
                return Err(cursor.error_here(11, what).into());
            }
        };
        cursor.at += 1;
        if let Some((_, slot)) = self.checked.keys.last_mut() {
            *slot = text;
        }
        self.end(cursor)
    }

    /// `@M03/P, @M05/D…`: M or G codes from 00 to `last`.
    fn codes(&mut self, cursor: &mut Cursor<'_>, letter: char, last: u32) -> Result {
        loop {
            let span = cursor.span();
            let name = match cursor.token() {
                Some(token) if token.kind == Kind::Executive => cursor.slice(token),
                _ => {
                    let what =
                        format!("a code like @{letter}03 is expected, not {}", cursor.found());
                    return Err(cursor.error_here(24, what).into());
                }
            };
            let digits = name.strip_prefix('@').and_then(|rest| rest.strip_prefix(letter));
            let valid = digits.is_some_and(|digits| {
                let canonical = digits.len() == 2 || digits.len() == 3 && !digits.starts_with('0');
                canonical && digits.parse::<u32>().is_ok_and(|number| number <= last)
            });
            if !valid {
                return Err(error(24, span, format!("`{name}` is no {letter} code"))
                    .help(format!("they are @{letter}00 to @{letter}{last}"))
                    .into());
            }
            cursor.at += 1;
            self.declare((name, span), Type::Logical, None, Meaning::ResetOnly)?;
            let when = if cursor.eat(Kind::Slash) { cursor.name() } else { None };
            if !matches!(when, Some(("P" | "D", _))) {
                let place = when.map_or(cursor.span(), |(_, span)| span);
                let what = format!("{name} needs /P (prompt) or /D (delayed)");
                let mut problem = cursor.error_here(25, what);
                // The error points at a wrong word, not at what stands after it.
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
            self.expect(cursor, Kind::Comma, ",")?;
        }
    }
}

/// The directive that a statement with an error was meant to be: one in small letters, or one with
/// something in front of it. The statements that follow are read as its own.
fn directive_meant(cursor: &Cursor<'_>) -> Option<Section> {
    let statement = cursor.statement_span();
    let first = cursor.text.get(statement.range()).filter(|text| text.starts_with('$'));
    let directive = cursor.tokens.iter().find(|token| token.kind == Kind::Directive);
    let text = first.or_else(|| directive.map(|token| cursor.slice(*token)))?;
    let end = text.bytes().skip(1).take_while(u8::is_ascii_alphanumeric).count() + 1;
    let word = text.get(..end)?.to_ascii_uppercase();
    DIRECTIVES.iter().find(|(name, _)| *name == word).map(|&(_, section)| section)
}

/// The error of a name that is declared already, at `earlier` or by the executive.
fn duplicate(name: &str, span: Span, earlier: Option<Span>) -> Box<Diagnostic> {
    let problem = error(10, span, format!("{name} is declared a second time"));
    let problem = match earlier {
        Some(at) => problem.label(at, "it is declared here already"),
        None => problem.note("it belongs to the executive"),
    };
    Box::new(problem.help("give one of the two another name"))
}

/// The error of an array, or an element of one, in a text.
pub(crate) fn array_in_text(span: Span) -> Diagnostic {
    error(11, span, "an array has no place in a fault's or message's text")
        .help("copy the element to a variable and name that")
}

/// Adds a help without replacing the one that an error has.
pub(crate) trait HelpIfNone {
    /// The same with `text` as its help, unless it has one.
    fn help_if_none(self, text: impl Into<MessageText>) -> Self;
}

impl HelpIfNone for Diagnostic {
    fn help_if_none(self, text: impl Into<MessageText>) -> Self {
        if self.help.is_some() { self } else { self.help(text) }
    }
}
