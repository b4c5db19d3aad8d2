//! Calls of motion programs with words behind them on their line, which READ of the called program may take (guide, appendix
//! D, READ).

use plcc_abi::pmac::motion::{Axis, LineWord, MotionKind, MoveWord};

use super::cursor::{Parsed, syntax_help};
use super::download::DownloadReader;
use super::words::{self, MOTION, PLC};
use crate::pmac::ast::Expr;

/// How many words of its line a call gives at most.
const MAX_WORDS: usize = 60;

/// The number of a code's letter: G is 0, M 1, T 2, D 3.
pub(super) fn code_of(letter: u8) -> u8 {
    match letter {
        b'G' => 0,
        b'M' => 1,
        b'T' => 2,
        _ => 3,
    }
}

impl DownloadReader<'_> {
    /// Whether a program is called on the line in front of the cursor, or may be by PRELUDE.
    pub(super) fn is_behind_call(&self) -> bool {
        self.has_prelude || self.open.as_ref().is_some_and(|open| open.next_word != 0)
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
        self.words_ahead(next, &mut values, &mut words);
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

    /// The words from the cursor to the end of the line, or to what is not a word. `next` is the number of the first. The
    /// cursor stays where it is.
    fn words_ahead(&mut self, next: u16, values: &mut Vec<Expr>, words: &mut Vec<LineWord>) {
        let before = self.reader.cur;
        for ordinal in (next..).take(MAX_WORDS) {
            let Some((letter, value)) = self.word_ahead() else { break };
            values.push(value);
            words.push(LineWord { letter, ordinal });
        }
        self.reader.cur = before;
    }

    /// In front of a statement that begins with the word at `start`, whose letter is taken: where there is a PRELUDE, a
    /// statement that may call.
    pub(super) fn before_word(&mut self, letter: u8, start: usize) {
        if !self.has_prelude || matches!(letter, b'N' | b'O') {
            return;
        }
        let pending = self.open.as_ref().and_then(|open| open.pending.as_ref());
        let goes_on = match Axis::from_letter(letter) {
            Some(axis) => pending.is_some_and(|p| !p.words.contains(&MoveWord::Axis(axis))),
            None => pending.is_some() && matches!(letter, b'R' | b'I' | b'J' | b'K' | b'F'),
        };
        if goes_on {
            return;
        }
        self.flush_move();
        let Some(next) = self.open.as_ref().map(|open| open.next_word.max(1)) else { return };
        let (mut values, mut words) = (Vec::new(), Vec::new());
        let after = std::mem::replace(&mut self.reader.cur.pos, start);
        self.words_ahead(next, &mut values, &mut words);
        self.reader.cur.pos = after;
        if words.is_empty() {
            return;
        }
        if let Some(open) = &mut self.open {
            open.next_word = next;
        }
        self.push_words(MotionKind::BeforeWord, values, words, start);
    }

    /// PRELUDE1 with a call, or PRELUDE0.
    pub(super) fn prelude(&mut self, start: usize) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let help = "PRELUDE1 CALL500, PRELUDE1 with a G, M, T or D code, or PRELUDE0";
        match self.reader.cur.integer() {
            Some(0) => {
                self.push_motion(MotionKind::PreludeOff, Vec::new(), start);
                Ok(())
            }
            Some(1) => {
                let code = match self.reader.cur.peek().to_ascii_uppercase() {
                    _ if self.reader.cur.eat_word("CALL") => None,
                    letter @ (b'G' | b'M' | b'T' | b'D') => {
                        self.reader.cur.pos += 1;
                        Some(code_of(letter))
                    }
                    _ => return syntax_help(at, "PRELUDE1 is followed by a call", help),
                };
                self.with_data(MotionKind::Prelude(code), start)
            }
            _ => syntax_help(at, "PRELUDE is followed by 0 or 1", help),
        }
    }

    /// The letter and the value of the word at the cursor; `None` if there is none. Velocities and the like after the value
    /// are passed over.
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
        if matches!(self.reader.cur.byte(), b':' | b'^') {
            self.reader.cur.pos += 1;
            let _ = self.data().ok()?;
        }
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
