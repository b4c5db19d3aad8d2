//! The names of a program's variables: [`Names`], one immutable table that everybody asks who finds, shows, sets,
//! wires or forces variables, so that nobody has a second opinion of them.
//!
//! It is made from the program's tables alone, needs no executive, and can be asked by any thread. What it finds is
//! a [`VariableKey`], by which an [`Executive`](crate::Executive) reads and sets the variable.

use std::fmt::Debug;

use plcc_abi::place::{Direction, Place};

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
            line: None,
            unit: "",
            can_be_forced: false,
        }
    }
}

/// The names of a program's variables, and what is known of each. See [`names_of`](crate::names_of).
pub trait Names: Debug + Send + Sync {
    /// Finds a variable by its name in the dialect's spelling. For [`Purpose::Watch`] a whole array is allowed.
    ///
    /// # Errors
    /// When nothing has that name, or it can't be used for the purpose.
    fn find(&self, name: &str, purpose: Purpose) -> Result<VariableKey, NameError>;

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

    /// The physical outputs, in natural sort order: what may become something else than off at a stop.
    fn outputs(&self) -> Vec<(String, VariableKey)>;

    /// The variables that an image file shows, in the order of its table of symbols. Each has a
    /// [value](Properties::value) in the process image.
    fn shown_in_image(&self) -> Vec<VariableKey>;

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
}

impl dyn Names + '_ {
    /// The keys of a single variable, or of the elements of an array, in their order.
    pub fn elements(&self, key: VariableKey) -> Vec<VariableKey> {
        match self.properties(key).elements {
            Some(count) => (0..count).filter_map(|index| self.element(key, index)).collect(),
            None => vec![key],
        }
    }
}
