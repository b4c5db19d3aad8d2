//! Who gets in: users with a password, who may write what is allowed to be written, and, where the
//! configuration permits it, everybody, who may read.
//!
//! The file of users has a line `NAME:PASSWORD` for each; lines that are empty or begin with `#` say nothing.

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

use opcua::nodes::AccessLevel;
use opcua::server::authenticator::{
    AuthManager, Password, UserToken, user_pass_security_policy_id, user_pass_security_policy_uri,
};
use opcua::server::{ANONYMOUS_USER_TOKEN_ID, ServerEndpoint};
use opcua::types::{
    Error, MessageSecurityMode, NodeId, StatusCode, UAString, UserTokenPolicy, UserTokenType,
};

use plcc_configuration::drivers::opcua::Settings;

/// How long a client waits for the answer to a wrong password, so that it can't try many.
const PAUSE: Duration = Duration::from_secs(1);

/// The users.
pub(super) struct Users {
    passwords: Vec<(String, String)>,
    anonymous: bool,
}

impl Users {
    /// Reads the file of users.
    ///
    /// # Errors
    /// When it can't be read, others than its owner may read it, or nobody would get in.
    pub(super) fn open(settings: &Settings) -> Result<Self, String> {
        let passwords = match &settings.users {
            Some(path) => Self::read(path).map_err(|why| format!("{}: {why}", path.display()))?,
            None => vec![],
        };
        if passwords.is_empty() && !settings.anonymous {
            return Err("nobody could log in: set opcua-users or opcua-anonymous in [plcio]".into());
        }
        Ok(Self { passwords, anonymous: settings.anonymous })
    }

    fn read(path: &Path) -> Result<Vec<(String, String)>, String> {
        let about = std::fs::metadata(path).map_err(|error| error.to_string())?;
        if about.mode() & 0o077 != 0 {
            return Err("others may read the passwords in it: chmod 600 is needed".into());
        }
        let text = crate::input_file::read_text(path).map_err(|error| error.to_string())?;
        let lines = text.lines().zip(1..).map(|(line, number)| (line.trim(), number));
        let lines = lines.filter(|(line, _)| !line.is_empty() && !line.starts_with('#'));
        let user = |(line, number): (&str, usize)| match line.split_once(':') {
            Some((name, password)) if !name.is_empty() && !password.is_empty() => {
                Ok((name.to_owned(), password.to_owned()))
            }
            _ => Err(format!("line {number}: NAME:PASSWORD is expected")),
        };
        lines.map(user).collect()
    }
}

/// Whether two texts are the same, in a time that does not tell where they differ.
fn is_same(one: &str, other: &str) -> bool {
    let differences = one.bytes().zip(other.bytes()).fold(0, |found, (a, b)| found | (a ^ b));
    one.len() == other.len() && differences == 0
}

#[async_trait::async_trait]
impl AuthManager for Users {
    async fn authenticate_anonymous_token(&self, endpoint: &ServerEndpoint) -> Result<(), Error> {
        match self.supports_anonymous(endpoint) {
            true => Ok(()),
            false => Err(Error::new(StatusCode::BadIdentityTokenRejected, "a user is needed")),
        }
    }

    async fn authenticate_username_identity_token(
        &self,
        _endpoint: &ServerEndpoint,
        name: &str,
        password: &Password,
    ) -> Result<UserToken, Error> {
        let is_user = |(known, right): &(String, String)| {
            is_same(known, name) & is_same(right, password.get())
        };
        if self.passwords.iter().any(is_user) {
            return Ok(UserToken(format!("user {name}")));
        }
        tokio::time::sleep(PAUSE).await;
        Err(Error::new(StatusCode::BadUserAccessDenied, "the user or the password is wrong"))
    }

    fn effective_user_access_level(
        &self,
        token: &UserToken,
        level: AccessLevel,
        _node: &NodeId,
    ) -> AccessLevel {
        if token.is_anonymous() { level & AccessLevel::CURRENT_READ } else { level }
    }

    fn user_token_policies(&self, endpoint: &ServerEndpoint) -> Vec<UserTokenPolicy> {
        let mut policies = vec![];
        if self.anonymous {
            policies.push(UserTokenPolicy {
                policy_id: ANONYMOUS_USER_TOKEN_ID.to_ascii_lowercase().into(),
                token_type: UserTokenType::Anonymous,
                issued_token_type: UAString::null(),
                issuer_endpoint_url: UAString::null(),
                security_policy_uri: UAString::null(),
            });
        }
        // A password never goes over a connection without encryption.
        let is_open = endpoint.message_security_mode() == MessageSecurityMode::None;
        if !self.passwords.is_empty() && !is_open {
            policies.push(UserTokenPolicy {
                policy_id: user_pass_security_policy_id(endpoint),
                token_type: UserTokenType::UserName,
                issued_token_type: UAString::null(),
                issuer_endpoint_url: UAString::null(),
                security_policy_uri: user_pass_security_policy_uri(endpoint),
            });
        }
        policies
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn users_are_read_from_a_file_that_only_its_owner_can_read() {
        let path = std::env::temp_dir().join(format!("plcio-users-{}", std::process::id()));
        let read = |text: &str, mode: u32| {
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, PermissionsExt::from_mode(mode)).unwrap();
            Users::read(&path)
        };
        let users = read("# who\n\npanel:a:b\n shop : c\n", 0o600).unwrap();
        let expected = [("panel", "a:b"), ("shop ", " c")];
        assert_eq!(users, expected.map(|(name, password)| (name.into(), password.into())));
        assert_eq!(read("a:b\npanel\n", 0o600).unwrap_err(), "line 2: NAME:PASSWORD is expected");
        assert!(read("a:b\n", 0o640).unwrap_err().contains("chmod 600"));
        std::fs::remove_file(&path).unwrap();
        assert!(is_same("ab", "ab") && !is_same("ab", "abc") && !is_same("ab", "ac"));
    }
}
