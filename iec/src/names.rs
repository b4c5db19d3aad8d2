//! Identifiers: letters, digits and single underscores, whatever the case of the letters, and no word of the standard
//! (IEC 61131-3, 6.1.2).

use std::collections::BTreeSet;

use crate::functions;

/// Words that compilers of the standard do not take as names of variables: keywords, types, and what functions and function
/// blocks of the standard are called.
const RESERVED: &str = "
    ABS ACOS ACTION ADD AND ANY ARRAY ASIN AT ATAN ATAN2 BCD_TO_DINT BCD_TO_INT BOOL BY BYTE CAL CALC CALCN CASE CHAR CLASS CONCAT
    CONFIGURATION CONSTANT CONTINUE COS CTD CTU CTUD D DATE DATE_AND_TIME DELETE DINT DIV DO DT DWORD EDGE ELSE ELSIF EN END_ACTION
    END_CASE END_CONFIGURATION END_FOR END_FUNCTION END_FUNCTION_BLOCK END_IF END_PROGRAM END_REPEAT END_RESOURCE END_STEP
    END_STRUCT END_TRANSITION END_TYPE END_VAR END_WHILE ENO EQ EXIT EXP EXPT FALSE FIND FOR FROM FUNCTION FUNCTION_BLOCK F_EDGE
    F_TRIG GE GT IF INITIAL_STEP INSERT INT INTERFACE INTERVAL JMP JMPC JMPCN L LD LDN LE LEFT LEN LIMIT LINT LN LOG LREAL LT LWORD
    MAX METHOD MID MIN MOD MOVE MUL MUX N NAMESPACE NE NEG NIL NON_RETAIN NOT NULL OF ON OR ORN OVERRIDE P PRAGMA PRIORITY PROGRAM
    PUBLIC PRIVATE PROTECTED R R1 READ_ONLY READ_WRITE REAL REF REF_TO REPEAT REPLACE RESOURCE RET RETAIN RETC RETCN RETURN RIGHT
    ROL ROR RS RTC R_EDGE R_TRIG S S1 SEL SEMA SHL SHR SIN SINGLE SINT SQRT SR ST STEP STN STRING STRUCT SUB SUPER TAN TASK THEN
    THIS TIME TIME_OF_DAY TO TOD TOF TON TP TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNTIL USINT USING VAR VAR_ACCESS VAR_CONFIG
    VAR_EXTERNAL VAR_GLOBAL VAR_INPUT VAR_IN_OUT VAR_OUTPUT VAR_TEMP WCHAR WHILE WITH WORD WSTRING XOR XORN
    BIT BITS DERIVATIVE HYSTERESIS INTEGRAL PID RAMP CD CU CV CS DS ET FB IN PT PV Q Q1 QD QU CLK LDT TMR
";

/// Makes identifiers, each once.
#[derive(Debug)]
pub struct Names {
    taken: BTreeSet<String>,
}

impl Default for Names {
    fn default() -> Self {
        Self::new()
    }
}

impl Names {
    /// No name has been given yet but that of the variable of [`NOTHING`](crate::NOTHING).
    pub fn new() -> Self {
        Self { taken: BTreeSet::from(["NOTHING".to_owned()]) }
    }

    /// An identifier that is as like a name as can be: what is not a letter or a digit becomes an underscore. A word of the
    /// standard, a name that begins with a digit, and one that was given before, get something after or in front.
    pub fn make(&mut self, name: &str) -> String {
        let mut made = String::new();
        for c in name.chars() {
            if c.is_ascii_alphanumeric() {
                made.push(c.to_ascii_uppercase());
            } else if !made.is_empty() && !made.ends_with('_') {
                made.push('_');
            }
        }
        while made.ends_with('_') {
            made.pop();
        }
        if !made.starts_with(|c: char| c.is_ascii_alphabetic()) {
            made.insert(0, 'V');
        }
        let is_word = RESERVED.split_whitespace().any(|word| word == made)
            || functions::all().any(|function| function.name == made)
            || made.contains("_TO_");
        let first = if is_word { format!("{made}_V") } else { made.clone() };
        let more = (2..).map(|n: u32| format!("{made}_V{n}"));
        let free = std::iter::once(first).chain(more).find(|name| !self.taken.contains(name));
        let free = free.unwrap_or(made);
        self.taken.insert(free.clone());
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_identifiers_that_differ() {
        let mut names = Names::new();
        for (name, made) in [
            ("LS27", "LS27"),
            ("ls27", "LS27_V2"),
            ("S", "S_V"),
            ("S_V", "S_V_V2"),
            ("@FRO", "FRO"),
            ("X:$0700", "X_0700"),
            ("2ND", "V2ND"),
            ("A__B_", "A_B"),
            ("INTEGER_ADD", "INTEGER_ADD_V"),
            ("INT_TO_BOOL", "INT_TO_BOOL_V"),
            ("?", "V"),
        ] {
            assert_eq!(names.make(name), made, "{name}");
        }
    }
}
