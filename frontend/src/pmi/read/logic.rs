//! Reads the statements of the execution section (PMI 3.3): assignments, IF, GOTO, labels.

use plcc_diag::Diagnostic;

use crate::common::Limits;
use crate::pmi::read::{
    cursor::Cursor,
    diagnostic::{HelpIfNone, Result, error},
    expression::{ExpressionReader, Until},
    syntax::{Expression, Logic, LogicForm, Part},
    token::{Kind, RESERVED, Token},
};

/// Reads one statement. It takes tokens from `cursor` and adds to `parts`.
pub(super) struct LogicReader<'r, 'c> {
    cursor: &'r mut Cursor<'c>,
    parts: &'r mut Vec<Part>,
    limits: Limits,
}

/// The keyword that the next token is, if it is one that begins a statement.
fn keyword<'c>(cursor: &Cursor<'c>) -> Option<&'c str> {
    let token = cursor.token().filter(|token| token.kind == Kind::Name)?;
    let word = cursor.slice(token);
    matches!(word, "IF" | "ELSEIF" | "ELSE" | "ENDIF" | "GOTO").then_some(word)
}

/// The labels in front of a statement, and the variable that it assigns.
fn declared(cursor: &Cursor<'_>) -> (Vec<Token>, Option<Token>) {
    let tokens = cursor.tokens;
    let is = |index: usize, kind| tokens.get(index).is_some_and(|token| token.kind == kind);
    let mut labels = vec![];
    let mut at = 0;
    while is(at, Kind::Name) && is(at + 1, Kind::Colon) {
        labels.extend(tokens.get(at));
        at += 2;
    }
    let assigned = tokens.get(at).filter(|_| is(at, Kind::Name) && is(at + 1, Kind::Eq));
    (labels, assigned.copied())
}

impl<'r, 'c> LogicReader<'r, 'c> {
    pub(super) fn new(
        cursor: &'r mut Cursor<'c>,
        parts: &'r mut Vec<Part>,
        limits: Limits,
    ) -> Self {
        Self { cursor, parts, limits }
    }

    /// Reads the statement, and returns what is wrong with its form too.
    pub(super) fn read(mut self) -> (Logic, Option<Box<Diagnostic>>) {
        let (labels, assigned) = declared(self.cursor);
        if !labels.is_empty() {
            self.cursor.at = 2;
        }
        let mut form = LogicForm::Other { ends_if: false };
        let result = self.form(&mut form);
        (Logic { labels, assigned, form }, result.err())
    }

    /// Reads all after a label. An error leaves in `form` what was read in front of it.
    fn form(&mut self, form: &mut LogicForm) -> Result {
        let (Some(word), Some(begins)) = (self.cursor.token(), keyword(self.cursor)) else {
            return self.without_keyword(form);
        };
        self.cursor.at += 1;
        match begins {
            "IF" => {
                let mut condition = None;
                let result = self.condition(begins, &mut condition);
                *form = LogicForm::If { word, condition };
                result
            }
            "ELSEIF" => {
                let mut condition = None;
                let result = self.condition(begins, &mut condition);
                *form = LogicForm::ElseIf { word, condition };
                result
            }
            "ELSE" => {
                let is_else_if = keyword(self.cursor) == Some("IF");
                *form = LogicForm::Else { word, is_else_if };
                self.end(begins, is_else_if.then_some("write ELSEIF as one word"))
            }
            "ENDIF" => {
                *form = LogicForm::EndIf { word };
                self.end(begins, None)
            }
            _ => self.goto(word, form),
        }
    }

    /// An assignment, or the error of what does not begin a statement.
    fn without_keyword(&mut self, form: &mut LogicForm) -> Result {
        let (number, what, help) = match self.cursor.kind() {
            None => return Ok(()),
            Some(Kind::Name | Kind::Executive) => return self.assignment(form),
            Some(Kind::Directive) => (
                1,
                format!("{} comes after $END", self.cursor.found()),
                "directives belong in front of $END; only $INCLUDE is allowed here",
            ),
            Some(_) => (
                9,
                format!("a name is expected, not {}", self.cursor.found()),
                "a statement is an assignment, an IF, ELSEIF, ELSE, ENDIF or a GOTO",
            ),
        };
        Err(self.cursor.error_here(number, what).help_if_none(help).into())
    }

    fn expression(&mut self, until: Until) -> Expression {
        ExpressionReader::new(self.cursor, self.parts, self.limits).read(until)
    }

    fn assignment(&mut self, form: &mut LogicForm) -> Result {
        let Some(name) = self.cursor.token() else { return Ok(()) };
        let next = self.cursor.second_kind();
        let indexed = next == Some(Kind::LBracket);
        if !indexed && next != Some(Kind::Eq) {
            return self.no_assignment(name, form);
        }
        self.cursor.at += 1;
        let (mut index, mut value) = (None, None);
        if indexed {
            self.cursor.at += 1;
            index = Some(self.expression(Until::Index));
        }
        let mut result = Ok(());
        if index.as_ref().is_none_or(|index| index.error.is_none()) {
            if self.cursor.kind() == Some(Kind::Eq) {
                self.cursor.at += 1;
                value = Some(self.expression(Until::End));
            } else {
                let what = format!("`=` is expected, not {}", self.cursor.found());
                result = Err(self.cursor.error_here(11, what).into());
            }
        }
        *form = LogicForm::Assignment { name, index, value };
        result
    }

    /// The error of a name after which there is neither `=` nor `[`.
    fn no_assignment(&mut self, first: Token, form: &mut LogicForm) -> Result {
        let name = self.cursor.slice(first);
        let written = first.start as usize..self.cursor.statement.end as usize;
        let written = self.cursor.text.get(written).unwrap_or("");
        let mut words = written.trim_end_matches(';').split_whitespace();
        // Nobody needs to be told that an IF has no ENDIF that this was meant to end.
        let ends_if = matches!(
            [words.next(), words.next(), words.next()],
            [Some("END_IF"), None, None] | [Some("END"), Some("IF"), None]
        );
        *form = LogicForm::Other { ends_if };
        self.cursor.at += 1;
        let help = match (name, keyword(self.cursor)) {
            ("END", Some("IF")) => "write ENDIF as one word",
            ("ELSE", Some("IF")) => "write ELSEIF as one word",
            ("GO", _) => "write GOTO as one word",
            _ => "an assignment is written name = expression",
        };
        let what = format!("`=` is expected after {name}, not {}", self.cursor.found());
        Err(self.cursor.error_here(11, what).help_if_none(help).into())
    }

    /// `(condition)` and nothing after it.
    fn condition(&mut self, word: &str, condition: &mut Option<Expression>) -> Result {
        if !self.cursor.eat(Kind::LParen) {
            let what = format!("`(` is expected after {word}, not {}", self.cursor.found());
            return Err(self
                .cursor
                .error_here(11, what)
                .help_if_none(format!("write {word}(condition)"))
                .into());
        }
        let condition = condition.insert(self.expression(Until::Condition));
        if condition.error.is_some() {
            return Ok(());
        }
        match self.cursor.kind() {
            None => Ok(()),
            Some(Kind::RParen) => Err(error(32, self.cursor.span(), "`)` has no `(`")
                .help("remove it, or open it further left")
                .into()),
            Some(_) => {
                let what = format!("{} follows the condition", self.cursor.found());
                let help = "put the whole condition in one pair of parentheses, and statements in \
                            lines of their own";
                Err(self.cursor.error_here(5, what).help_if_none(help).into())
            }
        }
    }

    /// Refuses anything more in the statement after `word`. `None` stands for the usual help.
    fn end(&self, word: &str, help: Option<&'static str>) -> Result {
        if self.cursor.kind().is_none() {
            return Ok(());
        }
        let help = help.unwrap_or("put it on a line of its own");
        let what = format!("{} follows {word}", self.cursor.found());
        Err(self.cursor.error_here(5, what).help_if_none(help).into())
    }

    fn goto(&mut self, word: Token, form: &mut LogicForm) -> Result {
        let is_reserved = |token: &Token| RESERVED.contains(&self.cursor.slice(*token));
        let label = self.cursor.token().filter(|token| token.kind == Kind::Name);
        let label = label.filter(|token| !is_reserved(token));
        *form = LogicForm::Goto { word, label };
        if label.is_none() {
            let what = format!("a label is expected after GOTO, not {}", self.cursor.found());
            let help = "write GOTO and the label's name";
            return Err(self.cursor.error_here(46, what).help_if_none(help).into());
        }
        self.cursor.at += 1;
        self.end("the label", None)
    }
}
