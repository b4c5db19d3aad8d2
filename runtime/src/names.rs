//! The names of a program's variables: [`Names`], one immutable table that everybody asks who finds, shows, sets,
//! wires or forces variables, so that nobody has a second opinion of them.
//!
//! It is made from the program's tables alone, needs no executive, and can be asked by any thread. What it finds is
//! a [`VariableKey`], by which an [`Executive`](crate::Executive) reads and sets the variable.

use std::borrow::Cow;
use std::fmt::Debug;

use plcc_abi::place::{Direction, Place};
use plcc_abi::{GivenName, natural_cmp};
use plcc_simulator::Equipment;

use crate::given_names::GivenNames;
use crate::safe_outputs::{SafeLines, SafeOutputs};
use crate::variable::{NameError, Purpose, Setting, ValueError, VariableKey};

/// What kind of values a variable has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// 0 and 1 only, so that a waveform viewer shows it as a line.
    Logical,
    /// Integers.
    Integer,
    /// Numbers with a fraction.
    Fraction,
}

/// What is known of a variable without the control that runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Properties {
    /// What kind of values it, or each of its elements, has.
    pub class: Class,
    /// How many elements an array has; `None` for a single variable.
    pub elements: Option<u32>,
    /// Whether it is an input or an output.
    pub direction: Direction,
    /// Where the value lies in the process image, of an array the first element. `None` for what is kept elsewhere
    /// or in parts. That of a PMAC's M-variable is the place after load; the program may move it.
    pub value: Option<Place>,
    /// How many bits an integer of at least 0 has that lies in parts or elsewhere, where that is known.
    pub width: Option<u8>,
    /// Where the physical lines of an input or output lie, if that is known and another place than the value.
    pub line: Option<Place>,
    /// The unit of the value; empty where none is known.
    pub unit: &'static str,
    /// Whether [`Executive::force`](crate::Executive::force) can hold it, as long as a PMAC's program does not move it.
    pub can_be_forced: bool,
}

impl Properties {
    /// A single variable that nobody outside gives or takes, with its value at a place.
    pub(crate) fn internal(class: Class, value: Option<Place>) -> Self {
        Self {
            class,
            elements: None,
            direction: Direction::Internal,
            value,
            width: None,
            line: None,
            unit: "",
            can_be_forced: false,
        }
    }
}

/// What the value `press` of a key does: the key is pressed, and let go this many ticks later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Press {
    /// The ticks.
    pub ticks: u64,
}

/// The names of a program's variables, and what is known of each. See [`names_of`](crate::names_of).
pub trait Names: Debug + Send + Sync {
    /// Finds a variable by its name in the dialect's spelling, or, in the table that an executive and
    /// [`names_of`](crate::names_of) give, by an alias. For [`Purpose::Watch`] a whole array is allowed.
    ///
    /// # Errors
    /// When nothing has that name, or it can't be used for the purpose.
    fn find(&self, name: &str, purpose: Purpose) -> Result<VariableKey, NameError>;

    /// What people call the variables and say of them. A control's own table knows none of it.
    fn given(&self) -> &GivenNames {
        GivenNames::none()
    }

    /// The canonical spelling of a variable's name, as a dump has it; empty for the key of another control.
    fn canonical(&self, key: VariableKey) -> String;

    /// What is known of a variable.
    fn properties(&self, key: VariableKey) -> Properties;

    /// An element of an array, from 0; `None` beyond the last one, and of a single variable.
    fn element(&self, key: VariableKey, index: u32) -> Option<VariableKey>;

    /// Reads the text of a value for a variable.
    ///
    /// # Errors
    /// When the text is not a number, or the variable can't take it.
    fn parse(&self, key: VariableKey, text: &str) -> Result<Setting, ValueError>;

    /// The variables that the program declares or names, in natural sort order of their canonical names:
    /// numbers in names are compared as numbers, so that P2 stands before P10.
    fn declared(&self) -> Vec<(String, VariableKey)>;

    /// The variables for which a pattern can stand: those of [`declared`](Self::declared), and what the control has
    /// besides that is only looked at.
    fn patterns(&self) -> Vec<(String, VariableKey)> {
        self.declared()
    }

    /// What there is to be seen of a machine that is simulated; nothing where none is.
    fn equipment(&self) -> Equipment {
        Equipment::default()
    }

    /// The physical outputs, in natural sort order: what may become something else than off at a stop.
    fn outputs(&self) -> Vec<(String, VariableKey)>;

    /// The variables that an image file shows, in the order of its table of symbols. Each has a
    /// [value](Properties::value) in the process image.
    fn shown_in_image(&self) -> Vec<VariableKey>;

    /// Whether the simulator of the run writes any of a variable's bits, so that no other process gives it.
    fn is_simulated(&self, _key: VariableKey) -> bool {
        false
    }

    /// The physical lines of an input or output, the lowest first, each a variable of one bit with a name of its own; of a line
    /// itself that line. Empty for what has none.
    fn lines(&self, _key: VariableKey) -> Vec<VariableKey> {
        vec![]
    }

    /// Where the physical outputs lie in the process image, and what they become at a stop: what `outputs` say,
    /// and all others off.
    ///
    /// # Errors
    /// Every entry whose name is that of no physical output, or whose value does not fit.
    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>>;

    /// Whether forces on two variables would hold some of the same bits, of which only one can win. Only of variables
    /// that always lie in the same place; a PMAC's can be moved, so that [`Executive::force`](crate::Executive::force)
    /// refuses them.
    fn share_forced_bits(&self, a: VariableKey, b: VariableKey) -> bool;

    /// Whether there are keys of a simulated machine.
    fn has_keys(&self) -> bool {
        false
    }

    /// What the value `press` does to a variable; `None` where it is not a key of a simulated machine.
    fn press(&self, _key: VariableKey) -> Option<Press> {
        None
    }
}

impl dyn Names + '_ {
    /// The keys of a single variable, or of the elements of an array, in their order.
    pub fn elements(&self, key: VariableKey) -> Vec<VariableKey> {
        match self.properties(key).elements {
            Some(count) => (0..count).filter_map(|index| self.element(key, index)).collect(),
            None => vec![key],
        }
    }

    /// A name in the dialect's spelling: of an alias the canonical name of its variable, any other text as it is.
    pub fn spelled<'n>(&self, name: &'n str) -> Cow<'n, str> {
        self.given().replaced(name).map_or(Cow::Borrowed(name), Cow::Owned)
    }

    /// What people call a variable and say of it, if anything.
    pub fn said_of(&self, key: VariableKey) -> Option<Cow<'_, GivenName>> {
        self.given().said_of(&self.canonical(key))
    }

    /// The alias of a variable, or its canonical name if it has none.
    pub fn alias_or_name(&self, key: VariableKey) -> String {
        let name = self.canonical(key);
        let alias = self.given().said_of(&name).map(|said| said.alias.clone());
        alias.filter(|alias| !alias.is_empty()).unwrap_or(name)
    }

    /// The variables of a pattern: those that the program declares or names and whose name or alias matches, in natural order,
    /// and after them others that have an alias which matches.
    pub fn matching(&self, matches: impl Fn(&str) -> bool) -> Vec<(String, VariableKey)> {
        let given = self.given();
        let mut found = self.patterns();
        let aliased = |name: &str| given.aliases_of(name).into_iter().any(&matches);
        found.retain(|(name, _)| matches(name) || aliased(name));
        let others = given.aliases().filter(|(alias, _)| matches(alias)).map(|(_, name)| name);
        let mut others: Vec<&str> =
            others.filter(|name| found.iter().all(|(known, _)| known != name)).collect();
        others.sort_by(|a, b| natural_cmp(a, b));
        others.dedup();
        let others = others.into_iter();
        found.extend(
            others
                .filter_map(|name| Some((name.to_owned(), self.find(name, Purpose::Watch).ok()?))),
        );
        found
    }
}
