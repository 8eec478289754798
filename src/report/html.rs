//! Parts that all pages share.

use std::fmt::Write;

use super::table::Table;

/// The look of every page.
const STYLE: &str = include_str!("style.css");

/// Content security policy: a page shows itself, and the pictures and films beside it.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' file: data:; media-src 'self' file:; base-uri 'none'; form-action 'none'";

/// The end of every page.
pub(crate) const TAIL: &str = "</main></body></html>\n";

/// A page up to where its contents begin.
pub(crate) fn head(title: &str) -> String {
    format!(
        r#"<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{}</title>
<style>
{STYLE}</style>
</head>
<body><main>
"#,
        escaped(title)
    )
}

/// Text that HTML takes for text.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A table under its title.
pub(crate) fn push_table(html: &mut String, table: &Table) {
    let _ = write!(
        html,
        "<h2>{}</h2>\n<div class=\"scroll\"><table>\n<thead><tr>",
        escaped(&table.title)
    );
    for cell in &table.head {
        let _ = write!(html, "<th>{}</th>", escaped(cell));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        html.push_str("<tr>");
        for cell in row {
            let _ = write!(html, "<td>{}</td>", escaped(cell));
        }
        html.push_str("</tr>\n");
    }
    let notes: Vec<String> = table.notes.iter().map(|note| escaped(note)).collect();
    let _ = write!(
        html,
        "</tbody></table></div>\n<p class=\"note\">{}</p>\n",
        notes.join("<br>\n")
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_the_page() {
        assert_eq!(escaped("<a \"&\">"), "&lt;a &quot;&amp;&quot;&gt;");
        assert!(head("<b>").contains("<title>&lt;b&gt;</title>"));
        assert!(head("").contains("default-src 'none'"));
    }
}
