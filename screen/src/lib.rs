//! What the programs share that draw in a terminal, `plcc monitor` and `plcctl operator`: the terminal itself, texts in cells,
//! and the operator's screen, which both of them show.
//!
//! | file | holds |
//! | --- | --- |
//! | `terminal.rs` | the terminal: how a display is drawn again and again and gets its keys, signals, the end |
//! | `text.rs` | texts in rows of cells |
//! | `cells.rs` | keys, lamps and values of panels |
//! | `operator.rs` | the operator's screen |
//!
//! ```
//! use plcc_protocol::OperatorView;
//! use plcc_screen::{Display, Operator, TerminalError};
//! use ratatui::Frame;
//! use ratatui::crossterm::event::{KeyCode, KeyEvent};
//!
//! /// The operator's screen of a program that uses no key.
//! #[derive(Default)]
//! struct Empty {
//!     operator: Operator,
//!     is_left: bool,
//! }
//!
//! impl Display for Empty {
//!     fn draw(&mut self, frame: &mut Frame<'_>) {
//!         self.operator.draw(&OperatorView::default(), frame, frame.area());
//!     }
//!
//!     fn key(&mut self, key: KeyEvent) {
//!         self.is_left = key.code == KeyCode::Char('q');
//!     }
//!
//!     fn is_left(&self) -> bool {
//!         self.is_left
//!     }
//! }
//!
//! # fn example() -> Result<(), TerminalError> {
//! plcc_screen::run(&mut Empty::default())
//! # }
//! ```

mod cells;
mod operator;
mod terminal;
mod text;

pub use cells::{cell_text, style_of};
pub use operator::{Asked, KEYS, Operator, bar};
pub use terminal::{Display, TerminalError, check, run};
pub use text::{first_shown, fitted, word_rows};
