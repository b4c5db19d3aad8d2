//! Words of other languages, and what PMAC has in their place.

use super::other_languages::{Explanation, Place, explanation, help};
use crate::common::Controller;
use crate::pmac::ast::FUNCTIONS;

/// Directives of the download program without their `#`, or misspelt ones.
pub(super) fn directive(place: &Place<'_>) -> Option<Explanation> {
    let line = [&place.before, place.word.as_str(), &place.behind].concat();
    let line = line.trim();
    let first: String = line.chars().take_while(|c| *c == '#' || c.is_ascii_alphabetic()).collect();
    let rest = line.get(first.len()..).unwrap_or("").trim_start();
    let (name, with_sign) = match first.strip_prefix('#') {
        Some(name) => (name.to_ascii_lowercase(), true),
        None => (first.to_ascii_lowercase(), false),
    };
    let before = place.before.trim();
    let same_place = before.is_empty() || before == "#" || before.eq_ignore_ascii_case(&first);
    let is_name = rest.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if !same_place {
        return None;
    }
    if with_sign {
        return match name.as_str() {
            "if" | "elif" | "elseif" => explanation(
                format!("`#{name}` is no directive"),
                "there are #ifdef and #ifndef, #else, #endif",
            ),
            "def" | "defin" | "defines" | "defined" | "defien" | "deifne" => {
                explanation(format!("`#{name}` is no directive"), format!("write #define {rest}"))
            }
            "inc" | "includ" | "inlcude" | "import" | "using" => {
                explanation(format!("`#{name}` is no directive"), format!("write #include {rest}"))
            }
            glued if glued.starts_with("define") && glued.len() > "define".len() => explanation(
                format!("`{first}` is no directive"),
                "a blank stands between #define and the name",
            ),
            _ => None,
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
pub(super) fn function(place: &Place<'_>) -> Option<Explanation> {
    let word = place.word.to_ascii_uppercase();
    let behind = place.behind.trim_start();
    let inside = place.before.to_ascii_uppercase();
    if place.around.at == "," && inside.contains("ATAN2(") {
        return help("write Q0=COSINE P1=ATAN2(SINE): the second value stands in Q0");
    }
    if !behind.starts_with('(') {
        if place.begins_line() {
            return None;
        }
        let letters = word.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        let known = FUNCTIONS.iter().find(|(name, _)| *name == letters)?;
        let digits = word.get(letters.len()..).unwrap_or("");
        let value: String = if digits.is_empty() {
            behind.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '.').collect()
        } else {
            digits.to_owned()
        };
        let value = if value.is_empty() { "…".to_owned() } else { value };
        let message = format!("the value of {} stands in parentheses", known.0);
        return explanation(message, format!("write {}({value})", known.0));
    }
    let what = match word.as_str() {
        "SQR" | "ROOT" => "the square root is SQRT(…), a square P1*P1",
        "POW" | "POWER" => "write a product, P1*P1, or EXP(3*LN(P1))",
        "FLOOR" | "TRUNC" | "FIX" => "INT(…) is the next integer below",
        "CEIL" => "write -INT(-P1)",
        "ROUND" => "write INT(P1+0.5)",
        "LOG" => "the natural logarithm is LN(…), the decimal one LN(P1)/LN(10)",
        "ATN" | "ARCTAN" => "the function is ATAN(…), in degrees unless I15=1",
        "ARCSIN" | "ARCCOS" => "the functions are ASIN(…) and ACOS(…), in degrees unless I15=1",
        "FABS" => "the function is ABS(…)",
        "MOD" | "FMOD" => "the remainder is written with `%`: P1%P2",
        "MIN" | "MAX" | "SGN" | "SIGN" | "LIMIT" => "write IF (P1<P2) P3=P1 ELSE P3=P2 ENDIF",
        "NOT" => return explanation("there is no NOT", "write the opposite comparison: (P1!=0)"),
        _ => return None,
    };
    explanation(format!("there is no function {word}"), what)
}

/// Words and signs of other languages in expressions and conditions.
pub(super) fn operand(place: &Place<'_>) -> Option<Explanation> {
    let inside = place.before.contains(['=', '(']);
    if !inside {
        return None;
    }
    let condition = place.before.contains('(');
    let word = place.word.to_ascii_uppercase();
    match word.as_str() {
        "NOT" => explanation("there is no NOT", "write the opposite comparison: (P1!=0), (P1=0)"),
        "TRUE" | "ON" | "HIGH" => explanation(format!("there is no constant {word}"), "write 1"),
        "FALSE" | "OFF" | "LOW" => explanation(format!("there is no constant {word}"), "write 0"),
        "XOR" if condition => {
            explanation("there is no XOR of conditions", "bits are linked with `^`: (M1^M2=1)")
        }
        "XOR" => explanation("XOR is no operator", "bits are linked with `^`: P1=P2^P3"),
        "MOD" => explanation("MOD is no operator", "the remainder is written with `%`: P1%P2"),
        "DIV" => explanation("DIV is no operator", "write INT(P1/P2)"),
        "AND" | "OR" if place.around.at == place.word && !condition => {
            let sign = if word == "AND" { "&" } else { "|" };
            explanation(
                format!("{word} joins conditions, not values"),
                format!("bits are linked with `{sign}`: P1=P2{sign}P3"),
            )
        }
        "SHL" | "SHR" | "ROL" | "ROR" => {
            explanation(format!("{word} is no operator"), "multiply or divide by a power of 2")
        }
        _ => match place.around.at {
            "!" if place.before.trim_end().ends_with('=') => help(
                "the opposite of a bit is 1-M1 or M1^1; `!` stands in comparators: != !> !< !~",
            ),
            "(" | "" => None,
            at if at.starts_with('(') && at.contains(['<', '>', '=']) && !at.contains("==") => {
                help("write IF (P2>3) P1=1 ELSE P1=0 ENDIF")
                    .filter(|_| place.around.before.trim_end().ends_with('='))
            }
            _ => None,
        },
    }
}

/// Words with which statements begin elsewhere.
pub(super) fn statement(place: &Place<'_>) -> Option<Explanation> {
    let word = place.word.to_ascii_uppercase();
    let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let Place { before, behind, code, .. } = place;
    let at = place.around.at;
    let opens = matches!(before.trim().to_ascii_uppercase().as_str(), "OPEN PLC" | "OPEN PLCC");
    if opens && word.starts_with(|c: char| c.is_ascii_alphabetic()) && word != "CLEAR" {
        return explanation(
            format!("a PLC has a number, 0 to 31, and `{}` is none", place.word),
            format!("write OPEN PLC 1 CLEAR, or before it #define {} 1", place.word),
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
        let condition = [place.word.as_str(), behind].concat();
        let upper = condition.to_ascii_uppercase();
        let end = [" THEN", " DO"].iter().filter_map(|word| upper.find(word)).min();
        let condition = condition.get(..end.unwrap_or(condition.len())).unwrap_or("").trim();
        let compares = condition.contains(['=', '<', '>']) && !condition.contains(['(', ')']);
        let condition = if compares { condition.replace("==", "=") } else { "P1=1".to_owned() };
        let word = before.trim();
        return help(format!("a condition stands in parentheses: {word} ({condition})"));
    }
    let in_expression = before.trim_end().ends_with(|c: char| "=+-*/(<>&|^%".contains(c));
    if in_expression && at != "," || before.contains("->") {
        return None;
    }
    let index = before.rfind('(').and_then(|open| before.get(..open)).unwrap_or("");
    let in_index = index.ends_with(|c: char| "PQMIpqmi".contains(c));
    let ends_line = behind.trim().is_empty();
    let no_word =
        |help: &str| explanation(format!("`{}` is no statement of a PLC", place.word), help);
    match letters {
        "THEN" | "DO" | "BEGIN" if !place.before.contains("=") || *code == "PMAC-3" => {
            let help = format!("leave {letters} out: the statements follow the condition directly");
            no_word(&help)
        }
        "ELSIF" | "ELIF" | "ELSEIF" => {
            no_word("write ELSE and IF (…); each of these IFs needs an ENDIF of its own")
        }
        "DWELL" | "DELAY" | "WAIT" | "SLEEP" | "PAUSE"
            if letters == word || letters == "DELAY" || letters == "DWELL" =>
        {
            no_word(wait(place.controller))
        }
        "FOR" | "NEXT" | "TO" | "REPEAT" | "UNTIL" | "LOOP" | "WEND" | "ENDFOR" => {
            no_word("the loop is WHILE (P1<10) … P1=P1+1 ENDWHILE; each round is a scan of its own")
        }
        "BREAK" | "CONTINUE" | "EXIT" => no_word("let the condition of the WHILE become false"),
        "SWITCH" | "CASE" | "DEFAULT" | "ENDCASE" | "ENDSWITCH" | "SELECT" => {
            no_word("write IF (P1=1) … ENDIF IF (P1=2) … ENDIF")
        }
        "GOTO" | "GOSUB" | "CALL" | "RETURN" | "RET" | "JMP" | "JUMP" | "N" if word.len() > 1 => {
            no_word(
                "there are no jumps and no subroutines in PLCs: use IF and WHILE, or ENABLE PLC n to \
             start another one",
            )
        }
        "JOG" => no_word("a command to a motor is given with COMMAND\"#1J+\""),
        "HOME" | "HM" if !behind.trim_start().starts_with('=') => {
            no_word("a command to a motor is given with COMMAND\"#1HM\"")
        }
        "LINEAR" | "RAPID" | "X" | "Y" | "Z" | "G" | "F" | "T"
            if letters != word || word.len() > 1 =>
        {
            help("moves stand in motion programs; a PLC starts one with COMMAND\"&1B1R\"")
        }
        "RUN" => no_word("write ENABLE PLC n, or COMMAND\"&1B1R\" for a motion program"),
        "ENABLE" | "DISABLE" | "ENA" | "DIS" => {
            let number: String = behind.trim().chars().take_while(char::is_ascii_digit).collect();
            (!number.is_empty()).then(|| {
                explanation(
                    format!("PLC is missing after {}", place.word),
                    format!("write {letters} PLC {number}"),
                )
            })?
        }
        "PLC" if behind.trim_start().starts_with('=') => {
            help("ENABLE PLC n and DISABLE PLC n start and stop a PLC")
        }
        "PLC" if place.begins_line() => {
            help("write OPEN PLC 5 CLEAR, and CLOSE after its statements")
        }
        "LD" | "LDN" | "LDI" | "OUT" | "ST" | "STN" | "U" | "UN" | "A" | "AN" | "O" | "AND"
        | "OR" | "ANI" | "ORI" | "MOV" | "MOVE"
            if place.begins_line()
                && at == place.word
                && behind.starts_with(' ')
                && behind.trim_start().starts_with(|c: char| c.is_ascii_alphabetic())
                && !behind.contains(['=', '<', '>']) =>
        {
            no_word("there are no instruction lists: write M3=M1&M2 or IF (M1=1) … ENDIF")
        }
        "SET" | "S" if place.begins_line() && behind.starts_with(' ') => no_word("write M3=1"),
        "RST" | "RESET" | "R" if place.begins_line() && behind.starts_with(' ') => {
            no_word("write M3=0")
        }
        "VAR" | "INT" | "DIM" | "REAL" | "BOOL" | "DOUBLE" | "FLOAT" | "LONG" | "CONST"
        | "END_VAR" | "LET" | "WORD"
            if place.begins_line() =>
        {
            explanation(
                format!("`{}` declares nothing", place.word),
                "variables exist without a declaration: P0 to P1023; #define COUNT P1 names one",
            )
        }
        "PRINT" | "PRINTF" | "WRITE" | "ECHO" | "MSG" => no_word("SEND\"text\" writes a text"),
        "END" | "ENDPLC" | "STOP"
            if place.begins_line()
                && letters == word
                && (ends_line || behind.starts_with(" PLC")) =>
        {
            no_word("a program ends with CLOSE")
        }
        "P" | "Q" | "M" | "I" if letters == word && *code == "PMAC-3" && place.begins_line() => {
            let rest = behind.trim_start();
            let brackets = rest.starts_with('[');
            let what = if brackets {
                format!("{letters}1 is a variable, {letters}(P2+1) the one that a value chooses")
            } else {
                format!("a variable has a number: {letters}1")
            };
            (brackets || rest.starts_with(['=', '-', '+'])).then(|| help(what))?
        }
        "M" if at == place.word && *code == "PMAC-3" && place.begins_line() && ends_line => {
            help(format!("{at}=1 switches the variable on; M codes stand in motion programs"))
        }
        _ if at == "#" && place.around.behind.starts_with(|c: char| c.is_ascii_digit()) => {
            let command = place.around.behind.split_whitespace().next().unwrap_or("");
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
