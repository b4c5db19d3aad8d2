//! Machine code as text.

use std::fmt::{Display, Write as _};

use cranelift_codegen::Context;
use cranelift_codegen::ir::SourceLoc;
use cranelift_frontend::FunctionBuilderContext;
use plcc_ir::Module;
use target_lexicon::Architecture;
use yaxpeax_arch::{Decoder as _, LengthedInstruction as _, U8Reader};

use super::source;
use crate::{CodegenError, Target, compile_function};

/// A verified module's machine code, disassembled.
///
/// Offsets are from the function's start; a jump names the offset it goes to.
///
/// # Errors
/// When Cranelift refuses a function.
pub fn asm(module: &Module, target: &Target) -> Result<String, CodegenError> {
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
        compile_function(module, func, target, &mut context, &mut builder_context)?;
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

/// What may stand behind an instruction.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Behind {
    /// Another.
    Code,
    /// Constants, up to the next block: it goes elsewhere.
    Data,
    /// A jump table: it goes to an address in a register.
    Table,
}

/// An instruction's text, length and what follows. The number is the offset of the first byte.
type Decode = fn(&[u8], u32) -> Option<(String, u32, Behind)>;

struct Listing<'a> {
    module: &'a Module,
    bytes: &'a [u8],
    /// Stretches of code, by rising start, with the statement each belongs to.
    locs: Vec<(u32, u32, SourceLoc)>,
    /// Where blocks begin.
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
            let Some((text, length, behind)) = (self.decode)(rest, at) else {
                let byte = rest.first().copied().unwrap_or_default();
                let _ = writeln!(out, "  {at:06x}  .byte 0x{byte:02x}");
                at += 1;
                continue;
            };
            let _ = writeln!(out, "  {at:06x}  {text}");
            at += length;
            if behind != Behind::Code {
                at = self.data(out, at, behind);
            }
        }
    }

    /// What stands from an offset up to the next block; the distances in a table are from there.
    fn data(&self, out: &mut String, start: u32, behind: Behind) -> u32 {
        let next = self.blocks.partition_point(|&block| block < start);
        let end = self.blocks.get(next).copied().unwrap_or(self.bytes.len() as u32);
        let data = self.bytes.get(start as usize..end as usize).unwrap_or_default();
        let mut at = start;
        // Constants are aligned; a table is where it is.
        let odd = if behind == Behind::Data { (at.next_multiple_of(4) - at) as usize } else { 0 };
        let (padding, data) = data.split_at(odd.min(data.len()));
        at += padding.len() as u32;
        for chunk in data.chunks(4) {
            let mut word = [0; 4];
            word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
            let word = u32::from_le_bytes(word);
            let _ = match behind {
                Behind::Table => {
                    writeln!(out, "  {at:06x}  .long -> {:06x}", start.wrapping_add(word))
                }
                _ => writeln!(out, "  {at:06x}  .long 0x{word:08x}"),
            };
            at += chunk.len() as u32;
        }
        at
    }
}

fn x86_64(bytes: &[u8], at: u32) -> Option<(String, u32, Behind)> {
    let decoder = yaxpeax_x86::long_mode::InstDecoder::default();
    let instruction = decoder.decode(&mut U8Reader::new(bytes)).ok()?;
    let length = u32::try_from(instruction.len().to_const()).ok()?;
    let text = absolute(&instruction, at + length);
    let behind = match text.split(' ').next() {
        Some("jmp") if text.starts_with("jmp r") => Behind::Table,
        Some("jmp" | "ret" | "ud2") => Behind::Data,
        _ => Behind::Code,
    };
    Some((text, length, behind))
}

fn aarch64(bytes: &[u8], at: u32) -> Option<(String, u32, Behind)> {
    let decoder = yaxpeax_arm::armv8::a64::InstDecoder::default();
    let instruction = decoder.decode(&mut U8Reader::new(bytes)).ok()?;
    let text = absolute(&instruction, at);
    let behind = match text.split(' ').next() {
        Some("br") => Behind::Table,
        Some("b" | "ret" | "udf") => Behind::Data,
        _ => Behind::Code,
    };
    Some((text, 4, behind))
}

/// A jump's distance made the offset it leads to.
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
