//! What the programs share that draw in a terminal, `plcc monitor` and `plcctl operator`: the terminal itself, texts in cells,
//! and the operator's screen, which both of them show.
//!
//! | file | holds |
//! | --- | --- |
//! | `terminal.rs` | the terminal: how a display is drawn again and again and gets its keys, signals, the end |
//! | `text.rs` | texts in rows of cells |
//! | `cells.rs` | keys, lamps and values of panels |
//! | `operator.rs` | the operator's screen |

mod cells;
mod operator;
mod terminal;
mod text;

pub use cells::{cell_text, style_of};
pub use operator::{Asked, KEYS, Operator, bar};
pub use terminal::{Display, TerminalError, check, run};
pub use text::{first_shown, fitted, word_rows};
