//! Runs the modules (NCT 1.2, 1.3): how each is called, and how long it may run.
//!
//! In simulated time a module is suspended or stopped after a number of safepoints, so that every run
//! is the same. In real time the manual's shares of the time count ([`super::time`]), and in both the
//! watchdog, where there is one.

use std::time::{Duration, Instant};

use plcc_abi::image::read_u32;
use plcc_abi::nct::context;
use plcc_abi::{Engine, Outcome, Scan, TimeLimit, TrapCode};

use crate::{ClockDecision, Stop};

use super::host::NctHost;
use super::image::Module;
use super::state::State;
use super::tick::NctExecutive;
use super::time::{ModuleTime, Share};

/// Safepoints that :001 and :002 may pass.
pub(super) const MAX_SAFEPOINTS: u32 = 1_000_000;
/// In real time a module is suspended after so many safepoints in any case, so that its time is
/// looked at also where there is no watchdog.
const REAL_TIME_STEP: u32 = 1000;
/// The time that :001 and :000 together get in each slice in real time (NCT 1.2).
pub(super) const SHARE_OF_SLICE: Duration = Duration::from_millis(5);

impl NctExecutive {
    /// Whether a module with this share has any time limit.
    fn is_limited(&self, share: &Share) -> bool {
        share.time.is_some() || self.watchdog.is_some()
    }

    /// The time limits of a module, if it has any.
    fn time<'a>(&'a self, share: &'a Share) -> Option<ModuleTime<'a>> {
        let watchdog = self.watchdog.as_ref();
        let used_before = &self.used_before;
        self.is_limited(share).then_some(ModuleTime { share, watchdog, used_before })
    }

    /// The time now, where a watchdog limits scans.
    fn time_for_watchdog(&self) -> Option<Instant> {
        self.watchdog.as_ref().map(|_| Instant::now())
    }

    /// The share of a module that gets `time` of the real time that began at `began`.
    fn share(&self, began: Option<Instant>, time: Duration, is_suspended: bool) -> Share {
        let time = began.filter(|_| self.realtime).map(|began| (began, time));
        Share { time, began: self.time_for_watchdog(), is_suspended }
    }

    /// Calls a module once. It may pass `fuel` safepoints; `stops` says whether it is stopped or suspended
    /// when they are used up.
    fn call(
        &mut self,
        engine: &mut dyn Engine,
        module: Module,
        fuel: u32,
        stops: bool,
        share: &Share,
    ) -> Outcome {
        let watchdog = self.watchdog.as_ref();
        let limited = self.is_limited(share);
        let used_before = &self.used_before;
        let time = limited.then_some(ModuleTime { share, watchdog, used_before });
        let State { modules, memory, resume, .. } = &mut self.state;
        self.image.enter(modules, module, fuel, stops);
        let limit = time.as_ref().and_then(ModuleTime::limit).unwrap_or(TimeLimit::NONE);
        let mut host = NctHost { flags: &self.tables.flags, memory, time };
        let mut scan = Scan { image: &mut self.image.bytes, host: &mut host, limit };
        let slot = resume.get_mut(module);
        let from = slot.as_deref().copied().flatten();
        let outcome = engine.call(module, from, &mut scan);
        if let Some(slot) = slot {
            *slot = outcome.resume_point();
        }
        self.image.leave(modules, module);
        if let Some(watchdog) = watchdog {
            watchdog.end();
        }
        // A program may also store into the lines themselves.
        self.state.forces.apply_to_outputs(&mut self.image.bytes, self.image.places.lines_out);
        outcome
    }

    /// How many safepoints the module that was called last might still pass.
    fn fuel_left(&self) -> u32 {
        read_u32(&self.image.bytes, self.image.places.context + context::FUEL)
    }

    /// Runs a module that must come to its end; `began` is when its share of real time began.
    pub(super) fn run(
        &mut self,
        engine: &mut dyn Engine,
        module: Module,
        began: Option<Instant>,
    ) -> Result<(), Stop> {
        let time = match module {
            2 => Duration::from_millis(self.period_ms),
            _ => SHARE_OF_SLICE,
        };
        let share = &self.share(began, time, false);
        let outcome = if self.decisions.followed().is_some() {
            self.run_as_decided(engine, module)
        } else if !self.is_limited(share) {
            self.call(engine, module, MAX_SAFEPOINTS, true, share)
        } else {
            let mut passed = 0;
            let outcome = self.run_with_limits(engine, module, share, &mut passed);
            self.note(outcome, passed);
            outcome
        };
        self.calls += 1;
        match outcome {
            Outcome::End | Outcome::Suspended(_) => Ok(()),
            Outcome::Trap(trap) => Err(self.stop(module, trap)),
        }
    }

    /// Runs a module that must come to its end and is stopped when its time is used up.
    fn run_with_limits(
        &mut self,
        engine: &mut dyn Engine,
        module: Module,
        share: &Share,
        passed: &mut u32,
    ) -> Outcome {
        let mut fuel = if self.realtime { REAL_TIME_STEP } else { MAX_SAFEPOINTS };
        loop {
            let outcome = self.call(engine, module, fuel, false, share);
            if outcome.resume_point().is_none() {
                return outcome;
            }
            let left = self.fuel_left();
            *passed = passed.saturating_add(fuel.saturating_sub(left));
            let has_fuel = self.realtime || left > 0;
            if !has_fuel || self.time(share).is_some_and(|time| time.is_over()) {
                return self.stop_at_safepoint(engine, module, share);
            }
            fuel = if self.realtime { REAL_TIME_STEP } else { left };
        }
    }

    /// Notes how a call of a module that is watched by the clock has ended, unless it came to its end.
    /// It passed `passed` safepoints before the one at which it was stopped, if it was.
    fn note(&mut self, outcome: Outcome, passed: u32) {
        let call = self.calls;
        self.decisions.note(match outcome {
            Outcome::Suspended(_) => ClockDecision::Suspended { call, safepoints: passed },
            Outcome::Trap(trap) => match trap.code {
                TrapCode::Timeout => {
                    ClockDecision::Stopped { call, safepoints: passed.saturating_add(1) }
                }
                TrapCode::Watchdog => ClockDecision::Cut,
                // The program itself is to blame.
                _ => return,
            },
            Outcome::End => return,
        });
    }

    /// Runs a module as far as the followed decisions say; to its end where they say nothing of it.
    fn run_as_decided(&mut self, engine: &mut dyn Engine, module: Module) -> Outcome {
        let this = self.calls;
        let mut decided = self.decisions.followed().unwrap_or_default().iter();
        let limit = decided.find_map(|decision| match *decision {
            ClockDecision::Suspended { call, safepoints } if call == this => {
                Some((safepoints, false))
            }
            ClockDecision::Stopped { call, safepoints } if call == this => Some((safepoints, true)),
            _ => None,
        });
        let (fuel, stops) = limit.unwrap_or((u32::MAX, true));
        let began = self.time_for_watchdog();
        let share = &Share { time: None, began, is_suspended: !stops };
        let outcome = self.call(engine, module, fuel, stops, share);
        if let Some((safepoints, stops)) = limit {
            self.note(outcome, safepoints.saturating_sub(u32::from(stops)));
        }
        outcome
    }

    /// Lets a module that was suspended go on to its next safepoint, where it is stopped, by a trap
    /// that names the statement, unless it comes to its end before.
    fn stop_at_safepoint(
        &mut self,
        engine: &mut dyn Engine,
        module: Module,
        share: &Share,
    ) -> Outcome {
        match self.call(engine, module, 1, true, share) {
            Outcome::Suspended(_) => Outcome::trap(TrapCode::Timeout),
            outcome => outcome,
        }
    }

    /// Runs :000 for what is left of the slice whose real time began at `began`.
    pub(super) fn run_level0(
        &mut self,
        engine: &mut dyn Engine,
        began: Option<Instant>,
    ) -> Result<(), Stop> {
        self.image.show(&mut self.state.modules, true);
        if self.state.level0_starts || !self.state.synchronised {
            self.image.synchronise(&self.state.modules);
        }
        let share = &self.share(began, SHARE_OF_SLICE, true);
        let mut passed = 0_u32;
        let mut fuel = if self.realtime { REAL_TIME_STEP } else { self.level0_safepoints };
        let follows = self.decisions.followed().is_some();
        let outcome = loop {
            if follows {
                break self.run_as_decided(engine, 0);
            }
            let outcome = self.call(engine, 0, fuel, false, share);
            if outcome.resume_point().is_none() {
                break outcome;
            }
            let left = self.fuel_left();
            passed = passed.saturating_add(fuel.saturating_sub(left));
            let Some(time) = self.time(share) else { break outcome };
            if time.is_over() {
                break self.stop_at_safepoint(engine, 0, share);
            }
            if time.is_used_up() || !self.realtime && left == 0 {
                break outcome;
            }
            fuel = if self.realtime { REAL_TIME_STEP } else { left };
        };
        if !follows && self.is_limited(share) {
            self.note(outcome, passed);
        }
        self.calls += 1;
        self.image.show(&mut self.state.modules, false);
        match outcome {
            Outcome::End => self.state.level0_starts = true,
            Outcome::Suspended(_) => self.state.level0_starts = false,
            Outcome::Trap(trap) => return Err(self.stop(0, trap)),
        }
        Ok(())
    }
}
