//! Words of other languages, and what PMI has in their place.

use super::other_languages::{Explanation, Place};
use crate::pmi::read::section::Section;

/// Operators that are words elsewhere.
pub(super) fn operator(word: &str) -> Option<Explanation> {
    let help = match word {
        "AND" => "AND is written `&`: A & B",
        "OR" => "OR is written `!`: A ! B",
        "NOT" => "NOT is written `/`: /A",
        "XOR" => "the exclusive OR of two LOGICALs is A /= B",
        "MOD" => "the remainder is written `%`: A % B",
        "DIV" => "the quotient is written `/`: A / B",
        "EQ" => "equality is written `=`: A = B",
        "NE" => "inequality is written `/=`: A /= B",
        "LT" | "LE" | "GT" | "GE" => "the relations are < <= > >= = /=",
        _ => return None,
    };
    Explanation::new(format!("`{word}` is no operator"), help)
}

/// Truth values that are words elsewhere.
pub(super) fn truth_value(word: &str) -> Option<Explanation> {
    let value = match word {
        "TRUE" | "ON" | "HIGH" | "YES" => "T",
        "FALSE" | "OFF" | "LOW" | "NO" => "F",
        _ => return None,
    };
    let help = format!("write {value}: true is T, false is F");
    Explanation::new(format!("{word} is no constant and no variable"), help)
}

/// A statement that begins with `first`, with `second` after it.
pub(super) fn statement(first: &str, second: &str) -> Option<Explanation> {
    let help = match (first, second) {
        ("END", "IF") => "write ENDIF as one word",
        ("ELSE", "IF") => "write ELSEIF as one word",
        ("GO", "TO") => "write GOTO as one word",
        ("ELSIF" | "ELIF" | "ELIFS", _) => "write ELSEIF (condition)",
        ("FI" | "ENDIFS", _) => "write ENDIF",
        ("THEN" | "BEGIN" | "DO", _) => {
            "leave it out: the body of an IF begins after the condition's line"
        }
        (
            "WHILE" | "FOR" | "REPEAT" | "UNTIL" | "LOOP" | "NEXT" | "WEND" | "EXIT" | "BREAK"
            | "CONTINUE" | "ENDWHILE" | "ENDFOR" | "ENDREPEAT",
            _,
        ) => {
            "there are no loops: the program runs once in every scan; count in a variable, one \
             round in each scan"
        }
        ("CASE" | "SWITCH" | "ENDCASE" | "DEFAULT", _) => {
            "write IF (N = 1), ELSEIF (N = 2), ELSE, ENDIF"
        }
        ("JMP" | "JMPC" | "JMPCN" | "JUMP" | "SPA" | "SPB" | "JU" | "JC", _) => {
            "write GOTO and a label that comes later in the program"
        }
        ("CALL" | "CAL" | "GOSUB" | "RETURN" | "RET" | "PROGRAM" | "FUNCTION" | "SUB", _) => {
            "there are no subroutines: the program runs from $END to its last line; GOTO goes to a \
             later label"
        }
        ("VAR" | "ENDVAR" | "INT" | "BOOL" | "DINT" | "WORD" | "DIM" | "CONST", _) => {
            "declare variables in front of $END, after $LOGICAL, $INTEGER or $LONG"
        }
        (
            "LD" | "LDN" | "LDI" | "ST" | "STN" | "STR" | "OUT" | "U" | "UN" | "A" | "AN" | "O"
            | "AND" | "ANDN" | "ANI" | "ANB" | "OR" | "ORN" | "ORI" | "ORB" | "XOR" | "XORN"
            | "NOT" | "L" | "MOV" | "MOVE" | "=",
            _,
        ) => {
            "there are no instruction lists: write the whole link as an assignment, LAMP = SW1 & /SW2"
        }
        ("S" | "SET" | "OTL", _) => "write NAME = T in an IF (condition), ENDIF",
        ("R" | "RST" | "RESET" | "RES" | "OTU", _) => "write NAME = F in an IF (condition), ENDIF",
        ("INC" | "DEC" | "ADD" | "MUL" | "DIV" | "CTU" | "CTD", _) => {
            "write an assignment: COUNT = COUNT + 1"
        }
        ("TON" | "TOF" | "TP", _) => {
            "declare the timer after $TIMER (E/CONTROL/DELAYED = 50) and assign its control contact"
        }
        (line, _) if is_block_number(line) && !second.is_empty() => {
            "blocks of part programs have no place here; a label is a name with a colon"
        }
        _ => return None,
    };
    Explanation::new(format!("`{first}` begins no statement of PMI"), help)
}

/// Whether a word numbers the block of a part program: `N10`.
fn is_block_number(word: &str) -> bool {
    let digits = word.strip_prefix('N').unwrap_or("");
    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}

/// The directive that declares the variables of a type.
fn directive_of(ty: &str) -> Option<&'static str> {
    Some(match ty {
        "BOOL" | "BIT" | "BOOLEAN" | "LOGIC" => "$LOGICAL",
        "INT" | "WORD" | "UINT" | "SINT" | "USINT" | "BYTE" | "SHORT" => "$INTEGER",
        "DINT" | "DWORD" | "UDINT" => "$LONG",
        _ => return None,
    })
}

/// A directive that does not exist.
pub(super) fn directive(word: &str) -> Option<Explanation> {
    let name = word.strip_prefix('$').unwrap_or(word);
    let help = match name {
        "VAR" | "VARIABLE" => "variables are declared after $LOGICAL, $INTEGER or $LONG".to_owned(),
        "REAL" | "FLOAT" | "LREAL" | "DOUBLE" => {
            "there are whole numbers only: use $INTEGER or $LONG and scale the values".to_owned()
        }
        "CONST" | "CONSTANT" | "DEFINE" => {
            "a constant is declared with its type: NAME = 5 after $INTEGER".to_owned()
        }
        "PROGRAM" | "LOGIC" | "MAIN" | "BEGIN" | "CODE" => "the logic begins after $END".to_owned(),
        _ => format!("write {}", directive_of(name)?),
    };
    Explanation::help(help)
}

/// A declaration with a type.
pub(super) fn declaration(place: &Place<'_, '_>) -> Option<Explanation> {
    let typed = (1..=3).find_map(|index| directive_of(place.word(index)));
    let first = place.word(0);
    if first == "VAR" {
        let help = "leave VAR out: a directive such as $INTEGER begins a list of variables";
        return Explanation::help(help);
    }
    let directive = typed.or_else(|| directive_of(first))?;
    let is_variable =
        |section| matches!(section, Section::Logical | Section::Integer | Section::Long);
    if place.section.is_some_and(is_variable) {
        return Explanation::help(format!(
            "leave the type out: the names after {directive} have it"
        ));
    }
    Explanation::help(format!("declare variables after {directive}, the name alone"))
}
