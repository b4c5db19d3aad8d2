//! What the checks of a program's tables share.
//!
//! They are not needed for memory safety: executives and hosts check each access to the image, and the engine each
//! label. They refuse a program that was put together wrongly before it runs.

/// Nothing, or what does not fit: the end of a sentence that begins with "the artifact is inconsistent:" or
/// "the program is damaged:".
pub type Check = Result<(), String>;

/// An error that says `what` does not fit, unless a condition holds.
pub fn ensure(holds: bool, what: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(what()) }
}

/// The process image as far as tables are checked against it: its size.
#[derive(Clone, Copy)]
pub struct Image {
    /// Its length in bytes.
    pub size: u64,
}

impl Image {
    /// An image of `size` bytes.
    pub fn new(size: u32) -> Self {
        Self { size: size.into() }
    }

    /// Whether `length` bytes from `offset` are inside.
    pub fn holds(self, offset: u32, length: u32) -> bool {
        u64::from(offset) + u64::from(length) <= self.size
    }

    /// Refuses `what` unless its `length` bytes from `offset` are inside.
    pub fn check(self, offset: u32, length: u32, what: &str) -> Check {
        ensure(self.holds(offset, length), || format!("{what} is outside the image"))
    }
}
