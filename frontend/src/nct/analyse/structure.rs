//! Checks what holds between statements: conditions with their `E` and `Z`, labels, modules (NCT 3,
//! 4.2, 4.11).

use std::collections::BTreeSet;

use plcc_diag::{Diagnostic, FileId, MessageText, Span};

use super::indentation::left_conditions;
use crate::nct::{
    ast::{Op, Opens, Stmt},
    read::{
        cursor::{is_blank, last_place},
        diagnostic::error,
    },
};

/// How deep conditions may nest.
const MAX_NESTING: usize = 256;

/// A condition whose `Z` has not come yet.
struct Open {
    /// The index of its statement.
    stmt: usize,
    /// The index of its `E`, if that has come.
    otherwise: Option<usize>,
    /// The indices of the statements J0, J1 and J2 inside it, but not of those in conditions inside
    /// it.
    ends: Vec<usize>,
}

/// Checks the statements of one program.
struct Checker<'a> {
    text: &'a str,
    stmts: &'a mut [Stmt],
    /// The errors and warnings so far.
    found: &'a mut Vec<Diagnostic>,
    /// The index of each label's statement.
    labels: Vec<Option<u32>>,
    /// The last character of the text that is not blank.
    last: Span,
    /// The last line of the text that is not blank.
    last_line: Span,
    unread: Unread,
}

/// The labels, and the J0, J1 and J2, that are inside statements that could not be read, such as
/// a wrong parenthesis. They are not reported as missing.
#[derive(Default)]
struct Unread {
    labels: BTreeSet<u16>,
    /// The digits of `J0`, `J1` and `J2`.
    ends: BTreeSet<u8>,
}

impl Unread {
    fn of(text: &str, stmts: &[Stmt]) -> Self {
        let mut unread = Self::default();
        for stmt in stmts.iter().filter(|stmt| matches!(stmt.op, Op::Bad { .. })) {
            let written = text.get(stmt.span.range()).unwrap_or("").chars();
            let mut rest = written.filter(|c| !is_blank(*c));
            while let Some(c) = rest.next() {
                let mut ahead = rest.clone();
                let mut digit = || ahead.next().and_then(|c| c.to_digit(10));
                match c {
                    ':' => {
                        if let (Some(a), Some(b), Some(c)) = (digit(), digit(), digit()) {
                            unread.labels.insert((a * 100 + b * 10 + c) as u16);
                        }
                    }
                    'J' => unread.ends.extend(digit().map(|digit| digit as u8)),
                    _ => {}
                }
            }
        }
        unread
    }
}

/// Checks the statements, and sets in conditions and `E` where they lead. Returns for each of the
/// labels 0 to 200 the index of its statement.
pub(crate) fn check(
    file: FileId,
    text: &str,
    stmts: &mut [Stmt],
    found: &mut Vec<Diagnostic>,
) -> Vec<Option<u32>> {
    let last = last_place(file, text);
    let line = text.get(..last.end as usize).unwrap_or("");
    let line = line.get(line.rfind(['\r', '\n']).map_or(0, |at| at + 1)..).unwrap_or("");
    let first = last.end as usize - line.trim_start_matches(is_blank).len();
    let last_line = Span::new(file, first, last.end as usize);
    let labels = vec![None; 201];
    let unread = Unread::of(text, stmts);
    let mut checker = Checker { text, stmts, found, labels, last, last_line, unread };
    checker.nest();
    checker.find_labels();
    checker.targets();
    checker.modules();
    checker.returns();
    checker.labels
}

impl Checker<'_> {
    fn error(
        &mut self,
        number: u8,
        span: Span,
        message: impl Into<MessageText>,
        help: impl Into<MessageText>,
    ) {
        self.found.push(*error(number, span, message, help));
    }

    fn span(&self, at: usize) -> Span {
        self.stmts.get(at).map_or(self.last, |s| s.span)
    }

    /// Matches each condition with its `E` and `Z`.
    fn nest(&mut self) {
        let mut open: Vec<Open> = vec![];
        // How many statements that could not be read may have been conditions, so that their `E`
        // and `Z` are not errors.
        let mut perhaps_open = 0_usize;
        let mut too_deep = false;
        for at in 0..self.stmts.len() {
            let Some(&Stmt { op, span }) = self.stmts.get(at) else { break };
            match op {
                Op::If { .. } | Op::Bad { opens: Opens::Yes } => {
                    if open.len() >= MAX_NESTING && !too_deep {
                        too_deep = true;
                        let message = format!("conditions are nested more than {MAX_NESTING} deep");
                        let fail = Diagnostic::error("NCT-X1", span, message);
                        self.found.push(fail.help("put the inner ones into a subroutine"));
                    }
                    open.push(Open { stmt: at, otherwise: None, ends: vec![] });
                }
                Op::Bad { opens: Opens::Perhaps } => perhaps_open += 1,
                Op::Else { .. } => match open.last_mut() {
                    Some(top) if top.otherwise.is_none() => {
                        top.otherwise = Some(at);
                        let condition = top.stmt;
                        if let Some(Op::If { otherwise, .. }) = self.op(condition) {
                            *otherwise = at as u32;
                        }
                    }
                    Some(_) => {
                        let help = "a condition has one E at most; a Z may be missing before it";
                        self.error(73, span, "a second E of the same condition", help);
                    }
                    None if perhaps_open > 0 => {}
                    None => {
                        let help = "E separates the two parts of a condition";
                        self.error(73, span, "there is no condition that this E belongs to", help);
                    }
                },
                Op::EndIf => match open.pop() {
                    Some(top) => self.close(&top, at),
                    None if perhaps_open > 0 => perhaps_open -= 1,
                    None => {
                        let help = "remove it, or look for the condition that is missing";
                        self.error(2, span, "there is no condition that this Z ends", help);
                    }
                },
                Op::End(_) => {
                    // It is reported when the innermost condition around it is closed.
                    if let Some(top) = open.last_mut() {
                        top.ends.push(at);
                    }
                }
                _ => {}
            }
        }
        let left = match open.is_empty() {
            true => vec![],
            false => left_conditions(self.text, self.stmts),
        };
        for top in open {
            match top.otherwise {
                Some(at) => {
                    let help = "write Z where the part that begins with E ends";
                    self.error(73, self.span(at), "the Z of this E is missing", help);
                }
                // A statement that could not be read has its error already.
                None if matches!(self.op(top.stmt), Some(Op::Bad { .. })) => {}
                None if perhaps_open > 0 => perhaps_open -= 1,
                None => {
                    let help = "write Z where the part that depends on it ends";
                    let span = self.span(top.stmt);
                    let fail = *error(17, span, "nothing ends this condition", help);
                    let place = left.iter().find(|left| left.condition == top.stmt);
                    self.found.push(match place.map(|left| self.span(left.statement)) {
                        Some(at) => fail.label(at, "a Z may be lost before this"),
                        None => fail,
                    });
                }
            }
        }
    }

    fn op(&mut self, at: usize) -> Option<&mut Op> {
        self.stmts.get_mut(at).map(|s| &mut s.op)
    }

    /// Closes a condition at its `Z`, the statement with the index `at`.
    fn close(&mut self, top: &Open, at: usize) {
        match top.otherwise {
            Some(other) => {
                if let Some(Op::Else { end }) = self.op(other) {
                    *end = at as u32;
                }
            }
            None => {
                if let Some(Op::If { otherwise, .. }) = self.op(top.stmt) {
                    *otherwise = at as u32;
                }
            }
        }
        for &end in &top.ends {
            let condition = self.span(top.stmt);
            let fail = error(
                75,
                self.span(end),
                "a module can't end inside a condition",
                "jump to a label before the J, as in G196 and :196 J0",
            );
            self.found.push(fail.label(condition, "inside this condition"));
        }
    }

    /// Whether a statement is a label or was meant to be one.
    fn is_label(&self, stmt: &Stmt) -> bool {
        let begins = || self.text.get(stmt.span.start as usize..).unwrap_or("").starts_with(':');
        matches!(stmt.op, Op::Label(_)) || (matches!(stmt.op, Op::Bad { .. }) && begins())
    }

    /// Finds the labels. Reports those that are there twice, and statements before the first one.
    fn find_labels(&mut self) {
        match self.stmts.iter().position(|s| self.is_label(s)) {
            None => {
                let help = "begin a module: :001 for the 20 ms module, :000 for the slow one";
                self.error(8, self.last_line, "the program has no module", help);
            }
            Some(first) => {
                let mut before = self.stmts.iter().take(first);
                if let Some(stmt) = before.find(|s| !matches!(s.op, Op::Bad { .. })) {
                    let span = stmt.span;
                    let help = "begin a module: :001 for the 20 ms module, :000 for the slow one";
                    self.error(8, span, "this statement belongs to no module", help);
                }
            }
        }
        for at in 0..self.stmts.len() {
            let Some(&Stmt { op, span }) = self.stmts.get(at) else { break };
            let Op::Label(label) = op else { continue };
            match self.labels.get_mut(label as usize) {
                Some(slot @ None) => *slot = Some(at as u32),
                Some(Some(first)) => {
                    let first = *first as usize;
                    let fail = error(
                        54,
                        span,
                        format!(":{label:03} is here twice"),
                        "give one of them another number",
                    );
                    let before = self.span(first);
                    self.found.push(fail.label(before, "it is here first"));
                }
                None => {}
            }
            if label >= 197 {
                self.before_text(at, label);
            }
        }
    }

    /// Reports a text module that the program could run into.
    fn before_text(&mut self, at: usize, label: u16) {
        let Some(before) = at.checked_sub(1).and_then(|before| self.stmts.get(before)) else {
            return;
        };
        if matches!(before.op, Op::Goto(_) | Op::Return | Op::End(_) | Op::Text | Op::Bad { .. }) {
            return;
        }
        let message = format!("the program could run into the texts of :{label}");
        let help = "put Gnnn, R, J0, J1, J2 or the `$` of other texts in front of them";
        self.error(74, self.span(at), message, help);
    }

    /// Whether a label is in the program.
    fn has(&self, label: u16) -> bool {
        self.labels.get(label as usize).is_some_and(Option::is_some)
    }

    /// Whether a label is in the program, or inside a statement that could not be read.
    fn is_written(&self, label: u16) -> bool {
        self.has(label) || self.unread.labels.contains(&label)
    }

    /// Reports jumps and calls to labels that do not exist.
    fn targets(&mut self) {
        for at in 0..self.stmts.len() {
            let Some(&Stmt { op, span }) = self.stmts.get(at) else { break };
            if let Op::Goto(label) | Op::Call(label) = op
                && !self.is_written(label)
            {
                let message = format!("there is no label :{label:03}");
                let near = self.nearest(label);
                let help = match near {
                    Some(other) => format!("did you mean :{other:03}?"),
                    None => format!("write :{label:03} where the program is to go on"),
                };
                let mut problem = *error(53, span, message, help);
                if let Some(near) = near {
                    let letter = if matches!(op, Op::Goto(_)) { 'G' } else { 'C' };
                    problem = problem.replace(format!("{letter}{near:03}"));
                }
                self.found.push(problem);
            }
        }
    }

    /// The label with the nearest number, if it differs from `label` in one digit only.
    fn nearest(&self, label: u16) -> Option<u16> {
        let digits = |n: u16| [n / 100, n / 10 % 10, n % 10];
        let wanted = digits(label);
        (3..=196).filter(|other| self.has(*other)).min_by_key(|other| other.abs_diff(label)).filter(
            |other| digits(*other).iter().zip(wanted).filter(|(a, b)| **a != *b).count() == 1,
        )
    }

    /// Reports modules that are missing or do not end.
    fn modules(&mut self) {
        let any = self.labels.iter().any(Option::is_some);
        if !any {
            return;
        }
        for (label, number) in [(0, 5), (1, 6)] {
            if !self.is_written(label) {
                let message = format!("there is no module :{label:03}");
                let help =
                    format!("write :{label:03} and J{label}, with nothing between if need be");
                self.error(number, self.last, message, help);
            }
        }
        for module in 0..3_u8 {
            let ends = self.stmts.iter().any(|s| s.op == Op::End(module));
            if ends || !self.has(module.into()) || self.unread.ends.contains(&module) {
                continue;
            }
            let message = format!("there is no J{module}");
            let help = format!("write J{module} where module :{module:03} ends");
            if module < 2 {
                self.error(61, self.last, message, help);
            } else {
                let at = self.labels.get(2).copied().flatten().unwrap_or(0);
                let span = self.span(at as usize);
                self.found.push(Diagnostic::warning("NCT-W3", span, message).help(help));
            }
        }
    }

    /// Reports each R between a module's label and its J.
    fn returns(&mut self) {
        // The texts are constants, since there may be half a million such R.
        let texts = [
            ("R is in module :000, before its J0", "outside a call this R ends module :000"),
            ("R is in module :001, before its J1", "outside a call this R ends module :001"),
            ("R is in module :002, before its J2", "outside a call this R ends module :002"),
        ];
        let helps = [
            "jump to a label before J0 instead",
            "jump to a label before J1 instead",
            "jump to a label before J2 instead",
        ];
        for ((module, (in_module, ends_module)), help_end) in (0_u8..).zip(texts).zip(helps) {
            let Some(from) = self.labels.get(module as usize).copied().flatten() else { continue };
            let from = from as usize;
            let rest = self.stmts.get(from..).unwrap_or_default();
            let Some(len) = rest.iter().position(|s| s.op == Op::End(module)) else { continue };
            let mut depth = 0_usize;
            for at in from..from + len {
                match self.stmts.get(at).map(|s| s.op) {
                    Some(Op::If { .. } | Op::Bad { opens: Opens::Yes }) => depth += 1,
                    Some(Op::EndIf) => depth = depth.saturating_sub(1),
                    Some(Op::Return) if depth == 0 => {
                        let help = "R ends subroutines; put them after the module's J";
                        self.error(71, self.span(at), in_module, help);
                    }
                    Some(Op::Return) => {
                        let warning = Diagnostic::warning("NCT-W2", self.span(at), ends_module);
                        self.found.push(warning.help(help_end));
                    }
                    _ => {}
                }
            }
        }
    }
}
