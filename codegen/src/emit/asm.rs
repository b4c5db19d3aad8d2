//! Machine code as text: a disassembly with the source's statements as comments.

use std::fmt::{Display, Write as _};

use cranelift_codegen::Context;
use cranelift_codegen::ir::SourceLoc;
use cranelift_frontend::FunctionBuilderContext;
use plcc_ir::Module;
use target_lexicon::Architecture;
use yaxpeax_arch::{Decoder as _, LengthedInstruction as _, U8Reader};

use super::source;
use crate::{CodegenError, CodegenOptions, Target, compile_function};

/// A verified module's machine code, disassembled.
///
/// Offsets are from the function's start; a jump names the offset it goes to.
///
/// # Errors
/// When Cranelift refuses a function.
pub fn asm(
    module: &Module,
    target: &Target,
    options: CodegenOptions,
) -> Result<String, CodegenError> {
    let mut out = format!("; machine code for {}", target.triple());
    if !target.features().is_empty() {
        let _ = write!(out, " with {}", target.features().join(", "));
    }
    out.push('\n');
    let decode = match target.isa.triple().architecture {
        Architecture::X86_64 => x86_64,
        _ => aarch64,
    };
    let mut context = Context::new();
    let mut builder_context = FunctionBuilderContext::new();
    for (_, func) in module.funcs() {
        compile_function(module, func, target, options, &mut context, &mut builder_context)?;
        let Some(code) = context.compiled_code() else { continue };
        let _ = writeln!(out, "\n{}:{}", func.name(), source::entries(module, func));
        let locs = code.buffer.get_srclocs_sorted().iter();
        let locs = locs.map(|range| (range.start, range.end, range.loc));
        let listing = Listing {
            module,
            bytes: code.code_buffer(),
            locs: locs.collect(),
            blocks: &code.bb_starts,
            decode,
        };
        listing.write(&mut out);
    }
    Ok(out)
}

/// What follows an instruction in the code.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Next {
    /// An instruction.
    Code,
    /// Constants, or nothing, up to the next block: the instruction jumps or returns.
    Data,
    /// A jump table, up to the next block: the instruction jumps to an address in a register.
    Table,
}

/// Decodes the first instruction of some bytes, which are at an offset in the function: its text,
/// its length in bytes, and what follows it. `None` if there is no such instruction.
type Decode = fn(&[u8], u32) -> Option<(String, u32, Next)>;

/// One function's code and what is needed to list it.
struct Listing<'a> {
    module: &'a Module,
    bytes: &'a [u8],
    /// Ranges of code (start, end, statement), by rising start.
    locs: Vec<(u32, u32, SourceLoc)>,
    /// The offsets at which blocks begin.
    blocks: &'a [u32],
    decode: Decode,
}

impl Listing<'_> {
    fn write(&self, out: &mut String) {
        let mut at = 0;
        let mut locs = self.locs.iter().peekable();
        let mut last = None;
        while let Some(rest) = self.bytes.get(at as usize..).filter(|rest| !rest.is_empty()) {
            while let Some(&(_, end, loc)) = locs.next_if(|&&(start, ..)| start <= at) {
                if end > at && !loc.is_default() && last != Some(loc) {
                    last = Some(loc);
                    if let Some(comment) = source::comment(self.module, loc.bits()) {
                        let _ = writeln!(out, "    {comment}");
                    }
                }
            }
            let Some((text, length, following)) = (self.decode)(rest, at) else {
                let byte = rest.first().copied().unwrap_or_default();
                let _ = writeln!(out, "  {at:06x}  .byte 0x{byte:02x}");
                at += 1;
                continue;
            };
            let _ = writeln!(out, "  {at:06x}  {text}");
            at += length;
            if following != Next::Code {
                at = self.data(out, at, following);
            }
        }
    }

    /// Lists the data from an offset up to the next block, and gives the offset after it. What a
    /// jump table holds are distances from its own beginning.
    fn data(&self, out: &mut String, start: u32, following: Next) -> u32 {
        let next = self.blocks.partition_point(|&block| block < start);
        let end = self.blocks.get(next).copied().unwrap_or(self.bytes.len() as u32);
        let data = self.bytes.get(start as usize..end as usize).unwrap_or_default();
        let mut at = start;
        // Constants begin at a multiple of 4, jump tables right after the instruction.
        let padding =
            if following == Next::Data { (at.next_multiple_of(4) - at) as usize } else { 0 };
        let (padding, data) = data.split_at(padding.min(data.len()));
        at += padding.len() as u32;
        for chunk in data.chunks(4) {
            let mut word = [0; 4];
            word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
            let word = u32::from_le_bytes(word);
            let _ = match following {
                Next::Table => {
                    writeln!(out, "  {at:06x}  .long -> {:06x}", start.wrapping_add(word))
                }
                _ => writeln!(out, "  {at:06x}  .long 0x{word:08x}"),
            };
            at += chunk.len() as u32;
        }
        at
    }
}

fn x86_64(bytes: &[u8], at: u32) -> Option<(String, u32, Next)> {
    let decoder = yaxpeax_x86::long_mode::InstDecoder::default();
    let instruction = decoder.decode(&mut U8Reader::new(bytes)).ok()?;
    let length = u32::try_from(instruction.len().to_const()).ok()?;
    let text = absolute(&instruction, at + length);
    let following = match text.split(' ').next() {
        Some("jmp") if text.starts_with("jmp r") => Next::Table,
        Some("jmp" | "ret" | "ud2") => Next::Data,
        _ => Next::Code,
    };
    Some((text, length, following))
}

fn aarch64(bytes: &[u8], at: u32) -> Option<(String, u32, Next)> {
    let decoder = yaxpeax_arm::armv8::a64::InstDecoder::default();
    let instruction = decoder.decode(&mut U8Reader::new(bytes)).ok()?;
    let text = absolute(&instruction, at);
    let following = match text.split(' ').next() {
        Some("br") => Next::Table,
        Some("b" | "ret" | "udf") => Next::Data,
        _ => Next::Code,
    };
    Some((text, 4, following))
}

/// An instruction's text, in which a jump's distance (`$+0x10`) is replaced by the offset that it
/// leads to; distances count from `origin`.
fn absolute(instruction: &impl Display, origin: u32) -> String {
    let text = instruction.to_string();
    let Some((before, distance)) = text.rsplit_once('$') else { return text };
    let (sign, digits) = distance.split_at(1.min(distance.len()));
    let Some(number) = digits.strip_prefix("0x").and_then(|hex| u32::from_str_radix(hex, 16).ok())
    else {
        return text;
    };
    let target = match sign {
        "+" => origin.wrapping_add(number),
        _ => origin.wrapping_sub(number),
    };
    format!("{before}-> {target:06x}")
}
