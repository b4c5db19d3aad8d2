//! The two interfaces between an executive and a program: the executive calls an [`Engine`], and
//! program code calls a [`Host`] in return.

use serde::{Deserialize, Serialize};

use crate::{HostFn, Outcome, TimeLimit};

/// What implements the [host functions](HostFn): all of them by one method, so that every engine,
/// native or not, reaches the same implementation.
pub trait Host {
    /// Executes a host function. Arguments and result are as the function's
    /// [signature](HostFn::signature) says: integers zero-extended, floating point as its bits,
    /// the unused ones 0.
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64;

    /// An engine asks this when the scan is late. Returns a later [limit](TimeLimit::limit), or `None` if
    /// the scan must be stopped; the engine then ends it with the trap
    /// [`TrapCode::Watchdog`](crate::TrapCode::Watchdog).
    fn extend_time(&mut self) -> Option<u64> {
        None
    }
}

/// What a scan works on.
pub struct Scan<'a> {
    /// The process image, of the program's size.
    pub image: &'a mut [u8],
    /// What program code may call.
    pub host: &'a mut dyn Host,
    /// Until when the scan may run.
    pub limit: TimeLimit<'a>,
}

impl<'a> Scan<'a> {
    /// A scan that may take any time.
    #[inline]
    pub fn new(image: &'a mut [u8], host: &'a mut dyn Host) -> Self {
        Self { image, host, limit: TimeLimit::NONE }
    }
}

/// Where a suspended task goes on: the number of a place, counted from 0 in the source's order
/// over all places at which this task can be suspended.
///
/// It is the same in every engine and at every optimisation level, so that a task which one engine
/// has suspended can go on in another. In PMAC the places
/// are the WHILE statements of the PLC; in NCT they are the labels that a
/// backward jump or a call may lead to, the same for all modules, since a module is suspended
/// there when its time or number of backward jumps and calls is used up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ResumePoint(pub u32);

/// Something that executes a program: the statement interpreter, the IR interpreter, or native
/// code. It keeps nothing between two calls that a program could notice: where a task was
/// suspended is told to the caller, who gives it back.
pub trait Engine {
    /// Runs one scan of a task, from its entry (`None`) or from where an earlier scan of it was
    /// suspended. A task that does not exist is [`Outcome::End`] at once. A resume point that the
    /// task does not have is [`TrapCode::Internal`](crate::TrapCode::Internal), and nothing is
    /// executed.
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome;
}

impl<E: Engine + ?Sized> Engine for alloc::boxed::Box<E> {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        (**self).call(task, from, scan)
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
