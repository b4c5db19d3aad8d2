//! The requests that the Language Server Protocol does not have: the page of a diagnostic, the values of a run, and their reasons.

use lsp_server::{ErrorCode, Request, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::documents::path_of;
use crate::features::diagnostics;
use crate::run::{Change, ShowValues, Shown, ShownRun, Why};
use crate::server::Server;

/// What a request of ours gives, or why it gives nothing.
fn answered<T: DeserializeOwned, R: Serialize>(
    request: Request,
    answer: impl FnOnce(T) -> Result<R, String>,
) -> Response {
    let failed =
        |why: String| Response::new_err(request.id.clone(), ErrorCode::InvalidParams as i32, why);
    match serde_json::from_value(request.params).map_err(|error| error.to_string()).and_then(answer)
    {
        Ok(result) => Response::new_ok(request.id, result),
        Err(why) => failed(why),
    }
}

impl Server<'_> {
    /// Answers a request `plcc/…`; gives one back that is none of them.
    pub(crate) fn own_request(&mut self, request: Request) -> Result<Response, Request> {
        Ok(match request.method.as_str() {
            "plcc/explain" => answered(request, |it: Value| {
                let code = it.get("code").and_then(Value::as_str).unwrap_or_default();
                let page = diagnostics::page(code);
                page.ok_or_else(|| format!("`{code}` is not the code of a diagnostic"))
            }),
            "plcc/showValues" => answered(request, |it| self.show_values(&it)),
            "plcc/hideValues" => answered(request, |_: Value| {
                self.shown = None;
                (self.refreshes_hints, self.refreshes_lenses) = (true, true);
                Ok(())
            }),
            "plcc/why" => answered(request, |it: Why| {
                let shown = self.shown.as_mut();
                let shown = shown.ok_or("no run is shown: plcc/showValues comes first")?;
                Ok(serde_json::json!({ "text": shown.why(&it.name)? }))
            }),
            "plcc/change" => answered(request, |it: Change| {
                let shown = self.shown.as_mut();
                let shown = shown.ok_or("no control is shown: plcc/showValues comes first")?;
                let tick = shown.change(&it)?;
                self.refreshes_hints = true;
                Ok(serde_json::json!({ "tick": tick }))
            }),
            _ => return Err(request),
        })
    }

    /// Shows the values of a run, or of another tick of the one that is shown.
    fn show_values(&mut self, wanted: &ShowValues) -> Result<Shown, String> {
        let of = path_of(&wanted.text_document.uri);
        let path = of.parent().map_or_else(Default::default, |it| it.join(&wanted.run));
        // Another run takes the place of the one that is shown when it has been opened.
        if !self.shown.as_ref().is_some_and(|shown| shown.is(&of, &path)) {
            let run = self.compiler.open_run(&path, &of)?;
            self.shown = Some(ShownRun::new(of, path, run));
            self.refreshes_lenses = true;
        }
        self.refreshes_hints = true;
        let shown = self.shown.as_mut().ok_or("no run is shown")?;
        shown.go_to(wanted.tick)
    }
}
