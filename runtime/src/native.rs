//! Runs compiled code.
//!
//! Three things together make this sound. A [`Code`] can only be made from bytes that its maker vouches for (see
//! [`Code::seal`]). Those bytes reach nothing but the image, whose length is checked before each call, and the
//! host, through one function of the context. And they always end by returning.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};
use std::io;
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use memmap2::{Mmap, MmapMut};
use plcc_abi::context::ChunkFn;
use plcc_abi::{
    Code, CodeLine, CodeMemory, Engine, HostFn, Outcome, Program, RawOutcome, ResumeLabels,
    ResumePoint, Scan, ScanContext, SourceLine, Task, Trap, TrapCode, TrapSite,
};
use wasmtime_internal_jit_icache_coherence as icache;

#[cfg(feature = "args")]
use crate::gdb::ShownCode;
pub use crate::native_error::NativeError;
use crate::perf;

/// Compiled code in executable memory.
pub struct NativeEngine {
    /// What gdb knows of the code, if it was told.
    #[cfg(feature = "args")]
    shown: Option<ShownCode>,
    /// Keeps the code in memory; the entries point into it. It is dropped with the engine, when no
    /// scan can be in it: a scan borrows the engine.
    memory: Box<dyn CodeMemory>,
    /// For each label the function to call with it.
    entries: Vec<ChunkFn>,
    /// For each task where its scans begin that were not suspended.
    starts: Vec<Start>,
    /// For each task the labels at which it begins and goes on.
    tasks: Vec<ResumeLabels>,
    trap_sites: Arc<Vec<TrapSite>>,
    /// The source line of each label and of each piece of code, to say where a scan was stopped that took too long.
    label_lines: Arc<Vec<Option<SourceLine>>>,
    lines: Arc<Vec<CodeLine>>,
    /// Where the code begins and ends in memory.
    extent: (usize, usize),
    /// The size of the image for which the code was made; [`usize::MAX`], which no image has, when a host
    /// function has panicked, after which no further scan is executed.
    image_size: usize,
}

/// Where a scan begins or goes on.
#[derive(Clone, Copy)]
struct Start {
    /// The function to call with the label.
    entry: ChunkFn,
    label: u32,
}

/// A copy of some code in pages of its own, which can be executed and not written.
struct MappedCode(Mmap);

impl MappedCode {
    /// Copies the code and makes the copy executable.
    ///
    /// # Errors
    /// When the operating system gives no such memory.
    fn new(code: &Code) -> io::Result<Self> {
        let mut map = MmapMut::map_anon(code.bytes.len().max(1))?;
        if let Some(room) = map.get_mut(..code.bytes.len()) {
            room.copy_from_slice(&code.bytes);
        }
        // SAFETY: address and length are those of the mapping. Nothing of it is executed yet.
        unsafe { icache::clear_cache(map.as_ptr().cast(), map.len()) }.map_err(io_error)?;
        let map = map.make_exec()?;
        // Reaches all threads of the process, so that the code may be executed by another one.
        icache::pipeline_flush_mt().map_err(io_error)?;
        Ok(Self(map))
    }
}

/// An error of the crate that flushes caches as one of input and output; on some systems it has a
/// type of its own.
fn io_error(error: impl ToString) -> io::Error {
    io::Error::other(error.to_string())
}

// SAFETY: a mapping stays where it is until it is dropped, and this one is private, not writable
// and executable; `new` has made the instruction caches coherent and flushed the pipelines.
unsafe impl CodeMemory for MappedCode {
    fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// Keeps code that gdb knows of in memory until the process ends: gdb does not forget the breakpoints in
/// it, and reports an error and goes no further when it can't write there.
#[cfg(feature = "args")]
impl Drop for NativeEngine {
    fn drop(&mut self) {
        if self.shown.is_some() {
            std::mem::forget(std::mem::replace(&mut self.memory, Box::new(NoMemory)));
        }
    }
}

/// Memory of no length.
#[cfg(feature = "args")]
struct NoMemory;

// SAFETY: there is nothing that could move, be written or executed.
#[cfg(feature = "args")]
unsafe impl CodeMemory for NoMemory {
    fn bytes(&self) -> &[u8] {
        &[]
    }
}

impl NativeEngine {
    /// Copies a program's code into executable memory.
    ///
    /// # Errors
    /// When there is no memory for the code, or it is for another machine or another program.
    pub fn new(code: &Code, program: &Program) -> Result<Self, NativeError> {
        Self::with_memory(code, program, Box::new(MappedCode::new(code)?))
    }

    /// Runs a program's code where it lies in `memory`, which holds a copy of `code.bytes` at its
    /// beginning.
    ///
    /// # Errors
    /// When the memory holds something else, or the code is for another machine or program.
    pub fn with_memory(
        code: &Code,
        program: &Program,
        memory: Box<dyn CodeMemory>,
    ) -> Result<Self, NativeError> {
        let missing = crate::cpu::missing(&code.features);
        if code.architecture != std::env::consts::ARCH || !missing.is_empty() {
            let needed = std::iter::once(&code.architecture).chain(&missing);
            let needed: Vec<&str> = needed.map(String::as_str).collect();
            return Err(NativeError::Machine(needed.join(" with ")));
        }
        if code.image_size != program.image_size {
            return Err(NativeError::Misfit("their process images differ in size"));
        }
        let mut points = program.tasks.iter().flat_map(|task| &task.resume_points);
        if !points.all(|&label| (label as usize) < code.labels.len()) {
            return Err(NativeError::Misfit("a task goes on at no label"));
        }
        let bytes = memory.bytes();
        if !bytes.starts_with(&code.bytes) {
            return Err(NativeError::Misfit("the memory holds other code"));
        }
        let entry = |&offset: &u32| {
            // SAFETY: the offset is that of a function of the code (`Code::seal` has checked it),
            // so it lies in the memory, which holds this code and stays where it is as long as
            // the engine, and with it the pointer, lives. The function has this type.
            unsafe {
                std::mem::transmute::<*const u8, ChunkFn>(bytes.as_ptr().add(offset as usize))
            }
        };
        let entries: Vec<ChunkFn> = code.labels.iter().map(entry).collect();
        let start = |task: &Task| {
            Some(Start { entry: *entries.get(task.entry as usize)?, label: task.entry })
        };
        let starts = program.tasks.iter().map(start).collect::<Option<_>>();
        let starts = starts.ok_or(NativeError::Misfit("a task starts at no label"))?;
        let begin = bytes.as_ptr() as usize;
        let extent = (begin, begin + bytes.len());
        let tasks = program.tasks.iter().map(ResumeLabels::new).collect();
        if std::env::var_os(perf::VARIABLE).is_some_and(|value| value == "1") {
            perf::write_map(code, &program.files, begin);
        }
        Ok(Self {
            #[cfg(feature = "args")]
            shown: None,
            memory,
            entries,
            starts,
            tasks,
            trap_sites: Arc::clone(&code.trap_sites),
            label_lines: Arc::clone(&code.label_lines),
            lines: Arc::clone(&code.lines),
            extent,
            image_size: code.image_size as usize,
        })
    }

    /// Tells gdb of the code, so that it stops at lines of the source and prints variables. `debug` is what
    /// the compiler makes for that, [`Artifact::debug`](crate::Artifact::debug). From then on the code stays in
    /// memory until the process ends.
    ///
    /// # Errors
    /// What is wrong with `debug`.
    #[cfg(feature = "args")]
    pub fn show_to_gdb(&mut self, debug: &[u8]) -> Result<(), &'static str> {
        self.shown = Some(ShownCode::new(debug, self.address())?);
        Ok(())
    }

    /// The offset in the code of an address of this process, for
    /// [`line_at`](plcc_abi::CodeParts::line_at) and
    /// [`function_at`](plcc_abi::CodeParts::function_at); `None` if the address is not in the code.
    pub fn offset_of(&self, address: usize) -> Option<u32> {
        let offset = address.checked_sub(self.address())?;
        u32::try_from(offset).ok().filter(|_| offset < self.memory.bytes().len())
    }

    /// Whether both engines have the same number of tasks, with as many resume points each, as all engines of
    /// one program have; then a task that one has suspended can go on in the other.
    pub fn has_same_tasks_as(&self, other: &Self) -> bool {
        let count = |task: &ResumeLabels| task.count();
        self.tasks.iter().map(count).eq(other.tasks.iter().map(count))
    }

    /// Whether a host function has panicked, after which every scan is refused.
    pub fn host_panicked(&self) -> bool {
        self.image_size == usize::MAX
    }

    /// The source line of the call from which code returns to an address; `None` if the address is not in
    /// the code, or the call belongs to no line.
    fn line_of_call(&self, return_address: usize) -> Option<SourceLine> {
        let offset = self.offset_of(return_address.checked_sub(1)?)?;
        let starts = self.entries.iter().map(|&entry| entry as usize);
        let function = starts.filter(|&start| start < return_address).max()? - self.address();
        let behind = self.lines.partition_point(|line| line.offset <= offset);
        let line = self.lines.get(behind.checked_sub(1)?)?;
        // A line's code does not reach into the next function.
        let known = line.offset as usize >= function;
        known.then_some(SourceLine { file: line.file, line: line.line })
    }

    /// The address in the code to which the host function that runs now returns, if that can be found out: that of
    /// the innermost frame on the stack that belongs to the code.
    fn return_address(code: (usize, usize)) -> Option<usize> {
        let mut search = FrameSearch { code, found: 0 };
        // SAFETY: the function calls `visit_frame` with the pointer that it is given, which lives until it
        // returns, once for each frame on this thread's stack. It stops at frames that it can't unwind.
        unsafe { _Unwind_Backtrace(visit_frame, (&raw mut search).cast()) };
        (search.found != 0).then_some(search.found)
    }

    /// The address of the code's first byte in this process.
    pub fn address(&self) -> usize {
        self.extent.0
    }
}

/// What a call of the engine needs as long as compiled code runs. It is not kept in registers, each of which
/// would have to be saved and restored.
#[repr(C)]
struct Call<'a, 'b> {
    /// What compiled code gets. It stands first, so that its address is also that of the whole.
    context: ScanContext,
    /// What the engine was called with.
    scan: &'a mut Scan<'b>,
    engine: &'a mut NativeEngine,
    /// Why the scan ended in a host function, and the image as it was then. Compiled code can't be left there: it
    /// runs on to the end of its chunk with 0 as every result, and what it stores until then is undone with this
    /// copy. (Code that jumps back leaves its chunk when the scan is late.)
    early_end: ManuallyDrop<Option<Box<EarlyEnd>>>,
}

/// Why a scan ended in a host function, and the image as it was then.
struct EarlyEnd {
    code: TrapCode,
    image: Vec<u8>,
    /// The address in the code at which the host function was called, if the scan was late.
    return_address: Option<usize>,
}

/// A search for a frame of compiled code on the stack.
struct FrameSearch {
    /// Where the code begins and ends in memory.
    code: (usize, usize),
    /// The return address of the frame that was found; 0 as long as there is none.
    found: usize,
}

// The platform's unwinder, which the standard library links for panics (Itanium C++ ABI, Exception Handling).
// It passes a frame of a thread's stack as a pointer.
unsafe extern "C" {
    fn _Unwind_Backtrace(
        visit_frame: unsafe extern "C" fn(*mut c_void, *mut c_void) -> c_int,
        data: *mut c_void,
    ) -> c_int;
    fn _Unwind_GetIP(frame: *mut c_void) -> usize;
}

/// Looks at one frame: ends the search if it belongs to the code.
///
/// # Safety
/// Only `_Unwind_Backtrace` calls it, with a frame and the [`FrameSearch`] that it was given.
unsafe extern "C" fn visit_frame(frame: *mut c_void, search: *mut c_void) -> c_int {
    /// Go on with the next frame.
    const NO_REASON: c_int = 0;
    /// Go no further.
    const END_OF_STACK: c_int = 5;
    // SAFETY: the caller says so; nothing else uses the search meanwhile.
    let search = unsafe { &mut *search.cast::<FrameSearch>() };
    // SAFETY: the frame is that of the unwinder, which waits for this function.
    let address = unsafe { _Unwind_GetIP(frame) };
    let (start, end) = search.code;
    // A return address lies after a call, so it may be the code's end and not its beginning.
    if address > start && address <= end {
        search.found = address;
        return END_OF_STACK;
    }
    NO_REASON
}

impl NativeEngine {
    /// Where a task's scan begins, or goes on that was suspended.
    #[inline]
    fn start(&self, task: usize, from: Option<ResumePoint>) -> Option<Start> {
        let Some(point) = from else { return self.starts.get(task).copied() };
        let label = self.tasks.get(task)?.label(Some(point))?;
        Some(Start { entry: *self.entries.get(label as usize)?, label })
    }

    /// What a scan of a task gives that can't begin.
    #[cold]
    fn refused(&self, task: usize) -> Outcome {
        match task < self.starts.len() {
            true if self.host_panicked() => Outcome::trap(TrapCode::HostPanic),
            true => Outcome::trap(TrapCode::BadLabel),
            // A task that does not exist has nothing to execute.
            false => Outcome::End,
        }
    }
}

impl Call<'_, '_> {
    /// What code returns at the end of a scan.
    const END: RawOutcome = RawOutcome::new(RawOutcome::END, 0);

    /// Whether the scan must be stopped since it took too long. If it is given more time instead, the
    /// context gets the new limit.
    #[inline]
    fn is_over(&mut self) -> bool {
        if !self.scan.limit.is_late() {
            return false;
        }
        let is_over = self.scan.limit.is_over(self.scan.host);
        self.context.limit.store(self.scan.limit.limit, Ordering::Relaxed);
        is_over
    }

    /// Says where a scan goes on whose last function has returned `raw`, or how it has ended.
    #[inline(never)]
    fn next(&mut self, task: usize, raw: RawOutcome) -> Result<Start, Outcome> {
        if let Some(early_end) = self.early_end.take() {
            if early_end.code == TrapCode::HostPanic {
                self.engine.image_size = usize::MAX;
            }
            // Both have the length of the image that the engine was called with.
            self.scan.image.copy_from_slice(&early_end.image);
            let line =
                early_end.return_address.and_then(|address| self.engine.line_of_call(address));
            return Err(Outcome::Trap(Trap { statement: line, ..Trap::new(early_end.code) }));
        }
        let (kind, label) = (raw.kind(), raw.payload());
        Err(match kind {
            // Where chunks go round for ever, the scan is ended here.
            RawOutcome::GOTO if self.is_over() => {
                let line = self.engine.label_lines.get(label as usize).copied().flatten();
                Outcome::Trap(Trap::late(line))
            }
            RawOutcome::GOTO => match self.engine.entries.get(label as usize) {
                Some(&entry) => return Ok(Start { entry, label }),
                None => Outcome::trap(TrapCode::BadLabel),
            },
            RawOutcome::END => Outcome::End,
            RawOutcome::SUSPEND => {
                let point = self.engine.tasks.get(task).and_then(|labels| labels.point(label));
                point.map_or(Outcome::trap(TrapCode::BadLabel), Outcome::Suspended)
            }
            _ => Outcome::Trap(raw.to_trap(&self.engine.trap_sites)),
        })
    }

    /// Goes on with a scan whose first function has returned `raw`, to the scan's end.
    ///
    /// # Safety
    /// The call is the one with which that function was called, and everything that it points to may
    /// still be used as compiled code and [`host_call`] use it.
    #[cold]
    #[inline(never)]
    unsafe fn go_on(call: *mut Self, task: usize, mut raw: RawOutcome) -> Outcome {
        loop {
            // SAFETY: the caller says so. The reference ends before compiled code runs again.
            let state = unsafe { &mut *call };
            let label = raw.payload();
            let ended_early = state.early_end.is_some();
            if raw == Self::END && !ended_early {
                return Outcome::End;
            }
            let is_goto = raw.kind() == RawOutcome::GOTO && !ended_early;
            let next = match state.engine.entries.get(label as usize) {
                Some(&entry) if is_goto && !state.scan.limit.is_late() => Start { entry, label },
                _ => match state.next(task, raw) {
                    Ok(next) => next,
                    Err(outcome) => return outcome,
                },
            };
            // SAFETY: as in `Engine::call`.
            raw = RawOutcome(unsafe { (next.entry)(call.cast_const().cast(), next.label) });
        }
    }
}

impl Engine for NativeEngine {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let Some(Start { entry, label }) = self.start(task, from) else {
            return self.refused(task);
        };
        if scan.image.len() < self.image_size {
            return self.refused(task);
        }
        let context = ScanContext {
            image: scan.image.as_mut_ptr(),
            host: host_call,
            host_data: std::ptr::null_mut(),
            epoch: scan.limit.epoch,
            limit: AtomicU64::new(scan.limit.limit),
        };
        #[cfg(feature = "args")]
        let shown = self.shown.as_ref().map(ShownCode::context);
        let mut call = Call { context, scan, engine: self, early_end: ManuallyDrop::new(None) };
        let call = &raw mut call;
        #[cfg(feature = "args")]
        if let Some(shown) = shown {
            shown.store(call.cast(), Ordering::Relaxed);
        }
        // SAFETY: the code was made for images of `image_size`, and this one is as long (checked above);
        // context, host function and the rest of the call belong together and live until it returns.
        // Nothing else touches them or the image meanwhile.
        let raw = RawOutcome(unsafe { entry(call.cast_const().cast(), label) });
        // SAFETY: no compiled code runs now, and the reference ends before any does again.
        let ended_early = unsafe { &*call }.early_end.is_some();
        if raw == Call::END && !ended_early {
            return Outcome::End;
        }
        // SAFETY: as above.
        unsafe { Call::go_on(call, task, raw) }
    }
}

/// What compiled code calls. A panic must not cross compiled code: it is caught here, and from then
/// on every call does nothing and gives 0, until the loop in [`Engine::call`] has control again and
/// traps. The same happens when a function was done too late.
///
/// # Safety
/// Only compiled code calls it, with the context that [`Engine::call`] has given to it.
unsafe extern "C" fn host_call(
    context: *const ScanContext,
    function: u32,
    a: u64,
    b: u64,
    c: u64,
    d: u64,
) -> u64 {
    // SAFETY: compiled code passes on the context it was given, which is the beginning of the `Call` that
    // `Engine::call` made and which outlives this function. `Engine::call` does not touch it while
    // compiled code runs, and this function, the only other, is not entered twice: a host gets
    // the image as a slice and has no way back into the code.
    let call = unsafe { &mut *context.cast_mut().cast::<Call<'_, '_>>() };
    let Some(function) = HostFn::from_number(function) else { return 0 };
    if call.early_end.is_some() {
        return 0;
    }
    let length = (&raw const *call.scan.image).len();
    // SAFETY: pointer and length come from the `&mut [u8]` that `Engine::call` borrows for the
    // whole call and does not use meanwhile; compiled code is waiting for this function.
    let image = unsafe { std::slice::from_raw_parts_mut(call.context.image, length) };
    // The host is not called again after a panic, so nobody sees what it left half done.
    let result = catch_unwind(AssertUnwindSafe(|| {
        let result = call.scan.host.call(image, function, [a, b, c, d]);
        (result, call.is_over())
    }));
    match result {
        Ok((result, false)) => result,
        Ok((_, true)) => {
            let return_address = NativeEngine::return_address(call.engine.extent);
            let (code, image) = (TrapCode::Watchdog, image.to_vec());
            *call.early_end = Some(Box::new(EarlyEnd { code, image, return_address }));
            0
        }
        Err(payload) => {
            // A payload may panic when it is dropped, which would leave this function.
            std::mem::forget(payload);
            let (code, image) = (TrapCode::HostPanic, image.to_vec());
            *call.early_end = Some(Box::new(EarlyEnd { code, image, return_address: None }));
            0
        }
    }
}
