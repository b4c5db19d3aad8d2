//! Runs compiled code.
//!
//! Three things together make this sound. A [`Code`] can only be made from bytes that its maker vouches for (see
//! [`Code::seal`]). Those bytes reach nothing but the image, whose length is checked before each call, and the
//! host, through one function of the context. And they always end by returning.
#![allow(unsafe_code)]

use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use plcc_abi::context::ChunkFn;
use plcc_abi::{
    Code, CodeMemory, CodeParts, Engine, HostFn, Outcome, Program, RawOutcome, ResumeLabels,
    ResumePoint, Scan, ScanContext, SourceLine, Trap, TrapCode, TrapSite,
};

use crate::frame_search::return_address;

use crate::gdb::ShownCode;
pub use crate::loaded_code::LaterCode;
use crate::loaded_code::LoadedCode;
use crate::mapped_code::MappedCode;
pub use crate::native_error::NativeError;
use crate::perf;

/// How many tasks' starts lie in the engine itself: a PMI program has one task, NCT's module of a time slice is the second.
const NEAR: usize = 2;

/// Compiled code in executable memory. What each call reads stands first, on one cache line: when a tick comes after
/// much other work, each further line is a further wait for memory.
#[repr(C, align(64))]
pub struct NativeEngine {
    /// The size of the image for which the code was made; [`usize::MAX`], which no image has, when a host
    /// function has panicked, after which no further scan is executed.
    image_size: usize,
    /// What gdb knows of the code, if it was told.
    shown: Option<ShownCode>,
    /// The first of `starts`; [`no_task`] where there are fewer.
    near_starts: [Start; NEAR],
    /// Keeps the code in memory; the entries point into it. It is dropped with the engine, when no
    /// scan can be in it: a scan borrows the engine.
    code: LoadedCode,
    /// The same for the code that was made later.
    later_code: Option<LoadedCode>,
    /// Makes the code of the labels that have none yet.
    maker: Option<Box<dyn LaterCode>>,
    /// For each label the function to call with it; [`make_later_code`] for those that have no code yet.
    entries: Vec<ChunkFn>,
    /// For each task where its scans begin that were not suspended.
    starts: Vec<Start>,
    /// For each task the labels at which it begins and goes on.
    tasks: Vec<ResumeLabels>,
    trap_sites: Arc<Vec<TrapSite>>,
    /// The source line of each label, to say where a scan was stopped that took too long.
    label_lines: Arc<Vec<Option<SourceLine>>>,
    /// The names of the source files if the profiler `perf` is to know the code.
    perf_files: Option<Vec<String>>,
}

/// Where a scan begins or goes on.
#[derive(Clone, Copy)]
struct Start {
    /// The function to call with the label.
    entry: ChunkFn,
    label: u32,
}

/// Keeps code that gdb knows of in memory until the process ends: gdb does not forget the breakpoints in
/// it, and reports an error and goes no further when it can't write there.
impl Drop for NativeEngine {
    fn drop(&mut self) {
        if self.shown.is_some() {
            self.code.keep_memory();
        }
    }
}

/// The functions of some code for each label; [`make_later_code`] for labels without code.
fn entries(code: &Code, loaded: &LoadedCode) -> Vec<ChunkFn> {
    let entry = |&offset: &u32| {
        if offset == CodeParts::NO_CODE {
            return make_later_code as ChunkFn;
        }
        // SAFETY: the offset is that of a function of the code (`Code::seal` has checked it),
        // so it lies in the memory, which holds this code (`LoadedCode::new` has checked it) and stays where it is
        // as long as the engine, and with it the pointer, lives. The function has this type.
        unsafe {
            std::mem::transmute::<*const u8, ChunkFn>(loaded.bytes().as_ptr().add(offset as usize))
        }
    };
    code.labels.iter().map(entry).collect()
}

/// Where scans begin at these labels; `None` if there is no such label.
fn starts(entries: &[ChunkFn], labels: impl Iterator<Item = u32>) -> Option<Vec<Start>> {
    labels.map(|label| Some(Start { entry: *entries.get(label as usize)?, label })).collect()
}

/// The first of these starts.
fn near(starts: &[Start]) -> [Start; NEAR] {
    let none = Start { entry: no_task, label: 0 };
    std::array::from_fn(|task| starts.get(task).copied().unwrap_or(none))
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
        if code.image_size != program.image_size {
            return Err(NativeError::Misfit("their process images differ in size"));
        }
        let mut points = program.tasks.iter().flat_map(|task| &task.resume_points);
        if !points.all(|&label| (label as usize) < code.labels.len()) {
            return Err(NativeError::Misfit("a task goes on at no label"));
        }
        let loaded = LoadedCode::new(code, memory)?;
        let entries = entries(code, &loaded);
        let starts = starts(&entries, program.tasks.iter().map(|task| task.entry));
        let starts = starts.ok_or(NativeError::Misfit("a task starts at no label"))?;
        let tasks = program.tasks.iter().map(ResumeLabels::new).collect();
        let perf_files = perf::is_wanted().then(|| program.files.clone());
        if let Some(files) = &perf_files {
            perf::write_map(code, files, loaded.extent().0);
        }
        Ok(Self {
            image_size: code.image_size as usize,
            shown: None,
            near_starts: near(&starts),
            code: loaded,
            later_code: None,
            maker: None,
            entries,
            starts,
            tasks,
            trap_sites: Arc::clone(&code.trap_sites),
            label_lines: Arc::clone(&code.label_lines),
            perf_files,
        })
    }

    /// Has the code of the labels for which there is [none](CodeParts::NO_CODE) made when a scan first comes to one of
    /// them. The time that this takes does not count as the scan's. If no code can be made, such a scan is an error
    /// of the control ([`TrapCode::Internal`]).
    pub fn make_later(&mut self, maker: Box<dyn LaterCode>) {
        self.maker = Some(maker);
    }

    /// Whether code has been made for the labels that had none at first.
    pub fn has_later_code(&self) -> bool {
        self.later_code.is_some()
    }

    /// Makes the code of the labels that have none, if it was not made or tried before. Says whether the label has
    /// code then.
    fn make_later_code(&mut self, label: u32) -> bool {
        if let Some(Ok((code, memory))) = self.maker.take().map(LaterCode::make)
            && code.image_size as usize == self.image_size
            && let Ok(loaded) = LoadedCode::new(&code, memory)
        {
            let made = code.labels.iter().zip(entries(&code, &loaded));
            for (entry, (&offset, made)) in self.entries.iter_mut().zip(made) {
                if offset != CodeParts::NO_CODE {
                    *entry = made;
                }
            }
            let labels: Vec<u32> = self.starts.iter().map(|start| start.label).collect();
            if let Some(starts) = starts(&self.entries, labels.into_iter()) {
                self.near_starts = near(&starts);
                self.starts = starts;
            }
            for (line, &made) in
                Arc::make_mut(&mut self.label_lines).iter_mut().zip(&*code.label_lines)
            {
                *line = line.or(made);
            }
            if let Some(files) = &self.perf_files {
                perf::write_map(&code, files, loaded.extent().0);
            }
            let has_code =
                code.labels.get(label as usize).is_some_and(|&o| o != CodeParts::NO_CODE);
            self.later_code = Some(loaded);
            return has_code;
        }
        false
    }

    /// Tells gdb of the code, so that it stops at lines of the source and prints variables. `debug` is what
    /// the compiler makes for that, `Artifact::debug`. From then on the code stays in
    /// memory until the process ends.
    ///
    /// # Errors
    /// What is wrong with `debug`.
    pub fn show_to_gdb(&mut self, debug: &[u8]) -> Result<(), &'static str> {
        self.shown = Some(ShownCode::new(debug, self.code.extent().0)?);
        Ok(())
    }

    /// Whether a host function has panicked, after which every scan is refused.
    fn host_panicked(&self) -> bool {
        self.image_size == usize::MAX
    }

    /// The source line of the call from which code returns to an address; `None` if the address is not in
    /// the code, or the call belongs to no line.
    fn line_of_call(&self, return_address: usize) -> Option<SourceLine> {
        let mut parts = std::iter::once(&self.code).chain(&self.later_code);
        parts.find_map(|code| code.line_of_call(return_address))
    }

    /// The source line of the statement that begins at a label.
    fn line_of_label(&mut self, label: u32) -> Option<SourceLine> {
        let line = |engine: &Self| engine.label_lines.get(label as usize).copied().flatten();
        if line(self).is_none() && self.maker.is_some() {
            self.make_later_code(label);
        }
        line(self)
    }

    /// Where the code begins and ends in memory; of each part of it.
    fn extents(&self) -> [(usize, usize); 2] {
        [self.code.extent(), self.later_code.as_ref().map_or((0, 0), LoadedCode::extent)]
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

impl NativeEngine {
    /// Where a task's scan begins, or goes on that was suspended.
    #[inline]
    fn start(&self, task: usize, from: Option<ResumePoint>) -> Option<Start> {
        let Some(point) = from else {
            let near = self.near_starts.get(task);
            return near.or_else(|| self.starts.get(task)).copied();
        };
        let label = self.tasks.get(task)?.label(Some(point))?;
        Some(Start { entry: *self.entries.get(label as usize)?, label })
    }

    /// What a scan of a task gives that can't begin.
    #[cold]
    fn refused(&self, task: usize) -> Outcome {
        match task < self.starts.len() {
            true if self.host_panicked() => Outcome::trap(TrapCode::HostPanic),
            true => Outcome::trap(TrapCode::Internal),
            // As no_task.
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
                Outcome::Trap(Trap::late(self.engine.line_of_label(label)))
            }
            RawOutcome::GOTO => match self.engine.entries.get(label as usize) {
                Some(&entry) => return Ok(Start { entry, label }),
                None => Outcome::trap(TrapCode::Internal),
            },
            RawOutcome::END => Outcome::End,
            RawOutcome::SUSPEND => {
                let point = self.engine.tasks.get(task).and_then(|labels| labels.point(label));
                point.map_or(Outcome::trap(TrapCode::Internal), Outcome::Suspended)
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

        let shown = self.shown.as_ref().map(ShownCode::context);
        let mut call = Call { context, scan, engine: self, early_end: ManuallyDrop::new(None) };
        let call = &raw mut call;

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

/// What a task executes that does not exist: nothing.
///
/// # Safety
/// It uses none of its arguments.
unsafe extern "C" fn no_task(_: *const ScanContext, _: u32) -> u64 {
    RawOutcome::new(RawOutcome::END, 0).0
}

/// Stands in the place of the functions that have no code yet: has it made, and gives the label back, for the engine
/// to go on with.
///
/// # Safety
/// Only [`Engine::call`] and [`Call::go_on`] call it, with the context of the call.
unsafe extern "C" fn make_later_code(context: *const ScanContext, label: u32) -> u64 {
    // SAFETY: as in `host_call`; no compiled code runs now.
    let call = unsafe { &mut *context.cast_mut().cast::<Call<'_, '_>>() };
    let start = Instant::now();
    let made = catch_unwind(AssertUnwindSafe(|| call.engine.make_later_code(label)));
    let made = made.unwrap_or_else(|payload| {
        // A payload may panic when it is dropped, which would leave this function.
        std::mem::forget(payload);
        false
    });
    if !made {
        return RawOutcome::trap(TrapCode::Internal).0;
    }
    call.scan.limit.extend(start.elapsed());
    call.context.limit.store(call.scan.limit.limit, Ordering::Relaxed);
    RawOutcome::new(RawOutcome::GOTO, label).0
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
            let return_address = return_address(call.engine.extents());
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
