//! `plcc explain`

use std::fmt::Write;

use plcc_abi::Dialect;
use plcc_diag::{CodeInfo, code, find_code};
use plcc_frontend::{nct, pmac, pmi};

use crate::args::ExplainArgs;
use crate::failure::{DONE, Failure};
use crate::output;

pub(crate) fn explain(args: &ExplainArgs) -> Result<u8, Failure> {
    let what = args.what.trim();
    let wanted = |dialect| args.dialect.is_none_or(|only| Dialect::from(only) == dialect);
    let mut pages = Vec::new();
    if let Some(info) = find_code(what) {
        pages.push(page(info));
    }
    type Explain = fn(&str) -> Option<String>;
    let languages: [(Dialect, &str, Explain); 3] = [
        (Dialect::Pmi, "PMI", pmi::explain),
        (Dialect::Nct, "NCT", nct::names::explain),
        (Dialect::Pmac, "PMAC", pmac::tables::explain),
    ];
    for (dialect, title, explain) in languages {
        if wanted(dialect)
            && let Some(text) = explain(what)
        {
            pages.push(format!("{title}: {}\n", text.trim_end()));
        }
    }
    if pages.is_empty() {
        return Err(Failure::Usage(unknown(what)));
    }
    output::print(pages.join("\n").as_bytes())?;
    Ok(DONE)
}

fn page(info: &CodeInfo) -> String {
    let CodeInfo { code, title, meaning, mend } = info;
    let mut page = String::new();
    let _ = write!(page, "{code}: {title}\n\n{}\n\n{}\n", meaning.trim_end(), mend.trim_end());
    page
}

fn unknown(what: &str) -> String {
    let upper = what.to_ascii_uppercase();
    let near = code::TABLES
        .iter()
        .flat_map(|table| table.iter())
        .map(|info| (strsim::damerau_levenshtein(info.code, &upper), info.code))
        .min()
        .filter(|&(distance, _)| distance <= 2 && upper.contains('-'));
    let near = near.map_or_else(String::new, |(_, code)| format!("; did you mean {code}?"));
    format!(
        "`{what}` is neither a code (as PMI-31) nor a variable that a control gives a meaning \
         (as @FRO, I510, M145){near}"
    )
}
