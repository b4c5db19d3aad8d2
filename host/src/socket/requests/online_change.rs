//! Online changes: another program takes the place of the one that runs, or the program before that comes back.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plcc_abi::Engine;
use serde_json::Value as Json;

use super::waiting_change::duration;
use super::{Loaded, RequestState, Requests, done, json, refused};
use crate::Peer;
use crate::image_file::{Content, Publisher, State, SymbolTable};
use crate::journal::EntryKind;
use crate::replacement::{Progress, Replacement};
use crate::socket::program::ServedProgram;
use plcc_protocol::{ChangedVariable, Failure, OnlineChange};
use plcc_runtime::compare;
use plcc_runtime::online_change::{Change, Comparison, Row};
use plcc_runtime::{Executive, Purpose, VariableKey};

/// An online change that is under way, as the socket's thread remembers it. The other thread has the
/// [`Replacement`] meanwhile.
pub(super) struct PendingChange {
    /// The program that is about to run.
    pub(super) next: ServedProgram,
    comparison: Comparison,
    rollback: bool,
    pub(super) by: Peer,
}

/// What was made ready for a program that is about to run.
struct Prepared {
    /// Its image file.
    publisher: Option<Publisher>,
    /// The keys of the stimulus's variables in it.
    set: Vec<VariableKey>,
    /// Those of the trace's.
    watched: Vec<VariableKey>,
}

/// The program that ran before the last online change, ready to run again.
pub(super) struct Previous {
    pub(super) program: ServedProgram,
    executive: Box<dyn Executive + Send>,
    engine: Option<Box<dyn Engine + Send>>,
}

impl Requests {
    /// Compares another artifact with the program that runs, and has it take its place.
    pub(super) fn swap(
        &mut self,
        path: &Path,
        accept: &[String],
        dry_run: bool,
        wait: Option<f64>,
        by: &Peer,
    ) -> Result<RequestState, Failure> {
        let wait = duration(wait)?;
        if !dry_run {
            self.check_none_waits()?;
        }
        let Loaded { program, operator, engine, put_into_record } =
            (self.services.load)(path).map_err(refused)?;
        let comparison = compare(&self.current.program, &program).map_err(refused)?;
        if dry_run {
            return done(&shown(&comparison));
        }
        let names: Vec<&str> = comparison.refused(accept).map(|row| row.name.as_str()).collect();
        if !names.is_empty() {
            let text = format!(
                "these changes are refused unless they are accepted by their names: {}",
                names.join(", ")
            );
            let mut failure = refused(text);
            if let Json::Object(details) = json(&shown(&comparison))? {
                failure.details = details;
            }
            return Err(failure);
        }
        let make = &self.services.make_executive;
        let executive = make(&program).map_err(refused)?;
        let mut next =
            ServedProgram::new(Arc::new(program), operator.as_deref(), executive.as_ref());
        next.title = path.display().to_string();
        next.recorded = put_into_record();
        let change = PendingChange { next, comparison, rollback: false, by: by.clone() };
        self.replace(change, executive, Some(engine), wait)
    }

    /// Has the program run again that the last online change replaced. Changes need not be accepted.
    pub(super) fn rollback(
        &mut self,
        wait: Option<f64>,
        by: &Peer,
    ) -> Result<RequestState, Failure> {
        let wait = duration(wait)?;
        self.check_none_waits()?;
        let Some(Previous { program: next, executive, engine }) = self.previous.take() else {
            return Err(refused("there was no online change that could be taken back"));
        };
        let comparison = compare(&self.current.program, &next.program).map_err(refused)?;
        let change = PendingChange { next, comparison, rollback: true, by: by.clone() };
        self.replace(change, executive, engine, wait)
    }

    /// Prepares a program to take the place of the one that runs, and has it do so.
    fn replace(
        &mut self,
        mut change: PendingChange,
        mut executive: Box<dyn Executive + Send>,
        engine: Option<Box<dyn Engine + Send>>,
        wait: Duration,
    ) -> Result<RequestState, Failure> {
        let prepared = self.check_room();
        let prepared = prepared.and_then(|()| self.take_forces(&mut change, executive.as_mut()));
        let prepared = prepared.and_then(|()| self.prepare(&change.next, executive.as_ref()));
        let Prepared { publisher, set, watched } = match prepared {
            Ok(prepared) => prepared,
            Err(failure) => {
                self.keep_previous(change, executive, engine);
                return Err(failure);
            }
        };
        let plan = change.comparison.plan.clone();
        let recorder_program =
            (self.services.recorder_program)(change.next.recorded, executive.as_ref());
        let progress = Progress::Prepared;
        let replacement = Replacement {
            executive,
            engine,
            plan,
            set,
            watched,
            recorder_program,
            publisher,
            progress,
        };
        let ends = Instant::now() + wait;
        self.hand_over(Box::new(replacement), Box::new(change), wait, ends)?;
        Ok(RequestState::Changing)
    }

    /// Has an executive that is about to run take the forces that are in effect now, in the place of those that it has.
    pub(super) fn take_forces(
        &mut self,
        change: &mut PendingChange,
        executive: &mut (dyn Executive + Send),
    ) -> Result<(), Failure> {
        self.current.check_forces(&change.comparison).map_err(refused)?;
        for (key, _) in executive.forces() {
            // Ending a force never fails.
            let _ = executive.force(key, None);
        }
        change.next.take_forces(&self.current, executive).map_err(refused)
    }

    /// Ends a change that is not carried out.
    pub(super) fn abandon(&mut self, replacement: Replacement, change: PendingChange) {
        if let Some(path) = &self.services.image {
            Publisher::discard(path);
        }
        let Replacement { executive, engine, .. } = replacement;
        self.keep_previous(change, executive, engine);
    }

    /// Puts a program that was to run again back to where it waited.
    fn keep_previous(
        &mut self,
        change: PendingChange,
        executive: Box<dyn Executive + Send>,
        engine: Option<Box<dyn Engine + Send>>,
    ) {
        if change.rollback {
            self.previous = Some(Previous { program: change.next, executive, engine });
        }
    }

    /// Makes everything ready that does not depend on the state of the program that runs: the keys of variables, the
    /// image file.
    fn prepare(
        &self,
        next: &ServedProgram,
        executive: &(dyn Executive + Send),
    ) -> Result<Prepared, Failure> {
        // A pattern of the trace may have found constants, which are declared, but are nothing that a name could choose.
        let declared: HashMap<String, VariableKey> = next.names.declared().into_iter().collect();
        let keys = |names: &[String], purpose| -> Result<Vec<VariableKey>, Failure> {
            let key = |name: &String| {
                let found = next.names.find(name, purpose).ok();
                let declared = || declared.get(name).copied().filter(|_| purpose == Purpose::Watch);
                found.or_else(declared).ok_or_else(|| {
                    refused(format!(
                        "the trace or the stimulus of this run uses {name}, which the new program \
                         can't provide"
                    ))
                })
            };
            names.iter().map(key).collect()
        };
        let set = keys(&self.services.set, Purpose::Stimulus)?;
        let watched = keys(&self.services.watched, Purpose::Watch)?;
        let Some(path) = &self.services.image else {
            return Ok(Prepared { publisher: None, set, watched });
        };
        let content = Content {
            program: &next.program,
            fingerprint: executive.fingerprint(),
            image: executive.image(),
            used: &executive.used_ranges(),
            tick_ns: executive.tick_ns(),
            generation: self.generation + 1,
            safe_outputs: executive.safe_lines().bytes(),
            symbols: &SymbolTable::new(&*next.names),
            rules: &self.services.input_rules,
        };
        let publisher = Publisher::prepare(path, &content);
        let publisher = Some(publisher.map_err(|error| refused(error.to_string()))?);
        Ok(Prepared { publisher, set, watched })
    }

    /// Ends an online change, when the thread that runs the ticks has carried it out or can't do that.
    pub(super) fn change(
        &mut self,
        replacement: Replacement,
        change: PendingChange,
        tick: u64,
        took: Duration,
    ) -> Result<Json, Failure> {
        self.under_way = None;
        if let Progress::Failed(why) = replacement.progress {
            self.abandon(replacement, change);
            return Err(refused(why));
        }
        let Replacement { executive, engine, publisher, .. } = replacement;
        if let Some(path) = &self.services.image
            && let Err(error) = Publisher::put_in_place(path)
        {
            self.journal.error(error.to_string());
        }
        if let Some(mut publisher) = publisher {
            publisher.end(State::Replaced);
        }
        let PendingChange { next, comparison, rollback, by } = change;
        let program = std::mem::replace(&mut self.current, next);
        self.previous = Some(Previous { program, executive, engine });
        self.generation += 1;
        let artifact = self.current.title.clone();
        self.journal.write(EntryKind::Swap { artifact, rollback, took, by });
        json(&OnlineChange {
            comparison: shown(&comparison),
            ticks: tick,
            took_us: took.as_nanos() as f64 / 1000.0,
            generation: self.generation,
        })
    }
}

/// A comparison as a part of a reply.
fn shown(comparison: &Comparison) -> plcc_protocol::Comparison {
    let row = |row: &Row| ChangedVariable {
        name: row.name.clone(),
        change: match row.change {
            Change::New => plcc_protocol::Change::New,
            Change::Gone => plcc_protocol::Change::Gone,
            Change::Changed => plcc_protocol::Change::Changed,
        },
        old: row.old.clone(),
        new: row.new.clone(),
        needs_accept: row.needs_accept,
    };
    plcc_protocol::Comparison {
        kept: comparison.kept,
        changes: comparison.rows.iter().map(row).collect(),
    }
}
