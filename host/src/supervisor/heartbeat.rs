//! What the control's process tells its supervisor.

use std::time::Duration;

/// At which stage of its run a control is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// It has not begun its first tick.
    Starting,
    /// It runs ticks.
    Running,
    /// It runs no more ticks: the outputs are safe, and everything is being saved.
    Ending,
}

/// What is sent: 32 bytes, numbers little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// At which stage of its run the control is.
    pub phase: Phase,
    /// How many ticks have begun.
    pub ticks: u64,
    /// A number that grows for as long as the thread that runs the ticks goes on, also while a user has
    /// stopped the program.
    pub rounds: u64,
    /// After how much time without a further tick the control is taken to hang.
    pub limit: Duration,
}

impl Heartbeat {
    /// How long a heartbeat is, in bytes.
    pub const SIZE: usize = 32;

    /// The bytes that are sent.
    pub fn to_bytes(self) -> [u8; Self::SIZE] {
        let phase: u64 = match self.phase {
            Phase::Starting => 0,
            Phase::Running => 1,
            Phase::Ending => 2,
        };
        let limit = u64::try_from(self.limit.as_nanos()).unwrap_or(u64::MAX);
        let mut bytes = [0; Self::SIZE];
        let numbers = [phase, self.ticks, self.rounds, limit];
        for (place, number) in bytes.chunks_exact_mut(8).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    /// Reads what was sent; `None` when it is not a heartbeat.
    pub fn from_bytes(bytes: &[u8; Self::SIZE]) -> Option<Self> {
        let mut numbers =
            bytes.chunks_exact(8).map(|part| part.try_into().map_or(0, u64::from_le_bytes));
        let phase = match numbers.next()? {
            0 => Phase::Starting,
            1 => Phase::Running,
            2 => Phase::Ending,
            _ => return None,
        };
        let (ticks, rounds, limit) = (numbers.next()?, numbers.next()?, numbers.next()?);
        Some(Self { phase, ticks, rounds, limit: Duration::from_nanos(limit) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_is_read_as_it_was_sent() {
        for phase in [Phase::Starting, Phase::Running, Phase::Ending] {
            let limit = Duration::from_millis(750);
            let sent = Heartbeat { phase, ticks: 1 << 40, rounds: 3, limit };
            assert_eq!(Heartbeat::from_bytes(&sent.to_bytes()), Some(sent));
        }
        assert_eq!(Heartbeat::from_bytes(&[9; Heartbeat::SIZE]), None);
    }
}
