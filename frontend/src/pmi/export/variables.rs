//! The variables of the source in IEC 61131-3: LOGICAL is BOOL, INTEGER is INT, LONG is DINT. Single lines of ports are variables
//! with an address, `%IX1.0` for port 1, bit 0; groups of lines are computed from those and put on them.

use std::collections::BTreeMap;

use plcc_abi::GivenName;
use plcc_abi::pmi::{Format, Lines, Type as PmiType};
use plcc_iec::{Kind, Names, Type, Variable, literal};

use crate::pmi::ast::{Checked, Item, Meaning, Symbol, SymbolId};

/// Executive variables that survive power-off (PMI 3.4).
const RETAINED: [&str; 3] = ["@NVFLG", "@NVINT", "@NVLNG"];

/// Executive variables that the control changes around a scan.
const OF_THE_SCAN: [&str; 3] = ["@IPL", "@ESTOP", "@CRSET"];

/// The type of a variable.
pub(super) fn type_of(ty: PmiType) -> Type {
    match ty {
        PmiType::Logical => Type::Bool,
        PmiType::Integer => Type::Int,
        PmiType::Long => Type::Dint,
    }
}

/// The declarations, and what each symbol is called.
pub(super) struct Variables<'a> {
    pub(super) checked: &'a Checked,
    pub(super) list: Vec<Variable>,
    /// What each variable of the source is called, other than constants.
    pub(super) pairs: Vec<(String, String)>,
    /// By the numbers of the symbols; empty for those that the program does not have.
    names: Vec<String>,
    /// The variable with the value of each line of an input port.
    pub(super) input_lines: BTreeMap<(u16, u8), String>,
    /// The same for lines of outputs.
    pub(super) output_lines: BTreeMap<(u16, u8), String>,
}

impl<'a> Variables<'a> {
    pub(super) fn new(checked: &'a Checked, given: &[GivenName], names: &mut Names) -> Self {
        let mut this = Self {
            checked,
            list: vec![],
            pairs: vec![],
            names: vec![String::new(); checked.symbols.len()],
            input_lines: BTreeMap::new(),
            output_lines: BTreeMap::new(),
        };
        let said: BTreeMap<&str, &str> =
            given.iter().rev().map(|given| (given.name.as_str(), given.text.as_str())).collect();
        let is_declared = |symbol: &Symbol| {
            symbol.named && !matches!(symbol.meaning, Meaning::Label(_) | Meaning::Unknown)
        };
        // The program's own variables keep their names, where one of the control would have the same without its @.
        for executive in [false, true] {
            for (index, symbol) in checked.symbols.iter().enumerate() {
                if is_declared(symbol) && symbol.executive == executive {
                    let name = names.make(&symbol.name);
                    this.declare(symbol, &name, said.get(symbol.name.as_str()).copied());
                    // The control has no variables for constants.
                    if !matches!(symbol.meaning, Meaning::Constant(_)) {
                        this.pairs.push((symbol.name.clone(), name.clone()));
                    }
                    if let Some(slot) = this.names.get_mut(index) {
                        *slot = name;
                    }
                }
            }
        }
        for symbol in checked.symbols.iter().filter(|it| is_declared(it)) {
            if let Meaning::Input(lines) | Meaning::Output(lines) = symbol.meaning {
                let is_input = matches!(symbol.meaning, Meaning::Input(_));
                this.declare_lines(&symbol.name, lines, is_input, names);
            }
        }
        this
    }

    /// What a symbol is called.
    pub(super) fn name(&self, id: SymbolId) -> &str {
        self.names.get(id.0 as usize).map_or("", String::as_str)
    }

    /// What a variable of the control is called, if the program has it.
    pub(super) fn of_the_control(&self, name: &str) -> Option<&str> {
        let at = self.checked.symbols.iter().position(|symbol| symbol.name == name)?;
        self.names.get(at).map(String::as_str).filter(|name| !name.is_empty())
    }

    /// Whether the program names a variable of the control.
    pub(super) fn has(&self, name: &str) -> bool {
        self.of_the_control(name).is_some()
    }

    /// Whether something in the program is of the first scan alone.
    pub(super) fn needs_first_scan(&self) -> bool {
        self.has("@IPL") || !self.tables().is_empty()
    }

    pub(super) fn add(&mut self, variable: Variable) {
        self.list.push(variable);
    }

    fn declare(&mut self, symbol: &Symbol, name: &str, said: Option<&str>) {
        let kind = match &symbol.meaning {
            Meaning::Constant(_) if symbol.elements.is_none() => Kind::Constant,
            Meaning::ReadOnly if !OF_THE_SCAN.contains(&symbol.name.as_str()) => Kind::Input,
            _ if RETAINED.contains(&symbol.name.as_str()) => Kind::Retained,
            _ => Kind::Local,
        };
        let initial = match &symbol.meaning {
            // Compilers may take no first values for an array, and do not tell; see `tables`.
            Meaning::Constant(values) if symbol.elements.is_none() => {
                values.iter().map(|&it| self.value(symbol, it)).collect()
            }
            _ => vec![],
        };
        let mut address = None;
        if let Meaning::Input(lines) | Meaning::Output(lines) = symbol.meaning
            && lines.format == Format::Bit
        {
            let is_input = matches!(symbol.meaning, Meaning::Input(_));
            let taken = if is_input { &mut self.input_lines } else { &mut self.output_lines };
            if let std::collections::btree_map::Entry::Vacant(slot) =
                taken.entry((lines.port, lines.low))
            {
                slot.insert(name.to_owned());
                address = Some(place(is_input, lines.port, lines.low));
            }
        }
        self.add(Variable {
            kind,
            initial,
            address,
            elements: symbol.elements,
            ..Variable::local(name, type_of(symbol.ty), self.about(symbol, name, said))
        });
    }

    /// The constant arrays, as assignments to their elements. Those that are 0 are so from the beginning.
    pub(super) fn tables(&self) -> Vec<String> {
        let mut lines = vec![];
        for (symbol, name) in self.checked.symbols.iter().zip(&self.names) {
            let Meaning::Constant(values) = &symbol.meaning else { continue };
            if name.is_empty() || symbol.elements.is_none() {
                continue;
            }
            let set = (0..).zip(values).filter(|(_, value)| **value != 0);
            lines.extend(
                set.map(|(at, &it)| format!("{name}[{at}] := {};", self.value(symbol, it))),
            );
        }
        lines
    }

    fn value(&self, symbol: &Symbol, value: i32) -> String {
        match symbol.ty {
            PmiType::Logical => (if value != 0 { "TRUE" } else { "FALSE" }).to_owned(),
            PmiType::Integer | PmiType::Long => literal(value.into()).into_text(),
        }
    }

    /// What is said of a variable: its old name where it has another one now, its text, its comment.
    fn about(&self, symbol: &Symbol, name: &str, said: Option<&str>) -> String {
        let mut parts = vec![];
        if symbol.name != name {
            parts.push(symbol.name.clone());
        }
        let of_this = |it: &&crate::pmi::ast::Announcement| {
            self.checked.symbol(it.symbol).is_some_and(|other| other.name == symbol.name)
        };
        for (word, list) in [("fault", &self.checked.faults), ("message", &self.checked.messages)] {
            if let Some(announcement) = list.iter().find(of_this) {
                // Between words and a value stands a blank.
                let mut text = String::new();
                for item in &announcement.items {
                    match item {
                        Item::Text(words) => text.push_str(words),
                        Item::Value(id) => {
                            let name = self.checked.symbol(*id).map_or("", |it| it.name.as_str());
                            let blank =
                                if text.is_empty() || text.ends_with(' ') { "" } else { " " };
                            text.push_str(&format!("{blank}<{name}>"));
                        }
                    }
                }
                parts.push(format!("{word} \"{text}\""));
            }
        }
        if let Some((_, text)) = self.checked.keys.iter().find(|(key, _)| *key == symbol.name) {
            parts.push(format!("key \"{text}\""));
        }
        parts.extend(said.filter(|text| !text.is_empty()).map(str::to_owned));
        parts.join("; ")
    }

    /// Gives each line of a group a variable, where it has none.
    fn declare_lines(&mut self, group: &str, lines: Lines, is_input: bool, names: &mut Names) {
        if lines.format == Format::Bit {
            return;
        }
        for bit in lines.low..(lines.low + lines.count).min(8) {
            let taken = if is_input { &mut self.input_lines } else { &mut self.output_lines };
            if taken.contains_key(&(lines.port, bit)) {
                continue;
            }
            let address = place(is_input, lines.port, bit);
            let name = names.make(address.trim_start_matches('%'));
            taken.insert((lines.port, bit), name.clone());
            let about = format!("a line of {group}");
            let variable = Variable::local(name, Type::Bool, about);
            self.add(Variable { address: Some(address), ..variable });
        }
    }
}

/// The address of a line.
fn place(is_input: bool, port: u16, bit: u8) -> String {
    format!("%{}X{port}.{bit}", if is_input { 'I' } else { 'Q' })
}
