//! The language server: what editors show of a program while it is written, by the Language Server Protocol.
//!
//! Everything comes from the front ends: the diagnostics are those of `plcc check`, names and what is done with them are
//! [`Words`](plcc_frontend::common::Words), which the compiler's own readers make, so that an editor and the compiler can't
//! disagree.
//!
//! | file | holds |
//! | --- | --- |
//! | `server.rs` | the loop: messages in their order, requests that are out of date |
//! | `dispatch.rs` | which request is answered by which feature |
//! | `documents.rs` | the texts that the editor has open |
//! | `position.rs` | lines and columns of the protocol |
//! | `program.rs` | a program that has been read, and the place in it that a request is about |
//! | `run.rs` | a run whose values are shown beside the names |
//! | `own_requests.rs` | the requests that the protocol does not have |
//! | `workspace.rs` | which program a file belongs to, and the settings it is read with |
//! | `features/` | a file for each thing that an editor asks |
//!
//! ```
//! use std::path::Path;
//!
//! use lsp_server::{Connection, Message, Request, RequestId};
//! use plcc_diag::Diagnostic;
//! use plcc_frontend::CheckedProgram;
//!
//! /// Compares nothing, so that names can't be changed.
//! struct NoCompiler;
//!
//! impl plcc_lsp::Compiler for NoCompiler {
//!     fn code(&self, _: &dyn CheckedProgram, _: Option<(&str, &str)>) -> Option<Vec<u8>> {
//!         None
//!     }
//!
//!     fn mistakes_of_script(&self, _: &Path, _: &str) -> Vec<Diagnostic> {
//!         vec![]
//!     }
//!
//!     fn open_run(&self, _: &Path, _: &Path) -> Result<Box<dyn plcc_lsp::Run>, String> {
//!         Err("nothing runs".into())
//!     }
//! }
//!
//! let (editor, server) = Connection::memory();
//! let ask = |id: i32, method: &str| {
//!     let request = Request::new(RequestId::from(id), method.to_owned(), serde_json::json!({}));
//!     editor.sender.send(Message::Request(request))
//! };
//! ask(1, "initialize")?;
//! editor.sender.send(lsp_server::Notification::new("initialized".into(), ()).into())?;
//! ask(2, "shutdown")?;
//! editor.sender.send(lsp_server::Notification::new("exit".into(), ()).into())?;
//! plcc_lsp::serve(&server, &NoCompiler)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Architecture Invariant: no message of an editor makes the server panic, and none changes what a later request of another
//! document gets. What can't be answered is answered with the reason.

mod capabilities;
mod dispatch;
mod documents;
mod features;
mod own_requests;
mod position;
mod program;
mod run;
mod server;
mod workspace;

use std::io;
use std::path::Path;

use lsp_server::Connection;
use plcc_diag::Diagnostic;
use plcc_frontend::CheckedProgram;

pub use capabilities::capabilities;
pub use run::{Run, Value};

/// What the server needs of the compiler behind the front ends.
pub trait Compiler: Sync {
    /// The machine code of a program, to see whether a change has changed it. `None` if it can't be compiled. With a new and an old
    /// name, the variable that has the new one lies where it would with the old one.
    fn code(&self, program: &dyn CheckedProgram, renamed: Option<(&str, &str)>) -> Option<Vec<u8>>;

    /// The mistakes of a test script, whose path is absolute, with this text. Their places are in a [`SourceMap`] that has
    /// the script alone.
    ///
    /// [`SourceMap`]: plcc_diag::SourceMap
    fn mistakes_of_script(&self, path: &Path, text: &str) -> Vec<Diagnostic>;

    /// Opens a run: the socket of a control that runs, or a record, whichever has the path. `program` is a file of its program.
    ///
    /// # Errors
    /// Why it can't be opened.
    fn open_run(&self, path: &Path, program: &Path) -> Result<Box<dyn Run>, String>;
}

/// Serves one editor over a connection, until it says goodbye or its stream ends.
///
/// # Errors
/// When the editor's messages have no valid form, or the stream fails.
pub fn serve(connection: &Connection, compiler: &dyn Compiler) -> io::Result<()> {
    server::Server::run(connection, compiler).map_err(io::Error::other)
}

/// Serves one editor over standard input and output.
///
/// # Errors
/// As those of [`serve`].
pub fn serve_stdio(compiler: &dyn Compiler) -> io::Result<()> {
    let (connection, threads) = Connection::stdio();
    let result = serve(&connection, compiler);
    // The writing thread ends when nobody can send to it any more.
    drop(connection);
    result.and(threads.join())
}
