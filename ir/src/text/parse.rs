//! Reads a module from text.

use plcc_abi::{Region, Task};
use thiserror::Error;

use super::lex::{Line, unescaped};
use super::parse_func::FuncParser;
use crate::{Module, SourceFile, Statement};

/// Text that is no module.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{line}:{column}: {message}")]
pub struct ParseError {
    /// The line, from 1.
    pub line: usize,
    /// The column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
}

/// Reads a module. What is read has references that lead somewhere; whether it keeps the other
/// rules, the [verifier](crate::verify) says.
///
/// # Errors
/// At the first place that cannot be read.
pub fn parse(text: &str) -> Result<Module, ParseError> {
    let mut parser = Parser { module: Module::default(), named: vec![], in_text: false };
    let mut func: Option<FuncParser> = None;
    for (number, text) in (1..).zip(text.lines()) {
        if let Some(rest) = text.strip_prefix('|') {
            parser.file_line(number, rest)?;
            continue;
        }
        let mut line = Line::new(number, text)?;
        if line.is_done() {
            continue;
        }
        match func.take() {
            Some(mut open) => {
                if line.take('}') {
                    line.end()?;
                    let (data, named) = open.finish(line.place())?;
                    parser.module.funcs.push(data);
                    parser.named.extend(named);
                } else {
                    open.line(&mut line, &parser.module)?;
                    func = Some(open);
                }
            }
            None if line.take_word("fn") => {
                let name = line.quoted("the function's name in quotes")?;
                line.sign('{')?;
                line.end()?;
                func = Some(FuncParser::new(name, line.place()));
            }
            None => parser.item(&mut line)?,
        }
    }
    match func {
        Some(open) => Err(open.unclosed()),
        None => parser.finish(),
    }
}

struct Parser {
    module: Module,
    /// Labels that are named, with their places in the text.
    named: Vec<(u32, (usize, usize))>,
    /// Whether the file at hand has lines already.
    in_text: bool,
}

impl Parser {
    fn item(&mut self, line: &mut Line) -> Result<(), ParseError> {
        match line.word("`image`, `region`, `task`, `fn`, `statement` or `file`")?.as_str() {
            "image" => self.module.image_size = line.number("size in bytes")?,
            "region" => {
                let name = line.word("the region's name")?;
                line.keyword("at")?;
                let offset = line.number("offset in bytes")?;
                line.keyword("size")?;
                let size = line.number("size in bytes")?;
                let bits = line.take_word("bits");
                self.module.regions.push(Region { name, offset, size, bits });
            }
            "task" => {
                let name = line.quoted("the task's name in quotes")?;
                let place = line.place();
                let entry = line.reference("L", "a label")?;
                self.named.push((entry, place));
                self.module.tasks.push(Task { name, entry });
            }
            "statement" => {
                let mut field = |word| {
                    line.keyword(word)?;
                    line.number::<u32>("number")
                };
                let statement = Statement {
                    file: field("file")?,
                    line: field("line")?,
                    start: field("from")?,
                    end: field("to")?,
                };
                self.module.statements.push(statement);
            }
            "file" => {
                let name = line.quoted("the file's name in quotes")?;
                self.module.files.push(SourceFile { name, text: String::new() });
                self.in_text = false;
            }
            other => {
                return Err(line.error_before(format!(
                    "`{other}` begins nothing; `image`, `region`, `task`, `fn`, `statement` and \
                     `file` do"
                )));
            }
        }
        line.end()
    }

    /// A line of a file's text.
    fn file_line(&mut self, number: usize, rest: &str) -> Result<(), ParseError> {
        let error =
            |column, message: &str| ParseError { line: number, column, message: message.into() };
        let Some(file) = self.module.files.last_mut() else {
            return Err(error(1, "a line of text wants a `file` before it"));
        };
        let rest = rest.strip_prefix(' ').unwrap_or(rest);
        let text = unescaped(rest)
            .ok_or_else(|| error(2, "a backslash wants `\\`, `r` or `{hex}` behind it"))?;
        // Lines are joined by line feeds.
        if std::mem::replace(&mut self.in_text, true) {
            file.text.push('\n');
        }
        file.text.push_str(&text);
        Ok(())
    }

    fn finish(mut self) -> Result<Module, ParseError> {
        let count: usize = self.module.funcs.iter().map(|func| func.entries.len()).sum();
        for (label, (line, column)) in self.named {
            if label as usize >= count {
                let message = format!("L{label} stands nowhere: there are {count} labels, from L0");
                return Err(ParseError { line, column, message });
            }
        }
        self.module.label_count = count as u32;
        Ok(self.module)
    }
}
