//! A token bucket: bounds how often something is done, with bursts up to a limit.

use std::time::Instant;

/// Tokens that come at a steady rate and are kept up to a limit; whatever is bounded takes one each time.
#[derive(Debug)]
pub(super) struct TokenBucket {
    /// How many tokens come in a second.
    rate: f64,
    /// How many are kept at most.
    burst: f64,
    tokens: f64,
    /// When `tokens` was last brought up to date.
    refilled_at: Instant,
}

impl TokenBucket {
    /// A full bucket: `rate` tokens come in a second, and at most `burst` are kept.
    pub(super) fn new(rate: f64, burst: f64, now: Instant) -> Self {
        Self { rate, burst, tokens: burst, refilled_at: now }
    }

    /// Adds the tokens of the time that has passed.
    pub(super) fn refill(&mut self, now: Instant) {
        let passed = now.saturating_duration_since(self.refilled_at).as_secs_f64();
        // An earlier time than the last one adds nothing, and takes nothing from the time that comes.
        self.refilled_at = self.refilled_at.max(now);
        self.tokens = (self.tokens + passed * self.rate).min(self.burst);
    }

    /// Whether there is no token, as of the last refill.
    pub(super) fn is_empty(&self) -> bool {
        self.tokens < 1.0
    }

    /// Takes a token; where there is none, nothing happens.
    pub(super) fn take(&mut self) {
        if !self.is_empty() {
            self.tokens -= 1.0;
        }
    }
}
