//! Unwind information for the functions of a blob: an `.eh_frame` section, written by gimli from
//! what Cranelift says of each function. [`plcc_abi::unwind`] says how it is laid out.

use cranelift_codegen::isa::TargetIsa;
use cranelift_codegen::isa::unwind::systemv::UnwindInfo;
use gimli::write::{Address, EhFrame, EndianVec, FrameTable};
use gimli::{DW_EH_PE_pcrel, DW_EH_PE_sdata4, DwEhPe, RunTimeEndian};
use plcc_abi::unwind::ALIGNMENT;

use crate::CodegenError;

/// The section for functions at these offsets in `code_len` bytes of code, in the order given.
///
/// # Errors
/// When Cranelift knows no unwind information for the target, or gimli can't write it.
pub(crate) fn section<'a>(
    isa: &dyn TargetIsa,
    code_len: usize,
    functions: impl Iterator<Item = (u32, &'a UnwindInfo)>,
) -> Result<Vec<u8>, CodegenError> {
    let fail = |reason: String| CodegenError::internal(format!("no unwind information: {reason}"));
    let mut cie = isa
        .create_systemv_cie()
        .ok_or_else(|| fail(format!("there is none for {}", isa.triple())))?;
    cie.fde_address_encoding = DwEhPe(DW_EH_PE_pcrel.0 | DW_EH_PE_sdata4.0);
    let mut table = FrameTable::default();
    let cie = table.add_cie(cie);
    let base = code_len.next_multiple_of(ALIGNMENT) as u64;
    for (offset, info) in functions {
        // The encoding of an address is relative to where it stands. The section begins `base`
        // bytes after the beginning of the code.
        let address = Address::Constant(u64::from(offset).wrapping_sub(base));
        table.add_fde(cie, info.to_fde(address));
    }
    let mut written = EhFrame::from(EndianVec::new(RunTimeEndian::Little));
    table.write_eh_frame(&mut written).map_err(|error| fail(error.to_string()))?;
    Ok(written.0.into_vec())
}
