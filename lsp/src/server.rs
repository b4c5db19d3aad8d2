//! The loop of the server: takes messages in their order, and leaves out what is out of date.
//!
//! All messages that have come are taken before one is answered. So a request that the editor has cancelled, or that asks about
//! a text which has been changed since, is answered at once with that reason, and problems are told when nothing else waits:
//! typing never waits for the analysis of a text that is old already.

use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use gen_lsp_types::{
    Diagnostic, DidChangeTextDocumentNotification, DidCloseTextDocumentNotification,
    DidOpenTextDocumentNotification, InitializeParams, InitializeResult, Notification as _,
    PublishDiagnosticsNotification, PublishDiagnosticsParams, ServerInfo, WorkspaceFolders,
};
use lsp_server::{
    Connection, ErrorCode, Message, Notification, ProtocolError, Request, RequestId, Response,
};
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::Compiler;
use crate::capabilities::capabilities;
use crate::documents::{Document, Documents, path_of};
use crate::features::diagnostics;
use crate::features::machine_file::{is_machine_file, problems};
use crate::features::semantic_tokens::SentTokens;
use crate::position::Encoding;
use crate::run::ShownRun;
use crate::workspace::{Settings, Workspace, dialect_of};

/// The server's state.
pub(crate) struct Server<'c> {
    connection: &'c Connection,
    pub(crate) compiler: &'c dyn Compiler,
    pub(crate) documents: Documents,
    pub(crate) workspace: Workspace,
    pub(crate) encoding: Encoding,
    pub(crate) sent_tokens: SentTokens,
    /// The run whose values are shown.
    pub(crate) shown: Option<ShownRun>,
    /// Whether the editor is to be asked to fetch its inlay hints again.
    pub(crate) refreshes_hints: bool,
    /// The same for its code lenses.
    pub(crate) refreshes_lenses: bool,
    /// Whether the editor knows these requests, and how often they were sent.
    can_refresh_hints: bool,
    can_refresh_lenses: bool,
    refreshed: u32,
    /// Whether a text has changed since problems were told.
    has_changed: bool,
    /// By file, the problems that were told last.
    told: BTreeMap<PathBuf, Vec<Diagnostic>>,
}

impl<'c> Server<'c> {
    /// Serves the editor at the other end.
    pub(crate) fn run(
        connection: &'c Connection,
        compiler: &'c dyn Compiler,
    ) -> Result<(), ProtocolError> {
        let (id, params) = connection.initialize_start()?;
        let params: InitializeParams = serde_json::from_value(params).unwrap_or_default();
        let offered =
            params.capabilities.general.as_ref().and_then(|it| it.position_encodings.as_deref());
        let encoding = Encoding::chosen_of(offered);
        let of_workspace = params.capabilities.workspace.as_ref();
        let can_refresh_hints =
            of_workspace.and_then(|it| it.inlay_hint.as_ref()?.refresh_support).unwrap_or_default();
        let can_refresh_lenses =
            of_workspace.and_then(|it| it.code_lens.as_ref()?.refresh_support).unwrap_or_default();
        let mut settings: Settings = params
            .initialization_options
            .and_then(|it| serde_json::from_value(it).ok())
            .unwrap_or_default();
        if let Some(WorkspaceFolders::WorkspaceFolderList(folders)) =
            &params.workspace_folders_initialize_params.workspace_folders
            && let Some(folder) = folders.first()
        {
            settings.resolve(&path_of(&folder.uri));
        }
        let server_info = Some(ServerInfo {
            name: "plcc".into(),
            version: Some(env!("CARGO_PKG_VERSION").into()),
        });
        let result = InitializeResult { capabilities: capabilities(encoding.kind()), server_info };
        connection.initialize_finish(id, serde_json::to_value(result).unwrap_or_default())?;
        let mut server = Self {
            connection,
            compiler,
            documents: Documents::default(),
            workspace: Workspace::new(settings),
            encoding,
            sent_tokens: SentTokens::default(),
            shown: None,
            refreshes_hints: false,
            refreshes_lenses: false,
            can_refresh_hints,
            can_refresh_lenses,
            refreshed: 0,
            has_changed: false,
            told: BTreeMap::new(),
        };
        server.answer_all();
        Ok(())
    }

    /// Answers until the editor has said that it is going.
    fn answer_all(&mut self) {
        let mut waiting: VecDeque<Message> = VecDeque::new();
        loop {
            if waiting.is_empty() {
                if self.connection.receiver.is_empty() {
                    self.tell_problems();
                }
                let Ok(message) = self.connection.receiver.recv() else { return };
                waiting.push_back(message);
            }
            waiting.extend(self.connection.receiver.try_iter());
            self.drop_cancelled(&mut waiting);
            match waiting.pop_front() {
                Some(Message::Request(request)) => {
                    if request.method == "shutdown" {
                        self.send(Response::new_ok(request.id, ()).into());
                        self.wait_for_exit(&waiting);
                        return;
                    }
                    let is_old =
                        asks_about(&request).is_some_and(|uri| is_changed_in(&waiting, &uri));
                    let response = if is_old {
                        let why = "the text has been changed since".to_owned();
                        Response::new_err(request.id, ErrorCode::ContentModified as i32, why)
                    } else {
                        self.answer(request)
                    };
                    self.send(response.into());
                    self.refresh();
                }
                Some(Message::Notification(note)) => self.note(note),
                // What the editor says to a request to refresh changes nothing.
                Some(Message::Response(_)) | None => {}
            }
        }
    }

    /// Asks the editor to fetch its inlay hints or code lenses again, if they have changed without a change of a text.
    fn refresh(&mut self) {
        let hints = std::mem::take(&mut self.refreshes_hints) && self.can_refresh_hints;
        let lenses = std::mem::take(&mut self.refreshes_lenses) && self.can_refresh_lenses;
        for (is_asked, method) in
            [(hints, "workspace/inlayHint/refresh"), (lenses, "workspace/codeLens/refresh")]
        {
            if is_asked {
                self.refreshed = self.refreshed.wrapping_add(1);
                let id = RequestId::from(format!("refresh-{}", self.refreshed));
                self.send(Request::new(id, method.into(), ()).into());
            }
        }
    }

    /// Waits until the editor has said that it is gone, or its stream has ended.
    fn wait_for_exit(&self, waiting: &VecDeque<Message>) {
        let is_exit = |message: &Message| match message {
            Message::Notification(note) => note.method == "exit",
            Message::Request(_) | Message::Response(_) => false,
        };
        let _ =
            waiting.iter().any(is_exit) || self.connection.receiver.iter().any(|it| is_exit(&it));
    }

    /// Answers requests that a later message cancels, and takes them out.
    fn drop_cancelled(&self, waiting: &mut VecDeque<Message>) {
        let cancelled: Vec<RequestId> = waiting.iter().filter_map(cancelled_by).collect();
        if cancelled.is_empty() {
            return;
        }
        waiting.retain(|message| {
            let Message::Request(request) = message else { return cancelled_by(message).is_none() };
            let is_cancelled = cancelled.contains(&request.id);
            if is_cancelled {
                let (code, why) =
                    (ErrorCode::RequestCanceled as i32, "the editor cancelled it".to_owned());
                self.send(Response::new_err(request.id.clone(), code, why).into());
            }
            !is_cancelled
        });
    }

    /// Answers one request. A mistake of the server's own is an answer too.
    fn answer(&mut self, request: Request) -> Response {
        let id = request.id.clone();
        let answered = catch_unwind(AssertUnwindSafe(|| self.dispatch(request)));
        answered.unwrap_or_else(|_| {
            self.workspace.files_changed();
            let why = "a mistake of the server; please report what was asked".to_owned();
            Response::new_err(id, ErrorCode::InternalError as i32, why)
        })
    }

    fn send(&self, message: Message) {
        // An editor that is gone needs no answer; the loop ends with its stream.
        let _ = self.connection.sender.send(message);
    }

    /// Takes in what the editor says of its documents.
    fn note(&mut self, note: Notification) {
        fn params<N: gen_lsp_types::Notification>(value: Value) -> Option<N::Params>
        where
            N::Params: DeserializeOwned,
        {
            serde_json::from_value(value).ok()
        }
        match note.method.as_str() {
            "textDocument/didOpen" => {
                let Some(it) = params::<DidOpenTextDocumentNotification>(note.params) else {
                    return;
                };
                let it = it.text_document;
                let language: String = it.language_id.into();
                let dialect = dialect_of(&language);
                let document =
                    Document { uri: it.uri, version: it.version, text: it.text, dialect };
                let path = self.documents.open(document);
                self.changed(&path);
            }
            "textDocument/didChange" => {
                let Some(it) = params::<DidChangeTextDocumentNotification>(note.params) else {
                    return;
                };
                let path = path_of(&it.text_document.text_document_identifier.uri);
                let version = it.text_document.version;
                self.documents.change(&path, version, it.content_changes, self.encoding);
                self.changed(&path);
            }
            "textDocument/didClose" => {
                let Some(it) = params::<DidCloseTextDocumentNotification>(note.params) else {
                    return;
                };
                let path = path_of(&it.text_document.uri);
                self.documents.close(&path);
                self.sent_tokens.forget(&path);
                self.changed(&path);
            }
            "textDocument/didSave" | "workspace/didChangeWatchedFiles" => {
                self.workspace.files_changed();
                self.has_changed = true;
            }
            _ => {}
        }
    }

    fn changed(&mut self, path: &Path) {
        self.workspace.text_changed(path);
        self.has_changed = true;
    }

    /// Tells the problems of the programs of open documents where they have changed, and takes back those of files that are in
    /// no program any more.
    fn tell_problems(&mut self) {
        if !std::mem::take(&mut self.has_changed) {
            return;
        }
        let open: Vec<PathBuf> = self.documents.iter().map(|(path, _)| path.clone()).collect();
        let mut found: BTreeMap<PathBuf, Vec<Diagnostic>> = BTreeMap::new();
        for path in open {
            if let Some(document) = self.documents.get(&path).filter(|_| is_machine_file(&path)) {
                found.insert(path, problems(&document.text));
                continue;
            }
            if let Some(script) = self.script(&path) {
                let explains = self.workspace.settings.explain_links;
                let reading = || script.problems(self.compiler, explains);
                found.insert(path, catch_unwind(AssertUnwindSafe(reading)).unwrap_or_default());
                continue;
            }
            let reading = || self.workspace.program(&path, &self.documents, self.encoding);
            let Some(program) = catch_unwind(AssertUnwindSafe(reading)).ok().flatten() else {
                continue;
            };
            let explains = self.workspace.settings.explain_links;
            for file in program.files() {
                let of_file = found.entry(program.path(file).to_owned());
                of_file.or_insert_with(|| {
                    diagnostics::of_file(&program, file, &self.documents, explains)
                });
            }
        }
        let told = std::mem::take(&mut self.told);
        for (path, problems) in &found {
            if told.get(path) != Some(problems) {
                self.publish(path, problems.clone());
            }
        }
        for gone in told.keys().filter(|path| !found.contains_key(*path)) {
            self.publish(gone, vec![]);
        }
        self.told = found;
    }

    fn publish(&self, path: &Path, diagnostics: Vec<Diagnostic>) {
        let Some(uri) = self.documents.uri(path) else { return };
        let version = self.documents.get(path).map(|document| document.version);
        let params = PublishDiagnosticsParams { uri, version, diagnostics };
        let method: String = PublishDiagnosticsNotification::METHOD.into();
        self.send(Notification::new(method, params).into());
    }
}

/// The request that a message cancels.
fn cancelled_by(message: &Message) -> Option<RequestId> {
    let Message::Notification(note) = message else { return None };
    if note.method != "$/cancelRequest" {
        return None;
    }
    match note.params.get("id")? {
        Value::Number(number) => Some(RequestId::from(i32::try_from(number.as_i64()?).ok()?)),
        Value::String(text) => Some(RequestId::from(text.clone())),
        _ => None,
    }
}

/// The address of the document that a request is about.
fn asks_about(request: &Request) -> Option<String> {
    let uri = request.params.get("textDocument")?.get("uri")?.as_str()?;
    Some(uri.to_owned())
}

/// Whether a document is changed by a message that waits.
fn is_changed_in(waiting: &VecDeque<Message>, uri: &str) -> bool {
    waiting.iter().any(|message| {
        let Message::Notification(note) = message else { return false };
        let about = || note.params.get("textDocument")?.get("uri")?.as_str();
        note.method == "textDocument/didChange" && about() == Some(uri)
    })
}
