//! The page's files, which are part of the program: `monitor/web/`.

/// A file of the page.
pub(super) struct Asset {
    /// Its path in the address of the page: `/main.js`.
    pub(super) path: &'static str,
    pub(super) content_type: &'static str,
    pub(super) bytes: &'static [u8],
}

macro_rules! assets {
    ($($name:literal: $content_type:expr,)*) => {
        &[$(Asset {
            path: concat!("/", $name),
            content_type: $content_type,
            bytes: include_bytes!(concat!("../../web/", $name)),
        },)*]
    };
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

/// All files.
pub(super) const ASSETS: &[Asset] = assets! {
    "index.html": HTML,
    "style.css": CSS,
    "icon.svg": SVG,
    "actions.js": SCRIPT,
    "connection.js": SCRIPT,
    "dialogs.js": SCRIPT,
    "dom.js": SCRIPT,
    "events.js": SCRIPT,
    "export.js": SCRIPT,
    "frame.js": SCRIPT,
    "io.js": SCRIPT,
    "keys.js": SCRIPT,
    "machine.js": SCRIPT,
    "machine_drawing.js": SCRIPT,
    "main.js": SCRIPT,
    "operator.js": SCRIPT,
    "panels.js": SCRIPT,
    "scope.js": SCRIPT,
    "scope_drawing.js": SCRIPT,
    "statements.js": SCRIPT,
    "table.js": SCRIPT,
    "tasks.js": SCRIPT,
    "terminal.js": SCRIPT,
    "timing.js": SCRIPT,
    "variables.js": SCRIPT,
};

/// The page itself.
pub(super) const PAGE: &str = "/index.html";

/// The file at a path.
pub(super) fn asset(path: &str) -> Option<&'static Asset> {
    let path = if path == "/" { PAGE } else { path };
    ASSETS.iter().find(|asset| asset.path == path)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    #[test]
    fn every_file_of_the_folder_is_given() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        let files = std::fs::read_dir(folder).unwrap();
        let files = files.map(|file| format!("/{}", file.unwrap().file_name().to_str().unwrap()));
        let listed = ASSETS.iter().map(|asset| asset.path.to_owned());
        assert_eq!(files.collect::<BTreeSet<_>>(), listed.collect());
    }

    #[test]
    fn nothing_from_outside_is_named() {
        for asset in ASSETS {
            let text = std::str::from_utf8(asset.bytes).unwrap();
            // The only addresses are the names of the XML languages.
            let text = text.replace("http://www.w3.org/2000/svg", "");
            assert!(!text.contains("http://") && !text.contains("https://"), "{}", asset.path);
            assert!(!text.contains("innerHTML"), "{}", asset.path);
        }
    }
}
