//! The machines that code is made for.

use std::str::FromStr;
use std::sync::Arc;

use cranelift_codegen::isa::{self, TargetIsa};
use cranelift_codegen::settings::{self, Configurable, SetError};
use plcc_ir::{FuncData, Module};
use target_lexicon::{Architecture, BinaryFormat, Triple};

use crate::CodegenError;

/// A machine to make code for: an architecture, the extensions of its instruction set that code may
/// use, and Cranelift's settings.
#[derive(Clone)]
pub struct Target {
    pub(crate) isa: Arc<dyn TargetIsa>,
    /// The same machine, for functions that seldom run: registers are allocated in a single pass, which
    /// takes a small part of the time.
    quick_isa: Arc<dyn TargetIsa>,
    /// The number of IR instructions of a program from which on that is done.
    quick_from: usize,
    features: Vec<&'static str>,
}

/// Programs of this many IR instructions have the functions that seldom run compiled quickly. Code for general
/// versions of PLCs is up to three times as long then, so it is done only in programs near the limit of length.
const QUICK_FROM: usize = 200_000;

/// The extensions that x86-64-v2 adds to x86-64, by the names that Rust's feature detection uses.
const X86_64_V2: &[&str] = &["sse3", "ssse3", "sse4.1", "sse4.2", "popcnt", "cmpxchg16b"];

impl Target {
    /// This machine, with every extension that its processor has: for code that is run at once.
    ///
    /// # Errors
    /// When Cranelift does not know the machine.
    pub fn host() -> Result<Self, CodegenError> {
        let triple = Triple::host();
        let fail = |reason: String| target_error(&triple, reason);
        let builder = cranelift_native::builder().map_err(|reason| fail(reason.into()))?;
        Self::finish(&triple, builder, vec![])
    }

    /// A machine by its triple, without extensions that some such machines of the last ten years
    /// lack: for code that is kept. On x86-64 it is x86-64-v2.
    ///
    /// # Errors
    /// When the triple is none, or code for it can't be made.
    pub fn baseline(triple: &str) -> Result<Self, CodegenError> {
        let parsed = Triple::from_str(triple).map_err(|error| CodegenError::Target {
            triple: triple.into(),
            reason: format!("{error}; a triple looks like `x86_64-unknown-linux-gnu`"),
        })?;
        let fail = |reason: String| target_error(&parsed, reason);
        let mut builder = isa::lookup(parsed.clone())
            .map_err(|error| fail(format!("{error}; x86_64 and aarch64 are supported")))?;
        let mut features = vec![];
        if matches!(parsed.architecture, Architecture::X86_64) {
            builder.enable("x86-64-v2").map_err(|error| fail(error.to_string()))?;
            features.extend(X86_64_V2);
        }
        Self::finish(&parsed, builder, features)
    }

    /// The [baseline](Self::baseline) of this machine's architecture.
    ///
    /// # Errors
    /// When code for it can't be made.
    pub fn host_baseline() -> Result<Self, CodegenError> {
        let mut triple = Triple::host();
        // Objects are ELF wherever they are made.
        triple.binary_format = BinaryFormat::Elf;
        Self::baseline(&triple.to_string())
    }

    fn finish(
        triple: &Triple,
        builder: isa::Builder,
        features: Vec<&'static str>,
    ) -> Result<Self, CodegenError> {
        let isa = |allocator| {
            let flags =
                flags(allocator).map_err(|error| target_error(triple, error.to_string()))?;
            builder.finish(flags).map_err(|error| target_error(triple, error.to_string()))
        };
        Ok(Self {
            isa: isa("backtracking")?,
            quick_isa: isa("single_pass")?,
            quick_from: QUICK_FROM,
            features,
        })
    }

    /// The same machine, with functions that seldom run compiled quickly in programs of this number of IR
    /// instructions and more, for tests.
    #[must_use]
    pub fn with_quick_code_from(self, instructions: usize) -> Self {
        Self { quick_from: instructions, ..self }
    }

    /// The machine with the settings for a function of a module. In a long program a function that seldom
    /// runs, such as the general version of a PLC that also has specialised code, is compiled in half the
    /// time, and its code is a fifth longer.
    pub(crate) fn isa_for(&self, module: &Module, func: &FuncData) -> &dyn TargetIsa {
        let seldom_runs = func.is_optimized_for_size();
        let length = || module.funcs().map(|(_, func)| func.inst_count()).sum::<usize>();
        if seldom_runs && length() >= self.quick_from { &*self.quick_isa } else { &*self.isa }
    }

    /// The target's triple, such as `x86_64-unknown-linux-gnu`.
    pub fn triple(&self) -> String {
        self.isa.triple().to_string()
    }

    /// The architecture's name, as `std::env::consts::ARCH` has it.
    pub fn architecture(&self) -> String {
        self.isa.triple().architecture.to_string()
    }

    /// The extensions that a processor must have to run the code, by the names that Rust's feature
    /// detection uses. Empty for [`host`](Self::host), whose code runs on this machine only.
    pub fn features(&self) -> &[&'static str] {
        &self.features
    }
}

fn target_error(triple: &Triple, reason: String) -> CodegenError {
    CodegenError::Target { triple: triple.to_string(), reason }
}

/// Cranelift's settings, with one of its register allocators.
fn flags(allocator: &str) -> Result<settings::Flags, SetError> {
    let mut builder = settings::builder();
    builder.set("is_pic", "true")?;
    // Our own passes have optimised the IR. Cranelift's would find little more, would take a third
    // of the time to compile, and would fold base registers back into long addresses (see
    // `lower/base_registers.rs`).
    builder.set("opt_level", "none")?;
    builder.set("regalloc_algorithm", allocator)?;
    // Profilers unwind by frame pointers. On x86-64 Cranelift keeps them in any case; on ARM64 it
    // costs three instructions a chunk that calls nothing.
    builder.set("preserve_frame_pointers", "true")?;
    // Stored values are forwarded to loads by our own pass, over few statements only. Cranelift
    // would do it over any distance, so that values live long and are spilled, which costs more
    // than loading them again.
    builder.set("enable_alias_analysis", "false")?;
    builder.set("enable_verifier", if cfg!(debug_assertions) { "true" } else { "false" })?;
    builder.set("unwind_info", "true")?;
    builder.set("enable_probestack", "false")?;
    // The offsets of blocks, by which a listing tells jump tables from code.
    builder.set("machine_code_cfg_info", "true")?;
    Ok(settings::Flags::new(builder))
}
