//! The operator's screen: what is announced, and the keys, lamps and overrides that the program uses. The screens of the
//! monitor and of `plcctl` are both this view.

use plcc_abi::{OperatorCell, OperatorPanel, number};
use serde::{Deserialize, Serialize};

/// What an operator sees: what is announced, and the keys, lamps and overrides that the program uses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct OperatorView {
    /// Faults and messages that are on.
    pub active: Vec<Active>,
    /// Overrides and other percentages.
    pub overrides: Vec<PanelCell>,
    /// Push-buttons and lamps.
    pub keys: Vec<PanelCell>,
}

/// A fault or message that is on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Active {
    /// Fault or message.
    pub kind: EventKind,
    /// The variable or flag.
    pub name: String,
    /// Its text with the present values.
    pub text: String,
    /// The tick in which it came; `None` if that is not known.
    pub since: Option<u64>,
}

/// What an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A fault.
    Fault,
    /// A message.
    Message,
    /// A text that the program sent or displayed.
    Text,
    /// A command or another action of the program.
    Command,
    /// The program was stopped.
    Stop,
}

/// A push-button, a lamp, or a value.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct PanelCell {
    /// What it is called; empty for a place without anything.
    pub label: String,
    /// Its value or text.
    pub value: Option<String>,
    /// Whether its lamp is on; `None` if it has none.
    pub light: Option<bool>,
    /// Whether its push-button is pressed; `None` if it is none.
    pub pressed: Option<bool>,
    /// The variable that a press, or a new value, sets. `None` if nothing can be set.
    pub variable: Option<String>,
    /// Whether the value is not in use, so that it is shown less clearly.
    pub dim: bool,
    /// What a press sets once, and to what: a command, which has no state. `None` while the past is shown, where none is given.
    pub command: Option<(String, String)>,
}

impl PanelCell {
    /// What a press sets, and to what: a push-button that is pressed is released. `None` if the cell can't be pressed.
    pub fn press(&self) -> Option<(String, String)> {
        let pressed = || Some((self.variable.clone()?, self.pressed?));
        let button = || pressed().map(|(name, on)| (name, if on { "0" } else { "1" }.to_owned()));
        self.command.clone().or_else(button)
    }
}

impl OperatorView {
    /// The view of a panel's cells, with the values that `value` gives.
    pub fn new(
        panel: &OperatorPanel,
        active: Vec<Active>,
        value: &dyn Fn(&str) -> Option<f64>,
    ) -> Self {
        let (mut keys, mut overrides) = (vec![], vec![]);
        for cell in &panel.cells {
            match cell.is_key() {
                true => keys.extend(key(cell, &panel.key_texts, value)),
                false => overrides.push(override_of(cell, value)),
            }
        }
        Self { active, overrides, keys }
    }

    /// Whether a variable is that of a key which can be pressed.
    pub fn presses(&self, variable: &str) -> bool {
        let is_its =
            |key: &PanelCell| key.pressed.is_some() && key.variable.as_deref() == Some(variable);
        self.keys.iter().any(is_its)
    }
}

fn is_on(name: &Option<String>, value: &dyn Fn(&str) -> Option<f64>) -> Option<bool> {
    Some(value(name.as_deref()?)? != 0.0)
}

/// The label of a touch key, of which a variable has the number of the text, from 1. `None` for 0: a key without a text is not
/// displayed (PMI 3.4).
pub fn touch_key_label(label: &str, texts: &[String], number: f64) -> Option<String> {
    let number = number as usize;
    let text = texts.get(number.checked_sub(1)?).cloned();
    Some(text.unwrap_or_else(|| format!("{label} key {number}")))
}

/// A key or lamp; `None` for a touch key that is not displayed.
fn key(
    cell: &OperatorCell,
    texts: &[String],
    value: &dyn Fn(&str) -> Option<f64>,
) -> Option<PanelCell> {
    let label = match &cell.text {
        None => cell.label.clone(),
        Some(name) => touch_key_label(&cell.label, texts, value(name).unwrap_or(0.0))?,
    };
    let pressed = is_on(&cell.button, value);
    let variable = cell.button.clone().filter(|_| pressed.is_some());
    let light = is_on(&cell.light, value);
    Some(PanelCell { label, light, pressed, variable, ..PanelCell::default() })
}

fn override_of(cell: &OperatorCell, value: &dyn Fn(&str) -> Option<f64>) -> PanelCell {
    let shown = cell.number.as_deref().and_then(value).map(number);
    PanelCell {
        label: cell.label.clone(),
        value: Some(shown.unwrap_or_else(|| "-".into())),
        dim: is_on(&cell.unused, value).unwrap_or(false),
        ..PanelCell::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_has_the_values_of_its_panel() {
        let name = |name: &str| Some(name.to_owned());
        let touch = |text: &str| OperatorCell {
            label: text.into(),
            text: name(text),
            light: name("L"),
            button: name("B"),
            ..OperatorCell::default()
        };
        let share = OperatorCell {
            label: "F%".into(),
            number: name("F"),
            unused: name("B"),
            ..OperatorCell::default()
        };
        let lamp =
            OperatorCell { label: "lamp".into(), light: name("L"), ..OperatorCell::default() };
        let cells = vec![touch("T0"), touch("T1"), touch("T9"), touch("T2"), share, lamp];
        let panel = OperatorPanel { cells, key_texts: vec!["AUTO".into(), "MAN".into()] };
        let value = |name: &str| match name {
            "T0" | "L" => Some(0.0),
            "T1" | "B" => Some(1.0),
            "T2" => Some(2.0),
            "T9" => Some(9.0),
            "F" => Some(80.0),
            _ => None,
        };
        let view = OperatorView::new(&panel, vec![], &value);
        let labels: Vec<&str> = view.keys.iter().map(|key| key.label.as_str()).collect();
        assert_eq!(labels, ["AUTO", "T9 key 9", "MAN", "lamp"]);
        assert_eq!(view.keys[0].press(), Some(("B".into(), "0".into())));
        assert_eq!((view.keys[3].light, view.keys[3].press()), (Some(false), None));
        assert!(view.presses("B") && !view.presses("L") && !view.presses("F"));
        let [share] = view.overrides.as_slice() else { panic!("{view:?}") };
        assert_eq!((share.value.as_deref(), share.dim), (Some("80"), true));
        let nothing = OperatorView::new(&panel, vec![], &|_| None);
        assert_eq!((nothing.keys.len(), nothing.keys[0].press()), (1, None));
        assert_eq!(nothing.overrides[0].value.as_deref(), Some("-"));
    }
}
