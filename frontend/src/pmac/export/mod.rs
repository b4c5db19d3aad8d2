//! The PLCs of a download in IEC 61131-3, with what a PMAC does around them (rulings, Time): a call is a servo cycle.
//!
//! A WHILE suspends its PLC to the next scan. So all statements are blocks of one CASE in a loop, and the control's own steps are the
//! first ones among them (`control.rs`).

mod control;
mod expression;
mod refused;
mod words;

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::image::read_f64;
use plcc_abi::pmac::{Kind, PlcOp, PmacName, Range, Variable as Named};
use plcc_abi::{GivenName, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap};
use plcc_iec::{Flow, Item, Names, Project, Step, Type, Variable, literal};

use super::analyse::load::Loaded;
use super::ast::{Download, Op, Stmt, StmtKind, Target};
use super::tasks::{TaskKind, tasks};
use super::{COMMENT_MARKS, tables};
use crate::common::{CommentsInOrder, Exported, Held};
use control::Plc;
use expression::{operand, real};
use words::Words;

/// The download under a name, or the statements that can't be written. `given` says what people say of its variables.
pub(super) fn export(
    download: &Download,
    loaded: &Loaded,
    sources: &SourceMap,
    name: &str,
    given: &[GivenName],
) -> Result<Exported, Vec<Diagnostic>> {
    let refused = refused::all(download, loaded);
    if !refused.is_empty() {
        return Err(refused);
    }
    let mut names = Names::new();
    let writer = Writer::new(download, loaded, sources, &mut names);
    let items = writer.items(sources);
    let flow = Flow::new(&items, writer.entries(), &writer.own.next);
    let body = writer.body(&flow);
    let path = sources.path(FileId(0));
    let project = Project {
        name: names.make(name),
        comments: vec![
            format!("{path}, PLCs of a PMAC, written in IEC 61131-3 by plcc"),
            "Each call of the program is a servo cycle".into(),
        ],
        variables: writer.declarations(given),
        body,
        interval_us: writer.cycle_us(),
    }
    .complete();
    let notes = refused::notes(download);
    Ok(Exported { project, names: writer.pairs(), notes })
}

/// The variables that the program in IEC 61131-3 has besides those of the source.
struct Own {
    next: String,
    result: String,
    /// Servo cycles until the next real-time interrupt.
    until: String,
    /// The PLC that ran last in the background.
    last: String,
    chosen: String,
}

struct Writer<'a> {
    download: &'a Download,
    loaded: &'a Loaded,
    /// The PLCs, then the PLCCs.
    plcs: Vec<Plc<'a>>,
    words: Words,
    /// P-, Q- and I-variables.
    reals: BTreeMap<(char, u16), String>,
    /// What a dump has.
    named: Vec<Named>,
    own: Own,
}

fn letter(kind: Kind) -> char {
    match kind {
        Kind::P => 'P',
        Kind::Q => 'Q',
        Kind::I => 'I',
        Kind::M => 'M',
        Kind::L => 'L',
    }
}

impl<'a> Writer<'a> {
    fn new(
        download: &'a Download,
        loaded: &'a Loaded,
        sources: &SourceMap,
        names: &mut Names,
    ) -> Self {
        let tables = tables::program(download, loaded, vec![], vec![], sources).tables;
        let named = match tables {
            Tables::Pmac(tables) => tables.named,
            _ => vec![],
        };
        let mut used: BTreeSet<(char, u16)> =
            named.iter().map(|it| (letter(it.kind), it.number as u16)).collect();
        let code: Vec<_> = tasks(download, loaded)
            .into_iter()
            .filter(|(kind, _)| matches!(kind, TaskKind::Plc { .. }))
            .collect();
        for stmt in code.iter().flat_map(|(_, code)| code.iter()) {
            if let StmtKind::Assign(target, _) = stmt.kind {
                used.extend(target.named().map(|(kind, number)| (letter(kind), number)));
            }
            for op in stmt.kind.expressions().flat_map(|expr| download.ops(expr)) {
                if let Op::Var(kind, number) = *op {
                    used.insert((letter(kind), number));
                }
            }
        }
        let words = Words::new(download, loaded, &used, names);
        let reals = used.iter().filter(|(kind, _)| matches!(kind, 'P' | 'Q' | 'I'));
        let reals =
            reals.map(|&(kind, number)| ((kind, number), names.make(&format!("{kind}{number}"))));
        let reals = reals.collect();
        let mut first = control::steps(&code);
        let mut plcs = vec![];
        for (kind, code) in code {
            let TaskKind::Plc { compiled, number } = kind else { continue };
            plcs.push(Plc::new(compiled, number, code, first, names));
            // One more item ends the scan.
            first += code.len() + 1;
        }
        let own = Own {
            next: names.make("NEXT_BLOCK"),
            result: names.make("RESULT"),
            until: names.make("UNTIL_INTERRUPT"),
            last: names.make("LAST_PLC"),
            chosen: names.make("CHOSEN_PLC"),
        };
        let plcs = Self::chained(plcs);
        Self { download, loaded, plcs, words, reals, named, own }
    }

    /// What a P-, Q- or I-variable is called.
    fn name(&self, kind: Kind, number: u16) -> &str {
        self.reals.get(&(letter(kind), number)).map_or("0.0", String::as_str)
    }

    fn items(&self, sources: &SourceMap) -> Vec<Item> {
        let mut comments = CommentsInOrder::new(sources, &COMMENT_MARKS);
        let mut items = self.steps_of_control();
        for plc in &self.plcs {
            let mut title = vec![super::ast::program_name(plc.compiled, plc.number)];
            for stmt in plc.code {
                let (span, _) = self.download.origins.place(stmt.at);
                let line = sources.line(span.file, span.start);
                if !title.is_empty() {
                    comments.skip_to(span.file, line);
                }
                let (front, behind) = comments.of_statement(span, line);
                let mut all = std::mem::take(&mut title);
                all.extend(front);
                items.push(Item { comments: all, behind, step: self.step(plc, stmt) });
            }
            items.push(Step::Leave(vec![format!("{} := {};", self.own.next, plc.after)]).into());
        }
        items
    }

    fn entries(&self) -> BTreeSet<usize> {
        let steps = self.plcs.len() + control::OWN_STEPS;
        let mut entries: BTreeSet<usize> = (0..steps).collect();
        for plc in &self.plcs {
            entries.insert(plc.first);
            entries.extend(plc.code.iter().filter_map(|stmt| match stmt.kind {
                StmtKind::EndWhile(head) => Some(plc.first + head as usize),
                _ => None,
            }));
        }
        entries
    }

    fn step(&self, plc: &Plc<'_>, stmt: &Stmt) -> Step {
        let item = |target: u32| plc.first + target as usize;
        match stmt.kind {
            StmtKind::Assign(target, value) => Step::Do(self.assign(target, value)),
            StmtKind::If(condition, target) | StmtKind::While(condition, target) => Step::Branch {
                before: vec![],
                condition: self.value(condition).truth(),
                otherwise: item(target),
            },
            StmtKind::Jump(target) => Step::Jump { to: item(target), ends_body: true },
            StmtKind::EndWhile(head) => Step::Leave(vec![
                format!("{} := {};", plc.resume, item(head) + 1),
                format!("{} := {};", self.own.next, plc.after),
            ]),
            StmtKind::Plc(op, set) => {
                let chosen = self
                    .plcs
                    .iter()
                    .filter(|it| it.compiled == set.compiled && set.bits >> it.number & 1 != 0);
                Step::Do(chosen.flat_map(|plc| apply(plc, op)).collect())
            }
            // The addressed motor is for commands alone; all else is refused.
            _ => Step::Do(vec![]),
        }
    }

    fn assign(&self, target: Target, value: super::ast::Expr) -> Vec<String> {
        let value = self.value(value);
        let targets: Vec<_> = target.named().collect();
        let mut lines = vec![];
        let is_one = targets.len() == 1;
        // The right side of a range is computed once.
        let value = match (is_one, value) {
            (true, value) => value,
            (false, value) => {
                lines.push(format!("{} := {};", self.own.result, value.finite().into_text()));
                expression::Typed::Variable(plcc_iec::Expression::name(&self.own.result))
            }
        };
        for (kind, number) in targets {
            match kind {
                Kind::M | Kind::L => {
                    if let Some(field) = self.words.get(kind, number) {
                        lines.push(field.write(value.clone().number()));
                    }
                }
                _ => {
                    let name = self.name(kind, number);
                    let range = self.range(kind, number);
                    lines.push(format!("{name} := {};", value.clone().finite().into_text()));
                    lines.extend(range.map(|range| converted(name, range)).unwrap_or_default());
                }
            }
        }
        lines
    }

    fn range(&self, kind: Kind, number: u16) -> Option<Range> {
        if kind != Kind::I {
            return None;
        }
        let at = self.loaded.ranges.binary_search_by_key(&u32::from(number), |(of, _)| *of).ok()?;
        self.loaded.ranges.get(at).map(|(_, range)| *range)
    }

    fn initial(&self, kind: char, number: u16) -> f64 {
        let layout = &self.loaded.layout;
        let number = u32::from(number);
        let offset = match kind {
            'P' => layout.p_offset(number),
            'Q' => layout.q_offset(layout.q_base_of(1).wrapping_add(number)),
            _ => layout.i_offset(number),
        };
        read_f64(&self.loaded.image, offset)
    }

    fn declarations(&self, given: &[GivenName]) -> Vec<Variable> {
        let about = |name: &str| {
            let of = given.iter().filter(|it| it.name == name);
            let words = of.flat_map(|it| [it.alias.as_str(), it.text.as_str()]);
            words.filter(|text| !text.is_empty()).collect::<Vec<_>>().join("; ")
        };
        let mut list = vec![];
        for ((kind, number), name) in &self.reals {
            let initial = vec![real(self.initial(*kind, *number)).into_text()];
            let about = about(&format!("{kind}{number}"));
            list.push(Variable { initial, ..Variable::local(name, Type::Lreal, about) });
        }
        self.words.declare(self.loaded, &mut list, about);
        let own = &self.own;
        for plc in &self.plcs {
            plc.declare(self.loaded, &mut list);
        }
        let mut add = |name: &String, ty, about: &str| list.push(Variable::local(name, ty, about));
        add(
            &own.next,
            Type::Dint,
            "the number of the block of statements that is next, 0 at the end of the cycle",
        );
        add(&own.result, Type::Lreal, "a value for several variables");
        add(&own.until, Type::Dint, "servo cycles until the next real-time interrupt");
        add(&own.last, Type::Int, "the PLC that ran last in the background");
        add(&own.chosen, Type::Int, "the PLC that runs in the background now");
        list
    }

    fn pairs(&self) -> Vec<(String, Held)> {
        let pair = |variable: &Named| {
            let key = (letter(variable.kind), variable.number as u16);
            let held = match self.reals.get(&key) {
                Some(name) => Held::Variable(name.clone()),
                None => match &self.words.fields.get(&key)?.held {
                    words::Held::Own(name) => Held::Variable(name.clone()),
                    words::Held::OfWord(_) => return None,
                },
            };
            Some((PmacName::Variable(*variable).to_string(), held))
        };
        let words = self.words.words.iter().map(|((is_y, address), name)| {
            let letter = if *is_y { 'Y' } else { 'X' };
            (format!("{letter}:${address:04X}"), Held::Variable(name.clone()))
        });
        self.named.iter().filter_map(pair).chain(words).collect()
    }
}

/// An I-variable after an assignment takes the value into its range (guide, appendix B).
fn converted(name: &str, range: Range) -> Vec<String> {
    let (low, high, length, mut lines) = match range {
        Range::Integer(low, high) => {
            let rounded = format!("{name} := FLOAT_ROUND({name});");
            (low as f64, high as f64, (high - low + 1) as f64, vec![rounded])
        }
        Range::Real(low, high) => (low, high, high - low, vec![]),
    };
    let text = |value: f64| operand(value).into_text();
    lines.extend([
        format!("IF ({name} < {}) OR ({name} > {}) THEN", text(low), text(high)),
        format!("  {name} := FLOAT_REST({name}, {});", text(length)),
        format!("  IF {name} < {} THEN", text(low)),
        format!("    {name} := {name} + {};", text(length)),
        format!("  ELSIF {name} > {} THEN", text(high)),
        format!("    {name} := {name} - {};", text(length)),
        "  END_IF;".into(),
        "END_IF;".into(),
        format!("{name} := FLOAT_FINITE({name});"),
    ]);
    lines
}

/// ENABLE, DISABLE, PAUSE and RESUME (rulings, Time).
fn apply(plc: &Plc<'_>, op: PlcOp) -> Vec<String> {
    let state = &plc.state;
    let only = |before: i32, then: i32| {
        vec![
            format!("IF {state} = {before} THEN"),
            format!("  {state} := {};", literal(then.into()).into_text()),
            "END_IF;".into(),
        ]
    };
    match op {
        PlcOp::Enable => vec![format!("{state} := 1;"), format!("{} := TRUE;", plc.restart)],
        PlcOp::Disable => vec![format!("{state} := 0;")],
        PlcOp::Pause => only(1, 2),
        PlcOp::Resume => only(2, 1),
    }
}
