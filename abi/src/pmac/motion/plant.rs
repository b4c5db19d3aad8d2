//! What a simulated motor is fastened to: its stops, its switches, its index pulses.

use alloc::{vec, vec::Vec};

use serde::{Deserialize, Serialize};

/// A simulated motor. Positions are counts from the position at power-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    /// The motor, from 1.
    pub number: u8,
    /// The hard stops; none where the motor turns freely.
    pub stroke: Option<(f64, f64)>,
    /// The limit inputs are closed between these; always without.
    pub limits: Option<(f64, f64)>,
    /// Where the home input is 1: intervals by rising position that do not touch.
    pub home: Vec<(f64, f64)>,
    /// Counts between index pulses; 0 for none.
    pub index: u32,
    /// Where one index pulse is.
    pub index_at: i64,
    /// Servo cycles from the command to the actual position.
    pub lag: u16,
    /// Counts a millisecond at full output in open loop.
    pub open_loop: f64,
}

impl Plant {
    /// A motor of which the machine file says nothing.
    pub fn new(number: u8) -> Self {
        Self {
            number,
            stroke: None,
            limits: None,
            home: vec![(-12_000.0, -10_000.0), (10_000.0, 12_000.0)],
            index: 4000,
            index_at: 0,
            lag: 0,
            open_loop: 32.0,
        }
    }

    /// Brings intervals into their order and joins those that touch.
    pub fn joined(mut intervals: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
        intervals.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut out: Vec<(f64, f64)> = Vec::with_capacity(intervals.len());
        for (from, to) in intervals {
            match out.last_mut() {
                Some(last) if from <= last.1 => last.1 = last.1.max(to),
                _ => out.push((from, to)),
            }
        }
        out
    }
}
