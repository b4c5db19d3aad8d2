//! The contacts of a statement: the operands of a condition or of a logical assignment, and the gates between them.
//!
//! The word is that of circuit diagrams, which these languages took the place of. Coverage counts what was seen of each contact.

use plcc_diag::Span;

use super::{Expression, Value};

/// An operand of a condition or of a logical assignment: a bit, or a comparison.
#[derive(Clone, Debug)]
pub struct Contact {
    /// Its text.
    pub name: String,
    /// Where it stands.
    pub span: Span,
    /// Its value.
    pub value: Expression,
}

/// What combines contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gate {
    /// Both.
    And,
    /// At least one.
    Or,
    /// Exactly one.
    Xor,
}

/// A part of the logic of a statement; the operands of a gate stand before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Node {
    Contact(usize),
    Constant(bool),
    Not(usize),
    Gate(Gate, usize, usize),
}

/// The contacts of a statement with the gates between them.
#[derive(Clone, Debug, Default)]
pub struct Logic {
    contacts: Vec<Contact>,
    /// In postfix order; the last one is the result.
    nodes: Vec<Node>,
}

/// What contacts were when a statement was executed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The statement's result.
    pub result: bool,
    /// For each contact its value, and whether it decided: turned alone, it would have changed the result.
    pub contacts: Vec<(bool, bool)>,
}

impl Logic {
    /// The contacts, in the order of the text.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// What the contacts are in an image. `None` where one has no value.
    pub fn see(&self, image: &[u8]) -> Option<Seen> {
        let mut seen = Seen { result: false, contacts: Vec::with_capacity(self.contacts.len()) };
        for contact in &self.contacts {
            seen.contacts.push((contact.value.evaluate(image).ok()?.is_true(), false));
        }
        let mut values: Vec<bool> = Vec::with_capacity(self.nodes.len());
        let value = |values: &[bool], at: usize| values.get(at).copied().unwrap_or(false);
        for node in &self.nodes {
            let result = match *node {
                Node::Contact(at) => seen.contacts.get(at).is_some_and(|(value, _)| *value),
                Node::Constant(constant) => constant,
                Node::Not(at) => !value(&values, at),
                Node::Gate(Gate::And, a, b) => value(&values, a) & value(&values, b),
                Node::Gate(Gate::Or, a, b) => value(&values, a) | value(&values, b),
                Node::Gate(Gate::Xor, a, b) => value(&values, a) ^ value(&values, b),
            };
            values.push(result);
        }
        seen.result = values.last().copied().unwrap_or(false);
        // From the result down to the contacts: what changes the result when it is turned.
        let mut decides = vec![false; self.nodes.len()];
        if let Some(last) = decides.last_mut() {
            *last = true;
        }
        for (at, node) in self.nodes.iter().enumerate().rev() {
            if !decides.get(at).copied().unwrap_or(false) {
                continue;
            }
            let mut mark = |at: usize, passes: bool| {
                if let Some(decides) = decides.get_mut(at) {
                    *decides = passes;
                }
            };
            match *node {
                Node::Contact(at) => {
                    if let Some((_, decided)) = seen.contacts.get_mut(at) {
                        *decided = true;
                    }
                }
                Node::Constant(_) => {}
                Node::Not(of) => mark(of, true),
                Node::Gate(Gate::Xor, a, b) => {
                    mark(a, true);
                    mark(b, true);
                }
                Node::Gate(gate, a, b) => {
                    let open = gate == Gate::And;
                    mark(a, value(&values, b) == open);
                    mark(b, value(&values, a) == open);
                }
            }
        }
        Some(seen)
    }
}

/// Puts the logic of a statement together, operands before their gates.
#[derive(Debug, Default)]
pub(crate) struct LogicBuilder {
    logic: Logic,
    /// The nodes that wait for a gate.
    waiting: Vec<usize>,
}

impl LogicBuilder {
    fn push(&mut self, node: Node) {
        self.logic.nodes.push(node);
        self.waiting.push(self.logic.nodes.len() - 1);
    }

    /// A contact. What reads no variable is a constant and no contact.
    pub(crate) fn contact(&mut self, name: &str, span: Span, value: Expression) {
        if value.variables().is_empty() {
            let is_true = value.evaluate_without_image().is_some_and(Value::is_true);
            return self.push(Node::Constant(is_true));
        }
        self.varying_contact(name, span, value);
    }

    /// A contact that is not a constant, although it may name no variable: NCT's relations compare OP.
    pub(crate) fn varying_contact(&mut self, name: &str, span: Span, value: Expression) {
        let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
        self.logic.contacts.push(Contact { name, span, value });
        self.push(Node::Contact(self.logic.contacts.len() - 1));
    }

    /// Turns what was put last.
    pub(crate) fn not(&mut self) {
        if let Some(of) = self.waiting.pop() {
            self.push(Node::Not(of));
        }
    }

    /// Combines the last two.
    pub(crate) fn gate(&mut self, gate: Gate) {
        if let (Some(b), Some(a)) = (self.waiting.pop(), self.waiting.pop()) {
            self.push(Node::Gate(gate, a, b));
        }
    }

    /// The logic; `None` where there is no contact.
    pub(crate) fn finish(self) -> Option<Logic> {
        (!self.logic.contacts.is_empty() && self.waiting.len() == 1).then_some(self.logic)
    }
}

#[cfg(test)]
mod tests {
    use plcc_diag::FileId;

    use super::super::{Evaluate, EvaluationError};
    use super::*;

    /// The value of a byte.
    #[derive(Debug)]
    struct Byte(usize);

    impl Evaluate for Byte {
        fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError> {
            Ok(Value::Logical(image[self.0] != 0))
        }
    }

    fn contact(builder: &mut LogicBuilder, at: usize) {
        let name = format!("B{at}");
        let value = Expression::new(&name, vec![name.clone()], 4, Byte(at));
        builder.contact(&name, Span::new(FileId(0), at, at + 1), value);
    }

    /// What turning each contact alone does, by trying.
    fn tried(logic: &Logic, image: [u8; 4]) -> Vec<(bool, bool)> {
        let result = logic.see(&image).unwrap().result;
        let turned = |at: usize| {
            let mut other = image;
            other[at] ^= 1;
            (image[at] != 0, logic.see(&other).unwrap().result != result)
        };
        (0..logic.contacts().len()).map(turned).collect()
    }

    #[test]
    fn a_contact_decides_if_turning_it_changes_the_result() {
        let gates = [Gate::And, Gate::Or, Gate::Xor];
        for number in 0..27 {
            let gate = |place: u32| gates[number / 3usize.pow(place) % 3];
            let mut builder = LogicBuilder::default();
            // (B0 g NOT B1) g (B2 g B3)
            contact(&mut builder, 0);
            contact(&mut builder, 1);
            builder.not();
            builder.gate(gate(0));
            contact(&mut builder, 2);
            contact(&mut builder, 3);
            builder.gate(gate(1));
            builder.gate(gate(2));
            let logic = builder.finish().unwrap();
            for bits in 0..16u8 {
                let image = [bits & 1, bits >> 1 & 1, bits >> 2 & 1, bits >> 3];
                assert_eq!(
                    logic.see(&image).unwrap().contacts,
                    tried(&logic, image),
                    "{number} {bits}"
                );
            }
        }
    }
}
