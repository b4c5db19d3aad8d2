//! The watched variables, and the trace of their changes.

use std::io::{self, Write};

use crate::{Executive, NameError, Purpose, Value, Variable};

/// Variables under their names as they were asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Watch {
    names: Vec<(String, Variable)>,
}

impl Watch {
    /// Finds the variables of lists `NAME,NAME…`.
    ///
    /// # Errors
    /// Every name that is none.
    pub fn parse(
        lists: &[impl AsRef<str>],
        executive: &mut dyn Executive,
    ) -> Result<Self, Vec<NameError>> {
        let mut names = vec![];
        let mut errors = vec![];
        for name in lists.iter().flat_map(|list| split(list.as_ref())) {
            match executive.find(name, Purpose::Watch) {
                Ok(variable) => names.push((name.to_owned(), variable)),
                Err(error) => errors.push(error),
            }
        }
        if errors.is_empty() { Ok(Self { names }) } else { Err(errors) }
    }

    /// The variables, in their order.
    pub fn variables(&self) -> impl Iterator<Item = Variable> + '_ {
        self.names.iter().map(|&(_, variable)| variable)
    }
}

/// The names of a list. Commas inside brackets separate nothing.
fn split(list: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0u32;
    list.split(move |c: char| {
        match c {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        c == ',' && depth == 0
    })
    .map(str::trim)
}

/// Writes a row for each watched variable that has changed since its last row.
#[derive(Clone, Debug)]
pub struct Trace {
    watch: Watch,
    last: Vec<Option<Value>>,
}

impl Trace {
    /// A trace without rows.
    pub fn new(watch: Watch) -> Self {
        Self { last: vec![None; watch.names.len()], watch }
    }

    /// Writes the header.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn header(out: &mut dyn Write) -> io::Result<()> {
        out.write_all(b"tick,name,value\n")
    }

    /// Writes the rows of a tick that has ended; whether there were any.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn rows(
        &mut self,
        tick: u64,
        executive: &dyn Executive,
        out: &mut dyn Write,
    ) -> io::Result<bool> {
        let mut any = false;
        for ((name, variable), last) in self.watch.names.iter().zip(&mut self.last) {
            let value = executive.get(*variable);
            if last.as_ref() == Some(&value) {
                continue;
            }
            any = true;
            match value {
                Value::Array(_) => writeln!(out, "{tick},{name},\"{value}\"")?,
                Value::Int(_) | Value::Float(_) => writeln!(out, "{tick},{name},{value}")?,
            }
            *last = Some(value);
        }
        Ok(any)
    }
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn names_are_split_at_commas() {
        let names: Vec<&str> = split("A[3], X:$0700,&2Q5 ,B[1,2],").collect();
        assert_eq!(names, ["A[3]", "X:$0700", "&2Q5", "B[1,2]", ""]);
    }
}
