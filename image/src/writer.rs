//! Gives inputs to a control: the side of the process outside.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use thiserror::Error;

use crate::input_area::{InputArea, WriterName};
use crate::layout::{self, State};
use crate::reader::{image_place, open_regular};
use crate::sequence::{read_word, write_word};
use crate::symbol::{Direction, Number, Symbol};
use crate::{Access, ImageReader, SharedMemory, process, triple_buffer};

/// Why inputs can't be given.
#[derive(Debug, Error)]
pub enum ClaimError {
    /// The image file can't be opened.
    #[error("{0}")]
    File(#[from] std::io::Error),
    /// The control takes no inputs from other processes.
    #[error("the image file has no area for inputs")]
    NoInputs,
    /// All mailboxes are taken.
    #[error("no mailbox is free: the largest possible number of processes give inputs already")]
    NoMailbox,
    /// The program has no such variable.
    #[error("the program has no variable named `{0}`")]
    Unknown(String),
    /// The variable can't be given.
    #[error("`{0}` can't be given by another process")]
    NotAnInput(String),
    /// Another process gives it.
    #[error("`{name}` is given by {writer} (process {process}) already")]
    Taken {
        /// The variable.
        name: String,
        /// The name of its writer.
        writer: String,
        /// The number of its process.
        process: u32,
    },
    /// The variable can't have this value.
    #[error("`{name}` can't be {value}")]
    Value {
        /// The variable.
        name: String,
        /// The value.
        value: Number,
    },
    /// This writer has released the variable.
    #[error("the variable is not claimed")]
    Released,
    /// Somebody else has this writer's mailbox, or has damaged it.
    #[error("another process has taken or damaged the mailbox of this one")]
    Lost,
}

/// A variable that a writer has claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Input(usize);

#[derive(Debug)]
struct Claimed {
    symbol: Symbol,
    slot: usize,
    value: u64,
    /// 0 until a value is set.
    serial: u64,
}

/// Gives a control the values of inputs.
///
/// The control sees the values that were [`set`](Self::set) when they are [published](Self::publish), all at once. When this process ends or the writer is dropped, and when a value
/// has not been set again for too long, the inputs take their safe values.
#[derive(Debug)]
pub struct InputWriter {
    memory: SharedMemory,
    area: InputArea,
    mailbox: usize,
    owner: u64,
    symbols: Vec<Symbol>,
    claimed: Vec<Claimed>,
    serial: u64,
}

impl InputWriter {
    /// Opens an image file as a writer with a name, which the control's log shows; of long names the first
    /// 32 bytes.
    ///
    /// # Errors
    /// When the file can't be opened or has no area for inputs, or no mailbox is free.
    pub fn open(path: &Path, name: &str) -> Result<Self, ClaimError> {
        let symbols = ImageReader::open(path)?.symbols();
        let memory = SharedMemory::map(&open_regular(path, true)?, Access::Write)?;
        image_place(memory.words())?;
        let area = InputArea::of(memory.words()).ok_or(ClaimError::NoInputs)?;
        let owner = process::own_identity();
        let mailbox = free_mailbox(&memory, area, owner).ok_or(ClaimError::NoMailbox)?;
        let serial = crate::monotonic_ns();
        let mut writer = Self { memory, area, mailbox, owner, symbols, claimed: vec![], serial };
        writer.release_all();
        let words = writer.memory.words();
        let name = WriterName::new(name);
        let places = area.name(words, mailbox).unwrap_or_default();
        for (word, bytes) in places.iter().zip(name.0.chunks_exact(8)) {
            let bytes = bytes.first_chunk().copied().unwrap_or_default();
            write_word(word, u64::from_ne_bytes(bytes));
        }
        for word in [area.timeout(words, mailbox), area.hold(words, mailbox)].into_iter().flatten()
        {
            write_word(word, 0);
        }
        // Nothing that an earlier owner of the mailbox has given counts any more.
        writer.publish()?;
        Ok(writer)
    }

    /// Says after what time a value is late that has not been set again, and whether such inputs stay what they
    /// are rather than become 0. This is for inputs of which the control's configuration says nothing;
    /// without it they are never late as long as this process lives.
    pub fn set_timeout(&mut self, timeout: Duration, hold: bool) {
        let words = self.memory.words();
        let nanoseconds = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        if let Some(word) = self.area.timeout(words, self.mailbox) {
            write_word(word, nanoseconds.to_le());
        }
        if let Some(word) = self.area.hold(words, self.mailbox) {
            write_word(word, u64::from(hold).to_le());
        }
    }

    /// The program's variables.
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// Claims a variable by its canonical name: no other process can give it from now on.
    ///
    /// # Errors
    /// When there is no such variable, it can't be given, or a process that lives gives it.
    pub fn claim(&mut self, name: &str) -> Result<Input, ClaimError> {
        let symbol = self.symbols.iter().find(|symbol| symbol.is_called(name)).cloned();
        let symbol = symbol.ok_or_else(|| ClaimError::Unknown(name.into()))?;
        let not_an_input = || ClaimError::NotAnInput(name.into());
        let slot = symbol.slot.filter(|_| symbol.direction != Direction::Output);
        let slot = slot.ok_or_else(not_an_input)? as usize;
        if let Some(known) = self.claimed.iter().position(|claimed| claimed.slot == slot) {
            return Ok(Input(known));
        }
        let words = self.memory.words();
        let owner = self.area.owner(words, slot).ok_or_else(not_an_input)?;
        let mut old = owner.load(Ordering::Acquire);
        let new = (self.mailbox as u64 + 1).to_le();
        loop {
            let other = (old.to_le() as usize).checked_sub(1);
            if let Some(other) = other.filter(|&other| other != self.mailbox)
                && let Some(process) = self.area.process(words, other).map(read_word)
                && process::is_running(process.to_le())
            {
                let writer = self.area.name(words, other).map(WriterName::read).unwrap_or_default();
                let (name, writer) = (name.to_owned(), writer.to_string());
                let process = (process.to_le() >> 32) as u32;
                return Err(ClaimError::Taken { name, writer, process });
            }
            match owner.compare_exchange(old, new, Ordering::AcqRel, Ordering::Acquire) {
                Ok(_) => break,
                Err(now) => old = now,
            }
        }
        self.claimed.push(Claimed { symbol, slot, value: 0, serial: 0 });
        self.count_claim();
        Ok(Input(self.claimed.len() - 1))
    }

    /// The variable that was claimed.
    pub fn symbol(&self, input: Input) -> Option<&Symbol> {
        self.claimed.get(input.0).map(|claimed| &claimed.symbol)
    }

    /// Sets a value, or says that it is the same as before and still current.
    ///
    /// # Errors
    /// When the variable can't have this value. Its old value stays, and gets late after its timeout.
    pub fn set(&mut self, input: Input, value: Number) -> Result<(), ClaimError> {
        let claimed = self.claimed.get_mut(input.0).ok_or(ClaimError::Released)?;
        if !claimed.symbol.takes(value) {
            return Err(ClaimError::Value { name: claimed.symbol.name.clone(), value });
        }
        let has_fraction = claimed.symbol.outside().range().is_none();
        claimed.value = match value {
            Number::Int(number) if !has_fraction => number as u64,
            number => number.float().to_bits(),
        };
        self.serial = self.serial.wrapping_add(1).max(1);
        claimed.serial = self.serial;
        Ok(())
    }

    /// Says that the source of a variable gives a value that the variable can't have, or none that is a number.
    /// The control writes an event; the variable keeps its last good value until its timeout.
    ///
    /// # Errors
    /// When this writer has released the variable.
    pub fn refuse(&mut self, input: Input) -> Result<(), ClaimError> {
        let claimed = self.claimed.get_mut(input.0).ok_or(ClaimError::Released)?;
        // No integer variable has 64 bits, and no variable can be NaN.
        claimed.value = match claimed.symbol.outside().range() {
            Some(_) => i64::MIN as u64,
            None => f64::NAN.to_bits(),
        };
        self.serial = self.serial.wrapping_add(1).max(1);
        claimed.serial = self.serial;
        Ok(())
    }

    /// Hands all values over to the control, which takes them as a whole before its next tick.
    ///
    /// # Errors
    /// When the mailbox is lost.
    pub fn publish(&mut self) -> Result<(), ClaimError> {
        let words = self.memory.words();
        let process = self.area.process(words, self.mailbox).map(read_word);
        let state = self.area.buffers(words, self.mailbox).ok_or(ClaimError::Lost)?;
        if process.map(u64::to_le) != Some(self.owner) {
            return Err(ClaimError::Lost);
        }
        let back = triple_buffer::back(state).ok_or(ClaimError::Lost)?;
        for slot in 0..self.area.slots() {
            if let Some((value, serial)) = self.area.value(words, self.mailbox, back, slot) {
                write_word(value, 0);
                write_word(serial, 0);
            }
        }
        for claimed in &self.claimed {
            if let Some((value, serial)) = self.area.value(words, self.mailbox, back, claimed.slot)
            {
                write_word(value, claimed.value.to_le());
                write_word(serial, claimed.serial.to_le());
            }
        }
        triple_buffer::publish(state).ok_or(ClaimError::Lost)
    }

    /// Whether the control still takes inputs from this file. It does not when it has ended, or when an
    /// online change has made another file of the same name: open that one then.
    pub fn is_current(&self) -> bool {
        let state = self.memory.words().get(layout::AT_STATE / 8).map_or(0, read_word).to_le();
        let over = [State::Ended, State::Replaced, State::Dead];
        !over.iter().any(|over| over.number() == state)
    }

    /// Releases every slot that has this mailbox as its owner.
    fn release_all(&mut self) {
        let words = self.memory.words();
        let own = (self.mailbox as u64 + 1).to_le();
        for slot in 0..self.area.slots() {
            if let Some(owner) = self.area.owner(words, slot) {
                // Fails for a slot of another owner, which stays as it is.
                let _ = owner.compare_exchange(own, 0, Ordering::AcqRel, Ordering::Relaxed);
            }
        }
        self.count_claim();
    }

    fn count_claim(&self) {
        if let Some(claims) = self.area.claims(self.memory.words()) {
            claims.fetch_add(1, Ordering::AcqRel);
        }
    }
}

impl Drop for InputWriter {
    fn drop(&mut self) {
        let words = self.memory.words();
        let process = self.area.process(words, self.mailbox).map(read_word);
        if process.map(u64::to_le) != Some(self.owner) {
            return;
        }
        self.claimed.clear();
        self.release_all();
        if let Some(process) = self.area.process(self.memory.words(), self.mailbox) {
            process.store(0, Ordering::Release);
        }
    }
}

/// Takes a mailbox that is free, or whose process has ended.
fn free_mailbox(memory: &SharedMemory, area: InputArea, owner: u64) -> Option<usize> {
    (0..area.mailboxes()).find(|&mailbox| {
        area.process(memory.words(), mailbox).is_some_and(|process| {
            let old = process.load(Ordering::Acquire);
            let new = owner.to_le();
            !process::is_running(old.to_le())
                && process.compare_exchange(old, new, Ordering::AcqRel, Ordering::Relaxed).is_ok()
        })
    })
}
