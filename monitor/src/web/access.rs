//! Who may see the page and speak with the server.
//!
//! Every program of every user of this machine can connect to a loopback address, and so can every page
//! that a browser shows, also under a foreign name that its owner lets point to 127.0.0.1 (DNS rebinding).
//! Therefore:
//!
//! - The address that is printed has a *token*, a random number that is valid once. The browser gets two
//!   other random numbers for it: a *cookie* (`HttpOnly`, `SameSite=Strict`), without which no page is
//!   given, and a *key*. Browsers send a cookie to all ports of a host, also to those of other users'
//!   programs. The key stays within the page's origin, port included; a WebSocket needs both. Behind the key's random digits is
//!   the number of the browser, by which it has a tick of its own.
//! - The `Host` of each request must be `localhost` or a literal address, never a name.
//! - The `Origin`, which a WebSocket must have, must be that host. Requests that a browser makes on behalf
//!   of other sites (`Sec-Fetch-Site`) are refused.

use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::{Mutex, PoisonError};

use axum::http::HeaderMap;
use axum::http::header::{COOKIE, HOST, ORIGIN, SEC_WEBSOCKET_PROTOCOL};

use super::WebError;

/// The name of the WebSocket's protocol. The key follows it in the same header.
pub(super) const PROTOCOL: &str = "plcc-monitor";

/// The random numbers, and where the server listens.
pub(super) struct Access {
    address: SocketAddr,
    /// The token of the address that was printed last.
    token: Mutex<String>,
    cookie: String,
    key: String,
    /// How many browsers have got a key.
    browsers: AtomicU16,
    announce: Box<dyn Fn(&str) + Send + Sync>,
}

impl Access {
    pub(super) fn new(
        address: SocketAddr,
        announce: Box<dyn Fn(&str) + Send + Sync>,
    ) -> Result<Self, WebError> {
        let (token, cookie, key) = (Mutex::new(random()?), random()?, random()?);
        Ok(Self { address, token, cookie, key, browsers: AtomicU16::new(0), announce })
    }

    /// The page's address with the present token.
    pub(super) fn url(&self) -> String {
        let token = self.token.lock().unwrap_or_else(PoisonError::into_inner);
        // An address that stands for all of a machine's is none that a browser can open.
        let mut shown = self.address;
        if shown.ip().is_unspecified() {
            shown.set_ip(IpAddr::from([127, 0, 0, 1]));
        }
        format!("http://{shown}/?token={token}")
    }

    /// Takes a token, which is not valid any more then, and announces the next one. Gives whether it was
    /// valid.
    pub(super) fn take_token(&self, given: &str) -> bool {
        {
            let mut token = self.token.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(next) = random().ok().filter(|_| same(given, &token)) else { return false };
            *token = next;
        }
        (self.announce)(&self.url());
        true
    }

    /// The key that the next browser gets for the token.
    pub(super) fn next_key(&self) -> String {
        format!("{}{:04x}", self.key, self.browsers.fetch_add(1, Ordering::Relaxed))
    }

    fn cookie_name(&self) -> String {
        format!("plcc-monitor-{}", self.address.port())
    }

    /// The value of the header `Set-Cookie` that a browser gets for the token.
    pub(super) fn set_cookie(&self) -> String {
        format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie_name(), self.cookie)
    }

    /// Whether a request has the cookie.
    pub(super) fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let name = self.cookie_name();
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        cookies
            .flat_map(|value| value.split(';'))
            .filter_map(|cookie| cookie.trim().split_once('='))
            .any(|(found, value)| found == name && same(value, &self.cookie))
    }

    /// The number of the browser, if a request has its key among the names of WebSocket protocols.
    pub(super) fn browser(&self, headers: &HeaderMap) -> Option<u16> {
        let values = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter();
        values.filter_map(|value| value.to_str().ok()).flat_map(|value| value.split(',')).find_map(
            |name| {
                let (key, number) = name.trim().split_at_checked(self.key.len())?;
                let number =
                    (number.len() == 4).then(|| u16::from_str_radix(number, 16).ok())??;
                same(key, &self.key).then_some(number)
            },
        )
    }

    /// Whether a request was sent to this server, and by a page of it, or by none.
    ///
    /// # Errors
    /// Why it is refused.
    pub(super) fn check_site(&self, headers: &HeaderMap) -> Result<(), &'static str> {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or(""));
        let mut hosts = headers.get_all(HOST).iter();
        let (Some(host), None) = (hosts.next(), hosts.next()) else {
            return Err("the request has not one Host");
        };
        let host = host.to_str().unwrap_or("");
        if !self.is_own_host(host) {
            return Err("open the page by 127.0.0.1 or another literal address, not by a name");
        }
        if text(ORIGIN.as_str()).is_some_and(|origin| origin != format!("http://{host}")) {
            return Err("the request comes from a page of another origin");
        }
        match text("sec-fetch-site") {
            None | Some("same-origin" | "none") => Ok(()),
            Some(_) => Err("the request comes from a page of another site"),
        }
    }

    /// Whether a browser has sent the page's origin, as it does for WebSockets.
    /// [`check_site`](Self::check_site) has compared it.
    pub(super) fn has_origin(headers: &HeaderMap) -> bool {
        headers.contains_key(ORIGIN)
    }

    /// `localhost` and literal addresses at which this server can be reached. The port may be another
    /// one, since an SSH tunnel may begin at any.
    fn is_own_host(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.parse::<u16>().is_ok() => name,
            _ => host,
        };
        let listens = self.address.ip();
        if name.eq_ignore_ascii_case("localhost") {
            return true;
        }
        let literal = name.strip_prefix('[').and_then(|name| name.strip_suffix(']'));
        let Ok(literal) = literal.unwrap_or(name).parse::<IpAddr>() else { return false };
        literal.is_loopback() || listens.is_unspecified() || literal == listens
    }
}

/// 32 random bytes in hexadecimal.
fn random() -> Result<String, WebError> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|error| WebError::Random(error.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Whether two texts are the same. The time depends on their lengths alone, so that nobody can find one
/// digit after the other by measuring it.
fn same(left: &str, right: &str) -> bool {
    let bytes = left.bytes().zip(right.bytes());
    left.len() == right.len() && bytes.fold(0, |differs, (one, other)| differs | (one ^ other)) == 0
}

#[cfg(test)]
mod tests {
    use axum::http::{HeaderName, HeaderValue};

    use super::*;

    fn access(address: &str) -> Access {
        Access::new(address.parse().unwrap(), Box::new(|_| ())).unwrap()
    }

    fn headers(lines: &[(&'static str, &str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(HeaderName::from_static(name), HeaderValue::from_str(value).unwrap());
        }
        headers
    }

    #[test]
    fn a_token_is_valid_once() {
        let access = access("127.0.0.1:7400");
        let url = access.url();
        let token = url.strip_prefix("http://127.0.0.1:7400/?token=").unwrap().to_owned();
        assert_eq!(token.len(), 64);
        assert!(!access.take_token(&token[1..]));
        assert!(!access.take_token(""));
        assert!(access.take_token(&token));
        assert!(!access.take_token(&token));
        assert_ne!(access.url(), url);
    }

    #[test]
    fn hosts_are_literal_addresses() {
        let access = access("127.0.0.1:7400");
        for host in ["127.0.0.1:7400", "localhost:7400", "localhost", "[::1]:9000", "127.0.0.2"] {
            assert_eq!(access.check_site(&headers(&[("host", host)])), Ok(()), "{host}");
        }
        let others = [
            "",
            "evil.example",
            "evil.example:7400",
            "localhost.evil.example",
            "192.168.0.7:7400",
            "127.0.0.1.nip.io:7400",
            "127.0.0.1:7400.evil.example",
            "localhost:99999",
        ];
        for host in others {
            assert!(access.check_site(&headers(&[("host", host)])).is_err(), "{host}");
        }
        assert!(access.check_site(&headers(&[])).is_err());
        let two = headers(&[("host", "localhost"), ("host", "evil.example")]);
        assert!(access.check_site(&two).is_err());
    }

    #[test]
    fn hosts_of_a_server_that_others_can_reach() {
        let one = access("192.168.0.7:7400");
        assert!(one.check_site(&headers(&[("host", "192.168.0.7:7400")])).is_ok());
        assert!(one.check_site(&headers(&[("host", "192.168.0.8:7400")])).is_err());
        let all = access("0.0.0.0:7400");
        assert!(all.check_site(&headers(&[("host", "192.168.0.8:7400")])).is_ok());
        assert!(all.check_site(&headers(&[("host", "controller.lan:7400")])).is_err());
        assert!(all.url().starts_with("http://127.0.0.1:7400/"));
    }

    #[test]
    fn origins_are_this_server() {
        let access = access("127.0.0.1:7400");
        let of = |lines: &[(&'static str, &str)]| access.check_site(&headers(lines));
        let host = ("host", "127.0.0.1:7400");
        assert!(of(&[host, ("origin", "http://127.0.0.1:7400")]).is_ok());
        for origin in
            ["http://127.0.0.1:8000", "http://localhost:7400", "null", "https://127.0.0.1:7400"]
        {
            assert!(of(&[host, ("origin", origin)]).is_err(), "{origin}");
        }
        assert!(of(&[host, ("sec-fetch-site", "none")]).is_ok());
        assert!(of(&[host, ("sec-fetch-site", "same-origin")]).is_ok());
        assert!(of(&[host, ("sec-fetch-site", "same-site")]).is_err());
        assert!(of(&[host, ("sec-fetch-site", "cross-site")]).is_err());
    }

    #[test]
    fn a_browser_shows_cookie_and_key() {
        let access = access("127.0.0.1:7400");
        let set = access.set_cookie();
        let cookie = set.split(';').next().unwrap();
        assert!(set.ends_with("; Path=/; HttpOnly; SameSite=Strict"));
        assert!(access.has_cookie(&headers(&[("cookie", &format!("a=b; {cookie}"))])));
        assert!(!access.has_cookie(&headers(&[("cookie", "plcc-monitor-7400=")])));
        assert!(!access.has_cookie(&headers(&[])));
        let browser = |key: &str| {
            let value = format!("{PROTOCOL}, {key}");
            access.browser(&headers(&[("sec-websocket-protocol", &value)]))
        };
        let key = access.next_key();
        // Each browser has a number.
        assert_eq!((browser(&key), browser(&access.next_key())), (Some(0), Some(1)));
        assert_eq!(
            (browser(""), browser(&key[1..]), browser(&key[..key.len() - 4])),
            (None, None, None)
        );
        assert!(!key.contains(&access.cookie));
    }
}
