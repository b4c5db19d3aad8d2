//! A kernel compiled by plcc, with its process image, as the benchmark runs it.

use std::io;
use std::ops::Range;
use std::time::Instant;

use memmap2::MmapMut;
use plcc_abi::engine::NoHost;
use plcc_abi::image::{read_f64, read_i16, read_u16, read_u32, write_f64, write_i16, write_u32};
use plcc_abi::pmac::{Controller, Layout, Place, Space};
use plcc_abi::{Engine, Scan, Tables};
use plcc_codegen::Optimization;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};

use super::plc::{
    NCT_FIRST_FLAG, NCT_FIRST_WORD, PMAC_BITS, PMAC_FIRST_ELEMENT, PMAC_FIRST_P, PMAC_FIRST_REAL,
    PMAC_WORD_BITS, PMAC_WORDS,
};
use super::{Inputs, Kernel, Language, patterns};
use crate::compiled::{self, Compiled};

/// Where a bit or word stands in the image.
#[derive(Clone, Copy, Debug)]
enum Spot {
    /// A byte that is 0 or 1.
    Byte(u32),
    /// A bit of a byte.
    BitOfByte(u32, u8),
    /// A bit of a word of 32 bits.
    BitOfWord(u32, usize),
    /// A signed number of 16 bits.
    Signed16(u32),
    /// An unsigned number of 16 bits.
    Unsigned16(u32),
    /// A signed number of 24 bits in a word of 32.
    Signed24(u32),
    /// A double.
    Double(u32),
}

impl Spot {
    fn read(self, image: &[u8]) -> f64 {
        match self {
            Self::Byte(at) => f64::from(image[at as usize]),
            Self::BitOfByte(at, bit) => f64::from(image[at as usize] >> bit & 1),
            Self::BitOfWord(at, bit) => f64::from(read_u32(image, at) >> bit & 1),
            Self::Signed16(at) => f64::from(read_i16(image, at)),
            Self::Unsigned16(at) => f64::from(read_u16(image, at)),
            Self::Signed24(at) => f64::from((read_u32(image, at) << 8) as i32 >> 8),
            Self::Double(at) => read_f64(image, at),
        }
    }

    fn write(self, image: &mut [u8], value: f64) {
        match self {
            Self::Byte(at) => image[at as usize] = value as u8,
            Self::BitOfByte(at, bit) => {
                let byte = &mut image[at as usize];
                *byte = *byte & !(1 << bit) | (value as u8 & 1) << bit;
            }
            Self::BitOfWord(at, bit) => {
                let old = read_u32(image, at) & !(1 << bit);
                write_u32(image, at, old | u32::from(value != 0.0) << bit);
            }
            Self::Signed16(at) | Self::Unsigned16(at) => write_i16(image, at, value as i16),
            Self::Signed24(at) => write_u32(image, at, value as i32 as u32 & 0xFF_FFFF),
            Self::Double(at) => write_f64(image, at, value),
        }
    }

    /// The bytes of the image that it is in.
    fn bytes(self) -> Range<usize> {
        let (at, size) = match self {
            Self::Byte(at) | Self::BitOfByte(at, _) => (at, 1),
            Self::Signed16(at) | Self::Unsigned16(at) => (at, 2),
            Self::BitOfWord(at, _) | Self::Signed24(at) => (at, 4),
            Self::Double(at) => (at, 8),
        };
        at as usize..at as usize + size
    }
}

/// A compiled kernel.
pub struct Subject {
    /// What the compiler has made.
    pub compiled: Compiled,
    /// For a PMAC its executive, which holds image and host; else the image.
    executive: Option<Box<PmacExecutive>>,
    image: OwnImage,
    /// The number of the task that is run.
    task: usize,
    /// Bits, words, elements and doubles, in this order.
    spots: Vec<Spot>,
    /// The parts of the image that hold inputs, and for each kind of inputs and each pattern the
    /// bytes of all these parts.
    input_ranges: Vec<Range<usize>>,
    input_bytes: [Vec<Vec<u8>>; 3],
    /// The image before the first scan.
    start: Vec<u8>,
}

impl Subject {
    /// Compiles a kernel with some passes. The patterns of the inputs are made from the seed.
    ///
    /// # Errors
    /// When the program has errors.
    pub fn new(kernel: &Kernel, seed: u64, how: Optimization) -> Result<Self, String> {
        let source = kernel.source();
        let compiled = match kernel.language {
            Language::Pmi => compiled::pmi(&source, how),
            Language::Nct => compiled::nct(&source, how),
            _ => compiled::pmac(&source, how),
        }?;
        let spots = spots(kernel, &compiled)?;
        let mut executive = None;
        let mut image = vec![0; compiled.program.image_size as usize];
        if kernel.language.is_pmac() {
            let made = PmacExecutive::new(&compiled.program, PmacOptions::default());
            let mut made = made.ok_or("no PMAC")?;
            image = made.parts().0.to_vec();
            executive = Some(Box::new(made));
        }
        for (spot, &value) in spots[kernel.bits + kernel.words..].iter().zip(&kernel.start) {
            spot.write(&mut image, value);
        }
        let task = usize::from(kernel.language == Language::Nct);
        let inputs: Vec<Spot> = spots[..kernel.inputs]
            .iter()
            .chain(&spots[kernel.bits..kernel.bits + kernel.input_words])
            .copied()
            .collect();
        let input_ranges = ranges(&inputs);
        let input_bytes = Inputs::ALL.map(|kind| {
            let bytes = |pattern: &super::Pattern| {
                let mut image = image.clone();
                let bits = pattern.bits.iter().map(|&bit| i16::from(bit));
                for (spot, value) in inputs.iter().zip(bits.chain(pattern.words.iter().copied())) {
                    spot.write(&mut image, f64::from(value));
                }
                input_ranges.iter().flat_map(|range| image[range.clone()].to_vec()).collect()
            };
            patterns(kernel, kind, seed).iter().map(bytes).collect()
        });
        let first_input = input_ranges.first().map_or(0, |range| range.start);
        let start = image;
        let image = OwnImage::new(start.len(), first_input).map_err(|error| error.to_string())?;
        Ok(Self { compiled, executive, image, task, spots, input_ranges, input_bytes, start })
    }

    /// Runs scans of native code, or of the statement interpreter; gives nanoseconds a scan.
    pub fn run(&mut self, inputs: Inputs, scans: usize, native: bool) -> f64 {
        let engine: &mut dyn Engine =
            if native { &mut self.compiled.native } else { &mut *self.compiled.interpreter };
        let mut no_host = NoHost;
        let (image, host): (&mut [u8], &mut dyn plcc_abi::Host) = match &mut self.executive {
            Some(executive) => executive.parts(),
            None => (self.image.bytes(), &mut no_host),
        };
        let patterns = &self.input_bytes[inputs as usize];
        let start = Instant::now();
        for n in 0..scans {
            let mut bytes = patterns[inputs.pattern(n)].as_slice();
            for range in &self.input_ranges {
                let (part, rest) = bytes.split_at(range.len());
                copy_inputs(part, &mut image[range.clone()]);
                bytes = rest;
            }
            engine.call(self.task, None, &mut Scan::new(image, host));
        }
        start.elapsed().as_secs_f64() * 1e9 / scans as f64
    }

    /// The number of the task that a scan runs, and the image before the first scan with the static inputs.
    pub fn start_with_inputs(&self) -> (usize, Vec<u8>) {
        let mut image = self.start.clone();
        let mut bytes = self.input_bytes[Inputs::Static as usize][0].as_slice();
        for range in &self.input_ranges {
            let (part, rest) = bytes.split_at(range.len());
            image[range.clone()].copy_from_slice(part);
            bytes = rest;
        }
        (self.task, image)
    }

    /// Runs scans of native code with cold caches, of which the clock's code and what this function uses are not; gives
    /// the median of their times in nanoseconds, without the time in which inputs are copied.
    pub fn run_cold(&mut self, inputs: Inputs, scans: usize) -> f64 {
        let mut evict = vec![0u8; 16 << 20];
        let mut times = vec![];
        for _ in 0..scans {
            self.run(inputs, 1, true);
            let mut no_host = NoHost;
            let (image, host): (&mut [u8], &mut dyn plcc_abi::Host) = match &mut self.executive {
                Some(executive) => executive.parts(),
                None => (self.image.bytes(), &mut no_host),
            };
            let mut scan = Scan::new(image, host);
            let engine: &mut dyn Engine = &mut self.compiled.native;
            for byte in evict.iter_mut().step_by(64) {
                *byte = std::hint::black_box(byte.wrapping_add(1));
            }
            std::hint::black_box(Instant::now());
            let start = Instant::now();
            engine.call(self.task, None, &mut scan);
            times.push(start.elapsed().as_secs_f64() * 1e9);
        }
        times.sort_by(f64::total_cmp);
        times.get(scans / 2).copied().unwrap_or(f64::NAN)
    }

    /// Makes all variables 0, runs scans, and gives bits, words and elements.
    pub fn state_after(&mut self, inputs: Inputs, scans: usize, native: bool) -> Vec<f64> {
        match &mut self.executive {
            Some(executive) => executive.parts().0.copy_from_slice(&self.start),
            None => self.image.bytes().copy_from_slice(&self.start),
        }
        self.run(inputs, scans, native);
        let image = match &mut self.executive {
            Some(executive) => executive.parts().0,
            None => self.image.bytes(),
        };
        self.spots.iter().map(|spot| spot.read(image)).collect()
    }
}

/// An image in pages of its own, as executives have it, whose inputs begin at a cache line, as those of the C do: compilers
/// align arrays. Copying inputs by wide stores that cross a line makes a scan wait for them (5 of 20 ns for NCT's touch panel).
struct OwnImage {
    memory: MmapMut,
    start: usize,
    size: usize,
}

impl OwnImage {
    /// An image of zeros whose byte at `aligned` begins a cache line.
    fn new(size: usize, aligned: usize) -> io::Result<Self> {
        const LINE: usize = 64;
        let memory = MmapMut::map_anon(size + 2 * LINE)?;
        let start = memory.as_ptr().align_offset(LINE) + LINE - aligned % LINE;
        Ok(Self { memory, start, size })
    }

    fn bytes(&mut self) -> &mut [u8] {
        &mut self.memory[self.start..self.start + self.size]
    }
}

/// Copies inputs to slices of the same length. Most of it is inlined, since in C it is too: there the length is
/// a constant.
#[inline]
fn copy_inputs(from: &[u8], to: &mut [u8]) {
    let (from, from_rest) = from.as_chunks::<64>();
    let (to, to_rest) = to.as_chunks_mut::<64>();
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
    if !from_rest.is_empty() {
        to_rest.copy_from_slice(from_rest);
    }
}

/// The adjacent bytes that spots are in, joined to as few ranges as possible.
fn ranges(spots: &[Spot]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = spots.iter().map(|spot| spot.bytes()).collect();
    all.sort_by_key(|range| range.start);
    let mut joined: Vec<Range<usize>> = vec![];
    for range in all {
        match joined.last_mut() {
            // Words of a PMAC's Y memory have words of X between them, which no kernel uses.
            Some(last) if range.start <= last.end + 4 => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

/// Where the kernel's bits, words and elements stand.
fn spots(kernel: &Kernel, compiled: &Compiled) -> Result<Vec<Spot>, String> {
    let mut all = vec![];
    match &compiled.program.tables {
        Tables::Pmi(_) => {
            let symbols = compiled.program.tables.symbols();
            let find = |name: String| {
                let symbol = symbols.iter().find(|symbol| symbol.name == name);
                symbol.map(|symbol| symbol.offset).ok_or(format!("no {name}"))
            };
            for bit in 0..kernel.bits {
                let name = match bit.checked_sub(kernel.inputs) {
                    None => format!("I{bit}"),
                    Some(relay) => format!("R{relay}"),
                };
                all.push(Spot::Byte(find(name)?));
            }
            for word in 0..kernel.words {
                all.push(Spot::Signed16(find(format!("W{word}"))?));
            }
            for element in 0..kernel.elements {
                all.push(Spot::Signed16(find("A".into())? + 2 * element as u32));
            }
        }
        Tables::Nct(tables) => {
            for bit in 0..kernel.bits {
                let (location, number) = match bit.checked_sub(kernel.inputs) {
                    None => (tables.inputs[bit / 8], bit % 8),
                    Some(relay) => (tables.flags[NCT_FIRST_FLAG + relay / 8], relay % 8),
                };
                all.push(match location.unpacked {
                    true => Spot::Byte(location.offset + number as u32),
                    false => Spot::BitOfByte(location.offset, number as u8),
                });
            }
            for word in 0..kernel.words {
                all.push(Spot::Unsigned16(tables.flags[NCT_FIRST_WORD + 2 * word].offset));
            }
        }
        Tables::Pmac(_) => {
            let layout = Layout::new(Controller::Pmac);
            let word = |space, address| match layout.place(space, address) {
                Place::Word(offset) => Ok(offset),
                other => Err(format!("{address:X} is {other:?}")),
            };
            for bit in 0..kernel.bits {
                let relay = bit.checked_sub(kernel.inputs);
                all.push(match relay.filter(|r| r % 2 == 1) {
                    Some(relay) if kernel.language == Language::PmacMixed => {
                        Spot::Double(layout.p_offset(relay as u32 / 2))
                    }
                    _ => {
                        let address = PMAC_BITS + (bit / PMAC_WORD_BITS) as u32;
                        Spot::BitOfWord(word(Space::Y, address)?, bit % PMAC_WORD_BITS)
                    }
                });
            }
            for number in 0..kernel.words as u32 {
                all.push(match kernel.language {
                    Language::Plcc => Spot::Signed24(word(Space::X, PMAC_WORDS + number)?),
                    _ => Spot::Double(layout.p_offset(PMAC_FIRST_P as u32 + number)),
                });
            }
            for element in 0..kernel.elements {
                all.push(Spot::Double(layout.p_offset((PMAC_FIRST_ELEMENT + element) as u32)));
            }
            for real in 0..kernel.reals {
                all.push(Spot::Double(layout.p_offset((PMAC_FIRST_REAL + real) as u32)));
            }
        }
    }
    Ok(all)
}
