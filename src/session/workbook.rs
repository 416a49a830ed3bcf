//! Workbooks (.xlsx): the cells of a sheet as the text of a table, row 5 of the sheet on line 5.
//!
//! A workbook is a ZIP archive of XML parts (ECMA-376, parts 1 and 2). Only what a table of numbers needs is read: values as they are
//! stored, not as they are formatted. Sizes are limited before anything is unpacked.

mod archive;

use std::collections::BTreeMap;

use roxmltree::{Document, Node, ParsingOptions};

use super::table::{Defect, TableErrors};
use crate::text::printable;
use archive::Archive;

/// Most elements of a part: a table of 250,000 cells.
const MOST_NODES: u32 = 3_000_000;
/// Last row that is read.
const LAST_ROW: usize = 250_000;
/// Last column that is read.
const LAST_COLUMN: usize = 1000;

/// Whether a file is a workbook, or at least a ZIP archive.
pub fn is_workbook(content: &[u8]) -> bool {
    content.starts_with(b"PK\x03\x04")
}

/// The text of a sheet: cells between tabs. Without `sheet`, the only one that has cells.
///
/// # Errors
/// No workbook, or not clear which sheet.
pub fn sheet_text(content: &[u8], file: &str, sheet: Option<&str>) -> Result<String, TableErrors> {
    read(content, sheet)
        .map_err(|reason| TableErrors::new(file, vec![Defect::BadWorkbook { reason }.of_table()], Vec::new()))
}

fn read(content: &[u8], wanted: Option<&str>) -> Result<String, String> {
    let archive = Archive::new(content)?;
    let sheets = sheets(&archive)?;
    let shared = match archive.part("xl/sharedStrings.xml")? {
        Some(part) => shared_strings(&xml(&part, "xl/sharedStrings.xml")?),
        None => Vec::new(),
    };
    let known: Vec<String> = sheets.iter().map(|(name, _)| format!("'{}'", printable(name))).collect();
    if let Some(wanted) = wanted {
        let part = sheets.iter().find(|(name, _)| name == wanted).map(|(_, part)| part);
        let part =
            part.ok_or_else(|| format!("it has no sheet '{}'; sheets: {}", printable(wanted), known.join(", ")))?;
        return text_of(&archive, part, &shared);
    }
    let mut filled = Vec::new();
    for (name, part) in &sheets {
        let text = text_of(&archive, part, &shared)?;
        if !text.trim().is_empty() {
            filled.push((name, text));
        }
    }
    match filled.len() {
        0 => Err("no sheet has cells".to_owned()),
        1 => Ok(filled.pop().map(|(_, text)| text).unwrap_or_default()),
        _ => {
            let names: Vec<String> = filled.iter().map(|(name, _)| format!("'{}'", printable(name))).collect();
            Err(format!("it has several sheets with cells ({}); say which one", names.join(", ")))
        }
    }
}

/// The parsed text of a part.
fn xml<'a>(text: &'a str, part: &str) -> Result<Document<'a>, String> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| format!("'{part}' is damaged: {error}"))
}

/// Names of the sheets with their parts.
fn sheets(archive: &Archive<'_>) -> Result<Vec<(String, String)>, String> {
    let required = |name: &str| -> Result<String, String> {
        archive.part(name)?.ok_or_else(|| format!("it is no workbook: '{name}' is missing"))
    };
    let (book, links) = (required("xl/workbook.xml")?, required("xl/_rels/workbook.xml.rels")?);
    let (book, links) = (xml(&book, "xl/workbook.xml")?, xml(&links, "xl/_rels/workbook.xml.rels")?);
    let targets: BTreeMap<&str, &str> = links
        .root_element()
        .children()
        .filter_map(|link| Some((link.attribute("Id")?, link.attribute("Target")?)))
        .collect();
    let named = |node: Node<'_, '_>| {
        let id = node.attributes().find(|attribute| attribute.name() == "id" && attribute.namespace().is_some())?;
        let target = targets.get(id.value())?;
        let part = target.strip_prefix('/').map_or_else(|| format!("xl/{target}"), str::to_owned);
        Some((node.attribute("name")?.to_owned(), part))
    };
    Ok(book.descendants().filter(|node| node.has_tag_name_of("sheet")).filter_map(named).collect())
}

/// The strings that cells refer to by number.
fn shared_strings(document: &Document<'_>) -> Vec<String> {
    document.root_element().children().filter(|node| node.has_tag_name_of("si")).map(text_within).collect()
}

/// The text of all runs of an element, without phonetic guides.
fn text_within(node: Node<'_, '_>) -> String {
    let is_text =
        |node: &Node<'_, '_>| node.has_tag_name_of("t") && !node.ancestors().any(|above| above.has_tag_name_of("rPh"));
    node.descendants().filter(is_text).filter_map(|node| node.text()).collect()
}

/// Tag names without their namespaces, of which there are two for the same elements.
trait LocalName {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl LocalName for Node<'_, '_> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

fn text_of(archive: &Archive<'_>, part: &str, shared: &[String]) -> Result<String, String> {
    let text = archive.part(part)?.ok_or_else(|| format!("'{}' is missing", printable(part)))?;
    let document = xml(&text, part)?;
    let mut rows: BTreeMap<usize, BTreeMap<usize, String>> = BTreeMap::new();
    let mut row = 0;
    for node in document.descendants().filter(|node| node.has_tag_name_of("row")) {
        row = number(node.attribute("r")).unwrap_or(row + 1);
        let mut column = 0;
        for cell in node.children().filter(|cell| cell.has_tag_name_of("c")) {
            column = cell.attribute("r").and_then(column_of).unwrap_or(column + 1);
            if row == 0 || row > LAST_ROW || column > LAST_COLUMN {
                return Err(format!(
                    "a cell is in row {row}, column {column}; at most {LAST_ROW} rows and {LAST_COLUMN} columns are read"
                ));
            }
            let value = value_of(cell, shared)?;
            if !value.is_empty() {
                rows.entry(row).or_default().insert(column, value);
            }
        }
    }
    let mut written = String::new();
    let mut line = 1;
    for (row, cells) in &rows {
        while line < *row {
            written.push('\n');
            line += 1;
        }
        let last = cells.keys().next_back().copied().unwrap_or_default();
        let empty = String::new();
        let cells: Vec<&str> = (1..=last).map(|column| cells.get(&column).unwrap_or(&empty).as_str()).collect();
        // A row of a single cell would show no separator.
        written.push_str(&cells.join("\t"));
    }
    written.push('\n');
    Ok(written)
}

/// What a cell holds, on one line.
fn value_of(cell: Node<'_, '_>, shared: &[String]) -> Result<String, String> {
    let value =
        || cell.children().find(|node| node.has_tag_name_of("v")).and_then(|node| node.text()).unwrap_or_default();
    let text = match cell.attribute("t") {
        Some("s") => {
            let place = number(Some(value())).ok_or("a cell refers to no text")?;
            shared.get(place).ok_or("a cell refers to a text that is missing")?.clone()
        }
        Some("inlineStr") => text_within(cell),
        _ => value().to_owned(),
    };
    let on_one_line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let trimmed = on_one_line.trim();
    Ok(if trimmed.starts_with('"') { format!("\"{}\"", trimmed.replace('"', "\"\"")) } else { trimmed.to_owned() })
}

fn number(text: Option<&str>) -> Option<usize> {
    text?.trim().parse().ok()
}

/// The column of a cell such as `AB12`, from 1.
fn column_of(cell: &str) -> Option<usize> {
    let letters = cell.bytes().take_while(u8::is_ascii_uppercase).take(4);
    let column = letters.fold(0, |column, letter| column * 26 + usize::from(letter - b'A') + 1);
    (column > 0).then_some(column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_counted_in_letters() {
        assert_eq!(["A1", "Z9", "AA10", "AB3"].map(column_of), [Some(1), Some(26), Some(27), Some(28)]);
        assert_eq!(column_of("12"), None);
    }
}
