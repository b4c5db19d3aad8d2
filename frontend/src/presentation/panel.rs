//! Panels of a control: push-buttons with lamps, displays, registers of the control's own screens, before the variables in
//! them are read.

/// A panel before its variables are read.
#[derive(Clone, Debug, Default)]
pub struct PanelDraft {
    /// Its title.
    pub title: String,
    /// How many cells a row has.
    pub columns: usize,
    /// The cells, row by row.
    pub cells: Vec<Cell>,
    /// What should be known of it.
    pub note: Option<String>,
}

/// A cell before its variables are read.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    /// What it is called; empty for a place without anything.
    pub label: String,
    /// What it shows beside that.
    pub shown: Shown,
    /// The variable of its lamp.
    pub light: Option<String>,
    /// The variable of its push-button.
    pub button: Option<String>,
    /// The variable that a new value sets.
    pub editable: Option<String>,
    /// The variable that says that the value is not in use.
    pub unused: Option<String>,
    /// What a press sets once, and to what: a command, which has no value of its own and so is not among the variables.
    pub command: Option<(String, String)>,
}

/// What a cell shows beside its label.
#[derive(Clone, Debug, Default)]
pub enum Shown {
    /// Nothing.
    #[default]
    Nothing,
    /// A text that depends on no variable.
    Text(String),
    /// The number in a variable.
    Number(String),
    /// The number in a variable, which a function makes a text.
    Formatted(String, fn(f64) -> String),
    /// The number in the first variable, which a function makes a text; the second variable says in which form.
    FormattedBy(String, String, fn(f64, f64) -> String),
    /// The text of a key whose number the variable holds, from 1 (see
    /// [`key_texts`](crate::CheckedProgram::key_texts)); 0 for none.
    Key(String),
}

impl Cell {
    /// A cell in which nothing is shown, to keep the others in their columns.
    pub fn gap() -> Self {
        Self::default()
    }

    /// A value with a title.
    pub fn number(label: impl Into<String>, variable: impl Into<String>) -> Self {
        Self { label: label.into(), shown: Shown::Number(variable.into()), ..Self::default() }
    }

    /// A value that a function makes a text.
    pub fn formatted(
        label: impl Into<String>,
        variable: impl Into<String>,
        text: fn(f64) -> String,
    ) -> Self {
        let shown = Shown::Formatted(variable.into(), text);
        Self { label: label.into(), shown, ..Self::default() }
    }

    /// A lamp.
    pub fn light(label: impl Into<String>, variable: impl Into<String>) -> Self {
        Self { label: label.into(), light: Some(variable.into()), ..Self::default() }
    }

    /// A push-button with its lamp.
    pub fn button(label: impl Into<String>, button: String, light: Option<String>) -> Self {
        Self { label: label.into(), button: Some(button), light, ..Self::default() }
    }

    /// A push-button that gives a command each time it is pressed, by setting a name to a value.
    pub fn command(
        label: impl Into<String>,
        name: impl Into<String>,
        value: impl Into<String>,
    ) -> Self {
        let command = Some((name.into(), value.into()));
        Self { label: label.into(), command, ..Self::default() }
    }

    /// The same, with a value that can be set.
    pub fn editable(self) -> Self {
        let editable = match &self.shown {
            Shown::Number(name) | Shown::Formatted(name, _) | Shown::FormattedBy(name, ..) => {
                Some(name.clone())
            }
            Shown::Nothing | Shown::Text(_) | Shown::Key(_) => None,
        };
        Self { editable, ..self }
    }

    /// The names of all its variables.
    pub fn variables(&self) -> Vec<&String> {
        let mut names: Vec<&String> = match &self.shown {
            Shown::Nothing | Shown::Text(_) => vec![],
            Shown::Number(name) | Shown::Formatted(name, _) | Shown::Key(name) => vec![name],
            Shown::FormattedBy(name, how, _) => vec![name, how],
        };
        names.extend([&self.light, &self.button, &self.unused].into_iter().flatten());
        names
    }
}
