//! Words of other languages, and what PMAC has in their place.

use super::other_languages::{ErrorSite, HABITS};
use crate::common::{Controller, Explanation, explanation, help};
use crate::pmac::ast::FUNCTIONS;

/// Directives of the download program without their `#`, or misspelt ones.
pub(super) fn directive(site: &ErrorSite<'_>) -> Option<Explanation> {
    let line = [&site.before, site.word.as_str(), &site.after].concat();
    let line = line.trim();
    let first: String = line.chars().take_while(|c| *c == '#' || c.is_ascii_alphabetic()).collect();
    let rest = line.get(first.len()..).unwrap_or("").trim_start();
    let (name, with_sign) = match first.strip_prefix('#') {
        Some(name) => (name.to_ascii_lowercase(), true),
        None => (first.to_ascii_lowercase(), false),
    };
    let before = site.before.trim();
    let same_place = before.is_empty() || before == "#" || before.eq_ignore_ascii_case(&first);
    let is_name = rest.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if !same_place {
        return None;
    }
    if with_sign {
        return match HABITS.help("directive", &name) {
            Some(help) => {
                let message = format!("`#{name}` is not a directive");
                explanation(message, help.replace("{rest}", rest))
            }
            None if name.starts_with("define") && name != "define" => explanation(
                format!("`{first}` is not a directive"),
                "put a blank between #define and the name",
            ),
            None => None,
        };
    }
    match name.as_str() {
        "include" if rest.starts_with(['"', '<']) || is_name => {
            explanation("`include` is a directive only with `#`", format!("write #include {rest}"))
        }
        "define" | "undef" | "ifdef" | "ifndef" if is_name => explanation(
            format!("`{first}` is a directive only with `#`"),
            format!("write #{name} {rest}"),
        ),
        _ => None,
    }
}

/// Functions without parentheses, and those that PMAC does not have.
pub(super) fn function(site: &ErrorSite<'_>) -> Option<Explanation> {
    let word = site.word.to_ascii_uppercase();
    let after = site.after.trim_start();
    let inside = site.before.to_ascii_uppercase();
    if site.around.at == "," && inside.contains("ATAN2(") {
        return help("write Q0=COSINE P1=ATAN2(SINE): the second value is in Q0");
    }
    if !after.starts_with('(') {
        if site.begins_line() {
            return None;
        }
        let letters = word.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        let known = FUNCTIONS.iter().find(|(name, _)| *name == letters)?;
        let digits = word.get(letters.len()..).unwrap_or("");
        let value: String = if digits.is_empty() {
            after.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '.').collect()
        } else {
            digits.to_owned()
        };
        let value = if value.is_empty() { "…".to_owned() } else { value };
        let message = format!("the value of {} is in parentheses", known.0);
        return explanation(message, format!("write {}({value})", known.0));
    }
    if word == "NOT" {
        return explanation("there is no NOT", "write the opposite comparison: (P1!=0)");
    }
    explanation(format!("there is no function {word}"), HABITS.help("function", &word)?)
}

/// Words and signs of other languages in expressions and conditions.
pub(super) fn operand(site: &ErrorSite<'_>) -> Option<Explanation> {
    let inside = site.before.contains(['=', '(']);
    if !inside {
        return None;
    }
    let condition = site.before.contains('(');
    let word = site.word.to_ascii_uppercase();
    if let Some(help) = HABITS.help("constant", &word) {
        return explanation(format!("there is no constant {word}"), help);
    }
    if !(word == "XOR" && condition)
        && let Some(help) = HABITS.help("operator", &word)
    {
        return explanation(format!("{word} is not an operator"), help);
    }
    match word.as_str() {
        "NOT" => explanation("there is no NOT", "write the opposite comparison: (P1!=0), (P1=0)"),
        "XOR" if condition => {
            explanation("there is no XOR of conditions", "bits are linked with `^`: (M1^M2=1)")
        }
        "AND" | "OR" if site.around.at == site.word && !condition => {
            let sign = if word == "AND" { "&" } else { "|" };
            explanation(
                format!("{word} joins conditions, not values"),
                format!("bits are linked with `{sign}`: P1=P2{sign}P3"),
            )
        }
        _ => match site.around.at {
            "!" if site.before.trim_end().ends_with('=') => help(
                "the opposite of a bit is 1-M1 or M1^1; `!` is part of comparators: != !> !< !~",
            ),
            "(" | "" => None,
            at if at.starts_with('(') && at.contains(['<', '>', '=']) && !at.contains("==") => {
                help("write IF (P2>3) P1=1 ELSE P1=0 ENDIF")
                    .filter(|_| site.around.before.trim_end().ends_with('='))
            }
            _ => None,
        },
    }
}

/// Words with which statements begin elsewhere.
pub(super) fn statement(site: &ErrorSite<'_>) -> Option<Explanation> {
    let word = site.word.to_ascii_uppercase();
    let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let ErrorSite { before, after, code, .. } = site;
    let at = site.around.at;
    let opens = matches!(before.trim().to_ascii_uppercase().as_str(), "OPEN PLC" | "OPEN PLCC");
    if opens && word.starts_with(|c: char| c.is_ascii_alphabetic()) && word != "CLEAR" {
        return explanation(
            format!("a PLC has a number, 0 to 31, and `{}` is none", site.word),
            format!("write OPEN PLC 1 CLEAR, or before it #define {} 1", site.word),
        );
    }
    let unnumbered = before.trim().eq_ignore_ascii_case("OPEN") && letters == "PLC";
    if unnumbered || opens {
        return help("PLCs have the numbers 0 to 31: OPEN PLC 1 CLEAR");
    }
    if matches!(before.trim().to_ascii_uppercase().as_str(), "IF" | "WHILE" | "AND" | "OR")
        && *code == "PMAC-3"
        && !at.starts_with('(')
    {
        let condition = [site.word.as_str(), after].concat();
        let upper = condition.to_ascii_uppercase();
        let end = [" THEN", " DO"].iter().filter_map(|word| upper.find(word)).min();
        let condition = condition.get(..end.unwrap_or(condition.len())).unwrap_or("").trim();
        let compares = condition.contains(['=', '<', '>']) && !condition.contains(['(', ')']);
        let condition = if compares { condition.replace("==", "=") } else { "P1=1".to_owned() };
        let word = before.trim();
        return help(format!("a condition is in parentheses: {word} ({condition})"));
    }
    let in_expression = before.trim_end().ends_with(|c: char| "=+-*/(<>&|^%".contains(c));
    if in_expression && at != "," || before.contains("->") {
        return None;
    }
    let index = before.rfind('(').and_then(|open| before.get(..open)).unwrap_or("");
    let in_index = index.ends_with(|c: char| "PQMIpqmi".contains(c));
    let ends_line = after.trim().is_empty();
    let no_word =
        |help: &str| explanation(format!("`{}` is not a statement of a PLC", site.word), help);
    let first = site.begins_line();
    let blank = after.starts_with(' ');
    let is_instruction = first
        && at == site.word
        && blank
        && after.trim_start().starts_with(|c: char| c.is_ascii_alphabetic())
        && !after.contains(['=', '<', '>']);
    let contexts = [
        ("statement", true),
        ("jump", word.len() > 1),
        ("command", !after.trim_start().starts_with('=')),
        ("instruction", is_instruction),
        ("switch", first && blank),
        ("filler", !site.before.contains("=") || *code == "PMAC-3"),
        ("end", first && letters == word && (ends_line || after.starts_with(" PLC"))),
    ];
    for (context, _) in contexts.iter().filter(|(_, is_it)| *is_it) {
        if let Some(help) = HABITS.help(context, letters) {
            return no_word(&help);
        }
    }
    if (letters != word || word.len() > 1)
        && let Some(what) = HABITS.help("move", letters)
    {
        return help(what);
    }
    if first && let Some(help) = HABITS.help("declaration", letters) {
        return explanation(format!("`{}` declares nothing", site.word), help);
    }
    match letters {
        "DWELL" | "DELAY" | "WAIT" | "SLEEP" | "PAUSE"
            if letters == word || letters == "DELAY" || letters == "DWELL" =>
        {
            no_word(wait(site.controller))
        }
        "ENABLE" | "DISABLE" | "ENA" | "DIS" => {
            let number: String = after.trim().chars().take_while(char::is_ascii_digit).collect();
            (!number.is_empty()).then(|| {
                explanation(
                    format!("PLC is missing after {}", site.word),
                    format!("write {letters} PLC {number}"),
                )
            })?
        }
        "PLC" if after.trim_start().starts_with('=') => {
            help("ENABLE PLC n and DISABLE PLC n start and stop a PLC")
        }
        "PLC" if site.begins_line() => {
            help("write OPEN PLC 5 CLEAR, and CLOSE after its statements")
        }
        "P" | "Q" | "M" | "I" if letters == word && *code == "PMAC-3" && site.begins_line() => {
            let rest = after.trim_start();
            let brackets = rest.starts_with('[');
            let what = if brackets {
                format!("{letters}1 is a variable, {letters}(P2+1) the one that a value chooses")
            } else {
                format!("a variable has a number: {letters}1")
            };
            (brackets || rest.starts_with(['=', '-', '+'])).then(|| help(what))?
        }
        "M" if at == site.word && *code == "PMAC-3" && site.begins_line() && ends_line => {
            help(format!("{at}=1 switches the variable on; M codes belong in motion programs"))
        }
        _ if at == "#" && site.around.after.starts_with(|c: char| c.is_ascii_digit()) => {
            let command = site.around.after.split_whitespace().next().unwrap_or("");
            let command = command.trim_end_matches('"');
            help(format!("a PLC gives it with COMMAND\"#{command}\""))
        }
        _ if at == "," && before.contains("\"") => {
            help("a statement writes one text: SEND\"a\" SEND\"b\"")
        }
        _ if at == "," && in_index && *code == "PMAC-3" => {
            help("a variable has one number: P(10*P1+P2)")
        }
        _ => None,
    }
}

/// How a PLC waits.
fn wait(controller: Controller) -> &'static str {
    match controller {
        Controller::Pmac => {
            "a timer counts servo cycles down: M70->X:$0700,0,24,S before the PLC, then M70=1000 \
             WHILE(M70>0) ENDWHILE"
        }
        Controller::Turbo => {
            "a timer counts servo cycles down: I5111=500*8388608/I10 WHILE(I5111>0) ENDWHILE waits \
             500 ms"
        }
    }
}
