//! Runs pieces of work, as many at a time as there are processors.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use plcc_abi::Engine;

use super::program::TestProgram;
use crate::failure::Failure;

/// The engines of programs, in one thread.
#[derive(Default)]
pub(super) struct Engines(HashMap<usize, Box<dyn Engine>>);

impl Engines {
    /// The engine of the program with a number, which is made once.
    ///
    /// # Errors
    /// When its code can't be mapped.
    pub(super) fn of(
        &mut self,
        number: usize,
        program: &TestProgram,
    ) -> Result<&mut dyn Engine, Failure> {
        let engine = match self.0.entry(number) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(program.engine().map_err(Failure::usage)?),
        };
        Ok(engine.as_mut())
    }
}

/// Does `count` pieces of work by their numbers, in several threads of which each has a `K` of its own. Gives the results in the
/// order of the numbers.
///
/// # Errors
/// The first one of a piece of work.
pub(super) fn parallel<K: Default, T: Send>(
    count: usize,
    work: impl Fn(usize, &mut K) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get).min(count);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Option<T>>> = Mutex::new((0..count).map(|_| None).collect());
    let failure: Mutex<Option<Failure>> = Mutex::new(None);
    thread::scope(|scope| {
        let work = || {
            let mut kept = K::default();
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= count {
                    return;
                }
                match work(number, &mut kept) {
                    Ok(result) => {
                        let mut done = done.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                        if let Some(place) = done.get_mut(number) {
                            *place = Some(result);
                        }
                    }
                    Err(error) => {
                        let mut failure =
                            failure.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                        failure.get_or_insert(error);
                        return;
                    }
                }
            }
        };
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
    match failure.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()) {
        Some(failure) => Err(failure),
        None => {
            let done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
            Ok(done.into_iter().flatten().collect())
        }
    }
}
