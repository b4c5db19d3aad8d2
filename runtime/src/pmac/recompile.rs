//! Recompiling a program that has changed definitions of M-variables.
//!
//! Compiled code assumes the definitions of the M-variables that it names. When one of them changes,
//! general code goes on, which calls the host for every M-variable (`plcc_abi::pmac::assumption`):
//! it gives the right results, but slowly. Where a compiler is at hand, [`Recompiling`] waits until
//! the definitions have not changed for some ticks, has the program compiled for the definitions as
//! they are then, and goes on with the new code between two ticks. All state is in the image and in
//! the executive, and resume points are the same in every specialisation, so only the speed
//! differs.
//!
//! M-variables whose definitions keep changing are left to the host, and the number of
//! recompilations is limited: see [`Settings`].

use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;

use plcc_abi::pmac::{Assumption, Controller, Definitions, DirectAccess, Layout};
use plcc_abi::{Engine, Outcome, ResumePoint, Scan};

use crate::NativeEngine;

/// A compiler for one program.
pub trait Recompiler: Send {
    /// The program as code that assumes the definitions in `assumed`. The code calls the host for
    /// M-variables that `assumed` leaves out or has without a definition. Its tasks and their resume
    /// points are those of any other code of the program.
    ///
    /// # Errors
    /// When no code can be made; the message is for people.
    fn recompile(&mut self, assumed: &[Assumption]) -> Result<NativeEngine, String>;
}

/// When a program is recompiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The ticks after which definitions count as settled, if none that the code names has changed
    /// in them.
    pub settled_after: u32,
    /// The ticks after which definitions that have not settled are no longer waited for: M-variables
    /// whose definitions changed in the second half of them are left to the host.
    pub patience: u32,
    /// How often a program is recompiled at most.
    pub max_recompilations: u32,
    /// How often it is recompiled at most because of one M-variable, which then is left to the host.
    pub max_per_variable: u8,
    /// Whether a thread of its own compiles while ticks go on, for ticks that are paced by the clock.
    /// Otherwise the program is compiled between two ticks, in each run between the same two.
    pub in_thread: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            settled_after: 100,
            patience: 1000,
            max_recompilations: 16,
            max_per_variable: 3,
            in_thread: false,
        }
    }
}

/// What the compiler is asked for.
struct Request {
    /// What the new code is to assume.
    assumed: Vec<Assumption>,
    /// Code that no longer runs, for the compiler's thread to drop, since a tick has no time for it.
    retired: Option<NativeEngine>,
}

/// What it answers.
struct Recompiled {
    assumed: Vec<Assumption>,
    engine: Result<NativeEngine, String>,
}

/// The compiler, and where it runs.
enum Compiler {
    /// Between two ticks, with its last answer until that is fetched.
    BetweenTicks(Box<dyn Recompiler>, Option<Box<Recompiled>>),
    /// In a thread of its own.
    Thread(SyncSender<Request>, Receiver<Recompiled>),
}

impl Compiler {
    fn new(mut recompiler: Box<dyn Recompiler>, in_thread: bool) -> Self {
        if !in_thread {
            return Self::BetweenTicks(recompiler, None);
        }
        let (requests, taken) = sync_channel::<Request>(1);
        let (finished, answers) = sync_channel(1);
        // The thread ends when the engine is dropped. If the system has no thread to give, both
        // channels are closed, and nothing is recompiled.
        let _ = thread::Builder::new().name("recompile".into()).spawn(move || {
            for request in taken {
                drop(request.retired);
                let engine = recompiler.recompile(&request.assumed);
                if finished.send(Recompiled { assumed: request.assumed, engine }).is_err() {
                    return;
                }
            }
        });
        Self::Thread(requests, answers)
    }

    /// Asks for code. Gives whether the compiler took the request.
    fn request(&mut self, request: Request) -> bool {
        match self {
            Self::BetweenTicks(recompiler, answer) => {
                let engine = recompiler.recompile(&request.assumed);
                *answer = Some(Box::new(Recompiled { assumed: request.assumed, engine }));
                true
            }
            Self::Thread(requests, _) => requests.try_send(request).is_ok(),
        }
    }

    /// The answer to the last request, if it is there; an error when there never will be one.
    fn fetch(&mut self) -> Result<Option<Recompiled>, ()> {
        match self {
            Self::BetweenTicks(_, answer) => Ok(answer.take().map(|answer| *answer)),
            Self::Thread(_, answers) => match answers.try_recv() {
                Ok(recompiled) => Ok(Some(recompiled)),
                Err(TryRecvError::Empty) => Ok(None),
                Err(TryRecvError::Disconnected) => Err(()),
            },
        }
    }
}

/// An M-variable that the code names.
#[derive(Clone, Copy, Debug)]
struct NamedVariable {
    number: u32,
    /// How often the program was recompiled because of it.
    recompilations: u8,
    /// It is left to the host from now on.
    left_to_host: bool,
}

/// Native code that is recompiled when the program has changed definitions that it assumes.
pub struct Recompiling {
    engine: NativeEngine,
    /// The code that ran before this one, until the next request takes it along.
    retired: Option<NativeEngine>,
    compiler: Compiler,
    settings: Settings,
    layout: Layout,
    named: Vec<NamedVariable>,
    /// [`Definitions::epoch`] at the beginning of the last tick.
    epoch: u32,
    /// Ticks since the first change of a definition that has not been dealt with; `None` if there
    /// is none.
    unsettled_ticks: Option<u32>,
    /// Ticks since the last change.
    quiet_ticks: u32,
    /// Whether it was decided already, after the last change, if the program is to be recompiled.
    decided: bool,
    /// Whether an answer of the compiler is awaited.
    awaiting: bool,
    /// The number of requests so far.
    requests: u32,
    /// The number of times that new code has replaced the old.
    replacements: u32,
}

impl Recompiling {
    /// An engine that runs `engine`, whose code assumes the definitions in `assumed`, until
    /// `recompiler` has made other code of the same program.
    pub fn new(
        engine: NativeEngine,
        assumed: &[Assumption],
        controller: Controller,
        recompiler: Box<dyn Recompiler>,
        settings: Settings,
    ) -> Self {
        let named = |assumed: &Assumption| NamedVariable {
            number: assumed.number,
            recompilations: 0,
            left_to_host: false,
        };
        Self {
            engine,
            retired: None,
            compiler: Compiler::new(recompiler, settings.in_thread),
            settings,
            layout: Layout::new(controller),
            named: assumed.iter().map(named).collect(),
            epoch: 0,
            // The compiler left variables to the host that the program redefines. Their definitions
            // may settle without a further change, so the first ticks count as after a change.
            unsettled_ticks: Some(0),
            quiet_ticks: 0,
            decided: false,
            awaiting: false,
            requests: 0,
            replacements: 0,
        }
    }

    /// How often new code has replaced the old.
    pub fn replacements(&self) -> u32 {
        self.replacements
    }

    /// Requests other code if the definitions call for it. They have settled, or they have not for
    /// as long as the settings allow (`out_of_patience`).
    fn decide(&mut self, definitions: &mut Definitions<'_>, out_of_patience: bool) {
        let is_last = self.requests + 1 >= self.settings.max_recompilations;
        let max_per_variable = if is_last { 1 } else { self.settings.max_per_variable };
        let mut needed = false;
        let mut assumed = Vec::with_capacity(self.named.len());
        for named in self.named.iter_mut().filter(|named| !named.left_to_host) {
            let number = named.number;
            let is_assumed = definitions.is_assumed(number);
            let definition = definitions.get(number);
            let direct = DirectAccess::of(&self.layout, definition).map(|_| definition);
            // The code fits an M-variable if it assumes the definition as it is, or if it calls the
            // host and no code could do without.
            let fits = if is_assumed {
                !definitions.differs_from_reference(number)
            } else {
                direct.is_none()
            };
            let gives_up = out_of_patience && definitions.take_changed(number)
                || !fits && named.recompilations >= max_per_variable;
            if gives_up {
                named.left_to_host = true;
                needed |= is_assumed;
                if !is_assumed {
                    definitions.ignore(number);
                }
                continue;
            }
            if !fits {
                needed = true;
                named.recompilations = named.recompilations.saturating_add(1);
            }
            assumed.push(Assumption { number, definition: direct });
        }
        if !needed {
            return;
        }
        self.requests += 1;
        self.awaiting = self.compiler.request(Request { assumed, retired: self.retired.take() });
    }

    /// Replaces the code by what was requested, if that is there.
    fn replace_code(&mut self, definitions: &mut Definitions<'_>) {
        // This engine refuses every further scan, and other code would not know that it must.
        if self.engine.host_panicked() {
            return self.stop_recompiling();
        }
        let recompiled = match self.compiler.fetch() {
            Ok(None) => return,
            Ok(Some(recompiled)) => recompiled,
            Err(()) => return self.stop_recompiling(),
        };
        self.awaiting = false;
        // Without new code the old one goes on; it gives the right results, slowly.
        let Ok(engine) = recompiled.engine else { return self.stop_recompiling() };
        if !engine.has_same_tasks_as(&self.engine) {
            return self.stop_recompiling();
        }
        definitions.assume(&recompiled.assumed);
        self.retired = Some(std::mem::replace(&mut self.engine, engine));
        self.replacements += 1;
    }

    /// Makes no further requests.
    fn stop_recompiling(&mut self) {
        self.awaiting = false;
        self.requests = self.settings.max_recompilations;
    }

    /// Has only changes from now on seen by [`Self::decide`].
    fn forget_changes(&self, definitions: &mut Definitions<'_>) {
        for named in &self.named {
            definitions.take_changed(named.number);
        }
    }
}

impl Engine for Recompiling {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.engine.call(task, from, scan)
    }

    fn begin_tick(&mut self, image: &mut [u8]) {
        let layout = self.layout;
        if image.len() < layout.size as usize {
            return;
        }
        let mut definitions = Definitions::new(image, &layout);
        let epoch = definitions.epoch();
        let unchanged = epoch == self.epoch && self.unsettled_ticks.is_none();
        let used_up = self.requests >= self.settings.max_recompilations;
        if (unchanged || used_up) && !self.awaiting {
            return;
        }
        if self.awaiting {
            self.replace_code(&mut definitions);
        }
        if epoch != self.epoch {
            self.epoch = epoch;
            (self.quiet_ticks, self.decided) = (0, false);
            self.unsettled_ticks.get_or_insert(0);
        } else {
            self.quiet_ticks = self.quiet_ticks.saturating_add(1);
        }
        let Some(unsettled_ticks) = &mut self.unsettled_ticks else { return };
        *unsettled_ticks += 1;
        let unsettled_ticks = *unsettled_ticks;
        if unsettled_ticks == self.settings.patience / 2 {
            self.forget_changes(&mut definitions);
        }
        if self.awaiting {
            return;
        }
        let out_of_patience = unsettled_ticks >= self.settings.patience;
        let settled = self.quiet_ticks >= self.settings.settled_after && !self.decided;
        if !settled && !out_of_patience {
            return;
        }
        self.decided = true;
        self.decide(&mut definitions, out_of_patience);
        // If nothing was requested, the count goes on, so that definitions which change again and
        // again, and each time back to what the code assumes, come to the end of patience.
        if out_of_patience || self.awaiting {
            self.unsettled_ticks = None;
        }
        if self.awaiting && !self.settings.in_thread {
            self.replace_code(&mut definitions);
        }
    }
}
