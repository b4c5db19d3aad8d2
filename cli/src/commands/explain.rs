//! `plcc explain`: prints what a diagnostic's code, a keyword, a variable or a word of memory means.

use std::fmt::Write;

use plcc_abi::Dialect;
use plcc_diag::code::TABLES;
use plcc_diag::lints::{LINTS, Level, find_lint, lint_of_code};
use plcc_diag::{CodeInfo, find_code};
use plcc_frontend::common::{Controller, closest};
use plcc_frontend::{LANGUAGES, Language};

use crate::args::ExplainArgs;
use crate::failure::{DONE, Failure};
use crate::output;

pub(crate) fn explain(args: &ExplainArgs) -> Result<u8, Failure> {
    let controller = args.controller.map(Controller::from);
    let languages = asked_about(args.dialect, controller);
    if args.list || !args.search.is_empty() {
        let words: Vec<String> = args.search.iter().map(|word| word.to_lowercase()).collect();
        let found = lines(&languages, |line| {
            let line = line.to_lowercase();
            words.iter().all(|word| line.contains(word))
        });
        if found.is_empty() {
            let message = format!("no line has all of these words: {}", args.search.join(" "));
            return Err(Failure::usage(message));
        }
        output::print(found.as_bytes())?;
        return Ok(DONE);
    }
    let mut all = Vec::new();
    let mut unknown = Vec::new();
    for what in &args.what {
        let pages = pages(what.trim(), &languages, controller);
        if pages.is_empty() {
            unknown.push(complaint(what.trim(), &languages));
        }
        all.extend(pages);
    }
    output::print(all.join("\n").as_bytes())?;
    if unknown.is_empty() { Ok(DONE) } else { Err(Failure::usage(unknown.join("\nerror: "))) }
}

/// The languages that are asked about: the one of `--dialect`; with `--controller` alone those that
/// have several controllers; else all.
fn asked_about(
    dialect: Option<Dialect>,
    controller: Option<Controller>,
) -> Vec<&'static dyn Language> {
    let is_asked_about = |language: &&dyn Language| match dialect {
        Some(dialect) => dialect == language.dialect(),
        None => controller.is_none() || language.has_controllers(),
    };
    LANGUAGES.iter().copied().filter(is_asked_about).collect()
}

/// The diagnostics of a language.
fn codes_of(language: &dyn Language) -> impl Iterator<Item = &'static CodeInfo> {
    let title = language.title();
    let all = TABLES.iter().flat_map(|table| table.iter());
    all.filter(move |info| info.code.split_once('-').is_some_and(|(of, _)| of == title))
}

/// Whether a code is of no language, but of another kind of text.
fn is_of_no_language(info: &CodeInfo) -> bool {
    let title = info.code.split_once('-').map_or("", |(title, _)| title);
    LANGUAGES.iter().all(|language| language.title() != title)
}

/// A line for everything that can be explained in these languages: diagnostics as `CODE: title`,
/// names as `LANGUAGE NAME: meaning`. Only lines for which `wanted` is true are taken.
fn lines(languages: &[&dyn Language], wanted: impl Fn(&str) -> bool) -> String {
    let mut text = String::new();
    if languages.len() == LANGUAGES.len() {
        let all = TABLES.iter().flat_map(|table| table.iter());
        let others = all.filter(|info| is_of_no_language(info));
        let lines = others.map(|info| format!("{}: {}\n", info.code, info.title));
        text.extend(lines.filter(|line| wanted(line)));
    }
    for language in languages {
        let codes = codes_of(*language).map(|info| match lint_of_code(info.code) {
            Some(lint) => format!("{}: {} (lint {})", info.code, info.title, lint.name),
            None => format!("{}: {}", info.code, info.title),
        });
        let topics = language.topics().into_iter();
        let topics =
            topics.map(|topic| format!("{} {}: {}", language.title(), topic.name, topic.meaning));
        for line in codes.chain(topics).filter(|line| wanted(line)) {
            text.push_str(&line);
            text.push('\n');
        }
    }
    text
}

/// What is known of a code or name in these languages, a page each; nothing where it is not known.
fn pages(what: &str, languages: &[&dyn Language], controller: Option<Controller>) -> Vec<String> {
    let titles: Vec<&str> = languages.iter().map(|language| language.title()).collect();
    let of_wanted = |info: &&CodeInfo| {
        let of_language =
            info.code.split_once('-').is_some_and(|(title, _)| titles.contains(&title));
        of_language || is_of_no_language(info)
    };
    let mut pages: Vec<String> = codes(what).into_iter().filter(of_wanted).map(page).collect();
    let of_name = |name: &str, pages: &mut Vec<String>| {
        for language in languages {
            if let Some(text) = language.explain(name, controller) {
                pages.push(format!("{}: {}\n", language.title(), text.trim_end()));
            }
        }
    };
    of_name(what, &mut pages);
    // A number that no error has is read on drawings, where it names a flag.
    if pages.is_empty() && is_number(what) {
        let mut of_variables = vec![];
        for letter in ["I", "Y", "M"] {
            of_name(&format!("{letter}{what}"), &mut of_variables);
        }
        if !of_variables.is_empty() {
            pages.push(format!(
                "{}\nWhat has this number in a program:\n",
                no_such_error(what, languages)
            ));
            pages.extend(of_variables);
        }
    }
    pages
}

/// Whether a text is a number and nothing else.
fn is_number(what: &str) -> bool {
    !what.is_empty() && what.bytes().all(|byte| byte.is_ascii_digit())
}

/// That no error of these languages' compilers has a number, and which numbers there are.
fn no_such_error(number: &str, languages: &[&dyn Language]) -> String {
    let mut known = vec![];
    for language in languages {
        let own = |info: &CodeInfo| info.code.split_once('-').and_then(|(_, own)| own.parse().ok());
        let numbers: Vec<u32> = codes_of(*language).filter_map(own).collect();
        if let (Some(first), Some(last)) = (numbers.iter().min(), numbers.iter().max()) {
            known.push(format!("{} has {first} to {last}", language.title()));
        }
    }
    format!("no error has the number {number}: {}.", known.join(", "))
}

/// The codes that a word names: `PMI-31` or `pmi31`; `ERR003`, which is PMAC's own form; a bare number
/// names that code of every language.
fn codes(what: &str) -> Vec<&'static CodeInfo> {
    let plain = |text: &str| {
        let kept = text.chars().filter(|c| c.is_ascii_alphanumeric());
        kept.collect::<String>().to_ascii_uppercase()
    };
    let mut word = plain(what);
    if let Some(number) = word.strip_prefix("ERR").and_then(|n| n.parse::<u32>().ok()) {
        word = format!("PMAC{number}");
    }
    if let Some(lint) = find_lint(what) {
        return lint.codes.iter().filter_map(|code| find_code(code)).collect();
    }
    let number = word.parse::<u32>().ok();
    let all = TABLES.iter().flat_map(|table| table.iter());
    all.filter(|info| match number {
        Some(number) => {
            let own = info.code.split_once('-').map(|(_, own)| own.parse());
            !is_of_no_language(info) && own == Some(Ok(number))
        }
        None => plain(info.code) == word,
    })
    .collect()
}

fn page(info: &CodeInfo) -> String {
    let CodeInfo { code, title, meaning, fix } = info;
    let mut page = String::new();
    let _ = write!(page, "{code}: {title}\n\n{}\n\n{}\n", meaning.trim_end(), fix.trim_end());
    if let Some(lint) = lint_of_code(code) {
        let name = lint.name;
        let default = match lint.default {
            Level::Allow => format!("It is off; -W {name} asks for it."),
            Level::Warn | Level::Deny => format!("-A {name} turns it off."),
        };
        let mark = if code.starts_with("PMI") { "?" } else { ";" };
        let _ = write!(
            page,
            "\n{default} The comment `{mark} plcc: allow {name}` silences it for the next statement, \
             `{name} = \"allow\"` under [lints] in the machine file for the program.\n"
        );
    }
    page
}

/// Why nothing is explained: the word is of a language that was not asked about, or is unknown.
fn complaint(what: &str, asked: &[&dyn Language]) -> String {
    let knows = |language: &&&dyn Language| {
        asked.iter().all(|asked| asked.dialect() != language.dialect())
            && !pages(what, &[**language], None).is_empty()
    };
    let others: Vec<&str> = LANGUAGES.iter().filter(knows).map(|l| l.title()).collect();
    if !others.is_empty() {
        let others = others.join(" and ");
        return format!(
            "`{what}` is of {others}, which --dialect or --controller leaves out; ask without them"
        );
    }
    if is_number(what) {
        return no_such_error(what, asked);
    }
    let codes = TABLES.iter().flat_map(|table| table.iter()).map(|info| info.code);
    let topics: Vec<_> = LANGUAGES.iter().flat_map(|language| language.topics()).collect();
    let codes = codes.chain(LINTS.iter().map(|lint| lint.name));
    let near = closest(what, codes.chain(topics.iter().map(|topic| topic.name.as_str())));
    let near = near.map_or_else(String::new, |near| format!(" Did you mean `{near}`?"));
    format!(
        "`{what}` is not known: it is neither a code (such as PMI-31) nor a keyword (WHILE) nor a \
         variable or memory word to which a control gives a meaning (@FRO, I510, M145, X:$0700).{near} \
         `plcc explain --search WORD` searches all meanings"
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
        assert_eq!(found("test5"), ["TEST-5"]);
        assert_eq!(pages("TEST-5", LANGUAGES, None).len(), 1);
        assert!(found("PMI-48").is_empty());
        assert!(found("").is_empty());
    }

    #[test]
    fn a_number_that_no_error_has_is_that_of_a_flag() {
        let text = pages("547", LANGUAGES, None).join("\n");
        assert!(
            text.starts_with("no error has the number 547: PMI has 1 to 47, NCT has 1 to 76, ")
        );
        assert!(text.contains("NCT: Y547\n") && text.contains("NCT: I547\n"), "{text}");
        assert!(pages("99999", LANGUAGES, None).is_empty());
        assert!(complaint("99999", LANGUAGES).ends_with("PMAC has 1 to 17."));
    }

    #[test]
    fn a_misspelt_name_is_answered_with_a_similar_one() {
        assert!(complaint("PMX-31", LANGUAGES).contains("Did you mean `PMI-31`?"));
        assert!(complaint("@ESTPO", LANGUAGES).contains("Did you mean `@ESTOP`?"));
    }

    #[test]
    fn what_another_language_has_is_said_to_be_of_that_one() {
        let nct = asked_about(Some(Dialect::Nct), None);
        assert!(complaint("PMI-31", &nct).starts_with("`PMI-31` is of PMI, which --dialect"));
        assert!(complaint("PMI-99", &nct).contains("is not known"));
    }
}
