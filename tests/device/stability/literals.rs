//! String literals of Rust code, for tests of what the program says.

/// String literals of code.
pub fn literals(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(at) = rest.find(['"', '/', '\'']) {
        let (before, tail) = rest.split_at(at);
        let length = match tail.as_bytes() {
            [b'/', b'/', ..] => tail.find('\n').unwrap_or(tail.len()),
            [b'\'', b'\\', _, b'\'', ..] => 4,
            [b'\'', _, b'\'', ..] => 3,
            [b'"', ..] => {
                let mut escaped = false;
                let end = match before.ends_with("r#") {
                    true => tail[1..].find("\"#"),
                    false => tail[1..].find(|c| {
                        let ends = c == '"' && !escaped;
                        escaped = c == '\\' && !escaped;
                        ends
                    }),
                };
                let end = end.map_or(tail.len(), |end| end + 1);
                found.push(&tail[1..end]);
                tail.len().min(end + 1)
            }
            _ => 1,
        };
        rest = &tail[length..];
    }
    found
}

/// Code before the tests in a file.
pub fn without_tests(text: &str) -> &str {
    let marks = text.match_indices("#[cfg(test)]\n");
    let mut tests = marks.map(|(at, mark)| (at, text[at + mark.len()..].lines().next()));
    let inline = |line: &str| line.contains("mod ") && line.ends_with('{');
    let tests = tests.find(|(_, line)| line.is_some_and(inline));
    &text[..tests.map_or(text.len(), |(at, _)| at)]
}
