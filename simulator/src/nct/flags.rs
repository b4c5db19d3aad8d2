//! The NC's flags and registers, and how they are found, read and written.

use crate::access::{Access, Handle, ImagePart, Use, Variable};
use crate::context::Context;

use super::Step;

/// How many bytes of flags there are.
const BYTES: usize = 100;
/// How many registers RH there are.
const REGISTERS: usize = 200;
/// How many bytes of memory F there are.
const MEMORY: usize = 1000;

/// Flags, eight in a byte.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flags([u8; BYTES]);

impl Default for Flags {
    fn default() -> Self {
        Self([0; BYTES])
    }
}

impl Flags {
    pub(super) fn is_on(&self, byte: usize, bit: usize) -> bool {
        self.byte(byte) >> (bit & 7) & 1 != 0
    }

    pub(super) fn byte(&self, byte: usize) -> u8 {
        self.0.get(byte).copied().unwrap_or(0)
    }

    pub(super) fn set(&mut self, byte: usize, bit: usize, on: bool) {
        if let Some(flags) = self.0.get_mut(byte) {
            *flags = *flags & !(1 << (bit & 7)) | u8::from(on) << (bit & 7);
        }
    }

    pub(super) fn set_byte(&mut self, byte: usize, value: u8) {
        if let Some(flags) = self.0.get_mut(byte) {
            *flags = value;
        }
    }
}

/// Registers RH.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Registers([u16; REGISTERS]);

impl Default for Registers {
    fn default() -> Self {
        Self([0; REGISTERS])
    }
}

impl Registers {
    pub(super) fn set(&mut self, number: usize, value: u16) {
        if let Some(register) = self.0.get_mut(number) {
            *register = value;
        }
    }

    fn get(&self, number: usize) -> u16 {
        self.0.get(number).copied().unwrap_or(0)
    }
}

/// The bytes of output flags that the NC reads: modes, states, keys' selections, axes, spindles; messages and the PLC's axes.
const READ: [std::ops::RangeInclusive<usize>; 2] = [40..=67, 70..=97];
/// The output flags of messages.
pub(super) const MESSAGES: std::ops::RangeInclusive<usize> = 70..=89;

/// The flags that the NC holds: byte, and its bits. None of them is in the image: what was written stays.
const HELD: [(usize, &[usize]); 20] = [
    (51, &[1]),
    (52, &[0, 1, 2, 3, 4, 5, 6, 7]),
    (53, &[0, 1, 2, 7]),
    (54, &[0, 1, 2, 5, 6, 7]),
    (55, &[0, 1, 2, 3, 4]),
    (56, &[0, 1, 2, 3, 4, 5, 6, 7]),
    (60, &[6, 7]),
    (61, &[0, 1, 2, 3, 4, 5, 6, 7]),
    (62, &[0, 1, 2, 3, 4, 5, 6, 7]),
    (65, &[0, 1, 2, 6, 7]),
    (66, &[0, 1, 2, 3, 4, 6, 7]),
    (67, &[5, 6, 7]),
    (90, AXIS),
    (91, AXIS),
    (92, AXIS),
    (93, AXIS),
    (94, AXIS),
    (95, AXIS),
    (96, AXIS),
    (97, AXIS),
];
/// The flags of an axis.
const AXIS: &[usize] = &[0, 1, 3, 7];

/// The registers that the NC holds.
fn held_registers() -> impl Iterator<Item = usize> {
    let of_axes =
        (0..super::state::AXES).flat_map(|axis| (0..4).map(move |at| 100 + 5 * axis + at));
    (0..=11).chain([15, 16, 20, 30, 31, 32]).chain(of_axes)
}

/// Everything that the control reads and writes.
#[derive(Clone, Debug)]
pub(super) struct Variables {
    bytes: Vec<(usize, Variable)>,
    /// The output flags as they were read last, and the image then.
    y: (Flags, ImagePart),
    reset_key: Variable,
    spindle_codes: [(Variable, Variable); 2],
    feed_code: Variable,
    spindle_override_code: Variable,
    rapid_code: Variable,
    /// For each byte of flags that the NC holds its number, and its flags.
    flags: Vec<(usize, [Variable; 8])>,
    /// The flags that were written last, and the revision of the variables then.
    written: Option<(Flags, u64)>,
    registers: Vec<(usize, Variable)>,
    /// The registers that were written last, with the revision of the variables then, and the image when all had their values.
    written_registers: (Option<(Registers, u64)>, ImagePart),
    /// I700 to I897.
    messages: Vec<Variable>,
    /// RH028, RH029, RH039.
    overrides: [Variable; 3],
    /// For each axis of the PLC RH150 to RH153 and on.
    plc_axes: Vec<[Variable; 4]>,
    /// RH051 and RH052, RH054 and RH055.
    pub(super) sent_record: [Variable; 2],
    pub(super) received_record: [Variable; 2],
    /// F000 to F998, words of bytes.
    memory: Vec<Variable>,
}

impl Variables {
    pub(super) fn find(access: &mut dyn Access) -> Self {
        let mut read = |name: &str| Variable::find(access, name, Use::Read);
        let reset_key = read("I477");
        let spindle_codes = [(read("RH060"), read("RH061")), (read("RH065"), read("RH066"))];
        let plc_axis =
            |axis: usize| [0, 1, 2, 3].map(|at| read(&format!("RH{}", 150 + 5 * axis + at)));
        let plc_axes = (0..super::state::AXES).map(plc_axis).collect();
        let sent_record = ["RH051", "RH052"].map(&mut read);
        let received_record = ["RH054", "RH055"].map(&mut read);
        let (feed_code, spindle_override_code) = (read("RH078"), read("RH079"));
        let rapid_code = read("RH089");
        let bytes = READ
            .into_iter()
            .flatten()
            .map(|byte| (byte, Variable::find(access, &format!("Y{byte:02}0"), Use::Byte)));
        let bytes: Vec<(usize, Variable)> = bytes.collect();
        let mut write = |name: &str| Variable::find(access, name, Use::Write);
        let flags = HELD.iter().map(|(byte, bits)| {
            let mut flags = [Variable::default(); 8];
            for (bit, flag) in flags.iter_mut().enumerate().filter(|(bit, _)| bits.contains(bit)) {
                *flag = write(&format!("I{byte:02}{bit}"));
            }
            (*byte, flags)
        });
        let flags = flags.collect();
        let registers = held_registers().map(|number| (number, write(&format!("RH{number:03}"))));
        let registers: Vec<(usize, Variable)> = registers.collect();
        let messages = MESSAGES.flat_map(|byte| (0..8).map(move |bit| format!("I{byte:02}{bit}")));
        let messages = messages.map(|name| write(&name)).collect();
        let overrides = ["RH028", "RH029", "RH039"].map(&mut write);
        let memory = (0..MEMORY - 1).map(|byte| write(&format!("F{byte:03}"))).collect();
        let part = |of: &[(usize, Variable)], access: &dyn Access| {
            ImagePart::of(of.iter().map(|(_, variable)| *variable), access)
        };
        let y = (Flags::default(), part(&bytes, access));
        let written_registers = (None, part(&registers, access));
        Self {
            bytes,
            y,
            reset_key,
            spindle_codes,
            feed_code,
            spindle_override_code,
            rapid_code,
            flags,
            written: None,
            registers,
            written_registers,
            messages,
            overrides,
            plc_axes,
            sent_record,
            received_record,
            memory,
        }
    }

    /// The registers of an axis of the PLC: its position and its speed, the low words first.
    pub(super) fn plc_axis(&self, axis: usize, access: &dyn Access) -> [i64; 4] {
        let registers = self.plc_axes.get(axis).copied().unwrap_or_default();
        registers.map(|register| register.read(access))
    }

    /// The word in which a byte of the memory lies, and whether it is the high byte.
    fn word(&self, byte: usize) -> Option<(Variable, bool)> {
        let low = self.memory.get(byte).map(|word| (*word, false));
        let before = || self.memory.get(byte.checked_sub(1)?).map(|word| (*word, true));
        low.or_else(before)
    }

    /// A byte of the memory, F000 to F999.
    pub(super) fn memory(&self, byte: usize, access: &dyn Access) -> u8 {
        let Some((word, high)) = self.word(byte) else { return 0 };
        let value = word.read(access);
        (if high { value >> 8 } else { value }) as u8
    }

    /// Sets a byte of the memory.
    pub(super) fn set_memory(&self, byte: usize, value: u8, access: &mut dyn Access) {
        let Some((word, high)) = self.word(byte) else { return };
        let (old, value) = (word.read(access), i64::from(value));
        let new = if high { old & 0xFF | value << 8 } else { old & 0xFF00 | value };
        word.write(access, new);
    }

    /// What is written.
    pub(super) fn writes(&self) -> Vec<Handle> {
        let flags = self.flags.iter().flat_map(|(_, flags)| *flags);
        let registers = self.registers.iter().map(|(_, register)| *register);
        let all = flags.chain(registers).chain(self.messages.iter().copied()).chain(self.overrides);
        all.filter_map(Variable::handle).collect()
    }

    /// Step 0 gives the overrides 100 %.
    pub(super) fn first_overrides(&self, access: &mut dyn Access, has_few_rapid_steps: bool) {
        let [feed, spindle, rapid] = self.overrides;
        feed.write(access, 13);
        spindle.write(access, 5);
        rapid.write(access, if has_few_rapid_steps { 3 } else { 13 });
    }

    /// What a step sees. The output flags are read only where the image has changed.
    pub(super) fn see<'a, 'c>(&mut self, now: &'a mut Context<'c>) -> Step<'a, 'c> {
        let access = &*now.access;
        let (y, part) = &mut self.y;
        if !part.is_same(access) {
            for (byte, variable) in &self.bytes {
                y.set_byte(*byte, variable.read(access) as u8);
            }
            part.copy(access);
        }
        let y = *y;
        let codes = |(value, voltage): (Variable, Variable)| {
            (i64::from(value.read(access) as u16), i64::from(voltage.read(access) as u16 as i16))
        };
        Step {
            y,
            reset_key: self.reset_key.is_on(access),
            spindle_codes: self.spindle_codes.map(codes),
            feed_code: self.feed_code.read(access),
            spindle_override_code: self.spindle_override_code.read(access),
            rapid_code: self.rapid_code.read(access),
            strobes: Flags::default(),
            now,
        }
    }

    /// Writes what the NC holds. Of the flags only those are looked at that have changed since they were written. Registers lie
    /// in the image, which is set as a whole where a run goes back: they are left alone while both are as they were when a pass over
    /// all of them found nothing to write.
    pub(super) fn write(&mut self, access: &mut dyn Access, flags: &Flags, registers: &Registers) {
        let revision = access.revision();
        let written = self.written.filter(|(_, at)| *at == revision);
        for (byte, variables) in &self.flags {
            let now = flags.byte(*byte);
            let changed = written.map_or(u8::MAX, |(before, _)| before.byte(*byte) ^ now);
            if changed == 0 {
                continue;
            }
            for (bit, variable) in variables.iter().enumerate() {
                if changed >> bit & 1 != 0 {
                    variable.write(access, (now >> bit & 1).into());
                }
            }
        }
        self.written = Some((*flags, revision));
        let (written, part) = &mut self.written_registers;
        let now = Some((*registers, revision));
        if *written == now && part.is_same(access) {
            return;
        }
        *written = now;
        let mut all_there = true;
        for (number, variable) in &self.registers {
            all_there &= variable.write(access, registers.get(*number).into());
        }
        if all_there { part.copy(access) } else { part.forget() }
    }

    /// Writes the flag of the message that is shown, and takes that of the one before away.
    pub(super) fn write_message(
        &self,
        access: &mut dyn Access,
        (shown, before): (Option<usize>, Option<usize>),
    ) {
        let flag = |at: Option<usize>| at.and_then(|at| self.messages.get(at)).copied();
        if before != shown
            && let Some(variable) = flag(before)
        {
            variable.write(access, 0);
        }
        if let Some(variable) = flag(shown) {
            variable.write(access, 1);
        }
    }
}
