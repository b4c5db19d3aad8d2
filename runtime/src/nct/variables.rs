//! Reads and sets variables for people and machines: the stimulus, traces and dumps.

use plcc_abi::image::{read_u8, read_u16, write_u8, write_u16};
use plcc_abi::nct::{FlagLocation, IMAGE_BYTES, LINE_BYTES, NctName, NctTables};

use super::image::Image;
use super::state::Modules;

/// What is needed to read the variables.
pub(super) struct View<'a> {
    pub(super) image: &'a Image,
    pub(super) modules: &'a Modules,
    pub(super) tables: &'a NctTables,
}

/// A byte or bit among locations; a word's second byte is 0 where there is none.
fn located(image: &[u8], locations: &[FlagLocation], byte: usize, bit: Option<u8>) -> u16 {
    let read = |n: usize| locations.get(n).map_or(0, |location| location.read(image));
    pick(read, byte, bit)
}

/// Physical lines, a byte of the image each.
fn lines(image: &[u8], offset: u32, byte: usize, bit: Option<u8>) -> u16 {
    let read = |n: usize| if n < LINE_BYTES { read_u8(image, offset + n as u32) } else { 0 };
    pick(read, byte, bit)
}

fn pick(read: impl Fn(usize) -> u8, byte: usize, bit: Option<u8>) -> u16 {
    match bit {
        Some(bit) => u16::from(read(byte) >> bit & 1),
        None => u16::from_le_bytes([read(byte), read(byte + 1)]),
    }
}

impl View<'_> {
    pub(super) fn get(&self, name: NctName) -> u16 {
        let image = &self.image.bytes;
        let places = &self.image.places;
        let word = |offset: u32, n: u32| read_u16(image, offset + n * 2);
        match name {
            NctName::I { byte, bit } => located(image, &self.tables.inputs, byte.into(), bit),
            NctName::Y { byte, bit } => located(image, &self.tables.outputs, byte.into(), bit),
            NctName::F { byte, bit } => located(image, &self.tables.flags, byte.into(), bit),
            NctName::P { byte, bit } => lines(image, places.lines_in, byte.into(), bit),
            NctName::O { byte, bit } => lines(image, places.lines_out, byte.into(), bit),
            NctName::Rh(n) => word(places.rh, n.into()),
            NctName::Q(n) => word(places.q, n.into()),
            NctName::T(n) => word(places.t, n.into()),
            NctName::H(n) => word(places.h, n.into()),
            NctName::M(n) => word(places.m, n.into()),
            NctName::Rp(n) => word(places.rp, n.into()),
            NctName::Op(n) => self.modules.op(n.into()),
        }
    }
}

/// What is needed to set the variables as the machine or the operator would.
pub(super) struct Target<'a> {
    pub(super) image: &'a mut Image,
    pub(super) tables: &'a NctTables,
    pub(super) modules: &'a mut Modules,
    pub(super) nc_flags: &'a mut [u8],
}

impl Target<'_> {
    pub(super) fn set(&mut self, name: NctName, word: u16) {
        let tables = self.tables;
        let places = self.image.places.clone();
        let image = &mut self.image.bytes;
        let mut put = |offset: u32, n: u32| write_u16(image, offset + n * 2, word);
        match name {
            NctName::Rh(n) => put(places.rh, n.into()),
            NctName::Q(n) => put(places.q, n.into()),
            NctName::T(n) => put(places.t, n.into()),
            NctName::H(n) => put(places.h, n.into()),
            NctName::M(n) => put(places.m, n.into()),
            NctName::Rp(n) => put(places.rp, n.into()),
            NctName::Op(n) => self.modules.set_op(n.into(), word),
            NctName::Y { byte, bit } => self.located(&tables.outputs, byte.into(), bit, word),
            NctName::F { byte, bit } => self.located(&tables.flags, byte.into(), bit, word),
            NctName::O { byte, bit } => {
                self.lines(places.lines_out, LINE_BYTES, byte.into(), bit, word);
            }
            NctName::P { byte, bit } => {
                self.lines(places.lines_in, LINE_BYTES, byte.into(), bit, word);
            }
            NctName::I { byte, bit } => {
                self.lines(places.lines_in, IMAGE_BYTES, byte.into(), bit, word);
            }
        }
    }

    fn located(&mut self, locations: &[FlagLocation], byte: usize, bit: Option<u8>, word: u16) {
        let Some(location) = locations.get(byte) else { return };
        let image = &mut self.image.bytes;
        match bit {
            Some(bit) => location.set_bit(image, bit, word & 1 != 0),
            None => {
                let [low, high] = word.to_le_bytes();
                location.write(image, low);
                if let Some(location) = locations.get(byte + 1) {
                    location.write(image, high);
                }
            }
        }
    }

    /// Physical lines from `offset` on and, up to byte `end`, the NC's flags after them.
    fn lines(&mut self, offset: u32, end: usize, byte: usize, bit: Option<u8>, word: u16) {
        let image = &mut self.image.bytes;
        let mut change = |n: usize, mask: u8, value: u8| {
            if n < LINE_BYTES {
                let at = offset + n as u32;
                let others = read_u8(image, at) & !mask;
                write_u8(image, at, others | value & mask);
            } else if let Some(flags) = self.nc_flags.get_mut(n).filter(|_| n < end) {
                *flags = *flags & !mask | value & mask;
            }
        };
        match bit {
            Some(bit) => change(byte, 1 << bit, if word & 1 != 0 { 0xFF } else { 0 }),
            None => {
                let [low, high] = word.to_le_bytes();
                change(byte, 0xFF, low);
                change(byte + 1, 0xFF, high);
            }
        }
    }
}
