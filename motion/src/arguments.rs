//! Words of a line with a call: READ of the called program takes them, and the line goes on behind them (guide, appendix D,
//! READ).

use plcc_abi::image::write_f64;
use plcc_abi::pmac::motion::{MotionKind, MotionStatement};

use crate::calculation::Jump;
use crate::machine::Machine;
use crate::system::{Argument, MAX_ARGUMENTS};

impl Machine<'_> {
    /// How many words of a statement behind a call have been read; `None` for a statement that is not behind one or of
    /// which nothing has been read.
    pub(crate) fn words_read(
        &mut self,
        system: usize,
        statement: &MotionStatement,
    ) -> Option<usize> {
        let this = &mut self.state.systems[system];
        let in_line = statement.words.first().is_some_and(|word| word.ordinal != 0);
        if !in_line {
            this.read = 0;
            return None;
        }
        if this.read == 0 {
            return None;
        }
        let words = match statement.kind {
            MotionKind::Code(_) => statement.words.get(..1)?,
            _ => &statement.words,
        };
        let read = words.iter().filter(|word| word.ordinal <= this.read).count();
        match (read, &statement.kind) {
            (0, _) => None,
            // The arguments of a code that has been read are its own.
            (_, MotionKind::Code(_)) => Some(statement.words.len()),
            (read, _) => Some(read),
        }
    }

    /// Carries out a move without its words that have been read.
    pub(crate) fn rest_of_words(
        &mut self,
        system: usize,
        statement: &MotionStatement,
        read: usize,
        values: &[f64],
    ) -> bool {
        let MotionKind::Move(words) = &statement.kind else { return false };
        let (words, values) = (words.get(read..), values.get(read..));
        let (words, values) = (words.unwrap_or_default(), values.unwrap_or_default());
        let words = self.take_words(system, words, values);
        self.programmed_move(system, &words)
    }

    /// Keeps the words behind a call for READ. Gives the number of the first.
    pub(crate) fn keep_arguments(
        &mut self,
        system: usize,
        statement: &MotionStatement,
        values: &[f64],
    ) -> u32 {
        let arguments = &mut self.state.systems[system].arguments;
        let first = arguments.len();
        for (&word, &value) in statement.words.iter().zip(values).skip(1) {
            if arguments.len() < MAX_ARGUMENTS {
                arguments.push(Argument { word, value });
            }
        }
        first as u32
    }

    /// In front of a letter-number word: the call of PRELUDE1, if there is one, which is made anew in front of the next
    /// word where its program has taken this one. None is made in subroutines.
    pub(crate) fn before_word(
        &mut self,
        system: usize,
        statement: &MotionStatement,
        values: &[f64],
    ) -> bool {
        let this = &mut self.state.systems[system];
        let returned = std::mem::take(&mut this.prelude.returned);
        if !returned && statement.words.first().is_some_and(|word| word.ordinal == 1) {
            this.read = 0;
            this.prelude.done = 0;
        }
        let Some((code, value)) = this.prelude.call.filter(|_| this.stack.is_empty()) else {
            return false;
        };
        let read = this.read;
        let Some(next) = statement.words.iter().position(|word| word.ordinal > read) else {
            return false;
        };
        let ordinal = statement.words[next].ordinal;
        if ordinal <= this.prelude.done {
            return false;
        }
        this.prelude.done = ordinal;
        let first = this.arguments.len();
        for (&word, &value) in statement.words.iter().zip(values).skip(next) {
            if this.arguments.len() < MAX_ARGUMENTS {
                this.arguments.push(Argument { word, value });
            }
        }
        self.state.calculation.first_argument = first as u32;
        self.state.calculation.by_prelude = true;
        let suspended = match code {
            Some(code) => self.code(system, code, value),
            None => self.call(system, value),
        };
        if !matches!(self.state.calculation.jump, Jump::Into(_)) {
            self.state.calculation.by_prelude = false;
            self.state.systems[system].arguments.truncate(first);
        }
        suspended
    }

    /// READ: words whose letters are asked for go to Q101 to Q126, up to the first other one. Q100 says which.
    pub(crate) fn read_arguments(&mut self, system: usize, letters: u32) {
        let mut mask = 0u32;
        while let Some(frame) = self.state.systems[system].stack.last().copied() {
            let argument = self.state.systems[system].arguments.get(frame.next as usize).copied();
            let Some(Argument { word, value }) = argument else { break };
            let number = u32::from(word.letter.wrapping_sub(b'A'));
            if number >= 26 || letters & 1 << number == 0 {
                break;
            }
            mask |= 1 << number;
            self.write_q(system, 101 + number, value);
            if let Some(frame) = self.state.systems[system].stack.last_mut() {
                frame.next += 1;
            }
        }
        self.write_q(system, 100, f64::from(mask));
    }

    /// Assigns to a Q-variable of a coordinate system.
    pub(crate) fn write_q(&mut self, system: usize, number: u32, value: f64) {
        let layout = &self.setup.layout;
        let offset = layout.q_offset(layout.q_base_of(system as u32 + 1).wrapping_add(number));
        write_f64(self.memory.image, offset, value);
    }
}
