//! Runs passes over the functions of a module, in several threads if the module is long.
//!
//! What one function is made into does not depend on the others, apart from the bytes that are dead at their labels
//! ([`DeadBytes`]), which are found before all passes. So the result is the same with any number of threads.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::dead_stores::DeadBytes;
use super::image_bytes::ImageBytes;
use super::pass::{Pass, Variant};
use super::pass_options::{PassOptions, PassSet};
use super::thresholds;
use crate::threads::in_threads;
use crate::{FuncData, Module, verify};

/// The number of IR instructions for which a further thread is started.
const INSTS_PER_THREAD: usize = 8000;

/// How long each pass took, in the order in which the passes first ran, over all functions.
pub type PassTimes = Vec<(Pass, Duration)>;

/// A function that is being optimised, with what its passes need to know of the module.
pub(super) struct Stage<'a> {
    module: &'a Module,
    pub(super) func: FuncData,
    pub(super) passes: PassSet,
    times: &'a mut PassTimes,
    pub(super) variant: Variant,
    bytes: &'a mut ImageBytes,
    dead: &'a DeadBytes,
}

impl Stage<'_> {
    /// Runs passes one after the other.
    pub(super) fn all(&mut self, passes: &[Pass]) {
        for &pass in passes {
            self.pass(pass);
        }
    }

    /// Runs one pass, if it may run; returns what [`Pass::run`] returns, or false.
    pub(super) fn pass(&mut self, pass: Pass) -> bool {
        if !self.passes.contains(pass) {
            return false;
        }
        let start = Instant::now();
        let changed = pass.run(self.module, &mut self.func, self.bytes, self.dead, self.variant);
        add_time(self.times, pass, start.elapsed());
        debug_assert_eq!(
            verify::function(self.module, &self.func).first().map(ToString::to_string),
            None,
            "{} after {}",
            self.func.name(),
            pass.name()
        );
        changed
    }
}

/// Adds to the time of a pass.
fn add_time(times: &mut PassTimes, pass: Pass, time: Duration) {
    match times.iter_mut().find(|(known, _)| *known == pass) {
        Some((_, sum)) => *sum += time,
        None => times.push((pass, time)),
    }
}

/// Lets `order` run passes over each function. `length` is the number of instructions that the module had before
/// all passes.
pub(super) fn each(
    module: &mut Module,
    options: PassOptions,
    length: usize,
    times: &mut PassTimes,
    order: impl Fn(&mut Stage<'_>) + Sync,
) {
    // Bits that have become bytes take fewer instructions, so this may be less than `length`.
    let reload_bits =
        options.reload_bits && module.usual_instructions() > thresholds::RELOAD_BITS_FROM;
    let is_long = length >= thresholds::LONG_FROM;
    let PassOptions { passes, by_length, .. } = options;
    let variant = Variant {
        reload_bits,
        combine_bits: false,
        skip_lone_tests: false,
        collect_bits: !(by_length && is_long),
        by_length,
    };
    let mut dead = DeadBytes::default();
    if passes.contains(Pass::DeadStores) {
        let start = Instant::now();
        dead = DeadBytes::of(module, &mut ImageBytes::new(module));
        add_time(times, Pass::DeadStores, start.elapsed());
    }
    let funcs = std::mem::take(&mut module.funcs);
    module.funcs = share_out(funcs, times, &|queue: &Queue, times: &mut PassTimes| {
        let mut bytes = ImageBytes::new(module);
        let mut done = vec![];
        while let Some((index, func)) = take(queue) {
            let (bytes, dead) = (&mut bytes, &dead);
            let mut stage = Stage { module, func, passes, times, variant, bytes, dead };
            order(&mut stage);
            done.push((index, stage.func));
        }
        done
    });
}

/// Functions with their numbers, of which each thread takes the next when it has done one.
type Queue = Mutex<Vec<(usize, FuncData)>>;

/// Takes the next function.
fn take(queue: &Queue) -> Option<(usize, FuncData)> {
    queue.lock().unwrap_or_else(PoisonError::into_inner).pop()
}

/// Lets `work` take all functions from a queue and give them back, in several threads if they are long. Adds the
/// times of all threads to `times`.
fn share_out(
    funcs: Vec<FuncData>,
    times: &mut PassTimes,
    work: &(impl Fn(&Queue, &mut PassTimes) -> Vec<(usize, FuncData)> + Sync),
) -> Vec<FuncData> {
    let (count, size) = (funcs.len(), funcs.iter().map(FuncData::inst_count).sum());
    let mut funcs: Vec<(usize, FuncData)> = funcs.into_iter().enumerate().collect();
    // The longest are taken first, so that all threads end at about the same time.
    funcs.sort_by_key(|(_, func)| func.inst_count());
    let queue = Queue::new(funcs);
    let results = in_threads(count, size, INSTS_PER_THREAD, || {
        let mut times = vec![];
        (work(&queue, &mut times), times)
    });
    let mut done = Vec::with_capacity(count);
    for result in results {
        // A panic is a mistake in a pass, whichever thread meets it.
        let (some, of_thread) = result.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        done.extend(some);
        of_thread.into_iter().for_each(|(pass, time)| add_time(times, pass, time));
    }
    done.sort_unstable_by_key(|&(index, _)| index);
    done.into_iter().map(|(_, func)| func).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::InstData;

    #[test]
    fn functions_keep_their_order_whichever_thread_takes_them() {
        let func = |number: usize| FuncData {
            name: format!("chunk{number}"),
            insts: vec![InstData::IsLate; 1000 + 37 * number % 1000].into(),
            ..FuncData::default()
        };
        let mut times = vec![];
        let done = share_out((0..50).map(func).collect(), &mut times, &|queue, times| {
            let mut done = vec![];
            while let Some(taken) = take(queue) {
                add_time(times, Pass::Fold, Duration::from_nanos(1));
                done.push(taken);
            }
            done
        });
        let names: Vec<&str> = done.iter().map(FuncData::name).collect();
        let wanted: Vec<String> = (0..50).map(|number| format!("chunk{number}")).collect();
        assert_eq!(names, wanted);
        assert_eq!(times, [(Pass::Fold, Duration::from_nanos(50))]);
    }
}
