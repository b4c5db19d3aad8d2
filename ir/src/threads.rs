//! Threads that share the work on the functions of a module.

use std::sync::OnceLock;
use std::thread;

/// Lets `work` run in several threads, if there is enough to do, and gives the result of each; the first is that of the
/// calling thread, and that of a thread that was lost by a panic is an error. There are no more threads than there are
/// functions (`count`), or processors, and one more for each `per_thread` of their `size`: for fewer instructions a thread
/// would cost more time than it saves.
pub fn in_threads<R: Send>(
    count: usize,
    size: usize,
    per_thread: usize,
    work: impl Fn() -> R + Sync,
) -> Vec<thread::Result<R>> {
    let wanted = count.min(1 + size / per_thread.max(1));
    let threads = if wanted > 1 { wanted.min(processors()) } else { 1 };
    thread::scope(|scope| {
        let helpers: Vec<_> = (1..threads).map(|_| scope.spawn(&work)).collect();
        let own = Ok(work());
        let others = helpers.into_iter().map(thread::ScopedJoinHandle::join);
        [own].into_iter().chain(others).collect()
    })
}

/// The number of processors that this process may use. The operating system is asked once, since that takes several
/// system calls.
fn processors() -> usize {
    static COUNT: OnceLock<usize> = OnceLock::new();
    *COUNT.get_or_init(|| thread::available_parallelism().map_or(1, usize::from))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn there_are_as_many_threads_as_the_work_is_worth() {
        let started = |count, size| {
            let begun = AtomicUsize::new(0);
            let results = in_threads(count, size, 1000, || begun.fetch_add(1, Ordering::Relaxed));
            assert_eq!(results.len(), begun.into_inner());
            results.len()
        };
        assert_eq!((started(0, 0), started(50, 999), started(1, 50_000)), (1, 1, 1));
        assert_eq!(started(50, 50_000), processors().min(50));
        assert_eq!(started(50, 1000), processors().min(2));
    }

    #[test]
    fn a_thread_that_is_lost_is_an_error() {
        let main = thread::current().id();
        let work = || assert_eq!(thread::current().id(), main, "not the calling thread");
        let results = in_threads(2, 2000, 1000, work);
        assert_eq!(results.iter().filter(|result| result.is_err()).count(), results.len() - 1);
    }
}
