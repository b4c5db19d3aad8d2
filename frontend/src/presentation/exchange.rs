//! Who gives a variable its value, seen from the machine.

/// How a program uses a variable, all its files together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uses {
    /// It is read or tested.
    pub read: bool,
    /// It is assigned.
    pub written: bool,
    /// Its value is a word in the process image, or bits of one, rather than a number with a fraction.
    pub in_word: bool,
    /// Who gives its value as the control's table of names says; `None` for what it calls neither input nor output.
    pub declared: Option<Exchange>,
}

impl Uses {
    /// Who gives the value of a variable that is used so.
    pub fn exchange(self) -> Exchange {
        match (self.read, self.written) {
            (true, true) => Exchange::Both,
            (false, true) => Exchange::Program,
            (_, false) => Exchange::Machine,
        }
    }
}

/// Who gives a variable its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// The machine.
    Machine,
    /// The program.
    Program,
    /// Both.
    Both,
}
