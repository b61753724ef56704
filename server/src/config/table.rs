//! Every setting for people, from the same source that reads them.

use std::fmt::Write as _;

use clap::CommandFactory as _;

use super::CommandLine;

/// The settings as a table in Markdown: on the command line, in the environment, the default, and what it is. In a file a setting has the name of
/// the command line without the dashes in front.
pub fn settings() -> String {
    let mut text = String::from("| setting | environment | default | what it is |\n|---|---|---|---|\n");
    let command = CommandLine::command();
    for argument in command.get_arguments() {
        let (Some(long), Some(env)) = (argument.get_long(), argument.get_env()) else { continue };
        let value = argument.get_value_names().and_then(|names| names.first()).map_or("", |name| name.as_str());
        let default: Vec<_> = argument.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
        let default = if default.is_empty() { String::new() } else { format!("`{}`", default.join(",")) };
        let what = argument.get_help().map(ToString::to_string).unwrap_or_default().replace('\n', " ");
        // Writing to a string does not fail.
        let _ = writeln!(text, "| `--{long} {value}` | `{}` | {default} | {what} |", env.to_string_lossy());
    }
    text
}
