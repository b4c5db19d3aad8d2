//! What an executive calls, and what program code may call in return.

use crate::{HostFn, Outcome};

/// The ways out of program code, one method for all of them so that every engine, native or not,
/// reaches the same implementation.
pub trait Host {
    /// Does what `function` says. Arguments and result are as the function's
    /// [signature](HostFn::signature) says: integers zero-extended, floating point as its bits,
    /// the unused ones 0.
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64;
}

/// What a scan works on.
pub struct Scan<'a> {
    /// The process image, of the program's size.
    pub image: &'a mut [u8],
    /// The way out.
    pub host: &'a mut dyn Host,
}

/// Something that executes a program: the statement interpreter, the IR interpreter, or native
/// code.
pub trait Engine {
    /// Runs one scan of a task, from its entry or from where it was suspended. A task that does
    /// not exist ends at once.
    fn call(&mut self, task: usize, scan: &mut Scan<'_>) -> Outcome;

    /// Forgets where a task was suspended, so that its next scan starts at the top.
    fn reset(&mut self, task: usize);

    /// A tick begins and no task runs: an engine that makes its code anew does it here. Controls
    /// say it to engines whose code may cease to fit their image (PMAC's does).
    fn begin_tick(&mut self, _image: &mut [u8]) {}
}

impl<E: Engine + ?Sized> Engine for alloc::boxed::Box<E> {
    fn call(&mut self, task: usize, scan: &mut Scan<'_>) -> Outcome {
        (**self).call(task, scan)
    }

    fn reset(&mut self, task: usize) {
        (**self).reset(task);
    }

    fn begin_tick(&mut self, image: &mut [u8]) {
        (**self).begin_tick(image);
    }
}

/// A host for programs that need none: every call gives 0.
#[derive(Debug, Default)]
pub struct NoHost;

impl Host for NoHost {
    fn call(&mut self, _: &mut [u8], _: HostFn, _: [u64; 4]) -> u64 {
        0
    }
}
