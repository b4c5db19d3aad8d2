//! The WebSocket of one page, in the server's thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::{interval, timeout};

use super::clients::{Request, Shown};
use super::{limits, protocol};

/// Serves a page until it leaves, hangs, or sends what is not a message.
pub(super) async fn serve(mut socket: WebSocket, browser: u16, requests: mpsc::Sender<Request>) {
    let (sender, mut views) = watch::channel(Utf8Bytes::default());
    let shown = Arc::new(Shown { browser, views: sender, was_sent: AtomicBool::new(true) });
    let mut ping = interval(limits::PING_TIME);
    let mut heard = Instant::now();
    loop {
        let mut is_view = false;
        let outgoing = tokio::select! {
            message = socket.recv() => {
                heard = Instant::now();
                match message {
                    Some(Ok(Message::Text(text))) => match answer(&text, &shown, &requests).await {
                        Some(text) => Message::Text(text),
                        None => break,
                    },
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                    Some(Ok(Message::Binary(_))) => closing(close_code::UNSUPPORTED, "texts only"),
                    Some(Ok(Message::Close(_))) | None => break,
                    // Too long a message among others.
                    Some(Err(_)) => closing(close_code::POLICY, "this is not a message of the page"),
                }
            }
            // The sender is kept here, so that there always is one.
            _ = views.changed() => {
                is_view = true;
                Message::Text(views.borrow_and_update().clone())
            }
            _ = ping.tick() => {
                if heard.elapsed() > 3 * limits::PING_TIME {
                    break;
                }
                Message::Ping(Default::default())
            }
        };
        let is_last = matches!(outgoing, Message::Close(_));
        match timeout(limits::SEND_TIME, socket.send(outgoing)).await {
            Ok(Ok(())) if !is_last => {}
            _ => break,
        }
        if is_view {
            shown.was_sent.store(true, Ordering::Release);
        }
    }
}

fn closing(code: u16, reason: &'static str) -> Message {
    Message::Close(Some(CloseFrame { code, reason: Utf8Bytes::from_static(reason) }))
}

/// The answer to a message; `None` when there is no session any more.
async fn answer(
    text: &str,
    shown: &Arc<Shown>,
    requests: &mpsc::Sender<Request>,
) -> Option<Utf8Bytes> {
    let (id, content) = protocol::read(text);
    let content = match content {
        Ok(content) => content,
        Err(refusal) => return Some(protocol::result(id, &Err(refusal)).into()),
    };
    let (answer, answered) = oneshot::channel();
    let request = Request { id, content, shown: Arc::clone(shown), answer };
    requests.send(request).await.ok()?;
    answered.await.ok()
}
