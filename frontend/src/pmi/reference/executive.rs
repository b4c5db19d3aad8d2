//! The executive variables (PMI 3.2.2, 3.3.6, 3.3.7 and 3.4): the table `executive.tsv` beside this
//! file, what a machine file adds to it, and what `plcc explain` says of a variable.

use std::{borrow::Cow, collections::HashMap, sync::OnceLock};

use plcc_abi::pmi::Type;

use crate::common::{
    Machine, VariableClass, VariableType,
    tsv::{self, Row, TsvError},
};
use crate::language::Topic;

/// The table. A row is one variable, or a family of variables that differ in a number
/// (`@CP100-@CP115`). The elements are 0 if it is not an array.
static TABLE: &str = include_str!("executive.tsv");

/// Its columns.
const COLUMNS: &[&str] = &["name", "type", "class", "elements", "section", "meaning"];

/// A row of the table: a family of variables, or a single one.
#[derive(Clone, Debug)]
pub(crate) struct Family {
    /// First (or only) name.
    pub(crate) first: &'static str,
    /// Last name, the same as `first` for a single variable.
    pub(crate) last: &'static str,
    /// The variables' type.
    pub(crate) ty: Type,
    /// What a program may do with them.
    pub(crate) class: VariableClass,
    /// How many elements each variable has, 0 if it is not an array.
    pub(crate) elements: u32,
    /// The manual's section; `example` for names that only its examples have.
    pub(crate) section: &'static str,
    /// One line of meaning.
    pub(crate) meaning: &'static str,
}

/// An executive variable of a particular machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Variable {
    /// Its name, with the `@`.
    pub(crate) name: String,
    /// Its type.
    pub(crate) ty: Type,
    /// What a program may do with it.
    pub(crate) class: VariableClass,
    /// How many elements it has, `None` if it is not an array.
    pub(crate) elements: Option<u32>,
}

/// Every row of the table, in order.
pub(crate) fn families() -> &'static [Family] {
    static FAMILIES: OnceLock<Vec<Family>> = OnceLock::new();
    FAMILIES.get_or_init(|| tsv::built_in(load(TABLE)))
}

fn load(table: &'static str) -> Result<Vec<Family>, TsvError> {
    tsv::load("frontend/src/pmi/reference/executive.tsv", table, COLUMNS, str::cmp, family)
}

fn family(row: &Row<'static>) -> Result<Family, TsvError> {
    let names = row.text("name")?;
    let (first, last) = names.split_once('-').unwrap_or((names, names));
    let types = [("logical", Type::Logical), ("integer", Type::Integer), ("long", Type::Long)];
    let classes = [
        ("ro", VariableClass::ReadOnly),
        ("rw", VariableClass::ReadWrite),
        ("reset", VariableClass::ResetOnly),
    ];
    let elements = row.number("elements", 0..=100)?;
    if elements == 1 {
        return Err(row.error("elements", "an array has at least two elements"));
    }
    let family = Family {
        first,
        last,
        ty: row.word("type", &types)?,
        class: row.word("class", &classes)?,
        elements,
        section: row.text("section")?,
        meaning: row.text("meaning")?,
    };
    let members = family.names();
    let ends = (members.first().map(String::as_str), members.last().map(String::as_str));
    if !first.starts_with('@') || ends != (Some(first), Some(last)) {
        return Err(
            row.error("name", format!("`{names}` is neither a variable nor a family of variables"))
        );
    }
    Ok(family)
}

impl Family {
    /// Whether its members exist only where `$MCODE` or `$GCODE` declares them.
    pub(crate) fn is_code(&self) -> bool {
        matches!(self.first, "@M00" | "@G00")
    }

    /// The names of all members.
    pub(crate) fn names(&self) -> Vec<String> {
        let (a, b) = (self.first.as_bytes(), self.last.as_bytes());
        let start = a.iter().zip(b).take_while(|(x, y)| x == y).count();
        if self.first == self.last {
            return vec![self.first.to_owned()];
        }
        // The number is the run of digits around the first difference.
        let digit = |name: &str, i: usize| name.as_bytes().get(i).is_some_and(u8::is_ascii_digit);
        let mut low = start.min(self.first.len());
        while low > 0 && digit(self.first, low - 1) {
            low -= 1;
        }
        let run = |name: &str| (low..name.len()).take_while(|&i| digit(name, i)).count();
        let number =
            |name: &str| name.get(low..low + run(name)).and_then(|n| n.parse::<u32>().ok());
        let (Some(from), Some(to)) = (number(self.first), number(self.last)) else { return vec![] };
        let width = run(self.first);
        let head = self.first.get(..low).unwrap_or("");
        let tail = self.first.get(low + width..).unwrap_or("");
        (from..=to).map(|n| format!("{head}{n:0width$}{tail}")).collect()
    }
}

/// The family of a name, which has its `@`.
fn family_of(name: &str) -> Option<&'static Family> {
    static BY_NAME: OnceLock<HashMap<String, &'static Family>> = OnceLock::new();
    let index = || {
        let names =
            |family: &'static Family| family.names().into_iter().map(move |name| (name, family));
        families().iter().rev().flat_map(names).collect()
    };
    BY_NAME.get_or_init(index).get(name).copied()
}

/// The executive variables of a machine.
#[derive(Clone, Debug)]
pub(crate) struct Executive {
    variables: Vec<Variable>,
    index: HashMap<String, usize>,
}

impl Executive {
    /// The manual's variables with the machine file's additions and changes.
    pub(crate) fn of(machine: &Machine) -> Cow<'static, Self> {
        static MANUAL: OnceLock<Executive> = OnceLock::new();
        let manual = MANUAL.get_or_init(Self::manual);
        match machine.variables.is_empty() {
            true => Cow::Borrowed(manual),
            false => Cow::Owned(manual.clone().changed(machine)),
        }
    }

    fn changed(mut self, machine: &Machine) -> Self {
        for change in &machine.variables {
            let slot = self.index.get(&change.name).copied().unwrap_or_else(|| {
                let plain = Variable {
                    name: change.name.clone(),
                    ty: Type::Logical,
                    class: VariableClass::ReadWrite,
                    elements: None,
                };
                self.push(plain)
            });
            let Some(variable) = self.variables.get_mut(slot) else { continue };
            if let Some(ty) = change.ty {
                variable.ty = abi_type(ty);
            }
            if let Some(class) = change.class {
                variable.class = class;
            }
            if let Some(size) = change.size {
                variable.elements = (size > 0).then_some(size);
            }
        }
        self
    }

    fn manual() -> Self {
        let mut this = Self { variables: vec![], index: HashMap::new() };
        for family in families().iter().filter(|family| !family.is_code()) {
            for name in family.names() {
                let elements = (family.elements > 0).then_some(family.elements);
                this.push(Variable { name, ty: family.ty, class: family.class, elements });
            }
        }
        this
    }

    fn push(&mut self, variable: Variable) -> usize {
        let slot = self.variables.len();
        self.index.insert(variable.name.clone(), slot);
        self.variables.push(variable);
        slot
    }

    /// Every variable; M and G codes are not among them, since a program declares those.
    pub(crate) fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// The variable of a name.
    #[cfg(test)]
    fn find(&self, name: &str) -> Option<&Variable> {
        self.index.get(name).and_then(|&slot| self.variables.get(slot))
    }
}

fn abi_type(ty: VariableType) -> Type {
    match ty {
        VariableType::Logical => Type::Logical,
        VariableType::Integer => Type::Integer,
        VariableType::Long => Type::Long,
    }
}

/// The names of the executive variables, for "did you mean": of each family the first.
pub fn executive_names() -> impl Iterator<Item = &'static str> {
    families().iter().map(|family| family.first)
}

/// What an executive variable means, in one line; `name` has its `@`.
pub(crate) fn meaning(name: &str) -> Option<&'static str> {
    family_of(name).map(|family| family.meaning)
}

/// The executive variables as topics of `plcc explain`: of each family the first.
pub(crate) fn topics() -> Vec<Topic> {
    let topic = |family: &Family| Topic {
        name: family.first.to_owned(),
        meaning: family.meaning.to_owned(),
    };
    families().iter().map(topic).collect()
}

/// What `plcc explain` prints for an executive variable, or `None` if none has the name. The name
/// may be in small letters and without its `@`. For one of a family the text tells of the family,
/// for an element of the array.
pub fn explain(name: &str) -> Option<String> {
    let upper = name.trim().to_ascii_uppercase();
    let (upper, index) = match upper.strip_suffix(']').and_then(|name| name.split_once('[')) {
        Some((name, index)) => (name.to_owned(), Some(index.parse::<u32>().ok()?)),
        None => (upper, None),
    };
    let name = if upper.starts_with('@') { upper } else { format!("@{upper}") };
    let family = family_of(&name)?;
    if index.is_some_and(|index| index >= family.elements) {
        return None;
    }
    let ty = match family.ty {
        Type::Logical => "LOGICAL",
        Type::Integer => "INTEGER",
        Type::Long => "LONG",
    };
    let class = match family.class {
        VariableClass::ReadOnly => "read-only",
        VariableClass::ReadWrite => "read and write",
        VariableClass::ResetOnly => "reset-only: an assignment can only clear it",
    };
    let mut text = name.clone();
    if family.first != family.last {
        text.push_str(&format!(" (of {} to {})", family.first, family.last));
    }
    text.push_str(&format!("\n  {}\n  {ty}, {class}", family.meaning));
    if family.elements > 0 {
        let last = family.elements - 1;
        text.push_str(&format!(", array of {}: {name}[0] to {name}[{last}]", family.elements));
    }
    if family.section == "example" {
        text.push_str("\n  PMI manual: only in an example, 3.4 does not list it\n");
    } else {
        text.push_str(&format!("\n  PMI manual {}\n", family.section));
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_explains_its_array() {
        assert_eq!(explain("@NVINT[19]"), explain("@NVINT"));
        assert!(explain("@NVINT[19]").is_some());
        for name in ["@NVINT[20]", "@NVINT[]", "@NVINT[X]", "@FRO[0]"] {
            assert_eq!(explain(name), None, "{name}");
        }
    }

    #[test]
    fn the_table_has_no_mistakes_and_no_variable_twice() {
        let families = load(TABLE).unwrap();
        assert_eq!(families.len(), TABLE.lines().count() - 1);
        let mut seen = std::collections::HashSet::new();
        for name in families.iter().flat_map(Family::names) {
            assert!(name.len() <= 7, "{name}");
            assert!(seen.insert(name.clone()), "{name} is there twice");
        }
    }

    #[test]
    fn a_wrong_row_is_named() {
        for (row, message) in [
            ("@A\tbyte\tro\t0\t3.4\tx", "type: `byte` is not one of: logical, integer, long"),
            ("@A\tlong\two\t0\t3.4\tx", "class: `wo` is not one of: ro, rw, reset"),
            ("@A\tlong\tro\t101\t3.4\tx", "elements: `101` is not a number from 0 to 100"),
            ("@A\tlong\tro\t1\t3.4\tx", "elements: an array has at least two elements"),
            ("@A\tlong\tro\t0\t\tx", "section: the cell is empty"),
            (
                "@A1-@B2\tlong\tro\t0\t3.4\tx",
                "name: `@A1-@B2` is neither a variable nor a family of variables",
            ),
            (
                "@A2-@A1\tlong\tro\t0\t3.4\tx",
                "name: `@A2-@A1` is neither a variable nor a family of variables",
            ),
            ("A\tlong\tro\t0\t3.4\tx", "name: `A` is neither a variable nor a family of variables"),
        ] {
            let table = format!("{}\n{row}\n", COLUMNS.join("\t"));
            let error = load(table.leak()).unwrap_err().to_string();
            let at = "frontend/src/pmi/reference/executive.tsv:2: ";
            assert_eq!(error, format!("{at}{message}"));
        }
    }

    #[test]
    fn families_are_expanded() {
        let executive = Executive::of(&Machine::default());
        for name in ["@CP100", "@CP109", "@CP115", "@MLD11", "@Z1SEL", "@Z8SEL", "@4A102"] {
            assert!(executive.find(name).is_some(), "{name}");
        }
        for name in ["@CP116", "@MLD12", "@Z9SEL", "@M03", "@G84"] {
            assert!(executive.find(name).is_none(), "{name}");
        }
    }

    /// Ruling: sizes that the manual gives, and 32 where it leaves them open.
    #[test]
    fn sizes_are_as_ruled() {
        let executive = Executive::of(&Machine::default());
        for (name, elements) in [
            ("@AUREQ", Some(6)),
            ("@AXRRQ", Some(6)),
            ("@PIN", Some(100)),
            ("@POUT", Some(100)),
            ("@SLIDP", Some(16)),
            ("@PCP", Some(50)),
            ("@NVFLG", Some(20)),
            ("@NHOME", Some(32)),
            ("@AUSTP", Some(32)),
            ("@FRO", None),
        ] {
            assert_eq!(executive.find(name).unwrap().elements, elements, "{name}");
        }
    }

    #[test]
    fn machine_file_adds_and_changes() {
        let machine = Machine::parse(
            "[variables]\n\"@HOMST\" = {type=\"integer\",class=\"rw\"}\n\"@OWN\" = {size=3}\n",
        )
        .unwrap();
        let executive = Executive::of(&machine);
        let homst = executive.find("@HOMST").unwrap();
        assert_eq!((homst.ty, homst.class), (Type::Integer, VariableClass::ReadWrite));
        assert_eq!(homst.elements, Some(32));
        let own = executive.find("@OWN").unwrap();
        assert_eq!((own.ty, own.elements), (Type::Logical, Some(3)));
    }

    #[test]
    fn variables_are_explained_in_any_case_and_by_member_name() {
        assert!(explain("@FRO").unwrap().contains("INTEGER, read and write"));
        assert!(explain("cp103").unwrap().contains("(of @CP100 to @CP115)"));
        assert!(explain("@M299").unwrap().contains("reset-only"));
        assert!(explain("@nvint").unwrap().contains("@NVINT[19]"));
        assert_eq!(explain("@NONE"), None);
    }
}
