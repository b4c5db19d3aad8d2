//! What browsers can ask of the server at most.

use std::time::Duration;

/// How many pages are shown at the same time.
pub(super) const MAX_CLIENTS: usize = 32;

/// How many connections are open at the same time, those of the pages among them. Others are closed at
/// once.
pub(super) const MAX_CONNECTIONS: usize = 128;

/// The longest message of a page in bytes. The longest ones name the statements that were chosen.
pub(super) const LONGEST_MESSAGE: usize = 64 << 10;

/// The longest text that is sent to a page in bytes: an export of the scope.
pub(super) const LONGEST_ANSWER: usize = 32 << 20;

/// How long the head of a request may take to arrive.
pub(super) const HEAD_TIME: Duration = Duration::from_secs(10);

/// How many bytes the head of a request may have. Browsers send less than 2 KB.
pub(super) const LONGEST_HEAD: usize = 16 << 10;

/// How long a page may take to receive a message. Then it is disconnected, and connects again.
pub(super) const SEND_TIME: Duration = Duration::from_secs(20);

/// How often a page is asked whether it is still there.
pub(super) const PING_TIME: Duration = Duration::from_secs(15);

/// How often views are made at most.
pub(super) const VIEW_PERIOD: Duration = Duration::from_millis(100);

/// The shortest time from a command to the view that shows its effect.
pub(super) const COMMAND_VIEW_DELAY: Duration = Duration::from_millis(20);

/// How many lines of the program a view has at most.
pub(super) const MAX_LINES: usize = 400;

/// How many samples of a variable a view of the scope has at most.
pub(super) const MAX_SAMPLES: usize = 4000;
