//! Calls of motion programs with words behind them on their line, which READ of the called program may take (guide, appendix
//! D, READ).

use plcc_abi::pmac::motion::{LineWord, MotionKind};

use super::cursor::{Parsed, syntax_help};
use super::download::DownloadReader;
use super::words::{self, MOTION, PLC};
use crate::pmac::ast::Expr;

/// How many words of its line a call gives at most.
const MAX_WORDS: usize = 60;

impl DownloadReader<'_> {
    /// Whether a program is called on the line in front of the cursor.
    pub(super) fn is_behind_call(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.next_word != 0)
    }

    /// What follows is not behind a call.
    pub(super) fn end_calls(&mut self) {
        if let Some(open) = &mut self.open {
            open.next_word = 0;
        }
    }

    /// A word of the line, whose letter and value are taken.
    pub(super) fn line_word(&mut self, letter: u8) -> LineWord {
        let Some(open) = &mut self.open else { return LineWord::default() };
        let ordinal = open.next_word;
        if ordinal != 0 {
            open.next_word = ordinal.saturating_add(1);
        }
        LineWord { letter, ordinal }
    }

    /// The word of a statement with one value; none in front of a call.
    pub(super) fn line_words(&mut self, letter: u8) -> Vec<LineWord> {
        match self.line_word(letter) {
            LineWord { ordinal: 0, .. } => Vec::new(),
            word => vec![word],
        }
    }

    /// A call, whose word is taken, with its value and those of the words behind it on its line. `letter` is its own one
    /// if it is a word too, else 0.
    pub(super) fn call_with_words(
        &mut self,
        kind: MotionKind,
        letter: u8,
        start: usize,
    ) -> Parsed<()> {
        let value = self.data()?;
        let own = if letter == 0 { LineWord::default() } else { self.line_word(letter) };
        let Some(next) = self.open.as_ref().map(|open| open.next_word.max(1)) else {
            return Ok(());
        };
        let (mut values, mut words) = (vec![value], vec![own]);
        let before = self.reader.cur;
        for ordinal in (next..).take(MAX_WORDS) {
            let Some((letter, value)) = self.word_ahead() else { break };
            values.push(value);
            words.push(LineWord { letter, ordinal });
        }
        self.reader.cur = before;
        if values.len() > 1 {
            if let Some(open) = &mut self.open {
                open.next_word = next;
            }
        } else if own.ordinal == 0 {
            words.clear();
        }
        self.push_words(kind, values, words, start);
        Ok(())
    }

    /// The letter and the value of the word at the cursor; `None` if there is none.
    fn word_ahead(&mut self) -> Option<(u8, Expr)> {
        self.reader.cur.blanks();
        let letter = self.reader.cur.byte().to_ascii_uppercase();
        let kind = self.reader.variable_kind();
        if !letter.is_ascii_uppercase()
            || matches!(letter, b'N' | b'O')
            || kind.is_some_and(|kind| self.is_assignment(kind))
            || kind.is_none() && words::find(self.reader.cur, PLC.or(MOTION)).is_some()
        {
            return None;
        }
        self.reader.cur.pos += 1;
        let value = self.data().ok()?;
        Some((letter, value))
    }

    /// READ and its letters.
    pub(super) fn read_words(&mut self, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let mut letters = 0u32;
        if self.reader.cur.eat(b'(') {
            loop {
                let letter = self.reader.cur.peek().to_ascii_uppercase();
                match letter {
                    b'A'..=b'Z' => letters |= 1 << (letter - b'A'),
                    b',' => {}
                    _ => break,
                }
                self.reader.cur.pos += 1;
            }
            if self.reader.cur.eat(b')') && letters != 0 {
                self.push_motion(MotionKind::Read(letters), Vec::new(), start);
                return Ok(());
            }
        }
        syntax_help(at, "READ is followed by letters in parentheses", "READ(X,Y)")
    }
}
