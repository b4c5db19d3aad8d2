//! Identifies the process that gives inputs, and says whether it still runs.

use std::fs;

/// One word that identifies this process. The upper 32 bits are the number of the process, the lower ones the
/// lower 32 bits of its start time, in clock ticks since the computer was started. A later process with the
/// same number has another start time.
pub(crate) fn own_identity() -> u64 {
    let process = std::process::id();
    u64::from(process) << 32 | start_time(process).unwrap_or(0)
}

/// The lower 32 bits of a process's start time; `None` if there is no such process, or it has ended and only waits
/// for its parent (a zombie).
fn start_time(process: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The program's name, in parentheses, may hold spaces. The start time is the 20th field after it.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_ascii_whitespace();
    if fields.next()? == "Z" {
        return None;
    }
    let time: u64 = fields.nth(18)?.parse().ok()?;
    Some(time & 0xFFFF_FFFF)
}

/// Whether the process with this identity (from [`own_identity`]) still runs. No process has the identity 0.
pub(crate) fn is_running(owner: u64) -> bool {
    owner != 0 && start_time((owner >> 32) as u32) == Some(owner & 0xFFFF_FFFF)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_known_by_its_number_and_its_start() {
        assert!(is_running(own_identity()));
        assert!(!is_running(own_identity() ^ 1) && !is_running(0));
        assert!(!is_running(u64::from(u32::MAX) << 32));
        let mut child = std::process::Command::new("true").spawn().unwrap();
        let owner = u64::from(child.id()) << 32 | start_time(child.id()).unwrap_or(0);
        child.wait().unwrap();
        assert!(!is_running(owner));
    }
}
