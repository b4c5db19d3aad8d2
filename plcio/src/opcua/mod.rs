//! A server for OPC UA: the variables of the program as an address space that clients browse, read and
//! subscribe to. They write the points of the driver `opcua` that are given from outside, and nothing else.
//!
//! | file | holds |
//! | --- | --- |
//! | `address_space.rs` | a node for each variable, and its value |
//! | `users.rs` | who gets in, and who may write |
//! | `certificates.rs` | the server's certificate, and those of clients that are not trusted |
//!
//! The server has a thread of its own, so that clients that ask much, and the arithmetic of its ciphers,
//! don't delay the other drivers.

mod address_space;
mod certificates;
mod users;

use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use opcua::crypto::SecurityPolicy;
use opcua::server::diagnostics::NamespaceMetadata;
use opcua::server::node_manager::memory::{SimpleNodeManager, simple_node_manager};
use opcua::server::{
    ANONYMOUS_USER_TOKEN_ID, Server as OpcUaServer, ServerBuilder, ServerEndpoint, ServerHandle,
};
use opcua::types::MessageSecurityMode;
use plcc_configuration::drivers::opcua::Settings;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use address_space::Nodes;
use certificates::Certificates;
use users::Users;

use crate::driver::{Driver, Making, Stages, Start, has_left};
use crate::session::Shared;

/// The most sessions at once.
const SESSIONS: usize = 16;
/// How often values are compared with those that clients have, unless `poll_ms` is longer.
const PERIOD: Duration = Duration::from_millis(20);
/// After how many periods the folder of refused certificates is read again.
const PERIODS_UNTIL_CERTIFICATES: u32 = 50;

/// The driver. Its server shows all variables, also where no entry names it.
struct OpcUa {
    is_configured: bool,
    server: Server,
}

/// Makes the driver.
pub(crate) fn driver(making: &Making<'_>) -> Box<dyn Driver> {
    let is_configured = making.settings.drivers.opcua.address.is_some();
    Box::new(OpcUa { is_configured, server: Server::default() })
}

impl Driver for OpcUa {
    fn start(&mut self, session: &mut Start<'_>) {
        let (server, points) = (self.server.clone(), session.points.to_vec());
        session.show(server.run(session.shared.clone(), points, session.stages.clone()));
    }

    fn works_without_points(&self) -> bool {
        self.is_configured
    }

    fn end(&mut self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>> {
        Box::pin(self.server.stop("plcio ends"))
    }
}

/// The server of a session, on a thread of its own. When the control has died or ended, it goes on with the last values
/// and safe outputs until the next session begins, so that clients can tell a dead control from a dead network.
#[derive(Clone, Debug, Default)]
struct Server(Arc<Mutex<Option<Serving>>>);

/// A server that was started.
#[derive(Debug)]
struct Serving {
    /// Ends it, with the reason.
    stop: oneshot::Sender<&'static str>,
    /// Is closed when it has ended.
    stopped: oneshot::Receiver<()>,
}

/// What ends a server.
struct Until {
    /// The session ends.
    stages: Stages,
    /// The server is to end, and why.
    stop: oneshot::Receiver<&'static str>,
    /// Is dropped when the session need not wait for the server any more.
    done: Option<oneshot::Sender<()>>,
}

impl Server {
    /// Starts the server of a session, and returns when the session may end.
    async fn run(self, shared: Shared, points: Vec<usize>, stages: Stages) {
        self.stop("another image file is served").await;
        let (stop, to_stop) = oneshot::channel();
        let (running, stopped) = oneshot::channel();
        let (done, finished) = oneshot::channel();
        *self.serving() = Some(Serving { stop, stopped });
        let events = shared.events.clone();
        let serve = move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            let until = Until { stages, stop: to_stop, done: Some(done) };
            match runtime {
                Ok(runtime) => runtime.block_on(serve(shared, points, until)),
                Err(error) => off(&shared, &error.to_string()),
            }
            drop(running);
        };
        match std::thread::Builder::new().name("opcua".into()).spawn(serve) {
            // Nothing is sent: the sender is dropped.
            Ok(_) => drop(finished.await),
            Err(error) => events.write("server_off", &[("why", error.to_string().into())]),
        }
    }

    /// Ends the server that was started last, if it still serves, and waits for its end.
    async fn stop(&self, why: &'static str) {
        let serving = self.serving().take();
        if let Some(Serving { stop, stopped }) = serving {
            let _ = stop.send(why);
            let _ = stopped.await;
        }
    }

    fn serving(&self) -> MutexGuard<'_, Option<Serving>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Says that the server does not serve, and why.
fn off(shared: &Shared, why: &str) {
    shared.events.write("server_off", &[("server", "opcua".into()), ("why", why.into())]);
}

/// Serves until it is told to end; begins again where that fails.
async fn serve(shared: Shared, points: Vec<usize>, mut until: Until) {
    let Some(address) = shared.settings.drivers.opcua.address.clone() else {
        off(&shared, "[plcio] has no key `opcua-server`, which says where it listens");
        return;
    };
    let mut reported = String::new();
    loop {
        let why = match serve_once(&shared, &points, &address, &mut until).await {
            Ok(why) => return off(&shared, why),
            Err(why) => why,
        };
        if reported != why {
            off(&shared, &why);
            reported = why;
        }
        tokio::select! {
            () = tokio::time::sleep(Duration::from_secs(1)) => {}
            () = has_left(&mut until.stages), if until.done.is_some() => return,
            _ = &mut until.stop => return,
        }
    }
}

/// Serves until it is told to end, or the session ends and the control goes on or `plcio` ends. Returns why.
///
/// # Errors
/// Why it can't serve.
async fn serve_once(
    shared: &Shared,
    points: &[usize],
    address: &str,
    until: &mut Until,
) -> Result<&'static str, String> {
    let listener = TcpListener::bind(address).await.map_err(|error| error.to_string())?;
    let local = listener.local_addr().map_err(|error| error.to_string())?;
    let name = shared.settings.name();
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let uri = format!("urn:{host}:plcio:{name}");
    // The first namespace, with the name of the server itself, belongs to its diagnostics.
    let space = format!("urn:{host}:plcc:{name}");
    let settings = &shared.settings.drivers.opcua;
    let users = Users::open(settings)?;
    let mut certificates = Certificates::open(&settings.certificates, &uri)?;
    let (server, handle) = server(settings, &name, (&uri, &space), &host, local, users)?;
    let manager = handle
        .node_managers()
        .get_of_type::<SimpleNodeManager>()
        .ok_or("its address space can't be made")?;
    let namespace =
        handle.get_namespace_index(&space).ok_or("its address space has no namespace")?;
    let mut nodes = Nodes::create(shared, points, &manager, namespace, &name);
    let mut task = tokio::spawn(server.run_with(listener));
    let at = format!("opc.tcp://{local}");
    shared.events.write("server_on", &[("server", "opcua".into()), ("address", at.into())]);
    let mut rounds = 0_u32;
    loop {
        nodes.update(shared, &manager, handle.subscriptions());
        if rounds.is_multiple_of(PERIODS_UNTIL_CERTIFICATES) {
            for file in certificates.newly_refused() {
                let file = file.display().to_string();
                shared.events.write("certificate_refused", &[("file", file.into())]);
            }
        }
        rounds = rounds.wrapping_add(1);
        tokio::select! {
            () = tokio::time::sleep(shared.settings.poll.max(PERIOD)) => {}
            result = &mut task => {
                return match result {
                    Ok(Ok(())) => Err("the server has ended".into()),
                    Ok(Err(why)) => Err(why),
                    Err(error) => Err(error.to_string()),
                };
            }
            why = &mut until.stop => {
                close(&handle, task).await;
                return Ok(why.unwrap_or("plcio ends"));
            }
            // A server that goes on after the session does not wait for its end again.
            () = has_left(&mut until.stages), if until.done.is_some() => {
                let why = {
                    let hub = shared.hub();
                    match hub.is_replaced() {
                        _ if hub.is_ending() => Some("plcio ends"),
                        true => Some("another image file is served"),
                        false => None,
                    }
                };
                if let Some(why) = why {
                    close(&handle, task).await;
                    return Ok(why);
                }
                drop(until.done.take());
            }
        }
    }
}

/// Ends all connections.
async fn close(handle: &ServerHandle, task: JoinHandle<Result<(), String>>) {
    handle.cancel();
    let _ = tokio::time::timeout(Duration::from_secs(1), task).await;
}

/// The server, with its endpoints: signed, or signed and encrypted, for users with a password; and for
/// everybody without either where the configuration permits it.
fn server(
    settings: &Settings,
    name: &str,
    (uri, space): (&str, &str),
    host: &str,
    local: SocketAddr,
    users: Users,
) -> Result<(OpcUaServer, ServerHandle), String> {
    let metadata = NamespaceMetadata { namespace_uri: space.into(), ..Default::default() };
    let host = match local.ip() {
        ip if ip.is_unspecified() => host.to_owned(),
        ip => ip.to_string(),
    };
    let mut builder = ServerBuilder::new()
        .application_name(format!("plcio {name}"))
        .application_uri(uri)
        .product_uri("urn:plcc:plcio")
        .pki_dir(&settings.certificates)
        .host(host)
        .port(local.port())
        .discovery_urls(vec!["/".into()])
        .max_sessions(SESSIONS)
        .with_authenticator(Arc::new(users))
        .with_node_manager(simple_node_manager(metadata, name));
    let anonymous = [ANONYMOUS_USER_TOKEN_ID.to_owned()];
    for policy in [
        SecurityPolicy::Basic256Sha256,
        SecurityPolicy::Aes128Sha256RsaOaep,
        SecurityPolicy::Aes256Sha256RsaPss,
    ] {
        for mode in [MessageSecurityMode::Sign, MessageSecurityMode::SignAndEncrypt] {
            let endpoint = ServerEndpoint::new("/", policy, mode, &[]);
            builder = builder.add_endpoint(format!("{policy} {mode}"), endpoint);
        }
    }
    if settings.anonymous {
        builder = builder.add_endpoint("none", ServerEndpoint::new_none("/", &anonymous));
    }
    builder.build()
}
