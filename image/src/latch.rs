//! The control's side of the area for inputs: takes what the writers have given before each tick, and gives
//! inputs their safe values when their writer is late or gone.
//!
//! [`InputLatch::take`] is called by the thread that runs the ticks. It does not wait, allocates nothing,
//! makes no system call, and trusts nothing in the file: where the parts of the area lie, which values a
//! variable can have, and what its safe value is are kept in the control's own memory.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::input_area::{InputArea, MAILBOXES, WriterName};
use crate::sequence::{read_word, write_word};
use crate::symbol::{Direction, Number, Symbol};
use crate::triple_buffer::{self, Taken};

/// What a variable that is given from outside becomes when it is not given in time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Safe {
    /// 0.
    #[default]
    Off,
    /// It stays what it is.
    Hold,
    /// This value.
    Value(Number),
}

/// What the configuration says of one variable that is given from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// What it becomes when it is not given in time.
    pub safe: Safe,
    /// After how many nanoseconds a value is late; 0 never.
    pub timeout_ns: u64,
}

/// What has happened to inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// A writer gives them from now on.
    Begun,
    /// They were not given in time, and have their safe values.
    Late,
    /// Nobody gives them any more, since their writer has released them or has ended. They have their safe values.
    Released,
    /// They had their safe values, and are given again.
    Recovered,
    /// They were given values that they can't have, which were not taken.
    Refused,
}

impl Change {
    const ALL: [Self; 5] =
        [Self::Begun, Self::Late, Self::Released, Self::Recovered, Self::Refused];

    /// The word for it in a log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Begun => "begun",
            Self::Late => "late",
            Self::Released => "released",
            Self::Recovered => "recovered",
            Self::Refused => "refused",
        }
    }
}

/// A change of one or several inputs of one writer before one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputEvent {
    /// What has happened.
    pub change: Change,
    /// The writer.
    pub writer: WriterName,
    /// The slot of the first input.
    pub first: u32,
    /// How many inputs.
    pub count: u32,
}

/// The state of a slot, as the file shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SlotState {
    /// Nobody has given it yet.
    Vacant = 0,
    /// It has the value that its writer gives.
    Current = 1,
    /// It has its safe value.
    Safe = 2,
}

/// What the file shows of a slot that is current, but whose newest value was one that it can't have.
const SHOWN_REFUSED: u64 = 3;

#[derive(Clone, Debug)]
struct Slot {
    symbol: Symbol,
    rule: Option<Rule>,
    /// The number of its writer's mailbox plus one; 0 if it has no writer.
    owner: usize,
    /// The last owner that was not 0. An event of a slot that was released names that writer.
    last_owner: usize,
    state: SlotState,
    /// Whether the newest value that was given is one that the variable can't have.
    refused: bool,
    /// The state as the file shows it.
    shown: u64,
    /// The serial number of the newest value that was given.
    serial: u64,
    /// The value that the variable was set to last. It is set again if the stimulus or the socket may have
    /// set the variable meanwhile.
    value: Option<Number>,
    /// When the newest value was given or, before the first one, when the control began to wait for it, in
    /// nanoseconds of `CLOCK_MONOTONIC`.
    since: u64,
}

/// The inputs of one writer with the same [`Change`] before one tick: the slot of the first and their number.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    first: u32,
    count: u32,
}

/// Takes inputs. See [`take`](Self::take).
#[derive(Clone, Debug)]
pub struct InputLatch {
    area: InputArea,
    slots: Vec<Slot>,
    /// The slots that have an owner or a rule.
    active: Vec<u32>,
    /// The number of claims in the area when the owners were looked up last; `None` before the first tick.
    claims: Option<u64>,
    /// Whether variables with a rule have their safe values from the first tick on.
    begins_safe: bool,
    /// Before this time, in nanoseconds of `CLOCK_MONOTONIC`, no input can become late.
    deadline: u64,
    /// The changes before the present tick, by owner (0 for none) and by kind.
    counts: [[Count; Change::ALL.len()]; MAILBOXES + 1],
}

impl InputLatch {
    /// Makes the latch of an area with a slot for each of `symbols`, whose variables can be given; `rules` are
    /// those of the configuration, in the same order. With `begins_safe` variables with a rule have their safe
    /// values from the first tick on; else, after an online change, they stay what they were, for at
    /// most their timeout.
    pub fn new(
        area: InputArea,
        symbols: Vec<Symbol>,
        rules: &[Option<Rule>],
        begins_safe: bool,
    ) -> Self {
        let rules = rules.iter().copied().chain(std::iter::repeat(None));
        let slot = |(symbol, rule)| Slot {
            symbol,
            rule,
            owner: 0,
            last_owner: 0,
            state: SlotState::Vacant,
            refused: false,
            shown: SlotState::Vacant as u64,
            serial: 0,
            value: None,
            since: 0,
        };
        let slots: Vec<Slot> = symbols.into_iter().zip(rules).map(slot).collect();
        let active = Vec::with_capacity(slots.len());
        let counts = Default::default();
        Self { area, slots, active, claims: None, begins_safe, deadline: 0, counts }
    }

    /// Takes what the writers have given; called before each tick. `words` is the mapped file, `now` the time in
    /// nanoseconds of `CLOCK_MONOTONIC`. `apply` is called with the slot and the value of each variable that has
    /// to be set. With `set_all` the inputs whose values have not changed are set too, since the stimulus or
    /// the socket may have set them. `report` is called for each change of inputs.
    pub fn take(
        &mut self,
        words: &[AtomicU64],
        now: u64,
        set_all: bool,
        mut apply: impl FnMut(u32, Number),
        mut report: impl FnMut(InputEvent),
    ) {
        let claims = self.area.claims(words).map(|claims| claims.load(Ordering::Acquire));
        let first = self.claims.is_none();
        let changed = claims != self.claims;
        if changed {
            self.claims = claims;
            self.find_owners(words, now, first);
        }
        // The mailboxes are read after the claims: a writer clears its mailbox before it claims a slot, so no
        // value of the mailbox's previous owner is taken.
        let mut fronts = [None; MAILBOXES];
        let mut fresh = false;
        for (mailbox, front) in fronts.iter_mut().enumerate() {
            *front = self.area.buffers(words, mailbox).and_then(triple_buffer::take);
            fresh |= front.is_some_and(|taken: Taken| taken.fresh);
        }
        if !(fresh || changed || set_all || now >= self.deadline) {
            return;
        }
        self.deadline = u64::MAX;
        let mut reported = false;
        for &number in &self.active {
            let Some(slot) = self.slots.get_mut(number as usize) else { continue };
            let front = slot.owner.checked_sub(1).and_then(|mailbox| {
                let taken: Taken = (*fronts.get(mailbox)?)?;
                Some((mailbox, taken.front))
            });
            let given = front.and_then(|(mailbox, front)| {
                self.area.value(words, mailbox, front, number as usize)
            });
            let given =
                given.map(|(value, serial)| (read_word(value).to_le(), read_word(serial).to_le()));
            let begins = first && self.begins_safe;
            let (change, value) = slot.step(words, self.area, given, now, begins, set_all);
            if let Some(value) = value {
                apply(number, value);
            }
            if let Some(change) = change {
                let writer = if change == Change::Released { slot.last_owner } else { slot.owner };
                let counts = self.counts.get_mut(writer);
                if let Some(count) = counts.and_then(|counts| counts.get_mut(change as usize)) {
                    if count.count == 0 {
                        count.first = number;
                    }
                    count.count += 1;
                    reported = true;
                }
            }
            let shown = slot.shown_state();
            if std::mem::replace(&mut slot.shown, shown) != shown
                && let Some(word) = self.area.state(words, number as usize)
            {
                write_word(word, shown.to_le());
            }
            if let Some(deadline) = slot.deadline(words, self.area) {
                self.deadline = self.deadline.min(deadline);
            }
        }
        if !reported {
            return;
        }
        for (owner, counts) in self.counts.iter_mut().enumerate() {
            for (count, change) in counts.iter_mut().zip(Change::ALL) {
                let Count { first, count } = std::mem::take(count);
                if count > 0 {
                    let mailbox = owner.checked_sub(1);
                    let name = mailbox.and_then(|mailbox| self.area.name(words, mailbox));
                    let writer = name.map(WriterName::read).unwrap_or_default();
                    report(InputEvent { change, writer, first, count });
                }
            }
        }
    }

    /// Whether the input of a slot is set again whenever somebody else has set it, so that nothing comes of that: its
    /// writer gives it, or it has its safe value since its writer is late or gone.
    pub fn holds(&self, slot: u32) -> bool {
        self.slots
            .get(slot as usize)
            .is_some_and(|slot| slot.symbol.direction == Direction::Input && slot.value.is_some())
    }

    /// Looks up who owns which slot.
    fn find_owners(&mut self, words: &[AtomicU64], now: u64, first: bool) {
        self.active.clear();
        for (number, slot) in (0..).zip(&mut self.slots) {
            let owner = self.area.owner(words, number as usize);
            let owner = owner.map_or(0, |owner| owner.load(Ordering::Acquire)).to_le();
            let owner = usize::try_from(owner).unwrap_or(0);
            let owner = if owner > MAILBOXES { 0 } else { owner };
            if owner != 0 {
                slot.last_owner = owner;
            }
            slot.owner = owner;
            // The time of the newest value stays when the owner changes: a change of owner is not a new value.
            if first {
                slot.since = now;
            }
            // A slot that was released is handled once more, so that its input gets the safe value.
            if owner != 0 || slot.rule.is_some() || slot.state == SlotState::Current {
                self.active.push(number);
            }
        }
    }
}

impl Slot {
    /// Brings the slot up to date before a tick. Gives how it has changed, and the value that its variable is to be
    /// set to. `given` is the value and serial number that its writer has published last. `begins_safe` says
    /// that this is the first tick, in which variables with a rule get their safe values.
    fn step(
        &mut self,
        words: &[AtomicU64],
        area: InputArea,
        given: Option<(u64, u64)>,
        now: u64,
        begins_safe: bool,
        set_all: bool,
    ) -> (Option<Change>, Option<Number>) {
        let is_input = self.symbol.direction == Direction::Input;
        if begins_safe && self.rule.is_some() {
            return (None, self.safe_value(words, area));
        }
        if let Some((value, serial)) = given
            && serial != 0
            && serial != self.serial
        {
            self.serial = serial;
            let value = match self.symbol.outside().range() {
                Some(_) => Number::Int(value as i64),
                None => Number::Float(f64::from_bits(value)),
            };
            if !self.symbol.takes(value) {
                // This is reported once, and again after a value that could be taken.
                let known = std::mem::replace(&mut self.refused, true);
                let late = self.deadline(words, area).is_some_and(|end| now >= end);
                if !late || self.state == SlotState::Safe {
                    return ((!known).then_some(Change::Refused), None);
                }
                return (Some(Change::Late), self.become_safe(words, area));
            }
            self.refused = false;
            self.since = now;
            let change = match self.state {
                SlotState::Vacant => Some(Change::Begun),
                SlotState::Safe => Some(Change::Recovered),
                SlotState::Current => None,
            };
            // An input is set when its value changes; another variable whenever it is given, since the
            // program may have changed it.
            let set = !is_input || set_all || change.is_some() || self.value != Some(value);
            self.state = SlotState::Current;
            self.value = Some(value);
            return (change, set.then_some(value));
        }
        let change = match (self.owner, self.state) {
            (_, SlotState::Safe) => None,
            (0, SlotState::Current) => Some(Change::Released),
            _ => self.deadline(words, area).filter(|&end| now >= end).map(|_| Change::Late),
        };
        if change.is_some() {
            return (change, self.become_safe(words, area));
        }
        (None, self.value.filter(|_| set_all && is_input))
    }

    /// Puts the slot into the state [`SlotState::Safe`]. Returns the value that its variable is to be set to; `None` if
    /// it stays what it is, as a variable does that is neither an input nor named by the configuration.
    fn become_safe(&mut self, words: &[AtomicU64], area: InputArea) -> Option<Number> {
        self.state = SlotState::Safe;
        let has_safe_value = self.symbol.direction == Direction::Input || self.rule.is_some();
        self.value = self.safe_value(words, area).filter(|_| has_safe_value);
        self.value
    }

    /// The state as the file shows it.
    fn shown_state(&self) -> u64 {
        match self.state {
            SlotState::Current if self.refused => SHOWN_REFUSED,
            state => state as u64,
        }
    }

    /// The time from which on the value is late, in nanoseconds of `CLOCK_MONOTONIC`; `None` if it never is.
    fn deadline(&self, words: &[AtomicU64], area: InputArea) -> Option<u64> {
        let of_mailbox = || {
            let timeout = self.owner.checked_sub(1).and_then(|owner| area.timeout(words, owner));
            timeout.map_or(0, |timeout| read_word(timeout).to_le())
        };
        let timeout = self.rule.map_or_else(of_mailbox, |rule| rule.timeout_ns);
        let waits = self.state == SlotState::Current
            || self.state == SlotState::Vacant && self.rule.is_some();
        (waits && timeout != 0).then(|| self.since.saturating_add(timeout))
    }

    /// What the variable is set to when it is late; `None` if it stays what it is.
    fn safe_value(&self, words: &[AtomicU64], area: InputArea) -> Option<Number> {
        let held = || {
            let hold = self.owner.checked_sub(1).and_then(|owner| area.hold(words, owner));
            hold.is_some_and(|hold| read_word(hold).to_le() == 1)
        };
        let safe = match self.rule {
            Some(rule) => rule.safe,
            None if held() => Safe::Hold,
            None => Safe::Off,
        };
        let has_fraction = self.symbol.outside().range().is_none();
        match safe {
            Safe::Hold => None,
            Safe::Value(value) => Some(value),
            Safe::Off if has_fraction => Some(Number::Float(0.0)),
            Safe::Off => Some(Number::Int(0)),
        }
    }
}
