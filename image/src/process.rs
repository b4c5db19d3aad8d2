//! Which process a part of the file belongs to, and whether that process still lives.

use std::fs;

/// The number of this process and the time at which it began, in one word: the process's number in the
/// upper 32 bits, the lower 32 bits of its start time in clock ticks since the computer started in the
/// lower ones. By the time it is told from a later process of the same number.
pub(crate) fn this() -> u64 {
    let process = std::process::id();
    u64::from(process) << 32 | start_time(process).unwrap_or(0)
}

/// The lower 32 bits of the time at which a process began; `None` where there is no such process.
fn start_time(process: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The program's name, in parentheses, may hold spaces. The start time is the 20th field behind it.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_ascii_whitespace();
    if fields.next()? == "Z" {
        return None;
    }
    let time: u64 = fields.nth(18)?.parse().ok()?;
    Some(time & 0xFFFF_FFFF)
}

/// Whether the process that [`this`] gave this word still lives.
pub(crate) fn lives(owner: u64) -> bool {
    owner != 0 && start_time((owner >> 32) as u32) == Some(owner & 0xFFFF_FFFF)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_known_by_its_number_and_its_start() {
        assert!(lives(this()));
        assert!(!lives(this() ^ 1) && !lives(0) && !lives(u64::from(u32::MAX) << 32));
        let mut child = std::process::Command::new("true").spawn().unwrap();
        let owner = u64::from(child.id()) << 32 | start_time(child.id()).unwrap_or(0);
        child.wait().unwrap();
        assert!(!lives(owner));
    }
}
