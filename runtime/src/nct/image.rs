//! The process image as the modules share it: one module's registers and input images are in it,
//! the others' wait outside, in [`Modules`].

use std::ops::Range;

use memmap2::MmapMut;
use plcc_abi::Program;
use plcc_abi::image::{read_u16, read_u32, write_u16, write_u32, write_u64};
use plcc_abi::nct::{FlagLocation, LINE_BYTES, NctTables, context, layout::region};

use crate::image_memory::image_memory;

use super::NctLoadError;
use super::state::{Modules, SavedInputs};

/// Where the parts of the image begin that the executive uses. `rh` to `rp` are the registers of these
/// letters, 16 bits each.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    pub(super) context: u32,
    pub(super) lines_in: u32,
    pub(super) lines_out: u32,
    pub(super) rh: u32,
    pub(super) q: u32,
    pub(super) t: u32,
    pub(super) h: u32,
    pub(super) m: u32,
    pub(super) rp: u32,
    /// The input image that is shown: its bytes, and its bits that are kept as one byte each.
    input: [Range<usize>; 2],
    /// The one before it, with which it is compared.
    previous: [Range<usize>; 2],
}

impl Places {
    /// Finds the regions; a missing or short one is named.
    pub(super) fn of(program: &Program) -> Result<Self, String> {
        let find = |name: &str, size: u32| {
            program
                .region(name)
                .filter(|r| r.size >= size)
                .filter(|r| r.offset.checked_add(r.size).is_some_and(|e| e <= program.image_size))
                .ok_or_else(|| format!("the region `{name}` is missing or too short"))
        };
        let offset = |name: &str, size: u32| find(name, size).map(|region| region.offset);
        let words = |name: &str, count: u16| offset(name, u32::from(count) * 2);
        let range = |name: &str| {
            find(name, 0).map(|r| r.offset as usize..r.offset as usize + r.size as usize)
        };
        let ranges = |[bytes, bits]: [&str; 2]| Ok::<_, String>([range(bytes)?, range(bits)?]);
        let (rh, q, t, h) = {
            use plcc_abi::nct::{H_COUNT, Q_COUNT, RH_COUNT, T_COUNT};
            (
                words(region::RH, RH_COUNT)?,
                words(region::Q, Q_COUNT)?,
                words(region::T, T_COUNT)?,
                words(region::H, H_COUNT)?,
            )
        };
        let places = Self {
            context: offset(region::CONTEXT, context::SIZE)?,
            lines_in: offset(region::LINES_IN, LINE_BYTES as u32)?,
            lines_out: offset(region::LINES_OUT, LINE_BYTES as u32)?,
            rh,
            q,
            t,
            h,
            m: words(region::M, plcc_abi::nct::M_COUNT)?,
            rp: words(region::RP, plcc_abi::nct::RP_COUNT)?,
            input: ranges(region::INPUT)?,
            previous: ranges(region::PREVIOUS)?,
        };
        let same = places.input.iter().zip(&places.previous).all(|(a, b)| a.len() == b.len());
        if same { Ok(places) } else { Err("the regions of I and V differ in size".into()) }
    }
}

/// A module: 0, 1 or 2, and the number of its task.
pub(super) type Module = usize;

impl Modules {
    /// A module's OP, while none runs.
    pub(super) fn op(&self, module: Module) -> u16 {
        self.registers.get(module).map_or(0, |saved| read_u16(saved, context::OP))
    }

    /// Sets a module's OP, while none runs.
    pub(super) fn set_op(&mut self, module: Module, value: u16) {
        if let Some(saved) = self.registers.get_mut(module) {
            write_u16(saved, context::OP, value);
        }
    }
}

/// The process image.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) bytes: MmapMut,
    pub(super) places: Places,
    pub(super) inputs: Vec<FlagLocation>,
    /// Whether the input images of :001 and of :000, and the ones before them, are known to hold the same
    /// bytes. That is so a slice after the last change of an input; it then makes no difference which of
    /// them are shown, so nothing is copied.
    input_images_equal: bool,
}

/// The parts of the region `context`: OP and DEPTH, FUEL, ON_EMPTY with what is free behind it, and
/// the return addresses, of which the first one stands alone, so that the others are whole vectors. What one
/// part holds is stored at once: a processor waits where it loads several bytes at once that were stored
/// separately shortly before.
#[derive(Clone, Copy)]
struct Registers {
    op: u16,
    depth: u16,
    first_site: u32,
    other_sites: [u8; OTHER_SITES],
}

/// The length in bytes of all return addresses but the first.
const OTHER_SITES: usize = (context::SIZE - context::SITES - 4) as usize;

impl Registers {
    /// Reads the region; `None` if it is too short.
    #[inline]
    fn read(region: &[u8]) -> Option<Self> {
        let other_sites = *region.get(context::SITES as usize + 4..)?.first_chunk()?;
        Some(Self {
            op: read_u16(region, context::OP),
            depth: read_u16(region, context::DEPTH),
            first_site: read_u32(region, context::SITES),
            other_sites,
        })
    }

    /// Writes the region, with `fuel` and what happens when it is used up.
    #[inline]
    fn write(&self, region: &mut [u8], fuel: u32, stops: bool) {
        let Some(sites) = region.get_mut(context::SITES as usize + 4..) else { return };
        let Some(sites) = sites.first_chunk_mut() else { return };
        *sites = self.other_sites;
        write_u32(region, context::SITES, self.first_site);
        write_u32(region, context::ON_EMPTY, u32::from(stops));
        let begin = u64::from(self.op) | u64::from(self.depth) << 16 | u64::from(fuel) << 32;
        write_u64(region, context::OP, begin);
    }
}

impl Image {
    pub(super) fn new(program: &Program, tables: &NctTables) -> Result<Self, NctLoadError> {
        let places = Places::of(program).map_err(NctLoadError::Damaged)?;
        Ok(Self {
            bytes: image_memory(program.image_size)?,
            places,
            inputs: tables.inputs.clone(),
            input_images_equal: false,
        })
    }

    /// The physical input lines.
    pub(super) fn lines_in(&self) -> Option<&[u8; LINE_BYTES]> {
        self.bytes.get(self.places.lines_in as usize..)?.first_chunk()
    }

    /// Says that the input images may have changed in another way than by [`set_input`](Self::set_input),
    /// [`set_input_bit`](Self::set_input_bit) and [`age_inputs`](Self::age_inputs).
    pub(super) fn input_images_replaced(&mut self) {
        self.input_images_equal = false;
    }

    /// Finds out whether all input images hold the same.
    pub(super) fn compare_input_images(&mut self, modules: &Modules) {
        if self.input_images_equal {
            return;
        }
        let SavedInputs { input, previous } = &modules.saved_inputs;
        let Places { input: shown, previous: shown_previous, .. } = &self.places;
        let bytes = |range: &Range<usize>| self.bytes.get(range.clone());
        let parts = shown.iter().zip(shown_previous).zip(input.iter().zip(previous));
        self.input_images_equal =
            parts.into_iter().all(|((now, before), (other, other_before))| {
                let now = bytes(now);
                now == bytes(before) && now == Some(&**other) && now == Some(&**other_before)
            });
    }

    /// The lengths of an input image: its bytes, its single bits.
    pub(super) fn input_lengths(&self) -> [usize; 2] {
        self.places.input.each_ref().map(Range::len)
    }

    /// Has the process image hold the input images of :000 (`level0`), or those of :001. The others are kept
    /// in `modules`.
    #[inline]
    pub(super) fn show(&mut self, modules: &mut Modules, level0: bool) {
        if modules.level0_inputs != level0 {
            modules.level0_inputs = level0;
            if !self.input_images_equal {
                self.swap_input_images(modules);
            }
        }
    }

    /// Exchanges the input images in the process image for those in `modules`.
    fn swap_input_images(&mut self, modules: &mut Modules) {
        let Places { input, previous, .. } = &self.places;
        let inside = input.iter().chain(previous);
        let SavedInputs { input, previous } = &mut modules.saved_inputs;
        let outside = input.iter_mut().chain(previous);
        for (range, waiting) in inside.zip(outside) {
            let bytes = self.bytes.get_mut(range.clone());
            if let Some(bytes) = bytes.filter(|bytes| bytes.len() == waiting.len()) {
                bytes.swap_with_slice(waiting);
            }
        }
    }

    /// Makes the shown input image the previous one, as a new one is about to be filled in.
    pub(super) fn age_inputs(&mut self) {
        if self.input_images_equal {
            return;
        }
        for (from, to) in self.places.input.iter().zip(&self.places.previous) {
            self.bytes.copy_within(from.clone(), to.start);
        }
    }

    /// Copies the inputs of :001 into the input image of :000, which must be the one that is shown.
    pub(super) fn synchronise(&mut self, modules: &Modules) {
        if self.input_images_equal {
            return;
        }
        self.age_inputs();
        for (range, from) in self.places.input.iter().zip(&modules.saved_inputs.input) {
            let bytes = self.bytes.get_mut(range.clone());
            if let Some(bytes) = bytes.filter(|bytes| bytes.len() == from.len()) {
                bytes.copy_from_slice(from);
            }
        }
    }

    /// Fills the shown input image's byte.
    pub(super) fn set_input(&mut self, byte: usize, value: u8) {
        self.input_images_equal = false;
        if let Some(location) = self.inputs.get(byte) {
            location.write(&mut self.bytes, value);
        }
    }

    /// Sets a bit of the shown input image.
    pub(super) fn set_input_bit(&mut self, byte: usize, bit: u8, value: bool) {
        if let Some(location) = self.inputs.get(byte)
            && location.bit(&self.bytes, bit) != value
        {
            self.input_images_equal = false;
            location.set_bit(&mut self.bytes, bit, value);
        }
    }

    /// Puts a module's registers and input images in. `fuel` is the number of safepoints that its next call
    /// may pass; `stops` says whether it is stopped or suspended when they are used up.
    #[inline]
    pub(super) fn enter(&mut self, modules: &mut Modules, module: Module, fuel: u32, stops: bool) {
        self.show(modules, module == 0);
        if let Some(saved) = modules.registers.get(module)
            && let Some(place) = self.bytes.get_mut(self.places.context as usize..)
            && let Some(registers) = Registers::read(saved)
        {
            registers.write(place, fuel, stops);
        }
    }

    /// Takes a module's registers out.
    #[inline]
    pub(super) fn leave(&self, modules: &mut Modules, module: Module) {
        if let Some(saved) = modules.registers.get_mut(module)
            && let Some(place) = self.bytes.get(self.places.context as usize..)
            && let Some(registers) = Registers::read(place)
        {
            // How much fuel is left depends on the clock, and it is given anew with each call.
            registers.write(saved, 0, false);
        }
    }

    /// Lowers each word of the `BYTES` bytes from `offset` on by `times`, but to no less than 0.
    #[inline]
    pub(super) fn count_down<const BYTES: usize>(&mut self, offset: u32, times: u64) {
        let times = u16::try_from(times).unwrap_or(u16::MAX);
        let words = self.bytes.get_mut(offset as usize..);
        let Some(words) = words.and_then(|bytes| bytes.first_chunk_mut::<BYTES>()) else { return };
        // Without a branch, so that the compiler makes vector instructions of it.
        for word in words.as_chunks_mut::<2>().0 {
            *word = u16::from_le_bytes(*word).saturating_sub(times).to_le_bytes();
        }
    }
}
