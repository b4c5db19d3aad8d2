//! Lowers jumps, calls and returns (NCT 4.11), safepoints, and the beginnings of modules.
//!
//! A safepoint takes one off the fuel in the region `context`, the number of safepoints that the
//! module may still pass. At 0, or when the scan is late, the module is suspended or stopped. A call is known by its number,
//! counted over all calls of the program in the source's order. A return goes on after the call
//! whose number was stored last.
//!
//! A module that is stopped names the statement that it was at. Each statement that can pass a
//! safepoint has a number for that: a call its own number, a jump back one above those of all calls.
//! Where fuel is used up, the number is stored in the image (`pending`), so that the code after is
//! shared. An indirect jump or call stores it in any case before it goes to a stub.

use plcc_abi::{SourceLine, TrapCode, TrapSite, nct::context};
use plcc_ir::{Address, BinaryOp, InstBuilder, IntCond, Place, Type, Value};

use super::memory::Bcd;
use super::{Lowerer, Result};
use crate::common::{OrMissing, ReturnStack};
use crate::nct::{
    ast::{Op, Space, Word},
    control_flow::INDIRECT_LABELS,
    lower::liveness::LiveSet,
    status_flags::{NOT_BCD, SYNTAX},
};

/// Code through which all indirect jumps back, or all indirect calls, go that lead to one
/// statement. It passes the safepoint and, for a call, stores the call's number.
pub(super) struct Stub {
    /// The index of the statement.
    to: usize,
    /// Whether it is for calls.
    call: bool,
    /// Where the code is.
    place: Place,
}

/// The number of the statement that calls or jumps back.
#[derive(Clone, Copy)]
enum Number {
    /// This one.
    Known(i64),
    /// That of an indirect jump or call, which has left it in the image.
    Pending,
}

impl Lowerer<'_> {
    /// Makes places for the statements that jumps, calls and returns lead to. The places after
    /// calls come first, so that the number of a call is also the number of the chunk label after
    /// it.
    pub(super) fn find_places(&mut self) {
        let stmts = &self.program.stmts;
        self.sites = self.program.calls().collect();
        for site in self.sites.clone() {
            let place = self.place(site + 1);
            self.builder.label(place);
        }
        if !self.sites.is_empty() {
            let pending = self.pending();
            self.return_stack = Some(ReturnStack {
                region: self.regions.context,
                offset: context::SITES,
                depth: context::MAX_DEPTH.into(),
                pending: Some((pending.region, pending.offset)),
            });
        }
        let indirect = |op: &Op| matches!(op, Op::GotoIndirect(_) | Op::CallIndirect(_));
        if stmts.iter().any(|s| indirect(&s.op)) {
            let stands = |label: u16| Some((label, self.program.target(label)?));
            self.labels = INDIRECT_LABELS.filter_map(stands).collect();
        }
        for (_, at) in self.labels.clone() {
            self.place(at);
        }
        for stmt in stmts {
            if let Op::Goto(label) | Op::Call(label) = stmt.op
                && let Some(to) = self.program.target(label)
            {
                self.place(to);
            }
        }
    }

    /// Adds the trap sites. The number of a statement that can pass a safepoint is also that of its
    /// site for a module that takes too long. Those for calls that nest too deep follow after all
    /// of them, in the order of the calls.
    pub(super) fn trap_sites(&mut self) -> Result {
        for (at, stmt) in self.program.stmts.iter().enumerate() {
            let jumps_back = match stmt.op {
                Op::Goto(label) => self.program.target(label).is_some_and(|to| to <= at),
                Op::GotoIndirect(_) => true,
                _ => false,
            };
            if jumps_back {
                self.jumps.push(at);
            }
        }
        let mut add = |code, at: usize| {
            let line = self.program.lines.get(at).copied();
            let line = line.or_missing(|| format!("the line of statement {at}"))?;
            let statement = SourceLine { file: 0, line };
            self.builder.trap_site(TrapSite { code, statement, array: None });
            Ok(())
        };
        for &at in self.sites.iter().chain(&self.jumps) {
            add(TrapCode::Timeout, at)?;
        }
        self.sites.iter().try_for_each(|&at| add(TrapCode::CallDepth, at))
    }

    /// The number of the first trap site for calls that nest too deep.
    fn first_depth_site(&self) -> i64 {
        (self.sites.len() + self.jumps.len()) as i64
    }

    /// Makes the beginnings of the tasks. No call is open there.
    pub(super) fn entries(&mut self) {
        for (module, at) in self.program.modules() {
            let entry = self.builder.place();
            self.builder.task(format!(":{module:03}"), entry);
            self.bind(entry);
            let none = self.builder.func().constant(Type::I16, 0);
            self.set_context(context::DEPTH, none);
            let start = self.place(at);
            self.builder.jump(start);
        }
    }

    /// The statements that safepoints lead to, in the source's order. Any task can be suspended at
    /// any of them.
    fn resume_points(&self) -> Vec<usize> {
        let mut points = vec![];
        for (at, stmt) in self.program.stmts.iter().enumerate() {
            match stmt.op {
                Op::Goto(label) => points.extend(self.program.target(label).filter(|&to| to <= at)),
                Op::Call(label) => points.extend(self.program.target(label)),
                Op::GotoIndirect(_) | Op::CallIndirect(_) => {
                    let call = matches!(stmt.op, Op::CallIndirect(_));
                    let all = self.labels.iter().map(|&(_, to)| to);
                    points.extend(all.filter(|&to| call || to <= at));
                }
                _ => {}
            }
        }
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Reads from the region `context`.
    fn context(&mut self, ty: Type, offset: u32) -> Value {
        self.builder.func().load(ty, Address::fixed(self.regions.context, offset))
    }

    /// Writes to the region `context`.
    fn set_context(&mut self, offset: u32, value: Value) {
        self.builder.func().store(Address::fixed(self.regions.context, offset), value);
    }

    /// Passes a safepoint of the statement with this number and goes to a statement.
    fn safepoint(&mut self, from: Number, to: usize) {
        let target = self.place(to);
        let fuel = self.context(Type::I32, context::FUEL);
        let fuel = self.builder.func().binary_imm(BinaryOp::Sub, fuel, 1);
        self.set_context(context::FUEL, fuel);
        let empty = self.is_zero(fuel);
        let is_late = self.builder.func().is_late();
        let empty = self.builder.func().binary(BinaryOp::Or, empty, is_late);
        let emptied = match self.emptied.iter().find(|(place, _)| *place == target) {
            Some((_, emptied)) => *emptied,
            None => {
                let emptied = self.builder.place();
                self.emptied.push((target, emptied));
                emptied
            }
        };
        match from {
            Number::Pending => self.builder.brif(empty, emptied, target),
            Number::Known(number) => {
                let cold = self.builder.place();
                self.builder.brif(empty, cold, target);
                self.bind(cold);
                let before = self.builder.func().set_cold(true);
                self.set_pending(number);
                self.builder.jump(emptied);
                self.builder.func().set_cold(before);
            }
        }
    }

    /// Leaves the number of a statement in the image.
    fn set_pending(&mut self, number: i64) {
        let number = self.builder.func().constant(Type::I32, number);
        let pending = self.pending();
        self.builder.func().store(pending, number);
    }

    /// `G…`: jumps to a label. A jump back passes a safepoint.
    pub(super) fn goto(&mut self, at: usize, label: u16) -> Result {
        let to = self.program.target(label).or_missing(|| format!("label :{label:03}"))?;
        self.leave(LiveSet::ALL);
        if to <= at {
            let number = self.jump_number(at)?;
            self.safepoint(Number::Known(number), to);
        } else {
            let place = self.place(to);
            self.builder.jump(place);
        }
        Ok(())
    }

    /// The number of the statement with the index `at`, which jumps back.
    fn jump_number(&self, at: usize) -> Result<i64> {
        let number = self.jumps.binary_search(&at).ok();
        let number = number.or_missing(|| format!("the jump at statement {at}"))?;
        Ok((self.sites.len() + number) as i64)
    }

    pub(super) fn call(&mut self, at: usize, label: u16) -> Result {
        let to = self.program.target(label).or_missing(|| format!("label :{label:03}"))?;
        let site = self.site(at)?;
        self.leave(LiveSet::ALL);
        self.enter(Number::Known(site), to);
        Ok(())
    }

    /// The number of the call at the statement with the index `at`.
    fn site(&self, at: usize) -> Result<i64> {
        let site = self.sites.binary_search(&at).ok();
        Ok(site.or_missing(|| format!("the call at statement {at}"))? as i64)
    }

    /// Stores the number of the call and goes to the statement that it calls.
    fn enter(&mut self, call: Number, to: usize) {
        let depth = self.context(Type::I16, context::DEPTH);
        let max = context::MAX_DEPTH;
        let full = self.builder.func().icmp_imm(IntCond::Uge, depth, max.into());
        let go_on = self.builder.place();
        match call {
            Number::Known(number) => {
                let cold = self.builder.place();
                self.builder.brif(full, cold, go_on);
                self.bind(cold);
                let before = self.builder.func().set_cold(true);
                let site = self.first_depth_site() + number;
                let site = self.builder.func().constant(Type::I32, site);
                self.trap_at(site);
                self.builder.func().set_cold(before);
            }
            Number::Pending => {
                let too_deep = match self.too_deep {
                    Some(place) => place,
                    None => {
                        let place = self.builder.place();
                        self.too_deep = Some(place);
                        place
                    }
                };
                self.builder.brif(full, too_deep, go_on);
            }
        }
        self.bind(go_on);
        let depth = self.context(Type::I16, context::DEPTH);
        let site = match call {
            Number::Known(number) => self.builder.func().constant(Type::I32, number),
            Number::Pending => self.load_pending(),
        };
        let slot = self.builder.func().zextend_or_trunc(Type::I32, depth);
        let sites = Address::indexed(self.regions.context, context::SITES, slot, 4, u32::from(max));
        self.builder.func().store(sites, site);
        let depth = self.builder.func().binary_imm(BinaryOp::Add, depth, 1);
        self.set_context(context::DEPTH, depth);
        self.safepoint(call, to);
    }

    /// `R`: goes on after the call that was done last. Outside of calls it ends the task.
    pub(super) fn ret(&mut self) {
        self.leave(LiveSet::ALL);
        let depth = self.context(Type::I16, context::DEPTH);
        let outside = self.is_zero(depth);
        let (end, back) = (self.builder.place(), self.builder.place());
        self.builder.brif(outside, end, back);
        self.bind(end);
        self.builder.ret();
        self.bind(back);
        let depth = self.context(Type::I16, context::DEPTH);
        let depth = self.builder.func().binary_imm(BinaryOp::Sub, depth, 1);
        self.set_context(context::DEPTH, depth);
        let slot = self.builder.func().zextend_or_trunc(Type::I32, depth);
        let max = u32::from(context::MAX_DEPTH);
        let at = Address::indexed(self.regions.context, context::SITES, slot, 4, max);
        let site = self.builder.func().load(Type::I32, at);
        self.builder.goto_indirect(site);
    }

    /// `GF`, and `CF` (`call`): goes to the label whose number is in BCD in the word `word` of
    /// F.
    pub(super) fn jump_indirect(&mut self, at: usize, word: u16, call: bool) -> Result {
        self.leave(LiveSet::ALL);
        let word = self.word(Word::Bytes { space: Space::F, byte: word })?;
        let word = self.builder.func().zextend_or_trunc(Type::I32, word);
        let Bcd { number, wrong } = self.take_bcd(word);
        let none = self.builder.func().constant(Type::I32, i64::from(u16::MAX));
        let number = self.builder.func().select(wrong, none, number);
        let zero = self.builder.func().constant(Type::I1, 0);
        self.store_bits(Space::F, SYNTAX.byte, &[(SYNTAX.bit, zero), (NOT_BCD.bit, wrong)])?;
        let statement = if call { self.site(at)? } else { self.jump_number(at)? };
        self.set_pending(statement);
        let refused = self.builder.place();
        let mut targets = vec![refused; usize::from(*INDIRECT_LABELS.end()) + 1];
        for (label, to) in self.labels.clone() {
            let place = if call || to <= at { self.stub(to, call) } else { self.place(to) };
            if let Some(slot) = targets.get_mut(usize::from(label)) {
                *slot = place;
            }
        }
        self.builder.switch(number, targets, refused);
        self.bind(refused);
        // If no digit was wrong, which F0082 says, the label does not exist, which F0080 says.
        let wrong = self.bit(NOT_BCD)?;
        let missing = self.not(wrong);
        self.store_bit(SYNTAX, missing)
    }

    /// The number that a statement has left in the image.
    fn load_pending(&mut self) -> Value {
        let pending = self.pending();
        self.builder.func().load(Type::I32, pending)
    }

    /// Where a statement leaves its number.
    fn pending(&self) -> Address {
        Address::fixed(
            self.regions.scratch,
            (u32::from(self.program.slots) * 2).next_multiple_of(4),
        )
    }

    /// The place of the stub to a statement.
    fn stub(&mut self, to: usize, call: bool) -> Place {
        if let Some(stub) = self.stubs.iter().find(|s| s.to == to && s.call == call) {
            return stub.place;
        }
        let place = self.builder.place();
        self.stubs.push(Stub { to, call, place });
        place
    }

    /// Adds, after the program's last statement, the code that its branches share: stubs,
    /// safepoints whose fuel is used up, traps.
    pub(super) fn shared_code(&mut self) {
        let points = self.resume_points();
        for Stub { to, call, place } in std::mem::take(&mut self.stubs) {
            self.bind(place);
            if call {
                self.enter(Number::Pending, to);
            } else {
                self.safepoint(Number::Pending, to);
            }
        }
        for (target, emptied) in std::mem::take(&mut self.emptied) {
            self.bind(emptied);
            let stop = self.context(Type::I8, context::ON_EMPTY);
            let go_on = self.is_zero(stop);
            let (suspended, timeout) = (self.builder.place(), self.timeout());
            self.builder.brif(go_on, suspended, timeout);
            self.bind(suspended);
            self.builder.suspend(target);
        }
        let places: Vec<Place> = points.into_iter().map(|at| self.place(at)).collect();
        for task in 0..self.program.modules().count() {
            self.builder.resume_points(task, &places);
        }
        if let Some(place) = self.timeout {
            self.bind(place);
            let site = self.load_pending();
            self.trap_at(site);
        }
        if let Some(place) = self.too_deep {
            self.bind(place);
            let call = self.load_pending();
            let first = self.first_depth_site();
            let site = self.builder.func().binary_imm(BinaryOp::Add, call, first);
            self.trap_at(site);
        }
    }

    /// Stops the program at a trap site.
    fn trap_at(&mut self, site: Value) {
        let none = self.builder.func().constant(Type::I32, 0);
        self.builder.func().trap_at(site, none);
    }

    /// Where the program is stopped since it takes too long.
    fn timeout(&mut self) -> Place {
        match self.timeout {
            Some(place) => place,
            None => {
                let place = self.builder.place();
                self.timeout = Some(place);
                place
            }
        }
    }
}
