//! `plcc explain`

use std::fmt::Write;

use plcc_abi::Dialect;
use plcc_diag::CodeInfo;
use plcc_diag::code::TABLES;
use plcc_frontend::common::{Controller, closest};
use plcc_frontend::{nct, pmac, pmi};

use crate::args::ExplainArgs;
use crate::failure::{DONE, Failure};
use crate::output;

pub(crate) fn explain(args: &ExplainArgs) -> Result<u8, Failure> {
    // Only PMAC has controllers to choose from.
    let pmac = args.controller.map(|_| Dialect::Pmac);
    let dialect = args.dialect.map(Dialect::from).or(pmac);
    let mut all = Vec::new();
    let mut unknown = Vec::new();
    for what in &args.what {
        let pages = pages(what.trim(), dialect, args.controller.map(Controller::from));
        if pages.is_empty() {
            unknown.push(complaint(what.trim()));
        }
        all.extend(pages);
    }
    output::print(all.join("\n").as_bytes())?;
    if unknown.is_empty() { Ok(DONE) } else { Err(Failure(unknown.join("\nerror: "))) }
}

fn pages(what: &str, dialect: Option<Dialect>, controller: Option<Controller>) -> Vec<String> {
    let wanted = |of: &str| dialect.is_none_or(|dialect| dialect.name().eq_ignore_ascii_case(of));
    let codes = codes(what).into_iter();
    let codes = codes.filter(|info| info.code.split_once('-').is_some_and(|(of, _)| wanted(of)));
    let mut pages: Vec<String> = codes.map(page).collect();
    let pmac = |what: &str| pmac::reference::describe::explain(what, controller);
    type Explain<'a> = &'a dyn Fn(&str) -> Option<String>;
    let languages: [(&str, Explain); 3] =
        [("PMI", &pmi::explain), ("NCT", &nct::names::explain), ("PMAC", &pmac)];
    for (title, explain) in languages {
        if wanted(title)
            && let Some(text) = explain(what)
        {
            pages.push(format!("{title}: {}\n", text.trim_end()));
        }
    }
    pages
}

/// The codes that a word means: `PMI-31`, `pmi31`; `ERR003`, as PMAC says it; a bare number is
/// that of every language.
fn codes(what: &str) -> Vec<&'static CodeInfo> {
    let plain = |text: &str| {
        let kept = text.chars().filter(|c| c.is_ascii_alphanumeric());
        kept.collect::<String>().to_ascii_uppercase()
    };
    let mut word = plain(what);
    if let Some(number) = word.strip_prefix("ERR").and_then(|n| n.parse::<u32>().ok()) {
        word = format!("PMAC{number}");
    }
    let number = word.parse::<u32>().ok();
    let all = TABLES.iter().flat_map(|table| table.iter());
    all.filter(|info| match number {
        Some(number) => info.code.split_once('-').is_some_and(|(_, n)| n.parse() == Ok(number)),
        None => plain(info.code) == word,
    })
    .collect()
}

fn page(info: &CodeInfo) -> String {
    let CodeInfo { code, title, meaning, mend } = info;
    let mut page = String::new();
    let _ = write!(page, "{code}: {title}\n\n{}\n\n{}\n", meaning.trim_end(), mend.trim_end());
    page
}

fn complaint(what: &str) -> String {
    let codes = TABLES.iter().flat_map(|table| table.iter()).map(|info| info.code);
    let near = closest(what, codes.chain(pmi::executive_names()));
    let near = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    format!(
        "`{what}` is neither a code (as PMI-31) nor a variable that a control gives a meaning \
         (as @FRO, I510, M145){near}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_found_however_they_are_written() {
        let found = |what| codes(what).iter().map(|info| info.code).collect::<Vec<_>>();
        assert_eq!(found("PMI-31"), ["PMI-31"]);
        assert_eq!(found("pmi31"), ["PMI-31"]);
        assert_eq!(found("Err003"), ["PMAC-3"]);
        assert_eq!(found("31"), ["PMI-31", "NCT-31"]);
        assert!(found("PMI-48").is_empty());
        assert!(found("").is_empty());
    }

    #[test]
    fn a_slip_is_mended() {
        assert!(complaint("PMX-31").contains("`PMI-31`"));
        assert!(complaint("@ESTPO").contains("`@ESTOP`"));
    }
}
