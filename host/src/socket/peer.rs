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
        let command = plcc_abi::printable(command.trim()).into_owned();
        let command = if command.is_empty() { "an unknown command".into() } else { command };
        Ok(Self { user: user(uid), uid, pid, command })
    }
}

/// Who may use a socket.
#[derive(Clone, Debug)]
pub(crate) struct Admitted {
    /// The user who runs the control.
    own_user: u32,
    /// Further users.
    users: Vec<u32>,
    /// Groups whose members may.
    groups: Vec<u32>,
}

impl Admitted {
    /// The user of this process, root, and further users and groups.
    pub(crate) fn new(users: &[AllowedUser], groups: &[AllowedGroup]) -> Self {
        Self {
            own_user: rustix::process::geteuid().as_raw(),
            users: users.iter().map(|user| user.0).collect(),
            groups: groups.iter().map(|group| group.0).collect(),
        }
    }

    /// Whether nobody is admitted but the own user and root.
    pub(super) fn is_alone(&self) -> bool {
        self.users.is_empty() && self.groups.is_empty()
    }

    /// Whether the process at the other end of a connection may use the socket.
    pub(super) fn admits(&self, stream: &UnixStream, peer: &Peer) -> bool {
        let first_group = || {
            let credentials = rustix::net::sockopt::socket_peercred(stream);
            credentials.ok().map(|credentials| credentials.gid.as_raw())
        };
        self.admits_user(peer.uid)
            || !self.groups.is_empty()
                && self.admits_group(peer.uid, first_group(), &Accounts::read())
    }

    fn admits_user(&self, uid: u32) -> bool {
        uid == self.own_user || uid == 0 || self.users.contains(&uid)
    }

    /// Whether a user is a member of an admitted group: by the group of the process that has connected, or
    /// by the computer's lists. (Of a process's further groups the operating system tells nothing that
    /// could not be of another process by now.)
    fn admits_group(&self, uid: u32, process: Option<u32>, accounts: &Accounts) -> bool {
        let of_user = accounts.groups_of(uid);
        process.into_iter().chain(of_user).any(|group| self.groups.contains(&group))
    }
}

/// The computer's lists of users and groups.
struct Accounts {
    /// `/etc/passwd`.
    users: String,
    /// `/etc/group`.
    groups: String,
}

impl Accounts {
    fn read() -> Self {
        let read = |path| fs::read_to_string(path).unwrap_or_default();
        Self { users: read("/etc/passwd"), groups: read("/etc/group") }
    }

    /// The numbers of the groups of which a user is a member.
    fn groups_of(&self, uid: u32) -> Vec<u32> {
        // name:password:user:group:…
        let accounts = self.users.lines().map(|line| line.split(':').collect::<Vec<&str>>());
        let own: Vec<Vec<&str>> = accounts
            .filter(|fields| fields.get(2).and_then(|text| text.parse().ok()) == Some(uid))
            .collect();
        let first = own.iter().filter_map(|fields| fields.get(3)?.parse().ok());
        // name:password:group:member,member…
        let is_own = |name: &str| own.iter().any(|fields| fields.first() == Some(&name));
        let further = self.groups.lines().filter_map(|line| {
            let fields: Vec<&str> = line.split(':').collect();
            let is_member = fields.get(3)?.split(',').any(|member| is_own(member.trim()));
            fields.get(2).filter(|_| is_member)?.parse().ok()
        });
        first.chain(further).collect()
    }

    /// The number of the group of a name.
    fn group_number(&self, name: &str) -> Option<u32> {
        self.groups.lines().find_map(|line| {
            let mut fields = line.split(':');
            (fields.next()? == name).then(|| fields.nth(1)?.parse().ok()).flatten()
        })
    }
}

/// The number of a group whose members may use the socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AllowedGroup(pub u32);

impl FromStr for AllowedGroup {
    type Err = String;

    /// Takes a group's name or number.
    fn from_str(name: &str) -> Result<Self, String> {
        if let Ok(number) = name.parse() {
            return Ok(Self(number));
        }
        let found = Accounts::read().group_number(name);
        let none = || format!("there is no group {name} in /etc/group; its number can be given");
        found.map(Self).ok_or_else(none)
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
        let admitted =
            |own_user, users: &[u32]| Admitted { own_user, users: users.to_vec(), groups: vec![] };
        assert!(admitted(7, &[]).admits_user(7) && admitted(7, &[]).admits_user(0));
        assert!(!admitted(7, &[]).admits_user(8) && !admitted(0, &[]).admits_user(7));
        assert!(admitted(7, &[9, 8]).admits_user(8) && !admitted(7, &[9, 8]).admits_user(10));
    }

    #[test]
    fn members_of_groups_are_admitted() {
        let accounts = Accounts {
            users: "anna:x:1000:100::/:/bin/sh\nbert:x:1001:101::/:/bin/sh\nbroken\n".into(),
            groups: "users:x:100:\nplc:x:200:carl,anna\nother:x:201:annabel\nbroken:x\n".into(),
        };
        assert_eq!(accounts.groups_of(1000), [100, 200]);
        assert_eq!(accounts.groups_of(1001), [101]);
        assert!(accounts.groups_of(1002).is_empty());
        assert_eq!(accounts.group_number("plc"), Some(200));
        assert_eq!(accounts.group_number("pl"), None);
        let admitted = Admitted { own_user: 7, users: vec![], groups: vec![200] };
        assert!(!admitted.is_alone());
        assert!(admitted.admits_group(1000, None, &accounts));
        assert!(!admitted.admits_group(1001, Some(201), &accounts));
        assert!(admitted.admits_group(1001, Some(200), &accounts));
        assert!("0".parse() == Ok(AllowedGroup(0)) && "root".parse() == Ok(AllowedGroup(0)));
        assert!("no group of that name".parse::<AllowedGroup>().is_err());
    }
}
