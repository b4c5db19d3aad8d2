//! What a control that is paced by the clock requests of the operating system: a real-time priority,
//! so that it runs before ordinary programs, and memory that is never swapped out.
//!
//! Threads inherit the priority. Those that write files or compile while ticks run are therefore started
//! before it is requested.

/// Priorities are 1 to 99. This one is above all ordinary programs and below the threads of the
/// kernel.
#[cfg(target_os = "linux")]
const PRIORITY: u8 = 50;

/// Gives this thread a real-time priority (`SCHED_FIFO`) and locks the process's memory.
///
/// # Errors
/// What was not permitted, and what to do. The run goes on without it.
#[cfg(target_os = "linux")]
pub(crate) fn request() -> Result<(), String> {
    let refused: Vec<String> = [
        raise_priority(PRIORITY).map_err(|why| format!("ticks have no real-time priority ({why})")),
        lock_memory().map_err(|why| format!("memory is not locked ({why})")),
    ]
    .into_iter()
    .filter_map(Result::err)
    .collect();
    if refused.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}, so ticks may be late; `ulimit -r` and `ulimit -l` say what is permitted",
        refused.join(" and ")
    ))
}

/// Other systems have no such request.
#[cfg(not(target_os = "linux"))]
pub(crate) fn request() -> Result<(), String> {
    Ok(())
}

/// Gives this thread a real-time priority above that of the thread that runs the scans, if that is
/// permitted: the watchdog must run also while a scan does.
pub(crate) fn raise_above_scans() {
    #[cfg(target_os = "linux")]
    // Where that is not permitted, the same request for the scan's thread fails too, and the journal says
    // so.
    let _ = raise_priority(PRIORITY + 1);
}

#[cfg(target_os = "linux")]
fn raise_priority(priority: u8) -> Result<(), String> {
    use std::io;
    use thread_priority::unix::{set_thread_priority_and_policy, thread_native_id};
    use thread_priority::{
        Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue,
        ThreadSchedulePolicy,
    };
    let value = ThreadPriorityValue::try_from(priority)?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = ThreadPriority::Crossplatform(value);
    set_thread_priority_and_policy(thread_native_id(), priority, policy).map_err(|why| match why {
        Error::OS(code) => io::Error::from_raw_os_error(code).to_string(),
        other => format!("{other:?}"),
    })
}

/// Locks the process's memory. Memory that it takes later is locked too, but only where the amount is not
/// limited: with a limit, an allocation beyond it would fail.
///
/// # Errors
/// Why it is not permitted.
#[cfg(target_os = "linux")]
pub(crate) fn lock_memory() -> Result<(), String> {
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::process::{Resource, getrlimit};
    let unbounded = getrlimit(Resource::Memlock).current.is_none();
    let future = if unbounded { MlockAllFlags::FUTURE } else { MlockAllFlags::empty() };
    mlockall(MlockAllFlags::CURRENT | future).map_err(|why| why.to_string())
}
