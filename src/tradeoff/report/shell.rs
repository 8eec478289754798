//! Command lines to read and to copy.

/// The program with these arguments, quoted for a POSIX shell.
pub fn shell_line(arguments: &[String]) -> String {
    let mut line = String::from("gs-chroma");
    for argument in arguments {
        line.push(' ');
        line.push_str(&quoted(argument));
    }
    line
}

/// In single quotes where the shell would see more than a word.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    match !argument.is_empty() && argument.chars().all(plain) {
        true => argument.to_owned(),
        false => format!("'{}'", argument.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_needs_quotes_has_them() {
        let words = ["fit", "/a b/c", "--max-side", "400", "", "it's", "$HOME;&*"];
        assert_eq!(
            shell_line(&words.map(str::to_owned)),
            r"gs-chroma fit '/a b/c' --max-side 400 '' 'it'\''s' '$HOME;&*'"
        );
    }

    /// What the shell itself makes of it.
    #[cfg(unix)]
    #[test]
    fn a_shell_reads_the_same_arguments() {
        let words = [
            "fit",
            "/a b/ü",
            "it's",
            "\"$HOME\" `id`",
            "\\",
            "a\nb",
            "",
            "*",
        ];
        let words = words.map(str::to_owned);
        let line = shell_line(&words).replacen("gs-chroma", r"printf '%s|'", 1);
        let done = std::process::Command::new("sh")
            .arg("-c")
            .arg(line)
            .output();
        let printed = String::from_utf8(done.expect("a shell").stdout).expect("text");
        assert_eq!(printed, words.map(|word| word + "|").concat());
    }
}
