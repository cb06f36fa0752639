//! The commands that README.md promises.

/// The lines of README.md that begin with `cargo xtask`, as words, each once; in shell blocks and blocks without language.
pub(crate) fn xtask_commands(readme: &str) -> Vec<Vec<String>> {
    let mut commands: Vec<Vec<String>> = vec![];
    // The language of the block that we are in.
    let mut block: Option<&str> = None;
    for line in readme.lines().map(str::trim) {
        if let Some(language) = line.strip_prefix("```") {
            block = if block.is_some() { None } else { Some(language) };
            continue;
        }
        let in_shell = block.is_some_and(|language| ["", "sh", "bash", "console", "shell"].contains(&language));
        let line = line.trim_start_matches("$ ").split('#').next().unwrap_or_default();
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        if in_shell && words.starts_with(&["cargo".to_owned(), "xtask".to_owned()]) && !commands.contains(&words) {
            commands.push(words);
        }
    }
    commands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_shell_examples_count() {
        let text = "cargo xtask no\n```rust\ncargo xtask no\n```\n```sh\n$ cargo xtask compare  # look\ncargo build\n```\n\
                    ```toml\ncargo xtask no\n```\n```\ncargo xtask ci\n```\n```console\ncargo xtask compare\ncargo xtask test\n```\n";
        let lines: Vec<String> = xtask_commands(text).iter().map(|c| c.join(" ")).collect();
        assert_eq!(lines, ["cargo xtask compare", "cargo xtask ci", "cargo xtask test"]);
    }
}
