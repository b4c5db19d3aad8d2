//! Code made anew when a program has moved definitions of M-variables.
//!
//! Code has definitions built in; when one of those moves, access goes through the host from the
//! next statement on (`plcc_abi::pmac::assumption`), which is right and slow. Where a compiler is at
//! hand, [`Recompiling`] has the program compiled for the definitions as they are now, once they
//! have come to rest, and changes over between two ticks. All state is in the image and in the
//! executive, and resume points are the same in every specialisation, so nothing but the time
//! tells the difference.
//!
//! What never rests is left to the host, and no variable is followed for ever: see [`Settings`].

use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;

use plcc_abi::pmac::{Assumption, Controller, Definitions, Direct, Layout};
use plcc_abi::{Engine, Outcome, ResumePoint, Scan};

use crate::NativeEngine;

/// A compiler at hand.
pub trait Recompiler: Send {
    /// The same program with the definitions of `assumed` built in; M-variables that `assumed` leaves
    /// out, or has without a definition, are reached through the host. Tasks and their resume
    /// points are those of any other code of the program.
    ///
    /// # Errors
    /// When no code can be made; the message is for people.
    fn recompile(&mut self, assumed: &[Assumption]) -> Result<NativeEngine, String>;
}

/// When code is made anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Definitions are at rest when none that the code names has changed for so many ticks.
    pub rest: u32,
    /// What is not at rest after so many ticks is not waited for: variables that moved in the
    /// second half of them are left to the host.
    pub patience: u32,
    /// Code is made anew at most so often.
    pub most: u32,
    /// And for the sake of one variable at most so often; then it is left to the host.
    pub each: u8,
    /// Whether code is made by a thread of its own while ticks go on, for ticks that are paced by
    /// the clock; otherwise between two ticks, always the same two.
    pub beside: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { rest: 100, patience: 1000, most: 16, each: 3, beside: false }
    }
}

/// What the compiler is asked for: the code, and an engine that is to be dropped.
struct Order {
    assumed: Vec<Assumption>,
    retired: Option<NativeEngine>,
}

/// What it gives.
struct Fresh {
    assumed: Vec<Assumption>,
    engine: Result<NativeEngine, String>,
}

/// Where code is made.
enum Workshop {
    /// Between two ticks.
    Here(Box<dyn Recompiler>, Option<Fresh>),
    /// In a thread of its own.
    Beside(SyncSender<Order>, Receiver<Fresh>),
}

impl Workshop {
    fn new(mut recompiler: Box<dyn Recompiler>, beside: bool) -> Self {
        if !beside {
            return Self::Here(recompiler, None);
        }
        let (orders, taken) = sync_channel::<Order>(1);
        let (made, fresh) = sync_channel(1);
        // It ends when the engine is gone. Where there is no thread to be had, there is no code.
        let _ = thread::Builder::new().name("recompile".into()).spawn(move || {
            for order in taken {
                drop(order.retired);
                let engine = recompiler.recompile(&order.assumed);
                if made.send(Fresh { assumed: order.assumed, engine }).is_err() {
                    return;
                }
            }
        });
        Self::Beside(orders, fresh)
    }

    /// Orders code; whether there is somebody to make it.
    fn order(&mut self, order: Order) -> bool {
        match self {
            Self::Here(recompiler, fresh) => {
                let engine = recompiler.recompile(&order.assumed);
                *fresh = Some(Fresh { assumed: order.assumed, engine });
                true
            }
            Self::Beside(orders, _) => orders.try_send(order).is_ok(),
        }
    }

    /// What was ordered, if it is there; an error when it never will be.
    fn fetch(&mut self) -> Result<Option<Fresh>, ()> {
        match self {
            Self::Here(_, fresh) => Ok(fresh.take()),
            Self::Beside(_, made) => match made.try_recv() {
                Ok(fresh) => Ok(Some(fresh)),
                Err(TryRecvError::Empty) => Ok(None),
                Err(TryRecvError::Disconnected) => Err(()),
            },
        }
    }
}

/// An M-variable that code names.
#[derive(Clone, Copy, Debug)]
struct Named {
    number: u32,
    /// How often code was made for its sake.
    followed: u8,
    /// It is left to the host for good.
    left: bool,
}

/// Native code that is made anew.
pub struct Recompiling {
    engine: NativeEngine,
    /// The code before this one, until somebody has time to drop it.
    retired: Option<NativeEngine>,
    workshop: Workshop,
    settings: Settings,
    layout: Layout,
    named: Vec<Named>,
    /// The epoch when a tick began last.
    epoch: u32,
    /// Ticks since definitions began to move; none while nothing is to be done.
    unrest: Option<u32>,
    /// Ticks since one has moved.
    quiet: u32,
    /// It was decided what to do about that.
    decided: bool,
    /// Code is being made.
    ordered: bool,
    /// How often code was ordered.
    orders: u32,
    /// How often it was changed over to.
    changes: u32,
}

impl Recompiling {
    /// Code that has the definitions of `assumed` built in, and the compiler that made it.
    pub fn new(
        engine: NativeEngine,
        assumed: &[Assumption],
        controller: Controller,
        recompiler: Box<dyn Recompiler>,
        settings: Settings,
    ) -> Self {
        let named =
            |assumed: &Assumption| Named { number: assumed.number, followed: 0, left: false };
        Self {
            engine,
            retired: None,
            workshop: Workshop::new(recompiler, settings.beside),
            settings,
            layout: Layout::new(controller),
            named: assumed.iter().map(named).collect(),
            epoch: 0,
            // What the compiler left to the host, since it saw that it moves, may well rest.
            unrest: Some(0),
            quiet: 0,
            decided: false,
            ordered: false,
            orders: 0,
            changes: 0,
        }
    }

    /// How often new code has taken over.
    pub fn changes(&self) -> u32 {
        self.changes
    }

    /// Definitions have rested, or moved for too long: orders code where other code is called for.
    fn decide(&mut self, definitions: &mut Definitions<'_>, restless: bool) {
        let last = self.orders + 1 >= self.settings.most;
        let each = if last { 1 } else { self.settings.each };
        let mut needed = false;
        let mut assumed = Vec::with_capacity(self.named.len());
        for named in self.named.iter_mut().filter(|named| !named.left) {
            let number = named.number;
            let built_in = definitions.is_built_in(number);
            let definition = definitions.get(number);
            let direct = Direct::of(&self.layout, definition).map(|_| definition);
            // A variable in its place, or one that only the host can follow and that is left to
            // it, needs nothing.
            let fits = if built_in { !definitions.is_moved(number) } else { direct.is_none() };
            let gives_up =
                restless && definitions.take_changed(number) || !fits && named.followed >= each;
            if gives_up {
                named.left = true;
                needed |= built_in;
                if !built_in {
                    definitions.ignore(number);
                }
                continue;
            }
            if !fits {
                needed = true;
                named.followed = named.followed.saturating_add(1);
            }
            assumed.push(Assumption { number, definition: direct });
        }
        if !needed {
            return;
        }
        self.orders += 1;
        self.ordered = self.workshop.order(Order { assumed, retired: self.retired.take() });
    }

    /// Changes over to code that was ordered, if it is there.
    fn take_over(&mut self, definitions: &mut Definitions<'_>) {
        // Other code would not know that this engine refuses every further scan.
        if self.engine.host_panicked() {
            return self.give_up();
        }
        let fresh = match self.workshop.fetch() {
            Ok(None) => return,
            Ok(Some(fresh)) => fresh,
            Err(()) => {
                self.give_up();
                return;
            }
        };
        self.ordered = false;
        // Without new code the old one is right, and slow.
        let Ok(engine) = fresh.engine else { return self.give_up() };
        if !engine.has_tasks_of(&self.engine) {
            return self.give_up();
        }
        definitions.assume(&fresh.assumed);
        self.retired = Some(std::mem::replace(&mut self.engine, engine));
        self.changes += 1;
    }

    /// Nothing is ordered any more.
    fn give_up(&mut self) {
        self.ordered = false;
        self.orders = self.settings.most;
    }

    /// Forgets which definitions have changed.
    fn forget(&self, definitions: &mut Definitions<'_>) {
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
        let calm = epoch == self.epoch && self.unrest.is_none();
        let done = self.orders >= self.settings.most;
        if (calm || done) && !self.ordered {
            return;
        }
        if self.ordered {
            self.take_over(&mut definitions);
        }
        if epoch != self.epoch {
            self.epoch = epoch;
            (self.quiet, self.decided) = (0, false);
            self.unrest.get_or_insert(0);
        } else {
            self.quiet = self.quiet.saturating_add(1);
        }
        let Some(unrest) = &mut self.unrest else { return };
        *unrest += 1;
        let unrest = *unrest;
        if unrest == self.settings.patience / 2 {
            self.forget(&mut definitions);
        }
        if self.ordered {
            return;
        }
        let restless = unrest >= self.settings.patience;
        let rests = self.quiet >= self.settings.rest && !self.decided;
        if !rests && !restless {
            return;
        }
        self.decided = true;
        self.decide(&mut definitions, restless);
        // What moves away and comes back again and again does not rest, so patience wears on.
        if restless || self.ordered {
            self.unrest = None;
        }
        if self.ordered && !self.settings.beside {
            self.take_over(&mut definitions);
        }
    }
}
