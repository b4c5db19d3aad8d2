//! SEND and DISPLAY, the statements that put out a text.

use plcc_abi::pmac::Text;
use plcc_diag::Diagnostic;

use super::cursor::{Parsed, syntax};
use super::download::DownloadReader;
use super::words;
use crate::pmac::ast::{Expr, StmtKind};

impl DownloadReader<'_> {
    /// A text in quotes, or `^` and a letter. Characters that the controller does not have are
    /// warnings.
    pub(crate) fn quoted(&mut self) -> Parsed<String> {
        self.reader.cur.blanks();
        let start = self.reader.cur.pos;
        let text = self.reader.quoted()?;
        if let Some(c) = text.chars().find(|c| !c.is_ascii()) {
            let at = self.reader.cur.since(start);
            self.tell(at, |span| {
                let message = format!("the controller has no character `{c}`");
                Diagnostic::warning("PMAC-W7", span, message).help("texts are of ASCII characters")
            });
        }
        Ok(text)
    }

    /// Appends the statement that puts out `text`, which reaches from the offset `start` to the
    /// cursor; `value` is what a DISPLAY shows or the MACRO ring is sent.
    pub(crate) fn text(&mut self, text: Text, value: Option<Expr>, start: usize) {
        self.download.texts.push(text);
        let index = self.download.texts.len() as u32 - 1;
        self.push(StmtKind::Text(index, value), start);
    }

    /// SEND, whose word is taken and begins at the offset `start`.
    pub(crate) fn send(&mut self, start: usize) -> Parsed<()> {
        let port = words::port(&mut self.reader.cur).map(String::from);
        let text = self.quoted()?;
        self.text(Text::Send { text, port }, None, start);
        Ok(())
    }

    /// DISPLAY, whose word is taken and begins at the offset `start`.
    pub(crate) fn display(&mut self, start: usize) -> Parsed<()> {
        self.reader.cur.blanks();
        let from = self.reader.cur.pos;
        let position = self.reader.cur.integer();
        let Ok(position) = u32::try_from(position.unwrap_or(0)) else {
            return syntax(self.reader.cur.since(from), "this position is too large");
        };
        let _ = self.reader.cur.eat(b',');
        if self.reader.cur.peek() == b'"' {
            let text = self.quoted()?;
            self.text(Text::Show { text, position }, None, start);
            return Ok(());
        }
        let from = self.reader.cur.pos;
        let width = self.reader.cur.integer();
        let decimals = self.reader.cur.eat(b'.').then(|| self.reader.cur.integer()).flatten();
        let (Some(width @ 1..=80), decimals @ 0..=40) = (width, decimals.unwrap_or(0)) else {
            if width.is_none() {
                return self.reader.cur.expected("a text in quotes, or width.decimals");
            }
            return syntax(
                self.reader.cur.since(from),
                "a field has 1 to 80 characters and 0 to 40 decimals",
            );
        };
        if !self.reader.cur.eat(b',') {
            return self.reader.cur.expected("`,` and a variable");
        }
        let expr = self.variable_value()?;
        let (width, decimals) = (width as u32, decimals as u32);
        self.text(Text::Value { position, width, decimals }, Some(expr), start);
        Ok(())
    }
}
