//! Reads the text modules :197 to :200 (NCT 3.4 to 3.7). Their texts are separated by commas and
//! end with `$`.

use plcc_diag::{Diagnostic, Span};

use crate::nct::{
    ast::Op,
    read::{
        cursor::{is_blank, last_place},
        diagnostic::error,
        parser::Parser,
    },
};

/// How long and how many the texts of a module may be.
struct TextLimits {
    /// How many characters of a text the control is sure to show.
    shown: usize,
    /// How many characters a text may have.
    most: usize,
    /// The error of a text that has more.
    number: u8,
    /// How many texts the module may have.
    count: usize,
}

/// The limits of a text module; :200 has none.
fn text_limits(label: u16) -> Option<TextLimits> {
    match label {
        197 => Some(TextLimits { shown: 9, most: 16, number: 72, count: 8 }),
        198 => Some(TextLimits { shown: 20, most: 20, number: 69, count: 8 }),
        199 => Some(TextLimits { shown: 20, most: 25, number: 65, count: 152 }),
        _ => None,
    }
}

/// Whether the label of a text module begins here. Inside the texts of another module this means
/// that its `$` is missing.
fn begins_module(rest: &str) -> bool {
    [":197", ":198", ":199", ":200"].iter().any(|label| rest.starts_with(label))
}

impl Parser<'_> {
    /// Reads the texts after a label, up to `$`.
    pub(crate) fn text_module(&mut self, label: u16, start: usize) {
        self.cursor.enter_raw();
        let mut texts = vec![];
        let mut text = String::new();
        let mut from = None;
        let mut line_start = false;
        let mut closed = false;
        loop {
            if line_start && begins_module(self.cursor.raw_rest()) {
                break;
            }
            let at = self.cursor.pos();
            let Some(c) = self.cursor.bump_raw() else { break };
            match c {
                None => {}
                Some('$') => {
                    closed = true;
                    break;
                }
                Some(',') if label != 200 => {
                    texts.push((std::mem::take(&mut text), from.take(), self.cursor.end()));
                }
                Some('\r' | '\n') => line_start = true,
                Some(c) => {
                    line_start &= is_blank(c);
                    if !is_blank(c) {
                        from.get_or_insert(at);
                    }
                    text.push(c);
                }
            }
        }
        let end = self.cursor.end();
        // A comma may be before the `$`, and then no text follows it.
        if !text.trim_matches(is_blank).is_empty() {
            texts.push((text, from, end));
        }
        if !closed {
            self.unclosed_text(label);
        }
        self.cursor.leave_raw();
        self.check_texts(label, start, &texts);
        let mut texts: Vec<String> =
            texts.into_iter().map(|(t, ..)| t.trim_matches(is_blank).to_owned()).collect();
        let kept = &mut self.out.texts;
        match label {
            197 => kept.softkeys = texts,
            198 => kept.indexed = texts,
            199 => kept.messages = texts,
            _ => kept.info = texts.pop().unwrap_or_default(),
        }
        self.emit(start, Op::Text);
    }

    /// Reports texts whose `$` is missing.
    fn unclosed_text(&mut self, label: u16) {
        let span = if self.cursor.peek().is_none() {
            last_place(self.file, self.text)
        } else {
            self.cursor.span_here()
        };
        let message = format!("the texts of :{label} do not end");
        self.found.push(*error(55, span, message, "write `$` after the last text"));
    }

    /// Reports texts that are too long or too many. Each has its start, if it is not empty, and its
    /// end.
    fn check_texts(&mut self, label: u16, start: usize, texts: &[(String, Option<usize>, usize)]) {
        let Some(limits) = text_limits(label) else { return };
        if let Some((_, from, end)) = texts.get(limits.count) {
            let span = Span::new(self.file, from.unwrap_or(*end), *end);
            let message = format!("module :{label} has more than {} texts", limits.count);
            self.found.push(*error(55, span, message, "remove the texts that no flag shows"));
        }
        for (text, from, end) in texts {
            let count = text.trim_matches(is_blank).chars().count();
            if count <= limits.shown {
                continue;
            }
            let span = Span::new(self.file, from.unwrap_or(start), *end);
            if count > limits.most {
                let message = format!("this text has {count} characters");
                let help = format!("texts of :{label} have at most {}", limits.most);
                self.found.push(*error(limits.number, span, message, help));
            } else {
                let message = format!("this text has {count} characters");
                let help = format!("the control is sure to show {} characters of it", limits.shown);
                self.found.push(Diagnostic::warning("NCT-W1", span, message).help(help));
            }
        }
    }
}
