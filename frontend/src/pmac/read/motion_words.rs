//! The words of motion programs that are single letters: axes, vectors, feedrates, labels, codes; and the values that
//! follow words.

use plcc_abi::pmac::Kind;
use plcc_abi::pmac::motion::{Axis, LineWord, MotionKind, MoveWord, TimeWord};

use super::cursor::{Parsed, syntax, syntax_help};
use super::download::DownloadReader;
use super::motion_calls::code_of;
use super::motion_program::PendingMove;
use crate::pmac::ast::{Expr, Op, StmtKind, Target};

impl DownloadReader<'_> {
    /// A word of one letter with its data, whose letter is taken.
    pub(super) fn letter_word(&mut self, letter: u8, start: usize) -> Parsed<()> {
        self.before_word(letter, start);
        if let Some(axis) = Axis::from_letter(letter) {
            let again = self.open.as_ref().and_then(|open| open.pending.as_ref());
            if again.is_some_and(|pending| pending.words.contains(&MoveWord::Axis(axis))) {
                self.flush_move();
            }
            let value = self.data()?;
            let word = self.line_word(letter);
            self.add_word(MoveWord::Axis(axis), value, word, start);
            let further = match self.reader.cur.byte() {
                b':' => Some(MoveWord::Velocity(axis)),
                b'^' => Some(MoveWord::Trigger(axis)),
                _ => None,
            };
            if let Some(kind) = further {
                self.reader.cur.pos += 1;
                let value = self.data()?;
                self.add_word(kind, value, word, start);
            }
            return Ok(());
        }
        match letter {
            b'R' => {
                let value = self.data()?;
                let word = self.line_word(letter);
                self.add_word(MoveWord::R, value, word, start);
            }
            b'I' | b'J' | b'K' => {
                let value = self.data()?;
                let word = self.line_word(letter);
                self.add_word(MoveWord::Center(letter - b'I'), value, word, start);
            }
            b'F' => {
                let value = self.data()?;
                let words = self.line_words(letter);
                self.push_words(MotionKind::Time(TimeWord::Feed), vec![value], words, start);
            }
            b'N' | b'O' => {
                self.flush_move();
                self.end_calls();
                self.reader.cur.blanks();
                let at = self.reader.cur.next_word();
                let Some(number) = self.reader.cur.integer().and_then(|n| u32::try_from(n).ok())
                else {
                    return syntax(at, "a label is a number: N100");
                };
                let index = self.next_index();
                let at = self.reader.cur.since(start);
                if let Some(buffer) = self.buffer() {
                    buffer.labels.push((number, index, at));
                }
            }
            b'S' => {
                self.flush_move();
                let value = self.data()?;
                if self.is_behind_call() {
                    let words = self.line_words(letter);
                    self.push_words(MotionKind::Spindle, vec![value], words, start);
                } else {
                    self.push(StmtKind::Assign(Target::Var(Kind::Q, 127), value), start);
                }
            }
            b'G' | b'M' | b'T' | b'D' => {
                self.flush_move();
                self.call_with_words(MotionKind::Code(code_of(letter)), letter, start)?;
            }
            _ if self.is_behind_call() => {
                self.flush_move();
                let value = self.data()?;
                let words = self.line_words(letter);
                self.push_words(MotionKind::Argument, vec![value], words, start);
            }
            _ => {
                self.flush_move();
                self.reader.cur.pos = start;
                return self.reader.unknown_word_error();
            }
        }
        Ok(())
    }

    /// A constant with a sign or none, or an expression in parentheses.
    pub(super) fn data(&mut self) -> Parsed<Expr> {
        match self.reader.cur.peek() {
            b'(' => self.reader.index(),
            b'0'..=b'9' | b'.' | b'$' | b'-' | b'+' => {
                let value = self.reader.signed()?;
                Ok(self.reader.constant(value))
            }
            _ if self.reader.variable_kind().is_some() => {
                let at = self.reader.cur.next_word();
                let what = self.reader.cur.text_at(at).to_owned();
                let help = format!("put it in parentheses: ({what})");
                syntax_help(at, "a value is a number, or an expression in parentheses", help)
            }
            _ => self.reader.cur.expected("a number, or an expression in parentheses"),
        }
    }

    pub(super) fn constant_of(&self, value: Expr) -> Option<f64> {
        let start = value.start as usize;
        match self.reader.ops.get(start..start + value.len as usize)? {
            [Op::Const(value)] => Some(*value),
            _ => None,
        }
    }

    /// Adds a word to the move of this line.
    fn add_word(&mut self, word: MoveWord, value: Expr, line_word: LineWord, start: usize) {
        let end = self.reader.cur.pos;
        let Some(open) = &mut self.open else { return };
        let pending =
            open.pending.get_or_insert_with(|| PendingMove { start, ..PendingMove::default() });
        pending.words.push(word);
        pending.values.push(value);
        pending.line_words.push(line_word);
        pending.end = end;
    }

    /// Ends the move of this line.
    pub(crate) fn flush_move(&mut self) {
        let pending = self.open.as_mut().and_then(|open| open.pending.take());
        let Some(PendingMove { words, values, mut line_words, start, end }) = pending else {
            return;
        };
        if line_words.iter().all(|word| word.ordinal == 0) {
            line_words.clear();
        }
        let after = std::mem::replace(&mut self.reader.cur.pos, end);
        self.push_words(MotionKind::Move(words), values, line_words, start);
        self.reader.cur.pos = after;
    }
}
