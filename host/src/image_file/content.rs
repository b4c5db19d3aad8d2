//! What an image file holds when it is made.

use std::collections::HashMap;
use std::ops::Range;
use std::time::{SystemTime, UNIX_EPOCH};

use plcc_abi::{Dialect, Program};
use serde::Serialize;

use plcc_image::input_area::InputArea;
use plcc_image::latch::{InputLatch, Rule};
use plcc_image::layout::{self, HEADER_SIZE, SAFE_OUTPUT_SIZE, SYMBOL_SIZE};

use plcc_runtime::safe_outputs::SafeByte;

use super::symbols::SymbolTable;

/// What a new file is made of.
#[derive(Clone, Copy, Debug)]
pub struct Content<'a> {
    /// The program.
    pub program: &'a Program,
    /// What tells it from others.
    pub fingerprint: u64,
    /// The process image.
    pub image: &'a [u8],
    /// The parts of the image that the program is known to use; they are copied after each tick.
    /// Images of at most 64 KiB are copied as a whole.
    pub used: &'a [Range<u32>],
    /// The length of a tick in nanoseconds.
    pub tick_ns: u64,
    /// How often the program has been replaced by an online change.
    pub generation: u64,
    /// What a supervisor writes when the process has died.
    pub safe_outputs: &'a [SafeByte],
    /// The program's variables, and which of them other processes can give.
    pub symbols: &'a SymbolTable,
    /// By the names of inputs, what the configuration says of them.
    pub rules: &'a [(String, Rule)],
}

/// A line of the table of variables: a region of the image. The keys are written in this order.
#[derive(Serialize)]
struct RegionLine<'a> {
    region: &'a str,
    offset: u32,
    bytes: u32,
}

/// A line of the table of variables: a variable. The keys are written in this order.
#[derive(Serialize)]
struct VariableLine<'a> {
    name: &'a str,
    #[serde(rename = "type")]
    ty: &'a str,
    offset: u32,
    elements: u32,
}

/// The table of variables: a JSON object a line for each variable and each region.
fn variables(program: &Program) -> Vec<u8> {
    let mut table = Vec::new();
    let mut line = |text: serde_json::Result<String>| {
        // Numbers and texts can always be written.
        table.extend(text.unwrap_or_default().into_bytes());
        table.push(b'\n');
    };
    for region in &program.regions {
        let (offset, bytes) = (region.offset, region.size);
        line(serde_json::to_string(&RegionLine { region: &region.name, offset, bytes }));
    }
    for symbol in program.tables.symbols() {
        let (offset, elements) = (symbol.offset, symbol.elements);
        let (name, ty) = (&symbol.name, symbol.ty.name());
        line(serde_json::to_string(&VariableLine { name, ty, offset, elements }));
    }
    table
}

/// Lengthens some bytes to whole words.
fn pad(bytes: &mut Vec<u8>) {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
}

impl Content<'_> {
    /// The bytes of the file, and where the area for inputs is in it.
    pub(super) fn encode(&self) -> (Vec<u8>, InputArea) {
        let mut bytes = vec![0; HEADER_SIZE];
        bytes.extend(self.image);
        pad(&mut bytes);
        let variables_at = bytes.len();
        let variables = variables(self.program);
        bytes.extend(&variables);
        pad(&mut bytes);
        let safe_at = bytes.len();
        for &SafeByte { offset, keep, set } in self.safe_outputs {
            bytes.extend(offset.to_le_bytes());
            bytes.extend([!keep, set, 0, 0]);
        }
        debug_assert_eq!(bytes.len(), safe_at + self.safe_outputs.len() * SAFE_OUTPUT_SIZE);
        let symbols_at = bytes.len();
        let texts_at = symbols_at + self.symbols.symbols.len() * SYMBOL_SIZE;
        let (mut entries, mut texts) = (vec![], vec![]);
        for symbol in &self.symbols.symbols {
            symbol.encode(&mut entries, &mut texts, texts_at);
        }
        bytes.extend(entries.into_iter().chain(texts));
        let inputs = InputArea::new(bytes.len(), self.symbols.slots.len());
        bytes.resize(inputs.offset(), 0);
        bytes.extend(inputs.encode());
        let mut put = |at: usize, value: &[u8]| {
            if let Some(place) = bytes.get_mut(at..at + value.len()) {
                place.copy_from_slice(value);
            }
        };
        let dialect = Dialect::ALL.iter().position(|&d| d == self.program.dialect());
        let created = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        put(layout::AT_MAGIC, &layout::MAGIC);
        put(layout::AT_VERSION, &layout::VERSION.to_le_bytes());
        put(layout::AT_HEADER_SIZE, &(HEADER_SIZE as u32).to_le_bytes());
        put(layout::AT_FINGERPRINT, &self.fingerprint.to_le_bytes());
        put(layout::AT_DIALECT, &(dialect.unwrap_or(0) as u32).to_le_bytes());
        put(layout::AT_IMAGE_SIZE, &(self.image.len() as u32).to_le_bytes());
        put(layout::AT_IMAGE, &(HEADER_SIZE as u64).to_le_bytes());
        put(layout::AT_VARIABLES, &(variables_at as u64).to_le_bytes());
        put(layout::AT_VARIABLES_SIZE, &(variables.len() as u64).to_le_bytes());
        put(layout::AT_SAFE_OUTPUTS, &(safe_at as u64).to_le_bytes());
        put(layout::AT_SAFE_OUTPUTS_COUNT, &(self.safe_outputs.len() as u64).to_le_bytes());
        put(layout::AT_TICK_NS, &self.tick_ns.to_le_bytes());
        put(layout::AT_PROCESS, &u64::from(std::process::id()).to_le_bytes());
        put(layout::AT_CREATED, &(created.as_nanos() as u64).to_le_bytes());
        put(layout::AT_GENERATION, &self.generation.to_le_bytes());
        put(layout::AT_SYMBOLS, &(symbols_at as u64).to_le_bytes());
        put(layout::AT_SYMBOLS_COUNT, &(self.symbols.symbols.len() as u64).to_le_bytes());
        put(layout::AT_INPUTS, &(inputs.offset() as u64).to_le_bytes());
        (bytes, inputs)
    }

    /// What takes inputs, of an area that [`encode`](Self::encode) has made.
    pub(super) fn latch(&self, area: InputArea) -> InputLatch {
        let given = self.symbols.symbols.iter().filter(|symbol| symbol.slot.is_some());
        let of_name: HashMap<&str, Rule> =
            self.rules.iter().map(|(name, rule)| (name.as_str(), *rule)).collect();
        let rules: Vec<Option<Rule>> =
            given.clone().map(|symbol| of_name.get(symbol.name.as_str()).copied()).collect();
        InputLatch::new(area, given.cloned().collect(), &rules, self.generation == 0)
    }
}
