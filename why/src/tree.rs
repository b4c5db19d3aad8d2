//! Builds the answer: from a variable to what holds it, and from there on, each variable once, the nearest ones first.

use std::collections::HashSet;
use std::rc::Rc;

use plcc_frontend::common::Value;
use plcc_replay::DebugError;

use crate::changes::Origin;
use crate::explanation::{Announcing, Cause, Explanation, ForPeople, Number, Said, Wish};
use crate::inquiry::{Inquiry, Moment};
use crate::reasons::Reasons;
use crate::variable::Variable;

/// How many variables an answer has at most.
const MOST_NODES: usize = 1000;

/// What is asked for.
pub(crate) struct Root {
    pub(crate) variable: Rc<Variable>,
    pub(crate) value: f64,
    pub(crate) at: Moment,
    pub(crate) reasons: Reasons,
    /// Since when it has its value, where that is known already: the variable stands for a statement that puts out a text.
    pub(crate) origin: Option<Origin>,
}

/// A variable of the answer.
struct Node {
    variable: Rc<Variable>,
    value: f64,
    at: Moment,
    reasons: Reasons,
    /// The indices of what holds it.
    because: Vec<usize>,
}

impl Inquiry<'_> {
    /// The answer for a variable at a moment.
    pub(crate) fn tree(
        mut self,
        variable: &Rc<Variable>,
        at: Moment,
        would: bool,
    ) -> Result<Explanation, DebugError> {
        let value = self.value_at(variable, at)?;
        let reasons = self.reasons(variable, value, at)?;
        let is_stopped = self.trace(at.tick)?.stop.is_some();
        let is_tried = would && variable.is_logical && !is_stopped;
        let root = Root { variable: Rc::clone(variable), value, at, reasons, origin: None };
        let would = if is_tried { Some(self.would(variable, value, at)?) } else { None };
        self.answer(root, would)
    }

    /// The answer for what is asked for; `would` are the sets of inputs that would switch it, where they were looked for.
    pub(crate) fn answer(
        mut self,
        root: Root,
        would: Option<Vec<Vec<Wish>>>,
    ) -> Result<Explanation, DebugError> {
        let Root { variable, value: _, at, reasons: _, origin } = &root;
        let (variable, at, given) = (Rc::clone(variable), *at, origin.clone());
        let is_of_text = given.is_some();
        let nodes = self.nodes(root)?;
        let asked: Vec<_> =
            nodes.iter().map(|node| (Rc::clone(&node.variable), node.value, node.at)).collect();
        let mut origins = self.origins(&asked)?;
        if let (Some(first), Some(given)) = (origins.first_mut(), given) {
            *first = given;
        }
        let idle = nodes.first().map(|node| node.reasons.idle.clone()).unwrap_or_default();
        let tasks = &self.program.tables().tasks;
        let mut idle: Vec<String> =
            idle.into_iter().filter_map(|task| Some(tasks.get(task)?.name.clone())).collect();
        idle.dedup();
        let mut causes: Vec<Option<Cause>> = vec![];
        causes.resize_with(nodes.len(), || None);
        // What holds a variable stands behind it.
        for (index, (node, origin)) in nodes.iter().zip(&origins).enumerate().rev() {
            let because = node.because.iter().filter_map(|&at| causes.get_mut(at)?.take());
            let because = because.collect();
            let cause = self.cause(node, origin, because)?;
            if let Some(slot) = causes.get_mut(index) {
                *slot = Some(cause);
            }
        }
        let root = causes.into_iter().next().flatten();
        let root = root.ok_or_else(|| DebugError::new("there is nothing to explain"))?;
        let is_logical = variable.is_logical;
        let tick_ns = self.tick_ns;
        let announced = self.checked().announcements().into_iter();
        let mut announces = announced.filter(|one| one.name == variable.name).map(|one| {
            let what = if one.is_fault { Announcing::Fault } else { Announcing::Message };
            (what, one.text)
        });
        let announces = announces.next_back();
        let trace = self.trace(at.tick)?;
        let stopped = trace.stop.as_ref().map(|stop| stop.code.clone());
        let was_tried = would.is_some();
        Ok(Explanation {
            name: root.name,
            said: root.said,
            value: root.value,
            tick: at.tick,
            since: root.since,
            file: root.file,
            line: root.line,
            because: root.because,
            changed_by: root.changed_by,
            would: would.unwrap_or_default(),
            for_people: ForPeople {
                statement: root.statement,
                remark: root.remark,
                is_logical,
                was_tried,
                is_of_text,
                idle,
                tick_ns,
                announces,
                is_of_present: false,
                stopped,
            },
        })
    }

    /// The value of a variable at a moment.
    fn value_at(&mut self, variable: &Variable, at: Moment) -> Result<f64, DebugError> {
        let trace = self.trace(at.tick)?;
        if at.step < trace.steps.len()
            && let Some(value) = variable.value_in(&trace.image(at.step))
        {
            return Ok(value.number());
        }
        self.go_behind(at.tick)?;
        let image = self.history.executive().image().to_vec();
        let value =
            self.number_now(variable).or_else(|| variable.value_in(&image).map(Value::number));
        value.ok_or_else(|| DebugError(format!("`{}` has no value of its own", variable.name)))
    }

    /// The variables of the answer; the first one is that which is asked for.
    fn nodes(&mut self, root: Root) -> Result<Vec<Node>, DebugError> {
        let node = |variable, value, at| Node {
            variable,
            value,
            at,
            reasons: Reasons::default(),
            because: vec![],
        };
        let Root { variable, value, at, reasons, origin: _ } = root;
        let mut seen = HashSet::from([variable.name.clone()]);
        let mut nodes = vec![node(variable, value, at)];
        let mut known = Some(reasons);
        let mut next = 0;
        while let Some((variable, value, at)) =
            nodes.get(next).map(|node| (Rc::clone(&node.variable), node.value, node.at))
        {
            let reasons = match known.take() {
                Some(reasons) => reasons,
                None => self.reasons(&variable, value, at)?,
            };
            let mut because = vec![];
            for operand in &reasons.operands {
                let Some(variable) = &operand.variable else { continue };
                if nodes.len() < MOST_NODES && seen.insert(variable.name.clone()) {
                    because.push(nodes.len());
                    nodes.push(node(Rc::clone(variable), operand.value.number(), operand.at));
                }
            }
            if let Some(node) = nodes.get_mut(next) {
                (node.reasons, node.because) = (reasons, because);
            }
            next += 1;
        }
        Ok(nodes)
    }

    /// What people say of a variable.
    fn said(&self, name: &str) -> Said {
        self.program.given().said_of(name).map_or_else(Said::default, |said| Said::from(&*said))
    }

    /// A variable of the answer, with what holds it.
    fn cause(
        &mut self,
        node: &Node,
        origin: &Origin,
        because: Vec<Cause>,
    ) -> Result<Cause, DebugError> {
        let written = node.reasons.written.map(|(_, statement)| statement).or(origin.statement);
        let place = written.and_then(|statement| self.place(statement));
        let path = |file| self.program.sources().path(file).to_owned();
        let image = self.image(node.at)?;
        Ok(Cause {
            said: self.said(&node.variable.name),
            name: node.variable.name.clone(),
            value: Number(node.value),
            since: origin.since,
            file: place.map(|place| path(place.file)),
            line: place.map(|place| place.line),
            because,
            changed_by: origin.changed_by.clone(),
            statement: written.map(|statement| self.excerpt(statement)).unwrap_or_default(),
            remark: self.remark(&node.variable, node.value, &image),
        })
    }
}
