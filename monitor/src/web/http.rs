//! Connections and HTTP: the page's files, the exchange of the token, the way to the WebSocket.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Request as HttpRequest, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, LOCATION, REFERRER_POLICY,
    SET_COOKIE, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc};

use super::access::{Access, PROTOCOL};
use super::assets::{PAGE, asset};
use super::clients::Request;
use super::{client, limits};

/// What every request needs.
struct Shared {
    access: Arc<Access>,
    requests: mpsc::Sender<Request>,
    clients: Arc<Semaphore>,
}

/// Serves connections until the program ends.
pub(super) async fn serve(
    listener: TcpListener,
    access: Arc<Access>,
    requests: mpsc::Sender<Request>,
) {
    let connections = Arc::new(Semaphore::new(limits::MAX_CONNECTIONS));
    let clients = Arc::new(Semaphore::new(limits::MAX_CLIENTS));
    let router = router(Arc::new(Shared { access, requests, clients }));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // No file descriptor is free, say.
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        let Ok(permit) = Arc::clone(&connections).try_acquire_owned() else { continue };
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let connection = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(limits::HEAD_TIME)
                .max_buf_size(limits::LONGEST_HEAD)
                .serve_connection(TokioIo::new(stream), service)
                .with_upgrades();
            // A connection that fails is the browser's affair.
            let _ = connection.await;
            drop(permit);
        });
    }
}

fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/socket", get(socket))
        .fallback(get(file))
        .layer(from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared)
}

/// Refuses what comes from elsewhere, before anything else is looked at, and says in every response what
/// the page may do.
async fn guard(State(shared): State<Arc<Shared>>, request: HttpRequest, next: Next) -> Response {
    let host = request.headers().get(HOST).cloned();
    let mut response = match shared.access.check_site(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(reason) => refused(StatusCode::FORBIDDEN, reason),
    };
    // Browsers whose 'self' leaves out WebSockets need the address. The host has been checked by now.
    let host = host
        .as_ref()
        .and_then(|host| host.to_str().ok())
        .filter(|_| response.status().is_success());
    let socket = host.map(|host| format!(" ws://{host}")).unwrap_or_default();
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; \
         connect-src 'self'{socket}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let headers = response.headers_mut();
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        headers.insert(CONTENT_SECURITY_POLICY, policy);
    }
    for (name, value) in [
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (X_FRAME_OPTIONS, "DENY"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn refused(status: StatusCode, reason: &str) -> Response {
    (status, [(CONTENT_TYPE, "text/plain; charset=utf-8")], format!("{reason}\n")).into_response()
}

fn no_cookie() -> Response {
    refused(
        StatusCode::FORBIDDEN,
        "This browser is not known. Each address that `plcc monitor` prints opens one browser, once; take \
         the newest one.",
    )
}

/// The page; with a token, the way to it. The key follows `#`: browsers do not send that part of
/// an address to a server, but the page can read it.
async fn page(State(shared): State<Arc<Shared>>, uri: Uri, headers: HeaderMap) -> Response {
    let access = &shared.access;
    let token = uri.query().and_then(|query| query.strip_prefix("token="));
    match token {
        Some(token) if access.take_token(token) => {
            let target = format!("/#key={}", access.next_key());
            let headers = [(LOCATION, target), (SET_COOKIE, access.set_cookie())];
            (StatusCode::SEE_OTHER, headers).into_response()
        }
        // The address was opened once more by a browser that is known.
        Some(_) if access.has_cookie(&headers) => {
            (StatusCode::SEE_OTHER, [(LOCATION, "/")]).into_response()
        }
        Some(_) => no_cookie(),
        None => given(access, &headers, PAGE),
    }
}

async fn file(State(shared): State<Arc<Shared>>, uri: Uri, headers: HeaderMap) -> Response {
    given(&shared.access, &headers, uri.path())
}

fn given(access: &Access, headers: &HeaderMap, path: &str) -> Response {
    if !access.has_cookie(headers) {
        return no_cookie();
    }
    match asset(path) {
        Some(asset) => ([(CONTENT_TYPE, asset.content_type)], asset.bytes).into_response(),
        None => refused(StatusCode::NOT_FOUND, "there is no such file"),
    }
}

/// The WebSocket of a page.
async fn socket(
    State(shared): State<Arc<Shared>>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    let browser = shared.access.browser(&headers).filter(|_| shared.access.has_cookie(&headers));
    let Some(browser) = browser else { return no_cookie() };
    if !Access::has_origin(&headers) {
        return refused(StatusCode::FORBIDDEN, "a page's WebSocket has an Origin");
    }
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(rejection) => return rejection.into_response(),
    };
    let Ok(permit) = Arc::clone(&shared.clients).try_acquire_owned() else {
        return refused(StatusCode::SERVICE_UNAVAILABLE, "too many pages are open");
    };
    let requests = shared.requests.clone();
    upgrade
        .protocols([PROTOCOL])
        .max_message_size(limits::LONGEST_MESSAGE)
        .max_frame_size(limits::LONGEST_MESSAGE)
        .on_upgrade(move |socket| async move {
            client::serve(socket, browser, requests).await;
            drop(permit);
        })
}
