//! Who is at the other end of a connection, as the operating system says it.

use std::fs;
use std::os::unix::net::UnixStream;
use std::str::FromStr;

use crate::Peer;

impl Peer {
    /// The process at the other end.
    ///
    /// # Errors
    /// When the system does not say.
    pub(crate) fn of(stream: &UnixStream) -> std::io::Result<Self> {
        let credentials = rustix::net::sockopt::socket_peercred(stream)?;
        let uid = credentials.uid.as_raw();
        let pid = credentials.pid.as_raw_nonzero().get() as u32;
        let command = fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
        // A process chooses its name itself.
        let command: String = command.trim().chars().filter(|c| !c.is_control()).collect();
        let command = if command.is_empty() { "an unknown command".into() } else { command };
        Ok(Self { user: user(uid), uid, pid, command })
    }

    /// Whether the process may use the control of the user with the number `own`: that user, root and the
    /// users `others` may.
    pub(crate) fn is_admitted(&self, own: u32, others: &[u32]) -> bool {
        self.uid == own || self.uid == 0 || others.contains(&self.uid)
    }
}

/// The number of a user who may use the socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AllowedUser(pub u32);

impl FromStr for AllowedUser {
    type Err = String;

    /// Takes a user's name or number.
    fn from_str(name: &str) -> Result<Self, String> {
        match name.parse() {
            Ok(number) => Ok(Self(number)),
            Err(_) => user_number(name).map(Self),
        }
    }
}

/// The number of the user of a name.
fn user_number(name: &str) -> Result<u32, String> {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    let found = users.lines().find_map(|line| {
        let mut fields = line.split(':');
        (fields.next()? == name).then(|| fields.nth(1)?.parse().ok()).flatten()
    });
    found.ok_or_else(|| format!("there is no user {name} in /etc/passwd; its number can be given"))
}

/// The name of a user, or the number as text if `/etc/passwd` does not have it.
fn user(uid: u32) -> String {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    let found = users.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(uid)).then(|| name.to_owned())
    });
    found.unwrap_or_else(|| uid.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_says_who_is_connected() {
        let (one, _other) = UnixStream::pair().unwrap();
        let peer = Peer::of(&one).unwrap();
        assert_eq!(peer.pid, std::process::id());
        assert_eq!(peer.uid, rustix::process::geteuid().as_raw());
        assert!(!peer.user.is_empty() && !peer.command.is_empty());
    }

    #[test]
    fn users_are_given_by_name_or_number() {
        assert_eq!("root".parse(), Ok(AllowedUser(0)));
        assert_eq!("4711".parse(), Ok(AllowedUser(4711)));
        assert!("nobody of that name".parse::<AllowedUser>().is_err());
    }

    #[test]
    fn the_own_user_and_root_are_admitted() {
        let peer = |uid| Peer { user: String::new(), uid, pid: 1, command: String::new() };
        assert!(peer(7).is_admitted(7, &[]) && peer(0).is_admitted(7, &[]));
        assert!(!peer(8).is_admitted(7, &[]) && !peer(7).is_admitted(0, &[]));
        assert!(peer(8).is_admitted(7, &[9, 8]) && !peer(10).is_admitted(7, &[9, 8]));
    }
}
