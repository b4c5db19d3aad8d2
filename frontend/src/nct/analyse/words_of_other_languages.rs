//! Words of other languages, and what NCT has in their place.

/// What NCT writes in place of a word of another language; `None` for any other word. `before` and
/// `behind` are the text around it on its line. Since NCT's statements are single letters that may
/// stand without blanks between them, only a word that stands alone counts.
pub(super) fn word_of_other_language(word: &str, before: &str, behind: &str) -> Option<String> {
    // ST50 stores to a timer, LD0 begins with a letter too many.
    if word.len() <= 2 && behind.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let first = before.trim().is_empty();
    let inside = before.contains('(');
    Some(match word {
        "AND" | "ANDN" | "ANI" | "AN" if inside => "AND is written A: (I001 A I002)".into(),
        "OR" | "ORN" | "ORI" if inside => "OR is written O: (I001 O I002)".into(),
        "XOR" if inside => "the exclusive OR is written X: (I001 X I002)".into(),
        "AND" | "ANDN" | "ANI" | "OR" | "ORN" | "ORI" | "XOR" | "XORN" => {
            "conditions are joined in parentheses: (I001 A I002 O NI003) U012 Z".into()
        }
        "A" | "AN" | "O" | "ON" | "UN" if first && behind.starts_with(' ') => {
            "conditions are joined in parentheses, and the statements after them run where they \
             hold: (I001 A I002 O NI003) U012 Z"
                .into()
        }
        "NOT" => "NOT is written N: NI001".into(),
        "LD" | "LDN" | "LDI" | "STR" => {
            "I001 begins a condition that Z ends: I001 U012 Z; LI001 loads a bit into register OP"
                .into()
        }
        "ST" | "STN" | "OUT" | "MOV" | "MOVE" => {
            "load and store: LI00 SY40; a condition switches an output: I001 U012 E D012 Z".into()
        }
        "SET" | "RST" | "RES" | "RESET" => "U012 sets output Y012, D012 resets it".into(),
        "IF" | "THEN" | "ENDIF" | "END_IF" | "ELSIF" | "ELSEIF" | "ELSE" => {
            "a condition, the statements where it holds, E, the others, Z: I001 U012 E D012 Z"
                .into()
        }
        "WHILE" | "DO" | "FOR" | "REPEAT" | "UNTIL" | "NEXT" | "ENDWHILE" | "END_WHILE" => {
            "there are no loops: the module runs in each slice; G and a label jump: G010".into()
        }
        "CASE" | "SWITCH" => "compare register OP: LQ05 =1 … Z =2 … Z".into(),
        "GOTO" | "JMP" | "JMPC" | "JUMP" | "SPA" | "SPB" | "JU" | "JC" => {
            "a jump is written G and a label of three digits: G010".into()
        }
        "CALL" | "CAL" | "GOSUB" => "a call is written C and a label of three digits: C010".into(),
        "RET" | "RETURN" | "RTN" => "R returns from a subroutine".into(),
        "END" | "BE" | "PE" => "a module ends with J0, J1 or J2".into(),
        "CTU" | "INC" => "UQ05 adds 1 to counter Q05".into(),
        "CTD" | "DEC" => "DQ05 subtracts 1 from counter Q05".into(),
        "TON" | "TOF" | "TP" | "TMR" | "TIM" => {
            "store the time to start a timer, ,50 ST00; T00 is on while it runs".into()
        }
        "TRUE" | "FALSE" => "U012 switches on, D012 off; a constant is ,1 or ,0".into(),
        "VAR" | "INT" | "BOOL" | "END_VAR" => {
            "nothing is declared: flags are F0000 to F9997, words F000 to F998".into()
        }
        _ => return None,
    })
}
