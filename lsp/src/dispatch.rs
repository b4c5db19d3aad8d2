//! Which request is answered by which feature.

use std::path::Path;
use std::rc::Rc;

use gen_lsp_types::{
    CallHierarchyIncomingCallsRequest, CallHierarchyItem, CallHierarchyOutgoingCallsRequest,
    CallHierarchyPrepareRequest, CodeActionRequest, CodeLensRequest, CompletionRequest,
    DeclarationRequest, DefinitionRequest, DocumentFormattingRequest, DocumentHighlightRequest,
    DocumentLinkRequest, DocumentSymbolRequest, FoldingRangeRequest, HoverRequest,
    InlayHintRequest, InlineValueRequest, LspRequestMethod as Method, Position,
    PrepareRenameRequest, Range, ReferencesRequest, RenameRequest, SelectionRangeRequest,
    SemanticTokensDeltaRequest, SemanticTokensRangeRequest, SemanticTokensRequest,
    SignatureHelpRequest, TextDocumentIdentifier, TextDocumentPositionParams,
    WorkspaceSymbolRequest,
};
use lsp_server::{ErrorCode, Request, Response};
use plcc_diag::{FileId, Span};
use serde_json::Value;

use crate::documents::path_of;
use crate::features::machine_file::{MachineText, is_machine_file, source_of};
use crate::features::script::{Script, is_script};
use crate::features::{
    call_hierarchy, code_actions, code_lens, completion, folding, formatting, hover, inlay_hints,
    inline_values, links, navigation, rename, selection, semantic_tokens, signature, symbols,
    values,
};
use crate::program::{At, Program};
use crate::server::Server;

/// Answers a request of the type `R`.
fn respond<R: gen_lsp_types::Request>(
    request: Request,
    answer: impl FnOnce(R::Params) -> Result<R::Result, String>,
) -> Response {
    respond_with::<R>(request, |params| {
        serde_json::to_value(answer(params)?).map_err(|error| error.to_string())
    })
}

/// Does the same where the answer has the protocol's form already.
fn respond_with<R: gen_lsp_types::Request>(
    request: Request,
    answer: impl FnOnce(R::Params) -> Result<Value, String>,
) -> Response {
    let Request { id, params, .. } = request;
    let params: R::Params = match serde_json::from_value(params) {
        Ok(params) => params,
        Err(error) => {
            return Response::new_err(id, ErrorCode::InvalidParams as i32, error.to_string());
        }
    };
    match answer(params) {
        Ok(result) => Response { id, response_result: Ok(result) },
        Err(why) => Response::new_err(id, ErrorCode::RequestFailed as i32, why),
    }
}

impl Server<'_> {
    /// Answers a request.
    pub(crate) fn dispatch(&mut self, request: Request) -> Response {
        match Method::from(request.method.as_str()) {
            Method::TextDocumentHover => respond::<HoverRequest>(request, |it| {
                let place = &it.text_document_position_params;
                let at = place.position;
                let found =
                    self.in_script(place, |script, program| script.hover(at, program)).or_else(
                        || self.in_machine_file(place, |file, program| file.hover(at, program)),
                    );
                Ok(found.or_else(|| self.at(place, hover::hover)).flatten())
            }),
            Method::TextDocumentDefinition => respond::<DefinitionRequest>(request, |it| {
                Ok(self.at(&it.text_document_position_params, navigation::definition).flatten())
            }),
            Method::TextDocumentDeclaration => respond::<DeclarationRequest>(request, |it| {
                Ok(self.at(&it.text_document_position_params, navigation::declaration).flatten())
            }),
            Method::TextDocumentReferences => respond::<ReferencesRequest>(request, |it| {
                let all = it.context.include_declaration;
                Ok(self.at(&it.text_document_position_params, |at| navigation::references(at, all)))
            }),
            Method::TextDocumentDocumentHighlight => {
                respond::<DocumentHighlightRequest>(request, |it| {
                    Ok(self.at(&it.text_document_position_params, navigation::highlights))
                })
            }
            Method::TextDocumentDocumentSymbol => respond::<DocumentSymbolRequest>(request, |it| {
                Ok(self.file(&it.text_document, symbols::of_document))
            }),
            Method::WorkspaceSymbol => respond::<WorkspaceSymbolRequest>(request, |it| {
                self.read_open();
                Ok(Some(symbols::of_workspace(&it.query, self.workspace.known(), &self.documents)))
            }),
            Method::TextDocumentCompletion => respond::<CompletionRequest>(request, |it| {
                let place = &it.text_document_position_params;
                let at = place.position;
                let found = self
                    .in_script(place, |script, program| script.completion(at, program))
                    .or_else(|| {
                        self.in_machine_file(place, |file, program| file.completion(at, program))
                    });
                Ok(found.or_else(|| self.at(place, completion::completion)))
            }),
            Method::TextDocumentSignatureHelp => respond::<SignatureHelpRequest>(request, |it| {
                Ok(self.at(&it.text_document_position_params, signature::help).flatten())
            }),
            Method::TextDocumentPrepareRename => respond::<PrepareRenameRequest>(request, |it| {
                self.at(&it.text_document_position_params, rename::prepare).transpose()
            }),
            Method::TextDocumentRename => respond::<RenameRequest>(request, |it| {
                let compiler = self.compiler;
                let new = it.new_name;
                self.at(&it.text_document_position_params, |at| rename::rename(at, &new, compiler))
                    .transpose()
            }),
            Method::TextDocumentCodeAction => respond::<CodeActionRequest>(request, |it| {
                Ok(self.range(&it.text_document, it.range, code_actions::code_actions))
            }),
            Method::TextDocumentCodeLens => respond::<CodeLensRequest>(request, |it| {
                let of_script = self.script(&path_of(&it.text_document.uri));
                let of_script = of_script.map(|script| script.code_lens(&it.text_document.uri));
                let shown = self.shown.as_ref().map(|it| it.file().to_owned());
                let of_program = || {
                    self.file(&it.text_document, |at| {
                        let is_shown = shown.is_some_and(|file| at.program.file(&file).is_some());
                        code_lens::code_lens(at, is_shown)
                    })
                };
                Ok(of_script.or_else(of_program))
            }),
            Method::TextDocumentDocumentLink => respond::<DocumentLinkRequest>(request, |it| {
                Ok(self.file(&it.text_document, links::links))
            }),
            Method::TextDocumentFormatting => respond::<DocumentFormattingRequest>(request, |it| {
                self.file(&it.text_document, |at| formatting::format(at, &it.options)).transpose()
            }),
            Method::TextDocumentFoldingRange => respond::<FoldingRangeRequest>(request, |it| {
                Ok(self.file(&it.text_document, folding::folding))
            }),
            Method::TextDocumentSelectionRange => respond::<SelectionRangeRequest>(request, |it| {
                Ok(self.file(&it.text_document, |at| selection::selection(at, &it.positions)))
            }),
            Method::TextDocumentPrepareCallHierarchy => {
                respond::<CallHierarchyPrepareRequest>(request, |it| {
                    Ok(self
                        .at(&it.text_document_position_params, call_hierarchy::prepare)
                        .flatten())
                })
            }
            Method::CallHierarchyIncomingCalls => {
                respond::<CallHierarchyIncomingCallsRequest>(request, |it| {
                    Ok(self.item(&it.item, call_hierarchy::incoming))
                })
            }
            Method::CallHierarchyOutgoingCalls => {
                respond::<CallHierarchyOutgoingCallsRequest>(request, |it| {
                    Ok(self.item(&it.item, call_hierarchy::outgoing))
                })
            }
            Method::TextDocumentSemanticTokensFull => {
                respond_with::<SemanticTokensRequest>(request, |it| {
                    let mut sent = std::mem::take(&mut self.sent_tokens);
                    let tokens = self.file(&it.text_document, |at| sent.full(at));
                    self.sent_tokens = sent;
                    Ok(tokens.as_ref().map_or(Value::Null, semantic_tokens::json))
                })
            }
            Method::TextDocumentSemanticTokensFullDelta => {
                respond::<SemanticTokensDeltaRequest>(request, |it| {
                    let mut sent = std::mem::take(&mut self.sent_tokens);
                    let previous = &it.previous_result_id;
                    let changes = self.file(&it.text_document, |at| sent.since(previous, at));
                    self.sent_tokens = sent;
                    Ok(changes)
                })
            }
            Method::TextDocumentSemanticTokensRange => {
                respond::<SemanticTokensRangeRequest>(request, |it| {
                    Ok(self.range(&it.text_document, it.range, |at, span| {
                        semantic_tokens::tokens(at, Some(span))
                    }))
                })
            }
            Method::TextDocumentInlineValue => respond::<InlineValueRequest>(request, |it| {
                let shown = Range { end: it.context.stopped_location.end, ..it.range };
                Ok(self.range(&it.text_document, shown, inline_values::inline_values))
            }),
            Method::TextDocumentInlayHint => respond::<InlayHintRequest>(request, |it| {
                let mut shown = self.shown.take();
                // Where values are shown, what else could stand there would hide them.
                let hints = self.range(&it.text_document, it.range, |at, part| {
                    let of_run = shown.as_mut().filter(|it| at.program.file(it.file()).is_some());
                    match of_run {
                        Some(run) => values::values(at, part, run),
                        None => inlay_hints::inlay_hints(at, part),
                    }
                });
                self.shown = shown;
                Ok(hints)
            }),
            _ => self.own_request(request).unwrap_or_else(|request| {
                let why = format!("the server does not know the request {}", request.method);
                Response::new_err(request.id, ErrorCode::MethodNotFound as i32, why)
            }),
        }
    }

    /// Reads the programs of all open documents.
    fn read_open(&mut self) {
        let open: Vec<_> = self.documents.iter().map(|(path, _)| path.clone()).collect();
        for path in open {
            self.workspace.program(&path, &self.documents, self.encoding);
        }
    }

    /// The program of a document, and the document's file in it. `None` if it is in no language.
    fn program(&mut self, document: &TextDocumentIdentifier) -> Option<(Rc<Program>, FileId)> {
        let path = path_of(&document.uri);
        let program = self.workspace.program(&path, &self.documents, self.encoding)?;
        let file = program.file(&path)?;
        Some((program, file))
    }

    /// What a feature says of a position.
    fn at<T>(
        &mut self,
        of: &TextDocumentPositionParams,
        feature: impl FnOnce(At<'_>) -> T,
    ) -> Option<T> {
        let (program, file) = self.program(&of.text_document)?;
        let offset = self.encoding.offset(&program.sources, file, of.position);
        Some(feature(At { program: &program, documents: &self.documents, file, offset }))
    }

    /// The test script with a path, if it is one that the editor has open.
    pub(crate) fn script(&self, path: &Path) -> Option<Script> {
        let document = self.documents.get(path).filter(|_| is_script(path))?;
        Some(Script::new(path, &document.text, self.encoding))
    }

    /// What a feature says of a test script and the program that it tests; `None` if the document is not a script.
    fn in_script<T>(
        &mut self,
        of: &TextDocumentPositionParams,
        feature: impl FnOnce(&Script, Option<&Program>) -> T,
    ) -> Option<T> {
        let script = self.script(&path_of(&of.text_document.uri))?;
        let named = script.program();
        let program =
            named.and_then(|path| self.workspace.program(&path, &self.documents, self.encoding));
        Some(feature(&script, program.as_deref()))
    }

    /// What a feature says of a machine file and the program that it belongs to; `None` if the document is not a machine file.
    fn in_machine_file<T>(
        &mut self,
        of: &TextDocumentPositionParams,
        feature: impl FnOnce(&MachineText, Option<&Program>) -> T,
    ) -> Option<T> {
        let path = path_of(&of.text_document.uri);
        let document = self.documents.get(&path).filter(|_| is_machine_file(&path))?;
        let text = MachineText::new(&path, &document.text, self.encoding);
        let source = source_of(&path, &self.documents);
        let program =
            source.and_then(|it| self.workspace.program(&it, &self.documents, self.encoding));
        Some(feature(&text, program.as_deref()))
    }

    /// What a feature says of a document.
    fn file<T>(
        &mut self,
        of: &TextDocumentIdentifier,
        feature: impl FnOnce(At<'_>) -> T,
    ) -> Option<T> {
        let position = Position { line: 0, character: 0 };
        self.at(&TextDocumentPositionParams { text_document: of.clone(), position }, feature)
    }

    /// What a feature says of a part of a document.
    fn range<T>(
        &mut self,
        of: &TextDocumentIdentifier,
        range: Range,
        feature: impl FnOnce(At<'_>, Span) -> T,
    ) -> Option<T> {
        let encoding = self.encoding;
        self.file(of, |at| {
            let offset = |position| encoding.offset(&at.program.sources, at.file, position);
            let (start, end) = (offset(range.start), offset(range.end));
            feature(at, Span { file: at.file, start, end: end.max(start) })
        })
    }

    /// What a feature says of an item of the call hierarchy.
    fn item<T>(
        &mut self,
        item: &CallHierarchyItem,
        feature: impl FnOnce(At<'_>) -> Option<T>,
    ) -> Option<T> {
        let text_document = TextDocumentIdentifier { uri: item.uri.clone() };
        let position = item.selection_range.start;
        self.at(&TextDocumentPositionParams { text_document, position }, feature).flatten()
    }
}
