//! The specification section (PMI 3.1): directives, faults, messages, keys, M and G codes, and what
//! all declarations share. `declaration.rs` and `ports.rs` check the others.

use plcc_abi::pmi::{DeclaredCode, Type};
use plcc_diag::{Diagnostic, Span};

use crate::common::Limits;
use crate::pmi::{
    analyse::{names::Names, ports::Ports},
    ast::{Checked, Meaning, SymbolId},
    read::{
        cursor::Cursor,
        diagnostic::{self, HelpIfNone, Result, error},
        section::Section,
        syntax::{Declaration, DeclarationForm, TextItem},
        token::{Kind, Token},
    },
};

/// A fault or message whose text may name variables that are declared later. They are looked up
/// when all declarations are read.
pub(crate) struct PendingAnnouncement {
    pub(crate) symbol: SymbolId,
    pub(crate) fault: bool,
    pub(crate) items: Vec<PendingItem>,
}

/// A part of such a text: characters, or the name of a variable and its place.
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
    /// The directives so far, and their places.
    seen: Vec<(Section, Span)>,
    /// How many arrays are declared.
    pub(crate) arrays: u32,
    /// How many bytes all arrays together take.
    pub(crate) bytes: u64,
    /// Which lines the inputs and outputs use.
    pub(crate) ports: Ports,
}

impl<'a> SpecificationSection<'a> {
    pub(crate) fn new(names: &'a mut Names, checked: &'a mut Checked, limits: Limits) -> Self {
        Self {
            names,
            checked,
            pending: vec![],
            warnings: vec![],
            limits,
            seen: vec![],
            arrays: 0,
            bytes: 0,
            ports: Ports::default(),
        }
    }

    /// Whether a statement in front of $END looks as if it belonged after it: it begins with a keyword of the logic or with
    /// a name that is declared already.
    pub(crate) fn looks_like_logic(&self, cursor: &Cursor<'_>) -> bool {
        let Some(word) = cursor.tokens.first().map(|&token| cursor.slice(token)) else {
            return false;
        };
        let is_keyword = matches!(word, "IF" | "ELSEIF" | "ELSE" | "ENDIF" | "GOTO");
        is_keyword || self.names.find(word).is_some()
    }

    /// Checks one statement. `error` is what is wrong with its form.
    pub(crate) fn statement(
        &mut self,
        cursor: &Cursor<'_>,
        declaration: &mut Declaration,
        error: Option<Box<Diagnostic>>,
    ) -> Result {
        let form = match error {
            None => Ok(()),
            Some(error) => Err(error),
        };
        let result = match &mut declaration.form {
            DeclarationForm::Directive(section) => return self.directive(cursor, *section, form),
            DeclarationForm::Unknown => {
                self.declare_unknown(cursor, declaration.section);
                return form;
            }
            DeclarationForm::Variables(variables) => self.variables(cursor, variables, form),
            DeclarationForm::Lines(lines) => {
                self.port_lines(cursor, lines, declaration.section == Some(Section::Output), form)
            }
            DeclarationForm::Announcement { name, items } => {
                let is_fault = declaration.section == Some(Section::Fault);
                self.announcement(cursor, *name, std::mem::take(items), is_fault, form)
            }
            DeclarationForm::Key { name, text } => self.key(cursor, *name, text.take(), form),
            DeclarationForm::Codes(codes) => self.codes(cursor, codes, form),
            DeclarationForm::Timer(timer) => self.timer(cursor, timer, form),
            DeclarationForm::FlipFlop(pins) => self.flipflop(cursor, pins, form),
            DeclarationForm::Auxiliary { name, numbers } => form.map(|()| {
                let name = name.map_or("", |name| cursor.slice(name)).to_owned();
                self.checked.auxiliary.push((name, std::mem::take(numbers)));
            }),
        };
        if result.is_err() {
            self.declare_unknown(cursor, declaration.section);
        }
        let help = declaration.section.map(Section::form);
        result.map_err(|problem| match help {
            Some(help) => Box::new(problem.help_if_none(help)),
            None => problem,
        })
    }

    fn directive(&mut self, cursor: &Cursor<'_>, section: Option<Section>, form: Result) -> Result {
        let (Some(section), Some(token)) = (section, cursor.tokens.first()) else { return form };
        let (word, span) = (cursor.slice(*token), cursor.span_of(*token));
        let earlier = self.seen.iter().find(|(seen, _)| *seen == section).map(|&(_, at)| at);
        if let Some(at) = earlier {
            return Err(error(23, span, format!("{word} is here a second time"))
                .label(at, "it is here already")
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
        form
    }

    /// Declares all names in a statement with an error as unknown, so that no use of them is
    /// reported. Names with `@` are declared only where they can be M or G codes.
    fn declare_unknown(&mut self, cursor: &Cursor<'_>, section: Option<Section>) {
        let codes = matches!(section, Some(Section::MCode | Section::GCode) | None);
        for token in cursor.tokens {
            if token.kind == Kind::Name || codes && token.kind == Kind::Executive {
                self.names.declare_unknown(cursor.slice(*token), cursor.span_of(*token));
            }
        }
    }

    /// Declares a name; one that is declared already is an error.
    pub(crate) fn declare(
        &mut self,
        cursor: &Cursor<'_>,
        name: Token,
        ty: Type,
        elements: Option<u32>,
        meaning: Meaning,
    ) -> Result<SymbolId> {
        let (name, span) = (cursor.slice(name), cursor.span_of(name));
        self.names
            .declare(name, span, ty, elements, meaning)
            .map_err(|earlier| duplicate(name, span, earlier))
    }

    /// Refuses a name that is declared already. It is called before the rest of the statement is
    /// checked, since the first error of a statement is the one that is reported.
    pub(crate) fn check_new(&self, cursor: &Cursor<'_>, name: Token) -> Result {
        let (name, span) = (cursor.slice(name), cursor.span_of(name));
        let known = self.names.find(name).and_then(|id| self.names.get(id));
        match known.filter(|symbol| symbol.meaning != Meaning::Unknown) {
            Some(symbol) => Err(duplicate(name, span, symbol.declared)),
            None => Ok(()),
        }
    }

    /// A fault or message.
    fn announcement(
        &mut self,
        cursor: &Cursor<'_>,
        name: Option<Token>,
        items: Vec<TextItem>,
        is_fault: bool,
        form: Result,
    ) -> Result {
        let Some(name) = name else { return form };
        let symbol = self.declare(cursor, name, Type::Logical, None, Meaning::Variable)?;
        form?;
        let length = |item: &TextItem| match item {
            TextItem::Text(text) => text.chars().count(),
            TextItem::Name(_) => 0,
        };
        let length: usize = items.iter().map(length).sum();
        if length > 40 {
            let what = format!("the text has {length} characters; the control shows 40");
            self.warnings.push(
                Diagnostic::warning(diagnostic::LONG_TEXT, cursor.statement_span(), what)
                    .help("what is after the 40th character is cut; shorten the text"),
            );
        }
        let items = items.into_iter().map(|item| match item {
            TextItem::Text(text) => PendingItem::Text(text),
            TextItem::Name(name) => {
                PendingItem::Name(cursor.slice(name).to_owned(), cursor.span_of(name))
            }
        });
        let items = items.collect();
        self.pending.push(PendingAnnouncement { symbol, fault: is_fault, items });
        Ok(())
    }

    /// A key. Its name is a constant: the number of the key, from 1.
    fn key(
        &mut self,
        cursor: &Cursor<'_>,
        name: Option<Token>,
        text: Option<String>,
        form: Result,
    ) -> Result {
        let Some(name) = name else { return form };
        let position = self.checked.keys.len() as i32 + 1;
        self.declare(cursor, name, Type::Long, None, Meaning::Constant(vec![position]))?;
        self.checked.keys.push((cursor.slice(name).to_owned(), text.unwrap_or_default()));
        form
    }

    /// M or G codes.
    fn codes(&mut self, cursor: &Cursor<'_>, codes: &[(Token, bool)], form: Result) -> Result {
        for &(code, delayed) in codes {
            self.declare(cursor, code, Type::Logical, None, Meaning::ResetOnly)?;
            let mut name = cursor.slice(code).chars();
            let letter = name.nth(1);
            if let (Some(letter), Ok(number)) = (letter, name.as_str().parse()) {
                self.checked.codes.push(DeclaredCode { letter, number, delayed });
            }
        }
        form
    }
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
