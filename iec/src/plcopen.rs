//! PLCopen XML: the same as [`structured_text`](crate::structured_text) in the form of TC6, version 2.01.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesCData, BytesDecl, Event};

use crate::project::{Function, Kind, Project, Type, Variable};
use crate::text::{comment, interval};

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
    let root = xml
        .create_element("project")
        .with_attributes([("xmlns", NAMESPACE), ("xmlns:xhtml", XHTML)]);
    root.write_inner_content(|xml| {
        xml.create_element("fileHeader")
            .with_attributes([
                ("companyName", "-"),
                ("productName", "plcc"),
                ("productVersion", version),
                ("creationDateTime", TIME),
            ])
            .write_empty()?;
        content_header(xml, project)?;
        types(xml, project)?;
        instances(xml, project)
    })?;
    let mut bytes = xml.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn content_header(xml: &mut Xml, project: &Project) -> io::Result<()> {
    let header = xml.create_element("contentHeader").with_attribute(("name", &*project.name));
    header.write_inner_content(|xml| {
        let information = xml.create_element("coordinateInfo");
        information.write_inner_content(|xml| {
            for language in ["fbd", "ld", "sfc"] {
                xml.create_element(language).write_inner_content(|xml| {
                    let scaling = xml.create_element("scaling");
                    scaling.with_attributes([("x", "1"), ("y", "1")]).write_empty().map(drop)
                })?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}

fn types(xml: &mut Xml, project: &Project) -> io::Result<()> {
    xml.create_element("types").write_inner_content(|xml| {
        xml.create_element("dataTypes").write_empty()?;
        xml.create_element("pous").write_inner_content(|xml| {
            project.functions().into_iter().try_for_each(|it| function(xml, it))?;
            program(xml, project)
        })?;
        Ok(())
    })?;
    Ok(())
}

fn function(xml: &mut Xml, function: &Function) -> io::Result<()> {
    let variable = |&(name, ty): &(&str, Type)| Variable::local(name, ty, "");
    let pou = xml.create_element("pou");
    let pou = pou.with_attributes([("name", function.name), ("pouType", "function")]);
    pou.write_inner_content(|xml| {
        xml.create_element("interface").write_inner_content(|xml| {
            let returns = xml.create_element("returnType");
            returns.write_inner_content(|xml| simple_type(xml, function.returns))?;
            let lists = [("inputVars", function.inputs), ("localVars", function.locals)];
            for (list, variables) in lists {
                let variables: Vec<Variable> = variables.iter().map(variable).collect();
                list_of(xml, list, &[], variables.iter())?;
            }
            Ok(())
        })?;
        let lines = function.body.iter().copied();
        body(xml, lines)?;
        documentation(xml, function.comment)
    })?;
    Ok(())
}

fn program(xml: &mut Xml, project: &Project) -> io::Result<()> {
    let pou = xml.create_element("pou");
    let pou = pou.with_attributes([("name", &*project.name), ("pouType", "program")]);
    pou.write_inner_content(|xml| {
        xml.create_element("interface").write_inner_content(|xml| {
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
    })?;
    Ok(())
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
    let list = xml.create_element(list).with_attributes(attributes.iter().copied());
    list.write_inner_content(|xml| variables.try_for_each(|it| variable(xml, it)))?;
    Ok(())
}

fn variable(xml: &mut Xml, variable: &Variable) -> io::Result<()> {
    let element = xml.create_element("variable").with_attribute(("name", &*variable.name));
    let address = variable.address.iter().map(|place| ("address", place.as_str()));
    element.with_attributes(address).write_inner_content(|xml| {
        xml.create_element("type").write_inner_content(|xml| match variable.elements {
            None => simple_type(xml, variable.ty),
            Some(count) => {
                xml.create_element("array").write_inner_content(|xml| {
                    let upper = count.saturating_sub(1).to_string();
                    let dimension = xml.create_element("dimension");
                    dimension
                        .with_attributes([("lower", "0"), ("upper", &*upper)])
                        .write_empty()?;
                    let base = xml.create_element("baseType");
                    base.write_inner_content(|xml| simple_type(xml, variable.ty)).map(drop)
                })?;
                Ok(())
            }
        })?;
        if !variable.initial.is_empty() {
            let initial = xml.create_element("initialValue");
            initial.write_inner_content(|xml| {
                match (variable.elements, &variable.initial[..]) {
                    (None, [value, ..]) => simple_value(xml, value),
                    (_, values) => {
                        xml.create_element("arrayValue").write_inner_content(|xml| {
                            values.iter().try_for_each(|value| {
                                let element = xml.create_element("value");
                                element
                                    .write_inner_content(|xml| simple_value(xml, value))
                                    .map(drop)
                            })
                        })?;
                        Ok(())
                    }
                }
            })?;
        }
        documentation(xml, &variable.comment)
    })?;
    Ok(())
}

fn simple_type(xml: &mut Xml, ty: Type) -> io::Result<()> {
    xml.create_element(ty.name()).write_empty().map(drop)
}

fn simple_value(xml: &mut Xml, value: &str) -> io::Result<()> {
    xml.create_element("simpleValue").with_attribute(("value", value)).write_empty().map(drop)
}

/// A text in an element of XHTML, as all texts of the form are.
fn formatted(xml: &mut Xml, text: &str) -> io::Result<()> {
    xml.create_element("xhtml:p").write_inner_content(|xml| {
        BytesCData::escaped(text).try_for_each(|part| xml.write_event(Event::CData(part)))
    })?;
    Ok(())
}

fn documentation(xml: &mut Xml, text: &str) -> io::Result<()> {
    if text.is_empty() {
        return Ok(());
    }
    // Characters that XML does not have can't be in a text of it.
    let text = comment(text);
    let text = text.trim_start_matches("(* ").trim_end_matches(" *)");
    xml.create_element("documentation").write_inner_content(|xml| formatted(xml, text)).map(drop)
}

fn body<'l>(xml: &mut Xml, lines: impl Iterator<Item = &'l str>) -> io::Result<()> {
    let text = lines.collect::<Vec<_>>().join("\n");
    xml.create_element("body").write_inner_content(|xml| {
        xml.create_element("ST").write_inner_content(|xml| formatted(xml, &text)).map(drop)
    })?;
    Ok(())
}

fn instances(xml: &mut Xml, project: &Project) -> io::Result<()> {
    xml.create_element("instances").write_inner_content(|xml| {
        xml.create_element("configurations").write_inner_content(|xml| {
            let configuration = xml.create_element("configuration");
            configuration.with_attribute(("name", "PLANT")).write_inner_content(|xml| {
                let resource = xml.create_element("resource").with_attribute(("name", "CONTROL"));
                resource.write_inner_content(|xml| {
                    let time = interval(project);
                    let task = xml.create_element("task").with_attributes([
                        ("name", "SCAN"),
                        ("interval", &*time),
                        ("priority", "1"),
                    ]);
                    task.write_inner_content(|xml| {
                        let instance = xml.create_element("pouInstance");
                        instance
                            .with_attributes([("name", "MAIN"), ("typeName", &*project.name)])
                            .write_empty()
                            .map(drop)
                    })?;
                    Ok(())
                })?;
                Ok(())
            })?;
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}
