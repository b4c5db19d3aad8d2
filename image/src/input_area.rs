//! The area for inputs: a part of the image file by which other processes give the control values.
//!
//! Each variable that can be given has a *slot*; the table of symbols has its number. A process that gives
//! values is a *writer*. It takes one of the *mailboxes*, and claims the slots that it wants to give: each slot
//! has one owner at most, the number of a mailbox plus one. Through the three buffers of its mailbox
//! (`triple_buffer.rs`) it hands over the values of all its slots as one set. With each value goes a *serial
//! number*, which changes whenever the writer has got a value from its source, also the same one
//! again: a value whose serial number stays the same for too long is late.
//!
//! Head of the area, offsets from its beginning, 64 bits each:
//!
//! | offset | holds |
//! | --- | --- |
//! | `0x00` | number of slots |
//! | `0x08` | number of mailboxes |
//! | `0x10` | offset in the file of the owners, 64 bits for each slot |
//! | `0x18` | offset in the file of the states, 64 bits for each slot: 0 nobody has given it, 1 it is current, 2 it has its safe value, 3 it was given what it can't have, and has its last good value |
//! | `0x20` | offset in the file of the first mailbox |
//! | `0x28` | bytes of a mailbox |
//! | `0x30` | number of claims: changes with each change of an owner |
//!
//! Mailbox, offsets from its beginning:
//!
//! | offset | holds |
//! | --- | --- |
//! | `0x00` | the process that has it: its number in the upper 32 bits, the lower 32 bits of its start time (field 22 of `/proc/PID/stat`) in the lower ones; 0 where it is free |
//! | `0x08` | state of the three buffers |
//! | `0x10` | after how many nanoseconds a value is late that the control's configuration says nothing of; 0 never |
//! | `0x18` | what such inputs become when they are late: 0 if they become 0, 1 if they stay what they are |
//! | `0x20` | name of the writer, 32 bytes, 0 after it |
//! | `0x40` | three buffers: for each slot the value (an integer, or the bits of a number with a fraction) and its serial number, 64 bits each; a serial number of 0 is not a value |

use std::sync::atomic::AtomicU64;

use crate::layout::AT_INPUTS;
use crate::sequence::read_word;
use crate::triple_buffer;

/// How many writers there can be at once.
pub const MAILBOXES: usize = 8;
/// Bytes of a writer's name.
pub const NAME_SIZE: usize = 32;
/// The area begins at a multiple of this many bytes, a page, so that it can be mapped alone.
const ALIGNMENT: usize = 4096;

/// Words of the area's head.
const HEAD: usize = 8;
/// Words of a mailbox before its buffers.
const MAILBOX_HEAD: usize = 8;
/// The word of a mailbox that holds its owner.
const OWNER: usize = 0;
/// The word of a mailbox that holds the state of its buffers.
const STATE: usize = 1;
/// The word of a mailbox that holds the time after which a value is late.
const TIMEOUT: usize = 2;
/// The word of a mailbox that says what late inputs become.
const HOLD: usize = 3;
/// The first word of a writer's name.
const NAME: usize = 4;
/// The word of the area that holds the number of claims.
const CLAIMS: usize = 6;

/// Where the parts of an area lie, in words from the beginning of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputArea {
    slots: usize,
    head: usize,
    owners: usize,
    states: usize,
    first_mailbox: usize,
    mailbox_size: usize,
    mailboxes: usize,
}

impl InputArea {
    /// The area for a number of slots that begins after `from` bytes of the file.
    pub fn new(from: usize, slots: usize) -> Self {
        let head = from.next_multiple_of(ALIGNMENT) / 8;
        let owners = head + HEAD;
        let states = owners + slots;
        let first_mailbox = states + slots;
        let mailbox_size = MAILBOX_HEAD + 3 * 2 * slots;
        Self { slots, head, owners, states, first_mailbox, mailbox_size, mailboxes: MAILBOXES }
    }

    /// The area of a mapped image file; `None` if the file has none, or says that parts of it lie outside the file.
    pub fn of(words: &[AtomicU64]) -> Option<Self> {
        let number = |at: usize| words.get(at).map(read_word).map(u64::to_le);
        let place = |at: usize| usize::try_from(number(at)?).ok();
        let head = place(AT_INPUTS / 8)? / 8;
        if head == 0 {
            return None;
        }
        let field = |n: usize| place(head.checked_add(n)?);
        let area = Self {
            slots: field(0)?,
            head,
            owners: field(2)? / 8,
            states: field(3)? / 8,
            first_mailbox: field(4)? / 8,
            mailbox_size: field(5)? / 8,
            mailboxes: field(1)?,
        };
        let holds =
            |from: usize, size: usize| from.checked_add(size).is_some_and(|end| end <= words.len());
        let mailboxes = area.mailbox_size.checked_mul(area.mailboxes)?;
        let buffers = area.slots.checked_mul(6)?.checked_add(MAILBOX_HEAD)?;
        let fits = holds(area.owners, area.slots)
            && holds(area.states, area.slots)
            && holds(area.first_mailbox, mailboxes)
            && holds(head, HEAD)
            && buffers <= area.mailbox_size;
        fits.then_some(area)
    }

    /// Offset of the area in the file, in bytes.
    pub fn offset(self) -> usize {
        self.head * 8
    }

    /// The first byte after the area.
    pub fn end(self) -> usize {
        (self.first_mailbox + self.mailbox_size * self.mailboxes) * 8
    }

    /// How many slots there are.
    pub fn slots(self) -> usize {
        self.slots
    }

    /// How many mailboxes there are.
    pub fn mailboxes(self) -> usize {
        self.mailboxes
    }

    /// The bytes of a new area, from [`offset`](Self::offset) on.
    pub fn encode(self) -> Vec<u8> {
        let mut words = vec![0_u64; (self.end() - self.offset()) / 8];
        let bytes = |words: usize| words as u64 * 8;
        let head = [
            self.slots as u64,
            self.mailboxes as u64,
            bytes(self.owners),
            bytes(self.states),
            bytes(self.first_mailbox),
            bytes(self.mailbox_size),
        ];
        words.iter_mut().zip(head).for_each(|(word, value)| *word = value);
        for mailbox in 0..self.mailboxes {
            let at = self.first_mailbox + mailbox * self.mailbox_size + STATE - self.head;
            if let Some(word) = words.get_mut(at) {
                *word = triple_buffer::INITIAL;
            }
        }
        words.into_iter().flat_map(u64::to_le_bytes).collect()
    }

    /// The word that holds the number of claims.
    pub fn claims(self, words: &[AtomicU64]) -> Option<&AtomicU64> {
        words.get(self.head + CLAIMS)
    }

    /// The word that holds the owner of a slot: the number of a mailbox plus one, or 0. `None` if there is no such
    /// slot.
    pub fn owner(self, words: &[AtomicU64], slot: usize) -> Option<&AtomicU64> {
        words.get(self.owners + slot).filter(|_| slot < self.slots)
    }

    /// The word that holds the state of a slot; `None` if there is no such slot.
    pub fn state(self, words: &[AtomicU64], slot: usize) -> Option<&AtomicU64> {
        words.get(self.states + slot).filter(|_| slot < self.slots)
    }

    /// The number of a mailbox's first word; `None` if there is no such mailbox. The number of a mailbox may come
    /// from the file and be any.
    fn mailbox_start(self, mailbox: usize) -> Option<usize> {
        (mailbox < self.mailboxes).then(|| self.first_mailbox + mailbox * self.mailbox_size)
    }

    fn mailbox(self, words: &[AtomicU64], mailbox: usize, word: usize) -> Option<&AtomicU64> {
        words.get(self.mailbox_start(mailbox)? + word)
    }

    /// The word that identifies the process that has a mailbox (see the table above); `None` if there is no such
    /// mailbox.
    pub fn process(self, words: &[AtomicU64], mailbox: usize) -> Option<&AtomicU64> {
        self.mailbox(words, mailbox, OWNER)
    }

    /// The word that holds the state of a mailbox's three buffers (see `triple_buffer.rs`).
    pub fn buffers(self, words: &[AtomicU64], mailbox: usize) -> Option<&AtomicU64> {
        self.mailbox(words, mailbox, STATE)
    }

    /// The word that says after how many nanoseconds a mailbox's values are late; 0 never.
    pub fn timeout(self, words: &[AtomicU64], mailbox: usize) -> Option<&AtomicU64> {
        self.mailbox(words, mailbox, TIMEOUT)
    }

    /// The word that says what a mailbox's late inputs become: 1 they stay what they are, 0 they become 0.
    pub fn hold(self, words: &[AtomicU64], mailbox: usize) -> Option<&AtomicU64> {
        self.mailbox(words, mailbox, HOLD)
    }

    /// The words that hold the name of a mailbox's writer.
    pub fn name(self, words: &[AtomicU64], mailbox: usize) -> Option<&[AtomicU64]> {
        let at = self.mailbox_start(mailbox)? + NAME;
        words.get(at..at + NAME_SIZE / 8)
    }

    /// The value of a slot and its serial number in a mailbox's buffer 0, 1 or 2.
    pub fn value(
        self,
        words: &[AtomicU64],
        mailbox: usize,
        buffer: usize,
        slot: usize,
    ) -> Option<(&AtomicU64, &AtomicU64)> {
        let at = MAILBOX_HEAD + (buffer * self.slots + slot) * 2;
        let word = |n| self.mailbox(words, mailbox, at + n);
        if slot < self.slots && buffer < 3 { word(0).zip(word(1)) } else { None }
    }
}

/// The name of a writer, as its mailbox holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WriterName(pub [u8; NAME_SIZE]);

impl WriterName {
    /// The first [`NAME_SIZE`] bytes of a name.
    pub fn new(name: &str) -> Self {
        let mut bytes = [0; NAME_SIZE];
        bytes.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
        Self(bytes)
    }

    /// Reads it from the words of a mailbox.
    pub fn read(words: &[AtomicU64]) -> Self {
        let mut bytes = [0; NAME_SIZE];
        for (to, word) in bytes.chunks_exact_mut(8).zip(words) {
            to.copy_from_slice(&read_word(word).to_ne_bytes());
        }
        Self(bytes)
    }
}

impl std::fmt::Display for WriterName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap_or(NAME_SIZE);
        let name = String::from_utf8_lossy(self.0.get(..end).unwrap_or_default());
        f.write_str(if name.is_empty() { "no driver" } else { &name })
    }
}
