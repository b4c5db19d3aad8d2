//! What can be chosen when an object is made.

use std::path::Path;

/// What can be chosen when an object is made.
#[derive(Clone, Debug)]
pub struct ObjectOptions {
    /// What the names of its symbols begin with, a name of C. An underscore follows it.
    pub prefix: String,
    /// The folder from which the names of the sources start, for debuggers.
    pub folder: String,
    /// Pairs of a folder and what takes its place in the paths that debuggers get: a path that begins
    /// with the folder begins with the other instead. Of several pairs that fit, the first counts.
    pub prefix_map: Vec<(String, String)>,
}

impl Default for ObjectOptions {
    fn default() -> Self {
        Self { prefix: "plcc".into(), folder: ".".into(), prefix_map: vec![] }
    }
}

impl ObjectOptions {
    /// A path as debuggers get it.
    pub(super) fn mapped(&self, path: &str) -> String {
        let found = self.prefix_map.iter().find_map(|(old, new)| {
            let rest = Path::new(path).strip_prefix(old).ok()?;
            Some(Path::new(new).join(rest).to_string_lossy().into_owned())
        });
        let path = found.unwrap_or_else(|| path.to_owned());
        // A folder joined with nothing ends with a slash.
        let trimmed = path.trim_end_matches('/');
        if trimmed.is_empty() { path } else { trimmed.to_owned() }
    }
}
