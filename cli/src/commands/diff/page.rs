//! Differences as a page for browsers, which needs nothing from elsewhere.

use std::fmt::Write as _;

use super::{Place, Row};
use crate::args::DiffArgs;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;margin:2em;color:#1c1c1c;background:#fff}\
table{border-collapse:collapse;width:100%}td,th{border:1px solid #ccc;padding:.4em .6em;text-align:left;\
vertical-align:top}code{font:14px ui-monospace,monospace;white-space:pre-wrap}.old{background:#fbe9e7}\
.new{background:#e8f5e9}.where{color:#666;font-size:85%}\
@media(prefers-color-scheme:dark){body{color:#ddd;background:#181818}.old{background:#4a2020}.new{background:#1f3d22}\
td,th{border-color:#444}.where{color:#999}}";

/// The page.
pub(super) fn page(args: &DiffArgs, rows: &[Row]) -> String {
    let (old, new) = (escaped(&args.old.to_string_lossy()), escaped(&args.new.to_string_lossy()));
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{old} and {new}</title>\n\
         <meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}</style>\n\
         <h1>What differs</h1>\n<p>Old: <b>{old}</b>. New: <b>{new}</b>.</p>\n"
    );
    if rows.is_empty() {
        out.push_str("<p>Both versions mean the same.</p>\n");
        return out;
    }
    out.push_str("<table><tr><th>change<th>old<th>new<th>what depends on it</tr>\n");
    for row in rows {
        let _ = write!(out, "<tr><td>{}", row.change);
        for (class, place) in [("old", &row.old), ("new", &row.new)] {
            match place {
                Some(Place { file, line, text }) => {
                    let (file, text) = (escaped(file), escaped(text));
                    let _ = write!(
                        out,
                        "<td class=\"{class}\"><code>{text}</code><br><span class=\"where\">{file}:{line}</span>"
                    );
                }
                None => out.push_str("<td>"),
            }
        }
        out.push_str("<td>");
        let effects = row.effects().map(|(it, role)| {
            let via = if it.via.is_empty() {
                String::new()
            } else {
                format!(" by way of {}", escaped(&it.via.join(", ")))
            };
            let role = if *role == "control" { "for the control:" } else { role };
            format!("{role} <b>{}</b>{via}", escaped(&it.name))
        });
        let effects: Vec<String> = effects.collect();
        out.push_str(if effects.is_empty() { "nothing outside of the program" } else { "" });
        out.push_str(&effects.join("<br>"));
        out.push_str("</tr>\n");
    }
    out.push_str("</table>\n");
    out
}

/// A text as it may stand in a page.
fn escaped(text: &str) -> String {
    let text = plcc_abi::printable(text).to_string();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
