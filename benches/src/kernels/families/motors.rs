//! Motors that exclude one another, and alarms.

use super::draft::{Draft, all, any, count_up, is, put, switch};
use super::number;
use crate::kernels::{Expr, Kernel, Language, Op, Stmt};

/// Motors, alarms, and how many motors run.
pub(super) fn motors(language: Language, count: usize, seed: u64) -> Kernel {
    let mut draft = Draft::new("motors", language, 0, seed);
    for pair in 0..count {
        add_pair(&mut draft, pair % 2 == 0);
    }
    add_alarms(&mut draft, count);
    draft.finish()
}

/// Adds the two directions of a motor, of which only one may run, with permissives and perhaps a brake that opens
/// later; and how many of these run.
pub(super) fn add_pair(draft: &mut Draft, is_equations: bool) {
    let (first, stop) = (draft.bits(2), draft.input());
    for (run, other) in [(first, first + 1), (first + 1, first)] {
        let start = Expr::Bit(draft.input());
        let permissives = 1 + draft.rng.below(2);
        let mut conditions = draft.contacts(permissives);
        conditions.push(Expr::NotBit(other));
        if is_equations {
            let mut parts = vec![Expr::Any(vec![start, Expr::Bit(run)]), Expr::NotBit(stop)];
            parts.append(&mut conditions);
            draft.set(run, Expr::All(parts));
        } else {
            let lost = any(conditions.iter().take(permissives).map(opposite).collect());
            let off = Expr::Any(vec![Expr::Bit(stop), lost]);
            conditions.insert(0, start);
            draft.push(Stmt::If(all(conditions), vec![switch(run, true)], vec![]));
            draft.push(Stmt::If(off, vec![switch(run, false)], vec![]));
        }
    }
    if draft.rng.chance(40) {
        add_delay(draft, first);
    }
}

/// Adds a contact that closes some scans after a relay.
fn add_delay(draft: &mut Draft, relay: usize) {
    let (time, late, limit) = (draft.word(), draft.bit(), 10 + draft.rng.below(40));
    let below = Expr::op(Op::Lt, Expr::Word(time), number(limit));
    let more = Stmt::If(below, vec![count_up(time)], vec![]);
    draft.push(Stmt::If(Expr::Bit(relay), vec![more], vec![put(time, 0)]));
    draft.decode(late, vec![vec![is(time, limit)]]);
}

/// The opposite of a contact.
fn opposite(contact: &Expr) -> Expr {
    match contact {
        Expr::Bit(bit) => Expr::NotBit(*bit),
        Expr::NotBit(bit) => Expr::Bit(*bit),
        other => other.clone(),
    }
}

/// Adds alarms that stay until the reset, the number of the first one, how many there are, and a lamp and a horn.
pub(super) fn add_alarms(draft: &mut Draft, count: usize) {
    let (alarms, first, sum) = (draft.bits(count), draft.word(), draft.word());
    let (reset, quiet) = (draft.input(), draft.input());
    let is_equations = draft.rng.chance(50);
    for (alarm, number) in (alarms..).zip(1..=count) {
        let causes = 1 + draft.rng.below(2);
        let cause = all(draft.contacts(causes));
        if is_equations {
            let held = Expr::Any(vec![cause, Expr::Bit(alarm)]);
            draft.set(alarm, Expr::All(vec![held, Expr::NotBit(reset)]));
        } else {
            draft.push(Stmt::If(cause, vec![switch(alarm, true)], vec![]));
        }
        let new = draft.when(vec![Expr::Bit(alarm), is(first, 0)], vec![put(first, number)]);
        draft.push(new);
    }
    let mut clear = vec![put(first, 0)];
    if !is_equations {
        clear.extend((alarms..alarms + count).map(|alarm| switch(alarm, false)));
    }
    draft.push(Stmt::If(Expr::Bit(reset), clear, vec![]));
    add_sum(draft, sum, alarms, count);
    let (lamp, horn) = (draft.bit(), draft.bit());
    let none = Expr::op(Op::Gt, Expr::Word(sum), number(0));
    draft.decode(lamp, vec![vec![none]]);
    draft.set(horn, Expr::All(vec![Expr::Bit(lamp), Expr::NotBit(quiet)]));
}

/// How many of some bits are on, as a sum or counted by conditions. NCT's sums are those of words.
fn add_sum(draft: &mut Draft, sum: usize, first: usize, count: usize) {
    if draft.rng.chance(50) && draft.kernel.language != Language::Nct {
        let add = |sum, bit| Expr::op(Op::Add, sum, Expr::Bit(bit));
        let total = (first + 1..first + count).fold(Expr::Bit(first), add);
        draft.push(Stmt::SetWord(sum, total));
    } else {
        draft.push(put(sum, 0));
        for bit in first..first + count {
            draft.push(Stmt::If(Expr::Bit(bit), vec![count_up(sum)], vec![]));
        }
    }
}
