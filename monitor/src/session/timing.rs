//! How long ticks take, where the time goes by line, and overruns.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use plcc_protocol::{TaskSummary, TimingSummary};

use super::Session;
use super::costs::{Cost, ENOUGH};
use crate::Refusal;
use crate::flow::LOOK_BACK;
use crate::view::{LineCost, Overrun, TimingView};

/// How long further ticks are run again for one view.
const MORE_TIME: Duration = Duration::from_millis(30);
/// How many lines are listed.
const MAX_LINES: usize = 200;
/// How many overruns are listed.
const MAX_OVERRUNS: usize = 50;

/// A stretch of ticks that the clock left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Skipped {
    /// The first of them.
    pub(super) first: u64,
    pub(super) count: u64,
    /// Whether no tick was left out but the watchdog has stopped a scan; `first` is the tick of that scan then.
    pub(super) cut: bool,
}

impl Session<'_> {
    pub(super) fn timing_view(&mut self) -> Result<TimingView, Refusal> {
        let timing = self.link.as_mut().map(|link| link.timing());
        let timing = timing.and_then(Result::ok).map(|stat| stat.timing);
        let rows = |timing: &TimingSummary| {
            let whole = [("lateness", timing.lateness), ("tick", timing.ticks)];
            let whole = whole.map(|(name, times)| TaskSummary { name: name.into(), times });
            whole.into_iter().chain(timing.tasks.iter().cloned()).collect()
        };
        let times = timing.as_ref().map(rows).unwrap_or_default();
        let (ticks, lines) = match self.debugger {
            Some(_) => self.line_costs()?,
            None => (0, vec![]),
        };
        let executed: u64 = self.costs.by_row.values().map(|cost| cost.executions).sum();
        let usual = if ticks > 0 { executed as f64 / ticks as f64 } else { 0.0 };
        let recorded_overruns = self.overruns(usual);
        Ok(TimingView {
            times,
            overruns: timing.as_ref().map(|timing| timing.overruns),
            skipped: timing.as_ref().map(|timing| timing.skipped),
            ticks,
            enough: ENOUGH,
            lines: lines.into_iter().take(MAX_LINES).collect(),
            recorded_overruns,
        })
    }

    /// How long the interpreter took for the statements of each line, in many ticks, whose number is given. Nothing of fewer than
    /// [`ENOUGH`]: as many as are missing are run again meanwhile, a few at each call.
    fn line_costs(&mut self) -> Result<(u64, Vec<LineCost>), Refusal> {
        self.flow()?;
        let until = Instant::now() + MORE_TIME;
        let first = self.debugger()?.history().first();
        while self.costs.ticks < ENOUGH && Instant::now() < until {
            let last = (self.time.shown + 1).saturating_sub(LOOK_BACK);
            let next = self.costs.next_back.map_or(last, |next| next.min(last));
            let Some(tick) = next.checked_sub(1).filter(|tick| *tick >= first) else { break };
            self.costs.next_back = Some(tick);
            self.trace(tick)?;
        }
        let ticks = self.costs.ticks;
        if ticks < ENOUGH {
            return Ok((ticks, vec![]));
        }
        let all: Duration = self.costs.by_row.values().map(|cost| cost.time).sum();
        let line = |(&row, cost): (&usize, &Cost)| {
            let content = self.text.rows.get(row)?;
            Some(LineCost {
                row,
                number: content.number.clone(),
                text: content.text().trim().to_owned(),
                executions: cost.executions,
                nanoseconds: cost.time.as_nanos() as f64 / ticks as f64,
                // A clock that is too coarse to see any of them gives no shares.
                share: cost.time.as_secs_f64() / all.as_secs_f64().max(f64::MIN_POSITIVE),
            })
        };
        let mut lines: Vec<LineCost> = self.costs.by_row.iter().filter_map(line).collect();
        lines.sort_by(|a, b| b.nanoseconds.total_cmp(&a.nanoseconds).then(a.row.cmp(&b.row)));
        Ok((ticks, lines))
    }

    /// By the rows of the program's text, how many statements of each were executed in some ticks.
    fn executions(&self, ticks: RangeInclusive<u64>) -> HashMap<usize, u64> {
        let mut by_row = HashMap::new();
        for steps in ticks.filter_map(|tick| self.traces.get(tick)) {
            for row in steps.steps.iter().filter_map(|(statement, _)| self.text.row_of(*statement))
            {
                *by_row.entry(row).or_default() += 1;
            }
        }
        by_row
    }

    fn overruns(&mut self, usual: f64) -> Vec<Overrun> {
        let from = self.skipped.len().saturating_sub(MAX_OVERRUNS);
        let skipped: Vec<Skipped> = self.skipped.get(from..).unwrap_or_default().to_vec();
        let first = self.first();
        skipped
            .into_iter()
            .map(|Skipped { first: tick, count, cut }| {
                let before = tick.checked_sub(1).filter(|before| *before >= first && !cut);
                // Of another version of the program nothing is run again here: that would replace what is shown.
                let before = before.filter(|before| self.is_of_version(*before));
                let traced = before.and_then(|before| {
                    if !self.traces.has(before) {
                        self.trace(before).ok()?;
                    }
                    let count = self.traces.get(before)?.steps.len() as u64;
                    let rows = self.executions(before..=before).into_iter();
                    let most = rows.max_by_key(|&(row, count)| (count, usize::MAX - row));
                    let line = most.and_then(|(row, _)| {
                        let content = self.text.rows.get(row)?;
                        Some(format!("{} {}", content.number, content.text().trim()))
                    });
                    Some((count, line))
                });
                let (statements, line) = match traced {
                    Some((statements, line)) => (Some(statements), line),
                    None => (None, None),
                };
                Overrun { tick, skipped: count, statements, usual, line }
            })
            .collect()
    }

    /// Adds a tick that the clock left out or, with `cut`, in which the watchdog stopped a scan.
    pub(super) fn note_overrun(&mut self, tick: u64, cut: bool) {
        match self.skipped.last_mut() {
            Some(last) if !cut && !last.cut && last.first + last.count == tick => last.count += 1,
            _ => self.skipped.push(Skipped { first: tick, count: u64::from(!cut), cut }),
        }
    }
}
