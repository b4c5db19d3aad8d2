//! PLCopen XML: the same as [`structured_text`](crate::structured_text) in the form of TC6, version 2.01.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesCData, BytesDecl, Event};

use crate::project::{Function, Kind, Project, Type, Variable};
use crate::text::{interval, one_line};

type Xml = Writer<Vec<u8>>;

const NAMESPACE: &str = "http://www.plcopen.org/xml/tc6_0201";
const XHTML: &str = "http://www.w3.org/1999/xhtml";
/// The same project gives the same file, whenever it is written.
const TIME: &str = "2000-01-01T00:00:00";

/// A project as a file of PLCopen XML. `version` is that of the program that writes it.
///
/// # Errors
/// When there is no memory for it.
pub fn plcopen(project: &Project, version: &str) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(vec![], b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("utf-8"), None)))?;
    let namespaces = [("xmlns", NAMESPACE), ("xmlns:xhtml", XHTML)];
    element(&mut xml, "project", &namespaces, |xml| {
        let header = [
            ("companyName", "-"),
            ("productName", "plcc"),
            ("productVersion", version),
            ("creationDateTime", TIME),
        ];
        empty(xml, "fileHeader", &header)?;
        content_header(xml, project)?;
        types(xml, project)?;
        instances(xml, project)
    })?;
    let mut bytes = xml.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

/// An element with others in it.
fn element(
    xml: &mut Xml,
    name: &str,
    attributes: &[(&str, &str)],
    inner: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let element = xml.create_element(name).with_attributes(attributes.iter().copied());
    element.write_inner_content(inner).map(drop)
}

/// An element without any.
fn empty(xml: &mut Xml, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
    xml.create_element(name).with_attributes(attributes.iter().copied()).write_empty().map(drop)
}

fn content_header(xml: &mut Xml, project: &Project) -> io::Result<()> {
    element(xml, "contentHeader", &[("name", &project.name)], |xml| {
        element(xml, "coordinateInfo", &[], |xml| {
            ["fbd", "ld", "sfc"].into_iter().try_for_each(|language| {
                element(xml, language, &[], |xml| empty(xml, "scaling", &[("x", "1"), ("y", "1")]))
            })
        })
    })
}

fn types(xml: &mut Xml, project: &Project) -> io::Result<()> {
    element(xml, "types", &[], |xml| {
        empty(xml, "dataTypes", &[])?;
        element(xml, "pous", &[], |xml| {
            project.functions().into_iter().try_for_each(|it| function(xml, it))?;
            program(xml, project)
        })
    })
}

fn function(xml: &mut Xml, function: &Function) -> io::Result<()> {
    let variable = |&(name, ty): &(&str, Type)| Variable::local(name, ty, "");
    element(xml, "pou", &[("name", function.name), ("pouType", "function")], |xml| {
        element(xml, "interface", &[], |xml| {
            element(xml, "returnType", &[], |xml| empty(xml, function.returns.name(), &[]))?;
            let lists = [("inputVars", function.inputs), ("localVars", function.locals)];
            for (list, variables) in lists {
                let variables: Vec<Variable> = variables.iter().map(variable).collect();
                list_of(xml, list, &[], variables.iter())?;
            }
            Ok(())
        })?;
        body(xml, function.body.iter().copied())?;
        documentation(xml, function.comment)
    })
}

fn program(xml: &mut Xml, project: &Project) -> io::Result<()> {
    element(xml, "pou", &[("name", &project.name), ("pouType", "program")], |xml| {
        element(xml, "interface", &[], |xml| {
            for (kind, list, attributes) in [
                (Kind::Input, "inputVars", &[][..]),
                (Kind::Local, "localVars", &[]),
                (Kind::Retained, "localVars", &[("retain", "true")]),
                (Kind::Constant, "localVars", &[("constant", "true")]),
            ] {
                let variables = project.variables.iter().filter(|it| it.kind == kind);
                list_of(xml, list, attributes, variables)?;
            }
            Ok(())
        })?;
        body(xml, project.body.iter().map(String::as_str))?;
        documentation(xml, &project.comments.join("\n"))
    })
}

fn list_of<'v>(
    xml: &mut Xml,
    list: &str,
    attributes: &[(&str, &str)],
    variables: impl Iterator<Item = &'v Variable>,
) -> io::Result<()> {
    let mut variables = variables.peekable();
    if variables.peek().is_none() {
        return Ok(());
    }
    element(xml, list, attributes, |xml| variables.try_for_each(|it| variable(xml, it)))
}

fn variable(xml: &mut Xml, variable: &Variable) -> io::Result<()> {
    let mut attributes = vec![("name", variable.name.as_str())];
    attributes.extend(variable.address.iter().map(|place| ("address", place.as_str())));
    element(xml, "variable", &attributes, |xml| {
        element(xml, "type", &[], |xml| match variable.elements {
            None => empty(xml, variable.ty.name(), &[]),
            Some(count) => element(xml, "array", &[], |xml| {
                let upper = count.saturating_sub(1).to_string();
                empty(xml, "dimension", &[("lower", "0"), ("upper", &upper)])?;
                element(xml, "baseType", &[], |xml| empty(xml, variable.ty.name(), &[]))
            }),
        })?;
        if !variable.initial.is_empty() {
            element(xml, "initialValue", &[], |xml| {
                match (variable.elements, &variable.initial[..]) {
                    (None, [value, ..]) => simple_value(xml, value),
                    (_, values) => element(xml, "arrayValue", &[], |xml| {
                        values.iter().try_for_each(|value| {
                            element(xml, "value", &[], |xml| simple_value(xml, value))
                        })
                    }),
                }
            })?;
        }
        documentation(xml, &variable.comment)
    })
}

fn simple_value(xml: &mut Xml, value: &str) -> io::Result<()> {
    empty(xml, "simpleValue", &[("value", value)])
}

/// A text in an element of XHTML, as all texts of the form are.
fn formatted(xml: &mut Xml, text: &str) -> io::Result<()> {
    element(xml, "xhtml:p", &[], |xml| {
        BytesCData::escaped(text).try_for_each(|part| xml.write_event(Event::CData(part)))
    })
}

fn documentation(xml: &mut Xml, text: &str) -> io::Result<()> {
    if text.is_empty() {
        return Ok(());
    }
    // Characters that XML does not have can't be in a text of it.
    element(xml, "documentation", &[], |xml| formatted(xml, &one_line(text)))
}

fn body<'l>(xml: &mut Xml, lines: impl Iterator<Item = &'l str>) -> io::Result<()> {
    let text = lines.collect::<Vec<_>>().join("\n");
    element(xml, "body", &[], |xml| element(xml, "ST", &[], |xml| formatted(xml, &text)))
}

fn instances(xml: &mut Xml, project: &Project) -> io::Result<()> {
    let time = interval(project);
    element(xml, "instances", &[], |xml| {
        element(xml, "configurations", &[], |xml| {
            element(xml, "configuration", &[("name", "PLANT")], |xml| {
                element(xml, "resource", &[("name", "CONTROL")], |xml| {
                    let task = [("name", "SCAN"), ("interval", &*time), ("priority", "1")];
                    element(xml, "task", &task, |xml| {
                        empty(xml, "pouInstance", &[("name", "MAIN"), ("typeName", &project.name)])
                    })
                })
            })
        })
    })
}
