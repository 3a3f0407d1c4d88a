//! The table `[project]`.

use toml::Spanned;

use super::super::Project;
use super::super::fault::{SiteError, Source};
use super::super::file::{DateKey, ProjectTable, Text};

/// The most characters that a title block has room for in one field.
const LONGEST: usize = 120;

pub(super) fn project(source: &Source, table: &ProjectTable) -> Result<Project, SiteError> {
    let field = |key: &Option<Text>| {
        key.as_ref().map_or(Ok(String::new()), |text| one_line(source, text.get_ref(), text.span()))
    };
    let date = match &table.date {
        None => String::new(),
        Some(date) => match date.get_ref() {
            DateKey::Toml(date) => date.to_string(),
            DateKey::Text(text) => one_line(source, text, Spanned::span(date))?,
        },
    };
    Ok(Project {
        title: field(&table.title)?,
        institution: field(&table.institution)?,
        author: field(&table.author)?,
        date,
        rights: field(&table.rights)?,
    })
}

fn one_line(source: &Source, text: &str, span: std::ops::Range<usize>) -> Result<String, SiteError> {
    let text = text.trim();
    if text.chars().any(char::is_control) || text.chars().count() > LONGEST {
        let expected = format!("expected one line of at most {LONGEST} characters");
        return Err(source.fault(span, expected, "Shorten it: a title block has little room"));
    }
    Ok(text.to_owned())
}
